//! Finished tables on disk, each written once.
//!
//! A table appears under its key whole or not at all: it is written aside, flushed, and linked
//! into place only if nobody else was faster. Equal keys mean equal tables, so losing that race
//! loses nothing, and two processes may share a store. A table is read whole and as it was
//! written, or not at all: its file holds a digest of its bytes and the recipe that its key
//! follows from.

pub mod checkpoint;
pub mod files;
pub mod key;
pub mod listing;
pub mod lock;
pub mod provenance;
mod unflushed;
/// For tests, which leave files as an ended process would.
#[doc(hidden)]
pub mod writer;

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::parquet::{self, Columns, Metadata, ParquetError};
use crate::store::files::{Existing, make_folder, read_whole, write_file};
use crate::store::key::TaskKey;
use crate::store::lock::Lock;
use crate::store::provenance::Provenance;
use crate::store::unflushed::Unflushed;
use crate::table::Table;

/// The folder in a store where tables are written before they get their places.
const WORKSHOP: &str = "unfinished";

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
    /// A page or a figure has been changed since it was written.
    #[error("`{}` is not as it was written; `asperity report` writes it anew", path.display())]
    Changed {
        /// Where.
        path: PathBuf,
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
    pub fn is_mendable(&self) -> bool {
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
        Store::look(root)
    }

    /// The store in this folder, which need not exist: a plan only looks.
    ///
    /// # Errors
    /// When nobody can tell whether the store is pruned just now.
    pub fn look(root: &Path) -> Result<Store, StoreError> {
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

    /// Whether a task is finished.
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
        write_file(&path, &bytes, Existing::Keep, &self.workshop())?;
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
    fn workshop(&self) -> PathBuf {
        self.root.join(WORKSHOP)
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
    let told = Provenance::of(&metadata).filter(|told| told.key() == key);
    told.filter(|_| metadata.key == Some(key)).ok_or_else(|| StoreError::Damaged {
        path: path.to_owned(),
        source: ParquetError::Foreign { owner: format!("task {key}") },
    })
}

#[cfg(test)]
mod tests;
