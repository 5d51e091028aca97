//! Layout of the data folder, and the search for files in it that no study needs.
//!
//! Unneeded files are tables of tasks that no named study has, damaged files in quarantine, and
//! unfinished files of killed processes.

use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::cluster::receipts::Receipt;
use crate::plan::Plan;
use crate::plan::reasons::record::Record;
use crate::settings_file::{FILE, SettingsFile};
use crate::{cluster, results};
use asperity_manifest::diagnostics::ManifestErrors;
use asperity_tables::key::KeyMap;
use asperity_tables::store::layers::ListedStore;
use asperity_tables::store::listing::{FileKind, StoredFile};
use asperity_tables::store::series::{self, TableRef};
use asperity_tables::store::users::{HostState, Lock};
use asperity_tables::store::{Store, StoreError, listing};

/// Path of the folder that contains all results. It need not exist.
///
/// - `store/`: tables of tasks
/// - `results/STUDY/`: tables of stages
/// - `plans/`: a [`Record`] of each study at its last run
/// - `cluster/STUDY/`: batch scripts and receipts of a study that is computed on a cluster
/// - `asperity.toml`: [settings](SettingsFile), such as read-only stores of a group
///
/// ```
/// use std::path::Path;
///
/// use asperity_pipeline::data_folder::DataFolder;
///
/// let table = DataFolder::new("data").table("quickstart", "curves");
/// assert_eq!(table, Path::new("data/results/quickstart/curves.parquet"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataFolder {
    path: PathBuf,
    /// Paths of settings files, the nearest first. They need not exist.
    settings: Vec<PathBuf>,
}

