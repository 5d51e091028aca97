//! Files of measured surfaces, identified by their content.
//!
//! A result depends on the content of a file and not on its path: recipes contain the hash of the
//! content, and [`SurfaceFiles`] maps hashes to paths.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use thiserror::Error;

use asperity_tables::store::regular::read_regular;

/// Maximum size of a file: a map of 16384 × 16384 double-precision numbers and a header of 1 MiB.
pub const MAX_BYTES: u64 = (8 << 28) + (1 << 20);

/// BLAKE3 hash of the bytes of a file, written in hexadecimal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ContentHash([u8; 32]);

impl ContentHash {
    /// Computes the hash of these bytes.
    pub fn new(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// Parses a hash in hexadecimal digits.
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
        let invalid = || de::Error::custom(format_args!("`{text}` is not a BLAKE3 hash"));
        ContentHash::from_hex(&text).ok_or_else(invalid)
    }
}

/// Properties of files when they were last read, by their paths in the manifest.
pub type RecordedFiles = BTreeMap<PathBuf, RecordedFile>;

/// Properties of a file when it was last read. Recipes and forecasts use them if the file cannot be
/// read now.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedFile {
    pub content: ContentHash,
    /// Format of the file, or `None` for a NumPy array.
    pub format: Option<String>,
    /// Unit of length of the map.
    pub unit: String,
    /// Nodes along x and y of the prepared map.
    pub nodes: [u32; 2],
    /// Sides of the prepared map.
    pub side: [f64; 2],
    /// True if missing points of the map were filled.
    pub is_filled: bool,
}

/// Paths of the files of measured surfaces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceFiles {
    /// Folder of the manifest, to which paths are relative.
    folder: PathBuf,
    paths: BTreeMap<ContentHash, PathBuf>,
    known: RecordedFiles,
    /// Files that cannot be read and for which recorded properties are used.
    recalled: BTreeSet<PathBuf>,
    /// Files that have been read.
    read: BTreeSet<PathBuf>,
}

/// Reason why the file of a surface cannot be used.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum SurfaceFileError {
    #[error("no surface file of this study has the BLAKE3 hash {content}")]
    Unknown { content: ContentHash },
    #[error("cannot read surface file `{}`", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("surface file `{}` has changed since the study was read", path.display())]
    Changed { path: PathBuf },
}

impl SurfaceFiles {
    /// Creates an empty collection for the folder of a manifest.
    pub fn new(folder: &Path) -> Self {
        Self::with_records(folder, RecordedFiles::new())
    }

    /// Creates an empty collection that uses recorded properties for files that cannot be read.
    pub fn with_records(folder: &Path, known: RecordedFiles) -> Self {
        Self { folder: folder.to_owned(), known, ..Self::default() }
    }

    /// Returns the recorded properties of a file that cannot be read, and adds the file to
    /// [`SurfaceFiles::recalled`]. Returns `None` if nothing is recorded.
    pub fn recall(&mut self, path: &Path) -> Option<RecordedFile> {
        let recalled = self.known.get(path)?.clone();
        let paths = self.paths.entry(recalled.content);
        paths.or_insert_with(|| path.to_owned());
        self.recalled.insert(path.to_owned());
        Some(recalled)
    }

    /// Returns the files that could not be read and for which recorded properties were used.
    pub fn recalled(&self) -> &BTreeSet<PathBuf> {
        &self.recalled
    }

    /// Returns the paths, as in the manifest, of all files that were read, including files with
    /// equal contents.
    pub fn read_files(&self) -> &BTreeSet<PathBuf> {
        &self.read
    }

    /// Reads a file for the first time and records the path of its content. Of several files with
    /// equal content, the first path is kept.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read.
    pub fn add(&mut self, path: &Path) -> Result<(ContentHash, Vec<u8>), SurfaceFileError> {
        let bytes = self.load(path)?;
        let content = ContentHash::new(&bytes);
        self.paths.entry(content).or_insert_with(|| path.to_owned());
        self.read.insert(path.to_owned());
        Ok((content, bytes))
    }

    /// Returns whether there is a file with this path, or a record of it.
    pub fn has(&self, path: &Path) -> bool {
        self.folder.join(path).is_file() || self.known.contains_key(path)
    }

    /// Returns the names in a folder, relative to the manifest, with those of recorded files.
    pub fn names_in(&self, folder: &Path) -> BTreeSet<String> {
        let entries = std::fs::read_dir(self.folder.join(folder)).into_iter().flatten();
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let recorded = self.known.keys().filter_map(|path| {
            let inside = path.strip_prefix(folder).ok()?;
            Some(inside.components().next()?.as_os_str().to_str()?.to_owned())
        });
        names.chain(recorded).collect()
    }

    /// Reads the file with this content again.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read or its content has changed.
    pub fn read(&self, content: &ContentHash) -> Result<Vec<u8>, SurfaceFileError> {
        let path = self.path_of(content).ok_or(SurfaceFileError::Unknown { content: *content })?;
        let bytes = self.load(path)?;
        if ContentHash::new(&bytes) != *content {
            return Err(SurfaceFileError::Changed { path: path.to_owned() });
        }
        Ok(bytes)
    }

    /// Returns the path of the file with this content, as in the manifest.
    pub fn path_of(&self, content: &ContentHash) -> Option<&Path> {
        self.paths.get(content).map(PathBuf::as_path)
    }

    /// Returns the path of the file whose hash is `content`, in hexadecimal digits.
    pub fn path_of_hex(&self, content: &str) -> Option<&Path> {
        self.path_of(&ContentHash::from_hex(content)?)
    }

    /// Returns the paths of all files, as in the manifest, by content hash.
    pub fn paths(&self) -> &BTreeMap<ContentHash, PathBuf> {
        &self.paths
    }

    fn load(&self, path: &Path) -> Result<Vec<u8>, SurfaceFileError> {
        read_regular(&self.folder.join(path), MAX_BYTES)
            .map_err(|source| SurfaceFileError::Read { path: path.to_owned(), source })
    }
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
        let other = ContentHash::new(b"three");
        assert!(matches!(files.read(&other), Err(SurfaceFileError::Unknown { .. })));
    }

    #[test]
    fn a_hash_is_written_in_hexadecimal() {
        let content = ContentHash::new(b"");
        let json = serde_json::to_string(&content).unwrap();
        // The published BLAKE3 hash of the empty input.
        assert!(json.starts_with("\"af1349b9f5f9a1a6a0404dea36dcc949"), "{json}");
        assert_eq!(json.len(), 66);
    }
}
