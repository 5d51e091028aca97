//! Filling of the missing points of measured maps.
//!
//! A contact problem needs a height at every node. A filled height is not a measurement: it is
//! smooth where the instrument lost its signal on a steep flank, and it is never a peak. The
//! default is therefore an error, and [`Prepared`](super::preparation::Prepared) counts the filled
//! nodes.
//!
//! [`Fill::Nearest`] measures the distance in length, not in nodes. It first searches each line
//! along y, then compares the lines, from the line of the missing point outwards. Of equally near
//! points, it takes the one on the nearest line, then the one of smaller x, then of smaller y.

use serde::{Deserialize, Serialize};

use super::surface::{MissingPoints, Scan, Surface};

mod harmonic;

/// Method to fill missing points of a measured map.
///
/// The solution of Laplace's equation is the smoothest surface in a hole, and its heights are
/// between the lowest and the highest height at the rim of the hole. Points filled with the lowest
/// height of the map are the last to make contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Fill {
    /// No filling: missing points are an error.
    #[default]
    Error,
    /// Solution of Laplace's equation in each hole, with the measured heights at its rim.
    Harmonic,
    /// Height of the nearest measured point.
    Nearest,
    /// Lowest measured height of the map.
    Lowest,
}

impl Fill {
    /// Returns the name used in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Fill::Error => "error",
            Fill::Harmonic => "harmonic",
            Fill::Nearest => "nearest",
            Fill::Lowest => "lowest",
        }
    }

    /// Gives a height to each missing point of a map.
    ///
    /// If `is_periodic`, holes continue across the edges. Otherwise [`Fill::Harmonic`] has zero
    /// normal slope at the edges.
    ///
    /// # Errors
    /// Fails if points are missing and the method is [`Fill::Error`], or if no point was measured.
    pub fn fill(self, scan: Scan, is_periodic: bool) -> Result<Surface, MissingPoints> {
        if scan.missing() == 0 || scan.measured().next().is_none() {
            return scan.into_surface();
        }
        match self {
            Fill::Error => scan,
            Fill::Harmonic => harmonic::filled(scan, is_periodic),
            Fill::Nearest => filled(scan, is_periodic),
            Fill::Lowest => lowest(scan),
        }
        .into_surface()
    }
}

fn lowest(scan: Scan) -> Scan {
    let heights = scan.measured().map(|(_, height)| height);
    let lowest = heights.fold(f64::INFINITY, f64::min);
    let missing: Vec<usize> =
        (0..scan.heights().len()).filter(|&node| scan.is_missing(node)).collect();
    scan.with(missing.into_iter().map(|node| (node, lowest)))
}

/// Gives each missing point the height of the nearest measured point.
fn filled(scan: Scan, is_periodic: bool) -> Scan {
    let [nodes_x, nodes_y] = scan.grid().nodes();
    let [step_x, step_y] = scan.grid().spacing();
    let in_line = nearest_in_lines(&scan, is_periodic);
    let farthest = if is_periodic { nodes_x / 2 } else { nodes_x - 1 };
    let nearest = |node: usize| {
        let (i, j) = (node / nodes_y, node % nodes_y);
        let mut best: Option<(f64, usize)> = None;
        for lines in 0..=farthest {
            let across = (lines as f64 * step_x).powi(2);
            if best.is_some_and(|(square, _)| across >= square) {
                break;
            }
            for line in beside(i, lines, nodes_x, is_periodic).into_iter().flatten() {
                if let Some((steps, other)) = in_line[line * nodes_y + j] {
                    let square = across + (steps as f64 * step_y).powi(2);
                    if best.is_none_or(|(least, _)| square < least) {
                        best = Some((square, line * nodes_y + other as usize));
                    }
                }
            }
        }
        best.map_or(f64::NAN, |(_, node)| scan.heights()[node])
    };
    let missing = (0..nodes_x * nodes_y).filter(|&node| scan.is_missing(node));
    let found: Vec<(usize, f64)> = missing.map(|node| (node, nearest(node))).collect();
    scan.with(found)
}

/// Returns the indices of the lines at a distance of `lines` lines before and after `line`, in
/// ascending order, on a map of `of` lines. A line outside the map is `None`.
fn beside(line: usize, lines: usize, of: usize, is_periodic: bool) -> [Option<usize>; 2] {
    let (below, above) = if is_periodic {
        (Some((line + of - lines) % of), Some((line + lines) % of))
    } else {
        (line.checked_sub(lines), Some(line + lines).filter(|line| *line < of))
    };
    let mut both = [below, above.filter(|_| below != above)];
    both.sort_by_key(|line| line.unwrap_or(usize::MAX));
    both
}

