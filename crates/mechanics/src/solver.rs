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
//! # Method
//!
//! The solution minimises the energy ½⟨p, A p⟩ − ⟨p, h⟩ over 0 ≤ p ≤ H with the mean pressure of
//! the load, where A turns pressures into displacements. The gap, up to the offset, is the
//! gradient. The method is the constrained conjugate-gradient method of Polonsky & Keer (*Wear*
//! 231, 1999, 206) with a preconditioner M, a predicted step length τ, and an initial guess from
//! coarser meshes:
//!
//! ```text
//! p ← initial guess                     coarser meshes, or heights, or full contact
//! repeat                                iterative refinement
//!     g ← A p − h                       double precision
//!     stop if the residual is within the tolerance
//!     repeat                            single precision
//!         F ← nodes with p > 0 or g < δ                the free nodes
//!         r ← g − δ on F                               residual; δ makes r vanish in the mean
//!         z ← M r                                      preconditioned residual: Eᵀ K E r
//!         β ← ⟨z, A d⟩ / ⟨d, A d⟩                      d is the last step
//!         t ← −z + β d − m                             m keeps the mean pressure
//!         d ← clamp(p + τ t, 0, H), scaled to the load, − p
//!         p ← p + d,  g ← g + A d
//!         undo a part of d if the energy along it is lowest before its middle
//!     until the residual is small enough
//! ```
//!
//! An iteration takes two transform pairs, one for z and one for A d. A load takes 12 to 15 pairs
//! on meshes from 512² to 4096² nodes. What the ingredients are worth (docs/notes/solver-pairs.md
//! of the repository has the measurements):
//!
//! - The extension E of the residual to nodes that are not free (`preconditioner`): without it, 1.8
//!   times the pairs on 1024² nodes, and more on larger meshes.
//! - The initial guess from coarser meshes (`nested`): 1.5 to 2 times the pairs.
//! - The preconditioner of two levels in the first three iterations
//!   (`blocks/two_level`): 1.1 to 1.3 times the pairs.
//! - Predicted step lengths instead of an exact line search (`line_search`): a third pair in each
//!   iteration.
//! - Single precision with refinement in double precision (`refinement`): twice the time of a pair.
//! - The evaluation in double precision right after the last step, without its gap in single
//!   precision: one pair more.
//!
//! The modules in the order of the computation:
//!
//! - `problem` prepares what no load changes, and siblings share it;
//! - `initial_guess` provides the initial pressures, with `nested` and `prolongation`;
//! - `refinement` evaluates pressures in double precision, and finally decides which nodes at the
//!   edge of contact belong to it;
//! - `inner` iterates in single precision, with `preconditioner` and `line_search`;
//! - `bounds` keeps pressures within their bounds and their mean equal to the load; if the hardness
//!   bounds the pressures, `inner/balance` chooses m and δ;
//! - `passes` are the loops over the mesh between two transforms, on the vectors of `lanes`.
//!
//! `prescribed` searches the load of a prescribed mean gap or approach. After a load is solved,
//! `stiffness` computes its derivative with respect to the approach.
//!
//! Terms that all modules use:
//!
//! - A *free* node is one whose pressure may change in the present iteration: it has pressure or
//!   penetrates.
//! - A *step* d is the change of the pressures in one iteration. Its *step length* τ is the factor
//!   of the search direction t in it.
//! - The *reference* is a number close to δ. It is subtracted from gaps before they are rounded to
//!   single precision: a stored gap is u − h − reference.
//! - The *offset* is the mean of the stored gaps in contact, so that δ = reference + offset.
//! - The *residual* of a node is its stored gap minus the offset.

use std::sync::Arc;

use super::elasticity::ElasticOperator;
use super::fft::Scratch;
use super::reduced::ReducedHeights;
use super::threads::Threads;

