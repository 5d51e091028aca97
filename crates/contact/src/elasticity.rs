//! Elasticity: which displacement a pressure on the surface of a body causes, and how stiff the body
//! is in return.
//!
//! - [`ElasticOperator`]: all that a solver asks of a body;
//! - [`half_space`]: the isotropic half-space under a pressure that repeats for ever;
//! - [`free`]: the same under a pressure that is zero outside the map.
//!
//! Lengths are in units of the cell's longer side L and pressures in units of E*, so that a
//! wavenumber of the mesh is |q| = 2πk.

use crate::fft::{Kernel, Real, Transform};
use crate::grid::{Grid, magnitude};
use crate::threads::Threads;

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

    /// The same body under pressures on a coarser grid, if the contact there leads to that on its own. It does not where
    /// pressures rise without bound towards the edges of a map, which no interpolation follows.
    fn on_coarser(&self, _: Grid) -> Option<Box<dyn ElasticOperator>> {
        None
    }

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

    /// The displacement of waves of 0, 1, … periods along one axis and so many along the other.
    fn displacements(&self, along: Axis, across: usize, displacements: &mut [f64]) {
        for (waves, displacement) in displacements.iter_mut().enumerate() {
            *displacement = self.displacement(along.of(waves, across));
        }
    }

    /// The stiffness of such waves.
    fn stiffnesses(&self, along: Axis, across: usize, stiffnesses: &mut [f64]) {
        for (waves, stiffness) in stiffnesses.iter_mut().enumerate() {
            *stiffness = self.stiffness(along.of(waves, across));
        }
    }

    /// Whether the stiffness is the inverse of the displacement, on maps of zero mean. Then one
    /// pressure flattens any heights, and contact can be full.
    fn stiffness_is_exact(&self) -> bool;

    /// Whether a uniform pressure displaces nothing, so that displacements have no mean: it is the
    /// far field that moves, and what it moves by is not asked.
    fn keeps_mean(&self) -> bool;

    /// The displacement of one node, in units of cell sides, under a unit pressure on this node
    /// alone, in units of E*.
    fn nodal_compliance(&self, threads: &Threads) -> f64 {
        mean_over_waves(threads, self.convolved_nodes(), |k_x, factors| {
            self.displacements(Axis::Y, k_x, factors);
        })
    }

    /// The pressure at one node, in units of E* per cell side, that a unit displacement of this node
    /// alone asks for.
    fn nodal_stiffness(&self, threads: &Threads) -> f64 {
        mean_over_waves(threads, self.stiffness_nodes(), |k_x, factors| {
            self.stiffnesses(Axis::Y, k_x, factors);
        })
    }
}

/// One of the two axes of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Across its rows.
    X,
    /// Along its rows.
    Y,
}

impl Axis {
    /// So many waves along this axis and along the other one, as waves along x and y.
    #[inline]
    fn of(self, along: usize, across: usize) -> [usize; 2] {
        match self {
            Axis::X => [along, across],
            Axis::Y => [across, along],
        }
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
    let nodes = operator.convolved_nodes();
    Kernel::of_columns(threads, nodes, |k_y, factors| {
        operator.displacements(Axis::X, k_y, factors);
    })
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
    let nodes = operator.stiffness_nodes();
    Kernel::of_columns(threads, nodes, |k_y, factors| {
        operator.stiffnesses(Axis::X, k_y, factors);
    })
}

/// The transform that such convolutions are made with.
pub fn transform<T: Real>(operator: &dyn ElasticOperator) -> Transform<T> {
    Transform::padded(operator.grid().nodes(), operator.convolved_nodes())
}

/// Rows of factors that are evaluated before they are added up.
const ROWS_AT_ONCE: usize = 64;

/// A node's own share of a convolution: the mean of its factors, of which `factors` sets those of one k_x and
/// k_y = 0, 1, …. Threads evaluate them, and one adds them up in their order.
fn mean_over_waves(
    threads: &Threads,
    [nodes_x, nodes_y]: [usize; 2],
    factors: impl Fn(usize, &mut [f64]) + Sync,
) -> f64 {
    let waves_y = nodes_y / 2 + 1;
    let mut values = vec![0.0; ROWS_AT_ONCE * waves_y];
    let mut sum = 0.0;
    for first in (0..nodes_x).step_by(ROWS_AT_ONCE) {
        let rows = values.chunks_exact_mut(waves_y).zip(first..nodes_x);
        let mut rows: Vec<(&mut [f64], usize)> = rows.collect();
        let evaluate = |(): &mut (), (row, k_x): &mut (&mut [f64], usize)| {
            factors(magnitude(*k_x, nodes_x), row);
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
