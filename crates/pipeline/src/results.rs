//! Published tables of results, one per stage, to be read with polars, pandas or DuckDB.
//!
//! The table of a stage combines the tables of its tasks. Large columns such as maps stay in the
//! store; the column `task` has the key under which the store has them. A run rewrites a table only
//! if its tasks have changed. [`StudyResults`] reads the results of a study and writes nothing.

pub mod failures;
pub mod owner;
mod published_stage;
mod publishing;
pub mod reader;
pub mod warnings;

use std::path::{Path, PathBuf};

use crate::adaptive_sampling::{ClaimRule, SampledStudy, SamplingError};
use crate::manifest::setting::Setting;
use crate::plan::{Plan, PlannedStage};
use crate::results::publishing::{RowContext, TableParts};
use crate::results::reader::ResultReader;
use crate::study::{EmptyTables, Stage, Study};
use asperity_manifest::diagnostics::ManifestErrors;
use asperity_stages::StageError;
use asperity_stages::absolute::AbsoluteColumns;
use asperity_stages::columns::CONTENT;
use asperity_stages::fit::limits::columns::AS_QUANTITY;
use asperity_stages::surface::labels::PATH;
use asperity_stages::units::TableUnits;
use asperity_tables::column::{Column, ColumnKind, Description};
use asperity_tables::key::Digest;
use asperity_tables::parquet::Metadata;
use asperity_tables::source::TableSource;
use asperity_tables::store::listing::{FileKind, StoredFile};
use asperity_tables::store::{Store, StoreError, TaskTables, listing};
use asperity_tables::table::{Table, TableError};

pub use publishing::{PublishedTable, publish};

/// Version of the format of published tables. Increase it when the format of their metadata
/// changes, so that existing tables are rewritten.
const FORMAT: u32 = 4;

/// Name of the folder with a study's figures, beside its tables.
pub const FIGURES: &str = "figures";

pub const TASK: Column =
    Column::result("task", ColumnKind::Text, "", "key of the task that computed the row");

/// Names of the columns that only published tables have.
pub const OWN_COLUMNS: [&str; 2] = [TASK.name, PATH.name];

/// A study with its existing results, for reading only. If the study is unfinished or its store is
/// lost, the rows of all existing tables can be read.
#[derive(Debug)]
pub struct StudyResults {
    pub study: Study,
    pub plan: Plan,
    pub reader: ResultReader,
    folder: PathBuf,
    empty_tables: EmptyTables,
}

/// Rows of a stage's finished tasks.
#[derive(Debug)]
pub struct StageRows<T = Table> {
    pub stage: String,
    /// Path of the stage's table, which need not exist.
    pub path: PathBuf,
    /// Tasks to which the rows belong, in the order of the plan.
    pub tasks: Vec<usize>,
    /// Rows of the tasks, or `None` if no task is finished.
    pub table: Option<T>,
    /// Digest that changes whenever the rows can change.
    pub digest: String,
    /// True if the published table has exactly these rows.
    pub is_published: bool,
}

/// Reads a manifest with settings as [`Study::read`] does. If a surface file is missing, it is
/// assumed to have the same content as when the results were published.
pub fn read_study(
    manifest: &Path,
    settings: &[Setting],
    store: &Store,
    folder: &Path,
) -> Result<Study, ManifestErrors> {
    Study::read_recalling(manifest, settings, |name| {
        ResultReader::new(store.clone(), &folder.join(name)).recollection()
    })
}

impl StudyResults {
    /// Opens the existing results of a study.
    ///
    /// # Errors
    /// Returns an error if a table that decides the number of surfaces cannot be read.
    pub fn new(
        study: Study,
        store: Store,
        folder: &Path,
        rule: &dyn ClaimRule,
    ) -> Result<StudyResults, SamplingError> {
        let reader = ResultReader::new(store, &folder.join(&study.name));
        let SampledStudy { study, plan, .. } = SampledStudy::from_tables(study, &reader, rule)?;
        let empty_tables = EmptyTables::new(&study);
        Ok(StudyResults { study, plan, reader, folder: folder.to_owned(), empty_tables })
    }

    /// Reads the rows of every stage, in the order of the plan.
    pub fn all(&self) -> Result<Vec<StageRows>, ResultsError> {
        let stages = self.plan.stages.iter();
        stages.map(|stage| self.rows(stage)).collect()
    }

