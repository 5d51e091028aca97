//! Looking after the folder of data: whether every table, page and figure is as it was written, and
//! what no study needs.
//!
//! To verify a table, it is read to its end: its bytes must match their digest, its columns be of
//! our types, and its key follow from the recipe in it. What does not hold is quarantined, and
//! computed again by the next run.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::PathBuf;

use serde::{Serialize, Serializer};

use super::{DataFolder, Session, SessionError};
use asperity_manifest::diagnostics::chain;
use asperity_manifest::names;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::{adaptive_sampling, data_folder, results};
use asperity_report::changed_files;
use asperity_tables::parallel;
use asperity_tables::parquet::{self, ParquetError};
use asperity_tables::store::files::{quarantine, verify_whole};
use asperity_tables::store::key::Provenance;
use asperity_tables::store::listing::{self, FileKind, StoredFile};
use asperity_tables::store::users::{HostState, Lock};
use asperity_tables::store::{Store, StoreError};

/// What became of verifying the tables, pages and figures of a folder of data.
#[derive(Debug, Serialize)]
pub struct Verification {
    /// How many tables were read.
    pub checked: usize,
    /// Files that are damaged, or cannot be read.
    pub damaged: Vec<Finding>,
}

/// A file that is damaged, or cannot be read.
#[derive(Debug, Serialize)]
pub struct Finding {
    /// What is wrong with it, and where it was.
    #[serde(serialize_with = "in_words")]
    pub cause: StoreError,
    /// Where it is now, if it is damaged and its folder can be written.
    #[serde(rename = "aside")]
    pub quarantined: Option<PathBuf>,
}

/// What was deleted, or would be.
#[derive(Debug, Serialize)]
pub struct Pruned {
    /// Whether it was.
    pub deleted: bool,
    pub files: usize,
    pub bytes: u64,
    /// The same by what the files are.
    pub kinds: Vec<PrunedKind>,
}

/// Files of one kind.
#[derive(Debug, Serialize)]
pub struct PrunedKind {
    pub name: String,
    pub files: usize,
    pub bytes: u64,
}

/// What pruning does.
#[derive(Debug, Clone, Copy, Default)]
pub struct PruneOptions {
    /// Whether to delete what would otherwise only be counted.
    pub delete: bool,
    /// Whether to delete even while elements may be at work on other machines, as their receipts
    /// say: no lock tells of them.
    pub force: bool,
}

/// Verifies the tables, pages and figures of a study, or of all; damaged tables are quarantined.
/// `checked` hears, with the number of tables, whenever one has been read.
///
/// # Errors
/// When the manifest makes no sense, or a folder cannot be listed.
pub fn verify(
    data: &DataFolder,
    study: Option<&Session<'_>>,
    checked: &(dyn Fn(usize) + Sync),
) -> Result<Verification, SessionError> {
    let plan = study.map(|session| Ok::<_, SessionError>(session.reading()?.plan)).transpose()?;
    let (plan, store) = (plan.as_ref(), data.open_read_only()?);
    let tables = tables(plan, data)?;
    let findings = parallel::map(&tables, |table| {
        let finding = check(table, &store);
        checked(tables.len());
        finding
    });
    let mut damaged: Vec<Finding> = findings.into_iter().flatten().collect();
    damaged.extend(pages(plan, data)?);
    Ok(Verification { checked: tables.len(), damaged })
}

