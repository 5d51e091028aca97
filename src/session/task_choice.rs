//! Choice of a task and of its loads or states by the values of columns.

use std::collections::BTreeSet;
use std::str::FromStr;

use arrow::array::{Array, AsArray};
use arrow::datatypes::{DataType, Field, Float64Type};
use arrow::util::display::array_value_to_string;

use super::formatting::{counted, listed, short};
use super::name_lookup::TaskNameError;
use super::{SessionError, UnknownName};
use asperity_manifest::decimal;
use asperity_manifest::keys::quantity::{self, Dimension, Unit};
use asperity_stages::columns::{
    BRANCH, CONTENT, FORCE, LOAD, MEAN_GAP, PRESCRIBED_DISPLACEMENT, PRESCRIBED_GAP, PRESSURE,
    STEP, SURFACE,
};
use asperity_stages::ensemble::{load_column, prescribed_length};
use asperity_stages::surface::labels::PATH;
use asperity_stages::units::{TableUnits, length_unit, pressure_unit};
use asperity_tables::column::{Role, Value};
use asperity_tables::key::TaskKey;
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
    /// Creates a condition on a column that identifies surfaces, loads or states of a path, such as
    /// `k_upper`, `realization`, `pressure` or `branch`. Numbers may have a unit: `10 MPa`.
    pub fn new(column: impl Into<String>, value: impl Into<String>) -> Coordinate {
        Coordinate { column: column.into(), value: value.into() }
    }
}

/// Error in a condition on a column.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected COLUMN=VALUE, such as `k_upper=32`")]
pub struct InvalidCoordinate;

/// Column that distinguishes the rows of a task, and its values in the chosen rows: the numbers of
/// the states of a path, or the loads in the unit of the study. `None` if the rows have no load.
pub(crate) type ChosenRows = Option<(&'static str, BTreeSet<Value>)>;

/// Load that a user chooses: a number in the unit of the study, or a mean pressure or a force with
/// a unit. A state of a path with prescribed mean gaps is chosen by its mean gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChosenLoad {
    number: f64,
    unit: Option<&'static Unit>,
    quantity: ChosenQuantity,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ChosenQuantity {
    Load,
    MeanGap,
    /// The quantity that the manifest prescribes.
    Prescribed,
    /// The quantity of this column.
    Column(&'static str),
}

impl From<f64> for ChosenLoad {
    /// Chooses a load, or a mean gap if the manifest prescribes mean gaps.
    fn from(number: f64) -> ChosenLoad {
        ChosenLoad { number, unit: None, quantity: ChosenQuantity::Prescribed }
    }
}

impl FromStr for ChosenLoad {
    type Err = InvalidLoad;

    /// Reads a load: a number, a pressure such as `10 MPa`, or a force such as `10 N`.
    fn from_str(text: &str) -> Result<ChosenLoad, InvalidLoad> {
        ChosenLoad::read(text, ChosenQuantity::Load)
    }
}

impl ChosenLoad {
    /// Reads a mean gap: a number, or a length such as `20 nm`.
    ///
    /// # Errors
    /// Returns an error if the text is not a finite number with or without a unit of length.
    pub(crate) fn mean_gap(text: &str) -> Result<ChosenLoad, InvalidLoad> {
        ChosenLoad::read(text, ChosenQuantity::MeanGap)
    }

    /// Reads the quantity that the manifest prescribes: a number, a pressure or a mean gap.
    ///
    /// # Errors
    /// Returns an error if the text is not a finite number with or without such a unit.
    pub fn prescribed(text: &str) -> Result<ChosenLoad, InvalidLoad> {
        let gap = ChosenLoad::mean_gap(text).ok().filter(|gap| gap.unit.is_some());
        let read = gap.map_or_else(|| ChosenLoad::read(text, ChosenQuantity::Load), Ok)?;
        Ok(ChosenLoad { quantity: ChosenQuantity::Prescribed, ..read })
    }

    fn read(text: &str, quantity: ChosenQuantity) -> Result<ChosenLoad, InvalidLoad> {
        let dimensions: &[Dimension] = match quantity {
            ChosenQuantity::MeanGap => &[Dimension::Length],
            ChosenQuantity::Column(name) if prescribed_length(name).is_some() => {
                &[Dimension::Length]
            }
            ChosenQuantity::Column(name) if name == FORCE.name => &[Dimension::Force],
            _ => &[Dimension::Pressure, Dimension::Force],
        };
        let dimension = dimensions[0];
        let (number, unit) = match quantity::split(text) {
            Some((number, symbol)) => {
                let unit = Unit::find(symbol).filter(|unit| dimensions.contains(&unit.dimension));
                let unknown = || InvalidLoad::Unit { symbol: symbol.to_owned(), dimension };
                (number, Some(unit.ok_or_else(unknown)?))
            }
            None => (text.trim(), None),
        };
        let finite = number.parse().ok().filter(|number: &f64| number.is_finite());
        let number = finite.ok_or(InvalidLoad::Form { dimension })?;
        Ok(ChosenLoad { number, unit, quantity })
    }

    /// Returns the column and the number of the load in the unit of the table.
    fn in_table(self, table: &Table) -> Result<(&'static str, f64), SessionError> {
        let given = load_column(table);
        match self.quantity {
            ChosenQuantity::Load if let Some(length) = prescribed_length(given) => {
                let message = format!("the manifest prescribes {length}s; use `--gap`");
                return Err(SessionError::refused(message));
            }
            ChosenQuantity::MeanGap if prescribed_length(given).is_none() => {
                return Err(SessionError::refused("the manifest prescribes loads; use `--load`"));
            }
            _ => {}
        }
        let own = match self.quantity {
            ChosenQuantity::Column(name) => name,
            _ => given,
        };
        let Some(unit) = self.unit else { return Ok((own, self.number)) };
        let column = match unit.dimension {
            Dimension::Length => own,
            Dimension::Force if table.has(FORCE.name) => FORCE.name,
            Dimension::Force => {
                let message = "the manifest gives no forces; choose a load by its pressure";
                return Err(SessionError::refused(message));
            }
            _ => PRESSURE.name,
        };
        let shown = unit_of(table, column).as_deref().and_then(Unit::find).ok_or_else(|| {
            let dimension = unit.dimension;
            SessionError::refused(format!("the study has no unit of {dimension}; omit the unit"))
        })?;
        Ok((column, self.number * unit.factor_to(shown)))
    }
}

/// Error in a load or a mean gap on the command line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidLoad {
    #[error("expected a finite number, or a {dimension} such as `10 {}`", dimension.common_unit())]
    Form { dimension: Dimension },
    #[error(
        "unknown unit `{symbol}`; units of {dimension} are {}",
        listed(dimension.names(), "and")
    )]
    Unit { symbol: String, dimension: Dimension },
}

