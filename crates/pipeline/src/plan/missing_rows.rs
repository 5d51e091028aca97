//! Rows that the store lacks of a task, grouped by what has to be computed for them.

use std::collections::BTreeMap;

use crate::plan::Task;
use asperity_stages::Recipe;
use asperity_tables::parquet::Columns;
use asperity_tables::store::series::{MissingRows, Part, PartRows, SeriesRows, TableRef, contains};
use asperity_tables::store::{Store, StoreError};
use asperity_tables::table::Table;

/// Rows of a series that lack the same columns in the store.
#[derive(Debug, Clone, PartialEq)]
pub struct RowGroup {
    /// Values of the rows, in ascending order.
    pub values: Vec<f64>,
    /// True if the store lacks the rows, false if it lacks only parts of them.
    pub is_new: bool,
    /// Parts that the store lacks.
    pub parts: Vec<Part>,
    /// True if the missing parts can be computed from stored rows.
    pub from_stored: bool,
}

/// Returns the rows and parts that a task has to compute because the store lacks them. If the store
/// has all of them, returns all rows of the task with all parts.
///
/// # Errors
/// Returns an error if the store cannot be listed.
pub fn to_compute(
    task: &Task,
    series: &SeriesRows,
    store: &Store,
) -> Result<Vec<RowGroup>, StoreError> {
    let groups = missing_groups(task, series, &|table| store.missing_rows(table))?;
    if !groups.is_empty() {
        return Ok(groups);
    }
    let all = MissingRows {
        values: series.values.clone(),
        parts: series.parts.iter().map(|of| of.values.clone()).collect(),
    };
    Ok(grouped(series, &all, &[]))
}

/// Returns the rows and parts of a task that the store lacks, as `missing_rows` finds them.
///
/// # Errors
/// Returns the errors of `missing_rows`.
pub fn missing_groups(
    task: &Task,
    series: &SeriesRows,
    missing_rows: &dyn Fn(&TableRef) -> Result<MissingRows, StoreError>,
) -> Result<Vec<RowGroup>, StoreError> {
    let missing = missing_rows(&task.table)?;
    let lacks_only_parts = !missing.is_empty() && missing.values.len() < missing.all().len();
    let with_source = match task.recipe.source_part() {
        Some(part) if lacks_only_parts => {
            let wanted = with_source(task, part, series.values.clone());
            let lacking = missing_rows(&wanted)?.all();
            let stored = series.values.iter().filter(|value| !contains(&lacking, **value));
            stored.copied().collect()
        }
        _ => Vec::new(),
    };
    Ok(grouped(series, &missing, &with_source))
}

/// Returns a reference to rows of a task with only its source part.
fn with_source(task: &Task, part: Part, values: Vec<f64>) -> TableRef {
    let stored = task.table.series.as_deref();
    let series = stored.map(|series| SeriesRows {
        column: series.column,
        values: values.clone(),
        parts: vec![PartRows { part, values }],
    });
    TableRef { key: task.table.key, series: series.map(Into::into) }
}

/// Groups rows by the columns that they lack. `with_source` are the rows that are stored with the
/// part from which other parts can be computed.
fn grouped(series: &SeriesRows, missing: &MissingRows, with_source: &[f64]) -> Vec<RowGroup> {
    let mut by_need: BTreeMap<(bool, Vec<bool>, bool), Vec<f64>> = BTreeMap::new();
    for value in missing.all() {
        let is_new = contains(&missing.values, value);
        let parts: Vec<bool> = missing.parts.iter().map(|rows| contains(rows, value)).collect();
        let from_stored = !is_new && contains(with_source, value);
        by_need.entry((is_new, parts, from_stored)).or_default().push(value);
    }
    let groups = by_need.into_iter().map(|((is_new, lacks, from_stored), values)| {
        let lacking = series.parts.iter().zip(lacks).filter(|(_, lacks)| *lacks);
        let parts = lacking.map(|(of, _)| of.part.clone()).collect();
        RowGroup { values, is_new, parts, from_stored }
    });
    groups.collect()
}

impl RowGroup {
    /// Returns the recipe that computes this group.
    pub fn recipe(&self, whole: &Recipe) -> Recipe {
        let wanted = |part: &Part| self.parts.contains(part);
        whole.restricted(&self.values, &wanted).expect("the recipe describes a series")
    }

    /// Reads the stored rows of the group with their source part, if the missing parts can be
    /// computed from them.
    pub fn stored(&self, task: &Task, store: &Store) -> Result<Option<Table>, StoreError> {
        let Some(part) = task.recipe.source_part().filter(|_| self.from_stored) else {
            return Ok(None);
        };
        let wanted = with_source(task, part, self.values.clone());
        store.read(&wanted, Columns::All).map(Some)
    }
}
