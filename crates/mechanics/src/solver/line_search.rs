//! Line search along a step, and prediction of step lengths. The line search is complete once the
//! displacement under the step is known, before the next gap is computed.
//!
//! Let m be the clipped step. All pressures are then scaled by s to restore their mean. Together
//! this changes the pressure p by d = s m + (s − 1) p, and the displacement u under p by A d = s A
//! m + (s − 1) u, where A maps pressures to displacements. With the gap g, the line search follows
//! from sums over m, p, g and u, and from ⟨m, A m⟩.
//!
//! If the material yields, saturated pressures must not be scaled, and the displacement due to
//! scaling elastic pressures alone is unknown. Therefore d = m, and the next direction restores the
//! missing load. The energy then includes the work of the missing load on the offset.
//!
//! [`StepControl`] predicts how far to follow a direction before the best step length is known. It
//! contains what the iterations of one load have learnt from its steps.

use super::passes::{PendingUpdate, Sums};

/// Largest factor of the pressures that restores their mean after a step. If a larger factor is
/// needed, the step is undone.
const MAX_SCALE: f64 = 2.0;

/// Elastic energy along the line from the pressures p before a step to the pressures p + d after
/// it.
///
/// d = s m + (s − 1) p consists of the clipped step m and the scaling by s. A maps pressures to
/// displacements, and g is the gap before the step.
#[derive(Debug, Clone, Copy)]
pub struct LineSearch {
    /// Factor s that restores the mean pressure, or 1 if the material yields.
    pub scale: f64,
    /// Factor of all pressures that would restore their mean after the step. Unlike `scale`, it is
    /// not set to 1 if the material yields.
    needed_scale: f64,
    /// Slope ⟨d, g⟩ of the energy, with the change d of the pressures and the gap g. The offset of
    /// the gaps does not matter, because the mean of d is zero.
    slope: f64,
    /// Product ⟨p, A d⟩ of the pressure p and the displacement under the change d of the pressures.
    along: f64,
    /// Product ⟨p, g⟩ of pressure and gap.
    pressure_on_gap: f64,
    /// Product ⟨m, u⟩ of the clipped step and the displacement u under p; `work` is ⟨p, u⟩.
    step_on_displacement: f64,
    work: f64,
    /// Sum of the pressures that the load requires.
    total: f64,
}

impl LineSearch {
    /// Creates the line search of a step in an elastic material.
    ///
    /// After the clipped step, pressures add up to `reference_sum` + `sums.pressure_increment`; the
    /// load requires the sum `total`. Gaps are displacements − heights − `reference`.
    pub fn new(sums: &Sums, reference_sum: f64, total: f64, reference: f64) -> Self {
        let after = reference_sum + sums.pressure_increment;
        let scale = total / after;
        let pressure_on_gap = sums.pressure_on_gap - sums.step_on_gap;
        let pressure_on_height = sums.pressure_on_height - sums.step_on_height;
        let step_on_displacement =
            sums.step_on_gap + sums.step_on_height + reference * (after - total);
        let work = pressure_on_gap + pressure_on_height + reference * total;
        Self {
            scale,
            needed_scale: scale,
            slope: scale * sums.step_on_gap + (scale - 1.0) * pressure_on_gap,
            along: scale * step_on_displacement + (scale - 1.0) * work,
            pressure_on_gap,
            step_on_displacement,
            work,
            total,
        }
    }

    /// Creates the line search of a step in a material that yields.
    ///
    /// Pressures add up to `before` before the step; the load requires the sum `total`. `offset` is
    /// the mean gap of free nodes.
    pub fn yielding(
        sums: &Sums,
        reference_sum: f64,
        [before, total]: [f64; 2],
        offset: f64,
    ) -> Self {
        let after = reference_sum + sums.pressure_increment + sums.rounded;
        Self {
            scale: 1.0,
            needed_scale: total / after,
            slope: sums.step_on_gap - offset * (after - before),
            along: 0.0,
            pressure_on_gap: sums.pressure_on_gap,
            step_on_displacement: 0.0,
            work: 0.0,
            total,
        }
    }

    /// Returns the line search of this step followed by a multiplication of elastic pressures by
    /// `scale`. `offset` is the mean gap of free nodes.
    pub fn then_scaled(self, scale: f64, offset: f64) -> Self {
        let missing_load = self.total - self.total / self.needed_scale;
        Self {
            slope: self.slope + (scale - 1.0) * self.pressure_on_gap - offset * missing_load,
            ..self
        }
    }

