//! Iterative refinement: evaluation in double precision, correction in single precision, and the
//! decision about nodes at the edge of contact.
//!
//! A solution within the tolerance leaves two kinds of nodes undecided. Some bear a small pressure
//! although their gap is positive: they were in contact before, and their pressure has not yet
//! fallen to zero. Others bear no pressure although they penetrate by less than the tolerance. For
//! each of these nodes, [`Solver::decide`] estimates whether a solution with a smaller residual
//! would have it in contact, and sets its pressure accordingly. The pressures are evaluated again,
//! so that the residual is that of the returned pressures.

use super::bounds::PressureSummary;
use super::inner::{End, Goal, State};
use super::lanes::{Totals, for_rows, sum_by, sum_rows, weight};
use super::line_search::{LastStep, LineSearch, StepControl};
use super::passes::{Convergence, GapStatistics, PendingUpdate, StepScaling};
use super::{Hardness, Outcome, Settings, Solver, Stop, Watch};

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

#[derive(Debug, Clone, Copy)]
pub struct Evaluation {
    pub convergence: Convergence,
    pub contact_nodes: f64,
    /// Mean gap over the map; nodes in contact count as zero.
    pub mean_gap: f64,
    /// Mean over the map of the negative gaps of saturated nodes, as a positive depth.
    pub yielded_depth: f64,
    /// Elastic energy per area, half the mean of pressure × displacement.
    pub energy: f64,
}

