//! Template of a manifest, and the JSON Schema that editors use to complete and check manifests.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::SessionError;
use asperity_manifest::names;
use asperity_pipeline::manifest::template;
use asperity_tables::store::StoreError;

pub(crate) use asperity_pipeline::manifest::{SCHEMA, schema};

/// Result of writing a new manifest.
#[derive(Debug)]
pub(crate) struct NewManifest {
    pub(crate) path: PathBuf,
    /// True if the schema did not exist before.
    pub(crate) schema_is_new: bool,
}

/// Writes `NAME.toml` and, if it does not exist, the schema into the current folder.
///
/// # Errors
/// Returns an error if the name is invalid, the manifest exists already, or a file cannot be
/// written.
pub(crate) fn write(name: &str) -> Result<NewManifest, SessionError> {
    if !names::is_plain(name) || name.len() > names::MAX_LENGTH {
        return Err(SessionError::refused(format!(
            "`{name}` must be a letter or `_`, then letters, digits, `_` and `-`, at most {} in \
             all",
            names::MAX_LENGTH
        )));
    }
    let path = PathBuf::from(format!("{name}.toml"));
    if !write_new(&path, &template(name))? {
        return Err(SessionError::refused(format!(
            "`{}` already exists; give the study another name",
            path.display()
        )));
    }
    let schema_is_new = write_new(Path::new(SCHEMA), &format!("{:#}\n", schema()))?;
    Ok(NewManifest { path, schema_is_new })
}

/// Writes a file and returns true, or returns false if the file exists already.
fn write_new(path: &Path, text: &str) -> Result<bool, StoreError> {
    let created = fs::File::create_new(path);
    match created.and_then(|mut file| file.write_all(text.as_bytes())) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
        Err(source) => Err(StoreError::writing(path, source)),
    }
}
