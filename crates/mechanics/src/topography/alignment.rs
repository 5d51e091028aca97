//! Alignment of the scan lines of a measured map.
//!
//! A scanning instrument measures a map line by line. Drift between the lines and jumps of the tip
//! give each line an offset of its own, and the bow of the scanner bends each line. Both are errors
//! of the instrument, and a form that is fitted to the whole map does not contain them.
//!
//! An alignment subtracts a function of each line from that line. It cannot distinguish the offset
//! of a line from a real wave across the lines, so that it also removes such waves and a tilt
//! across the lines. The mean height of the measured points stays the same.

use serde::{Deserialize, Serialize};

use super::surface::{Axis, Scan};

/// Maximum degree of the polynomial that is subtracted from a line.
pub const MAX_DEGREE: u32 = 5;

/// Number of times that each polynomial is fitted. The second time corrects rounding errors.
const ROUNDS: usize = 2;

/// Alignment of the lines of a map with each other.
///
/// ```
/// use asperity_mechanics::grid::{Cell, Grid};
/// use asperity_mechanics::topography::alignment::{Alignment, LineFit};
/// use asperity_mechanics::topography::surface::{Axis, Scan};
///
/// let grid = Grid::new([3, 2], Cell::new([3.0, 2.0])?)?;
/// // Two lines along x with the heights 1, 2, 3, of which the second one is higher by 10.
/// let scan = Scan::new(grid, vec![1.0, 11.0, 2.0, 12.0, 3.0, 13.0])?;
/// let aligned = Alignment { along: Axis::X, by: LineFit::Median }.align(&scan);
/// assert_eq!(aligned.heights(), [6.0, 6.0, 7.0, 7.0, 8.0, 8.0]);
/// # Ok::<(), asperity_mechanics::topography::surface::SurfaceError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Alignment {
    /// Direction of the lines, the fast axis of the scan.
    pub along: Axis,
    /// Function that is subtracted from each line.
    #[serde(flatten)]
    pub by: LineFit,
}

/// Function that an alignment subtracts from each line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "by", rename_all = "lowercase")]
pub enum LineFit {
    /// Median of the heights of the line.
    Median,
    /// Sum of the medians of the differences of neighbouring lines, up to the line.
    ///
    /// A line that shares no position with the measured points of the line before it keeps its
    /// height relative to that line.
    Differences,
    /// Least-squares polynomial of the heights of the line.
    ///
    /// A line with n measured points is fitted by a polynomial of degree n − 1 at most.
    Polynomial {
        /// Degree of the polynomial.
        degree: u32,
    },
}

impl LineFit {
    /// Returns the name used in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            LineFit::Median => "median",
            LineFit::Differences => "differences",
            LineFit::Polynomial { .. } => "polynomial",
        }
    }
}

impl Alignment {
    /// Returns the map with aligned lines. Missing points stay missing.
    pub fn align(self, scan: &Scan) -> Scan {
        let lines = Lines::new(scan, self.along);
        let mut heights = scan.heights().to_vec();
        let mut subtract_offset = |line: usize, offset: f64| {
            lines.nodes(line).for_each(|node| heights[node] -= offset);
        };
        match self.by {
            LineFit::Median => {
                for line in 0..lines.count {
                    let of_line = lines.nodes(line).map(|node| scan.heights()[node]);
                    let mut measured: Vec<f64> =
                        of_line.filter(|height| !height.is_nan()).collect();
                    if let Some(offset) = median(&mut measured) {
                        subtract_offset(line, offset);
                    }
                }
            }
            LineFit::Differences => {
                for (line, offset) in lines.offsets_by_differences(scan).into_iter().enumerate() {
                    subtract_offset(line, offset);
                }
            }
            LineFit::Polynomial { degree } => {
                for line in 0..lines.count {
                    let nodes: Vec<usize> =
                        lines.nodes(line).filter(|node| !scan.is_missing(*node)).collect();
                    let positions: Vec<f64> =
                        nodes.iter().map(|node| lines.position(*node)).collect();
                    let mut of_line: Vec<f64> = nodes.iter().map(|node| heights[*node]).collect();
                    subtract_polynomial(&positions, &mut of_line, degree);
                    nodes.iter().zip(of_line).for_each(|(node, height)| heights[*node] = height);
                }
            }
        }
        with_mean_of(scan, heights)
    }
}

/// The lines of a map along one axis.
#[derive(Clone, Copy)]
struct Lines {
    along: Axis,
    nodes: [usize; 2],
    /// Number of lines.
    count: usize,
}

impl Lines {
    fn new(scan: &Scan, along: Axis) -> Lines {
        let nodes = scan.grid().nodes();
        let [nodes_x, nodes_y] = nodes;
        Lines { along, nodes, count: along.select([nodes_y, nodes_x]) }
    }

    /// Returns the nodes of a line.
    fn nodes(self, line: usize) -> impl Iterator<Item = usize> {
        let [nodes_x, nodes_y] = self.nodes;
        let (first, step) = self.along.select([(line, nodes_y), (line * nodes_y, 1)]);
        (0..self.along.select([nodes_x, nodes_y])).map(move |index| first + index * step)
    }

