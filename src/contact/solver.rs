//! Presses a rigid rough surface into an elastic body, load after load.
//!
//! The pressure p and the gap g between the bodies satisfy p ≥ 0, g ≥ 0 and p g = 0 at every node
//! of a mesh, where g = u − h − offset: displacement u of the elastic body, height h of the
//! rough surface, and the rigid offset that makes the mean pressure equal to the load. What the body
//! is, an [`ElasticOperator`] says. Friction and
//! adhesion are absent, so the solution is unique and owes nothing to the loads before it: they
//! serve as a guess.
//!
//! `start` guesses, `conjugate_gradients` holds the iteration, in the line of Polonsky & Keer
//! (*Wear* 231, 1999, 206) with a preconditioner, `evaluation` evaluates where it led, and
//! `active_set` lets go what is in contact by an oversight. The search runs in single precision on
//! increments; what it finds is evaluated in double precision, and the residual found there is
//! where it goes on: iterative refinement.

use super::fft::{Kernel, Scratch, Transform};
use crate::contact::elasticity::{self, ElasticOperator};

mod active_set;
mod conjugate_gradients;
pub(crate) mod cost;
mod evaluation;
mod flags;
mod history;
mod lanes;
mod line_search;
mod passes;
mod start;
mod steps;
mod survey;

use evaluation::Evaluation;
use history::History;
use passes::{Base, Sample};
use start::Start;
use steps::Steps;

/// How far an evaluation in single precision is trusted to have reduced the residual of the last
/// one in double precision: far from its rounding, 1e-7.
const SINGLE_REDUCTION: f64 = 1e-4;

/// The largest residual over the displacement of one node under the mean pressure in contact. Beyond
/// it, contact would be whatever a guess took for it.
const SHARE_OF_DISPLACEMENT: f64 = 0.1;

/// At this tolerance contact counts are within 4 nodes of a million, 0.4 on average.
pub const DEFAULT_TOLERANCE: f64 = 6e-5;
/// Far more than any load of a rough surface takes.
pub const DEFAULT_PAIR_LIMIT: u32 = 2000;

/// When a load counts as solved, and when to give up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest [`Outcome::residual`] of a solution. It is held to a tenth, too, of what the mean
    /// pressure in contact displaces one node by: less than the default only where that pressure is
    /// below 5e-4 E* × rms slope.
    pub tolerance: f64,
    /// Transform pairs, forward and inverse, after which a load is given up; asked once an
    /// iteration, so that a few more may be spent.
    pub pair_limit: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: DEFAULT_TOLERANCE,
            pair_limit: DEFAULT_PAIR_LIMIT,
        }
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
    /// Transform pairs spent, in both precisions.
    pub pairs: u32,
    /// The largest of |g| in contact and of the penetration −g elsewhere, in double precision, in
    /// units of rms slope × the smaller mesh step. The gap is measured from its mean in contact.
    pub residual: f64,
    /// Nodes with pressure.
    pub contact_nodes: usize,
    /// Mean gap over the map, in units of rms slope × its longer side.
    pub mean_gap: f64,
    /// Elastic energy per area ½⟨p u⟩, in units of E* × rms slope² × longer side.
    pub energy: f64,
    /// In units of E* × rms slope.
    pub peak_pressure: f64,
}

/// Bytes that a [`Solver`] holds for each node, with solutions of this tolerance.
pub fn bytes_per_node(tolerance: f64) -> f64 {
    if Base::is_map(tolerance) { 61.0 } else { 57.0 }
}

