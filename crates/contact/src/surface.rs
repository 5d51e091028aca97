//! Surfaces from heights, and the preparation of measured maps.

use asperity_mechanics::topography::descriptors::Descriptors;
use asperity_mechanics::topography::level::Level;
use asperity_mechanics::topography::moments::Moments;
use asperity_mechanics::topography::preparation::{Preparation, PreparationError};
use asperity_mechanics::topography::surface::{self as mechanics, HIGHEST, Scan};
use asperity_mechanics::topography::{differences, fill, periodic};
use thiserror::Error;

use crate::{Grid, Length};

/// Rough surface: a height at each node of a grid, positive towards the elastic body.
///
/// ```
/// use asperity_contact::{Grid, Length, Surface};
///
/// // A ridge of 1 µm in the middle of a map of 4 × 2 nodes.
/// let grid = Grid::new([4, 2], [Length::micrometres(40.0), Length::micrometres(20.0)])?;
/// let heights = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0];
/// let surface = Surface::from_heights(grid, heights, Length::micrometres(1.0))?;
/// assert!(!surface.is_periodic());
/// assert!(Surface::from_heights(grid, vec![0.0; 7], Length::metres(1.0)).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    map: mechanics::Surface,
    rms_slope: f64,
    is_periodic: bool,
}

/// Reason why heights do not form a surface.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// The number of heights is not the number of nodes.
    #[error("{found} heights for {expected} nodes; give one height for each node of the grid")]
    #[non_exhaustive]
    Count {
        /// Number of heights.
        found: usize,
        /// Number of nodes.
        expected: usize,
    },
    /// A height is not finite, or its square overflows.
    #[error(
        "the height of node ({}, {}) is {height} in the given unit; heights must be finite, and missing points of a \
         measured map are filled by `MeasuredMap`",
        node[0],
        node[1]
    )]
    #[non_exhaustive]
    Height {
        /// Indices of the node along x and y.
        node: [usize; 2],
        /// The height, in the given unit.
        height: f64,
    },
    /// The unit of the heights is not positive and finite.
    #[error("the unit of the heights is {unit}; it must be positive and finite")]
    #[non_exhaustive]
    Unit {
        /// The unit.
        unit: Length,
    },
    /// Points of a measured map are missing.
    #[error(
        "{missing} of {count} points are missing; choose how to fill them with `MeasuredMap::fill`"
    )]
    #[non_exhaustive]
    Missing {
        /// Number of missing points.
        missing: usize,
        /// Number of all points.
        count: usize,
    },
    /// The prepared map is flat.
    #[error("the prepared map is flat; remove less of its form")]
    Flat,
    /// The faded fraction of a side is not positive and at most one half.
    #[error("the faded fraction of each side is {0}; it must be positive and at most 0.5")]
    Taper(f64),
}

impl Surface {
    /// Creates a surface from one height for each node, row-major, as multiples of `unit`.
    ///
    /// The opposite edges of the map are not expected to match: press it as an isolated patch, or
    /// make it [periodic](Surface::assume_periodic).
    ///
    /// # Errors
    /// Fails if the number of heights is not the number of nodes, or if a height is not finite.
    pub fn from_heights(grid: Grid, heights: Vec<f64>, unit: Length) -> Result<Self, SurfaceError> {
        let heights = checked(grid, heights, unit, |height| height.is_finite())?;
        let map = mechanics::Surface::new(grid.inner(), heights);
        Ok(Self::open(map.expect("the heights were checked")))
    }

    /// Declares that the surface continues periodically, so that opposite edges match.
    ///
    /// The rms slope is then that of the Fourier modes, in which a step between opposite edges
    /// counts.
    pub fn assume_periodic(self) -> Self {
        let rms_slope = Descriptors::from_surface(&self.map).rms_slope;
        Self::periodic(self.map, rms_slope)
    }

    pub(crate) fn periodic(map: mechanics::Surface, rms_slope: f64) -> Self {
        Self { map, rms_slope, is_periodic: true }
    }

    fn open(map: mechanics::Surface) -> Self {
        let rms_slope = differences::moments(&map).rms_slope();
        Self { map, rms_slope, is_periodic: false }
    }

    /// Returns the grid of the surface.
    pub fn grid(&self) -> Grid {
        Grid::of(self.map.grid())
    }

    /// Iterates over the heights in row-major order.
    pub fn heights(&self) -> impl ExactSizeIterator<Item = Length> {
        self.map.heights().iter().map(|height| Length::metres(*height))
    }

    /// Returns true if the surface continues periodically.
    pub fn is_periodic(&self) -> bool {
        self.is_periodic
    }

    /// Returns the rms slope h′ = √⟨|∇h|²⟩: of the Fourier modes of a periodic surface, of the
    /// differences between neighbouring nodes of another one.
    pub fn rms_slope(&self) -> f64 {
        self.rms_slope
    }

    /// Returns the root mean square of the heights about their mean.
    pub fn rms_height(&self) -> Length {
        let moments = if self.is_periodic {
            Moments::from_surface(&self.map)
        } else {
            differences::moments(&self.map)
        };
        Length::metres(moments.rms_height())
    }

    pub(crate) fn map(&self) -> &mechanics::Surface {
        &self.map
    }
}

