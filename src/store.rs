//! Finished tables on disk, each written once.
//!
//! A table appears under its key whole or not at all: it is written beside its place, flushed,
//! and linked into place only if nobody else was faster. Equal keys mean equal tables, so losing
//! that race loses nothing, and two processes may share a store.

pub mod column;
pub mod key;
pub mod parquet;
pub mod table;

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::store::key::TaskKey;
use crate::store::parquet::{Columns, Metadata, ParquetError};
use crate::store::table::Table;

/// A folder of finished tables.
#[derive(Debug, Clone)]
pub struct Store {
    root: PathBuf,
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
    #[error("`{}` is damaged or no table of this program; move it away and run again", path.display())]
    Damaged {
        /// Where.
        path: PathBuf,
        /// What the reader met.
        source: ParquetError,
    },
}

impl Store {
    /// The store in this folder, which is made if it does not exist.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn open(root: &Path) -> Result<Store, StoreError> {
        make_folder(root)?;
        Ok(Store {
            root: root.to_owned(),
        })
    }

    /// The store in this folder, which need not exist: a plan only looks.
    pub fn look(root: &Path) -> Store {
        Store {
            root: root.to_owned(),
        }
    }

    /// Where a task's table is, or would be. Folders by the key's first two digits keep
    /// listings short.
    pub fn path(&self, key: TaskKey) -> PathBuf {
        let name = key.to_string();
        let mut path = self.root.join(&name[..2]);
        path.push(name + ".parquet");
        path
    }

    /// Whether a task is finished.
    pub fn has(&self, key: TaskKey) -> bool {
        self.path(key).is_file()
    }

    /// A finished task's table.
    ///
    /// # Errors
    /// When the file is missing, unreadable or damaged.
    pub fn read(&self, key: TaskKey, columns: Columns) -> Result<Table, StoreError> {
        let path = self.path(key);
        let file = File::open(&path).map_err(|source| StoreError::Read {
            path: path.clone(),
            source,
        })?;
        let (table, metadata) =
            parquet::decode(file, columns).map_err(|source| StoreError::Damaged {
                path: path.clone(),
                source,
            })?;
        if metadata.key != Some(key) {
            let source = ParquetError::Foreign {
                key: key.to_string(),
            };
            return Err(StoreError::Damaged { path, source });
        }
        Ok(table)
    }

    /// Stores a finished task's table for good.
    ///
    /// # Errors
    /// When the disk is full, or the folder cannot be written.
    pub fn publish(
        &self,
        key: TaskKey,
        table: &Table,
        metadata: &Metadata,
    ) -> Result<(), StoreError> {
        let path = self.path(key);
        let bytes = parquet::encode(table, metadata);
        write_whole(&path, &bytes, Existing::Keep)
    }
}

/// What to do with a file that is already there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Leave it: it is the same.
    Keep,
    /// Put the new one in its place.
    Replace,
}

/// Writes a file that appears whole or not at all, even if the power is cut: its bytes are on the
/// disk before it gets its name. The name itself may take the seconds that the system leaves it
/// in memory, and is waited for by nobody: a file that is lost is written again.
///
/// # Errors
/// When the folder cannot be made, or the file not be written, flushed or moved into place.
pub fn write_whole(path: &Path, bytes: &[u8], existing: Existing) -> Result<(), StoreError> {
    let folder = path.parent().unwrap_or(Path::new("."));
    make_folder(folder)?;
    let result = (|| {
        let mut file = tempfile::Builder::new()
            .prefix(".unfinished-")
            .permissions(readable())
            .tempfile_in(folder)?;
        file.write_all(bytes)?;
        file.as_file().sync_all()?;
        match existing {
            Existing::Replace => drop(file.persist(path)?),
            Existing::Keep => match file.persist_noclobber(path) {
                Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => {
                    is_file(path)?;
                }
                other => drop(other?),
            },
        }
        File::open(folder)?.sync_all()
    })();
    result.map_err(|source| StoreError::Write {
        path: path.to_owned(),
        source,
    })
}

