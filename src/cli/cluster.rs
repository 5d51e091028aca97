//! `asperity submit`, `status`, `cancel` and `finish`: run a study on a Slurm cluster.

use std::env;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread::sleep;
use std::time::Duration;

use super::console::{Console, SCHEDULED, StopSignal};
use super::plan::{core_hours, store_lines};
use super::run::{ResourceArguments, exit_code, run_text};
use super::terminal::{in_columns, stdout};
use super::{Failure, StudyArguments, print_json, warn};
use crate::session::formatting::{counted, listed, shell_word};
use crate::session::status::Queue;
use crate::session::submission::{ScriptOptions, Settings, SettingsFile, Submission, ranges};
use crate::session::{DataFolder, FinishOutcome, PlannedSubmission, Progress, SessionError};

#[derive(clap::Args)]
pub(crate) struct SubmitArguments {
    #[command(flatten)]
    study: StudyArguments,

    /// Print the scripts and the expected cost without writing or submitting anything.
    #[arg(long)]
    dry_run: bool,

    /// Write the HTML report at the end.
    #[arg(long)]
    report: bool,

    /// Overwrite the results of another manifest with the same study name.
    #[arg(long)]
    replace: bool,

    /// Program that the nodes run (default: this program).
    #[arg(long, value_name = "PATH")]
    program: Option<PathBuf>,

    #[command(flatten)]
    cluster: Settings,
}

