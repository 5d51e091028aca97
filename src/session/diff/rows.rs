//! Matching of the rows of two tables by parameter point, surface and load.
//!
//! The roles of the columns identify the rows, as in [`ensemble`](asperity_stages::ensemble). A
//! surface is identified by its seed and realization. Random numbers depend on nothing else, so two
//! rows with the same seed and realization belong to the same surface, or to surfaces with the same
//! random numbers if a parameter of the surfaces differs.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use arrow::array::{Array, Float64Array};
use serde::Serialize;

use asperity_manifest::decimal::nearest;
use asperity_manifest::keys::quantity;
use asperity_stages::columns::{LOAD, PRESSURE};
use asperity_stages::ensemble::{Member, Members, ParameterPoint, grouped, load_column};
use asperity_stages::units::TableUnits;
use asperity_tables::column::{Role, Value};
use asperity_tables::table::{Table, TableError};

/// Maximum number of points, surfaces or loads that are named.
const MAX_NAMED: usize = 3;

/// Rows of two tables A and B that agree in the parameter point and the load, by surface.
#[derive(Debug)]
pub(crate) struct RowGroup {
    pub(crate) point: ParameterPoint,
    /// Load in the unit of the manifest; `None` if the tables have no loads.
    pub(crate) load: Option<f64>,
    /// Number of the row, from 1, among rows that no column distinguishes.
    pub(crate) repetition: usize,
    /// Index of the row of each surface in A and in B.
    pub(crate) rows: [BTreeMap<Member, usize>; 2],
}

/// Result of matching two tables.
#[derive(Debug)]
pub(crate) struct MatchedRows {
    pub(crate) groups: Vec<RowGroup>,
    pub(crate) rows: RowMatches,
}

/// Numbers of rows that two tables A and B share, and that only one of them has.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct RowMatches {
    /// Number of rows that both tables have.
    pub common: usize,
    pub only_in_a: UnmatchedRows,
    pub only_in_b: UnmatchedRows,
    /// Parameters that differ between the tables and are therefore not used for matching.
    pub across: Vec<String>,
    /// Parameters that distinguish the points.
    pub varying: Vec<String>,
    pub load_column: &'static str,
    /// Smallest and largest load of A and of B, if no load is in both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub disjoint_loads: Option<[[f64; 2]; 2]>,
}

/// Rows that only one of two tables has.
#[derive(Debug, Default, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct UnmatchedRows {
    pub rows: usize,
    /// Rows at parameter points that the other table lacks.
    pub points: Lacking,
    /// Rows of surfaces that the other table lacks at the same point.
    pub surfaces: Lacking,
    /// Rows at loads that the other table lacks for the same surface.
    pub loads: Lacking,
}

/// Rows whose point, surface or load the other table lacks.
#[derive(Debug, Default, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Lacking {
    pub rows: usize,
    /// The first points, surfaces or loads.
    pub first: Vec<String>,
    /// True if there are others than the first.
    pub more: bool,
}

impl Lacking {
    fn add(&mut self, name: impl FnOnce() -> String) {
        self.rows += 1;
        if self.more {
            return;
        }
        let name = name();
        if !self.first.contains(&name) {
            self.more = self.first.len() == MAX_NAMED;
            self.first.extend((!self.more).then_some(name));
        }
    }
}

impl MatchedRows {
    /// Matches the rows of two tables.
    ///
    /// # Errors
    /// Returns an error if seeds, realizations or loads are not numbers.
    pub(crate) fn new(a: &Table, b: &Table) -> Result<MatchedRows, TableError> {
        let [in_a, in_b] = [a, b].map(load_column);
        // If one table is given in pascals and the other is not, reduced loads are comparable.
        let load_column = if in_a == in_b { in_a } else { LOAD.name };
        let points = [a, b].map(points_of);
        let across = changed_parameters(&points[0], &points[1]);
        let names: Vec<&str> = across.iter().map(String::as_str).collect();
        let mut matching = Matching::default();
        for (side, (table, points)) in [a, b].into_iter().zip(points).enumerate() {
            let reduced = points.into_iter().map(|(point, rows)| (point.without(&names), rows));
            matching.add(side, table, load_column, reduced)?;
        }
        let varying = matching.varying();
        let units = [a, b].map(|table| {
            let TableUnits { length, pressure } = TableUnits::from_table(table);
            match load_column {
                name if name == LOAD.name => None,
                name if name == PRESSURE.name => pressure,
                _ => length,
            }
        });
        let (common, [only_in_a, only_in_b]) = matching.counts(load_column, &units, &varying);
        let disjoint_loads = disjoint_loads(&matching.groups);
        let rows = RowMatches {
            common,
            only_in_a,
            only_in_b,
            across,
            varying,
            load_column,
            disjoint_loads,
        };
        Ok(MatchedRows { groups: matching.groups, rows })
    }
}

