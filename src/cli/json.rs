//! Studies for programs: what several commands print alike.

use serde_json::{Value, json};

use crate::session::Status;
use crate::session::status::StageCount;
use asperity_pipeline::adaptive_sampling::AdaptiveStage;

/// What is told of stages, and of the study.
pub fn status(status: &Status, stages: impl Iterator<Item = Value>) -> Value {
    json!({
        "stages": stages.collect::<Value>(),
        "core_hours": status.total_seconds() / 3600.0,
        "growing": adaptive(&status.adaptive),
    })
}

/// How much of a stage is finished.
pub fn count(count: &StageCount) -> Value {
    json!({
        "name": count.stage.name,
        "kind": count.stage.kind,
        "cached": count.cached,
        "to_run": count.to_run,
    })
}

/// Stages whose number of surfaces is not given.
pub fn adaptive(stages: &[AdaptiveStage]) -> Value {
    let stages = stages.iter().map(|stage| {
        json!({
            "name": stage.name,
            "surfaces": stage.surfaces,
            "at_most": stage.growth.at_most,
            "until": stage.growth.until.to_string(),
            "holds": stage.holds(),
            "undecided": stage.undecided(),
        })
    });
    stages.collect()
}
