//! Solver in single precision on one mesh.
//!
//! A [`Solver`](super::Solver) gives it a load, initial pressures and gaps, and takes its result
//! over in double precision. The modules in the order of the computation:
//!
//! - `start` begins the iterations from pressures in double precision, from those of a coarser
//!   mesh, or again;
//! - `conjugate_gradients` iterates, with `balance` if the material yields;
//! - `evaluation` passes pressures and gaps to the transforms in double precision;
//! - `frozen` applies the preconditioner to a contact whose nodes do not change.
//!
//! # Invariants
//!
//! Only these modules change the maps, so that after each of their methods
//!
//! - the flags in a last step say whether its node is free, has pressure and is saturated;
//! - groups of nodes that are not active have neither pressures nor last steps;
//! - a gap is u − h − reference, and the residual of the preconditioner is gap − level at the free
//!   nodes, `free_nodes` in number.

use std::mem::swap;
use std::sync::Arc;

use super::Hardness;
use super::candidates::Candidates;
use super::marks::ActiveGroups;
use super::mesh::Mesh;
use super::passes::{ReferencePressure, Sample};
use super::preconditioner::Preconditioner;
use crate::fft::Scratch;
use crate::threads::Threads;

mod balance;
mod conjugate_gradients;
mod evaluation;
mod frozen;
mod start;

pub use conjugate_gradients::{End, Goal, State};

/// Pressures, gaps and last steps of the nodes in single precision, and the preconditioner.
pub struct InnerSolver {
    pub mesh: Arc<Mesh>,
    pub load: f64,
    /// Upper bound of the pressures; `None` while they are not bounded.
    pub bound: Option<Hardness>,

    pub gap: Vec<f32>,
    /// Number that is subtracted from gaps before they are rounded to single precision.
    pub reference: f64,
    /// Offset from which the present residual is measured: residual = `gap` − `level`.
    level: f64,
    /// Part of the pressure that does not change during the iterations.
    pub reference_pressure: ReferencePressure,
    /// Difference of pressure and reference pressure.
    pub pressure_increment: Vec<f32>,
    /// Last step of the pressure of each node, zero at nodes that are not free. Its lowest bits
    /// hold the flags of the node (`marks`).
    pub last_step: Vec<f32>,
    active: ActiveGroups,
    sample: Sample,
    pub free_nodes: f64,
    preconditioner: Preconditioner,
    /// Nodes whose pressure may change, collected if the material yields.
    candidates: Candidates,
    /// Memory of transforms, which takes turns with that in double precision.
    pub scratch: Scratch<f32>,

    /// Transform pairs used for the present load, in both precisions.
    pub pairs: u32,

    pub threads: Threads,
}

impl InnerSolver {
    pub fn new(threads: &Threads, mesh: Arc<Mesh>) -> Self {
        let (nodes, cells) = (mesh.nodes, mesh.cells());
        Self {
            load: 0.0,
            bound: None,
            gap: vec![0.0; cells],
            reference: 0.0,
            level: 0.0,
            reference_pressure: ReferencePressure::new(nodes),
            pressure_increment: vec![0.0; cells],
            last_step: vec![0.0; cells],
            active: ActiveGroups::new(nodes),
            sample: Sample::new(nodes),
            free_nodes: 0.0,
            preconditioner: Preconditioner::new(threads, &mesh),
            candidates: Candidates::default(),
            scratch: mesh.transform.scratch_on(threads.clone()),
            pairs: 0,
            threads: threads.clone(),
            mesh,
        }
    }

    pub fn set_threads(&mut self, threads: Threads) {
        self.scratch.set_threads(threads.clone());
        self.preconditioner.set_threads(&threads);
        self.threads = threads;
    }

    /// Begins a load whose pressures are not bounded, with gaps relative to zero. Iterations will
    /// go on to a residual of `tolerance`.
    pub fn begin_load(&mut self, load: f64, tolerance: f64) {
        self.load = load;
        self.bound = None;
        self.pairs = 0;
        self.reference = 0.0;
        self.reference_pressure.prepare(tolerance);
        self.active.always = ReferencePressure::is_map(tolerance);
    }

    /// Begins a load with pressures at most `bound`. Maps keep what they hold.
    pub fn begin_bounded(&mut self, load: f64, bound: Option<Hardness>) {
        self.load = load;
        self.bound = bound;
        self.pairs = 0;
    }

    /// Returns the sum of the pressures that the load requires.
    pub fn total(&self) -> f64 {
        self.load * self.mesh.cells() as f64
    }

    /// Returns the upper bound of the pressures, or infinity if there is none.
    pub fn ceiling(&self) -> f64 {
        self.bound.map_or(f64::INFINITY, Hardness::pressure)
    }

    /// Converts an error of the gap to the unit of residuals, the smaller mesh step at unit rms
    /// slope.
    pub fn residual(&self, error: f64) -> f64 {
        self.mesh.steps_per_side * error
    }

    /// Frees the maps that are borrowed from a finer mesh during a solve.
    pub fn drop_maps(&mut self) {
        for map in self.lent_maps() {
            *map = Vec::new();
        }
    }

    /// Swaps the maps with the larger maps of a finer mesh, and takes the scratch of that mesh.
    pub fn borrow_from(&mut self, finer: &mut Self) {
        for (own, map) in self.lent_maps().into_iter().zip(finer.lent_maps()) {
            swap(own, map);
        }
        self.scratch.take_over(&mut finer.scratch);
    }

    fn lent_maps(&mut self) -> [&mut Vec<f32>; 3] {
        [&mut self.gap, &mut self.pressure_increment, &mut self.last_step]
    }
}

#[cfg(test)]
mod tests {
    use crate::elasticity::PeriodicHalfSpace;
    use crate::fft::Row;
    use crate::grid::samples::{rectangle, square};
    use crate::reduced::samples::on;
    use crate::solver::lanes::LANES;
    use crate::solver::{Settings, Solver};
    use crate::topography::shapes::Shape;

    #[test]
    fn pressure_is_in_active_groups_alone() {
        // Strips of contact along y, and along x, where rows end with nine nodes outside groups.
        let grid = rectangle([96, 153], [1.0, 1.0]);
        let waves = Shape::Wave { amplitude: 0.1, waves: 2 }.draw(grid);
        let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &on(grid, waves.heights()));
        solver.press(0.01, &Settings::default(), &|| false);
        let mut counts = [0; 2];
        for row in (0..96).map(|index| Row::new(index, 153)) {
            let groups = row.of(solver.pressure()).as_chunks::<LANES>().0;
            for (active, pressures) in solver.inner.active.row(row).iter().zip(groups) {
                counts[usize::from(*active)] += 1;
                assert!(*active || pressures.iter().all(|p| *p == 0.0));
            }
        }
        assert_eq!(counts[0] + counts[1], 96 * 9);
        assert!(counts[0] > counts[1] && counts[1] > 0);
    }

    #[test]
    fn all_groups_of_a_fine_search_stay_active() {
        let grid = square(64, 1.0);
        let wave = Shape::Wave { amplitude: 0.1, waves: 1 }.draw(grid);
        let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &on(grid, wave.heights()));
        let settings = Settings { tolerance: 1e-8, ..Settings::default() };
        solver.press(0.01, &settings, &|| false);
        let groups = &solver.inner.active;
        let rows = || (0..64).map(|index| Row::new(index, 64));
        assert!(rows().all(|row| groups.row(row).iter().all(|active| *active)));
        assert!(rows().any(|row| groups.free_row(row).iter().any(|free| !free)));
    }
}
