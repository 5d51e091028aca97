//! Points of a table, and what is known of an observable at each: of every surface under every load, or
//! a fitted parameter with its standard error.

use std::collections::BTreeMap;

use arrow::array::{Array, Float64Array};

use super::super::common_columns::SURFACES;
use super::LimitChoices;
use crate::columns::{LOAD, REALIZATION, STOP};
use crate::ensemble::{Ensemble, Member, Members, Point, ensembles, grouped};
use crate::solve::GIVEN_UP;
use asperity_statistics::limits::Observed;
use asperity_tables::column::Role;
use asperity_tables::table::{Table, TableError};

/// What is known of an observable at one point.
#[derive(Debug, Clone)]
pub enum Known {
    /// Under each load, for each surface; not a number where a surface lacks it.
    Surfaces {
        /// The surfaces.
        members: Vec<Member>,
        /// Each load with the values of the surfaces.
        states: Vec<(Option<f64>, Vec<f64>)>,
    },
    /// Under each load, an estimate.
    Estimates(Vec<(Option<f64>, Observed)>),
}

/// One point: the row that stands for it, its parameters, what is known, and loads given up.
pub type Found = (usize, Point, Known, Vec<f64>);

/// Reads the points of a table.
pub struct Reader<'a> {
    table: &'a Table,
    choices: &'a LimitChoices,
    /// The columns that expressions name, as numbers; not a number where null.
    columns: BTreeMap<&'a str, Vec<f64>>,
}

impl<'a> Reader<'a> {
    /// Looks at the columns that expressions name.
    ///
    /// # Errors
    /// When one is missing, or holds no numbers.
    pub fn new(table: &'a Table, choices: &'a LimitChoices) -> Result<Reader<'a>, TableError> {
        let terms = choices.terms.iter().map(|term| &term.of);
        let named = terms.chain([&choices.of]).flat_map(|one| one.columns());
        let columns = named.map(|name| Ok((name, numbers(table, name)?)));
        Ok(Reader { table, choices, columns: columns.collect::<Result<_, TableError>>()? })
    }

    /// Every point.
    ///
    /// # Errors
    /// When a column is missing.
    pub fn points(&self) -> Result<Vec<Found>, TableError> {
        match &self.choices.error {
            Some(error) => self.estimates(error),
            None if self.table.has(LOAD.name) => self.under_loads(),
            None => self.without_loads(),
        }
    }

    /// The small numbers of the point that a row stands for.
    pub fn small(&self, row: usize) -> Vec<f64> {
        let value = |name: &str| self.columns[name][row];
        let terms = self.choices.terms.iter();
        terms.map(|term| term.of.value(&value)).collect()
    }

    fn under_loads(&self) -> Result<Vec<Found>, TableError> {
        let stops = self.table.has(STOP.name).then(|| self.table.texts(STOP.name));
        let stops = stops.transpose()?;
        let reduced = self.table.reals(LOAD.name)?;
        let found = ensembles(self.table)?.into_iter().map(|ensemble| {
            let states = ensemble.states();
            let given_up = states
                .filter(|&(_, _, row)| stops.is_some_and(|stops| stops.value(row) == GIVEN_UP));
            let given_up = given_up.map(|(_, load, _)| load.reduced).collect();
            let known = Known::Surfaces {
                states: self.curves(&ensemble, reduced),
                members: ensemble.members,
            };
            (ensemble.first, ensemble.point, known, given_up)
        });
        Ok(found.collect())
    }

    /// The observable of every surface along the loads that it has.
    fn curves(&self, ensemble: &Ensemble, reduced: &Float64Array) -> Vec<(Option<f64>, Vec<f64>)> {
        let places = 0..ensemble.loads.len();
        let surfaces = ensemble.members.len();
        let mut states: Vec<(Option<f64>, Vec<f64>)> = ensemble
            .loads
            .iter()
            .map(|load| (Some(load.reduced), vec![f64::NAN; surfaces]))
            .collect();
        for surface in 0..surfaces {
            let own =
                places.clone().filter_map(|place| Some((place, ensemble.row(surface, place)?)));
            let (places, rows): (Vec<usize>, Vec<usize>) = own.unzip();
            let loads: Vec<f64> = rows.iter().map(|&row| reduced.value(row)).collect();
            let column = |name: &str| {
                let values = &self.columns[name];
                rows.iter().map(|&row| values[row]).collect()
            };
            let values = self.choices.of.values(&column, &loads);
            for (place, value) in places.into_iter().zip(values) {
                states[place].1[surface] = value;
            }
        }
        states
    }

    fn without_loads(&self) -> Result<Vec<Found>, TableError> {
        let parameters = self.table.in_role(Role::Parameter);
        let members = Members::of(self.table)?;
        let found = grouped(&parameters).into_iter().map(|rows| {
            let mut own: BTreeMap<Member, usize> = BTreeMap::new();
            for &row in &rows {
                own.entry(members.of_row(row)).or_insert(row);
            }
            let value = |&row: &usize| self.choices.of.value(&|name| self.columns[name][row]);
            let states = vec![(None, own.values().map(value).collect())];
            let point = Point::of_row(&parameters, rows[0]);
            let members = own.into_keys().collect();
            (rows[0], point, Known::Surfaces { members, states }, Vec::new())
        });
        Ok(found.collect())
    }

    /// Parameters that were fitted to all surfaces of a point; those of single surfaces are left out.
    fn estimates(&self, error: &str) -> Result<Vec<Found>, TableError> {
        let table = self.table;
        let errors = numbers(table, error)?;
        let surfaces = table.integers(SURFACES.name)?;
        let loads = table.has(LOAD.name).then(|| table.reals(LOAD.name)).transpose()?;
        let alone = table.has(REALIZATION.name).then(|| table.integers(REALIZATION.name));
        let alone = alone.transpose()?;
        let parameters = table.in_role(Role::Parameter);
        let found = grouped(&parameters).into_iter().map(|rows| {
            let pooled = rows.iter().filter(|&&row| alone.is_none_or(|alone| alone.is_null(row)));
            let states = pooled.filter_map(|&row| {
                let value = self.choices.of.value(&|name| self.columns[name][row]);
                let load = loads.filter(|loads| loads.is_valid(row));
                let estimate = Observed::Estimate {
                    value,
                    standard_error: errors[row],
                    surfaces: surfaces.value(row).unsigned_abs() as usize,
                };
                let is_known = value.is_finite() && errors[row].is_finite();
                is_known.then(|| (load.map(|loads| loads.value(row)), estimate))
            });
            let states = states.collect();
            let point = Point::of_row(&parameters, rows[0]);
            (rows[0], point, Known::Estimates(states), Vec::new())
        });
        Ok(found.collect())
    }
}

/// A column of numbers; not a number where null.
fn numbers(table: &Table, name: &str) -> Result<Vec<f64>, TableError> {
    if let Ok(integers) = table.integers(name) {
        let values = integers.iter();
        return Ok(values.map(|value| value.map_or(f64::NAN, |value| value as f64)).collect());
    }
    let reals = table.reals(name)?;
    Ok(reals.iter().map(|value| value.unwrap_or(f64::NAN)).collect())
}
