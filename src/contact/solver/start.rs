//! Where the search at a new load starts: the solutions before it, or the pressure of full contact.

use std::ops::RangeInclusive;

use super::Solver;
use super::lanes::total;
use super::survey::{Standing, Survey};
use crate::contact::half_space;

/// How far from the last load, in units of the way to it from the one before, a straight line
/// through both solutions is a better guess than the last one scaled: back to the one before, or
/// some steps on.
const REACH: RangeInclusive<f64> = -1.0..=4.0;

/// Halvings that find a shift of the full-contact pressure to the last bit.
const BISECTIONS: u32 = 60;

impl Solver {
    /// Replaces pressure and gap by a guess at `load`, of that mean pressure. Returns where it
    /// stands, if it is known without an evaluation.
    ///
    /// A straight line through two solutions costs no transform, for gaps are linear in pressures.
    /// It may leave pressures below zero, which the first move of a search clips.
    pub(super) fn guess(&mut self, load: f64) -> Option<Standing> {
        let reach = (load - self.load) / (self.load - self.earlier_load);
        if self.load > 0.0 && self.earlier_load > 0.0 && REACH.contains(&reach) {
            self.extrapolate(reach);
            self.load = load;
            return Some(self.survey());
        }
        if self.load == 0.0 {
            self.guess_from_full_contact(load);
        } else {
            self.remember();
        }
        self.load = load;
        let scale = load * self.pressure.len() as f64 / total(&self.pressure);
        for p in &mut self.pressure {
            *p *= scale;
        }
        None
    }

    /// Fills the pressure with that of full contact under `load`: exact, if it is nowhere negative.
    pub(super) fn flatten(&mut self, load: f64) {
        self.remember();
        self.fill_with_full_contact();
        for p in &mut self.pressure {
            *p += load;
        }
        self.load = load;
    }

    /// Along the straight line through the last two solutions. While the contact does not change,
    /// the solution is linear in the load.
    fn extrapolate(&mut self, reach: f64) {
        for (p, earlier) in self.pressure.iter_mut().zip(&mut self.earlier_pressure) {
            let last = *p;
            *p = last + reach * (last - f64::from(*earlier));
            *earlier = last as f32;
        }
        let single_reach = reach as f32;
        for (gap, earlier) in self.gap.iter_mut().zip(&mut self.earlier_gap) {
            let last = *gap;
            *gap = last + single_reach * (last - *earlier);
            *earlier = last;
        }
        let last = self.datum;
        self.datum = last + reach * (last - self.earlier_datum);
        self.earlier_datum = last;
        self.earlier_load = self.load;
    }

    /// Where the present pressure and gap stand; nodes with pressure become the active ones.
    fn survey(&mut self) -> Standing {
        for (active, p) in self.active.iter_mut().zip(&self.pressure) {
            *active = *p > 0.0;
        }
        let mut survey = Survey::new();
        survey.add(&self.active, &self.gap);
        survey.standing()
    }

    fn remember(&mut self) {
        for (earlier, p) in self.earlier_pressure.iter_mut().zip(&self.pressure) {
            *earlier = *p as f32;
        }
        self.earlier_gap.copy_from_slice(&self.gap);
        self.earlier_datum = self.datum;
        self.earlier_load = self.load;
    }

    /// The part of the full-contact pressure above a level that leaves the mean `load`.
    fn guess_from_full_contact(&mut self, load: f64) {
        self.fill_with_full_contact();
        let cells = self.pressure.len() as f64;
        let peak = self.pressure.iter().fold(0.0, |peak: f64, p| peak.max(*p));
        let (mut low, mut high) = (-peak, self.full_contact_load);
        for _ in 0..BISECTIONS {
            let shift = 0.5 * (low + high);
            let sum: f64 = self.pressure.iter().map(|p| (p + shift).max(0.0)).sum();
            *(if sum > load * cells {
                &mut high
            } else {
                &mut low
            }) = shift;
        }
        // The upper end, where the sum is positive for certain.
        for p in &mut self.pressure {
            *p = (*p + high).max(0.0);
        }
    }

    /// Fills the pressure with the one of zero mean that flattens the heights: one pair.
    fn fill_with_full_contact(&mut self) {
        half_space::full_contact_pressure(
            &self.double,
            &self.heights,
            &mut self.pressure,
            &mut self.double_scratch,
        );
        self.pairs += 1;
    }
}
