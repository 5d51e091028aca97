//! Elastic bodies, described by the displacement of the surface under a pressure and by the inverse
//! relation, the stiffness.
//!
//! - [`ElasticOperator`]: trait that the solver uses;
//! - [`PeriodicHalfSpace`]: isotropic half-space under a periodic pressure;
//! - [`FreeHalfSpace`]: isotropic half-space under a pressure that is zero outside the map;
//! - [`PeriodicLayer`]: layer on a rigid base, or coating on a half-space, under a periodic
//!   pressure.
//!
//! Lengths are in units of the cell's longer side L and pressures in units of E*, so a wavenumber
//! of the mesh is |q| = 2πk.
//!
//! A periodic pressure p lowers the surface of the half-space by u. For each wavenumber û = 2 p̂ /
//! (E* |q|) (Johnson, *Contact Mechanics*, 1985, §13.2; Stanley & Kato 1997). û(0) is set to 0,
//! because a uniform pressure moves the far field and does not change the shape of the surface.

use std::f64::consts::PI;

use super::fft::{Kernel, Real, Transform};
use super::grid::{Grid, magnitude};
use super::threads::Threads;

pub mod free;
pub mod layer;

pub use free::FreeHalfSpace;
pub use layer::{Base, Layer, LayerError, Layered, PeriodicLayer, Support};

/// Elastic body under the pressures on a grid.
///
/// A pressure p lowers the surface by u, the convolution of p with an even kernel. The kernel has
/// one factor û/p̂ for each wave of the convolution's mesh. Lengths are in units of the longer side
/// L, pressures in units of E*. Several threads may use the operator at the same time.
pub trait ElasticOperator: Send + Sync {
    /// Returns the grid on which pressures act.
    fn grid(&self) -> Grid;

    /// Returns the same body on a coarser grid, or `None` if a solution on the coarser grid is no
    /// useful initial guess.
    fn on_coarser(&self, _: Grid) -> Option<Box<dyn ElasticOperator>> {
        None
    }

    /// Returns the numbers of nodes along x and y of the mesh for the convolution of pressures.
    ///
    /// For periodic pressures the mesh is the grid. Otherwise the mesh is larger than the grid, and
    /// pressures are padded with zeros.
    fn convolved_nodes(&self) -> [usize; 2] {
        self.grid().nodes()
    }

    /// Returns û/p̂, the displacement of a pressure wave per unit pressure.
    ///
    /// `waves` counts the periods of the wave along x and y of the [mesh of the
    /// convolution](ElasticOperator::convolved_nodes).
    fn displacement(&self, waves: [usize; 2]) -> f64;

    /// Returns the numbers of nodes along x and y of the mesh for the convolution of displacements
    /// with the stiffness.
    ///
    /// For periodic bodies the mesh is the grid. Otherwise the mesh is the grid with a margin.
    fn stiffness_nodes(&self) -> [usize; 2] {
        self.convolved_nodes()
    }

    /// Returns p̂/û, the pressure of a displacement wave per unit displacement, exactly or
    /// approximately.
    ///
    /// `waves` counts the periods of the wave along x and y of the [mesh of the
    /// stiffness](ElasticOperator::stiffness_nodes). The solver uses the stiffness as a
    /// preconditioner. The stiffness of a uniform displacement is zero, so that the preconditioner
    /// does not change the load.
    fn stiffness(&self, waves: [usize; 2]) -> f64;

    /// Returns the stiffness of a wave in the preconditioner of the solver.
    ///
    /// It differs from [`stiffness`](Self::stiffness) if the solver converges faster with another
    /// one.
    fn preconditioner(&self, waves: [usize; 2]) -> f64 {
        self.stiffness(waves)
    }

    /// Returns the numbers of nodes along x and y of the mesh of these factors.
    fn nodes_of(&self, factor: Factor) -> [usize; 2] {
        match factor {
            Factor::Displacement => self.convolved_nodes(),
            Factor::Stiffness | Factor::Preconditioner => self.stiffness_nodes(),
        }
    }

