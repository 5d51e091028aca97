//! Passes at the beginning and at the end of the iterations of a load.
//!
//! They compute the first residual from a gap and its pressure, start the inner solver from given
//! pressures, and combine its result for a finer mesh. Pressures are stored as increments to a
//! [`ReferencePressure`].

use pulp::Simd;

use super::update_gap::{GapSums, GapUpdate};
use super::update_pressure::PendingUpdate;
use crate::fft::{Band, Row};
use crate::solver::extension::ResidualRows;
use crate::solver::flags::{ActiveBand, FREE, PRESSED, SATURATED, has, marked_by_pressure};
use crate::solver::lanes::{
    Accumulate, InOrder, LANES, Lanes, Pass, REST, greater, split_mut, sum_by, total, weight,
};
use crate::solver::nearing::{Expected, LimitedGap};
use crate::solver::prolongation::Prolonged;

/// Pass over pressures that computes the first residual, from the last gaps and pressures or from
/// their extrapolation.
pub struct InitialResidual<'a, const YIELDS: bool> {
    pub extrapolation: Option<Extrapolation<'a>>,
    /// Nodes without pressure that may be free if they penetrate.
    pub expected: Expected,
    pub limited_gap: LimitedGap,
    pub heights: &'a [f32],
    pub response: GapUpdate,
    pub gap: Band<'a, f32>,
    pub hardness: f64,
    /// Last steps, which an extrapolation sets to zero. Their flags are updated.
    pub last_step: Band<'a, f32>,
    /// Marks of the groups with free nodes or with pressure, which are updated.
    pub active: ActiveBand<'a>,
    pub residual: ResidualRows<'a>,
    pub row: Vec<f32>,
    pub reference_pressure: ReferenceBand<'a>,
    /// Increments, which are set to pressure − reference pressure.
    pub pressure_increment: Band<'a, f32>,
    pub seen: InOrder<GapSums>,
    pub reference_sum: InOrder<f64>,
    /// Σ clamp(p, 0, `hardness`) over the pressures p, if the material yields.
    pub bounded_sum: InOrder<f64>,
}

/// Linear extrapolation from the last two solutions. The last solution then replaces the earlier
/// one.
pub struct Extrapolation<'a> {
    /// Ratio of the next increment of the load to the last one.
    pub reach: f64,
    pub earlier_pressure: Band<'a, f32>,
    pub earlier_gap: Band<'a, f32>,
}

/// Pass over pressures that copies them to a map in single precision.
pub struct SavePressure<'a>(pub Band<'a, f32>);

impl Pass<f64> for SavePressure<'_> {
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