/// One rough surface, and its contact at the last load.
///
/// Holds about 57 bytes a node: heights and pressure in double precision; heights, the search's
/// pressure, the previous pressure, gap and previous gap, and what nodes carry from iteration to
/// iteration in single; a half spectrum of each precision, and three kernels of half the mesh. For
/// tolerances below 1e-5, 4 more.
///
/// ```
/// use asperity::contact::elasticity::PeriodicHalfSpace;
/// use asperity::contact::grid::Grid;
/// use asperity::contact::solver::{Settings, Solver, Stop};
/// use asperity::contact::topography::moments::Moments;
/// use asperity::contact::topography::shapes::Shape;
///
/// // Westergaard's wave: full contact at π E* Δ/λ, which is E* × rms slope / √2; a strip of
/// // a = (2/π) arcsin √(p/p*) under less.
/// let grid = Grid::square(64, 1.0)?;
/// let wave = Shape::Wave { amplitude: 1.0, waves: 1 }.draw(grid);
/// let slope = Moments::of(&wave).rms_slope();
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
/// # Ok::<(), asperity::contact::grid::GridError>(())
/// ```
pub struct Solver {
    body: Box<dyn ElasticOperator>,
    nodes: [usize; 2],
    /// Mesh steps, the smaller ones, in the longer side.
    steps_per_side: f64,
    heights: Vec<f64>,
    /// The largest of them.
    highest: f64,
    full_contact_load: Option<f64>,

    pressure: Vec<f64>,
    load: f64,
    earlier_pressure: Vec<f32>,
    earlier_load: f64,
    steps: Steps,

    /// Gap less the gap reference.
    gap: Vec<f32>,
    reference: f64,
    earlier_gap: Vec<f32>,
    earlier_reference: f64,
    /// Mean of the gap in contact, less the reference.
    offset: f64,
    earlier_offset: f64,
    /// Heights less their reference.
    single_heights: Vec<f32>,
    height_reference: f64,
    /// Pressures of a search are counted from here,
    base: Base,
    /// and are so much higher.
    rise: Vec<f32>,
    /// The last move of free nodes; elsewhere, the extension of the gap. Marked, see `passes`.
    carry: Vec<f32>,
    sample: Sample,
    free_nodes: f64,

    double: Transform<f64>,
    double_scratch: Scratch<f64>,
    displacement: Kernel<f64>,
    single: Transform<f32>,
    single_scratch: Scratch<f32>,
    single_displacement: Kernel<f32>,
    single_stiffness: Kernel<f32>,
    nodal_stiffness: f64,
    nodal_compliance: f64,

    /// Transform pairs spent on the present load.
    pairs: u32,
}

impl Solver {
    /// Prepares a surface of one height for each node of the body's grid, peaks towards the body, in
    /// units of rms slope × the longer side of the cell: of unit rms slope where that is one. Their
    /// mean is of no consequence.
    pub fn new(body: impl ElasticOperator + 'static, heights: &[f64]) -> Self {
        Self::of(Box::new(body), heights)
    }

    fn of(body: Box<dyn ElasticOperator>, heights: &[f64]) -> Self {
        let (nodes, cells) = (body.grid().nodes(), body.grid().count());
        assert_eq!(heights.len(), cells, "heights fill the mesh");
        let mean = heights.iter().sum::<f64>() / cells as f64;
        let heights: Vec<f64> = heights.iter().map(|height| height - mean).collect();
        let (double, single) = (elasticity::transform(&*body), elasticity::transform(&*body));
        let mut double_scratch = double.scratch();
        let mut pressure = vec![0.0; cells];
        let full_contact_load = body.stiffness_is_exact().then(|| {
            let flatten = elasticity::stiffness(&*body);
            double.convolve(&flatten, &heights, &mut pressure, &mut double_scratch);
            -pressure.iter().fold(0.0, |lowest: f64, p| lowest.min(*p))
        });
        Self {
            nodes,
            steps_per_side: body.grid().smaller_steps(),
            single_heights: heights.iter().map(|height| *height as f32).collect(),
            height_reference: 0.0,
            highest: heights.iter().fold(f64::MIN, |highest, h| highest.max(*h)),
            heights,
            full_contact_load,
            pressure,
            load: 0.0,
            earlier_pressure: vec![0.0; cells],
            earlier_load: 0.0,
            steps: Steps::default(),
            gap: vec![0.0; cells],
            reference: 0.0,
            earlier_gap: vec![0.0; cells],
            earlier_reference: 0.0,
            offset: 0.0,
            earlier_offset: 0.0,
            carry: vec![0.0; cells],
            base: Base::new(nodes),
            rise: vec![0.0; cells],
            sample: Sample::new(nodes),
            free_nodes: 0.0,
            double,
            double_scratch,
            displacement: elasticity::displacement(&*body),
            single_scratch: single.scratch(),
            single,
            single_displacement: elasticity::displacement(&*body),
            single_stiffness: elasticity::stiffness(&*body),
            nodal_stiffness: body.nodal_stiffness(),
            nodal_compliance: body.nodal_compliance(),
            pairs: 0,
            body,
        }
    }

