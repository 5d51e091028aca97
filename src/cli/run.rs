//! `asperity run`: compute what is missing and write the tables.

use std::io::{Write, stderr, stdout};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::json;

use super::plan::Counts;
use super::progress::Progress;
use super::{Data, Failure, chain, counted, summary};
use crate::pace::Pace;
use crate::plan::Plan;
use crate::runner::{self, Outcome, TaskError};
use crate::{results, store::StoreError};

/// How a process ends that its user stopped.
const STOPPED: u8 = 130;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest.
    manifest: PathBuf,

    /// Surfaces to work on at once; one core and a few maps of memory each.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,

    /// Print JSON, as `plan --json` does, with `computed` and `failed` for each stage.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &Data) -> Result<ExitCode, Failure> {
    let study = super::study(&arguments.manifest)?;
    let plan = Plan::of(&study);
    let store = data.open()?;
    let missing = runner::missing(&plan, &store);
    let outcome = if missing.is_empty() {
        Outcome::default()
    } else {
        let progress = Progress::new(&plan, &missing, &Pace::default());
        let jobs = jobs(arguments).min(missing.len());
        let stopped = stop_on_signal()?;
        let outcome = runner::run(
            &plan,
            &missing,
            &store,
            &study.sources,
            jobs,
            &progress,
            &stopped,
        );
        progress.end();
        outcome
    };
    let tables = results::publish(&plan, &store, &study.sources, &data.results())?;

    let mut out = stdout().lock();
    if arguments.json {
        writeln!(out, "{:#}", as_json(&plan, &missing, &outcome))?;
    } else {
        write!(out, "{}", summary::text(&plan, &tables)?)?;
        writeln!(out, "{}", closing(&plan, &outcome))?;
    }
    report_failures(&plan, &outcome)?;
    Ok(exit_code(&outcome))
}

fn jobs(arguments: &Arguments) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    arguments.jobs.map_or_else(cores, usize::from)
}

/// The first signal asks tasks to stop, the second one ends the process.
fn stop_on_signal() -> Result<Arc<AtomicBool>, Failure> {
    let stopped = Arc::new(AtomicBool::new(false));
    let flag = stopped.clone();
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(STOPPED));
        }
        eprintln!("stopping; finished tasks are kept");
    })?;
    Ok(stopped)
}

fn as_json(plan: &Plan, missing: &[usize], outcome: &Outcome) -> serde_json::Value {
    let failed: Vec<usize> = outcome.failed.iter().map(|(task, _)| *task).collect();
    let counts = Counts::of(plan, missing);
    let stages = counts.0.iter().map(|count| {
        let among = |tasks: &[usize]| {
            let own = |task: &&usize| tasks.binary_search(task).is_ok();
            count.stage.tasks.iter().filter(own).count()
        };
        let mut json = count.json();
        json["computed"] = json!(among(&outcome.computed));
        json["failed"] = json!(among(&failed));
        json
    });
    json!({ "stages": stages.collect::<Vec<_>>() })
}

fn closing(plan: &Plan, outcome: &Outcome) -> String {
    let computed = outcome.computed.len();
    if outcome.interrupted {
        let left = plan.tasks.len() - computed;
        return format!("stopped after {computed} of {left} tasks; run again to go on");
    }
    match computed {
        0 if outcome.failed.is_empty() => "nothing to do: every table was there".to_owned(),
        _ => format!("{} computed", counted(computed, "task")),
    }
}

/// One line per failure; those that only follow from another are counted.
fn report_failures(plan: &Plan, outcome: &Outcome) -> Result<(), StoreError> {
    let mut err = stderr().lock();
    let mut followed = 0;
    for (task, error) in &outcome.failed {
        if matches!(error, TaskError::Upstream) {
            followed += 1;
            continue;
        }
        let task = &plan.tasks[*task];
        let kind = task.recipe.kind();
        let line = format!("error: {kind} task {} failed: {}", task.key, chain(error));
        // Nobody is left to tell if standard error is closed.
        let _ = writeln!(err, "{line}");
    }
    if followed > 0 {
        let _ = writeln!(
            err,
            "{} that read them: not started",
            counted(followed, "task")
        );
    }
    Ok(())
}

fn exit_code(outcome: &Outcome) -> ExitCode {
    if outcome.interrupted {
        ExitCode::from(STOPPED)
    } else if outcome.failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    }
}
