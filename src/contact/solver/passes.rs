//! The passes over the mesh that a solution is made of, fused with the convolutions they feed.

use super::lanes::{Work, dot, sum_by, total, weight};
use super::survey::Survey;
use crate::contact::fft::Rows;

/// From pressure to gap and energy, in double precision.
pub struct Evaluate<'a> {
    pub nodes: usize,
    pub heights: &'a [f64],
    pub pressure: &'a [f64],
    /// Subtracted from the gap before it is rounded to single precision.
    pub datum: f64,
    pub gap: &'a mut [f32],
    /// Set to where there is pressure.
    pub active: &'a mut [bool],
    pub survey: Survey<f64>,
    /// Σ (gap − datum).
    pub gap_sum: f64,
    /// Σ pressure × displacement.
    pub work: f64,
}

impl Rows<f64> for Evaluate<'_> {
    #[inline(always)]
    fn fill(&mut self, row: usize, values: &mut [f64]) {
        values.copy_from_slice(&self.pressure[row * self.nodes..][..self.nodes]);
    }

    #[inline(always)]
    fn take(&mut self, row: usize, values: &mut [f64]) {
        let start = row * self.nodes;
        let pressure = &self.pressure[start..][..self.nodes];
        let heights = &self.heights[start..][..self.nodes];
        let gap = &mut self.gap[start..][..self.nodes];
        let active = &mut self.active[start..][..self.nodes];

        self.work += dot(pressure, values);
        for (value, height) in values.iter_mut().zip(heights) {
            *value -= height + self.datum;
        }
        self.gap_sum += total(values);
        for (gap, value) in gap.iter_mut().zip(&*values) {
            *gap = *value as f32;
        }
        for (active, p) in active.iter_mut().zip(pressure) {
            *active = *p > 0.0;
        }
        self.survey.add(active, values);
    }
}

/// From the gap of free nodes to the pressure that would close it, were every node free.
pub struct Correct<'a> {
    pub nodes: usize,
    pub level: f32,
    pub gap: &'a [f32],
    /// Where there is pressure; turned into where nodes are free.
    pub active: &'a mut [bool],
    /// Set on free nodes, zero elsewhere.
    pub correction: &'a mut [f32],
    pub last_move: &'a [f32],
    /// Displacement under the last move.
    pub image: &'a [f32],
    pub sums: Sums,
}

/// Sums over free nodes.
#[derive(Default, Clone, Copy)]
pub struct Sums {
    /// Free nodes.
    pub nodes: usize,
    /// Σ correction.
    pub correction: f64,
    /// Σ correction × displacement under the last move.
    pub correction_on_image: f64,
    /// Σ last move.
    pub last_move: f64,
}

impl Rows<f32> for Correct<'_> {
    #[inline(always)]
    fn fill(&mut self, row: usize, values: &mut [f32]) {
        let start = row * self.nodes;
        let gap = &self.gap[start..][..self.nodes];
        let active = &mut self.active[start..][..self.nodes];

        for ((value, active), gap) in values.iter_mut().zip(active).zip(gap) {
            *active |= *gap < self.level;
            *value = weight::<f32>(*active) * (*gap - self.level);
        }
    }

    #[inline(always)]
    fn take(&mut self, row: usize, values: &mut [f32]) {
        let start = row * self.nodes;
        let active = &self.active[start..][..self.nodes];
        let correction = &mut self.correction[start..][..self.nodes];
        let last_move = &self.last_move[start..][..self.nodes];
        let image = &self.image[start..][..self.nodes];

        for ((correction, value), active) in correction.iter_mut().zip(values).zip(active) {
            *correction = weight::<f32>(*active) * *value;
        }
        self.sums.nodes += active.iter().filter(|active| **active).count();
        self.sums.correction += total(correction);
        self.sums.correction_on_image += dot(correction, image);
        self.sums.last_move += sum_by(last_move, active, |d, active| weight::<f32>(active) * d);
    }
}

/// From a row of corrections to one of directions that keep the mean pressure.
pub struct Aim<'a> {
    /// Of the last move in the direction.
    pub share: f32,
    /// Subtracted on free nodes.
    pub mean: f32,
    /// How far the direction is to be followed.
    pub step: f64,
    pub pressure: &'a [f64],
    /// Free nodes.
    pub active: &'a [bool],
    pub correction: &'a [f32],
    /// The last move, turned into the direction.
    pub direction: &'a mut [f32],
}

impl Work for Aim<'_> {
    /// Sum of the pressures that the step leaves, clipped at zero.
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        for ((d, active), z) in self
            .direction
            .iter_mut()
            .zip(self.active)
            .zip(self.correction)
        {
            *d = weight::<f32>(*active) * (self.share * *d - z - self.mean);
        }
        sum_by(self.pressure, self.direction, |p, d| {
            (p + self.step * f64::from(d)).max(0.0)
        })
    }
}

/// From a direction to a move that leaves no pressure below zero, and to the gap after it.
pub struct Move<'a> {
    pub nodes: usize,
    pub step: f64,
    /// Brings the clipped pressures back to their mean.
    pub scale: f64,
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
    pub survey: Survey<f32>,
    /// Σ move × displacement under it.
    pub curvature: f64,
    /// Σ move × (gap before it − level).
    pub slope: f64,
}

impl Rows<f32> for Move<'_> {
    #[inline(always)]
    fn fill(&mut self, row: usize, values: &mut [f32]) {
        let start = row * self.nodes;
        let pressure = &mut self.pressure[start..][..self.nodes];
        let active = &mut self.active[start..][..self.nodes];
        let direction = &mut self.direction[start..][..self.nodes];
        for (p, d) in pressure.iter_mut().zip(&mut *direction) {
            let next = (*p + self.step * f64::from(*d)).max(0.0) * self.scale;
            *d = (next - *p) as f32;
            *p = next;
        }
        for (active, p) in active.iter_mut().zip(pressure) {
            *active = *p > 0.0;
        }
        values.copy_from_slice(direction);
    }

    #[inline(always)]
    fn take(&mut self, row: usize, values: &mut [f32]) {
        let start = row * self.nodes;
        let active = &self.active[start..][..self.nodes];
        let direction = &self.direction[start..][..self.nodes];
        let image = &mut self.image[start..][..self.nodes];
        let gap = &mut self.gap[start..][..self.nodes];
        image.copy_from_slice(values);
        self.curvature += dot(direction, image);
        self.slope += sum_by(direction, gap, |d, gap| d * (gap - self.level));
        for (gap, image) in gap.iter_mut().zip(image) {
            *gap += *image;
        }
        self.survey.add(active, gap);
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
