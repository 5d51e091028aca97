//! Rows of series in the store: which are missing, reading and storing.

use std::cell::RefCell;
use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::file_names::{entries, finished_in, is_of, not_found, provenance_of, stated_rows};
use super::{
    FileName, MissingRows, Part, PartRows, RowsName, SeriesRows, TableRef, ascending, contains,
    index_of,
};
use crate::key::{KeyMap, TaskKey};
use crate::parallel::locked;
use crate::parquet::{Columns, ParquetError};
use crate::store::provenance::Provenance;
use crate::store::{Store, StoreError, file_path, files, path};
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
        let missing = |of: Option<&Part>, values: &[f64]| {
            self.divided(names, of.map(|part| part.name.as_str()), values).1
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
            let (own, stored) = stated_rows(&self.locate(name), name)?;
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
        let (mut tables, mut last_made) = (Vec::new(), None);
        let (chosen, missing) = self.divided(names, part, values);
        if !missing.is_empty() {
            return Err(not_found(&self.path(key)));
        }
        if let [(name, _)] = chosen[..]
            && name.rows == Some(RowsName::new(part, values))
        {
            return self.read_file(name, columns);
        }
        for (name, here) in chosen {
            let (table, made) = self.read_file(name, columns)?;
            let of_rows = values_in(&table, column, &self.path(key))?;
            let found = of_rows.iter().enumerate().filter(|(_, value)| contains(&here, **value));
            let wanted: Vec<usize> = found.map(|(row, _)| row).collect();
            tables.push(table.pick(&wanted));
            last_made = Some(made);
        }
        let provenance = last_made.ok_or_else(|| not_found(&self.path(key)))?;
        let stacked = Table::stack(&tables).map_err(|_| not_found(&self.path(key)))?;
        let order = ascending(&values_in(&stacked, column, &self.path(key))?);
        Ok((stacked.pick(&order), provenance))
    }

    /// Chooses the files from which rows are read, and the values of the rows that each provides.
    /// Also returns the values of the rows that the files `names` lack.
    fn divided<'n>(
        &self,
        names: &'n [FileName],
        part: Option<&str>,
        values: &[f64],
    ) -> (Vec<(&'n FileName, Vec<f64>)>, Vec<f64>) {
        let exact = Some(RowsName::new(part, values));
        if let Some(name) = names.iter().find(|name| name.rows == exact) {
            return (vec![(name, values.to_vec())], Vec::new());
        }
        let mut missing = values.to_vec();
        let mut chosen = Vec::new();
        for name in names.iter().filter(|name| is_of(name, part)) {
            let stored = self.rows_of(name).unwrap_or_default();
            let (here, others): (Vec<f64>, Vec<f64>) =
                missing.iter().partition(|value| contains(&stored, **value));
            if !here.is_empty() {
                missing = others;
                chosen.push((name, here));
            }
        }
        (chosen, missing)
    }

    /// Returns the files among `names` from which a table is read. Returns `None` if they lack a
    /// row.
    pub(in crate::store) fn files_read(
        &self,
        table: &TableRef,
        names: &[FileName],
    ) -> Option<Vec<FileName>> {
        let Some(series) = &table.series else {
            return names.iter().find(|name| name.rows.is_none()).map(|name| vec![name.clone()]);
        };
        let parts = series.parts.iter().map(|of| (Some(of.part.name.as_str()), &of.values));
        let mut read = Vec::new();
        for (part, values) in [(None, &series.values)].into_iter().chain(parts) {
            let (chosen, missing) = self.divided(names, part, values);
            if !missing.is_empty() {
                return None;
            }
            read.extend(chosen.into_iter().map(|(name, _)| name.clone()));
        }
        Some(read)
    }

    pub(in crate::store) fn read_file(
        &self,
        name: &FileName,
        columns: Columns,
    ) -> Result<(Table, Provenance), StoreError> {
        let path = self.locate(name);
        let (table, metadata) = files::read_whole(&path, columns)?;
        Ok((table, provenance_of(&path, name, &metadata)?))
    }

    /// Returns the values of the rows in a file, or `None` if the file cannot be read.
    pub(in crate::store) fn rows_of(&self, name: &FileName) -> Option<Arc<[f64]>> {
        let lock = || locked(&self.known_rows.0);
        if let Some(known) = lock().get(name) {
            return Some(known.clone());
        }
        let stated = stated_rows(&self.locate(name), name);
        let values: Arc<[f64]> = match stated {
            Ok((_, values)) => values.into(),
            Err(error) => {
                self.layers.ignore(&error);
                return None;
            }
        };
        lock().insert(name.clone(), values.clone());
        Some(values)
    }

    /// Returns the names of the files with rows of a series: those of this store, sorted, then
    /// those that only layers have.
    pub fn files_of(&self, key: TaskKey) -> Result<Vec<FileName>, StoreError> {
        Ok(self.finished_beside(key)?.remove(&key).unwrap_or_default())
    }

    /// Returns the files with tables in the folder of the key `key`, by key: those of this store,
    /// then those that only layers have.
    pub(in crate::store) fn finished_beside(
        &self,
        key: TaskKey,
    ) -> Result<KeyMap<Vec<FileName>>, StoreError> {
        let finished_in = |root: &Path| {
            let path = path(root, key);
            let folder = path.parent().unwrap_or(root);
            finished_in(folder).map_err(|source| StoreError::reading(folder, source))
        };
        let mut finished = finished_in(&self.root)?;
        for root in self.layers() {
            for (key, found) in finished_in(root).unwrap_or_default() {
                self.add_layer(finished.entry(key).or_default(), root, found);
            }
        }
        Ok(finished)
    }

    /// Adds the files `found` of the layer `root` that can be used and are not in `files` yet.
    fn add_layer(&self, files: &mut Vec<FileName>, root: &Path, found: Vec<FileName>) {
        for file in found {
            if !files.contains(&file) && !self.layers.is_ignored(&file_path(root, &file)) {
                files.push(file);
            }
        }
    }

    /// Returns the path in this store of a file with the table of a task or with rows of a series.
    pub fn path_of(&self, name: &FileName) -> PathBuf {
        file_path(&self.root, name)
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
        self.write(&self.path_of(&name), table, &metadata)?;
        Ok(name)
    }

    /// Removes a file whose rows are all in another file. Ignores errors, because the file does no
    /// harm.
    pub fn remove_superseded(&self, name: &FileName) {
        let _ = std::fs::remove_file(self.path_of(name));
    }
}

