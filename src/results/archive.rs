//! The tables of finished tasks, from wherever they are.
//!
//! The store has them with their maps. Where it has lost them, as when results are shared alone,
//! the published tables of stages have their rows: a row says which task computed it, and a key
//! says all that decides it, so that it does not matter which of the two is read.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::{PATH, TASK, files_of};
use crate::stages::Kind;
use crate::stages::columns::CONTENT;
use crate::stages::grids::Meshes;
use crate::store::files::read_whole;
use crate::store::key::TaskKey;
use crate::store::listing::What;
use crate::store::parquet::Columns;
use crate::store::table::{Table, TableError};
use crate::store::{Store, StoreError, TaskTables};
use crate::surface_files::{ContentHash, Recollection};

/// A store, and what has been published of a study beside it.
#[derive(Debug)]
pub struct Archive {
    store: Store,
    folder: PathBuf,
    published: OnceLock<Vec<Published>>,
}

/// A stage's table that has been published.
#[derive(Debug)]
struct Published {
    stage: String,
    kind: String,
    table: Table,
    /// The rows of each task that has any.
    rows: HashMap<TaskKey, Vec<usize>>,
}

impl Archive {
    /// What there is in a store, and in the folder of a study's results.
    pub fn of(store: Store, folder: &Path) -> Archive {
        Archive {
            store,
            folder: folder.to_owned(),
            published: OnceLock::new(),
        }
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
        let mut published = self.published().iter();
        published.find_map(|published| {
            let rows = published.table.pick(published.rows.get(&key)?);
            Some(rows.without(&[TASK.name, PATH.name]))
        })
    }

    /// The stages whose tables have been published, and their tasks.
    pub fn published_tasks(&self) -> Vec<(&str, Vec<TaskKey>)> {
        let published = self.published().iter();
        published
            .map(|table| (table.stage.as_str(), table.rows.keys().copied().collect()))
            .collect()
    }

    /// What the files of measured surfaces held when their tables were published.
    pub fn recollection(&self) -> Recollection {
        let generated = self.published().iter();
        let generated = generated.filter(|published| published.kind == Kind::Generate.name());
        let told = generated.filter_map(|published| files(&published.table).ok());
        told.flatten().collect()
    }

    /// Tables that cannot be read have no rows: who asks for one of them by its name hears of it.
    fn published(&self) -> &[Published] {
        self.published.get_or_init(|| {
            let files = files_of(&self.folder).unwrap_or_default().into_iter();
            let tables = files.filter_map(|file| match file.what {
                What::Stage { stage, .. } => Published::read(stage, &file.path).ok()?,
                _ => None,
            });
            tables.collect()
        })
    }
}

impl Published {
    /// Nothing if it is a table whose rows are of no task.
    fn read(stage: String, path: &Path) -> Result<Option<Published>, StoreError> {
        let (table, metadata) = read_whole(path, Columns::Light)?;
        let (Ok(tasks), Some(kind)) = (table.texts(TASK.name), metadata.get("kind")) else {
            return Ok(None);
        };
        let mut rows: HashMap<TaskKey, Vec<usize>> = HashMap::new();
        for (row, task) in tasks.iter().enumerate() {
            if let Some(key) = task.and_then(|task| task.parse().ok()) {
                rows.entry(key).or_default().push(row);
            }
        }
        Ok(Some(Published {
            stage,
            kind: kind.to_owned(),
            rows,
            table,
        }))
    }
}

impl TaskTables for Archive {
    fn have(&self, keys: &[TaskKey]) -> Vec<bool> {
        let mut have = self.store.have(keys);
        for (key, have) in keys.iter().zip(&mut have).filter(|(_, have)| !**have) {
            *have = self
                .published()
                .iter()
                .any(|table| table.rows.contains_key(key));
        }
        have
    }

    fn light(&self, key: TaskKey) -> Result<Table, StoreError> {
        self.store
            .light(key)
            .or_else(|error| match error.is_mendable() {
                true => self.rows_of(key).ok_or(error),
                false => Err(error),
            })
    }
}

/// The files that surfaces were read from: their contents and nodes, by their paths.
fn files(table: &Table) -> Result<Recollection, TableError> {
    let (paths, contents) = (table.texts(PATH.name)?, table.texts(CONTENT.name)?);
    let meshes = Meshes::of(table)?;
    let file = |row: usize| {
        let content = ContentHash::from_hex(contents.value(row))?;
        let nodes = meshes
            .nodes(row)
            .map(|nodes| u32::try_from(nodes).unwrap_or(u32::MAX));
        Some((PathBuf::from(paths.value(row)), (content, nodes)))
    };
    Ok((0..table.rows()).filter_map(file).collect())
}
