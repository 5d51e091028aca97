//! A manifest to start from, and the schema by which editors complete and check it.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::SessionError;
use asperity_manifest::names;
use asperity_pipeline::manifest::template;
use asperity_tables::store::StoreError;

pub use asperity_pipeline::manifest::{SCHEMA, schema};

/// A manifest that has been written.
#[derive(Debug)]
pub struct NewManifest {
    pub path: PathBuf,
    /// Whether the schema was not there before.
    pub schema_is_new: bool,
}

/// Writes `NAME.toml` and, if it is not there, the schema into the current folder.
///
/// # Errors
/// When no study can have this name, the manifest is there, or a file cannot be written.
pub fn write(name: &str) -> Result<NewManifest, SessionError> {
    if !names::is_plain(name) || name.len() > names::LONGEST {
        return Err(SessionError::Refused(format!(
            "`{name}` cannot name a study: a letter or `_`, then letters, digits, `_` and `-`, {} at \
             most",
            names::LONGEST
        )));
    }
    let path = PathBuf::from(format!("{name}.toml"));
    if !write_new(&path, &template(name))? {
        return Err(SessionError::Refused(format!(
            "`{}` is there already; give the study another name",
            path.display()
        )));
    }
    let schema_is_new = write_new(Path::new(SCHEMA), &format!("{:#}\n", schema()))?;
    Ok(NewManifest { path, schema_is_new })
}

/// Writes a file; false if there is one already, which stays as it is.
fn write_new(path: &Path, text: &str) -> Result<bool, StoreError> {
    let created = fs::File::create_new(path);
    match created.and_then(|mut file| file.write_all(text.as_bytes())) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
        Err(source) => Err(StoreError::Write { path: path.to_owned(), source }),
    }
}
