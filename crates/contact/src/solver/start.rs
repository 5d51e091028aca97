//! Initial guess of the pressures: by extrapolation from the last two solutions, from the heights,
//! or from full contact.
//!
//! After a single load, the surface without contact is the earlier of the two solutions. If the
//! next load is too far away for extrapolation, the last solution is scaled. The first load, and a
//! light load that is not extrapolated, have other guesses:
//!
//! - Under a light load the displacements are smaller than the differences in height of the nodes,
//!   so the guess is made from the heights. Any other guess would put pressure on too many nodes.
//!   Removing this pressure takes steps so much larger than the final pressure that single
//!   precision would lose it.
//! - If the contact is expected to be small, the guess puts pressure on the highest nodes. Their
//!   number is known approximately from the load, and the surface is highest in contact.
//! - Otherwise the guess is the pressure of full contact, shifted and clipped.
//!
//! Both guesses were compared with solutions at k_lower = 4, k_upper = 64 on 1024² nodes. If n
//! nodes are in contact under 0.006 E* × rms slope, 71 per cent of them are among the n highest
//! nodes, and 46 per cent among the n nodes with the largest pressure of full contact. Under 0.3 E*
//! × rms slope these are 85 and 90 per cent.

use std::mem::{swap, take};
use std::ops::RangeInclusive;

use super::balance::Balance;
use super::evaluation::Convergence;
use super::heights::{CountHeights, LevelBin, PressAbove, SubtractLevel, Untouched, range};
use super::lanes::{InOrder, over_rows};
use super::line_search::StepLengths;
use super::nearing::{Expected, LimitedGap, SumInContact};
use super::passes::{Extrapolation, GapUpdate, InitialResidual, SavePressure};
use super::{Hardness, Solver};
use crate::elasticity;
use crate::fft::{Band, Transform};

/// Range of (L − L₁)/(L₁ − L₂), for a load L after the loads L₂ and L₁, in which extrapolation is
/// better than scaling the last solution.
const REACH: RangeInclusive<f64> = -1.0..=4.0;

/// Upper limit of load × nodes for a light load, in E* × rms slope. This product is the pressure of
/// a single node that bears the whole load.
const LIGHT: f64 = 1.0;

/// State from which iterations start, except for the maps, which the inner solver holds.
pub struct Start {
    pub convergence: Convergence,
    pub reference_sum: f64,
    pub balance: Option<Balance>,
}

impl Solver {
    /// Replaces the pressures by an initial guess with the mean `load`.
    ///
    /// If the guess is extrapolated from the last two solutions, extrapolates the gaps as well,
    /// because gaps are linear in pressures, and returns the start of the iterations. Extrapolated
    /// pressures may be negative; the first step clips them. Any other guess must be evaluated to
    /// find its gaps, and the result is `None`.
    pub(super) fn guess(&mut self, load: f64) -> Option<Start> {
        let is_light = self.is_light(load);
        self.set_height_reference(if is_light { self.highest } else { 0.0 });
        if let Some(reach) = self.reach(load) {
            let start = self.extrapolate(reach);
            self.inner.load = load;
            return Some(start);
        }
        self.save_previous();
        if is_light {
            self.guess_from_heights(load);
        } else if self.inner.load == 0.0 {
            self.guess_first(load);
        }
        self.inner.load = load;
        self.impose_load();
        None
    }

    pub(super) fn is_light(&self, load: f64) -> bool {
        load * (self.pressure.len() as f64) < LIGHT
    }

    /// Returns (L − L₁)/(L₁ − L₂) for the load L = `load`, the last load L₁ and the load L₂ before
    /// it, or `None` if the guess should not be extrapolated.
    ///
    /// A light load is extrapolated only if L₂ ≤ L₁ ≤ L, because under heavier loads too many nodes
    /// have pressure.
    fn reach(&self, load: f64) -> Option<f64> {
        let reach = (load - self.inner.load) / (self.inner.load - self.earlier_load);
        let ascend = self.earlier_load <= self.inner.load && self.inner.load <= load;
        let leads_there = REACH.contains(&reach) && (ascend || !self.is_light(load));
        (self.inner.load > 0.0 && leads_there).then_some(reach)
    }