    /// Returns ⟨d, A d⟩, twice the elastic energy of the change d of the pressures alone.
    /// `own_work` is ⟨m, A m⟩ for the clipped step m, which d scales.
    pub fn curvature(&self, own_work: f64) -> f64 {
        let rest = self.scale - 1.0;
        self.scale * self.scale * own_work
            + rest * (2.0 * self.scale * self.step_on_displacement + rest * self.work)
    }

    /// Returns whether the step must be undone, because restoring the load would take a factor
    /// above [`MAX_SCALE`] or because a sum is not finite.
    ///
    /// This happens if a sample of rows missed the relevant nodes, or if numbers overflow.
    pub fn loses_load(&self) -> bool {
        let scale = self.needed_scale;
        !(scale > 0.0 && scale <= MAX_SCALE && self.slope.is_finite())
    }

    /// Returns −slope/`curvature`, the fraction of the step at which the energy is lowest; it may
    /// exceed one.
    ///
    /// The result is zero if the slope or the curvature has the wrong sign, so that only rounding
    /// remains.
    pub fn best(&self, curvature: f64) -> f64 {
        if self.slope < 0.0 && curvature > 0.0 { -self.slope / curvature } else { 0.0 }
    }

    /// Returns the mean gap, weighted by pressure, after the fraction `part` of the step.
    /// `curvature` is the curvature ⟨d, A d⟩ of the energy along the step.
    pub fn offset(&self, part: f64, curvature: f64) -> f64 {
        let linear = self.slope + self.along;
        (self.pressure_on_gap + part * (linear + part * curvature)) / self.total
    }

    /// Predicts [`LineSearch::offset`] after the whole step, assuming the curvature for which the
    /// whole step is best.
    pub fn expected_offset(&self) -> f64 {
        self.offset(1.0, self.slope.abs())
    }
}

/// Predicted step length, before [`StepControl`] shortens it.
///
/// Corrections are too large by up to a third. With a step length of 0.5, loads take 1.5 times as
/// many pairs.
const STEP_LENGTH: f64 = 0.9;

/// The same on a coating, where clipped pressures are compensated and do not make steps too long.
const COATING_STEP_LENGTH: f64 = 1.0;

/// Number of iterations after which [`StepControl`] adapts the step length to the best ones.
///
/// Loads that take so many iterations need other lengths than most, for example on elongated cells.
const USUAL_ITERATIONS: usize = 15;

/// Bounds of the adapted step length.
///
/// Lengths above 1 would only help nodes that are about to be released; one iteration may have many
/// of them, and the next none.
const STEP_LENGTHS: (f64, f64) = (0.1, 1.0);

/// Best fraction of a step (the fraction at which the energy is lowest) below which the rest of the
/// step is undone.
///
/// If the best fraction is below one half, the whole step would increase the energy.
const MIN_DESCENT_PART: f64 = 0.5;

/// Best fraction of a step below which the whole step is undone and the next steps are shortened.
///
/// A small fraction would leave traces of pressure on many nodes that should have none and would
/// disturb later directions.
const MIN_PART: f64 = 0.25;

/// Threshold of the best fraction of a step. Below it, the next step length is multiplied by the
/// best fraction, but at least by [`MIN_DESCENT_PART`].
///
/// While many nodes change between free and fixed, one step too long follows another.
const EXPECTED_PART: f64 = 0.8;

/// Smallest [`StepControl::damping`] with which the residual is extended to nodes that are not
/// free.
///
/// If many nodes are clipped, a correction computed for all nodes may increase the energy when only
/// the remaining ones apply it.
const MIN_EXTENDING_DAMPING: f64 = 0.5;

/// [`StepControl::damping`] below which means are computed over all rows instead of a sample.
///
/// Steps are shortened so often only if directions are wrong altogether, for example if contact is
/// aligned with the sampled rows.
const MIN_SAMPLE_DAMPING: f64 = 0.01;

