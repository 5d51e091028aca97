//! Conjugate gradients on the nodes that are, or should be, in contact.
//!
//! The elastic energy is quadratic in the pressure, its gradient is the gap, and the pressure must
//! stay positive and keep its mean. One iteration takes two transform pairs:
//!
//! 1. *Correct.* On the free nodes, those with pressure or penetrating, the gap is turned into the
//!    pressure that would close it if every node were free: the stiffness |q|/2 of the half-space
//!    is the preconditioner. Made conjugate to the last move, the correction is the direction.
//! 2. *Move.* The pressure follows the direction by a predicted step, is clipped at zero and
//!    scaled back to its mean; the displacement of what did move updates the gap.
//!
//! An exact line search would need the displacement of the direction before it is clipped: a third
//! pair, for nearly every move clips. But how long the move should have been is known after it at
//! no cost. That teaches the step of the same iteration at the next load, and what was missed is
//! made up for by the next move, whose direction contains the last one.

use super::Solver;
use super::lanes::{Wide, wide};
use super::passes::{Aim, Correct, Evaluate, Move, Retreat, Sums};
use super::survey::{Standing, Survey};

/// Iterations of one load whose steps are told apart; later ones share the last.
const STEPS: usize = 16;

/// The step before any was learnt: between those of first iterations, 0.7, and of later ones, 0.35.
const UNTRIED_STEP: f64 = 0.5;

/// Steps stay within what surfaces of all kinds were seen to need, 0.15 to 1, with a margin: a load
/// that ends in rounding must not teach the next.
const STEP_RANGE: (f64, f64) = (0.1, 1.5);

/// The largest share of the last move in a direction: more would make it grow from one iteration
/// to the next, which a predicted step does not bear.
const LARGEST_SHARE: f64 = 2.0;

/// A move of which less than this part would have been best is taken back to that part. Below one
/// half it would have raised the energy.
const SMALLEST_PART: f64 = 0.5;

/// Where less than this part would have been best, the next steps are shortened.
const RECKLESS_PART: f64 = 0.25;

/// The steps that each iteration of a load learnt from earlier loads.
pub struct Steps([f64; STEPS]);

impl Default for Steps {
    fn default() -> Self {
        Self([UNTRIED_STEP; STEPS])
    }
}

impl Steps {
    fn of(&self, iteration: usize) -> f64 {
        self.0[iteration.min(STEPS - 1)]
    }

    /// Learns, by half, that `best` times the step would have been right.
    fn learn(&mut self, iteration: usize, best: f64) {
        let (least, most) = STEP_RANGE;
        let step = &mut self.0[iteration.min(STEPS - 1)];
        *step = (*step * (0.5 + 0.5 * best.min(2.0))).clamp(least, most);
    }
}

/// What an iteration leaves to the next one of the same load.
pub struct Search {
    iteration: usize,
    /// Shortens steps after one that went much too far. Without it, a step that clips too many
    /// nodes to go downhill would be taken back and tried again for ever.
    caution: f64,
    last: Option<LastMove>,
}

impl Default for Search {
    fn default() -> Self {
        Self {
            iteration: 0,
            caution: 1.0,
            last: None,
        }
    }
}

struct LastMove {
    /// ⟨move, its displacement⟩, twice the elastic energy of the move alone.
    curvature: f64,
    /// The part of the move that should be added to it.
    missed: f64,
    /// The level before the move.
    level: f64,
}

impl Search {
    /// Whether the last iteration went nowhere, so that only a new evaluation can help.
    pub fn is_stuck(&self) -> bool {
        self.iteration > 0 && self.last.is_none()
    }
}

/// What only double precision tells.
#[derive(Debug, Clone, Copy)]
pub struct Evaluation {
    pub standing: Standing,
    /// Mean of the gap over the cell, zero where there is contact.
    pub mean_gap: f64,
    /// Half the mean of pressure × displacement.
    pub energy: f64,
}

impl Solver {
    /// Measures the present pressure in double precision and renews the gap from it: one pair.
    pub(super) fn evaluate(&mut self) -> Evaluation {
        let mut pass = Evaluate {
            nodes: self.nodes,
            heights: &self.heights,
            pressure: &self.pressure,
            datum: self.datum,
            gap: &mut self.gap,
            active: &mut self.active,
            survey: Survey::new(),
            gap_sum: 0.0,
            work: 0.0,
        };
        self.double.convolve_rows(
            &self.displacement,
            &mut Wide(&mut pass),
            &mut self.double_scratch,
        );
        let (gap_sum, work) = (pass.gap_sum, pass.work);
        let standing = pass.survey.standing();
        self.pairs += 1;
        // Gaps in contact are rounded relative to the datum: once it is the level, they keep all
        // their digits.
        self.datum += standing.level;
        for gap in &mut self.gap {
            *gap -= standing.level as f32;
        }
        let cells = self.pressure.len() as f64;
        Evaluation {
            standing: Standing {
                level: 0.0,
                ..standing
            },
            mean_gap: gap_sum / cells - standing.level,
            energy: 0.5 * work / cells,
        }
    }