    /// Saves the last solution, and sets the pressures to the full-contact pressures under `load`.
    ///
    /// These are the solution if none of them is negative.
    pub(super) fn set_full_contact(&mut self, load: f64) {
        self.save_previous();
        self.fill_with_full_contact();
        for p in &mut self.pressure {
            *p += load;
        }
        self.inner.load = load;
        self.inner.reference = 0.0;
    }

    /// Extrapolates pressures and gaps linearly from the last two solutions, and saves the last
    /// solution as the earlier one.
    ///
    /// `reach` is the ratio of the next increment of the load to the last one. The extrapolation is
    /// exact if the contact does not change.
    fn extrapolate(&mut self, reach: f64) -> Start {
        let extrapolation = |last: f64, earlier: &mut f64| {
            let guess = last + reach * (last - *earlier);
            *earlier = last;
            guess
        };
        self.expected = self.nearing(reach).map_or(Expected::All, Expected::Near);
        if self.earlier_load == 0.0 {
            self.earlier_offset = self.mean_earlier_gap();
        }
        self.inner.reference = extrapolation(self.inner.reference, &mut self.earlier_reference);
        self.offset = extrapolation(self.offset, &mut self.earlier_offset);
        self.earlier_load = self.inner.load;
        self.earlier_contact_nodes = self.contact_nodes;
        self.begin(self.offset, Some(reach))
    }

    /// Prepares iterations from the present pressures and gaps, and computes their first residual.
    /// `convergence` describes these gaps.
    pub(super) fn initial_residual(&mut self, convergence: Convergence) -> Start {
        let offset = match self.inner.bound {
            None => convergence.offset,
            Some(hardness) => self.balanced_offset(hardness, convergence),
        };
        self.begin(offset, None)
    }

    /// Prepares iterations from the present pressures and gaps. If `reach` is given, first
    /// extrapolates both to the next load; `reach` is the ratio of the next increment of the load
    /// to the last one.
    ///
    /// The first residual is the gap minus `offset`.
    fn begin(&mut self, offset: f64, reach: Option<f64>) -> Start {
        match self.inner.bound {
            None => self.begin_as::<false>(offset, reach),
            Some(_) => self.begin_as::<true>(offset, reach),
        }
    }

    fn begin_as<const YIELDS: bool>(&mut self, offset: f64, reach: Option<f64>) -> Start {
        let hardness = self.inner.ceiling();
        let extrapolation = reach.map(|reach| Extrapolation {
            reach,
            earlier_pressure: Band::new(&mut self.earlier_pressure),
            earlier_gap: Band::new(&mut self.earlier_gap),
        });
        let mut pass = InitialResidual::<YIELDS> {
            extrapolation,
            expected: take(&mut self.expected),
            limited_gap: LimitedGap::new(self.inner.nodes[1]),
            heights: &self.inner.heights,
            response: GapUpdate::without_step(offset),
            gap: Band::new(&mut self.inner.gap),
            hardness,
            last_step: Band::new(&mut self.inner.last_step),
            active: self.inner.active.band(),
            residual: self.inner.extension.residual_rows(),
            row: vec![0.0; self.inner.nodes[1]],
            reference_pressure: self.inner.reference_pressure.band(),
            pressure_increment: Band::new(&mut self.inner.pressure_increment),
            seen: InOrder::new(),
            reference_sum: InOrder::new(),
            bounded_sum: InOrder::new(),
        };
        let row_nodes = self.inner.nodes[1];
        over_rows(&self.inner.threads, &mut self.pressure, row_nodes, &mut pass);
        let (seen, reference_sum) = (pass.seen.total(), pass.reference_sum.total());
        let sum = pass.bounded_sum.total();
        self.inner.free_nodes = seen.free_nodes;
        self.inner.scratch.take_over(&mut self.double_scratch);
        self.inner.level = offset;
        Start {
            convergence: seen.extremes.convergence(offset),
            reference_sum,
            balance: YIELDS.then(|| Balance::seen(&seen, sum, offset)),
        }
    }