pub(crate) mod blocks;
mod body;
mod bounds;
mod candidates;
mod conductor;
pub mod cost;
mod initial_guess;
mod inner;
pub(crate) mod lanes;
mod line_search;
pub(crate) mod marks;
mod mesh;
mod nested;
mod passes;
mod preconditioner;
mod prescribed;
mod problem;
mod prolongation;
mod refinement;
mod stiffness;

pub use body::{Body, Elastic, Hardness, HardnessError};
pub use conductor::Conductor;
pub use prescribed::Prescribed;
pub use stiffness::ContactStiffness;

use inner::InnerSolver;
use nested::Coarser;
use passes::ReferencePressure;
use problem::Problem;

/// Returns the memory that a [`Solver`] needs for this tolerance, in bytes per node.
///
/// A run on 4096² nodes had a peak of 53 bytes per node, without the memory of the idle program.
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
/// use asperity_mechanics::elasticity::PeriodicHalfSpace;
/// use asperity_mechanics::grid::Grid;
/// use asperity_mechanics::reduced::Units;
/// use asperity_mechanics::solver::{Settings, Solver, Stop};
/// use asperity_mechanics::topography::moments::Moments;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// // Westergaard's wave: full contact at p* = π E* Δ/λ = E* × rms slope / √2, and under a lower
/// // load p a strip that covers (2/π) arcsin √(p/p*) of the area.
/// let grid = Grid::square(64, 1.0)?;
/// let wave = Shape::Wave { amplitude: 1.0, waves: 1 }.draw(grid);
/// let units = Units::new(grid.cell(), Moments::from_surface(&wave).rms_slope(), 1.0)?;
/// let heights = units.reduced_heights(wave)?;
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
/// # Ok::<(), Box<dyn std::error::Error>>(())
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

/// Surface, body and material, prepared once for all solvers of the surface; clones share the data.
#[derive(Clone)]
pub struct PreparedSurface(Arc<Problem>);

impl PreparedSurface {
    /// Creates a solver of the surface. A load has the same result with any of its solvers.
    pub fn solver(&self, threads: Threads) -> Solver {
        Solver::of_problem(threads, self.0.clone())
    }
}

impl Solver {
    /// Creates the solver of a surface with one height for each node of the body's grid. The mean
    /// of the heights does not matter.
    ///
    /// # Panics
    /// Panics if the number of heights differs from the number of nodes of the body.
    pub fn new(body: impl ElasticOperator + 'static, heights: &ReducedHeights) -> Self {
        Self::with_threads(Threads::one(), Box::new(body), None, heights)
    }

    /// Creates the solver of a surface on a material that yields at `hardness`, or on an elastic
    /// material if it is `None`.
    ///
    /// A load whose elastic pressures stay below the hardness gives the same bytes as with
    /// [`Solver::new`]. It takes more transform pairs if it was wrongly expected to make the
    /// material yield. All other loads are solved with both bounds, 0 ≤ p ≤ hardness.
    ///
    /// The threads also share the work of all loads, until [`Solver::set_threads`] replaces them.
    ///
    /// # Panics
    /// Panics if the number of heights differs from the number of nodes of the body.
    pub fn with_threads(
        threads: Threads,
        body: Box<dyn ElasticOperator>,
        hardness: Option<Hardness>,
        heights: &ReducedHeights,
    ) -> Self {
        let problem = Problem::new(&threads, body, hardness, heights.as_slice());
        PreparedSurface(Arc::new(problem)).solver(threads)
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
    /// ([`Body::sibling_bytes_per_node`]).
    ///
    /// ```
    /// use asperity_mechanics::elasticity::PeriodicHalfSpace;
    /// use asperity_mechanics::grid::Grid;
    /// use asperity_mechanics::reduced::ReducedHeights;
    /// use asperity_mechanics::solver::{Settings, Solver};
    /// use asperity_mechanics::threads::Threads;
    /// use asperity_mechanics::topography::shapes::Shape;
    ///
    /// let grid = Grid::square(64, 1.0)?;
    /// let wave = Shape::Wave { amplitude: 0.1, waves: 1 }.draw(grid);
    /// let heights = ReducedHeights::reduced(grid, wave.into_heights())?;
    /// let mut first = Solver::new(PeriodicHalfSpace::new(grid), &heights);
    /// let mut second = first.sibling(Threads::one());
    /// let press = |solver: &mut Solver, load| {
    ///     solver.press(load, &Settings::default(), &|| false).contact_nodes
    /// };
    /// let [light, heavy] = std::thread::scope(|scope| {
    ///     let heavy = scope.spawn(|| press(&mut second, 0.2));
    ///     [press(&mut first, 0.1), heavy.join().expect("no panic")]
    /// });
    /// assert!(light < heavy);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn sibling(&self, threads: Threads) -> Self {
        self.prepared().solver(threads)
    }