    /// Reads the rows of one stage into memory; see [`StudyResults::open`].
    pub fn rows(&self, stage: &PlannedStage) -> Result<StageRows, ResultsError> {
        let StageRows { stage, path, tasks, table, digest, is_published } = self.open(stage)?;
        let table = table.map(|source| source.table()).transpose()?;
        Ok(StageRows { stage, path, tasks, table, digest, is_published })
    }

    /// Opens the rows of one stage.
    ///
    /// If the published table has exactly the finished tasks, or all tasks, it is opened without
    /// reading the rows. Otherwise the rows are read task by task.
    ///
    /// # Errors
    /// Returns an error if a table is damaged and its rows are found nowhere else.
    pub fn open(&self, stage: &PlannedStage) -> Result<StageRows<TableSource>, ResultsError> {
        let StudyResults { plan, reader, .. } = self;
        let sources = &self.study.sources;
        let (description, absolute) = &described(&self.empty_tables, &self.study, &stage.name)?;
        let conversion = &self.study.conversion(&stage.name);
        let path = path(&self.folder, &plan.study, &stage.name);
        let mut published = TableSource::open(&path);
        let stored = stage.tasks_where(&reader.store().have(&plan.tables_of(stage)));
        let rows = |tasks, table, digest, is_published| StageRows {
            stage: stage.name.clone(),
            path: path.clone(),
            tasks,
            table,
            digest,
            is_published,
        };
        let context = RowContext { plan, stage, sources, description, absolute, conversion };
        for tasks in [stored, stage.tasks.clone()] {
            let digest = digest(context, &tasks);
            let is_it = |metadata: &Metadata| metadata.get("digest") == Some(&digest);
            published = match published {
                Ok((table, metadata)) if !tasks.is_empty() && is_it(&metadata) => {
                    return Ok(rows(tasks, Some(table), digest, true));
                }
                other => other,
            };
        }
        let mut parts = TableParts::within(usize::MAX);
        for &task in &stage.tasks {
            let table = &plan.tasks[task].table;
            let published = reader.published_table(&stage.name, table);
            match published.map_or_else(|| reader.light(table), Ok) {
                Err(StoreError::Read { source, .. })
                    if source.kind() == std::io::ErrorKind::NotFound => {}
                read => parts.add(task, read)?,
            }
        }
        match published {
            // The damaged published table may have been the only copy of the rows.
            Err(error @ StoreError::Damaged { .. }) if parts.is_empty() => Err(error.into()),
            _ => {
                let (tasks, table) = parts.stacked(context)?;
                let digest = digest(context, &tasks);
                Ok(rows(tasks, table.map(Into::into), digest, false))
            }
        }
    }
}

/// Error of reading or writing the results of a study.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// The store or the folder of results could not be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Tables of finished tasks are damaged or missing.
    #[error("{}", damaged(tables))]
    Damaged {
        /// Tasks, with the error of reading each table.
        tables: Vec<(usize, StoreError)>,
    },
    /// The tables of two tasks contradict each other.
    #[error("cannot combine the tables of stage `{stage}`")]
    Table { stage: String, source: TableError },
    /// The columns of a stage cannot be derived from the columns of its inputs.
    #[error("cannot derive the columns of stage `{stage}` from its inputs")]
    Columns { stage: String, source: StageError },
}

/// Returns the table of a stage without rows, and the columns of absolute numbers in it. Its
/// columns have the units and meanings that the tables of the store lack.
fn described(
    tables: &EmptyTables,
    study: &Study,
    stage: &str,
) -> Result<(Table, AbsoluteColumns), ResultsError> {
    let unknown = |source| ResultsError::Columns { stage: stage.to_owned(), source };
    let (absolute, quantity) = study.absolute_columns(tables, stage).map_err(unknown)?;
    let table = tables.named(study, stage).map_err(unknown)?;
    let conversion = study.conversion(stage);
    let named = absolute.beside(table).with_named_units(|unit| match &quantity {
        // The limit of an observable stays in the unit of the store.
        Some(quantity) if unit == AS_QUANTITY => conversion.from.name(quantity),
        _ => conversion.name(unit),
    });
    Ok((named, absolute))
}

