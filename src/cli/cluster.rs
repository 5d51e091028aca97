//! `asperity status`, `cancel` and `finish`: how far a study is that was submitted, the end of its jobs,
//! and what its last job runs.

use std::io::Write;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread::sleep;
use std::time::Duration;

use bytesize::ByteSize;

use super::console::{Console, Patience, StopSignal};
use super::plan::core_hours;
use super::run::{exit_code, told};
use super::submit::in_hours;
use super::terminal::stdout;
use super::{Failure, print_json, warn};
use crate::session::status::Queue;
use crate::session::submission::ranges;
use crate::session::words::{counted, listed};
use crate::session::{DataFolder, FinishOptions, FinishOutcome, Progress, RunOptions, Session};

/// Time between looks.
const EVERY: Duration = Duration::from_secs(10);

/// Failures that are shown.
const SHOWN: usize = 5;

#[derive(clap::Args)]
pub struct StatusArguments {
    /// The manifest.
    manifest: PathBuf,

    /// Look again every ten seconds, until nobody is at work.
    #[arg(long)]
    watch: bool,

    /// Print JSON: `{"study", "stages": [{"name", "kind", "done", "running", "waiting", "failed"}, …],
    /// "core_hours_spent", "core_hours_left", "hours_left", "cores", "queue", "failures"}`; with
    /// `--watch`, a line for each look.
    #[arg(long)]
    json: bool,
}

pub fn status(arguments: &StatusArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = super::session(&arguments.manifest, data);
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
        sleep(EVERY);
    }
}

fn progress_text(progress: &Progress) -> String {
    let mut text = format!(
        "{:20} {:10} {:>8} {:>8} {:>8} {:>8}\n",
        "stage", "kind", "done", "running", "waiting", "failed"
    );
    for stage in &progress.stages {
        text += &format!(
            "{:20} {:10} {:>8} {:>8} {:>8} {:>8}\n",
            stage.name, stage.kind, stage.done, stage.running, stage.waiting, stage.failed
        );
    }
    let hours = |hours: f64| core_hours(3600.0 * hours);
    let left = hours(progress.core_hours_left);
    text += &format!("{} spent, {left} left", hours(progress.core_hours_spent));
    if let Some(wall) = progress.hours_left {
        let cores = counted(progress.cores, "core");
        text += &format!(": {} on the {cores} at work", in_hours(wall));
    }
    text += "\n";
    text += &progress.queue.as_ref().map_or_else(String::new, queued);
    for failed in progress.failures.iter().take(SHOWN) {
        text += &format!("failed: {} {}: {}\n", failed.stage, &failed.task[..8], failed.reason);
    }
    let more = progress.failures.len().saturating_sub(SHOWN);
    if more > 0 {
        text += &format!("and {more} more that failed\n");
    }
    text
}

fn queued(queue: &Queue) -> String {
    let Queue { running, waiting, reasons, finish } = queue;
    if *running + *waiting == 0 && finish.is_none() {
        return "queue: no job of the study\n".to_owned();
    }
    let reasons: Vec<&str> = reasons.iter().map(String::as_str).collect();
    let why = match reasons.is_empty() {
        true => String::new(),
        false => format!(" ({})", reasons.join(", ")),
    };
    let last =
        finish.as_ref().map_or_else(String::new, |finish| format!(", the last job {finish}"));
    format!("queue: {} run, {waiting} wait{why}{last}\n", counted(*running, "element"))
}

#[derive(clap::Args)]
pub struct CancelArguments {
    /// The manifest of a study that has been submitted.
    manifest: PathBuf,
}

pub fn cancel(arguments: &CancelArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = super::session(&arguments.manifest, data);
    let jobs = session.cancel()?;
    let mut out = stdout();
    match jobs.as_slice() {
        [] => writeln!(out, "no job of the study is in the queue")?,
        jobs => {
            let jobs = listed(jobs.iter().map(String::as_str), "and");
            writeln!(out, "cancelled: {jobs}; finished tasks are kept")?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

#[derive(clap::Args)]
pub struct FinishArguments {
    /// The manifest.
    manifest: PathBuf,

    /// How often something was submitted again before.
    #[arg(long, value_name = "N", default_value_t = 0)]
    round: u32,

    /// Surfaces to work on at once.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,

    /// Memory to keep to.
    #[arg(long, value_name = "SIZE")]
    memory: Option<ByteSize>,

    /// Write the page of figures, too.
    #[arg(long)]
    report: bool,

    /// Take the place of another manifest whose study has the same name.
    #[arg(long)]
    replace: bool,
}

pub fn finish(arguments: &FinishArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let console = Console::default();
    let session = Session::new(&arguments.manifest, data.path()).observed_by(&console);
    let stop = StopSignal::on_signal(Patience::OfANode)?;
    let options = FinishOptions {
        round: arguments.round,
        run: RunOptions {
            jobs: arguments.jobs.map(usize::from).and_then(NonZeroUsize::new),
            memory: arguments.memory,
            replace: arguments.replace,
            ..RunOptions::default()
        },
        report: arguments.report,
    };
    let finished = session.finish(&options, stop.asked())?;
    if !finished.silent.is_empty() {
        let study = session.study()?.name;
        warn(&format!(
            "warning: elements {} left no receipt: they never began, or their nodes have not got the \
             program or `{}`; what they printed is in `{}`, as far as they see it",
            ranges(finished.silent),
            data.path().display(),
            data.cluster_of(&study).join("logs").display(),
        ));
    }
    let mut out = stdout();
    match finished.outcome {
        FinishOutcome::SubmittedAgain(round) => {
            let numbers = ranges(round.elements);
            let array = round.array.map_or_else(String::new, |job| format!(" as job {job}"));
            writeln!(
                out,
                "elements {numbers} are submitted again{array}; job {} finishes",
                round.finish
            )?;
            Ok(ExitCode::SUCCESS)
        }
        FinishOutcome::Done(report, page) => {
            write!(out, "{}", told(&report, None)?)?;
            if let Some(page) = page {
                writeln!(out, "report: {}", page.page.display())?;
            }
            Ok(exit_code(&report.outcome, &stop))
        }
    }
}
