//! Heights as a solver keeps them: of zero mean, in both precisions.

use pulp::Simd;

use super::in_order::InOrder;
use super::lanes::{Pass, over_rows, total};
use super::range::RangeSoFar;
use crate::fft::{Band, Row};
use crate::threads::Threads;

/// Heights of zero mean.
pub struct CentredHeights {
    pub heights: Vec<f64>,
    pub single_heights: Vec<f32>,
    pub lowest: f64,
    pub highest: f64,
}

impl CentredHeights {
    /// Of heights in rows of so many.
    pub fn of(threads: &Threads, heights: &[f64], row_nodes: usize) -> Self {
        let cells = heights.len();
        let (mut own, mut single_heights) = (vec![0.0; cells], vec![0.0; cells]);
        let mut copy = CopyAndSum { heights, sum: InOrder::new() };
        over_rows(threads, &mut own, row_nodes, &mut copy);
        let mut centre = Centre {
            mean: copy.sum.total() / cells as f64,
            single_heights: Band::of(&mut single_heights),
            seen: RangeSoFar::NONE,
        };
        over_rows(threads, &mut own, row_nodes, &mut centre);
        let [lowest, highest] = centre.seen.found();
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

struct Centre<'a> {
    mean: f64,
    single_heights: Band<'a, f32>,
    seen: RangeSoFar,
}

impl Pass<f64> for Centre<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, own: &mut [f64]) {
        for (height, single) in own.iter_mut().zip(self.single_heights.row(row)) {
            *height -= self.mean;
            *single = *height as f32;
        }
        self.seen.see(own);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { single_heights: self.single_heights.split_off(row), seen: RangeSoFar::NONE, ..*self }
    }

    fn append(&mut self, later: Self) {
        self.seen.join(later.seen);
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use super::super::range::range;
    use super::*;

    #[test]
    fn heights_are_centred_and_their_range_known_whoever_shares_the_work() {
        // Rows of some groups and a rest, enough nodes for several threads.
        let (rows, row_nodes) = (600, 1000);
        let bump = |node: usize| 3.0 + (node as f64).sin();
        let given: Vec<f64> = (0..rows * row_nodes).map(bump).collect();
        let three = Threads::new(NonZeroUsize::new(3).unwrap());
        let [alone, shared] = [Threads::one(), three.clone()]
            .map(|threads| CentredHeights::of(&threads, &given, row_nodes));
        assert_eq!(alone.heights, shared.heights);
        assert_eq!(alone.single_heights, shared.single_heights);

        let mut heights = shared.heights;
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        // As far as so many roundings may add up.
        assert!(mean.abs() < heights.len() as f64 * f64::EPSILON, "{mean}");
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert_eq!([shared.lowest, shared.highest], [lowest, highest]);
        assert_eq!(range(&three, &mut heights, row_nodes), [lowest, highest]);
        assert!((highest - lowest - 2.0).abs() < 1e-6);
        let mut single = heights.iter().zip(&shared.single_heights);
        assert!(single.all(|(height, single)| *height as f32 == *single));
    }
}