/// Error of opening the store of a data folder.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The settings file that lists read-only stores is wrong.
    #[error(transparent)]
    Settings(#[from] ManifestErrors),
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl DataFolder {
    pub fn new(path: impl Into<PathBuf>) -> DataFolder {
        let path = path.into();
        DataFolder { settings: vec![path.join(FILE)], path }
    }

    /// Adds a settings file that counts after all others, such as that of the user.
    #[must_use]
    pub fn with_settings(mut self, file: Option<PathBuf>) -> DataFolder {
        self.settings.extend(file);
        self
    }

    /// Adds the settings file next to a manifest, which counts before all others.
    #[must_use]
    pub fn for_manifest(mut self, manifest: &Path) -> DataFolder {
        self.settings.insert(0, manifest.with_file_name(FILE));
        self
    }

    /// Returns the paths of the settings files, the nearest first. They need not exist.
    pub fn settings(&self) -> &[PathBuf] {
        &self.settings
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the folder with the tables of tasks.
    pub fn store(&self) -> PathBuf {
        self.path.join("store")
    }

    /// Returns the folder `results/`, which has a subfolder for each study.
    pub fn results(&self) -> PathBuf {
        self.path.join("results")
    }

    /// Returns the folder with the tables of one study's stages.
    pub fn results_of(&self, study: &str) -> PathBuf {
        self.results().join(study)
    }

    /// Returns the path of one stage's table, which need not exist.
    pub fn table(&self, study: &str, stage: &str) -> PathBuf {
        results::path(&self.results(), study, stage)
    }

    /// Returns the folder with the records of studies at their last runs.
    pub fn records(&self) -> PathBuf {
        self.path.join("plans")
    }

    /// Returns the folder with one study's batch scripts and receipts of cluster jobs.
    pub fn cluster_of(&self, study: &str) -> PathBuf {
        self.path.join("cluster").join(study)
    }

    /// Returns the folder with the receipts of the processes that computed shards of one study.
    pub fn receipts_of(&self, study: &str) -> PathBuf {
        self.cluster_of(study).join("receipts")
    }

    /// Opens the store for writing, above the read-only stores that the settings list.
    ///
    /// # Errors
    /// Returns an error if the store cannot be written, a settings file is wrong, or a listed store
    /// cannot be used.
    pub fn open(&self) -> Result<Store, OpenError> {
        let store = Store::open(&self.store())?;
        all_usable(store.above(&self.listed_stores()?))
    }

    /// Opens the store for reading, above the read-only stores that the settings list.
    ///
    /// # Errors
    /// Returns an error if a settings file is wrong or a listed store cannot be used. Also returns
    /// an error if the lock of the store cannot be acquired, because another process could then
    /// delete tables at the same time.
    pub fn open_read_only(&self) -> Result<Store, OpenError> {
        all_usable(self.open_available()?)
    }

    /// Opens the store as [`DataFolder::open_read_only`] does, above those listed stores that can
    /// be used. Also returns the errors of the others.
    ///
    /// # Errors
    /// Returns an error if a settings file is wrong or the lock of the store cannot be acquired.
    pub fn open_available(&self) -> Result<(Store, Vec<StoreError>), OpenError> {
        Ok(Store::open_read_only(&self.store())?.above(&self.listed_stores()?))
    }

    /// Returns the folder of the first store, own or listed, that another process has locked to
    /// delete tables. Opening the stores waits for this process.
    pub fn locked_store(&self) -> Option<PathBuf> {
        let listed = self.listed_stores().unwrap_or_default().into_iter();
        let folders = listed.flat_map(|listed| [listed.path.join("store"), listed.path]);
        std::iter::once(self.store()).chain(folders).find(|folder| Lock::is_exclusive(folder))
    }

    /// Returns the read-only stores of the nearest settings file that lists any.
    fn listed_stores(&self) -> Result<Vec<ListedStore>, ManifestErrors> {
        for file in &self.settings {
            let stores = SettingsFile::read(file)?.and_then(|settings| settings.stores);
            if let Some(stores) = stores {
                let listed = |path| ListedStore { path, listed_in: file.clone() };
                return Ok(stores.into_iter().map(listed).collect());
            }
        }
        Ok(Vec::new())
    }
}

fn all_usable((store, unusable): (Store, Vec<StoreError>)) -> Result<Store, OpenError> {
    match unusable.into_iter().next() {
        Some(error) => Err(error.into()),
        None => Ok(store),
    }
}

/// Lists the files that none of the studies `plans` needs.
///
/// Files that a process may be writing now are not listed. If `plans` is empty, no table is listed,
/// because an empty list is more likely a mistake than a request to delete everything.
pub fn unneeded(
    plans: &[Plan],
    data: &DataFolder,
    moment: &HostState,
) -> Result<Vec<StoredFile>, StoreError> {
    let tasks = plans.iter().flat_map(|plan| &plan.tasks);
    let mut tables: KeyMap<Vec<&TableRef>> = KeyMap::default();
    tasks.for_each(|task| tables.entry(task.table.key).or_default().push(&task.table));
    let mut found = listing::store_files(&data.store())?;
    found.extend(results::files(&data.results())?);
    found.extend(Record::files(&data.records())?);
    found.extend(cluster::files(data.path())?);
    let is_needed = |found: &StoredFile| match &found.what {
        FileKind::Quarantined => false,
        FileKind::Unfinished => !moment.is_abandoned(&found.path),
        _ if plans.is_empty() => true,
        FileKind::Task(file) => tables.get(&file.key).is_some_and(|tables| {
            tables.iter().any(|table| series::holds_some_of(&found.path, file, table))
        }),
        FileKind::Stage { study, stage } => plans.iter().any(|plan| plan.has_table(study, stage)),
        FileKind::Owner { study } | FileKind::Record { study } | FileKind::Cluster { study } => {
            plans.iter().any(|plan| plan.study == *study)
        }
    };
    found.retain(|found| !is_needed(found));
    Ok(found)
}

/// Returns the receipts of processes that may be running. The file locks of processes on other
/// machines may be invisible here.
pub fn running_receipts(data: &DataFolder) -> Result<Vec<Receipt>, StoreError> {
    let mut receipts = cluster::receipts(data.path())?;
    receipts.retain(Receipt::may_be_running);
    Ok(receipts)
}

/// Deletes files, and the folders that become empty. `_alone` proves that the caller holds the
/// exclusive lock of the store.
pub fn delete(files: &[StoredFile], _alone: &Lock) -> Result<(), StoreError> {
    for StoredFile { path, .. } in files {
        remove(path)?;
        if let Some(folder) = path.parent() {
            // A folder that is not empty cannot be removed.
            let _ = fs::remove_dir(folder);
        }
    }
    Ok(())
}

/// Deletes the unfinished files of processes that have ended.
///
/// On some file systems a lock excludes only processes of the same machine. Unfinished files of
/// processes that may be running on other machines are therefore kept. Folders are kept too,
/// because such a process may be about to write into them.
pub fn delete_unfinished(data: &DataFolder, moment: &HostState) -> Result<(), StoreError> {
    let mut left = listing::unfinished(&data.store())?;
    left.extend(results::files(&data.results())?);
    left.extend(Record::files(&data.records())?);
    left.extend(cluster::files(data.path())?);
    left.retain(|found| found.what == FileKind::Unfinished && moment.is_abandoned(&found.path));
    if left.is_empty() {
        return Ok(());
    }
    match Lock::exclusive(&data.store())? {
        Some(_alone) => left.iter().try_for_each(|found| remove(&found.path)),
        None => Ok(()),
    }
}

fn remove(path: &Path) -> Result<(), StoreError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        removed => removed.map_err(|source| StoreError::writing(path, source)),
    }
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use asperity_tables::store::users::Writer;

    use super::*;

    /// Returns the state of a machine on which no process is running.
    fn moment() -> HostState {
        HostState { machine: "node07".to_owned(), now: SystemTime::now(), started: |_| None }
    }

    #[test]
    fn what_another_machine_may_be_writing_stays_where_locks_say_that_nobody_is_there() {
        let root = tempfile::tempdir().unwrap();
        let data = DataFolder::new(root.path());
        let workshops = [data.store().join("unfinished"), data.results_of("small"), data.records()];
        let unfinished = |machine: &str| {
            let machine = machine.to_owned();
            let name = Writer { machine, process: 1 }.prefix() + "aB3dEf";
            workshops.clone().map(|folder| {
                fs::create_dir_all(&folder).unwrap();
                let path = folder.join(&name);
                fs::write(&path, "half a table").unwrap();
                path
            })
        };
        let (own, others) = (unfinished("node07"), unfinished("node08"));
        let found = unneeded(&[], &data, &moment()).unwrap();
        assert_eq!(found.len(), own.len());
        delete_unfinished(&data, &moment()).unwrap();
        assert!(own.iter().all(|path| !path.exists()));
        assert!(others.iter().all(|path| path.exists()));
        others.iter().for_each(|path| fs::remove_file(path).unwrap());

        unfinished("node07");
        delete_unfinished(&data, &moment()).unwrap();
        assert!(workshops.iter().all(|folder| folder.exists()));
    }
}
