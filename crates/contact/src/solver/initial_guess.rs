//! Initial guess of the pressures: from coarser meshes (`nested`), or on one mesh.
//!
//! On small meshes, and under light loads, the guess is made on one mesh:
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

use pulp::Simd;

use super::lanes::{Pass, over_rows};
use super::line_search::History;
use super::problem::range;
use super::refinement::Evaluation;
use super::{Settings, Solver, Watch};
use crate::elasticity;
use crate::fft::{Row, Transform};

/// Upper limit of load × nodes for a light load, in E* × rms slope. This product is the pressure of
/// a single node that bears the whole load.
const LIGHT: f64 = 1.0;

impl Solver {
    /// Finds initial pressures for the present load and bound: on coarser meshes, or on this mesh
    /// if there are none or if the load is light. Returns their evaluation.
    pub(super) fn initial_guess(
        &mut self,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> (History, Evaluation) {
        if let Some(guess) = self.guess_from_coarser(settings, watch) {
            return guess;
        }
        self.inner.reference = 0.0;
        if self.is_light() {
            self.guess_from_heights(self.inner.load);
        } else {
            self.guess_on_one_mesh(self.inner.load);
        }
        self.impose_load();
        (History::default(), self.evaluate_guess(settings))
    }

    pub(super) fn is_light(&self) -> bool {
        self.inner.load * (self.pressure.len() as f64) < LIGHT
    }

    /// Sets the pressures to the full-contact pressures under the load.
    ///
    /// These are the solution if none of them is negative.
    pub(super) fn set_full_contact(&mut self) {
        let load = self.inner.load;
        self.fill_with_full_contact();
        for p in &mut self.pressure {
            *p += load;
        }
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
    fn guess_on_one_mesh(&mut self, load: f64) {
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
        let [lowest, highest] =
            range(&self.inner.threads, &mut self.pressure, self.inner.mesh.nodes[1]);
        let most = match self.inner.bound {
            Some(hardness) => hardness.pressure() - lowest,
            // With this shift, the mean is the load of full contact, which exceeds `load`.
            None => self.problem.full_contact.map_or(load - lowest, |full| full.load),
        };
        self.raise_to(load, (-highest, most));
    }

    /// Sets the pressures to √(h − l) at heights h above a level l and to zero below, as in Hertz'
    /// contacts.
    ///
    /// The level is chosen such that 1.5 times as many nodes have pressure as are expected in
    /// contact (`area_fraction`). The load is not yet imposed.
    fn guess_from_highest(&mut self, area_fraction: f64) {
        let nodes = area_fraction * self.problem.heights.len() as f64;
        let level = self.level_above(PRESSED * nodes);
        let mut press = PressAbove { level, heights: &self.problem.heights };
        over_rows(&self.inner.threads, &mut self.pressure, self.inner.mesh.nodes[1], &mut press);
        self.inner.reference = -level;
    }

    /// Returns a height above which `nodes` nodes or slightly more lie. It is found with two
    /// histograms, the second within one bin of the first.
    fn level_above(&mut self, nodes: f64) -> f64 {
        let coarse = self.highest_between(self.problem.lowest, self.problem.highest, nodes, 0.0);
        self.highest_between(coarse.low, coarse.high, nodes, coarse.above).low
    }

    /// Returns the bin that contains the n-th highest node, with n = `nodes`, in a histogram of
    /// the heights between `low` and `high`. `above` is the number of nodes above `high`.
    fn highest_between(&mut self, low: f64, high: f64, nodes: f64, above: f64) -> LevelBin {
        let mut counts = CountHeights::between(low, high, &self.problem.heights);
        over_rows(&self.inner.threads, &mut self.pressure, self.inner.mesh.nodes[1], &mut counts);
        counts.highest(above, nodes)
    }

    /// Sets the pressures to clamp((h − h_max)/c + s, 0, hardness), as if nodes did not displace
    /// each other.
    ///
    /// h is the height of a node, c the nodal compliance, and s the shift for which the mean
    /// pressure is `load`. The guess is exact if one node bears all the load or if displacements
    /// are negligible.
    pub(super) fn guess_from_heights(&mut self, load: f64) {
        for (p, height) in self.pressure.iter_mut().zip(&self.problem.heights) {
            *p = (height - self.problem.highest) / self.inner.mesh.nodal_compliance;
        }
        let most = match self.inner.bound {
            None => load * self.pressure.len() as f64,
            Some(hardness) => {
                hardness.pressure()
                    + (self.problem.highest - self.problem.lowest)
                        / self.inner.mesh.nodal_compliance
            }
        };
        let highest = self.raise_to(load, (0.0, most));
        self.inner.reference = highest * self.inner.mesh.nodal_compliance - self.problem.highest;
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
        let stiffness = elasticity::stiffness_on(&self.inner.threads, &*self.problem.body);
        let transform =
            Transform::padded(self.inner.mesh.nodes, self.problem.body.stiffness_nodes());
        let mut scratch = transform.scratch_on(self.inner.threads.clone());
        scratch.take_over(&mut self.inner.scratch);
        scratch.take_over(&mut self.double_scratch);
        transform.convolve(&stiffness, &self.problem.heights, &mut self.pressure, &mut scratch);
        self.double_scratch.take_over(&mut scratch);
        self.inner.pairs += 1;
    }
}

const BINS: usize = 1024;

/// Histogram of the heights between `low` and `high`, with the highest bin first.
///
/// It counts nodes as a [`Pass`] over any map and does not change this map.
pub struct CountHeights<'a> {
    heights: &'a [f64],
    low: f64,
    high: f64,
    counts: [u32; BINS],
}

/// Bin of a histogram of heights that contains the n-th highest node, for a given n.
#[derive(Debug, Clone, Copy)]
pub struct LevelBin {
    /// Number of nodes above the upper end of the bin.
    pub above: f64,
    pub low: f64,
    pub high: f64,
}

impl<'a> CountHeights<'a> {
    pub fn between(low: f64, high: f64, heights: &'a [f64]) -> Self {
        Self { heights, low, high, counts: [0; BINS] }
    }

