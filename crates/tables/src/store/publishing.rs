//! Publishing of tables under names that may exist.
//!
//! Most file systems can rename a file, or link it, only if the new name is free. On some file
//! systems of clusters, both are refused, links exist only within a folder, or links become
//! symbolic. There, a process claims the name before it renames its file: it creates a lock file,
//! which fails if another process has claimed the name.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use tempfile::{NamedTempFile, TempPath};

use super::users::{UNFINISHED, Writer};

/// Name of the file in the store that exists if tables are published under lock files.
const NOTE: &str = "publishing";

/// Content of this file.
const TEXT: &str = "This file system cannot rename or link a file only if the new name is free.\n\
                    asperity creates a lock file before it renames a table.\n";

/// Time after which the owner of a lock file is considered dead. Renaming a file takes
/// milliseconds.
const ABANDONED_AFTER: Duration = Duration::from_secs(10);

/// Handling of an existing file with the same path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Keep the existing file, because it has the same content.
    Keep,
    /// Keep the existing file on a file system that cannot rename a file only to a free name.
    KeepByLockFile,
    /// Replace the existing file by the new one.
    Replace,
}

/// Finds out how a new table in `folder` keeps an existing table of the same name, by trying it
/// with empty files. Notes in the store `root` if lock files are needed.
pub fn trial(root: &Path, staging: &Path, folder: &Path) -> Existing {
    let way = if keeps_names(staging, folder) { Existing::Keep } else { Existing::KeepByLockFile };
    let note = root.join(NOTE);
    // Ignore errors: the note is for users only.
    let _ = match way {
        Existing::KeepByLockFile if !note.exists() => fs::write(&note, TEXT),
        Existing::KeepByLockFile => Ok(()),
        _ => fs::remove_file(&note),
    };
    way
}

/// Returns whether the last trial found that tables of the store are published under lock files.
pub fn uses_lock_files(root: &Path) -> bool {
    root.join(NOTE).is_file()
}

/// Returns whether a file can be moved from `staging` to a free name in `folder`, and whether a
/// name that is not free is refused.
fn keeps_names(staging: &Path, folder: &Path) -> bool {
    let Ok(first) = unfinished_file(staging) else { return false };
    let name = folder.join(first.path().file_name().unwrap_or_default());
    let exists = |error: &io::Error| error.kind() == io::ErrorKind::AlreadyExists;
    let is_refused = |second: NamedTempFile| {
        second.persist_noclobber(&name).is_err_and(|refused| exists(&refused.error))
    };
    let keeps = first.persist_noclobber(&name).is_ok()
        // A symbolic link would lead nowhere, because the file in `staging` has been removed.
        && name.symlink_metadata().is_ok_and(|metadata| metadata.is_file())
        && unfinished_file(staging).is_ok_and(is_refused);
    let _ = fs::remove_file(&name);
    keeps
}

/// Creates an empty file in the folder `staging`, with a name that identifies this process.
pub fn unfinished_file(staging: &Path) -> io::Result<NamedTempFile> {
    tempfile::Builder::new()
        .prefix(&Writer::own().prefix())
        .permissions(as_the_umask_allows())
        .tempfile_in(staging)
}

/// Returns the permissions of other programs for new files, of which the system removes those in
/// the umask. Temporary files would otherwise be private.
fn as_the_umask_allows() -> fs::Permissions {
    use std::os::unix::fs::PermissionsExt;
    fs::Permissions::from_mode(0o666)
}

/// Moves a file to `path` unless a file of this name exists. A link that leads nowhere is replaced.
pub fn publish(file: NamedTempFile, path: &Path, existing: Existing) -> io::Result<()> {
    let file = match existing {
        Existing::Replace => file,
        Existing::Keep => match file.persist_noclobber(path) {
            Ok(_) => return Ok(()),
            Err(refused) if refused.error.kind() == io::ErrorKind::AlreadyExists => refused.file,
            Err(refused) => return Err(refused.error),
        },
        Existing::KeepByLockFile => return publish_locked(file.into_temp_path(), path),
    };
    if existing == Existing::Keep && path.exists() {
        return is_file(path);
    }
    file.persist(path)?;
    Ok(())
}

/// Moves a file to `path` unless a file of this name exists, while the lock file of `path` exists.
fn publish_locked(file: TempPath, path: &Path) -> io::Result<()> {
    let _lock = LockFile::create(path, file.parent().unwrap_or(Path::new(".")))?;
    if path.exists() { is_file(path) } else { Ok(file.persist(path)?) }
}

