//! Comparison as one table, with a row for each stage, column, parameter point and load.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, BooleanArray, Int64Array};
use arrow::datatypes::{Field, Schema};

use super::{Comparison, MeanComparison, Test};
use crate::session::SessionError;
use asperity_stages::columns::{LOAD, PRESSURE};
use asperity_tables::column::{
    ColumnKind, Role, Value, described, integers, optional_reals, optional_texts, reals, texts,
};
use asperity_tables::parquet::{self, Metadata};
use asperity_tables::source::TableSource;
use asperity_tables::store::files::{folder_of, write_file};
use asperity_tables::table::Table;

/// Name and value of the metadata entry by which a file is known to be a comparison.
const MADE_BY: (&str, &str) = ("made_by", "asperity diff");

/// Mean comparison with the names of its study, stage and column.
struct Row<'a> {
    study: &'a str,
    stage: &'a str,
    column: &'a str,
    unit: &'a str,
    load_column: &'static str,
    mean: &'a MeanComparison,
}

/// Writes all means of a comparison into a Parquet file.
///
/// # Errors
/// Returns an error if the file cannot be written, or if it exists and is not a comparison.
pub(crate) fn write(comparison: &Comparison, path: &Path) -> Result<(), SessionError> {
    if path.symlink_metadata().is_ok() && !is_comparison(path) {
        return Err(SessionError::refused(format!(
            "`{}` was not written by `asperity diff`; choose another file",
            path.display()
        )));
    }
    let entry = |(name, value): (&str, &str)| (name.to_owned(), value.to_owned());
    let version = entry(("version", env!("CARGO_PKG_VERSION")));
    let metadata = Metadata { key: None, entries: vec![entry(MADE_BY), version] };
    let bytes = parquet::encode(&table(comparison), &metadata);
    Ok(write_file(path, &bytes, folder_of(path))?)
}

fn is_comparison(path: &Path) -> bool {
    let source = TableSource::open(path);
    source.is_ok_and(|(_, metadata)| metadata.get(MADE_BY.0) == Some(MADE_BY.1))
}

/// Returns a table with a row for each mean of a comparison.
pub fn table(comparison: &Comparison) -> Table {
    let mut rows = Vec::new();
    for study in &comparison.studies {
        for stage in &study.stages {
            let Some(tables) = &stage.tables else { continue };
            for column in &tables.columns {
                rows.extend(column.means.iter().map(|mean| Row {
                    study: &study.a.study,
                    stage: &stage.stage,
                    column: &column.column,
                    unit: &column.unit,
                    load_column: tables.rows.load_column,
                    mean,
                }));
            }
        }
    }
    let text = |value: fn(&Row) -> String| texts(rows.iter().map(value));
    let mut names = Columns::default();
    names.add("study", Role::Parameter, "study of A", text(|row| row.study.to_owned()));
    names.add("stage", Role::Parameter, "stage of A", text(|row| row.stage.to_owned()));
    names.add("column", Role::Parameter, "compared column", text(|row| row.column.to_owned()));
    let unit = text(|row| row.unit.to_owned());
    names.add("column_unit", Role::Derived, "unit of the compared column", unit);
    let results = results(&rows);
    let mut coordinates = coordinates(&rows);
    // A query may call a column as this table does.
    let is_free = |name: &String| !names.has(name) && !results.has(name);
    coordinates.retain(|(name, ..)| is_free(name));
    for (name, role, array) in coordinates {
        names.add(&name, role, "coordinate of the rows in both studies", array);
    }
    names.append(results);
    Table::from_arrays(rows.len(), Schema::new(names.fields), names.arrays)
}

/// Returns the columns of parameters and loads.
fn coordinates(rows: &[Row]) -> Vec<(String, Role, ArrayRef)> {
    let mut columns: Vec<(String, Role, ArrayRef)> = Vec::new();
    for (name, _) in rows.iter().flat_map(|row| row.mean.point.iter()) {
        if columns.iter().all(|(known, ..)| known != name) {
            let values: Vec<Option<&Value>> =
                rows.iter().map(|row| row.mean.point.get(name)).collect();
            columns.push((name.to_owned(), Role::Parameter, parameter(&values)));
        }
    }
    for load_column in [LOAD.name, PRESSURE.name] {
        let load = |row: &Row| row.mean.load.filter(|_| row.load_column == load_column);
        let loads: Vec<Option<f64>> = rows.iter().map(load).collect();
        if loads.iter().any(Option::is_some) {
            columns.push((load_column.to_owned(), Role::Load, optional_reals(loads)));
        }
    }
    columns
}

