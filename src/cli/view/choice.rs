//! Which of a stage's tasks is meant, by the coordinates of its rows.

use std::collections::BTreeSet;
use std::str::FromStr;

use arrow::array::{Array, AsArray};
use arrow::datatypes::{DataType, Float64Type};
use arrow::util::display::array_value_to_string;

use super::loads::{ROUNDING, rows_under};
use crate::cli::{Failure, Misused, counted, unknown};
use asperity_stages::columns::{LOAD, PRESSURE};
use asperity_tables::store::key::TaskKey;
use asperity_tables::table::Table;

/// A column and the value that it must have.
#[derive(Debug, Clone)]
pub struct Coordinate {
    column: String,
    value: String,
}

impl FromStr for Coordinate {
    type Err = String;

    fn from_str(word: &str) -> Result<Coordinate, String> {
        let (column, value) = word
            .split_once('=')
            .ok_or("a coordinate is a column and its value, as in `k_upper=32`")?;
        if [LOAD.name, PRESSURE.name].contains(&column) {
            return Err("`--load` says which load to draw".to_owned());
        }
        Ok(Coordinate { column: column.to_owned(), value: value.to_owned() })
    }
}

/// What is known of a task.
pub struct TaskChoice<'a> {
    pub stage: &'a str,
    pub coordinates: &'a [Coordinate],
    /// The load of the task, in the unit of the study.
    pub load: Option<f64>,
}

impl TaskChoice<'_> {
    /// The one task that computed such rows.
    pub fn task(&self, table: &Table) -> Result<TaskKey, Failure> {
        let mut rows: Vec<usize> = (0..table.rows()).collect();
        for coordinate in self.coordinates {
            rows = coordinate.among(table, &rows)?;
        }
        if let Some(load) = self.load.filter(|_| table.has(LOAD.name)) {
            rows = rows_under(table, &rows, load)?;
        }
        let rows = table.pick(&rows);
        let tasks = rows.texts("task")?;
        let tasks: BTreeSet<&str> = tasks.iter().flatten().collect();
        match tasks.len() {
            1 => Ok(tasks.into_iter().collect::<String>().parse()?),
            number => Err(self.ambiguous(number, &rows)),
        }
    }

    fn ambiguous(&self, tasks: usize, rows: &Table) -> Failure {
        let columns = rows.coordinates();
        let columns = columns.names().into_iter().zip(columns.batch().columns());
        let differing = columns
            .filter(|(name, _)| ![LOAD.name, PRESSURE.name, "surface"].contains(name))
            .filter_map(|(name, values)| {
                let values = distinct(values.as_ref());
                (values.len() > 1).then(|| format!("\n  {name}={}", values.join(" | ")))
            });
        let differing: String = differing.collect();
        let stage = self.stage;
        let tasks = counted(tasks, "task");
        Misused(format!("{tasks} of `{stage}` are meant; say which by{differing}")).into()
    }
}

impl Coordinate {
    /// Those of the rows that have the value; at least one.
    fn among(&self, table: &Table, rows: &[usize]) -> Result<Vec<usize>, Failure> {
        let Coordinate { column, value } = self;
        let coordinates = table.coordinates();
        let Some(values) = coordinates.batch().column_by_name(column) else {
            let message = format!("the table has no coordinate `{column}`");
            return Err(unknown(message, column, &coordinates.names()));
        };
        let has = |row: &usize| is_value(values.as_ref(), *row, value);
        let found: Vec<usize> = rows.iter().copied().filter(has).collect();
        if found.is_empty() {
            let picked = coordinates.pick(rows);
            let there = picked.batch().column_by_name(column);
            let there = there.map(|values| distinct(values.as_ref()).join(", "));
            let there = there.unwrap_or_default();
            let message = format!("no row has `{column}` = {value}; there is {there}");
            return Err(Misused(message).into());
        }
        Ok(found)
    }
}

fn is_value(values: &dyn Array, row: usize, wanted: &str) -> bool {
    if values.is_null(row) {
        return false;
    }
    match (values.data_type(), wanted.parse::<f64>()) {
        (DataType::Float64, Ok(wanted)) => {
            let value = values.as_primitive::<Float64Type>().value(row);
            (value - wanted).abs() <= ROUNDING * wanted.abs()
        }
        _ => array_value_to_string(values, row).is_ok_and(|value| value == wanted),
    }
}

/// The values of a column, each once, in order of appearance.
fn distinct(values: &dyn Array) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for row in (0..values.len()).filter(|&row| values.is_valid(row)) {
        let value = array_value_to_string(values, row).unwrap_or_default();
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}
