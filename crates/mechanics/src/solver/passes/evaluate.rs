//! Passes from displacements to gaps in double precision, and statistics of the gap.

use pulp::Simd;

use super::ReferencePressure;
use super::peek::SampleBand;
use super::update_gap::{Convergence, Extremes};
use crate::fft::{Band, Row};
use crate::solver::lanes::{
    Accumulate, InOrder, Lanes, Pass, REST, Shared, split, split_mut, sum_by, total, weight,
};
use crate::solver::marks::{FREE, PRESSED, SATURATED, has, mark, mark_yielding};

#[inline(always)]
pub fn promote(factor: f64, reference_pressure: &[f32], increment: &[f32], pressure: &mut [f64]) {
    for ((p, reference_pressure), increment) in
        pressure.iter_mut().zip(reference_pressure).zip(increment)
    {
        *p = factor * (f64::from(*reference_pressure) + f64::from(*increment));
    }
}

/// Pass over displacements u that computes the gaps u − h − `reference`, with the heights h, and
/// their statistics.
pub struct GapOutput<'a, const YIELDS: bool> {
    pub heights: &'a [f64],
    /// Number that is subtracted from gaps before they are rounded to single precision.
    pub reference: f64,
    pub gap: Band<'a, f32>,
    pub last_step: &'a [f32],
    pub sums_gaps: bool,
    pub statistics: InOrder<GapStatistics>,
}

impl<const YIELDS: bool> Pass<f64> for GapOutput<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f64]) {
        let gap = self.gap.row(row);
        above(values, row.of(self.heights), self.reference, gap);
        let last_step = row.of(self.last_step);
        let mut statistics = GapStatistics::new(self.sums_gaps);
        statistics.add_gaps::<YIELDS>(values, last_step);
        let (gap, last_gap) = split::<S, R>(gap);
        let (last_step, rest_step) = split::<S, R>(last_step);
        statistics.add::<_, _, YIELDS>(simd, gap, last_step);
        statistics.add::<_, _, YIELDS>(REST, last_gap, rest_step);
        self.statistics.push(statistics);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { gap: self.gap.split_off(row), statistics: InOrder::new(), ..*self }
    }

    fn append(&mut self, later: Self) {
        self.statistics.append(later.statistics);
    }
}

#[inline(always)]
fn above(values: &mut [f64], heights: &[f64], reference: f64, gap: &mut [f32]) {
    for ((gap, value), height) in gap.iter_mut().zip(values).zip(heights) {
        *value -= height + reference;
        *gap = *value as f32;
    }
}

/// Pass over the displacements after a step that computes the gaps. From the change of the gaps it
/// also computes the displacements under the step, and the curvature of the energy, Σ step ×
/// displacement.
pub struct StepOutput<'a, const YIELDS: bool> {
    pub heights: &'a [f64],
    pub reference: f64,
    pub scaling: StepScaling,
    pub sums_gaps: bool,
    pub statistics: InOrder<GapStatistics>,
    pub curvature: InOrder<f64>,
    pub reference_pressure: &'a ReferencePressure,
    pub pressure_increment: &'a [f32],
    pub gap: Band<'a, f32>,
    /// Steps of free nodes, to which the pass adds the scaling of their pressures. Steps of other
    /// nodes are set to zero.
    pub last_step: Band<'a, f32>,
    /// Storage of the displacements under the step, for a sample of rows.
    pub sample: SampleBand<'a>,
    pub found: Vec<f32>,
}

/// Scaling of the pressures after a step, and change of the reference, both the same for all nodes.
#[derive(Clone, Copy)]
pub struct StepScaling {
    pub scale: f32,
    pub reference_change: f32,
}

impl<const YIELDS: bool> Pass<f64> for StepOutput<'_, YIELDS> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f64]) {
        let heights = row.of(self.heights);
        above(values, heights, self.reference, &mut self.found);
        {
            let (found, last_found) = split_mut::<S, R>(&mut self.found);
            let (gap, last_gap) = split_mut::<S, R>(self.gap.row(row));
            let last_step = self.last_step.row(row);
            let mut statistics = GapStatistics::new(self.sums_gaps);
            statistics.add_gaps::<YIELDS>(values, last_step);
            let (last_step, rest_step) = split_mut::<S, R>(last_step);
            let (reference_pressure, last_base) = split::<S, R>(self.reference_pressure.row(row));
            let (increment, last_increment) = split::<S, R>(row.of(self.pressure_increment));
            statistics.add::<_, _, YIELDS>(simd, found, last_step);
            statistics.add::<_, _, YIELDS>(REST, last_found, rest_step);
            self.statistics.push(statistics);
            let scaling = self.scaling;
            let curvature = scaling.finish::<_, _, YIELDS>(
                simd,
                found,
                gap,
                last_step,
                reference_pressure,
                increment,
            );
            self.curvature.push(curvature);
            if !last_found.is_empty() {
                let curvature = scaling.finish::<_, _, YIELDS>(
                    REST,
                    last_found,
                    last_gap,
                    rest_step,
                    last_base,
                    last_increment,
                );
                self.curvature.push(curvature);
            }
        }
        self.sample.keep(row, &self.found);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self {
            statistics: InOrder::new(),
            curvature: InOrder::new(),
            gap: self.gap.split_off(row),
            last_step: self.last_step.split_off(row),
            sample: self.sample.split_off(row),
            found: vec![0.0; self.found.len()],
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.statistics.append(later.statistics);
        self.curvature.append(later.curvature);
    }
}

