//! Files that appear whole or not at all, and are read whole or not at all.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use super::StoreError;
use super::users::Writer;
use crate::parquet::{self, Columns, Metadata, ParquetError, TableFile};
use crate::table::Table;

/// What is appended to the names of files that turned out to be damaged.
pub(crate) const DAMAGED: &str = ".damaged";

/// How long a new file may wait.
const MAX_WAIT: Duration = Duration::from_secs(1);

/// What to do with a file that is already there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Leave it: it is the same.
    Keep,
    /// Put the new one in its place.
    Replace,
}

/// Writes a file that appears whole or not at all, even if the power is cut: its bytes are on the
/// disk before it gets its name.
///
/// Until then it lies in `staging`, a folder of the same disk, for a file cannot change its name
/// across disks. A process that is killed leaves it there, under a name that says whose it is.
///
/// # Errors
/// When a folder cannot be made, or the file not be written, flushed or moved into place.
pub fn write_whole(
    path: &Path,
    bytes: &[u8],
    existing: Existing,
    staging: &Path,
) -> Result<(), StoreError> {
    write_file(path, bytes, existing, staging)?;
    flush_folder(path.parent().unwrap_or(Path::new(".")))
}

/// Like [`write_whole`], but for its name, which may be lost if the power is cut before its folder
/// is flushed.
///
/// # Errors
/// As [`write_whole`].
pub fn write_file(
    path: &Path,
    bytes: &[u8],
    existing: Existing,
    staging: &Path,
) -> Result<(), StoreError> {
    write_with(path, existing, staging, |file| file.write_all(bytes))
}

/// Like [`write_file`], of what is not in memory as a whole.
///
/// # Errors
/// As [`write_file`], and those of `write`.
pub fn write_with(
    path: &Path,
    existing: Existing,
    staging: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<(), StoreError> {
    make_folder(path.parent().unwrap_or(Path::new(".")))?;
    make_folder(staging)?;
    let result = (|| {
        let mut file = tempfile::Builder::new()
            .prefix(&Writer::own().prefix())
            .permissions(readable())
            .tempfile_in(staging)?;
        write(file.as_file_mut())?;
        file.as_file().sync_all()?;
        match existing {
            Existing::Replace => drop(file.persist(path)?),
            Existing::Keep => match file.persist_noclobber(path) {
                Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => {
                    is_file(path)?;
                }
                other => drop(other?),
            },
        }
        Ok(())
    })();
    result.map_err(|source| StoreError::Write { path: path.to_owned(), source })
}

/// Sees to it that the disk knows the names of a folder's files.
///
/// # Errors
/// When the folder cannot be flushed, although its file system can flush folders.
pub fn flush_folder(folder: &Path) -> Result<(), StoreError> {
    let flushed = File::open(folder).and_then(|folder| folder.sync_all());
    flushed
        .or_else(unless_unsupported)
        .map_err(|source| StoreError::Write { path: folder.to_owned(), source })
}

/// Accepts `EINVAL` and `ENOSYS`, by which some network and user-space file systems say that they
/// cannot flush folders.
fn unless_unsupported(error: io::Error) -> io::Result<()> {
    match error.kind() {
        io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported => Ok(()),
        _ => Err(error),
    }
}

/// Folders with new files of which the disk may not know yet, and since when the first of them waits.
///
/// A file is on the disk before it gets its name, but its name is on the disk only once its folder
/// has been flushed. One flush does for all files of a folder, so that tasks of milliseconds do not
/// wait for one each: a power cut costs the tasks of the last second.
#[derive(Debug, Default)]
pub(crate) struct Unflushed(Mutex<Waiting>);

#[derive(Debug, Default)]
struct Waiting {
    folders: BTreeSet<PathBuf>,
    since: Option<Instant>,
}

impl Unflushed {
    /// A new file; flushes its folder and the others if one of them has waited long enough.
    ///
    /// # Errors
    /// When a folder cannot be flushed.
    pub fn add(&self, file: &Path) -> Result<(), StoreError> {
        let is_due = {
            let mut waiting = self.0.lock().expect("no panic happens while it is held");
            waiting.folders.extend(file.parent().map(Path::to_owned));
            waiting.since.get_or_insert_with(Instant::now).elapsed() >= MAX_WAIT
        };
        if is_due { self.flush() } else { Ok(()) }
    }

    /// Flushes all of them.
    ///
    /// # Errors
    /// When a folder cannot be flushed.
    pub fn flush(&self) -> Result<(), StoreError> {
        let waiting = {
            let mut waiting = self.0.lock().expect("no panic happens while it is held");
            std::mem::take(&mut *waiting)
        };
        waiting.folders.iter().try_for_each(|folder| flush_folder(folder))
    }
}

/// Locks a folder until the returned file is dropped, so that readers who take the lock too see
/// only complete sets of files. Returns `None` where folders cannot be locked.
pub fn lock_to_write(folder: &Path) -> Option<File> {
    let folder = File::open(folder).ok()?;
    folder.lock().is_ok().then_some(folder)
}

/// Locks a folder for reading, which many readers may do at once.
pub fn lock_to_read(folder: &Path) -> Option<File> {
    let folder = File::open(folder).ok()?;
    folder.lock_shared().is_ok().then_some(folder)
}

/// What is there already must be a file, or else nothing has been stored.
fn is_file(path: &Path) -> io::Result<()> {
    if path.is_file() {
        Ok(())
    } else {
        Err(io::Error::other("something that is no file is in its place"))
    }
}

/// Makes a folder and those above it.
///
/// # Errors
/// When it cannot be made.
pub fn make_folder(path: &Path) -> Result<(), StoreError> {
    fs::create_dir_all(path).map_err(|source| StoreError::Write { path: path.to_owned(), source })
}

/// The way to a file from a folder, as `../small/area.parquet`; the path itself if one of the two
/// cannot be found.
pub fn from_folder(path: &Path, folder: &Path) -> PathBuf {
    let (Ok(whole), Ok(folder)) = (fs::canonicalize(path), fs::canonicalize(folder)) else {
        return path.to_owned();
    };
    let common = whole.components().zip(folder.components());
    let common = common.take_while(|(one, other)| one == other).count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    up.chain(whole.components().skip(common)).collect()
}

/// The names of what is in a folder, in order; none if there is no such folder.
///
/// # Errors
/// When it cannot be listed.
pub fn names(folder: &Path) -> Result<Vec<String>, StoreError> {
    let unreadable = |source| StoreError::Read { path: folder.to_owned(), source };
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(unreadable)?,
    };
    let name = |entry: fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
    let names = entries.map(|entry| entry.map(name).map_err(unreadable));
    let mut names = names.collect::<Result<Vec<_>, _>>()?;
    names.sort_unstable();
    Ok(names)
}

