//! Files that a command writes where the user asks for them.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Read, Seek, Write};
use std::path::Path;

use super::SessionError;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{folder_of, write_with};

/// Number of first bytes by which two files are of the same kind.
const SIGNATURE: usize = 4;

/// Returns whether the suffix of a path is `suffix`, in upper or lower case.
pub(crate) fn has_suffix(path: &Path, suffix: &str) -> bool {
    path.extension().is_some_and(|found: &OsStr| found.eq_ignore_ascii_case(suffix))
}

/// Writes a file of the kind `kind`, such as `PNG`; see [`write_output_with`].
///
/// # Errors
/// Returns an error if the file must not be overwritten or cannot be written.
pub(crate) fn write_output(
    path: &Path,
    bytes: &[u8],
    kind: &str,
    replace: bool,
) -> Result<(), SessionError> {
    let signature = &bytes[..bytes.len().min(SIGNATURE)];
    write_output_with(path, kind, signature, replace, |file| file.write_all(bytes))
}

/// Writes a file of the kind `kind`, whose content `write` writes.
///
/// A file with the same content is not changed. Another file of this kind, which begins with the
/// same `signature`, is overwritten if `replace` is set. A file of another kind is never
/// overwritten.
///
/// # Errors
/// Returns an error if the file must not be overwritten or cannot be written, and the errors of
/// `write`.
pub(crate) fn write_output_with(
    path: &Path,
    kind: &str,
    signature: &[u8],
    replace: bool,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<(), SessionError> {
    let failed = |source: io::Error| StoreError::writing(path, source);
    let there = if is_stream(path) { None } else { beginning(path, signature.len())? };
    if there.as_ref().is_some_and(|there| there != signature) {
        return Err(SessionError::refused(format!(
            "`{}` is not a {kind} file and will not be overwritten; choose another file",
            path.display()
        )));
    }
    if !is_stream(path) && there.is_none_or(|_| replace) {
        return Ok(write_with(path, folder_of(path), write)?);
    }
    let written = tempfile::tempfile().and_then(|mut file| {
        write(&mut file)?;
        file.rewind()?;
        Ok(file)
    });
    let mut file = written.map_err(failed)?;
    if is_stream(path) {
        let opened = File::options().write(true).open(path);
        let copied = opened.and_then(|mut stream| io::copy(&mut file, &mut stream));
        return Ok(copied.map(drop).map_err(failed)?);
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(failed)?;
    if fs::read(path).map_err(failed)? == bytes {
        return Ok(());
    }
    let message = format!("`{}` already exists; use `--replace` to overwrite it", path.display());
    Err(SessionError::refused(message))
}

/// Writes a picture to a file whose name ends in `.png`; see [`write_output`].
///
/// # Errors
/// Returns an error if the name has another suffix, or the errors of [`write_output`].
pub(crate) fn write_png(path: &Path, png: &[u8], replace: bool) -> Result<(), SessionError> {
    if !is_stream(path) && !has_suffix(path, "png") {
        return Err(SessionError::refused(format!(
            "the picture is written as a PNG file, but `{}` does not end in `.png`; use `{}`",
            path.display(),
            path.with_extension("png").display()
        )));
    }
    write_output(path, png, "PNG", replace)
}

/// Returns whether the path is a pipe or a device, such as `/dev/stdout`.
pub(crate) fn is_stream(path: &Path) -> bool {
    let metadata = path.metadata();
    metadata.is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir())
}

/// Returns whether a file can be read and begins with these bytes.
pub(crate) fn begins_with(path: &Path, signature: &[u8]) -> bool {
    let start = beginning(path, signature.len()).ok().flatten();
    start.is_some_and(|start| start == signature)
}

/// Returns up to `limit` bytes from the start of a file, or `None` if it does not exist.
fn beginning(path: &Path, limit: usize) -> Result<Option<Vec<u8>>, StoreError> {
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(limit as u64).read_to_end(&mut bytes));
    match read {
        Ok(_) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(StoreError::writing(path, source)),
    }
}
