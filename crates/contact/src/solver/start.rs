//! Where the search at a new load starts: on the straight line through the two solutions before it, of
//! which the surface that nothing touches is the first, or from a guess.

use std::mem::{swap, take};
use std::ops::RangeInclusive;

use super::Solver;
use super::balance::Balance;
use super::in_order::InOrder;
use super::lanes::over_rows;
use super::passes::{
    Ask, CountedFrom, Expected, GapUpdate, Onwards, Remember, ShownGap, SumInContact, Untouched,
};
use super::steps::Steps;
use super::survey::Standing;
use crate::fft::Band;

/// How far from the last load, in units of the way to it from the one before, a straight line
/// through both solutions is a better guess than the last one scaled: back to the one before, or
/// some steps on.
const REACH: RangeInclusive<f64> = -1.0..=4.0;

/// The largest pressure of one node under a light load, in units of E* × rms slope, if it bears all.
const LIGHT: f64 = 1.0;

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
            self.search.load = load;
            return Some(start);
        }
        self.remember();
        if is_light {
            self.guess_from_heights(load);
        } else if self.search.load == 0.0 {
            self.guess_first(load);
        }
        self.search.load = load;
        self.impose_load();
        None
    }

    pub(super) fn is_light(&self, load: f64) -> bool {
        load * (self.pressure.len() as f64) < LIGHT
    }

    /// How far beyond the last load this one is, if the straight line through the last two solutions
    /// reaches so far. To a light load it leads up from lighter ones alone: from heavier ones it
    /// would press on all that they do.
    fn reach(&self, load: f64) -> Option<f64> {
        let reach = (load - self.search.load) / (self.search.load - self.earlier_load);
        let ascend = self.earlier_load <= self.search.load && self.search.load <= load;
        let leads_there = REACH.contains(&reach) && (ascend || !self.is_light(load));
        (self.search.load > 0.0 && leads_there).then_some(reach)
    }

    /// Fills the pressure with that of full contact under `load`: exact, if it is nowhere negative.
    pub(super) fn flatten(&mut self, load: f64) {
        self.remember();
        self.fill_with_full_contact();
        for p in &mut self.pressure {
            *p += load;
        }
        self.search.load = load;
        self.search.reference = 0.0;
    }

    /// Along the straight line through the last two solutions. While the contact does not change,
    /// the solution is linear in the load.
    fn extrapolate(&mut self, reach: f64) -> Start {
        let onwards = |last: f64, earlier: &mut f64| {
            let guess = last + reach * (last - *earlier);
            *earlier = last;
            guess
        };
        self.expected = self.nearing(reach).map_or(Expected::All, Expected::Near);
        if self.earlier_load == 0.0 {
            self.earlier_offset = self.mean_earlier_gap();
        }
        self.search.reference = onwards(self.search.reference, &mut self.earlier_reference);
        self.offset = onwards(self.offset, &mut self.earlier_offset);
        self.earlier_load = self.search.load;
        self.earlier_contact_nodes = self.contact_nodes;
        self.begin(self.offset, Some(reach))
    }

    /// Begins a search where pressure and gap are.
    pub(super) fn ask(&mut self, standing: Standing) -> Start {
        let offset = match self.search.bound {
            None => standing.offset,
            Some(hardness) => self.balanced_offset(hardness, standing),
        };
        self.begin(offset, None)
    }

    /// Begins a search `reach` beyond pressure and gap, or where they are.
    fn begin(&mut self, offset: f64, reach: Option<f64>) -> Start {
        match self.search.bound {
            None => self.begin_as::<false>(offset, reach),
            Some(_) => self.begin_as::<true>(offset, reach),
        }
    }

    fn begin_as<const YIELDS: bool>(&mut self, offset: f64, reach: Option<f64>) -> Start {
        let hardness = self.search.ceiling();
        let onwards = reach.map(|reach| Onwards {
            reach,
            earlier_pressure: Band::of(&mut self.earlier_pressure),
            earlier_gap: Band::of(&mut self.earlier_gap),
        });
        let mut pass = Ask::<YIELDS> {
            onwards,
            expected: take(&mut self.expected),
            shown: ShownGap::new(self.search.nodes[1]),
            heights: &self.search.heights,
            response: GapUpdate::to_a_start(offset),
            gap: Band::of(&mut self.search.gap),
            hardness,
            carry: Band::of(&mut self.search.carry),
            active: self.search.active.band(),
            asked: self.search.extension.asked_rows(),
            row: vec![0.0; self.search.nodes[1]],
            base: self.search.base.band(),
            increment: Band::of(&mut self.search.increment),
            seen: InOrder::new(),
            base_sum: InOrder::new(),
            bounded_sum: InOrder::new(),
        };
        let row_nodes = self.search.nodes[1];
        over_rows(&self.search.threads, &mut self.pressure, row_nodes, &mut pass);
        let (seen, base_sum) = (pass.seen.total(), pass.base_sum.total());
        let sum = pass.bounded_sum.total();
        self.search.free_nodes = seen.free_nodes;
        self.search.scratch.take_over(&mut self.double_scratch);
        self.search.level = offset;
        Start {
            standing: seen.extremes.seen_from(offset),
            base_sum,
            balance: YIELDS.then(|| Balance::seen(&seen, sum, offset)),
        }
    }

    /// Makes the last solution the earlier one: that of no load, if there is none. The gap is lost.
    pub(super) fn remember(&mut self) {
        self.earlier_contact_nodes = self.contact_nodes;
        if self.search.load == 0.0 {
            self.remember_untouched();
            return;
        }
        let mut pass = Remember(Band::of(&mut self.earlier_pressure));
        let (threads, row_nodes) = (&self.search.threads, self.search.nodes[1]);
        over_rows(threads, &mut self.pressure, row_nodes, &mut pass);
        swap(&mut self.earlier_gap, &mut self.search.gap);
        self.earlier_reference = self.search.reference;
        self.earlier_offset = self.offset;
        self.earlier_load = self.search.load;
    }

    /// Mean over the last contact of the gap before it: the level that the mean gap in contact was on, where
    /// nothing was in contact.
    fn mean_earlier_gap(&mut self) -> f64 {
        let mut pass = SumInContact { gap: &self.earlier_gap, sum: InOrder::new() };
        over_rows(&self.search.threads, &mut self.pressure, self.search.nodes[1], &mut pass);
        pass.sum.total() / self.contact_nodes
    }

    fn remember_untouched(&mut self) {
        let mut pass = Untouched {
            highest: self.highest,
            heights: &self.heights,
            earlier_pressure: Band::of(&mut self.earlier_pressure),
        };
        over_rows(&self.search.threads, &mut self.earlier_gap, self.search.nodes[1], &mut pass);
        self.earlier_reference = -self.highest;
        self.earlier_offset = 0.0;
        self.earlier_load = 0.0;
    }

    /// Goes back to where no load has been pressed.
    pub(super) fn forget(&mut self) {
        self.search.steps = Steps::default();
        self.search.nested_steps = Steps::default();
        (self.search.load, self.search.reference, self.offset) = (0.0, 0.0, 0.0);
        self.contact_nodes = 0.0;
    }

    /// Single precision tells displacements from heights best where heights are small: under a light
    /// load, they are to be so in the highest nodes.
    pub(super) fn count_heights_from(&mut self, height: f64) {
        if self.search.height_reference == height {
            return;
        }
        self.search.height_reference = height;
        let mut pass = CountedFrom { level: height, heights: &self.heights };
        over_rows(&self.search.threads, &mut self.search.heights, self.search.nodes[1], &mut pass);
    }
}
