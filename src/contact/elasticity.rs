//! Elasticity: which displacement a pressure on the surface of a body causes, and how stiff the body
//! is in return.
//!
//! - [`ElasticOperator`]: all that a solver asks of a body;
//! - [`half_space`]: the isotropic half-space under a pressure that repeats for ever;
//! - [`free`]: the same under a pressure that is zero outside the map.
//!
//! Lengths are in units of the cell's longer side L and pressures in units of E*, so that a
//! wavenumber of the mesh is |q| = 2πk.

use crate::contact::fft::{Kernel, Real, Transform};
use crate::contact::grid::{Grid, magnitude};
use crate::contact::threads::Threads;

pub mod free;
pub mod half_space;

pub use free::FreeHalfSpace;
pub use half_space::PeriodicHalfSpace;

/// An elastic body under the pressures on a grid: all that a solver asks of it.
///
/// Pressure p lowers its surface by u, a convolution with an even kernel: a factor for each wave of
/// the mesh on which pressures are convolved. Threads may share it.
pub trait ElasticOperator: Send + Sync {
    /// Where pressures act.
    fn grid(&self) -> Grid;

    /// Nodes of the mesh on which pressures are convolved: those of the grid, if pressures repeat, or
    /// more, which hold zeros.
    fn convolved_nodes(&self) -> [usize; 2] {
        self.grid().nodes()
    }

    /// Displacement per pressure of a wave with so many periods along x and y of that mesh.
    fn displacement(&self, waves: [usize; 2]) -> f64;

    /// Nodes of the mesh on which displacements are turned into pressures: those of the grid, and others
    /// around it.
    fn stiffness_nodes(&self) -> [usize; 2] {
        self.convolved_nodes()
    }

    /// Pressure per displacement of a wave of that mesh, or nearly so: what a solver preconditions with.
    /// Zero for the mean, so that nothing asks for another load.
    fn stiffness(&self, waves: [usize; 2]) -> f64;

    /// Whether the stiffness is the inverse of the displacement, on maps of zero mean. Then one
    /// pressure flattens any heights, and contact can be full.
    fn stiffness_is_exact(&self) -> bool;

    /// Whether a uniform pressure displaces nothing, so that displacements have no mean: it is the
    /// far field that moves, and what it moves by is not asked.
    fn keeps_mean(&self) -> bool;

    /// The displacement of one node, in units of cell sides, under a unit pressure on this node
    /// alone, in units of E*.
    fn nodal_compliance(&self, threads: &Threads) -> f64 {
        mean_over_waves(threads, self.convolved_nodes(), |waves| {
            self.displacement(waves)
        })
    }

    /// The pressure at one node, in units of E* per cell side, that a unit displacement of this node
    /// alone asks for.
    fn nodal_stiffness(&self, threads: &Threads) -> f64 {
        mean_over_waves(threads, self.stiffness_nodes(), |waves| {
            self.stiffness(waves)
        })
    }
}

/// The convolution from pressure to displacement.
pub fn displacement<T: Real>(operator: &dyn ElasticOperator) -> Kernel<T> {
    displacement_on(&Threads::one(), operator)
}

/// The same, made by several threads.
pub(crate) fn displacement_on<T: Real>(
    threads: &Threads,
    operator: &dyn ElasticOperator,
) -> Kernel<T> {
    let factor = |k_x, k_y| operator.displacement([k_x, k_y]);
    Kernel::new_on(threads, operator.convolved_nodes(), factor)
}

/// The convolution from displacement to pressure.
pub fn stiffness<T: Real>(operator: &dyn ElasticOperator) -> Kernel<T> {
    stiffness_on(&Threads::one(), operator)
}

/// The same, made by several threads.
pub(crate) fn stiffness_on<T: Real>(
    threads: &Threads,
    operator: &dyn ElasticOperator,
) -> Kernel<T> {
    let factor = |k_x, k_y| operator.stiffness([k_x, k_y]);
    Kernel::new_on(threads, operator.stiffness_nodes(), factor)
}

/// The transform that such convolutions are made with.
pub fn transform<T: Real>(operator: &dyn ElasticOperator) -> Transform<T> {
    Transform::padded(operator.grid().nodes(), operator.convolved_nodes())
}

/// Rows of factors that are evaluated before they are added up.
const ROWS_AT_ONCE: usize = 64;

/// A node's own share of a convolution: the mean of its factors. Threads evaluate them, and one adds them
/// up in their order.
fn mean_over_waves(
    threads: &Threads,
    [nodes_x, nodes_y]: [usize; 2],
    factor: impl Fn([usize; 2]) -> f64 + Sync,
) -> f64 {
    let waves_y = nodes_y / 2 + 1;
    let mut factors = vec![0.0; ROWS_AT_ONCE * waves_y];
    let mut sum = 0.0;
    for first in (0..nodes_x).step_by(ROWS_AT_ONCE) {
        let rows = factors.chunks_exact_mut(waves_y).zip(first..nodes_x);
        let mut rows: Vec<(&mut [f64], usize)> = rows.collect();
        let evaluate = |(): &mut (), (row, k_x): &mut (&mut [f64], usize)| {
            for (k_y, value) in row.iter_mut().enumerate() {
                *value = factor([magnitude(*k_x, nodes_x), k_y]);
            }
        };
        let crew = threads.crew(rows.len() * nodes_y);
        crew.each(&mut Vec::new(), || (), &mut rows, evaluate);
        for (row, _) in rows {
            for k_y in 0..nodes_y {
                sum += row[magnitude(k_y, nodes_y)];
            }
        }
    }
    sum / (nodes_x * nodes_y) as f64
}
