//! One tidy table per stage, made of its tasks' tables, for polars, pandas or DuckDB to open.
//!
//! Heavy columns stay in the store, where the `task` column finds them. The tables are rewritten
//! after each run, and only if their tasks have changed.

use std::fs::File;
use std::path::{Path, PathBuf};

use crate::plan::{Plan, PlannedStage};
use crate::sources::Sources;
use crate::stages::columns::CONTENT;
use crate::store::column::{Column, ColumnKind, texts};
use crate::store::files::{Existing, read_whole, write_whole};
use crate::store::key::Digest;
use crate::store::listing::{self, Found, What};
use crate::store::parquet::{self, Columns, Metadata};
use crate::store::table::{Table, TableError};
use crate::store::{Store, StoreError};

/// Raise it when tables say something else of themselves: those that are there are written anew.
const FORMAT: u32 = 1;

/// The folder of a study's figures, beside its tables.
pub const FIGURES: &str = "figures";

const TASK: Column = Column::result(
    "task",
    ColumnKind::Text,
    "",
    "key of the task that computed the row",
);
const PATH: Column = Column::result(
    "path",
    ColumnKind::Text,
    "",
    "file of the measured surface, as the manifest names it",
);

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
    Table {
        /// The stage.
        stage: String,
        /// Why.
        source: TableError,
    },
}

/// A stage's table and how much of it is there.
#[derive(Debug)]
pub struct StageTable {
    /// The stage's name.
    pub stage: String,
    /// Where its table is.
    pub path: PathBuf,
    /// How many of its tasks are finished.
    pub finished: usize,
}

/// The columns that a stage's table has beyond those of its tasks'.
pub fn with_own_columns(table: Table) -> Table {
    let own: &[Column] = match table.has(CONTENT.name) {
        true => &[PATH, TASK],
        false => &[TASK],
    };
    table.beside(&Table::empty(own))
}

/// Where a stage's table is, or would be.
pub fn path(folder: &Path, study: &str, stage: &str) -> PathBuf {
    folder.join(study).join(format!("{stage}.parquet"))
}

impl StageTable {
    /// Its rows.
    ///
    /// # Errors
    /// When the file is missing or damaged.
    pub fn read(&self) -> Result<Table, StoreError> {
        Ok(read_whole(&self.path, Columns::Light)?.0)
    }
}

fn damaged(tables: &[(usize, StoreError)]) -> String {
    match tables {
        [] => "no table is damaged".to_owned(),
        [(_, only)] => only.to_string(),
        [(_, first), others @ ..] => format!("{first}, as are {} more", others.len()),
    }
}

/// Writes the table of every stage that has a finished task, unless it is there already.
///
/// # Errors
/// When tables cannot be read, or the folder not be written.
pub fn publish(
    plan: &Plan,
    store: &Store,
    sources: &Sources,
    folder: &Path,
) -> Result<Vec<StageTable>, ResultsError> {
    let mut damaged = Vec::new();
    let mut published = Vec::new();
    for stage in &plan.stages {
        match publish_stage(plan, stage, store, sources, folder) {
            Ok(table) => published.push(table),
            Err(ResultsError::Damaged { tables }) => damaged.extend(tables),
            Err(error) => return Err(error),
        }
    }
    match damaged.is_empty() {
        true => Ok(published),
        false => Err(ResultsError::Damaged { tables: damaged }),
    }
}

/// Writes the table of one stage if it has a finished task, unless it is there already.
///
/// # Errors
/// As [`publish`].
pub fn publish_stage(
    plan: &Plan,
    stage: &PlannedStage,
    store: &Store,
    sources: &Sources,
    folder: &Path,
) -> Result<StageTable, ResultsError> {
    let key = |&task: &usize| plan.tasks[task].key;
    let have = store.have(&stage.tasks.iter().map(key).collect::<Vec<_>>());
    let finished = stage
        .tasks
        .iter()
        .zip(have)
        .filter(|(_, is_there)| *is_there);
    let tasks: Vec<usize> = finished.map(|(&task, _)| task).collect();
    let path = path(folder, &plan.study, &stage.name);
    let digest = digest(plan, &tasks, sources);
    if !tasks.is_empty() && written_for(&path).as_ref() != Some(&digest) {
        let table = assemble(plan, stage, &tasks, store, sources)?;
        let metadata = metadata(plan, stage, &table, tasks.len(), digest);
        let bytes = parquet::encode(&table, &metadata);
        let beside = path.parent().unwrap_or(folder);
        write_whole(&path, &bytes, Existing::Replace, beside)?;
    }
    Ok(StageTable {
        stage: stage.name.clone(),
        path,
        finished: tasks.len(),
    })
}