impl StepScaling {
    /// Stores the gaps `found` after a step in `gap`, replaces `found` by the displacements under
    /// the step, and adds the scaling of the pressures to `last_step`.
    ///
    /// Returns Σ step × displacement.
    #[inline(always)]
    fn finish<S: Simd, const R: usize, const YIELDS: bool>(
        self,
        simd: S,
        found: &mut [[S::f32s; R]],
        gap: &mut [[S::f32s; R]],
        last_step: &mut [[S::f32s; R]],
        reference_pressure: &[[S::f32s; R]],
        increment: &[[S::f32s; R]],
    ) -> f64 {
        let scaling = Lanes::all(simd, self.scale - 1.0);
        let reference_change = Lanes::all(simd, self.reference_change);
        let mut curvature = Lanes::all(simd, 0.0);
        let nodes = found.iter_mut().zip(gap).zip(last_step);
        for (((found, gap), last_step), (reference_pressure, increment)) in
            nodes.zip(reference_pressure.iter().zip(increment))
        {
            let image = Lanes::of(simd, *found) - Lanes::of(simd, *gap) + reference_change;
            *gap = *found;
            *found = image.numbers();
            let c = Lanes::of(simd, *last_step);
            let free = c.has(FREE);
            let pressure = Lanes::of(simd, *reference_pressure) + Lanes::of(simd, *increment);
            let scaled = c.plus(scaling, pressure);
            let step = if YIELDS {
                // Saturated pressures are not scaled.
                free.or_zero(c.has(SATURATED).choose(c, scaled))
            } else {
                free.or_zero(scaled)
            };
            curvature = curvature.plus(step, image);
            let pressed = c.has(PRESSED);
            *last_step = if YIELDS {
                mark_yielding(step, free, pressed, c.has(SATURATED)).numbers()
            } else {
                mark(step, free, pressed).numbers()
            };
        }
        curvature.total()
    }
}

/// Counts of nodes, and sums and extremes of the gap.
#[derive(Debug, Clone, Copy, Default)]
pub struct GapStatistics {
    pub contact_nodes: f64,
    pub elastic_nodes: f64,
    /// Σ gap over elastic nodes, in double precision.
    pub elastic_sum: f64,
    /// Σ gap over saturated nodes, in double precision.
    pub saturated_sum: f64,
    /// Σ gap over the map; `None` if displacements have zero mean.
    pub gap_sum: Option<f64>,
    extremes: Extremes,
}

impl Accumulate for GapStatistics {
    fn add(&mut self, later: Self) {
        self.contact_nodes += later.contact_nodes;
        self.elastic_nodes += later.elastic_nodes;
        self.elastic_sum += later.elastic_sum;
        self.saturated_sum += later.saturated_sum;
        if let Some(sum) = later.gap_sum {
            self.gap_sum = Some(self.gap_sum.unwrap_or(0.0) + sum);
        }
        self.extremes.add(later.extremes);
    }
}

impl GapStatistics {
    /// Creates empty statistics, with or without a sum of gaps over the map.
    pub fn new(sums_gaps: bool) -> Self {
        Self { gap_sum: sums_gaps.then_some(0.0), ..Self::default() }
    }

    /// Adds a row of gaps to the sums over elastic nodes, saturated nodes and the map. `last_step`
    /// holds the flags of the nodes.
    #[inline(always)]
    pub fn add_gaps<const YIELDS: bool>(&mut self, gap: &[f64], last_step: &[f32]) {
        self.elastic_sum += sum_by(gap, last_step, |gap, last_step| {
            let is_elastic = has(last_step, PRESSED) && !(YIELDS && has(last_step, SATURATED));
            weight::<f64>(is_elastic) * gap
        });
        if YIELDS {
            self.saturated_sum += sum_by(gap, last_step, |gap, last_step| {
                weight::<f64>(has(last_step, SATURATED)) * gap
            });
        }
        if let Some(sum) = &mut self.gap_sum {
            *sum += total(gap);
        }
    }

    /// Adds a row of gaps to the counts of nodes and to the extremes. `last_step` holds the flags
    /// of the nodes.
    #[inline(always)]
    pub fn add<S: Simd, const R: usize, const YIELDS: bool>(
        &mut self,
        simd: S,
        gap: &[[S::f32s; R]],
        last_step: &[[S::f32s; R]],
    ) {
        let (zero, one) = (Lanes::all(simd, 0.0), Lanes::all(simd, 1.0));
        let mut nodes = zero;
        let mut saturated_nodes = zero;
        let mut highest = Lanes::all(simd, -f32::MAX);
        let mut lowest = Lanes::all(simd, f32::MAX);
        for (gap, last_step) in gap.iter().zip(last_step) {
            let (gap, last_step) = (Lanes::of(simd, *gap), Lanes::of(simd, *last_step));
            let pressed = last_step.has(PRESSED);
            nodes = nodes + pressed.or_zero(one);
            highest = pressed.choose(highest.max(gap), highest);
            let lower = lowest.min(gap);
            if YIELDS {
                let saturated = last_step.has(SATURATED);
                saturated_nodes = saturated_nodes + saturated.or_zero(one);
                lowest = saturated.choose(lowest, lower);
            } else {
                lowest = lower;
            }
        }
        let pressed_nodes = nodes.total();
        self.contact_nodes += pressed_nodes;
        self.elastic_nodes += pressed_nodes - saturated_nodes.total();
        self.extremes.add(Extremes::of(highest, lowest));
    }

    pub fn saturated_nodes(&self) -> f64 {
        self.contact_nodes - self.elastic_nodes
    }

    pub fn convergence(&self) -> Convergence {
        let offset = if self.elastic_nodes > 0.0 || self.contact_nodes == 0.0 {
            self.elastic_sum / self.elastic_nodes
        } else {
            self.extremes.middle()
        };
        self.extremes.convergence(offset)
    }
}
