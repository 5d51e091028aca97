//! Curves of ensembles: means and error bars at ascending loads. An ensemble comprises all surfaces
//! of one parameter point.

use std::collections::BTreeMap;
use std::fmt;

use arrow::array::Array;

use asperity_contact::grid::Grid;
use asperity_stages::columns::{
    COEFFICIENT, CORRECTION, K_LOWER, K_ROLLOFF, NODES, NODES_X, NODES_Y, SIDE, SIDE_X, SIDE_Y,
};
use asperity_stages::ensemble::{self, Load};
use asperity_stages::grids;
use asperity_tables::column::Column;
use asperity_tables::table::{Table, TableError};

/// Parameter point of a group of surfaces: values as text, by name.
pub type Point = BTreeMap<String, String>;

/// Returns the mesh of the surfaces at a point, or `None` if the point does not contain the mesh.
pub fn grid(point: &Point) -> Option<Grid> {
    let number = |column: &Column| point.get(column.name)?.parse::<f64>().ok();
    let pair = |[either, x, y]: [Column; 3]| match number(&either) {
        Some(same) => Some([same; 2]),
        None => Some([number(&x)?, number(&y)?]),
    };
    let nodes = pair([NODES, NODES_X, NODES_Y])?.map(|nodes| nodes as usize);
    grids::grid(nodes, pair([SIDE, SIDE_X, SIDE_Y])?).ok()
}

/// Surfaces of one parameter point at ascending loads.
#[derive(Debug)]
pub struct EnsembleCurves<'a> {
    pub point: Point,
    /// Correction of the area, or `None` for the counted area.
    pub correction: Option<String>,
    pub surfaces: usize,
    table: &'a Table,
    rows: ensemble::Ensemble,
    bars: Bars,
}

/// Mean of a quantity at one load over the surfaces of an ensemble.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    pub load: f64,
    pub mean: f64,
    /// Half the length of the error bar; `None` for a single surface.
    pub half_bar: Option<f64>,
}

impl Mean {
    /// Returns the ends of the error bar.
    pub fn bar(&self) -> Option<[f64; 2]> {
        ends(self.mean, self.half_bar)
    }

    /// Returns the secant at this load: the mean and its error bar divided by the load.
    pub fn secant(&self) -> Mean {
        Mean {
            load: self.load,
            mean: self.mean / self.load,
            half_bar: self.half_bar.map(|half| half / self.load),
        }
    }
}

/// Returns the ensembles of a table of loads, in order of appearance.
pub fn from_table(table: &Table, bars: Bars) -> Result<Vec<EnsembleCurves<'_>>, TableError> {
    let ensembles = ensemble::ensembles(table)?.into_iter();
    Ok(ensembles
        .map(|rows| EnsembleCurves {
            point: to_text(rows.point.clone()),
            correction: rows.point.get(CORRECTION.name).map(ToString::to_string),
            surfaces: rows.members.len(),
            rows,
            table,
            bars,
        })
        .collect())
}

pub fn point(table: &Table, row: usize) -> Point {
    to_text(ensemble::ParameterPoint::from_row(table, row))
}

/// Converts parameters to text. Omits the correction of the area, and the roll-off of a spectrum
/// without a plateau.
fn to_text(point: ensemble::ParameterPoint) -> Point {
    let point = point.without(&[CORRECTION.name, COEFFICIENT.name]);
    let mut point: Point =
        point.iter().map(|(name, value)| (name.to_owned(), value.to_string())).collect();
    // Two wavenumbers name a spectrum without a plateau.
    if point.get(K_ROLLOFF.name) == point.get(K_LOWER.name) {
        point.remove(K_ROLLOFF.name);
    }
    point
}

impl EnsembleCurves<'_> {
    /// Returns the means of a quantity at the loads at which all surfaces have a row. A curve ends
    /// where the first surface reaches full contact, because this surface has no rows at heavier
    /// loads.
    pub fn mean(&self, column: &str) -> Result<Vec<Mean>, TableError> {
        let values = self.table.reals(column)?;
        let means = self.complete().filter_map(|(load, rows)| {
            let known: Option<Vec<f64>> =
                rows.iter().map(|&row| values.is_valid(row).then(|| values.value(row))).collect();
            let (mean, half_bar) = mean_and_half_bar(&known?, self.bars);
            Some(Mean { load: load.reduced, mean, half_bar })
        });
        Ok(means.collect())
    }

    /// Returns the mean ratio of a quantity to a quantity of another ensemble of the same surfaces.
    /// Ratios are computed for each surface, at the loads at which all surfaces have a row in both
    /// ensembles.
    pub fn ratio(
        &self,
        column: &str,
        other: &EnsembleCurves,
        other_column: &str,
    ) -> Result<Vec<Mean>, TableError> {
        let (values, others) = (self.table.reals(column)?, other.table.reals(other_column)?);
        let others: BTreeMap<_, f64> = other
            .rows
            .states()
            .map(|(member, load, row)| ((member, load.given.to_bits()), others.value(row)))
            .collect();
        let means = self.complete().filter_map(|(load, rows)| {
            let members = self.rows.members.iter().zip(rows);
            let ratios = members.map(|(&member, row)| {
                let other = others.get(&(member, load.given.to_bits()))?;
                Some(values.value(row) / other)
            });
            let (mean, half_bar) =
                mean_and_half_bar(&ratios.collect::<Option<Vec<_>>>()?, self.bars);
            Some(Mean { load: load.reduced, mean, half_bar })
        });
        Ok(means.collect())
    }

    /// Returns the loads at which all surfaces have a row, each with the rows of the surfaces.
    fn complete(&self) -> impl Iterator<Item = (Load, Vec<usize>)> {
        let loads = self.rows.loads.iter().enumerate();
        loads.filter_map(|(index, &load)| Some((load, self.rows.complete(index)?)))
    }
}

