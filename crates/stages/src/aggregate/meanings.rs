//! Units and meanings of reduced columns.

use std::collections::HashMap;

use arrow::array::ArrayRef;
use arrow::datatypes::{Field, Metadata, Schema};

use super::names::OWN;
use super::{Groups, confidence};
use asperity_tables::column::Column;
use asperity_tables::table::Table;

/// Gives each column the unit and meaning that it inherits.
pub fn with_meanings(
    table: &Table,
    columns: Vec<(String, ArrayRef)>,
    rows: usize,
    groups: &Groups,
) -> Table {
    let schema = table.batch().schema();
    let own: HashMap<&str, Column> = OWN.map(|column| (column.name, column)).into();
    let field = |name: &str, array: &ArrayRef| {
        if let Some(column) = own.get(name) {
            return column.field();
        }
        if let Ok(field) = schema.field_with_name(name) {
            return field.clone();
        }
        let source = schema.fields().iter().filter(|f| name.starts_with(&format!("{}_", f.name())));
        let source = source.max_by_key(|field| field.name().len());
        let metadata = source.map(|field| inherited(field, name, groups)).unwrap_or_default();
        Field::new(name, array.data_type().clone(), true).with_metadata(metadata)
    };
    let fields: Vec<Field> = columns.iter().map(|(name, array)| field(name, array)).collect();
    let arrays = columns.into_iter().map(|(_, array)| array).collect();
    Table::of(rows, Schema::new(fields), arrays)
}

fn inherited(source: &Field, name: &str, groups: &Groups) -> Metadata {
    let of = |entry: &str| source.metadata().get(entry).cloned().unwrap_or_default();
    let statistic = &name[source.name().len() + 1..];
    let of_an_end = |&level: &f64| confidence::meaning(level, statistic);
    let said = groups.levels().iter().find_map(of_an_end);
    let said = said.unwrap_or_else(|| statistic.to_owned());
    let unit = match statistic {
        "slope" | "secant" | "regr_slope" => format!("{} per load", of("unit")),
        _ => of("unit"),
    };
    Metadata::new()
        .with("role", "result")
        .with("unit", unit)
        .with("meaning", format!("{said} of: {}", of("meaning")))
}