    /// Returns the prepared data of the surface, from which siblings are created.
    pub fn prepared(&self) -> PreparedSurface {
        PreparedSurface(self.problem.clone())
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

    /// Solves the contact under the mean pressure `load` > 0, in units of E* × rms slope.
    ///
    /// The load must be below the hardness, if there is one ([`Hardness::check_load`]). The result
    /// does not depend on loads that were solved before. At least one node bears pressure, even
    /// under the lightest load and after an interruption. `watch` is called in every iteration and
    /// can stop the solver; `&|| false` never stops it.
    pub fn press(&mut self, load: f64, settings: &Settings, watch: &dyn Watch) -> Outcome {
        assert!(load.is_finite() && load > 0.0, "the load must be positive and finite");
        self.begin_load(load, settings);
        if self.reaches_full_contact(load) {
            return self.press_to_full_contact();
        }
        let Some(hardness) = self.problem.hardness else {
            return self.solve_within(None, settings, watch);
        };
        hardness.check_load(load).expect("the load is below the hardness");
        // The hardness bounds the pressures only if elastic pressures exceed it, so that all other
        // loads have the same solution as without a hardness.
        if self.is_expected_to_yield(hardness, watch) {
            let outcome = self.solve_within(Some(hardness), settings, watch);
            if outcome.saturated_nodes > 0 || outcome.stop != Stop::Converged {
                return outcome;
            }
        }
        let outcome = self.solve_within(None, settings, watch);
        if outcome.peak_pressure > hardness.pressure() {
            return self.solve_within(Some(hardness), settings, watch);
        }
        outcome
    }

    /// Resets everything that earlier loads have changed.
    fn begin_load(&mut self, load: f64, settings: &Settings) {
        self.inner.begin_load(load, settings.tolerance);
        if let Some(coarser) = &mut self.coarser {
            coarser.found_for = None;
        }
    }

    fn press_to_full_contact(&mut self) -> Outcome {
        self.set_full_contact();
        let evaluation = self.evaluate();
        let summary = self.summarise();
        Outcome { mean_gap: 0.0, ..self.outcome(Stop::FullContact, evaluation, summary) }
    }

    /// Returns whether the material is expected to yield under the present load.
    fn is_expected_to_yield(&mut self, hardness: Hardness, watch: &dyn Watch) -> bool {
        let expected = self.yields_on_coarser(hardness, watch);
        expected.unwrap_or_else(|| !self.is_light() && self.inner.load > self.problem.yield_load)
    }

    /// Solves the present load with pressures at most `bound`.
    fn solve_within(
        &mut self,
        bound: Option<Hardness>,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Outcome {
        self.inner.bound = bound;
        let (history, evaluation) = self.initial_guess(settings, watch);
        self.solve(history, evaluation, settings, watch)
    }

    /// Returns whether all nodes are in contact under `load` without yielding; false if no formula
    /// gives the load of full contact.
    pub fn reaches_full_contact(&self, load: f64) -> bool {
        self.problem.reaches_full_contact(load)
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
        if self.problem.body.is_periodic() {
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

impl Solver {
    /// Returns the displacement u of the elastic body under `pressure`, with one pressure per node.
    ///
    /// The pressure is in units of E* × rms slope, the displacement in units of rms slope × longer
    /// side and positive into the body. The mean displacement is zero for a body that a uniform
    /// pressure does not displace.
    ///
    /// # Panics
    ///
    /// Panics if the number of pressures differs from the number of nodes.
    ///
    /// ```
    /// use std::f64::consts::PI;
    ///
    /// use asperity_mechanics::elasticity::PeriodicHalfSpace;
    /// use asperity_mechanics::grid::Grid;
    /// use asperity_mechanics::reduced::ReducedHeights;
    /// use asperity_mechanics::solver::Solver;
    ///
    /// // A pressure wave of wavelength λ causes a displacement of λ/(π E*) times the pressure.
    /// let grid = Grid::square(32, 1.0)?;
    /// let cosine = |node: usize| (2.0 * PI * grid.indices(node)[0] as f64 / 32.0).cos();
    /// let pressure: Vec<f64> = (0..grid.count()).map(cosine).collect();
    /// let flat = ReducedHeights::reduced(grid, vec![0.0; grid.count()])?;
    /// let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &flat);
    /// let displacement = solver.displacement_under(&pressure);
    /// for (u, p) in displacement.iter().zip(&pressure) {
    ///     assert!((u - p / PI).abs() < 1e-15);
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn displacement_under(&mut self, pressure: &[f64]) -> Vec<f64> {
        assert_eq!(pressure.len(), self.pressure.len(), "one pressure per node");
        let mut displacement = vec![0.0; pressure.len()];
        let scratch = &mut self.double_scratch;
        self.problem.transform.convolve(
            &self.problem.displacement,
            pressure,
            &mut displacement,
            scratch,
        );
        displacement
    }

    /// Returns the gap between the bodies under a pressure that solves the contact.
    ///
    /// The gap is u − h minus its mean in elastic contact, in the units of
    /// [`Solver::displacement_under`]. At nodes in elastic contact it is set to zero; the solution
    /// deviates from zero there by at most the residual. At saturated nodes the gap is negative, by
    /// the yielded depth. Elsewhere it is positive, except for the residual. If no node is in
    /// elastic contact, the mean is over all nodes with pressure.
    ///
    /// # Panics
    ///
    /// Panics if the number of pressures differs from the number of nodes.
    pub fn gap_under(&mut self, pressure: &[f64]) -> Vec<f64> {
        let hardness = self.problem.hardness.map_or(f64::INFINITY, |bound| bound.pressure());
        let mut gap = self.displacement_under(pressure);
        for (gap, height) in gap.iter_mut().zip(&self.problem.heights) {
            *gap -= height;
        }
        let is_elastic = |pressure: f64| pressure > 0.0 && pressure < hardness;
        let mean = mean_where(&gap, pressure, is_elastic);
        let in_contact = mean.or_else(|| mean_where(&gap, pressure, |pressure| pressure > 0.0));
        let offset = in_contact.unwrap_or_default();
        for (gap, &pressure) in gap.iter_mut().zip(pressure) {
            *gap = if is_elastic(pressure) { 0.0 } else { *gap - offset };
        }
        gap
    }
}

/// Returns the mean of `values` over the nodes whose pressure satisfies `is_so`, or `None` if there
/// are no such nodes.
fn mean_where(values: &[f64], pressure: &[f64], is_so: impl Fn(f64) -> bool) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for (value, _) in values.iter().zip(pressure).filter(|(_, p)| is_so(**p)) {
        sum += value;
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stop {
    /// The residual is within the tolerance.
    Converged,
    /// Every node is in contact, and the pressure follows from a formula.
    FullContact,
    /// The pair limit was reached; the pressure is the best found.
    PairLimit,
    /// The caller stopped the solver; the pressure is the best found.
    Interrupted,
    /// The surfaces do not touch at the prescribed mean gap.
    #[default]
    NoContact,
    /// No load gives the prescribed mean gap or approach; the load is the nearest one.
    NotReached,
}

/// Result for one load, without the pressures. The default is that of surfaces that do not touch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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
pub(crate) mod tests;
