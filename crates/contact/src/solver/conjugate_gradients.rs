//! Conjugate gradients on the nodes that are, or should be, in contact.
//!
//! The elastic energy is quadratic in the pressure, its gradient is the gap, and the pressure must
//! stay positive and keep its mean. One iteration takes two transform pairs:
//!
//! 1. *Correct.* On the free nodes, those with pressure or penetrating, the gap is turned into the
//!    pressure that would close it ([`Search::correct`]): the preconditioner is the stiffness |q|/2
//!    of the half-space between a continuation of the gap over all nodes and its transpose. Made
//!    conjugate to the last move, the correction is the direction.
//! 2. *Move.* The pressure follows the direction by a predicted step, is clipped at zero and
//!    scaled back to its mean; the displacement of what did move updates the gap.
//!
//! An exact line search would need the displacement of the direction before it is clipped: a third
//! pair, for nearly every move clips. But how long the move should have been is known after it at
//! no cost. That teaches the step of the same iteration at the next load, and what was missed is
//! made up for by the next move, whose direction contains the last one.
//!
//! On large meshes memory is the limit, and not arithmetic. So the mesh is gone over at the ends
//! and beginnings of transforms, and only once from a correction to a move. What a pass would have
//! to know in advance is had in other ways. The line search after a move follows from sums over the
//! pass that made it and from the transform (`line_search`), and so does the offset of the gap,
//! which here is its mean weighted by pressure. Scaling pressures back to their mean, and taking
//! back what was too far, are left to the next pass (`PendingUpdate`). And what the corrections are
//! like on the whole is seen in a sample of rows, before all of them are made.
//!
//! Where the material yields, the pressure is clipped at the hardness too, and free are besides
//! elastic nodes those that penetrate without pressure and those whose gap is open under the
//! hardness. Saturated ones are fixed like those without pressure: the residual of elastic nodes is
//! what is driven to zero. `balance` says how moves keep the mean. The first iterations are
//! corrected by less than a pair, with a preconditioner of two levels (`two_level`).
//!
//! In the preconditioner, the stiffness has the pressure for a displacement of all nodes;
//! `extension` has the displacement for a gap of free nodes, and takes back to them the pressure
//! that belongs on others.

use std::mem::take;

use super::balance::Balance;
use super::evaluation::{Convergence, Evaluation};
use super::flags::{FREE, PRESSED};
use super::lanes::{InOrder, Wide};
use super::line_search::{History, LastMove, LineSearch};
use super::passes::{
    Ceiling, Direction, Extend, GapUpdate, GatherCandidates, Means, Peek, PendingUpdate, Sums,
    TakeOthers, UpdateGap, UpdatePressure,
};
use super::search::Search;
use super::start::Start;
use super::{Solver, two_level};
use crate::fft::Band;

/// The part of its largest residual that a search in single precision is trusted to reach: far from
/// its rounding, 1e-7. An evaluation in double precision and the start after it last as long as two
/// iterations.
const SINGLE_REDUCTION: f64 = 1e-5;

/// By which an iteration is expected to reduce the residual once contact is found: what comes that
/// close to the goal is moved and evaluated in double precision at once.
const EXPECTED_REDUCTION: f64 = 0.1;

/// The same on the strips of elastic nodes that are left where the material yields.
const EXPECTED_REDUCTION_OF_STRIPS: f64 = 0.2;

/// Where iterations end.
pub enum End {
    /// At a residual that is low enough, or will not be lower without a new start: with this still
    /// to be done to pressures, and gaps in contact about as high as the offset.
    Residual { pending: PendingUpdate, offset: f64, is_reached: bool },
    /// At a move, made from this offset, that is expected to lead to such a residual; its gap is
    /// not known.
    Move { line: LineSearch, balance: Option<Balance>, offset: f64 },
}

/// Where iterations are to lead.
#[derive(Clone, Copy)]
pub struct Goal {
    /// In mesh steps.
    pub residual: f64,
    /// Whether it is evaluated in double precision there, and the last move with it.
    pub is_evaluated: bool,
}

impl Solver {
    /// Iterates, at least once, until the residual is within the tolerance or single precision has
    /// done what it can, and evaluates where that led.
    pub(super) fn refine(
        &mut self,
        history: &mut History,
        start: Start,
        tolerance: f64,
        stop: &dyn Fn(u32) -> bool,
    ) -> Evaluation {
        let goal = Goal { residual: tolerance, is_evaluated: true };
        match self.search.iterate(history, start, goal, stop) {
            End::Residual { pending, offset, .. } => self.evaluate_search(pending, offset),
            End::Move { line, balance, offset } => match (self.search.bound, &balance) {
                (Some(hardness), Some(balance)) => {
                    self.evaluate_yielding_move(history, &line, hardness, balance, offset)
                }
                _ => self.evaluate_move(history, &line, offset),
            },
        }
    }
}

