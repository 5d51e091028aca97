//! Preconditioned conjugate gradients on the free nodes, in single precision.
//!
//! The elastic energy is quadratic in the pressure p and its gradient is the gap. The pressure must
//! not become negative and must keep its mean. One iteration takes two pairs of transforms:
//!
//! 1. *Correct.* Free nodes have pressure or penetrate. Their gap above the offset is the residual
//!    r. The preconditioner turns r into the correction z, the decrease of pressure that would
//!    close the gap ([`InnerSolver::correct`]). The search direction t is −z made conjugate to the
//!    last step.
//! 2. *Step.* The pressure changes by a predicted step length τ along t, is clipped at zero and
//!    scaled back to its mean. The displacement under this step updates the gap.
//!
//! An exact line search would need the displacement under the direction before clipping. This would
//! be a third pair, because nearly every step clips some pressures. But the best step length
//! follows from the gap after the step at no cost. If the step was too long, the next one is
//! shorter. If it was too short, the next direction, which contains the
//! last step, makes up for the missing part.
//!
//! On large meshes memory bandwidth limits the speed. The mesh is therefore visited only at the
//! ends of transforms, and once between correction and step. Three things make this possible:
//!
//! - Sums that the passes at both ends of a transform add up yield the line search and the offset,
//!   which here is the mean gap weighted by pressure (`line_search`).
//! - Scaling the pressures, and undoing a part of the step if necessary, is left to the next pass
//!   over them (`PendingUpdate`).
//! - The mean correction is estimated from a sample of rows, before all corrections are computed.
//!
//! If the material yields, pressures are also clipped at the hardness. Free nodes are then elastic
//! nodes, nodes that penetrate without pressure, and saturated nodes with an open gap. The
//! convergence criterion is the residual of elastic nodes. `balance` describes how steps keep the
//! mean. The first iterations use a cheaper preconditioner of two levels (`two_level`).
//!
//! The preconditioner is Eᵀ K E: E extends the residual of free nodes to all nodes (`extension`),
//! the stiffness K = |q|/2 of the half-space turns it into pressures, and Eᵀ returns the pressures
//! of other nodes to free nodes.

use std::mem::take;

use super::balance::Balance;
use super::evaluation::{Convergence, Evaluation};
use super::flags::{FREE, PRESSED};
use super::inner_solver::InnerSolver;
use super::lanes::{InOrder, Wide};
use super::line_search::{History, LastStep, LineSearch};
use super::passes::{
    Ceiling, CollectFixed, Direction, Extend, GapUpdate, GatherCandidates, Means, Peek,
    PendingUpdate, Sums, UpdateGap, UpdatePressure,
};
use super::start::Start;
use super::{Solver, two_level};
use crate::fft::Band;

/// Smallest residual that is trusted in single precision, as a fraction of the largest residual
/// since the last evaluation in double precision.
///
/// It is well above the rounding error of 1e-7. An evaluation in double precision and a new start
/// take as long as two iterations.
const SINGLE_REDUCTION: f64 = 1e-5;

/// Expected factor by which one iteration reduces the residual once the contact is found.
///
/// If this reduction suffices to reach the goal, the pressures after the iteration are evaluated in
/// double precision directly.
const EXPECTED_REDUCTION: f64 = 0.1;

/// Expected factor by which one iteration reduces the residual if the material yields, in place of
/// [`EXPECTED_REDUCTION`]. In such a material only strips of nodes are elastic.
const EXPECTED_REDUCTION_OF_STRIPS: f64 = 0.2;

/// Reason why a series of iterations ended, with the data for the evaluation of the pressures.
pub enum End {
    /// The residual is low enough (`is_reached`), or the iterations must start again. The update
    /// `pending` is still to be applied to the pressures. Gaps in contact are about `offset`.
    Residual { pending: PendingUpdate, offset: f64, is_reached: bool },
    /// The last step should reach the goal, but the gap after it is not yet computed. Gaps in
    /// contact were about `offset` before this step.
    Step { line: LineSearch, balance: Option<Balance>, offset: f64 },
}

/// Goal of a series of iterations.
#[derive(Clone, Copy)]
pub struct Goal {
    /// Residual to reach, in mesh steps at unit rms slope.
    pub residual: f64,
    /// True if the caller evaluates the result in double precision, so that the gap after the last
    /// step need not be computed in single precision.
    pub is_evaluated: bool,
}

