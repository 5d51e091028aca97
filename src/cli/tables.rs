//! The tables of a study, as commands that look at them read them.

use std::path::Path;

use super::{Failure, counted, place_of, warn};
use crate::failures;
use crate::names;
use crate::plan::{Plan, PlannedStage};
use crate::results::reading::Reading;
use crate::store::table::Table;

/// The tables of a study as its manifest has them now, whatever has been published.
pub struct Tables<'a> {
    pub manifest: &'a Path,
    pub plan: &'a Plan,
    pub reading: &'a Reading,
    pub folder: &'a Path,
}

impl Tables<'_> {
    /// A stage's table, by the stage's name, or the table of failures.
    pub fn of(&self, name: &str) -> Result<Table, Failure> {
        if name == names::FAILURES {
            return Ok(failures::read(self.folder, &self.plan.study)?);
        }
        let stage = &self.plan.stages[place_of(&self.names(), name)?];
        self.read(stage)?.ok_or_else(|| self.not_computed(name))
    }

    /// A stage's table; `None` if nothing of it is computed. What is missing is told.
    pub fn read(&self, stage: &PlannedStage) -> Result<Option<Table>, Failure> {
        let rows = self.reading.rows(stage)?;
        if !rows.tasks.is_empty() && rows.tasks.len() < stage.tasks.len() {
            warn(&format!(
                "note: `{}` is not complete, {} of {} computed; `asperity run {}` goes on",
                stage.name,
                rows.tasks.len(),
                counted(stage.tasks.len(), "task"),
                self.manifest.display(),
            ));
        }
        Ok(rows.table)
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
