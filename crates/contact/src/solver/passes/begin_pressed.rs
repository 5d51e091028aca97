//! From the pressures with which a search in single precision begins to their gap, and from where it ends to what a finer
//! mesh takes up. Increments are all there is of such pressures.

use pulp::Simd;

use super::super::active_groups::ActiveBand;
use super::super::flags::{FREE, PRESSED, SATURATED, has};
use super::super::in_order::{Found, InOrder};
use super::super::lanes::{LANES, Pass, greater, sum_by, total, weight};
use super::prolong::Prolonged;
use super::update_pressure::PendingUpdate;
use crate::fft::{Band, Row};

/// What makes pressures of increments and moves when a search ends.
#[derive(Clone, Copy)]
pub struct LastMoveDone {
    scale: f32,
    taken_back: f32,
    ceiling: f32,
}

impl LastMoveDone {
    pub fn new(pending: PendingUpdate, ceiling: f64) -> Self {
        Self {
            scale: pending.of_pressure() as f32,
            taken_back: (1.0 - pending.part) as f32,
            ceiling: ceiling as f32,
        }
    }

    /// Of an increment, and a move if it is marked as that of a free node.
    #[inline(always)]
    fn pressure(&self, increment: f32, carry: f32) -> f32 {
        let last_move = weight::<f32>(has(carry, FREE)) * carry;
        // Rounding must not leave a pressure below zero, or above the ceiling.
        greater(self.scale * increment - self.taken_back * last_move, 0.0).min(self.ceiling)
    }
}

/// The pressures from which a search is to go on.
pub enum StartPressure<'a> {
    OfCoarserMesh(Prolonged<'a>),
    OfLastMove(LastMoveDone),
}

impl StartPressure<'_> {
    #[inline(always)]
    fn set_row(&mut self, row: Row, pressure: &mut [f32], increment: &[f32], carry: &[f32]) {
        match self {
            Self::OfCoarserMesh(prolonged) => prolonged.set_row(row, pressure),
            Self::OfLastMove(done) => {
                let nodes = increment.iter().zip(carry);
                for (p, (increment, carry)) in pressure.iter_mut().zip(nodes) {
                    *p = done.pressure(*increment, *carry);
                }
            }
        }
    }

    fn split_off(&self) -> Self {
        match self {
            Self::OfCoarserMesh(prolonged) => Self::OfCoarserMesh(prolonged.split_off()),
            Self::OfLastMove(done) => Self::OfLastMove(*done),
        }
    }
}

/// Begins the convolution of the pressures, from which the search is to go on: with the gap that there is
/// without any, which their displacement is to be added to.
pub struct BeginPressed<'a, const YIELDS: bool> {
    pub start: StartPressure<'a>,
    pub ceiling: f32,
    pub heights: &'a [f32],
    /// Subtracted from gaps.
    pub reference: f32,
    pub gap: Band<'a, f32>,
    pub increment: Band<'a, f32>,
    /// Marked by pressure; no node has moved yet.
    pub carry: Band<'a, f32>,
    /// Set where there is pressure.
    pub active: ActiveBand<'a>,
    pub sums: InOrder<PressedSums>,
}

/// Sums over the mesh.
#[derive(Clone, Copy)]
pub struct PressedSums {
    pub pressure: f64,
    /// Σ pressure × height.
    pub pressure_on_height: f64,
    pub saturated_nodes: f64,
}

impl Found for PressedSums {
    const NOTHING: Self = Self { pressure: 0.0, pressure_on_height: 0.0, saturated_nodes: 0.0 };

    fn add(&mut self, later: Self) {
        self.pressure += later.pressure;
        self.pressure_on_height += later.pressure_on_height;
        self.saturated_nodes += later.saturated_nodes;
    }
}

impl<const YIELDS: bool> Pass<f32> for BeginPressed<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let (increment, carry) = (self.increment.row(row), self.carry.row(row));
        self.start.set_row(row, values, increment, carry);
        let heights = row.of(self.heights);
        for (gap, height) in self.gap.row(row).iter_mut().zip(heights) {
            *gap = -(height + self.reference);
        }
        let ceiling = self.ceiling;
        let saturated = if YIELDS { SATURATED } else { 0 };
        let mut saturated_nodes = 0;
        for (carry, p) in carry.iter_mut().zip(&*values) {
            let bears = u32::from(*p >= ceiling);
            let pressed = PRESSED * u32::from(*p > 0.0);
            *carry = f32::from_bits(pressed | (saturated * bears));
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
                // As clipping leaves them.
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
            increment: self.increment.split_off(row),
            carry: self.carry.split_off(row),
            active: self.active.split_off(row),
            sums: InOrder::new(),
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.sums.append(later.sums);
    }
}

/// Sets s × pressure − gap, of pressures that are increments. Goes over that map.
pub struct PressureLessGap<'a> {
    /// s
    pub compliance: f32,
    /// From which gaps are counted.
    pub offset: f32,
    pub done: LastMoveDone,
    pub increment: &'a [f32],
    pub carry: &'a [f32],
    pub gap: &'a [f32],
    pub peak_pressure: f32,
}

impl Pass<f32> for PressureLessGap<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let pressed = row.of(self.increment).iter().zip(row.of(self.carry));
        let nodes = pressed.zip(row.of(self.gap));
        let mut peak = 0.0_f32;
        for (value, ((increment, carry), gap)) in values.iter_mut().zip(nodes) {
            let p = self.done.pressure(*increment, *carry);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_taken_back_leaves_pressures_as_they_were_before_it() {
        let (before, last_move) = ([0.5_f32, 0.0, 2.0, 1.0], [0.25_f32, 0.75, -2.0, 0.0]);
        let marked = last_move.map(|by| f32::from_bits(by.to_bits() & !0b111 | FREE));
        let after = [0, 1, 2, 3].map(|node| before[node] + last_move[node]);
        let left = |pending, ceiling| {
            let done = LastMoveDone::new(pending, ceiling);
            [0, 1, 2, 3].map(|node| done.pressure(after[node], marked[node]))
        };
        let close = |found: [f32; 4], exact: [f32; 4]| {
            // Marks are in the lowest bits of moves.
            let apart = found.iter().zip(exact).map(|(a, b)| (a - b).abs());
            assert!(apart.into_iter().all(|by| by < 1e-6), "{found:?}, {exact:?}");
        };
        close(left(PendingUpdate::ALL_BACK, f64::INFINITY), before);
        close(left(PendingUpdate::NOTHING, f64::INFINITY), after);
        let half = PendingUpdate { scale: 1.0, part: 0.5 };
        close(left(half, 0.8), [0.625, 0.375, 0.8, 0.8]);
        // What is no move is not taken back.
        let done = LastMoveDone::new(PendingUpdate::ALL_BACK, f64::INFINITY);
        let unmarked = f32::from_bits(0.25_f32.to_bits() & !FREE | PRESSED);
        assert_eq!(done.pressure(1.0, unmarked), 1.0);
    }
}
