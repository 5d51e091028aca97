//! Comparison with the answers of DuckDB, which `tests/sql.py` writes.

use std::collections::BTreeMap;
use std::sync::Arc;

use arrow::array::{Array, ArrayRef, AsArray, BooleanArray, Float64Array, Int64Array, StringArray};
use arrow::datatypes::{Field, Float64Type, Int64Type, Schema};
use bytesize::ByteSize;
use serde_json::Value;

use asperity_manifest::diagnostics::chain;
use asperity_stages::aggregate::sql::ask;
use asperity_tables::table::Table;

/// Relative difference that sums in another order may have.
const TOLERANCE: f64 = 1e-12;

fn table(description: &Value) -> Table {
    let rows = description["rows"].as_array().unwrap();
    let columns = description["columns"].as_array().unwrap().iter().enumerate();
    let columns = columns.map(|(index, column)| {
        let (name, kind) = column.as_str().unwrap().split_once(' ').unwrap();
        let values = rows.iter().map(|row| &row[index]);
        let array: ArrayRef = match kind {
            "bigint" => Arc::new(values.map(Value::as_i64).collect::<Int64Array>()),
            "double" => Arc::new(values.map(Value::as_f64).collect::<Float64Array>()),
            "boolean" => Arc::new(values.map(Value::as_bool).collect::<BooleanArray>()),
            _ => Arc::new(values.map(Value::as_str).collect::<StringArray>()),
        };
        (Field::new(name, array.data_type().clone(), true), array)
    });
    let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) = columns.unzip();
    Table::from_arrays(rows.len(), Schema::new(fields), arrays)
}

fn cell(array: &dyn Array, row: usize) -> Value {
    if array.is_null(row) {
        Value::Null
    } else if let Some(values) = array.as_primitive_opt::<Float64Type>() {
        values.value(row).into()
    } else if let Some(values) = array.as_primitive_opt::<Int64Type>() {
        values.value(row).into()
    } else if let Some(values) = array.as_boolean_opt() {
        values.value(row).into()
    } else {
        array.as_string::<i32>().value(row).into()
    }
}

fn is_equal(a: &Value, b: &Value) -> bool {
    match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) => (a - b).abs() <= TOLERANCE * a.abs().max(b.abs()).max(1.0),
        _ => a == b,
    }
}

/// Returns whether a query has an `order by` outside parentheses.
fn is_sorted(query: &str) -> bool {
    let mut depth = 0;
    let outside = query.chars().filter(|character| {
        match character {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        depth == 0
    });
    outside.collect::<String>().contains("order by")
}

/// Returns rows in an order that does not depend on last digits.
fn sorted(mut rows: Vec<Vec<Value>>) -> Vec<Vec<Value>> {
    rows.sort_by_cached_key(|row| {
        let cells = row.iter().map(|cell| match cell.as_f64() {
            Some(number) => format!("{number:.9e}"),
            None => cell.to_string(),
        });
        cells.collect::<Vec<_>>()
    });
    rows
}

#[test]
fn duckdb_answers_alike() {
    let reference: Value = serde_json::from_str(include_str!("sql/duckdb.json")).unwrap();
    let tables = reference["tables"].as_object().unwrap();
    let names: Vec<String> = tables.keys().cloned().collect();
    let mut wrong = Vec::new();
    for answer in reference["answers"].as_array().unwrap() {
        let query = answer["query"].as_str().unwrap();
        let sources = tables.iter().map(|(name, rows)| (name.clone(), table(rows).into()));
        let memory = ByteSize::mb(10);
        let answered = match ask(query, sources.collect(), &names, &BTreeMap::new(), memory) {
            Ok(table) => table,
            Err(error) => {
                wrong.push(format!("{query}\n    {}", chain(&error)));
                continue;
            }
        };
        let columns = answered.batch().columns();
        let row = |row| columns.iter().map(|column| cell(column, row)).collect::<Vec<_>>();
        let mut have: Vec<Vec<Value>> = (0..answered.rows()).map(row).collect();
        let expected = answer["rows"].as_array().unwrap().iter();
        let mut expected: Vec<Vec<Value>> =
            expected.map(|row| row.as_array().unwrap().clone()).collect();
        if !is_sorted(query) {
            (have, expected) = (sorted(have), sorted(expected));
        }
        let same_row = |(a, b): (&Vec<Value>, &Vec<Value>)| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_equal(a, b))
        };
        if have.len() != expected.len() || !have.iter().zip(&expected).all(same_row) {
            wrong.push(format!("{query}\n    {have:?}\n    DuckDB: {expected:?}"));
        }
    }
    assert!(wrong.is_empty(), "{} wrong answers:\n{}", wrong.len(), wrong.join("\n"));
}
