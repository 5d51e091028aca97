//! Preconditioned conjugate gradients on the free nodes, in single precision.
//!
//! [`InnerSolver::iterate`] is the loop. One iteration takes two pairs of transforms: one for the
//! preconditioned residual z, the decrease of pressure that would close the gap of free nodes, and
//! one for the displacement A d under the step d.
//!
//! An exact line search would need the displacement under the direction before clipping. This would
//! be a third pair, because nearly every step clips some pressures. The step length τ is therefore
//! predicted. The best one follows from the gap after the step at no cost. If the step was too
//! long, the next one is shorter, and if it was far too long, it is undone. If it was too short,
//! the next direction, which contains the last step, makes up for the missing part.
//!
//! On large meshes memory bandwidth limits the speed. The mesh is therefore visited only at the
//! ends of transforms, and once between z and the step. Three things make this possible:
//!
//! - Sums that the passes at both ends of a transform add up yield the line search and the offset,
//!   which here is the mean gap weighted by pressure (`line_search`).
//! - Scaling the pressures, and undoing a part of the step if necessary, is left to the next pass
//!   over them (`PendingUpdate`).
//! - The mean m of the direction is estimated from a sample of rows, before all of z is computed.
//!
//! If the material yields, pressures are also clipped at the hardness. Free nodes are then elastic
//! nodes, nodes that penetrate without pressure, and saturated nodes with an open gap. The
//! convergence criterion is the residual of elastic nodes. `balance` describes how steps keep the
//! mean.

use std::mem::take;

use super::InnerSolver;
use crate::fft::Band;
use crate::solver::lanes::{InOrder, Wide};
use crate::solver::line_search::{LastStep, LineSearch, StepControl};
use crate::solver::marks::{FREE, PRESSED};
use crate::solver::passes::{
    Ceiling, Convergence, Direction, GapSums, GapUpdate, GatherCandidates, Means, Peek,
    PendingUpdate, Sums, UpdateGap, UpdatePressure,
};
use crate::solver::preconditioner::{Kind, Residual};

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

/// Number of first iterations of a load with the two-level preconditioner, after a start from a
/// coarser mesh, in a material that yields, or with free boundaries.
///
/// The errors of a start from a coarser mesh are short waves. In the other cases, the first
/// iterations only find the nodes in contact. With four such iterations, loads take 3 % more pairs;
/// without any, a tenth to a third more. Elongated cells of few nodes do not converge with them.
const TWO_LEVEL_ITERATIONS: usize = 3;

/// Convergence of the present pressures and gaps, and what their balance depends on.
#[derive(Clone, Copy)]
pub struct State {
    pub convergence: Convergence,
    /// Sum of the reference pressures.
    pub reference_sum: f64,
    /// Balance of the mean pressure, if the material yields.
    pub balance: Option<Balance>,
}

impl State {
    /// Returns the mean gap of the free nodes if the material yields, otherwise the offset.
    pub fn free_offset(&self) -> f64 {
        self.balance.map_or(self.convergence.offset, |balance| balance.free_offset)
    }
}

/// Sum of all pressures, and mean gap of the free nodes. Both are tracked while the hardness bounds
/// the pressures.
#[derive(Debug, Clone, Copy)]
pub struct Balance {
    pub sum: f64,
    pub free_offset: f64,
}

impl Balance {
    pub fn seen(seen: &GapSums, sum: f64, offset: f64) -> Self {
        Self { sum, free_offset: offset + seen.free_sum / seen.free_nodes.max(1.0) }
    }
}

/// Reason why a series of iterations ended, with the data for the evaluation of the pressures.
pub enum End {
    /// The residual is low enough (`is_reached`), or the iterations must start again. The update
    /// `pending` is still to be applied to the pressures. Gaps in contact are about `offset`.
    Residual { pending: PendingUpdate, offset: f64, is_reached: bool },
    /// The last step should reach the goal, but the gap after it is not yet computed. `state` is
    /// the state before this step.
    Step { line: LineSearch, state: State },
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

impl InnerSolver {
    /// Iterates from the state `start` at least once, until the goal is met, rounding in single
    /// precision prevents progress or `stop` returns true.
    ///
    /// `stop` is called with the number of transform pairs used for the load.
    pub fn iterate(
        &mut self,
        control: &mut StepControl,
        start: State,
        goal: Goal,
        stop: &dyn Fn(u32) -> bool,
    ) -> End {
        let mut state = start;
        let mut last = control.last_step(state.convergence.offset);
        let mut largest = 0.0_f64;
        loop {
            let Convergence { offset, error } = state.convergence;
            let residual = self.residual(error);
            largest = largest.max(residual);
            let target = goal.residual.max(self.within_single_precision(largest, offset));
            let is_last = goal.is_evaluated && EXPECTED_REDUCTION * residual <= target;

            // z = M r
            let kind = self.preconditioner_kind(control, is_last);
            self.precondition(kind);
            // t = −z + β d − m
            let balancing = Balancing {
                missing_load: state.balance.map_or(0.0, |balance| self.total() - balance.sum),
                sees_all_rows: control.sees_all_rows || self.must_balance(target / residual),
            };
            let direction = self.direction(last.as_ref(), control.step_length(), balancing);
            if control.compensates_clipping {
                self.compensate_clipping(direction);
            }
            // p ← clamp(p + τ t, 0, H)
            let sums = self.update_pressure(direction, is_last);
            let line = self.line_search(&sums, &state);
            if line.loses_load() {
                control.shorten_steps();
                return End::Residual {
                    pending: PendingUpdate::ALL_BACK,
                    offset,
                    is_reached: false,
                };
            }
            if is_last {
                return End::Step { line, state };
            }
            // g ← g + A d, and δ ← mean of u − h in contact
            let (next, step) = self.update_gap(control, &line, &sums, &state);
            let is_reached = self.residual(next.convergence.error) <= target;
            // A step may be smaller than the rounding of pressures.
            let is_stuck = step.pending.part == 0.0 || next.convergence == state.convergence;
            if is_reached || is_stuck || stop(self.pairs) {
                let offset = next.convergence.offset;
                return End::Residual { pending: step.pending, offset, is_reached };
            }
            (state, last) = (next, Some(step));
        }
    }

