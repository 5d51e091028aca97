//! A ZIP archive with the same bytes every time, and the checksums of what it holds.
//!
//! Files lie in it in the order of their paths, dated to the first day that the format knows. Tables
//! are compressed as they are; only texts are compressed by the archive.

use std::fs::File;
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

/// The list of checksums.
pub const CHECKSUMS: &str = "SHA256SUMS";
/// Bytes that are read at once.
const CHUNK: usize = 1 << 18;
/// Files from this size on need the longer numbers of ZIP64.
const LARGE: u64 = u32::MAX as u64;

/// Where the bytes of a file come from.
#[derive(Debug)]
pub enum Source {
    /// A file, which is too large to be kept in memory, perhaps.
    File(PathBuf),
    /// These.
    Bytes(Vec<u8>),
}

impl Source {
    /// How many bytes it has.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn size(&self) -> io::Result<u64> {
        match self {
            Source::File(path) => Ok(path.metadata().map_err(about(path))?.len()),
            Source::Bytes(bytes) => Ok(bytes.len() as u64),
        }
    }

    fn open(&self) -> io::Result<Box<dyn Read + '_>> {
        Ok(match self {
            Source::File(path) => Box::new(File::open(path).map_err(about(path))?),
            Source::Bytes(bytes) => Box::new(bytes.as_slice()),
        })
    }
}

fn about(path: &Path) -> impl FnOnce(io::Error) -> io::Error {
    move |error| {
        let message = format!("cannot read `{}`: {error}", path.display());
        io::Error::new(error.kind(), message)
    }
}

/// Writes an archive, and knows the checksums of what is in it.
pub struct Archive<W: Write + Seek> {
    zip: ZipWriter<W>,
    /// Lines as `sha256sum` writes them.
    checksums: String,
}

/// Returns whether a file is an archive of a study: a ZIP file with the list of checksums.
pub fn is_archive(path: &Path) -> bool {
    let archive = File::open(path).ok().and_then(|file| ZipArchive::new(file).ok());
    archive.is_some_and(|archive| archive.index_for_name(CHECKSUMS).is_some())
}

impl<W: Write + Seek> Archive<W> {
    /// An empty one.
    pub fn new(output: W) -> Archive<W> {
        Archive { zip: ZipWriter::new(output), checksums: String::new() }
    }

    /// Adds a file, at a path with `/` between folders.
    ///
    /// # Errors
    /// When it cannot be read, or the archive not be written.
    pub fn add(&mut self, path: &str, source: &Source) -> io::Result<()> {
        let is_table = path.ends_with(".parquet");
        let method = match is_table {
            true => CompressionMethod::Stored,
            false => CompressionMethod::Deflated,
        };
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .last_modified_time(DateTime::default())
            .unix_permissions(0o644)
            .large_file(source.size()? >= LARGE);
        self.zip.start_file(path, options)?;
        let mut input = source.open()?;
        let (mut hash, mut chunk) = (Sha256::new(), vec![0; CHUNK]);
        loop {
            let length = match input.read(&mut chunk) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                length => length?,
            };
            if length == 0 {
                break;
            }
            hash.update(&chunk[..length]);
            self.zip.write_all(&chunk[..length])?;
        }
        let digits = hash.finalize().into_iter().map(|byte| format!("{byte:02x}"));
        let digits: String = digits.collect();
        self.checksums += &format!("{digits}  {path}\n");
        Ok(())
    }

    /// Adds the list of checksums, which `sha256sum --check` reads, and ends the archive.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self) -> io::Result<W> {
        let checksums = std::mem::take(&mut self.checksums);
        self.add(CHECKSUMS, &Source::Bytes(checksums.into_bytes()))?;
        Ok(self.zip.finish()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn archive() -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("table.parquet");
        std::fs::write(&file, "rows").unwrap();
        let mut archive = Archive::new(Cursor::new(Vec::new()));
        archive.add("a/text.txt", &Source::Bytes(b"abc".to_vec())).unwrap();
        archive.add("b/table.parquet", &Source::File(file)).unwrap();
        archive.finish().unwrap().into_inner()
    }

    #[test]
    fn the_list_holds_the_published_checksum_of_abc() {
        let mut read = ZipArchive::new(Cursor::new(archive())).unwrap();
        let mut list = String::new();
        let mut file = read.by_name(CHECKSUMS).unwrap();
        file.read_to_string(&mut list).unwrap();
        // FIPS 180-2, appendix B.1.
        let expected =
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  a/text.txt\n";
        assert!(list.starts_with(expected), "{list}");
        assert_eq!(list.lines().count(), 2);
    }

    #[test]
    fn equal_contents_make_equal_archives_whenever_they_are_made() {
        let first = archive();
        std::thread::sleep(std::time::Duration::from_secs(2));
        assert_eq!(archive(), first);
    }

    #[test]
    fn a_file_that_is_gone_is_named() {
        let mut archive = Archive::new(Cursor::new(Vec::new()));
        let gone = Source::File(PathBuf::from("nowhere.parquet"));
        let error = archive.add("t.parquet", &gone).unwrap_err();
        assert!(error.to_string().contains("nowhere.parquet"), "{error}");
    }
}
