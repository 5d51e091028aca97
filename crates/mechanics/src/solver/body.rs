//! Elastic bodies with a boundary condition and a hardness ([`Body`]), and the memory that their
//! solvers need.

use thiserror::Error;

use super::{Solver, bytes_per_node};
use crate::elasticity::{ElasticOperator, FreeHalfSpace, Layer, PeriodicHalfSpace, PeriodicLayer};
use crate::grid::{Boundary, Grid};
use crate::reduced::ReducedHeights;
use crate::threads::Threads;

/// Elastic body with a boundary condition and, if it yields, a hardness.
///
/// ```
/// use asperity_mechanics::grid::{Boundary, Grid};
/// use asperity_mechanics::reduced::ReducedHeights;
/// use asperity_mechanics::solver::{Body, Hardness, Settings};
///
/// // A ball of radius 4 on a material that yields at less than half of Hertz' peak pressure.
/// let grid = Grid::square(64, 1.0)?;
/// let from_centre = |index: usize| (index as f64 + 0.5) / 64.0 - 0.5;
/// let height = |[i, j]: [usize; 2]| -(from_centre(i).powi(2) + from_centre(j).powi(2)) / 8.0;
/// let heights = (0..grid.count()).map(|node| height(grid.indices(node))).collect();
/// let heights = ReducedHeights::reduced(grid, heights)?;
/// let hardness = Hardness::new(0.012)?;
/// let body = Body { elastic: Boundary::Free.into(), hardness: Some(hardness) };
/// let mut solver = body.solver(&heights);
///
/// let load = 8e-4;
/// hardness.check_load(load)?;
/// let outcome = solver.press(load, &Settings::default(), &|| false);
/// assert_eq!(outcome.peak_pressure, hardness.pressure());
/// assert!(outcome.saturated_nodes > 0 && outcome.yielded_depth > 0.0);
/// // A material that yields needs a larger contact area.
/// let elastic = Body { hardness: None, ..body };
/// let without = elastic.solver(&heights).press(load, &Settings::default(), &|| false);
/// assert!(outcome.contact_nodes > without.contact_nodes);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Body {
    /// Elastic body, without its hardness.
    pub elastic: Elastic,
    /// Highest pressure that the material bears; `None` for an elastic material.
    pub hardness: Option<Hardness>,
}

/// Elastic body with a boundary condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Elastic {
    /// Half-space, periodic or with a free boundary (no pressure beyond the edges of the map).
    HalfSpace(Boundary),
    /// Layer under a periodic pressure.
    Layer(Layer),
}

impl Default for Elastic {
    /// Returns the periodic half-space.
    fn default() -> Self {
        Boundary::Periodic.into()
    }
}

impl From<Boundary> for Elastic {
    /// Returns the half-space with this boundary condition.
    fn from(boundary: Boundary) -> Self {
        Elastic::HalfSpace(boundary)
    }
}

impl Elastic {
    /// Returns the operator of the body below a grid.
    pub fn operator(&self, grid: Grid) -> Box<dyn ElasticOperator> {
        match *self {
            Elastic::HalfSpace(Boundary::Periodic) => Box::new(PeriodicHalfSpace::new(grid)),
            Elastic::HalfSpace(Boundary::Free) => Box::new(FreeHalfSpace::new(grid)),
            Elastic::Layer(layer) => Box::new(PeriodicLayer::new(grid, layer)),
        }
    }

    /// Returns the boundary condition.
    pub fn boundary(&self) -> Boundary {
        match *self {
            Elastic::HalfSpace(boundary) => boundary,
            Elastic::Layer(_) => Boundary::Periodic,
        }
    }
}

impl Body {
    /// Creates the solver of a surface on this body.
    pub fn solver(&self, heights: &ReducedHeights) -> Solver {
        self.solver_with_threads(Threads::one(), heights)
    }

    /// Creates the solver as [`Body::solver`] does, with several threads.
    ///
    /// The threads also share the work of all loads, until [`Solver::set_threads`] replaces them.
    pub fn solver_with_threads(&self, threads: Threads, heights: &ReducedHeights) -> Solver {
        let operator = self.elastic.operator(heights.grid());
        Solver::with_threads(threads, operator, self.hardness, heights)
    }

