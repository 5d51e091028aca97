//! Series of rows in several files: tables of independent rows that can be extended.
//!
//! The rows of a series share everything that decides them except one value, such as the load. The
//! key of the series covers what they share, and each row is identified by its value. A file holds
//! any number of rows and never changes. A task that needs further rows adds another file, so
//! adding or removing values computes nothing twice.
//!
//! Some columns are computed only on request, such as pressure fields. They are the *parts* of a
//! series and have their own files, with one row per value. A task that requests another part adds
//! files of this part and leaves the other files as they are.
//!
//! The name of a file is `KEY-DIGEST.parquet`, or `KEY-PART-DIGEST.parquet` for a part, with a
//! digest of the values of its rows.

use std::cell::RefCell;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Mutex};

use super::files::Existing;
use super::key::{Provenance, TaskKey};
use super::listing::finished_in;
use super::{Store, StoreError, files};
use crate::parquet::{Columns, Metadata, ParquetError};
use crate::table::Table;

/// Reference to the table of a task: a whole table, or rows of a series.
#[derive(Debug, Clone, PartialEq)]
pub struct TableRef {
    /// Key of the table, or of the series to which its rows belong.
    pub key: TaskKey,
    /// Rows of the table if they belong to a series.
    pub series: Option<Arc<SeriesRows>>,
}

/// Rows of a series, and the parts that some of them have.
#[derive(Debug, Clone, PartialEq)]
pub struct SeriesRows {
    /// Name of the column whose values identify the rows.
    pub column: &'static str,
    /// Values of the rows, in ascending order.
    pub values: Vec<f64>,
    pub parts: Vec<PartRows>,
}

impl SeriesRows {
    /// Returns the rows of a table whose values are among the values of the series. Returns `None`
    /// if the table has no column of the values.
    pub fn among(&self, table: &Table) -> Option<Table> {
        let values = table.reals(self.column).ok()?.values();
        let rows: Vec<usize> =
            (0..table.rows()).filter(|&row| contains(&self.values, values[row])).collect();
        Some(if rows.len() == table.rows() { table.clone() } else { table.pick(&rows) })
    }

    /// Returns the rows in ascending order of their values. Returns `None` if the table has no
    /// column of the values.
    pub fn sorted(&self, table: &Table) -> Option<Table> {
        let values = table.reals(self.column).ok()?.values();
        let mut order: Vec<usize> = (0..table.rows()).collect();
        // The sort is stable, so rows with the same value keep their order.
        order.sort_by(|one, other| values[*one].total_cmp(&values[*other]));
        Some(table.pick(&order))
    }

    /// Returns whether a table has a row for each value of the series.
    pub fn is_whole(&self, table: &Table) -> bool {
        let found = table.reals(self.column);
        found.is_ok_and(|found| self.values.iter().all(|value| contains(found.values(), *value)))
    }
}

/// Rows that have one of the parts of a series.
#[derive(Debug, Clone, PartialEq)]
pub struct PartRows {
    pub part: Part,
    /// Values of the rows with this part, in ascending order.
    pub values: Vec<f64>,
}

/// Group of columns that a series has only on request.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Name with the parameters of the part; letters, digits, `_` and `.`.
    pub name: String,
    /// Names of the columns.
    pub columns: Vec<&'static str>,
    /// True if the columns are large, so that they are read only with all columns.
    pub is_heavy: bool,
}

/// Rows that the store lacks, by their values.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MissingRows {
    /// Rows that are not stored at all.
    pub values: Vec<f64>,
    /// For each part of the table, the rows for which the store lacks the part.
    pub parts: Vec<Vec<f64>>,
}

impl MissingRows {
    pub fn is_empty(&self) -> bool {
        self.values.is_empty() && self.parts.iter().all(Vec::is_empty)
    }

    /// Returns the values of all rows that lack anything, in ascending order.
    pub fn all(&self) -> Vec<f64> {
        let mut all: Vec<f64> =
            self.parts.iter().chain([&self.values]).flatten().copied().collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }
}

impl From<TaskKey> for TableRef {
    fn from(key: TaskKey) -> TableRef {
        TableRef { key, series: None }
    }
}

