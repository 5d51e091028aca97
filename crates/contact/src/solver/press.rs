//! Solution of one load, from the initial guess to the decision about nodes at the edge of contact.
//!
//! A solution within the tolerance leaves two kinds of nodes undecided. Some bear a small pressure
//! although their gap is positive: they were in contact before, and their pressure has not yet
//! fallen to zero. Others bear no pressure although they penetrate by less than the tolerance. For
//! each of these nodes, [`Solver::decide`] estimates whether a solution with a smaller residual
//! would have it in contact, and sets its pressure accordingly. The pressures are evaluated again,
//! so that the residual is that of the returned pressures.

use pulp::Simd;

use super::evaluation::Evaluation;
use super::lanes::{InOrder, Pass, over_rows, sum_by, weight};
use super::line_search::History;
use super::load::PressureSummary;
use super::passes::ReferencePressure;
use super::start::Start;
use super::{Hardness, Outcome, Settings, Solver, Stop, Watch};
use crate::fft::Row;

/// Maximum residual, as a fraction of the displacement that the mean contact pressure on a single
/// node causes at this node.
///
/// A larger residual would let the contact depend on the initial guess.
const MAX_FRACTION_OF_DISPLACEMENT: f64 = 0.1;

/// Largest accepted rounding error of the residual, as a fraction of the tolerance.
const MAX_ROUNDING: f64 = 0.01;

/// Maximum number of times that [`Solver::solve`] lets [`Solver::decide`] change the contact. After
/// that, it accepts a solution within the tolerance as it is.
const DECISIONS: u32 = 2;

/// Returns whether a load that was solved with the hardness as bound needs this bound.
pub fn has_yielded(outcome: &Outcome) -> bool {
    outcome.saturated_nodes > 0 || outcome.stop != Stop::Converged
}

impl Solver {
    /// Solves the contact under the mean pressure `load` > 0, in units of E* × rms slope.
    ///
    /// The load must be below the hardness, if there is one ([`Hardness::check_load`]). The result
    /// does not depend on loads that were solved before. At least one node bears pressure, even
    /// under the lightest load and after an interruption. `watch` is called in every iteration and
    /// can stop the solver; `&|| false` never stops it.
    pub fn press(&mut self, load: f64, settings: &Settings, watch: &dyn Watch) -> Outcome {
        assert!(load.is_finite() && load > 0.0, "the load must be positive and finite");
        if let Some(hardness) = self.problem.hardness {
            hardness.check_load(load).expect("the load is below the hardness");
        }
        self.begin_load(load, settings);
        if self.reaches_full_contact(load) {
            self.set_full_contact();
            let evaluation = self.evaluate();
            let summary = self.summarise();
            return Outcome {
                mean_gap: 0.0,
                ..self.outcome(Stop::FullContact, evaluation, summary)
            };
        }
        if let Some(outcome) = self.press_nested(settings, watch) {
            return outcome;
        }
        if let Some(hardness) = self.problem.hardness.filter(|_| self.is_expected_to_yield()) {
            let outcome = self.solve_within(Some(hardness), settings, watch);
            if has_yielded(&outcome) {
                return outcome;
            }
        }
        let outcome = self.solve_within(None, settings, watch);
        self.solve_again_if_yielding(outcome, settings, watch)
    }

    /// Resets everything that earlier loads have changed.
    pub(super) fn begin_load(&mut self, load: f64, settings: &Settings) {
        self.inner.load = load;
        self.inner.bound = None;
        self.inner.pairs = 0;
        self.inner.reference = 0.0;
        self.inner.extension.is_enabled = true;
        self.inner.reference_pressure.prepare(settings.tolerance);
        self.inner.active.prepare(ReferencePressure::is_map(settings.tolerance));
    }

    /// Returns whether the material is expected to yield under the present load. The result is
    /// false if the load is light.
    pub(super) fn is_expected_to_yield(&self) -> bool {
        self.inner.load > self.problem.yield_load && !self.is_light(self.inner.load)
    }

