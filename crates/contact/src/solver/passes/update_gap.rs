//! Pass that turns the displacement under a step into the next gap and residual.

use pulp::Simd;

use super::peek::SampleBand;
use crate::fft::{Band, Row};
use crate::solver::evaluation::Extremes;
use crate::solver::extension::ResidualRows;
use crate::solver::flags::{
    ALL, ActiveBand, FREE, GroupsOfRow, PRESSED, SATURATED, mark, mark_yielding,
};
use crate::solver::lanes::{Accumulate, InOrder, Lanes, Pass, REST, split, split_mut};

/// Pass over displacements under a step that adds them to the gap, updates the flags of the nodes,
/// and computes the residual of free nodes.
///
/// Free nodes have pressure or penetrate. If the material yields, saturated nodes are free only if
/// their gap is open.
pub struct UpdateGap<'a, const YIELDS: bool> {
    pub response: GapUpdate,
    pub heights: &'a [f32],
    pub gap: Band<'a, f32>,
    pub last_step: Band<'a, f32>,
    pub active: ActiveBand<'a>,
    pub residual: ResidualRows<'a>,
    pub sample: SampleBand<'a>,
    pub seen: InOrder<GapSums>,
}

/// Constants of the update of the gap, the same for all nodes.
#[derive(Clone, Copy)]
pub struct GapUpdate {
    pub offset: f32,
    /// Factor of the displacement under the clipped step, in the change of the gap.
    pub on_step: f32,
    /// Factor of the displacement under the pressure before the step, in the change of the gap.
    pub on_pressure: f32,
    pub reference: f32,
    /// Flag of nodes with pressure: [`PRESSED`], or [`FREE`] if a part of the step is undone.
    pub pressed: u32,
}

/// Counts of nodes, and sums and extremes of their gaps.
#[derive(Clone, Copy)]
pub struct GapSums {
    pub free_nodes: f64,
    pub extremes: Extremes,
    /// Number of nodes with pressure that are not saturated, if the material yields.
    pub elastic_nodes: f64,
    /// Σ (gap − offset) over elastic nodes.
    pub elastic_sum: f64,
    /// Σ (gap − offset) over free nodes.
    pub free_sum: f64,
}

impl Accumulate for GapSums {
    const ZERO: Self = Self {
        free_nodes: 0.0,
        extremes: Extremes::NONE,
        elastic_nodes: 0.0,
        elastic_sum: 0.0,
        free_sum: 0.0,
    };

    fn add(&mut self, later: Self) {
        self.free_nodes += later.free_nodes;
        self.extremes.add(later.extremes);
        self.elastic_nodes += later.elastic_nodes;
        self.elastic_sum += later.elastic_sum;
        self.free_sum += later.free_sum;
    }
}

impl<const YIELDS: bool> Pass<f32> for UpdateGap<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f32]) {
        let response = self.response;
        {
            let (values, last_values) = split_mut::<S, R>(values);
            let (gap, last_gap) = split_mut::<S, R>(self.gap.row(row));
            let (heights, last_heights) = split::<S, R>(row.of(self.heights));
            response.shift(simd, values, gap, heights);
            response.shift(REST, last_values, last_gap, last_heights);
        }
        self.sample.keep(row, values);
        let (gap, last_step) = (self.gap.row(row), self.last_step.row(row));
        let always = self.active.always;
        let mut groups = self.active.row(row);
        response.residual_row::<S, R, YIELDS>(
            simd,
            values,
            gap,
            last_step,
            &mut groups,
            &mut self.seen,
        );
        if always {
            groups.active.fill(true);
        }
        self.residual.add_row::<S, R>(simd, row, values, last_step, groups.free);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self {
            gap: self.gap.split_off(row),
            last_step: self.last_step.split_off(row),
            active: self.active.split_off(row),
            residual: self.residual.split_off(row),
            sample: self.sample.split_off(row),
            seen: InOrder::new(),
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.seen.append(later.seen);
    }
}

impl GapUpdate {
    /// Returns the update that leaves the gaps as they are, so that only the residual gap −
    /// `offset` is computed.
    pub fn without_step(offset: f64) -> Self {
        Self {
            offset: offset as f32,
            on_step: 0.0,
            on_pressure: 0.0,
            reference: 0.0,
            pressed: PRESSED,
        }
    }

    /// Returns whether a part of the step is undone, so that nodes that it saturated are elastic
    /// again.
    #[inline(always)]
    fn takes_back(self) -> bool {
        self.pressed == FREE
    }

