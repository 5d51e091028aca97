//! The folder of finished work: what is where in it, and what nobody needs any more.
//!
//! Unneeded are tables that no named study asks for, damaged files that are in quarantine, and what
//! killed processes left unfinished.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::cluster::receipts::Receipt;
use crate::plan::Plan;
use crate::plan::reasons::record::Record;
use crate::{cluster, results};
use asperity_tables::store::key::TaskKey;
use asperity_tables::store::listing::{Found, What};
use asperity_tables::store::users::{Lock, Moment};
use asperity_tables::store::{Store, StoreError, listing};

/// The folder that holds tables of tasks in `store/`, tables of stages in `results/STUDY/`, in
/// `plans/` what studies were when they last ran, and in `cluster/STUDY/` what shares one out among
/// machines. It need not exist.
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
    /// The folder at this path.
    pub fn new(path: impl Into<PathBuf>) -> DataFolder {
        DataFolder(path.into())
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Tables of tasks.
    pub fn store(&self) -> PathBuf {
        self.0.join("store")
    }

    /// Tables of stages, a folder for each study.
    pub fn results(&self) -> PathBuf {
        self.0.join("results")
    }

    /// Tables of one study's stages.
    pub fn results_of(&self, study: &str) -> PathBuf {
        self.results().join(study)
    }

    /// The table of one stage of a study, whether it is there or not.
    pub fn table(&self, study: &str, stage: &str) -> PathBuf {
        results::path(&self.results(), study, stage)
    }

    /// What studies were when they last ran.
    pub fn records(&self) -> PathBuf {
        self.0.join("plans")
    }

    /// What the machines of a cluster leave of one study: scripts, and receipts of what they did.
    pub fn cluster_of(&self, study: &str) -> PathBuf {
        self.0.join("cluster").join(study)
    }

    /// A receipt of each process that has computed a shard of one study.
    pub fn receipts_of(&self, study: &str) -> PathBuf {
        self.cluster_of(study).join("receipts")
    }

    /// Opens the store for reading, unless it cannot be told whether it is being pruned.
    pub fn look(&self) -> Result<Store, StoreError> {
        Store::look(&self.store())
    }
}

/// What none of these studies needs. Without any study no table is unneeded: naming none is
/// rather a slip than a wish to lose everything. What somebody may be writing just now stays.
pub fn unneeded(
    plans: &[Plan],
    data: &DataFolder,
    moment: &Moment,
) -> Result<Vec<Found>, StoreError> {
    let keys: HashSet<TaskKey> = plans.iter().flat_map(Plan::keys).collect();
    let mut found = listing::of_store(&data.store())?;
    found.extend(results::files(&data.results())?);
    found.extend(Record::files(&data.records())?);
    found.extend(cluster::files(data.path())?);
    let is_needed = |found: &Found| match &found.what {
        What::Quarantined => false,
        What::Unfinished => !moment.is_abandoned(&found.path),
        _ if plans.is_empty() => true,
        What::Task(key) | What::Checkpoint(key) => keys.contains(key),
        What::Stage { study, stage } => plans.iter().any(|plan| plan.has_table(study, stage)),
        What::Owner { study } | What::Record { study } | What::Cluster { study } => {
            plans.iter().any(|plan| plan.study == *study)
        }
    };
    found.retain(|found| !is_needed(found));
    Ok(found)
}

/// Receipts of elements that may be at work on other machines, which no lock may tell of.
pub fn at_work(data: &DataFolder) -> Result<Vec<Receipt>, StoreError> {
    let mut receipts = cluster::receipts(data.path())?;
    receipts.retain(Receipt::may_be_at_work);
    Ok(receipts)
}

/// Deletes files, and folders that become empty. Whoever calls it has the store alone.
pub fn delete(files: &[Found], _alone: &Lock) -> Result<(), StoreError> {
    for Found { path, .. } in files {
        remove(path)?;
        if let Some(folder) = path.parent() {
            // It is refused while something is left in it.
            let _ = fs::remove_dir(folder);
        }
    }
    Ok(())
}

/// Deletes what ended processes left unfinished. Where locks hold on one machine only, others may
/// be at work: what is theirs stays, as do the folders, in which they may be about to write.
pub fn sweep(data: &DataFolder, moment: &Moment) -> Result<(), StoreError> {
    let mut left = listing::unfinished(&data.store())?;
    left.extend(results::files(&data.results())?);
    left.extend(Record::files(&data.records())?);
    left.extend(cluster::files(data.path())?);
    left.retain(|found| found.what == What::Unfinished && moment.is_abandoned(&found.path));
    if left.is_empty() {
        return Ok(());
    }
    match Lock::alone(&data.store())? {
        Some(_alone) => left.iter().try_for_each(|found| remove(&found.path)),
        None => Ok(()),
    }
}

fn remove(path: &Path) -> Result<(), StoreError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        removed => removed.map_err(|source| StoreError::Write { path: path.to_owned(), source }),
    }
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use asperity_tables::store::users::Writer;

    use super::*;

    /// A machine on which no process lives.
    fn moment() -> Moment {
        Moment { machine: "node07".to_owned(), now: SystemTime::now(), begun: |_| None }
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
        sweep(&data, &moment()).unwrap();
        assert!(own.iter().all(|path| !path.exists()));
        assert!(others.iter().all(|path| path.exists()));
        others.iter().for_each(|path| fs::remove_file(path).unwrap());

        unfinished("node07");
        sweep(&data, &moment()).unwrap();
        assert!(workshops.iter().all(|folder| folder.exists()));
    }
}
