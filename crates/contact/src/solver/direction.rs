//! From corrections to a direction, and to the move along it.

use std::mem::take;

use super::history::LastMove;
use super::in_order::InOrder;
use super::lanes::Wide;
use super::passes::{Asking, Ceiling, Direction, Means, Peek, PendingUpdate, Sums, UpdatePressure};
use super::search::Search;
use crate::fft::Band;

/// The largest share of the last move in a direction: more would make it grow from one iteration
/// to the next, which a predicted step does not bear.
const LARGEST_SHARE: f64 = 2.0;

impl Search {
    /// Looks at the corrections of a sample of rows, or of all if it shows too few free nodes. Where
    /// the material yields, free nodes are gathered on the way; returns also in how many rows.
    fn peek(&mut self, of_move: f64, sees_all_rows: bool) -> (Means, usize) {
        // Their memory serves again.
        let (mut nodes, mut last_moves) = (take(&mut self.asking), take(&mut self.last_moves));
        nodes.clear();
        last_moves.clear();
        let asking = self.bound.map(|_| Asking {
            base: &self.base,
            increment: &self.increment,
            of_move: of_move as f32,
            nodes,
            last_moves,
            rows: 0,
        });
        let extension = &self.extension;
        let mut peek = Wide(Peek::new(&self.carry, &self.active, &self.sample, extension, asking));
        let by_blocks = self.is_by_blocks;
        let nodal = by_blocks.then(|| self.two_level.nodal(&self.gap, self.level));
        let (single, scratch) = (&self.transform, &mut self.scratch);
        let mut look = |pairs: Vec<usize>, peek: &mut Wide<Peek>| match nodal {
            None => self.stiffness.peek_kept(&pairs, peek, single, scratch),
            Some(nodal) => nodal.peek(&self.threads, &pairs, self.nodes, peek),
        };
        look(self.sample.pairs(), &mut peek);
        if sees_all_rows || peek.0.saw_too_little() {
            look(self.sample.other_pairs(), &mut peek);
        }
        let means = peek.0.means();
        let Some(asking) = peek.0.asking() else {
            return (means, 0);
        };
        let rows = asking.rows;
        (self.asking, self.last_moves) = (asking.nodes, asking.last_moves);
        (means, rows)
    }

    /// Chooses a direction, conjugate to the last move. Where the material yields, it brings also
    /// what pressures have lacked since then.
    pub(super) fn direction(
        &mut self,
        last: Option<&LastMove>,
        step: f64,
        lacked: f64,
        sees_all_rows: bool,
    ) -> Direction {
        let of_move = last.map_or(0.0, |last| last.pending.part - 1.0);
        let (means, rows) = self.peek(of_move, sees_all_rows);
        let Some(last) = last else {
            let mean = self.balanced_mean([step, 0.0], lacked, rows);
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
        let mean = self.balanced_mean([step, share * part], lacked, rows).unwrap_or(mean);
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
            base: &self.base,
            increment: Band::of(&mut self.increment),
            given: self.extension.given_rows(),
            active: &self.active,
            carry: Band::of(&mut self.carry),
            gap: &self.gap,
            heights: &self.heights,
            sums: InOrder::new(),
        });
        let (single, scratch) = (&self.transform, &mut self.scratch);
        if self.is_by_blocks {
            let nodal = self.two_level.nodal(&self.gap, self.level);
            nodal.turn(self.nodes[1], &mut pass, single, scratch);
        } else if is_last {
            self.stiffness.finish_kept(&mut pass, single, scratch);
        } else {
            self.stiffness.turn_kept(&mut pass, single, scratch);
        }
        pass.0.sums.total()
    }
}
