//! Store of finished tables on disk. Each table is written once, under its key.
//!
//! Writing is atomic: a table is written to a staging folder, flushed, and renamed to its final
//! path. Equal keys mean equal tables, so several processes can share a store. If two of them
//! compute the same table, it does not matter whose file is kept. A file contains a
//! digest of its bytes and the recipe from which its key was computed. Reading verifies both.
//!
//! Read-only stores can lie below a store, see [`Store::above`]. Reading searches the own folder
//! first and then these layers; writing concerns the own folder only.

pub mod files;
pub mod layers;
pub mod listing;
mod permissions;
pub mod provenance;
pub mod regular;
pub mod series;
pub mod users;

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::key::TaskKey;
use crate::parallel;
use crate::parquet::{self, Columns, Metadata, ParquetError};
use crate::store::files::{Unflushed, make_folder, write_file};
use crate::store::layers::{Layers, ListedStore};
use crate::store::permissions::explained;
use crate::store::provenance::Provenance;
use crate::store::series::{FileName, KnownRows, TableRef};
use crate::store::users::Lock;
use crate::table::Table;

/// Name of the folder in the store in which files are written before they are renamed to their
/// final path.
const STAGING: &str = "unfinished";

/// Folder of finished tables, with a shared lock that prevents the removal of tables.
#[derive(Debug, Clone)]
pub struct Store {
    root: PathBuf,
    unflushed: Arc<Unflushed>,
    known_rows: Arc<KnownRows>,
    layers: Arc<Layers>,
    _lock: Arc<Lock>,
}

/// File of a store that cannot be used.
#[derive(Debug)]
pub struct DamagedFile {
    pub cause: StoreError,
    /// New path of the file, or `None` if it is in a read-only store.
    pub quarantined: Option<PathBuf>,
}

/// Source of the tables of finished tasks, without maps.
pub trait TaskTables {
    /// Returns, for each of the tables in the given order, whether all of its rows exist.
    fn have(&self, tables: &[&TableRef]) -> Vec<bool>;

    /// Reads the table of a finished task, without maps.
    ///
    /// # Errors
    /// Returns an error if the table is missing or unreadable.
    fn light(&self, table: &TableRef) -> Result<Table, StoreError>;
}

/// Error of reading, writing or locking the files of a store or of results.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    #[error("cannot write `{}`", path.display())]
    Write { path: PathBuf, source: io::Error },
    #[error("cannot read `{}`", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("`{}` is damaged, or was not written by this program", path.display())]
    Damaged { path: PathBuf, source: ParquetError },
    /// A page or figure of a report was changed by a user or another program.
    #[error("`{}` was edited; run `asperity report` to write it again", path.display())]
    Changed { path: PathBuf },
    #[error("cannot lock the store: cannot open or lock `{}`", path.display())]
    Lock { path: PathBuf, source: io::Error },
    /// A read-only store cannot be used.
    #[error(
        "cannot use the store `{}` (mount its disk, or correct `stores` in `{}`)",
        path.display(),
        listed_in.display()
    )]
    Layer { path: PathBuf, listed_in: PathBuf, source: io::Error },
    /// All files of a table are in read-only stores, and one of them cannot be read or is damaged.
    #[error("cannot use a table of a read-only store")]
    InLayer(#[source] Box<StoreError>),
}

impl StoreError {
    /// Creates the error of writing, renaming or deleting a file. If permissions are missing, the
    /// error says who owns its folder.
    pub fn writing(path: impl Into<PathBuf>, source: io::Error) -> StoreError {
        let path = path.into();
        let folder = if path.is_dir() { &path } else { path.parent().unwrap_or(&path) };
        StoreError::Write { source: explained(source, folder), path }
    }

    /// Creates the error of reading a file or listing a folder. If permissions are missing, the
    /// error says who owns it.
    pub fn reading(path: impl Into<PathBuf>, source: io::Error) -> StoreError {
        let path = path.into();
        StoreError::Read { source: explained(source, &path), path }
    }

    /// Adds the path of the file to an error. A failed read becomes [`StoreError::Read`]. All other
    /// errors mean that the file is damaged.
    pub(crate) fn in_file(path: &Path, error: ParquetError) -> StoreError {
        match error {
            ParquetError::Read(source) => StoreError::reading(path, source),
            source => StoreError::Damaged { path: path.to_owned(), source },
        }
    }

