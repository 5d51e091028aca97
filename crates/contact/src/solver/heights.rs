//! Heights of zero mean in both precisions, their range and their histograms.

use pulp::Simd;

use super::lanes::{InOrder, LANES, Pass, greater, less, over_rows, total};
use crate::fft::Row;
use crate::threads::Threads;

pub struct CentredHeights {
    pub heights: Vec<f64>,
    /// Heights minus the highest.
    pub single_heights: Vec<f32>,
    pub lowest: f64,
    pub highest: f64,
}

impl CentredHeights {
    pub fn new(threads: &Threads, heights: &[f64], row_nodes: usize) -> Self {
        let cells = heights.len();
        let (mut own, mut single_heights) = (vec![0.0; cells], vec![0.0; cells]);
        let mut copy = CopyAndSum { heights, sum: InOrder::new() };
        over_rows(threads, &mut own, row_nodes, &mut copy);
        let mean = copy.sum.total() / cells as f64;
        let mut centre = Centre { mean, seen: RangeSoFar::NONE };
        over_rows(threads, &mut own, row_nodes, &mut centre);
        let [lowest, highest] = centre.seen.found();
        let mut round = BelowHighest { highest, heights: &own };
        over_rows(threads, &mut single_heights, row_nodes, &mut round);
        Self { heights: own, single_heights, lowest, highest }
    }
}

struct CopyAndSum<'a> {
    heights: &'a [f64],
    sum: InOrder<f64>,
}

impl Pass<f64> for CopyAndSum<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, own: &mut [f64]) {
        own.copy_from_slice(row.of(self.heights));
        self.sum.push(total(own));
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { sum: InOrder::new(), ..*self }
    }

    fn append(&mut self, later: Self) {
        self.sum.append(later.sum);
    }
}

struct Centre {
    mean: f64,
    seen: RangeSoFar,
}

impl Pass<f64> for Centre {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, _: Row, own: &mut [f64]) {
        for height in &mut *own {
            *height -= self.mean;
        }
        self.seen.visit(own);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { seen: RangeSoFar::NONE, ..*self }
    }

    fn append(&mut self, later: Self) {
        self.seen.join(later.seen);
    }
}

pub fn range(threads: &Threads, map: &mut [f64], row_nodes: usize) -> [f64; 2] {
    let mut seen = RangeSoFar::NONE;
    over_rows(threads, map, row_nodes, &mut seen);
    seen.found()
}

#[derive(Clone, Copy)]
pub struct RangeSoFar {
    lowest: [f64; LANES],
    highest: [f64; LANES],
}

impl RangeSoFar {
    pub const NONE: Self =
        Self { lowest: [f64::INFINITY; LANES], highest: [f64::NEG_INFINITY; LANES] };

    #[inline(always)]
    pub fn visit(&mut self, row: &[f64]) {
        for chunk in row.chunks(LANES) {
            let seen = self.lowest.iter_mut().zip(&mut self.highest);
            for ((lowest, highest), number) in seen.zip(chunk) {
                *lowest = less(*lowest, *number);
                *highest = greater(*highest, *number);
            }
        }
    }

    pub fn join(&mut self, later: Self) {
        for (lowest, later) in self.lowest.iter_mut().zip(later.lowest) {
            *lowest = less(*lowest, later);
        }
        for (highest, later) in self.highest.iter_mut().zip(later.highest) {
            *highest = greater(*highest, later);
        }
    }

    pub fn found(self) -> [f64; 2] {
        [
            self.lowest.into_iter().fold(f64::INFINITY, less),
            self.highest.into_iter().fold(f64::NEG_INFINITY, greater),
        ]
    }
}

impl Pass<f64> for RangeSoFar {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, _: Row, numbers: &mut [f64]) {
        self.visit(numbers);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self::NONE
    }

    fn append(&mut self, later: Self) {
        self.join(later);
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

/// Pass over heights in single precision that sets them to `heights` − `highest`.
struct BelowHighest<'a> {
    highest: f64,
    heights: &'a [f64],
}

impl Pass<f32> for BelowHighest<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, single: &mut [f32]) {
        for (single, height) in single.iter_mut().zip(row.of(self.heights)) {
            *single = (height - self.highest) as f32;
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use super::{range, *};

    #[test]
    fn heights_are_centred_and_their_range_is_found_on_any_threads() {
        // Rows of whole groups and some further nodes, with enough nodes for several threads.
        let (rows, row_nodes) = (600, 1000);
        let bump = |node: usize| 3.0 + (node as f64).sin();
        let given: Vec<f64> = (0..rows * row_nodes).map(bump).collect();
        let three = Threads::new(NonZeroUsize::new(3).unwrap());
        let [alone, shared] = [Threads::one(), three.clone()]
            .map(|threads| CentredHeights::new(&threads, &given, row_nodes));
        assert_eq!(alone.heights, shared.heights);
        assert_eq!(alone.single_heights, shared.single_heights);

        let mut heights = shared.heights;
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        // Bound on the sum of all rounding errors.
        assert!(mean.abs() < heights.len() as f64 * f64::EPSILON, "{mean}");
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert_eq!([shared.lowest, shared.highest], [lowest, highest]);
        assert_eq!(range(&three, &mut heights, row_nodes), [lowest, highest]);
        assert!((highest - lowest - 2.0).abs() < 1e-6);
        let mut single = heights.iter().zip(&shared.single_heights);
        assert!(single.all(|(height, single)| (height - highest) as f32 == *single));
    }
}