impl TableRef {
    /// Returns a reference to the rows with these values only.
    pub fn restricted(&self, values: &[f64]) -> TableRef {
        self.with_series(|series| SeriesRows {
            column: series.column,
            values: common(&series.values, values),
            parts: series
                .parts
                .iter()
                .map(|of| PartRows { part: of.part.clone(), values: common(&of.values, values) })
                .collect(),
        })
    }

    /// Returns a reference to the same rows with only those parts that `wanted` accepts.
    pub fn with_parts(&self, wanted: impl Fn(&Part) -> bool) -> TableRef {
        self.with_series(|series| SeriesRows {
            column: series.column,
            values: series.values.clone(),
            parts: series.parts.iter().filter(|of| wanted(&of.part)).cloned().collect(),
        })
    }

    fn with_series(&self, change: impl Fn(&SeriesRows) -> SeriesRows) -> TableRef {
        let series = self.series.as_deref().map(|series| Arc::new(change(series)));
        TableRef { key: self.key, series }
    }
}

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
    pub fn new(part: Option<&Part>, values: &[f64]) -> RowsName {
        let mut hasher = blake3::Hasher::new();
        for value in values {
            hasher.update(&value.to_bits().to_le_bytes());
        }
        let mut digest = [0; 8];
        digest.copy_from_slice(&hasher.finalize().as_bytes()[..8]);
        RowsName { part: part.map(|part| part.name.clone()), digest: u64::from_be_bytes(digest) }
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
        let key = words.next().and_then(|word| word.parse().ok()).ok_or(())?;
        let mut rest: Vec<&str> = words.collect();
        let rows = match rest.pop() {
            None => None,
            Some(digest) => {
                let digest = u64::from_str_radix(digest, 16).map_err(drop)?;
                let part = match rest[..] {
                    [] => None,
                    [part] => Some(part.to_owned()),
                    _ => return Err(()),
                };
                Some(RowsName { part, digest })
            }
        };
        let parsed = FileName { key, rows };
        if parsed.to_string() == name { Ok(parsed) } else { Err(()) }
    }
}

/// Name of the metadata entry with the column that identifies rows, followed by their values.
const ROWS: &str = "rows";
/// Name of the metadata entry with the name of the part in the file.
const PART: &str = "part";

/// Returns the metadata entries of a file with these rows of a series.
fn entries(column: &str, values: &[f64], part: Option<&Part>) -> Vec<(String, String)> {
    // Rust formats numbers so that parsing gives exactly the same number.
    let words = values.iter().map(|value| format!(" {value:?}"));
    let rows = words.fold(column.to_owned(), |all, word| all + &word);
    let part = part.map(|part| (PART.to_owned(), part.name.clone()));
    part.into_iter().chain([(ROWS.to_owned(), rows)]).collect()
}

/// Returns the column that identifies the rows of a file, and their values.
fn rows_in(metadata: &Metadata) -> Option<(String, Vec<f64>)> {
    let mut words = metadata.get(ROWS)?.split(' ');
    let column = words.next()?.to_owned();
    let values = words.map(|word| word.parse().ok()).collect::<Option<_>>()?;
    Some((column, values))
}

