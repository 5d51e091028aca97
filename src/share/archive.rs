//! Reproducible ZIP archives with checksums, and the paths of a manifest and its files in them.
//!
//! Files are sorted by path and have the earliest date of the format, so that equal contents give
//! equal bytes. Tables are compressed already; the archive compresses texts only.
//!
//! The manifest is stored unchanged, so its relative paths must stay valid. If
//! `manifests/scan.toml` names `../data/scan.x3p`, the archive contains `manifests/scan.toml` and
//! `data/scan.x3p`.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, Write};
use std::mem::ManuallyDrop;
use std::path::{Component, Path, PathBuf};
use std::{fs, io};

use sha2::{Digest, Sha256};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use asperity_tables::store::files::folder_of;

/// File name of the list of checksums.
pub(crate) const CHECKSUMS: &str = "SHA256SUMS";
/// Size of the read buffer in bytes.
const CHUNK: usize = 1 << 18;
/// Size in bytes from which a file needs ZIP64.
const ZIP64_SIZE: u64 = u32::MAX as u64;

/// File of an archive.
#[derive(Debug)]
pub(crate) struct ArchivedFile {
    pub(crate) source: Source,
    pub(crate) role: FileRole,
    /// Short description of the contents.
    pub(crate) about: String,
}

/// Role of a file in the study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FileRole {
    /// File that defines the study.
    Manifest,
    /// Input file, such as a measured surface.
    Input,
    /// Table of results of a stage.
    Table,
    Other,
}

/// Source of the bytes of a file.
#[derive(Debug)]
pub(crate) enum Source {
    /// A file, which may be too large for the memory.
    File(PathBuf),
    /// Bytes that are in memory.
    Bytes(Vec<u8>),
}

impl Source {
    /// Returns the number of bytes.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read.
    pub(crate) fn size(&self) -> io::Result<u64> {
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

/// Writer of an archive that records checksums.
pub(crate) struct Archive<W: Write + Seek> {
    /// Not dropped before it is finished: after a failed write, `ZipWriter` would try again to
    /// complete the archive, and print a second error to the terminal.
    zip: ManuallyDrop<ZipWriter<W>>,
    /// Lines in the format of `sha256sum`.
    checksums: String,
}

/// Returns whether a file is an archive of a study: a ZIP file with the list of checksums.
pub(crate) fn is_archive(path: &Path) -> bool {
    let archive = File::open(path).ok().and_then(|file| ZipArchive::new(file).ok());
    archive.is_some_and(|archive| archive.index_for_name(CHECKSUMS).is_some())
}

impl<W: Write + Seek> Archive<W> {
    /// Creates an archive without files.
    pub(crate) fn new(output: W) -> Archive<W> {
        Archive { zip: ManuallyDrop::new(ZipWriter::new(output)), checksums: String::new() }
    }

    /// Adds a file under `path`, with `/` between folders.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read or the archive cannot be written.
    pub(crate) fn add(&mut self, path: &str, source: &Source) -> io::Result<()> {
        let is_table = path.ends_with(".parquet");
        let method = if is_table { CompressionMethod::Stored } else { CompressionMethod::Deflated };
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .last_modified_time(DateTime::default())
            .unix_permissions(0o644)
            .large_file(source.size()? >= ZIP64_SIZE);
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
        let digits: String =
            hash.finalize().into_iter().map(|byte| format!("{byte:02x}")).collect();
        self.checksums += &checksum_line(&digits, path);
        Ok(())
    }

    /// Adds the list of checksums for `sha256sum --check` and completes the archive.
    ///
    /// # Errors
    /// Returns an error if the archive cannot be written.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        let checksums = std::mem::take(&mut self.checksums);
        self.add(CHECKSUMS, &Source::Bytes(checksums.into_bytes()))?;
        Ok(ManuallyDrop::into_inner(self.zip).finish()?)
    }
}

/// Returns the line of `sha256sum` about a file. The digits begin with a backslash if characters of
/// the path are escaped, since a line break would end the line.
fn checksum_line(digits: &str, path: &str) -> String {
    let escaped = path.replace('\\', "\\\\").replace('\n', "\\n").replace('\r', "\\r");
    let mark = if escaped == path { "" } else { "\\" };
    format!("{mark}{digits}  {escaped}\n")
}

/// Paths of a manifest and its files in an archive, with `/` between folders.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct ArchivePaths {
    /// Path of the manifest in the archive.
    pub(crate) manifest: String,
    /// Paths of the files in the archive, by their paths in the manifest.
    pub(crate) files: BTreeMap<PathBuf, String>,
}

/// Error for a path in a manifest that would lead to no file of the archive.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "cannot add `{}` to an archive: {why}; use a path relative to the manifest's folder",
    path.display()
)]
pub struct UnportablePath {
    /// Path of the file in the manifest.
    pub(crate) path: PathBuf,
    /// Reason why the path does not work.
    pub(crate) why: &'static str,
}

