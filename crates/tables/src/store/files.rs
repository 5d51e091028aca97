//! Atomic writing of files, verified reading of tables, and quarantine of damaged files.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Component, Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use tempfile::NamedTempFile;

use super::StoreError;
use super::permissions::explained;
use super::regular::open_regular;
use super::users::Writer;
use crate::parallel::locked;
use crate::parquet::{self, Columns, Metadata, ParquetError, TableFile};
use crate::table::Table;

/// Suffix of the names of damaged files in quarantine.
pub(crate) const DAMAGED: &str = ".damaged";

/// Maximum time between writing a file and flushing its folder.
const MAX_WAIT: Duration = Duration::from_secs(1);

/// Returns the folder of a file.
pub fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    folder.unwrap_or(Path::new("."))
}

/// Writes a file atomically, even in case of a power cut.
///
/// The file is first written to the folder `staging` and flushed, and then renamed to `path`, where
/// it replaces an existing file. Both must be on the same disk. If the process is killed, it leaves
/// the file in `staging`, with a name that identifies the process.
///
/// # Errors
/// Returns an error if a folder cannot be created, or if the file cannot be written, flushed or
/// renamed.
pub fn write_whole(path: &Path, bytes: &[u8], staging: &Path) -> Result<(), StoreError> {
    write_file(path, bytes, staging)?;
    flush_folder(path.parent().unwrap_or(Path::new(".")))
}

/// Writes a file as [`write_whole`] does, unless it already has the same content.
///
/// # Errors
/// Returns the same errors as [`write_whole`].
pub fn write_if_changed(path: &Path, bytes: &[u8], staging: &Path) -> Result<(), StoreError> {
    match fs::read(path) {
        Ok(written) if written == bytes => Ok(()),
        _ => write_whole(path, bytes, staging),
    }
}

/// Writes a file as [`write_whole`] does, but without flushing its folder. After a power cut, the
/// file may be missing, but it is never incomplete.
///
/// # Errors
/// Returns the same errors as [`write_whole`].
pub fn write_file(path: &Path, bytes: &[u8], staging: &Path) -> Result<(), StoreError> {
    write_with(path, staging, |file| file.write_all(bytes))
}

/// Writes a file as [`write_file`] does; the function `write` writes the content.
///
/// # Errors
/// Returns the same errors as [`write_file`], and the errors of `write`.
pub fn write_with(
    path: &Path,
    staging: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<(), StoreError> {
    let folder = path.parent().unwrap_or(Path::new("."));
    make_folder(folder)?;
    make_folder(staging)?;
    let result = (|| {
        let mut file = unfinished_file(staging).map_err(|error| explained(error, staging))?;
        write(file.as_file_mut())?;
        file.as_file().sync_all().or_else(unless_unsupported)?;
        file.persist(path).map_err(|refused| explained(refused.error, folder))?;
        Ok(())
    })();
    result.map_err(|source| StoreError::Write { path: path.to_owned(), source })
}

/// Creates an empty file in the folder `staging`, with a name that identifies this process.
fn unfinished_file(staging: &Path) -> io::Result<NamedTempFile> {
    // The permissions of other programs for new files, of which the system removes those in the
    // umask. Temporary files would otherwise be private.
    let permissions = fs::Permissions::from_mode(0o666);
    tempfile::Builder::new()
        .prefix(&Writer::own().prefix())
        .permissions(permissions)
        .tempfile_in(staging)
}

/// Flushes a folder, so that the names of its files are on the disk.
///
/// # Errors
/// Returns an error if the flush fails on a file system that supports it.
pub fn flush_folder(folder: &Path) -> Result<(), StoreError> {
    let flushed = File::open(folder).and_then(|folder| folder.sync_all());
    flushed.or_else(unless_unsupported).map_err(|source| StoreError::writing(folder, source))
}

/// Converts the errors `EINVAL` and `ENOSYS` to success. They mean that the file system cannot
/// flush a file or folder.
fn unless_unsupported(error: io::Error) -> io::Result<()> {
    match error.kind() {
        io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported => Ok(()),
        _ => Err(error),
    }
}

/// Folders with new files whose names may not be on the disk yet.
///
/// The content of a file is on the disk before the file is renamed, but the new name is on the disk
/// only after a flush of the folder. The folders are flushed about once a second, because a flush
/// for each file would slow down tasks of milliseconds. A power cut therefore loses at most the
/// tasks of the last second.
#[derive(Debug, Default)]
pub(crate) struct Unflushed(Mutex<Waiting>);

#[derive(Debug, Default)]
struct Waiting {
    folders: BTreeSet<PathBuf>,
    /// Time at which the oldest file was added.
    since: Option<Instant>,
}

impl Unflushed {
    /// Adds a new file. Flushes all folders if the oldest file was added [`MAX_WAIT`] ago.
    ///
    /// # Errors
    /// Returns an error if a folder cannot be flushed.
    pub fn add(&self, file: &Path) -> Result<(), StoreError> {
        let is_due = {
            let mut waiting = locked(&self.0);
            waiting.folders.extend(file.parent().map(Path::to_owned));
            waiting.since.get_or_insert_with(Instant::now).elapsed() >= MAX_WAIT
        };
        if is_due { self.flush() } else { Ok(()) }
    }

    /// Flushes all folders with new files.
    ///
    /// # Errors
    /// Returns an error if a folder cannot be flushed.
    pub fn flush(&self) -> Result<(), StoreError> {
        let waiting = std::mem::take(&mut *locked(&self.0));
        waiting.folders.iter().try_for_each(|folder| flush_folder(folder))
    }
}

/// Takes the exclusive lock of a folder, which is held until the returned file is dropped. Readers
/// that take the shared lock then see only complete sets of files.
///
/// Returns `None` if the folder cannot be locked.
pub fn lock_to_write(folder: &Path) -> Option<File> {
    let folder = File::open(folder).ok()?;
    folder.lock().is_ok().then_some(folder)
}

/// Takes the shared lock of a folder for reading. Returns `None` if the folder cannot be locked.
pub fn lock_to_read(folder: &Path) -> Option<File> {
    let folder = File::open(folder).ok()?;
    folder.lock_shared().is_ok().then_some(folder)
}

/// Creates a folder and its parents.
///
/// # Errors
/// Returns an error if a folder cannot be created.
pub fn make_folder(path: &Path) -> Result<(), StoreError> {
    fs::create_dir_all(path).map_err(|source| StoreError::writing(path, source))
}

/// Returns the path of a file relative to a folder, such as `../small/area.parquet`.
///
/// Returns `path` unchanged if the file or the folder does not exist.
pub fn from_folder(path: &Path, folder: &Path) -> PathBuf {
    let (Ok(whole), Ok(folder)) = (fs::canonicalize(path), fs::canonicalize(folder)) else {
        return path.to_owned();
    };
    let pairs = whole.components().zip(folder.components());
    let common = pairs.take_while(|(one, other)| one == other).count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    up.chain(whole.components().skip(common)).collect()
}

/// Returns the sorted names of the entries of a folder. If the folder does not exist, there are
/// none.
///
/// # Errors
/// Returns an error if the folder cannot be listed.
pub fn names(folder: &Path) -> Result<Vec<String>, StoreError> {
    let unreadable = |source| StoreError::reading(folder, source);
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(unreadable)?,
    };
    let name = |entry: fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
    let found = entries.map(|entry| entry.map(name).map_err(unreadable));
    let mut names = found.collect::<Result<Vec<_>, _>>()?;
    names.sort_unstable();
    Ok(names)
}

