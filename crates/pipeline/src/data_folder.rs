//! Layout of the data folder, and the search for files in it that no study needs.
//!
//! Unneeded files are tables of tasks that no named study has, damaged files in quarantine, and
//! unfinished files of killed processes.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::cluster::receipts::Receipt;
use crate::plan::Plan;
use crate::plan::reasons::record::Record;
use crate::{cluster, results};
use asperity_tables::store::key::TaskKey;
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
pub struct DataFolder(PathBuf);

impl DataFolder {
    pub fn new(path: impl Into<PathBuf>) -> DataFolder {
        DataFolder(path.into())
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Returns the folder with the tables of tasks.
    pub fn store(&self) -> PathBuf {
        self.0.join("store")
    }

    /// Returns the folder `results/`, which has a subfolder for each study.
    pub fn results(&self) -> PathBuf {
        self.0.join("results")
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
        self.0.join("plans")
    }

    /// Returns the folder with one study's batch scripts and receipts of cluster jobs.
    pub fn cluster_of(&self, study: &str) -> PathBuf {
        self.0.join("cluster").join(study)
    }

    /// Returns the folder with the receipts of the processes that computed shards of one study.
    pub fn receipts_of(&self, study: &str) -> PathBuf {
        self.cluster_of(study).join("receipts")
    }

    /// Opens the store for reading. Fails if the lock of the store cannot be acquired, because
    /// another process could then delete tables at the same time.
    pub fn open_read_only(&self) -> Result<Store, StoreError> {
        Store::open_read_only(&self.store())
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
    let mut tables: HashMap<TaskKey, Vec<&TableRef>> = HashMap::new();
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