    /// Solves the same load again, with the hardness as bound, if the peak pressure of `outcome`
    /// exceeds the hardness. Otherwise returns `outcome`, which was found without the bound.
    pub(super) fn solve_again_if_yielding(
        &mut self,
        outcome: Outcome,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Outcome {
        match self.problem.hardness {
            Some(hardness) if outcome.peak_pressure > hardness.pressure() => {
                let evaluation = self.guess_yielding(hardness);
                self.inner.extension.is_enabled = true;
                self.solve(History::default(), evaluation, settings, watch)
            }
            _ => outcome,
        }
    }

    /// Solves the present load on this mesh alone, with pressures at most `bound`.
    pub(super) fn solve_within(
        &mut self,
        bound: Option<Hardness>,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Outcome {
        self.inner.bound = bound;
        self.inner.reference = 0.0;
        self.inner.extension.is_enabled = true;
        self.guess();
        let evaluation = self.evaluate_guess(settings);
        self.solve(History::default(), evaluation, settings, watch)
    }

    /// Returns whether all nodes are in contact under `load` without yielding; false if no formula
    /// gives the load of full contact.
    pub fn reaches_full_contact(&self, load: f64) -> bool {
        self.problem.reaches_full_contact(load)
    }

    /// Iterates from the present pressures, whose evaluation is given, until the residual is within
    /// the tolerance and [`Solver::decide`] makes no more changes.
    ///
    /// Stops earlier at the pair limit or if `watch` interrupts. The outcome describes exactly the
    /// final pressures, because none changes after the last evaluation.
    pub(super) fn solve(
        &mut self,
        mut history: History,
        mut evaluation: Evaluation,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Outcome {
        let mut decisions = DECISIONS;
        loop {
            if self.is_solved(settings, &evaluation) {
                if self.is_rounded(settings, &evaluation) {
                    self.inner.reference += evaluation.convergence.offset;
                    evaluation = self.evaluate();
                    continue;
                }
                let summary = self.summarise();
                if decisions > 0 && self.decide(evaluation.convergence.offset, summary) {
                    decisions -= 1;
                    evaluation = self.evaluate();
                    continue;
                }
                return self.outcome(Stop::Converged, evaluation, summary);
            }
            let stop = if self.inner.pairs >= settings.pair_limit {
                Stop::PairLimit
            } else if watch.is_interrupted() {
                Stop::Interrupted
            } else {
                let start = self.initial_residual(evaluation.convergence);
                evaluation = self.approach(&mut history, start, settings, watch);
                continue;
            };
            let summary = self.summarise();
            return self.outcome(stop, evaluation, summary);
        }
    }

    /// Iterates in single precision from `start` until the tolerance is met, rounding prevents
    /// progress, or the pair limit or `watch` stops it. Returns the evaluation of the new pressures
    /// in double precision.
    ///
    /// `history` holds what earlier iterations for the same load have learnt.
    pub(super) fn approach(
        &mut self,
        history: &mut History,
        start: Start,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Evaluation {
        let tolerance = self.tolerance(settings, self.inner.free_nodes);
        let stop = |pairs| {
            watch.spent(pairs);
            pairs >= settings.pair_limit || watch.is_interrupted()
        };
        self.refine(history, start, tolerance, &stop)
    }

    pub(super) fn is_solved(&self, settings: &Settings, evaluation: &Evaluation) -> bool {
        let tolerance = self.tolerance(settings, evaluation.contact_nodes);
        self.inner.residual(evaluation.convergence.error) <= tolerance
    }

    /// Returns whether ε |offset|, the rounding error of the stored gaps in contact, exceeds the
    /// fraction [`MAX_ROUNDING`] of the tolerance. ε is [`f32::EPSILON`], and the offset is the
    /// mean of these gaps.
    fn is_rounded(&self, settings: &Settings, evaluation: &Evaluation) -> bool {
        let Evaluation { convergence, contact_nodes, .. } = evaluation;
        let rounding = f64::from(f32::EPSILON) * convergence.offset.abs();
        let tolerance = self.tolerance(settings, *contact_nodes);
        self.inner.residual(rounding) > MAX_ROUNDING * tolerance
    }

    /// Returns the residual to reach, in mesh steps at unit rms slope, if `contact_nodes` nodes are
    /// in contact.
    ///
    /// It is at most `settings.tolerance`, and at most the fraction
    /// [`MAX_FRACTION_OF_DISPLACEMENT`] of the displacement of one node under the mean contact
    /// pressure. The second limit is never below the rounding error of the heights.
    fn tolerance(&self, settings: &Settings, contact_nodes: f64) -> f64 {
        let mean_pressure = self.inner.load * self.pressure.len() as f64 / contact_nodes;
        let bound = MAX_FRACTION_OF_DISPLACEMENT * self.inner.mesh.nodal_compliance * mean_pressure;
        let rounding = f64::EPSILON * self.problem.highest;
        settings.tolerance.min(self.inner.residual(bound.max(rounding)))
    }

    fn outcome(&mut self, stop: Stop, evaluation: Evaluation, summary: PressureSummary) -> Outcome {
        Outcome {
            stop,
            pairs: self.inner.pairs,
            // If all contact nodes are saturated, the error may be negative.
            residual: self.inner.residual(evaluation.convergence.error.max(0.0)),
            contact_nodes: summary.contact_nodes,
            saturated_nodes: summary.saturated_nodes,
            mean_gap: evaluation.mean_gap,
            yielded_depth: evaluation.yielded_depth,
            energy: evaluation.energy,
            peak_pressure: summary.peak_pressure,
        }
    }
}

/// Smallest ratio c p/g for which a node with pressure p and gap g > 0 stays in contact, where c p
/// is the displacement of the node under its own pressure.
///
/// With 0.675, as many nodes are released too early as too late in series of loads on 256² to 1024²
/// nodes.
const UNDECIDED: f64 = 0.675;

/// Largest sum of the changes of pressure that [`Solver::decide`] makes, as a fraction of the load
/// on elastic nodes.
///
/// If saturated nodes bear nearly all of the load, changes within the tolerance may exceed the
/// pressures of all elastic nodes. Single nodes cannot be decided then.
const LARGEST_CHANGE: f64 = 0.1;

impl Solver {
    /// Decides which nodes at the edge of contact belong to it, and restores the mean pressure.
    ///
    /// Let g be the gap of a node minus `offset`, the mean gap in elastic contact, and c the
    /// displacement of a node under unit pressure on itself. A node with pressure p > 0 is released
    /// if c p < [`UNDECIDED`] g. The node with the lowest gap stays in contact. A node that
    /// penetrates without pressure gets the pressure −g/c, which closes its own gap. Of 31 such
    /// nodes under twenty loads of two surfaces, 27 are in contact in a solution with a residual of
    /// 1e-10.
    ///
    /// Returns whether any pressure changed, in which case the pressures must be evaluated again.
    /// `summary` describes the pressures before the decision.
    pub(super) fn decide(&mut self, offset: f64, summary: PressureSummary) -> bool {
        let decision = Decision { compliance: self.inner.mesh.nodal_compliance, offset };
        let (threads, row_nodes) = (&self.inner.threads, self.inner.mesh.nodes[1]);
        let mut changes =
            Changes { decision, gap: &self.inner.gap, nodes: 0.0, pressure: InOrder::new() };
        over_rows(threads, &mut self.pressure, row_nodes, &mut changes);
        let total = self.inner.load * self.pressure.len() as f64;
        let elastic = match self.inner.bound {
            None => total,
            Some(hardness) => total - hardness.pressure() * summary.saturated_nodes as f64,
        };
        if changes.nodes == 0.0 || changes.pressure.total() > LARGEST_CHANGE * elastic {
            return false;
        }
        let mut decide = Decide { decision, gap: &self.inner.gap };
        over_rows(threads, &mut self.pressure, row_nodes, &mut decide);
        self.impose_load();
        true
    }
}

/// Criterion by which [`Solver::decide`] puts a single node into contact or out of it.
#[derive(Clone, Copy)]
struct Decision {
    /// Displacement of a node under unit pressure on itself.
    compliance: f64,
    offset: f64,
}

impl Decision {
    /// Returns the new pressure of a node, given its present pressure and gap.
    #[inline(always)]
    fn pressure(self, pressure: f64, gap: f32) -> f64 {
        // The lowest gap in contact exceeds the mean by rounding only.
        let rounding = f64::from(f32::EPSILON * gap.abs());
        let above = f64::from(gap) - self.offset;
        let closing = (-above - rounding).max(0.0) / self.compliance;
        let is_held = pressure * self.compliance >= UNDECIDED * (above - rounding);
        closing * weight::<f64>(pressure == 0.0) + pressure * weight::<f64>(is_held)
    }
}

/// Pass over pressures that counts the nodes whose pressure `decision` changes, and adds up the
/// absolute changes.
struct Changes<'a> {
    decision: Decision,
    gap: &'a [f32],
    nodes: f64,
    pressure: InOrder<f64>,
}

impl Pass<f64> for Changes<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        let (decision, gap) = (self.decision, row.of(self.gap));
        let changes = |p, gap| weight::<f64>(decision.pressure(p, gap) != p);
        self.nodes += sum_by(pressure, gap, changes);
        let by = |p, gap| (decision.pressure(p, gap) - p).abs();
        self.pressure.push(sum_by(pressure, gap, by));
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { nodes: 0.0, pressure: InOrder::new(), ..*self }
    }

    fn append(&mut self, later: Self) {
        self.nodes += later.nodes;
        self.pressure.append(later.pressure);
    }
}

struct Decide<'a> {
    decision: Decision,
    gap: &'a [f32],
}

