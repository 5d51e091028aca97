//! Owner of a results folder: the manifest whose study was last written to it.
//!
//! Two manifests may give their studies the same name and thus share a results folder. Therefore
//! the folder has a record of its manifest and study. The same manifest may change the study in any
//! way, but another manifest may only add results.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::reader::ResultReader;
use crate::adaptive_sampling::with_maximum_surfaces;
use crate::plan::Plan;
use crate::plan::reasons::record::{PointRecord, Record, StageRecord};
use crate::study::Study;
use asperity_stages::surface_files::read_regular;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{Existing, from_folder, write_whole};
use asperity_tables::store::key::TaskKey;

/// Name of the file that records the owner, beside the tables.
pub const FILE: &str = "owner.json";
/// Maximum size in bytes of an owner file that is read, enough for tens of thousands of points.
const MAX_BYTES: u64 = 64 << 20;

/// A manifest with the record of its study.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Owner {
    /// Path of the manifest relative to the folder of the tables, so that both can be moved
    /// together.
    manifest: String,
    study: Record,
}

/// Error of writing to a folder in which results of another manifest would be lost.
#[derive(Debug, thiserror::Error)]
#[error(
    "`{}` holds results of {} that this manifest would overwrite: {}; rename the study, or use \
     `--replace` to overwrite them",
    folder.display(),
    named(owner.as_deref()),
    lost.join(", "),
)]
pub struct Taken {
    folder: PathBuf,
    owner: Option<PathBuf>,
    lost: Vec<String>,
}

fn named(owner: Option<&Path>) -> String {
    let manifest = owner.map(|owner| format!("`{}`", owner.display()));
    manifest.unwrap_or_else(|| "an unknown manifest".to_owned())
}

/// Returns the path of a manifest relative to a folder, as a text.
fn relative_path(manifest: &Path, folder: &Path) -> String {
    from_folder(manifest, folder).to_string_lossy().into_owned()
}

impl Owner {
    /// Creates the owner of the results folder `folder`.
    pub fn new(manifest: &Path, study: &Study, plan: &Plan, folder: &Path) -> Owner {
        Owner::at(relative_path(manifest, folder), study, plan)
    }

    /// Creates the owner from the path of the manifest relative to the results folder.
    pub fn at(relative_path: String, study: &Study, plan: &Plan) -> Owner {
        Owner { manifest: relative_path, study: Record::new(study, plan, &[]) }
    }

    /// Returns the owner as the bytes of its file.
    pub fn bytes(&self) -> Vec<u8> {
        serde_json::to_vec(self).expect("an owner is plain data")
    }

    /// Returns the record of the study whose tables the folder has.
    pub fn into_study(self) -> Record {
        self.study
    }

    /// Reads the owner of a results folder. Returns `None` if there is no valid owner file.
    pub fn read(folder: &Path) -> Option<Owner> {
        let bytes = read_regular(&folder.join(FILE), MAX_BYTES).ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// Writes the owner file, unless it already has the same content.
    pub fn write(&self, folder: &Path) -> Result<(), StoreError> {
        let path = folder.join(FILE);
        let bytes = self.bytes();
        match fs::read(&path) {
            Ok(written) if written == bytes => Ok(()),
            _ => write_whole(&path, &bytes, Existing::Replace, folder),
        }
    }
}

/// Checks that a study can be written to its results folder.
///
/// # Errors
/// Returns an error if results of another manifest would be lost.
pub fn check(
    manifest: &Path,
    study: &Study,
    plan: &Plan,
    reader: &ResultReader,
) -> Result<(), Taken> {
    let folder = reader.folder();
    let owner = Owner::read(folder);
    let is_own = |owner: &Owner| owner.manifest == relative_path(manifest, folder);
    if owner.as_ref().is_some_and(is_own) {
        return Ok(());
    }
    let published = reader.published_tasks();
    let lost = match &owner {
        _ if published.is_empty() => Vec::new(),
        Some(owner) => {
            let most = with_maximum_surfaces(study.clone());
            owner.study.lost_by(&Record::new(&most, &Plan::new(&most), &[]))
        }
        None => {
            let keys = plan.keys();
            let is_lost = |tasks: &[TaskKey]| tasks.iter().any(|task| !keys.contains(task));
            let lost = published.iter().filter(|(_, tasks)| is_lost(tasks));
            lost.map(|(stage, _)| format!("rows of `{stage}`")).collect()
        }
    };
    if lost.is_empty() {
        Ok(())
    } else {
        Err(Taken {
            folder: folder.to_owned(),
            owner: owner.map(|owner| from_folder(&folder.join(owner.manifest), Path::new("."))),
            lost,
        })
    }
}

impl Record {
    /// Lists the results of this study that `other` would not have.
    fn lost_by(&self, other: &Record) -> Vec<String> {
        let lost = self.stages.iter().filter_map(|stage| {
            let name = &stage.name;
            let mut others = other.stages.iter();
            match others.find(|other| other.name == *name && other.kind == stage.kind) {
                None => Some(format!("stage `{name}`")),
                Some(other) if stage.is_covered_by(other) => None,
                Some(_) => Some(format!("rows of `{name}`")),
            }
        });
        lost.collect()
    }
}

impl StageRecord {
    /// Returns whether `other` computes everything that this stage computes.
    fn is_covered_by(&self, other: &StageRecord) -> bool {
        let reads = self.reads.iter().all(|name| other.reads.contains(name));
        let is_there = |point: &PointRecord| other.points.iter().any(|by| point.is_covered_by(by));
        reads && self.points.iter().all(is_there)
    }
}

impl PointRecord {
    /// Returns whether `other` computes everything that this point computes: `other` has the same
    /// parameters, except that its lists may have additional elements.
    fn is_covered_by(&self, other: &PointRecord) -> bool {
        let is_equal = self.identity == other.identity;
        let mut fields = self.fields.iter();
        let is_within = |(name, value): (&String, &String)| {
            let by = other.fields.get(name);
            by.is_some_and(|by| value == by || (name != SPLITS && is_part(value, by)))
        };
        self.realizations <= other.realizations && (is_equal || fields.all(is_within))
    }
}

/// Name of the parameter whose list divides rows into groups. A longer list splits existing rows
/// instead of adding rows.
const SPLITS: &str = "group_by";

/// Returns whether both values are lists and `of` has all elements of `value`.
fn is_part(value: &str, of: &str) -> bool {
    let list = |text: &str| serde_json::from_str::<Vec<Value>>(text).ok();
    match (list(value), list(of)) {
        (Some(value), Some(of)) => value.iter().all(|element| of.contains(element)),
        _ => false,
    }
}