/// State that is passed from one iteration of a load to the next.
pub struct StepControl {
    /// True after a start from a coarser mesh.
    pub is_nested: bool,
    /// True if clipped pressures are compensated.
    pub compensates_clipping: bool,
    pub iteration: usize,
    /// Step length, before `damping` and `caution`.
    length: f64,
    /// Factor of all step lengths, halved after each step that was far too long. Without it, such a
    /// step would be undone and repeated again and again.
    damping: f64,
    /// Factor of the next step length, below one if the last step was somewhat too long.
    caution: f64,
    /// True if means are computed over all rows, not only over a sample.
    pub sees_all_rows: bool,
    pub last: Option<LastStep>,
}

impl StepControl {
    /// Creates the control of the steps of a load, which begins from a coarser mesh if `is_nested`.
    pub fn new(is_nested: bool) -> Self {
        Self {
            is_nested,
            compensates_clipping: false,
            iteration: 0,
            length: STEP_LENGTH,
            damping: 1.0,
            caution: 1.0,
            sees_all_rows: false,
            last: None,
        }
    }

    /// Returns the control where clipped pressures are compensated: on a coating if `is_coating`,
    /// otherwise with a free boundary.
    pub fn compensating_clipping(self, is_coating: bool) -> Self {
        let length = if is_coating { COATING_STEP_LENGTH } else { STEP_LENGTH };
        Self { compensates_clipping: true, length, ..self }
    }

    /// Takes the last step of earlier iterations. Gaps in contact are about `offset` after it.
    pub fn last_step(&mut self, offset: f64) -> Option<LastStep> {
        let mut last = self.last.take()?;
        last.offset_change += offset;
        Some(last)
    }

    pub fn step_length(&self) -> f64 {
        self.length * self.damping * self.caution
    }

    /// Adapts `self` to a step along which the energy is lowest at the fraction `best`. Returns
    /// the fraction of the step to keep.
    pub fn learn(&mut self, best: f64) -> f64 {
        if self.iteration >= USUAL_ITERATIONS && self.damping == 1.0 {
            // Half-way towards the best length.
            let (shortest, longest) = STEP_LENGTHS;
            let factor = 0.5 + 0.5 * (self.caution * best).min(2.0);
            self.length = (self.length * factor).clamp(shortest, longest);
        }
        // The first step from a guess clips many nodes, and this clipping must not be undone,
        // except on a body that would sink under it.
        let is_first = self.iteration == 0 && !self.compensates_clipping;
        self.iteration += 1;
        // It says little about the next step, except after a coarser mesh, where few nodes are
        // clipped.
        if !is_first || self.is_nested {
            self.caution = if best < EXPECTED_PART { best.max(MIN_DESCENT_PART) } else { 1.0 };
        }
        if is_first || best >= MIN_DESCENT_PART {
            self.damping = (2.0 * self.damping).min(1.0);
            return 1.0;
        }
        if best < MIN_PART {
            self.shorten_steps();
            return 0.0;
        }
        best
    }

    /// Returns whether corrections extend the residual to nodes that are not free.
    ///
    /// Where clipped pressures are compensated, clipping does not spoil these corrections, and
    /// local ones would leave long waves unsolved.
    pub fn uses_extension(&self) -> bool {
        self.compensates_clipping || self.damping >= MIN_EXTENDING_DAMPING
    }

    pub fn shorten_steps(&mut self) {
        self.damping *= 0.5;
        self.sees_all_rows |= self.damping < MIN_SAMPLE_DAMPING;
    }
}

/// Last conjugate-gradient step d. The clipped step is already added to the pressures; its scaling
/// and partial undo (`pending`) are not.
#[derive(Clone, Copy)]
pub struct LastStep {
    pub pending: PendingUpdate,
    /// ⟨d, A d⟩, twice the elastic energy of the step alone; A maps pressures to displacements.
    pub curvature: f64,
    /// Fraction of the step by which the step was too short, at most 1. It is the fraction at which
    /// the energy is lowest, minus 1, or 0 if the step was partly undone.
    pub missed: f64,
    /// Change of the offset during the step.
    pub offset_change: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::{Factor, PeriodicHalfSpace, kernel};
    use crate::fft::Transform;
    use crate::grid::samples::square;
    use crate::threads::Threads;

    const NODES: usize = 12;

    fn noise(seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut draw = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..NODES * NODES).map(|_| draw()).collect()
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    fn sunk(pressure: &[f64]) -> Vec<f64> {
        let body = PeriodicHalfSpace::new(square(NODES, 1.0));
        let transform = Transform::new([NODES; 2]);
        let (kernel, mut scratch) =
            (kernel(&Threads::one(), &body, Factor::Displacement), transform.scratch());
        let mut sunk = vec![0.0; pressure.len()];
        transform.convolve(&kernel, pressure, &mut sunk, &mut scratch);
        sunk
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12 * (1.0 + b.abs())
    }