    /// Returns true if the disk is full or not writable, so that no other table could be stored
    /// either.
    pub fn affects_all_tables(&self) -> bool {
        use io::ErrorKind::{QuotaExceeded, StorageFull};
        self.is_denied() || matches!(self.failed_write(), Some(QuotaExceeded | StorageFull))
    }

    /// Returns true if a file or folder cannot be written because of its permissions.
    pub fn is_denied(&self) -> bool {
        use io::ErrorKind::{PermissionDenied, ReadOnlyFilesystem};
        matches!(self.failed_write(), Some(PermissionDenied | ReadOnlyFilesystem))
    }

    fn failed_write(&self) -> Option<io::ErrorKind> {
        if let StoreError::Write { source, .. } = self { Some(source.kind()) } else { None }
    }

    /// Returns true if the table is damaged or missing, so that recomputing it helps.
    pub fn is_recomputable(&self) -> bool {
        matches!(self, StoreError::Damaged { .. } | StoreError::InLayer(_)) || self.is_missing()
    }

    fn is_missing(&self) -> bool {
        matches!(self, StoreError::Read { source, .. } if source.kind() == io::ErrorKind::NotFound)
    }
}

impl Store {
    /// Opens the store in a folder. Creates the folder if necessary.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be created or the lock file cannot be opened.
    pub fn open(root: &Path) -> Result<Store, StoreError> {
        make_folder(root)?;
        Lock::prepare(root);
        Store::open_read_only(root)
    }

    /// Opens the store in a folder without creating anything. The folder need not exist.
    ///
    /// # Errors
    /// Returns an error if a lock file exists but cannot be opened.
    pub fn open_read_only(root: &Path) -> Result<Store, StoreError> {
        Ok(Store {
            root: root.to_owned(),
            unflushed: Arc::default(),
            known_rows: Arc::default(),
            layers: Arc::default(),
            _lock: Arc::new(Lock::share(root)?),
        })
    }

    /// Returns this store above the read-only stores `listed`, whose tables count as its own when
    /// it is read, and the errors of those that cannot be used.
    pub fn above(self, listed: &[ListedStore]) -> (Store, Vec<StoreError>) {
        let (layers, unusable) = Layers::open(listed, &self.root);
        (Store { layers: Arc::new(layers), ..self }, unusable)
    }

    /// Returns the folders of the read-only stores, in the order in which they are searched.
    pub fn layers(&self) -> impl Iterator<Item = &Path> {
        self.layers.roots()
    }

    /// Returns the path of the table of a task in this store, which need not exist.
    pub fn path(&self, key: TaskKey) -> PathBuf {
        path(&self.root, key)
    }

    /// Returns the path of a file in the first folder that has it: this store or a layer. If none
    /// has it, returns its path in this store.
    pub fn locate(&self, name: &FileName) -> PathBuf {
        let own = self.path_of(name);
        if own.is_file() { own } else { self.layers.find(name).unwrap_or(own) }
    }

    /// Returns the index of the read-only store from which a file is read, if it is one.
    fn layer_of(&self, name: &FileName) -> Option<usize> {
        self.layers.index_of(&self.locate(name))
    }

    /// Returns, for each of the tables in the given order, whether all of its rows exist.
    ///
    /// The folders of the tables are listed. On a parallel file system, listing one takes about as
    /// long as looking up one file.
    pub fn have(&self, tables: &[&TableRef]) -> Vec<bool> {
        if let [table] = tables {
            return vec![self.has(table)];
        }
        let mut folders: BTreeMap<u8, Vec<usize>> = BTreeMap::new();
        for (index, table) in tables.iter().enumerate() {
            folders.entry(table.key.first_byte()).or_default().push(index);
        }
        let look_up = |wanted: &Vec<usize>| -> Vec<(usize, bool)> {
            let finished = self.finished_beside(tables[wanted[0]].key).unwrap_or_default();
            let has = |&index: &usize| {
                let names = finished.get(&tables[index].key).map_or(&[][..], Vec::as_slice);
                (index, self.is_complete(tables[index], names))
            };
            wanted.iter().map(has).collect()
        };
        let mut have = vec![false; tables.len()];
        let found = parallel::map(&folders.into_values().collect::<Vec<_>>(), look_up);
        for (index, is_there) in found.into_iter().flatten() {
            have[index] = is_there;
        }
        have
    }