impl<const YIELDS: bool> Pass<f64> for InitialResidual<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, pressure: &mut [f64]) {
        let level = self.response.offset;
        let gap = self.gap.row(row);
        let last_step = self.last_step.row(row);
        if let Some(extrapolation) = &mut self.extrapolation {
            let earlier = extrapolation.earlier_pressure.row(row);
            if YIELDS {
                extrapolate_bounded(extrapolation.reach, self.hardness, pressure, earlier);
            } else {
                extrapolate(extrapolation.reach, pressure, earlier);
            }
            let earlier = extrapolation.earlier_gap.row(row);
            if let Expected::Near(nearing) = self.expected {
                let limited_gap = &mut self.limited_gap;
                limited_gap.hold_far::<S, R>(simd, level, nearing, gap, earlier);
            }
            let (gap, last_gap) = split_mut::<S, R>(gap);
            let (earlier, last_earlier) = split_mut::<S, R>(earlier);
            extrapolate_single(simd, extrapolation.reach, gap, earlier);
            extrapolate_single(REST, extrapolation.reach, last_gap, last_earlier);
            for (last_step, p) in last_step.iter_mut().zip(&*pressure) {
                *last_step = marked_by_pressure(0.0, *p, self.hardness);
            }
        }
        if YIELDS {
            let hardness = self.hardness;
            let bounded = sum_by(pressure, pressure, |p, _| p.clamp(0.0, hardness));
            self.bounded_sum.push(bounded);
        }
        let reference_pressure = self.reference_pressure.set_row(row, pressure);
        split(pressure, reference_pressure, self.pressure_increment.row(row));
        self.reference_sum.push(sum_by(
            reference_pressure,
            reference_pressure,
            |reference_pressure, _| f64::from(reference_pressure),
        ));
        if let Expected::AsHighAs(lowest) = self.expected {
            let heights = row.of(self.heights);
            self.limited_gap.hold_low::<S, R>(simd, level, lowest, heights);
        }
        let limited_gap = match self.expected {
            Expected::All => gap,
            Expected::Near(_) | Expected::AsHighAs(_) => self.limited_gap.of::<S, R>(simd, gap),
        };
        let (residual, seen) = (&mut self.row, &mut self.seen);
        let always = self.active.always;
        let mut found = self.active.row(row);
        found.active.fill(true);
        self.response.residual_row::<S, R, YIELDS>(
            simd,
            residual,
            limited_gap,
            last_step,
            &mut found,
            seen,
        );
        let groups = self.pressure_increment.row(row).as_chunks_mut::<LANES>().0;
        for (active, increments) in found.active.iter_mut().zip(groups) {
            *active |= always || increments.iter().any(|increment| *increment != 0.0);
            if !*active {
                // Clipping leaves −0, too.
                increments.fill(-0.0);
            }
        }
        self.residual.add_row::<S, R>(simd, row, residual, last_step, found.free);
    }

    fn split_off(&mut self, row: Row) -> Self {
        let extrapolation = self.extrapolation.as_mut();
        Self {
            extrapolation: extrapolation.map(|extrapolation| Extrapolation {
                reach: extrapolation.reach,
                earlier_pressure: extrapolation.earlier_pressure.split_off(row),
                earlier_gap: extrapolation.earlier_gap.split_off(row),
            }),
            gap: self.gap.split_off(row),
            last_step: self.last_step.split_off(row),
            active: self.active.split_off(row),
            residual: self.residual.split_off(row),
            limited_gap: self.limited_gap.clone(),
            row: self.row.clone(),
            reference_pressure: self.reference_pressure.split_off(row),
            pressure_increment: self.pressure_increment.split_off(row),
            seen: InOrder::new(),
            reference_sum: InOrder::new(),
            bounded_sum: InOrder::new(),
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.seen.append(later.seen);
        self.reference_sum.append(later.reference_sum);
        self.bounded_sum.append(later.bounded_sum);
    }
}

#[inline(always)]
fn split(pressure: &[f64], reference_pressure: &[f32], increment: &mut [f32]) {
    for ((p, reference_pressure), increment) in
        pressure.iter().zip(reference_pressure).zip(increment)
    {
        *increment = (p - f64::from(*reference_pressure)) as f32;
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

/// Extrapolates pressures linearly in the load, in place, and saves the last pressures in
/// `earlier`.
///
/// Nodes at the hardness under both previous loads are set to exactly the hardness: `earlier` is in
/// single precision, so that their difference is only a rounding error. Other extrapolated
/// pressures are not clipped here and may exceed the hardness.
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

/// Constants that turn increments into pressures after the pending update of the last step, for a
/// reference pressure of zero.
#[derive(Clone, Copy)]
pub struct AppliedUpdate {
    scale: f32,
    taken_back: f32,
    ceiling: f32,
}

impl AppliedUpdate {
    pub fn new(pending: PendingUpdate, ceiling: f64) -> Self {
        Self {
            scale: pending.of_pressure() as f32,
            taken_back: (1.0 - pending.part) as f32,
            ceiling: ceiling as f32,
        }
    }

    /// Returns the pressure of a node after the update, clipped at its bounds. The last step is
    /// undone in part if its flag [`FREE`] is set.
    #[inline(always)]
    fn pressure(&self, increment: f32, last_step: f32) -> f32 {
        let step = weight::<f32>(has(last_step, FREE)) * last_step;
        // Rounding must not leave a pressure below zero or above the ceiling.
        greater(self.scale * increment - self.taken_back * step, 0.0).min(self.ceiling)
    }
}

pub enum StartPressure<'a> {
    FromCoarserMesh(Prolonged<'a>),
    FromLastIteration(AppliedUpdate),
}

impl StartPressure<'_> {
    #[inline(always)]
    fn set_row(&mut self, row: Row, pressure: &mut [f32], increment: &[f32], last_step: &[f32]) {
        match self {
            Self::FromCoarserMesh(prolonged) => prolonged.set_row(row, pressure),
            Self::FromLastIteration(update) => {
                let nodes = increment.iter().zip(last_step);
                for (p, (increment, last_step)) in pressure.iter_mut().zip(nodes) {
                    *p = update.pressure(*increment, *last_step);
                }
            }
        }
    }

    fn split_off(&self) -> Self {
        match self {
            Self::FromCoarserMesh(prolonged) => Self::FromCoarserMesh(prolonged.split_off()),
            Self::FromLastIteration(update) => Self::FromLastIteration(*update),
        }
    }
}

/// Pass that writes the initial pressures as input of the convolution. It sets the gap to −(h +
/// `reference`) with the height h; displacements are added after the convolution.
pub struct BeginPressed<'a, const YIELDS: bool> {
    pub start: StartPressure<'a>,
    pub ceiling: f32,
    pub heights: &'a [f32],
    pub reference: f32,
    pub gap: Band<'a, f32>,
    pub pressure_increment: Band<'a, f32>,
    /// Last steps, which are set to zero, with flags that follow from the pressure.
    pub last_step: Band<'a, f32>,
    pub active: ActiveBand<'a>,
    pub sums: InOrder<PressedSums>,
}

