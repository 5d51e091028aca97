//! From pressure to gap, in double precision.

use super::super::lanes::{dot, total};
use super::super::survey::Survey;
use crate::contact::fft::Rows;

/// From pressure to gap and energy, in double precision.
pub struct Evaluate<'a> {
    pub heights: &'a [f64],
    pub pressure: &'a [f64],
    /// Subtracted from the gap before it is rounded to single precision.
    pub datum: f64,
    pub gap: &'a mut [f32],
    /// Set to where there is pressure.
    pub active: &'a mut [bool],
    pub tally: Tally,
}

/// What only double precision tells, in the making.
pub struct Tally {
    pub survey: Survey<f64>,
    /// Σ (gap − datum).
    pub gap_sum: f64,
    /// Σ pressure × displacement.
    pub work: f64,
}

impl Tally {
    pub fn new() -> Self {
        Self {
            survey: Survey::new(),
            gap_sum: 0.0,
            work: 0.0,
        }
    }

    /// Adds a row, and turns its displacements into gaps less the datum.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        active: &[bool],
        pressure: &[f64],
        heights: &[f64],
        datum: f64,
        values: &mut [f64],
    ) {
        self.work += dot(pressure, values);
        for (value, height) in values.iter_mut().zip(heights) {
            *value -= height + datum;
        }
        self.gap_sum += total(values);
        self.survey.add(active, values);
    }
}

impl Rows<f64> for Evaluate<'_> {
    #[inline(always)]
    fn fill(&mut self, row: usize, values: &mut [f64]) {
        let range = row * values.len()..(row + 1) * values.len();
        let pressure = &self.pressure[range.clone()];
        let active = &mut self.active[range.clone()];
        for (active, p) in active.iter_mut().zip(pressure) {
            *active = *p > 0.0;
        }
        values.copy_from_slice(pressure);
    }

    #[inline(always)]
    fn take(&mut self, row: usize, values: &mut [f64]) {
        let range = row * values.len()..(row + 1) * values.len();
        let pressure = &self.pressure[range.clone()];
        let heights = &self.heights[range.clone()];
        let gap = &mut self.gap[range.clone()];
        let active = &self.active[range.clone()];

        self.tally
            .add(active, pressure, heights, self.datum, values);
        for (gap, value) in gap.iter_mut().zip(&*values) {
            *gap = *value as f32;
        }
    }
}
