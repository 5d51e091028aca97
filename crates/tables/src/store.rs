//! Finished tables on disk, each written once.
//!
//! A table appears under its key whole or not at all: it is written aside, flushed, and linked
//! into place only if nobody else was faster. Equal keys mean equal tables, so losing that race
//! loses nothing, and two processes may share a store. A table is read whole and as it was
//! written, or not at all: its file holds a digest of its bytes and the recipe that its key
//! follows from.

pub mod checkpoints;
pub mod files;
pub mod key;
pub mod listing;
pub mod users;

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::parquet::{self, Columns, Metadata, ParquetError};
use crate::store::files::{Existing, Unflushed, make_folder, read_whole, write_file};
use crate::store::key::{Provenance, TaskKey};
use crate::store::users::Lock;
use crate::table::Table;

/// The folder in a store where tables are written before they get their places.
const STAGING: &str = "unfinished";

/// A folder of finished tables, which stay there as long as somebody holds one of these.
#[derive(Debug, Clone)]
pub struct Store {
    root: PathBuf,
    unflushed: Arc<Unflushed>,
    _lock: Arc<Lock>,
}

/// Where the tables of finished tasks are found, as far as they are no maps.
pub trait TaskTables {
    /// Which of these tasks are finished, in their order.
    fn have(&self, keys: &[TaskKey]) -> Vec<bool>;

    /// A finished task's table without its maps.
    ///
    /// # Errors
    /// When there is none, or it cannot be read.
    fn light(&self, key: TaskKey) -> Result<Table, StoreError>;
}

/// The store cannot do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    #[error("cannot write `{}`", path.display())]
    Write { path: PathBuf, source: io::Error },
    #[error("cannot read `{}`", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("`{}` is damaged or no table of this program", path.display())]
    Damaged { path: PathBuf, source: ParquetError },
    /// A page or a figure has been changed since it was written.
    #[error("`{}` is not as it was written; `asperity report` writes it anew", path.display())]
    Changed { path: PathBuf },
    /// Nobody can tell whether others use the store.
    #[error("cannot lock the store with `{}`", path.display())]
    Lock { path: PathBuf, source: io::Error },
}

impl StoreError {
    /// The error that a reader met in a file. A disk that failed says nothing of what is on it.
    pub(crate) fn in_file(path: &Path, error: ParquetError) -> StoreError {
        let path = path.to_owned();
        match error {
            ParquetError::Read(source) => StoreError::Read { path, source },
            source => StoreError::Damaged { path, source },
        }
    }

    /// Whether no other table could be stored either.
    pub fn affects_all_tables(&self) -> bool {
        use io::ErrorKind::{QuotaExceeded, StorageFull};
        let is_full = matches!(
            self,
            StoreError::Write { source, .. } if [QuotaExceeded, StorageFull].contains(&source.kind())
        );
        is_full || self.is_denied()
    }

    /// Returns whether a file or folder cannot be written for want of permission.
    pub fn is_denied(&self) -> bool {
        use io::ErrorKind::{PermissionDenied, ReadOnlyFilesystem};
        matches!(
            self,
            StoreError::Write { source, .. }
                if [PermissionDenied, ReadOnlyFilesystem].contains(&source.kind())
        )
    }

    /// Whether computing the table again would help: it is damaged, or not there at all.
    pub fn is_recomputable(&self) -> bool {
        match self {
            StoreError::Damaged { .. } => true,
            StoreError::Read { source, .. } => source.kind() == io::ErrorKind::NotFound,
            StoreError::Write { .. } | StoreError::Changed { .. } | StoreError::Lock { .. } => {
                false
            }
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
        Lock::prepare(root);
        Store::open_read_only(root)
    }

    /// The store in this folder, which need not exist: a plan only looks.
    ///
    /// # Errors
    /// When nobody can tell whether the store is pruned just now.
    pub fn open_read_only(root: &Path) -> Result<Store, StoreError> {
        Ok(Store {
            root: root.to_owned(),
            unflushed: Arc::default(),
            _lock: Arc::new(Lock::share(root)?),
        })
    }

    /// Where a task's table is, or would be.
    pub fn path(&self, key: TaskKey) -> PathBuf {
        path(&self.root, key)
    }

    /// Which of these tasks are finished, in their order.
    ///
    /// Where many lie in one folder it is listed: on a parallel file system that costs about as
    /// much as asking for one of them.
    pub fn have(&self, keys: &[TaskKey]) -> Vec<bool> {
        const MANY: usize = 16;
        let mut folders: BTreeMap<u8, Vec<usize>> = BTreeMap::new();
        for (index, key) in keys.iter().enumerate() {
            folders.entry(key.first_byte()).or_default().push(index);
        }
        let mut have = vec![false; keys.len()];
        for wanted in folders.into_values() {
            let folder = self.path(keys[wanted[0]]);
            let listed = match folder.parent() {
                Some(folder) if wanted.len() >= MANY => listing::finished_in(folder).ok(),
                _ => None,
            };
            for index in wanted {
                have[index] = match &listed {
                    Some(finished) => finished.contains(&keys[index]),
                    None => self.has(keys[index]),
                };
            }
        }
        have
    }

    pub fn has(&self, key: TaskKey) -> bool {
        self.path(key).is_file()
    }

    /// Whether a damaged file of the task is in quarantine.
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
        let keys = names.iter().filter_map(|name| name.strip_suffix(".parquet"));
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
        read_keyed(&self.path(key), key, columns)
    }

