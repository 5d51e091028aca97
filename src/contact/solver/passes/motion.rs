//! From direction to the pressure and the gap where it leads.

use super::super::lanes::{dot, sum_by};
use super::super::survey::Survey;
use super::evaluate::Tally;
use crate::contact::fft::Rows;

/// How far a direction is followed.
#[derive(Clone, Copy)]
pub struct Step {
    pub length: f64,
    /// Brings the clipped pressures back to their mean.
    pub scale: f64,
}

impl Step {
    /// Moves a row of pressures, and turns its directions into moves.
    #[inline(always)]
    fn take(self, pressure: &mut [f64], active: &mut [bool], direction: &mut [f32]) {
        for (p, d) in pressure.iter_mut().zip(direction) {
            let next = (*p + self.length * f64::from(*d)).max(0.0) * self.scale;
            *d = (next - *p) as f32;
            *p = next;
        }
        for (active, p) in active.iter_mut().zip(pressure) {
            *active = *p > 0.0;
        }
    }
}

/// What the energy does along a move.
#[derive(Default, Clone, Copy)]
pub struct Course {
    /// Σ move × displacement under it.
    pub curvature: f64,
    /// Σ move × (gap before it − level).
    pub slope: f64,
}

impl Course {
    #[inline(always)]
    fn add(&mut self, last_move: &[f32], image: &[f32], gap_before: &[f32], level: f32) {
        self.curvature += dot(last_move, image);
        self.slope += sum_by(last_move, gap_before, |d, gap| d * (gap - level));
    }
}

/// A move along a direction that leaves no pressure below zero, and the gap after it.
pub struct Move<'a> {
    pub step: Step,
    /// The level of the gap before the move.
    pub level: f32,
    pub pressure: &'a mut [f64],
    /// Set to where there is pressure.
    pub active: &'a mut [bool],
    /// The direction, turned into the move.
    pub direction: &'a mut [f32],
    /// Set to the displacement under the move.
    pub image: &'a mut [f32],
    pub gap: &'a mut [f32],
    pub course: Course,
}

/// A move whose displacement updates the gap, in single precision.
pub struct Glide<'a> {
    pub motion: Move<'a>,
    pub survey: Survey<f32>,
}

impl Rows<f32> for Glide<'_> {
    #[inline(always)]
    fn fill(&mut self, row: usize, values: &mut [f32]) {
        let range = row * values.len()..(row + 1) * values.len();
        let motion = &mut self.motion;
        let direction = &mut motion.direction[range.clone()];
        motion.step.take(
            &mut motion.pressure[range.clone()],
            &mut motion.active[range],
            direction,
        );
        values.copy_from_slice(direction);
    }

    #[inline(always)]
    fn take(&mut self, row: usize, values: &mut [f32]) {
        let range = row * values.len()..(row + 1) * values.len();
        let motion = &mut self.motion;
        let image = &mut motion.image[range.clone()];
        let gap = &mut motion.gap[range.clone()];
        image.copy_from_slice(values);
        let direction = &motion.direction[range.clone()];
        motion.course.add(direction, image, gap, motion.level);
        for (gap, image) in gap.iter_mut().zip(image) {
            *gap += *image;
        }
        self.survey.add(&motion.active[range], gap);
    }
}

/// A move after which the gap is evaluated anew, in double precision.
pub struct Land<'a> {
    pub motion: Move<'a>,
    pub heights: &'a [f64],
    /// Subtracted from the gap before it is rounded to single precision.
    pub datum: f64,
    pub tally: Tally,
}

impl Rows<f64> for Land<'_> {
    #[inline(always)]
    fn fill(&mut self, row: usize, values: &mut [f64]) {
        let range = row * values.len()..(row + 1) * values.len();
        let motion = &mut self.motion;
        let pressure = &mut motion.pressure[range.clone()];
        motion.step.take(
            pressure,
            &mut motion.active[range.clone()],
            &mut motion.direction[range],
        );
        values.copy_from_slice(pressure);
    }

    #[inline(always)]
    fn take(&mut self, row: usize, values: &mut [f64]) {
        let range = row * values.len()..(row + 1) * values.len();
        let motion = &mut self.motion;
        self.tally.add(
            &motion.active[range.clone()],
            &motion.pressure[range.clone()],
            &self.heights[range.clone()],
            self.datum,
            values,
        );
        let image = &mut motion.image[range.clone()];
        let gap = &mut motion.gap[range.clone()];
        for ((image, value), gap) in image.iter_mut().zip(&*values).zip(&*gap) {
            *image = (value - f64::from(*gap)) as f32;
        }
        let direction = &motion.direction[range];
        motion.course.add(direction, image, gap, motion.level);
        for (gap, value) in gap.iter_mut().zip(values) {
            *gap = *value as f32;
        }
    }
}

/// Takes a part of a move back.
pub struct Retreat<'a> {
    pub part: f64,
    pub pressure: &'a mut [f64],
    /// Set to where there is pressure.
    pub active: &'a mut [bool],
    pub gap: &'a mut [f32],
    pub last_move: &'a [f32],
    /// Displacement under the last move.
    pub image: &'a [f32],
}

impl Retreat<'_> {
    pub fn survey(self) -> Survey<f32> {
        for ((p, active), d) in self
            .pressure
            .iter_mut()
            .zip(&mut *self.active)
            .zip(self.last_move)
        {
            // Rounding of the move must not leave a pressure below zero.
            *p = (*p - self.part * f64::from(*d)).max(0.0);
            *active = *p > 0.0;
        }
        for (gap, image) in self.gap.iter_mut().zip(self.image) {
            *gap -= self.part as f32 * image;
        }
        let mut survey = Survey::new();
        survey.add(self.active, self.gap);
        survey
    }
}
