//! A ZIP archive with the same bytes every time, the checksums of what it holds, and where a
//! manifest and the files that it names lie in it: seen from each other, as they did.
//!
//! Files lie in it in the order of their paths, dated to the first day that the format knows. Tables
//! are compressed as they are; only texts are compressed by the archive.
//!
//! A manifest goes into an archive as it is, byte for byte, so that its paths must lead to the same
//! files. They are kept as far as they are relative: of `manifests/scan.toml`, which names
//! `../data/scan.x3p`, the archive holds `manifests/scan.toml` and `data/scan.x3p`.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, Write};
use std::path::{Component, Path, PathBuf};
use std::{fs, io};

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

/// Where a manifest and the files that it names lie in an archive, `/` between folders.
#[derive(Debug, PartialEq, Eq)]
pub struct Places {
    /// The manifest.
    pub manifest: String,
    /// The files, by their paths as the manifest names them.
    pub files: BTreeMap<PathBuf, String>,
}

/// A file cannot be put where the manifest would find it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{}` cannot go into an archive: {why}; have the manifest name it by a path that begins in the \
     manifest's folder, as `surfaces/scan.x3p` or `../surfaces/scan.x3p`",
    path.display()
)]
pub struct Unplaceable {
    /// The file, as the manifest names it.
    pub path: PathBuf,
    /// What is wrong with that.
    pub why: &'static str,
}

impl Places {
    /// Of a manifest, and of the files that it names.
    ///
    /// # Errors
    /// When a path is absolute, leads out of the root of the file system, or goes up again after it
    /// has gone down.
    pub fn of<'a>(
        manifest: &Path,
        files: impl IntoIterator<Item = &'a PathBuf>,
    ) -> Result<Places, Unplaceable> {
        let ways = files.into_iter().map(|path| Ok((path, Way::of(path)?)));
        let ways: Vec<(&PathBuf, Way)> = ways.collect::<Result<_, _>>()?;
        let above = folders_of(manifest);
        let highest = ways.iter().max_by_key(|(_, way)| way.up);
        let height = highest.map_or(0, |(_, way)| way.up);
        if let Some((path, way)) = highest
            && way.up > above.len()
        {
            return Err(unplaceable(path, "it leads out of the file system"));
        }
        let kept = &above[above.len() - height..];
        let place = |up: usize, rest: &[String]| {
            let parts = kept[..height - up].iter().chain(rest);
            parts.map(String::as_str).collect::<Vec<_>>().join("/")
        };
        let name = manifest.file_name().unwrap_or_default().to_string_lossy();
        let files = ways.iter();
        Ok(Places {
            manifest: place(0, &[name.into_owned()]),
            files: files.map(|(path, way)| ((*path).clone(), place(way.up, &way.down))).collect(),
        })
    }

    /// The way back to the manifest from a folder of the archive that is `depth` folders deep.
    pub fn manifest_from(&self, depth: usize) -> String {
        "../".repeat(depth) + &self.manifest
    }
}

/// A relative path: first up, then down.
struct Way {
    up: usize,
    down: Vec<String>,
}

impl Way {
    fn of(path: &Path) -> Result<Way, Unplaceable> {
        let (mut up, mut down) = (0, Vec::new());
        for part in path.components() {
            match part {
                Component::CurDir => {}
                Component::ParentDir if down.is_empty() => up += 1,
                Component::Normal(part) => down.push(part.to_string_lossy().into_owned()),
                Component::ParentDir => return Err(unplaceable(path, "it goes down and up again")),
                Component::RootDir | Component::Prefix(_) => {
                    return Err(unplaceable(path, "its path is absolute"));
                }
            }
        }
        Ok(Way { up, down })
    }
}

fn unplaceable(path: &Path, why: &'static str) -> Unplaceable {
    Unplaceable { path: path.to_owned(), why }
}

/// The names of the folders above a file, the root's first.
fn folders_of(file: &Path) -> Vec<String> {
    let folder = file.parent().filter(|folder| *folder != Path::new(""));
    let folder = folder.unwrap_or(Path::new("."));
    // A manifest that has been read has a folder; should it have gone since, its name will do.
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

    /// The places of `a/b/study.toml` and the file that it names so.
    fn places(named: &str) -> Result<(String, String), &'static str> {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("a/b");
        fs::create_dir_all(&folder).unwrap();
        let named = PathBuf::from(named);
        match Places::of(&folder.join("study.toml"), [&named]) {
            Ok(places) => Ok((places.manifest.clone(), places.files[&named].clone())),
            Err(error) => Err(error.why),
        }
    }

    fn both(manifest: &str, file: &str) -> Result<(String, String), &'static str> {
        Ok((manifest.to_owned(), file.to_owned()))
    }

    #[test]
    fn a_manifest_without_files_lies_at_the_root() {
        let places = Places::of(Path::new("somewhere/study.toml"), []).unwrap();
        assert_eq!(places.manifest, "study.toml");
        assert_eq!(places.manifest_from(3), "../../../study.toml");
    }

    #[test]
    fn paths_lead_from_the_manifest_to_its_files_as_they_did() {
        assert_eq!(places("scan.x3p"), both("study.toml", "scan.x3p"));
        assert_eq!(places("./maps/s.x3p"), both("study.toml", "maps/s.x3p"));
        assert_eq!(places("../scan.x3p"), both("b/study.toml", "scan.x3p"));
        assert_eq!(places("../../m/s.x3p"), both("a/b/study.toml", "m/s.x3p"));
    }

    #[test]
    fn what_would_not_be_found_again_is_refused() {
        assert_eq!(places("/scan.x3p"), Err("its path is absolute"));
        assert_eq!(places("maps/../s.x3p"), Err("it goes down and up again"));
        let far = "../".repeat(60) + "scan.x3p";
        assert_eq!(places(&far), Err("it leads out of the file system"));
    }
}