/// Deletes what no named study needs, or counts it. Without any study, all tables stay, and only
/// damaged and unfinished files go.
///
/// # Errors
/// When a manifest makes no sense, the data are in use, or a folder cannot be listed or a file not
/// be deleted.
pub fn prune(
    data: &DataFolder,
    studies: &[Session<'_>],
    options: PruneOptions,
) -> Result<Pruned, SessionError> {
    let mut plans = Vec::new();
    for session in studies {
        plans.push(session.sampled()?.plan);
        // Surfaces that were drawn are needed, even where a table that asked for them is missing.
        plans.push(adaptive_sampling::maximum_plan(session.study()?));
    }
    // Who has the store alone looks at it without sharing it: nothing changes until the end.
    let alone = match options.delete {
        true => Some(alone(data, options.force)?),
        false => None,
    };
    let unneeded = data_folder::unneeded(&plans, data, &HostState::here())?;
    let pruned = Pruned::of(&unneeded, options.delete);
    if let Some(alone) = &alone {
        data_folder::delete(&unneeded, alone)?;
    }
    Ok(pruned)
}

/// The tables that are there: those of some studies, or of all.
fn tables(plan: Option<&Plan>, data: &DataFolder) -> Result<Vec<StoredFile>, StoreError> {
    let mut found = listing::store_files(&data.store())?;
    found.extend(results::files(&data.results())?);
    let keys = plan.map(Plan::keys);
    found.retain(|found| match &found.what {
        FileKind::Task(key) => keys.as_ref().is_none_or(|keys| keys.contains(key)),
        FileKind::Stage { study, stage } => plan.is_none_or(|plan| plan.has_table(study, stage)),
        FileKind::Owner { .. }
        | FileKind::Record { .. }
        | FileKind::Cluster { .. }
        | FileKind::Checkpoint(_)
        | FileKind::Quarantined
        | FileKind::Unfinished => false,
    });
    Ok(found)
}

/// Pages and figures that somebody has changed, those of a study or of all. They stay where they
/// are: a report writes them anew.
fn pages(plan: Option<&Plan>, data: &DataFolder) -> Result<Vec<Finding>, StoreError> {
    let mut folders = listing::folders(&data.results())?;
    folders.retain(|folder| plan.is_none_or(|plan| folder.ends_with(&plan.study)));
    let changed = folders.iter().flat_map(|folder| changed_files(folder));
    let findings =
        changed.map(|path| Finding { cause: StoreError::Changed { path }, quarantined: None });
    Ok(findings.collect())
}

/// Nothing if the table is sound, or if another process has mended or removed it meanwhile.
fn check(table: &StoredFile, store: &Store) -> Option<Finding> {
    let cause = read(table, store).err()?;
    if !cause.is_recomputable() {
        return Some(Finding { cause, quarantined: None });
    }
    let quarantined = match table.what {
        FileKind::Task(key) => store.quarantine(key),
        _ => quarantine(&table.path),
    };
    match quarantined {
        Ok(None) => None,
        quarantined => Some(Finding { cause, quarantined: quarantined.ok().flatten() }),
    }
}

fn read(table: &StoredFile, store: &Store) -> Result<(), StoreError> {
    let path = &table.path;
    match &table.what {
        FileKind::Task(key) => store.verify(*key),
        FileKind::Stage { study, stage } => {
            let metadata = verify_whole(path)?;
            // The table of failures is of no stage.
            let of_stage = (stage != names::FAILURES).then_some(stage.as_str());
            match metadata.get("study") == Some(study) && metadata.get("stage") == of_stage {
                true => Ok(()),
                false => Err(StoreError::Damaged {
                    path: path.clone(),
                    source: ParquetError::Foreign {
                        owner: format!("stage `{stage}` of study `{study}`"),
                    },
                }),
            }
        }
        FileKind::Owner { .. }
        | FileKind::Record { .. }
        | FileKind::Cluster { .. }
        | FileKind::Checkpoint(_)
        | FileKind::Quarantined
        | FileKind::Unfinished => Ok(()),
    }
}

/// Locks may hold on one machine only: of other machines nothing is known but receipts.
fn alone(data: &DataFolder, force: bool) -> Result<Lock, SessionError> {
    let store = data.store();
    let alone = Lock::exclusive(&store)?.ok_or(SessionError::InUse { store })?;
    match data_folder::running_receipts(data)?.as_slice() {
        [receipt, more @ ..] if !force => Err(SessionError::AtWork {
            elements: 1 + more.len(),
            shard: receipt.shard,
            study: receipt.study.clone(),
            machine: receipt.machine.clone(),
        }),
        _ => Ok(alone),
    }
}

impl Pruned {
    fn of(found: &[StoredFile], deleted: bool) -> Pruned {
        let mut kinds: BTreeMap<String, (usize, u64)> = BTreeMap::new();
        for file in found {
            let (files, bytes) = kinds.entry(kind(file)).or_default();
            *files += 1;
            *bytes += file.bytes;
        }
        let kinds =
            kinds.into_iter().map(|(name, (files, bytes))| PrunedKind { name, files, bytes });
        Pruned {
            deleted,
            files: found.len(),
            bytes: found.iter().map(|file| file.bytes).sum(),
            kinds: kinds.collect(),
        }
    }
}

/// What a file is, in a word or two; the table of a task tells its stage's kind itself.
fn kind(file: &StoredFile) -> String {
    let stage = || {
        let metadata = parquet::verify(File::open(&file.path).ok()?).ok()?;
        Some(Provenance::from_metadata(&metadata)?.stage)
    };
    match file.what {
        FileKind::Task(_) => stage().unwrap_or_else(|| "unreadable".to_owned()),
        FileKind::Stage { .. } | FileKind::Owner { .. } => "results".to_owned(),
        FileKind::Checkpoint(_) => "checkpoints".to_owned(),
        FileKind::Record { .. } => "plans".to_owned(),
        FileKind::Cluster { .. } => "cluster".to_owned(),
        FileKind::Quarantined => "set aside".to_owned(),
        FileKind::Unfinished => "unfinished".to_owned(),
    }
}

/// An error and its causes, in one sentence.
pub(super) fn in_words<S: Serializer>(
    error: &StoreError,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&chain(error))
}