    /// Returns whether all rows of a table exist.
    pub fn has(&self, table: &TableRef) -> bool {
        match table.series {
            None => self.locate(&whole(table.key)).is_file(),
            Some(_) => self.files_of(table.key).is_ok_and(|names| self.is_complete(table, &names)),
        }
    }

    /// Returns whether the files `names` hold all rows of a table.
    fn is_complete(&self, table: &TableRef, names: &[FileName]) -> bool {
        match table.series {
            None => names.iter().any(|name| name.rows.is_none()),
            Some(_) => self.missing_rows_among(table, names).is_empty(),
        }
    }

    /// Returns true if a damaged file of the task is in quarantine.
    pub fn has_damaged(&self, key: TaskKey) -> bool {
        let path = self.path(key);
        let digits = key.to_string();
        let names = path.parent().map(files::names).and_then(Result::ok).unwrap_or_default();
        names.iter().any(|name| name.starts_with(&digits) && name.contains(files::DAMAGED))
    }

    /// Returns the finished tasks whose keys begin with the given hexadecimal digits. There must be
    /// at least two digits.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be listed.
    pub fn finished(&self, digits: &str) -> Result<Vec<TaskKey>, StoreError> {
        let Some(first) = digits.get(..2) else {
            return Ok(Vec::new());
        };
        let mut names = files::names(&self.root.join(first))?;
        names.extend(self.layers().flat_map(|layer| files::names(&layer.join(first))).flatten());
        let meant = names.iter().filter(|name| name.starts_with(digits));
        let files = meant.filter_map(|name| name.parse::<FileName>().ok());
        let mut keys: Vec<TaskKey> = files.map(|file| file.key).collect();
        keys.sort_unstable();
        keys.dedup();
        Ok(keys)
    }

    /// Reads the table of a finished task.
    ///
    /// # Errors
    /// Returns an error if a file is missing, unreadable or damaged, or if its content does not
    /// belong to the key.
    pub fn read(&self, table: &TableRef, columns: Columns) -> Result<Table, StoreError> {
        self.ignoring_unusable(|| match &table.series {
            None => Ok(self.read_file(&whole(table.key), columns)?.0),
            Some(series) => {
                // A task that has just finished may have replaced small files by a larger one.
                let read = |last: Result<Table, StoreError>| match last {
                    Err(error) if error.is_missing() => self.read_series(table, series, columns),
                    last => last,
                };
                read(read(self.read_series(table, series, columns)))
            }
        })
    }

    /// Calls `read`. If a file of a read-only store cannot be read or is damaged, ignores this file
    /// from now on and calls `read` again.
    fn ignoring_unusable<T>(
        &self,
        read: impl Fn() -> Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        let mut unusable = None;
        loop {
            match read() {
                Err(error) if self.layers.ignore(&error) => unusable = Some(error),
                Err(error) if error.is_missing() => {
                    let cause = unusable.map(|cause| StoreError::InLayer(Box::new(cause)));
                    return Err(cause.unwrap_or(error));
                }
                read => return read,
            }
        }
    }

    /// Reads everything that is stored under a key: a whole table, or all rows of a series. Also
    /// returns the provenance.
    ///
    /// # Errors
    /// Returns the same errors as [`Store::read`].
    pub fn read_with_provenance(&self, key: TaskKey) -> Result<(Table, Provenance), StoreError> {
        self.ignoring_unusable(|| {
            if self.locate(&whole(key)).is_file() {
                self.read_file(&whole(key), Columns::All)
            } else {
                self.read_all_rows(key)
            }
        })
    }

    /// Verifies the files from which the table of a finished task is read, with all parts, and
    /// returns their names.
    ///
    /// # Errors
    /// Returns an error if a file is missing, unreadable or damaged.
    pub fn verified_files(&self, table: &TableRef) -> Result<Vec<FileName>, StoreError> {
        self.ignoring_unusable(|| {
            let found = self.files_read(table, &self.files_of(table.key)?);
            let read = found.ok_or_else(|| series::not_found(&self.path(table.key)))?;
            read.iter().try_for_each(|name| verify(&self.locate(name), name))?;
            Ok(read)
        })
    }