    /// Whether a task's file is as it was written, and the one that its name says; its rows are not
    /// looked at, whose digest holds.
    ///
    /// # Errors
    /// As [`Store::read`].
    pub fn verify(&self, key: TaskKey) -> Result<(), StoreError> {
        let path = self.path(key);
        owned(&path, key, files::verify_whole(&path)?).map(drop)
    }

    /// Stores a finished task's table for good, under the key that follows from its provenance.
    ///
    /// # Errors
    /// When the disk is full, or the folder cannot be written.
    pub fn publish(&self, provenance: &Provenance, table: &Table) -> Result<(), StoreError> {
        let path = self.path(provenance.key());
        let bytes = parquet::encode(table, &provenance.metadata());
        write_file(&path, &bytes, Existing::Keep, &self.staging())?;
        self.unflushed.add(&path)
    }

    /// Sees to it that every table that has been published is found after a power cut, too. Whole it
    /// is in any case.
    ///
    /// # Errors
    /// When a folder cannot be flushed.
    pub fn flush(&self) -> Result<(), StoreError> {
        self.unflushed.flush()
    }

    /// Where tables lie while they are written: in the store, for they cannot change their names
    /// from one disk to another.
    fn staging(&self) -> PathBuf {
        self.root.join(STAGING)
    }

    /// Renames a task's damaged file, so that its table can be computed again; its new name, or
    /// none if another process has already mended it.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn quarantine(&self, key: TaskKey) -> Result<Option<PathBuf>, StoreError> {
        let path = self.path(key);
        let Some(quarantined) = files::quarantine(&path)? else {
            return Ok(None);
        };
        // Between looking and renaming, another process may have put a sound table there.
        if read_keyed(&quarantined, key, Columns::Light).is_err() {
            return Ok(Some(quarantined));
        }
        let back = std::fs::rename(&quarantined, &path);
        back.map_err(|source| StoreError::Write { path, source })?;
        Ok(None)
    }
}

impl TaskTables for Store {
    fn have(&self, keys: &[TaskKey]) -> Vec<bool> {
        Store::have(self, keys)
    }

    fn light(&self, key: TaskKey) -> Result<Table, StoreError> {
        self.read(key, Columns::Light)
    }
}

/// Where a task's table is, or would be. Folders by the key's first two digits keep listings
/// short.
pub fn path(root: &Path, key: TaskKey) -> PathBuf {
    let name = key.to_string();
    let mut path = root.join(&name[..2]);
    path.push(name + ".parquet");
    path
}

/// The table in a file, if it is that of the task, and how it came about.
fn read_keyed(
    path: &Path,
    key: TaskKey,
    columns: Columns,
) -> Result<(Table, Provenance), StoreError> {
    let (table, metadata) = read_whole(path, columns)?;
    Ok((table, owned(path, key, metadata)?))
}

/// How the table in a file came about, if it is that of the task.
fn owned(path: &Path, key: TaskKey, metadata: Metadata) -> Result<Provenance, StoreError> {
    let told = Provenance::from_metadata(&metadata).filter(|told| told.key() == key);
    told.filter(|_| metadata.key == Some(key)).ok_or_else(|| StoreError::Damaged {
        path: path.to_owned(),
        source: ParquetError::Foreign { owner: format!("task {key}") },
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::column::{Column, ColumnKind, reals};

    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");

    fn provenance(recipe: &str) -> Provenance {
        Provenance {
            stage: "test".to_owned(),
            version: 1,
            recipe: recipe.to_owned(),
            inputs: vec![],
            input_identities: vec![],
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
    fn many_keys_looked_for_at_once_are_those_looked_for_one_by_one() {
        let (_folder, store, key, _) = fixture();
        let shares_its_folder = |number: u32| {
            let other = provenance(&number.to_string()).key();
            (other.first_byte() == key.first_byte()).then_some(other)
        };
        let absent: Vec<TaskKey> = (0..20_000).filter_map(shares_its_folder).collect();
        assert!(absent.len() > 30, "enough for the folder to be listed");
        let keys = [&absent[..9], &[key], &absent[9..]].concat();
        let one_by_one: Vec<bool> = keys.iter().map(|&key| store.has(key)).collect();
        assert_eq!(store.have(&keys), one_by_one);
        assert_eq!(store.have(&absent), vec![false; absent.len()]);
        assert!(store.have(&keys)[9]);
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
        assert_eq!(fs::read_dir(store.staging()).unwrap().count(), 0);
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
    fn a_quarantined_file_makes_room_for_a_sound_one() {
        let (_folder, store, key, table) = fixture();
        for number in ["", "-2"] {
            fs::write(store.path(key), "not a table").unwrap();
            let quarantined = store.quarantine(key).unwrap().unwrap();
            let name = format!("{key}.parquet.damaged{number}");
            assert_eq!(quarantined.file_name().unwrap().to_str(), Some(name.as_str()));
            assert_eq!(fs::read(quarantined).unwrap(), b"not a table");
            assert!(!store.has(key));
            store.publish(&provenance("{}"), &table).unwrap();
        }
        assert_eq!(store.read(key, Columns::All).unwrap(), table);
    }

    #[test]
    fn a_sound_file_is_not_quarantined() {
        let (_folder, store, key, table) = fixture();
        assert_eq!(store.quarantine(key).unwrap(), None);
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
        assert_eq!(parquet::encode(&table, &metadata), parquet::encode(&table, &metadata));
    }
}