impl Solver {
    /// Iterates from `start` at least once, until the residual is at most `tolerance`, rounding in
    /// single precision prevents progress or `stop` returns true. Evaluates the result.
    ///
    /// `stop` is called with the number of transform pairs used for the load.
    pub(super) fn refine(
        &mut self,
        history: &mut History,
        start: Start,
        tolerance: f64,
        stop: &dyn Fn(u32) -> bool,
    ) -> Evaluation {
        let goal = Goal { residual: tolerance, is_evaluated: true };
        match self.inner.iterate(history, start, goal, stop) {
            End::Residual { pending, offset, .. } => self.evaluate_inner(pending, offset),
            End::Step { line, balance, offset } => match (self.inner.bound, &balance) {
                (Some(hardness), Some(balance)) => {
                    self.evaluate_yielding_step(history, &line, hardness, balance, offset)
                }
                _ => self.evaluate_step(history, &line, offset),
            },
        }
    }
}

impl InnerSolver {
    /// Iterates from `start` at least once, until the goal is met, rounding in single precision
    /// prevents progress or `stop` returns true.
    ///
    /// `stop` is called with the number of transform pairs used for the load.
    pub(super) fn iterate(
        &mut self,
        history: &mut History,
        start: Start,
        wanted: Goal,
        stop: &dyn Fn(u32) -> bool,
    ) -> End {
        let total = self.load * self.cells() as f64;
        let Start { mut convergence, reference_sum, mut balance } = start;
        let expected_reduction = match self.bound {
            None => EXPECTED_REDUCTION,
            Some(_) => EXPECTED_REDUCTION_OF_STRIPS,
        };
        let two_level_iterations = match self.bound {
            _ if history.is_nested => two_level::NESTED_ITERATIONS,
            None => 0,
            Some(_) => two_level::YIELDING_ITERATIONS,
        };
        let mut last = history.last.take();
        if let Some(last) = &mut last {
            last.offset_change += convergence.offset;
        }
        let mut largest = 0.0_f64;
        loop {
            // The first residual may belong to a solution under another load.
            largest = largest.max(self.residual(convergence.error));
            let possible = self.within_single_precision(largest, convergence.offset);
            let goal = wanted.residual.max(possible);
            let is_last = wanted.is_evaluated
                && expected_reduction * self.residual(convergence.error) <= goal;
            let by_blocks = !is_last && history.iteration < two_level_iterations;
            self.correct(by_blocks);
            let step_length = history.step_length();
            let missing_load = balance.map_or(0.0, |balance| total - balance.sum);
            let reduction = goal / self.residual(convergence.error);
            let sees_all_rows = history.sees_all_rows || self.must_balance(reduction);
            let direction = self.direction(last.as_ref(), step_length, missing_load, sees_all_rows);
            let sums = self.update_pressure(direction, is_last);
            let line = match &balance {
                None => {
                    let reference = self.reference + self.mesh.highest;
                    LineSearch::new(&sums, reference_sum, total, reference)
                }
                Some(balance) => {
                    let load = [balance.sum, total];
                    LineSearch::yielding(&sums, reference_sum, load, balance.free_offset)
                }
            };
            if line.loses_load() {
                history.shorten_steps();
                self.extension.is_enabled = history.uses_extension();
                return End::Residual {
                    pending: PendingUpdate::ALL_BACK,
                    offset: convergence.offset,
                    is_reached: false,
                };
            }
            if is_last {
                return End::Step { line, balance, offset: convergence.offset };
            }
            let before = convergence;
            let (next, free_offset, made) = self.follow(history, &line, convergence);
            convergence = next;
            if let Some(balance) = &mut balance {
                let moved = reference_sum + sums.pressure_increment + sums.rounded - balance.sum;
                balance.sum += made.pending.part * moved;
                balance.free_offset = free_offset;
            }
            // A step may be smaller than the rounding of pressures.
            let stuck = made.pending.part == 0.0 || convergence == before;
            let is_reached = self.residual(convergence.error) <= goal;
            if is_reached || stuck || stop(self.pairs) {
                return End::Residual {
                    pending: made.pending,
                    offset: convergence.offset,
                    is_reached,
                };
            }
            last = Some(made);
        }
    }

    /// Returns the smallest residual that single precision can reach if the largest residual was
    /// `largest` and gaps in contact are near `offset`.
    fn within_single_precision(&self, largest: f64, offset: f64) -> f64 {
        let rounding = f64::from(f32::EPSILON) * offset.abs();
        self.residual(rounding).max(SINGLE_REDUCTION * largest)
    }

