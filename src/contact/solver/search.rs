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
//! Where nodes are not free, the gap that is turned into a pressure is not zero but an *extension*
//! of the gap on the free ones: were it the displacement that the sought correction causes there,
//! the stiffness would give the correction exactly, with no pressure outside. It starts from
//! nothing, follows every move, and gives way to the pressure found outside, each node for itself.
//! A jump to zero at the edges of contact would cost a fifth more iterations on rough surfaces and
//! leave twice as many nodes wrong at the end.
//!
//! An exact line search would need the displacement of the direction before it is clipped: a third
//! pair, for nearly every move clips. But how long the move should have been is known after it at
//! no cost. That teaches the step of the same iteration at the next load, and what was missed is
//! made up for by the next move, whose direction contains the last one.

use super::Solver;
use super::lanes::{Wide, wide};
use super::passes::{
    Aim, Correct, Course, Evaluate, Extension, Glide, Land, Move, Retreat, Step, Sums, Tally,
};
use super::survey::{Standing, Survey};

/// How much of the extension an iteration hands to the next, and how far it gives way to a pressure
/// on a node that is not free, in units of the displacement that this node alone asks for. More of
/// either sways at light loads; less forgets what it knew. Tried from 0.3 to 0.7, and 0.3 to 1.6.
const MEMORY: f32 = 0.5;
const COMPLIANCE: f64 = 1.4;

/// The largest share of the last move in a direction: more would make it grow from one iteration
/// to the next, which a predicted step does not bear.
const LARGEST_SHARE: f64 = 2.0;

/// A move of which less than this part would have been best is taken back to that part. Below one
/// half it would have raised the energy.
const SMALLEST_PART: f64 = 0.5;

/// Where less than this part would have been best, the next steps are shortened.
const RECKLESS_PART: f64 = 0.25;

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
    /// How much of it was not taken back.
    part: f64,
    /// How much of the extension outlives it: nothing, if its displacement is the difference of
    /// gaps, which far from contact are rounded more coarsely than the extension bears.
    memory: f32,
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

/// Where an iteration led.
#[derive(Debug, Clone, Copy)]
pub enum Reached {
    /// As far as single precision sees.
    Estimate(Standing),
    Evaluated(Evaluation),
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
            heights: &self.heights,
            pressure: &self.pressure,
            datum: self.datum,
            gap: &mut self.gap,
            active: &mut self.active,
            tally: Tally::new(),
        };
        self.double.convolve_rows(
            &self.displacement,
            &mut Wide(&mut pass),
            &mut self.double_scratch,
        );
        let tally = pass.tally;
        self.pairs += 1;
        self.settle(&tally)
    }

    /// Makes the level the datum, and says what double precision found.
    ///
    /// Gaps in contact are rounded relative to the datum: once it is the level, they keep all their
    /// digits.
    fn settle(&mut self, tally: &Tally) -> Evaluation {
        let standing = tally.survey.standing();
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
            mean_gap: tally.gap_sum / cells - standing.level,
            energy: 0.5 * tally.work / cells,
        }
    }

    /// One iteration, from where the search stands to where it leads; evaluated in double
    /// precision if `landing`, unless the move was too long and had to be taken back in part.
    pub(super) fn advance(
        &mut self,
        search: &mut Search,
        standing: Standing,
        landing: bool,
    ) -> Reached {
        let step = search.caution * self.steps.of(search.iteration);
        let level = self.datum + standing.level;
        let sums = self.correct(search, standing.level);
        let share = search.last.as_ref().map_or(0.0, |last| {
            // Gaps count from the level, and the level has moved too.
            let along = sums.correction_on_image - (level - last.level) * sums.correction;
            (along / last.curvature + last.missed / step).clamp(0.0, LARGEST_SHARE)
        });
        // Keeps the mean pressure, were nothing clipped.
        let mean = (share * sums.last_move - sums.correction) / sums.nodes as f64;
        let pressure_sum = self.aim(step, share, mean, standing.level);
        let step = Step {
            length: step,
            scale: self.load * self.pressure.len() as f64 / pressure_sum,
        };
        let (mut reached, course) = self.follow(step, standing.level, landing);

        // A move of no length, or one against the slope: only rounding is left in it.
        let best = -course.slope / course.curvature;
        let best = if best > 0.0 { best } else { 0.0 };
        if search.caution == 1.0 {
            self.steps.learn(search.iteration, best);
        }
        // What the first move clips of a guess is not to be taken back.
        let short = search.iteration > 0 && best < SMALLEST_PART;
        if short {
            reached = Reached::Estimate(self.retreat(1.0 - best));
        }
        if short && best < RECKLESS_PART {
            search.caution *= 0.5;
        } else if !short {
            search.caution = (2.0 * search.caution).min(1.0);
        }
        search.iteration += 1;
        search.last = (best > 0.0).then_some(LastMove {
            part: if short { best } else { 1.0 },
            memory: if landing { 0.0 } else { MEMORY },
            curvature: course.curvature,
            missed: if short { 0.0 } else { (best - 1.0).min(1.0) },
            level,
        });
        reached
    }

    /// Frees nodes, and fills `correction` with what the gap above `level` asks for: one pair.
    fn correct(&mut self, search: &Search, level: f64) -> Sums {
        let extension = search
            .last
            .as_ref()
            .map_or(Extension::default(), |last| Extension {
                memory: last.memory,
                part: last.part as f32,
                rise: (self.datum + level - last.level) as f32,
                compliance: (COMPLIANCE / self.nodal_stiffness) as f32,
            });
        let mut pass = Correct {
            level: level as f32,
            gap: &self.gap,
            active: &mut self.active,
            correction: &mut self.correction,
            extension,
            last_move: &self.direction,
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
    fn aim(&mut self, step: f64, share: f64, mean: f64, level: f64) -> f64 {
        let rows = self.direction.chunks_exact_mut(self.nodes).enumerate();
        rows.map(|(row, direction)| {
            let range = row * self.nodes..(row + 1) * self.nodes;
            wide(Aim {
                share: share as f32,
                mean: mean as f32,
                step,
                pressure: &self.pressure[range.clone()],
                active: &self.active[range.clone()],
                gap: &self.gap[range.clone()],
                level: level as f32,
                correction: &mut self.correction[range],
                direction,
            })
        })
        .sum()
    }

    /// Moves along `direction`, and updates the gap in single precision or, if `landing`, evaluates
    /// it in double: one pair.
    fn follow(&mut self, step: Step, level: f64, landing: bool) -> (Reached, Course) {
        let motion = Move {
            step,
            level: level as f32,
            pressure: &mut self.pressure,
            active: &mut self.active,
            direction: &mut self.direction,
            image: &mut self.image,
            gap: &mut self.gap,
            course: Course::default(),
        };
        self.pairs += 1;
        if landing {
            let mut pass = Land {
                motion,
                heights: &self.heights,
                datum: self.datum,
                tally: Tally::new(),
            };
            self.double.convolve_rows(
                &self.displacement,
                &mut Wide(&mut pass),
                &mut self.double_scratch,
            );
            let (tally, course) = (pass.tally, pass.motion.course);
            (Reached::Evaluated(self.settle(&tally)), course)
        } else {
            let mut pass = Glide {
                motion,
                survey: Survey::new(),
            };
            self.single.convolve_rows(
                &self.single_displacement,
                &mut Wide(&mut pass),
                &mut self.single_scratch,
            );
            let standing = pass.survey.standing();
            (Reached::Estimate(standing), pass.motion.course)
        }
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