impl Search {
    /// Iterates, at least once, until the residual is as low as it is wanted or single precision
    /// has done what it can.
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
            // The first one may be that of a solution under another load.
            largest = largest.max(self.residual(convergence.error));
            let possible = self.within_single_precision(largest, convergence.offset);
            let goal = wanted.residual.max(possible);
            let is_last = wanted.is_evaluated
                && expected_reduction * self.residual(convergence.error) <= goal;
            let by_blocks = !is_last && history.iteration < two_level_iterations;
            self.correct(by_blocks);
            let steps = self.steps(history.is_nested);
            let step = history.damping * history.caution * steps.of(history.iteration);
            let missing_load = balance.map_or(0.0, |balance| total - balance.sum);
            let reduction = goal / self.residual(convergence.error);
            let sees_all_rows = history.sees_all_rows || self.must_balance(reduction);
            let direction = self.direction(last.as_ref(), step, missing_load, sees_all_rows);
            let sums = self.update_pressure(direction, is_last);
            let line = match &balance {
                None => {
                    let reference = self.reference + self.height_reference;
                    LineSearch::new(&sums, reference_sum, total, reference)
                }
                Some(balance) => {
                    let load = [balance.sum, total];
                    LineSearch::yielding(&sums, reference_sum, load, balance.free_offset)
                }
            };
            if line.sheds_load() {
                history.shorten_steps();
                self.extension.continues = history.continues();
                return End::Residual {
                    pending: PendingUpdate::ALL_BACK,
                    offset: convergence.offset,
                    is_reached: false,
                };
            }
            if is_last {
                return End::Move { line, balance, offset: convergence.offset };
            }
            let before = convergence;
            let (next, free_offset, made) = self.follow(history, &line, convergence);
            convergence = next;
            if let Some(balance) = &mut balance {
                let moved = reference_sum + sums.pressure_increment + sums.rounded - balance.sum;
                balance.sum += made.pending.part * moved;
                balance.free_offset = free_offset;
            }
            // A move may be less than pressures are rounded by.
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

    /// What single precision can reduce residuals to that were `largest`, where gaps in contact are
    /// about `offset`: their last digit, where that is far from the reference.
    fn within_single_precision(&self, largest: f64, offset: f64) -> f64 {
        let rounding = f64::from(f32::EPSILON) * offset.abs();
        self.residual(rounding).max(SINGLE_REDUCTION * largest)
    }

    /// Follows a move that has been made with the gap. Says also what the mean gap of free nodes is
    /// then, where the material yields.
    fn follow(
        &mut self,
        history: &mut History,
        line: &LineSearch,
        convergence: Convergence,
    ) -> (Convergence, f64, LastMove) {
        let offset = convergence.offset;
        let own_work = self.transform.multiply(&self.displacement, &mut self.scratch);
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
        let made = LastMove {
            pending,
            curvature: part * part * curvature,
            missed: if part < 1.0 { 0.0 } else { (best - 1.0).min(1.0) },
            offset_change: convergence.offset - offset,
        };
        (convergence, free_offset, made)
    }

    /// Learns from a move of which the part `best` would have been right. Says which part to keep.
    pub(super) fn learn(&mut self, history: &mut History, best: f64) -> f64 {
        let part = history.learn(self.steps_mut(history.is_nested), best);
        self.extension.continues = history.continues();
        part
    }

    /// Moves the gap after the pressures, and goes on with what it asks for.
    pub(super) fn update_gap<const YIELDS: bool>(
        &mut self,
        pending: PendingUpdate,
        offset: f64,
    ) -> (Convergence, f64) {
        let response = GapUpdate {
            offset: offset as f32,
            on_move: (pending.part * pending.scale) as f32,
            on_pressure: (pending.part * (pending.scale - 1.0)) as f32,
            reference: (self.reference + self.height_reference) as f32,
            // What is taken back in part leaves pressure wherever there was some.
            pressed: if pending.part < 1.0 { FREE } else { PRESSED },
        };
        let mut pass = Wide(UpdateGap::<YIELDS> {
            response,
            heights: &self.heights,
            gap: Band::new(&mut self.gap),
            last_step: Band::new(&mut self.last_step),
            active: self.active.band(),
            residual: self.extension.residual_rows(),
            sample: self.sample.band(),
            seen: InOrder::new(),
        });
        self.transform.finish(&mut pass, &mut self.scratch);
        let seen = pass.0.seen.total();
        self.free_nodes = seen.free_nodes;
        self.level = offset;
        let free_offset = offset + seen.free_sum / seen.free_nodes.max(1.0);
        // In elastic bodies the sums are zero, and it is known already.
        let offset = offset + seen.elastic_sum / seen.elastic_nodes.max(1.0);
        (seen.extremes.convergence(offset), free_offset)
    }
}

/// The largest share of the last move in a direction: more would make it grow from one iteration
/// to the next, which a predicted step does not bear.
const LARGEST_SHARE: f64 = 2.0;

