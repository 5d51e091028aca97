//! One tidy table per stage, made of its tasks' tables, for polars, pandas or DuckDB to open.
//!
//! Heavy columns stay in the store, where the `task` column finds them. The tables are rewritten
//! after each run, and only if their tasks have changed; whoever looks at a study is
//! [`reading`] and writes nothing.

pub mod archive;
pub mod exceeded_hardness;
pub mod failures;
pub mod owner;
mod publishing;
pub mod reading;

use std::path::{Path, PathBuf};

use crate::plan::Plan;
use asperity_stages::columns::CONTENT;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_tables::column::{Column, ColumnKind};
use asperity_tables::store::StoreError;
use asperity_tables::store::key::Digest;
use asperity_tables::store::listing;
use asperity_tables::store::listing::{Found, What};
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