    /// Returns the smallest residual that single precision can reach if the largest residual was
    /// `largest` and gaps in contact are near `offset`.
    fn within_single_precision(&self, largest: f64, offset: f64) -> f64 {
        let rounding = f64::from(f32::EPSILON) * offset.abs();
        self.residual(rounding).max(SINGLE_REDUCTION * largest)
    }

    /// Chooses the preconditioner of an iteration.
    fn preconditioner_kind(&self, control: &StepControl, is_last: bool) -> Kind {
        let is_apt = control.is_nested || self.bound.is_some() || self.mesh.has_margin();
        if !control.uses_extension() {
            Kind::Restricted
        } else if is_apt && control.iteration < TWO_LEVEL_ITERATIONS && !is_last {
            Kind::TwoLevel
        } else {
            Kind::Extended
        }
    }

    /// Computes the corrections z from the present residual.
    fn precondition(&mut self, kind: Kind) {
        let residual = Residual {
            gap: &self.gap,
            level: self.level,
            last_step: &self.last_step,
            active: &self.active,
        };
        let (mesh, scratch) = (&self.mesh, &mut self.scratch);
        self.pairs += self.preconditioner.apply(kind, mesh, residual, scratch, &self.threads);
    }

    /// Changes the corrections z such that clipped pressures are taken from the nodes around them.
    fn compensate_clipping(&mut self, direction: Direction) {
        let residual = Residual {
            gap: &self.gap,
            level: self.level,
            last_step: &self.last_step,
            active: &self.active,
        };
        self.preconditioner.compensate_clipping(
            &self.mesh,
            (direction, self.ceiling() as f32),
            (&self.reference_pressure, &self.pressure_increment),
            residual,
            &mut self.scratch,
            &self.threads,
        );
    }

    /// Returns the control of the steps of a load, which begins from a coarser mesh if `is_nested`.
    pub fn step_control(&self, is_nested: bool) -> StepControl {
        let control = StepControl::new(is_nested);
        if self.preconditioner.clipping.is_some() {
            return control.compensating_clipping(!self.mesh.has_margin());
        }
        control
    }

    /// Returns the line search along a step with these sums from `state`.
    fn line_search(&self, sums: &Sums, state: &State) -> LineSearch {
        let (reference_sum, total) = (state.reference_sum, self.total());
        match state.balance {
            None => LineSearch::new(sums, reference_sum, total, self.reference + self.mesh.highest),
            Some(Balance { sum, free_offset }) => {
                LineSearch::yielding(sums, reference_sum, [sum, total], free_offset)
            }
        }
    }

    /// Computes the gap after the step from `state` that `line` and `sums` describe, and adapts
    /// `control`. Returns the next state and the step.
    fn update_gap(
        &mut self,
        control: &mut StepControl,
        line: &LineSearch,
        sums: &Sums,
        state: &State,
    ) -> (State, LastStep) {
        let own_work = self.mesh.transform.multiply(&self.mesh.displacement, &mut self.scratch);
        self.pairs += 1;
        let curvature = line.curvature(own_work);
        let best = line.best(curvature);
        let part = control.learn(best);
        let pending = PendingUpdate { scale: line.scale, part };
        let (convergence, free_offset) = match self.bound {
            None => self.finish_gap::<false>(pending, line.offset(part, curvature)),
            Some(_) => {
                let next_offset = self.peek_offset(part, state.convergence, control.sees_all_rows);
                self.finish_gap::<true>(pending, next_offset)
            }
        };
        let balance = state.balance.map(|before| {
            let after = state.reference_sum + sums.pressure_increment + sums.rounded;
            Balance { sum: before.sum + part * (after - before.sum), free_offset }
        });
        let step = LastStep {
            pending,
            curvature: part * part * curvature,
            missed: if part < 1.0 { 0.0 } else { (best - 1.0).min(1.0) },
            offset_change: convergence.offset - state.convergence.offset,
        };
        (State { convergence, balance, ..*state }, step)
    }