    /// Copies the last solution, or the surface without contact before the first load, to the
    /// `earlier_*` fields. The present gap is lost.
    pub(super) fn save_previous(&mut self) {
        self.earlier_contact_nodes = self.contact_nodes;
        if self.inner.load == 0.0 {
            self.save_untouched();
            return;
        }
        let mut pass = SavePressure(Band::new(&mut self.earlier_pressure));
        let (threads, row_nodes) = (&self.inner.threads, self.inner.nodes[1]);
        over_rows(threads, &mut self.pressure, row_nodes, &mut pass);
        swap(&mut self.earlier_gap, &mut self.inner.gap);
        self.earlier_reference = self.inner.reference;
        self.earlier_offset = self.offset;
        self.earlier_load = self.inner.load;
    }

    /// Returns the mean of `earlier_gap` over the nodes in contact under the last load.
    ///
    /// If the earlier solution has no contact, this mean replaces its offset.
    fn mean_earlier_gap(&mut self) -> f64 {
        let mut pass = SumInContact { gap: &self.earlier_gap, sum: InOrder::new() };
        over_rows(&self.inner.threads, &mut self.pressure, self.inner.nodes[1], &mut pass);
        pass.sum.total() / self.contact_nodes
    }

    fn save_untouched(&mut self) {
        let mut pass = Untouched {
            highest: self.highest,
            heights: &self.heights,
            earlier_pressure: Band::new(&mut self.earlier_pressure),
        };
        over_rows(&self.inner.threads, &mut self.earlier_gap, self.inner.nodes[1], &mut pass);
        self.earlier_reference = -self.highest;
        self.earlier_offset = 0.0;
        self.earlier_load = 0.0;
    }

    /// Resets the solver to the state before the first load.
    pub(super) fn reset(&mut self) {
        self.inner.step_lengths = StepLengths::default();
        self.inner.nested_step_lengths = StepLengths::default();
        (self.inner.load, self.inner.reference, self.offset) = (0.0, 0.0, 0.0);
        self.contact_nodes = 0.0;
    }

    /// Sets the height that is subtracted from all heights before they are rounded to single
    /// precision.
    ///
    /// Rounding errors are smallest at heights near this reference. Under a light load it should be
    /// the highest height.
    pub(super) fn set_height_reference(&mut self, height: f64) {
        if self.inner.height_reference == height {
            return;
        }
        self.inner.height_reference = height;
        let mut pass = SubtractLevel { level: height, heights: &self.heights };
        over_rows(&self.inner.threads, &mut self.inner.heights, self.inner.nodes[1], &mut pass);
    }
}

/// Ratio of area fraction to load from which the contact under the first load is predicted, in
/// units of 1 / (E* × rms slope).
///
/// Theories and computations give 2 to 2.5 for rough surfaces under light loads.
const CONTACT_OVER_LOAD: f64 = 2.4;

/// Largest expected area fraction for which the first guess is made from the highest nodes instead
/// of full contact.
const SMALL_AREA_FRACTION: f64 = 0.2;

/// Ratio of the number of nodes with pressure, in a guess from the highest nodes, to the number
/// expected in contact.
const PRESSED: f64 = 1.5;

/// Number of bisections with which [`Solver::raise_to`] determines the shift to the last bit.
const BISECTIONS: u32 = 60;

/// Ratio of all nodes to nodes with positive pressure above which [`Solver::raise_to`] visits only
/// a list of the nodes with positive pressure.
const COPY_RATIO: usize = 4;

impl Solver {
    pub(super) fn guess_first(&mut self, load: f64) {
        let area_fraction = 1.0 - (-CONTACT_OVER_LOAD * load).exp();
        if self.inner.bound.is_none() && area_fraction < SMALL_AREA_FRACTION {
            self.guess_from_highest(area_fraction);
        } else {
            self.guess_from_full_contact(load);
        }
    }

