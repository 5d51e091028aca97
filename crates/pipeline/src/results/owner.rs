//! Owners of a results folder: the manifests whose studies were written to it.
//!
//! Several manifests may give their studies the same name and thus share a results folder.
//! Therefore the folder has a record of each manifest and its study. A manifest may change its own
//! study in any way, but it may only add to the results of the others. A manifest that no longer
//! exists was renamed or deleted; another manifest that has all of its results replaces it.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::reader::ResultReader;
use crate::adaptive_sampling::with_maximum_surfaces;
use crate::manifest::composition::{EffectiveManifest, names_study, normalized};
use crate::plan::Plan;
use crate::plan::reasons::record::{PointRecord, Record, StageRecord};
use crate::study::Study;
use asperity_tables::key::TaskKey;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{Existing, from_folder, write_whole};
use asperity_tables::store::regular::read_regular;

/// Name of the file that records the owners, beside the tables.
pub const FILE: &str = "owner.json";
/// Name of the file with the effective manifest, if the manifest extends another one or if keys
/// were set on the command line.
pub const EFFECTIVE_MANIFEST: &str = "manifest.toml";
/// Maximum size in bytes of an owner file that is read, enough for tens of thousands of points.
const MAX_BYTES: u64 = 64 << 20;

/// The manifest that was run last, with the record of its study, and other manifests with results
/// in the same folder.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Owner {
    #[serde(flatten)]
    last: RecordedManifest,
    /// First paragraph of the comment at the beginning of the last manifest. It is recorded because
    /// the manifest of a received folder is not read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    description: Option<String>,
    /// Manifests that the last one extends, relative to its folder.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    extends: Vec<PathBuf>,
    /// Settings of the command line in the last run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    settings: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    others: Vec<RecordedManifest>,
}

/// A manifest with the record of its study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct RecordedManifest {
    /// Path of the manifest relative to the folder of the tables, so that both can be moved
    /// together.
    manifest: String,
    study: Record,
}

/// Another manifest with results in the folder of a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OtherManifest {
    /// The manifest exists. Both may add results.
    Shares(PathBuf),
    /// The manifest no longer exists, and its results now belong to the study.
    Gone(PathBuf),
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
    match owner {
        Some(owner) if owner.exists() => format!("`{}`", owner.display()),
        Some(owner) => format!("`{}`, which no longer exists,", owner.display()),
        None => "an unknown manifest".to_owned(),
    }
}

/// Returns the path of a manifest relative to a folder, as a text.
fn relative_path(manifest: &Path, folder: &Path) -> String {
    from_folder(manifest, folder).to_string_lossy().into_owned()
}

impl Owner {
    /// Creates the owner of the results folder `folder`.
    /// Other manifests whose results the study has, too, remain recorded.
    pub fn new(manifest: &Path, study: &Study, plan: &Plan, folder: &Path) -> Owner {
        let mut owner = Owner::at(relative_path(manifest, folder), study, plan);
        let before = Owner::read(folder).map_or_else(Vec::new, Owner::into_manifests);
        owner.others.extend(before.into_iter().filter(|other| {
            other.manifest != owner.last.manifest && other.exists(folder, &study.name)
        }));
        if !owner.others.is_empty() {
            let most = with_maximum_surfaces(study.clone());
            let record = Record::new(&most, &Plan::new(&most), &[]);
            owner.others.retain(|other| other.study.lost_by(&record).is_empty());
        }
        owner
    }

    /// Creates the owner from the path of the manifest relative to the results folder.
    pub fn at(relative_path: String, study: &Study, plan: &Plan) -> Owner {
        Owner {
            last: RecordedManifest {
                manifest: relative_path,
                study: Record::new(study, plan, &[]),
            },
            description: study.manifest.description.clone(),
            extends: study.manifest.bases.clone(),
            settings: study.manifest.settings.clone(),
            others: Vec::new(),
        }
    }

    /// Returns all manifests with results in the folder, the last one first.
    fn into_manifests(self) -> Vec<RecordedManifest> {
        [vec![self.last], self.others].concat()
    }

    /// Returns the owner as the bytes of its file.
    pub fn bytes(&self) -> Vec<u8> {
        serde_json::to_vec(self).expect("an owner is plain data")
    }

    /// Returns the record of the study whose tables the folder has.
    pub fn into_study(self) -> Record {
        self.last.study
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

/// Writes the effective manifest to the folder of the tables if it differs from the file of the
/// manifest, and otherwise deletes that of an earlier run.
pub fn write_effective_manifest(
    manifest: &EffectiveManifest,
    folder: &Path,
) -> Result<(), StoreError> {
    let path = folder.join(EFFECTIVE_MANIFEST);
    let written = fs::read_to_string(&path).ok();
    if manifest.is_composed() && written.as_ref() != Some(&manifest.text) {
        return write_whole(&path, manifest.text.as_bytes(), Existing::Replace, folder);
    }
    if !manifest.is_composed() && written.is_some() {
        return fs::remove_file(&path).map_err(|source| StoreError::writing(path, source));
    }
    Ok(())
}

impl RecordedManifest {
    /// Returns the path of the manifest relative to the current folder.
    fn path(&self, folder: &Path) -> PathBuf {
        let path = folder.join(&self.manifest);
        if path.exists() { from_folder(&path, Path::new(".")) } else { normalized(&path) }
    }

    /// Returns whether the manifest still exists and has a study of this name.
    fn exists(&self, folder: &Path, study: &str) -> bool {
        names_study(&folder.join(&self.manifest), study)
    }
}

/// Returns the path of the manifest that was run last in a results folder, and its description.
/// Returns `None` if there is no valid owner file.
pub fn manifest_of(folder: &Path) -> Option<(PathBuf, Option<String>)> {
    let owner = Owner::read(folder)?;
    Some((owner.last.path(folder), owner.description))
}

/// Checks that a study can be written to its results folder. Returns the other manifest that was
/// run last, unless the last one was the manifest of the study.
///
/// # Errors
/// Returns an error if results of another manifest would be lost.
pub fn check(
    manifest: &Path,
    study: &Study,
    plan: &Plan,
    reader: &ResultReader,
) -> Result<Option<OtherManifest>, Taken> {
    let folder = reader.folder();
    let published = reader.published_tasks();
    if published.is_empty() {
        return Ok(None);
    }
    let taken = |owner, lost| Taken { folder: folder.to_owned(), owner, lost };
    let Some(owner) = Owner::read(folder) else {
        let keys = plan.keys();
        let is_lost = |tasks: &[TaskKey]| tasks.iter().any(|task| !keys.contains(task));
        let stages = published.iter().filter(|(_, tasks)| is_lost(tasks));
        let lost: Vec<_> = stages.map(|(stage, _)| format!("rows of `{stage}`")).collect();
        return if lost.is_empty() { Ok(None) } else { Err(taken(None, lost)) };
    };
    let own = relative_path(manifest, folder);
    let was_last = owner.last.manifest == own;
    let mut others = owner.into_manifests();
    others.retain(|other| other.manifest != own);
    let Some(last) = others.first() else {
        return Ok(None);
    };
    let most = with_maximum_surfaces(study.clone());
    let record = Record::new(&most, &Plan::new(&most), &[]);
    for other in &others {
        let lost = other.study.lost_by(&record);
        if !lost.is_empty() {
            return Err(taken(Some(other.path(folder)), lost));
        }
    }
    Ok(if was_last {
        None
    } else if last.exists(folder, &study.name) {
        Some(OtherManifest::Shares(last.path(folder)))
    } else {
        Some(OtherManifest::Gone(last.path(folder)))
    })
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
