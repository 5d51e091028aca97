//! Where the search at a new load starts: the solutions before it, the pressure of full contact, or,
//! under a light load, the heights.
//!
//! A light load bends the half-space by less than nodes differ in height. Most of what any other
//! guess presses on would have to be let go again, in moves so much larger than the pressure that
//! single precision would lose it.

use std::ops::RangeInclusive;

use super::balance::Balance;
use super::in_order::InOrder;
use super::lanes::over_rows;
use super::passes::{Ask, GapUpdate, Onwards};
use super::steps::Steps;
use super::survey::Standing;
use super::{Hardness, Solver};
use crate::contact::elasticity;
use crate::contact::fft::Band;

/// How far from the last load, in units of the way to it from the one before, a straight line
/// through both solutions is a better guess than the last one scaled: back to the one before, or
/// some steps on.
const REACH: RangeInclusive<f64> = -1.0..=4.0;

/// The largest pressure of one node under a light load, in units of E* × rms slope, if it bears all.
const LIGHT: f64 = 1.0;

/// Halvings that find a shift of a pressure to the last bit.
const BISECTIONS: u32 = 60;

/// Nodes that are raised are gathered when there are that many others to each.
const MANY: usize = 4;

/// Where a search starts: what its first correction is to close is in the single-precision
/// transform.
pub struct Start {
    pub standing: Standing,
    /// Σ of what pressures are counted from.
    pub base_sum: f64,
    /// If the material may yield, what pressures lack.
    pub balance: Option<Balance>,
}

impl Solver {
    /// Replaces pressure and gap by a guess at `load`, of that mean pressure, and begins the search
    /// there, if the gap is known without an evaluation.
    ///
    /// A straight line through two solutions costs no transform, for gaps are linear in pressures.
    /// It may leave pressures below zero, which the first move of a search clips.
    pub(super) fn guess(&mut self, load: f64) -> Option<Start> {
        let is_light = self.is_light(load);
        self.count_heights_from(if is_light { self.highest } else { 0.0 });
        if let Some(reach) = self.reach(load) {
            let start = self.extrapolate(reach);
            self.load = load;
            return Some(start);
        }
        if self.load > 0.0 {
            self.remember();
        }
        if is_light {
            self.guess_from_heights(load);
        } else if self.load == 0.0 {
            self.guess_from_full_contact(load);
        }
        self.load = load;
        self.impose_load();
        None
    }

    fn is_light(&self, load: f64) -> bool {
        load * (self.pressure.len() as f64) < LIGHT
    }

    /// How far beyond the last load this one is, if the straight line through the last two solutions
    /// reaches so far. To a light load it leads up from lighter ones alone: from heavier ones it
    /// would press on all that they do.
    fn reach(&self, load: f64) -> Option<f64> {
        let reach = (load - self.load) / (self.load - self.earlier_load);
        let are_solved = self.load > 0.0 && self.earlier_load > 0.0;
        let ascend = self.earlier_load <= self.load && self.load <= load;
        let leads_there = REACH.contains(&reach) && (ascend || !self.is_light(load));
        (are_solved && leads_there).then_some(reach)
    }

    /// Fills the pressure with that of full contact under `load`: exact, if it is nowhere negative.
    pub(super) fn flatten(&mut self, load: f64) {
        self.remember();
        self.fill_with_full_contact();
        for p in &mut self.pressure {
            *p += load;
        }
        self.load = load;
        self.reference = 0.0;
    }

    /// Along the straight line through the last two solutions. While the contact does not change,
    /// the solution is linear in the load.
    fn extrapolate(&mut self, reach: f64) -> Start {
        let onwards = |last: f64, earlier: &mut f64| {
            let guess = last + reach * (last - *earlier);
            *earlier = last;
            guess
        };
        self.reference = onwards(self.reference, &mut self.earlier_reference);
        self.offset = onwards(self.offset, &mut self.earlier_offset);
        self.earlier_load = self.load;
        self.begin(self.offset, Some(reach))
    }

    /// Begins a search where pressure and gap are.
    pub(super) fn ask(&mut self, standing: Standing) -> Start {
        let offset = match self.bound {
            None => standing.offset,
            Some(hardness) => self.balanced_offset(hardness, standing),
        };
        self.begin(offset, None)
    }

    /// Begins a search `reach` beyond pressure and gap, or where they are.
    fn begin(&mut self, offset: f64, reach: Option<f64>) -> Start {
        match self.bound {
            None => self.begin_as::<false>(offset, reach),
            Some(_) => self.begin_as::<true>(offset, reach),
        }
    }

    fn begin_as<const YIELDS: bool>(&mut self, offset: f64, reach: Option<f64>) -> Start {
        let hardness = self.ceiling();
        let onwards = reach.map(|reach| Onwards {
            reach,
            earlier_pressure: Band::of(&mut self.earlier_pressure),
            earlier_gap: Band::of(&mut self.earlier_gap),
        });
        let mut pass = Ask::<YIELDS> {
            onwards,
            response: GapUpdate::to_a_start(offset),
            gap: Band::of(&mut self.gap),
            hardness,
            carry: Band::of(&mut self.carry),
            active: self.active.band(),
            asked: self.extension.asked_rows(),
            row: vec![0.0; self.nodes[1]],
            base: self.base.band(),
            increment: Band::of(&mut self.increment),
            seen: InOrder::new(),
            base_sum: InOrder::new(),
            bounded_sum: InOrder::new(),
        };
        let row_nodes = self.nodes[1];
        over_rows(&self.threads, &mut self.pressure, row_nodes, &mut pass);
        let (seen, base_sum) = (pass.seen.total(), pass.base_sum.total());
        let sum = pass.bounded_sum.total();
        self.free_nodes = seen.free_nodes;
        self.single_scratch.take_over(&mut self.double_scratch);
        self.begin_correction(offset);
        Start {
            standing: seen.extremes.seen_from(offset),
            base_sum,
            balance: YIELDS.then(|| Balance::seen(&seen, sum, offset)),
        }
    }