impl Search {
    /// Looks at the corrections of a sample of rows, or of all if it shows too few free nodes.
    /// Where the material yields, free nodes are gathered on the way; returns also in how many
    /// rows.
    fn peek(&mut self, of_move: f64, sees_all_rows: bool) -> (Means, usize) {
        // Their memory serves again.
        let (mut nodes, mut last_moves) = (take(&mut self.candidates), take(&mut self.last_moves));
        nodes.clear();
        last_moves.clear();
        let candidates = self.bound.map(|_| GatherCandidates {
            reference_pressure: &self.reference_pressure,
            pressure_increment: &self.pressure_increment,
            of_move: of_move as f32,
            nodes,
            last_moves,
            rows: 0,
        });
        let extension = &self.extension;
        let mut peek =
            Wide(Peek::new(&self.last_step, &self.active, &self.sample, extension, candidates));
        let by_blocks = self.is_by_blocks;
        let nodal = by_blocks.then(|| self.two_level.nodal(&self.gap, self.level));
        let (single, scratch) = (&self.transform, &mut self.scratch);
        let mut look = |pairs: Vec<usize>, peek: &mut Wide<Peek>| match nodal {
            None => self.stiffness.peek_stored(&pairs, peek, single, scratch),
            Some(nodal) => nodal.peek(&self.threads, &pairs, self.nodes, peek),
        };
        look(self.sample.pairs(), &mut peek);
        if sees_all_rows || peek.0.saw_too_little() {
            look(self.sample.other_pairs(), &mut peek);
        }
        let means = peek.0.means();
        let Some(candidates) = peek.0.candidates() else {
            return (means, 0);
        };
        let rows = candidates.rows;
        (self.candidates, self.last_moves) = (candidates.nodes, candidates.last_moves);
        (means, rows)
    }

    /// Chooses a direction, conjugate to the last move. Where the material yields, it brings also
    /// what pressures have missing_load since then.
    pub(super) fn direction(
        &mut self,
        last: Option<&LastMove>,
        step: f64,
        missing_load: f64,
        sees_all_rows: bool,
    ) -> Direction {
        let of_move = last.map_or(0.0, |last| last.pending.part - 1.0);
        let (means, rows) = self.peek(of_move, sees_all_rows);
        let Some(last) = last else {
            let mean = self.balanced_mean([step, 0.0], missing_load, rows);
            return Direction::first(step, mean.unwrap_or(-means.correction));
        };
        // Gaps count from the offset, and the offset has moved too.
        let along = means.correction_on_image - last.offset_change * means.sampled_correction;
        let share = self.free_nodes * along / last.curvature + last.missed / step;
        let share = share.clamp(0.0, LARGEST_SHARE);
        let PendingUpdate { scale, part } = last.pending;
        let cells = self.cells() as f64;
        let scaling = (1.0 - 1.0 / scale) * self.load * cells / self.free_nodes;
        let mean = share * part * (means.last_move + scaling) - means.correction;
        let mean = self.balanced_mean([step, share * part], missing_load, rows).unwrap_or(mean);
        Direction::next(last.pending, share, step, mean)
    }

    /// Moves the pressures along a new direction.
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
            given: self.extension.given_rows(),
            active: &self.active,
            last_step: Band::new(&mut self.last_step),
            gap: &self.gap,
            heights: &self.heights,
            sums: InOrder::new(),
        });
        let (single, scratch) = (&self.transform, &mut self.scratch);
        if self.is_by_blocks {
            let nodal = self.two_level.nodal(&self.gap, self.level);
            nodal.begin(self.nodes[1], &mut pass, single, scratch);
        } else if is_last {
            self.stiffness.read_stored(&mut pass, single, scratch);
        } else {
            self.stiffness.begin_from_stored(&mut pass, single, scratch);
        }
        pass.0.sums.total()
    }

    /// Makes the rows of the correction, all but what is to be given to them: in one pair, after
    /// which they are kept, or by blocks.
    pub(super) fn correct(&mut self, by_blocks: bool) {
        self.is_by_blocks = by_blocks;
        if by_blocks {
            return self.two_level.correct(&self.threads, &mut self.extension);
        }
        self.begin_correction();
        self.pairs += 1;
        let mut pass = Wide(TakeOthers {
            map: self.nodes,
            last_step: &self.last_step,
            active: &self.active,
            taken: self.extension.taken_rows(),
        });
        let (single, scratch) = (&self.transform, &mut self.scratch);
        self.stiffness.finish_and_store(&mut pass, single, scratch);
        self.extension.collect(&self.threads);
    }

    /// Begins the transform of the gap above its level, on free nodes and continued over the
    /// others.
    fn begin_correction(&mut self) {
        self.extension.extend(&self.threads);
        let mut pass = Wide(Extend {
            map: self.nodes,
            level: self.level as f32,
            gap: &self.gap,
            last_step: &self.last_step,
            active: &self.active,
            continued: self.extension.continued_rows(),
        });
        let (single, scratch) = (&self.transform, &mut self.scratch);
        self.stiffness.begin(&mut pass, single, scratch);
    }
}