/// Listing of a store for many questions about its rows. Each folder is listed once.
pub struct Listing<'a> {
    store: &'a Store,
    folders: RefCell<HashMap<u8, KeyMap<Vec<FileName>>>>,
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
        self.with_files(table, |names| self.store.missing_rows_among(table, names))
    }

    /// Returns the indices of the layers from which rows of a finished table are read.
    ///
    /// # Errors
    /// Returns an error if a folder cannot be listed.
    pub fn layers_of(&self, table: &TableRef) -> Result<BTreeSet<usize>, StoreError> {
        self.with_files(table, |names| {
            let read = self.store.files_read(table, names).unwrap_or_default();
            read.iter().filter_map(|name| self.store.layer_of(name)).collect()
        })
    }

    /// Calls `read` with the names of the files that the store has for a table.
    fn with_files<T>(
        &self,
        table: &TableRef,
        read: impl FnOnce(&[FileName]) -> T,
    ) -> Result<T, StoreError> {
        let mut folders = self.folders.borrow_mut();
        let files = match folders.entry(table.key.first_byte()) {
            Entry::Occupied(listed) => listed.into_mut(),
            Entry::Vacant(entry) => entry.insert(self.store.finished_beside(table.key)?),
        };
        Ok(read(files.get(&table.key).map_or(&[][..], Vec::as_slice)))
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
