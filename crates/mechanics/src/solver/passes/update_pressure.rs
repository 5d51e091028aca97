//! Pass that turns corrections into a step of the pressures.

use pulp::Simd;

use super::ReferencePressure;
use crate::fft::{Band, Row};
use crate::solver::blocks::TransposeOutput;
use crate::solver::lanes::{
    Accumulate, InOrder, Lanes, Pass, REST, Shared, split, split_mut, sum_over_groups,
};
use crate::solver::marks::{ALL, ActiveGroups, FREE, SATURATED, mark, mark_yielding};

/// Update of the pressures that remains to be applied after a step: scaling, and undoing a part of
/// the step.
#[derive(Debug, Clone, Copy)]
pub struct PendingUpdate {
    /// Factor of all pressures after the whole step.
    pub scale: f64,
    /// Fraction of the step, scaling included, that is kept.
    pub part: f64,
}

impl PendingUpdate {
    pub const NONE: Self = Self { scale: 1.0, part: 1.0 };

    pub const ALL_BACK: Self = Self { scale: 1.0, part: 0.0 };

    /// Returns the factor 1 + `part` (`scale` − 1) of the pressures. It is applied before the rest
    /// of the step is undone.
    pub fn of_pressure(self) -> f64 {
        1.0 + self.part * (self.scale - 1.0)
    }
}

/// Hardness as the sum of two single-precision numbers, so that differences from it are accurate.
#[derive(Debug, Clone, Copy)]
pub struct Ceiling {
    nearest: f32,
    rest: f32,
}

impl Ceiling {
    pub fn at(hardness: f64) -> Self {
        let nearest = hardness as f32;
        Self { nearest, rest: (hardness - f64::from(nearest)) as f32 }
    }
}

/// Pass over corrections that turns the corrections into a direction conjugate to the last step. It
/// changes the pressures along this direction, within the bounds of the pressures.
pub struct UpdatePressure<'a, const YIELDS: bool> {
    pub direction: Direction,
    pub ceiling: Ceiling,
    pub reference_pressure: &'a ReferencePressure,
    pub pressure_increment: Band<'a, f32>,
    pub active: &'a ActiveGroups,
    /// Output of the transpose of the extension, which is added to the corrections.
    pub transposed: TransposeOutput<'a>,
    pub last_step: Band<'a, f32>,
    pub gap: &'a [f32],
    pub heights: &'a [f32],
    pub sums: InOrder<Sums>,
}

impl<const YIELDS: bool> Pass<f32> for UpdatePressure<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f32]) {
        let active = self.active.row(row);
        self.transposed.add_to_row(row, values, self.active.free_row(row));
        let (values, last_values) = split_mut::<S, R>(values);
        let (reference_pressure, last_base) = split::<S, R>(self.reference_pressure.row(row));
        let (increment, last_increment) = split_mut::<S, R>(self.pressure_increment.row(row));
        let (last_step, rest_step) = split_mut::<S, R>(self.last_step.row(row));
        let (gap, last_gap) = split::<S, R>(row.of(self.gap));
        let (heights, last_heights) = split::<S, R>(row.of(self.heights));
        let direction = self.direction;
        let mut sums = direction.follow::<_, _, YIELDS>(
            simd,
            self.ceiling,
            active,
            values,
            reference_pressure,
            increment,
            last_step,
            gap,
            heights,
        );
        if !last_values.is_empty() {
            self.sums.push(sums);
            sums = direction.follow::<_, _, YIELDS>(
                REST,
                self.ceiling,
                &ALL[..last_values.len()],
                last_values,
                last_base,
                last_increment,
                rest_step,
                last_gap,
                last_heights,
            );
        }
        let increment = &*self.pressure_increment.row(row);
        sums.pressure_increment =
            sum_over_groups(active, increment, increment, |increment, _| f64::from(increment));
        self.sums.push(sums);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self {
            pressure_increment: self.pressure_increment.split_off(row),
            last_step: self.last_step.split_off(row),
            transposed: self.transposed.split_off(row),
            sums: InOrder::new(),
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.sums.append(later.sums);
    }
}

/// Coefficients of the direction, step length and pending update, the same for all nodes.
///
/// The pending update changes the pressure p by `of_pressure` × p + `of_step` × s, with the last
/// step s. The direction is −z + `beta` × s + `scaling` × p − `mean`, with the correction z.
#[derive(Clone, Copy)]
pub struct Direction {
    of_pressure: f32,
    of_step: f32,
    beta: f32,
    /// Factor of the pressure in the direction, because the pending update scales the pressures.
    scaling: f32,
    /// Number that is subtracted from the direction, so that a step keeps the mean pressure if
    /// nothing is clipped.
    mean: f32,
    pub step_length: f32,
}

impl Direction {
    /// Creates the direction −z − `mean` of a first step, with the correction z of each node, for
    /// pressures without a pending update.
    pub fn first(step_length: f64, mean: f64) -> Self {
        Self {
            of_pressure: 0.0,
            of_step: 0.0,
            beta: 0.0,
            scaling: 0.0,
            mean: mean as f32,
            step_length: step_length as f32,
        }
    }

