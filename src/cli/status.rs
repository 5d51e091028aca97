//! `asperity status`: how far a study is, wherever it is computed.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread::sleep;
use std::time::Duration;

use super::Failure;
use super::plan::core_hours;
use super::submit::in_hours;
use super::terminal::stdout;
use crate::session::DataFolder;
use crate::session::Progress;
use crate::session::status::Queue;
use crate::session::words::counted;

/// Time between looks.
const EVERY: Duration = Duration::from_secs(10);

/// Failures that are shown.
const SHOWN: usize = 5;

#[derive(clap::Args)]
pub struct Arguments {
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

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = super::session(&arguments.manifest, data);
    loop {
        let progress = session.progress()?;
        let mut out = stdout();
        match (arguments.json, arguments.watch) {
            (true, true) => writeln!(out, "{}", serde_json::to_string(&progress)?)?,
            (true, false) => writeln!(out, "{:#}", serde_json::to_value(&progress)?)?,
            (false, is_watched) => {
                if is_watched {
                    out.clear()?;
                }
                write!(out, "{}", text(&progress))?;
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

fn text(progress: &Progress) -> String {
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
