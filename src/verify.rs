//! Whether every table is as it was written, and every page and figure.
//!
//! A file is read to its end: its bytes must match their digest, its columns be of our types, and
//! its key follow from the recipe in it. What does not hold is quarantined, and computed again by
//! the next run.

use std::path::{Path, PathBuf};

use asperity_manifest::names;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results;
use asperity_report::seal;
use asperity_tables::parallel;
use asperity_tables::parquet::ParquetError;
use asperity_tables::store::files::{quarantine, verify_whole};
use asperity_tables::store::listing;
use asperity_tables::store::listing::{Found, What};
use asperity_tables::store::{Store, StoreError};

/// A file that is damaged, or cannot be read.
#[derive(Debug)]
pub struct Finding {
    /// What is wrong with it, and where it was.
    pub cause: StoreError,
    /// Where it is now, if it is damaged and its folder can be written.
    pub quarantined: Option<PathBuf>,
}

/// The tables that are there: those of some studies, or of all.
///
/// # Errors
/// When a folder cannot be listed.
pub fn tables(plan: Option<&Plan>, store: &Path, results: &Path) -> Result<Vec<Found>, StoreError> {
    let mut found = listing::of_store(store)?;
    found.extend(results::files(results)?);
    let keys = plan.map(Plan::keys);
    found.retain(|found| match &found.what {
        What::Task(key) => keys.as_ref().is_none_or(|keys| keys.contains(key)),
        What::Stage { study, stage } => plan.is_none_or(|plan| plan.has_table(study, stage)),
        What::Owner { .. }
        | What::Record { .. }
        | What::Cluster { .. }
        | What::Checkpoint(_)
        | What::Quarantined
        | What::Unfinished => false,
    });
    Ok(found)
}

/// Pages and figures that somebody has changed, those of a study or of all. They stay where they
/// are: a report writes them anew.
///
/// # Errors
/// When a folder cannot be listed.
pub fn pages(plan: Option<&Plan>, results: &Path) -> Result<Vec<Finding>, StoreError> {
    let mut folders = listing::folders(results)?;
    folders.retain(|folder| plan.is_none_or(|plan| folder.ends_with(&plan.study)));
    let changed = folders.iter().flat_map(|folder| seal::changed(folder));
    let findings =
        changed.map(|path| Finding { cause: StoreError::Changed { path }, quarantined: None });
    Ok(findings.collect())
}

/// Checks tables, several at once, and quarantines the damaged ones; `checked` hears of each.
pub fn check(tables: &[Found], store: &Store, checked: &(dyn Fn() + Sync)) -> Vec<Finding> {
    let findings = parallel::map(tables, |table| {
        let finding = check_one(table, store);
        checked();
        finding
    });
    findings.into_iter().flatten().collect()
}

/// Nothing if the table is sound, or if another process has mended or removed it meanwhile.
fn check_one(table: &Found, store: &Store) -> Option<Finding> {
    let cause = read(table, store).err()?;
    if !cause.is_mendable() {
        return Some(Finding { cause, quarantined: None });
    }
    let quarantined = match table.what {
        What::Task(key) => store.quarantine(key),
        _ => quarantine(&table.path),
    };
    match quarantined {
        Ok(None) => None,
        quarantined => Some(Finding { cause, quarantined: quarantined.ok().flatten() }),
    }
}

fn read(table: &Found, store: &Store) -> Result<(), StoreError> {
    let path = &table.path;
    match &table.what {
        What::Task(key) => store.verify(*key),
        What::Stage { study, stage } => {
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
        What::Owner { .. }
        | What::Record { .. }
        | What::Cluster { .. }
        | What::Checkpoint(_)
        | What::Quarantined
        | What::Unfinished => Ok(()),
    }
}
