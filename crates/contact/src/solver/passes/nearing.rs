//! How fast gaps close from load to load.

use pulp::Simd;

use super::super::in_order::InOrder;
use super::super::lanes::{Choice, LANES, Lanes, Pass, split, sum_by};
use crate::fft::Row;

/// Parts that are told apart.
const BINS: usize = 256;

/// Nodes whose gap is less than a part of what it was under the load before.
#[derive(Debug, Clone, Copy)]
pub struct Nearing {
    pub part: f32,
    /// Levels from which gaps are measured under the last load,
    pub offset: f32,
    /// and under the one before.
    pub earlier_offset: f32,
}

impl Nearing {
    #[inline(always)]
    pub fn is_near<S: Simd, const R: usize>(
        self,
        gap: Lanes<S, R>,
        earlier: Lanes<S, R>,
    ) -> Choice<S, R> {
        let above = gap - gap.like(self.offset);
        let before = earlier - gap.like(self.earlier_offset);
        above.is_below(gap.like(self.part) * before)
    }
}

/// Counts nodes without pressure that are near by how near they are. Goes over pressures.
pub struct CountNearing<'a> {
    /// The farthest.
    nearing: Nearing,
    gap: &'a [f32],
    earlier_gap: &'a [f32],
    counts: [u32; BINS],
}

impl<'a> CountNearing<'a> {
    pub fn new(nearing: Nearing, gap: &'a [f32], earlier_gap: &'a [f32]) -> Self {
        Self { nearing, gap, earlier_gap, counts: [0; BINS] }
    }

    /// The nearest so many nodes, to a part in so many as are told apart; none if there are fewer.
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
            // What penetrates by rounding is nearest.
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

    /// Counts are whole numbers, which come to the same in any order.
    fn append(&mut self, later: Self) {
        for (count, later) in self.counts.iter_mut().zip(later.counts) {
            *count += later;
        }
    }
}

/// Adds up gaps where there is pressure. Goes over pressures.
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
