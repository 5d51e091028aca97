//! What the iterations of one load have learnt of its moves.

use super::passes::PendingUpdate;
use super::steps::Steps;

/// A move of which less than this part would have been best is taken back to that part. Below one
/// half it would have raised the energy.
const SMALLEST_PART: f64 = 0.5;

/// Where less than this part would have been best, all of it is taken back, and the next steps are
/// shortened: a small part would leave a trace of pressure on many nodes that should have none, so that
/// directions would go on to count with them.
const RECKLESS_PART: f64 = 0.25;

/// Where less than this part would have been best, the next step is shorter by as much: while many nodes change
/// between free and bound, one step too long follows another.
const EXPECTED_PART: f64 = 0.8;

/// While steps are shortened further than this, corrections go without a continuation of the gap.
/// Where many nodes are clipped, the rest of what was meant for all may lead uphill.
const CONTINUED_DAMPING: f64 = 0.5;

/// Steps are shortened as far as this only if directions are wrong altogether: made for the rows of
/// a sample, it may be, where contact follows the rows.
const LEAST_DAMPING: f64 = 0.01;

/// What iterations of one load leave to later ones, besides the steps.
pub struct History {
    /// Whether they began where a coarser mesh led.
    pub is_nested: bool,
    pub iteration: usize,
    /// Shortens steps after one that went much too far. Without it, a step that clips too many
    /// nodes to go downhill would be taken back and tried again for ever.
    pub damping: f64,
    /// Shortens the step after one that went somewhat too far.
    pub caution: f64,
    /// Whether all rows are looked at, and not a sample.
    pub sees_all_rows: bool,
    /// The last move, if it was evaluated.
    pub last: Option<LastMove>,
}

impl Default for History {
    fn default() -> Self {
        Self {
            is_nested: false,
            iteration: 0,
            damping: 1.0,
            caution: 1.0,
            sees_all_rows: false,
            last: None,
        }
    }
}

impl History {
    /// Of iterations that begin where a coarser mesh led.
    pub fn nested() -> Self {
        Self { is_nested: true, ..Self::default() }
    }

    /// Learns from a move of which the part `best` would have been right. Says which part to keep.
    pub fn learn(&mut self, steps: &mut Steps, best: f64) -> f64 {
        if self.damping == 1.0 {
            steps.learn(self.iteration, best * self.caution);
        }
        // What the first move clips of a guess is not to be taken back, and tells of the next only where little is clipped:
        // after a coarser mesh.
        let is_first = self.iteration == 0;
        let short = !is_first && best < SMALLEST_PART;
        if !is_first || self.is_nested {
            let went_too_far = best < EXPECTED_PART;
            self.caution = if went_too_far { best.max(SMALLEST_PART) } else { 1.0 };
        }
        self.iteration += 1;
        if !short {
            self.damping = (2.0 * self.damping).min(1.0);
            return 1.0;
        }
        if best < RECKLESS_PART {
            self.shorten_steps();
            return 0.0;
        }
        best
    }

    /// Whether corrections are made with a continuation of the gap.
    pub fn continues(&self) -> bool {
        self.damping >= CONTINUED_DAMPING
    }

    pub fn shorten_steps(&mut self) {
        self.damping *= 0.5;
        self.sees_all_rows |= self.damping < LEAST_DAMPING;
    }
}

/// A move that has been made, but for its pending update.
#[derive(Clone, Copy)]
pub struct LastMove {
    pub pending: PendingUpdate,
    /// ⟨move, its displacement⟩, twice the elastic energy of the move alone.
    pub curvature: f64,
    /// The part of the move that should be added to it.
    pub missed: f64,
    /// How much higher the offset is after it.
    pub offset_change: f64,
}
