//! From gap to direction.

use super::super::lanes::{Work, dot, either, sum_by, total, weight};
use crate::contact::fft::Rows;

/// From the gap of free nodes, and its extension over the others, to the pressure that would close
/// it, were every node free.
pub struct Correct<'a> {
    pub level: f32,
    pub gap: &'a [f32],
    /// Where there is pressure; turned into where nodes are free.
    pub active: &'a mut [bool],
    /// On free nodes set to the correction; elsewhere the extension, brought up to date.
    pub correction: &'a mut [f32],
    pub extension: Extension,
    pub last_move: &'a [f32],
    /// Displacement under the last move.
    pub image: &'a [f32],
    pub sums: Sums,
}

/// How the extension of the last iteration becomes that of this one.
#[derive(Default, Clone, Copy)]
pub struct Extension {
    /// How much of it is kept.
    pub memory: f32,
    /// The part of the last move that was not taken back.
    pub part: f32,
    /// How far the level rose.
    pub rise: f32,
    /// Displacement per pressure by which it gives way to pressures on nodes that are not free.
    pub compliance: f32,
}

impl Extension {
    #[inline(always)]
    fn follow(&self, extension: f32, image: f32) -> f32 {
        self.memory * (extension + self.part * image - self.rise)
    }
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
        let range = row * values.len()..(row + 1) * values.len();
        let gap = &self.gap[range.clone()];
        let active = &mut self.active[range.clone()];
        let correction = &self.correction[range.clone()];
        let image = &self.image[range.clone()];

        for (active, gap) in active.iter_mut().zip(gap) {
            *active |= *gap < self.level;
        }
        let extensions = correction.iter().zip(image);
        let nodes = values.iter_mut().zip(active).zip(gap).zip(extensions);
        for (((value, active), gap), (extension, image)) in nodes {
            let extension = self.extension.follow(*extension, *image);
            *value = either(*active, *gap - self.level, extension);
        }
    }

    #[inline(always)]
    fn take(&mut self, row: usize, values: &mut [f32]) {
        let range = row * values.len()..(row + 1) * values.len();
        let active = &self.active[range.clone()];
        let correction = &mut self.correction[range.clone()];
        let last_move = &self.last_move[range.clone()];
        let image = &self.image[range];

        let nodes = correction
            .iter_mut()
            .zip(image)
            .zip(&mut *values)
            .zip(active);
        for (((correction, image), value), active) in nodes {
            let extension = self.extension.follow(*correction, *image);
            let extension = extension - self.extension.compliance * *value;
            *correction = either(*active, *value, extension);
            *value *= weight::<f32>(*active);
        }
        self.sums.nodes += active.iter().filter(|active| **active).count();
        self.sums.correction += total(values);
        self.sums.correction_on_image += dot(values, image);
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
    pub gap: &'a [f32],
    pub level: f32,
    /// Used up on free nodes, and set to what extends the gap if they are left behind: the gap.
    pub correction: &'a mut [f32],
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
            .zip(&*self.correction)
        {
            *d = weight::<f32>(*active) * (self.share * *d - z - self.mean);
        }
        for ((correction, active), gap) in self.correction.iter_mut().zip(self.active).zip(self.gap)
        {
            *correction = either(*active, *gap - self.level, *correction);
        }
        sum_by(self.pressure, self.direction, |p, d| {
            (p + self.step * f64::from(d)).max(0.0)
        })
    }
}
