//! What a study has finished: its stages' tables.

use std::path::PathBuf;

use super::Subject;
use crate::plan::Plan;
use crate::sources::Sources;
use crate::stages::Kind;
use crate::store::files::read_whole;
use crate::store::parquet::{Columns, Metadata};
use crate::store::table::Table;
use crate::store::{Store, StoreError};

/// A stage with at least one finished task.
#[derive(Debug)]
pub struct Stage {
    /// Its name in the manifest.
    pub name: String,
    /// What it does.
    pub kind: Kind,
    /// Its rows.
    pub table: Table,
    /// What its file says of itself.
    pub metadata: Metadata,
    /// Its file.
    pub path: PathBuf,
}

/// Everything that figures are drawn from.
pub struct Finished<'a> {
    /// The stages, in the order of the plan.
    pub stages: Vec<Stage>,
    /// The tasks of the study.
    pub plan: &'a Plan,
    /// Where the maps are.
    pub store: &'a Store,
    /// Where measured surfaces are.
    pub sources: &'a Sources,
}

impl<'a> Finished<'a> {
    /// Reads the tables that have been published.
    ///
    /// # Errors
    /// When one cannot be read.
    pub fn read(subject: &Subject<'a>) -> Result<Finished<'a>, StoreError> {
        let Subject {
            plan,
            store,
            sources,
            published,
            ..
        } = *subject;
        let stages = plan.stages.iter().zip(published);
        let stages = stages.filter(|(_, published)| published.finished > 0);
        let stages = stages.map(|(stage, published)| {
            let (table, metadata) = read_whole(&published.path, Columns::Light)?;
            Ok(Stage {
                name: stage.name.clone(),
                kind: stage.kind,
                table,
                metadata,
                path: published.path.clone(),
            })
        });
        Ok(Finished {
            stages: stages.collect::<Result<_, _>>()?,
            plan,
            store,
            sources,
        })
    }

    /// The stages whose tables have all of these columns.
    pub fn with<'b>(&'b self, columns: &'b [&str]) -> impl Iterator<Item = &'b Stage> {
        let has_all = |stage: &&Stage| columns.iter().all(|column| stage.table.has(column));
        self.stages.iter().filter(has_all)
    }

    /// The name of a stage of a kind, finished or not, for advice on what to add.
    pub fn name_of(&self, kind: Kind) -> Option<&str> {
        let mut stages = self.plan.stages.iter();
        let found = stages.find(|stage| stage.kind == kind)?;
        Some(&found.name)
    }
}
