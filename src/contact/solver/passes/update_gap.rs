//! From the displacement under a move to the gap after it, and to what is asked of the next.

use pulp::Simd;

use super::super::flags::{FREE, PRESSED, mark};
use super::super::lanes::{Lanes, Pass, REST, split, split_mut};
use super::super::survey::Extremes;
use super::sample::Sample;
use crate::contact::fft::Row;

/// Moves the gap by the displacement of a move, frees nodes, and leaves what the next correction is
/// to close: the gap of free nodes and its extension over the others.
pub struct UpdateGap<'a> {
    pub response: GapUpdate,
    pub heights: &'a [f32],
    pub gap: &'a mut [f32],
    /// Moves of free nodes, extension on the others.
    pub carry: &'a mut [f32],
    pub sample: &'a mut Sample,
    pub seen: Seen,
}

/// What each node does.
#[derive(Clone, Copy)]
pub struct GapUpdate {
    /// Level of the gap after the move.
    pub offset: f32,
    /// How far it rose.
    pub rise: f32,
    /// Of the displacement under the move before it is scaled.
    pub on_move: f32,
    /// Of the displacement under the pressure before the move.
    pub on_pressure: f32,
    /// Subtracted from gaps.
    pub reference: f32,
    /// The mark of nodes that may have pressure.
    pub pressed: u32,
    /// How much of the extension is kept.
    pub memory: f32,
}

/// What is seen on the way.
#[derive(Clone, Copy)]
pub struct Seen {
    pub free_nodes: f64,
    pub extremes: Extremes,
}

impl Seen {
    pub const NOTHING: Self = Self {
        free_nodes: 0.0,
        extremes: Extremes::NONE,
    };
}

impl Pass<f32> for UpdateGap<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f32]) {
        let response = self.response;
        {
            let (values, last_values) = split_mut::<S, R>(values);
            let (gap, last_gap) = split_mut::<S, R>(row.of_mut(self.gap));
            let (heights, last_heights) = split::<S, R>(row.of(self.heights));
            response.shift(simd, values, gap, heights);
            response.shift(REST, last_values, last_gap, last_heights);
        }
        self.sample.keep(row, values);
        let (gap, carry) = (row.of(self.gap), row.of_mut(self.carry));
        response.ask_row::<S, R>(simd, values, gap, carry, &mut self.seen);
    }
}

impl GapUpdate {
    /// To a gap that has not moved, and that nothing extends.
    pub fn to_a_start(offset: f64) -> Self {
        Self {
            offset: offset as f32,
            rise: 0.0,
            on_move: 0.0,
            on_pressure: 0.0,
            reference: 0.0,
            pressed: PRESSED,
            memory: 0.0,
        }
    }

    /// Moves gaps, and turns displacements into those under the whole move.
    #[inline(always)]
    fn shift<S: Simd, const R: usize>(
        self,
        simd: S,
        values: &mut [[S::f32s; R]],
        gap: &mut [[S::f32s; R]],
        heights: &[[S::f32s; R]],
    ) {
        let on_move = Lanes::all(simd, self.on_move);
        let on_pressure = Lanes::all(simd, self.on_pressure);
        let reference = Lanes::all(simd, self.reference);
        for ((value, gap), height) in values.iter_mut().zip(gap).zip(heights) {
            let (g, h) = (Lanes::of(simd, *gap), Lanes::of(simd, *height));
            let displacement = g + h + reference;
            let image = (on_pressure * displacement).plus(on_move, Lanes::of(simd, *value));
            *value = image.numbers();
            *gap = (g + image).numbers();
        }
    }

    /// Turns a row of displacements into what the next correction is to close.
    #[inline(always)]
    pub fn ask_row<S: Simd, const R: usize>(
        self,
        simd: S,
        values: &mut [f32],
        gap: &[f32],
        carry: &mut [f32],
        seen: &mut Seen,
    ) {
        let (values, last_values) = split_mut::<S, R>(values);
        let (gap, last_gap) = split::<S, R>(gap);
        let (carry, last_carry) = split_mut::<S, R>(carry);
        self.ask(simd, values, gap, carry, seen);
        if !last_values.is_empty() {
            self.ask(REST, last_values, last_gap, last_carry, seen);
        }
    }

    #[inline(always)]
    fn ask<S: Simd, const R: usize>(
        self,
        simd: S,
        values: &mut [[S::f32s; R]],
        gap: &[[S::f32s; R]],
        carry: &mut [[S::f32s; R]],
        seen: &mut Seen,
    ) {
        let offset = Lanes::all(simd, self.offset);
        let rise = Lanes::all(simd, self.rise);
        let memory = Lanes::all(simd, self.memory);
        let (zero, one) = (Lanes::all(simd, 0.0), Lanes::all(simd, 1.0));
        let mut free_nodes = zero;
        let mut highest = Lanes::all(simd, -f32::MAX);
        let mut lowest = Lanes::all(simd, f32::MAX);
        for ((value, gap), carry) in values.iter_mut().zip(gap).zip(carry) {
            let (g, c) = (Lanes::of(simd, *gap), Lanes::of(simd, *carry));
            let above = g - offset;
            let was_free = c.has(FREE);
            let pressed = c.has(self.pressed);
            let free = pressed | above.is_below(zero);
            highest = pressed.choose(highest.max(g), highest);
            lowest = lowest.min(g);
            free_nodes = free_nodes + free.or_zero(one);
            let extended = c + Lanes::of(simd, *value) - rise;
            let extension = memory * was_free.choose(above, extended);
            *value = free.choose(above, extension).numbers();
            let next = free.choose(was_free.or_zero(c), extension);
            *carry = mark(next, free, pressed).numbers();
        }
        seen.free_nodes += free_nodes.total();
        seen.extremes.add(highest, lowest);
    }
}
