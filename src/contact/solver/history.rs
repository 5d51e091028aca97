//! What the iterations of one load have learnt of its moves.

use super::passes::Fold;
use super::steps::Steps;

/// A move of which less than this part would have been best is taken back to that part. Below one
/// half it would have raised the energy.
const SMALLEST_PART: f64 = 0.5;

/// Where less than this part would have been best, the next steps are shortened.
const RECKLESS_PART: f64 = 0.25;

/// Steps are shortened as far as this only if directions are wrong altogether: made for the rows of
/// a sample, it may be, where contact follows the rows.
const LEAST_CAUTION: f64 = 0.01;

/// What iterations of one load leave to later ones, besides the steps.
pub struct Search {
    pub iteration: usize,
    /// Shortens steps after one that went much too far. Without it, a step that clips too many
    /// nodes to go downhill would be taken back and tried again for ever.
    pub caution: f64,
    /// Whether all rows are looked at, and not a sample.
    pub sees_all_rows: bool,
    /// The last move, if it was evaluated.
    pub last: Option<LastMove>,
}

impl Default for Search {
    fn default() -> Self {
        Self {
            iteration: 0,
            caution: 1.0,
            sees_all_rows: false,
            last: None,
        }
    }
}

impl Search {
    /// Learns from a move of which the part `best` would have been right. Says whether that was too
    /// little to keep it.
    pub fn learn(&mut self, steps: &mut Steps, best: f64) -> bool {
        if self.caution == 1.0 {
            steps.learn(self.iteration, best);
        }
        // What the first move clips of a guess is not to be taken back.
        let short = self.iteration > 0 && best < SMALLEST_PART;
        if short && best < RECKLESS_PART {
            self.shorten_steps();
        } else if !short {
            self.caution = (2.0 * self.caution).min(1.0);
        }
        self.iteration += 1;
        short
    }

    pub fn shorten_steps(&mut self) {
        self.caution *= 0.5;
        self.sees_all_rows |= self.caution < LEAST_CAUTION;
    }
}

/// A move that has been made, but for what its fold says.
#[derive(Clone, Copy)]
pub struct LastMove {
    pub fold: Fold,
    /// ⟨move, its displacement⟩, twice the elastic energy of the move alone.
    pub curvature: f64,
    /// The part of the move that should be added to it.
    pub missed: f64,
    /// How far it made the level rise.
    pub rise: f64,
    /// Whether the extension followed it.
    pub extends: bool,
}
