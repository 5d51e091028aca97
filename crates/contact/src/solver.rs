//! Solver for the contact of a rigid rough surface with an elastic half-space under a series of
//! loads.
//!
//! The gap at a node of the mesh is g = u − h − δ, with the displacement u of the elastic body, the
//! height h of the rough surface and the rigid offset δ. The pressure p and the gap satisfy p ≥ 0,
//! g ≥ 0 and p g = 0 at every node, and δ is such that the mean pressure equals the load. The body
//! is an [`ElasticOperator`]. There is no friction and no adhesion, so the solution is unique. The
//! result depends on the surface, the load and the settings only, to the last bit: every load is
//! solved as if it were the first.
//!
//! A material with a [`Hardness`] H yields: the pressure is bounded, 0 ≤ p ≤ H, and where p = H the
//! gap may be negative, by the depth that the material has yielded. A node is out of contact, in
//! elastic contact, or saturated. The model describes loading from the undeformed surfaces, without
//! unloading, hardening or pile-up around a contact (Almqvist, Sahlin, Larsson & Glavatskih,
//! *Tribol. Int.* 40, 2007, 574).
//!
//! The modules in the order of the computation:
//!
//! - `press` solves the contact under one load;
//! - `start` provides the initial guess, or `nested` if the contact is first solved on coarser
//!   meshes;
//! - `inner_solver` holds the state of the iterations, and `conjugate_gradients` iterates, as in
//!   Polonsky & Keer (*Wear* 231, 1999, 206), with the preconditioners `extension` and `two_level`;
//! - `evaluation` computes gap and residual in double precision;
//! - `load` keeps pressures within their bounds and their mean equal to the load.
//!
//! The inner solver iterates in single precision, on increments of the pressure. The result is
//! evaluated in double precision, and the inner solver starts again from the residual found there
//! (iterative refinement). Finally `press` decides which nodes at the edge of contact belong to it
//! and evaluates the pressures once more, so that the reported residual is that of the returned
//! pressures.
//!
//! Terms that all modules use:
//!
//! - A *free* node is one whose pressure may change in the present iteration: it has pressure or
//!   penetrates.
//! - A *step* is the change of the pressures in one iteration. Its *step length* is the factor of
//!   the search direction in it.
//! - The *reference* is a number close to δ. It is subtracted from gaps before they are rounded to
//!   single precision: a stored gap is u − h − reference.
//! - The *offset* is the mean of the stored gaps in contact, so that δ = reference + offset.
//! - The *residual* of a node is its stored gap minus the offset.

use std::sync::Arc;

use super::elasticity::ElasticOperator;
use super::fft::Scratch;
use super::threads::Threads;

mod balance;
mod conjugate_gradients;
pub mod cost;
mod evaluation;
mod extension;
mod flags;
mod gaps;
mod half_space;
mod heights;
mod inner_solver;
mod lanes;
mod line_search;
mod load;
mod nested;
mod passes;
mod press;
mod problem;
mod prolongation;
mod start;
mod two_level;

pub use half_space::{HalfSpace, Hardness, HardnessError};

use inner_solver::InnerSolver;
use nested::Coarser;
use passes::ReferencePressure;
use problem::Problem;

/// Returns the memory that a [`Solver`] needs for this tolerance, in bytes per node.
///
/// Before two maps of the previous load were dropped, 8 bytes per node, runs on 2048² and 4096²
/// nodes had a peak of 59 bytes per node.
pub fn bytes_per_node(tolerance: f64) -> f64 {
    if ReferencePressure::is_map(tolerance) { 55.375 } else { 51.375 }
}

/// Solver for the contact of one rough surface. It holds the solution under the last load.
///
/// A solver needs about 52 bytes per node, and 4 more for tolerances below 1e-5. It holds heights
/// and pressure in double precision. In single precision it holds heights, pressure increments,
/// last steps and the present gap. Both precisions share one half spectrum; three kernels have a
/// quarter of the mesh each. The coarser meshes have a third of the nodes in total and hold
/// heights, results and two kernels in single precision.
///
/// ```
/// use asperity_contact::elasticity::PeriodicHalfSpace;
/// use asperity_contact::grid::Grid;
/// use asperity_contact::solver::{Settings, Solver, Stop};
/// use asperity_contact::topography::moments::Moments;
/// use asperity_contact::topography::shapes::Shape;
///
/// // Westergaard's wave: full contact at p* = π E* Δ/λ = E* × rms slope / √2, and under a lower
/// // load p a strip that covers (2/π) arcsin √(p/p*) of the area.
/// let grid = Grid::square(64, 1.0)?;
/// let wave = Shape::Wave { amplitude: 1.0, waves: 1 }.draw(grid);
/// let slope = Moments::from_surface(&wave).rms_slope();
/// let heights: Vec<f64> = wave.heights().iter().map(|height| height / slope).collect();
/// let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &heights);
/// let full = solver.full_contact_load().expect("a periodic body has one");
/// assert!((full - 0.5_f64.sqrt()).abs() < 1e-12);
///
/// let outcome = solver.press(full / 2.0, &Settings::default(), &|| false);
/// assert_eq!(outcome.stop, Stop::Converged);
/// // Half of the 64 rows, give or take one at each edge of the strip.
/// assert!(outcome.contact_nodes.abs_diff(32 * 64) <= 2 * 64);
/// let mean = solver.pressure().iter().sum::<f64>() / grid.count() as f64;
/// assert!((mean - full / 2.0).abs() < 1e-12);
/// # Ok::<(), asperity_contact::grid::GridError>(())
/// ```
pub struct Solver {
    /// Prepared data of the surface, shared with siblings.
    problem: Arc<Problem>,

