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

mod file_names;
mod stored_rows;

use std::sync::Arc;

use crate::key::TaskKey;
use crate::table::Table;

pub use file_names::{FileName, RowsName, holds_some_of};
pub(super) use file_names::{not_found, provenance_of};
pub(super) use stored_rows::KnownRows;
pub use stored_rows::Listing;

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
        Some(table.pick(&ascending(table.reals(self.column).ok()?.values())))
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
    /// Columns that the part adds to a row.
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

/// Returns the order of rows in which their values ascend. Rows with the same value keep their
/// order.
fn ascending(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|one, other| values[*one].total_cmp(&values[*other]));
    order
}

/// Returns the index of a value in a list of ascending values, or `None` if the list lacks it.
fn index_of(values: &[f64], value: f64) -> Option<usize> {
    values.binary_search_by(|other| other.total_cmp(&value)).ok()
}

/// Returns whether a list of ascending values contains a value, to the last bit.
pub fn contains(values: &[f64], value: f64) -> bool {
    index_of(values, value).is_some()
}

fn common(values: &[f64], others: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|value| contains(others, *value)).collect()
}

#[cfg(test)]
mod tests;