/// Returns the elements of `rows` with the load `load`; there is at least one.
///
/// # Errors
/// Returns an error if no row has this load; the message names the next lower and higher loads.
/// Returns an error if the load has a unit, and the column of the table has no known unit, or if
/// the manifest prescribes another quantity.
pub(crate) fn rows_under(
    table: &Table,
    rows: &[usize],
    load: ChosenLoad,
) -> Result<Vec<usize>, SessionError> {
    let (column, load) = load.in_table(table)?;
    let loads = table.reals(column)?;
    let is_meant = |row: &usize| (loads.value(*row) - load).abs() <= ROUNDING * load.abs();
    let found: Vec<usize> = rows.iter().copied().filter(is_meant).collect();
    if !found.is_empty() {
        return Ok(found);
    }
    let (below, above): (Vec<f64>, Vec<f64>) =
        rows.iter().map(|&row| loads.value(row)).partition(|other| *other < load);
    let lower = below.into_iter().max_by(f64::total_cmp);
    let higher = above.into_iter().min_by(f64::total_cmp);
    let suffix = unit_of(table, column).map(|unit| format!(" {unit}")).unwrap_or_default();
    let text = |load: f64| short(load) + &suffix;
    let nearest: Vec<String> = lower.into_iter().chain(higher).map(text).collect();
    let verb = if nearest.len() == 1 { "is" } else { "are" };
    let (load, nearest) = (text(load), nearest.join(" and "));
    Err(SessionError::refused(format!(
        "no row has `{column}` = {load}; the nearest {verb} {nearest}"
    )))
}

/// Returns the unit of a column of loads; `None` for reduced loads and if it is unknown.
fn unit_of(table: &Table, column: &str) -> Option<String> {
    match column {
        _ if column == PRESSURE.name => pressure_unit(table),
        _ if prescribed_length(column).is_some() => length_unit(table),
        _ => (column == FORCE.name).then(|| "N".to_owned()),
    }
}

/// Returns the only element of `rows`, which have the same load. The rows of a task without a path
/// are equal, so the first one is returned.
///
/// # Errors
/// Returns an error if several states of a path have the load; the message names them.
pub(crate) fn only_state(table: &Table, rows: &[usize]) -> Result<usize, SessionError> {
    if rows.len() == 1 || !table.has(STEP.name) {
        return Ok(rows[0]);
    }
    let (branches, steps) = (table.texts(BRANCH.name)?, table.integers(STEP.name)?);
    let states =
        rows.iter().map(|&row| format!("\n  {} step={}", branches.value(row), steps.value(row)));
    Err(SessionError::refused(format!(
        "{} of the path match; choose one by its `step`:{}",
        counted(rows.len(), "state"),
        states.collect::<String>()
    )))
}

impl FromStr for Coordinate {
    type Err = InvalidCoordinate;

    /// Reads a condition of the form `COLUMN=VALUE`.
    fn from_str(word: &str) -> Result<Coordinate, InvalidCoordinate> {
        let (column, value) = word.split_once('=').ok_or(InvalidCoordinate)?;
        Ok(Coordinate::new(column, value))
    }
}