impl ArchivePaths {
    /// Assigns paths to a manifest and the files that it names.
    ///
    /// # Errors
    /// Returns an error if a path is absolute, leaves the root of the file system, or contains `..`
    /// after a folder.
    pub(crate) fn new<'a>(
        manifest: &Path,
        files: impl IntoIterator<Item = &'a PathBuf>,
    ) -> Result<ArchivePaths, UnportablePath> {
        let folder = folders_of(manifest);
        // Number of folders above the root of the archive.
        let mut above = folder.len();
        let mut files_below = BTreeMap::new();
        for path in files {
            let refused = |why| UnportablePath { path: path.clone(), why };
            let (mut parts, mut has_descended) = (folder.clone(), false);
            for part in path.components() {
                match part {
                    Component::CurDir => {}
                    Component::ParentDir if has_descended => {
                        return Err(refused("it contains `..` after a folder"));
                    }
                    Component::ParentDir => {
                        let root = || refused("it leaves the root of the file system");
                        parts.pop().ok_or_else(root)?;
                        above = above.min(parts.len());
                    }
                    Component::Normal(name) => {
                        parts.push(name.to_string_lossy().into_owned());
                        has_descended = true;
                    }
                    Component::RootDir | Component::Prefix(_) => {
                        return Err(refused("its path is absolute"));
                    }
                }
            }
            files_below.insert(path.clone(), parts);
        }
        let name = manifest.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let files = files_below.into_iter();
        Ok(ArchivePaths {
            manifest: [&folder[above..], &[name]].concat().join("/"),
            files: files.map(|(path, parts)| (path, parts[above..].join("/"))).collect(),
        })
    }

    /// Returns the relative path of the manifest from a folder at this depth in the archive.
    pub(crate) fn manifest_from(&self, depth: usize) -> String {
        "../".repeat(depth) + &self.manifest
    }
}

/// Returns the names of the folders above a file, starting at the root.
fn folders_of(file: &Path) -> Vec<String> {
    let folder = folder_of(file);
    // The folder may have been deleted after the manifest was read.
    let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    let names = folder.components().filter_map(|part| match part {
        Component::Normal(name) => Some(name.to_string_lossy().into_owned()),
        _ => None,
    });
    names.collect()
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

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
    fn an_archive_that_finds_no_room_is_an_error_and_not_a_panic() {
        let whole = archive();
        for room in (0..whole.len()).step_by(17).chain([whole.len()]) {
            let mut archive = Archive::new(Cursor::new(vec![0; room].into_boxed_slice()));
            let text = Source::Bytes(b"abc".to_vec());
            let written = archive.add("a/text.txt", &text);
            let table = Source::Bytes(b"rows".to_vec());
            let written = written.and_then(|()| archive.add("b/table.parquet", &table));
            let finished = written.and_then(|()| archive.finish());
            assert_eq!(finished.is_ok(), room == whole.len(), "{room}");
        }
    }

    #[test]
    fn names_with_line_breaks_are_escaped_as_sha256sum_does() {
        assert_eq!(checksum_line("ab12", "a b.txt"), "ab12  a b.txt\n");
        assert_eq!(checksum_line("ab12", "a\nb\\c\r"), "\\ab12  a\\nb\\\\c\\r\n");
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

    /// Returns the paths of `a/b/study.toml` and of a file that it names.
    fn paths(named: &str) -> Result<(String, String), &'static str> {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("a/b");
        fs::create_dir_all(&folder).unwrap();
        let named = PathBuf::from(named);
        match ArchivePaths::new(&folder.join("study.toml"), [&named]) {
            Ok(paths) => Ok((paths.manifest.clone(), paths.files[&named].clone())),
            Err(error) => Err(error.why),
        }
    }

    fn both(manifest: &str, file: &str) -> Result<(String, String), &'static str> {
        Ok((manifest.to_owned(), file.to_owned()))
    }

    #[test]
    fn a_manifest_without_files_lies_at_the_root() {
        let paths = ArchivePaths::new(Path::new("somewhere/study.toml"), []).unwrap();
        assert_eq!(paths.manifest, "study.toml");
        assert_eq!(paths.manifest_from(3), "../../../study.toml");
    }

    #[test]
    fn paths_lead_from_the_manifest_to_its_files_as_they_did() {
        assert_eq!(paths("scan.x3p"), both("study.toml", "scan.x3p"));
        assert_eq!(paths("./maps/s.x3p"), both("study.toml", "maps/s.x3p"));
        assert_eq!(paths("../scan.x3p"), both("b/study.toml", "scan.x3p"));
        assert_eq!(paths("../../m/s.x3p"), both("a/b/study.toml", "m/s.x3p"));
    }

    #[test]
    fn paths_that_cannot_stay_valid_are_refused() {
        assert_eq!(paths("/scan.x3p"), Err("its path is absolute"));
        assert_eq!(paths("maps/../s.x3p"), Err("it contains `..` after a folder"));
        let far = "../".repeat(60) + "scan.x3p";
        assert_eq!(paths(&far), Err("it leaves the root of the file system"));
    }
}