/// A stage's rows, in the plan's order, each with the task that it came from.
fn assemble(
    plan: &Plan,
    stage: &PlannedStage,
    tasks: &[usize],
    store: &Store,
    sources: &Sources,
) -> Result<Table, ResultsError> {
    let mut stored = Vec::new();
    let mut damaged = Vec::new();
    for &task in tasks {
        let key = plan.tasks[task].key;
        match store.read(key, Columns::Light) {
            Ok(table) => {
                let keys = std::iter::repeat_n(key.to_string(), table.rows());
                let table = with_paths(table, sources);
                stored.push(table.with(vec![(TASK, texts(keys))]));
            }
            Err(error) if error.is_mendable() => damaged.push((task, error)),
            Err(error) => return Err(error.into()),
        }
    }
    if !damaged.is_empty() {
        return Err(ResultsError::Damaged { tables: damaged });
    }
    Table::stack(&stored).map_err(|source| ResultsError::Table {
        stage: stage.name.clone(),
        source,
    })
}

/// Every file that this program has put into the folder of results.
///
/// # Errors
/// When a folder cannot be listed.
pub fn files(folder: &Path) -> Result<Vec<Found>, StoreError> {
    let mut files = Vec::new();
    for study in listing::folders(folder)? {
        files.extend(files_of(&study)?);
    }
    Ok(files)
}

/// Tables of stages that the study has no longer.
///
/// # Errors
/// When the folder cannot be listed.
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
    files.extend(listing::known(folder, |file| {
        let stage = file.strip_suffix(".parquet")?;
        Some(What::Stage {
            study: name.to_string(),
            stage: stage.to_owned(),
        })
    })?);
    Ok(files)
}

/// Names the file of measured surfaces, which no key knows.
fn with_paths(table: Table, sources: &Sources) -> Table {
    let Ok(contents) = table.texts(CONTENT.name) else {
        return table;
    };
    let paths = contents
        .iter()
        .map(|content| content.and_then(|hash| sources.path_of_hex(hash)))
        .map(|path| {
            path.map(|path| path.display().to_string())
                .unwrap_or_default()
        });
    let paths = texts(paths.collect::<Vec<_>>());
    table.with(vec![(PATH, paths)])
}

/// What a table says of itself. Its columns are described once more in plain JSON, because not
/// every reader of Parquet hands on what Arrow says of fields.
fn metadata(
    plan: &Plan,
    stage: &PlannedStage,
    table: &Table,
    finished: usize,
    digest: String,
) -> Metadata {
    let entry = |name: &str, value: String| (name.to_owned(), value);
    let columns = serde_json::to_string(&table.descriptions()).expect("plain text");
    Metadata {
        key: None,
        entries: vec![
            entry("study", plan.study.clone()),
            entry("stage", stage.name.clone()),
            entry("kind", stage.kind.name().to_owned()),
            entry("tasks", stage.tasks.len().to_string()),
            entry("finished", finished.to_string()),
            entry("columns", columns),
            entry("digest", digest),
            entry("version", env!("CARGO_PKG_VERSION").to_owned()),
        ],
    }
}

/// What decides a stage's table: its tasks, and the names of its files.
fn digest(plan: &Plan, tasks: &[usize], sources: &Sources) -> String {
    let keys: Vec<_> = tasks.iter().map(|&task| plan.tasks[task].key).collect();
    Digest::of(&(FORMAT, keys, sources.paths())).to_string()
}

fn written_for(path: &Path) -> Option<String> {
    let metadata = parquet::metadata(File::open(path).ok()?).ok()?;
    metadata.get("digest").map(str::to_owned)
}
