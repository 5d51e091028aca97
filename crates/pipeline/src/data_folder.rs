//! The folder of finished work: what is where in it.

use std::path::{Path, PathBuf};

use crate::results;
use asperity_tables::store::{Store, StoreError};

/// The folder that holds tables of tasks in `store/`, tables of stages in `results/STUDY/`, in
/// `plans/` what studies were when they last ran, and in `cluster/STUDY/` what shares one out among
/// machines. It need not exist.
///
/// ```
/// use std::path::Path;
///
/// use asperity::session::DataFolder;
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

    /// The store, to be looked at: nothing is made.
    ///
    /// # Errors
    /// When nobody can tell whether the store is pruned just now.
    pub fn look(&self) -> Result<Store, StoreError> {
        Store::look(&self.store())
    }
}