    /// Stores the table of a finished task under the key that its provenance gives.
    ///
    /// # Errors
    /// Returns an error if the disk is full or the folder is not writable.
    pub fn publish(&self, provenance: &Provenance, table: &Table) -> Result<(), StoreError> {
        self.write(&self.path(provenance.key()), table, &provenance.metadata())
    }

    fn write(&self, path: &Path, table: &Table, metadata: &Metadata) -> Result<(), StoreError> {
        write_file(path, &parquet::encode(table, metadata), &self.staging())?;
        self.unflushed.add(path)
    }

    /// Flushes the folders of all stored tables, so that no table is lost in a power cut. The
    /// contents of the files are on the disk already.
    ///
    /// # Errors
    /// Returns an error if a folder cannot be flushed.
    pub fn flush(&self) -> Result<(), StoreError> {
        self.unflushed.flush()
    }

    /// Returns the staging folder. It is in the store, because a file can be renamed only within
    /// one file system.
    fn staging(&self) -> PathBuf {
        self.root.join(STAGING)
    }

    /// Renames a damaged file of the store, so that its rows can be recomputed.
    ///
    /// Returns the new path, or `None` if another process has already replaced the file.
    ///
    /// # Errors
    /// Returns an error if the folder is not writable.
    pub fn quarantine(&self, path: &Path) -> Result<Option<PathBuf>, StoreError> {
        let Some(quarantined) = files::quarantine(path)? else {
            return Ok(None);
        };
        // Another process may have replaced the damaged file just before it was renamed.
        let name = path.file_name().and_then(|name| name.to_str()?.parse::<FileName>().ok());
        let is_sound = name.is_some_and(|name| verify(&quarantined, &name).is_ok());
        if !is_sound {
            return Ok(Some(quarantined));
        }
        let back = std::fs::rename(&quarantined, path);
        back.map_err(|source| StoreError::writing(path, source))?;
        Ok(None)
    }

    /// Returns whether a file of a task or a series does not say which rows it has. Such a file
    /// counts as missing.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be listed.
    pub fn has_unreadable(&self, key: TaskKey) -> Result<bool, StoreError> {
        Ok(self.files_of(key)?.iter().any(|name| self.rows_of(name).is_none()))
    }

    /// Verifies all files with rows of a task or a series. Quarantines the damaged files of this
    /// store, and ignores those of read-only stores from now on, so that all rows that the store
    /// then has can be read.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be listed or is not writable.
    pub fn set_damaged_aside(&self, key: TaskKey) -> Result<Vec<DamagedFile>, StoreError> {
        let mut found = Vec::new();
        for name in self.files_of(key)? {
            let own = std::iter::once(self.root.as_path());
            let paths = own.chain(self.layers()).map(|root| file_path(root, &name));
            for path in paths.filter(|path| path.is_file()) {
                let Err(cause) = verify(&path, &name) else { break };
                if self.layers.index_of(&path).is_some() {
                    if self.layers.ignore(&cause) {
                        let cause = StoreError::InLayer(Box::new(cause));
                        found.push(DamagedFile { cause, quarantined: None });
                    }
                } else if matches!(cause, StoreError::Damaged { .. })
                    && let Some(path) = self.quarantine(&path)?
                {
                    found.push(DamagedFile { cause, quarantined: Some(path) });
                }
            }
        }
        Ok(found)
    }
}

impl TaskTables for Store {
    fn have(&self, tables: &[&TableRef]) -> Vec<bool> {
        Store::have(self, tables)
    }

    fn light(&self, table: &TableRef) -> Result<Table, StoreError> {
        self.read(table, Columns::Light)
    }
}

/// Returns the path of the table of a task, which need not exist.
///
/// The first two digits of the key are the name of the folder, so that each folder has few files.
pub fn path(root: &Path, key: TaskKey) -> PathBuf {
    let name = key.to_string();
    let mut path = root.join(&name[..2]);
    path.push(name + ".parquet");
    path
}

/// Returns the path of a file with the table of a task or with rows of a series.
fn file_path(root: &Path, name: &FileName) -> PathBuf {
    path(root, name.key).with_file_name(name.to_string())
}