    /// Computes the gap after the step that `line` describes, and adapts `history`.
    /// `convergence` describes the gaps before the step.
    ///
    /// Returns the new convergence, the mean gap of free nodes (only if the material yields), and
    /// the step.
    fn follow(
        &mut self,
        history: &mut History,
        line: &LineSearch,
        convergence: Convergence,
    ) -> (Convergence, f64, LastStep) {
        let offset = convergence.offset;
        let own_work =
            self.mesh.transform.multiply(&self.mesh.displacement, &mut self.buffers.scratch);
        self.pairs += 1;
        let curvature = line.curvature(own_work);
        let best = line.best(curvature);
        let part = self.learn(history, best);
        let pending = PendingUpdate { scale: line.scale, part };
        let (convergence, free_offset) = match self.bound {
            None => {
                let next_offset = line.offset(part, curvature);
                self.update_gap::<false>(pending, next_offset)
            }
            Some(_) => {
                let next_offset = self.peek_offset(part, convergence, history.sees_all_rows);
                self.update_gap::<true>(pending, next_offset)
            }
        };
        let made = LastStep {
            pending,
            curvature: part * part * curvature,
            missed: if part < 1.0 { 0.0 } else { (best - 1.0).min(1.0) },
            offset_change: convergence.offset - offset,
        };
        (convergence, free_offset, made)
    }

    /// Adapts `history` to a step along which the energy is lowest at the fraction `best`. Returns the fraction of the step to keep.
    pub(super) fn learn(&mut self, history: &mut History, best: f64) -> f64 {
        let part = history.learn(best);
        self.extension.is_enabled = history.uses_extension();
        part
    }

    /// Adds the displacement under a step to the gap, and computes the next residual, gap −
    /// `offset`.
    ///
    /// `pending` is the scaling and partial undo of the step. Returns the convergence and the mean
    /// gap of free nodes.
    pub(super) fn update_gap<const YIELDS: bool>(
        &mut self,
        pending: PendingUpdate,
        offset: f64,
    ) -> (Convergence, f64) {
        let response = GapUpdate {
            offset: offset as f32,
            on_step: (pending.part * pending.scale) as f32,
            on_pressure: (pending.part * (pending.scale - 1.0)) as f32,
            reference: (self.reference + self.mesh.highest) as f32,
            // A step that is undone in part leaves pressure on every free node.
            pressed: if pending.part < 1.0 { FREE } else { PRESSED },
        };
        let mut pass = Wide(UpdateGap::<YIELDS> {
            response,
            heights: &self.mesh.heights,
            gap: Band::new(&mut self.gap),
            last_step: Band::new(&mut self.last_step),
            active: self.active.band(),
            residual: self.extension.residual_rows(),
            sample: self.sample.band(),
            seen: InOrder::new(),
        });
        self.mesh.transform.finish(&mut pass, &mut self.buffers.scratch);
        let seen = pass.0.seen.total();
        self.free_nodes = seen.free_nodes;
        self.level = offset;
        let free_offset = offset + seen.free_sum / seen.free_nodes.max(1.0);
        // For elastic bodies the sums are zero, and the offset is known.
        let offset = offset + seen.elastic_sum / seen.elastic_nodes.max(1.0);
        (seen.extremes.convergence(offset), free_offset)
    }
}

/// Largest factor β of the last step in a direction.
///
/// With a larger β, the contribution of the last step could grow from iteration to iteration,
/// because step lengths are only predicted.
const MAX_BETA: f64 = 2.0;

impl InnerSolver {
    /// Returns the means of corrections and last steps over the free nodes of a sample of rows. If
    /// `sees_all_rows` or if the sample has too few free nodes, the means are over all rows.
    ///
    /// If the material yields, also collects these free nodes in `candidates`, with `of_step` ×
    /// last step added to their pressures. The second result is the number of rows from which they
    /// were collected, or 0.
    fn peek(&mut self, of_step: f64, sees_all_rows: bool) -> (Means, usize) {
        // Reuse the allocations.
        let (mut nodes, mut candidate_steps) =
            (take(&mut self.candidates), take(&mut self.candidate_steps));
        nodes.clear();
        candidate_steps.clear();
        let candidates = self.bound.map(|_| GatherCandidates {
            reference_pressure: &self.reference_pressure,
            pressure_increment: &self.pressure_increment,
            of_step: of_step as f32,
            nodes,
            candidate_steps,
            rows: 0,
        });
        let extension = &self.extension;
        let mut peek =
            Wide(Peek::new(&self.last_step, &self.active, &self.sample, extension, candidates));
        let by_blocks = self.is_by_blocks;
        let nodal = by_blocks.then(|| self.mesh.two_level.nodal(&self.gap, self.level));
        let (single, buffers) = (&self.mesh.transform, &mut self.buffers);
        let mut look = |pairs: Vec<usize>, peek: &mut Wide<Peek>| match nodal {
            None => self.mesh.stiffness.peek_stored(&pairs, peek, single, buffers),
            Some(nodal) => nodal.peek(&self.threads, &pairs, self.mesh.nodes, peek),
        };
        look(self.sample.pairs(), &mut peek);
        if sees_all_rows || peek.0.is_too_small() {
            look(self.sample.other_pairs(), &mut peek);
        }
        let means = peek.0.means();
        let Some(candidates) = peek.0.candidates() else {
            return (means, 0);
        };
        let rows = candidates.rows;
        (self.candidates, self.candidate_steps) = (candidates.nodes, candidates.candidate_steps);
        (means, rows)
    }

