//! Prediction of the nodes that come into contact under the next load.
//!
//! Extrapolation along a straight line through two solutions closes gaps too soon. Towards an edge
//! of contact, gaps fall with the power 3/2 of the distance, so nodes that the next load leaves
//! open seem to penetrate: half of the mesh under a load twice the last one. An iteration releases
//! only half of these wrong nodes. But the number of nodes in contact can be predicted to one per
//! cent, because contact grows in proportion to the load over a few loads. The first nodes to touch
//! are those whose gap fell to the smallest fraction of its previous value. Therefore only these
//! are free in the first iteration. If they are too few, others penetrate after the first step and
//! become free then.

use pulp::Simd;

use super::Solver;
use super::lanes::{InOrder, LANES, Lanes, Mask, Pass, REST, over_rows, split, split_mut, sum_by};
use crate::fft::Row;

/// Ratio of the number of nodes predicted to come into contact to the expected increase of the
/// number in contact.
const EXCESS: f64 = 1.1;

impl Solver {
    /// Returns the criterion that selects the nodes expected to come into contact under the next
    /// load.
    ///
    /// `reach` is the ratio of the next increment of the load to the last one. Returns `None` if
    /// the contact does not grow, or if fewer nodes than expected penetrate after extrapolation.
    pub(super) fn nearing(&mut self, reach: f64) -> Option<Nearing> {
        let grown = self.contact_nodes - self.earlier_contact_nodes;
        if !(reach > 0.0 && grown > 0.0) {
            return None;
        }
        let penetrate = Nearing {
            part: (reach / (1.0 + reach)) as f32,
            offset: self.offset as f32,
            earlier_offset: self.earlier_offset as f32,
        };
        let mut pass = CountNearing::new(penetrate, &self.inner.gap, &self.earlier_gap);
        over_rows(&self.inner.threads, &mut self.pressure, self.inner.nodes[1], &mut pass);
        pass.first(EXCESS * reach * grown)
    }
}

const BINS: usize = 256;

/// Criterion g₁ < `part` × g₂ for nodes close to contact. g₁ and g₂ are the gaps, minus their
/// offsets, under the last load and the load before it.
#[derive(Debug, Clone, Copy)]
pub struct Nearing {
    pub part: f32,
    pub offset: f32,
    pub earlier_offset: f32,
}

impl Nearing {
    #[inline(always)]
    pub fn is_near<S: Simd, const R: usize>(
        self,
        gap: Lanes<S, R>,
        earlier: Lanes<S, R>,
    ) -> Mask<S, R> {
        let above = gap - gap.like(self.offset);
        let before = earlier - gap.like(self.earlier_offset);
        above.is_below(gap.like(self.part) * before)
    }
}

/// Histogram of the ratio g₁/g₂ of the gaps under the last load and the load before it, over nodes
/// without pressure.
///
/// It counts nodes as a [`Pass`] over pressures.
pub struct CountNearing<'a> {
    /// Criterion that all counted nodes satisfy; its `part` is the upper end of the histogram.
    nearing: Nearing,
    gap: &'a [f32],
    earlier_gap: &'a [f32],
    counts: [u32; BINS],
}

impl<'a> CountNearing<'a> {
    pub fn new(nearing: Nearing, gap: &'a [f32], earlier_gap: &'a [f32]) -> Self {
        Self { nearing, gap, earlier_gap, counts: [0; BINS] }
    }

    /// Returns the criterion that selects the `nodes` nodes with the smallest ratios, rounded up to
    /// a whole bin, or `None` if the histogram has fewer nodes.
    pub fn first(&self, nodes: f64) -> Option<Nearing> {
        let mut counted = 0.0;
        let bin = self.counts.iter().position(|count| {
            counted += f64::from(*count);
            counted >= nodes
        })?;
        Some(Nearing { part: self.nearing.part * (bin + 1) as f32 / BINS as f32, ..self.nearing })
    }