/// Returns the smallest and the largest load of both tables, if they have loads and no load is in
/// both.
fn disjoint_loads(groups: &[RowGroup]) -> Option<[[f64; 2]; 2]> {
    let loads = |side: usize| -> Vec<f64> {
        let own = groups.iter().filter(|group| !group.rows[side].is_empty());
        own.filter_map(|group| group.load).collect()
    };
    let loads = [loads(0), loads(1)];
    let is_common = loads[0].iter().any(|load| loads[1].contains(load));
    let ends = |loads: &[f64]| {
        let least = loads.iter().copied().reduce(f64::min)?;
        Some([least, loads.iter().copied().fold(least, f64::max)])
    };
    if is_common { None } else { Some([ends(&loads[0])?, ends(&loads[1])?]) }
}

/// Parameter points of a table with the indices of their rows.
type Points = Vec<(ParameterPoint, Vec<usize>)>;

fn points_of(table: &Table) -> Points {
    let parameters = table.in_role(Role::Parameter);
    let rounded = |_: &str, value: &Value| match value {
        Value::Real(value) => Value::Real(nearest(*value)),
        other => other.clone(),
    };
    let groups = grouped(&parameters).into_iter();
    groups.map(|rows| (ParameterPoint::from_row(&parameters, rows[0]).map(rounded), rows)).collect()
}

/// Returns the parameters that were changed between two tables, such as a tolerance. The other
/// parameters must still distinguish the points of each table.
///
/// A parameter is changed if no value is in both tables. If no point is in both tables, so is the
/// parameter without which most points are, such as a mesh that follows another parameter.
fn changed_parameters(a: &Points, b: &Points) -> Vec<String> {
    let names: BTreeSet<&str> =
        a.iter().chain(b).flat_map(|(point, _)| point.iter()).map(|(name, _)| name).collect();
    let values = |points: &Points, name: &str| -> BTreeSet<Option<Value>> {
        points.iter().map(|(point, _)| point.get(name).cloned()).collect()
    };
    // Points without some parameters, or `None` if these parameters distinguish points.
    let distinct = |points: &Points, without: &[&str]| {
        let left: BTreeSet<ParameterPoint> =
            points.iter().map(|(point, _)| point.clone().without(without)).collect();
        (left.len() == points.len()).then_some(left)
    };
    let common = |without: &[&str]| {
        let (a, b) = (distinct(a, without)?, distinct(b, without)?);
        Some(a.intersection(&b).count())
    };
    let is_disjoint = |name: &&str| values(a, name).is_disjoint(&values(b, name));
    let is_constant = |name: &&str| values(a, name).len() == 1 && values(b, name).len() == 1;
    let mut changed: Vec<&str> = names.iter().copied().filter(is_disjoint).collect();
    if common(&changed).is_none() {
        changed.retain(is_constant);
    }
    if common(&changed) == Some(0) {
        let others = names.iter().copied().filter(|name| !changed.contains(name));
        let candidates = others.filter_map(|name| {
            let points = common(&[&changed[..], &[name]].concat())?;
            (points > 0).then_some((points, name))
        });
        // Of several, take the last in alphabetical order: `nodes` and not `k_upper`.
        let best = candidates.max_by_key(|(points, _)| *points);
        changed.extend(best.map(|(_, name)| name));
    }
    changed.into_iter().map(str::to_owned).collect()
}

/// Bits of a rounded load, or `None` without a load.
type LoadKey = Option<u64>;

/// Groups of rows, and the points, surfaces and loads of each table.
#[derive(Default)]
struct Matching {
    groups: Vec<RowGroup>,
    points: BTreeMap<ParameterPoint, usize>,
    /// Index of the group of a point, load and repetition.
    index: HashMap<(usize, LoadKey, usize), usize>,
    known_points: [HashSet<usize>; 2],
    known_surfaces: [HashSet<(usize, Member)>; 2],
}

