//! Rows of many surfaces and loads, sorted into the curves of parameter points.

use std::collections::BTreeMap;

use arrow::util::display::array_value_to_string;

use crate::fitting::FitError;
use crate::fitting::curves::Curves;
use crate::stages::columns::{
    AREA_CORRECTED, AREA_FRACTION, CORRECTION, LOAD, PRESSURE, REALIZATION, SEED, STOP, SURFACE,
};
use crate::store::table::{Table, TableError};

/// What tells rows of one parameter point apart.
pub const WITHIN_A_POINT: [&str; 5] = [
    SURFACE.name,
    SEED.name,
    REALIZATION.name,
    LOAD.name,
    PRESSURE.name,
];

/// The curves of all surfaces of one parameter point, under one correction.
pub struct Point {
    /// A row of the table that stands for the point's coordinates.
    pub row: usize,
    /// The estimator of the area, if any was applied.
    pub correction: Option<String>,
    /// How many surfaces it pools.
    pub surfaces: usize,
    /// Rows whose load did not converge.
    pub unconverged: usize,
    /// Areas, or what is fitted in their place, at the loads that all surfaces reached; an error if
    /// there are none.
    pub curves: Result<Curves, FitError>,
}

impl Point {
    /// Every point of a table, in the order of its first row: areas, corrected where they are.
    ///
    /// # Errors
    /// When a column is missing.
    pub fn all(table: &Table) -> Result<Vec<Point>, TableError> {
        let area = match table.has(CORRECTION.name) {
            true => AREA_CORRECTED,
            false => AREA_FRACTION,
        };
        Point::all_of(table, area.name)
    }

    /// The same with the curves of any column of numbers.
    ///
    /// # Errors
    /// When a column is missing.
    pub fn all_of(table: &Table, column: &str) -> Result<Vec<Point>, TableError> {
        let corrections = table
            .has(CORRECTION.name)
            .then(|| table.texts(CORRECTION.name));
        let corrections = corrections.transpose()?;
        let (areas, loads) = (table.reals(column)?, table.reals(LOAD.name)?);
        let surfaces = table.texts(SURFACE.name)?;
        let stops = table.texts(STOP.name)?;
        let points = groups(table, &WITHIN_A_POINT).into_iter().map(|rows| {
            let mut of_surface: BTreeMap<&str, BTreeMap<u64, f64>> = BTreeMap::new();
            for &row in &rows {
                let curve = of_surface.entry(surfaces.value(row)).or_default();
                // Positive numbers sort as their bits do. Two blocks that share a load agree on
                // it to the solver's tolerance; the first one stands.
                curve
                    .entry(loads.value(row).to_bits())
                    .or_insert(areas.value(row));
            }
            Point {
                row: rows[0],
                correction: corrections.map(|names| names.value(rows[0]).to_owned()),
                surfaces: of_surface.len(),
                unconverged: rows
                    .iter()
                    .filter(|&&row| stops.value(row) == "pair-limit")
                    .count(),
                curves: common_loads(of_surface.into_values().collect()),
            }
        });
        Ok(points.collect())
    }
}

/// The corrections among the points, each once.
pub fn corrections(points: &[Point]) -> Vec<Option<String>> {
    let mut found = Vec::new();
    for point in points {
        if !found.contains(&point.correction) {
            found.push(point.correction.clone());
        }
    }
    found
}

/// Rows that differ in these coordinates only, together; in the order of their first rows.
pub fn groups(table: &Table, within: &[&str]) -> Vec<Vec<usize>> {
    let coordinates = table.coordinates().without(within);
    let mut known = BTreeMap::new();
    let mut points: Vec<Vec<usize>> = Vec::new();
    for row in 0..table.rows() {
        let columns = coordinates.batch().columns().iter();
        let values: Vec<String> = columns
            .map(|column| array_value_to_string(column, row).unwrap_or_default())
            .collect();
        let point = *known.entry(values).or_insert(points.len());
        if point == points.len() {
            points.push(Vec::new());
        }
        points[point].push(row);
    }
    points
}

/// Surfaces in full contact have no rows beyond it, so a mean exists only where all still have.
fn common_loads(curves: Vec<BTreeMap<u64, f64>>) -> Result<Curves, FitError> {
    let first = curves
        .first()
        .map(|curve| curve.keys().copied().collect::<Vec<_>>());
    let in_all = |load: &u64| curves.iter().all(|curve| curve.contains_key(load));
    let loads: Vec<u64> = first
        .unwrap_or_default()
        .into_iter()
        .filter(in_all)
        .collect();
    let areas = curves
        .iter()
        .map(|curve| loads.iter().map(|load| curve[load]).collect());
    let areas = areas.collect();
    Curves::new(loads.into_iter().map(f64::from_bits).collect(), areas)
}
