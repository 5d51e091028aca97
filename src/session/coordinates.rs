//! Choice of a task and of its loads by the values of columns.

use std::collections::BTreeSet;
use std::str::FromStr;

use arrow::array::{Array, AsArray};
use arrow::datatypes::{DataType, Field, Float64Type};
use arrow::util::display::array_value_to_string;

use super::words::{counted, listed, short};
use super::{SessionError, UnknownName, names};
use asperity_manifest::keys::quantity::{self, Dimension, Unit};
use asperity_stages::columns::{LOAD, PRESSURE};
use asperity_stages::ensemble::load_column;
use asperity_stages::units::pressure_unit;
use asperity_tables::column::Role;
use asperity_tables::store::key::TaskKey;
use asperity_tables::table::Table;

/// Relative tolerance between a typed number and a column, because tables show rounded numbers.
const ROUNDING: f64 = 1e-3;

/// Column and the value that a row must have in it.
#[derive(Debug, Clone)]
pub struct Coordinate {
    column: String,
    value: String,
}

impl Coordinate {
    /// Creates a condition on a column that identifies surfaces, such as `k_upper` or
    /// `realization`.
    ///
    /// # Errors
    /// Returns an error for columns of the load, which is chosen separately.
    pub fn new(
        column: impl Into<String>,
        value: impl Into<String>,
    ) -> Result<Coordinate, InvalidCoordinate> {
        let (column, value) = (column.into(), value.into());
        if [LOAD.name, PRESSURE.name].contains(&column.as_str()) {
            return Err(InvalidCoordinate::Load);
        }
        Ok(Coordinate { column, value })
    }
}

/// Error in a condition on a column.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidCoordinate {
    #[error("expected COLUMN=VALUE, such as `k_upper=32`")]
    Form,
    #[error("use `--load` to choose the load")]
    Load,
}

/// Task that was chosen, with the loads of its rows.
#[derive(Debug)]
pub struct ChosenTask {
    pub key: TaskKey,
    /// Loads in the unit of the study, or `None` if the rows have no load.
    pub loads: Option<Vec<f64>>,
}

/// Load that a user chooses: a number in the unit of the study, or a mean pressure with a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChosenLoad {
    number: f64,
    unit: Option<&'static Unit>,
}

impl From<f64> for ChosenLoad {
    fn from(number: f64) -> ChosenLoad {
        ChosenLoad { number, unit: None }
    }
}

impl FromStr for ChosenLoad {
    type Err = InvalidLoad;

    /// Reads a number, or a pressure such as `10 MPa`.
    fn from_str(text: &str) -> Result<ChosenLoad, InvalidLoad> {
        let (number, unit) = match quantity::split(text) {
            Some((number, symbol)) => {
                let unit = Unit::find(symbol);
                let unit = unit.filter(|unit| unit.dimension == Dimension::Pressure);
                (number, Some(unit.ok_or_else(|| InvalidLoad::Unit { symbol: symbol.to_owned() })?))
            }
            None => (text.trim(), None),
        };
        let number = number.parse().ok().filter(|number: &f64| number.is_finite());
        Ok(ChosenLoad { number: number.ok_or(InvalidLoad::Form)?, unit })
    }
}

/// Error in a load on the command line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidLoad {
    #[error("expected a finite number, or a pressure such as `10 MPa`")]
    Form,
    #[error("unknown unit `{symbol}`; units of pressure are {}", known())]
    Unit { symbol: String },
}

fn known() -> String {
    listed(Dimension::Pressure.names(), "and")
}

/// Returns the elements of `rows` with the load `load`; there is at least one.
///
/// # Errors
/// Returns an error if no row has this load; the message names the next lower and higher loads.
/// Returns an error if the load has a unit, and the pressures of the table have no known unit.
pub fn rows_under(
    table: &Table,
    rows: &[usize],
    load: ChosenLoad,
) -> Result<Vec<usize>, SessionError> {
    let own = pressure_unit(table);
    let (column, load) = match load.unit {
        None => (load_column(table), load.number),
        Some(unit) => {
            let own = own.as_deref().and_then(Unit::find).ok_or_else(|| {
                let message = "the manifest names no unit of pressure; give the load as a number in \
                               the unit of the study";
                SessionError::Refused(message.to_owned())
            })?;
            (PRESSURE.name, load.number * unit.factor_to(own))
        }
    };
    let loads = table.reals(column)?;
    let is_meant = |row: &usize| (loads.value(*row) - load).abs() <= ROUNDING * load.abs();
    let found: Vec<usize> = rows.iter().copied().filter(is_meant).collect();
    if !found.is_empty() {
        return Ok(found);
    }
    let (lower, higher): (Vec<f64>, Vec<f64>) =
        rows.iter().map(|&row| loads.value(row)).partition(|other| *other < load);
    let lower = lower.into_iter().max_by(f64::total_cmp);
    let higher = higher.into_iter().min_by(f64::total_cmp);
    let text = |load: f64| match own.as_deref().filter(|_| column == PRESSURE.name) {
        Some(unit) => format!("{} {unit}", load_as_typed(load)),
        None => load_as_typed(load),
    };
    let nearest: Vec<String> = lower.into_iter().chain(higher).map(text).collect();
    let requested = format!("no row has `{column}` = {}", text(load));
    Err(SessionError::Refused(match nearest.as_slice() {
        [] => "the task has no loads".to_owned(),
        [nearest] => format!("{requested}; the nearest is {nearest}"),
        [lower, higher, ..] => format!("{requested}; the nearest are {lower} and {higher}"),
    }))
}