    /// Sets the pressures to clamp(p + s, 0, hardness), with the pressure p of full contact with
    /// zero mean and the shift s for which their mean is `load`.
    fn guess_from_full_contact(&mut self, load: f64) {
        self.fill_with_full_contact();
        let [lowest, highest] = range(&self.inner.threads, &mut self.pressure, self.inner.nodes[1]);
        let most = match self.inner.bound {
            Some(hardness) => hardness.pressure() - lowest,
            // With this shift, the mean is the load of full contact, which exceeds `load`.
            None => self.full_contact.map_or(load - lowest, |full| full.load),
        };
        self.raise_to(load, (-highest, most));
    }

    /// Sets the pressures to √(h − l) at heights h above a level l and to zero below, as in Hertz'
    /// contacts.
    ///
    /// The level is chosen such that 1.5 times as many nodes have pressure as are expected in
    /// contact (`area_fraction`). The load is not yet imposed.
    fn guess_from_highest(&mut self, area_fraction: f64) {
        let nodes = area_fraction * self.heights.len() as f64;
        let [level, expected] = self.levels_above([PRESSED * nodes, nodes]);
        let mut press = PressAbove { level, heights: &self.heights };
        over_rows(&self.inner.threads, &mut self.pressure, self.inner.nodes[1], &mut press);
        self.inner.reference = -level;
        let expected = expected - self.inner.height_reference;
        self.expected = Expected::AsHighAs(expected as f32);
    }

    /// Returns, for each number in `nodes`, a height above which this many nodes or slightly more
    /// lie. It is found with two histograms, the second within one bin of the first.
    fn levels_above<const N: usize>(&mut self, nodes: [f64; N]) -> [f64; N] {
        let all = nodes.map(|nodes| (nodes, 0.0));
        let coarse = self.highest_between(self.lowest, self.highest, all);
        let mut levels = [0.0; N];
        for ((level, nodes), found) in levels.iter_mut().zip(nodes).zip(coarse) {
            let [fine] = self.highest_between(found.low, found.high, [(nodes, found.above)]);
            *level = fine.low;
        }
        levels
    }

    /// Returns, for each pair (n, m) in `nodes`, the bin that contains the n-th highest node, in a
    /// histogram of the heights between `low` and `high`. m is the number of nodes above `high`.
    fn highest_between<const N: usize>(
        &mut self,
        low: f64,
        high: f64,
        nodes: [(f64, f64); N],
    ) -> [LevelBin; N] {
        let mut counts = CountHeights::between(low, high, &self.heights);
        over_rows(&self.inner.threads, &mut self.pressure, self.inner.nodes[1], &mut counts);
        nodes.map(|(nodes, above)| counts.highest(above, nodes))
    }

    /// Returns whether the material is expected to yield under the first load.
    ///
    /// Let p be the pressure of full contact, shifted so that its peak equals the hardness. The
    /// material is expected to yield if the mean of max(p, 0) is below `load`. This clipped
    /// pressure has a larger contact than the solution under the same load, and usually a lower
    /// peak. The result is false if the load is light or no formula gives p.
    pub(super) fn is_expected_to_yield(&self, hardness: Hardness, load: f64) -> bool {
        let Some(full) = self.full_contact.filter(|_| !self.is_light(load)) else {
            return false;
        };
        let raised = hardness.pressure() - full.peak;
        let borne: f64 = self.pressure.iter().map(|p| (p + raised).max(0.0)).sum();
        borne < load * self.pressure.len() as f64
    }

    /// Sets the pressures to clamp((h − h_max)/c + s, 0, hardness), as if nodes did not displace
    /// each other.
    ///
    /// h is the height of a node, c the nodal compliance, and s the shift for which the mean
    /// pressure is `load`. The guess is exact if one node bears all the load or if displacements
    /// are negligible.
    pub(super) fn guess_from_heights(&mut self, load: f64) {
        for (p, height) in self.pressure.iter_mut().zip(&self.heights) {
            *p = (height - self.highest) / self.inner.nodal_compliance;
        }
        let most = match self.inner.bound {
            None => load * self.pressure.len() as f64,
            Some(hardness) => {
                hardness.pressure() + (self.highest - self.lowest) / self.inner.nodal_compliance
            }
        };
        let highest = self.raise_to(load, (0.0, most));
        self.inner.reference = highest * self.inner.nodal_compliance - self.highest;
    }