impl Solver {
    /// Iterates from the present pressures, whose evaluation is given, until the residual is within
    /// the tolerance and [`Solver::decide`] makes no more changes.
    ///
    /// Stops earlier at the pair limit or if `watch` interrupts. The outcome describes exactly the
    /// final pressures, because none changes after the last evaluation.
    pub(super) fn solve(
        &mut self,
        mut control: StepControl,
        mut evaluation: Evaluation,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Outcome {
        let mut decisions = DECISIONS;
        loop {
            if self.is_solved(settings, &evaluation) {
                let may_repeat = self.inner.pairs < settings.pair_limit;
                if may_repeat && self.is_rounded(settings, &evaluation) {
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
                evaluation = self.approach(&mut control, start, settings, watch);
                continue;
            };
            let summary = self.summarise();
            return self.outcome(stop, evaluation, summary);
        }
    }

    /// Iterates in single precision from `start` at least once, until the tolerance is met,
    /// rounding prevents progress, or the pair limit or `watch` stops it. Returns the evaluation of
    /// the new pressures in double precision.
    ///
    /// `control` holds what earlier iterations for the same load have learnt.
    pub(super) fn approach(
        &mut self,
        control: &mut StepControl,
        start: State,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Evaluation {
        let residual = self.tolerance(settings, self.inner.free_nodes);
        let goal = Goal { residual, is_evaluated: true };
        let stop = |pairs| {
            watch.spent(pairs);
            pairs >= settings.pair_limit || watch.is_interrupted()
        };
        match self.inner.iterate(control, start, goal, &stop) {
            End::Residual { pending, offset, .. } => self.evaluate_inner(pending, offset),
            End::Step { line, state } => match self.inner.bound {
                None => self.evaluate_step(control, &line, state.convergence.offset),
                Some(hardness) => self.evaluate_yielding_step(control, &line, hardness, &state),
            },
        }
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

    pub(super) fn outcome(
        &mut self,
        stop: Stop,
        evaluation: Evaluation,
        summary: PressureSummary,
    ) -> Outcome {
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

impl Solver {
    /// Computes the gap under the present pressures and evaluates it; takes one transform pair.
    /// Sets the last steps to zero.
    pub(super) fn evaluate(&mut self) -> Evaluation {
        self.double_scratch.take_over(&mut self.inner.scratch);
        self.problem
            .transform
            .begin(&mut self.inner.pressure_input(&self.pressure, false), &mut self.double_scratch);
        self.finish_gap()
    }

    /// Evaluates an initial guess. If rounding of the gaps hides the error of the guess, changes
    /// the reference of the gaps and evaluates the guess again.
    ///
    /// This happens if gaps differ much from their reference. The inner solver could not improve
    /// such a guess.
    pub(super) fn evaluate_guess(&mut self, settings: &Settings) -> Evaluation {
        let evaluation = self.evaluate();
        let Convergence { offset, error } = evaluation.convergence;
        let is_seen = error > f64::from(f32::EPSILON) * offset.abs();
        if is_seen || self.is_solved(settings, &evaluation) {
            return evaluation;
        }
        self.inner.reference += offset;
        self.evaluate()
    }

    /// Sets the pressures to those of the inner solver after the update `pending`, and evaluates
    /// them.
    ///
    /// Adds `offset`, approximately the mean gap in contact, to the reference of the gaps, so that
    /// gaps in contact become small and keep all their digits.
    pub(super) fn evaluate_inner(&mut self, pending: PendingUpdate, offset: f64) -> Evaluation {
        if let Some(hardness) = self.inner.bound {
            self.promote_yielding(hardness, pending);
            self.inner.reference += offset;
            return self.evaluate();
        }
        if pending.part == 1.0 {
            self.begin_promoted(pending.scale, offset);
            return self.finish_gap();
        }
        self.inner.promote(pending.of_pressure(), &mut self.pressure);
        self.evaluate_without(1.0 - pending.part, offset)
    }

    fn evaluate_without(&mut self, part: f64, offset: f64) -> Evaluation {
        self.inner.take_back(part, &mut self.pressure);
        self.impose_load();
        self.inner.reference += offset;
        self.evaluate()
    }

    /// Evaluates the pressures after the step that `line` describes. If only a part of the step is
    /// to be kept, undoes the rest and evaluates again.
    ///
    /// `offset` is approximately the mean gap in contact before the step. `control` is updated.
    fn evaluate_step(
        &mut self,
        control: &mut StepControl,
        line: &LineSearch,
        offset: f64,
    ) -> Evaluation {
        let offset_change = line.expected_offset();
        self.begin_promoted(line.scale, offset_change);
        let (evaluation, curvature) = self.finish_step::<false>(line.scale, offset_change);
        self.keep_step(control, line.best(curvature), curvature, evaluation, offset_change - offset)
    }

    /// Evaluates the pressures after a step as [`Solver::evaluate_step`] does, in a material that
    /// yields.
    fn evaluate_yielding_step(
        &mut self,
        control: &mut StepControl,
        line: &LineSearch,
        hardness: Hardness,
        state: &State,
    ) -> Evaluation {
        let offset = state.convergence.offset;
        let scale = self.promote_yielding(hardness, PendingUpdate::NONE);
        self.inner.reference += offset;
        self.begin_keeping_steps();
        let (evaluation, curvature) = self.finish_step::<true>(scale, offset);
        let best = line.then_scaled(scale, state.free_offset()).best(curvature);
        self.keep_step(control, best, curvature, evaluation, 0.0)
    }

    /// Ends the convolution of the pressures after a step d, and computes the gap. Returns the
    /// evaluation of the gap, and the curvature ⟨d, A d⟩ of the energy along the step.
    ///
    /// The step includes a multiplication of the pressures by `scale`. `reference_change` was added
    /// to the reference of the gaps.
    fn finish_step<const YIELDS: bool>(
        &mut self,
        scale: f64,
        reference_change: f64,
    ) -> (Evaluation, f64) {
        let work =
            self.problem.transform.multiply(&self.problem.displacement, &mut self.double_scratch);
        let scaling =
            StepScaling { scale: scale as f32, reference_change: reference_change as f32 };
        let sums_gaps = !self.problem.body.is_periodic();
        let mut pass = self.inner.step_output::<YIELDS>(&self.problem.heights, sums_gaps, scaling);
        self.problem.transform.finish(&mut pass, &mut self.double_scratch);
        let (statistics, curvature) = (pass.0.statistics.total(), pass.0.curvature.total());
        (self.evaluation(&statistics, work), curvature)
    }

    /// Adapts `control` to an evaluated step along which the energy is lowest at the fraction
    /// `best`.
    ///
    /// If the whole step is to be kept, stores it in `control` and returns `evaluation`. Otherwise
    /// undoes a part of it and evaluates again.
    fn keep_step(
        &mut self,
        control: &mut StepControl,
        best: f64,
        curvature: f64,
        evaluation: Evaluation,
        offset_change: f64,
    ) -> Evaluation {
        let part = control.learn(best);
        if part < 1.0 {
            return self.evaluate_without(1.0 - part, evaluation.convergence.offset);
        }
        control.last = (best > 0.0).then_some(LastStep {
            pending: PendingUpdate::NONE,
            curvature,
            missed: (best - 1.0).min(1.0),
            offset_change,
        });
        evaluation
    }

    fn begin_promoted(&mut self, scale: f64, offset: f64) {
        self.inner.reference += offset;
        self.double_scratch.take_over(&mut self.inner.scratch);
        self.problem.transform.begin(
            &mut self.inner.promoted_input(scale, &mut self.pressure),
            &mut self.double_scratch,
        );
    }

    fn finish_gap(&mut self) -> Evaluation {
        match self.inner.bound {
            None => self.finish_gap_as::<false>(),
            Some(_) => self.finish_gap_as::<true>(),
        }
    }

    fn finish_gap_as<const YIELDS: bool>(&mut self) -> Evaluation {
        let work =
            self.problem.transform.multiply(&self.problem.displacement, &mut self.double_scratch);
        let sums_gaps = !self.problem.body.is_periodic();
        let mut pass = self.inner.gap_output::<YIELDS>(&self.problem.heights, sums_gaps);
        self.problem.transform.finish(&mut pass, &mut self.double_scratch);
        let statistics = pass.0.statistics.total();
        self.evaluation(&statistics, work)
    }

    fn evaluation(&mut self, statistics: &GapStatistics, work: f64) -> Evaluation {
        let convergence = statistics.convergence();
        self.inner.pairs += 1;
        self.offset = convergence.offset;
        let cells = self.pressure.len() as f64;
        let yielded_depth = match statistics.saturated_nodes() {
            0.0 => 0.0,
            nodes => (nodes * convergence.offset - statistics.saturated_sum) / cells,
        };
        let mean_gap = match statistics.gap_sum {
            Some(sum) => sum / cells - convergence.offset,
            // Displacements and heights have zero mean.
            None => -(self.inner.reference + convergence.offset),
        };
        // Yielded nodes count as zero gap. If all nodes are in contact, only rounding remains.
        let mean_gap = match yielded_depth {
            0.0 => mean_gap,
            depth => (mean_gap + depth).max(0.0),
        };
        Evaluation {
            convergence,
            contact_nodes: statistics.contact_nodes,
            mean_gap,
            yielded_depth,
            energy: 0.5 * work / cells,
        }
    }

    /// Prepares iterations from the present pressures and gaps, and computes their first residual.
    /// `convergence` describes these gaps.
    pub(super) fn initial_residual(&mut self, convergence: Convergence) -> State {
        let start = self.inner.begin(&mut self.pressure, convergence);
        self.inner.scratch.take_over(&mut self.double_scratch);
        start
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
        let (pressure, gap) = (&mut self.pressure, &self.inner.gap);
        let changes = sum_rows(threads, pressure, row_nodes, |row, pressure| {
            let changes = |p, gap| weight::<f64>(decision.pressure(p, gap) != p);
            let by = |p, gap| (decision.pressure(p, gap) - p).abs();
            let gap = row.of(gap);
            let sums = [sum_by(pressure, gap, changes), sum_by(pressure, gap, by)];
            Totals { sums, highest: [] }
        });
        let [changed_nodes, change] = changes.sums;
        let total = self.inner.load * self.pressure.len() as f64;
        let elastic = match self.inner.bound {
            None => total,
            Some(hardness) => total - hardness.pressure() * summary.saturated_nodes as f64,
        };
        if changed_nodes == 0.0 || change > LARGEST_CHANGE * elastic {
            return false;
        }
        for_rows(threads, &mut self.pressure, row_nodes, |row, pressure| {
            for (p, gap) in pressure.iter_mut().zip(row.of(gap)) {
                *p = decision.pressure(*p, *gap);
            }
        });
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
