//! Begins a search: from a gap and its pressure to what the first correction is to close.

use pulp::{Scalar, Simd};

use super::super::lanes::{Lanes, Pass, sum_by};
use super::base::Base;
use super::marks::marked;
use super::respond::{Response, Seen};

/// From the last gap and pressure as they are.
pub struct Ask<'a> {
    pub response: Response,
    pub gap: &'a [f32],
    pub pressure: &'a [f64],
    /// Marked where there is pressure; the last move on free nodes, if there is one to go on from.
    pub carry: &'a mut [f32],
    pub base: &'a mut Base,
    /// Set to the pressure above the base.
    pub rise: &'a mut [f32],
    pub seen: Seen,
    /// Σ base.
    pub base_sum: f64,
}

impl Pass<f32> for Ask<'_> {
    #[inline(always)]
    fn row<S: Simd>(&mut self, simd: S, row: usize, values: &mut [f32]) {
        let range = row * values.len()..(row + 1) * values.len();
        let pressure = &self.pressure[range.clone()];
        self.base.set_row(range.clone(), pressure);
        let base = self.base.row(range.clone());
        split(pressure, base, &mut self.rise[range.clone()]);
        self.base_sum += sum_by(base, base, |base, _| f64::from(base));
        let (gap, carry) = (&self.gap[range.clone()], &mut self.carry[range]);
        values.fill(0.0);
        self.response
            .ask_row(simd, values, gap, carry, &mut self.seen);
    }
}

#[inline(always)]
fn split(pressure: &[f64], base: &[f32], rise: &mut [f32]) {
    for ((p, base), rise) in pressure.iter().zip(base).zip(rise) {
        *rise = (p - f64::from(*base)) as f32;
    }
}

/// From the straight line through the last gaps and pressures and the ones before.
pub struct Extrapolate<'a> {
    /// How far, in units of the way from the earlier ones to the last.
    pub reach: f64,
    pub response: Response,
    pub pressure: &'a mut [f64],
    /// Set to the last pressure.
    pub earlier_pressure: &'a mut [f32],
    pub gap: &'a mut [f32],
    /// Set to the last gap.
    pub earlier_gap: &'a mut [f32],
    pub carry: &'a mut [f32],
    pub base: &'a mut Base,
    pub rise: &'a mut [f32],
    pub seen: Seen,
    /// Σ base.
    pub base_sum: f64,
}

impl Pass<f32> for Extrapolate<'_> {
    #[inline(always)]
    fn row<S: Simd>(&mut self, simd: S, row: usize, values: &mut [f32]) {
        let range = row * values.len()..(row + 1) * values.len();
        let pressure = &mut self.pressure[range.clone()];
        let earlier = &mut self.earlier_pressure[range.clone()];
        extrapolate(self.reach, pressure, earlier);
        self.base.set_row(range.clone(), pressure);
        let base = self.base.row(range.clone());
        let rise = &mut self.rise[range.clone()];
        split(pressure, base, rise);
        self.base_sum += sum_by(base, base, |base, _| f64::from(base));
        let gap = &mut self.gap[range.clone()];
        {
            let (gap, last_gap) = S::as_mut_simd_f32s(gap);
            let (earlier, last_earlier) = S::as_mut_simd_f32s(&mut self.earlier_gap[range.clone()]);
            extrapolate_single(simd, self.reach, gap, earlier);
            extrapolate_single(Scalar, self.reach, last_gap, last_earlier);
        }
        let carry = &mut self.carry[range];
        for (carry, p) in carry.iter_mut().zip(pressure) {
            *carry = marked(0.0, false, *p > 0.0);
        }
        values.fill(0.0);
        self.response
            .ask_row(simd, values, gap, carry, &mut self.seen);
    }
}

#[inline(always)]
fn extrapolate(reach: f64, pressure: &mut [f64], earlier: &mut [f32]) {
    for (p, earlier) in pressure.iter_mut().zip(earlier) {
        let last = *p;
        *p = last + reach * (last - f64::from(*earlier));
        *earlier = last as f32;
    }
}

#[inline(always)]
fn extrapolate_single<S: Simd>(simd: S, reach: f64, last: &mut [S::f32s], earlier: &mut [S::f32s]) {
    let reach = Lanes::all(simd, reach as f32);
    for (last, earlier) in last.iter_mut().zip(earlier) {
        let now = Lanes::of(simd, *last);
        let guess = now.plus(reach, now - Lanes::of(simd, *earlier));
        *earlier = now.numbers();
        *last = guess.numbers();
    }
}
