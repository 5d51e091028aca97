//! The settings file `asperity.toml`: read-only stores of a group, and settings of cluster jobs.
//!
//! Files are searched next to the manifest, in the data folder and in the user's configuration
//! folder. If several files have a key, the first one in this order is used. No result and no key
//! in the store depends on these settings.

use std::io;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use crate::cluster::settings::{self, Settings};
use crate::manifest::syntax::report_syntax;
use asperity_manifest::diagnostics::{
    ManifestErrors, Problem, Problems, Span, chain, did_you_mean,
};
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

fn parse(text: &str, problems: &mut Problems) -> Option<SettingsFile> {
    let (document, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        report_syntax(text, &errors, problems);
        return None;
    }
    let mut found = SettingsFile::default();
    for (key, value) in document.into_inner() {
        let (name, span) = (key.get_ref().to_string(), key.span());
        let place = value.span();
        match value.into_inner() {
            DeValue::Table(table) if name == "cluster" => {
                found.cluster = settings::read_table(table, span, problems)?;
            }
            value if name == "stores" => found.stores = stores(&value, place, problems),
            _ => {
                let label = match did_you_mean(&name, ["cluster", "stores"]) {
                    Some("cluster") => "did you mean `[cluster]`?",
                    Some(_) => "did you mean `stores`?",
                    None => "not allowed in this file",
                };
                let problem = Problem::new(format!("unknown `{name}`"), span, label);
                let help = format!("`{FILE}` has the list `stores` and the table `[cluster]`");
                problems.push(problem.help(help));
            }
        }
    }
    Some(found)
}

/// Reads the list of stores. Returns `None` and reports problems if it is wrong.
fn stores(value: &DeValue<'_>, place: Span, problems: &mut Problems) -> Option<Vec<PathBuf>> {
    let mut refuse = |span: Span, label: &str| {
        let problem = Problem::new("`stores` is not a list of folders", span, label);
        let example = "`stores = [\"/shared/asperity\"]`";
        problems
            .push(problem.help(format!("list data folders or their `store/`, as in {example}")));
    };
    let DeValue::Array(items) = value else {
        refuse(place, "must be a list");
        return None;
    };
    let mut folders = Vec::new();
    for item in items {
        match item.get_ref() {
            DeValue::String(folder) if !folder.is_empty() => folders.push(PathBuf::from(&**folder)),
            _ => refuse(item.span(), "must be a folder"),
        }
    }
    Some(folders)
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
        assert!(refused("stores = \"/shared\"").contains("must be a list"));
    }

    #[test]
    fn a_file_that_is_no_toml_or_not_there_is_told_apart() {
        let refused = SettingsFile::parse("[cluster", FILE).unwrap_err().render(false);
        assert!(refused.contains("invalid TOML"));
        assert_eq!(SettingsFile::read(Path::new("/nowhere/asperity.toml")).unwrap(), None);
    }
}
