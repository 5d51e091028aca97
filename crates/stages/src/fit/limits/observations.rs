//! Values of an observable for every surface and load, grouped for fits.
//!
//! A point is one ensemble: rows that agree in every parameter. A group consists of points that
//! agree in every parameter except those that vary among the points of a fit.

use std::collections::{BTreeMap, BTreeSet};

use arrow::array::{Array, Float64Array};

use crate::columns::{K_LOWER, K_ROLLOFF, LOAD, REALIZATION, STOP};
use crate::ensemble::{Ensemble, Member, Members, ParameterPoint, ensembles, grouped};
use crate::fit::fitted_point::SURFACES;
use crate::fit::limits::LimitChoices;
use crate::solve::is_unconverged;
use asperity_manifest::decimal;
use asperity_statistics::Window;
use asperity_statistics::limits::{LimitPoint, Observed};
use asperity_tables::column::{Role, Value};
use asperity_tables::table::{Table, TableError};

/// Points that are fitted together, with their common parameters.
#[derive(Debug, Clone)]
pub struct ObservedGroup {
    /// Index of the table row from which the common parameters of the points are copied.
    pub row: usize,
    /// Common ratio k_rolloff/k_lower of the points, if `k_lower` varies and `k_rolloff` is not
    /// among the varied parameters.
    pub rolloff_ratio: Option<f64>,
    /// Loads at which the group is fitted, or a single `None` if rows have no loads.
    pub loads: Vec<Option<f64>>,
    points: Vec<Observations>,
    /// Surfaces that occur at one or more points.
    members: BTreeSet<Member>,
}

/// Values of the observable at one point.
#[derive(Debug, Clone)]
struct Observations {
    /// Parameters that vary among the points of a fit.
    varied: ParameterPoint,
    /// Value of the small parameter of each term.
    small: Vec<f64>,
    values: Values,
    /// Loads at which the solver did not converge, with one entry for each affected surface.
    unconverged_loads: Vec<f64>,
}

impl ObservedGroup {
    /// Returns the points at which the observable is known for all surfaces under a load. A mean
    /// over some surfaces would belong to another ensemble.
    pub fn points_under(&self, load: Option<f64>) -> Vec<LimitPoint> {
        let points = self.points.iter();
        let members = &self.members();
        points.filter_map(|point| point.under(load, members)).collect()
    }

    /// Returns the points of [`ObservedGroup::points_under`], each with its varied parameters.
    pub fn points_with_parameters(&self, load: Option<f64>) -> Vec<(ParameterPoint, LimitPoint)> {
        let points = self.points.iter();
        let members = &self.members();
        let with_parameters =
            |point: &Observations| Some((point.varied.clone(), point.under(load, members)?));
        points.filter_map(with_parameters).collect()
    }

    /// Returns the surfaces in ascending order. The index of a surface in this list identifies it
    /// at all points.
    fn members(&self) -> Vec<Member> {
        self.members.iter().copied().collect()
    }

    /// Returns the number of rows at a load for which the solver did not converge.
    pub fn unconverged(&self, load: Option<f64>) -> usize {
        let loads = self.points.iter().flat_map(|point| &point.unconverged_loads);
        let here = loads.filter(|other| load.is_none_or(|load| decimal::is_same(load, **other)));
        here.count()
    }
}

impl Observations {
    fn under(&self, load: Option<f64>, numbered: &[Member]) -> Option<LimitPoint> {
        let is_here = |other: Option<f64>| match (load, other) {
            (Some(load), Some(other)) => decimal::is_same(load, other),
            (None, None) => true,
            _ => false,
        };
        let observed = match &self.values {
            Values::Surfaces { members, states } => {
                let (_, values) = states.iter().find(|(other, _)| is_here(*other))?;
                let is_complete = values.iter().all(|value| value.is_finite());
                let number = |member| numbered.partition_point(|other| other < member);
                is_complete.then(|| Observed::Surfaces {
                    units: members.iter().map(number).collect(),
                    values: values.clone(),
                })?
            }
            Values::Estimates(states) => {
                let (_, estimate) = states.iter().find(|(other, _)| is_here(*other))?;
                estimate.clone()
            }
        };
        Some(LimitPoint { small: self.small.clone(), observed })
    }

    fn loads(&self) -> Vec<Option<f64>> {
        match &self.values {
            Values::Surfaces { states, .. } => states.iter().map(|(load, _)| *load).collect(),
            Values::Estimates(states) => states.iter().map(|(load, _)| *load).collect(),
        }
    }
}