/// Checks that the content of a file belongs to its name, and returns its provenance.
pub(super) fn provenance_of(
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

/// Values of the rows in files whose metadata have been read. Files with equal names have equal
/// rows.
#[derive(Debug, Default)]
pub(super) struct KnownRows(Mutex<HashMap<FileName, Arc<[f64]>>>);

impl Store {
    /// Returns the rows and parts of a table that the store lacks. A whole table lacks no rows.
    ///
    /// # Errors
    /// Returns an error if a folder cannot be listed.
    pub fn missing_rows(&self, table: &TableRef) -> Result<MissingRows, StoreError> {
        Ok(self.missing_rows_among(table, &self.files_of(table.key)?))
    }

    /// Returns the rows and parts of a table that the files `names` lack.
    pub(super) fn missing_rows_among(&self, table: &TableRef, names: &[FileName]) -> MissingRows {
        let Some(series) = &table.series else { return MissingRows::default() };
        let missing = |part: Option<&Part>, values: &[f64]| {
            let exact = FileName { key: table.key, rows: Some(RowsName::new(part, values)) };
            if names.contains(&exact) {
                return Vec::new();
            }
            let mut missing = values.to_vec();
            for name in names.iter().filter(|name| name.key == table.key && is_of(name, part)) {
                let stored = self.rows_of(name).unwrap_or_default();
                missing.retain(|value| !contains(&stored, *value));
            }
            missing
        };
        MissingRows {
            values: missing(None, &series.values),
            parts: series.parts.iter().map(|of| missing(Some(&of.part), &of.values)).collect(),
        }
    }

    /// Reads rows of a series with their parts, in ascending order of the values.
    pub(super) fn read_series(
        &self,
        table: &TableRef,
        series: &SeriesRows,
        columns: Columns,
    ) -> Result<(Table, Provenance), StoreError> {
        let names = self.files_of(table.key)?;
        let read = |part: Option<&Part>, values: &[f64]| {
            self.read_part(table.key, &names, part, values, columns)
        };
        let (mut rows, provenance) = read(None, &series.values)?;
        let parts = series.parts.iter().filter(|of| columns == Columns::All || !of.part.is_heavy);
        for PartRows { part, values } in parts {
            let (cells, _) = read(Some(part), values)?;
            let of_part = cells.only(&part.columns);
            let known = values_in(&cells, series.column, &self.path(table.key))?;
            let wanted = values_in(&rows, series.column, &self.path(table.key))?;
            let index = |value: &f64| known.iter().position(|known| same(*known, *value));
            let picked: Vec<Option<usize>> = wanted.iter().map(index).collect();
            rows = rows.beside(&of_part.pick_or_null(&picked));
        }
        Ok((rows, provenance))
    }

    /// Reads all stored rows of a series with all parts, for a reader that only knows the key.
    pub(super) fn read_all_rows(&self, key: TaskKey) -> Result<(Table, Provenance), StoreError> {
        let names = self.files_of(key)?;
        let (mut column, mut values, mut parts) = (None, Vec::new(), HashMap::new());
        for name in &names {
            let (own, stored) = stated_rows(&self.path_of(name), name)?;
            match name.rows.as_ref().and_then(|rows| rows.part.clone()) {
                None => values.extend(stored),
                Some(part) => parts.entry(part).or_insert_with(Vec::new).extend(stored),
            }
            column = Some(own);
        }
        let Some(column) = column else { return Err(not_found(&self.path(key))) };
        let sorted = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.dedup();
            values
        };
        let read = |part: Option<&Part>, values: &[f64]| {
            self.read_part(key, &names, part, values, Columns::All)
        };
        let (mut rows, provenance) = read(None, &sorted(values))?;
        let mut parts: Vec<_> = parts.into_iter().collect();
        parts.sort_by(|one, other| one.0.cmp(&other.0));
        for (name, values) in parts {
            let (cells, _) =
                read(Some(&Part { name, columns: Vec::new(), is_heavy: false }), &sorted(values))?;
            let path = self.path(key);
            let (known, wanted) =
                (values_in(&cells, &column, &path)?, values_in(&rows, &column, &path)?);
            let index = |value: &f64| known.iter().position(|known| same(*known, *value));
            let picked: Vec<Option<usize>> = wanted.iter().map(index).collect();
            // Two parts may hold the same column, for example counts in different bins.
            let others = rows.names().into_iter().map(str::to_owned).collect::<Vec<_>>();
            let new = cells.keep(|name, _| !others.iter().any(|other| other == name));
            rows = rows.beside(&new.pick_or_null(&picked));
        }
        Ok((rows, provenance))
    }

    /// Reads the rows with the given values of the columns that all rows have, or of one part.
    fn read_part(
        &self,
        key: TaskKey,
        names: &[FileName],
        part: Option<&Part>,
        values: &[f64],
        columns: Columns,
    ) -> Result<(Table, Provenance), StoreError> {
        let exact = FileName { key, rows: Some(RowsName::new(part, values)) };
        if names.contains(&exact) {
            let (table, provenance, _) = self.read_file(&exact, columns)?;
            return Ok((table, provenance));
        }
        let mut missing = values.to_vec();
        let (mut tables, mut provenance) = (Vec::new(), None);
        for name in names.iter().filter(|name| is_of(name, part)) {
            let stored = self.rows_of(name).unwrap_or_default();
            let here: Vec<f64> =
                missing.iter().copied().filter(|value| contains(&stored, *value)).collect();
            if here.is_empty() {
                continue;
            }
            missing.retain(|value| !contains(&here, *value));
            let (table, made, column) = self.read_file(name, columns)?;
            let of_rows = values_in(&table, &column, &self.path(key))?;
            let wanted = of_rows.iter().enumerate().filter(|(_, value)| contains(&here, **value));
            let wanted: Vec<usize> = wanted.map(|(row, _)| row).collect();
            tables.push((table.pick(&wanted), column));
            provenance = Some(made);
        }
        let (Some(provenance), true, Some((_, column))) =
            (provenance, missing.is_empty(), tables.first())
        else {
            return Err(not_found(&self.path(key)));
        };
        let column = column.clone();
        let tables: Vec<Table> = tables.into_iter().map(|(table, _)| table).collect();
        let stacked = Table::stack(&tables).map_err(|_| not_found(&self.path(key)))?;
        let of_rows = values_in(&stacked, &column, &self.path(key))?;
        let mut order: Vec<usize> = (0..stacked.rows()).collect();
        // The sort is stable, so rows with the same value keep their order.
        order.sort_by(|one, other| of_rows[*one].total_cmp(&of_rows[*other]));
        Ok((stacked.pick(&order), provenance))
    }

    fn read_file(
        &self,
        name: &FileName,
        columns: Columns,
    ) -> Result<(Table, Provenance, String), StoreError> {
        let path = self.path_of(name);
        let (table, metadata) = files::read_whole(&path, columns)?;
        let provenance = provenance_of(&path, name, &metadata)?;
        let column = rows_in(&metadata).map_or_else(String::new, |(column, _)| column);
        Ok((table, provenance, column))
    }

    /// Returns the values of the rows in a file, or `None` if the file cannot be read.
    fn rows_of(&self, name: &FileName) -> Option<Arc<[f64]>> {
        let lock = || self.known_rows.0.lock().expect("no code panics while it holds the lock");
        if let Some(known) = lock().get(name) {
            return Some(known.clone());
        }
        let values: Arc<[f64]> = stated_rows(&self.path_of(name), name).ok()?.1.into();
        lock().insert(name.clone(), values.clone());
        Some(values)
    }

    /// Returns the names of the files with rows of a series, sorted.
    pub fn files_of(&self, key: TaskKey) -> Result<Vec<FileName>, StoreError> {
        let folder = self.path(key);
        let folder = folder.parent().unwrap_or(&self.root);
        let digits = key.to_string();
        let names = files::names(folder)?.into_iter().filter(|name| name.starts_with(&digits));
        Ok(names.filter_map(|name| name.parse().ok()).collect())
    }

    /// Returns the path of a file with the table of a task or with rows of a series.
    pub fn path_of(&self, name: &FileName) -> PathBuf {
        self.path(name.key).with_file_name(name.to_string())
    }

    /// Stores rows of a series, or one part of these rows. `table` has the rows with exactly the
    /// given values. Returns the name of the file.
    ///
    /// # Errors
    /// Returns an error if the disk is full or the folder is not writable.
    pub fn publish_rows(
        &self,
        provenance: &Provenance,
        column: &str,
        values: &[f64],
        part: Option<&Part>,
        table: &Table,
    ) -> Result<FileName, StoreError> {
        let name = FileName { key: provenance.key(), rows: Some(RowsName::new(part, values)) };
        let mut metadata = provenance.metadata();
        metadata.entries.extend(entries(column, values, part));
        // A file of this name that cannot be read counts as missing, so it is replaced.
        self.write(&self.path_of(&name), table, &metadata, Existing::Replace)?;
        Ok(name)
    }

    /// Removes a file whose rows are all in another file. Ignores errors, because the file does no
    /// harm.
    pub fn remove_superseded(&self, name: &FileName) {
        let _ = std::fs::remove_file(self.path_of(name));
    }
}

