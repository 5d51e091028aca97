//! Finished tables on disk, each written once.
//!
//! A table appears under its key whole or not at all: it is written aside, flushed, and linked
//! into place only if nobody else was faster. Equal keys mean equal tables, so losing that race
//! loses nothing, and two processes may share a store. A table is read whole and as it was
//! written, or not at all: its file holds a digest of its bytes and the recipe that its key
//! follows from.

pub mod cells;
pub mod column;
pub mod files;
pub mod key;
pub mod listing;
pub mod lock;
pub mod parquet;
pub mod provenance;
pub mod table;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::store::files::{Existing, make_folder, read_whole, write_whole};
use crate::store::key::TaskKey;
use crate::store::lock::Lock;
use crate::store::parquet::{Columns, ParquetError};
use crate::store::provenance::Provenance;
use crate::store::table::Table;

/// The folder in a store where tables are written before they get their places.
const WORKSHOP: &str = "unfinished";

/// A folder of finished tables, which stay there as long as somebody holds one of these.
#[derive(Debug, Clone)]
pub struct Store {
    root: PathBuf,
    _lock: Arc<Lock>,
}

/// The store cannot do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// A file or folder cannot be written.
    #[error("cannot write `{}`", path.display())]
    Write {
        /// Where.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file cannot be read.
    #[error("cannot read `{}`", path.display())]
    Read {
        /// Where.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file is no table, or a damaged one.
    #[error("`{}` is damaged or no table of this program", path.display())]
    Damaged {
        /// Where.
        path: PathBuf,
        /// What the reader met.
        source: ParquetError,
    },
    /// Nobody can tell whether others use the store.
    #[error("cannot lock the store with `{}`", path.display())]
    Lock {
        /// The file to be locked.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl StoreError {
    /// Whether no other table could be stored either.
    pub fn concerns_all(&self) -> bool {
        use io::ErrorKind::{PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull};
        let everywhere = [
            PermissionDenied,
            QuotaExceeded,
            ReadOnlyFilesystem,
            StorageFull,
        ];
        matches!(self, StoreError::Write { source, .. } if everywhere.contains(&source.kind()))
    }

    /// Whether computing the table again would help: it is damaged, or not there at all.
    pub fn is_mendable(&self) -> bool {
        match self {
            StoreError::Damaged { .. } => true,
            StoreError::Read { source, .. } => source.kind() == io::ErrorKind::NotFound,
            StoreError::Write { .. } | StoreError::Lock { .. } => false,
        }
    }
}

impl Store {
    /// The store in this folder, which is made if it does not exist.
    ///
    /// # Errors
    /// When the folder cannot be made, or nobody can tell whether it is pruned just now.
    pub fn open(root: &Path) -> Result<Store, StoreError> {
        make_folder(root)?;
        Store::look(root)
    }

    /// The store in this folder, which need not exist: a plan only looks.
    ///
    /// # Errors
    /// When nobody can tell whether the store is pruned just now.
    pub fn look(root: &Path) -> Result<Store, StoreError> {
        Ok(Store {
            root: root.to_owned(),
            _lock: Arc::new(Lock::share(root)?),
        })
    }

    /// Where a task's table is, or would be.
    pub fn path(&self, key: TaskKey) -> PathBuf {
        path(&self.root, key)
    }

    /// Whether a task is finished.
    pub fn has(&self, key: TaskKey) -> bool {
        self.path(key).is_file()
    }

    /// Whether a damaged file of the task has been set aside.
    pub fn has_damaged(&self, key: TaskKey) -> bool {
        let mut name = self.path(key).into_os_string();
        name.push(files::DAMAGED);
        Path::new(&name).is_file()
    }

    /// The finished tasks whose keys begin with these digits, at least two of them.
    ///
    /// # Errors
    /// When the folder cannot be listed.
    pub fn finished(&self, digits: &str) -> Result<Vec<TaskKey>, StoreError> {
        let Some(folder) = digits.get(..2).map(|first| self.root.join(first)) else {
            return Ok(Vec::new());
        };
        let names = files::names(&folder)?;
        let keys = names
            .iter()
            .filter_map(|name| name.strip_suffix(".parquet"));
        let meant = keys.filter(|key| key.starts_with(digits));
        Ok(meant.filter_map(|key| key.parse().ok()).collect())
    }

    /// A finished task's table.
    ///
    /// # Errors
    /// When the file is missing, unreadable or damaged, or its content does not belong to the key.
    pub fn read(&self, key: TaskKey, columns: Columns) -> Result<Table, StoreError> {
        Ok(self.read_with_provenance(key, columns)?.0)
    }

    /// A finished task's table, and how it came about.
    ///
    /// # Errors
    /// As [`Store::read`].
    pub fn read_with_provenance(
        &self,
        key: TaskKey,
        columns: Columns,
    ) -> Result<(Table, Provenance), StoreError> {
        read_as(&self.path(key), key, columns)
    }

    /// Stores a finished task's table for good, under the key that follows from its provenance.
    ///
    /// # Errors
    /// When the disk is full, or the folder cannot be written.
    pub fn publish(&self, provenance: &Provenance, table: &Table) -> Result<(), StoreError> {
        let path = self.path(provenance.key());
        let bytes = parquet::encode(table, &provenance.metadata());
        write_whole(&path, &bytes, Existing::Keep, &self.workshop())
    }

    /// Where tables lie while they are written: in the store, for they cannot change their names
    /// from one disk to another.
    fn workshop(&self) -> PathBuf {
        self.root.join(WORKSHOP)
    }

    /// Renames a task's damaged file, so that its table can be computed again; its new name, or
    /// none if another process has already mended it.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn set_aside(&self, key: TaskKey) -> Result<Option<PathBuf>, StoreError> {
        let path = self.path(key);
        let Some(aside) = files::set_aside(&path)? else {
            return Ok(None);
        };
        // Between looking and renaming, another process may have put a sound table there.
        if read_as(&aside, key, Columns::Light).is_err() {
            return Ok(Some(aside));
        }
        let back = std::fs::rename(&aside, &path);
        back.map_err(|source| StoreError::Write { path, source })?;
        Ok(None)
    }
}

/// Where a task's table is, or would be. Folders by the key's first two digits keep listings
/// short.
fn path(root: &Path, key: TaskKey) -> PathBuf {
    let name = key.to_string();
    let mut path = root.join(&name[..2]);
    path.push(name + ".parquet");
    path
}

/// The table in a file, if it is that of the task, and how it came about.
fn read_as(path: &Path, key: TaskKey, columns: Columns) -> Result<(Table, Provenance), StoreError> {
    let (table, metadata) = read_whole(path, columns)?;
    let told = Provenance::of(&metadata).filter(|told| told.key() == key);
    if let Some(provenance) = told.filter(|_| metadata.key == Some(key)) {
        return Ok((table, provenance));
    }
    Err(StoreError::Damaged {
        path: path.to_owned(),
        source: ParquetError::Foreign {
            owner: format!("task {key}"),
        },
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::column::{Column, ColumnKind, reals};
    use super::*;

    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");

    fn provenance(recipe: &str) -> Provenance {
        Provenance {
            stage: "test".to_owned(),
            version: 1,
            recipe: recipe.to_owned(),
            inputs: vec![],
            read_as: vec![],
        }
    }

    /// A store with one table in it.
    fn fixture() -> (tempfile::TempDir, Store, TaskKey, Table) {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&folder.path().join("store")).unwrap();
        let made = provenance("{}");
        let table = Table::new(2, vec![(AREA, reals([0.25, 0.5]))]);
        assert!(!store.has(made.key()));
        store.publish(&made, &table).unwrap();
        (folder, store, made.key(), table)
    }

    fn is_damaged(store: &Store, key: TaskKey) -> bool {
        let read = store.read(key, Columns::All);
        matches!(read, Err(StoreError::Damaged { .. }))
    }

    #[test]
    fn a_published_table_is_read_back() {
        let (_folder, store, key, table) = fixture();
        assert!(store.has(key));
        assert_eq!(store.read(key, Columns::All).unwrap(), table);
    }

    #[test]
    fn a_published_table_is_never_rewritten() {
        let (_folder, store, key, table) = fixture();
        let other = Table::new(1, vec![(AREA, reals([9.0]))]);
        store.publish(&provenance("{}"), &other).unwrap();
        assert_eq!(store.read(key, Columns::All).unwrap(), table);
    }

    #[test]
    fn publishing_leaves_nothing_else_behind() {
        let (_folder, store, key, table) = fixture();
        store.publish(&provenance("{}"), &table).unwrap();
        let folder = store.path(key).parent().unwrap().to_owned();
        assert_eq!(fs::read_dir(folder).unwrap().count(), 1);
        assert_eq!(fs::read_dir(store.workshop()).unwrap().count(), 0);
    }

    #[test]
    fn a_truncated_an_empty_and_a_foreign_file_are_damaged() {
        let (_folder, store, key, table) = fixture();
        let path = store.path(key);
        let whole = fs::read(&path).unwrap();
        for length in [0, 1, whole.len() / 2, whole.len() - 7] {
            fs::write(&path, &whole[..length]).unwrap();
            assert!(is_damaged(&store, key), "{length} bytes");
        }
        let other = provenance("[]");
        store.publish(&other, &table).unwrap();
        fs::write(store.path(other.key()), &whole).unwrap();
        assert!(is_damaged(&store, other.key()));
    }

    #[test]
    fn a_table_under_a_key_that_does_not_follow_from_its_recipe_is_damaged() {
        let (_folder, store, key, table) = fixture();
        let mut metadata = provenance("another recipe").metadata();
        metadata.key = Some(key);
        fs::write(store.path(key), parquet::encode(&table, &metadata)).unwrap();
        assert!(is_damaged(&store, key));
    }

    #[test]
    fn every_flipped_bit_is_found() {
        let (_folder, store, key, _) = fixture();
        let path = store.path(key);
        let whole = fs::read(&path).unwrap();
        for position in 0..whole.len() {
            let mut flipped = whole.clone();
            flipped[position] ^= 1 << (position % 8);
            fs::write(&path, &flipped).unwrap();
            assert!(is_damaged(&store, key), "byte {position}");
        }
    }

    #[test]
    fn a_damaged_file_set_aside_makes_room_for_a_sound_one() {
        let (_folder, store, key, table) = fixture();
        for number in ["", "-2"] {
            fs::write(store.path(key), "not a table").unwrap();
            let aside = store.set_aside(key).unwrap().unwrap();
            let name = format!("{key}.parquet.damaged{number}");
            assert_eq!(aside.file_name().unwrap().to_str(), Some(name.as_str()));
            assert_eq!(fs::read(aside).unwrap(), b"not a table");
            assert!(!store.has(key));
            store.publish(&provenance("{}"), &table).unwrap();
        }
        assert_eq!(store.read(key, Columns::All).unwrap(), table);
    }

    #[test]
    fn a_sound_file_is_not_set_aside() {
        let (_folder, store, key, table) = fixture();
        assert_eq!(store.set_aside(key).unwrap(), None);
        assert_eq!(store.read(key, Columns::All).unwrap(), table);
    }

    #[test]
    fn a_folder_in_place_of_a_table_is_an_error() {
        let (_folder, store, _, table) = fixture();
        let other = provenance("[]");
        fs::create_dir_all(store.path(other.key())).unwrap();
        assert!(store.publish(&other, &table).is_err());
    }

    #[test]
    fn equal_tables_give_equal_bytes() {
        let (_folder, _store, _key, table) = fixture();
        let metadata = provenance("{}").metadata();
        assert_eq!(
            parquet::encode(&table, &metadata),
            parquet::encode(&table, &metadata)
        );
    }
}
