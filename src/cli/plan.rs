//! `asperity plan`: what a study has, and what it would compute.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;

use super::table::write_json;
use super::terminal::stdout;
use super::{Failure, counted, forecast, json};
use crate::session::Status;
use crate::session::status::StageStatus;
use asperity_pipeline::data_folder::DataFolder;
use asperity_pipeline::plan::reasons::Group;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest.
    manifest: PathBuf,

    /// Print JSON: `{"stages": [{"name", "kind", "cached", "to_run", "reasons"}, …], "core_hours",
    /// "growing": [{"name", "surfaces", "at_most", "until", "holds", "undecided"}, …], "warnings": [{"stage",
    /// "message"}, …]}`.
    #[arg(long)]
    json: bool,

    /// Print every task instead, inputs before what reads them, as JSON, one object a line:
    /// `{"stage", "task", "state", "core_seconds", …}`, where `state` is "cached" or "missing", and
    /// the rest is what places the task in the study. `run --only TASK` computes one.
    #[arg(long)]
    tasks: bool,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let status = super::session(&arguments.manifest, data).status()?;
    let stages = status.stages();
    super::tell(&status.warnings);
    let mut out = stdout();
    if arguments.tasks {
        for table in status.tasks() {
            write_json(&mut out, table?.batch())?;
        }
    } else if arguments.json {
        let stages = stages.iter().map(|stage| {
            let mut json = json::count(&stage.count);
            json["reasons"] = json!(reasons(&status, stage));
            json
        });
        let mut json = json::status(&status, stages);
        json["warnings"] = json!(status.warnings);
        writeln!(out, "{json:#}")?;
    } else {
        writeln!(out, "{}\n{}", table(&status, &stages), forecast::text(&status))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A stage's reasons, each in a phrase.
fn reasons(status: &Status, stage: &StageStatus) -> Vec<String> {
    let told = |group: &Group| {
        let causes = group.causes.iter();
        let told: Vec<_> =
            causes.map(|cause| status.told(cause, &stage.count.stage.name)).collect();
        told.join("; ")
    };
    stage.groups.iter().map(told).collect()
}

fn table(status: &Status, stages: &[StageStatus]) -> String {
    let names = stages.iter().map(|stage| stage.count.stage.name.chars().count());
    let width = names.max().unwrap_or(0).max("stage".len());
    let mut lines =
        vec![format!("{:width$}  {:9}  {:>8}  {:>8}  why", "stage", "kind", "cached", "to run")];
    for stage in stages {
        let count = &stage.count;
        let why = match reasons(status, stage).as_slice() {
            [] => String::new(),
            [one] => one.clone(),
            [first, more @ ..] => format!("{first}, and {}", counted(more.len(), "other reason")),
        };
        let line = format!(
            "{:width$}  {:9}  {:>8}  {:>8}  {why}",
            count.stage.name, count.stage.kind, count.cached, count.to_run
        );
        lines.push(line.trim_end().to_owned());
    }
    lines.join("\n")
}
