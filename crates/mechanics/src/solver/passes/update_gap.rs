//! Passes that compute gaps and the residual of free nodes: at the beginning of iterations, and
//! after a step.

use pulp::Simd;

use super::ReferenceBand;
use super::peek::SampleBand;
use crate::fft::{Band, Row};
use crate::solver::blocks::ResidualRows;
use crate::solver::lanes::{
    Accumulate, InOrder, LANES, Lanes, Pass, REST, Shared, split, split_mut, sum_by,
};
use crate::solver::marks::{
    ALL, ActiveBand, FREE, GroupsOfRow, PRESSED, SATURATED, mark, mark_yielding,
};

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
#[derive(Clone, Copy, Default)]
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
        let flags = groups.active.iter_mut().zip(&mut *groups.free);
        let nodes = values.iter_mut().zip(gap).zip(last_step).zip(flags);
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
            ..GapSums::default()
        };
        if YIELDS {
            seen.elastic_nodes = elastic_nodes.total();
            seen.elastic_sum = elastic_sum.total();
            seen.free_sum = free_sum.total();
        }
        seen
    }
}

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
        subtract(pressure, reference_pressure, self.pressure_increment.row(row));
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
fn subtract(pressure: &[f64], reference_pressure: &[f32], increment: &mut [f32]) {
    for ((p, reference_pressure), increment) in
        pressure.iter().zip(reference_pressure).zip(increment)
    {
        *increment = (p - f64::from(*reference_pressure)) as f32;
    }
}

/// Offset of the gaps, and their largest violation of the contact conditions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Mean gap in elastic contact, or an estimate of it if few or no nodes are elastic.
    pub offset: f64,
    /// Largest violation of the contact conditions by the gap above the offset: |gap − offset| in
    /// elastic contact, penetration outside contact, and positive gaps at saturated nodes.
    pub error: f64,
}

/// Highest gap in contact, and lowest gap of nodes that are not saturated.
#[derive(Debug, Clone, Copy)]
pub struct Extremes {
    pub highest_in_contact: f32,
    pub lowest: f32,
}

impl Default for Extremes {
    fn default() -> Self {
        Self { highest_in_contact: -f32::MAX, lowest: f32::MAX }
    }
}

impl Extremes {
    /// Returns the offset that violates the contact conditions least if all contact nodes are
    /// saturated.
    ///
    /// This is the mean of both extremes, or the highest gap if all nodes are saturated.
    pub fn middle(self) -> f64 {
        let highest = f64::from(self.highest_in_contact);
        if self.lowest == f32::MAX {
            return highest;
        }
        0.5 * (highest + f64::from(self.lowest))
    }

    pub fn convergence(self, offset: f64) -> Convergence {
        let highest = f64::from(self.highest_in_contact) - offset;
        let lowest = f64::from(self.lowest) - offset;
        Convergence { offset, error: highest.max(-lowest) }
    }

    #[inline(always)]
    pub fn of<S: Simd, const R: usize>(
        highest_in_contact: Lanes<S, R>,
        lowest: Lanes<S, R>,
    ) -> Self {
        Self { highest_in_contact: highest_in_contact.highest(), lowest: lowest.lowest() }
    }

    #[inline(always)]
    pub fn add(&mut self, others: Self) {
        self.highest_in_contact = self.highest_in_contact.max(others.highest_in_contact);
        self.lowest = self.lowest.min(others.lowest);
    }
}