fn results(rows: &[Row]) -> Columns {
    let number = |value: fn(&MeanComparison) -> f64| reals(rows.iter().map(|row| value(row.mean)));
    let optional = |value: fn(&MeanComparison) -> Option<f64>| {
        optional_reals(rows.iter().map(|row| value(row.mean)))
    };
    let count = |value: fn(&MeanComparison) -> usize| {
        integers(rows.iter().map(|row| value(row.mean) as i64))
    };
    let mut columns = Columns::default();
    columns.result("row", "number among rows that no column distinguishes", count(|m| m.row));
    let test = texts(rows.iter().map(|row| match row.mean.test {
        Test::Paired => "paired",
        Test::Welch => "welch",
    }));
    columns.result("test", "`paired` by surface, or `welch` for independent surfaces", test);
    columns.result("values_a", "number of values in the mean of A", count(|m| m.values_a));
    columns.result("values_b", "number of values in the mean of B", count(|m| m.values_b));
    columns.result("mean_a", "mean of A", number(|m| m.mean_a));
    columns.result("mean_b", "mean of B", number(|m| m.mean_b));
    columns.result("difference", "mean of B minus mean of A", number(|m| m.difference));
    columns.result("relative", "difference over |mean of A|", optional(|m| m.relative));
    columns.result("lower", "lower end of the 95 % interval", optional(|m| m.lower));
    columns.result("upper", "upper end of the 95 % interval", optional(|m| m.upper));
    columns.result("p_value", "p-value of the difference", optional(|m| m.p_value));
    columns.result("p_corrected", "p-value after Holm's correction", optional(|m| m.p_corrected));
    let is_more = rows.iter().map(|row| row.mean.is_more_than_noise);
    let is_more: ArrayRef = Arc::new(BooleanArray::from_iter(is_more));
    columns.result("more_than_noise", "whether the corrected p-value is at most 5 %", is_more);
    columns
}

#[derive(Default)]
struct Columns {
    fields: Vec<Field>,
    arrays: Vec<ArrayRef>,
}

impl Columns {
    fn has(&self, name: &str) -> bool {
        self.fields.iter().any(|field| field.name() == name)
    }

    fn add(&mut self, name: &str, role: Role, meaning: &str, array: ArrayRef) {
        let field = Field::new(name, array.data_type().clone(), true);
        self.fields.push(field.with_metadata(described(role, "", meaning)));
        self.arrays.push(array);
    }

    fn result(&mut self, name: &str, meaning: &str, array: ArrayRef) {
        self.add(name, Role::Result, meaning, array);
    }

    fn append(&mut self, other: Columns) {
        self.fields.extend(other.fields);
        self.arrays.extend(other.arrays);
    }
}

/// Returns the column of a parameter. Values of different types become text.
fn parameter(values: &[Option<&Value>]) -> ArrayRef {
    let kind = |value: &&Value| match value {
        Value::Real(_) => ColumnKind::Real,
        Value::Integer(_) => ColumnKind::Integer,
        Value::Text(_) => ColumnKind::Text,
    };
    let mut kinds = values.iter().flatten().map(kind);
    let first = kinds.next().filter(|first| kinds.all(|other| other == *first));
    match first {
        Some(ColumnKind::Real) => optional_reals(values.iter().map(|value| match value {
            Some(Value::Real(value)) => Some(*value),
            _ => None,
        })),
        Some(ColumnKind::Integer) => {
            Arc::new(Int64Array::from_iter(values.iter().map(|value| match value {
                Some(Value::Integer(value)) => Some(*value),
                _ => None,
            })))
        }
        _ => optional_texts(values.iter().map(|value| value.map(ToString::to_string))),
    }
}
