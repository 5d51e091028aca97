//! Whether every table is as it was written.
//!
//! A file is read to its end: its bytes must match their digest, its columns be of our types, and
//! its key follow from the recipe in it. What does not hold is set aside, and computed again by
//! the next run.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::plan::Plan;
use crate::results;
use crate::store::files::{read_whole, set_aside};
use crate::store::listing::{self, Found, What};
use crate::store::parquet::{Columns, ParquetError};
use crate::store::{Store, StoreError};

/// A damaged file.
#[derive(Debug)]
pub struct Finding {
    /// What is wrong with it, and where it was.
    pub cause: StoreError,
    /// Where it is now.
    pub aside: PathBuf,
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
        What::Stage { study, stage } => plan.is_none_or(|plan| plan.has_stage(study, stage)),
        What::Record { .. } | What::Damaged | What::Unfinished => false,
    });
    Ok(found)
}

/// Checks tables, several at once, and sets the damaged ones aside; `checked` hears of each.
///
/// # Errors
/// When a file cannot be opened, or a damaged one not be renamed.
pub fn check(
    tables: &[Found],
    store: &Store,
    checked: &(dyn Fn() + Sync),
) -> Result<Vec<Finding>, StoreError> {
    let findings = tables.par_iter().map(|table| {
        let finding = check_one(table, store);
        checked();
        finding
    });
    let findings: Vec<Option<Finding>> = findings.collect::<Result<_, _>>()?;
    Ok(findings.into_iter().flatten().collect())
}

/// Nothing if the table is sound, or if another process has mended or removed it meanwhile.
fn check_one(table: &Found, store: &Store) -> Result<Option<Finding>, StoreError> {
    let cause = match read(table, store) {
        Ok(()) => return Ok(None),
        Err(cause) if cause.is_mendable() => cause,
        Err(unreadable) => return Err(unreadable),
    };
    let aside = match table.what {
        What::Task(key) => store.set_aside(key)?,
        _ => set_aside(&table.path)?,
    };
    Ok(aside.map(|aside| Finding { cause, aside }))
}

fn read(table: &Found, store: &Store) -> Result<(), StoreError> {
    let path = &table.path;
    match &table.what {
        What::Task(key) => store.read(*key, Columns::All).map(drop),
        What::Stage { study, stage } => {
            let (_, metadata) = read_whole(path, Columns::All)?;
            let told = metadata.get("study").zip(metadata.get("stage"));
            match told == Some((study, stage)) {
                true => Ok(()),
                false => Err(StoreError::Damaged {
                    path: path.clone(),
                    source: ParquetError::Foreign {
                        owner: format!("stage `{stage}` of study `{study}`"),
                    },
                }),
            }
        }
        What::Record { .. } | What::Damaged | What::Unfinished => Ok(()),
    }
}
