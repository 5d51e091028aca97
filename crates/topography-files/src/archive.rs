//! Zip archives, into which several formats pack their files.

use std::borrow::Cow;
use std::io::Cursor;

use zip::ZipArchive;

use super::FormatError;
use super::input::{after, inflate};

/// First bytes of an archive that has at least one file.
pub(crate) const SIGNATURE: &[u8] = b"PK\x03\x04";

/// Directory of an archive in memory, from which files are read by name.
pub(crate) struct Archive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
}

impl<'a> Archive<'a> {
    /// Opens an archive for a format that packs its files into one.
    pub(crate) fn of_format(bytes: &'a [u8]) -> Result<Archive<'a>, FormatError> {
        after(bytes, SIGNATURE)?;
        Archive::new(bytes).map_err(|_| FormatError::Signature)
    }

    /// Reads the directory of an archive. Other data may precede the archive.
    pub(crate) fn new(bytes: &'a [u8]) -> Result<Archive<'a>, FormatError> {
        let opened = ZipArchive::new(Cursor::new(bytes));
        let zip = opened.map_err(|error| FormatError::damaged("the zip archive", error))?;
        Ok(Archive { zip })
    }

    /// Returns the paths of the files. Paths that are not valid text are left out, because no
    /// format of this crate uses them.
    pub(crate) fn names(&self) -> impl Iterator<Item = Cow<'_, str>> {
        self.zip.file_names().filter_map(Result::ok)
    }

    /// Reads a file of any length up to `limit` bytes.
    pub(crate) fn file(&mut self, name: &str, limit: usize) -> Result<Vec<u8>, FormatError> {
        let size = self.open(name, |file| file.size())?;
        match usize::try_from(size) {
            Ok(size) if size <= limit => self.exactly(name, size),
            _ => {
                let allowed = format!("at most {limit}");
                let entry = format!("length of `{name}` in the archive");
                Err(FormatError::value(&entry, size, &allowed))
            }
        }
    }

    /// Reads a file of exactly `expected` bytes.
    pub(crate) fn exactly(&mut self, name: &str, expected: usize) -> Result<Vec<u8>, FormatError> {
        self.open(name, |file| {
            let compressed = usize::try_from(file.compressed_size()).unwrap_or(usize::MAX);
            inflate(&format!("`{name}` in the archive"), file, compressed, expected)
        })?
    }

    fn open<T>(
        &mut self,
        name: &str,
        read: impl FnOnce(zip::read::ZipFile<'_, Cursor<&'a [u8]>>) -> T,
    ) -> Result<T, FormatError> {
        let part = format!("`{name}` in the archive");
        let file = self.zip.by_name(name);
        Ok(read(file.map_err(|error| FormatError::damaged(&part, error))?))
    }
}
