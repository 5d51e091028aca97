//! From pressure to gap, in double precision: the way to the displacement, and the way back.

use pulp::Simd;

use super::super::flags::{FREE, PRESSED, has, mark, marked};
use super::super::lanes::{Lanes, Pass, REST, greater, split, split_mut, sum_by, weight};
use super::super::survey::Survey;
use super::base::Base;
use super::sample::Sample;
use crate::contact::fft::Row;

/// Departs from a pressure as it is.
pub struct Depart<'a> {
    pub pressure: &'a [f64],
    /// Emptied, and marked where there is pressure.
    pub carry: &'a mut [f32],
}

impl Pass<f64> for Depart<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f64]) {
        values.copy_from_slice(row.of(self.pressure));
        for (carry, p) in row.of_mut(self.carry).iter_mut().zip(values) {
            *carry = marked(0.0, false, *p > 0.0);
        }
    }
}

/// Departs from the pressure of a search, which it brings up to date.
pub struct Settle<'a> {
    /// Brings pressures to their mean.
    pub scale: f64,
    pub base: &'a Base,
    pub rise: &'a [f32],
    pub pressure: &'a mut [f64],
}

impl Pass<f64> for Settle<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f64]) {
        let pressure = row.of_mut(self.pressure);
        join(self.scale, self.base.row(row), row.of(self.rise), pressure);
        values.copy_from_slice(pressure);
    }
}

#[inline(always)]
fn join(factor: f64, base: &[f32], rise: &[f32], pressure: &mut [f64]) {
    for ((p, base), rise) in pressure.iter_mut().zip(base).zip(rise) {
        *p = factor * (f64::from(*base) + f64::from(*rise));
    }
}

/// Brings pressures up to date, where no transform is to follow.
pub struct Join<'a> {
    pub factor: f64,
    pub base: &'a Base,
    pub rise: &'a [f32],
}

impl Pass<f64> for Join<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        join(self.factor, self.base.row(row), row.of(self.rise), pressure);
    }
}

/// Takes a part of the last move back from pressures.
pub struct Withdraw<'a> {
    pub part: f64,
    /// Moves of free nodes, marked.
    pub carry: &'a [f32],
}

impl Pass<f64> for Withdraw<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        for (p, carry) in pressure.iter_mut().zip(row.of(self.carry)) {
            let last_move = weight::<f64>(has(*carry, FREE)) * f64::from(*carry);
            // Rounding must not leave a pressure below zero.
            *p = greater(*p - self.part * last_move, 0.0);
        }
    }
}

/// Arrives at a gap.
pub struct Arrive<'a> {
    pub heights: &'a [f64],
    /// Subtracted from the gap before it is rounded to single precision.
    pub reference: f64,
    pub gap: &'a mut [f32],
    /// Marked where there is pressure.
    pub carry: &'a [f32],
    pub survey: Survey,
}

impl Pass<f64> for Arrive<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f64]) {
        let gap = row.of_mut(self.gap);
        above(values, row.of(self.heights), self.reference, gap);
        let carry = row.of(self.carry);
        self.survey.contact_sum += contact_sum(values, carry);
        self.survey.add_gaps(values);
        let (gap, last_gap) = split::<S, R>(gap);
        let (carry, last_carry) = split::<S, R>(carry);
        self.survey.add(simd, gap, carry);
        self.survey.add(REST, last_gap, last_carry);
    }
}

#[inline(always)]
fn above(values: &mut [f64], heights: &[f64], reference: f64, gap: &mut [f32]) {
    for ((gap, value), height) in gap.iter_mut().zip(values).zip(heights) {
        *value -= height + reference;
        *gap = *value as f32;
    }
}

/// Σ of gaps where numbers are marked for pressure.
#[inline(always)]
fn contact_sum(gap: &[f64], carry: &[f32]) -> f64 {
    sum_by(gap, carry, |gap, carry| {
        weight::<f64>(has(carry, PRESSED)) * gap
    })
}

/// Arrives at the gap after a move that was followed at once, and sees what the move did.
pub struct Land<'a> {
    pub heights: &'a [f64],
    pub reference: f64,
    pub landing: Landing,
    pub base: &'a Base,
    pub rise: &'a [f32],
    pub gap: &'a mut [f32],
    /// Moves of free nodes, before pressures were scaled, to be scaled too; emptied elsewhere.
    pub carry: &'a mut [f32],
    /// Set to displacements under the move.
    pub sample: &'a mut Sample,
    /// A row of gaps.
    pub found: Vec<f32>,
}

/// What each node does, and what is seen.
#[derive(Clone, Copy)]
pub struct Landing {
    pub scale: f32,
    /// How much the reference rose.
    pub reference_rise: f32,
    pub survey: Survey,
    /// Σ move × displacement under it.
    pub curvature: f64,
}

impl Pass<f64> for Land<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f64]) {
        let heights = row.of(self.heights);
        above(values, heights, self.reference, &mut self.found);
        {
            let (found, last_found) = split_mut::<S, R>(&mut self.found);
            let (gap, last_gap) = split_mut::<S, R>(row.of_mut(self.gap));
            let carry = row.of_mut(self.carry);
            self.landing.survey.contact_sum += contact_sum(values, carry);
            self.landing.survey.add_gaps(values);
            let (carry, last_carry) = split_mut::<S, R>(carry);
            let (base, last_base) = split::<S, R>(self.base.row(row));
            let (rise, last_rise) = split::<S, R>(row.of(self.rise));
            let landing = &mut self.landing;
            landing.survey.add(simd, found, carry);
            landing.survey.add(REST, last_found, last_carry);
            landing.finish(simd, found, gap, carry, base, rise);
            if !last_found.is_empty() {
                landing.finish(REST, last_found, last_gap, last_carry, last_base, last_rise);
            }
        }
        self.sample.keep(row, &self.found);
    }
}

impl Landing {
    /// Takes the gaps that were `found` over, and turns them into displacements under the move.
    #[inline(always)]
    fn finish<S: Simd, const R: usize>(
        &mut self,
        simd: S,
        found: &mut [[S::f32s; R]],
        gap: &mut [[S::f32s; R]],
        carry: &mut [[S::f32s; R]],
        base: &[[S::f32s; R]],
        rise: &[[S::f32s; R]],
    ) {
        let scaling = Lanes::all(simd, self.scale - 1.0);
        let reference_rise = Lanes::all(simd, self.reference_rise);
        let mut curvature = Lanes::all(simd, 0.0);
        let nodes = found.iter_mut().zip(gap).zip(carry);
        for (((found, gap), carry), (base, rise)) in nodes.zip(base.iter().zip(rise)) {
            let image = Lanes::of(simd, *found) - Lanes::of(simd, *gap) + reference_rise;
            *gap = *found;
            *found = image.numbers();
            let c = Lanes::of(simd, *carry);
            let free = c.has(FREE);
            let pressure = Lanes::of(simd, *base) + Lanes::of(simd, *rise);
            let moved = free.or_zero(c.plus(scaling, pressure));
            curvature = curvature.plus(moved, image);
            *carry = mark(moved, free, c.has(PRESSED)).numbers();
        }
        self.curvature += curvature.total();
    }
}
