//! Files that contain other files: zip archives, into which several formats pack their files, and
//! containers around any file. Gzip and zip around one file are read through, and other containers
//! are named for what they are.

use std::borrow::Cow;
use std::io::{Cursor, Read};

use flate2::read::MultiGzDecoder;
use zip::ZipArchive;

use super::input::{after, decoded_limit, inflate};
use super::{FormatError, TopographyFileError};

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
        self.read(name, |size| {
            let length = usize::try_from(size).ok().filter(|length| *length <= limit);
            let entry = format!("length of `{name}` in the archive");
            length.ok_or_else(|| FormatError::value(&entry, size, &format!("at most {limit}")))
        })
    }

    /// Reads the first `expected` bytes of a file.
    pub(crate) fn exactly(&mut self, name: &str, expected: usize) -> Result<Vec<u8>, FormatError> {
        self.read(name, |_| Ok(expected))
    }

    /// Reads as many bytes of a file as `length` returns for its size.
    fn read(
        &mut self,
        name: &str,
        length: impl FnOnce(u64) -> Result<usize, FormatError>,
    ) -> Result<Vec<u8>, FormatError> {
        let part = format!("`{name}` in the archive");
        let file = self.zip.by_name(name).map_err(|error| FormatError::damaged(&part, error))?;
        let compressed = usize::try_from(file.compressed_size()).unwrap_or(usize::MAX);
        let length = length(file.size())?;
        inflate(&part, file, compressed, length)
    }
}

/// Containers that are named by their first bytes, with what to do.
const NAMED: [(&[u8], &str, &str); 13] = [
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive", UNPACK),
    (b"Rar!\x1a\x07", "a RAR archive", UNPACK),
    (b"\xfd7zXZ\0", "a file compressed by xz", UNPACK),
    (b"BZh", "a file compressed by bzip2", UNPACK),
    (b"\x28\xb5\x2f\xfd", "a file compressed by Zstandard", UNPACK),
    (b"\x1f\x9d", "a file compressed by compress", UNPACK),
    (b"MATLAB 5.0", "a MATLAB file of version 5 to 7", "save the map again with `-v7.3`"),
    (b"%PDF", "a PDF document", "export the heights as a file of its instrument or as text"),
    (b"PK\x05\x06", "an empty zip archive", "pack the file again"),
    (b"\x89PNG", "a PNG picture", PICTURE),
    (b"\xff\xd8\xff", "a JPEG picture", PICTURE),
    (b"GIF8", "a GIF picture", PICTURE),
    (b"PAR1", "a Parquet file", "export the heights as CSV or as a NumPy array"),
];
const UNPACK: &str = "unpack it first";
const PICTURE: &str = "its colours are no heights; export the heights as numbers";

/// First bytes of a compound file of Microsoft.
const COMPOUND: &[u8] = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1";
/// Name of the stream of a MountainsMap document that has the surfaces. Its layout is not public,
/// and no second reader confirms that of SurfaceTopography 1.27.1.
const MOUNTAINS: &[u8] = b"S\0c\0o\0p\0e\0d\0C\0o\0n\0t\0e\0n\0t\0s\0";

/// Files in a zip archive by which other programs are known, with the name of their files and what
/// to do.
const ARCHIVES: [(&str, &str, &str); 9] = [
    ("xl/", "an Excel workbook", "export the sheet with the heights as CSV"),
    ("word/", "a Word document", "export the heights as text"),
    ("ppt/", "a PowerPoint presentation", "export the heights as text"),
    ("mimetype", "an OpenDocument file", "export the sheet with the heights as CSV"),
    ("segments/", "a JPK file of force curves", "export the height image of the map as TIFF"),
    ("shared-data/", "a JPK file of force curves", "export the height image of the map as TIFF"),
    ("data-image.jpk-qi-image", "a JPK QI file", "export its height image as TIFF"),
    ("meta.yml", "a container of contact.engineering", "unpack it and name one of its surfaces"),
    ("meta.json", "a container of contact.engineering", "unpack it and name one of its surfaces"),
];