    /// The least load, in units of E* × rms slope, that brings every node into contact, if it is known
    /// from a formula.
    pub fn full_contact_load(&self) -> Option<f64> {
        self.full_contact_load
    }

    /// The pressure under the last load, in units of E* × rms slope: exactly zero outside the
    /// contact, and of the load's mean to rounding.
    pub fn pressure(&self) -> &[f64] {
        &self.pressure
    }

    /// Finds the contact under a mean pressure `load` > 0, in units of E* × rms slope.
    ///
    /// Loads may come in any order; those in ascending order are found fastest. However light the
    /// load, and however it ends, some node bears it.
    pub fn press(
        &mut self,
        load: f64,
        settings: &Settings,
        interrupted: &dyn Fn() -> bool,
    ) -> Outcome {
        assert!(load.is_finite() && load > 0.0, "a load presses");
        self.pairs = 0;
        self.base.prepare(settings.tolerance);
        if self.full_contact_load.is_some_and(|full| load >= full) {
            self.flatten(load);
            let evaluation = self.evaluate();
            return Outcome {
                mean_gap: 0.0,
                ..self.outcome(Stop::FullContact, evaluation)
            };
        }
        let mut history = History::default();
        let mut evaluation = match self.guess(load) {
            Some(start) => self.approach(&mut history, start, settings, interrupted),
            None => self.evaluate_guess(settings),
        };
        loop {
            let stop = if self.is_solved(settings, &evaluation) {
                self.release(evaluation.standing.offset);
                Stop::Converged
            } else if self.pairs >= settings.pair_limit {
                Stop::PairLimit
            } else if interrupted() {
                Stop::Interrupted
            } else {
                let start = self.ask(evaluation.standing.offset);
                evaluation = self.approach(&mut history, start, settings, interrupted);
                continue;
            };
            return self.outcome(stop, evaluation);
        }
    }

    /// Iterates to where the tolerance is met, or as far as single precision reaches.
    fn approach(
        &mut self,
        history: &mut History,
        start: Start,
        settings: &Settings,
        interrupted: &dyn Fn() -> bool,
    ) -> Evaluation {
        let begun = self.residual(start.standing.error);
        let tolerance = self.tolerance(settings, self.free_nodes);
        let goal = tolerance.max(SINGLE_REDUCTION * begun);
        let stop = |pairs| pairs >= settings.pair_limit || interrupted();
        self.refine(history, start, goal, &stop)
    }

    fn is_solved(&self, settings: &Settings, evaluation: &Evaluation) -> bool {
        let tolerance = self.tolerance(settings, evaluation.contact_nodes);
        self.residual(evaluation.standing.error) <= tolerance
    }

    /// The tolerance asked for, or what tells which of so many nodes bear the load, if that is less
    /// and heights are known so well.
    fn tolerance(&self, settings: &Settings, contact_nodes: f64) -> f64 {
        let mean_pressure = self.load * self.pressure.len() as f64 / contact_nodes;
        let share = SHARE_OF_DISPLACEMENT * self.nodal_compliance * mean_pressure;
        let rounding = f64::EPSILON * self.highest;
        settings.tolerance.min(self.residual(share.max(rounding)))
    }

    /// An error of the gap in mesh steps of a surface of unit rms slope.
    fn residual(&self, error: f64) -> f64 {
        self.steps_per_side * error
    }

    fn outcome(&mut self, stop: Stop, evaluation: Evaluation) -> Outcome {
        let (contact_nodes, peak_pressure) = self.conclude();
        Outcome {
            stop,
            pairs: self.pairs,
            residual: self.residual(evaluation.standing.error),
            contact_nodes,
            mean_gap: evaluation.mean_gap,
            energy: evaluation.energy,
            peak_pressure,
        }
    }
}

#[cfg(test)]
mod tests;