    /// Computes the direction −z + β s − m, conjugate to the step s = `last`, with the correction z
    /// and a mean m that is subtracted. Without a last step, β is zero.
    ///
    /// A step of `step_length` along it keeps the sum of pressures, if none is clipped. If the
    /// material yields, the step adds `missing_load` to the sum in spite of clipping.
    pub(super) fn direction(
        &mut self,
        last: Option<&LastStep>,
        step_length: f64,
        missing_load: f64,
        sees_all_rows: bool,
    ) -> Direction {
        let of_step = last.map_or(0.0, |last| last.pending.part - 1.0);
        let (means, rows) = self.peek(of_step, sees_all_rows);
        let Some(last) = last else {
            let mean = self.balanced_mean([step_length, 0.0], missing_load, rows);
            return Direction::first(step_length, mean.unwrap_or(-means.correction));
        };
        // Gaps are measured from the offset, which has changed as well.
        let along = means.correction_on_image - last.offset_change * means.sampled_correction;
        let beta = self.free_nodes * along / last.curvature + last.missed / step_length;
        let beta = beta.clamp(0.0, MAX_BETA);
        let PendingUpdate { scale, part } = last.pending;
        let cells = self.cells() as f64;
        let scaling = (1.0 - 1.0 / scale) * self.load * cells / self.free_nodes;
        let mean = beta * part * (means.last_step + scaling) - means.correction;
        let mean =
            self.balanced_mean([step_length, beta * part], missing_load, rows).unwrap_or(mean);
        Direction::next(last.pending, beta, step_length, mean)
    }

    pub(super) fn update_pressure(&mut self, direction: Direction, is_last: bool) -> Sums {
        match self.bound {
            None => self.update_pressure_as::<false>(direction, is_last),
            Some(_) => self.update_pressure_as::<true>(direction, is_last),
        }
    }

    fn update_pressure_as<const YIELDS: bool>(
        &mut self,
        direction: Direction,
        is_last: bool,
    ) -> Sums {
        let mut pass = Wide(UpdatePressure::<YIELDS> {
            direction,
            ceiling: Ceiling::at(self.ceiling()),
            reference_pressure: &self.reference_pressure,
            pressure_increment: Band::new(&mut self.pressure_increment),
            transposed: self.extension.transpose_output(),
            active: &self.active,
            last_step: Band::new(&mut self.last_step),
            gap: &self.gap,
            heights: &self.mesh.heights,
            sums: InOrder::new(),
        });
        let (single, buffers) = (&self.mesh.transform, &mut self.buffers);
        if self.is_by_blocks {
            let nodal = self.mesh.two_level.nodal(&self.gap, self.level);
            nodal.begin(self.mesh.nodes[1], &mut pass, single, &mut buffers.scratch);
        } else if is_last {
            self.mesh.stiffness.read_stored(&mut pass, single, buffers);
        } else {
            self.mesh.stiffness.begin_from_stored(&mut pass, single, buffers);
        }
        pass.0.sums.total()
    }

    /// Computes the corrections z from the present residual, and stores them for the next
    /// direction.
    ///
    /// If `by_blocks`, they are computed with the two-level preconditioner, otherwise with the
    /// preconditioner [Eᵀ K E](self) and one transform pair.
    pub(super) fn correct(&mut self, by_blocks: bool) {
        self.is_by_blocks = by_blocks;
        if by_blocks {
            return self.mesh.two_level.correct(
                &self.threads,
                &mut self.extension,
                &mut self.block_buffers,
            );
        }
        self.begin_correction();
        self.pairs += 1;
        let mut pass = Wide(CollectFixed {
            map: self.mesh.nodes,
            last_step: &self.last_step,
            active: &self.active,
            collected: self.extension.transpose_input(),
        });
        let (single, buffers) = (&self.mesh.transform, &mut self.buffers);
        self.mesh.stiffness.finish_and_store(&mut pass, single, buffers);
        self.extension.collect(&self.threads);
    }

    fn begin_correction(&mut self) {
        self.extension.extend(&self.threads);
        let mut pass = Wide(Extend {
            map: self.mesh.nodes,
            level: self.level as f32,
            gap: &self.gap,
            last_step: &self.last_step,
            active: &self.active,
            extended: self.extension.extended_rows(),
        });
        let (single, buffers) = (&self.mesh.transform, &mut self.buffers);
        self.mesh.stiffness.begin(&mut pass, single, buffers);
    }
}
