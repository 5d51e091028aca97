//! Writes the PNG files of commands. Another picture is replaced only on request, other files
//! never.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use super::{Failure, Misused};
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{Existing, write_file};

/// The first bytes of every PNG file.
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Writes a picture to a file whose name ends in `.png`.
///
/// A file that holds the same picture stays as it is. Another PNG file is replaced if `replace` is
/// set, and a file of another kind never.
///
/// # Errors
/// When the name has another ending, the file must not be replaced, or it cannot be written.
pub fn write(path: &Path, png: &[u8], replace: bool) -> Result<(), Failure> {
    let shown = path.display();
    if is_stream(path) {
        return fs::write(path, png).map_err(|source| unwritten(path, source).into());
    }
    let ending = path.extension().unwrap_or_default();
    if !ending.eq_ignore_ascii_case("png") {
        let message = format!(
            "pictures are written as PNG files, and `{shown}` does not end in `.png`; name `{}`",
            path.with_extension("png").display()
        );
        return Err(Misused(message).into());
    }
    if let Some(there) = beginning(path, png.len() + 1)? {
        if there == png {
            return Ok(());
        }
        if !there.starts_with(SIGNATURE) {
            let message = format!("`{shown}` is not a PNG file and is not replaced; name another");
            return Err(Misused(message).into());
        }
        if !replace {
            let message = format!("`{shown}` is there already; `--replace` overwrites it");
            return Err(Misused(message).into());
        }
    }
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let folder = folder.unwrap_or(Path::new("."));
    Ok(write_file(path, png, Existing::Replace, folder)?)
}

/// Returns whether the path is a pipe or a device, such as `/dev/stdout`.
fn is_stream(path: &Path) -> bool {
    let metadata = path.metadata();
    metadata.is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir())
}

/// Returns the first bytes of a file, or none if there is no such file.
fn beginning(path: &Path, most: usize) -> Result<Option<Vec<u8>>, StoreError> {
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(most as u64).read_to_end(&mut bytes));
    match read {
        Ok(_) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(unwritten(path, source)),
    }
}

fn unwritten(path: &Path, source: io::Error) -> StoreError {
    StoreError::Write { path: path.to_owned(), source }
}