/// Formats a load as users write it: `0.1`, `1e8`.
pub fn load_as_typed(load: f64) -> String {
    if (1e-4..1e6).contains(&load) { short(load) } else { format!("{load:e}") }
}

impl FromStr for Coordinate {
    type Err = InvalidCoordinate;

    fn from_str(word: &str) -> Result<Coordinate, InvalidCoordinate> {
        let (column, value) = word.split_once('=').ok_or(InvalidCoordinate::Form)?;
        Coordinate::new(column, value)
    }
}

/// Returns the only task of `stage` that matches all `coordinates` and the load.
pub fn chosen_task(
    stage: &str,
    coordinates: &[Coordinate],
    load: Option<ChosenLoad>,
    table: &Table,
) -> Result<ChosenTask, SessionError> {
    let mut rows: Vec<usize> = (0..table.rows()).collect();
    for coordinate in coordinates {
        rows = coordinate.filter(table, &rows)?;
    }
    if let Some(load) = load.filter(|_| table.has(LOAD.name)) {
        rows = rows_under(table, &rows, load)?;
    }
    let rows = table.pick(&rows);
    let tasks = rows.texts("task")?;
    let tasks: BTreeSet<&str> = tasks.iter().flatten().collect();
    if tasks.len() == 1 {
        let word: String = tasks.into_iter().collect();
        let loads = loads_of(table, &word)?;
        let key = word.parse().map_err(|_| names::TaskNameError::InvalidKey { word })?;
        return Ok(ChosenTask { key, loads });
    }
    let columns = rows.coordinates();
    let fields = columns.batch().schema_ref().fields().iter().zip(columns.batch().columns());
    let is_typed = |field: &Field| {
        let name = field.name().as_str();
        // The surfaces of a spectrum are told by their realization, not by a measured slope.
        let is_measured = Role::from_field(field) == Some(Role::Surface)
            && *field.data_type() == DataType::Float64;
        ![LOAD.name, PRESSURE.name, "surface"].contains(&name) && !is_measured
    };
    let differing = fields.filter(|(field, _)| is_typed(field)).filter_map(|(field, values)| {
        let name = field.name();
        let values = distinct(values.as_ref());
        (values.len() > 1).then(|| format!("\n  {name}={}", values.join(" | ")))
    });
    let differing: String = differing.collect();
    let tasks = counted(tasks.len(), "task");
    Err(SessionError::Refused(format!("{tasks} of `{stage}` match; choose one by{differing}")))
}

/// Returns the loads of the rows of a task, or `None` if the table has no loads.
fn loads_of(table: &Table, task: &str) -> Result<Option<Vec<f64>>, SessionError> {
    if !table.has(LOAD.name) {
        return Ok(None);
    }
    let tasks = table.texts("task")?.iter();
    let loads = table.reals(load_column(table))?.iter().zip(tasks);
    let of_task = loads.filter(|(_, of)| *of == Some(task));
    Ok(Some(of_task.filter_map(|(load, _)| load).collect()))
}

impl Coordinate {
    /// Returns the elements of `rows` that have the required value in the column; there is at least
    /// one.
    fn filter(&self, table: &Table, rows: &[usize]) -> Result<Vec<usize>, SessionError> {
        let Coordinate { column, value } = self;
        let coordinates = table.coordinates();
        let Some(values) = coordinates.batch().column_by_name(column) else {
            let message = format!("the table has no coordinate `{column}`");
            return Err(UnknownName::new(message, column, &coordinates.names()).into());
        };
        let has = |row: &usize| is_value(values.as_ref(), *row, value);
        let found: Vec<usize> = rows.iter().copied().filter(has).collect();
        if found.is_empty() {
            let picked = coordinates.pick(rows);
            let there = picked.batch().column_by_name(column);
            let there = there.map(|values| distinct(values.as_ref()).join(", "));
            let there = there.unwrap_or_default();
            let message = format!("no row has `{column}` = {value}; available: {there}");
            return Err(SessionError::Refused(message));
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

/// Returns the distinct values of a column in order of appearance.
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
