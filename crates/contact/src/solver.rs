//! Presses a rigid rough surface into an elastic body, load after load.
//!
//! The pressure p and the gap g between the bodies satisfy p ≥ 0, g ≥ 0 and p g = 0 at every node
//! of a mesh, where g = u − h − offset: displacement u of the elastic body, height h of the rough
//! surface, and the rigid offset that makes the mean pressure equal to the load. What the body is,
//! an [`ElasticOperator`] says. Friction and adhesion are absent, so the solution is unique and
//! owes nothing to the loads before it: they serve as a guess.
//!
//! Materials yield. With a [`Hardness`] H the pressure is bounded, 0 ≤ p ≤ H, and where p = H the
//! gap may be negative, by the depth that the material has yielded: a node is out of contact, in
//! elastic contact, or saturated. This is a model of loading from the undeformed surfaces:
//! unloading, hardening and the material that piles up around a contact are not in it (Almqvist,
//! Sahlin, Larsson & Glavatskih, *Tribol. Int.* 40, 2007, 574).
//!
//! `press` holds a load together. `start` guesses, or `nested` by way of coarser meshes; `load`
//! keeps pressures within their bounds and of the load's mean. `search` has what an iteration works
//! on, `conjugate_gradients` holds it, in the line of Polonsky & Keer (*Wear* 231, 1999, 206) with
//! the preconditioners `extension` and `two_level`, `evaluation` evaluates where it led, and at
//! last it is decided which nodes at the edge of contact belong to it, after which the pressures
//! are evaluated once more: what is kept is what was evaluated. The search runs in single precision
//! on increments; what it finds is evaluated in double precision, and the residual found there is
//! where it goes on: iterative refinement.

use super::elasticity;
use super::elasticity::ElasticOperator;
use super::fft::{Kernel, Scratch, Transform};
use super::threads::Threads;

mod balance;
mod conjugate_gradients;
pub mod cost;
mod evaluation;
mod extension;
mod flags;
mod half_space;
mod heights;
mod lanes;
mod line_search;
mod load;
mod nearing;
mod nested;
mod passes;
mod press;
mod prolongation;
mod search;
mod start;
mod state;
mod two_level;

pub use half_space::{HalfSpace, Hardness, HardnessError};

use heights::{CentredHeights, range};
use nearing::Expected;
use nested::Coarser;
use passes::ReferencePressure;
use search::Search;

/// Bytes that a [`Solver`] holds for each node, with solutions of this tolerance: 59 were measured
/// at the peak of runs on 2048² and 4096² nodes.
pub fn bytes_per_node(tolerance: f64) -> f64 {
    if ReferencePressure::is_map(tolerance) { 63.375 } else { 59.375 }
}

/// One rough surface, and its contact at the last load.
///
/// Holds about 59 bytes a node: heights and pressure in double precision; heights, the search's
/// pressure, the previous pressure, gap and previous gap, and what nodes last_step from iteration to
/// iteration in single; a half spectrum, of either precision in turn, and three kernels of a
/// quarter of the mesh; on coarser meshes, of a third of the nodes together, heights, what was
/// found, and two kernels, in single. For tolerances below 1e-5, 4 more.
///
/// ```
/// use asperity_contact::elasticity::PeriodicHalfSpace;
/// use asperity_contact::grid::Grid;
/// use asperity_contact::solver::{Settings, Solver, Stop};
/// use asperity_contact::topography::moments::Moments;
/// use asperity_contact::topography::shapes::Shape;
///
/// // Westergaard's wave: full contact at π E* Δ/λ, which is E* × rms slope / √2; a strip of
/// // a = (2/π) arcsin √(p/p*) under less.
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
/// // Half of the 64 rows, but for one at each edge of the strip.
/// assert!(outcome.contact_nodes.abs_diff(32 * 64) <= 2 * 64);
/// let mean = solver.pressure().iter().sum::<f64>() / grid.count() as f64;
/// assert!((mean - full / 2.0).abs() < 1e-12);
/// # Ok::<(), asperity_contact::grid::GridError>(())
/// ```
pub struct Solver {
    body: Box<dyn ElasticOperator>,
    heights: Vec<f64>,
    lowest: f64,
    highest: f64,
    full_contact: Option<FullContact>,
    hardness: Option<Hardness>,
    /// The least load under which the material was seen to yield.
    yields_from: f64,