    /// Returns the position of a node along its line, from −1 to 1.
    fn position(self, node: usize) -> f64 {
        let nodes_y = self.nodes[1];
        let index = self.along.select([node / nodes_y, node % nodes_y]);
        let last = self.along.select(self.nodes).saturating_sub(1).max(1);
        2.0 * index as f64 / last as f64 - 1.0
    }

    /// Returns the offset of each line relative to the first one: the sum of the medians of the
    /// differences between each line and the measured line before it.
    fn offsets_by_differences(self, scan: &Scan) -> Vec<f64> {
        let mut offsets = Vec::with_capacity(self.count);
        let mut offset = 0.0;
        let mut before: Option<usize> = None;
        for line in 0..self.count {
            if let Some(before) = before {
                let pairs = self.nodes(line).zip(self.nodes(before));
                let all = pairs.map(|(node, other)| scan.heights()[node] - scan.heights()[other]);
                let mut differences: Vec<f64> =
                    all.filter(|difference| !difference.is_nan()).collect();
                offset += median(&mut differences).unwrap_or(0.0);
            }
            if self.nodes(line).any(|node| !scan.is_missing(node)) {
                before = Some(line);
            }
            offsets.push(offset);
        }
        offsets
    }
}

/// Subtracts the least-squares polynomial of the given degree from the heights at the given
/// positions.
///
/// The polynomial is a sum of polynomials that are orthogonal on the positions. They follow from
/// the recurrence of Stieltjes, which stops by itself if there are fewer positions than
/// coefficients.
fn subtract_polynomial(positions: &[f64], heights: &mut [f64], degree: u32) {
    let Some(&reference) = heights.first() else { return };
    heights.iter_mut().for_each(|height| *height -= reference);
    let mut before = vec![0.0; positions.len()];
    let mut current = vec![1.0; positions.len()];
    let mut norm_before = f64::INFINITY;
    for _ in (0..=degree).zip(positions) {
        let norm: f64 = current.iter().map(|value| value * value).sum();
        for _ in 0..ROUNDS {
            let moment: f64 = heights.iter().zip(&current).map(|(height, p)| height * p).sum();
            let coefficient = moment / norm;
            heights.iter_mut().zip(&current).for_each(|(height, p)| *height -= coefficient * p);
        }
        let weighted = positions.iter().zip(&current).map(|(position, p)| position * p * p);
        let (middle, ratio) = (weighted.sum::<f64>() / norm, norm / norm_before);
        for ((position, current), before) in positions.iter().zip(&mut current).zip(&mut before) {
            let next = (position - middle) * *current - ratio * *before;
            (*before, *current) = (*current, next);
        }
        norm_before = norm;
    }
}

/// Returns the map with other heights, shifted so that the mean of the measured points stays.
fn with_mean_of(scan: &Scan, heights: Vec<f64>) -> Scan {
    let count = scan.measured().count().max(1) as f64;
    let lost = scan.measured().map(|(node, height)| height - heights[node]);
    let shift = lost.sum::<f64>() / count;
    scan.map_measured(|node, _| heights[node] + shift)
}

/// Returns the median, and changes the order of the values. For an even number of values, it is the
/// mean of the two middle ones. Returns `None` if there are no values.
pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    let [lower, upper] = middle_values(values)?;
    Some(lower + (upper - lower) / 2.0)
}