    /// Writes the factor of the wave with n periods along axis `along` and `across` periods along
    /// the other axis to element n of `factors`.
    fn factors(&self, factor: Factor, along: Axis, across: usize, factors: &mut [f64]) {
        let waves = (0..).map(|waves| along.waves(waves, across));
        let all = factors.iter_mut().zip(waves);
        match factor {
            Factor::Displacement => all.for_each(|(to, waves)| *to = self.displacement(waves)),
            Factor::Stiffness => all.for_each(|(to, waves)| *to = self.stiffness(waves)),
            Factor::Preconditioner => all.for_each(|(to, waves)| *to = self.preconditioner(waves)),
        }
    }

    /// Returns the displacement under a pressure wave relative to that of a half-space, at a
    /// wavenumber k > 0 in units of 1/L. The preconditioner of the solver depends on it.
    fn relative_displacement(&self, _wavenumber: f64) -> f64 {
        1.0
    }

    /// Returns whether pressures repeat, so that their mesh is the grid.
    ///
    /// If so, [`stiffness`](Self::stiffness) is exactly the inverse of
    /// [`displacement`](Self::displacement), except for the uniform wave. A pressure exists that
    /// flattens any heights, and contact can be full. A uniform pressure moves only the far field.
    /// This displacement is undefined and counts as zero, so that the displacements under any
    /// pressure have zero mean.
    fn is_periodic(&self) -> bool {
        self.convolved_nodes() == self.grid().nodes()
    }

    /// Returns the response of one node to a unit load on this node alone: the displacement in
    /// units of the longer side L under a pressure of E*, or the pressure in units of E* under a
    /// displacement of L.
    fn nodal(&self, factor: Factor, threads: &Threads) -> f64 {
        mean_over_waves(threads, self.nodes_of(factor), |k_x, factors| {
            self.factors(factor, Axis::Y, k_x, factors);
        })
    }
}

/// Kernel of an [`ElasticOperator`], by the factor of each wave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Factor {
    /// [`ElasticOperator::displacement`].
    Displacement,
    /// [`ElasticOperator::stiffness`].
    Stiffness,
    /// [`ElasticOperator::preconditioner`].
    Preconditioner,
}

/// One of the two axes of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// The x axis, across the rows: first index of a node.
    X,
    /// The y axis, along the rows: second index of a node.
    Y,
}

impl Axis {
    /// Returns the numbers of periods along x and y of the wave with `along` periods along this
    /// axis and `across` periods along the other axis.
    #[inline]
    pub(crate) fn waves(self, along: usize, across: usize) -> [usize; 2] {
        match self {
            Axis::X => [along, across],
            Axis::Y => [across, along],
        }
    }
}

/// Returns a convolution kernel on the mesh of [`ElasticOperator::nodes_of`]. The given threads
/// compute it.
pub fn kernel<T: Real>(
    threads: &Threads,
    operator: &dyn ElasticOperator,
    factor: Factor,
) -> Kernel<T> {
    Kernel::from_columns(threads, operator.nodes_of(factor), |k_y, factors| {
        operator.factors(factor, Axis::X, k_y, factors);
    })
}

/// Plans convolutions of maps on the operator's grid with the kernel of
/// [`Factor::Displacement`].
pub fn transform<T: Real>(operator: &dyn ElasticOperator) -> Transform<T> {
    Transform::padded(operator.grid().nodes(), operator.convolved_nodes())
}

/// Number of rows of factors (one row per k_x) that [`mean_over_waves`] evaluates before it adds
/// them up.
const ROWS_PER_BATCH: usize = 64;

