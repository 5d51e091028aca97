//! Curves of statistically equal surfaces: means over them and how they scatter.

use std::collections::BTreeMap;

use arrow::array::Array;
use arrow::util::display::array_value_to_string;

use crate::stages::aggregate::ONE_SURFACE;
use crate::stages::columns::{
    COEFFICIENT, CORRECTION, K_LOWER, K_ROLLOFF, LOAD, PRESSURE, SURFACE,
};
use crate::store::table::{Table, TableError};

/// Where a group of surfaces stands in the study: its coordinates, as text, by name.
pub type Point = BTreeMap<String, String>;

/// Surfaces of one parameter point under ascending loads.
#[derive(Debug)]
pub struct Ensemble<'a> {
    /// All that they share.
    pub point: Point,
    /// Which estimate of the area the rows hold; none as it was counted.
    pub correction: Option<String>,
    /// Number of surfaces.
    pub surfaces: usize,
    table: &'a Table,
    /// The rows of each load, one of each surface that has the load.
    rows: BTreeMap<u64, Vec<usize>>,
}

/// A quantity under one load, over the surfaces of an ensemble.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// The load.
    pub load: f64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Standard error of the mean; none of a single surface.
    pub error: Option<f64>,
}

impl Mean {
    /// The mean and its standard error on either side.
    pub fn bar(&self) -> Option<[f64; 2]> {
        self.error
            .map(|error| [self.mean - error, self.mean + error])
    }

    /// The quantity over the load: the secant of its curve.
    pub fn secant(&self) -> Mean {
        Mean {
            load: self.load,
            mean: self.mean / self.load,
            error: self.error.map(|error| error / self.load),
        }
    }
}

/// The slope of a mean curve between two loads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// Half way between them.
    pub load: f64,
    /// Difference over difference.
    pub slope: f64,
    /// Its standard error: slopes of single surfaces scatter much less than their areas do.
    pub error: Option<f64>,
}

/// Columns that tell rows of one ensemble apart, or that follow from others.
const WITHIN: [&str; 4] = [LOAD.name, PRESSURE.name, CORRECTION.name, COEFFICIENT.name];

/// The ensembles of a table of loads, in order of appearance.
///
/// # Errors
/// When the table has no loads or names no surfaces.
pub fn of(table: &Table) -> Result<Vec<Ensemble<'_>>, TableError> {
    let (surfaces, loads) = (table.texts(SURFACE.name)?, table.reals(LOAD.name)?);
    let tasks = table.texts("task")?;
    let corrections = table.has(CORRECTION.name);
    let corrections = corrections
        .then(|| table.texts(CORRECTION.name))
        .transpose()?;
    let correction = |row: usize| corrections.map(|column| column.value(row));
    let mut order: Vec<(Point, Option<String>)> = Vec::new();
    let mut members: Vec<BTreeMap<(u64, &str), usize>> = Vec::new();
    let mut at = 0;
    for row in 0..table.rows() {
        // Rows of one task and correction differ by their load alone.
        let goes_on = row > 0
            && tasks.value(row) == tasks.value(row - 1)
            && correction(row) == correction(row - 1);
        if !goes_on {
            let place = (point(table, row), correction(row).map(str::to_owned));
            at = order
                .iter()
                .position(|known| *known == place)
                .unwrap_or(order.len());
            if at == order.len() {
                order.push(place);
                members.push(BTreeMap::new());
            }
        }
        // Positive numbers sort as their bits do. Two blocks that share a load count once.
        let key = (loads.value(row).to_bits(), surfaces.value(row));
        members[at].entry(key).or_insert(row);
    }
    let ensembles = order
        .into_iter()
        .zip(members)
        .map(|((point, correction), members)| {
            let mut rows: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
            for (&(load, _), &row) in &members {
                rows.entry(load).or_default().push(row);
            }
            let surfaces: std::collections::BTreeSet<&str> =
                members.keys().map(|&(_, surface)| surface).collect();
            Ensemble {
                point,
                correction,
                surfaces: surfaces.len(),
                table,
                rows,
            }
        });
    Ok(ensembles.collect())
}

/// The coordinates of a row, but those that tell surfaces of one point apart.
pub fn point(table: &Table, row: usize) -> Point {
    let coordinates = table.coordinates();
    let batch = coordinates.batch();
    let names = coordinates.names();
    let mut point: Point = names
        .into_iter()
        .zip(batch.columns())
        .filter(|(name, column)| {
            !WITHIN.contains(name) && !ONE_SURFACE.contains(name) && column.is_valid(row)
        })
        .map(|(name, column)| {
            let value = array_value_to_string(column, row).unwrap_or_default();
            (name.to_owned(), value)
        })
        .collect();
    // A spectrum without a plateau is told by two wavenumbers.
    if point.get(K_ROLLOFF.name) == point.get(K_LOWER.name) {
        point.remove(K_ROLLOFF.name);
    }
    point
}