/// Returns the groups of a table, in the order of the first row of each group.
///
/// # Errors
/// Returns an error if a column is missing.
pub fn groups(
    table: &Table,
    choices: &LimitChoices,
    window: Window,
) -> Result<Vec<ObservedGroup>, TableError> {
    let reader = Reader::new(table, choices)?;
    let mut order: Vec<(ParameterPoint, Option<Value>)> = Vec::new();
    let mut groups: Vec<ObservedGroup> = Vec::new();
    for (row, point, values, unconverged_loads) in reader.points()? {
        let over: Vec<&str> = choices.over.iter().map(String::as_str).collect();
        let mut shared = point.clone().without(&over);
        let ratio = rolloff_ratio(&point, choices);
        if ratio.is_some() {
            shared = shared.without(&[K_ROLLOFF.name]);
        }
        let key = (shared, ratio.map(Value::Real));
        let known = order.iter().position(|other| *other == key);
        let index = known.unwrap_or_else(|| {
            order.push(key);
            groups.push(ObservedGroup {
                row,
                rolloff_ratio: ratio,
                loads: Vec::new(),
                points: Vec::new(),
                members: BTreeSet::new(),
            });
            groups.len() - 1
        });
        if let Values::Surfaces { members, .. } = &values {
            groups[index].members.extend(members);
        }
        groups[index].points.push(Observations {
            varied: point.only(&over),
            small: reader.small(row),
            values,
            unconverged_loads,
        });
    }
    for group in &mut groups {
        group.loads = loads(&group.points, choices, window);
    }
    Ok(groups)
}

/// Returns k_rolloff/k_lower of a point, or `None` if `k_lower` does not vary or `k_rolloff` is
/// among the varied parameters.
fn rolloff_ratio(point: &ParameterPoint, choices: &LimitChoices) -> Option<f64> {
    let varies = |name: &str| choices.over.contains(name);
    if !varies(K_LOWER.name) || varies(K_ROLLOFF.name) {
        return None;
    }
    let number = |name: &str| point.get(name).and_then(Value::number);
    Some(decimal::nearest(number(K_ROLLOFF.name)? / number(K_LOWER.name)?))
}

fn loads(points: &[Observations], choices: &LimitChoices, window: Window) -> Vec<Option<f64>> {
    let mut all: Vec<f64> = points.iter().flat_map(Observations::loads).flatten().collect();
    if all.is_empty() {
        return vec![None];
    }
    if !choices.loads.is_empty() {
        return choices.loads.iter().copied().map(Some).collect();
    }
    all.retain(|&load| window.contains(load));
    all.sort_by(f64::total_cmp);
    all.dedup_by(|next, kept| decimal::is_same(*next, *kept));
    all.into_iter().map(Some).collect()
}

/// Values of an observable under each load of one point.
#[derive(Debug, Clone)]
enum Values {
    /// Values of the single surfaces; NaN for a surface without a row at the load.
    Surfaces {
        members: Vec<Member>,
        /// Each load with the values of all surfaces, in the order of `members`.
        states: Vec<(Option<f64>, Vec<f64>)>,
    },
    /// Estimates from fits to all surfaces.
    Estimates(Vec<(Option<f64>, Observed)>),
}

/// Data of a single point: (index of the first table row, parameters, values, loads at which the
/// solver did not converge).
type Found = (usize, ParameterPoint, Values, Vec<f64>);

/// Reader of the points of a table.
struct Reader<'a> {
    table: &'a Table,
    choices: &'a LimitChoices,
    /// Values of the columns that occur in expressions, with NaN for null.
    columns: BTreeMap<&'a str, Vec<f64>>,
}

