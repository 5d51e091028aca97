//! Rows of series in the store: which are missing, reading and storing.

use std::cell::RefCell;
use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::file_names::{entries, is_of, not_found, provenance_of, stated_rows};
use super::{FileName, MissingRows, Part, PartRows, RowsName, SeriesRows, TableRef};
use super::{ascending, contains, index_of};
use crate::parquet::{Columns, ParquetError};
use crate::store::files::Existing;
use crate::store::key::{Provenance, TaskKey};
use crate::store::listing::finished_in;
use crate::store::{Store, StoreError, files};
use crate::table::Table;

/// Values of the rows in files whose metadata have been read. Files with equal names have equal
/// rows.
#[derive(Debug, Default)]
pub struct KnownRows(Mutex<HashMap<FileName, Arc<[f64]>>>);

impl Store {
    /// Returns the rows and parts of a table that the store lacks. A whole table lacks no rows.
    ///
    /// # Errors
    /// Returns an error if a folder cannot be listed.
    pub fn missing_rows(&self, table: &TableRef) -> Result<MissingRows, StoreError> {
        Ok(self.missing_rows_among(table, &self.files_of(table.key)?))
    }

    /// Returns the rows and parts of a table that the files `names` lack.
    pub(in crate::store) fn missing_rows_among(
        &self,
        table: &TableRef,
        names: &[FileName],
    ) -> MissingRows {
        let Some(series) = &table.series else { return MissingRows::default() };
        let missing = |part: Option<&Part>, values: &[f64]| {
            let part = part.map(|part| part.name.as_str());
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
    pub(in crate::store) fn read_series(
        &self,
        table: &TableRef,
        series: &SeriesRows,
        columns: Columns,
    ) -> Result<Table, StoreError> {
        let names = self.files_of(table.key)?;
        let read = |part: Option<&Part>, values: &[f64]| {
            let name = part.map(|part| part.name.as_str());
            self.read_part(table.key, &names, series.column, name, values, columns)
        };
        let (mut rows, _) = read(None, &series.values)?;
        let parts = series.parts.iter().filter(|of| columns == Columns::All || !of.part.is_heavy);
        for PartRows { part, values } in parts {
            let (cells, _) = read(Some(part), values)?;
            let picked = matching(&rows, &cells, series.column, &self.path(table.key))?;
            rows = rows.beside(&cells.only(&part.columns).pick_or_null(&picked));
        }
        Ok(rows)
    }

    /// Reads all stored rows of a series with all parts, for a reader that only knows the key.
    pub(in crate::store) fn read_all_rows(
        &self,
        key: TaskKey,
    ) -> Result<(Table, Provenance), StoreError> {
        let names = self.files_of(key)?;
        // The values of the rows by part. `None` comes first: it stands for the columns of all
        // rows.
        let mut values: BTreeMap<Option<&str>, Vec<f64>> = BTreeMap::new();
        let mut column = String::new();
        for name in &names {
            let (own, stored) = stated_rows(&self.path_of(name), name)?;
            let part = name.rows.as_ref().and_then(|rows| rows.part.as_deref());
            values.entry(part).or_default().extend(stored);
            column = own;
        }
        if !values.contains_key(&None) {
            return Err(not_found(&self.path(key)));
        }
        let mut read = None;
        for (part, mut values) in values {
            values.sort_by(f64::total_cmp);
            values.dedup();
            let (cells, provenance) =
                self.read_part(key, &names, &column, part, &values, Columns::All)?;
            read = Some(match read {
                None => (cells, provenance),
                Some((rows, provenance)) => {
                    let picked = matching(&rows, &cells, &column, &self.path(key))?;
                    // Two parts may hold the same column, for example counts in different bins.
                    let new = cells.without(&rows.names());
                    (rows.beside(&new.pick_or_null(&picked)), provenance)
                }
            });
        }
        read.ok_or_else(|| not_found(&self.path(key)))
    }

    /// Reads the rows with the given values of the columns that all rows have, or of one part.
    /// `column` is the column of the values.
    fn read_part(
        &self,
        key: TaskKey,
        names: &[FileName],
        column: &str,
        part: Option<&str>,
        values: &[f64],
        columns: Columns,
    ) -> Result<(Table, Provenance), StoreError> {
        let exact = FileName { key, rows: Some(RowsName::new(part, values)) };
        if names.contains(&exact) {
            return self.read_file(&exact, columns);
        }
        let mut missing = values.to_vec();
        let (mut tables, mut provenance) = (Vec::new(), None);
        for name in names.iter().filter(|name| is_of(name, part)) {
            let stored = self.rows_of(name).unwrap_or_default();
            let (here, others): (Vec<f64>, Vec<f64>) =
                missing.iter().partition(|value| contains(&stored, **value));
            if here.is_empty() {
                continue;
            }
            missing = others;
            let (table, made) = self.read_file(name, columns)?;
            let of_rows = values_in(&table, column, &self.path(key))?;
            let wanted = of_rows.iter().enumerate().filter(|(_, value)| contains(&here, **value));
            let wanted: Vec<usize> = wanted.map(|(row, _)| row).collect();
            tables.push(table.pick(&wanted));
            provenance = Some(made);
        }
        let Some(provenance) = provenance.filter(|_| missing.is_empty()) else {
            return Err(not_found(&self.path(key)));
        };
        let stacked = Table::stack(&tables).map_err(|_| not_found(&self.path(key)))?;
        let order = ascending(&values_in(&stacked, column, &self.path(key))?);
        Ok((stacked.pick(&order), provenance))
    }

    fn read_file(
        &self,
        name: &FileName,
        columns: Columns,
    ) -> Result<(Table, Provenance), StoreError> {
        let path = self.path_of(name);
        let (table, metadata) = files::read_whole(&path, columns)?;
        Ok((table, provenance_of(&path, name, &metadata)?))
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
        let files = names.filter_map(|name| name.parse().ok());
        Ok(files.filter(|file| self.path_of(file).is_file()).collect())
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
        let part = part.map(|part| part.name.as_str());
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
                let unreadable = |source| StoreError::reading(folder, source);
                entry.insert(finished_in(folder).map_err(unreadable)?)
            }
        };
        let names = files.get(&table.key).map_or(&[][..], Vec::as_slice);
        Ok(self.store.missing_rows_among(table, names))
    }
}

/// Returns, for each of `rows`, the index of the row of `cells` with the same value in `column`.
fn matching(
    rows: &Table,
    cells: &Table,
    column: &str,
    path: &Path,
) -> Result<Vec<Option<usize>>, StoreError> {
    let known = values_in(cells, column, path)?;
    let wanted = values_in(rows, column, path)?;
    Ok(wanted.into_iter().map(|value| index_of(&known, value)).collect())
}

fn values_in(table: &Table, column: &str, path: &Path) -> Result<Vec<f64>, StoreError> {
    let values = table.reals(column).map_err(|_| StoreError::Damaged {
        path: path.to_owned(),
        source: ParquetError::Foreign { owner: format!("a series by `{column}`") },
    })?;
    Ok(values.values().to_vec())
}