    /// Replaces each pressure p by clamp(p + s, 0, ceiling), with the shift s between `low` and
    /// `high` for which their mean is `load`, and returns s.
    pub(super) fn raise_to(&mut self, load: f64, (mut low, mut high): (f64, f64)) -> f64 {
        let (cells, most) = (self.pressure.len() as f64, self.inner.ceiling());
        // The pressures that may become positive, in order; the others add nothing to the sum.
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
                if raised < all.len() / COPY_RATIO {
                    let above = all.iter().filter(|p| **p + high > 0.0);
                    few = Some(above.copied().collect());
                }
            } else {
                low = shift;
            }
        }
        // At the upper end of the interval the sum is certainly positive.
        for p in &mut self.pressure {
            *p = (*p + high).max(0.0).min(most);
        }
        high
    }

    /// Sets the pressures to the convolution of the heights with the stiffness; takes one transform
    /// pair.
    ///
    /// If the stiffness is exact, this is the pressure of zero mean that flattens the surface.
    pub(super) fn fill_with_full_contact(&mut self) {
        let stiffness = elasticity::stiffness_on(&self.inner.threads, &*self.body);
        let transform = Transform::padded(self.inner.nodes, self.body.stiffness_nodes());
        let mut scratch = transform.scratch_on(self.inner.threads.clone());
        scratch.take_over(&mut self.inner.scratch);
        scratch.take_over(&mut self.double_scratch);
        transform.convolve(&stiffness, &self.heights, &mut self.pressure, &mut scratch);
        self.double_scratch.take_over(&mut scratch);
        self.inner.pairs += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::PeriodicHalfSpace;
    use crate::grid::samples::square;
    use crate::solver::Settings;
    use crate::topography::shapes::Shape;

    fn above(solver: &Solver, level: f64) -> f64 {
        let nodes = solver.heights.iter().filter(|height| **height > level);
        nodes.count() as f64
    }

    #[test]
    fn a_level_has_as_many_nodes_above_it_as_were_asked_for() {
        let grid = square(64, 1.0);
        let ramp: Vec<f64> = (0..64 * 64).map(f64::from).collect();
        let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &ramp);
        for nodes in [1.0, 10.0, 1000.0, 4000.0] {
            let [level] = solver.levels_above([nodes]);
            let found = above(&solver, level);
            assert!((found - nodes).abs() <= 1.0, "{found} for {nodes}");
        }
    }

    #[test]
    fn a_plateau_is_above_the_level_of_its_first_node() {
        let grid = square(64, 1.0);
        let punch = Shape::Punch { radius: 0.2, depth: 0.1 };
        let punch = punch.draw(grid);
        let mut solver = Solver::new(PeriodicHalfSpace::new(grid), punch.heights());
        let plateau = punch.heights().iter().filter(|height| **height > -0.05);
        let [level] = solver.levels_above([1.0]);
        let found = above(&solver, level);
        assert_eq!(found, plateau.count() as f64);
    }

    #[test]
    fn the_surface_that_nothing_touches_is_the_solution_before_the_first() {
        let grid = square(64, 1.0);
        let wave = Shape::Wave { amplitude: 0.1, waves: 1 }.draw(grid);
        let mut solver = Solver::new(PeriodicHalfSpace::new(grid), wave.heights());
        solver.press(0.01, &Settings::default(), &|| false);
        assert_eq!((solver.earlier_load, solver.earlier_contact_nodes), (0.0, 0.0));
        assert!(solver.earlier_pressure.iter().all(|p| *p == 0.0));
        // Gaps are open except at the crest.
        let closed = solver.earlier_gap.iter().filter(|gap| **gap == 0.0);
        assert_eq!(closed.count(), 64);
    }
}
