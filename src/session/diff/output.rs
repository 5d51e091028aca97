//! Comparison as one table, with a row for each stage, column, parameter point and load.

use std::path::Path;

use arrow::array::ArrayRef;
use arrow::datatypes::{Field, Schema};

use super::{Comparison, MeanComparison, Test};
use crate::session::SessionError;
use asperity_stages::columns::{LOAD, PRESSURE};
use asperity_tables::column::{
    Role, Value, described, integers, optional_flags, optional_integers, optional_reals,
    optional_texts, reals, texts,
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
    let number = |value: fn(&MeanComparison) -> f64| reals(rows.iter().map(|row| value(row.mean)));
    let optional = |value: fn(&MeanComparison) -> Option<f64>| {
        optional_reals(rows.iter().map(|row| value(row.mean)))
    };
    let count = |value: fn(&MeanComparison) -> usize| {
        integers(rows.iter().map(|row| value(row.mean) as i64))
    };
    let test = texts(rows.iter().map(|row| match row.mean.test {
        Test::Paired => "paired",
        Test::Welch => "welch",
    }));
    let is_more = optional_flags(rows.iter().map(|row| row.mean.is_more_than_noise));
    let names = [
        ("study", Role::Parameter, "study of A", text(|row| row.study.to_owned())),
        ("stage", Role::Parameter, "stage of A", text(|row| row.stage.to_owned())),
        ("column", Role::Parameter, "compared column", text(|row| row.column.to_owned())),
        (
            "column_unit",
            Role::Derived,
            "unit of the compared column",
            text(|row| row.unit.to_owned()),
        ),
    ];
    let results = [
        ("row", "number among rows that no column distinguishes", count(|m| m.row)),
        ("test", "`paired` by surface, or `welch` for independent surfaces", test),
        ("values_a", "number of values in the mean of A", count(|m| m.values_a)),
        ("values_b", "number of values in the mean of B", count(|m| m.values_b)),
        ("mean_a", "mean of A", number(|m| m.mean_a)),
        ("mean_b", "mean of B", number(|m| m.mean_b)),
        ("difference", "mean of B minus mean of A", number(|m| m.difference)),
        ("relative", "difference over |mean of A|", optional(|m| m.relative)),
        ("lower", "lower end of the 95 % interval", optional(|m| m.lower)),
        ("upper", "upper end of the 95 % interval", optional(|m| m.upper)),
        ("p_value", "p-value of the difference", optional(|m| m.p_value)),
        ("p_corrected", "p-value after Holm's correction", optional(|m| m.p_corrected)),
        ("more_than_noise", "whether the corrected p-value is at most 5 %", is_more),
    ];
    let own = results.map(|(name, meaning, values)| (name, Role::Result, meaning, values));
    // A query may call a column as this table does.
    let mut shared = coordinates(&rows);
    shared.retain(|(name, ..)| names.iter().chain(&own).all(|(known, ..)| known != name));
    let meaning = "coordinate of the rows in both studies";
    let of_both = shared.into_iter().map(|(name, role, values)| (name, role, meaning, values));
    let columns = names.into_iter().chain(of_both).chain(own);
    let described = columns.map(|(name, role, meaning, values)| {
        let field = Field::new(name, values.data_type().clone(), true);
        (field.with_metadata(described(role, "", meaning)), values)
    });
    let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) = described.unzip();
    Table::from_arrays(rows.len(), Schema::new(fields), arrays)
}

/// Returns the columns of parameters and loads.
fn coordinates<'a>(rows: &[Row<'a>]) -> Vec<(&'a str, Role, ArrayRef)> {
    let mut columns: Vec<(&str, Role, ArrayRef)> = Vec::new();
    for (name, _) in rows.iter().flat_map(|row| row.mean.point.iter()) {
        if columns.iter().all(|(known, ..)| *known != name) {
            columns.push((name, Role::Parameter, parameter(name, rows)));
        }
    }
    for load_column in [LOAD.name, PRESSURE.name] {
        let load = |row: &Row| row.mean.load.filter(|_| row.load_column == load_column);
        let loads: Vec<Option<f64>> = rows.iter().map(load).collect();
        if loads.iter().any(Option::is_some) {
            columns.push((load_column, Role::Load, optional_reals(loads)));
        }
    }
    columns
}

/// Returns the column of a parameter. Values of different types become text.
fn parameter(name: &str, rows: &[Row]) -> ArrayRef {
    let values = || rows.iter().map(|row| row.mean.point.get(name));
    if values().flatten().all(|value| matches!(value, Value::Real(_))) {
        optional_reals(values().map(|value| match value {
            Some(Value::Real(value)) => Some(*value),
            _ => None,
        }))
    } else if values().flatten().all(|value| matches!(value, Value::Integer(_))) {
        optional_integers(values().map(|value| match value {
            Some(Value::Integer(value)) => Some(*value),
            _ => None,
        }))
    } else {
        optional_texts(values().map(|value| value.map(ToString::to_string)))
    }
}
