//! Whose tables these are.
//!
//! Two manifests may give their studies one name. So the folder of results says for which file it
//! was last written, and what that asked for: the same file may change its mind, another one may
//! only add.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::archive::Archive;
use crate::adaptive_sampling::at_its_most;
use crate::plan::Plan;
use crate::plan::reasons::record::{PointRecord, Record, StageRecord};
use crate::study::Study;
use asperity_stages::surface_files::read_regular;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{Existing, from_folder, write_whole};
use asperity_tables::store::key::TaskKey;

/// The file that says it, beside the tables.
pub const FILE: &str = "owner.json";
/// It is not read beyond this: tens of thousands of points.
const LARGEST: u64 = 64 << 20;

/// A manifest, and the study that it asked for.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Owner {
    /// Where it is, seen from the folder of the tables, so that both may move together.
    manifest: String,
    study: Record,
}

/// The tables of a study are another's.
#[derive(Debug, thiserror::Error)]
#[error(
    "`{}` has tables of {} that this one would take away: {}; give the study another name, or say \
     `--replace`",
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

/// Where a manifest is, seen from a folder, as text.
fn place(manifest: &Path, folder: &Path) -> String {
    from_folder(manifest, folder).to_string_lossy().into_owned()
}

impl Owner {
    /// A manifest, as the owner of the tables in a folder.
    pub fn of(manifest: &Path, study: &Study, plan: &Plan, folder: &Path) -> Owner {
        Owner::at(place(manifest, folder), study, plan)
    }

    /// A manifest, as the owner of tables from whose folder it is at `place`.
    pub fn at(place: String, study: &Study, plan: &Plan) -> Owner {
        Owner { manifest: place, study: Record::of(study, plan, &[]) }
    }

    /// What the file says.
    pub fn bytes(&self) -> Vec<u8> {
        serde_json::to_vec(self).expect("an owner is plain data")
    }

    /// Who owns the tables in a folder, as far as that is known.
    fn read(folder: &Path) -> Option<Owner> {
        let bytes = read_regular(&folder.join(FILE), LARGEST).ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// Says so beside the tables, unless it is said there already.
    pub fn write(&self, folder: &Path) -> Result<(), StoreError> {
        let path = folder.join(FILE);
        let bytes = self.bytes();
        match fs::read(&path) {
            Ok(written) if written == bytes => Ok(()),
            _ => write_whole(&path, &bytes, Existing::Replace, folder),
        }
    }
}

/// Refuses a study whose tables would take away those of another manifest in the same folder.
pub fn check(manifest: &Path, study: &Study, plan: &Plan, archive: &Archive) -> Result<(), Taken> {
    let folder = archive.folder();
    let owner = Owner::read(folder);
    let is_own = |owner: &Owner| owner.manifest == place(manifest, folder);
    if owner.as_ref().is_some_and(is_own) {
        return Ok(());
    }
    let published = archive.published_tasks();
    let lost = match &owner {
        _ if published.is_empty() => Vec::new(),
        Some(owner) => {
            let most = at_its_most(study.clone());
            owner.study.lost_by(&Record::of(&most, &Plan::of(&most), &[]))
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
    /// What the tables of this study have and those of another lack, in words.
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
    /// Whether another stage computes all that this one does.
    fn is_covered_by(&self, other: &StageRecord) -> bool {
        let reads = self.reads.iter().all(|name| other.reads.contains(name));
        let is_there = |point: &PointRecord| other.points.iter().any(|by| point.is_covered_by(by));
        reads && self.points.iter().all(is_there)
    }
}

impl PointRecord {
    /// Whether another point computes all that this one does: it has the same parameters, and at
    /// least the elements of each list.
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

/// A list that does not add rows when it is longer, but splits them.
const SPLITS: &str = "group_by";

/// Whether two values are lists, and one has all elements of the other.
fn is_part(value: &str, of: &str) -> bool {
    let list = |text: &str| serde_json::from_str::<Vec<Value>>(text).ok();
    match (list(value), list(of)) {
        (Some(value), Some(of)) => value.iter().all(|element| of.contains(element)),
        _ => false,
    }
}
