//! Passes from pressure to gap in double precision, before and after the convolution.

use pulp::Simd;

use super::begin::ReferencePressure;
use super::peek::SampleBand;
use crate::fft::{Band, Row};
use crate::solver::evaluation::GapStatistics;
use crate::solver::flags::{
    FREE, PRESSED, SATURATED, has, mark, mark_yielding, marked_by_pressure,
};
use crate::solver::lanes::{InOrder, Lanes, Pass, REST, greater, split, split_mut, weight};

/// Pass that writes the pressures as input of the convolution, and updates the flags of nodes with
/// pressure and of saturated nodes.
pub struct PressureInput<'a> {
    pub pressure: &'a [f64],
    /// Pressure at which nodes are saturated.
    pub hardness: f64,
    /// Last step of each node; its lowest bits hold the [flags](crate::solver::flags) that the pass
    /// updates.
    pub last_step: Band<'a, f32>,
    /// False to set the last steps to zero.
    pub keeps_steps: bool,
}

impl Pass<f64> for PressureInput<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f64]) {
        values.copy_from_slice(row.of(self.pressure));
        for (last_step, p) in self.last_step.row(row).iter_mut().zip(values) {
            let kept = if self.keeps_steps { *last_step } else { 0.0 };
            *last_step = marked_by_pressure(kept, *p, self.hardness);
        }
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { last_step: self.last_step.split_off(row), ..*self }
    }

    fn append(&mut self, _: Self) {}
}

/// Pass that converts the pressures of the inner solver to double precision. It stores them in
/// `pressure` and writes them as input of the convolution.
pub struct PromotedInput<'a> {
    /// Factor that restores the mean of the pressures.
    pub scale: f64,
    pub reference_pressure: &'a ReferencePressure,
    pub pressure_increment: &'a [f32],
    pub pressure: Band<'a, f64>,
}

impl Pass<f64> for PromotedInput<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f64]) {
        let pressure = self.pressure.row(row);
        promote(
            self.scale,
            self.reference_pressure.row(row),
            row.of(self.pressure_increment),
            pressure,
        );
        values.copy_from_slice(pressure);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { pressure: self.pressure.split_off(row), ..*self }
    }

    fn append(&mut self, _: Self) {}
}

#[inline(always)]
pub fn promote(factor: f64, reference_pressure: &[f32], increment: &[f32], pressure: &mut [f64]) {
    for ((p, reference_pressure), increment) in
        pressure.iter_mut().zip(reference_pressure).zip(increment)
    {
        *p = factor * (f64::from(*reference_pressure) + f64::from(*increment));
    }
}

/// Pass over pressures that sets them to `factor` × (reference pressure + increment), the pressures
/// of the inner solver in double precision.
pub struct Promote<'a> {
    pub factor: f64,
    pub reference_pressure: &'a ReferencePressure,
    pub pressure_increment: &'a [f32],
}

impl Pass<f64> for Promote<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        promote(
            self.factor,
            self.reference_pressure.row(row),
            row.of(self.pressure_increment),
            pressure,
        );
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}

/// Pass over pressures that undoes the fraction `part` of the last step, within the bounds of the
/// pressures.
pub struct TakeBack<'a> {
    pub part: f64,
    pub hardness: f64,
    /// Last steps of free nodes, with flags.
    pub last_step: &'a [f32],
}

impl Pass<f64> for TakeBack<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        for (p, last_step) in pressure.iter_mut().zip(row.of(self.last_step)) {
            let step = weight::<f64>(has(*last_step, FREE)) * f64::from(*last_step);
            // Rounding must not leave a pressure below zero or above the hardness.
            *p = greater(*p - self.part * step, 0.0).min(self.hardness);
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}

/// Pass over displacements u that computes the gaps u − h − `reference`, with the heights h, and
/// their statistics.
pub struct GapOutput<'a, const YIELDS: bool> {
    pub heights: &'a [f64],
    /// Number that is subtracted from gaps before they are rounded to single precision.
    pub reference: f64,
    pub gap: Band<'a, f32>,
    pub last_step: &'a [f32],
    pub sums_gaps: bool,
    pub statistics: InOrder<GapStatistics>,
}

impl<const YIELDS: bool> Pass<f64> for GapOutput<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f64]) {
        let gap = self.gap.row(row);
        above(values, row.of(self.heights), self.reference, gap);
        let last_step = row.of(self.last_step);
        let mut statistics = GapStatistics::new(self.sums_gaps);
        statistics.add_gaps::<YIELDS>(values, last_step);
        let (gap, last_gap) = split::<S, R>(gap);
        let (last_step, rest_step) = split::<S, R>(last_step);
        statistics.add::<_, _, YIELDS>(simd, gap, last_step);
        statistics.add::<_, _, YIELDS>(REST, last_gap, rest_step);
        self.statistics.push(statistics);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { gap: self.gap.split_off(row), statistics: InOrder::new(), ..*self }
    }

    fn append(&mut self, later: Self) {
        self.statistics.append(later.statistics);
    }
}

