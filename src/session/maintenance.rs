//! Maintenance of the data folder: verifying files and deleting unused ones.
//!
//! Verification reads each table completely: its bytes must match their digest, its columns must
//! have supported types, and its key must follow from the recipe in it. Otherwise the file is
//! quarantined, and the next run computes the table again.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::PathBuf;

use serde::{Serialize, Serializer};

use super::{DataFolder, Observer, Session, SessionError, notify_of_lock};
use asperity_manifest::diagnostics::chain;
use asperity_manifest::names;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::{adaptive_sampling, data_folder, results};
use asperity_tables::parallel;
use asperity_tables::parquet::{self, ParquetError};
use asperity_tables::store::files::{quarantine, verify_whole};
use asperity_tables::store::listing::{self, FileKind, StoredFile};
use asperity_tables::store::provenance::Provenance;
use asperity_tables::store::users::{HostState, Lock};
use asperity_tables::store::{self, Store, StoreError};

/// Result of verifying the tables, pages and figures of a data folder.
#[derive(Debug, Serialize)]
pub(crate) struct Verification {
    /// Number of tables that were read.
    pub(crate) checked: usize,
    /// Files that are damaged or cannot be read.
    pub(crate) damaged: Vec<DamagedFile>,
}

/// File that is damaged or cannot be read.
#[derive(Debug, Serialize)]
pub(crate) struct DamagedFile {
    /// Problem, with the path of the file.
    #[serde(serialize_with = "in_words")]
    pub(crate) cause: StoreError,
    /// New path, if the file was damaged and could be moved.
    #[serde(rename = "aside")]
    pub(crate) quarantined: Option<PathBuf>,
}

/// Files that pruning deleted or would delete.
#[derive(Debug, Serialize)]
pub(crate) struct Pruned {
    /// True if the files were deleted, false if they were counted.
    pub(crate) deleted: bool,
    pub(crate) files: usize,
    pub(crate) bytes: u64,
    /// Number and size of the files of each kind.
    pub(crate) kinds: Vec<PrunedKind>,
}

/// Number and size of the files of one kind.
#[derive(Debug, Serialize)]
pub(crate) struct PrunedKind {
    pub(crate) name: String,
    pub(crate) files: usize,
    pub(crate) bytes: u64,
}

/// Options of the function [`prune`].
#[derive(Debug, Clone, Copy, clap::Args)]
pub(crate) struct PruneOptions {
    /// Delete the files instead of listing them.
    #[arg(long)]
    yes: bool,

    /// Delete even if receipts report array elements running on other machines.
    ///
    /// Locks may not work across machines, so such an array element could still need the files.
    #[arg(long, requires = "yes")]
    force: bool,
}

/// Verifies the tables, pages and figures of one study or of all, and quarantines damaged tables.
///
/// If `with_layers` is set, also verifies the tables in the read-only stores below the store of the
/// data folder. Damaged files there are left in place. `checked` is called after each table with
/// the total number of tables. The observer receives a notice if the store is locked.
///
/// # Errors
/// Returns an error if the manifest is invalid, a folder cannot be listed, or a read-only store
/// cannot be used.
pub(crate) fn verify(
    data: &DataFolder,
    study: Option<&Session<'_>>,
    with_layers: bool,
    observer: &dyn Observer,
    checked: &(dyn Fn(usize) + Sync),
) -> Result<Verification, SessionError> {
    let read = study.map(|session| Ok::<_, SessionError>(session.reading()?.plan)).transpose()?;
    let plan = read.as_ref();
    notify_of_lock(data, observer);
    let store = Store::open_read_only(&data.store())?;
    let mut found = listing::store_files(&data.store())?;
    found.extend(results::files(&data.results())?);
    let mut files = of_plan(found, plan);
    let own = files.len();
    let layered = with_layers.then(|| study.map_or(data, Session::data).open_read_only());
    if let Some(store) = layered.transpose()? {
        for root in store.layers() {
            files.extend(of_plan(listing::store_files(root)?, plan));
        }
    }
    let tables: Vec<(StoredFile, bool)> =
        files.into_iter().enumerate().map(|(index, table)| (table, index < own)).collect();
    let findings = parallel::map(&tables, |(table, is_own)| {
        let finding = check(table, is_own.then_some(&store));
        checked(tables.len());
        finding
    });
    let mut damaged: Vec<DamagedFile> = findings.into_iter().flatten().collect();
    // Edited pages and figures are not moved, because a report writes them again.
    let mut folders = listing::folders(&data.results())?;
    folders.retain(|folder| plan.is_none_or(|plan| folder.ends_with(&plan.study)));
    let causes = folders.iter().flat_map(|folder| asperity_report::problems(folder));
    damaged.extend(causes.map(|cause| DamagedFile { cause, quarantined: None }));
    Ok(Verification { checked: tables.len(), damaged })
}

