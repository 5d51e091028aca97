//! Rows of many surfaces and loads, sorted into the curves of parameter points.

use std::collections::BTreeSet;

use arrow::array::Float64Array;

use super::row::Row;
use crate::columns::{AREA_CORRECTED, AREA_FRACTION, CORRECTION, STOP};
use crate::ensemble::{Ensemble, Member, ensembles};
use crate::solve::GIVEN_UP;
use asperity_statistics::FitError;
use asperity_statistics::curves::Curves;
use asperity_tables::table::{Table, TableError};

/// The curves of all surfaces of one parameter point, under one correction.
pub struct Point {
    /// A row of the table that stands for the point's coordinates.
    pub row: usize,
    /// The estimator of the area, if any was applied.
    pub correction: Option<String>,
    /// Surfaces in the order of the curves.
    pub members: Vec<Member>,
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
        let corrections = table.has(CORRECTION.name).then(|| table.texts(CORRECTION.name));
        let corrections = corrections.transpose()?;
        let areas = table.reals(column)?;
        let stops = table.texts(STOP.name)?;
        let points = ensembles(table)?.into_iter().map(|ensemble| Point {
            row: ensemble.first,
            correction: corrections.map(|names| names.value(ensemble.first).to_owned()),
            members: ensemble.members.clone(),
            unconverged: ensemble
                .states()
                .filter(|&(_, _, row)| stops.value(row) == GIVEN_UP)
                .count(),
            curves: curves(&ensemble, areas),
        });
        Ok(points.collect())
    }

    /// What a law makes of its curves, or why there is nothing to fit.
    pub fn fit(&self, law: impl FnOnce(&Curves) -> Result<Row, FitError>) -> Row {
        let curves = self.curves.as_ref().map_err(Clone::clone);
        let fitted = curves.and_then(law);
        fitted.unwrap_or_else(|error| Row::failed(&error))
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

/// Numbers the surfaces of several points from 0. A surface has the same number at all points.
pub fn units<'a>(points: impl Iterator<Item = &'a [Member]> + Clone) -> Vec<Vec<usize>> {
    let all: BTreeSet<Member> = points.clone().flatten().copied().collect();
    let all: Vec<Member> = all.into_iter().collect();
    let number = |member| all.partition_point(|other| other < member);
    points.map(|members| members.iter().map(number).collect()).collect()
}

/// Surfaces in full contact have no rows beyond it, so a mean exists only where all still have.
fn curves(ensemble: &Ensemble, areas: &Float64Array) -> Result<Curves, FitError> {
    let complete = ensemble.loads.iter().enumerate();
    let complete =
        complete.filter_map(|(place, load)| Some((load.reduced, ensemble.complete(place)?)));
    let (loads, rows): (Vec<f64>, Vec<Vec<usize>>) = complete.unzip();
    let curve = |member: usize| rows.iter().map(|rows| areas.value(rows[member])).collect();
    Curves::new(loads, (0..ensemble.members.len()).map(curve).collect())
}
