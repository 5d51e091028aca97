//! Computation of a study in parts, on the machines of a cluster.
//!
//! A [`Shard`](shard::Shard) is a part of a study's surfaces. Only the key of a surface decides
//! which shard it belongs to, so machines need not coordinate. The process that computes a shard
//! writes the tables of its tasks and one [receipt](mod@receipts), and no other files.
//!
//! Any scheduler that numbers the jobs of an array can be used. For Slurm, the submodules provide
//! [batch scripts](submission), the [number of array elements](sizing) from their expected cost,
//! and wrappers of its [commands](slurm).

pub mod receipts;
pub mod settings;
pub mod shard;
pub mod sizing;
pub mod slurm;
pub mod submission;

use std::path::{Path, PathBuf};

use asperity_tables::store::listing::{FileKind, StoredFile};
use asperity_tables::store::{StoreError, listing};
use receipts::Receipt;

/// Returns the folders of all studies in the `cluster/` folder of the data folder `root`.
fn studies(root: &Path) -> Result<Vec<PathBuf>, StoreError> {
    listing::folders(&root.join("cluster"))
}

/// Lists the files that this program and its jobs have written to the `cluster/` folder.
pub fn files(root: &Path) -> Result<Vec<StoredFile>, StoreError> {
    let mut files = Vec::new();
    for folder in studies(root)? {
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let what = || FileKind::Cluster { study: name.clone().into_owned() };
        let own = ["element.sh", "finish.sh", "submission.json"];
        files.extend(listing::known(&folder, |name| own.contains(&name).then(what))?);
        for (inner, ending) in [("receipts", ".json"), ("logs", ".txt")] {
            let is_own = |name: &str| name.ends_with(ending).then(what);
            files.extend(listing::known(&folder.join(inner), is_own)?);
        }
    }
    Ok(files)
}

/// Reads the receipts of all studies in a data folder.
pub fn receipts(root: &Path) -> Result<Vec<Receipt>, StoreError> {
    let mut receipts = Vec::new();
    for folder in studies(root)? {
        receipts.extend(receipts::read(&folder.join("receipts"))?);
    }
    Ok(receipts)
}
