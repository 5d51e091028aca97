//! Read-only stores below a store.
//!
//! The members of a group compute into stores of their own and read the tables that a shared store
//! already has. A layer is never changed: the program writes no table and no lock file there, and
//! it does not rename damaged files.
//!
//! A file of a layer that cannot be read or is damaged is ignored, as if it did not exist. Its
//! table is then taken from the next layer, or computed into the own store.

use std::collections::HashSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::series::FileName;
use super::users::Lock;
use super::{StoreError, file_path, files};
use crate::parallel::locked;

/// Entry of a list of stores, with the file that contains the list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListedStore {
    /// Data folder, or the folder `store/` in it.
    pub path: PathBuf,
    pub listed_in: PathBuf,
}

/// Read-only stores below a store, in the order in which they are searched.
#[derive(Debug, Default)]
pub(super) struct Layers {
    layers: Vec<Layer>,
    ignored: Mutex<HashSet<PathBuf>>,
}

#[derive(Debug)]
struct Layer {
    root: PathBuf,
    /// Shared lock that keeps the owner from pruning the store meanwhile.
    _lock: Lock,
}

impl Layers {
    /// Opens the listed stores below the store in the folder `own`. An entry that is this store
    /// itself is skipped. Also returns the errors of those that cannot be used.
    pub fn open(listed: &[ListedStore], own: &Path) -> (Layers, Vec<StoreError>) {
        let (mut found, mut unusable) = (Layers::default(), Vec::new());
        let own_root = own.canonicalize().ok();
        for ListedStore { path, listed_in } in listed {
            match Layer::open(path) {
                Ok(layer) if own_root.as_ref() == Some(&layer.root) => {}
                Ok(layer) => found.layers.push(layer),
                Err(source) => unusable.push(StoreError::Layer {
                    path: path.clone(),
                    listed_in: listed_in.clone(),
                    source,
                }),
            }
        }
        (found, unusable)
    }

    pub fn roots(&self) -> impl Iterator<Item = &Path> {
        self.layers.iter().map(|layer| layer.root.as_path())
    }

    /// Returns the path of a file in the first layer that has it.
    pub fn find(&self, name: &FileName) -> Option<PathBuf> {
        let mut paths = self.roots().map(|root| file_path(root, name));
        paths.find(|path| path.is_file() && !self.is_ignored(path))
    }

    /// Returns the index of the layer that contains a file.
    pub fn index_of(&self, path: &Path) -> Option<usize> {
        self.roots().position(|root| path.starts_with(root))
    }

    pub fn is_ignored(&self, path: &Path) -> bool {
        locked(&self.ignored).contains(path)
    }

    /// If the error is about a file of a layer, ignores this file from now on. Returns whether the
    /// file was used until now.
    pub fn ignore(&self, error: &StoreError) -> bool {
        match error {
            StoreError::Read { path, .. } | StoreError::Damaged { path, .. } => {
                self.index_of(path).is_some() && locked(&self.ignored).insert(path.clone())
            }
            _ => false,
        }
    }
}

impl Layer {
    fn open(path: &Path) -> io::Result<Layer> {
        let inner = path.join("store");
        let root = if inner.is_dir() { inner } else { path.to_owned() }.canonicalize()?;
        let names = files::names(&root).map_err(|error| match error {
            StoreError::Read { source, .. } => source,
            other => io::Error::other(other),
        })?;
        if !names.is_empty() && !names.iter().any(|name| is_of_store(name)) {
            let reason = "it is neither a store nor a data folder with `store/`";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, reason));
        }
        // Without a lock, the owner can delete tables meanwhile. They then count as missing.
        Ok(Layer { _lock: Lock::share_read_only(&root), root })
    }
}

