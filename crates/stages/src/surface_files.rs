//! Files of measured surfaces, found by what is in them.
//!
//! A result depends on the content of a file and not on its name: recipes hold the hash of the
//! content, and only this map knows where such content lies.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use thiserror::Error;

/// The largest file that is read: a map of 16384 × 16384 numbers and some header.
pub const LARGEST: u64 = (8 << 28) + (1 << 20);

/// A BLAKE3 hash of a file's bytes; written in hexadecimal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ContentHash([u8; 32]);

impl ContentHash {
    /// The hash of these bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// The hash that is written so.
    pub fn from_hex(text: &str) -> Option<Self> {
        let hash = blake3::Hash::from_hex(text).ok()?;
        Some(Self(*hash.as_bytes()))
    }
}

impl fmt::Display for ContentHash {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&blake3::Hash::from_bytes(self.0).to_hex())
    }
}

impl Serialize for ContentHash {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for ContentHash {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<ContentHash, D::Error> {
        let text = String::deserialize(deserializer)?;
        let unreadable = || de::Error::custom(format_args!("`{text}` is no hash of a content"));
        ContentHash::from_hex(&text).ok_or_else(unreadable)
    }
}

/// What files held when they were last read, by their paths as the manifest gives them.
pub type Recollection = BTreeMap<PathBuf, Recalled>;

/// What is known of a file that cannot be read now: what its recipe is made of that no manifest says,
/// and what forecasts need.
#[derive(Debug, Clone, PartialEq)]
pub struct Recalled {
    /// The hash of its content.
    pub content: ContentHash,
    /// Its format; none of a NumPy array.
    pub format: Option<String>,
    /// The unit of its lengths.
    pub unit: String,
    /// Nodes along x and y of its map once that is prepared.
    pub nodes: [u32; 2],
    /// Sides of that map.
    pub side: [f64; 2],
}

/// Where the files of measured surfaces lie.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceFiles {
    /// Paths in manifests are relative to it.
    folder: PathBuf,
    paths: BTreeMap<ContentHash, PathBuf>,
    known: Recollection,
    /// Files that cannot be read, and of which only their content's hash is known.
    recalled: BTreeSet<PathBuf>,
    /// Files that were read.
    read: BTreeSet<PathBuf>,
}

/// Why the file of a surface cannot be used.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum SurfaceFileError {
    /// No file of the study has this content.
    #[error("no surface file of this study has the content {content}")]
    Unknown { content: ContentHash },
    /// The file is gone, or may not be read.
    #[error("cannot read surface file `{}`", path.display())]
    Read { path: PathBuf, source: io::Error },
    /// The file is not what it was when the study was read.
    #[error("surface file `{}` has changed since the study was read", path.display())]
    Changed { path: PathBuf },
}

impl SurfaceFiles {
    /// No files yet, in the folder of a manifest.
    pub fn new(folder: &Path) -> Self {
        Self::recalling(folder, Recollection::new())
    }

    /// No files yet; those that cannot be read are taken to be as they were.
    pub fn recalling(folder: &Path, known: Recollection) -> Self {
        Self { folder: folder.to_owned(), known, ..Self::default() }
    }

    /// What a file held that cannot be read now, if that is known.
    pub fn recall(&mut self, path: &Path) -> Option<Recalled> {
        let recalled = self.known.get(path)?.clone();
        let paths = self.paths.entry(recalled.content);
        paths.or_insert_with(|| path.to_owned());
        self.recalled.insert(path.to_owned());
        Some(recalled)
    }

    /// The files that cannot be read, and were taken to be as they were.
    pub fn recalled(&self) -> &BTreeSet<PathBuf> {
        &self.recalled
    }

    /// Every file that was read, as the manifest names it, also those whose contents are equal.
    pub fn read_files(&self) -> &BTreeSet<PathBuf> {
        &self.read
    }

    /// Reads a file for the first time and remembers where its content lies. Of several files
    /// with equal content the first is kept.
    pub fn add(&mut self, path: &Path) -> Result<(ContentHash, Vec<u8>), SurfaceFileError> {
        let bytes = self.load(path)?;
        let content = ContentHash::of(&bytes);
        self.paths.entry(content).or_insert_with(|| path.to_owned());
        self.read.insert(path.to_owned());
        Ok((content, bytes))
    }

    /// Reads the file with this content again.
    ///
    /// # Errors
    /// When the file is gone, or its content is another by now.
    pub fn read(&self, content: &ContentHash) -> Result<Vec<u8>, SurfaceFileError> {
        let path = self.path_of(content).ok_or(SurfaceFileError::Unknown { content: *content })?;
        let bytes = self.load(path)?;
        if ContentHash::of(&bytes) != *content {
            let path = path.to_owned();
            return Err(SurfaceFileError::Changed { path });
        }
        Ok(bytes)
    }

    /// The path of a content, as the manifest gives it.
    pub fn path_of(&self, content: &ContentHash) -> Option<&Path> {
        self.paths.get(content).map(PathBuf::as_path)
    }

    /// The path of a content whose hash is known as text.
    pub fn path_of_hex(&self, content: &str) -> Option<&Path> {
        self.path_of(&ContentHash::from_hex(content)?)
    }

    /// Every content and its path, as the manifest gives it.
    pub fn paths(&self) -> &BTreeMap<ContentHash, PathBuf> {
        &self.paths
    }

    fn load(&self, path: &Path) -> Result<Vec<u8>, SurfaceFileError> {
        read_regular(&self.folder.join(path), LARGEST)
            .map_err(|source| SurfaceFileError::Read { path: path.to_owned(), source })
    }
}

/// Reads a file that is neither a folder nor a device, and not larger than `most` bytes.
pub fn read_regular(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let not_read = |why: &str| Err(io::Error::new(io::ErrorKind::InvalidInput, why));
    // Before it is opened: opening a pipe would wait for somebody to write to it.
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        return not_read("not a file");
    }
    if metadata.len() > most {
        return not_read("too large");
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_is_found_by_its_hash_until_the_file_changes() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.npy");
        std::fs::write(&file, b"one").unwrap();
        let mut files = SurfaceFiles::new(folder.path());
        let (content, bytes) = files.add(Path::new("a.npy")).unwrap();
        assert_eq!(bytes, b"one");
        assert_eq!(files.read(&content).unwrap(), b"one");
        assert_eq!(files.path_of_hex(&content.to_string()), Some(Path::new("a.npy")));

        std::fs::write(&file, b"two").unwrap();
        assert!(matches!(files.read(&content), Err(SurfaceFileError::Changed { .. })));
        std::fs::remove_file(&file).unwrap();
        assert!(matches!(files.read(&content), Err(SurfaceFileError::Read { .. })));
        let other = ContentHash::of(b"three");
        assert!(matches!(files.read(&other), Err(SurfaceFileError::Unknown { .. })));
    }

    #[test]
    fn folders_and_oversized_files_are_not_read() {
        let folder = tempfile::tempdir().unwrap();
        assert!(read_regular(folder.path(), 10).is_err());
        let file = folder.path().join("long");
        std::fs::write(&file, b"0123456789").unwrap();
        assert!(read_regular(&file, 9).is_err());
        assert_eq!(read_regular(&file, 10).unwrap().len(), 10);
    }

    #[test]
    fn a_hash_is_written_in_hexadecimal() {
        let content = ContentHash::of(b"");
        let json = serde_json::to_string(&content).unwrap();
        // The published BLAKE3 hash of nothing.
        assert!(json.starts_with("\"af1349b9f5f9a1a6a0404dea36dcc949"), "{json}");
        assert_eq!(json.len(), 66);
    }
}
