//! Opening of regular files only. The path may come from a file that somebody else has written, and
//! opening a pipe would wait for a writer, while a device such as `/dev/zero` has no end.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// Opens a regular file.
///
/// # Errors
/// Returns an error if the path is a folder, a pipe or a device, or if the file cannot be opened.
pub fn open_regular(path: &Path) -> io::Result<File> {
    // Check before opening: opening a pipe would wait for a writer.
    if fs::metadata(path)?.is_file() {
        File::open(path)
    } else {
        refuse("it is not a regular file")
    }
}

/// Reads a regular file of at most `limit` bytes.
///
/// # Errors
/// Returns the errors of [`open_regular`], or an error if the file has more than `limit` bytes.
pub fn read_regular(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = open_regular(path)?;
    let length = file.metadata()?.len();
    if length > limit {
        return refuse(&format!("it has {length} bytes; the limit is {limit}"));
    }
    let mut bytes = Vec::new();
    file.take(limit).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads a regular file of at most `limit` bytes that is in `folder` or below it. A link to a file
/// elsewhere is refused.
///
/// # Errors
/// Returns the errors of [`read_regular`], or an error if the file is elsewhere.
pub fn read_below(folder: &Path, path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let path = path.canonicalize()?;
    if !path.starts_with(folder.canonicalize()?) {
        return refuse("it is a link to another folder");
    }
    read_regular(&path, limit)
}

fn refuse<T>(reason: &str) -> io::Result<T> {
    Err(io::Error::new(io::ErrorKind::InvalidInput, reason))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_devices_and_oversized_files_are_not_read() {
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path(), Path::new("/dev/zero")] {
            assert_eq!(read_regular(path, 10).unwrap_err().kind(), io::ErrorKind::InvalidInput);
        }
        let file = folder.path().join("long");
        fs::write(&file, b"0123456789").unwrap();
        assert!(read_regular(&file, 9).is_err());
        assert_eq!(read_regular(&file, 10).unwrap().len(), 10);
    }

    #[test]
    fn files_outside_of_the_folder_are_not_read() {
        let outer = tempfile::tempdir().unwrap();
        let folder = outer.path().join("inner");
        fs::create_dir(&folder).unwrap();
        fs::write(outer.path().join("outside"), b"1").unwrap();
        fs::write(folder.join("inside"), b"2").unwrap();
        std::os::unix::fs::symlink("../outside", folder.join("link")).unwrap();
        let read = |name: &str| read_below(&folder, &folder.join(name), 10);
        assert_eq!(read("inside").unwrap(), b"2");
        assert!(read("link").is_err() && read("../outside").is_err() && read("/dev/zero").is_err());
    }
}