impl Matching {
    fn add(
        &mut self,
        side: usize,
        table: &Table,
        load_column: &str,
        points: impl Iterator<Item = (ParameterPoint, Vec<usize>)>,
    ) -> Result<(), TableError> {
        let members = Members::new(table)?;
        let loads = table.optional(load_column, Table::reals)?;
        let load =
            |loads: &Float64Array, row| loads.is_valid(row).then(|| nearest(loads.value(row)));
        for (point, rows) in points {
            let next = self.points.len();
            let number = *self.points.entry(point.clone()).or_insert(next);
            self.known_points[side].insert(number);
            let mut repetitions: HashMap<(LoadKey, Member), usize> = HashMap::new();
            for row in rows {
                let member = members.of_row(row);
                self.known_surfaces[side].insert((number, member));
                let load = loads.and_then(|loads| load(loads, row));
                let key = load.map(f64::to_bits);
                let repetition = repetitions.entry((key, member)).or_default();
                *repetition += 1;
                let next = self.groups.len();
                let group = *self.index.entry((number, key, *repetition)).or_insert(next);
                if group == next {
                    let (point, repetition) = (point.clone(), *repetition);
                    self.groups.push(RowGroup {
                        point,
                        load,
                        repetition,
                        rows: Default::default(),
                    });
                }
                self.groups[group].rows[side].insert(member, row);
            }
        }
        Ok(())
    }

    /// Returns the parameters that distinguish the points. Of several parameters that change
    /// together, such as a correction and its coefficient, only one is returned.
    fn varying(&self) -> Vec<String> {
        let mut names = BTreeSet::new();
        for (name, value) in self.points.keys().flat_map(ParameterPoint::iter) {
            names.insert((!matches!(value, Value::Text(_)), name));
        }
        // For each parameter, the number of its value at each point, in the order of appearance.
        let mut known = BTreeSet::new();
        let mut varying = Vec::new();
        for (_, name) in names {
            let mut numbers = BTreeMap::new();
            let numbered = self.points.keys().map(|point| {
                let next = numbers.len();
                *numbers.entry(point.get(name)).or_insert(next)
            });
            let values: Vec<usize> = numbered.collect();
            if numbers.len() > 1 && known.insert(values) {
                varying.push(name.to_owned());
            }
        }
        varying
    }

    /// Counts the rows that both tables have, and those that only one has. `units` are those of the
    /// loads of each table, and `varying` are the parameters by which points are named.
    fn counts(
        &self,
        load_column: &str,
        units: &[Option<String>; 2],
        varying: &[String],
    ) -> (usize, [UnmatchedRows; 2]) {
        let names: Vec<&str> = varying.iter().map(String::as_str).collect();
        let mut only = [UnmatchedRows::default(), UnmatchedRows::default()];
        let mut common = 0;
        for group in &self.groups {
            let [a, b] = &group.rows;
            common += a.keys().filter(|member| b.contains_key(member)).count();
            let point = self.points[&group.point];
            for (side, (own, other)) in [(a, b), (b, a)].into_iter().enumerate() {
                let (lacking, beyond) = (&mut only[side], 1 - side);
                for &member in own.keys().filter(|member| !other.contains_key(member)) {
                    lacking.rows += 1;
                    if !self.known_points[beyond].contains(&point) {
                        lacking.points.add(|| group.point.clone().only(&names).to_string());
                    } else if !self.known_surfaces[beyond].contains(&(point, member)) {
                        lacking.surfaces.add(|| surface(member));
                    } else {
                        lacking.loads.add(|| group.position(load_column, units[side].as_deref()));
                    }
                }
            }
        }
        (common, only)
    }
}

impl RowGroup {
    /// Describes the load and the number of the row, as in `pressure 10 MPa`.
    fn position(&self, load_column: &str, unit: Option<&str>) -> String {
        let number = |load: f64| quantity::written(load, unit);
        let load = self.load.map(|load| format!("{load_column} {}", number(load)));
        let row = (self.repetition > 1).then(|| format!("row {}", self.repetition));
        load.into_iter().chain(row).collect::<Vec<_>>().join(", ")
    }

    /// Returns the pairs of rows of the same surface.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        let [a, b] = &self.rows;
        a.iter().filter_map(|(member, &row)| Some((row, *b.get(member)?)))
    }
}

