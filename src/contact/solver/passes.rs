//! The passes over the mesh that a solution is made of, fused with the convolutions they feed.

use super::lanes::{Work, dot, either, sum_by, total, weight};
use super::survey::Survey;
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
    fn add(
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
