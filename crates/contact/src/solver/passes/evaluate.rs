//! From pressure to gap, in double precision: the way to the displacement, and the way back.

use pulp::Simd;

use super::begin::Base;
use super::peek::SampleBand;
use crate::fft::{Band, Row};
use crate::solver::evaluation::Survey;
use crate::solver::flags::{
    FREE, PRESSED, SATURATED, has, mark, mark_yielding, marked_by_pressure,
};
use crate::solver::lanes::{InOrder, Lanes, Pass, REST, greater, split, split_mut, weight};

/// Transforms a pressure as it is.
pub struct PressureInput<'a> {
    pub pressure: &'a [f64],
    /// The pressure at which nodes are saturated.
    pub hardness: f64,
    /// Marked by pressure,
    pub carry: Band<'a, f32>,
    /// and emptied, unless moves are to be kept.
    pub keeps_moves: bool,
}

impl Pass<f64> for PressureInput<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f64]) {
        values.copy_from_slice(row.of(self.pressure));
        for (carry, p) in self.carry.row(row).iter_mut().zip(values) {
            let kept = if self.keeps_moves { *carry } else { 0.0 };
            *carry = marked_by_pressure(kept, *p, self.hardness);
        }
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { carry: self.carry.split_off(row), ..*self }
    }

    fn append(&mut self, _: Self) {}
}

/// Brings pressures up to date with their search, and transforms them.
pub struct PromotedInput<'a> {
    /// Brings pressures to their mean.
    pub scale: f64,
    pub base: &'a Base,
    pub increment: &'a [f32],
    pub pressure: Band<'a, f64>,
}

impl Pass<f64> for PromotedInput<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f64]) {
        let pressure = self.pressure.row(row);
        promote(self.scale, self.base.row(row), row.of(self.increment), pressure);
        values.copy_from_slice(pressure);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { pressure: self.pressure.split_off(row), ..*self }
    }

    fn append(&mut self, _: Self) {}
}

#[inline(always)]
pub fn promote(factor: f64, base: &[f32], increment: &[f32], pressure: &mut [f64]) {
    for ((p, base), increment) in pressure.iter_mut().zip(base).zip(increment) {
        *p = factor * (f64::from(*base) + f64::from(*increment));
    }
}

/// Brings pressures up to date with their search, where no transform is to follow.
pub struct Promote<'a> {
    pub factor: f64,
    pub base: &'a Base,
    pub increment: &'a [f32],
}

impl Pass<f64> for Promote<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        promote(self.factor, self.base.row(row), row.of(self.increment), pressure);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}

/// Takes a part of the last move back from pressures.
pub struct TakeBack<'a> {
    pub part: f64,
    /// The highest pressure.
    pub hardness: f64,
    /// Moves of free nodes, marked.
    pub carry: &'a [f32],
}

impl Pass<f64> for TakeBack<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        for (p, carry) in pressure.iter_mut().zip(row.of(self.carry)) {
            let last_move = weight::<f64>(has(*carry, FREE)) * f64::from(*carry);
            // Rounding must not leave a pressure below zero, or above the hardness.
            *p = greater(*p - self.part * last_move, 0.0).min(self.hardness);
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}

/// Turns displacements into gaps, and surveys them.
pub struct GapOutput<'a, const YIELDS: bool> {
    pub heights: &'a [f64],
    /// Subtracted from the gap before it is rounded to single precision.
    pub reference: f64,
    pub gap: Band<'a, f32>,
    /// Marked by pressure.
    pub carry: &'a [f32],
    /// Whether gaps are to be summed over the whole map.
    pub sums_gaps: bool,
    pub survey: InOrder<Survey>,
}

impl<const YIELDS: bool> Pass<f64> for GapOutput<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f64]) {
        let gap = self.gap.row(row);
        above(values, row.of(self.heights), self.reference, gap);
        let carry = row.of(self.carry);
        let mut survey = Survey::new(self.sums_gaps);
        survey.add_gaps::<YIELDS>(values, carry);
        let (gap, last_gap) = split::<S, R>(gap);
        let (carry, last_carry) = split::<S, R>(carry);
        survey.add::<_, _, YIELDS>(simd, gap, carry);
        survey.add::<_, _, YIELDS>(REST, last_gap, last_carry);
        self.survey.push(survey);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { gap: self.gap.split_off(row), survey: InOrder::new(), ..*self }
    }

    fn append(&mut self, later: Self) {
        self.survey.append(later.survey);
    }
}

