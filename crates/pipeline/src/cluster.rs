//! A study shared out among the machines of a cluster.
//!
//! A [`Shard`](shard::Shard) is a part of a study's surfaces that follows from their keys alone, so that no two
//! machines need to agree on anything. What computed a shard leaves a [receipt](mod@receipts), and writes
//! no other file but the tables of tasks. Any scheduler that can count will do; for Slurm there are
//! [scripts](submission), as many elements as the [expected cost](sizing) asks for, and its
//! [commands](slurm).

pub mod receipts;
pub mod settings;
pub mod shard;
pub mod sizing;
pub mod slurm;
pub mod submission;

use std::path::{Path, PathBuf};

use asperity_tables::store::listing::{Found, What};
use asperity_tables::store::{StoreError, listing};
use receipts::Receipt;

/// The folders of studies in `cluster/` of a folder of data.
fn studies(root: &Path) -> Result<Vec<PathBuf>, StoreError> {
    listing::folders(&root.join("cluster"))
}

/// Every file that this program, or a job of it, has put into the folders of a cluster.
pub fn files(root: &Path) -> Result<Vec<Found>, StoreError> {
    let mut files = Vec::new();
    for folder in studies(root)? {
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let what = || What::Cluster { study: name.clone().into_owned() };
        let own = ["element.sh", "finish.sh", "submission.json"];
        files.extend(listing::known(&folder, |name| own.contains(&name).then(what))?);
        for (inner, ending) in [("receipts", ".json"), ("logs", ".txt")] {
            let is_own = |name: &str| name.ends_with(ending).then(what);
            files.extend(listing::known(&folder.join(inner), is_own)?);
        }
    }
    Ok(files)
}

/// The receipts of all studies of a folder of data.
pub fn receipts(root: &Path) -> Result<Vec<Receipt>, StoreError> {
    let mut receipts = Vec::new();
    for folder in studies(root)? {
        receipts.extend(receipts::read(&folder.join("receipts"))?);
    }
    Ok(receipts)
}