/// Finds, for each node, the nearest measured node on its line along y. Returns the distance in
/// grid spacings and the index j of that node, or `None` if no node of the line was measured.
fn nearest_in_lines(scan: &Scan, is_periodic: bool) -> Vec<Option<(u32, u32)>> {
    let nodes_y = scan.grid().nodes()[1];
    let mut nearest = vec![None; scan.heights().len()];
    // On a periodic map, a second pass along the line continues across the edges.
    let turns = if is_periodic { 2 } else { 1 };
    for (line, nearest) in
        scan.heights().chunks_exact(nodes_y).zip(nearest.chunks_exact_mut(nodes_y))
    {
        for is_backward in [false, true] {
            let mut last = None;
            for step in 0..turns * nodes_y {
                let at = step % nodes_y;
                let j = if is_backward { nodes_y - 1 - at } else { at };
                if !line[j].is_nan() {
                    last = Some((step, j));
                }
                if let Some((found, at)) = last {
                    let found = ((step - found) as u32, at as u32);
                    nearest[j] =
                        Some(nearest[j].map_or(found, |known: (u32, u32)| known.min(found)));
                }
            }
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topography::surface::samples::scan;

    const FILLS: [Fill; 3] = [Fill::Harmonic, Fill::Nearest, Fill::Lowest];

    #[test]
    fn what_was_measured_stays_and_what_was_not_lies_between() {
        let rough = |x: f64, y: f64| libm::sin(29.0 * x + y) * libm::cos(17.0 * y);
        let map = scan([19, 14], [1.0, 2.0], rough, |i, j| (i * i + 5 * j) % 7 < 3);
        let heights = || map.measured().map(|(_, height)| height);
        let lowest = heights().fold(f64::INFINITY, f64::min);
        let highest = heights().fold(f64::NEG_INFINITY, f64::max);
        for (fill, is_periodic) in FILLS.into_iter().flat_map(|fill| [(fill, false), (fill, true)])
        {
            let filled = fill.fill(map.clone(), is_periodic).unwrap();
            for (node, height) in map.measured() {
                assert_eq!(filled.heights()[node], height);
            }
            let is_between = |height: &f64| (lowest..=highest).contains(height);
            assert!(filled.heights().iter().all(is_between), "{fill:?}");
        }
    }

    #[test]
    fn holes_are_an_error_unless_something_fills_them() {
        let map = scan([4, 5], [1.0, 1.0], |x, _| x, |i, j| i == 2 && j > 1);
        let missing = MissingPoints { missing: 3, count: 20 };
        assert_eq!(Fill::Error.fill(map, false), Err(missing));
        let nothing = scan([4, 5], [1.0, 1.0], |x, _| x, |_, _| true);
        for fill in FILLS {
            let error = fill.fill(nothing.clone(), true).unwrap_err();
            assert_eq!(error.missing, error.count, "{fill:?}");
        }
    }

    #[test]
    fn a_whole_map_is_left_alone() {
        let map = scan([4, 5], [1.0, 1.0], |x, y| x * y, |_, _| false);
        for fill in [Fill::Error].into_iter().chain(FILLS) {
            assert_eq!(fill.fill(map.clone(), false), map.clone().into_surface());
        }
    }

    /// Returns the squared distance from `node` to the nearest measured node, by exhaustive search.
    fn distance(map: &Scan, node: usize, is_periodic: bool) -> f64 {
        let grid = map.grid();
        let here = grid.indices(node);
        let squares = map.measured().map(|(other, _)| {
            let there = grid.indices(other);
            let along = |axis: usize| {
                let steps = here[axis].abs_diff(there[axis]);
                let around = grid.nodes()[axis] - steps;
                let steps = if is_periodic { steps.min(around) } else { steps };
                (steps as f64 * grid.spacing()[axis]).powi(2)
            };
            along(0) + along(1)
        });
        squares.fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn every_hole_gets_the_height_of_a_nearest_point() {
        // Each node has a different height, which identifies the node.
        let name = |x: f64, y: f64| 1e3 * x + y;
        let is_missing = |i: usize, j: usize| (i * i + 3 * j * j) % 13 > 2 || (6..12).contains(&i);
        for size in [[2.0, 1.5], [1.0, 9.0]] {
            let map = scan([20, 15], size, name, is_missing);
            for is_periodic in [false, true] {
                let filled = filled(map.clone(), is_periodic);
                for node in 0..300 {
                    let height = filled.heights()[node];
                    let source = map.measured().find(|(_, known)| *known == height).unwrap().0;
                    let alone = scan([20, 15], size, name, |i, j| i * 15 + j != source);
                    let found = distance(&alone, node, is_periodic);
                    let least = distance(&map, node, is_periodic);
                    assert!(found <= least * (1.0 + 1e-14), "{node}: {found} {least}");
                }
            }
        }
    }

    #[test]
    fn of_equally_near_points_the_one_with_the_smallest_index_is_chosen() {
        let row = scan([1, 5], [1.0, 5.0], |_, y| y, |_, j| j == 2);
        assert_eq!(filled(row, false).heights()[2], 1.0);
        let column = scan([5, 1], [5.0, 1.0], |x, _| x, |i, _| i == 2);
        assert_eq!(filled(column, false).heights()[2], 1.0);
    }
}
