//! The half-spaces that there are, by name.

use super::{Hardness, Solver, bytes_per_node};
use crate::elasticity::{ElasticOperator, FreeHalfSpace, PeriodicHalfSpace};
use crate::grid::{Boundary, Grid};
use crate::threads::Threads;

/// The half-space that a surface is pressed into.
///
/// ```
/// use asperity_contact::grid::{Boundary, Grid};
/// use asperity_contact::solver::{HalfSpace, Hardness, Settings};
///
/// // A ball of radius 4 on a material that yields at less than half of Hertz' peak pressure.
/// let grid = Grid::square(64, 1.0)?;
/// let from_centre = |index: usize| (index as f64 + 0.5) / 64.0 - 0.5;
/// let height = |[i, j]: [usize; 2]| -(from_centre(i).powi(2) + from_centre(j).powi(2)) / 8.0;
/// let heights: Vec<f64> = (0..grid.count()).map(|node| height(grid.place(node))).collect();
/// let hardness = Hardness::new(0.012)?;
/// let body = HalfSpace { boundary: Boundary::Free, hardness: Some(hardness) };
/// let mut solver = body.solver(grid, &heights);
///
/// let load = 8e-4;
/// hardness.bear(load)?;
/// let outcome = solver.press(load, &Settings::default(), &|| false);
/// assert_eq!(outcome.peak_pressure, hardness.pressure());
/// assert!(outcome.saturated_nodes > 0 && outcome.yielded_depth > 0.0);
/// // Whoever yields needs a larger area.
/// let elastic = HalfSpace { hardness: None, ..body };
/// let without = elastic.solver(grid, &heights).press(load, &Settings::default(), &|| false);
/// assert!(outcome.contact_nodes > without.contact_nodes);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HalfSpace {
    /// What lies beyond the edges of the map: the same pressures again, or none.
    pub boundary: Boundary,
    /// The highest pressure that it bears; without one it is elastic under any.
    pub hardness: Option<Hardness>,
}

impl HalfSpace {
    /// Prepares a surface, as [`Solver::new`] does.
    pub fn solver(&self, grid: Grid, heights: &[f64]) -> Solver {
        self.solver_on(Threads::one(), grid, heights)
    }

    /// The same, prepared by several threads, which [work on it](Solver::work_on) from then on.
    pub fn solver_on(&self, threads: Threads, grid: Grid, heights: &[f64]) -> Solver {
        let body: Box<dyn ElasticOperator> = match self.boundary {
            Boundary::Periodic => Box::new(PeriodicHalfSpace::new(grid)),
            Boundary::Free => Box::new(FreeHalfSpace::new(grid)),
        };
        Solver::on(threads, body, self.hardness, heights)
    }

    /// Bytes that such a solver takes for each node while it is prepared and solves to this
    /// tolerance.
    pub fn bytes_per_node(&self, tolerance: f64) -> f64 {
        let around = match self.boundary {
            Boundary::Periodic => 0.0,
            Boundary::Free => FREE_BYTES,
        };
        let yielding = self.hardness.map_or(0.0, |_| YIELDING_BYTES);
        bytes_per_node(tolerance) + around + yielding
    }
}

/// What a free half-space takes more, though it has no coarser meshes: one of twice the nodes along both axes, on which the
/// factors of its kernels are made, and these kernels. 100 bytes a node in all were measured at the peak of runs on 2048²,
/// 4096² and 8192² nodes.
const FREE_BYTES: f64 = 44.0;

/// What is gathered of nodes that may change, where many do at once: at the peak of a run on 2048² nodes.
const YIELDING_BYTES: f64 = 10.0;