    /// Under the last load. Before the first one, that of full contact, of zero mean, if there is a
    /// formula.
    pressure: Vec<f64>,
    earlier_pressure: Vec<f32>,
    earlier_load: f64,

    /// Nodes in contact under the last load, and under the one before.
    contact_nodes: f64,
    earlier_contact_nodes: f64,

    earlier_gap: Vec<f32>,
    earlier_reference: f64,
    /// Mean of the gap in contact, less the reference.
    offset: f64,
    earlier_offset: f64,
    /// Which nodes are expected in contact when the next search begins.
    expected: Expected,

    double: Transform<f64>,
    double_scratch: Scratch<f64>,
    displacement: Kernel<f64>,

    /// Of the last load, whose gap it has.
    search: Search,
    /// Made when a load is the first to need it.
    coarser: Option<Box<Coarser>>,
}

/// What the pressure that flattens a surface is like, of zero mean.
#[derive(Debug, Clone, Copy)]
struct FullContact {
    /// How far it is below zero, and so the least load that brings every node into contact.
    load: f64,
    peak: f64,
}

impl Solver {
    /// Prepares a surface of one height for each node of the body's grid, peaks towards the body,
    /// in units of rms slope × the longer side of the cell: of unit rms slope where that is one.
    /// Their mean is of no consequence.
    pub fn new(body: impl ElasticOperator + 'static, heights: &[f64]) -> Self {
        Self::with_hardness(body, None, heights)
    }

    /// The same on a material that yields under the hardness, if there is one.
    ///
    /// Loads whose elastic pressure nowhere passes it are solved as by [`Solver::new`], to the same
    /// bytes (the first one in more pairs, if it was expected to pass it); from the first one on
    /// that does, in ascending order, all are solved for both bounds.
    pub fn with_hardness(
        body: impl ElasticOperator + 'static,
        hardness: Option<Hardness>,
        heights: &[f64],
    ) -> Self {
        Self::with_threads(Threads::one(), Box::new(body), hardness, heights)
    }

    /// The same, prepared by several threads, which [work on it](Solver::set_threads) from then on.
    pub fn with_threads(
        threads: Threads,
        body: Box<dyn ElasticOperator>,
        hardness: Option<Hardness>,
        heights: &[f64],
    ) -> Self {
        let (nodes, cells) = (body.grid().nodes(), body.grid().count());
        assert_eq!(heights.len(), cells, "heights fill the mesh");
        let CentredHeights { heights, single_heights, lowest, highest } =
            CentredHeights::new(&threads, heights, nodes[1]);
        let double = elasticity::transform(&*body);
        let mut double_scratch = double.scratch_on(threads.clone());
        let mut pressure = vec![0.0; cells];
        let full_contact = body.stiffness_is_exact().then(|| {
            let stiffness = elasticity::stiffness_on(&threads, &*body);
            double.convolve(&stiffness, &heights, &mut pressure, &mut double_scratch);
            let [lowest, peak] = range(&threads, &mut pressure, nodes[1]);
            let load = -lowest;
            FullContact { load, peak }
        });
        let search = Search::new(&threads, &*body, single_heights);
        Self {
            lowest,
            highest,
            heights,
            full_contact,
            hardness,
            yields_from: f64::INFINITY,
            pressure,
            earlier_pressure: vec![0.0; cells],
            earlier_load: 0.0,
            contact_nodes: 0.0,
            earlier_contact_nodes: 0.0,
            expected: Expected::All,
            earlier_gap: vec![0.0; cells],
            earlier_reference: 0.0,
            offset: 0.0,
            earlier_offset: 0.0,
            double,
            double_scratch,
            displacement: elasticity::displacement_on(&threads, &*body),
            search,
            coarser: None,
            body,
        }
    }

    /// Lets these threads share the work from now on. Nothing else depends on them: with any
    /// number, the same load has the same pressure, to the bit.
    pub fn set_threads(&mut self, threads: Threads) {
        self.double_scratch.set_threads(threads.clone());
        if let Some(coarser) = &mut self.coarser {
            coarser.set_threads(&threads);
        }
        self.search.set_threads(threads);
    }

    /// Who shares the work.
    pub fn threads(&self) -> &Threads {
        &self.search.threads
    }