/// Returns the only task of `stage` that matches all `coordinates` and the load, and its rows that
/// match the coordinates.
pub(crate) fn chosen_task(
    stage: &str,
    coordinates: &[Coordinate],
    load: Option<ChosenLoad>,
    table: &Table,
) -> Result<(TaskKey, ChosenRows), SessionError> {
    let mut selected: Vec<usize> = (0..table.rows()).collect();
    for coordinate in coordinates {
        selected = coordinate.filter(table, &selected)?;
    }
    let rows = match load.filter(|_| table.has(LOAD.name)) {
        Some(load) => rows_under(table, &selected, load)?,
        None => selected.clone(),
    };
    let keys = table.texts("task")?;
    let tasks: BTreeSet<&str> = rows.iter().map(|&row| keys.value(row)).collect();
    if tasks.len() == 1 {
        let word: String = tasks.into_iter().collect();
        let own = selected.into_iter().filter(|&row| keys.value(row) == word);
        let column = if table.has(STEP.name) { STEP.name } else { load_column(table) };
        let values = table.batch().column_by_name(column);
        let chosen = values.map(|values| {
            (column, own.filter_map(|row| Value::from_array(values.as_ref(), row)).collect())
        });
        return Ok((word.parse().map_err(|_| TaskNameError::InvalidKey { word })?, chosen));
    }
    let mut columns = table.coordinates();
    if table.has(PATH.name) {
        // Files are told by their paths.
        columns = table.only(&[PATH.name]).beside(&columns.without(&[CONTENT.name]));
    }
    let fields = columns.batch().schema_ref().fields().iter().zip(columns.batch().columns());
    let is_typed = |field: &Field| {
        let name = field.name().as_str();
        // The surfaces of a spectrum are told by their realization, not by a measured slope.
        let is_measured = Role::from_field(field) == Some(Role::Surface)
            && *field.data_type() == DataType::Float64;
        // A task with adhesion has all branches of its path.
        let is_state = name == BRANCH.name && table.has(STEP.name);
        let others = [LOAD.name, PRESSURE.name, FORCE.name, SURFACE.name];
        let is_load = others.contains(&name) || prescribed_length(name).is_some();
        !is_state && !is_measured && !is_load
    };
    let choices = fields.filter(|(field, _)| is_typed(field)).filter_map(|(field, values)| {
        let values = distinct(values.as_ref(), &rows);
        (values.len() > 1).then(|| format!("\n  {}={}", field.name(), values.join(" | ")))
    });
    let differing: String = choices.collect();
    let tasks = counted(tasks.len(), "task");
    Err(SessionError::refused(format!("{tasks} of `{stage}` match; choose one by{differing}")))
}

impl Coordinate {
    /// Returns the elements of `rows` that have the required value in the column; there is at least
    /// one. States of a path may also be selected by their number.
    pub(crate) fn filter(&self, table: &Table, rows: &[usize]) -> Result<Vec<usize>, SessionError> {
        let Coordinate { column, value } = self;
        let coordinates = match column.as_str() {
            name if [STEP.name, PATH.name].contains(&name) && table.has(name) => {
                table.only(&[name])
            }
            _ => table.coordinates(),
        };
        let Some(values) = coordinates.batch().column_by_name(column) else {
            let message = format!("the table has no coordinate `{column}`");
            return Err(UnknownName::new(message, column, &coordinates.names()).into());
        };
        let loads = [LOAD, PRESSURE, FORCE, MEAN_GAP, PRESCRIBED_GAP, PRESCRIBED_DISPLACEMENT]
            .map(|column| column.name);
        if let Some(name) = loads.into_iter().find(|name| *name == column.as_str()) {
            let load = ChosenLoad::read(value, ChosenQuantity::Column(name))
                .map_err(|error| SessionError::refused(format!("`{column}`: {error}")))?;
            return rows_under(table, rows, load);
        }
        let unit = TableUnits::from_table(table).of_column(table, column);
        let wanted = match quantity::split(value) {
            Some(_) if *values.data_type() == DataType::Float64 => {
                let number = quantity::in_unit(value, unit).map_err(|(message, label)| {
                    SessionError::refused(format!("`{column}` = {value}: {message}; {label}"))
                })?;
                decimal::written(number)
            }
            _ => value.clone(),
        };
        let has = |row: &usize| is_value(values.as_ref(), *row, &wanted);
        let found: Vec<usize> = rows.iter().copied().filter(has).collect();
        if found.is_empty() {
            let there = distinct(values.as_ref(), rows).join(", ");
            let message = format!("no row has `{column}` = {value}; available: {there}");
            return Err(SessionError::refused(message));
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

/// Returns the distinct values of a column in some rows, in order of appearance.
fn distinct(values: &dyn Array, rows: &[usize]) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for &row in rows.iter().filter(|&&row| values.is_valid(row)) {
        let value = array_value_to_string(values, row).unwrap_or_default();
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}