/// Runs `asperity submit`, where `own` is the path of this program if it differs from the
/// executable of the process.
pub(crate) fn submit(
    arguments: &SubmitArguments,
    data: &DataFolder,
    own: Option<&Path>,
) -> Result<ExitCode, Failure> {
    let session = arguments.study.session(data);
    let program = match arguments.program.as_deref().or(own) {
        Some(program) => program.to_owned(),
        None => env::current_exe()?,
    };
    let (settings, origin) = arguments.settings(session.data())?;
    let SubmitArguments { report, replace, .. } = *arguments;
    let options = ScriptOptions { report, replace, settings: session.settings().to_vec() };
    let planned = session.plan_submission(program, settings, options)?;
    let mut out = stdout();
    if planned.missing == 0 {
        writeln!(
            out,
            "nothing to submit: all tasks are finished; `asperity run` writes the tables of the \
             stages"
        )?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut submission = String::new();
    if arguments.dry_run {
        for (path, text) in planned.scripts() {
            writeln!(out, "==> {} <==\n{text}", path.display())?;
        }
    } else {
        submission = submitted(&planned, &session.submit(&planned)?, &arguments.study.manifest);
    }
    write!(out, "{}{origin}{submission}", expected(&planned))?;
    Ok(ExitCode::SUCCESS)
}

impl SubmitArguments {
    /// Returns the settings of the command line and, where it gives none, those of the settings
    /// files of the data folder, the nearest first. Also returns lines that name these files and
    /// the shell commands that each job will run.
    fn settings(&self, data: &DataFolder) -> Result<(Settings, String), Failure> {
        let (mut settings, mut files) = (self.cluster.clone(), Vec::new());
        for path in data.settings() {
            if let Some(read) = SettingsFile::read(path).map_err(SessionError::from)? {
                settings = settings.or(read.cluster);
                files.push(path.display().to_string());
            }
        }
        let mut text = String::new();
        if !files.is_empty() {
            let files = listed(files.iter().map(String::as_str), "and");
            text += &format!("settings from {files}\n");
        }
        for line in settings.before.iter().flatten() {
            text += &format!("each job first runs: {line}\n");
        }
        Ok((settings, text))
    }
}

/// Describes the expected cost of a submission in a few lines.
fn expected(planned: &PlannedSubmission) -> String {
    let sizing = &planned.sizing;
    let elements = sizing.hours.len();
    let each = match elements {
        0 => "no array elements; the last job computes all missing tasks".to_owned(),
        _ => format!(
            "{} with {} each, expected to take at most {}; time limit {}",
            counted(elements, "array element"),
            counted(sizing.cores as usize, "core"),
            in_hours(sizing.longest()),
            in_hours(f64::from(sizing.minutes) / 60.0),
        ),
    };
    let total = core_hours(3600.0 * (sizing.core_hours + sizing.core_hours_after));
    let paced = match planned.processors.as_slice() {
        [] => "from the speed of this machine, because no node has computed a task yet".to_owned(),
        processors => {
            let names = processors.iter().map(String::as_str);
            format!("from measurements on {}", listed(names, "and"))
        }
    };
    let mut text = format!(
        "{}: {} to compute\n{each}\n{total} expected, {paced}\n",
        planned.study,
        counted(planned.missing, "task")
    );
    if f64::from(sizing.minutes) / 60.0 < sizing.longest() {
        text += "note: the time limit is shorter than the expected time; another round follows\n";
    }
    text
}

fn submitted(planned: &PlannedSubmission, submission: &Submission, manifest: &Path) -> String {
    let lines = submission.submitted.iter().map(|round| match round.array {
        Some(array) => {
            format!("job {array} computes the tasks, job {} completes the study\n", round.finish)
        }
        None => format!("job {} completes the study\n", round.finish),
    });
    let rounds: String = lines.collect();
    let (folder, manifest) = (planned.folder.display(), shell_word(manifest));
    format!(
        "{rounds}scripts and logs: {folder}\n\
         `asperity status {manifest}` shows the progress, `asperity cancel {manifest}` cancels the jobs\n"
    )
}

/// Formats hours as seconds, minutes or hours.
fn in_hours(hours: f64) -> String {
    match hours {
        hours if hours < 1.0 / 60.0 => format!("{:.0} s", (3600.0 * hours).ceil()),
        hours if hours < 1.0 => format!("{:.0} min", (60.0 * hours).ceil()),
        hours => format!("{hours:.1} h"),
    }
}

/// Time between two updates of `status --watch`.
const WATCH_INTERVAL: Duration = Duration::from_secs(10);

/// Maximum number of failures printed.
const MAX_FAILURES: usize = 5;

#[derive(clap::Args)]
pub(crate) struct StatusArguments {
    #[command(flatten)]
    study: StudyArguments,

    /// Update every ten seconds until no job is running.
    #[arg(long)]
    watch: bool,

    /// Print the result as JSON.
    ///
    /// Form: `{"study", "stages": [{"name", "kind", "done", "running", "waiting", "failed"}, …],
    /// "core_hours_spent", "core_hours_left", "hours_left", "cores", "queue", "failures"}`; with
    /// `--watch`, one line per update. If tables are read from stores that `asperity.toml` lists,
    /// stages also have `"stores": [{"store", "tasks"}, …]`.
    #[arg(long)]
    json: bool,
}

pub(crate) fn status(arguments: &StatusArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = arguments.study.session(data);
    loop {
        let progress = session.progress()?;
        let mut out = stdout();
        match (arguments.json, arguments.watch) {
            (true, true) => writeln!(out, "{}", serde_json::to_string(&progress)?)?,
            (true, false) => print_json(&mut out, &progress)?,
            (false, is_watched) => {
                if is_watched {
                    out.clear()?;
                }
                write!(out, "{}", progress_text(&progress))?;
            }
        }
        out.flush()?;
        if !arguments.watch || progress.is_over() {
            return Ok(ExitCode::SUCCESS);
        }
        drop(out);
        sleep(WATCH_INTERVAL);
    }
}

fn progress_text(progress: &Progress) -> String {
    let rows = progress.stages.iter().map(|stage| {
        let counts = [stage.done, stage.running, stage.waiting, stage.failed];
        let [done, running, waiting, failed] = counts.map(|count| count.to_string());
        [stage.name.clone(), stage.kind.to_string(), done, running, waiting, failed]
    });
    let header = ["stage", "kind", "finished", "running", "waiting", "failed"];
    let mut text = in_columns(header, rows, |index| (2..6).contains(&index)) + "\n";
    let stages = progress.stages.iter();
    text += &store_lines(stages.map(|stage| (stage.name.as_str(), stage.stores.as_slice())));
    let hours = |hours: f64| core_hours(3600.0 * hours);
    // Only shards and array elements have receipts of the time that they spent.
    if progress.core_hours_spent > 0.0 {
        text += &format!("{} spent by array elements, ", hours(progress.core_hours_spent));
    }
    text += &format!("{} left", hours(progress.core_hours_left));
    if let Some(wall) = progress.hours_left {
        let cores = counted(progress.cores, "core");
        text += &format!(": {} on the {cores} in use", in_hours(wall));
    }
    text += "\n";
    text += &progress.queue.as_ref().map_or_else(String::new, queued);
    for failed in progress.failures.iter().take(MAX_FAILURES) {
        text += &format!("failed: {} {}: {}\n", failed.stage, &failed.task[..8], failed.reason);
    }
    let more = progress.failures.len().saturating_sub(MAX_FAILURES);
    if more > 0 {
        text += &format!("and {}\n", counted(more, "more failed task"));
    }
    text
}

fn queued(queue: &Queue) -> String {
    let Queue { running, waiting, reasons, finish } = queue;
    if *running + *waiting == 0 && finish.is_none() {
        return "queue: no jobs of this study\n".to_owned();
    }
    let explained = reasons.iter().map(|reason| match reason.as_str() {
        "BeginTime" => "BeginTime: Slurm restarts a job of a failed node after two minutes",
        other => other,
    });
    let reasons: Vec<&str> = explained.collect();
    let why = if reasons.is_empty() { String::new() } else { format!(" ({})", reasons.join(", ")) };
    let last = finish.as_ref().map_or_else(String::new, |finish| format!(", last job {finish}"));
    format!("queue: {} running, {waiting} waiting{why}{last}\n", counted(*running, "array element"))
}

pub(crate) fn cancel(arguments: &StudyArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let jobs = arguments.session(data).cancel()?;
    if jobs.is_empty() {
        writeln!(stdout(), "no jobs of this study are in the queue")?;
    } else {
        let jobs = listed(jobs.iter().map(String::as_str), "and");
        writeln!(stdout(), "cancelled: {jobs}; finished tasks are kept")?;
    }
    Ok(ExitCode::SUCCESS)
}

#[derive(clap::Args)]
pub(crate) struct FinishArguments {
    #[command(flatten)]
    study: StudyArguments,

    /// Number of earlier resubmissions of missing tasks.
    #[arg(long, value_name = "N", default_value_t = 0)]
    round: u32,

    #[command(flatten)]
    resources: ResourceArguments,

    /// Write the HTML report at the end.
    #[arg(long)]
    report: bool,
}

pub(crate) fn finish(arguments: &FinishArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let console = Console::default();
    let session = arguments.study.session(data).observed_by(&console);
    let stop = StopSignal::on_signal(SCHEDULED)?;
    let (options, report) = (arguments.resources.options(), arguments.report);
    let (outcome, silent) = session.finish(arguments.round, &options, report, stop.requested())?;
    if !silent.is_empty() {
        let study = session.study()?.name;
        warn(&format!(
            "warning: array elements {} left no receipt; see if their nodes have `{}`, and the \
             logs in `{}`",
            ranges(silent),
            data.path().display(),
            data.cluster_of(&study).join("logs").display(),
        ));
    }
    let mut out = stdout();
    match outcome {
        FinishOutcome::SubmittedAgain(round) => {
            let numbers = ranges(round.elements);
            let array = round.array.map_or_else(String::new, |job| format!(" as job {job}"));
            writeln!(
                out,
                "array elements {numbers} submitted again{array}; job {} completes the study",
                round.finish
            )?;
            Ok(ExitCode::SUCCESS)
        }
        FinishOutcome::Done(report, page) => {
            write!(out, "{}", run_text(&report, None)?)?;
            if let Some(page) = page {
                writeln!(out, "report: {}", page.page.display())?;
            }
            Ok(exit_code(&report.outcome, &stop))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hours_are_printed_in_a_suitable_unit() {
        assert_eq!([0.001, 0.5, 1.25, 48.0].map(in_hours), ["4 s", "30 min", "1.2 h", "48.0 h"]);
    }
}