impl Pass<f64> for Decide<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        for (p, gap) in pressure.iter_mut().zip(row.of(self.gap)) {
            *p = self.decision.pressure(*p, *gap);
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}

#[cfg(test)]
mod tests {
    use crate::solver::tests::{rough, solver};
    use crate::solver::{Settings, Stop};

    fn contact(solver: &super::Solver) -> Vec<bool> {
        solver.pressure().iter().map(|p| *p > 0.0).collect()
    }

    #[test]
    fn no_node_that_penetrates_is_left_open_and_contact_is_closer_to_that_of_a_smaller_residual() {
        let heights = rough(256, 4);
        let press = |tolerance: f64| {
            let mut solver = solver(256, &heights);
            let settings = Settings { tolerance, ..Settings::default() };
            let outcome = solver.press(0.2, &settings, &|| false);
            assert_eq!(outcome.stop, Stop::Converged);
            solver
        };
        let (loose, tight) = (press(1e-2), press(1e-10));
        let nodes = loose.pressure().iter().zip(&loose.inner.gap);
        for (p, gap) in nodes {
            let rounding = f64::from(f32::EPSILON * gap.abs());
            assert!(*p > 0.0 || f64::from(*gap) - loose.offset >= -rounding);
        }
        // Few nodes are decided, and few of these differ between the two solutions.
        let (found, exact) = (contact(&loose), contact(&tight));
        let wrong = found.iter().zip(&exact).filter(|(a, b)| a != b).count();
        let edge = exact.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(100 * wrong < edge, "{wrong} of {edge}");
    }
}