    #[inline(always)]
    fn count(&mut self, pressure: f64, gap: f32, earlier: f32) {
        let above = gap - self.nearing.offset;
        let farthest = self.nearing.part * (earlier - self.nearing.earlier_offset);
        if pressure == 0.0 && above < farthest {
            // Nodes that penetrate by rounding fall into the first bin.
            let bin = (above / farthest * BINS as f32) as usize;
            self.counts[bin.min(BINS - 1)] += 1;
        }
    }
}

impl Pass<f64> for CountNearing<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, pressure: &mut [f64]) {
        let (gap, earlier) = (row.of(self.gap), row.of(self.earlier_gap));
        let (gaps, last) = split::<S, R>(gap);
        let groups = gaps.iter().zip(split::<S, R>(earlier).0);
        for (group, (g, e)) in groups.enumerate() {
            let near = self.nearing.is_near(Lanes::of(simd, *g), Lanes::of(simd, *e));
            if !near.any() {
                continue;
            }
            let first = group * LANES;
            for node in first..first + LANES {
                self.count(pressure[node], gap[node], earlier[node]);
            }
        }
        for node in gap.len() - last.len()..gap.len() {
            self.count(pressure[node], gap[node], earlier[node]);
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

/// Pass over pressures that adds up the gaps of nodes with pressure.
pub struct SumInContact<'a> {
    pub gap: &'a [f32],
    pub sum: InOrder<f64>,
}

impl Pass<f64> for SumInContact<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        self.sum.push(sum_by(pressure, row.of(self.gap), |p, gap| {
            if p > 0.0 { f64::from(gap) } else { 0.0 }
        }));
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { sum: InOrder::new(), ..*self }
    }

    fn append(&mut self, later: Self) {
        self.sum.append(later.sum);
    }
}

/// Nodes without pressure that may be free in the first iteration. Other nodes without pressure are
/// treated as open.
#[derive(Clone, Copy, Default)]
pub enum Expected {
    #[default]
    All,
    /// Nodes close to contact by this criterion.
    Near(Nearing),
    /// Nodes with at least this height above the height that is subtracted in single precision.
    AsHighAs(f32),
}

/// Lower limits of the gaps in a row. A limit at the offset keeps a node from penetrating, and
/// therefore from being free.
#[derive(Clone)]
pub struct LimitedGap(Vec<f32>);

impl LimitedGap {
    pub fn new(row_nodes: usize) -> Self {
        Self(vec![0.0; row_nodes])
    }

    /// Sets the lower limit of the gap to `level` at nodes that are not close to contact by the
    /// criterion `nearing`, and removes it at others.
    ///
    /// `gap` and `earlier` are the gaps under the last load and the load before it.
    #[inline(always)]
    pub fn hold_far<S: Simd, const R: usize>(
        &mut self,
        simd: S,
        level: f32,
        nearing: Nearing,
        gap: &[f32],
        earlier: &[f32],
    ) {
        let (held, last_held) = split_mut::<S, R>(&mut self.0);
        let (gap, last_gap) = split::<S, R>(gap);
        let (earlier, last_earlier) = split::<S, R>(earlier);
        hold_far(simd, level, nearing, held, gap, earlier);
        hold_far(REST, level, nearing, last_held, last_gap, last_earlier);
    }

    /// Sets the lower limit of the gap to `level` at nodes with heights below `lowest`, and removes
    /// it at others.
    #[inline(always)]
    pub fn hold_low<S: Simd, const R: usize>(
        &mut self,
        simd: S,
        level: f32,
        lowest: f32,
        heights: &[f32],
    ) {
        let (held, last_held) = split_mut::<S, R>(&mut self.0);
        let (heights, last_heights) = split::<S, R>(heights);
        hold_low(simd, level, lowest, held, heights);
        hold_low(REST, level, lowest, last_held, last_heights);
    }

    /// Returns max(gap, lower limit) of each node, stored in place of the limits.
    #[inline(always)]
    pub fn of<S: Simd, const R: usize>(&mut self, simd: S, gap: &[f32]) -> &[f32] {
        let (held, last_held) = split_mut::<S, R>(&mut self.0);
        let (gap, last_gap) = split::<S, R>(gap);
        raise(simd, held, gap);
        raise(REST, last_held, last_gap);
        &self.0
    }
}

