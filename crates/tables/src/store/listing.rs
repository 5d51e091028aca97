//! Listings of the files in a store and in results folders. The kind of a file is known from its
//! name.

use std::path::{Path, PathBuf};

use super::files::{DAMAGED, names};
use super::series::FileName;
use super::users::UNFINISHED;
use super::{STAGING, StoreError, path};

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredFile {
    pub path: PathBuf,
    pub bytes: u64,
    pub what: FileKind,
}

/// Kind of a file according to its name and folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FileKind {
    Task(FileName),
    Stage {
        study: String,
        stage: String,
    },
    /// File that names the manifest to which a results folder belongs.
    Owner {
        study: String,
    },
    /// Record of the study at its last run.
    Record {
        study: String,
    },
    /// Script, receipt or other file of the cluster jobs of a study.
    Cluster {
        study: String,
    },
    Quarantined,
    /// File that a process is writing, or that a killed process has left.
    Unfinished,
}

/// Lists the files of this program in a store, including unfinished and damaged files.
///
/// # Errors
/// Returns an error if a folder cannot be listed.
pub fn store_files(root: &Path) -> Result<Vec<StoredFile>, StoreError> {
    let mut files = Vec::new();
    for folder in folders(root)? {
        let table = |name: &str| {
            let file: FileName = name.parse().ok()?;
            let is_in_its_folder = path(root, file.key).parent() == Some(&folder);
            is_in_its_folder.then_some(FileKind::Task(file))
        };
        files.extend(known(&folder, table)?);
    }
    Ok(files)
}

/// Lists the unfinished files of a store, which are in its staging folder.
///
/// # Errors
/// Returns an error if the folder cannot be listed.
pub fn unfinished(root: &Path) -> Result<Vec<StoredFile>, StoreError> {
    known(&root.join(STAGING), |_| None)
}

/// Lists the files of this program in a folder. `whole` returns the kind of a file with a given
/// name that is neither unfinished nor in quarantine, or `None` for a file of another program.
///
/// # Errors
/// Returns an error if the folder cannot be listed.
pub fn known(
    folder: &Path,
    whole: impl Fn(&str) -> Option<FileKind>,
) -> Result<Vec<StoredFile>, StoreError> {
    let what = |name: &str| {
        if name.starts_with(UNFINISHED) {
            return Some(FileKind::Unfinished);
        }
        let end = name.rsplit_once(".parquet").map_or("", |(_, end)| end);
        let is_quarantined = end.starts_with(DAMAGED);
        if is_quarantined { Some(FileKind::Quarantined) } else { whole(name) }
    };
    let names = names(folder)?.into_iter();
    let found = names.filter_map(|name| {
        let what = what(&name)?;
        let path = folder.join(name);
        // The size of a file that has just been removed is reported as zero.
        let bytes = path.metadata().map_or(0, |metadata| metadata.len());
        Some(StoredFile { path, bytes, what })
    });
    Ok(found.collect())
}

/// Returns the paths of the folders in a folder, sorted by name. If the folder does not exist,
/// there are none.
///
/// # Errors
/// Returns an error if the folder cannot be listed.
pub fn folders(folder: &Path) -> Result<Vec<PathBuf>, StoreError> {
    let paths = names(folder)?.into_iter().map(|name| folder.join(name));
    Ok(paths.filter(|path| path.is_dir()).collect())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::key::{Digest, TaskKey};

    #[test]
    fn files_are_recognized_by_name_and_folder() {
        let root = tempfile::tempdir().unwrap();
        let key = TaskKey::new("test", 1, Digest::from_params(&()), &[]);
        let digits = key.to_string();
        let mut ours = Vec::new();
        let mut write = |folder: &str, name: &str, what: Option<FileKind>| {
            let path = root.path().join(folder).join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, "12345").unwrap();
            ours.extend(what.map(|what| StoredFile { path, bytes: 5, what }));
        };
        let folder = &digits[..2];
        write(
            folder,
            &format!("{digits}.parquet"),
            Some(FileKind::Task(FileName { key, rows: None })),
        );
        write(folder, &format!("{digits}.parquet.damaged"), Some(FileKind::Quarantined));
        write(folder, &format!("{digits}.parquet.damaged-2"), Some(FileKind::Quarantined));
        write("unfinished", ".unfinished-Xy", Some(FileKind::Unfinished));
        write("zz", &format!("{digits}.parquet"), None);
        write(folder, "notes.txt", None);
        write(folder, "table.parquet", None);
        write(".", "lock", None);
        assert_eq!(store_files(root.path()).unwrap(), ours);
        assert_eq!(unfinished(root.path()).unwrap(), ours[3..]);
    }

    #[test]
    fn a_missing_folder_is_empty() {
        let root = tempfile::tempdir().unwrap();
        assert_eq!(store_files(&root.path().join("nowhere")).unwrap(), []);
    }
}