fn surface(member: Member) -> String {
    match member {
        Member::Sole => "the only surface".to_owned(),
        Member::Drawn { seed, realization } => format!("seed {seed}, realization {realization}"),
        Member::Sample(hash) => format!("sample {hash:016x}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_stages::columns::{HURST, REALIZATION, SEED, TOLERANCE};
    use asperity_tables::column::{integers, reals};

    /// Returns a table with a row for each Hurst exponent, tolerance, realization and load.
    fn table(rows: &[(f64, f64, i64, f64)]) -> Table {
        Table::new(
            rows.len(),
            vec![
                (HURST, reals(rows.iter().map(|row| row.0))),
                (TOLERANCE, reals(rows.iter().map(|row| row.1))),
                (SEED, integers(rows.iter().map(|_| 7))),
                (REALIZATION, integers(rows.iter().map(|row| row.2))),
                (LOAD, reals(rows.iter().map(|row| row.3))),
            ],
        )
    }

    #[test]
    fn rows_of_one_table_are_sorted_by_what_the_other_lacks() {
        let a = table(&[(0.3, 0.1, 0, 0.01), (0.8, 0.1, 0, 0.01)]);
        let b = table(&[
            (0.8, 0.1, 0, 0.010000000000000002),
            (0.8, 0.1, 0, 0.02),
            (0.8, 0.1, 1, 0.01),
            (0.8, 0.1, 1, 0.02),
        ]);
        let matched = MatchedRows::new(&a, &b).unwrap();
        assert_eq!(matched.rows.common, 1);
        let [only_a, only_b] = [matched.rows.only_in_a, matched.rows.only_in_b];
        assert_eq!((only_a.rows, only_a.points.rows), (1, 1));
        assert_eq!(only_a.points.first, ["hurst 0.3"]);
        assert_eq!((only_b.rows, only_b.surfaces.rows, only_b.loads.rows), (3, 2, 1));
        assert_eq!(only_b.surfaces.first, ["seed 7, realization 1"]);
        assert_eq!(only_b.loads.first, ["load 0.02"]);
    }

    #[test]
    fn the_ranges_of_loads_are_known_if_no_load_is_in_both_tables() {
        let a = table(&[(0.3, 0.1, 0, 0.01), (0.3, 0.1, 0, 0.03)]);
        let b = table(&[(0.3, 0.1, 0, 0.02)]);
        let matched = MatchedRows::new(&a, &b).unwrap();
        assert_eq!(matched.rows.disjoint_loads, Some([[0.01, 0.03], [0.02, 0.02]]));
        assert_eq!(MatchedRows::new(&a, &a).unwrap().rows.disjoint_loads, None);
    }

    #[test]
    fn a_changed_parameter_does_not_prevent_a_match() {
        let a = table(&[(0.3, 0.1, 0, 0.01), (0.8, 0.1, 0, 0.01)]);
        let b = table(&[(0.3, 0.2, 0, 0.01), (0.8, 0.2, 0, 0.01)]);
        let matched = MatchedRows::new(&a, &b).unwrap();
        assert_eq!((matched.rows.common, matched.rows.across), (2, vec!["tolerance".to_owned()]));
        // Without the exponent, the two points of A would be one point.
        let b = table(&[(0.5, 0.2, 0, 0.01)]);
        let matched = MatchedRows::new(&a, &b).unwrap();
        assert_eq!((matched.rows.common, matched.rows.across), (0, vec!["tolerance".to_owned()]));
    }

    #[test]
    fn a_parameter_that_follows_another_one_does_not_prevent_a_match() {
        // The tolerance is twice and four times the exponent.
        let a = table(&[(0.2, 0.4, 0, 0.01), (0.4, 0.8, 0, 0.01), (0.8, 1.6, 0, 0.01)]);
        let b = table(&[(0.2, 0.8, 0, 0.01), (0.4, 1.6, 0, 0.01), (0.8, 3.2, 0, 0.01)]);
        let matched = MatchedRows::new(&a, &b).unwrap();
        assert_eq!((matched.rows.common, matched.rows.across), (3, vec!["tolerance".to_owned()]));
    }

    #[test]
    fn rows_that_no_column_distinguishes_are_matched_in_their_order() {
        let [a, b] = [2, 3].map(|rows| table(&vec![(0.3, 0.1, 0, 0.01); rows]));
        let matched = MatchedRows::new(&a, &b).unwrap();
        assert_eq!((matched.rows.common, matched.rows.only_in_b.rows), (2, 1));
        assert_eq!(matched.rows.only_in_b.loads.first, ["load 0.01, row 3"]);
        let pairs: Vec<_> = matched.groups.iter().flat_map(RowGroup::pairs).collect();
        assert_eq!(pairs, [(0, 0), (1, 1)]);
    }
}
