//! Files that a command writes where the user asks for them.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use super::SessionError;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{Existing, write_file};

/// Number of first bytes by which two files are of the same kind.
const SIGNATURE: usize = 4;

/// Returns whether the suffix of a path is `suffix`, in upper or lower case.
pub fn has_suffix(path: &Path, suffix: &str) -> bool {
    path.extension().is_some_and(|found: &OsStr| found.eq_ignore_ascii_case(suffix))
}

/// Writes a file of the kind `kind`, such as `PNG`.
///
/// A file with the same content is not changed. Another file of this kind, which begins with the
/// same bytes, is overwritten if `replace` is set. A file of another kind is never overwritten.
///
/// # Errors
/// Returns an error if the file must not be overwritten or cannot be written.
pub fn write_output(
    path: &Path,
    bytes: &[u8],
    kind: &str,
    replace: bool,
) -> Result<(), SessionError> {
    let shown = path.display();
    let refused = |message: String| Err(SessionError::Refused(message));
    if is_stream(path) {
        return Ok(fs::write(path, bytes).map_err(|source| unwritten(path, source))?);
    }
    if let Some(there) = beginning(path, bytes.len() + 1)? {
        if there == bytes {
            return Ok(());
        }
        if !there.starts_with(&bytes[..bytes.len().min(SIGNATURE)]) {
            return refused(format!(
                "`{shown}` is not a {kind} file and will not be overwritten; choose another file"
            ));
        }
        if !replace {
            return refused(format!("`{shown}` already exists; use `--replace` to overwrite it"));
        }
    }
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let folder = folder.unwrap_or(Path::new("."));
    Ok(write_file(path, bytes, Existing::Replace, folder)?)
}

/// Writes a picture to a file whose name ends in `.png`; see [`write_output`].
///
/// # Errors
/// Returns an error if the name has another suffix, or the errors of [`write_output`].
pub fn write_png(path: &Path, png: &[u8], replace: bool) -> Result<(), SessionError> {
    if !is_stream(path) && !has_suffix(path, "png") {
        return Err(SessionError::Refused(format!(
            "the picture is written as a PNG file, but `{}` does not end in `.png`; use `{}`",
            path.display(),
            path.with_extension("png").display()
        )));
    }
    write_output(path, png, "PNG", replace)
}

/// Returns whether the path is a pipe or a device, such as `/dev/stdout`.
pub fn is_stream(path: &Path) -> bool {
    let metadata = path.metadata();
    metadata.is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir())
}

/// Returns up to `limit` bytes from the start of a file, or `None` if it does not exist.
fn beginning(path: &Path, limit: usize) -> Result<Option<Vec<u8>>, StoreError> {
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(limit as u64).read_to_end(&mut bytes));
    match read {
        Ok(_) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(unwritten(path, source)),
    }
}

fn unwritten(path: &Path, source: io::Error) -> StoreError {
    StoreError::writing(path, source)
}