/// Temporary files are private by default; results are for colleagues too.
fn readable() -> fs::Permissions {
    use std::os::unix::fs::PermissionsExt;
    fs::Permissions::from_mode(0o644)
}

/// The table in a file, and what the file says of itself.
///
/// # Errors
/// When the file is missing, unreadable, damaged, or no table of this program.
pub fn read_whole(path: &Path, columns: Columns) -> Result<(Table, Metadata), StoreError> {
    read(path, |file| parquet::decode(file, columns))
}

/// What a file says of itself, all of whose bytes and columns are as they should be.
///
/// # Errors
/// As [`read_whole`].
pub fn verify_whole(path: &Path) -> Result<Metadata, StoreError> {
    read(path, parquet::verify)
}

/// A table of which parts are read.
///
/// # Errors
/// As [`read_whole`], but for the parts that are not read yet.
pub(crate) fn open_table(path: &Path) -> Result<TableFile, StoreError> {
    read(path, TableFile::open)
}

fn read<T>(
    path: &Path,
    read: impl FnOnce(File) -> Result<T, ParquetError>,
) -> Result<T, StoreError> {
    let file = File::open(path).map_err(ParquetError::Read);
    file.and_then(read).map_err(|error| StoreError::in_file(path, error))
}

/// Renames a damaged file, so that nobody takes it for a table and nothing of it is lost; its new
/// name, or none if the file has gone.
///
/// # Errors
/// When the folder cannot be written.
pub fn quarantine(path: &Path) -> Result<Option<PathBuf>, StoreError> {
    let quarantined = free_name(path);
    match fs::rename(path, &quarantined) {
        Ok(()) => Ok(Some(quarantined)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(StoreError::Write { path: quarantined, source }),
    }
}

/// `NAME.damaged`, `NAME.damaged-2` …: earlier finds are kept.
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
        .expect("there are more numbers than files")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_its_file_system_cannot_flush_is_no_error() {
        // EINVAL, ENOSYS and EIO of Linux.
        let flushed = |number| unless_unsupported(io::Error::from_raw_os_error(number));
        assert!(flushed(22).is_ok() && flushed(38).is_ok());
        assert_eq!(flushed(5).unwrap_err().raw_os_error(), Some(5));
    }

    #[test]
    fn the_way_from_a_folder_goes_up_to_what_both_share() {
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