impl Ensemble<'_> {
    /// A quantity under each load that all surfaces have: a mean curve ends where the first of its
    /// surfaces reaches full contact, for it has no rows beyond.
    ///
    /// # Errors
    /// When the table has no such column of numbers.
    pub fn mean(&self, column: &str) -> Result<Vec<Mean>, TableError> {
        let values = self.table.reals(column)?;
        let means = self.complete().filter_map(|(load, rows)| {
            let known: Option<Vec<f64>> = rows
                .iter()
                .map(|&row| values.is_valid(row).then(|| values.value(row)))
                .collect();
            let (mean, error) = mean_and_error(&known?);
            Some(Mean { load, mean, error })
        });
        Ok(means.collect())
    }

    /// The slope of the mean of a quantity that vanishes at no load, the first one from there.
    ///
    /// # Errors
    /// When the table has no such column of numbers.
    pub fn slope(&self, column: &str) -> Result<Vec<Slope>, TableError> {
        let values = self.table.reals(column)?;
        let mut before = (0.0, vec![0.0; self.surfaces]);
        let mut slopes = Vec::new();
        for (load, rows) in self.complete() {
            let now: Vec<f64> = rows.iter().map(|&row| values.value(row)).collect();
            let step = load - before.0;
            let each = now
                .iter()
                .zip(&before.1)
                .map(|(now, before)| (now - before) / step);
            let (slope, error) = mean_and_error(&each.collect::<Vec<_>>());
            slopes.push(Slope {
                load: (load + before.0) / 2.0,
                slope,
                error,
            });
            before = (load, now);
        }
        Ok(slopes)
    }

    /// The growth of the mean contact pressure y/a with the load y, area a by the given column;
    /// the areas stand for the loads. Its first value has no predecessor and is left out.
    ///
    /// # Errors
    /// When the table has no such column of numbers.
    pub fn pressure_growth(&self, column: &str) -> Result<Vec<(f64, f64)>, TableError> {
        let means = self.mean(column)?;
        let growth = means.windows(2).map(|pair| {
            let pressure = |mean: &Mean| mean.load / mean.mean;
            let rise = pressure(&pair[1]) - pressure(&pair[0]);
            let area = (pair[0].mean + pair[1].mean) / 2.0;
            (area, rise / (pair[1].load - pair[0].load))
        });
        Ok(growth.collect())
    }

    fn complete(&self) -> impl Iterator<Item = (f64, &Vec<usize>)> {
        let all = self
            .rows
            .iter()
            .filter(|(_, rows)| rows.len() == self.surfaces);
        all.map(|(&load, rows)| (f64::from_bits(load), rows))
    }
}

/// Arithmetic mean and, of more than one value, its standard error.
pub fn mean_and_error(values: &[f64]) -> (f64, Option<f64>) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>();
    let error = (values.len() > 1).then(|| (square / (count - 1.0) / count).sqrt());
    (mean, error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::column::{Column, ColumnKind, integers, reals, texts};

    const TASK: Column = Column::result("task", ColumnKind::Text, "", "task");
    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");
    const NODES: Column = Column::coordinate("nodes", ColumnKind::Integer, "1", "nodes");

    /// Two surfaces in two blocks of loads that share 0.2; the second surface has no 0.4.
    fn table() -> Table {
        let rows = [
            ("one", "a", 0.1, 0.10),
            ("one", "a", 0.2, 0.30),
            ("two", "b", 0.1, 0.30),
            ("two", "b", 0.2, 0.50),
            ("three", "a", 0.2, 0.31),
            ("three", "a", 0.4, 0.60),
            ("four", "b", 0.2, 0.51),
        ];
        Table::new(
            rows.len(),
            vec![
                (SURFACE, texts(rows.map(|row| row.1))),
                (NODES, integers([64; 7])),
                (LOAD, reals(rows.map(|row| row.2))),
                (AREA, reals(rows.map(|row| row.3))),
                (TASK, texts(rows.map(|row| row.0))),
            ],
        )
    }

    #[test]
    fn blocks_of_loads_make_one_curve_that_ends_where_its_first_surface_does() {
        let table = table();
        let ensembles = of(&table).unwrap();
        let [ensemble] = ensembles.as_slice() else {
            panic!("one point, found {}", ensembles.len())
        };
        assert_eq!(ensemble.surfaces, 2);
        assert_eq!(ensemble.point["nodes"], "64");
        let means = ensemble.mean("area").unwrap();
        let found: Vec<(f64, f64)> = means.iter().map(|mean| (mean.load, mean.mean)).collect();
        assert_eq!(found, [(0.1, 0.2), (0.2, 0.4)], "a shared load counts once");
        // Two values, 0.2 apart: half of that is the standard error of their mean.
        assert!((means[0].error.unwrap() - 0.1).abs() < 1e-15);
    }

    #[test]
    fn slopes_begin_at_the_origin_and_scatter_as_those_of_single_surfaces_do() {
        let table = table();
        let slopes = of(&table).unwrap()[0].slope("area").unwrap();
        let found: Vec<f64> = slopes.iter().map(|slope| slope.load).collect();
        assert!((found[0] - 0.05).abs() < 1e-15 && (found[1] - 0.15).abs() < 1e-15);
        assert!((slopes[0].slope - 2.0).abs() < 1e-14);
        assert!((slopes[1].slope - 2.0).abs() < 1e-14);
        assert!(slopes[1].error.unwrap() < 1e-14, "both rise by 0.2");
    }

    #[test]
    fn a_single_surface_has_no_error() {
        let table = table().pick(&[0, 1]);
        let means = of(&table).unwrap()[0].mean("area").unwrap();
        assert!(means.iter().all(|mean| mean.error.is_none()));
    }
}
