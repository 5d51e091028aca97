//! Removal of the form of a map (levelling).
//!
//! A polynomial in x and y is fitted to the measured points by least squares with equal weights and
//! subtracted. Missing points stay missing. The basis consists of Legendre polynomials over the
//! sides of the map, which are nearly orthogonal. The solution of the normal equations is refined
//! with the residuals. A surface of the fitted form is therefore removed up to rounding.
//!
//! A plane can also be given by three positions ([`ThreePoints`]), for example on a flat part that
//! is the reference for all heights.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::cholesky::Cholesky;
use super::periodic::detrend;
use super::surface::Scan;
use crate::grid::Grid;

/// Form that is removed from a map.
///
/// The forms have the first 0, 1, 3 or 6 terms of c₀ + c₁x + c₂y + c₃x² + c₄xy + c₅y². A quadric
/// fits the bow of a scanner, cylinders and spheres.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// No form, so that the map stays unchanged.
    None,
    /// Mean height of the map.
    Mean,
    /// Least-squares plane of the map.
    Plane,
    /// Least-squares quadric of the map.
    Quadric,
}

/// Number of coefficients of a quadric.
const MAX_TERMS: usize = 6;

/// Number of times that the normal equations are solved.
///
/// The first solution is for the heights. Each later one is for the residuals and corrects rounding
/// errors.
const ROUNDS: usize = 3;

/// Minimum fraction of the squared norm of a term that must be orthogonal to the preceding terms.
///
/// A term with a smaller fraction is omitted, for example x if all points have the same x.
const INDEPENDENT: f64 = 1e-12;

type Terms = [f64; MAX_TERMS];

impl Level {
    /// Returns the name used in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Level::None => "none",
            Level::Mean => "mean",
            Level::Plane => "plane",
            Level::Quadric => "quadric",
        }
    }

    fn terms(self) -> usize {
        match self {
            Level::None => 0,
            Level::Mean => 1,
            Level::Plane => 3,
            Level::Quadric => 6,
        }
    }

    /// Returns the map minus its form.
    pub fn level(self, scan: Scan) -> Scan {
        match self {
            Level::None => scan,
            // The result has the same bits as that of `detrend` in `Edges::close`.
            Level::Plane if scan.missing() == 0 => match scan.into_surface() {
                Ok(surface) => detrend(&surface).into(),
                Err(_) => unreachable!("no point is missing"),
            },
            Level::Mean | Level::Plane | Level::Quadric => without_form(&scan, self.terms()),
        }
    }
}

/// Three positions (x, y) on the plane that is subtracted from a map, in the unit of its sides and
/// relative to its first node. Their heights become zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ThreePoints {
    /// First position.
    pub a: [f64; 2],
    /// Second position.
    pub b: [f64; 2],
    /// Third position.
    pub c: [f64; 2],
}

/// Reason why three positions give no plane.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[expect(missing_docs, reason = "the error messages document the variants")]
pub enum ThreePointsError {
    #[error("point `{name}` is outside the map; move it into the part of the map that is kept")]
    Outside { name: char },
    #[error("point `{name}` was not measured; choose a measured point")]
    Missing { name: char },
    #[error("the three points are on one line; move one of them away from it")]
    OnOneLine,
}

impl ThreePoints {
    /// Returns the map minus the plane through the heights of the nodes nearest to the positions.
    ///
    /// `first` are the indices of the first node of the map, if it is a part of a larger map to
    /// which the positions refer.
    ///
    /// # Errors
    /// Fails if a node is outside the map or missing, or if the nodes are on one line.
    pub fn level(self, scan: &Scan, first: [usize; 2]) -> Result<Scan, ThreePointsError> {
        let grid = scan.grid();
        let named = [('a', self.a), ('b', self.b), ('c', self.c)];
        let mut found = [([0.0; 2], 0.0); 3];
        for (found, (name, position)) in found.iter_mut().zip(named) {
            let outside = ThreePointsError::Outside { name };
            let mut indices = [0; 2];
            for axis in 0..2 {
                let index = (position[axis] / grid.spacing()[axis]).round() - first[axis] as f64;
                let is_inside = index >= 0.0 && index < grid.nodes()[axis] as f64;
                indices[axis] = if is_inside { index as usize } else { return Err(outside) };
            }
            let height = scan.heights()[indices[0] * grid.nodes()[1] + indices[1]];
            if height.is_nan() {
                return Err(ThreePointsError::Missing { name });
            }
            *found = (indices.map(|index| index as f64), height);
        }
        let [(start, height), others @ ..] = found;
        let [[bx, by, bz], [cx, cy, cz]] =
            others.map(|([i, j], other)| [i - start[0], j - start[1], other - height]);
        let determinant = bx * cy - by * cx;
        if determinant == 0.0 {
            return Err(ThreePointsError::OnOneLine);
        }
        let slope_x = (bz * cy - cz * by) / determinant;
        let slope_y = (bx * cz - cx * bz) / determinant;
        Ok(scan.map_measured(|node, measured| {
            let [i, j] = grid.indices(node).map(|index| index as f64);
            measured - (height + slope_x * (i - start[0]) + slope_y * (j - start[1]))
        }))
    }
}