/// Checks that an existing path is a file and not, for example, a folder of the same name.
fn is_file(path: &Path) -> io::Result<()> {
    if path.is_file() { Ok(()) } else { Err(io::Error::other("the path exists and is not a file")) }
}

/// Lock file in the staging folder, which names its owner and is removed when it is dropped.
struct LockFile(PathBuf);

impl LockFile {
    /// Creates the lock file of `path`. Waits while another process has it, and takes the lock file
    /// of a process that has died. Should that process live nevertheless, it replaces the table by
    /// an equal one.
    fn create(path: &Path, staging: &Path) -> io::Result<LockFile> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let lock = staging.join(format!("{UNFINISHED}lock-{name}"));
        let until = Instant::now() + ABANDONED_AFTER;
        loop {
            match OpenOptions::new().write(true).create_new(true).open(&lock) {
                Ok(mut file) => {
                    // The owner is written for users only.
                    let _ = writeln!(file, "{}", Writer::own());
                    return Ok(LockFile(lock));
                }
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
                Err(_) if Instant::now() >= until => return Ok(LockFile(lock)),
                Err(_) => sleep(Duration::from_millis(20)),
            }
        }
    }
}

impl Drop for LockFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Publishes a file with this content and returns the content under the name afterwards.
    fn published(folder: &Path, content: &str, existing: Existing) -> io::Result<String> {
        let staging = folder.join("unfinished");
        fs::create_dir_all(&staging)?;
        let mut file = unfinished_file(&staging)?;
        file.write_all(content.as_bytes())?;
        publish(file, &folder.join("table"), existing)?;
        assert_eq!(fs::read_dir(staging)?.count(), 0);
        fs::read_to_string(folder.join("table"))
    }

    #[test]
    fn an_existing_file_is_kept_with_and_without_lock_files() {
        for keep in [Existing::Keep, Existing::KeepByLockFile] {
            let folder = tempfile::tempdir().unwrap();
            assert_eq!(published(folder.path(), "first", keep).unwrap(), "first");
            assert_eq!(published(folder.path(), "second", keep).unwrap(), "first");
            let replaced = published(folder.path(), "second", Existing::Replace).unwrap();
            assert_eq!(replaced, "second");
        }
    }

    #[test]
    fn a_link_that_leads_nowhere_is_replaced_and_a_folder_is_not() {
        for keep in [Existing::Keep, Existing::KeepByLockFile] {
            let folder = tempfile::tempdir().unwrap();
            let table = folder.path().join("table");
            std::os::unix::fs::symlink("nowhere", &table).unwrap();
            assert_eq!(published(folder.path(), "whole", keep).unwrap(), "whole");
            fs::remove_file(&table).unwrap();
            fs::create_dir(&table).unwrap();
            assert!(published(folder.path(), "whole", keep).is_err());
        }
    }

    #[test]
    fn a_lock_file_makes_others_wait_and_names_its_owner() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("unfinished")).unwrap();
        let table = folder.path().join("table");
        let lock = LockFile::create(&table, &folder.path().join("unfinished")).unwrap();
        let owner = fs::read_to_string(&lock.0).unwrap();
        assert!(owner.starts_with(&std::process::id().to_string()), "{owner}");
        std::thread::scope(|scope| {
            let waiting =
                scope.spawn(|| published(folder.path(), "second", Existing::KeepByLockFile));
            sleep(Duration::from_millis(100));
            assert!(!table.exists());
            fs::write(&table, "first").unwrap();
            drop(lock);
            assert_eq!(waiting.join().unwrap().unwrap(), "first");
        });
    }

    #[test]
    fn this_file_system_needs_no_lock_files() {
        let root = tempfile::tempdir().unwrap();
        let [staging, folder] = ["unfinished", "ab"].map(|name| root.path().join(name));
        [&staging, &folder].into_iter().for_each(|path| fs::create_dir(path).unwrap());
        fs::write(root.path().join(NOTE), TEXT).unwrap();
        assert_eq!(trial(root.path(), &staging, &folder), Existing::Keep);
        assert!(!uses_lock_files(root.path()));
        assert_eq!(fs::read_dir(&staging).unwrap().count(), 0);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    }
}