/// Quantity that error bars show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bars {
    /// Standard errors of the mean.
    #[default]
    Sem,
    /// Standard deviations over the surfaces, as in the paper.
    Sd,
}

impl Bars {
    /// Returns half the length of an error bar, from the standard deviation of `count` values.
    pub fn half(self, deviation: f64, count: usize) -> f64 {
        match self {
            Bars::Sem => deviation / (count as f64).sqrt(),
            Bars::Sd => deviation,
        }
    }
}

impl fmt::Display for Bars {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Bars::Sem => "standard errors of the means",
            Bars::Sd => "standard deviations over the surfaces",
        })
    }
}

/// Returns the mean of values and half the length of its error bar, which is `None` for a single
/// value.
pub fn mean_and_half_bar(values: &[f64], bars: Bars) -> (f64, Option<f64>) {
    let half = deviation(values).map(|deviation| bars.half(deviation, values.len()));
    (mean(values), half)
}

/// Returns the ends of an error bar, `value` ± `half`, or `None` if `half` is `None`.
pub fn ends(value: f64, half: Option<f64>) -> Option<[f64; 2]> {
    half.map(|half| [value - half, value + half])
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the standard deviation with divisor n − 1, or `None` for fewer than two values.
pub fn deviation(values: &[f64]) -> Option<f64> {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (values.len() > 1).then(|| (squares / (values.len() - 1) as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_stages::columns::{LOAD, REALIZATION, SURFACE};
    use asperity_tables::column::{ColumnKind, integers, reals, texts};

    const TASK: Column = Column::result("task", ColumnKind::Text, "", "task");
    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");
    const NODES: Column = Column::parameter("nodes", ColumnKind::Integer, "1", "nodes");

    /// Returns a table of two surfaces with two blocks of loads that share the load 0.2. The second
    /// surface has no row at 0.4.
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
                (REALIZATION, integers(rows.map(|row| i64::from(row.1 == "b")))),
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
        let ensembles = from_table(&table, Bars::Sem).unwrap();
        let [ensemble] = ensembles.as_slice() else {
            panic!("one point, found {}", ensembles.len())
        };
        assert_eq!(ensemble.surfaces, 2);
        assert_eq!(ensemble.point["nodes"], "64");
        let means = ensemble.mean("area").unwrap();
        let found: Vec<(f64, f64)> = means.iter().map(|mean| (mean.load, mean.mean)).collect();
        assert_eq!(found, [(0.1, 0.2), (0.2, 0.4)], "a shared load counts once");
        // The standard error of the mean of two values is half of their distance of 0.2.
        assert!((means[0].half_bar.unwrap() - 0.1).abs() < 1e-15);
    }

    #[test]
    fn bars_of_deviations_are_longer_than_those_of_errors_by_the_root_of_the_surfaces() {
        let table = table();
        let bar = |bars| from_table(&table, bars).unwrap()[0].mean("area").unwrap()[0].half_bar;
        let ratio = bar(Bars::Sd).unwrap() / bar(Bars::Sem).unwrap();
        assert!((ratio - 2f64.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn ratios_are_of_the_same_surface_under_the_same_load() {
        let table = table();
        let reversed = table.pick(&[6, 5, 4, 3, 2, 1, 0]);
        let (one, other) =
            (from_table(&table, Bars::Sem).unwrap(), from_table(&reversed, Bars::Sem).unwrap());
        let ratios = one[0].ratio("area", &other[0], "area").unwrap();
        // At the load 0.2 each surface has two rows; in each table, the first of them counts.
        assert_eq!((ratios[0].load, ratios[0].mean), (0.1, 1.0));
        assert!((ratios[1].mean - (0.30 / 0.31 + 0.50 / 0.51) / 2.0).abs() < 1e-15);
    }

    #[test]
    fn a_single_surface_has_no_error() {
        let table = table().pick(&[0, 1]);
        let means = from_table(&table, Bars::Sem).unwrap()[0].mean("area").unwrap();
        assert!(means.iter().all(|mean| mean.half_bar.is_none()));
    }
}