    fn remember(&mut self) {
        for (earlier, p) in self.earlier_pressure.iter_mut().zip(&self.pressure) {
            *earlier = *p as f32;
        }
        self.earlier_gap.copy_from_slice(&self.gap);
        self.earlier_reference = self.reference;
        self.earlier_offset = self.offset;
        self.earlier_load = self.load;
    }

    /// The part of the full-contact pressure, or of what the stiffness has for it, above a plane that
    /// leaves the mean `load`.
    fn guess_from_full_contact(&mut self, load: f64) {
        self.fill_with_full_contact();
        let peak = self.pressure.iter().fold(0.0, |peak: f64, p| peak.max(*p));
        if let Some(hardness) = self.bound {
            let lowest = self.pressure.iter().fold(0.0, |low: f64, p| low.min(*p));
            self.raise_to(load, (-peak, hardness.pressure() - lowest));
            return;
        }
        // With less than the load everywhere there would be none at the lowest.
        let lowest = self
            .pressure
            .iter()
            .fold(0.0, |lowest: f64, p| lowest.min(*p));
        let most = self.full_contact.map_or(load - lowest, |full| full.load);
        self.raise_to(load, (-peak, most));
    }

    /// Whether the guess from full contact, under a first load, passes the hardness: raised until its peak
    /// does, the pressure of full contact bears less than the load. The contact of the guess is larger than
    /// that of the solution, and its peak lower as a rule. Where the stiffness is not exact, nothing is known.
    pub(super) fn is_expected_to_pass(&self, hardness: Hardness, load: f64) -> bool {
        let Some(full) = self.full_contact.filter(|_| !self.is_light(load)) else {
            return false;
        };
        let raised = hardness.pressure() - full.peak;
        let borne: f64 = self.pressure.iter().map(|p| (p + raised).max(0.0)).sum();
        borne < load * self.pressure.len() as f64
    }

    /// Goes back to where no load has been pressed.
    pub(super) fn forget(&mut self) {
        self.steps = Steps::default();
        (self.load, self.reference, self.offset) = (0.0, 0.0, 0.0);
    }

    /// What the highest nodes would bear if none displaced another: exact if one bears all, and where
    /// the material is so soft that it hardly bends.
    pub(super) fn guess_from_heights(&mut self, load: f64) {
        for (p, height) in self.pressure.iter_mut().zip(&self.heights) {
            *p = (height - self.highest) / self.nodal_compliance;
        }
        let most = match self.bound {
            None => load * self.pressure.len() as f64,
            Some(hardness) => {
                let lowest = self.pressure.iter().fold(0.0, |low: f64, p| low.min(*p));
                hardness.pressure() - lowest
            }
        };
        let highest = self.raise_to(load, (0.0, most));
        self.reference = highest * self.nodal_compliance - self.highest;
    }

    /// Raises the pressure so far that what is then within its bounds has the mean `load`, and says how
    /// far: within the range.
    pub(super) fn raise_to(&mut self, load: f64, (mut low, mut high): (f64, f64)) -> f64 {
        let (cells, most) = (self.pressure.len() as f64, self.ceiling());
        // Those that may be raised above zero, in their order: the others add nothing to any sum.
        let mut few: Option<Vec<f64>> = None;
        for _ in 0..BISECTIONS {
            let shift = 0.5 * (low + high);
            let all = few.as_deref().unwrap_or(&self.pressure);
            let (mut sum, mut raised) = (0.0, 0);
            for p in all {
                sum += (p + shift).max(0.0).min(most);
                raised += usize::from(p + shift > 0.0);
            }
            if sum > load * cells {
                high = shift;
                if raised < all.len() / MANY {
                    let above = all.iter().filter(|p| **p + high > 0.0);
                    few = Some(above.copied().collect());
                }
            } else {
                low = shift;
            }
        }
        // The upper end, where the sum is positive for certain.
        for p in &mut self.pressure {
            *p = (*p + high).max(0.0).min(most);
        }
        high
    }

    /// Single precision tells displacements from heights best where heights are small: under a light
    /// load, they are to be so in the highest nodes.
    pub(super) fn count_heights_from(&mut self, height: f64) {
        if self.height_reference == height {
            return;
        }
        self.height_reference = height;
        for (single, height) in self.single_heights.iter_mut().zip(&self.heights) {
            *single = (height - self.height_reference) as f32;
        }
    }

    /// Fills the pressure with the one of zero mean that flattens the heights, as far as the stiffness
    /// is exact: one pair.
    fn fill_with_full_contact(&mut self) {
        self.double_scratch.take_over(&mut self.single_scratch);
        self.double.convolve(
            &elasticity::stiffness_on(&self.threads, &*self.body),
            &self.heights,
            &mut self.pressure,
            &mut self.double_scratch,
        );
        self.pairs += 1;
    }
}
