//! How much of a study is finished.

use serde_json::json;

use crate::plan::{Plan, PlannedStage};

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