#[derive(Clone, Copy)]
pub struct PressedSums {
    pub pressure: f64,
    pub pressure_on_height: f64,
    pub saturated_nodes: f64,
}

impl Accumulate for PressedSums {
    const ZERO: Self = Self { pressure: 0.0, pressure_on_height: 0.0, saturated_nodes: 0.0 };

    fn add(&mut self, later: Self) {
        self.pressure += later.pressure;
        self.pressure_on_height += later.pressure_on_height;
        self.saturated_nodes += later.saturated_nodes;
    }
}

impl<const YIELDS: bool> Pass<f32> for BeginPressed<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let (increment, last_step) = (self.pressure_increment.row(row), self.last_step.row(row));
        self.start.set_row(row, values, increment, last_step);
        let heights = row.of(self.heights);
        for (gap, height) in self.gap.row(row).iter_mut().zip(heights) {
            *gap = -(height + self.reference);
        }
        let ceiling = self.ceiling;
        let saturated = if YIELDS { SATURATED } else { 0 };
        let mut saturated_nodes = 0;
        for (last_step, p) in last_step.iter_mut().zip(&*values) {
            let bears = u32::from(*p >= ceiling);
            let pressed = PRESSED * u32::from(*p > 0.0);
            *last_step = f32::from_bits(pressed | (saturated * bears));
            saturated_nodes += bears;
        }
        increment.copy_from_slice(values);
        let always = self.active.always;
        let groups = self.active.row(row);
        groups.free.fill(false);
        let increments = increment.as_chunks_mut::<LANES>().0;
        for (active, increments) in groups.active.iter_mut().zip(increments) {
            *active = always || increments.iter().any(|increment| *increment > 0.0);
            if !*active {
                // Clipping leaves −0, too.
                increments.fill(-0.0);
            }
        }
        self.sums.push(PressedSums {
            pressure: total(values),
            pressure_on_height: sum_by(values, heights, |p, height| p * height),
            saturated_nodes: f64::from(saturated_nodes),
        });
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self {
            start: self.start.split_off(),
            gap: self.gap.split_off(row),
            pressure_increment: self.pressure_increment.split_off(row),
            last_step: self.last_step.split_off(row),
            active: self.active.split_off(row),
            sums: InOrder::new(),
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.sums.append(later.sums);
    }
}

/// Pass that sets a map to s p − (g − `offset`), with the pressure p, the gap g and s =
/// `compliance`, for a reference pressure of zero.
pub struct PressureLessGap<'a> {
    pub compliance: f32,
    pub offset: f32,
    pub update: AppliedUpdate,
    pub pressure_increment: &'a [f32],
    pub last_step: &'a [f32],
    pub gap: &'a [f32],
    pub peak_pressure: f32,
}

impl Pass<f32> for PressureLessGap<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let pressed = row.of(self.pressure_increment).iter().zip(row.of(self.last_step));
        let nodes = pressed.zip(row.of(self.gap));
        let mut peak = 0.0_f32;
        for (value, ((increment, last_step), gap)) in values.iter_mut().zip(nodes) {
            let p = self.update.pressure(*increment, *last_step);
            *value = self.compliance * p - (gap - self.offset);
            peak = greater(peak, p);
        }
        self.peak_pressure = greater(self.peak_pressure, peak);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, later: Self) {
        self.peak_pressure = greater(self.peak_pressure, later.peak_pressure);
    }
}

