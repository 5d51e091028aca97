//! Heights for the points of a map that were not measured.
//!
//! A contact problem needs a height everywhere, and none of these is what was there: smooth where the
//! instrument lost its signal on steep flanks, flat where it did on a step, never a peak. Holes are
//! therefore filled only when the manifest says how, and rows count the nodes.

use serde::{Deserialize, Serialize};

use super::scan::{MissingPoints, Scan};
use super::surface::Surface;

mod harmonic;
mod nearest;

/// What becomes of points that were not measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fill {
    /// A map that has any is refused.
    #[default]
    Error,
    /// The solution of Laplace's equation in each hole: the smoothest surface between its edges, and
    /// no higher or lower than they are.
    Harmonic,
    /// The height of the nearest point that was measured.
    Nearest,
    /// The lowest height of the map, which touches last.
    Lowest,
}

impl Fill {
    /// The word used in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Fill::Error => "error",
            Fill::Harmonic => "harmonic",
            Fill::Nearest => "nearest",
            Fill::Lowest => "lowest",
        }
    }

    /// The surface of a map. Holes of a periodic map reach over its edges; at the edges of any other
    /// the slope across them is zero where Laplace's equation is solved.
    ///
    /// # Errors
    /// When points are missing and nothing fills them: [`Fill::Error`], or no point was measured.
    pub fn fill(self, scan: Scan, is_periodic: bool) -> Result<Surface, MissingPoints> {
        if scan.missing() == 0 || scan.measured().next().is_none() {
            return scan.whole();
        }
        match self {
            Fill::Error => scan,
            Fill::Harmonic => harmonic::filled(scan, is_periodic),
            Fill::Nearest => nearest::filled(scan, is_periodic),
            Fill::Lowest => lowest(scan),
        }
        .whole()
    }
}

fn lowest(scan: Scan) -> Scan {
    let heights = scan.measured().map(|(_, height)| height);
    let lowest = heights.fold(f64::INFINITY, f64::min);
    let missing = (0..scan.heights().len()).filter(|&node| scan.is_missing(node));
    let missing: Vec<usize> = missing.collect();
    scan.with(missing.into_iter().map(|node| (node, lowest)))
}

#[cfg(test)]
mod tests {
    use super::super::scan::samples::scan;
    use super::*;

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
            assert_eq!(fill.fill(map.clone(), false), map.clone().whole());
        }
    }
}
