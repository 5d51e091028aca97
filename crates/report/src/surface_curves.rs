//! Curves of surfaces from `measure` stages: densities against wavenumbers, and slopes against
//! distances. Curves are means over the surfaces of a parameter point.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::points::{self, Point};
use asperity_stages::columns::ALONG;
use asperity_tables::column::Column;
use asperity_tables::table::{Table, TableError};

/// Number of points of a curve per decade.
const POINTS_TO_A_DECADE: f64 = 24.0;

/// A curve of the surfaces of one parameter point.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceCurve {
    /// Parameter point, without the abscissa of the curve.
    pub point: Point,
    /// Direction of the distances, if the curve has one.
    pub along: Option<String>,
    pub surfaces: usize,
    pub points: Vec<CurvePoint>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    pub x: f64,
    pub y: f64,
    /// Weight in means with its neighbours.
    pub weight: f64,
}

/// Point of a curve before averaging: (sum of the values over the surfaces, number of surfaces,
/// weight of the point on the first surface).
type Sum = (f64, usize, f64);

/// Returns the curves of a table, in order of appearance. `weight` is the column of weights, if
/// any.
pub fn from_table(
    table: &Table,
    [x, y]: [Column; 2],
    weight: Option<Column>,
) -> Result<Vec<SurfaceCurve>, TableError> {
    let (coordinates, values) = (table.reals(x.name)?, table.reals(y.name)?);
    let weights = weight.map(|weight| table.integers(weight.name)).transpose()?;
    let mut found: Vec<(Point, BTreeMap<u64, Sum>)> = Vec::new();
    for rows in runs(coordinates.values()) {
        let point = points::at_row(table, rows.start).without(&[x.name]);
        let before = found.iter().position(|(known, _)| *known == point);
        let index = before.unwrap_or_else(|| {
            found.push((point, BTreeMap::new()));
            found.len() - 1
        });
        for row in rows {
            let weight = weights.map_or(1.0, |weights| weights.value(row) as f64);
            // The bits of positive numbers sort like the numbers.
            let bits = coordinates.value(row).to_bits();
            let sum = found[index].1.entry(bits).or_insert((0.0, 0, weight));
            sum.0 += values.value(row);
            sum.1 += 1;
        }
    }
    let curves = found.into_iter().map(|(point, sums)| SurfaceCurve {
        along: points::text(&point, ALONG.name).map(str::to_owned),
        point: point.without(&[ALONG.name]),
        surfaces: sums.values().map(|(_, count, _)| *count).max().unwrap_or(0),
        points: sums.into_iter().map(mean).collect(),
    });
    Ok(curves.collect())
}

fn mean((bits, (sum, count, weight)): (u64, Sum)) -> CurvePoint {
    CurvePoint { x: f64::from_bits(bits), y: sum / count as f64, weight }
}

/// Splits row indices into runs of ascending abscissae. Each run is the curve of one surface.
pub fn runs(coordinates: &[f64]) -> Vec<Range<usize>> {
    let mut starts: Vec<usize> = (0..coordinates.len())
        .filter(|&row| row == 0 || coordinates[row] <= coordinates[row - 1])
        .collect();
    starts.push(coordinates.len());
    starts.windows(2).map(|pair| pair[0]..pair[1]).collect()
}

/// Averages neighbouring points with weights. Returns points (x, y) that are about evenly spaced on
/// a logarithmic axis.
pub fn thinned(points: &[CurvePoint]) -> Vec<(f64, f64)> {
    let bin = |point: &CurvePoint| (POINTS_TO_A_DECADE * point.x.log10()).floor() as i64;
    let joined = points.chunk_by(|one, other| bin(one) == bin(other));
    let mean = |points: &[CurvePoint]| {
        let sum = |of: fn(&CurvePoint) -> f64| -> f64 {
            points.iter().map(|point| point.weight * of(point)).sum()
        };
        let weight = sum(|_| 1.0);
        let x = match points {
            [point] => point.x,
            _ => (sum(|point| point.x.ln()) / weight).exp(),
        };
        (x, sum(|point| point.y) / weight)
    };
    joined.map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_stages::columns::{MODES, REALIZATION, SPECTRAL_DENSITY, SURFACE, WAVENUMBER};
    use asperity_tables::column::{ColumnKind, integers, reals, texts};

    const NODES: Column = Column::parameter("nodes", ColumnKind::Integer, "1", "nodes");

    #[test]
    fn a_curve_is_the_mean_over_the_surfaces_of_a_point() {
        let rows = [
            ("a", 0, 64, 1.0, 4.0),
            ("a", 0, 64, 2.0, 2.0),
            ("b", 1, 64, 1.0, 8.0),
            ("b", 1, 64, 2.0, 4.0),
            ("c", 0, 128, 1.0, 5.0),
        ];
        let table = Table::new(
            rows.len(),
            vec![
                (SURFACE, texts(rows.map(|row| row.0))),
                (REALIZATION, integers(rows.map(|row| row.1))),
                (NODES, integers(rows.map(|row| row.2))),
                (WAVENUMBER, reals(rows.map(|row| row.3))),
                (MODES, integers([8; 5])),
                (SPECTRAL_DENSITY, reals(rows.map(|row| row.4))),
            ],
        );
        let found = from_table(&table, [WAVENUMBER, SPECTRAL_DENSITY], Some(MODES)).unwrap();
        let told: Vec<(usize, Vec<(f64, f64)>)> = found
            .iter()
            .map(|curve| {
                let points = curve.points.iter().map(|point| (point.x, point.y));
                (curve.surfaces, points.collect())
            })
            .collect();
        let expected = [(2, vec![(1.0, 6.0), (2.0, 3.0)]), (1, vec![(1.0, 5.0)])];
        assert_eq!(told, expected);
    }

    #[test]
    fn a_thinned_power_law_is_the_same_power_law() {
        let points: Vec<CurvePoint> = (1..3000)
            .map(|k| {
                let x = f64::from(k);
                CurvePoint { x, y: x.powf(-3.6), weight: x }
            })
            .collect();
        let thin = thinned(&points);
        assert!(thin.len() < 90, "{}", thin.len());
        for (x, y) in thin {
            // The mean over 1/24 of a decade exceeds the power law by less than 2 %.
            assert!((y * x.powf(3.6) - 1.0).abs() < 0.02, "{x}");
        }
    }
}
