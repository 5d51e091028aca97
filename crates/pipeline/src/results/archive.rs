//! The tables of finished tasks, from wherever they are.
//!
//! The store has them with their maps, a file each. The published tables of stages have their rows,
//! too: a row says which task computed it, and a key says all that decides it, so that it does not
//! matter which of the two is read. Where many are needed, one file is read in place of thousands;
//! where the store has lost them, as when results are shared alone, there is no other.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use arrow::array::Array;

use super::published::Published;
use super::{PATH, files_of};
use asperity_stages::columns::{CONTENT, FORMAT, UNIT};
use asperity_stages::grids::Grids;
use asperity_stages::surface_files::{ContentHash, Recalled, Recollection};
use asperity_stages::{Kind, StageError};
use asperity_tables::store::key::TaskKey;
use asperity_tables::store::listing::What;
use asperity_tables::store::{Store, StoreError, TaskTables};
use asperity_tables::table::Table;

/// A store, and what has been published of a study beside it.
#[derive(Debug)]
pub struct Archive {
    store: Store,
    folder: PathBuf,
    stages: OnceLock<Vec<StageFile>>,
}

/// A stage's table that may have been published, read when it is first asked for.
#[derive(Debug)]
struct StageFile {
    stage: String,
    path: PathBuf,
    published: OnceLock<Option<Published>>,
}

impl StageFile {
    /// A table that cannot be read has no rows: who asks for it by its name hears of it.
    fn published(&self) -> Option<&Published> {
        let published = self.published.get_or_init(|| Published::read(&self.path).ok().flatten());
        published.as_ref()
    }
}

impl Archive {
    /// What there is in a store, and in the folder of a study's results.
    pub fn of(store: Store, folder: &Path) -> Archive {
        Archive { store, folder: folder.to_owned(), stages: OnceLock::new() }
    }

    /// The store, which alone has maps.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// The folder of the study's results.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What has been published of a task: its rows, without maps and without what published tables
    /// add.
    pub fn rows_of(&self, key: TaskKey) -> Option<Table> {
        let mut published = self.published();
        published.find_map(|(_, published)| published.rows_of(key))
    }

    /// A task's table without its maps, out of what has been published of a stage: one file, where
    /// the store has one for each task. Nothing if it is not there.
    pub fn published_in(&self, stage: &str, key: TaskKey) -> Option<Table> {
        let mut stages = self.stages().iter();
        let file = stages.find(|file| file.stage == stage)?;
        file.published()?.table_of(key)
    }

    /// The same of as many of these tasks, from the first one on, as lie under each other and have the
    /// same columns: how many rows each of them has, and all their rows.
    pub fn published_in_a_row(
        &self,
        stage: &str,
        keys: impl Iterator<Item = TaskKey>,
    ) -> Option<(Vec<usize>, Table)> {
        let mut stages = self.stages().iter();
        let file = stages.find(|file| file.stage == stage)?;
        file.published()?.table_of_first(keys)
    }

    /// The stages whose tables have been published, and their tasks.
    pub fn published_tasks(&self) -> Vec<(&str, Vec<TaskKey>)> {
        self.published().map(|(stage, published)| (stage, published.tasks().collect())).collect()
    }

    /// What the files of measured surfaces held when their tables were published.
    pub fn recollection(&self) -> Recollection {
        let generated =
            self.published().filter(|(_, published)| published.kind == Kind::Generate.name());
        let tables = generated.filter_map(|(_, published)| published.table().ok());
        let told = tables.filter_map(|table| files(&table).ok());
        told.flatten().collect()
    }

    fn published(&self) -> impl Iterator<Item = (&str, &Published)> {
        let stages = self.stages().iter();
        stages.filter_map(|file| Some((file.stage.as_str(), file.published()?)))
    }

    fn stages(&self) -> &[StageFile] {
        self.stages.get_or_init(|| {
            let files = files_of(&self.folder).unwrap_or_default().into_iter();
            let stages = files.filter_map(|file| match file.what {
                What::Stage { stage, .. } => {
                    Some(StageFile { stage, path: file.path, published: OnceLock::new() })
                }
                _ => None,
            });
            stages.collect()
        })
    }
}

impl TaskTables for Archive {
    fn have(&self, keys: &[TaskKey]) -> Vec<bool> {
        let mut have = self.store.have(keys);
        for (key, have) in keys.iter().zip(&mut have).filter(|(_, have)| !**have) {
            *have = self.published().any(|(_, published)| published.has(*key));
        }
        have
    }

    fn light(&self, key: TaskKey) -> Result<Table, StoreError> {
        self.store.light(key).or_else(|error| match error.is_mendable() {
            true => self.rows_of(key).ok_or(error),
            false => Err(error),
        })
    }
}

/// The files that surfaces were read from, by their paths. Where several rows are about one file, and
/// differ by what was done to its map, the last one stands: the manifest says what they differ by, and
/// nodes and sides are for forecasts alone.
fn files(table: &Table) -> Result<Recollection, StageError> {
    let (paths, contents) = (table.texts(PATH.name)?, table.texts(CONTENT.name)?);
    let units = table.has(UNIT.name).then(|| table.texts(UNIT.name));
    let units = units.transpose()?;
    let formats = table.has(FORMAT.name).then(|| table.texts(FORMAT.name));
    let formats = formats.transpose()?;
    let grids = Grids::of(table)?;
    let file = |row: usize| {
        let grid = grids.grid(row).ok()?;
        let format = formats.filter(|formats| formats.is_valid(row));
        let recalled = Recalled {
            content: ContentHash::from_hex(contents.value(row))?,
            format: format.map(|formats| formats.value(row).to_owned()),
            unit: units.map_or_else(String::new, |units| units.value(row).to_owned()),
            nodes: grid.nodes().map(|nodes| u32::try_from(nodes).unwrap_or(u32::MAX)),
            side: grid.cell().size(),
        };
        Some((PathBuf::from(paths.value(row)), recalled))
    };
    Ok((0..table.rows()).filter_map(file).collect())
}