    fn example() -> ([Vec<f64>; 3], LineSearch) {
        let (pressure, heights, reference) = (noise(1), noise(2), 0.3);
        let gap: Vec<f64> = sunk(&pressure)
            .iter()
            .zip(&heights)
            .map(|(u, height)| u - height - reference)
            .collect();
        let after = noise(3);
        let step: Vec<f64> = after.iter().zip(&pressure).map(|(a, p)| a - p).collect();
        let sums = Sums {
            // Relative to a reference pressure of one.
            pressure_increment: after.iter().map(|p| p - 1.0).sum(),
            step_on_gap: dot(&step, &gap),
            pressure_on_gap: dot(&after, &gap),
            step_on_height: dot(&step, &heights),
            pressure_on_height: dot(&after, &heights),
            ..Sums::default()
        };
        let total = pressure.iter().sum();
        let line = LineSearch::new(&sums, (NODES * NODES) as f64, total, reference);
        ([pressure, gap, step], line)
    }

    #[test]
    fn sums_describe_the_scaled_step() {
        let ([pressure, gap, step], line) = example();
        let whole: Vec<f64> =
            step.iter().zip(&pressure).map(|(m, p)| line.scale * (p + m) - p).collect();
        assert!(whole.iter().sum::<f64>().abs() < 1e-12, "keeps the mean");
        let image = sunk(&whole);
        let curvature = line.curvature(dot(&step, &sunk(&step)));
        assert!(close(curvature, dot(&whole, &image)));
        let slope = dot(&whole, &gap);
        assert!(close(line.slope, slope));
        assert!(close(line.best(curvature) * curvature, (-slope).max(0.0)));
        assert_eq!(line.best(-curvature), 0.0);
        for part in [0.0, 0.3, 1.0] {
            let along = |a: &[f64], b: &[f64]| -> Vec<f64> {
                a.iter().zip(b).map(|(a, b)| a + part * b).collect()
            };
            let (p, g) = (along(&pressure, &whole), along(&gap, &image));
            let offset = dot(&p, &g) / p.iter().sum::<f64>();
            assert!(close(line.offset(part, curvature), offset));
        }
    }

    #[test]
    fn a_step_of_a_yielding_material_is_not_scaled() {
        let ([pressure, gap, step], _) = example();
        let after: f64 = pressure.iter().zip(&step).map(|(p, m)| p + m).sum();
        let (before, total, offset) = (pressure.iter().sum::<f64>(), 1.1 * after, 0.07);
        let sums = Sums {
            pressure_increment: after - 1.0,
            step_on_gap: dot(&step, &gap),
            ..Sums::default()
        };
        let line = LineSearch::yielding(&sums, 1.0, [before, total], offset);
        let curvature = line.curvature(dot(&step, &sunk(&step)));
        // Gaps are measured from the offset.
        let slope = step.iter().zip(&gap).map(|(m, g)| m * (g - offset)).sum::<f64>();
        assert!(close(line.slope, slope));
        assert!(close(curvature, dot(&step, &sunk(&step))));
        assert!(close(line.best(curvature) * curvature, (-slope).max(0.0)));
        assert_eq!(line.best(-curvature), 0.0);
        assert_eq!(line.scale, 1.0);
        assert!(!line.loses_load());
    }

    #[test]
    fn only_a_step_down_the_slope_and_up_again_has_a_best_fraction() {
        let (_, line) = example();
        let with_slope = |slope| LineSearch { slope, ..line };
        assert_eq!(with_slope(-6.0).best(2.0), 3.0);
        // Rounding may produce either sign.
        for (slope, curvature) in [(6.0, 2.0), (6.0, -2.0), (-6.0, -2.0), (-6.0, 0.0), (0.0, 0.0)] {
            assert_eq!(with_slope(slope).best(curvature), 0.0);
        }
    }

    #[test]
    fn a_step_that_removes_all_pressure_loses_the_load() {
        let nothing_left = Sums { pressure_increment: -1.0, ..Sums::default() };
        assert!(LineSearch::new(&nothing_left, 1.0, 1.0, 0.0).loses_load());
        let (_, line) = example();
        assert!(!line.loses_load());
    }
}