/// What is there already must be a file, or else nothing has been stored.
fn is_file(path: &Path) -> io::Result<()> {
    match path.is_file() {
        true => Ok(()),
        false => Err(io::Error::other(
            "something that is no file is in its place",
        )),
    }
}

fn make_folder(path: &Path) -> Result<(), StoreError> {
    fs::create_dir_all(path).map_err(|source| StoreError::Write {
        path: path.to_owned(),
        source,
    })
}

/// Temporary files are private by default; results are for colleagues too.
fn readable() -> fs::Permissions {
    use std::os::unix::fs::PermissionsExt;
    fs::Permissions::from_mode(0o644)
}

#[cfg(test)]
mod tests {
    use super::column::{Column, ColumnKind, reals};
    use super::key::Digest;
    use super::*;

    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");

    fn fixture() -> (tempfile::TempDir, Store, TaskKey, Table, Metadata) {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&folder.path().join("store")).unwrap();
        let key = TaskKey::of("test", 1, Digest::of(&"a"), &[]);
        let table = Table::new(2, vec![(AREA, reals([0.25, 0.5]))]);
        let metadata = Metadata {
            key: Some(key),
            entries: vec![("recipe".to_owned(), "{}".to_owned())],
        };
        (folder, store, key, table, metadata)
    }

    #[test]
    fn a_published_table_is_read_back() {
        let (_folder, store, key, table, metadata) = fixture();
        assert!(!store.has(key));
        store.publish(key, &table, &metadata).unwrap();
        assert!(store.has(key));
        assert_eq!(store.read(key, Columns::All).unwrap(), table);
    }

    #[test]
    fn a_published_table_is_never_rewritten() {
        let (_folder, store, key, table, metadata) = fixture();
        store.publish(key, &table, &metadata).unwrap();
        let other = Table::new(1, vec![(AREA, reals([9.0]))]);
        store.publish(key, &other, &metadata).unwrap();
        assert_eq!(store.read(key, Columns::All).unwrap(), table);
    }

    #[test]
    fn publishing_leaves_nothing_else_behind() {
        let (_folder, store, key, table, metadata) = fixture();
        store.publish(key, &table, &metadata).unwrap();
        store.publish(key, &table, &metadata).unwrap();
        let folder = store.path(key).parent().unwrap().to_owned();
        assert_eq!(fs::read_dir(folder).unwrap().count(), 1);
    }

    #[test]
    fn a_truncated_file_and_a_foreign_one_are_errors() {
        let (_folder, store, key, table, metadata) = fixture();
        store.publish(key, &table, &metadata).unwrap();
        let path = store.path(key);
        let whole = fs::read(&path).unwrap();
        fs::write(&path, &whole[..whole.len() - 7]).unwrap();
        assert!(matches!(
            store.read(key, Columns::All),
            Err(StoreError::Damaged { .. })
        ));
        let other = TaskKey::of("test", 1, Digest::of(&"b"), &[]);
        write_whole(&store.path(other), &whole, Existing::Keep).unwrap();
        assert!(matches!(
            store.read(other, Columns::All),
            Err(StoreError::Damaged { .. })
        ));
    }

    #[test]
    fn every_flipped_bit_is_found() {
        let (_folder, store, key, table, metadata) = fixture();
        store.publish(key, &table, &metadata).unwrap();
        let path = store.path(key);
        let whole = fs::read(&path).unwrap();
        for position in 0..whole.len() {
            let mut flipped = whole.clone();
            flipped[position] ^= 1 << (position % 8);
            fs::write(&path, &flipped).unwrap();
            assert!(store.read(key, Columns::All).is_err(), "byte {position}");
        }
    }

    #[test]
    fn a_folder_in_place_of_a_table_is_an_error() {
        let (_folder, store, key, table, metadata) = fixture();
        fs::create_dir_all(store.path(key)).unwrap();
        assert!(store.publish(key, &table, &metadata).is_err());
    }

    #[test]
    fn equal_tables_give_equal_bytes() {
        let (_folder, _store, _key, table, metadata) = fixture();
        assert_eq!(
            parquet::encode(&table, &metadata),
            parquet::encode(&table, &metadata)
        );
    }
}
