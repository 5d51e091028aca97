//! Heights as a solver keeps them: of zero mean, in both precisions.

use pulp::Simd;

use super::in_order::InOrder;
use super::lanes::{LANES, Pass, greater, less, over_rows, total};
use crate::contact::fft::{Band, Row};
use crate::contact::threads::Threads;

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
        let mut copy = CopyAndSum {
            heights,
            sum: InOrder::new(),
        };
        over_rows(threads, &mut own, row_nodes, &mut copy);
        let mut centre = Centre {
            mean: copy.sum.total() / cells as f64,
            single_heights: Band::of(&mut single_heights),
            seen: Extremes::NONE,
        };
        over_rows(threads, &mut own, row_nodes, &mut centre);
        let [lowest, highest] = centre.seen.found();
        Self {
            heights: own,
            single_heights,
            lowest,
            highest,
        }
    }
}

/// The lowest and the highest number of a map with rows of so many.
pub fn extremes(threads: &Threads, map: &mut [f64], row_nodes: usize) -> [f64; 2] {
    let mut seen = Extremes::NONE;
    over_rows(threads, map, row_nodes, &mut seen);
    seen.found()
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
        Self {
            sum: InOrder::new(),
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.sum.append(later.sum);
    }
}

struct Centre<'a> {
    mean: f64,
    single_heights: Band<'a, f32>,
    seen: Extremes,
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
        Self {
            single_heights: self.single_heights.split_off(row),
            seen: Extremes::NONE,
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.seen.join(later.seen);
    }
}

/// Lane by lane.
#[derive(Clone, Copy)]
struct Extremes {
    lowest: [f64; LANES],
    highest: [f64; LANES],
}

impl Extremes {
    const NONE: Self = Self {
        lowest: [f64::INFINITY; LANES],
        highest: [f64::NEG_INFINITY; LANES],
    };

    #[inline(always)]
    fn see(&mut self, row: &[f64]) {
        for chunk in row.chunks(LANES) {
            let seen = self.lowest.iter_mut().zip(&mut self.highest);
            for ((lowest, highest), number) in seen.zip(chunk) {
                *lowest = less(*lowest, *number);
                *highest = greater(*highest, *number);
            }
        }
    }

    fn join(&mut self, later: Self) {
        for (lowest, later) in self.lowest.iter_mut().zip(later.lowest) {
            *lowest = less(*lowest, later);
        }
        for (highest, later) in self.highest.iter_mut().zip(later.highest) {
            *highest = greater(*highest, later);
        }
    }

    fn found(self) -> [f64; 2] {
        [
            self.lowest.into_iter().fold(f64::INFINITY, less),
            self.highest.into_iter().fold(f64::NEG_INFINITY, greater),
        ]
    }
}

impl Pass<f64> for Extremes {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, _: Row, numbers: &mut [f64]) {
        self.see(numbers);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self::NONE
    }

    fn append(&mut self, later: Self) {
        self.join(later);
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use super::*;

    #[test]
    fn heights_are_centred_and_their_extremes_known_whoever_shares_the_work() {
        // Rows of some groups and a rest, enough nodes for several threads.
        let (rows, row_nodes) = (600, 1000);
        let bump = |node: usize| 3.0 + (node as f64).sin();
        let given: Vec<f64> = (0..rows * row_nodes).map(bump).collect();
        let three = Threads::new(NonZeroUsize::new(3).unwrap()).unwrap();
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
        assert_eq!(extremes(&three, &mut heights, row_nodes), [lowest, highest]);
        assert!((highest - lowest - 2.0).abs() < 1e-6);
        let mut single = heights.iter().zip(&shared.single_heights);
        assert!(single.all(|(height, single)| *height as f32 == *single));
    }
}
