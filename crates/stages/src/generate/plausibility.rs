//! Warnings of maps whose heights or sides were probably read in another unit.
//!
//! A file whose unit is misread looks like any other map: all its numbers are off by one factor.
//! Slopes of solid surfaces are within known bounds, and most pixels are square.

use std::fmt;

use asperity_manifest::keys::quantity;
use asperity_mechanics::grid::{Boundary, Grid};
use asperity_mechanics::topography::fill::Fill;
use asperity_mechanics::topography::level::Level;
use asperity_mechanics::topography::reliability::{NoiseFloor, NoiseShare};
use asperity_mechanics::topography::surface::{Scan, Window};

/// Rms slope above which a map is improbable. Contact theories assume slopes below it.
pub const STEEP: f64 = 1.0;

/// Largest rms slope that a mistake in the unit would explain.
const USUAL_SLOPE: f64 = 0.5;

/// Largest difference between the sides of a pixel that counts as rounding.
const UNEVEN: f64 = 0.03;

/// A map as it enters the program.
#[derive(Debug, Clone, Copy)]
pub struct EnteredMap<'a> {
    /// Grid of the map, with its sides in `unit`.
    pub grid: Grid,
    /// Name of the unit of length; empty if it is unknown.
    pub unit: &'a str,
    /// Rms slope, from differences between neighbouring points.
    pub rms_slope: f64,
    /// Difference between the highest and the lowest point, in `unit`.
    pub height_span: f64,
    /// True if the user gives the sides, and not the file.
    pub has_given_sides: bool,
}

impl EnteredMap<'_> {
    /// Returns a warning for each property of the map that is implausible. `name` names the map.
    pub fn warnings(&self, name: &str) -> Vec<String> {
        self.too_steep(name).into_iter().chain(self.uneven(name)).collect()
    }

    fn shown(&self, length: f64) -> String {
        quantity::range([length].into_iter(), Some(self.unit)).unwrap_or_default()
    }

    fn sides(&self) -> String {
        let [x, y] = self.grid.cell().size().map(|side| self.shown(side));
        if x == y { x } else { format!("{x} × {y}") }
    }

    /// Warns of a slope that no solid surface has, or of heights that span more than the side.
    fn too_steep(&self, name: &str) -> Option<String> {
        let is_high = self.height_span > self.grid.cell().longer_side();
        (self.rms_slope > STEEP || is_high).then(|| {
            format!(
                "the rms slope of {name} is {}, with heights that span {} on {}{}",
                number(self.rms_slope),
                self.shown(self.height_span),
                self.sides(),
                reading_of(self.rms_slope)
            )
        })
    }

    /// Warns of given sides with which pixels are not square, although the same sides in the other
    /// order, or sides in the ratio of the nodes, make them square.
    fn uneven(&self, name: &str) -> Option<String> {
        let ([nodes_x, nodes_y], [x, y]) = (self.grid.nodes(), self.grid.cell().size());
        let [nodes_x, nodes_y] = [nodes_x as f64, nodes_y as f64];
        let is_square = |x: f64, y: f64| (x / nodes_x / (y / nodes_y) - 1.0).abs() <= UNEVEN;
        let meant = if !self.has_given_sides || is_square(x, y) {
            return None;
        } else if x == y {
            [x, x * nodes_y / nodes_x]
        } else if is_square(y, x) {
            [y, x]
        } else {
            return None;
        };
        let [across, along] = self.grid.spacing().map(|step| self.shown(step));
        let [meant_x, meant_y] = meant.map(|side| self.shown(side));
        Some(format!(
            "the pixels of {name} are {across} × {along}; if they are square, the sides along x and y \
             are {meant_x} × {meant_y}"
        ))
    }
}

/// Returns the advice about an rms slope that is too large: which unit of the heights makes it
/// usual.
pub fn reading_of(rms_slope: f64) -> String {
    let units = [(1e3, "nm in place of µm"), (1e6, "nm in place of mm"), (1e9, "nm in place of m")];
    let reading = units.iter().find(|(factor, _)| rms_slope / factor <= USUAL_SLOPE);
    match reading {
        Some((factor, units)) => format!(
            "; check the unit of the heights: {units} would give an rms slope of {}",
            number(rms_slope / factor)
        ),
        None => "; a marker of missing points may have been read as a height".to_owned(),
    }
}

/// Formats a number with three digits.
fn number(value: f64) -> String {
    quantity::range([value].into_iter(), None).unwrap_or_default()
}

