//! `asperity explain`: why tasks would run, and at what cost.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::{Value, json};

use super::forecast::{self, core_hours};
use super::terminal::stdout;
use super::{Failure, counted, json};
use crate::session::status::StageStatus;
use crate::session::{SessionError, Status, UnknownName};
use asperity_pipeline::data_folder::DataFolder;
use asperity_pipeline::plan::reasons::Group;

/// More reasons in one stage are not read by anybody; `--json` has them all.
const MOST_REASONS: usize = 20;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest.
    manifest: PathBuf,

    /// A stage; all of them when left out.
    stage: Option<String>,

    /// Print JSON: `{"stages": [{"name", "kind", "cached", "to_run", "core_hours", "reasons":
    /// [{"tasks", "core_hours", "causes": [{"stage", "why", …}, …]}, …]}, …], "core_hours",
    /// "growing"}`, `growing` as `plan` has it.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let status = super::session(&arguments.manifest, data).status()?;
    let mut stages = status.stages();
    if let Some(wanted) = &arguments.stage {
        let names = stages.iter().map(|stage| &*stage.count.stage.name);
        let names: Vec<&str> = names.collect();
        let place = names.iter().position(|name| name == wanted);
        let place = place.ok_or_else(|| SessionError::from(UnknownName::stage(wanted, &names)))?;
        stages = vec![stages.swap_remove(place)];
    }
    let mut out = stdout();
    if arguments.json {
        let stages = stages.iter().map(|stage| json(&status, stage));
        writeln!(out, "{:#}", json::status(&status, stages))?;
    } else {
        for stage in &stages {
            write!(out, "{}", text(&status, stage))?;
        }
        if arguments.stage.is_none() {
            writeln!(out, "{}", forecast::text(&status))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// What a stage has, and a line per reason with all that belongs to it.
fn text(status: &Status, stage: &StageStatus) -> String {
    let count = &stage.count;
    let name = &count.stage.name;
    let mut text = format!("{name} ({}): {} reused", count.stage.kind, count.cached);
    if count.to_run > 0 {
        text += &format!(", {} to run, {}", count.to_run, core_hours(stage.seconds));
    }
    text.push('\n');
    for group in stage.groups.iter().take(MOST_REASONS) {
        let tasks = counted(group.tasks.len(), "task");
        let cost = match stage.groups {
            [_] => String::new(),
            _ => format!(", {}", core_hours(status.seconds(group))),
        };
        let told: Vec<_> = group.causes.iter().map(|cause| status.told(cause, name)).collect();
        text += &format!("  {tasks}{cost}: {}\n", told.join("; "));
    }
    let more = stage.groups.len().saturating_sub(MOST_REASONS);
    if more > 0 {
        text += &format!("  and {}\n", counted(more, "other reason"));
    }
    text
}

fn json(status: &Status, stage: &StageStatus) -> Value {
    let reason = |group: &Group| {
        let causes = group.causes.iter().map(|cause| {
            let mut json = json!(cause.why);
            json["stage"] = json!(status.origin(cause));
            json
        });
        json!({
            "tasks": group.tasks.len(),
            "core_hours": status.seconds(group) / 3600.0,
            "causes": causes.collect::<Vec<_>>(),
        })
    };
    let mut json = json::count(&stage.count);
    json["core_hours"] = json!(stage.seconds / 3600.0);
    json["reasons"] = stage.groups.iter().map(reason).collect();
    json
}
