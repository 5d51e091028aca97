//! What nobody needs any more: tables that no named study asks for, damaged files that were set
//! aside, and what killed processes left unfinished.

use std::collections::HashSet;
use std::fs;
use std::io;
use std::path::Path;

use crate::plan::Plan;
use crate::reasons::record::Record;
use crate::results;
use crate::store::StoreError;
use crate::store::key::TaskKey;
use crate::store::listing::{self, Found, What};
use crate::store::lock::Lock;

/// Where things are.
#[derive(Debug)]
pub struct Folders<'a> {
    /// Tables of tasks.
    pub store: &'a Path,
    /// Tables of stages.
    pub results: &'a Path,
    /// What studies were when they last ran.
    pub records: &'a Path,
}

/// What none of these studies needs. Without any study no table is unneeded: naming none is
/// rather a slip than a wish to lose everything.
///
/// # Errors
/// When a folder cannot be listed.
pub fn unneeded(plans: &[Plan], folders: &Folders) -> Result<Vec<Found>, StoreError> {
    let keys: HashSet<TaskKey> = plans.iter().flat_map(Plan::keys).collect();
    let mut found = listing::of_store(folders.store)?;
    found.extend(results::files(folders.results)?);
    found.extend(Record::files(folders.records)?);
    let is_needed = |found: &Found| match &found.what {
        What::Damaged | What::Unfinished => false,
        _ if plans.is_empty() => true,
        What::Task(key) => keys.contains(key),
        What::Stage { study, stage } => plans.iter().any(|plan| plan.has_table(study, stage)),
        What::Record { study } => plans.iter().any(|plan| plan.study == *study),
    };
    found.retain(|found| !is_needed(found));
    Ok(found)
}

/// Deletes files, and folders that become empty. Whoever calls it has the store alone.
///
/// # Errors
/// When a file cannot be deleted.
pub fn delete(files: &[Found], _alone: &Lock) -> Result<(), StoreError> {
    for Found { path, .. } in files {
        match fs::remove_file(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            removed => removed.map_err(|source| StoreError::Write {
                path: path.clone(),
                source,
            })?,
        }
        if let Some(folder) = path.parent() {
            // It is refused while something is left in it.
            let _ = fs::remove_dir(folder);
        }
    }
    Ok(())
}

/// Deletes what killed processes left unfinished, unless a process that is alive may be writing
/// it.
///
/// # Errors
/// When a folder cannot be listed, or a file not be deleted.
pub fn sweep(folders: &Folders) -> Result<(), StoreError> {
    let mut left = listing::unfinished(folders.store)?;
    left.extend(results::files(folders.results)?);
    left.extend(Record::files(folders.records)?);
    left.retain(|found| found.what == What::Unfinished);
    if left.is_empty() {
        return Ok(());
    }
    match Lock::alone(folders.store)? {
        Some(alone) => delete(&left, &alone),
        None => Ok(()),
    }
}