/// Returns whether a store has a file or folder of this name.
fn is_of_store(name: &str) -> bool {
    let is_folder_of_keys = name.len() == 2 && name.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_folder_of_keys || [super::STAGING, super::users::LOCK].contains(&name)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::column::{Column, ColumnKind, reals};
    use crate::key::TaskKey;
    use crate::parquet::Columns;
    use crate::store::Store;
    use crate::store::series::{SeriesRows, TableRef};
    use crate::store::tests::provenance;
    use crate::table::Table;

    const LOAD: Column = Column::result("load", ColumnKind::Real, "1", "load");

    fn table(loads: &[f64]) -> Table {
        Table::new(loads.len(), vec![(LOAD, reals(loads.iter().copied()))]).without_wording()
    }

    fn publish(store: &Store, recipe: &str, table: &Table) -> TaskKey {
        store.publish(&provenance(recipe), table).unwrap();
        provenance(recipe).key()
    }

    /// Returns a data folder with a store, and its path.
    fn data_folder() -> (tempfile::TempDir, Store) {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&folder.path().join("store")).unwrap();
        (folder, store)
    }

    fn above(store: Store, layers: &[&Path]) -> (Store, Vec<StoreError>) {
        let listed_in = PathBuf::from("asperity.toml");
        let listed = layers
            .iter()
            .map(|path| ListedStore { path: path.to_path_buf(), listed_in: listed_in.clone() });
        store.above(&listed.collect::<Vec<_>>())
    }

    #[test]
    fn the_own_table_comes_first_and_then_those_of_the_layers_in_order() {
        let folders: [_; 3] = std::array::from_fn(|_| data_folder());
        let [(_, own), (first, one), (second, two)] = &folders;
        for (store, recipes) in [(own, vec!["a"]), (one, vec!["a", "b"]), (two, vec!["b", "c"])] {
            for recipe in recipes {
                publish(store, recipe, &table(&[0.1]));
            }
        }
        let (store, unusable) = above(own.clone(), &[first.path(), &second.path().join("store")]);
        assert!(unusable.is_empty());
        let layer = |recipe: &str| {
            let key = provenance(recipe).key();
            assert!(store.has(&key.into()) && store.have(&[&key.into()]) == [true]);
            assert_eq!(store.read(&key.into(), Columns::All).unwrap(), table(&[0.1]));
            assert_eq!(store.finished(&key.to_string()).unwrap(), [key]);
            store.layers.index_of(&store.locate(&FileName { key, rows: None }))
        };
        assert_eq!(["a", "b", "c"].map(layer), [None, Some(0), Some(1)]);
        assert!(!store.has(&provenance("d").key().into()));
    }

    #[test]
    fn damaged_files_of_a_layer_count_as_missing_once_they_are_read() {
        let (folder, layer) = data_folder();
        let (_own, own) = data_folder();
        let key = publish(&layer, "a", &table(&[0.1]));
        fs::write(layer.path(key), "not a table").unwrap();
        let (store, _) = above(own, &[folder.path()]);
        assert!(store.has(&key.into()));
        let error = store.read(&key.into(), Columns::All).unwrap_err();
        assert!(matches!(&error, StoreError::InLayer(_)) && error.is_recomputable(), "{error}");
        assert!(!store.has(&key.into()));
        publish(&store, "a", &table(&[0.1]));
        assert_eq!(store.read(&key.into(), Columns::All).unwrap(), table(&[0.1]));
        assert_eq!(fs::read(layer.path(key)).unwrap(), b"not a table");
        assert_eq!(fs::read_dir(layer.path(key).parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn rows_of_a_series_are_merged() {
        let (folder, layer) = data_folder();
        let (_own, own) = data_folder();
        let rows = |store: &Store, loads: &[f64]| {
            let made = provenance("series");
            store.publish_rows(&made, "load", loads, None, &table(loads)).unwrap();
        };
        let wanted = |loads: &[f64]| {
            let series = SeriesRows { column: "load", values: loads.to_vec(), parts: vec![] };
            TableRef { key: provenance("series").key(), series: Some(series.into()) }
        };
        rows(&layer, &[0.1, 0.3]);
        let (store, _) = above(own, &[folder.path()]);
        let all = [0.1, 0.2, 0.3];
        assert_eq!(store.missing_rows(&wanted(&all)).unwrap().values, [0.2]);
        rows(&store, &[0.2]);
        assert_eq!(store.read(&wanted(&all), Columns::All).unwrap(), table(&all));
        assert!(!layer.has(&wanted(&all)));
        let key = provenance("series").key();
        assert_eq!(store.read_with_provenance(key).unwrap().0, table(&all));
        // Once a damaged file of the layer has been read, its rows are missing.
        let [name] = &layer.files_of(key).unwrap()[..] else { panic!("one file") };
        let path = layer.path_of(name);
        fs::write(&path, &fs::read(&path).unwrap()[..20]).unwrap();
        assert!(store.read(&wanted(&all), Columns::All).unwrap_err().is_recomputable());
        assert_eq!(store.missing_rows(&wanted(&all)).unwrap().values, [0.1, 0.3]);
    }

    #[test]
    fn folders_that_are_not_stores_are_errors_and_the_own_store_is_skipped() {
        let (folder, store) = data_folder();
        let [empty, other] = ["empty", "other"].map(|name| folder.path().join(name));
        fs::create_dir_all(&empty).unwrap();
        fs::create_dir_all(other.join("photographs")).unwrap();
        let nowhere = folder.path().join("nowhere");
        let (store, unusable) = above(store, &[folder.path(), &empty, &other, &nowhere]);
        assert_eq!(store.layers().collect::<Vec<_>>(), [empty.canonicalize().unwrap()]);
        let unusable: Vec<String> = unusable.iter().map(ToString::to_string).collect();
        assert!(unusable[0].contains("other") && unusable[1].contains("nowhere"), "{unusable:?}");
        assert_eq!(fs::read_dir(&empty).unwrap().count(), 0);
    }
}