/// Returns whether the file `path` of the name `file` holds rows of a table, or a part of them.
pub fn holds_some_of(path: &Path, file: &FileName, table: &TableRef) -> bool {
    let Some(series) = &table.series else { return file.rows.is_none() };
    let Ok((_, stored)) = stated_rows(path, file) else { return false };
    let wanted = |part: Option<&Part>, values: &[f64]| {
        is_of(file, part) && stored.iter().any(|value| contains(values, *value))
    };
    let mut parts = series.parts.iter();
    wanted(None, &series.values) || parts.any(|of| wanted(Some(&of.part), &of.values))
}

/// Reads which rows a file states to have: the column that identifies them, and their values.
fn stated_rows(path: &Path, name: &FileName) -> Result<(String, Vec<f64>), StoreError> {
    let table = files::open_table(path)?;
    provenance_of(path, name, table.metadata())?;
    rows_in(table.metadata()).ok_or_else(|| not_found(path))
}

/// Listing of a store for many questions about missing rows. Each folder is listed once.
pub struct Listing<'a> {
    store: &'a Store,
    folders: RefCell<HashMap<u8, HashMap<TaskKey, Vec<FileName>>>>,
}

impl<'a> Listing<'a> {
    pub fn new(store: &'a Store) -> Listing<'a> {
        Listing { store, folders: RefCell::default() }
    }

    /// Returns the rows and parts of a table that the store lacked when the folder was listed.
    ///
    /// # Errors
    /// Returns an error if a folder cannot be listed.
    pub fn missing_rows(&self, table: &TableRef) -> Result<MissingRows, StoreError> {
        let mut folders = self.folders.borrow_mut();
        let files = match folders.entry(table.key.first_byte()) {
            Entry::Occupied(listed) => listed.into_mut(),
            Entry::Vacant(entry) => {
                let path = self.store.path(table.key);
                let folder = path.parent().unwrap_or(&self.store.root);
                let unreadable = |source| StoreError::Read { path: folder.to_owned(), source };
                entry.insert(finished_in(folder).map_err(unreadable)?)
            }
        };
        let names = files.get(&table.key).map_or(&[][..], Vec::as_slice);
        Ok(self.store.missing_rows_among(table, names))
    }
}

fn is_of(name: &FileName, part: Option<&Part>) -> bool {
    let rows = name.rows.as_ref();
    rows.is_some_and(|rows| rows.part.as_deref() == part.map(|part| part.name.as_str()))
}

fn not_found(path: &Path) -> StoreError {
    StoreError::Read { path: path.to_owned(), source: std::io::ErrorKind::NotFound.into() }
}

fn values_in(table: &Table, column: &str, path: &Path) -> Result<Vec<f64>, StoreError> {
    let values = table.reals(column).map_err(|_| StoreError::Damaged {
        path: path.to_owned(),
        source: ParquetError::Foreign { owner: format!("a series by `{column}`") },
    })?;
    Ok(values.values().to_vec())
}

fn same(one: f64, other: f64) -> bool {
    one.to_bits() == other.to_bits()
}

fn contains(values: &[f64], value: f64) -> bool {
    values.iter().any(|other| same(*other, value))
}

fn common(values: &[f64], others: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|value| contains(others, *value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::column::{Column, ColumnKind, reals};
    use crate::store::key::Digest;

    const LOAD: Column = Column::result("load", ColumnKind::Real, "1", "load");
    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");
    const FLOW: Column = Column::result("flow", ColumnKind::Real, "1", "flow");

    fn provenance() -> Provenance {
        Provenance {
            stage: "test".to_owned(),
            version: 1,
            recipe: "{}".to_owned(),
            inputs: vec![],
            input_identities: vec![],
        }
    }

    fn flow() -> Part {
        Part { name: "flow".to_owned(), columns: vec!["flow"], is_heavy: false }
    }

    fn table(values: &[f64], with_flow: &[f64]) -> TableRef {
        let parts = vec![PartRows { part: flow(), values: with_flow.to_vec() }];
        let parts = if with_flow.is_empty() { vec![] } else { parts };
        let series = SeriesRows { column: "load", values: values.to_vec(), parts };
        TableRef { key: provenance().key(), series: Some(series.into()) }
    }

    /// Stores rows whose area is twice the load. The row of the load 0.5 is there twice.
    fn publish(store: &Store, values: &[f64]) {
        let rows = values.iter().flat_map(|value| vec![*value; 1 + usize::from(*value == 0.5)]);
        let rows: Vec<f64> = rows.collect();
        let areas = rows.iter().map(|value| 2.0 * value);
        let table =
            Table::new(rows.len(), vec![(LOAD, reals(rows.iter().copied())), (AREA, reals(areas))]);
        store.publish_rows(&provenance(), "load", values, None, &table).unwrap();
    }

    fn publish_flow(store: &Store, values: &[f64]) {
        let flows = values.iter().map(|value| 3.0 * value);
        let table = Table::new(
            values.len(),
            vec![(LOAD, reals(values.iter().copied())), (FLOW, reals(flows))],
        );
        store.publish_rows(&provenance(), "load", values, Some(&flow()), &table).unwrap();
    }

    fn store() -> (tempfile::TempDir, Store) {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&folder.path().join("store")).unwrap();
        (folder, store)
    }

    #[test]
    fn rows_of_several_files_equal_those_of_one_file() {
        let all = [0.1, 0.2, 0.3, 0.5, 0.7];
        let (_one, whole) = store();
        publish(&whole, &all);
        let (_other, parts) = store();
        publish(&parts, &[0.2, 0.5]);
        publish(&parts, &[0.1, 0.3, 0.5]);
        assert!(!parts.has(&table(&all, &[])));
        assert_eq!(parts.missing_rows(&table(&all, &[])).unwrap().values, [0.7]);
        publish(&parts, &[0.7]);
        for wanted in [&all[..], &[0.1, 0.5], &[0.3, 0.7], &[0.5]] {
            let wanted = table(wanted, &[]);
            assert!(parts.has(&wanted) && whole.has(&wanted));
            let [one, other] =
                [&whole, &parts].map(|store| store.read(&wanted, Columns::All).unwrap());
            assert_eq!(one, other);
        }
    }

    #[test]
    fn parts_are_null_in_rows_that_are_not_requested_with_them() {
        let (_folder, store) = store();
        let wanted = table(&[0.1, 0.2, 0.3], &[0.1, 0.3]);
        publish(&store, &[0.1, 0.2, 0.3]);
        publish_flow(&store, &[0.1]);
        let missing = store.missing_rows(&wanted).unwrap();
        assert_eq!((missing.values.len(), &missing.parts[..]), (0, &[vec![0.3]][..]));
        publish_flow(&store, &[0.3]);
        let read = store.read(&wanted, Columns::All).unwrap();
        assert_eq!(read.names(), ["load", "area", "flow"]);
        let flows: Vec<_> = read.reals("flow").unwrap().iter().collect();
        assert_eq!(flows, [Some(3.0 * 0.1), None, Some(3.0 * 0.3)]);
        let all = store.read_with_provenance(provenance().key()).unwrap().0;
        assert_eq!(all, read);
        let without = store.read(&wanted.with_parts(|_| false), Columns::All).unwrap();
        assert_eq!(without.names(), ["load", "area"]);
    }

    #[test]
    fn a_file_whose_name_does_not_follow_from_its_rows_is_damaged() {
        let (_folder, store) = store();
        publish(&store, &[0.1, 0.2]);
        let [name] = &store.files_of(provenance().key()).unwrap()[..] else { panic!("one file") };
        assert!(store.verify(name).is_ok());
        let rows = Some(RowsName::new(None, &[0.1]));
        let other = FileName { key: name.key, rows };
        std::fs::rename(store.path_of(name), store.path_of(&other)).unwrap();
        assert!(matches!(store.verify(&other), Err(StoreError::Damaged { .. })));
        assert!(!store.has(&table(&[0.2], &[])));
        assert!(store.read(&table(&[0.1], &[]), Columns::All).is_err());
    }

    #[test]
    fn names_of_files_are_parsed() {
        let key = TaskKey::new("test", 1, Digest::from_params(&()), &[]);
        let rows = |part: Option<&Part>| Some(RowsName::new(part, &[0.1]));
        for rows in [None, rows(None), rows(Some(&flow()))] {
            let name = FileName { key, rows };
            assert_eq!(name.to_string().parse(), Ok(name));
        }
        for word in ["", "table.parquet", "a-b.parquet", ".parquet"] {
            assert_eq!(word.parse::<FileName>(), Err(()), "{word}");
        }
    }

    #[test]
    fn a_reference_is_restricted_to_rows_and_parts() {
        let whole = table(&[0.1, 0.2, 0.3], &[0.2, 0.3]);
        assert_eq!(whole.restricted(&[0.1, 0.2]), table(&[0.1, 0.2], &[0.2]));
        assert_eq!(whole.with_parts(|_| false), table(&[0.1, 0.2, 0.3], &[]));
        let table_alone = TableRef::from(whole.key);
        assert_eq!(table_alone.restricted(&[0.1]), table_alone);
    }
}
