//! One tidy table per stage, made of its tasks' tables, for polars, pandas or DuckDB to open.
//!
//! Heavy columns stay in the store, where the `task` column finds them. The tables are rewritten
//! after each run, and only if their tasks have changed; a [`Reading`] looks at a study and writes
//! nothing.

pub mod archive;
pub mod exceeded_hardness;
pub mod failures;
pub mod owner;
mod publishing;

use std::path::{Path, PathBuf};

use crate::adaptive_sampling::{ClaimRule, SampledStudy, SamplingError};
use crate::plan::{Plan, PlannedStage};
use crate::results::archive::Archive;
use crate::results::publishing::Pieces;
use crate::study::{ClaimNames, Study};
use asperity_manifest::diagnostics::ManifestErrors;
use asperity_stages::columns::CONTENT;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_tables::column::{Column, ColumnKind};
use asperity_tables::parquet::Metadata;
use asperity_tables::source::TableSource;
use asperity_tables::store::key::Digest;
use asperity_tables::store::listing::{Found, What};
use asperity_tables::store::{Store, StoreError, TaskTables, listing};
use asperity_tables::table::{Table, TableError};

pub use publishing::{PublishedTable, publish};

/// Raise it when tables say something else of themselves: those that are there are written anew.
const FORMAT: u32 = 2;

/// The folder of a study's figures, beside its tables.
pub const FIGURES: &str = "figures";

pub const TASK: Column =
    Column::result("task", ColumnKind::Text, "", "key of the task that computed the row");
const PATH: Column = Column::result(
    "path",
    ColumnKind::Text,
    "",
    "file of the measured surface, as the manifest names it",
);

/// A study beside all that is there of it, to be looked at: nothing is written, and a study that is
/// half done, or whose store is gone, is read as far as it goes.
#[derive(Debug)]
pub struct Reading {
    pub study: Study,
    pub plan: Plan,
    pub archive: Archive,
    folder: PathBuf,
}

/// The rows of a stage's finished tasks.
#[derive(Debug)]
pub struct StageRows<T = Table> {
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
pub fn read_study(
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
    pub fn all(&self) -> Result<Vec<StageRows>, ResultsError> {
        let stages = self.plan.stages.iter();
        stages.map(|stage| self.rows(stage)).collect()
    }

    /// A stage's rows in memory, see [`Reading::open`].
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

/// A study's tables cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// The store, or the folder of results, failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Tables of finished tasks are damaged, or have gone.
    #[error("{}; `asperity run` computes it again", damaged(tables))]
    Damaged {
        /// The tasks, and what is wrong with their tables.
        tables: Vec<(usize, StoreError)>,
    },
    /// Two tasks' tables contradict each other.
    #[error("cannot put the tables of stage `{stage}` together")]
    Table { stage: String, source: TableError },
}

/// The columns that a stage's table has beyond those of its tasks'.
pub fn with_own_columns(table: Table) -> Table {
    let own: &[Column] = if table.has(CONTENT.name) { &[PATH, TASK] } else { &[TASK] };
    table.beside(&Table::empty(own))
}

/// Where a stage's table is, or would be.
pub fn path(folder: &Path, study: &str, stage: &str) -> PathBuf {
    folder.join(study).join(file(stage))
}

fn file(stage: &str) -> String {
    format!("{stage}.parquet")
}

fn damaged(tables: &[(usize, StoreError)]) -> String {
    match tables {
        [] => "no table is damaged".to_owned(),
        [(_, only)] => only.to_string(),
        [(_, first), others @ ..] => format!("{first}, as are {} more", others.len()),
    }
}

/// Every file that this program has put into the folder of results.
pub fn files(folder: &Path) -> Result<Vec<Found>, StoreError> {
    let mut files = Vec::new();
    for study in listing::folders(folder)? {
        files.extend(files_of(&study)?);
    }
    Ok(files)
}

/// Tables of stages that the study has no longer.
pub fn orphans(plan: &Plan, folder: &Path) -> Result<Vec<PathBuf>, StoreError> {
    let is_orphan = |what: &What| match what {
        What::Stage { study, stage } => !plan.has_table(study, stage),
        _ => false,
    };
    let mut files = files_of(&folder.join(&plan.study))?;
    files.retain(|file| is_orphan(&file.what));
    Ok(files.into_iter().map(|file| file.path).collect())
}

/// What this program has put into the folder of one study's results: of the figures in it, only
/// what is not finished.
fn files_of(folder: &Path) -> Result<Vec<Found>, StoreError> {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let mut files = listing::known(&folder.join(FIGURES), |_| None)?;
    let study = || name.to_string();
    files.extend(listing::known(folder, |file| match file {
        owner::FILE => Some(What::Owner { study: study() }),
        table => {
            Some(What::Stage { study: study(), stage: table.strip_suffix(".parquet")?.to_owned() })
        }
    })?);
    Ok(files)
}

/// What decides a stage's table: its tasks, and the names of its files.
fn digest(plan: &Plan, tasks: &[usize], sources: &SurfaceFiles) -> String {
    let keys: Vec<_> = tasks.iter().map(|&task| plan.tasks[task].key).collect();
    Digest::of(&(FORMAT, keys, sources.paths())).to_string()
}
