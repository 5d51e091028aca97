//! Preparation of a measured map: the steps from a [`Scan`] to a complete [`Surface`].
//!
//! The steps have a fixed order:
//!
//! 1. [`Crop`] selects a rectangle of the measured nodes.
//! 2. [`Spikes`] and then [`islands`] make points missing that are errors of the instrument. They
//!    precede all fits, which such points would distort. Islands follow because points that were
//!    connected by spikes may be islands without them. If lines are aligned later, spikes are
//!    searched in a map aligned by differences of lines, because an offset of a line is no spike.
//! 3. [`Alignment`] subtracts the offsets of the scan lines. It precedes [`Level`] because a form
//!    that is fitted to the whole map would contain a part of the offsets, and because it tilts the
//!    map.
//! 4. [`Level`] or [`ThreePoints`] subtracts the form, which [`Level`] fits to the measured points.
//!    It precedes [`Fill`] because filled heights must not enter the fit.
//! 5. [`Fill`] gives heights to missing points. It follows [`Level`] so that the lowest point
//!    belongs to the roughness and not to a tilt.
//! 6. [`Reliability`] finds the shortest wavelength that the instrument resolved. It precedes the
//!    filters, which would hide the tip and the noise. The tip is compared with the map before
//!    [`Fill`], because filled heights are not those of an instrument.
//! 7. [`high_pass`] and [`low_pass`] filter waves by their length. They need a map without holes.
//!    They follow [`Level`] because the form would distort the results near the edges.
//! 8. [`resampled`] interpolates on another grid. It follows [`low_pass`], which determines the
//!    shortest waves that the grid must resolve.
//! 9. [`Edges`] makes the map periodic, or leaves it as it is.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::alignment::{Alignment, LineFit};
use super::fill::Fill;
use super::gaussian::{high_pass, low_pass};
use super::level::{Level, ThreePoints, ThreePointsError};
use super::outliers::{Spikes, islands};
use super::periodic::{Edges, mirror, resampled};
use super::reliability::{Reliability, Tip};
use super::surface::{Axis, MissingPoints, Scan, Surface, Window};
use crate::grid::{Boundary, Grid};

/// Steps that turn a measured map into a surface. Steps that are `None` are skipped.
///
/// `Some(Level::None)` removes no form, like `None`, but it is serialised. Studies that vary
/// `level` use it as one of the values.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Preparation {
    /// Part of the map to keep.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crop: Option<Crop>,
    /// Spikes that become missing points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spikes: Option<Spikes>,
    /// Maximum number of points of an island. The points of islands become missing points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub islands: Option<u32>,
    /// Alignment of the scan lines.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub align: Option<Alignment>,
    /// Form to remove from the map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<Level>,
    /// Positions on the plane to remove, instead of `level`. They are relative to the first node of
    /// the map before its crop.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level_through: Option<ThreePoints>,
    /// Method to fill missing points; `None` is the same as [`Fill::Error`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fill: Option<Fill>,
    /// Cutoff wavelength of the high-pass filter, in the unit of the sides. Longer waves are
    /// attenuated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub high_pass: Option<f64>,
    /// Cutoff of the low-pass filter. Shorter waves are attenuated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub low_pass: Option<LowPass>,
    /// Numbers of nodes along x and y after resampling. Resampling treats the map as periodic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resample: Option<[u32; 2]>,
    /// Radius of the tip of the instrument, in the unit of the sides, for the reliability of the
    /// map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_radius: Option<f64>,
    /// Direction of the scan lines, along which peaks are compared with the tip. Omitted from the
    /// recipe if it is x, so that existing keys stay valid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_along: Option<Axis>,
    /// True if the noise of the map is analysed for its reliability.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub noise_floor: bool,
}

/// Cutoff wavelength of the low-pass filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum LowPass {
    /// Wavelength in the unit of the sides.
    Wavelength(f64),
    /// The shortest reliable wavelength of the map.
    Found(FoundCutoff),
}

/// Cutoff wavelength that follows from the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FoundCutoff {
    /// [`Reliability::wavelength`].
    Reliable,
}

