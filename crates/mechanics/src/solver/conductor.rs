//! Conductance of contacts in which the current flows through a layer.
//!
//! The potential drops by the same amount at all nodes in contact, and no current flows elsewhere.
//! The flux w with A w = 1 in contact and w = 0 elsewhere is found as the change of pressure of
//! the [stiffness](super::stiffness) is, with the operator A of conduction for the elastic one.

use std::sync::Arc;

use super::problem::Problem;
use super::{ContactStiffness, Settings, Solver, Watch};
use crate::conduction::LayeredConductor;
use crate::elasticity::PeriodicLayer;
use crate::grid::Grid;
use crate::threads::Threads;

/// Conduction through contacts on one grid with a [`LayeredConductor`]. Several threads may use it
/// at the same time.
///
/// ```
/// use asperity_mechanics::conduction::LayeredConductor;
/// use asperity_mechanics::grid::Grid;
/// use asperity_mechanics::solver::{Conductor, Settings};
/// use asperity_mechanics::threads::Threads;
///
/// // One square spot. A film with a tenth of the conductivity of both bodies constricts the
/// // current, and one with ten times their conductivity spreads it.
/// let grid = Grid::square(64, 1.0)?;
/// let is_inside = |node: usize| grid.indices(node).iter().all(|index| *index < 8);
/// let pressure = |node| if is_inside(node) { 1.0 } else { 0.0 };
/// let pressure: Vec<f64> = (0..grid.count()).map(pressure).collect();
/// let conductance = |ratio: f64| {
///     let film = LayeredConductor::new(0.05, ratio, ratio)?;
///     let conductor = Conductor::new(&Threads::one(), grid, film);
///     let settings = Settings::default();
///     let found = conductor.conductance(Threads::one(), &pressure, &settings, &|| false);
///     // In units of the conductivity of the bodies: k_s = 2 ratio/(1 + ratio) of it.
///     Ok::<f64, asperity_mechanics::conduction::ConductorError>(
///         found.stiffness * 2.0 * ratio / (1.0 + ratio),
///     )
/// };
/// assert!(conductance(0.1)? < 0.8 * conductance(1.0)?);
/// assert!(conductance(10.0)? > 1.2 * conductance(1.0)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Conductor {
    problem: Arc<Problem>,
}

/// Memory of a conductor that all loads share, in bytes per node: heights in both precisions and
/// three kernels, as in a solver, and a transient map.
const SHARED_BYTES: f64 = 24.0;

/// Memory for the conductance of one contact besides that of its stiffness, in bytes per node: the
/// buffers of a solver without coarser meshes.
const BYTES_OF_ONE: f64 = 36.0;

impl Conductor {
    /// Memory for the conductance of the contact under one load, in bytes per node.
    pub const BYTES_PER_NODE: f64 = SHARED_BYTES + BYTES_OF_ONE;

    /// Prepares the conductance of contacts on a grid of periodic cells.
    pub fn new(threads: &Threads, grid: Grid, layer: LayeredConductor) -> Self {
        let flat = vec![0.0; grid.count()];
        let operator = Box::new(PeriodicLayer::new(grid, layer));
        Self { problem: Arc::new(Problem::new(threads, operator, None, &flat)) }
    }

    /// Returns the conductance per area h_c L/k_s of the contact under a pressure, with one
    /// pressure per node: it flows through all nodes with a positive pressure.
    ///
    /// L is the longer side, and 2/k_s = 1/k₁ + 1/k₃ with the conductivities of the layer and of
    /// the other body. It is infinite in full contact, where no current is constricted. The
    /// resistance t/k₁ of the layer to a uniform current is not included.
    ///
    /// # Panics
    /// Panics if the number of pressures differs from the number of nodes.
    pub fn conductance(
        &self,
        threads: Threads,
        pressure: &[f64],
        settings: &Settings,
        watch: &dyn Watch,
    ) -> ContactStiffness {
        let mut solver = Solver::of_problem(threads, self.problem.clone());
        solver.unloading_stiffness(pressure, settings, watch)
    }
}

#[cfg(test)]
mod tests;