#[inline(always)]
fn above(values: &mut [f64], heights: &[f64], reference: f64, gap: &mut [f32]) {
    for ((gap, value), height) in gap.iter_mut().zip(values).zip(heights) {
        *value -= height + reference;
        *gap = *value as f32;
    }
}

/// The same after a move that was followed at once; sees what the move did.
pub struct MoveOutput<'a, const YIELDS: bool> {
    pub heights: &'a [f64],
    pub reference: f64,
    pub scaling: MoveScaling,
    /// Whether gaps are to be summed over the whole map.
    pub sums_gaps: bool,
    pub survey: InOrder<Survey>,
    /// Σ move × displacement under it.
    pub curvature: InOrder<f64>,
    pub base: &'a Base,
    pub increment: &'a [f32],
    pub gap: Band<'a, f32>,
    /// Moves of free nodes, before pressures were scaled, to be scaled too; emptied elsewhere.
    pub carry: Band<'a, f32>,
    /// Set to displacements under the move.
    pub sample: SampleBand<'a>,
    /// A row of gaps.
    pub found: Vec<f32>,
}

/// What each node does.
#[derive(Clone, Copy)]
pub struct MoveScaling {
    pub scale: f32,
    /// How much higher the reference is.
    pub reference_change: f32,
}

impl<const YIELDS: bool> Pass<f64> for MoveOutput<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f64]) {
        let heights = row.of(self.heights);
        above(values, heights, self.reference, &mut self.found);
        {
            let (found, last_found) = split_mut::<S, R>(&mut self.found);
            let (gap, last_gap) = split_mut::<S, R>(self.gap.row(row));
            let carry = self.carry.row(row);
            let mut survey = Survey::new(self.sums_gaps);
            survey.add_gaps::<YIELDS>(values, carry);
            let (carry, last_carry) = split_mut::<S, R>(carry);
            let (base, last_base) = split::<S, R>(self.base.row(row));
            let (increment, last_increment) = split::<S, R>(row.of(self.increment));
            survey.add::<_, _, YIELDS>(simd, found, carry);
            survey.add::<_, _, YIELDS>(REST, last_found, last_carry);
            self.survey.push(survey);
            let scaling = self.scaling;
            let curvature =
                scaling.finish::<_, _, YIELDS>(simd, found, gap, carry, base, increment);
            self.curvature.push(curvature);
            if !last_found.is_empty() {
                let curvature = scaling.finish::<_, _, YIELDS>(
                    REST,
                    last_found,
                    last_gap,
                    last_carry,
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
            survey: InOrder::new(),
            curvature: InOrder::new(),
            gap: self.gap.split_off(row),
            carry: self.carry.split_off(row),
            sample: self.sample.split_off(row),
            found: vec![0.0; self.found.len()],
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.survey.append(later.survey);
        self.curvature.append(later.curvature);
    }
}

impl MoveScaling {
    /// Takes over the gaps that were `found`, and turns them into displacements under the move.
    /// Returns Σ move × displacement.
    #[inline(always)]
    fn finish<S: Simd, const R: usize, const YIELDS: bool>(
        self,
        simd: S,
        found: &mut [[S::f32s; R]],
        gap: &mut [[S::f32s; R]],
        carry: &mut [[S::f32s; R]],
        base: &[[S::f32s; R]],
        increment: &[[S::f32s; R]],
    ) -> f64 {
        let scaling = Lanes::all(simd, self.scale - 1.0);
        let reference_change = Lanes::all(simd, self.reference_change);
        let mut curvature = Lanes::all(simd, 0.0);
        let nodes = found.iter_mut().zip(gap).zip(carry);
        for (((found, gap), carry), (base, increment)) in nodes.zip(base.iter().zip(increment)) {
            let image = Lanes::of(simd, *found) - Lanes::of(simd, *gap) + reference_change;
            *gap = *found;
            *found = image.numbers();
            let c = Lanes::of(simd, *carry);
            let free = c.has(FREE);
            let pressure = Lanes::of(simd, *base) + Lanes::of(simd, *increment);
            let scaled = c.plus(scaling, pressure);
            let moved = if YIELDS {
                // What is saturated is not scaled.
                free.or_zero(c.has(SATURATED).choose(c, scaled))
            } else {
                free.or_zero(scaled)
            };
            curvature = curvature.plus(moved, image);
            let pressed = c.has(PRESSED);
            *carry = if YIELDS {
                mark_yielding(moved, free, pressed, c.has(SATURATED)).numbers()
            } else {
                mark(moved, free, pressed).numbers()
            };
        }
        curvature.total()
    }
}