/// Numbers of measured points that a preparation removed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Removed {
    /// Number of spikes.
    pub spikes: usize,
    /// Number of points of islands.
    pub islands: usize,
}

impl Removed {
    /// Returns the number of all removed points.
    pub fn points(self) -> usize {
        self.spikes + self.islands
    }
}

/// A map after the steps that precede its filling.
#[derive(Debug, Clone)]
pub struct Levelled {
    /// Heights, with missing points where the map was not measured or points were removed.
    pub scan: Scan,
    /// Numbers of removed points.
    pub removed: Removed,
}

/// Result of a preparation: a complete surface that is not flat.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    /// Heights after all steps of the preparation.
    pub surface: Surface,
    /// Numbers of measured points that have been removed.
    pub removed: Removed,
    /// Number of missing points, removed ones included, that have been filled.
    pub filled: usize,
    /// Shortest wavelength that the instrument resolved; `None` if neither the tip nor the noise
    /// was analysed.
    pub reliability: Option<Reliability>,
}

/// Reason why the preparation of a map failed.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the error messages document the variants")]
pub enum PreparationError {
    #[error("cannot crop the map")]
    Crop(#[from] CropError),
    #[error("cannot level the map")]
    ThreePoints(#[from] ThreePointsError),
    #[error(transparent)]
    Missing(#[from] MissingPoints),
    #[error("the prepared map is flat; remove less form, or choose other cutoffs")]
    Flat,
    #[error("the reliable wavelength of the map is unknown; give `tip_radius` or `noise_floor`")]
    NoReliability,
}

/// Maximum ratio of the height ranges after and before the preparation at which the remaining
/// heights are only rounding errors. Such a map counts as flat.
const FLAT: f64 = 1e-12;

impl Preparation {
    /// Applies the steps before the filling: crop, removal of spikes and islands, alignment of the
    /// lines, and removal of the form. Points may be missing.
    ///
    /// # Errors
    /// Fails if the crop is not inside the map, or if the three points of `level_through` give no
    /// plane.
    pub fn levelled(&self, scan: Scan, edges: Edges) -> Result<Levelled, PreparationError> {
        let (mut part, first) = match &self.crop {
            Some(crop) => {
                let window = crop.window(scan.grid())?;
                (scan.cropped(window), window.first)
            }
            None => (scan, [0, 0]),
        };
        let is_periodic = edges == Edges::Periodic;
        let mut removed = Removed::default();
        if let Some(spikes) = self.spikes {
            let by = LineFit::Differences;
            let aligned = self.align.map(|align| Alignment { by, ..align }.align(&part));
            let found = spikes.find(aligned.as_ref().unwrap_or(&part), is_periodic);
            removed.spikes = found.len();
            part = part.without(&found);
        }
        if let Some(limit) = self.islands {
            let found = islands(&part, limit as usize, is_periodic);
            removed.islands = found.len();
            part = part.without(&found);
        }
        if let Some(align) = self.align {
            part = align.align(&part);
        }
        let scan = match self.level_through {
            Some(points) => points.level(&part, first)?,
            None => self.level.unwrap_or(Level::None).level(part),
        };
        Ok(Levelled { scan, removed })
    }

    /// Fills a levelled map, and finds its shortest reliable wavelength if the tip or the noise is
    /// analysed.
    ///
    /// # Errors
    /// Fails if points are missing and `fill` is `None` or [`Fill::Error`].
    pub fn filled(
        &self,
        levelled: Scan,
        edges: Edges,
    ) -> Result<(Surface, Option<Reliability>), MissingPoints> {
        let lines = self.tip_along.unwrap_or(Axis::X);
        let is_periodic = edges == Edges::Periodic;
        let boundary = Boundary::of(is_periodic);
        let tip =
            self.tip_radius.and_then(|radius| Tip { radius }.cutoff(&levelled, lines, boundary));
        let surface = self.fill.unwrap_or_default().fill(levelled, is_periodic)?;
        let reliability = self
            .tests_reliability()
            .then(|| Reliability::new(&surface, boundary, tip, self.noise_floor));
        Ok((surface, reliability))
    }

    /// Applies all steps to a measured map, and then makes it periodic as `edges` specifies.
    ///
    /// # Errors
    /// Fails as [`Preparation::levelled`], if points are missing and `fill` is `None` or
    /// [`Fill::Error`], or if the result is flat.
    pub fn prepare(&self, scan: Scan, edges: Edges) -> Result<Prepared, PreparationError> {
        let before = spread(scan.heights());
        let Levelled { scan: levelled, removed } = self.levelled(scan, edges)?;
        let filled = levelled.missing();
        let is_periodic = edges == Edges::Periodic;
        let (mut surface, reliability) = self.filled(levelled, edges)?;
        if let Some(cutoff) = self.high_pass {
            surface = high_pass(&surface, cutoff, is_periodic);
        }
        if let Some(cutoff) = self.low_pass {
            let cutoff = match (cutoff, &reliability) {
                (LowPass::Wavelength(wavelength), _) => wavelength,
                (LowPass::Found(FoundCutoff::Reliable), Some(found)) => found.wavelength,
                (LowPass::Found(FoundCutoff::Reliable), None) => {
                    return Err(PreparationError::NoReliability);
                }
            };
            surface = low_pass(&surface, cutoff, is_periodic);
        }
        if let Some(nodes) = self.resample {
            surface = resampled(&surface, nodes.map(|nodes| nodes as usize));
        }
        let surface = edges.close(surface);
        if spread(surface.heights()) <= FLAT * before {
            Err(PreparationError::Flat)
        } else {
            Ok(Prepared { surface, removed, filled, reliability })
        }
    }

    /// Returns whether the tip or the noise of the map is analysed.
    pub fn tests_reliability(&self) -> bool {
        self.tip_radius.is_some() || self.noise_floor
    }

    /// Returns whether the low-pass filter removes the waves that are not reliable.
    pub fn removes_unreliable(&self, reliability: &Reliability) -> bool {
        match self.low_pass {
            Some(LowPass::Wavelength(cutoff)) => cutoff >= reliability.wavelength,
            Some(LowPass::Found(FoundCutoff::Reliable)) => true,
            None => false,
        }
    }

    /// Returns a map on the nodes of the prepared surface: 1 at nodes whose heights were filled, 0
    /// at all other nodes.
    ///
    /// A node of a resampled map was filled if the nearest node before the resampling was filled.
    ///
    /// # Errors
    /// Fails as [`Preparation::levelled`].
    pub fn filled_nodes(&self, scan: Scan, edges: Edges) -> Result<Surface, PreparationError> {
        let Levelled { scan, .. } = self.levelled(scan, edges)?;
        let flags = scan.heights().iter().map(|height| f64::from(height.is_nan()));
        let flags = Surface::new(scan.grid(), flags.collect()).expect("one number per node");
        let flags = match self.resample {
            Some(nodes) => nearest(&flags, nodes.map(|nodes| nodes as usize)),
            None => flags,
        };
        Ok(match edges {
            Edges::Mirror => mirror(&flags),
            Edges::Periodic | Edges::Open | Edges::Taper { .. } => flags,
        })
    }
}

/// Returns a periodic map on another number of nodes, each with the height of the nearest node.
fn nearest(map: &Surface, nodes: [usize; 2]) -> Surface {
    let before = map.grid().nodes();
    let grid = Grid::new(nodes, map.grid().cell()).expect("the numbers of nodes were checked");
    let heights = (0..grid.count()).map(|node| {
        let after = grid.indices(node);
        let [i, j] = [0, 1].map(|axis| {
            // The index after × before / nodes, rounded.
            (2 * after[axis] * before[axis] + nodes[axis]) / (2 * nodes[axis]) % before[axis]
        });
        map.heights()[i * before[1] + j]
    });
    Surface::new(grid, heights.collect()).expect("copies of finite heights")
}

/// Returns the difference between the highest and the lowest height, ignoring missing points.
pub fn spread(heights: &[f64]) -> f64 {
    let least = heights.iter().copied().fold(f64::INFINITY, f64::min);
    heights.iter().copied().fold(f64::NEG_INFINITY, f64::max) - least
}

/// Rectangle of a map, given by its position and its sides in the unit of the map's sides.
///
/// ```
/// use asperity_mechanics::grid::{Cell, Grid};
/// use asperity_mechanics::topography::preparation::Crop;
///
/// let grid = Grid::new([100, 50], Cell::new([20e-6, 10e-6])?)?;
/// let crop = Crop { from: [4e-6, 0.0], size: [8e-6, 5.05e-6] };
/// let window = crop.window(grid).unwrap();
/// assert_eq!(window.first, [20, 0]);
/// assert_eq!(window.nodes, [40, 25]);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Crop {
    /// Position (x, y) of the first node, relative to the first node of the map.
    pub from: [f64; 2],
    /// Sides of the rectangle along x and y, each equal to number of nodes × grid spacing.
    pub size: [f64; 2],
}

/// Reason why a crop does not fit the map.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[expect(missing_docs, reason = "the error messages document the variants")]
pub enum CropError {
    #[error(
        "along {axis} the crop reaches from {from} to {to}, outside the map, which reaches from 0 to \
         {side}; move or shrink the crop"
    )]
    Outside { axis: char, from: f64, to: f64, side: f64 },
    #[error("the side of the crop along {axis} is {size}, less than the step {step} of the map")]
    Empty { axis: char, size: f64, step: f64 },
}

