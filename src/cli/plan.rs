//! `asperity plan`: what a study has, and what it would compute.

use std::io::{Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;

use super::{Data, Failure};
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
    let missing = runner::missing(&plan, &data.look());
    let counts = Counts::of(&plan, &missing);
    let mut out = stdout().lock();
    if arguments.json {
        let stages: Vec<_> = counts.0.iter().map(Count::json).collect();
        writeln!(out, "{:#}", json!({ "stages": stages }))?;
    } else {
        writeln!(out, "{}", table(&counts))?;
        if missing.is_empty() {
            writeln!(out, "nothing to do")?;
        }
    }
    Ok(ExitCode::SUCCESS)
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