    /// Pressure under the last load.
    pressure: Vec<f64>,
    /// Mean of u − h in contact, minus the reference.
    offset: f64,
    double_scratch: Scratch<f64>,

    /// Single-precision solver on this mesh; it holds the gap under the last load.
    inner: InnerSolver,
    /// Coarser meshes; `None` on small meshes.
    coarser: Option<Box<Coarser>>,
}

impl Solver {
    /// Creates the solver of a surface with one height for each node of the body's grid.
    ///
    /// Heights are positive towards the body, in units of rms slope × the longer side of the cell.
    /// Their mean does not matter.
    pub fn new(body: impl ElasticOperator + 'static, heights: &[f64]) -> Self {
        Self::with_hardness(body, None, heights)
    }

    /// Creates the solver of a surface on a material that yields at `hardness`, or on an elastic
    /// material if it is `None`.
    ///
    /// A load whose elastic pressures stay below the hardness gives the same bytes as with
    /// [`Solver::new`]. It takes more transform pairs if it was wrongly expected to make the
    /// material yield. All other loads are solved with both bounds, 0 ≤ p ≤ hardness.
    pub fn with_hardness(
        body: impl ElasticOperator + 'static,
        hardness: Option<Hardness>,
        heights: &[f64],
    ) -> Self {
        Self::with_threads(Threads::one(), Box::new(body), hardness, heights)
    }

    /// Creates the solver as [`Solver::with_hardness`] does, with several threads.
    ///
    /// The threads also share the work of all loads, until [`Solver::set_threads`] replaces them.
    pub fn with_threads(
        threads: Threads,
        body: Box<dyn ElasticOperator>,
        hardness: Option<Hardness>,
        heights: &[f64],
    ) -> Self {
        let problem = Problem::new(&threads, body, hardness, heights);
        Self::of_problem(threads, Arc::new(problem))
    }

    fn of_problem(threads: Threads, problem: Arc<Problem>) -> Self {
        Self {
            pressure: vec![0.0; problem.heights.len()],
            offset: 0.0,
            double_scratch: problem.transform.scratch_on(threads.clone()),
            inner: InnerSolver::new(&threads, problem.mesh.clone()),
            coarser: problem
                .coarser
                .as_ref()
                .map(|meshes| Box::new(Coarser::new(&threads, meshes))),
            problem,
        }
    }

    /// Creates another solver of the same surface, which shares the prepared data of this one.
    ///
    /// Several threads can thus solve different loads of one surface at the same time. A load has
    /// the same result with any of the solvers. A sibling needs about two thirds of the memory of
    /// the first solver
    /// ([`HalfSpace::sibling_bytes_per_node`]).
    ///
    /// ```
    /// use asperity_contact::elasticity::PeriodicHalfSpace;
    /// use asperity_contact::grid::Grid;
    /// use asperity_contact::solver::{Settings, Solver};
    /// use asperity_contact::threads::Threads;
    /// use asperity_contact::topography::shapes::Shape;
    ///
    /// let grid = Grid::square(64, 1.0)?;
    /// let wave = Shape::Wave { amplitude: 0.1, waves: 1 }.draw(grid);
    /// let mut first = Solver::new(PeriodicHalfSpace::new(grid), wave.heights());
    /// let mut second = first.sibling(Threads::one());
    /// let press = |solver: &mut Solver, load| {
    ///     solver.press(load, &Settings::default(), &|| false).contact_nodes
    /// };
    /// let [light, heavy] = std::thread::scope(|scope| {
    ///     let heavy = scope.spawn(|| press(&mut second, 0.2));
    ///     [press(&mut first, 0.1), heavy.join().expect("no panic")]
    /// });
    /// assert!(light < heavy);
    /// # Ok::<(), asperity_contact::grid::GridError>(())
    /// ```
    pub fn sibling(&self, threads: Threads) -> Self {
        Self::of_problem(threads, self.problem.clone())
    }

    /// Sets the threads that share the work.
    ///
    /// The pressures do not depend on the number of threads, not even in the last bit.
    pub fn set_threads(&mut self, threads: Threads) {
        self.double_scratch.set_threads(threads.clone());
        if let Some(coarser) = &mut self.coarser {
            coarser.set_threads(&threads);
        }
        self.inner.set_threads(threads);
    }

    /// Returns the threads that share the work.
    pub fn threads(&self) -> &Threads {
        &self.inner.threads
    }

