//! Owner of a results folder: the manifest whose study it has.
//!
//! The owner may change its study in any way. Another manifest with the same study name may write
//! to the folder only if its study is the same, or if the owner no longer exists because it was
//! renamed or deleted.

use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::{Deserialize, Serialize};

use crate::manifest::composition::{EffectiveManifest, names_study, normalized};
use crate::plan::Plan;
use crate::plan::reasons::record::Record;
use crate::results::files_of;
use crate::study::Study;
use asperity_manifest::names::FAILURES;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{from_folder, write_if_changed};
use asperity_tables::store::listing::FileKind;
use asperity_tables::store::regular::read_regular;

/// Name of the file that records the owner, beside the tables.
pub const FILE: &str = "owner.json";
/// Name of the file with the effective manifest, if the manifest extends another one or if keys
/// were set on the command line.
pub const EFFECTIVE_MANIFEST: &str = "manifest.toml";
/// Maximum size in bytes of an owner file that is read, enough for tens of thousands of points.
const MAX_BYTES: u64 = 64 << 20;

/// The manifest to which a results folder belongs, with the record of its study.
#[derive(Debug, Serialize, Deserialize)]
pub struct Owner {
    /// Path of the manifest relative to the folder of the tables, so that both can be moved
    /// together.
    manifest: String,
    study: Record,
    /// First paragraph of the comment at the beginning of the manifest. It is recorded because the
    /// manifest of a received folder is not read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    description: Option<String>,
    /// Manifests that the manifest extends, relative to its folder.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    extends: Vec<PathBuf>,
    /// Settings of the command line in the last run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    settings: Vec<String>,
}

/// Error of writing to a folder that belongs to another manifest.
#[derive(Debug, thiserror::Error)]
#[error(
    "`{}` holds results of {}; rename the study, or use `--replace` to overwrite them",
    folder.display(),
    owner.as_ref().map_or("an unknown manifest".to_owned(), |owner| {
        format!("`{}`, another study of the same name", owner.display())
    }),
)]
pub struct Taken {
    folder: PathBuf,
    owner: Option<PathBuf>,
}

impl Owner {
    /// Creates the owner of the results folder `folder`. If another manifest with the same study
    /// has it, this one stays the owner, so that a copy cannot be edited at its expense.
    pub fn new(manifest: &Path, study: &Study, plan: &Plan, folder: &Path) -> Owner {
        let owner = Owner::at(relative_path(manifest, folder), study, plan);
        let before = Owner::read(folder).filter(|before| {
            before.manifest != owner.manifest
                && before.study.bytes() == owner.study.bytes()
                && before.exists(folder, &study.name)
        });
        before.unwrap_or(owner)
    }

    /// Creates the owner from the path of the manifest relative to the results folder.
    pub fn at(relative_path: String, study: &Study, plan: &Plan) -> Owner {
        Owner {
            manifest: relative_path,
            study: Record::new(study, plan, &[]),
            description: study.manifest.description.clone(),
            extends: study.manifest.bases.clone(),
            settings: study.manifest.settings.clone(),
        }
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
        write_if_changed(&folder.join(FILE), &self.bytes(), folder)
    }

    /// Returns whether the manifest still exists and has a study of this name.
    fn exists(&self, folder: &Path, study: &str) -> bool {
        names_study(&folder.join(&self.manifest), study)
    }

    /// Returns the path of the manifest relative to the current folder.
    fn path(&self, folder: &Path) -> PathBuf {
        let path = folder.join(&self.manifest);
        if path.exists() { from_folder(&path, Path::new(".")) } else { normalized(&path) }
    }
}

/// Returns the path of a manifest relative to a folder, as a text.
fn relative_path(manifest: &Path, folder: &Path) -> String {
    from_folder(manifest, folder).to_string_lossy().into_owned()
}

/// Writes the effective manifest to the folder of the tables if it differs from the file of the
/// manifest, and otherwise deletes that of an earlier run.
pub fn write_effective_manifest(
    manifest: &EffectiveManifest,
    folder: &Path,
) -> Result<(), StoreError> {
    let path = folder.join(EFFECTIVE_MANIFEST);
    if manifest.is_composed() {
        return write_if_changed(&path, manifest.text.as_bytes(), folder);
    }
    match fs::remove_file(&path) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            Err(StoreError::writing(path, source))
        }
        _ => Ok(()),
    }
}

/// Returns the path of the manifest that was run last in a results folder, and its description.
/// Returns `None` if there is no valid owner file.
pub fn manifest_of(folder: &Path) -> Option<(PathBuf, Option<String>)> {
    let owner = Owner::read(folder)?;
    Some((owner.path(folder), owner.description))
}

/// Checks that a study can be written to its results folder `folder`. Returns the path of the
/// former owner if it no longer exists.
///
/// # Errors
/// Returns an error if the folder has results of another study.
pub fn check(
    manifest: &Path,
    study: &Study,
    plan: &Plan,
    folder: &Path,
) -> Result<Option<PathBuf>, Taken> {
    let is_table =
        |what: &FileKind| matches!(what, FileKind::Stage { stage, .. } if stage != FAILURES);
    if !files_of(folder).unwrap_or_default().iter().any(|file| is_table(&file.what)) {
        return Ok(None);
    }
    let taken = |owner| Err(Taken { folder: folder.to_owned(), owner });
    let Some(owner) = Owner::read(folder) else { return taken(None) };
    if owner.manifest == relative_path(manifest, folder) {
        return Ok(None);
    }
    let path = Some(owner.path(folder));
    if !owner.exists(folder, &study.name) {
        Ok(path)
    } else if owner.study.bytes() == Record::new(study, plan, &[]).bytes() {
        Ok(None)
    } else {
        taken(path)
    }
}