/// Returns the mean of a kernel's factors over all N_x N_y waves. This mean is the kernel at the
/// origin.
///
/// `factors(k_x, row)` writes the factors for k_y = 0, 1, …, N_y/2 to `row`. Several threads
/// evaluate rows, and one thread adds up the factors in order of k_x and k_y.
fn mean_over_waves(
    threads: &Threads,
    [nodes_x, nodes_y]: [usize; 2],
    factors: impl Fn(usize, &mut [f64]) + Sync,
) -> f64 {
    let waves_y = nodes_y / 2 + 1;
    let mut values = vec![0.0; ROWS_PER_BATCH * waves_y];
    let mut sum = 0.0;
    for first in (0..nodes_x).step_by(ROWS_PER_BATCH) {
        let mut rows: Vec<(&mut [f64], usize)> =
            values.chunks_exact_mut(waves_y).zip(first..nodes_x).collect();
        let evaluate = |(): &mut (), (row, k_x): &mut (&mut [f64], usize)| {
            factors(magnitude(*k_x, nodes_x), row);
        };
        let workers = threads.workers(rows.len() * nodes_y);
        workers.for_each(&mut Vec::new(), || (), &mut rows, evaluate);
        for (row, _) in rows {
            for k_y in 0..nodes_y {
                sum += row[magnitude(k_y, nodes_y)];
            }
        }
    }
    sum / (nodes_x * nodes_y) as f64
}

/// Isotropic half-space under a periodic pressure.
///
/// In full contact under a mean pressure p₀, the pressure is p₀ + F⁻¹(|q| ĥ)/2, with the heights h
/// in units of L and pressures in units of E*. By Parseval's theorem its variance is a quarter of
/// the mean square slope of the heights.
///
/// ```
/// use std::f64::consts::PI;
///
/// use asperity_mechanics::elasticity::{ElasticOperator, PeriodicHalfSpace};
/// use asperity_mechanics::grid::Grid;
///
/// let body = PeriodicHalfSpace::new(Grid::square(64, 1.0)?);
/// // Pressure with three periods displaces by 2p/|q|, |q| = 2π · 3; uniform pressure does not.
/// assert!((body.displacement([3, 0]) - 1.0 / (3.0 * PI)).abs() < 1e-15);
/// assert_eq!(body.displacement([0, 0]), 0.0);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodicHalfSpace {
    grid: Grid,
}

impl PeriodicHalfSpace {
    /// Creates the half-space below a grid. Only the ratio of the sides L_x and L_y matters.
    pub fn new(grid: Grid) -> Self {
        Self { grid }
    }

    /// Returns the wavenumber k = |q|/2π of a wave in units of 1/L, also for Nyquist waves.
    #[inline(always)]
    fn wavenumber(&self, waves: [usize; 2]) -> f64 {
        self.grid.cell().wavenumber(waves.map(|waves| waves as f64))
    }
}

impl ElasticOperator for PeriodicHalfSpace {
    fn grid(&self) -> Grid {
        self.grid
    }

    fn on_coarser(&self, grid: Grid) -> Option<Box<dyn ElasticOperator>> {
        Some(Box::new(Self::new(grid)))
    }

    /// Returns û/p̂ = 2/|q|, and zero at q = 0.
    #[inline(always)]
    fn displacement(&self, waves: [usize; 2]) -> f64 {
        let k = self.wavenumber(waves);
        if k > 0.0 { 1.0 / (PI * k) } else { 0.0 }
    }