#[inline(always)]
fn above(values: &mut [f64], heights: &[f64], reference: f64, gap: &mut [f32]) {
    for ((gap, value), height) in gap.iter_mut().zip(values).zip(heights) {
        *value -= height + reference;
        *gap = *value as f32;
    }
}

/// Pass over the displacements after a step that computes the gaps. From the change of the gaps it
/// also computes the displacements under the step, and the curvature of the energy, Σ step ×
/// displacement.
pub struct StepOutput<'a, const YIELDS: bool> {
    pub heights: &'a [f64],
    pub reference: f64,
    pub scaling: StepScaling,
    pub sums_gaps: bool,
    pub statistics: InOrder<GapStatistics>,
    pub curvature: InOrder<f64>,
    pub reference_pressure: &'a ReferencePressure,
    pub pressure_increment: &'a [f32],
    pub gap: Band<'a, f32>,
    /// Steps of free nodes, to which the pass adds the scaling of their pressures. Steps of other
    /// nodes are set to zero.
    pub last_step: Band<'a, f32>,
    /// Storage of the displacements under the step, for a sample of rows.
    pub sample: SampleBand<'a>,
    pub found: Vec<f32>,
}

/// Scaling of the pressures after a step, and change of the reference, both the same for all nodes.
#[derive(Clone, Copy)]
pub struct StepScaling {
    pub scale: f32,
    pub reference_change: f32,
}

impl<const YIELDS: bool> Pass<f64> for StepOutput<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f64]) {
        let heights = row.of(self.heights);
        above(values, heights, self.reference, &mut self.found);
        {
            let (found, last_found) = split_mut::<S, R>(&mut self.found);
            let (gap, last_gap) = split_mut::<S, R>(self.gap.row(row));
            let last_step = self.last_step.row(row);
            let mut statistics = GapStatistics::new(self.sums_gaps);
            statistics.add_gaps::<YIELDS>(values, last_step);
            let (last_step, rest_step) = split_mut::<S, R>(last_step);
            let (reference_pressure, last_base) = split::<S, R>(self.reference_pressure.row(row));
            let (increment, last_increment) = split::<S, R>(row.of(self.pressure_increment));
            statistics.add::<_, _, YIELDS>(simd, found, last_step);
            statistics.add::<_, _, YIELDS>(REST, last_found, rest_step);
            self.statistics.push(statistics);
            let scaling = self.scaling;
            let curvature = scaling.finish::<_, _, YIELDS>(
                simd,
                found,
                gap,
                last_step,
                reference_pressure,
                increment,
            );
            self.curvature.push(curvature);
            if !last_found.is_empty() {
                let curvature = scaling.finish::<_, _, YIELDS>(
                    REST,
                    last_found,
                    last_gap,
                    rest_step,
                    last_base,
                    last_increment,
                );
                self.curvature.push(curvature);
            }
        }
        self.sample.keep(row, &self.found);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self {
            statistics: InOrder::new(),
            curvature: InOrder::new(),
            gap: self.gap.split_off(row),
            last_step: self.last_step.split_off(row),
            sample: self.sample.split_off(row),
            found: vec![0.0; self.found.len()],
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.statistics.append(later.statistics);
        self.curvature.append(later.curvature);
    }
}

impl StepScaling {
    /// Stores the gaps `found` after a step in `gap`, replaces `found` by the displacements under
    /// the step, and adds the scaling of the pressures to `last_step`.
    ///
    /// Returns Σ step × displacement.
    #[inline(always)]
    fn finish<S: Simd, const R: usize, const YIELDS: bool>(
        self,
        simd: S,
        found: &mut [[S::f32s; R]],
        gap: &mut [[S::f32s; R]],
        last_step: &mut [[S::f32s; R]],
        reference_pressure: &[[S::f32s; R]],
        increment: &[[S::f32s; R]],
    ) -> f64 {
        let scaling = Lanes::all(simd, self.scale - 1.0);
        let reference_change = Lanes::all(simd, self.reference_change);
        let mut curvature = Lanes::all(simd, 0.0);
        let nodes = found.iter_mut().zip(gap).zip(last_step);
        for (((found, gap), last_step), (reference_pressure, increment)) in
            nodes.zip(reference_pressure.iter().zip(increment))
        {
            let image = Lanes::of(simd, *found) - Lanes::of(simd, *gap) + reference_change;
            *gap = *found;
            *found = image.numbers();
            let c = Lanes::of(simd, *last_step);
            let free = c.has(FREE);
            let pressure = Lanes::of(simd, *reference_pressure) + Lanes::of(simd, *increment);
            let scaled = c.plus(scaling, pressure);
            let step = if YIELDS {
                // Saturated pressures are not scaled.
                free.or_zero(c.has(SATURATED).choose(c, scaled))
            } else {
                free.or_zero(scaled)
            };
            curvature = curvature.plus(step, image);
            let pressed = c.has(PRESSED);
            *last_step = if YIELDS {
                mark_yielding(step, free, pressed, c.has(SATURATED)).numbers()
            } else {
                mark(step, free, pressed).numbers()
            };
        }
        curvature.total()
    }
}