impl<'a> Reader<'a> {
    /// Reads the columns that occur in expressions.
    ///
    /// # Errors
    /// Returns an error if a column is missing or holds no numbers.
    fn new(table: &'a Table, choices: &'a LimitChoices) -> Result<Reader<'a>, TableError> {
        let terms = choices.terms.iter().map(|term| &term.of);
        let named = terms.chain([&choices.of]).flat_map(|one| one.columns());
        let columns = named.map(|name| Ok((name, numbers(table, name)?)));
        Ok(Reader { table, choices, columns: columns.collect::<Result<_, TableError>>()? })
    }

    /// Reads all points of the table.
    ///
    /// # Errors
    /// Returns an error if a column is missing.
    fn points(&self) -> Result<Vec<Found>, TableError> {
        match &self.choices.error {
            Some(error) => self.estimates(error),
            None if self.table.has(LOAD.name) => self.under_loads(),
            None => self.without_loads(),
        }
    }

    /// Computes the small parameters from the parameters of a row.
    fn small(&self, row: usize) -> Vec<f64> {
        let value = |name: &str| self.columns[name][row];
        let terms = self.choices.terms.iter();
        terms.map(|term| term.of.value(&value)).collect()
    }

    fn under_loads(&self) -> Result<Vec<Found>, TableError> {
        let stops = self.table.optional(STOP.name, Table::texts)?;
        let reduced = self.table.reals(LOAD.name)?;
        let found = ensembles(self.table)?.into_iter().map(|ensemble| {
            let states = ensemble.states();
            let unconverged = states
                .filter(|&(_, _, row)| stops.is_some_and(|stops| is_unconverged(stops.value(row))));
            let unconverged_loads = unconverged.map(|(_, load, _)| load.reduced).collect();
            let values = Values::Surfaces {
                states: self.curves(&ensemble, reduced),
                members: ensemble.members,
            };
            (ensemble.first, ensemble.point, values, unconverged_loads)
        });
        Ok(found.collect())
    }

    /// Returns each load of the ensemble with the observable of all surfaces, in the order of the
    /// members; NaN for a surface without a row at the load.
    fn curves(&self, ensemble: &Ensemble, reduced: &Float64Array) -> Vec<(Option<f64>, Vec<f64>)> {
        let surfaces = ensemble.members.len();
        let mut states: Vec<(Option<f64>, Vec<f64>)> = ensemble
            .loads
            .iter()
            .map(|load| (Some(load.reduced), vec![f64::NAN; surfaces]))
            .collect();
        for surface in 0..surfaces {
            let own = (0..ensemble.loads.len())
                .filter_map(|load| Some((load, ensemble.row(surface, load)?)));
            let (indices, rows): (Vec<usize>, Vec<usize>) = own.unzip();
            let loads: Vec<f64> = rows.iter().map(|&row| reduced.value(row)).collect();
            let column = |name: &str| {
                let values = &self.columns[name];
                rows.iter().map(|&row| values[row]).collect()
            };
            let values = self.choices.of.values(&column, &loads);
            for (load, value) in indices.into_iter().zip(values) {
                states[load].1[surface] = value;
            }
        }
        states
    }

    fn without_loads(&self) -> Result<Vec<Found>, TableError> {
        let parameters = self.table.in_role(Role::Parameter);
        let members = Members::new(self.table)?;
        let found = grouped(&parameters).into_iter().map(|rows| {
            let mut own: BTreeMap<Member, usize> = BTreeMap::new();
            for &row in &rows {
                own.entry(members.of_row(row)).or_insert(row);
            }
            let value = |&row: &usize| self.choices.of.value(&|name| self.columns[name][row]);
            let states = vec![(None, own.values().map(value).collect())];
            let point = ParameterPoint::from_row(&parameters, rows[0]);
            let members = own.into_keys().collect();
            (rows[0], point, Values::Surfaces { members, states }, Vec::new())
        });
        Ok(found.collect())
    }

    /// Reads parameters that were fitted to all surfaces of a point. Fits to single surfaces are
    /// left out.
    fn estimates(&self, error: &str) -> Result<Vec<Found>, TableError> {
        let table = self.table;
        let errors = numbers(table, error)?;
        let surfaces = table.integers(SURFACES.name)?;
        let loads = table.optional(LOAD.name, Table::reals)?;
        let alone = table.optional(REALIZATION.name, Table::integers)?;
        let parameters = table.in_role(Role::Parameter);
        let found = grouped(&parameters).into_iter().map(|rows| {
            let pooled = rows.iter().filter(|&&row| alone.is_none_or(|alone| alone.is_null(row)));
            let estimates = pooled.filter_map(|&row| {
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
            let states = estimates.collect();
            let point = ParameterPoint::from_row(&parameters, rows[0]);
            (rows[0], point, Values::Estimates(states), Vec::new())
        });
        Ok(found.collect())
    }
}

/// Returns a column of numbers with NaN for null.
fn numbers(table: &Table, name: &str) -> Result<Vec<f64>, TableError> {
    if let Ok(integers) = table.integers(name) {
        let values = integers.iter();
        return Ok(values.map(|value| value.map_or(f64::NAN, |value| value as f64)).collect());
    }
    let reals = table.reals(name)?;
    Ok(reals.iter().map(|value| value.unwrap_or(f64::NAN)).collect())
}