/// Returns the map minus its least-squares polynomial with the first `terms` terms of
/// [`Basis::at`].
fn without_form(scan: &Scan, terms: usize) -> Scan {
    let Some((_, reference)) = scan.measured().next() else {
        return scan.clone();
    };
    let basis = Basis::new(scan.grid());
    let mut matrix = vec![0.0; terms * terms];
    for (node, _) in scan.measured() {
        let values = basis.at(node);
        for (row, one) in matrix.chunks_exact_mut(terms).zip(values) {
            row.iter_mut().zip(values).for_each(|(sum, other)| *sum += one * other);
        }
    }
    let equations = Cholesky::new(matrix, terms, INDEPENDENT);
    let mut coefficients = [0.0; MAX_TERMS];
    let residual = |node: usize, height: f64, coefficients: &Terms| {
        let values = basis.at(node);
        let form: f64 = (0..terms).map(|k| coefficients[k] * values[k]).sum();
        (values, height - reference - form)
    };
    for _ in 0..ROUNDS {
        let mut moments = [0.0; MAX_TERMS];
        for (node, height) in scan.measured() {
            let (values, left) = residual(node, height, &coefficients);
            (0..terms).for_each(|k| moments[k] += values[k] * left);
        }
        equations.solve(&mut moments[..terms]);
        (0..terms).for_each(|k| coefficients[k] += moments[k]);
    }
    scan.map_measured(|node, height| residual(node, height, &coefficients).1)
}

/// Basis of the fitted polynomials: products of Legendre polynomials of x and y, with the map
/// scaled to [−1, 1] × [−1, 1].
struct Basis {
    grid: Grid,
    middle: [f64; 2],
}

impl Basis {
    fn new(grid: Grid) -> Basis {
        let middle = grid.nodes().map(|nodes| (nodes as f64 - 1.0) / 2.0);
        Basis { grid, middle }
    }