/// Deletes or counts the files that none of the given studies needs.
///
/// Without any study, only damaged and unfinished files are deleted.
///
/// # Errors
/// Returns an error if a manifest is invalid, the data are in use, a folder cannot be listed, or a
/// file cannot be deleted.
pub(crate) fn prune(
    data: &DataFolder,
    studies: &[Session<'_>],
    options: PruneOptions,
) -> Result<Pruned, SessionError> {
    let mut plans = Vec::new();
    for session in studies {
        plans.push(session.sampled()?.0.plan);
        // Keep all surfaces of adaptive stages, even if a table that required them is missing.
        plans.push(adaptive_sampling::maximum_plan(session.study()?));
    }
    // The exclusive lock keeps the store unchanged between listing and deleting.
    let lock = options.yes.then(|| lock_exclusively(data, options.force)).transpose()?;
    let unneeded = data_folder::unneeded(&plans, data, &HostState::here())?;
    let pruned = Pruned::count(&unneeded, options.yes);
    if let Some(lock) = &lock {
        data_folder::delete(&unneeded, lock)?;
    }
    Ok(pruned)
}

/// Returns the tables among the files that belong to one study or to all.
fn of_plan(mut found: Vec<StoredFile>, plan: Option<&Plan>) -> Vec<StoredFile> {
    let keys = plan.map(Plan::keys);
    found.retain(|found| match &found.what {
        FileKind::Task(file) => keys.as_ref().is_none_or(|keys| keys.contains(&file.key)),
        FileKind::Stage { study, stage } => plan.is_none_or(|plan| plan.has_table(study, stage)),
        _ => false,
    });
    found
}

/// Verifies a table. If it is damaged and in the data folder, whose store is `own`, quarantines it.
/// Returns `None` if the table is valid or another process has replaced it.
fn check(table: &StoredFile, own: Option<&Store>) -> Option<DamagedFile> {
    let cause = read(table).err()?;
    let Some(store) = own.filter(|_| cause.is_recomputable()) else {
        return Some(DamagedFile { cause, quarantined: None });
    };
    let quarantined = match table.what {
        FileKind::Task(_) => store.quarantine(&table.path),
        _ => quarantine(&table.path),
    };
    match quarantined {
        Ok(None) => None,
        quarantined => Some(DamagedFile { cause, quarantined: quarantined.ok().flatten() }),
    }
}

fn read(table: &StoredFile) -> Result<(), StoreError> {
    let path = &table.path;
    match &table.what {
        FileKind::Task(file) => store::verify(path, file),
        FileKind::Stage { study, stage } => {
            let metadata = verify_whole(path)?;
            // The table of failures belongs to no stage.
            let of_stage = (stage != names::FAILURES).then_some(stage.as_str());
            if metadata.get("study") == Some(study) && metadata.get("stage") == of_stage {
                return Ok(());
            }
            let owner = format!("stage `{stage}` of study `{study}`");
            Err(StoreError::Damaged { path: path.clone(), source: ParquetError::Foreign { owner } })
        }
        _ => Ok(()),
    }
}

/// Takes the exclusive lock of the store. Returns an error if the store is in use or, unless
/// `force` is set, if receipts report processes that may be running on other machines.
fn lock_exclusively(data: &DataFolder, force: bool) -> Result<Lock, SessionError> {
    let store = data.store();
    let lock = Lock::exclusive(&store)?.ok_or(SessionError::InUse { store })?;
    match data_folder::running_receipts(data)?.as_slice() {
        [receipt, more @ ..] if !force => Err(SessionError::AtWork {
            elements: 1 + more.len(),
            shard: receipt.shard,
            study: receipt.study.clone(),
            machine: receipt.machine.clone(),
        }),
        _ => Ok(lock),
    }
}

impl Pruned {
    fn count(found: &[StoredFile], deleted: bool) -> Pruned {
        let mut by_kind: BTreeMap<String, (usize, u64)> = BTreeMap::new();
        for file in found {
            let (files, bytes) = by_kind.entry(kind(file)).or_default();
            *files += 1;
            *bytes += file.bytes;
        }
        let kinds =
            by_kind.into_iter().map(|(name, (files, bytes))| PrunedKind { name, files, bytes });
        Pruned {
            deleted,
            files: found.len(),
            bytes: found.iter().map(|file| file.bytes).sum(),
            kinds: kinds.collect(),
        }
    }
}

/// Returns the name of the kind of a file. For the table of a task, it is the kind of its stage,
/// which the metadata of the file contain.
fn kind(file: &StoredFile) -> String {
    let stage = || {
        let metadata = parquet::verify(File::open(&file.path).ok()?).ok()?;
        Some(Provenance::from_metadata(&metadata)?.stage)
    };
    let name = match file.what {
        FileKind::Task(_) => return stage().unwrap_or_else(|| "unreadable".to_owned()),
        FileKind::Stage { .. } | FileKind::Owner { .. } => "results",
        FileKind::Record { .. } => "plans",
        FileKind::Cluster { .. } => "cluster",
        FileKind::Quarantined => "set aside",
        FileKind::Unfinished => "unfinished",
    };
    name.to_owned()
}

/// Serializes an error with its causes as one text.
pub(super) fn in_words<S: Serializer>(
    error: &StoreError,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&chain(error))
}
