//! A measured map in one line, for messages.

use std::fmt;

use super::plausibility::slope_and_span;
use asperity_manifest::keys::quantity;
use asperity_mechanics::grid::{Boundary, Grid};
use asperity_mechanics::topography::fill::Fill;
use asperity_mechanics::topography::level::Level;
use asperity_mechanics::topography::reliability::{NoiseFloor, NoiseShare};
use asperity_mechanics::topography::surface::{Scan, Window};

/// Share of the mean square slope from noise above which users are warned.
const MUCH_NOISE: f64 = 0.1;

/// Share of the mean square slope below which noise is not told: heights in single precision have
/// noise, too.
const LITTLE_NOISE: f64 = 1e-3;

/// Maximum number of points along each side of the part of a map in which noise is searched.
const MOST_POINTS: usize = 512;

/// Properties of a measured map, after its mean plane was subtracted.
#[derive(Debug, Clone, PartialEq)]
pub struct DescribedMap {
    grid: Grid,
    /// Name of the unit of length; empty if it is unknown.
    unit: String,
    rms_height: f64,
    /// Rms slope from differences between neighbouring points.
    rms_slope: f64,
    missing: usize,
    /// White noise of the map; `None` if its spectrum has no plateau, if no point was measured, and
    /// for profiles.
    pub noise: Option<NoiseShare>,
}

impl DescribedMap {
    /// Describes a map. Noise is searched in the middle of a large map, because more points would
    /// hardly change it. Missing points are filled by Laplace's equation before.
    pub fn new(map: Scan, unit: &str, boundary: Boundary) -> DescribedMap {
        let levelled = Level::Plane.level(map);
        let (grid, missing) = (levelled.grid(), levelled.missing());
        let count = levelled.measured().count().max(1) as f64;
        let square = levelled.measured().map(|(_, height)| height * height).sum::<f64>();
        let (rms_slope, _) = slope_and_span(grid, levelled.heights());
        let (part, boundary) = match central(&levelled) {
            Some(part) => (part, Boundary::Free),
            None => (levelled, boundary),
        };
        let complete = Fill::Harmonic.fill(part, boundary == Boundary::Periodic);
        DescribedMap {
            grid,
            unit: unit.to_owned(),
            rms_height: (square / count).sqrt(),
            rms_slope,
            missing,
            noise: complete
                .ok()
                .and_then(|map| NoiseFloor::with_share(&map, boundary))
                .filter(|noise| noise.share >= LITTLE_NOISE && grid.nodes()[1] > 1),
        }
    }

    fn shown(&self, length: f64) -> String {
        quantity::range([length].into_iter(), Some(&self.unit)).unwrap_or_default()
    }

    /// Formats lengths along x and y with one unit, if both have the same.
    fn pair(&self, lengths: [f64; 2]) -> String {
        let [x, y] = lengths.map(|length| self.shown(length));
        match x.rsplit_once(' ').zip(y.rsplit_once(' ')) {
            Some(((number, unit), (_, other))) if unit == other => format!("{number} × {y}"),
            _ => format!("{x} × {y}"),
        }
    }

    /// Returns a warning if noise has much of the mean square slope of the map. `name` names the
    /// map.
    pub fn warning(&self, name: &str) -> Option<String> {
        let NoiseShare { floor, share } = self.noise.filter(|noise| noise.share > MUCH_NOISE)?;
        Some(format!(
            "noise with an rms height of {} has {:.0} % of the mean square slope of {name}, and \
             makes its contact area too small; `noise_floor = true` with `low_pass = \"reliable\"` \
             removes the waves shorter than {}, in which it prevails",
            self.shown(floor.rms_height),
            100.0 * share,
            self.shown(floor.wavelength)
        ))
    }
}

impl fmt::Display for DescribedMap {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [nodes_x, nodes_y] = self.grid.nodes();
        let steps = match self.grid.has_square_cells() {
            true => self.shown(self.grid.spacing()[0]),
            false => self.pair(self.grid.spacing()),
        };
        let slope = quantity::range([self.rms_slope].into_iter(), None).unwrap_or_default();
        if nodes_y == 1 {
            let [length, height] =
                [self.grid.cell().size()[0], self.rms_height].map(|length| self.shown(length));
            return write!(
                formatter,
                "profile of {length}, {nodes_x} points with a step of {}, Rq {height}, rms slope {slope}",
                self.shown(self.grid.spacing()[0]),
            );
        }
        write!(
            formatter,
            "{} along x and y, {nodes_x} × {nodes_y} points with steps of {steps}, rms height {}, \
             rms slope {slope}",
            self.pair(self.grid.cell().size()),
            self.shown(self.rms_height),
        )?;
        match self.missing {
            0 => {}
            missing => {
                let share = 100.0 * missing as f64 / self.grid.count() as f64;
                write!(formatter, ", {missing} points missing ({share:.2} %)")?;
            }
        }
        match &self.noise {
            None => write!(formatter, ", no plateau of noise found"),
            Some(NoiseShare { floor, share }) => write!(
                formatter,
                ", noise {} with {:.1} % of the mean square slope",
                self.shown(floor.rms_height),
                100.0 * share
            ),
        }
    }
}

/// Returns the middle of a map with too many points along a side.
fn central(map: &Scan) -> Option<Scan> {
    let all = map.grid().nodes();
    let nodes = all.map(|nodes| nodes.min(MOST_POINTS));
    let first = [0, 1].map(|axis| (all[axis] - nodes[axis]) / 2);
    (nodes != all).then(|| map.cropped(Window { first, nodes }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_mechanics::grid::Cell;
    use asperity_mechanics::topography::surface::Surface;

    #[test]
    fn a_map_is_told_with_its_sides_in_a_readable_unit_and_without_its_tilt() {
        let grid = Grid::new([40, 20], Cell::new([80e-6, 10e-6]).unwrap()).unwrap();
        let heights = (0..grid.count()).map(|node| {
            let [i, j] = grid.indices(node).map(|index| index as f64);
            1e-6 * libm::sin(0.3 * i) + 1e-5 * j
        });
        let map = Surface::new(grid, heights.collect()).unwrap();
        let text = DescribedMap::new(map.into(), "m", Boundary::Free).to_string();
        let start =
            "80 × 10 µm along x and y, 40 × 20 points with steps of 2 µm × 500 nm, rms height 6";
        assert!(text.starts_with(start), "{text}");
        assert!(text.ends_with("no plateau of noise found"), "{text}");
    }

    #[test]
    fn a_profile_is_told_with_its_length() {
        let grid = Grid::new([40, 1], Cell::new([80e-6, 2e-6]).unwrap()).unwrap();
        let heights = (0..grid.count()).map(|node| 1e-6 * (node % 2) as f64);
        let profile = Surface::new(grid, heights.collect()).unwrap();
        let text = DescribedMap::new(profile.into(), "m", Boundary::Free).to_string();
        let start = "profile of 80 µm, 40 points with a step of 2 µm, Rq ";
        assert!(text.starts_with(start) && text.contains(", rms slope 0."), "{text}");
    }
}