    /// Returns p̂/û = |q|/2.
    #[inline(always)]
    fn stiffness(&self, waves: [usize; 2]) -> f64 {
        PI * self.wavenumber(waves)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::fft::{Kernel, Transform};
    use crate::grid::samples::{rectangle, square};
    use crate::threads::Threads;

    /// Returns square and rectangular grids, with square and rectangular cells.
    fn grids() -> [Grid; 7] {
        [
            square(1, 1.0),
            square(2, 1.0),
            square(7, 1.0),
            square(12, 3.0),
            rectangle([8, 12], [1.0, 1.5]),
            rectangle([16, 7], [0.5, 2.0]),
            rectangle([1, 9], [2.0, 0.3]),
        ]
    }

    /// Returns the map of cos 2π(a x/L_x + b y/L_y).
    fn wave(grid: Grid, a: usize, b: usize) -> Vec<f64> {
        let [nodes_x, nodes_y] = grid.nodes();
        let phase = |node: usize| {
            let [i, j] = grid.indices(node);
            let turns = |waves: usize, index: usize, nodes: usize| {
                (waves * index % nodes) as f64 / nodes as f64
            };
            TAU * (turns(a, i, nodes_x) + turns(b, j, nodes_y))
        };
        (0..grid.count()).map(|node| phase(node).cos()).collect()
    }

    fn convolved(grid: Grid, kernel: &Kernel<f64>, map: &[f64]) -> Vec<f64> {
        let transform = Transform::new(grid.nodes());
        let mut out = vec![0.0; map.len()];
        transform.convolve(kernel, map, &mut out, &mut transform.scratch());
        out
    }

    /// Returns tuples (grid, a, b, |q|) of waves with a and b periods along x and y, up to the
    /// Nyquist wave. |q| is in units of 1/L.
    fn waves() -> [(Grid, usize, usize, f64); 9] {
        let lying = rectangle([12, 16], [1.5, 4.0]);
        [
            (square(15, 1.0), 3, 4, TAU * 5.0),
            (square(16, 2.0), 1, 0, TAU),
            (square(16, 1.0), 8, 0, TAU * 8.0),
            (square(16, 1.0), 8, 8, TAU * 128_f64.sqrt()),
            (square(15, 1.0), 7, 2, TAU * 53_f64.sqrt()),
            (lying, 3, 0, TAU * 8.0),
            (lying, 0, 8, TAU * 8.0),
            (lying, 6, 0, TAU * 16.0),
            (lying, 3, 6, TAU * 10.0),
        ]
    }

    #[test]
    fn a_wave_sinks_by_two_over_its_wavenumber() {
        for (grid, a, b, q) in waves() {
            let pressure = wave(grid, a, b);
            let kernel =
                kernel(&Threads::one(), &PeriodicHalfSpace::new(grid), Factor::Displacement);
            let sunk = convolved(grid, &kernel, &pressure);
            for (pressure, sunk) in pressure.iter().zip(sunk) {
                assert!((sunk - pressure * 2.0 / q).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_wave_is_flattened_by_half_its_wavenumber_times_its_height() {
        for (grid, a, b, q) in waves() {
            let heights = wave(grid, a, b);
            let kernel = kernel(&Threads::one(), &PeriodicHalfSpace::new(grid), Factor::Stiffness);
            let pressure = convolved(grid, &kernel, &heights);
            for (height, pressure) in heights.iter().zip(pressure) {
                assert!((pressure - 0.5 * q * height).abs() < 1e-13 * q);
            }
        }
    }

    #[test]
    fn a_displaced_node_needs_the_nodal_stiffness_and_a_pressed_one_sinks_by_the_compliance() {
        for grid in grids() {
            let half_space = PeriodicHalfSpace::new(grid);
            let mut alone = vec![0.0; grid.count()];
            alone[0] = 1.0;
            let close = |found: f64, exact: f64| (found - exact).abs() <= 1e-14 * exact;
            let pressure =
                convolved(grid, &kernel(&Threads::one(), &half_space, Factor::Stiffness), &alone);
            assert!(close(pressure[0], half_space.nodal(Factor::Stiffness, &Threads::one())));
            let sunk = convolved(
                grid,
                &kernel(&Threads::one(), &half_space, Factor::Displacement),
                &alone,
            );
            assert!(close(sunk[0], half_space.nodal(Factor::Displacement, &Threads::one())));
        }
    }

    #[test]
    fn uniform_pressure_moves_nothing() {
        for grid in grids() {
            let kernel =
                kernel(&Threads::one(), &PeriodicHalfSpace::new(grid), Factor::Displacement);
            let sunk = convolved(grid, &kernel, &vec![1.0; grid.count()]);
            assert!(sunk.iter().all(|value| value.abs() < 1e-15));
        }
    }

    #[test]
    fn units_of_length_do_not_matter() {
        let of = |side: f64| PeriodicHalfSpace::new(rectangle([8, 6], [side, 0.75 * side]));
        assert_eq!(
            of(1.0).nodal(Factor::Displacement, &Threads::one()),
            of(2.0).nodal(Factor::Displacement, &Threads::one())
        );
    }
}