/// Converts heights to metres, after a check of their number, range and unit.
fn checked(
    grid: Grid,
    mut heights: Vec<f64>,
    unit: Length,
    is_valid: impl Fn(f64) -> bool,
) -> Result<Vec<f64>, SurfaceError> {
    let (found, expected) = (heights.len(), grid.inner().count());
    if found != expected {
        return Err(SurfaceError::Count { found, expected });
    }
    let metres = unit.in_metres();
    if !(metres > 0.0 && metres.is_finite()) {
        return Err(SurfaceError::Unit { unit });
    }
    let is_wrong = |height: &f64| !is_valid(*height) || (height * metres).abs() > HIGHEST;
    if let Some(node) = heights.iter().position(is_wrong) {
        let height = heights[node];
        return Err(SurfaceError::Height { node: grid.inner().indices(node), height });
    }
    heights.iter_mut().for_each(|height| *height *= metres);
    Ok(heights)
}

/// Form that is fitted to the measured points of a map and subtracted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Form {
    /// Mean height.
    Mean,
    /// Least-squares plane.
    Plane,
    /// Least-squares quadric: the bow of a scanner, cylinders and spheres.
    Quadric,
}

/// Method to fill missing points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fill {
    /// Solution of Laplace's equation in each hole, with the heights at its rim.
    Harmonic,
    /// Height of the nearest measured point.
    Nearest,
    /// Lowest measured height, so that filled points are the last to touch.
    Lowest,
}

/// Treatment of the edges of a map, after which it is periodic.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Edges {
    /// Continuation by mirror images, on twice the sides.
    Mirror,
    /// Fading to the mean height, over this fraction of each side at each of its ends.
    Taper(f64),
}

/// Height map of an instrument, with missing points, before it is a [`Surface`].
///
/// The steps have a fixed order: form, missing points, edges.
///
/// ```
/// use asperity_contact::{Edges, Fill, Form, Grid, Length, MeasuredMap};
///
/// // A tilted map with a missing point.
/// let grid = Grid::square(16, Length::micrometres(16.0))?;
/// let height = |node: usize| if node == 40 { f64::NAN } else { (node / 16 + node % 3) as f64 };
/// let heights: Vec<f64> = (0..256).map(height).collect();
/// let map = MeasuredMap::new(grid, heights, Length::nanometres(1.0))?.level(Form::Plane);
/// assert!(map.clone().surface().is_err());
/// let patch = map.clone().fill(Fill::Harmonic).surface()?;
/// assert!(!patch.is_periodic());
/// let mirrored = map.fill(Fill::Harmonic).edges(Edges::Mirror).surface()?;
/// assert!(mirrored.is_periodic() && mirrored.grid().nodes() == [32, 32]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct MeasuredMap {
    scan: Scan,
    preparation: Preparation,
    edges: Option<Edges>,
}

impl MeasuredMap {
    /// Creates a map from one height for each node, row-major, as multiples of `unit`. NaN marks a
    /// missing point.
    ///
    /// # Errors
    /// Fails if the number of heights is not the number of nodes, or if a height is infinite.
    pub fn new(grid: Grid, heights: Vec<f64>, unit: Length) -> Result<Self, SurfaceError> {
        let heights = checked(grid, heights, unit, |height| !height.is_infinite())?;
        let scan = Scan::new(grid.inner(), heights).expect("the heights were counted");
        Ok(Self { scan, preparation: Preparation::default(), edges: None })
    }

    /// Subtracts a form.
    pub fn level(mut self, form: Form) -> Self {
        self.preparation.level = Some(match form {
            Form::Mean => Level::Mean,
            Form::Plane => Level::Plane,
            Form::Quadric => Level::Quadric,
        });
        self
    }

    /// Fills the missing points. Without it, they are an error.
    pub fn fill(mut self, fill: Fill) -> Self {
        self.preparation.fill = Some(match fill {
            Fill::Harmonic => fill::Fill::Harmonic,
            Fill::Nearest => fill::Fill::Nearest,
            Fill::Lowest => fill::Fill::Lowest,
        });
        self
    }

    /// Makes the map periodic. Without it, the surface is an isolated patch.
    pub fn edges(self, edges: Edges) -> Self {
        Self { edges: Some(edges), ..self }
    }

    /// Prepares the surface.
    ///
    /// # Errors
    /// Fails if points are missing and not to be filled, or if the prepared surface is flat.
    pub fn surface(self) -> Result<Surface, SurfaceError> {
        let edges = match self.edges {
            None => periodic::Edges::Open,
            Some(Edges::Mirror) => periodic::Edges::Mirror,
            Some(Edges::Taper(fraction)) if fraction > 0.0 && fraction <= 0.5 => {
                periodic::Edges::Taper { taper_fraction: fraction }
            }
            Some(Edges::Taper(fraction)) => return Err(SurfaceError::Taper(fraction)),
        };
        let missing = self.scan.missing();
        let prepared = self.preparation.prepare(self.scan, edges).map_err(|error| match error {
            PreparationError::Missing(points) => {
                SurfaceError::Missing { missing, count: points.count }
            }
            _ => SurfaceError::Flat,
        })?;
        let surface = Surface::open(prepared.surface);
        Ok(if self.edges.is_some() { surface.assume_periodic() } else { surface })
    }
}