/// Returns the rms slope of a map from the differences between neighbouring points, √(⟨(Δh/Δx)²⟩ +
/// ⟨(Δh/Δy)²⟩), and the difference between the highest and the lowest point. Missing points, which
/// are not finite, are left out.
pub fn slope_and_span(grid: Grid, heights: &[f64]) -> (f64, f64) {
    let [nodes_x, nodes_y] = grid.nodes();
    let steps = [(nodes_x, nodes_y), (nodes_y, 1)];
    let squares = steps.iter().zip(grid.spacing()).map(|(&(nodes, stride), spacing)| {
        let (mut sum, mut count) = (0.0, 0_usize);
        for (node, height) in heights.iter().enumerate() {
            let is_last = node / stride % nodes + 1 == nodes;
            let step = if is_last { f64::NAN } else { heights[node + stride] - height };
            if step.is_finite() {
                sum += (step / spacing) * (step / spacing);
                count += 1;
            }
        }
        sum / count.max(1) as f64
    });
    let finite = || heights.iter().copied().filter(|height| height.is_finite());
    let span = finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min);
    (squares.sum::<f64>().sqrt(), if span.is_finite() { span } else { 0.0 })
}

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

    fn map<'a>(nodes: [usize; 2], sides: [f64; 2], unit: &'a str) -> EnteredMap<'a> {
        EnteredMap {
            grid: Grid::new(nodes, Cell::new(sides).unwrap()).unwrap(),
            unit,
            rms_slope: 0.1,
            height_span: 0.0,
            has_given_sides: false,
        }
    }

    fn warned(map: EnteredMap<'_>) -> String {
        map.warnings("`a`").join("\n")
    }

    #[test]
    fn the_slope_of_a_plane_is_its_gradient_and_missing_points_are_left_out() {
        let grid = Grid::new([4, 3], Cell::new([8.0, 3.0]).unwrap()).unwrap();
        let mut heights: Vec<f64> =
            (0..12).map(|node| 3.0 * 2.0 * (node / 3) as f64 + 4.0 * (node % 3) as f64).collect();
        heights[5] = f64::NAN;
        let (slope, span) = slope_and_span(grid, &heights);
        assert!((slope - 5.0).abs() < 1e-12, "{slope}");
        assert_eq!(span, 26.0);
        assert_eq!(slope_and_span(grid, &[f64::NAN; 12]), (0.0, 0.0));
    }

    #[test]
    fn a_steep_map_is_told_with_the_unit_that_would_make_it_plausible() {
        let plausible = map([64; 2], [1e-4; 2], "m");
        assert_eq!(warned(plausible), "");
        let steep = EnteredMap { rms_slope: 88.6, height_span: 4.1e-4, ..plausible };
        assert_eq!(
            warned(steep),
            "the rms slope of `a` is 88.6, with heights that span 410 µm on 100 µm; check the unit \
             of the heights: nm in place of µm would give an rms slope of 0.0886"
        );
        let far = warned(EnteredMap { rms_slope: 78039.0, ..plausible });
        assert!(far.ends_with("nm in place of mm would give an rms slope of 0.078"), "{far}");
        let marker = warned(EnteredMap { rms_slope: 1e34, height_span: 1e29, ..plausible });
        assert!(marker.contains("a marker of missing points"), "{marker}");
        let high = EnteredMap { height_span: 1.01e-4, ..plausible };
        assert!(warned(high).contains("span 101 µm on 100 µm"), "{}", warned(high));
    }

    #[test]
    fn given_sides_whose_pixels_are_square_in_the_other_order_are_told() {
        let given =
            |nodes, sides| warned(EnteredMap { has_given_sides: true, ..map(nodes, sides, "µm") });
        assert_eq!(given([640, 480], [64.0, 48.0]), "");
        let swapped = given([640, 480], [48.0, 64.0]);
        assert!(swapped.ends_with("the sides along x and y are 64 µm × 48 µm"), "{swapped}");
        assert!(given([640, 480], [64.0; 2]).ends_with("64 µm × 48 µm"));
        // Lines of a stylus are farther apart than points, and the user says so.
        assert_eq!(given([1000, 100], [1000.0, 2000.0]), "");
        assert_eq!(warned(map([640, 480], [48.0, 64.0], "µm")), "");
    }
}

#[cfg(test)]
mod tests_of_described_map {
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
