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
use crate::solver::flags::{ActiveBand, FREE, PRESSED, SATURATED, has};
use crate::solver::lanes::{Accumulate, InOrder, LANES, Pass, greater, sum_by, total, weight};
use crate::solver::prolongation::Prolonged;

/// Pass over pressures that computes the first residual from their gaps.
pub struct InitialResidual<'a, const YIELDS: bool> {
    pub response: GapUpdate,
    pub gap: &'a [f32],
    pub hardness: f64,
    /// Last steps, of which the flags are updated.
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

impl<const YIELDS: bool> Pass<f64> for InitialResidual<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, pressure: &mut [f64]) {
        let last_step = self.last_step.row(row);
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
        let (residual, seen) = (&mut self.row, &mut self.seen);
        let always = self.active.always;
        let mut found = self.active.row(row);
        found.active.fill(true);
        self.response.residual_row::<S, R, YIELDS>(
            simd,
            residual,
            row.of(self.gap),
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
        Self {
            last_step: self.last_step.split_off(row),
            active: self.active.split_off(row),
            residual: self.residual.split_off(row),
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