    /// Creates the direction −z + β s − `mean`, with the correction z and the last step s of each
    /// node. The update `pending` of the last step is applied to pressures and steps.
    pub fn next(pending: PendingUpdate, beta: f64, step_length: f64, mean: f64) -> Self {
        let beta = beta * pending.part;
        Self {
            of_pressure: (pending.part * (pending.scale - 1.0)) as f32,
            of_step: (pending.part - 1.0) as f32,
            beta: beta as f32,
            scaling: (beta * (pending.scale - 1.0)) as f32,
            mean: mean as f32,
            step_length: step_length as f32,
        }
    }

    /// Returns the pressure of a free node after the step, before it is clipped. `correction` is
    /// the correction of the node, `pressure` its pressure before the pending update, and `last`
    /// its last step.
    #[inline(always)]
    pub fn unclipped(&self, correction: f32, pressure: f32, last: f32) -> f32 {
        let direction = self.scaling * pressure - correction - self.mean + self.beta * last;
        let due = self.of_pressure * pressure + self.of_step * last;
        pressure + due + self.step_length * direction
    }

    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "a row of each map")]
    fn follow<S: Simd, const R: usize, const YIELDS: bool>(
        self,
        simd: S,
        ceiling: Ceiling,
        active: &[bool],
        values: &mut [[S::f32s; R]],
        reference_pressure: &[[S::f32s; R]],
        increment: &mut [[S::f32s; R]],
        last_step: &mut [[S::f32s; R]],
        gap: &[[S::f32s; R]],
        heights: &[[S::f32s; R]],
    ) -> Sums {
        let of_pressure = Lanes::all(simd, self.of_pressure);
        let of_step = Lanes::all(simd, self.of_step);
        let beta = Lanes::all(simd, self.beta);
        let scaling = Lanes::all(simd, self.scaling);
        let mean = Lanes::all(simd, self.mean);
        let step_length = Lanes::all(simd, self.step_length);
        let nearest = Lanes::all(simd, ceiling.nearest);
        let rest = Lanes::all(simd, ceiling.rest);
        let zero = Lanes::all(simd, 0.0);
        let mut step_on_gap = zero;
        let mut pressure_on_gap = zero;
        let mut step_on_height = zero;
        let mut pressure_on_height = zero;
        let mut rounded = zero;

        let own = values.iter_mut().zip(reference_pressure).zip(increment).zip(last_step);
        let nodes = own.zip(gap.iter().zip(heights)).zip(active);
        for (((((value, b), increment), last_step), (g, h)), active) in nodes {
            if !active {
                *value = zero.numbers();
                continue;
            }
            let correction = Lanes::of(simd, *value);
            let (b, r) = (Lanes::of(simd, *b), Lanes::of(simd, *increment));
            let c = Lanes::of(simd, *last_step);
            let free = c.has(FREE);
            let last = free.or_zero(c);
            let direction = (scaling * (b + r) - correction - mean).plus(beta, last);
            let due = (of_pressure * (b + r)).plus(of_step, last);
            let old = r + due;
            let moved = old.plus(step_length, direction).max(-b);
            let new = if YIELDS {
                let top = (nearest - b) + rest;
                let fixed = c.has(SATURATED).choose(top, -b);
                free.choose(moved.min(top), fixed)
            } else {
                free.choose(moved, -b)
            };
            // The step is the difference of stored pressures, so that it includes their rounding.
            let m = (new - r) - due;
            let next = free.or_zero(m);
            *value = m.numbers();
            *increment = new.numbers();
            let pressed = (-b).is_below(new);
            let (p, g, h) = (b + new, Lanes::of(simd, *g), Lanes::of(simd, *h));
            step_on_gap = step_on_gap.plus(m, g);
            if YIELDS {
                let elastic = pressed & new.is_below((nearest - b) + rest);
                let saturated = pressed.unless(elastic);
                *last_step = mark_yielding(next, free, pressed, saturated).numbers();
                rounded = rounded + saturated.or_zero(((nearest - b) - new) + rest);
                pressure_on_gap = pressure_on_gap.plus(elastic.or_zero(p), g);
                continue;
            }
            *last_step = mark(next, free, pressed).numbers();
            pressure_on_gap = pressure_on_gap.plus(p, g);
            step_on_height = step_on_height.plus(m, h);
            pressure_on_height = pressure_on_height.plus(p, h);
        }
        Sums {
            pressure_increment: 0.0,
            rounded: rounded.total(),
            step_on_gap: step_on_gap.total(),
            pressure_on_gap: pressure_on_gap.total(),
            step_on_height: step_on_height.total(),
            pressure_on_height: pressure_on_height.total(),
        }
    }
}

/// Sums over the mesh for a step along a direction, clipped but not yet scaled. If the material
/// yields, sums over heights are zero.
#[derive(Default, Clone, Copy)]
pub struct Sums {
    /// Σ (pressure after the step − reference pressure), in double precision.
    pub pressure_increment: f64,
    /// Amount to add to `pressure_increment`, because the stored increments of saturated nodes are
    /// rounded.
    pub rounded: f64,
    pub step_on_gap: f64,
    /// Σ p × gap, with the pressure p after the step; over elastic nodes only, if the material
    /// yields.
    pub pressure_on_gap: f64,
    pub step_on_height: f64,
    pub pressure_on_height: f64,
}

impl Accumulate for Sums {
    fn add(&mut self, later: Self) {
        self.pressure_increment += later.pressure_increment;
        self.rounded += later.rounded;
        self.step_on_gap += later.step_on_gap;
        self.pressure_on_gap += later.pressure_on_gap;
        self.step_on_height += later.step_on_height;
        self.pressure_on_height += later.pressure_on_height;
    }
}