/// Returns the name of the file with the whole table of a task.
fn whole(key: TaskKey) -> FileName {
    FileName { key, rows: None }
}

/// Verifies the digest of a file, and checks that its content belongs to the name `name`. The rows
/// are not decoded, because the digest covers them.
///
/// # Errors
/// Returns the same errors as [`Store::read`].
pub fn verify(path: &Path, name: &FileName) -> Result<(), StoreError> {
    series::provenance_of(path, name, &files::verify_whole(path)?).map(drop)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::column::{Column, ColumnKind, reals};

    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");

    /// Returns the provenance of a table without inputs.
    pub(super) fn provenance(recipe: &str) -> Provenance {
        Provenance {
            stage: "test".to_owned(),
            version: 1,
            recipe: recipe.to_owned(),
            inputs: vec![],
            input_identities: vec![],
        }
    }

    /// Creates a store with one table.
    fn fixture() -> (tempfile::TempDir, Store, TaskKey, Table) {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&folder.path().join("store")).unwrap();
        let made = provenance("{}");
        let table = Table::new(2, vec![(AREA, reals([0.25, 0.5]))]);
        assert!(!store.has(&made.key().into()));
        store.publish(&made, &table).unwrap();
        (folder, store, made.key(), table.without_wording())
    }

    fn is_damaged(store: &Store, key: TaskKey) -> bool {
        let read = store.read(&key.into(), Columns::All);
        matches!(read, Err(StoreError::Damaged { .. }))
    }

    #[test]
    fn a_published_table_is_read_back() {
        let (_folder, store, key, table) = fixture();
        assert!(store.has(&key.into()));
        assert_eq!(store.read(&key.into(), Columns::All).unwrap(), table);
    }

    #[test]
    fn many_keys_and_single_keys_are_found_alike() {
        let (_folder, store, key, _) = fixture();
        let shares_its_folder = |number: u32| {
            let other = provenance(&number.to_string()).key();
            (other.first_byte() == key.first_byte()).then_some(other)
        };
        let absent: Vec<TaskKey> = (0..20_000).filter_map(shares_its_folder).collect();
        assert!(absent.len() > 30, "enough for the folder to be listed");
        let keys = [&absent[..9], &[key], &absent[9..]].concat();
        let have = |keys: &[TaskKey]| {
            let tables: Vec<TableRef> = keys.iter().map(|&key| key.into()).collect();
            store.have(&tables.iter().collect::<Vec<_>>())
        };
        let one_by_one: Vec<bool> = keys.iter().map(|&key| store.has(&key.into())).collect();
        assert_eq!(have(&keys), one_by_one);
        assert_eq!(have(&absent), vec![false; absent.len()]);
        assert!(have(&keys)[9]);
    }

    #[test]
    fn publishing_leaves_no_other_files() {
        let (_folder, store, key, table) = fixture();
        store.publish(&provenance("{}"), &table).unwrap();
        let folder = store.path(key).parent().unwrap().to_owned();
        assert_eq!(fs::read_dir(folder).unwrap().count(), 1);
        assert_eq!(fs::read_dir(store.staging()).unwrap().count(), 0);
    }

    #[test]
    fn truncated_empty_and_foreign_files_are_damaged() {
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
    fn a_table_can_be_published_after_quarantine() {
        let (_folder, store, key, table) = fixture();
        for number in ["", "-2"] {
            fs::write(store.path(key), "not a table").unwrap();
            let quarantined = store.quarantine(&store.path(key)).unwrap().unwrap();
            let name = format!("{key}.parquet.damaged{number}");
            assert_eq!(quarantined.file_name().unwrap().to_str(), Some(name.as_str()));
            assert_eq!(fs::read(quarantined).unwrap(), b"not a table");
            assert!(!store.has(&key.into()));
            store.publish(&provenance("{}"), &table).unwrap();
        }
        assert_eq!(store.read(&key.into(), Columns::All).unwrap(), table);
    }

    #[test]
    fn a_sound_file_is_not_quarantined() {
        let (_folder, store, key, table) = fixture();
        assert_eq!(store.quarantine(&store.path(key)).unwrap(), None);
        assert_eq!(store.read(&key.into(), Columns::All).unwrap(), table);
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