    /// The least load, in units of E* × rms slope, that brings every node into contact, if it is
    /// known from a formula: not where the material yields before.
    pub fn full_contact_load(&self) -> Option<f64> {
        let full = self.full_contact?;
        let ceiling = self.hardness.map_or(f64::INFINITY, Hardness::pressure);
        (full.load + full.peak <= ceiling).then_some(full.load)
    }

    /// What unit pressure on all nodes displaces each of them by, where displacements are absolute:
    /// nothing on a body that a uniform pressure does not displace. Since two nodes do the same to
    /// each other, the mean of p times this is the mean displacement under any pressure p. In units
    /// of the longer side over E*.
    pub fn displacement_under_unit_pressure(&mut self) -> Option<Vec<f64>> {
        if self.body.has_zero_mean_displacement() {
            return None;
        }
        let unit = vec![1.0; self.pressure.len()];
        let mut sunk = unit.clone();
        let scratch = &mut self.double_scratch;
        self.double.convolve(&self.displacement, &unit, &mut sunk, scratch);
        Some(sunk)
    }

    /// The pressure under the last load, in units of E* × rms slope: exactly zero outside the
    /// contact, exactly the hardness at saturated nodes, and of the load's mean to rounding.
    pub fn pressure(&self) -> &[f64] {
        &self.pressure
    }
}

/// At this tolerance contact counts on 1024² nodes are within 2 nodes of those at 1e-10 at each of
/// 1320 loads on twelve surfaces of three spectra; of the nodes, 0.07 are wrong on average.
pub const DEFAULT_TOLERANCE: f64 = 5e-5;

/// Far more than any load of a rough surface takes.
pub const DEFAULT_PAIR_LIMIT: u32 = 2000;

/// When a load counts as solved, and when to give up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest [`Outcome::residual`] of a solution, yielding or not. It is held to a tenth, too, of
    /// what the mean pressure in contact displaces one node by: less than the default only where
    /// that pressure is below 5e-4 E* × rms slope.
    pub tolerance: f64,
    /// Transform pairs, forward and inverse, after which a load is given up; asked once an
    /// iteration, so that a few more may be spent.
    pub pair_limit: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: DEFAULT_TOLERANCE, pair_limit: DEFAULT_PAIR_LIMIT }
    }
}

/// How a load ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// Within the tolerance.
    Converged,
    /// Every node is in contact, and the pressure follows from a formula.
    FullContact,
    /// Out of transform pairs; the pressure is the best known.
    PairLimit,
    /// Told to stop.
    Interrupted,
}

/// What is known of a load besides its pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub stop: Stop,
    /// Transform pairs spent, in both precisions; those on coarser meshes by their nodes.
    pub pairs: u32,
    /// The largest violation of the conditions of contact by the pressures that are kept, evaluated
    /// in double precision, in units of rms slope × the smaller mesh step: |g| in elastic contact,
    /// the penetration −g outside contact, and g at saturated nodes, where only yielding may make
    /// it negative. The gap is measured from its mean in elastic contact; the bounds of the
    /// pressure hold exactly.
    pub residual: f64,
    /// Nodes with pressure.
    pub contact_nodes: usize,
    /// Of these, the ones that bear the hardness: none without one.
    pub saturated_nodes: usize,
    /// Mean gap over the map, in units of rms slope × its longer side. Where the material has
    /// yielded there is none.
    pub mean_gap: f64,
    /// The depth to which saturated nodes have yielded, −g ≥ 0, as its mean over the map: the
    /// volume that has yielded, per area. In units of rms slope × longer side; zero without a
    /// hardness.
    pub yielded_depth: f64,
    /// Elastic energy per area ½⟨p u⟩, in units of E* × rms slope² × longer side. What is
    /// dissipated by yielding is not in it: the hardness × [`Outcome::yielded_depth`].
    pub energy: f64,
    /// In units of E* × rms slope: the hardness, where a node is saturated.
    pub peak_pressure: f64,
}

/// Is told once an iteration how far a load has come, and says whether it is to go on. A function
/// without arguments is one that hears nothing: whether it has been interrupted.
pub trait Watch {
    /// Whether to stop here: the best pressure so far is the outcome.
    fn is_interrupted(&self) -> bool;

    /// So many transform pairs have been spent on the load.
    fn spent(&self, _pairs: u32) {}
}

impl<F: Fn() -> bool> Watch for F {
    fn is_interrupted(&self) -> bool {
        self()
    }
}

#[cfg(test)]
mod tests;
