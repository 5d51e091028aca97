//! `asperity plan`: what a study has, and what it would compute.

use std::io::{Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread::available_parallelism;
use std::time::Duration;

use serde_json::json;

use super::progress::duration;
use super::{Data, Failure, counted};
use crate::pace::Pace;
use crate::plan::{Plan, PlannedStage};
use crate::runner;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest.
    manifest: PathBuf,

    /// Print JSON: `{"stages": [{"name", "kind", "cached", "to_run"}, …]}`.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &Data) -> Result<ExitCode, Failure> {
    let study = super::study(&arguments.manifest)?;
    let plan = Plan::of(&study);
    let missing = runner::missing(&plan, &data.look()?);
    let counts = Counts::of(&plan, &missing);
    let seconds = Pace::default().seconds_of(&plan, &missing);
    let mut out = stdout().lock();
    if arguments.json {
        let stages: Vec<_> = counts.0.iter().map(Count::json).collect();
        let core_hours = seconds / 3600.0;
        writeln!(
            out,
            "{:#}",
            json!({ "stages": stages, "core_hours": core_hours })
        )?;
    } else {
        writeln!(out, "{}\n{}", table(&counts), forecast(&missing, seconds))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// What is to come, in time of this machine.
fn forecast(missing: &[usize], seconds: f64) -> String {
    if missing.is_empty() {
        return "nothing to do".to_owned();
    }
    let cores = available_parallelism()
        .map_or(1, usize::from)
        .min(missing.len());
    let wall = duration(Duration::from_secs_f64((seconds / cores as f64).ceil()));
    format!(
        "{:.2} core-hours expected: {wall} on {}",
        seconds / 3600.0,
        counted(cores, "core")
    )
}

/// How much of each stage is finished.
pub struct Counts<'a>(pub Vec<Count<'a>>);

/// How much of one stage is finished.
pub struct Count<'a> {
    pub stage: &'a PlannedStage,
    pub cached: usize,
    pub to_run: usize,
}

impl<'a> Counts<'a> {
    pub fn of(plan: &'a Plan, missing: &[usize]) -> Counts<'a> {
        let count = |stage: &'a PlannedStage| {
            let is_missing = |task: &&usize| missing.binary_search(task).is_ok();
            let to_run = stage.tasks.iter().filter(is_missing).count();
            Count {
                stage,
                cached: stage.tasks.len() - to_run,
                to_run,
            }
        };
        Counts(plan.stages.iter().map(count).collect())
    }
}

impl Count<'_> {
    pub fn json(&self) -> serde_json::Value {
        json!({
            "name": self.stage.name,
            "kind": self.stage.kind,
            "cached": self.cached,
            "to_run": self.to_run,
        })
    }
}

fn table(counts: &Counts) -> String {
    let names = counts
        .0
        .iter()
        .map(|count| count.stage.name.chars().count());
    let width = names.max().unwrap_or(0).max("stage".len());
    let mut lines = vec![format!(
        "{:width$}  {:9}  {:>8}  {:>8}",
        "stage", "kind", "cached", "to run"
    )];
    for count in &counts.0 {
        lines.push(format!(
            "{:width$}  {:9}  {:>8}  {:>8}",
            count.stage.name, count.stage.kind, count.cached, count.to_run
        ));
    }
    lines.join("\n")
}