    /// Returns the bin in which the number of nodes, counted from the highest down, reaches
    /// `nodes`. `above` is the number of nodes above the histogram.
    pub fn highest(&self, mut above: f64, nodes: f64) -> LevelBin {
        let bin = self.counts.iter().position(|count| {
            above += f64::from(*count);
            above >= nodes
        });
        let bin = bin.unwrap_or(BINS - 1);
        let width = self.width();
        LevelBin {
            above: above - f64::from(self.counts[bin]),
            low: self.high - (bin + 1) as f64 * width,
            high: self.high - bin as f64 * width,
        }
    }

    fn width(&self) -> f64 {
        (self.high - self.low) / BINS as f64
    }
}

impl Pass<f64> for CountHeights<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, _: &mut [f64]) {
        let width = self.width();
        for height in row.of(self.heights) {
            if *height > self.low && *height <= self.high {
                let bin = ((self.high - height) / width) as usize;
                self.counts[bin.min(BINS - 1)] += 1;
            }
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { counts: [0; BINS], ..*self }
    }

    fn append(&mut self, later: Self) {
        // Counts are whole numbers, so their sum does not depend on the order.
        for (count, later) in self.counts.iter_mut().zip(later.counts) {
            *count += later;
        }
    }
}

/// Pass over pressures that sets them to √(h − `level`) at heights h above the level and to zero
/// below, as in Hertz' contacts.
pub struct PressAbove<'a> {
    pub level: f64,
    pub heights: &'a [f64],
}

impl Pass<f64> for PressAbove<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        for (p, height) in pressure.iter_mut().zip(row.of(self.heights)) {
            *p = (height - self.level).max(0.0).sqrt();
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::PeriodicHalfSpace;
    use crate::grid::samples::square;
    use crate::topography::shapes::Shape;

    fn above(solver: &Solver, level: f64) -> f64 {
        let nodes = solver.problem.heights.iter().filter(|height| **height > level);
        nodes.count() as f64
    }

    #[test]
    fn a_level_has_as_many_nodes_above_it_as_were_asked_for() {
        let grid = square(64, 1.0);
        let ramp: Vec<f64> = (0..64 * 64).map(f64::from).collect();
        let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &ramp);
        for nodes in [1.0, 10.0, 1000.0, 4000.0] {
            let level = solver.level_above(nodes);
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
        let level = solver.level_above(1.0);
        let found = above(&solver, level);
        assert_eq!(found, plateau.count() as f64);
    }
}