/// Name of the metadata entry of a published table whose numbers are not in the units of the store.
/// It has the units of the store, and the rows of such a table are no inputs of tasks.
const CONVERTED: &str = "converted_from";

/// Returns the columns of the published table of each stage, with the units that the study names.
///
/// # Errors
/// Returns an error if an SQL query of the study cannot be evaluated.
pub fn published_columns(study: &Study) -> Result<Vec<Vec<Description>>, ResultsError> {
    let tables = EmptyTables::new(study);
    let columns = |stage: &Stage| {
        let (table, _) = described(&tables, study, &stage.name)?;
        Ok(with_own_columns(table).descriptions_in_units())
    };
    study.stages.iter().map(columns).collect()
}

/// Returns a table without rows, with the columns of `table` and those that only published tables
/// have.
fn with_own_columns(table: Table) -> Table {
    let has_path = table.has(PATH.name) || !table.has(CONTENT.name);
    let own: &[Column] = if has_path { &[TASK] } else { &[PATH, TASK] };
    // A query such as `SELECT max(load)` answers an empty table with a row.
    table.slice(0..0).beside(&Table::empty(own))
}

/// Returns the path of a stage's table, which need not exist.
pub fn path(folder: &Path, study: &str, stage: &str) -> PathBuf {
    folder.join(study).join(file(stage))
}

fn file(stage: &str) -> String {
    format!("{stage}.parquet")
}

fn damaged(tables: &[(usize, StoreError)]) -> String {
    let (others, them) = match tables.len() {
        0 | 1 => (String::new(), "it"),
        2 => (" (and 1 more damaged table)".to_owned(), "them"),
        all => (format!(" (and {} more damaged tables)", all - 1), "them"),
    };
    let first = tables.first().map_or_else(String::new, |(_, error)| error.to_string());
    format!("{first}{others}; run `asperity run` to recompute {them}")
}

/// Lists the files that this program has written to the results folders of all studies.
pub fn files(folder: &Path) -> Result<Vec<StoredFile>, StoreError> {
    let mut files = Vec::new();
    for study in listing::folders(folder)? {
        files.extend(files_of(&study)?);
    }
    Ok(files)
}

/// Lists the published tables of stages that the study no longer has.
pub fn orphans(plan: &Plan, folder: &Path) -> Result<Vec<PathBuf>, StoreError> {
    let is_orphan = |what: &FileKind| match what {
        FileKind::Stage { study, stage } => !plan.has_table(study, stage),
        _ => false,
    };
    let mut files = files_of(&folder.join(&plan.study))?;
    files.retain(|file| is_orphan(&file.what));
    Ok(files.into_iter().map(|file| file.path).collect())
}

/// Lists the files that this program has written to the results folder of one study. Figures are
/// not listed, except unfinished ones.
fn files_of(folder: &Path) -> Result<Vec<StoredFile>, StoreError> {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let mut files = listing::known(&folder.join(FIGURES), |_| None)?;
    let study = || name.to_string();
    files.extend(listing::known(folder, |file| match file {
        owner::FILE | owner::EFFECTIVE_MANIFEST => Some(FileKind::Owner { study: study() }),
        table => Some(FileKind::Stage {
            study: study(),
            stage: table.strip_suffix(".parquet")?.to_owned(),
        }),
    })?);
    Ok(files)
}

/// Returns the digest of a published table, computed from the keys of `tasks`, the paths of the
/// surface files, the descriptions of the columns, the units of output and the modulus of columns
/// that no column of the table contains.
fn digest(context: RowContext, tasks: &[usize]) -> String {
    let RowContext { plan, sources, description, absolute, conversion, .. } = context;
    let keys: Vec<_> = tasks.iter().map(|&task| plan.tasks[task].key).collect();
    let content = (FORMAT, keys, sources.paths(), description.descriptions_in_units());
    let digest = match absolute.modulus() {
        None if conversion.is_none() => Digest::from_params(&content),
        modulus => {
            let TableUnits { length, pressure } = &conversion.to;
            Digest::from_params(&(content, length, pressure, modulus))
        }
    };
    if !plan.labels.is_empty() {
        return Digest::from_params(&(digest.to_string(), &plan.labels)).to_string();
    }
    digest.to_string()
}