/// Files in a zip archive of which this crate has a reader.
const READ: [&str; 4] = ["main.xml", ".dsc", "index.xml", "Document.xml"];

/// Returns the content of the only file in a container, or `None` if the file is no container.
///
/// # Errors
/// Returns an error that names the container if it has none or several files, or is of a kind that
/// is not read.
pub(crate) fn content(bytes: &[u8]) -> Result<Option<Vec<u8>>, TopographyFileError> {
    let container = |kind: &str, advice: &str| TopographyFileError::Container {
        kind: kind.to_owned(),
        advice: advice.to_owned(),
    };
    let limit = decoded_limit(bytes.len());
    if bytes.starts_with(b"\x1f\x8b") {
        let mut inflated = Vec::new();
        let read = MultiGzDecoder::new(bytes).take(limit as u64 + 1).read_to_end(&mut inflated);
        return match read {
            Ok(length) if length > limit => {
                Err(container("a gzip file that expands to far more than heights do", UNPACK))
            }
            Ok(_) if inflated.is_empty() => Err(container("an empty gzip file", UNPACK)),
            Ok(_) => Ok(Some(inflated)),
            Err(error) => Err(container(&format!("a damaged gzip file ({error})"), UNPACK)),
        };
    }
    if bytes.get(257..262) == Some(b"ustar") {
        return Err(container("a tar archive", UNPACK));
    }
    if bytes.starts_with(COMPOUND) {
        let is_mountains = bytes.windows(MOUNTAINS.len()).any(|name| name == MOUNTAINS);
        return Err(if is_mountains {
            container("a MountainsMap document (`.mnt`)", "save its surface as a `.sur` file")
        } else {
            let kind = "a compound file of Microsoft, such as an Excel workbook of 1997 to 2003";
            container(kind, "export the heights as text")
        });
    }
    if let Some((_, kind, advice)) = NAMED.iter().find(|(start, ..)| bytes.starts_with(start)) {
        return Err(container(kind, advice));
    }
    if !bytes.starts_with(SIGNATURE) {
        return Ok(None);
    }
    // The readers of formats that are archives report damage.
    let Ok(mut archive) = Archive::new(bytes) else {
        return Ok(None);
    };
    let names: Vec<String> = archive.names().map(Cow::into_owned).collect();
    let has = |part: &str| {
        let is_folder = part.ends_with('/');
        let is_it = |name: &String| {
            if is_folder { name.starts_with(part) } else { name.rsplit('/').next() == Some(part) }
        };
        names.iter().any(is_it)
    };
    let is_read = |name: &String| READ.iter().any(|end| name.ends_with(end));
    if is_npz(&names) || names.iter().any(is_read) {
        return Ok(None);
    }
    if let Some((_, kind, advice)) = ARCHIVES.iter().find(|(part, ..)| has(part)) {
        return Err(container(kind, advice));
    }
    let is_hidden = |name: &str| {
        name.ends_with('/')
            || name.split('/').any(|part| part == "__MACOSX" || part.starts_with('.'))
    };
    let files: Vec<&String> = names.iter().filter(|name| !is_hidden(name)).collect();
    let [file] = files[..] else {
        let first: Vec<&str> = files.iter().take(4).map(|name| name.as_str()).collect();
        let more = if files.len() > first.len() { ", …" } else { "" };
        let kind = format!("a zip archive of {} files ({}{more})", files.len(), first.join(", "));
        return Err(container(&kind, "unpack it and name one of its files"));
    };
    let inflated = archive.file(file, limit);
    inflated
        .map(Some)
        .map_err(|error| container(&format!("a damaged zip archive ({error})"), UNPACK))
}

/// Returns true if an archive has only NumPy arrays.
pub(crate) fn is_npz(names: &[String]) -> bool {
    !names.is_empty() && names.iter().all(|name| name.ends_with(".npy"))
}
