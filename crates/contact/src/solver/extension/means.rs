//! Means of the smallest blocks, and what belongs to them handed back: what a stiffness between blocks works
//! with.

use pulp::Simd;

use super::super::lanes::{Pass, over_rows};
use super::{Extension, Level, SIDE};
use crate::fft::{Band, Row};
use crate::threads::Threads;

/// Nodes of a whole block. Those that a block at an end of the mesh lacks count as not free.
const AREA: f32 = (SIDE * SIDE) as f32;

impl Extension {
    /// The smallest blocks along x and y.
    pub fn blocks(&self) -> [usize; 2] {
        self.levels[0].blocks
    }

    /// Makes of all rows that were asked for the means of the blocks, whose other nodes are continued, and sets
    /// `sums` to those over free nodes.
    pub fn extend_means<'a>(&'a mut self, threads: &Threads, sums: &'a mut [f32]) -> Means<'a> {
        self.forget_beyond_map();
        sums.copy_from_slice(&self.levels[0].values);
        self.extend(threads);
        Means { smallest: &self.levels[0], sums }
    }

    /// Rows of what the means of blocks are asked for. To be given to free nodes, by `sums`, is what their
    /// mean is asked for less `stiffness` times that mean.
    pub fn taken_means<'a>(&'a mut self, stiffness: f32, sums: &'a mut [f32]) -> TakenMeans<'a> {
        let smallest = &mut self.levels[0];
        TakenMeans {
            stiffness,
            free: &smallest.free,
            for_others: Band::of(&mut smallest.values),
            given: Band::of(sums),
        }
    }

    /// Makes of all rows that were taken what is to be handed back, with what is to be given besides: the
    /// transpose of [`Extension::extend_means`].
    pub fn collect_means(&mut self, threads: &Threads, given: &[f32]) {
        self.hand_down(threads);
        let smallest = &mut self.levels[0];
        over_rows(threads, &mut smallest.values, smallest.blocks[1], &mut Add(given));
    }
}

/// Means of blocks, row by row.
pub struct Means<'a> {
    smallest: &'a Level,
    /// Over free nodes.
    sums: &'a [f32],
}

impl Pass<f32> for Means<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, means: &mut [f32]) {
        let (free, continued) = (row.of(&self.smallest.free), row.of(&self.smallest.values));
        let nodes = free.iter().zip(continued);
        for ((mean, sum), (free, continued)) in means.iter_mut().zip(row.of(self.sums)).zip(nodes) {
            *mean = (sum + (AREA - free) * continued) / AREA;
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}

/// What means of blocks are asked for, row by row.
pub struct TakenMeans<'a> {
    stiffness: f32,
    free: &'a [f32],
    for_others: Band<'a, f32>,
    /// Sums over free nodes before.
    given: Band<'a, f32>,
}

impl Pass<f32> for TakenMeans<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, asked: &mut [f32]) {
        let blocks = self.for_others.row(row).iter_mut().zip(self.given.row(row));
        let nodes = asked.iter().zip(row.of(self.free));
        for ((for_others, given), (asked, free)) in blocks.zip(nodes) {
            *for_others = (AREA - free) * asked;
            // A sum over no node is zero.
            *given = asked - self.stiffness * *given / free.max(1.0);
        }
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self {
            for_others: self.for_others.split_off(row),
            given: self.given.split_off(row),
            ..*self
        }
    }

    fn append(&mut self, _: Self) {}
}

/// Adds a map.
struct Add<'a>(&'a [f32]);

impl Pass<f32> for Add<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        for (value, added) in values.iter_mut().zip(row.of(self.0)) {
            *value += added;
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self(self.0)
    }

    fn append(&mut self, _: Self) {}
}