    /// One iteration, from where the search stands to where it stands next.
    pub(super) fn advance(&mut self, search: &mut Search, standing: Standing) -> Standing {
        let step = search.caution * self.steps.of(search.iteration);
        let level = self.datum + standing.level;
        let sums = self.correct(standing.level);
        let share = search.last.as_ref().map_or(0.0, |last| {
            // Gaps count from the level, and the level has moved too.
            let along = sums.correction_on_image - (level - last.level) * sums.correction;
            (along / last.curvature + last.missed / step).clamp(0.0, LARGEST_SHARE)
        });
        // Keeps the mean pressure, were nothing clipped.
        let mean = (share * sums.last_move - sums.correction) / sums.nodes as f64;
        let pressure_sum = self.aim(step, share, mean);
        let scale = self.load * self.pressure.len() as f64 / pressure_sum;
        let (mut next, slope, curvature) = self.go(step, scale, standing.level);

        // A move of no length, or one against the slope: only rounding is left in it.
        let best = if -slope / curvature > 0.0 {
            -slope / curvature
        } else {
            0.0
        };
        if search.caution == 1.0 {
            self.steps.learn(search.iteration, best);
        }
        let short = best < SMALLEST_PART;
        if short {
            next = self.retreat(1.0 - best);
        }
        if best < RECKLESS_PART {
            search.caution *= 0.5;
        } else if !short {
            search.caution = (2.0 * search.caution).min(1.0);
        }
        search.iteration += 1;
        search.last = (best > 0.0).then_some(LastMove {
            curvature,
            missed: if short { 0.0 } else { (best - 1.0).min(1.0) },
            level,
        });
        next
    }

    /// Frees nodes, and fills `correction` with what the gap above `level` asks for: one pair.
    fn correct(&mut self, level: f64) -> Sums {
        let mut pass = Correct {
            nodes: self.nodes,
            level: level as f32,
            gap: &self.gap,
            active: &mut self.active,
            correction: &mut self.correction,
            last_move: &mut self.direction,
            image: &self.image,
            sums: Sums::default(),
        };
        self.single.convolve_rows(
            &self.single_stiffness,
            &mut Wide(&mut pass),
            &mut self.single_scratch,
        );
        self.pairs += 1;
        pass.sums
    }

    /// Turns the last move into the direction, `share` × itself − correction − `mean`. Returns the
    /// sum of the pressures that a step along it leaves, clipped at zero.
    fn aim(&mut self, step: f64, share: f64, mean: f64) -> f64 {
        let rows = self.direction.chunks_exact_mut(self.nodes).enumerate();
        rows.map(|(row, direction)| {
            let range = row * self.nodes..(row + 1) * self.nodes;
            wide(Aim {
                share: share as f32,
                mean: mean as f32,
                step,
                pressure: &self.pressure[range.clone()],
                active: &self.active[range.clone()],
                correction: &self.correction[range],
                direction,
            })
        })
        .sum()
    }

    /// Moves along `direction`: one pair. Returns where that leads, and the energy's slope and
    /// curvature along the move.
    fn go(&mut self, step: f64, scale: f64, level: f64) -> (Standing, f64, f64) {
        let mut pass = Move {
            nodes: self.nodes,
            step,
            scale,
            level: level as f32,
            pressure: &mut self.pressure,
            active: &mut self.active,
            direction: &mut self.direction,
            image: &mut self.image,
            gap: &mut self.gap,
            survey: Survey::new(),
            curvature: 0.0,
            slope: 0.0,
        };
        self.single.convolve_rows(
            &self.single_displacement,
            &mut Wide(&mut pass),
            &mut self.single_scratch,
        );
        self.pairs += 1;
        (pass.survey.standing(), pass.slope, pass.curvature)
    }

    /// Takes a part of the last move back.
    fn retreat(&mut self, part: f64) -> Standing {
        let retreat = Retreat {
            part,
            pressure: &mut self.pressure,
            active: &mut self.active,
            gap: &mut self.gap,
            last_move: &self.direction,
            image: &self.image,
        };
        retreat.survey().standing()
    }
}