    /// Returns the smallest load that brings every node into contact, in units of E* × rms slope.
    ///
    /// Returns `None` if no formula gives this load, or if the peak pressure under this load
    /// exceeds the hardness.
    pub fn full_contact_load(&self) -> Option<f64> {
        let full = self.problem.full_contact?;
        let ceiling = self.problem.hardness.map_or(f64::INFINITY, Hardness::pressure);
        (full.load + full.peak <= ceiling).then_some(full.load)
    }

    /// Returns the displacement w of each node under unit pressure on all nodes, in units of the
    /// longer side over E*.
    ///
    /// Returns `None` if a uniform pressure does not displace the body. By reciprocity, ⟨p w⟩ is
    /// the mean displacement under any pressure p.
    pub fn displacement_under_unit_pressure(&mut self) -> Option<Vec<f64>> {
        if self.problem.body.has_zero_mean_displacement() {
            return None;
        }
        let unit = vec![1.0; self.pressure.len()];
        let mut sunk = unit.clone();
        let scratch = &mut self.double_scratch;
        self.problem.transform.convolve(&self.problem.displacement, &unit, &mut sunk, scratch);
        Some(sunk)
    }

    /// Returns the pressure under the last load, in units of E* × rms slope.
    ///
    /// It is exactly zero outside the contact and exactly the hardness at saturated nodes. Its mean
    /// is the load, to rounding.
    pub fn pressure(&self) -> &[f64] {
        &self.pressure
    }
}

/// Default value of [`Settings::tolerance`].
///
/// Contact counts on 1024² nodes are within 2 nodes of those at 1e-10 under each of 1320 loads on
/// twelve surfaces of three spectra; on average 0.07 nodes are wrong.
pub const DEFAULT_TOLERANCE: f64 = 5e-5;

/// Default value of [`Settings::pair_limit`], far more than any load of a rough surface needs.
pub const DEFAULT_PAIR_LIMIT: u32 = 2000;

/// Stopping criteria of the solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest accepted [`Outcome::residual`], with or without a hardness.
    ///
    /// The residual must also be at most a tenth of the displacement that the mean contact pressure
    /// on a single node causes at this node. This second criterion is stricter than the default
    /// tolerance only if the mean contact pressure is below 5e-4 E* × rms slope.
    pub tolerance: f64,
    /// Maximum number of transform pairs (one forward and one inverse transform) for one load.
    ///
    /// The limit is checked once per iteration, so a few more pairs may be used.
    pub pair_limit: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: DEFAULT_TOLERANCE, pair_limit: DEFAULT_PAIR_LIMIT }
    }
}

/// Reason why the solver stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The residual is within the tolerance.
    Converged,
    /// Every node is in contact, and the pressure follows from a formula.
    FullContact,
    /// The pair limit was reached; the pressure is the best found.
    PairLimit,
    /// The caller stopped the solver; the pressure is the best found.
    Interrupted,
}

/// Result for one load, without the pressures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Reason why the solver stopped.
    pub stop: Stop,
    /// Number of transform pairs used, in both precisions; pairs on coarser meshes count in
    /// proportion to their nodes.
    pub pairs: u32,
    /// Largest violation of the contact conditions by the returned pressures, in units of rms slope
    /// × the smaller mesh step.
    ///
    /// It is evaluated in double precision: |g| in elastic contact, the penetration −g outside
    /// contact, and a positive g at saturated nodes, where yielding allows negative gaps only. Gaps
    /// are measured from their mean in elastic contact. The bounds of the pressure hold exactly.
    pub residual: f64,
    /// Number of nodes with pressure.
    pub contact_nodes: usize,
    /// Number of nodes with pressure equal to the hardness; they are contact nodes too.
    pub saturated_nodes: usize,
    /// Mean gap over the map, in units of rms slope × longer side. Nodes that have yielded count as
    /// zero gap.
    pub mean_gap: f64,
    /// Mean over the map of the yielded depth: −g at saturated nodes, zero elsewhere.
    ///
    /// It is the yielded volume per area, in units of rms slope × longer side; zero without a
    /// hardness.
    pub yielded_depth: f64,
    /// Elastic energy per area ½⟨p u⟩, in units of E* × rms slope² × longer side.
    ///
    /// It excludes the energy hardness × [`Outcome::yielded_depth`] that yielding dissipates.
    pub energy: f64,
    /// Largest pressure, in units of E* × rms slope; equal to the hardness if any node is
    /// saturated.
    pub peak_pressure: f64,
}

/// Observer of the solution of one load, which receives the progress once per iteration and can
/// stop the solver.
pub trait Watch {
    /// Returns whether to stop; the outcome then contains the best pressure so far.
    fn is_interrupted(&self) -> bool;

    /// Reports the number of transform pairs used for the load so far.
    fn spent(&self, _pairs: u32) {}
}

impl<F: Fn() -> bool> Watch for F {
    fn is_interrupted(&self) -> bool {
        self()
    }
}

#[cfg(test)]
mod tests;