    /// Adds the displacement under a step to the gap, and computes the next residual, gap −
    /// `offset`.
    ///
    /// `pending` is the scaling and partial undo of the step. Returns the convergence and the mean
    /// gap of free nodes.
    pub fn finish_gap<const YIELDS: bool>(
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
            residual: self.preconditioner.residual_rows(),
            sample: self.sample.band(),
            seen: InOrder::new(),
        });
        self.mesh.transform.finish(&mut pass, &mut self.scratch);
        let seen = pass.0.seen.total();
        self.free_nodes = seen.free_nodes;
        self.level = offset;
        let free_offset = offset + seen.free_sum / seen.free_nodes.max(1.0);
        // For elastic bodies the sums are zero, and the offset is known.
        let offset = offset + seen.elastic_sum / seen.elastic_nodes.max(1.0);
        (seen.extremes.convergence(offset), free_offset)
    }
}

/// Load that a step must add to the pressures, and the rows from which clipping is estimated.
#[derive(Clone, Copy)]
struct Balancing {
    missing_load: f64,
    /// True to use all rows instead of a sample.
    sees_all_rows: bool,
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
        // Reuse the allocation.
        let mut nodes = take(&mut self.candidates);
        nodes.clear();
        let candidates = self.bound.map(|_| GatherCandidates {
            reference_pressure: &self.reference_pressure,
            pressure_increment: &self.pressure_increment,
            of_step: of_step as f32,
            nodes,
            rows: 0,
        });
        let (mut corrections, transposed) = self.preconditioner.corrections(
            &self.mesh,
            &self.gap,
            self.level,
            &mut self.scratch,
            &self.threads,
        );
        let mut peek =
            Wide(Peek::new(&self.last_step, &self.active, &self.sample, transposed, candidates));
        corrections.peek(&self.sample.pairs(), &mut peek);
        if sees_all_rows || peek.0.is_too_small() {
            corrections.peek(&self.sample.other_pairs(), &mut peek);
        }
        let means = peek.0.means();
        let Some(candidates) = peek.0.candidates() else {
            return (means, 0);
        };
        self.candidates = candidates.nodes;
        (means, candidates.rows)
    }

    /// Computes the direction −z + β s − m, conjugate to the step s = `last`, with the correction z
    /// and a mean m that is subtracted. Without a last step, β is zero.
    ///
    /// A step of `step_length` along it keeps the sum of pressures, if none is clipped. If the
    /// material yields, the step adds the missing load to the sum in spite of clipping.
    fn direction(
        &mut self,
        last: Option<&LastStep>,
        step_length: f64,
        balancing: Balancing,
    ) -> Direction {
        let Balancing { missing_load, sees_all_rows } = balancing;
        let of_step = last.map_or(0.0, |last| last.pending.part - 1.0);
        let (means, rows) = self.peek(of_step, sees_all_rows);
        let Some(last) = last else {
            let mean = self.balanced_mean([step_length, 0.0], missing_load, rows);
            return Direction::first(step_length, mean.unwrap_or(-means.correction));
        };
        // Gaps are measured from the offset, which has changed as well.
        let along = means.correction_on_image - last.offset_change * means.sampled_correction;
        let conjugate = self.free_nodes * along / last.curvature;
        let beta = (conjugate + last.missed / step_length).clamp(0.0, MAX_BETA);
        let PendingUpdate { scale, part } = last.pending;
        let scaling = (1.0 - 1.0 / scale) * self.total() / self.free_nodes;
        let mean = beta * part * (means.last_step + scaling) - means.correction;
        let mean =
            self.balanced_mean([step_length, beta * part], missing_load, rows).unwrap_or(mean);
        Direction::next(last.pending, beta, step_length, mean)
    }

    fn update_pressure(&mut self, direction: Direction, is_last: bool) -> Sums {
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
        let ceiling = Ceiling::at(self.ceiling());
        let (corrections, transposed) = self.preconditioner.corrections(
            &self.mesh,
            &self.gap,
            self.level,
            &mut self.scratch,
            &self.threads,
        );
        let mut pass = Wide(UpdatePressure::<YIELDS> {
            direction,
            ceiling,
            reference_pressure: &self.reference_pressure,
            pressure_increment: Band::new(&mut self.pressure_increment),
            transposed,
            active: &self.active,
            last_step: Band::new(&mut self.last_step),
            gap: &self.gap,
            heights: &self.mesh.heights,
            sums: InOrder::new(),
        });
        if is_last {
            corrections.read(&mut pass);
        } else {
            corrections.begin_step(&mut pass);
        }
        pass.0.sums.total()
    }
}
