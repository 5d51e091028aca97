//! Gets ready for a search: from a gap and its pressure to what the first correction is to close.

use pulp::Simd;

use super::super::active_groups::ActiveBand;
use super::super::extension::AskedRows;
use super::super::flags::marked_by_pressure;
use super::super::in_order::InOrder;
use super::super::lanes::{LANES, Lanes, Pass, REST, split_mut, sum_by};
use super::base::BaseBand;
use super::expected::{Expected, ShownGap};
use super::update_gap::{GapUpdate, Seen};
use crate::fft::{Band, Row};

/// Goes over pressures. Starts from the last gap and pressure, or from a guess along the straight line
/// through them.
pub struct Ask<'a, const YIELDS: bool> {
    /// Where to go on to first.
    pub onwards: Option<Onwards<'a>>,
    /// Which nodes that penetrate are free.
    pub expected: Expected,
    pub shown: ShownGap,
    pub heights: &'a [f32],
    pub response: GapUpdate,
    pub gap: Band<'a, f32>,
    /// The pressure at which nodes are saturated.
    pub hardness: f64,
    /// Marked by pressure; the last move on free nodes, if there is one to go on from.
    pub carry: Band<'a, f32>,
    /// Set where there are free nodes, or pressures to be moved.
    pub active: ActiveBand<'a>,
    pub asked: AskedRows<'a>,
    /// A row of what free nodes ask for.
    pub row: Vec<f32>,
    pub base: BaseBand<'a>,
    /// Set to the pressure above the base.
    pub increment: Band<'a, f32>,
    pub seen: InOrder<Seen>,
    /// Σ base.
    pub base_sum: InOrder<f64>,
    /// Where the material yields, Σ pressure within its bounds.
    pub bounded_sum: InOrder<f64>,
}

/// The straight line through the last gap and pressure and the ones before.
pub struct Onwards<'a> {
    /// How far, in units of the way from the earlier ones to the last.
    pub reach: f64,
    /// Set to the last pressure.
    pub earlier_pressure: Band<'a, f32>,
    /// Set to the last gap.
    pub earlier_gap: Band<'a, f32>,
}

/// Keeps pressures in single precision. Goes over them.
pub struct Remember<'a>(pub Band<'a, f32>);

impl Pass<f64> for Remember<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        for (earlier, p) in self.0.row(row).iter_mut().zip(pressure) {
            *earlier = *p as f32;
        }
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self(self.0.split_off(row))
    }

    fn append(&mut self, _: Self) {}
}

impl<const YIELDS: bool> Pass<f64> for Ask<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, pressure: &mut [f64]) {
        let level = self.response.offset;
        let gap = self.gap.row(row);
        let carry = self.carry.row(row);
        if let Some(onwards) = &mut self.onwards {
            let earlier = onwards.earlier_pressure.row(row);
            if YIELDS {
                extrapolate_bounded(onwards.reach, self.hardness, pressure, earlier);
            } else {
                extrapolate(onwards.reach, pressure, earlier);
            }
            let earlier = onwards.earlier_gap.row(row);
            if let Expected::Near(nearing) = self.expected {
                let shown = &mut self.shown;
                shown.hold_far::<S, R>(simd, level, nearing, gap, earlier);
            }
            let (gap, last_gap) = split_mut::<S, R>(gap);
            let (earlier, last_earlier) = split_mut::<S, R>(earlier);
            extrapolate_single(simd, onwards.reach, gap, earlier);
            extrapolate_single(REST, onwards.reach, last_gap, last_earlier);
            for (carry, p) in carry.iter_mut().zip(&*pressure) {
                *carry = marked_by_pressure(0.0, *p, self.hardness);
            }
        }
        if YIELDS {
            let hardness = self.hardness;
            let bounded = sum_by(pressure, pressure, |p, _| p.clamp(0.0, hardness));
            self.bounded_sum.push(bounded);
        }
        let base = self.base.set_row(row, pressure);
        split(pressure, base, self.increment.row(row));
        self.base_sum.push(sum_by(base, base, |base, _| f64::from(base)));
        if let Expected::AsHighAs(lowest) = self.expected {
            let heights = row.of(self.heights);
            self.shown.hold_low::<S, R>(simd, level, lowest, heights);
        }
        let shown = match self.expected {
            Expected::All => gap,
            Expected::Near(_) | Expected::AsHighAs(_) => self.shown.of::<S, R>(simd, gap),
        };
        let (asked, seen) = (&mut self.row, &mut self.seen);
        let always = self.active.always;
        let mut found = self.active.row(row);
        found.active.fill(true);
        self.response.ask_row::<S, R, YIELDS>(simd, asked, shown, carry, &mut found, seen);
        let groups = self.increment.row(row).as_chunks_mut::<LANES>().0;
        for (active, increments) in found.active.iter_mut().zip(groups) {
            *active |= always || increments.iter().any(|increment| *increment != 0.0);
            if !*active {
                // As clipping leaves them.
                increments.fill(-0.0);
            }
        }
        self.asked.add_row::<S, R>(simd, row, asked, carry, found.free);
    }

    fn split_off(&mut self, row: Row) -> Self {
        let onwards = self.onwards.as_mut();
        Self {
            onwards: onwards.map(|onwards| Onwards {
                reach: onwards.reach,
                earlier_pressure: onwards.earlier_pressure.split_off(row),
                earlier_gap: onwards.earlier_gap.split_off(row),
            }),
            gap: self.gap.split_off(row),
            carry: self.carry.split_off(row),
            active: self.active.split_off(row),
            asked: self.asked.split_off(row),
            shown: self.shown.clone(),
            row: self.row.clone(),
            base: self.base.split_off(row),
            increment: self.increment.split_off(row),
            seen: InOrder::new(),
            base_sum: InOrder::new(),
            bounded_sum: InOrder::new(),
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.seen.append(later.seen);
        self.base_sum.append(later.base_sum);
        self.bounded_sum.append(later.bounded_sum);
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

/// The same of pressures up to the hardness. What bears it under both loads goes on to bear it: of the
/// earlier pressure single precision is left, whose difference from the last one is rounding there.
#[inline(always)]
fn extrapolate_bounded(reach: f64, hardness: f64, pressure: &mut [f64], earlier: &mut [f32]) {
    let nearest = hardness as f32;
    for (p, earlier) in pressure.iter_mut().zip(earlier) {
        let last = *p;
        let stays = last >= hardness && *earlier >= nearest;
        let guess = last + reach * (last - f64::from(*earlier));
        *p = if stays { hardness } else { guess };
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