    /// Turns the displacements `values` under the clipped step into displacements under the scaled
    /// step, and adds these to the gaps.
    #[inline(always)]
    fn shift<S: Simd, const R: usize>(
        self,
        simd: S,
        values: &mut [[S::f32s; R]],
        gap: &mut [[S::f32s; R]],
        heights: &[[S::f32s; R]],
    ) {
        let on_step = Lanes::all(simd, self.on_step);
        let on_pressure = Lanes::all(simd, self.on_pressure);
        let reference = Lanes::all(simd, self.reference);
        for ((value, gap), height) in values.iter_mut().zip(gap).zip(heights) {
            let (g, h) = (Lanes::of(simd, *gap), Lanes::of(simd, *height));
            let displacement = g + h + reference;
            let image = (on_pressure * displacement).plus(on_step, Lanes::of(simd, *value));
            *value = image.numbers();
            *gap = (g + image).numbers();
        }
    }

    /// Writes a row of the residual, gap − `offset` at free nodes and zero at other nodes, in
    /// groups with a free node.
    ///
    /// Also updates the flags in `last_step` and the marks in `groups`, and appends the sums over
    /// the row to `seen`.
    #[inline(always)]
    pub fn residual_row<S: Simd, const R: usize, const YIELDS: bool>(
        self,
        simd: S,
        values: &mut [f32],
        gap: &[f32],
        last_step: &mut [f32],
        groups: &mut GroupsOfRow,
        seen: &mut InOrder<GapSums>,
    ) {
        let (values, last_values) = split_mut::<S, R>(values);
        let (gap, last_gap) = split::<S, R>(gap);
        let (last_step, rest_step) = split_mut::<S, R>(last_step);
        seen.push(self.residual::<_, _, YIELDS>(simd, groups, values, gap, last_step));
        if !last_values.is_empty() {
            let [mut active, mut free] = [ALL; 2];
            let mut rest = GroupsOfRow {
                active: &mut active[..last_values.len()],
                free: &mut free[..last_values.len()],
            };
            seen.push(self.residual::<_, _, YIELDS>(
                REST,
                &mut rest,
                last_values,
                last_gap,
                rest_step,
            ));
        }
    }

    #[inline(always)]
    fn residual<S: Simd, const R: usize, const YIELDS: bool>(
        self,
        simd: S,
        groups: &mut GroupsOfRow,
        values: &mut [[S::f32s; R]],
        gap: &[[S::f32s; R]],
        last_step: &mut [[S::f32s; R]],
    ) -> GapSums {
        let offset = Lanes::all(simd, self.offset);
        let (zero, one) = (Lanes::all(simd, 0.0), Lanes::all(simd, 1.0));
        let mut free_nodes = zero;
        let mut highest = Lanes::all(simd, -f32::MAX);
        let mut lowest = Lanes::all(simd, f32::MAX);
        let mut elastic_nodes = zero;
        let mut elastic_sum = zero;
        let mut free_sum = zero;
        let groups = groups.active.iter_mut().zip(&mut *groups.free);
        let nodes = values.iter_mut().zip(gap).zip(last_step).zip(groups);
        for (((value, gap), last_step), (active, has_free)) in nodes {
            let g = Lanes::of(simd, *gap);
            let above = g - offset;
            let below = above.is_below(zero);
            if !*active && !below.any() {
                lowest = lowest.min(g);
                continue;
            }
            let c = Lanes::of(simd, *last_step);
            let was_free = c.has(FREE);
            let mut pressed = c.has(self.pressed);
            let mut free = pressed | below;
            let mut saturated = zero.is_below(zero);
            let mut lower = lowest.min(g);
            if YIELDS {
                saturated = c.has(SATURATED);
                if self.takes_back() {
                    saturated = saturated.unless(was_free);
                }
                pressed = pressed | saturated;
                free = free.unless(saturated) | (saturated & zero.is_below(above));
                lower = saturated.choose(lowest, lower);
                let elastic = pressed.unless(saturated);
                elastic_nodes = elastic_nodes + elastic.or_zero(one);
                elastic_sum = elastic_sum + elastic.or_zero(above);
                free_sum = free_sum + free.or_zero(above);
            }
            highest = pressed.choose(highest.max(g), highest);
            lowest = lower;
            free_nodes = free_nodes + free.or_zero(one);
            *value = free.or_zero(above).numbers();
            *has_free = free.any();
            *active = if YIELDS { (free | pressed).any() } else { *has_free };
            let next = (free & was_free).or_zero(c);
            *last_step = if YIELDS {
                mark_yielding(next, free, pressed, saturated).numbers()
            } else {
                mark(next, free, pressed).numbers()
            };
        }
        let mut seen = GapSums {
            free_nodes: free_nodes.total(),
            extremes: Extremes::of(highest, lowest),
            ..GapSums::ZERO
        };
        if YIELDS {
            seen.elastic_nodes = elastic_nodes.total();
            seen.elastic_sum = elastic_sum.total();
            seen.free_sum = free_sum.total();
        }
        seen
    }
}