    /// Returns the basis functions 1, x, y, P₂(x), xy and P₂(y) at a node.
    fn at(&self, node: usize) -> Terms {
        let indices = self.grid.indices(node);
        let along = |axis: usize| {
            let middle = self.middle[axis];
            (indices[axis] as f64 - middle) / middle.max(1.0)
        };
        let (x, y) = (along(0), along(1));
        let second = |x: f64| (3.0 * x * x - 1.0) / 2.0;
        [1.0, x, y, second(x), x * y, second(y)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topography::surface::Window;
    use crate::topography::surface::samples::scan;

    const LEVELS: [Level; 3] = [Level::Mean, Level::Plane, Level::Quadric];

    /// Returns a polynomial in x and y that consists of the terms that `level` removes.
    fn form(level: Level) -> impl Fn(f64, f64) -> f64 {
        let terms = level.terms();
        move |x, y| {
            let all = [3.0, -2.0 * x, 0.7 * y, 4.0 * x * x, -5.0 * x * y, 0.3 * y * y];
            all[..terms].iter().sum()
        }
    }

    fn is_in_hole(i: usize, j: usize) -> bool {
        (3..9).contains(&i) && (2..7).contains(&j) || (i * 7 + j * 3).is_multiple_of(11)
    }

    #[test]
    fn a_surface_of_the_form_is_removed_to_rounding() {
        let holes: [fn(usize, usize) -> bool; 2] = [|_, _| false, is_in_hole];
        for is_missing in holes {
            for level in LEVELS {
                let map = scan([17, 12], [2.0, 1.0], form(level), is_missing);
                let left = level.level(map.clone());
                assert_eq!(left.missing(), map.missing());
                for (_, height) in left.measured() {
                    assert!(height.abs() < 2e-14, "{level:?}: {height}");
                }
            }
        }
    }

    #[test]
    fn what_is_left_is_orthogonal_to_the_form() {
        let rough = |x: f64, y: f64| libm::sin(37.0 * x + 11.0 * y * y) + 0.2 * x * y;
        let map = scan([20, 30], [1.0, 1.5], rough, is_in_hole);
        for level in LEVELS {
            let left = level.level(map.clone());
            let basis = Basis::new(left.grid());
            for term in 0..level.terms() {
                let moments = left.measured().map(|(node, height)| basis.at(node)[term] * height);
                assert!(moments.sum::<f64>().abs() < 1e-11, "{level:?}");
            }
            let again = level.level(left.clone());
            for ((_, once), (_, twice)) in left.measured().zip(again.measured()) {
                assert!((once - twice).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn a_hole_moves_no_plane() {
        // Maps with and without holes take different code paths.
        let plane = |x: f64, y: f64| 1e3 + 2.0 * x - 3.0 * y;
        let holes: [fn(usize, usize) -> bool; 2] = [|_, _| false, is_in_hole];
        let [whole, holed] = holes
            .map(|is_missing| Level::Plane.level(scan([17, 12], [2.0, 1.0], plane, is_missing)));
        for (node, height) in holed.measured() {
            assert!((height - whole.heights()[node]).abs() < 1e-12);
        }
    }

    #[test]
    fn points_in_a_row_have_a_slope_along_it_alone() {
        let row = scan([9, 9], [1.0, 1.0], |x, y| x + 5.0 * y, |_, j| j != 4);
        for level in LEVELS {
            let left = level.level(row.clone());
            let slope = left.heights()[13] - left.heights()[4];
            let expected = if level == Level::Mean { 1.0 / 9.0 } else { 0.0 };
            assert!((slope - expected).abs() < 1e-14, "{level:?}: {slope}");
        }
        let point = scan([9, 9], [1.0, 1.0], |_, _| 7.0, |i, j| (i, j) != (2, 3));
        for level in LEVELS {
            assert_eq!(level.level(point.clone()).measured().next(), Some((21, 0.0)));
        }
    }

    const POINTS: ThreePoints = ThreePoints { a: [0.1, 0.2], b: [1.9, 0.3], c: [0.8, 0.9] };

    /// Returns the heights of a map at the nodes nearest to [`POINTS`].
    fn heights_at_points(map: &Scan) -> [f64; 3] {
        let [step_x, step_y] = map.grid().spacing();
        let index = |[x, y]: [f64; 2]| {
            (x / step_x).round() as usize * map.grid().nodes()[1] + (y / step_y).round() as usize
        };
        [POINTS.a, POINTS.b, POINTS.c].map(|point| map.heights()[index(point)])
    }

    #[test]
    fn the_plane_of_three_points_passes_through_them() {
        let rough = |x: f64, y: f64| 1e3 + libm::sin(37.0 * x + 11.0 * y * y) + x * y;
        let map = scan([17, 12], [2.0, 1.0], rough, |i, j| (i, j) == (9, 3));
        let levelled = POINTS.level(&map, [0, 0]).unwrap();
        assert_eq!(levelled.missing(), 1);
        assert!(heights_at_points(&levelled).into_iter().all(|height| height.abs() < 1e-12));
        // Tilting and raising the map, and levelling it again, change nothing.
        let [step_x, step_y] = map.grid().spacing();
        let tilted = map.map_measured(|node, height| {
            let [i, j] = map.grid().indices(node).map(|index| index as f64);
            height + 7.0 + 3.0 * step_x * i - 2.0 * step_y * j
        });
        for other in [tilted, levelled.clone()] {
            let again = POINTS.level(&other, [0, 0]).unwrap();
            for ((_, once), (_, twice)) in levelled.measured().zip(again.measured()) {
                assert!((once - twice).abs() < 2e-12);
            }
        }
    }

    #[test]
    fn positions_refer_to_the_map_of_which_a_part_is_levelled() {
        let rough = |x: f64, y: f64| libm::sin(7.0 * x + 11.0 * y * y);
        let map = scan([20, 10], [2.0, 1.0], rough, |_, _| false);
        let window = Window { first: [1, 2], nodes: [19, 8] };
        let [whole, part] = [(map.clone(), [0, 0]), (map.cropped(window), window.first)]
            .map(|(map, first)| POINTS.level(&map, first).unwrap());
        let expected = whole.cropped(window);
        for ((_, one), (_, other)) in part.measured().zip(expected.measured()) {
            assert!((one - other).abs() < 1e-14);
        }
    }

    #[test]
    fn three_points_without_a_plane_are_refused() {
        let map = scan([20, 10], [2.0, 1.0], |x, y| x * y, |i, j| (i, j) == (8, 9));
        let level = |points: ThreePoints, first| points.level(&map, first).unwrap_err();
        assert_eq!(level(POINTS, [0, 0]), ThreePointsError::Missing { name: 'c' });
        assert_eq!(level(POINTS, [2, 0]), ThreePointsError::Outside { name: 'a' });
        for x in [2.1, f64::NAN] {
            let beyond = ThreePoints { b: [x, 0.0], ..POINTS };
            assert_eq!(level(beyond, [0, 0]), ThreePointsError::Outside { name: 'b' });
        }
        let line = ThreePoints { a: [0.0, 0.0], b: [0.2, 0.2], c: [0.61, 0.58] };
        assert_eq!(level(line, [0, 0]), ThreePointsError::OnOneLine);
    }

    #[test]
    fn no_level_changes_nothing() {
        let map = scan([4, 4], [1.0, 1.0], |x, y| x - y, |_, _| false);
        assert_eq!(Level::None.level(map.clone()).into_surface(), map.into_surface());
    }
}
