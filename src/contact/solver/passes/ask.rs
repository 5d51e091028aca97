//! Begins a search: from a gap and its pressure to what the first correction is to close.

use pulp::Simd;

use super::super::flags::marked_by_pressure;
use super::super::lanes::{Lanes, Pass, REST, split_mut, sum_by};
use super::base::Base;
use super::update_gap::{GapUpdate, Seen};
use crate::contact::fft::Row;

/// Starts from the last gap and pressure, or from a guess along the straight line through them.
pub struct Ask<'a, const YIELDS: bool> {
    /// Where to go on to first.
    pub onwards: Option<Onwards<'a>>,
    pub response: GapUpdate,
    pub gap: &'a mut [f32],
    pub pressure: &'a mut [f64],
    /// The pressure at which nodes are saturated.
    pub hardness: f64,
    /// Marked by pressure; the last move on free nodes, if there is one to go on from.
    pub carry: &'a mut [f32],
    pub base: &'a mut Base,
    /// Set to the pressure above the base.
    pub increment: &'a mut [f32],
    pub seen: Seen,
    /// Σ base.
    pub base_sum: f64,
    /// Where the material yields, Σ pressure within its bounds.
    pub bounded_sum: f64,
}

/// The straight line through the last gap and pressure and the ones before.
pub struct Onwards<'a> {
    /// How far, in units of the way from the earlier ones to the last.
    pub reach: f64,
    /// Set to the last pressure.
    pub earlier_pressure: &'a mut [f32],
    /// Set to the last gap.
    pub earlier_gap: &'a mut [f32],
}

impl<const YIELDS: bool> Pass<f32> for Ask<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f32]) {
        let pressure = row.of_mut(self.pressure);
        let gap = row.of_mut(self.gap);
        let carry = row.of_mut(self.carry);
        if let Some(onwards) = &mut self.onwards {
            let earlier = row.of_mut(onwards.earlier_pressure);
            extrapolate(onwards.reach, pressure, earlier);
            let (gap, last_gap) = split_mut::<S, R>(gap);
            let earlier = row.of_mut(onwards.earlier_gap);
            let (earlier, last_earlier) = split_mut::<S, R>(earlier);
            extrapolate_single(simd, onwards.reach, gap, earlier);
            extrapolate_single(REST, onwards.reach, last_gap, last_earlier);
            for (carry, p) in carry.iter_mut().zip(&*pressure) {
                *carry = marked_by_pressure(0.0, *p, self.hardness);
            }
        }
        if YIELDS {
            let hardness = self.hardness;
            self.bounded_sum += sum_by(pressure, pressure, |p, _| p.clamp(0.0, hardness));
        }
        self.base.set_row(row, pressure);
        let base = self.base.row(row);
        split(pressure, base, row.of_mut(self.increment));
        self.base_sum += sum_by(base, base, |base, _| f64::from(base));
        values.fill(0.0);
        self.response
            .ask_row::<S, R, YIELDS>(simd, values, gap, carry, &mut self.seen);
    }
}

#[inline(always)]
fn split(pressure: &[f64], base: &[f32], increment: &mut [f32]) {
    for ((p, base), increment) in pressure.iter().zip(base).zip(increment) {
        *increment = (p - f64::from(*base)) as f32;
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
fn extrapolate_single<S: Simd, const R: usize>(
    simd: S,
    reach: f64,
    last: &mut [[S::f32s; R]],
    earlier: &mut [[S::f32s; R]],
) {
    let reach = Lanes::all(simd, reach as f32);
    for (last, earlier) in last.iter_mut().zip(earlier) {
        let now = Lanes::of(simd, *last);
        let guess = now.plus(reach, now - Lanes::of(simd, *earlier));
        *earlier = now.numbers();
        *last = guess.numbers();
    }
}
