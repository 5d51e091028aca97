//! The settings file `asperity.toml`: read-only stores of a group, and settings of cluster jobs.
//!
//! Files are searched next to the manifest, in the data folder and in the user's configuration
//! folder. If several files have a key, the first one in this order is used. No result and no key
//! in the store depends on these settings.

use std::io;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;
use toml::de::DeTable;

use crate::cluster::settings::{self, Settings};
use crate::manifest::syntax::report_syntax;
use crate::manifest::table_of;
use asperity_manifest::diagnostics::{ManifestErrors, Problem, Problems, chain};
use asperity_manifest::keys::expected_keys::ExpectedKeys;
use asperity_manifest::keys::{Key, reader, table};
use asperity_tables::store::StoreError;
use asperity_tables::store::regular::read_regular;

/// Name of the settings file.
pub const FILE: &str = "asperity.toml";

/// Maximum size of the file in bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Keys of a settings file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SettingsFile {
    pub cluster: Settings,
    /// Folders of read-only stores, in the order in which they are searched. `None` if the file
    /// does not have the key.
    pub stores: Option<Vec<PathBuf>>,
}

impl SettingsFile {
    /// Reads a settings file. Relative paths in it are relative to its folder. Returns `None` if
    /// the file does not exist.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read or is wrong; the error lists all its problems.
    pub fn read(path: &Path) -> Result<Option<SettingsFile>, ManifestErrors> {
        let file = path.display().to_string();
        let unreadable = |error: io::Error| {
            let mut problems = Problems::default();
            let message = chain(&StoreError::reading(path, error));
            problems.push(Problem::without_position(message));
            problems.into_errors(&file, "")
        };
        let bytes = match read_regular(path, MAX_BYTES) {
            Err(error) if is_absent(&error) => return Ok(None),
            bytes => bytes.map_err(unreadable)?,
        };
        let text = String::from_utf8(bytes)
            .map_err(|_| unreadable(io::Error::other("it is not UTF-8")))?;
        let mut settings = SettingsFile::parse(&text, &file)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        for store in settings.stores.iter_mut().flatten() {
            *store = folder.join(&store);
        }
        Ok(Some(settings))
    }

    /// Reads the settings from the text of a file. `file` is its name in error messages.
    ///
    /// # Errors
    /// Returns an error if the text is wrong; the error lists all problems.
    pub fn parse(text: &str, file: &str) -> Result<SettingsFile, ManifestErrors> {
        let mut problems = Problems::default();
        let settings = parse(text, &mut problems);
        match settings {
            Some(settings) if problems.is_empty() => Ok(settings),
            _ => Err(problems.into_errors(file, text)),
        }
    }
}

/// Returns whether a file does not exist. Also returns true if a parent of the path is a file,
/// which other parts of the program report.
fn is_absent(error: &io::Error) -> bool {
    [io::ErrorKind::NotFound, io::ErrorKind::NotADirectory].contains(&error.kind())
}

/// Keys of a settings file besides the table `[cluster]`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct SettingsTable {
    /// Data folders of a group, or their `store/`, such as `["/shared/asperity"]`.
    stores: Key<Vec<String>>,
}

table!(SettingsTable);

fn parse(text: &str, problems: &mut Problems) -> Option<SettingsFile> {
    let (document, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        report_syntax(text, &errors, problems);
        return None;
    }
    let mut document = document.into_inner();
    let cluster = match document.remove_entry("cluster") {
        Some(entry) => {
            let span = entry.0.span();
            settings::read_table(table_of(entry, problems)?, span, problems)?
        }
        None => Settings::default(),
    };
    let of_table = ExpectedKeys::of_table("the settings file");
    let expected = ExpectedKeys { common: vec!["cluster"], ..of_table };
    let section = reader::read::<SettingsTable>(document, 0..text.len(), &expected, problems);
    let written = section.points.first()?.table.stores.written();
    let stores = written.map(|stores| stores.value.iter().map(PathBuf::from).collect());
    Some(SettingsFile { cluster, stores })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stores_are_relative_to_the_file_and_keep_their_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        std::fs::write(&path, "stores = [\"/shared/a\", \"../b\"]\n[cluster]\ncores = 2").unwrap();
        let read = SettingsFile::read(&path).unwrap().unwrap();
        let expected = vec![PathBuf::from("/shared/a"), folder.path().join("../b")];
        assert_eq!(read.stores, Some(expected));
        assert_eq!(read.cluster.cores, Some(2));
        assert_eq!(SettingsFile::parse("stores = []", FILE).unwrap().stores, Some(vec![]));
        assert_eq!(SettingsFile::parse("", FILE).unwrap().stores, None);
    }

    #[test]
    fn stores_that_are_not_folders_are_shown_at_their_places() {
        let refused = |text: &str| SettingsFile::parse(text, FILE).unwrap_err().render(false);
        insta::assert_snapshot!(refused("stores = [\"/shared\", 3, \"\"]\nstore = []\n"));
        assert!(refused("stores = \"/shared\"").contains("a list"));
    }

    #[test]
    fn a_file_that_is_no_toml_or_not_there_is_told_apart() {
        let refused = SettingsFile::parse("[cluster", FILE).unwrap_err().render(false);
        assert!(refused.contains("invalid TOML"));
        assert_eq!(SettingsFile::read(Path::new("/nowhere/asperity.toml")).unwrap(), None);
    }
}
