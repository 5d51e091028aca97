//! What heights alone tell, before anything is pressed.

use pulp::Simd;

use super::super::lanes::Pass;
use crate::fft::{Band, Row};

/// Heights that are told apart between two levels.
const BINS: usize = 1024;

/// Counts nodes by their height, from the higher level down. Goes over pressures.
pub struct CountHeights<'a> {
    heights: &'a [f64],
    low: f64,
    high: f64,
    counts: [u32; BINS],
}

/// The highest nodes, down to two levels close to each other.
#[derive(Debug, Clone, Copy)]
pub struct Highest {
    /// Nodes above the higher level.
    pub above: f64,
    pub low: f64,
    pub high: f64,
}

impl<'a> CountHeights<'a> {
    /// Of nodes above one level, and up to the other.
    pub fn between(low: f64, high: f64, heights: &'a [f64]) -> Self {
        Self { heights, low, high, counts: [0; BINS] }
    }

    /// The levels between which there come to be so many nodes, `above` of which are not counted here.
    pub fn highest(&self, mut above: f64, nodes: f64) -> Highest {
        let bin = self.counts.iter().position(|count| {
            above += f64::from(*count);
            above >= nodes
        });
        let bin = bin.unwrap_or(BINS - 1);
        let width = self.width();
        Highest {
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

    /// Counts are whole numbers, which come to the same in any order.
    fn append(&mut self, later: Self) {
        for (count, later) in self.counts.iter_mut().zip(later.counts) {
            *count += later;
        }
    }
}

/// Sets pressures like those of Hertz' contacts, which grow with the square root of the height.
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

/// Sets the earlier gap and pressure to those of a surface that nothing touches but at its highest node.
/// Goes over gaps.
pub struct Untouched<'a> {
    pub highest: f64,
    pub heights: &'a [f64],
    pub earlier_pressure: Band<'a, f32>,
}

impl Pass<f32> for Untouched<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, gap: &mut [f32]) {
        self.earlier_pressure.row(row).fill(0.0);
        for (gap, height) in gap.iter_mut().zip(row.of(self.heights)) {
            *gap = (self.highest - height) as f32;
        }
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { earlier_pressure: self.earlier_pressure.split_off(row), ..*self }
    }

    fn append(&mut self, _: Self) {}
}

/// Sets heights in single precision, counted from a level.
pub struct CountedFrom<'a> {
    pub level: f64,
    pub heights: &'a [f64],
}

impl Pass<f32> for CountedFrom<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, single: &mut [f32]) {
        for (single, height) in single.iter_mut().zip(row.of(self.heights)) {
            *single = (height - self.level) as f32;
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}
