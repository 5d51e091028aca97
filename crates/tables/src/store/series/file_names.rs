//! Names of the files of a store, and what files with rows state about themselves.

use std::path::Path;
use std::str::FromStr;
use std::{fmt, fs, io};

use super::{TableRef, contains};
use crate::key::{KeyMap, TaskKey};
use crate::parquet::{Metadata, ParquetError};
use crate::store::provenance::Provenance;
use crate::store::{StoreError, files};

/// Name of a file with the table of a task, or with rows of a series.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FileName {
    pub key: TaskKey,
    /// `None` for a file with a whole table.
    pub rows: Option<RowsName>,
}

/// Part of a file name that identifies rows of a series.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RowsName {
    /// Name of the part in the file, or `None` for the columns that all rows have.
    pub part: Option<String>,
    digest: u64,
}

impl RowsName {
    /// Creates the name of a file with the rows of these values, or with one part of these rows.
    pub fn new(part: Option<&str>, values: &[f64]) -> RowsName {
        let mut hasher = blake3::Hasher::new();
        for value in values {
            hasher.update(&value.to_bits().to_le_bytes());
        }
        let mut digest = [0; 8];
        digest.copy_from_slice(&hasher.finalize().as_bytes()[..8]);
        RowsName { part: part.map(str::to_owned), digest: u64::from_be_bytes(digest) }
    }
}

impl fmt::Display for FileName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.key.fmt(formatter)?;
        if let Some(RowsName { part, digest }) = &self.rows {
            if let Some(part) = part {
                write!(formatter, "-{part}")?;
            }
            write!(formatter, "-{digest:016x}")?;
        }
        formatter.write_str(".parquet")
    }
}

impl FromStr for FileName {
    type Err = ();

    fn from_str(name: &str) -> Result<FileName, ()> {
        let mut words = name.strip_suffix(".parquet").ok_or(())?.split('-');
        let is_hexadecimal =
            |word: &&str| word.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
        let key = words.next().filter(is_hexadecimal).ok_or(())?.parse().map_err(drop)?;
        let rows = match (words.next(), words.next(), words.next()) {
            (None, ..) => None,
            (Some(digest), None, _) => Some((None, digest)),
            (Some(part), Some(digest), None) => Some((Some(part.to_owned()), digest)),
            (Some(_), Some(_), Some(_)) => return Err(()),
        };
        let rows = rows.map(|(part, digest)| {
            let is_digest = digest.len() == 16 && is_hexadecimal(&digest);
            let digest = u64::from_str_radix(digest, 16).ok().filter(|_| is_digest)?;
            Some(RowsName { part, digest })
        });
        Ok(FileName { key, rows: rows.map(|rows| rows.ok_or(())).transpose()? })
    }
}

/// Returns the sorted files with tables in a folder, by key. If the folder does not exist, there
/// are none.
///
/// # Errors
/// Returns an error if the folder cannot be listed.
pub(super) fn finished_in(folder: &Path) -> io::Result<KeyMap<Vec<FileName>>> {
    let mut finished: KeyMap<Vec<FileName>> = KeyMap::default();
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(finished),
        entries => entries?,
    };
    for entry in entries {
        let entry = entry?;
        let name = entry.file_name();
        let Some(file) = name.to_str().and_then(|name| name.parse::<FileName>().ok()) else {
            continue;
        };
        // The entry itself says whether it is a plain file. Only links need another system call.
        if entry.file_type()?.is_file() || entry.path().is_file() {
            finished.entry(file.key).or_default().push(file);
        }
    }
    finished.values_mut().for_each(|files| files.sort_unstable());
    Ok(finished)
}

/// Name of the metadata entry with the column that identifies rows, followed by their values.
const ROWS: &str = "rows";
/// Name of the metadata entry with the name of the part in the file.
const PART: &str = "part";

/// Returns the metadata entries of a file with these rows of a series.
pub(super) fn entries(column: &str, values: &[f64], part: Option<&str>) -> Vec<(String, String)> {
    // Rust formats numbers so that parsing gives exactly the same number.
    let words = values.iter().map(|value| format!(" {value:?}"));
    let rows = words.fold(column.to_owned(), |all, word| all + &word);
    let of_part = part.map(|part| (PART.to_owned(), part.to_owned()));
    of_part.into_iter().chain([(ROWS.to_owned(), rows)]).collect()
}

/// Returns the column that identifies the rows of a file, and their values.
fn rows_in(metadata: &Metadata) -> Option<(String, Vec<f64>)> {
    let mut words = metadata.get(ROWS)?.split(' ');
    let column = words.next()?.to_owned();
    let values = words.map(|word| word.parse().ok()).collect::<Option<_>>()?;
    Some((column, values))
}

/// Checks that the content of a file belongs to its name, and returns its provenance.
pub fn provenance_of(
    path: &Path,
    name: &FileName,
    metadata: &Metadata,
) -> Result<Provenance, StoreError> {
    let stated = Provenance::from_metadata(metadata).filter(|stated| stated.key() == name.key);
    let has_rows = match &name.rows {
        None => metadata.get(ROWS).is_none(),
        Some(rows) => rows_in(metadata).is_some_and(|(_, values)| {
            let part = metadata.get(PART).map(str::to_owned);
            *rows == RowsName { part, ..RowsName::new(None, &values) }
        }),
    };
    stated.filter(|_| metadata.key == Some(name.key) && has_rows).ok_or_else(|| {
        StoreError::Damaged {
            path: path.to_owned(),
            source: ParquetError::Foreign { owner: format!("task {}", name.key) },
        }
    })
}

/// Returns whether the file `path` of the name `file` holds rows of a table, or a part of them.
pub fn holds_some_of(path: &Path, file: &FileName, table: &TableRef) -> bool {
    let Some(series) = &table.series else { return file.rows.is_none() };
    let Ok((_, stored)) = stated_rows(path, file) else { return false };
    let wanted = |part: Option<&str>, values: &[f64]| {
        is_of(file, part) && stored.iter().any(|value| contains(values, *value))
    };
    let mut parts = series.parts.iter();
    wanted(None, &series.values) || parts.any(|of| wanted(Some(&of.part.name), &of.values))
}

/// Reads which rows a file states to have: the column that identifies them, and their values.
pub(super) fn stated_rows(path: &Path, name: &FileName) -> Result<(String, Vec<f64>), StoreError> {
    let table = files::open_table(path)?;
    provenance_of(path, name, table.metadata())?;
    rows_in(table.metadata()).ok_or_else(|| not_found(path))
}

/// Returns whether a file holds the columns of all rows (`None`), or the part of this name.
pub(super) fn is_of(name: &FileName, part: Option<&str>) -> bool {
    let rows = name.rows.as_ref();
    rows.is_some_and(|rows| rows.part.as_deref() == part)
}

pub fn not_found(path: &Path) -> StoreError {
    StoreError::Read { path: path.to_owned(), source: io::ErrorKind::NotFound.into() }
}
