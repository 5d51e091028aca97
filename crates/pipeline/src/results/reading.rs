//! What a study has computed, to be looked at: nothing is written, and a study that is half done,
//! or whose store is gone, is read as far as it goes.

use std::path::{Path, PathBuf};

use super::archive::Archive;
use super::publishing::Pieces;
use super::{ResultsError, digest, path};
use crate::adaptive_sampling::{ClaimRule, SampledStudy, SamplingError};
use crate::plan::{Plan, PlannedStage};
use crate::study::{ClaimNames, Study};
use asperity_manifest::diagnostics::ManifestErrors;
use asperity_tables::parquet::Metadata;
use asperity_tables::source::TableSource;
use asperity_tables::store::{Store, StoreError, TaskTables};
use asperity_tables::table::Table;

/// A study beside all that is there of it.
#[derive(Debug)]
pub struct Reading {
    /// The study.
    pub study: Study,
    /// Its tasks.
    pub plan: Plan,
    /// Their tables.
    pub archive: Archive,
    /// The folder of results.
    folder: PathBuf,
}

/// The rows of a stage's finished tasks.
#[derive(Debug)]
pub struct StageRows<T = Table> {
    /// The stage's name.
    pub stage: String,
    /// Where its table is, or would be.
    pub path: PathBuf,
    /// The tasks, in the order of the plan.
    pub tasks: Vec<usize>,
    /// Their rows; none as long as no task is finished.
    pub table: Option<T>,
    /// What decides them.
    pub digest: String,
    /// Whether the table on disk holds just these.
    pub is_published: bool,
}

/// Reads a manifest. Surface files that are gone are as they were when results were published.
///
/// # Errors
/// Everything that is wrong with it.
pub fn study(
    manifest: &Path,
    claims: ClaimNames,
    store: &Store,
    folder: &Path,
) -> Result<Study, ManifestErrors> {
    Study::read_recalling(manifest, claims, |name| {
        Archive::of(store.clone(), &folder.join(name)).recollection()
    })
}

impl Reading {
    /// Finds out what there is of a study.
    ///
    /// # Errors
    /// When a table cannot be read that tells how many surfaces it has.
    pub fn of(
        study: Study,
        store: Store,
        folder: &Path,
        rule: &dyn ClaimRule,
    ) -> Result<Reading, SamplingError> {
        let archive = Archive::of(store, &folder.join(&study.name));
        let SampledStudy { study, plan, .. } = SampledStudy::of(study, &archive, rule)?;
        Ok(Reading { study, plan, archive, folder: folder.to_owned() })
    }

    /// The rows of every stage, in the order of the plan.
    ///
    /// # Errors
    /// As [`Reading::rows`].
    pub fn all(&self) -> Result<Vec<StageRows>, ResultsError> {
        let stages = self.plan.stages.iter();
        stages.map(|stage| self.rows(stage)).collect()
    }

    /// A stage's rows in memory, see [`Reading::open`].
    ///
    /// # Errors
    /// As [`Reading::open`], and when the table on disk is damaged.
    pub fn rows(&self, stage: &PlannedStage) -> Result<StageRows, ResultsError> {
        let rows = self.open(stage)?;
        let table = rows.table.map(|source| source.table()).transpose()?;
        Ok(StageRows {
            table,
            stage: rows.stage,
            path: rows.path,
            tasks: rows.tasks,
            digest: rows.digest,
            is_published: rows.is_published,
        })
    }

    /// A stage's rows: the published table, not yet read, if it is of just the finished tasks, or of
    /// all; or else what there is of each task.
    ///
    /// # Errors
    /// When a table is damaged that nothing else stands in for.
    pub fn open(&self, stage: &PlannedStage) -> Result<StageRows<TableSource>, ResultsError> {
        let Reading { plan, archive, .. } = self;
        let sources = &self.study.sources;
        let path = path(&self.folder, &plan.study, &stage.name);
        let mut published = TableSource::open(&path);
        let stored = stage.among(&archive.store().have(&plan.keys_of(stage)));
        let rows = |tasks, table, digest, is_published| StageRows {
            stage: stage.name.clone(),
            path: path.clone(),
            tasks,
            table,
            digest,
            is_published,
        };
        for tasks in [stored, stage.tasks.clone()] {
            let digest = digest(plan, &tasks, sources);
            let is_it = |metadata: &Metadata| metadata.get("digest") == Some(&digest);
            published = match published {
                Ok((table, metadata)) if !tasks.is_empty() && is_it(&metadata) => {
                    return Ok(rows(tasks, Some(table), digest, true));
                }
                other => other,
            };
        }
        let mut pieces = Pieces::within(usize::MAX);
        for &task in &stage.tasks {
            let key = plan.tasks[task].key;
            let published = archive.published_in(&stage.name, key);
            match published.map_or_else(|| archive.light(key), Ok) {
                Err(StoreError::Read { source, .. })
                    if source.kind() == std::io::ErrorKind::NotFound => {}
                read => pieces.add(task, read)?,
            }
        }
        match published {
            // What is damaged may have been all there was.
            Err(error @ StoreError::Damaged { .. }) if pieces.is_empty() => Err(error.into()),
            _ => {
                let (tasks, table) = pieces.stacked(plan, stage, sources)?;
                let digest = digest(plan, &tasks, sources);
                Ok(rows(tasks, table.map(Into::into), digest, false))
            }
        }
    }
}