#[inline(always)]
fn hold_far<S: Simd, const R: usize>(
    simd: S,
    level: f32,
    nearing: Nearing,
    held: &mut [[S::f32s; R]],
    gap: &[[S::f32s; R]],
    earlier: &[[S::f32s; R]],
) {
    let level = Lanes::all(simd, level);
    for ((held, gap), earlier) in held.iter_mut().zip(gap).zip(earlier) {
        let near = nearing.is_near(Lanes::of(simd, *gap), Lanes::of(simd, *earlier));
        *held = near.choose(Lanes::all(simd, f32::MIN), level).numbers();
    }
}

#[inline(always)]
fn hold_low<S: Simd, const R: usize>(
    simd: S,
    level: f32,
    lowest: f32,
    held: &mut [[S::f32s; R]],
    heights: &[[S::f32s; R]],
) {
    let level = Lanes::all(simd, level);
    for (held, height) in held.iter_mut().zip(heights) {
        let low = Lanes::of(simd, *height).is_below(Lanes::all(simd, lowest));
        *held = low.choose(level, Lanes::all(simd, f32::MIN)).numbers();
    }
}

#[inline(always)]
fn raise<S: Simd, const R: usize>(simd: S, held: &mut [[S::f32s; R]], gap: &[[S::f32s; R]]) {
    for (held, gap) in held.iter_mut().zip(gap) {
        let gap = Lanes::of(simd, *gap);
        *held = Lanes::of(simd, *held).max(gap).numbers();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::PeriodicHalfSpace;
    use crate::grid::samples::square;
    use crate::solver::Settings;
    use crate::topography::random::samples;

    fn solver() -> Solver {
        let surface = samples::random(2, 16, 11);
        let grid = square(128, 1.0);
        let surface = surface.draw(grid);
        Solver::new(PeriodicHalfSpace::new(grid), surface.heights())
    }

    fn contact(solver: &Solver) -> Vec<bool> {
        solver.pressure().iter().map(|p| *p > 0.0).collect()
    }

    /// Returns, for each node, whether it has no pressure and is close to contact by the criterion
    /// `nearing`.
    fn near(solver: &Solver, nearing: Nearing) -> Vec<bool> {
        let nodes = solver.inner.gap.iter().zip(&solver.earlier_gap);
        let nodes = nodes.zip(solver.pressure());
        nodes
            .map(|((gap, earlier), p)| {
                let before = earlier - nearing.earlier_offset;
                *p == 0.0 && gap - nearing.offset < nearing.part * before
            })
            .collect()
    }

    fn count(nodes: impl Iterator<Item = bool>) -> f64 {
        nodes.filter(|counts| *counts).count() as f64
    }

    #[test]
    fn most_nodes_that_come_into_contact_are_predicted_and_few_others() {
        // The second load is predicted from the first alone, the third from both.
        let mut solver = solver();
        let press = |solver: &mut Solver, load| {
            solver.press(load, &Settings::default(), &|| false);
        };
        press(&mut solver, 0.02);
        for load in [0.04, 0.06] {
            let nearing = solver.nearing(1.0).expect("the contact grows");
            let expected = near(&solver, nearing);
            let penetrate = Nearing { part: 0.5, ..nearing };
            let seem = near(&solver, penetrate);
            let before = contact(&solver);
            press(&mut solver, load);
            let come: Vec<bool> =
                contact(&solver).iter().zip(&before).map(|(now, before)| *now && !before).collect();
            let both = |some: &[bool]| count(come.iter().zip(some).map(|(a, b)| *a && *b));
            let all = |some: &[bool]| count(some.iter().copied());
            assert!(both(&expected) > 0.8 * all(&come), "{load}");
            let [others, other_seem] = [&expected, &seem].map(|some| all(some) - both(some));
            assert!(others < 0.5 * other_seem, "{load}: {others}, {other_seem}");
        }
    }

    #[test]
    fn none_are_expected_where_the_load_falls() {
        let mut solver = solver();
        for load in [0.06, 0.04] {
            solver.press(load, &Settings::default(), &|| false);
        }
        assert!(solver.nearing(0.5).is_none());
    }
}
