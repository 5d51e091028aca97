//! Pressures within their bounds: not above the hardness, and of the mean that is asked for.

use std::ops::RangeInclusive;

use super::evaluation::Evaluation;
use super::flags::{FREE, has};
use super::lanes::{Wide, over_rows};
use super::passes::{PendingUpdate, PressureInput, PromoteYielding, Tally};
use super::range::range;
use super::{Hardness, Solver};
use crate::fft::Band;

/// What elastic pressures are scaled by after a search, and at least in any case: if they were to make
/// still more room for saturated ones, rather all are scaled.
const SCALES: RangeInclusive<f64> = 0.5..=2.0;

/// What is left of a load by saturated nodes that bear it all.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// In so many rounds, scaling saturates the last node that it is going to, or there is hardly
/// anything to scale.
const ROUNDS: usize = 50;

impl Solver {
    /// Makes of the present pressure and gap, a solution that knew no hardness, a guess for the same
    /// load that does, and evaluates it.
    ///
    /// Pressures rise all over by what a lowered surface asks each node for, until those within
    /// their bounds bear the load: the nodes that saturate spread to where the gap is smallest.
    pub(super) fn guess_yielding(&mut self, hardness: Hardness) -> Evaluation {
        self.search.bound = Some(hardness);
        for (p, gap) in self.pressure.iter_mut().zip(&self.search.gap) {
            *p -= (f64::from(*gap) - self.offset) / self.search.nodal_compliance;
        }
        let [lowest, highest] =
            range(&self.search.threads, &mut self.pressure, self.search.nodes[1]);
        self.raise_to(self.search.load, (-highest, hardness.pressure() - lowest));
        self.impose_load();
        self.evaluate()
    }

    /// Takes over the pressure where a search led, within its bounds and of the mean asked for, but for
    /// what is to be taken back. Returns by how much elastic nodes were scaled.
    pub(super) fn promote_yielding(&mut self, hardness: Hardness, pending: PendingUpdate) -> f64 {
        let mut promote = PromoteYielding {
            hardness: hardness.pressure(),
            base: &self.search.base,
            increment: &self.search.increment,
            carry: &self.search.carry,
            tally: Tally::below(hardness.pressure()),
        };
        over_rows(&self.search.threads, &mut self.pressure, self.search.nodes[1], &mut promote);
        let mut tally = promote.tally;
        if pending.part < 1.0 {
            self.take_back(1.0 - pending.part);
            tally = self.tally(hardness);
        }
        if SCALES.contains(&self.scale_after(&tally)) {
            return self.share_out_after(tally);
        }
        self.shift_free_nodes(hardness);
        self.share_out(hardness)
    }

    /// Shifts the pressure of nodes that were free, within its bounds, so that it comes to what it
    /// should: there may be so few elastic nodes that these cannot make up for what others lack.
    fn shift_free_nodes(&mut self, hardness: Hardness) {
        let hardness = hardness.pressure();
        let sum: f64 = self.pressure.iter().sum();
        let lacked = self.search.load * self.pressure.len() as f64 - sum;
        self.search.asking.clear();
        for (p, carry) in self.pressure.iter().zip(&self.search.carry) {
            if has(*carry, FREE) {
                self.search.asking.push(*p as f32, 0.0);
            }
        }
        let Some(shift) = self.search.asking.shift(lacked, hardness as f32) else {
            return;
        };
        for (p, carry) in self.pressure.iter_mut().zip(&self.search.carry) {
            if has(*carry, FREE) {
                *p = (*p + shift).clamp(0.0, hardness);
            }
        }
    }

    /// Begins an evaluation of the present pressure; moves are kept.
    pub(super) fn begin_with_moves_kept(&mut self, hardness: Hardness) {
        let mut pass = Wide(PressureInput {
            pressure: &self.pressure,
            hardness: hardness.pressure(),
            carry: Band::of(&mut self.search.carry),
            keeps_moves: true,
        });
        self.double_scratch.take_over(&mut self.search.scratch);
        self.double.begin(&mut pass, &mut self.double_scratch);
    }

    /// Scales elastic pressures so that they bear what saturated ones leave, and returns by how much;
    /// what passes the hardness on the way is saturated.
    pub(super) fn share_out(&mut self, hardness: Hardness) -> f64 {
        let tally = self.tally(hardness);
        self.share_out_after(tally)
    }

    fn share_out_after(&mut self, mut tally: Tally) -> f64 {
        let mut scaled = 1.0;
        for _ in 0..ROUNDS {
            let scale = self.scale_after(&tally);
            // Saturated nodes may bear it all.
            let is_possible = scale >= *SCALES.start() && scale.is_finite() || scale == 0.0;
            if !is_possible {
                break;
            }
            if scale == 1.0 {
                return scaled;
            }
            let saturated = tally.scale(&mut self.pressure, scale);
            if scale == 0.0 {
                return scaled;
            }
            scaled *= scale;
            if saturated == 0 {
                return scaled;
            }
        }
        self.share_out_anew();
        1.0
    }

    /// Finds elastic nodes; those above the hardness are brought down to it.
    fn tally(&mut self, hardness: Hardness) -> Tally {
        let mut tally = Tally::below(hardness.pressure());
        over_rows(&self.search.threads, &mut self.pressure, self.search.nodes[1], &mut tally);
        tally
    }

    /// By what elastic pressures are to be scaled.
    fn scale_after(&self, tally: &Tally) -> f64 {
        let total = self.search.load * self.pressure.len() as f64;
        let rest = total - tally.saturated_nodes * tally.hardness;
        let elastic = tally.elastic_sum(&self.pressure, self.search.nodes[1]);
        if rest.abs() <= ROUNDING * total {
            return if elastic == 0.0 { 1.0 } else { 0.0 };
        }
        rest / elastic
    }

    /// The same where there are too many saturated nodes, or nearly no others: with none saturated,
    /// or from the heights alone.
    fn share_out_anew(&mut self) {
        let total = self.search.load * self.pressure.len() as f64;
        let sum: f64 = self.pressure.iter().sum();
        if sum >= total {
            self.pressure.iter_mut().for_each(|p| *p *= total / sum);
        } else {
            self.guess_from_heights(self.search.load);
        }
    }
}