impl Crop {
    /// Returns the nodes of the rectangle, with the index of the first node and the number of nodes
    /// rounded along each axis.
    ///
    /// # Errors
    /// Fails if the rectangle extends outside the map by half a grid spacing or more, or has no
    /// node.
    pub fn window(&self, grid: Grid) -> Result<Window, CropError> {
        let mut window = Window { first: [0; 2], nodes: [0; 2] };
        for (axis, name) in ['x', 'y'].into_iter().enumerate() {
            let (from, size) = (self.from[axis], self.size[axis]);
            let step = grid.spacing()[axis];
            let [first, nodes] = [from, size].map(|length| (length / step).round());
            let is_inside = first >= 0.0 && first + nodes <= grid.nodes()[axis] as f64;
            if !is_inside {
                return Err(CropError::Outside {
                    axis: name,
                    from,
                    to: from + size,
                    side: grid.cell().size()[axis],
                });
            }
            if nodes < 1.0 {
                let axis = name;
                return Err(CropError::Empty { axis, size, step });
            }
            window.first[axis] = first as usize;
            window.nodes[axis] = nodes as usize;
        }
        Ok(window)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::grid::samples::rectangle;
    use crate::topography::gaussian::transmission;
    use crate::topography::surface::Axis;
    use crate::topography::surface::samples::scan;

    #[test]
    fn a_map_of_which_nothing_is_asked_stays_as_it_is() {
        let map = scan([8, 6], [1.0, 1.0], |x, y| x * y + 3.0, |_, _| false);
        let prepared = Preparation::default().prepare(map.clone(), Edges::Open);
        let surface = map.into_surface().unwrap();
        let removed = Removed::default();
        assert_eq!(prepared, Ok(Prepared { surface, removed, filled: 0, reliability: None }));
        assert_eq!(serde_json::to_string(&Preparation::default()).unwrap(), "{}");
    }

    #[test]
    fn a_tilted_wave_with_a_hole_becomes_the_wave_of_half_the_amplitude() {
        // The crop contains whole waves, so that its mean plane is nearly the tilt.
        let height = |x: f64, y: f64| 0.01 * libm::cos(TAU * x / 0.5) + 3.0 * x - y;
        let is_missing = |i: usize, j: usize| (i, j) == (40, 9);
        let map = scan([96, 24], [3.0, 0.75], height, is_missing);
        let preparation = Preparation {
            crop: Some(Crop { from: [0.5, 0.125], size: [2.0, 0.5] }),
            level: Some(Level::Plane),
            fill: Some(Fill::Harmonic),
            low_pass: Some(LowPass::Wavelength(0.5)),
            ..Preparation::default()
        };
        let prepared = preparation.prepare(map.clone(), Edges::Open).unwrap();
        assert_eq!(prepared.filled, 1);
        let grid = prepared.surface.grid();
        assert_eq!(grid.nodes(), [64, 16]);
        assert_eq!(grid.cell().size(), [2.0, 0.5]);
        let middle = prepared.surface.heights()[32 * 16 + 8];
        let expected = 0.01 * transmission(0.5, 0.5);
        assert!((middle / expected - 1.0).abs() < 0.05, "{middle}");
        let unfilled = Preparation { fill: None, ..preparation };
        let missing = MissingPoints { missing: 1, count: 1024 };
        assert_eq!(unfilled.prepare(map, Edges::Open), Err(PreparationError::Missing(missing)));
    }

    #[test]
    fn a_map_of_which_nothing_is_left_is_an_error() {
        let plane = scan([8, 6], [1.0, 1.0], |x, y| x - y, |_, _| false);
        let level = Some(Level::Plane);
        let preparation = Preparation { level, ..Preparation::default() };
        let error = preparation.prepare(plane.clone(), Edges::Open);
        assert_eq!(error, Err(PreparationError::Flat));
        let error = Preparation::default().prepare(plane, Edges::Mirror);
        assert_eq!(error, Err(PreparationError::Flat));
    }

    #[test]
    fn a_map_is_filtered_at_its_reliable_wavelength() {
        let height = |x: f64, _: f64| 0.01 * libm::cos(TAU * x / 0.25);
        let map = scan([64, 8], [1.0, 0.125], height, |_, _| false);
        let reliable = Some(LowPass::Found(FoundCutoff::Reliable));
        let preparation = Preparation { low_pass: reliable, ..Preparation::default() };
        let error = preparation.prepare(map.clone(), Edges::Periodic);
        assert_eq!(error, Err(PreparationError::NoReliability));
        // A tip of half the radius of the crests has a cutoff between two nodes and a wavelength.
        let radius = 0.7 / (0.01 * (TAU / 0.25).powi(2));
        let sharp = Preparation { tip_radius: Some(radius), ..preparation };
        let prepared = sharp.prepare(map.clone(), Edges::Periodic).unwrap();
        let cutoff = prepared.reliability.unwrap().wavelength;
        assert!((0.04..0.25).contains(&cutoff), "{cutoff}");
        let expected = 0.01 * transmission(cutoff, 0.25);
        assert!((prepared.surface.heights()[0] / expected - 1.0).abs() < 1e-12);
        let same = Preparation { low_pass: Some(LowPass::Wavelength(cutoff)), ..sharp.clone() };
        let same = same.prepare(map, Edges::Periodic).unwrap();
        assert_eq!(same.surface, prepared.surface);
        let text = serde_json::to_string(&sharp).unwrap();
        assert!(text.starts_with("{\"low_pass\":\"reliable\",\"tip_radius\":"), "{text}");
    }

    /// Returns a map with a wave, a spike, an island in a hole, and an offset of each line along x.
    fn damaged() -> Scan {
        let is_missing =
            |i: usize, j: usize| (5..12).contains(&i) && (5..12).contains(&j) && (i, j) != (8, 8);
        let wave = |x: f64, _: f64| libm::sin(TAU * x);
        let map = scan([40, 32], [1.0, 0.8], wave, is_missing);
        let spike = 25 * 32 + 20;
        map.map_measured(|node, height| {
            let [_, j] = map.grid().indices(node);
            height + f64::from(node == spike) + libm::sin(7.0 * (j * j) as f64)
        })
    }

    #[test]
    fn errors_of_the_instrument_are_removed_before_the_lines_are_aligned() {
        let preparation = Preparation {
            spikes: Some(Spikes { threshold: 6.0, window: 5 }),
            islands: Some(1),
            align: Some(Alignment { along: Axis::X, by: LineFit::Polynomial { degree: 3 } }),
            fill: Some(Fill::Nearest),
            ..Preparation::default()
        };
        let prepared = preparation.prepare(damaged(), Edges::Open).unwrap();
        assert_eq!(prepared.removed, Removed { spikes: 1, islands: 1 });
        assert_eq!(prepared.filled, 50);
        // Lines without missing points differ only by their offsets.
        let row = |j: usize| (0..40).map(move |i| i * 32 + j);
        let heights = prepared.surface.heights();
        for (one, other) in row(2).zip(row(30)) {
            assert!((heights[one] - heights[other]).abs() < 1e-13);
        }
    }

    #[test]
    fn a_removed_point_needs_to_be_filled() {
        let spikes = Some(Spikes { threshold: 6.0, window: 5 });
        let map = scan([40, 32], [1.0, 0.8], |x, _| libm::sin(TAU * x), |_, _| false);
        let with_spike = map.map_measured(|node, height| height + f64::from(node == 500));
        let preparation = Preparation { spikes, ..Preparation::default() };
        let missing = MissingPoints { missing: 1, count: 40 * 32 };
        let error = preparation.prepare(with_spike, Edges::Open);
        assert_eq!(error, Err(PreparationError::Missing(missing)));
        assert!(preparation.prepare(map, Edges::Open).is_ok());
    }

    #[test]
    fn filled_nodes_follow_the_steps_of_the_preparation() {
        let is_missing = |i: usize, j: usize| i == 2 && j == 1 || i == 5 && j == 7;
        let map = scan([8, 8], [1.0, 1.0], |x, y| x * y, is_missing);
        let nodes_of = |preparation: Preparation, edges: Edges| {
            let flags = preparation.filled_nodes(map.clone(), edges).unwrap();
            let filled = flags.heights().iter().enumerate().filter(|(_, flag)| **flag == 1.0);
            filled.map(|(node, _)| flags.grid().indices(node)).collect::<Vec<_>>()
        };
        let none = Preparation::default();
        assert_eq!(nodes_of(none.clone(), Edges::Open), [[2, 1], [5, 7]]);
        let crop = Some(Crop { from: [0.125, 0.0], size: [0.5, 0.5] });
        let cropped = Preparation { crop, ..Preparation::default() };
        assert_eq!(nodes_of(cropped, Edges::Open), [[1, 1]]);
        let mirrored = nodes_of(none, Edges::Mirror);
        let image = |[i, j]: [usize; 2]| [[i, j], [i, 15 - j], [15 - i, j], [15 - i, 15 - j]];
        let mut expected = [image([2, 1]), image([5, 7])].concat();
        expected.sort_unstable();
        assert_eq!(mirrored, expected);
        // Nodes at half the distance of the map before, each with the nearest one; ties go up.
        let finer = Preparation { resample: Some([16, 16]), ..Preparation::default() };
        let both = [[3, 1], [3, 2], [4, 1], [4, 2], [9, 13], [9, 14], [10, 13], [10, 14]];
        assert_eq!(nodes_of(finer, Edges::Periodic), both);
        let coarser = Preparation { resample: Some([4, 8]), ..Preparation::default() };
        assert_eq!(nodes_of(coarser, Edges::Periodic), [[1, 1]]);
    }

    fn window(from: [f64; 2], size: [f64; 2]) -> Result<Window, CropError> {
        Crop { from, size }.window(rectangle([10, 20], [1.0, 4.0]))
    }

    #[test]
    fn the_whole_map_is_a_part_of_it() {
        let whole = window([0.0, 0.0], [1.0, 4.0]).unwrap();
        assert_eq!((whole.first, whole.nodes), ([0, 0], [10, 20]));
        // Offsets of less than half a step of 0.1 and 0.2 round to zero.
        let rounded = window([0.04, -0.09], [1.0, 4.0]).unwrap();
        assert_eq!(rounded, whole);
    }

    #[test]
    fn what_is_no_part_of_a_map_is_refused_with_the_axis() {
        let beyond = window([0.5, 1.0], [0.5, 3.2]).unwrap_err();
        assert_eq!(
            beyond.to_string(),
            "along y the crop reaches from 1 to 4.2, outside the map, which reaches from 0 to 4; move or \
             shrink the crop"
        );
        assert!(matches!(
            window([-0.2, 0.0], [0.5, 1.0]),
            Err(CropError::Outside { axis: 'x', .. })
        ));
        let empty = window([0.5, 1.0], [0.04, 3.0]).unwrap_err();
        assert_eq!(
            empty.to_string(),
            "the side of the crop along x is 0.04, less than the step 0.1 of the map"
        );
        for odd in [f64::NAN, f64::INFINITY] {
            assert!(window([odd, 0.0], [0.5, 1.0]).is_err());
            assert!(window([0.0, 0.0], [0.5, odd]).is_err());
        }
    }
}
