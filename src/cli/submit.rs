//! `asperity submit`: share a study out among the nodes of a Slurm cluster.

use std::env;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::Failure;
use super::plan::core_hours;
use super::terminal::stdout;
use crate::session::DataFolder;
use crate::session::submission::Submission;
use crate::session::submission::settings;
use crate::session::submission::settings::Settings;
use crate::session::words::counted;
use crate::session::words::listed;
use crate::session::{PlannedSubmission, SubmitOptions};

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest.
    manifest: PathBuf,

    /// Print the scripts, and what they are expected to take; write and submit nothing.
    #[arg(long)]
    dry_run: bool,

    /// Write the page of figures in the end, too.
    #[arg(long)]
    report: bool,

    /// Take the place of another manifest whose study has the same name, even if tables of it are
    /// lost.
    #[arg(long)]
    replace: bool,

    /// The program that the nodes run; this one when left out.
    #[arg(long, value_name = "PATH")]
    program: Option<PathBuf>,

    #[command(flatten)]
    cluster: Settings,
}

/// `own` is what starts this program, where that is not the file of the process.
pub fn run(
    arguments: &Arguments,
    data: &DataFolder,
    own: Option<&Path>,
) -> Result<ExitCode, Failure> {
    let session = super::session(&arguments.manifest, data);
    let program = match arguments.program.as_deref().or(own) {
        Some(program) => program.to_owned(),
        None => env::current_exe()?,
    };
    let planned = session.plan_submission(&SubmitOptions {
        settings: arguments.settings()?,
        program,
        report: arguments.report,
        replace: arguments.replace,
    })?;
    let mut out = stdout();
    if planned.missing == 0 {
        writeln!(
            out,
            "nothing to submit: every table is in the store; `asperity run` writes those of the stages"
        )?;
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.dry_run {
        let scripts = &planned.scripts;
        for (path, text) in [
            (Submission::element_script(&planned.folder), &scripts.element),
            (Submission::finish_script(&planned.folder), &scripts.finish),
        ] {
            writeln!(out, "==> {} <==\n{text}", path.display())?;
        }
        write!(out, "{}", expected(&planned))?;
        return Ok(ExitCode::SUCCESS);
    }
    let submission = session.submit(&planned)?;
    write!(out, "{}{}", expected(&planned), submitted(&planned, &submission, &arguments.manifest))?;
    Ok(ExitCode::SUCCESS)
}

impl Arguments {
    /// What the command line says; else the file beside the manifest, and else that of the user.
    fn settings(&self) -> Result<Settings, Failure> {
        let mut settings = self.cluster.clone();
        let beside = self.manifest.parent().map(|folder| folder.join(settings::FILE));
        for path in beside.into_iter().chain(of_user()) {
            let read = Settings::read(&path).map_err(crate::session::SessionError::from)?;
            settings = settings.or(read.unwrap_or_default());
        }
        Ok(settings)
    }
}

/// Where the user's configuration is, as the XDG Base Directory Specification has it.
fn of_user() -> Option<PathBuf> {
    let named = env::var_os("XDG_CONFIG_HOME").filter(|folder| Path::new(folder).is_absolute());
    let folder = named.map(PathBuf::from).or_else(|| Some(env::home_dir()?.join(".config")));
    Some(folder?.join("asperity").join(settings::FILE))
}

/// What a submission is expected to take, in a few lines.
fn expected(planned: &PlannedSubmission) -> String {
    let sizing = &planned.sizing;
    let elements = sizing.hours.len();
    let each = match elements {
        0 => "nothing is left for elements".to_owned(),
        _ => format!(
            "{} of {}, at most {} each; Slurm ends one after {}",
            counted(elements, "element"),
            counted(sizing.cores as usize, "core"),
            in_hours(sizing.longest()),
            in_hours(f64::from(sizing.minutes) / 60.0),
        ),
    };
    let total = core_hours(3600.0 * (sizing.core_hours + sizing.core_hours_after));
    let paced = match planned.processors.as_slice() {
        [] => "at the pace of this machine; nothing has been computed on a node yet".to_owned(),
        processors => {
            let names = processors.iter().map(String::as_str);
            format!("at the pace of {}", listed(names, "and"))
        }
    };
    let mut text = format!(
        "{}: {} to compute\n{each}\n{total} expected, {paced}\n",
        planned.study,
        counted(planned.missing, "task")
    );
    if f64::from(sizing.minutes) / 60.0 < sizing.longest() {
        text += "note: the time limit is shorter than that; what an element does not finish goes into \
                 the next round\n";
    }
    text
}

fn submitted(planned: &PlannedSubmission, submission: &Submission, manifest: &Path) -> String {
    let rounds = submission.submitted.iter().map(|round| match round.array {
        Some(array) => format!("job {array} computes, job {} finishes\n", round.finish),
        None => format!("job {} finishes\n", round.finish),
    });
    let rounds: String = rounds.collect();
    let (folder, manifest) = (planned.folder.display(), manifest.display());
    format!(
        "{rounds}scripts and what the nodes print: {folder}\n\
         `asperity status {manifest}` says how far it is, `asperity cancel {manifest}` ends it\n"
    )
}

/// Hours in the unit that suits them.
pub fn in_hours(hours: f64) -> String {
    match hours {
        hours if hours < 1.0 / 60.0 => format!("{:.0} s", (3600.0 * hours).ceil()),
        hours if hours < 1.0 => format!("{:.0} min", (60.0 * hours).ceil()),
        hours => format!("{hours:.1} h"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hours_are_told_in_the_unit_that_suits_them() {
        assert_eq!([0.001, 0.5, 1.25, 48.0].map(in_hours), ["4 s", "30 min", "1.2 h", "48.0 h"]);
    }
}