    /// Returns the memory that the solver of this body needs for `tolerance`, including its
    /// creation, in bytes per node.
    pub fn bytes_per_node(&self, tolerance: f64) -> f64 {
        let around = match self.elastic.boundary() {
            Boundary::Periodic => 0.0,
            Boundary::Free => FREE_BYTES,
        };
        let clipping = match self.elastic {
            Elastic::HalfSpace(Boundary::Periodic) => 0.0,
            Elastic::HalfSpace(Boundary::Free) | Elastic::Layer(_) => CLIPPING_BYTES,
        };
        let yielding = self.hardness.map_or(0.0, |_| YIELDING_BYTES);
        bytes_per_node(tolerance) + around + clipping + yielding
    }

    /// Returns the memory that each [sibling](Solver::sibling) of a solver of this body needs for
    /// `tolerance`, in bytes per node.
    pub fn sibling_bytes_per_node(&self, tolerance: f64) -> f64 {
        let shared = match self.elastic.boundary() {
            Boundary::Periodic => SHARED_BYTES,
            Boundary::Free => SHARED_BYTES_FREE,
        };
        self.bytes_per_node(tolerance) - shared
    }
}

/// Additional memory of the solver of a free half-space, in bytes per node.
///
/// It is needed for the kernels, for a mesh with twice the nodes along both axes on which they are
/// computed, and for coarser meshes. A run on 2048² nodes had a peak of 106 bytes per node in
/// total.
const FREE_BYTES: f64 = 61.0;

/// Additional memory for the compensation of clipped pressures, in bytes per node: five maps of
/// blocks of 4 × 4 nodes, with larger blocks and those of coarser meshes.
const CLIPPING_BYTES: f64 = 2.0;

/// Memory that siblings share, in bytes per node: heights in both precisions take 12 bytes and
/// three kernels 4. Heights and kernels of coarser meshes take 6 bytes per node of these meshes, 2
/// in total. The second of two solvers on 4096² nodes took 34 bytes per node.
const SHARED_BYTES: f64 = 18.0;

/// Memory on a free half-space that a sibling does not need, in bytes per node. Siblings share the
/// kernels of pressures, which are on a mesh of four times the nodes, and do not compute them. The
/// second of two solvers on 2048² nodes took 57 bytes per node.
const SHARED_BYTES_FREE: f64 = 52.0;

/// Additional memory of a solver with a hardness, in bytes per node, for lists of nodes whose
/// pressure may change.
///
/// It was measured at the peak of a run on 2048² nodes in which many nodes change in the same
/// iteration.
const YIELDING_BYTES: f64 = 10.0;

/// Upper bound of the pressure, in units of E* × rms slope: positive and finite.
///
/// ```
/// use asperity_mechanics::solver::{Hardness, HardnessError};
///
/// // Steel of 2 GPa, E* = 230 GPa, on a surface of rms slope 0.2.
/// let hardness = Hardness::new(2e9 / (230e9 * 0.2))?;
/// assert!(hardness.check_load(0.01).is_ok());
/// assert_eq!(
///     hardness.check_load(0.06),
///     Err(HardnessError::Overloaded { load: 0.06, hardness: hardness.pressure() })
/// );
/// assert!(Hardness::new(0.0).is_err());
/// # Ok::<(), HardnessError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Hardness(f64);

/// Error of an invalid hardness, or of a load that the hardness does not bear.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum HardnessError {
    /// The hardness is not a positive, finite number.
    #[error("the hardness must be positive and finite, not {0}")]
    NotPositive(f64),
    /// The load is not below the hardness.
    #[error(
        "the mean pressure {load} is not below the hardness {hardness}; \
         use a smaller load or a larger hardness"
    )]
    Overloaded {
        /// Mean pressure of the load.
        load: f64,
        /// Hardness, in the same unit.
        hardness: f64,
    },
}

impl Hardness {
    /// Creates a hardness, in units of E* × rms slope.
    pub fn new(pressure: f64) -> Result<Self, HardnessError> {
        if pressure.is_finite() && pressure > 0.0 {
            Ok(Self(pressure))
        } else {
            Err(HardnessError::NotPositive(pressure))
        }
    }

    /// Returns the hardness in units of E* × rms slope.
    pub fn pressure(self) -> f64 {
        self.0
    }

    /// Checks that the mean pressure `load`, in units of E* × rms slope, is below the hardness.
    pub fn check_load(self, load: f64) -> Result<(), HardnessError> {
        if load < self.0 {
            Ok(())
        } else {
            let hardness = self.0;
            Err(HardnessError::Overloaded { load, hardness })
        }
    }
}