/// Tolerance below which pressures are stored as increments to a reference pressure.
///
/// Single precision rounds a pressure by 6e-8 of its value, and a gap by about 6e-8 mesh steps at
/// unit rms slope.
const FINE: f64 = 1e-5;

/// Reference pressure of the iterations: zero, or a map if the tolerance is small.
pub struct ReferencePressure {
    zeros: Vec<f32>,
    rows: usize,
    map: Vec<f32>,
}

impl ReferencePressure {
    pub fn new([rows, row_nodes]: [usize; 2]) -> Self {
        Self { zeros: vec![0.0; row_nodes], rows, map: Vec::new() }
    }

    /// Allocates the map if iterations to a residual of `tolerance` require one, and otherwise
    /// empties it.
    pub fn prepare(&mut self, tolerance: f64) {
        let cells = self.rows * self.zeros.len();
        let is_map = Self::is_map(tolerance);
        self.map.resize(if is_map { cells } else { 0 }, 0.0);
    }

    pub fn clear(&mut self) {
        self.map.fill(0.0);
    }

    /// Returns whether iterations to this tolerance require a map instead of zero.
    pub fn is_map(tolerance: f64) -> bool {
        tolerance < FINE
    }

    #[inline(always)]
    pub fn row(&self, row: Row) -> &[f32] {
        self.map.get(row.range()).unwrap_or(&self.zeros)
    }

    pub fn band(&mut self) -> ReferenceBand<'_> {
        ReferenceBand {
            zeros: &self.zeros,
            map: (!self.map.is_empty()).then(|| Band::new(&mut self.map)),
        }
    }
}

/// Mutable access to consecutive rows of a reference pressure.
pub struct ReferenceBand<'a> {
    zeros: &'a [f32],
    map: Option<Band<'a, f32>>,
}

impl ReferenceBand<'_> {
    /// Sets a row of the map to `pressure` in single precision, and returns it. Without a map,
    /// returns a row of zeros.
    #[inline(always)]
    pub fn set_row(&mut self, row: Row, pressure: &[f64]) -> &[f32] {
        let Some(map) = &mut self.map else {
            return self.zeros;
        };
        let reference_pressure = map.row(row);
        for (reference_pressure, p) in reference_pressure.iter_mut().zip(pressure) {
            *reference_pressure = *p as f32;
        }
        reference_pressure
    }

    pub fn split_off(&mut self, row: Row) -> Self {
        Self { zeros: self.zeros, map: self.map.as_mut().map(|map| map.split_off(row)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_taken_back_leaves_pressures_as_they_were_before_it() {
        let (before, step) = ([0.5_f32, 0.0, 2.0, 1.0], [0.25_f32, 0.75, -2.0, 0.0]);
        let marked = step.map(|by| f32::from_bits(by.to_bits() & !0b111 | FREE));
        let after = [0, 1, 2, 3].map(|node| before[node] + step[node]);
        let left = |pending, ceiling| {
            let update = AppliedUpdate::new(pending, ceiling);
            [0, 1, 2, 3].map(|node| update.pressure(after[node], marked[node]))
        };
        let close = |found: [f32; 4], exact: [f32; 4]| {
            // The lowest bits of steps hold flags.
            let apart = found.iter().zip(exact).map(|(a, b)| (a - b).abs());
            assert!(apart.into_iter().all(|by| by < 1e-6), "{found:?}, {exact:?}");
        };
        close(left(PendingUpdate::ALL_BACK, f64::INFINITY), before);
        close(left(PendingUpdate::NONE, f64::INFINITY), after);
        let half = PendingUpdate { scale: 1.0, part: 0.5 };
        close(left(half, 0.8), [0.625, 0.375, 0.8, 0.8]);
        // Without the flag of free nodes the number is not a step.
        let update = AppliedUpdate::new(PendingUpdate::ALL_BACK, f64::INFINITY);
        let unmarked = f32::from_bits(0.25_f32.to_bits() & !FREE | PRESSED);
        assert_eq!(update.pressure(1.0, unmarked), 1.0);
    }
}
