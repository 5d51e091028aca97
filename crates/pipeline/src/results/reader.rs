//! Reader of the tables of finished tasks, from the store or from published tables.
//!
//! The store has the tables of tasks, with maps. The published table of a stage has the same rows
//! without maps. Each row has the key of its task, which decides all values together with the load
//! of the row, so both sources are equivalent. If many tasks are read, the published table replaces
//! thousands of files of the store. It is the only source if the store is lost or was not shared
//! with the results.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use arrow::array::Array;

use super::published_stage::PublishedStage;
use crate::results::files_of;
use asperity_stages::columns::{CONTENT, FILLED_NODES, FORMAT, UNIT};
use asperity_stages::grids::Grids;
use asperity_stages::surface::labels::PATH;
use asperity_stages::surface_files::{ContentHash, RecordedFile, RecordedFiles};
use asperity_stages::{Kind, StageError};
use asperity_tables::store::listing::FileKind;
use asperity_tables::store::series::TableRef;
use asperity_tables::store::{Store, StoreError, TaskTables};
use asperity_tables::table::Table;

type StageFiles = BTreeMap<String, (PathBuf, OnceLock<Option<PublishedStage>>)>;

/// Reader of the tables of one study, from its store and its published tables.
#[derive(Debug)]
pub struct ResultReader {
    store: Store,
    folder: PathBuf,
    /// Files of the tables of stages, by stage, each opened when it is first needed. A table that
    /// cannot be read is `None`; the error is reported when the results of the stage are opened.
    stages: OnceLock<StageFiles>,
}

impl ResultReader {
    /// Creates a reader for a store and the results folder of a study.
    pub fn new(store: Store, folder: &Path) -> ResultReader {
        ResultReader { store, folder: folder.to_owned(), stages: OnceLock::new() }
    }

    /// Returns the store, which is the only source of maps.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// Reads the table of a task from the store, without maps.
    pub fn stored(&self, table: &TableRef) -> Result<Table, StoreError> {
        self.store.light(table)
    }

    /// Returns the published rows of a task, without the columns that publishing adds. Returns
    /// `None` if no published table has the task.
    pub fn rows_of(&self, table: &TableRef) -> Option<Table> {
        self.published().find_map(|published| published.rows_of(table))
    }

    /// Returns the table of a task, without maps, from the published table of its stage. Returns
    /// `None` if the published table lacks the task.
    pub fn published_table(&self, stage: &str, table: &TableRef) -> Option<Table> {
        self.stage(stage)?.table_of(table)
    }

    /// Reads the first of the tables `tables` together, from the published table of a stage: as
    /// many as are consecutive there and have few enough rows for one read. Returns the number of
    /// rows of each, and one table with all these rows.
    pub fn published_consecutive<'a>(
        &self,
        stage: &str,
        tables: impl Iterator<Item = &'a TableRef>,
    ) -> Option<(Vec<usize>, Table)> {
        self.stage(stage)?.leading_tables(tables)
    }

    /// Returns the properties that the files of measured surfaces had when the tables were
    /// published.
    pub fn recollection(&self) -> RecordedFiles {
        let generated = self.published().filter(|stage| stage.kind == Kind::Generate.name());
        generated.filter_map(|stage| files(&stage.table().ok()?).ok()).flatten().collect()
    }

    fn published(&self) -> impl Iterator<Item = &PublishedStage> {
        self.stages().keys().filter_map(|stage| self.stage(stage))
    }

    fn stage(&self, stage: &str) -> Option<&PublishedStage> {
        let (path, published) = self.stages().get(stage)?;
        published.get_or_init(|| PublishedStage::read(path).ok().flatten()).as_ref()
    }

    fn stages(&self) -> &StageFiles {
        self.stages.get_or_init(|| {
            let files = files_of(&self.folder).unwrap_or_default().into_iter();
            let stages = files.filter_map(|file| match file.what {
                FileKind::Stage { stage, .. } => Some((stage, (file.path, OnceLock::new()))),
                _ => None,
            });
            stages.collect()
        })
    }
}

impl TaskTables for ResultReader {
    fn have(&self, tables: &[&TableRef]) -> Vec<bool> {
        let mut have = self.store.have(tables);
        for (table, have) in tables.iter().zip(&mut have).filter(|(_, have)| !**have) {
            *have = self.published().any(|published| published.has(table));
        }
        have
    }

    fn light(&self, table: &TableRef) -> Result<Table, StoreError> {
        self.stored(table).or_else(|error| {
            if error.is_recomputable() { self.rows_of(table).ok_or(error) } else { Err(error) }
        })
    }
}

/// Returns the properties of the files of measured surfaces, by path.
///
/// If several rows are about the same file, the last one is used. Such rows differ only in how the
/// map was prepared, and their nodes and sides are used only for forecasts. The map of a file was
/// filled if it was filled in one of the rows.
fn files(table: &Table) -> Result<RecordedFiles, StageError> {
    let (paths, contents) = (table.texts(PATH.name)?, table.texts(CONTENT.name)?);
    let units = table.optional(UNIT.name, Table::texts)?;
    let formats = table.optional(FORMAT.name, Table::texts)?;
    let grids = Grids::new(table)?;
    let filled = table.optional(FILLED_NODES.name, Table::integers)?;
    let file = |row: usize| {
        let grid = grids.grid(row).ok()?;
        let format = formats.filter(|formats| formats.is_valid(row));
        let recalled = RecordedFile {
            content: ContentHash::from_hex(contents.value(row))?,
            format: format.map(|formats| formats.value(row).to_owned()),
            unit: units.map_or_else(String::new, |units| units.value(row).to_owned()),
            nodes: grid.nodes().map(|nodes| u32::try_from(nodes).unwrap_or(u32::MAX)),
            side: grid.cell().size(),
            is_filled: filled.is_some_and(|nodes| nodes.is_valid(row) && nodes.value(row) > 0),
        };
        Some((PathBuf::from(paths.value(row)), recalled))
    };
    let mut files = RecordedFiles::new();
    for (path, mut recalled) in (0..table.rows()).filter_map(file) {
        recalled.is_filled |= files.get(&path).is_some_and(|before| before.is_filled);
        files.insert(path, recalled);
    }
    Ok(files)
}
