//! The tables of a study, as commands that look at them read them.

use std::io::{Write, stderr};
use std::path::Path;

use super::{Failure, counted, place_of};
use crate::failures;
use crate::plan::{Plan, PlannedStage};
use crate::results;
use crate::sources::Sources;
use crate::store::Store;
use crate::store::table::Table;

/// The tables of a study, brought up to its manifest before they are read.
pub struct Tables<'a> {
    pub manifest: &'a Path,
    pub plan: &'a Plan,
    pub store: &'a Store,
    pub sources: &'a Sources,
    pub folder: &'a Path,
}

impl Tables<'_> {
    /// A stage's table, by the stage's name, or the table of failures.
    pub fn of(&self, name: &str) -> Result<Table, Failure> {
        if name == failures::NAME {
            return Ok(failures::read(self.folder, &self.plan.study)?);
        }
        let stage = &self.plan.stages[place_of(&self.names(), name)?];
        self.read(stage)?.ok_or_else(|| self.not_computed(name))
    }

    /// A stage's table; `None` if nothing of it is computed. What is missing is told.
    pub fn read(&self, stage: &PlannedStage) -> Result<Option<Table>, Failure> {
        let published =
            results::publish_stage(self.plan, stage, self.store, self.sources, self.folder)?;
        if published.finished == 0 {
            return Ok(None);
        }
        if published.finished < stage.tasks.len() {
            // Nobody is left to tell if standard error is closed.
            let _ = writeln!(
                stderr(),
                "note: `{}` is not complete, {} of {} computed; `asperity run {}` goes on",
                stage.name,
                published.finished,
                counted(stage.tasks.len(), "task"),
                self.manifest.display(),
            );
        }
        Ok(Some(published.read()?))
    }

    /// The names of its stages.
    pub fn names(&self) -> Vec<&str> {
        let stages = self.plan.stages.iter();
        stages.map(|stage| stage.name.as_str()).collect()
    }

    /// A stage has no table yet.
    pub fn not_computed(&self, stage: &str) -> Failure {
        let manifest = self.manifest.display();
        format!("nothing of `{stage}` is computed yet; `asperity run {manifest}` does it").into()
    }
}