/// Returns the two middle values, which are equal for an odd number of values, and changes the
/// order of the values. Returns `None` if there are no values.
pub(super) fn middle_values(values: &mut [f64]) -> Option<[f64; 2]> {
    let count = values.len();
    let middle = count.checked_sub(1)? / 2;
    let (_, &mut lower, above) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let upper = if count.is_multiple_of(2) {
        above.iter().copied().fold(f64::INFINITY, f64::min)
    } else {
        lower
    };
    Some([lower, upper])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topography::surface::samples::scan;

    const FITS: [LineFit; 4] = [
        LineFit::Median,
        LineFit::Differences,
        LineFit::Polynomial { degree: 0 },
        LineFit::Polynomial { degree: 3 },
    ];

    fn is_in_hole(i: usize, j: usize) -> bool {
        (3..9).contains(&i) && (2..7).contains(&j) || (i * 7 + j * 3).is_multiple_of(11)
    }

    fn rough(x: f64, y: f64) -> f64 {
        libm::sin(37.0 * x + 11.0 * y * y) + 0.2 * x * y
    }

    /// Returns an irregular offset of a line.
    fn offset(line: usize) -> f64 {
        10.0 * libm::sin(7.3 * (line * line) as f64)
    }

    fn largest_difference(one: &Scan, other: &Scan) -> f64 {
        let pairs = one.measured().zip(other.measured());
        pairs.map(|((_, one), (_, other))| (one - other).abs()).fold(0.0, f64::max)
    }

    /// Returns the map with the offset of each line added.
    fn with_offsets(map: &Scan, along: Axis) -> Scan {
        let nodes_y = map.grid().nodes()[1];
        map.map_measured(|node, height| {
            height + offset(along.select([node % nodes_y, node / nodes_y]))
        })
    }

    #[test]
    fn a_plane_along_the_lines_with_offsets_of_lines_is_restored() {
        let [size_x, size_y] = [2.0, 1.0];
        let holes: [fn(usize, usize) -> bool; 2] =
            [|_, _| false, |i, j| i.is_multiple_of(5) && j == 3];
        for along in Axis::BOTH {
            for is_missing in holes {
                let plane = |x: f64, y: f64| 3.0 * along.select([x / size_x, y / size_y]);
                let map = scan([15, 15], [size_x, size_y], plane, is_missing);
                for by in [LineFit::Differences, LineFit::Median] {
                    let aligned = Alignment { along, by }.align(&with_offsets(&map, along));
                    assert_eq!(aligned.missing(), map.missing());
                    // The mean of all offsets stays, and missing points move the median of a line.
                    let height = |node: usize| aligned.heights()[node] - map.heights()[node];
                    let shift = height(16);
                    let is_exact = map.missing() == 0 || by == LineFit::Differences;
                    for (node, _) in map.measured().filter(|_| is_exact) {
                        assert!((height(node) - shift).abs() < 1e-13, "{along:?} {by:?} {node}");
                    }
                }
            }
        }
    }

    #[test]
    fn offsets_of_lines_change_only_the_mean() {
        for along in Axis::BOTH {
            let map = scan([20, 17], [1.0, 1.5], rough, is_in_hole);
            for by in FITS {
                let alignment = Alignment { along, by };
                let [aligned, of_shifted] =
                    [map.clone(), with_offsets(&map, along)].map(|map| alignment.align(&map));
                let shift =
                    of_shifted.measured().next().unwrap().1 - aligned.measured().next().unwrap().1;
                let moved = aligned.map_measured(|_, height| height + shift);
                assert!(largest_difference(&moved, &of_shifted) < 1e-13, "{along:?} {by:?}");
            }
        }
    }

    #[test]
    fn a_polynomial_of_its_degree_is_removed_from_each_line() {
        for along in Axis::BOTH {
            for degree in 0..=MAX_DEGREE {
                let bow = |x: f64, y: f64| {
                    let [along, across] = [along.select([x, y]), along.select([y, x])];
                    (1.0 + across) * (1e3 + 5.0 * along.powi(degree as i32))
                };
                let map = scan([31, 23], [1.0, 0.8], bow, is_in_hole);
                let by = LineFit::Polynomial { degree };
                let aligned = Alignment { along, by }.align(&map);
                let mean = map.measured().map(|(_, height)| height).sum::<f64>()
                    / map.measured().count() as f64;
                for (_, height) in aligned.measured() {
                    assert!((height - mean).abs() < 3e-12 * mean, "{along:?} {degree}: {height}");
                }
            }
        }
    }

    #[test]
    fn the_mean_stays_and_a_constant_is_only_added() {
        let map = scan([20, 17], [1.0, 1.5], rough, is_in_hole);
        let sum = |map: &Scan| map.measured().map(|(_, height)| height).sum::<f64>();
        for (along, by) in Axis::BOTH.into_iter().flat_map(|along| FITS.map(|by| (along, by))) {
            let alignment = Alignment { along, by };
            let aligned = alignment.align(&map);
            assert!((sum(&aligned) - sum(&map)).abs() < 1e-12, "{by:?}");
            let raised = alignment.align(&map.map_measured(|_, height| height + 4.0));
            let lowered = raised.map_measured(|_, height| height - 4.0);
            assert!(largest_difference(&lowered, &aligned) < 1e-14, "{by:?}");
        }
    }

    #[test]
    fn aligned_lines_stay_as_they_are() {
        let map = scan([20, 17], [1.0, 1.5], rough, is_in_hole);
        for (along, by) in Axis::BOTH.into_iter().flat_map(|along| FITS.map(|by| (along, by))) {
            let alignment = Alignment { along, by };
            let once = alignment.align(&map);
            assert!(largest_difference(&alignment.align(&once), &once) < 1e-14, "{by:?}");
        }
    }

    #[test]
    fn lines_with_few_points_or_none_are_aligned() {
        // The first line has one point, the third line has none.
        let map = scan([6, 4], [1.0, 1.0], rough, |i, j| (j == 0 && i != 2) || j == 2);
        for by in FITS {
            let aligned = Alignment { along: Axis::X, by }.align(&map);
            assert_eq!(aligned.missing(), map.missing());
            assert!(aligned.measured().all(|(_, height)| height.is_finite()));
        }
        let nothing = scan([6, 4], [1.0, 1.0], rough, |_, _| true);
        for by in FITS {
            assert_eq!(Alignment { along: Axis::X, by }.align(&nothing).missing(), 24);
        }
    }

    #[test]
    fn the_median_of_an_even_number_is_the_mean_of_the_middle_ones() {
        assert_eq!(median(&mut [3.0, 1.0, 10.0, 2.0]), Some(2.5));
        assert_eq!(median(&mut [3.0, 1.0, 10.0]), Some(3.0));
        assert_eq!(median(&mut []), None);
    }
}