/// Reads the table in a file and the metadata of the file.
///
/// # Errors
/// Returns an error if the file is missing, unreadable, damaged or not a table of this program.
pub fn read_whole(path: &Path, columns: Columns) -> Result<(Table, Metadata), StoreError> {
    read(path, |file| parquet::decode(file, columns))
}

/// Verifies all bytes and the columns of a file and returns its metadata.
///
/// # Errors
/// Returns the same errors as [`read_whole`].
pub fn verify_whole(path: &Path) -> Result<Metadata, StoreError> {
    read(path, parquet::verify)
}

/// Opens a file in order to read parts of its table later.
///
/// # Errors
/// Returns the same errors as [`read_whole`], except that damage in the parts is found only when
/// they are read.
pub(crate) fn open_table(path: &Path) -> Result<TableFile, StoreError> {
    read(path, TableFile::open)
}

fn read<T>(
    path: &Path,
    read: impl FnOnce(File) -> Result<T, ParquetError>,
) -> Result<T, StoreError> {
    let file = open_regular(path).map_err(ParquetError::Read);
    file.and_then(read).map_err(|error| StoreError::in_file(path, error))
}

/// Renames a damaged file so that it is kept but no longer read as a table.
///
/// Returns the new path, or `None` if the file no longer exists.
///
/// # Errors
/// Returns an error if the folder is not writable.
pub fn quarantine(path: &Path) -> Result<Option<PathBuf>, StoreError> {
    let quarantined = free_name(path);
    match fs::rename(path, &quarantined) {
        Ok(()) => Ok(Some(quarantined)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(StoreError::writing(quarantined, source)),
    }
}

/// Returns the first unused path of `NAME.damaged`, `NAME.damaged-2` and so on.
fn free_name(path: &Path) -> PathBuf {
    let named = |ending: &str| {
        let mut name = path.as_os_str().to_owned();
        name.push(DAMAGED);
        name.push(ending);
        PathBuf::from(name)
    };
    let later = (2..).map(|number| named(&format!("-{number}")));
    std::iter::once(named(""))
        .chain(later)
        .find(|name| name.symlink_metadata().is_err())
        .expect("some number is unused")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_systems_that_cannot_flush_are_accepted() {
        // EINVAL, ENOSYS and EIO of Linux.
        let flushed = |number| unless_unsupported(io::Error::from_raw_os_error(number));
        assert!(flushed(22).is_ok() && flushed(38).is_ok());
        assert_eq!(flushed(5).unwrap_err().raw_os_error(), Some(5));
    }

    #[test]
    fn files_follow_the_umask() {
        let folder = tempfile::tempdir().unwrap();
        let [other, own] = ["other", "own"].map(|name| folder.path().join(name));
        File::create(&other).unwrap();
        write_whole(&own, b"a table", folder.path()).unwrap();
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode();
        assert_eq!(mode(&own), mode(&other));
    }

    #[test]
    fn relative_paths_go_up_to_the_common_folder() {
        let root = tempfile::tempdir().unwrap();
        let [results, elsewhere] = ["data/results/small", "elsewhere"].map(|folder| {
            let folder = root.path().join(folder);
            fs::create_dir_all(&folder).unwrap();
            folder
        });
        let table = results.join("area.parquet");
        fs::write(&table, "").unwrap();
        let way = |folder: &Path| from_folder(&table, folder);
        assert_eq!(way(&results), Path::new("area.parquet"));
        assert_eq!(way(&elsewhere), Path::new("../data/results/small/area.parquet"));
        assert_eq!(way(&root.path().join("nowhere")), table);
    }
}
