//! The lowest and the highest number of a map.

use pulp::Simd;

use super::lanes::{LANES, Pass, greater, less, over_rows};
use crate::fft::Row;
use crate::threads::Threads;

/// The lowest and the highest number of a map with rows of so many.
pub fn range(threads: &Threads, map: &mut [f64], row_nodes: usize) -> [f64; 2] {
    let mut seen = RangeSoFar::NONE;
    over_rows(threads, map, row_nodes, &mut seen);
    seen.found()
}

/// What was lowest and highest so far, lane by lane.
#[derive(Clone, Copy)]
pub struct RangeSoFar {
    lowest: [f64; LANES],
    highest: [f64; LANES],
}

impl RangeSoFar {
    pub const NONE: Self =
        Self { lowest: [f64::INFINITY; LANES], highest: [f64::NEG_INFINITY; LANES] };

    #[inline(always)]
    pub fn see(&mut self, row: &[f64]) {
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
        self.see(numbers);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self::NONE
    }

    fn append(&mut self, later: Self) {
        self.join(later);
    }
}
