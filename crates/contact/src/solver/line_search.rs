//! Line search along a move, before the gap under it is known, and prediction of step lengths.
//!
//! A move m is the clipped step. All pressures are then scaled by s to restore their mean. Both
//! together change the pressure p by d = s m + (s − 1) p. The displacement changes by A d = s A m +
//! (s − 1) u, where u is the displacement under p. With the gap g, the line search follows from
//! sums over m, p, g and u, and from ⟨m, A m⟩.
//!
//! If the material yields, saturated pressures must not be scaled, and the displacement of scaling
//! elastic pressures alone is unknown. There d = m, and the next direction restores the missing
//! load. The energy includes the work of the missing load on the offset.
//!
//! [`Steps`] predict how far to follow a direction before the best step length is known.
//! [`History`] is what the iterations of one load have learnt from its moves.

use super::passes::{PendingUpdate, Sums};

/// Maximum factor by which pressures may have to be scaled after a move.
const MAX_SCALE: f64 = 2.0;

/// The line from the pressure before a move through the pressure after it.
#[derive(Debug, Clone, Copy)]
pub struct LineSearch {
    /// Factor s that restores the mean pressure, or 1 if the material yields.
    pub scale: f64,
    /// Factor that would restore the mean of the pressures after the move.
    needed_scale: f64,
    /// Slope ⟨d, g⟩ of the energy; the offset of the gaps does not matter, because d has zero mean.
    slope: f64,
    /// Product ⟨p, A d⟩ of the pressure and the displacement under d.
    along: f64,
    /// Product ⟨p, g⟩ of pressure and gap.
    pressure_on_gap: f64,
    /// Products ⟨m, u⟩ and, in `work`, ⟨p, u⟩.
    move_on_displacement: f64,
    work: f64,
    /// Sum of all pressures, as required.
    total: f64,
}

impl LineSearch {
    /// Creates the line of a move after which pressures add up to
    /// `reference_sum + sums.pressure_increment` instead of `total`.
    ///
    /// Gaps are displacements minus heights and `reference`.
    pub fn new(sums: &Sums, reference_sum: f64, total: f64, reference: f64) -> Self {
        let after = reference_sum + sums.pressure_increment;
        let scale = total / after;
        let pressure_on_gap = sums.pressure_on_gap - sums.move_on_gap;
        let pressure_on_height = sums.pressure_on_height - sums.move_on_height;
        let move_on_displacement =
            sums.move_on_gap + sums.move_on_height + reference * (after - total);
        let work = pressure_on_gap + pressure_on_height + reference * total;
        Self {
            scale,
            needed_scale: scale,
            slope: scale * sums.move_on_gap + (scale - 1.0) * pressure_on_gap,
            along: scale * move_on_displacement + (scale - 1.0) * work,
            pressure_on_gap,
            move_on_displacement,
            work,
            total,
        }
    }

    /// Creates the line of a move in a material that yields.
    ///
    /// Pressures add up to `before` before the move, and gaps of free nodes have the mean `offset`.
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
            slope: sums.move_on_gap - offset * (after - before),
            along: 0.0,
            pressure_on_gap: sums.pressure_on_gap,
            move_on_displacement: 0.0,
            work: 0.0,
            total,
        }
    }

    /// Returns the line of the same move followed by scaling elastic pressures.
    pub fn then_scaled(self, scale: f64, offset: f64) -> Self {
        let missing_load = self.total - self.total / self.needed_scale;
        Self {
            slope: self.slope + (scale - 1.0) * self.pressure_on_gap - offset * missing_load,
            ..self
        }
    }

    /// Returns ⟨d, A d⟩, twice the elastic energy of d alone, from ⟨m, A m⟩.
    pub fn curvature(&self, own_work: f64) -> f64 {
        let rest = self.scale - 1.0;
        self.scale * self.scale * own_work
            + rest * (2.0 * self.scale * self.move_on_displacement + rest * self.work)
    }

    /// Returns whether the move loses so much of the load that it must be undone.
    ///
    /// This happens if a sample of rows missed the relevant nodes, or if numbers overflow.
    pub fn loses_load(&self) -> bool {
        let scale = self.needed_scale;
        !(scale > 0.0 && scale <= MAX_SCALE && self.slope.is_finite())
    }

    /// Returns the part of the move with the lowest energy.
    ///
    /// Zero for a move of zero length, without curvature or against the slope, where only rounding
    /// remains.
    pub fn best(&self, curvature: f64) -> f64 {
        if self.slope < 0.0 && curvature > 0.0 { -self.slope / curvature } else { 0.0 }
    }

    /// Returns the mean gap, weighted by pressure, after `part` of the move.
    pub fn offset(&self, part: f64, curvature: f64) -> f64 {
        let linear = self.slope + self.along;
        (self.pressure_on_gap + part * (linear + part * curvature)) / self.total
    }

    /// Predicts [`LineSearch::offset`] after the whole move, if about all of it is best.
    pub fn expected_offset(&self) -> f64 {
        self.offset(1.0, self.slope.abs())
    }
}

/// Iterations with separate step lengths; later iterations share the last one.
const STEPS: usize = 16;

/// Step length before any was learnt. Corrections are too large by up to a third; with one half,
/// first loads take half as many pairs again.
const INITIAL_STEP: f64 = 0.9;

/// Range of step lengths that surfaces of all kinds were seen to need, so that a load that ends in
/// rounding does not spoil the next. More than 1 would only help nodes that are about to be
/// released; one load may have many of them, and the next none.
const STEP_RANGE: (f64, f64) = (0.1, 1.0);

/// Step length of each iteration, learnt from earlier loads.
#[derive(Clone)]
pub struct Steps([f64; STEPS]);

impl Default for Steps {
    fn default() -> Self {
        Self([INITIAL_STEP; STEPS])
    }
}

impl Steps {
    pub fn of(&self, iteration: usize) -> f64 {
        self.0[iteration.min(STEPS - 1)]
    }

    pub fn all(&self) -> &[f64] {
        &self.0
    }

    /// Restores the step lengths that [`Steps::all`] returned.
    pub fn restored<E>(mut next: impl FnMut() -> Result<f64, E>) -> Result<Steps, E> {
        let mut steps = Steps::default();
        for step in &mut steps.0 {
            *step = next()?;
        }
        Ok(steps)
    }

    /// Moves the step length half-way towards `best` times its value.
    pub fn learn(&mut self, iteration: usize, best: f64) {
        let (least, most) = STEP_RANGE;
        let step = &mut self.0[iteration.min(STEPS - 1)];
        *step = (*step * (0.5 + 0.5 * best.min(2.0))).clamp(least, most);
    }
}

/// A move with a best part below this is undone to that part. Below one half it would have raised
/// the energy.
const MIN_DESCENT_PART: f64 = 0.5;

/// A move with a best part below this is undone completely, and the next steps are shortened. A
/// small part would leave traces of pressure on many nodes that should have none and would disturb
/// later directions.
const MIN_PART: f64 = 0.25;

/// A best part below this shortens the next step accordingly: while many nodes change between free
/// and fixed, one step too long follows another.
const EXPECTED_PART: f64 = 0.8;

/// With a damping below this, the residual is not extended to other nodes. If many nodes are
/// clipped, the rest of a correction meant for all may lead uphill.
const CONTINUED_DAMPING: f64 = 0.5;

/// A damping below this occurs only if directions are wrong altogether, for example if they fit the
/// rows of a sample and contact follows the rows.
const MIN_SAMPLE_DAMPING: f64 = 0.01;

/// State that iterations of one load pass on, apart from the step lengths.
pub struct History {
    pub is_nested: bool,
    pub iteration: usize,
    /// Factor that shortens steps after a step that was far too long. Without it, such a step would
    /// be undone and repeated without end.
    pub damping: f64,
    /// Factor that shortens the next step after one that was somewhat too long.
    pub caution: f64,
    /// True if corrections of all rows are considered, not those of a sample.
    pub sees_all_rows: bool,
    pub last: Option<LastMove>,
}

impl Default for History {
    fn default() -> Self {
        Self {
            is_nested: false,
            iteration: 0,
            damping: 1.0,
            caution: 1.0,
            sees_all_rows: false,
            last: None,
        }
    }
}

impl History {
    pub fn nested() -> Self {
        Self { is_nested: true, ..Self::default() }
    }

    /// Adapts the step lengths to a move whose best part was `best`. Returns the part to keep.
    pub fn learn(&mut self, steps: &mut Steps, best: f64) -> f64 {
        if self.damping == 1.0 {
            steps.learn(self.iteration, best * self.caution);
        }
        // The first move from a guess clips many nodes, which must not be undone. It says little
        // about the next move, except after a coarser mesh, where few nodes are clipped.
        let is_first = self.iteration == 0;
        let short = !is_first && best < MIN_DESCENT_PART;
        if !is_first || self.is_nested {
            let went_too_far = best < EXPECTED_PART;
            self.caution = if went_too_far { best.max(MIN_DESCENT_PART) } else { 1.0 };
        }
        self.iteration += 1;
        if !short {
            self.damping = (2.0 * self.damping).min(1.0);
            return 1.0;
        }
        if best < MIN_PART {
            self.shorten_steps();
            return 0.0;
        }
        best
    }

    /// Returns whether corrections extend the residual to other nodes.
    pub fn continues(&self) -> bool {
        self.damping >= CONTINUED_DAMPING
    }

    pub fn shorten_steps(&mut self) {
        self.damping *= 0.5;
        self.sees_all_rows |= self.damping < MIN_SAMPLE_DAMPING;
    }
}

/// A move that has been made, except for its pending update.
#[derive(Clone, Copy)]
pub struct LastMove {
    pub pending: PendingUpdate,
    /// ⟨d, A d⟩, twice the elastic energy of the move alone.
    pub curvature: f64,
    /// Part of the move that should still be added to it.
    pub missed: f64,
    pub offset_change: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::{PeriodicHalfSpace, displacement};
    use crate::fft::Transform;
    use crate::grid::samples::square;

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
        let (kernel, mut scratch) = (displacement(&body), transform.scratch());
        let mut sunk = vec![0.0; pressure.len()];
        transform.convolve(&kernel, pressure, &mut sunk, &mut scratch);
        sunk
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12 * (1.0 + b.abs())
    }

    /// Returns pressure, gap and move before scaling, and the line of the move.
    fn example() -> ([Vec<f64>; 3], LineSearch) {
        let (pressure, heights, reference) = (noise(1), noise(2), 0.3);
        let gap: Vec<f64> = sunk(&pressure)
            .iter()
            .zip(&heights)
            .map(|(u, height)| u - height - reference)
            .collect();
        let after = noise(3);
        let moved: Vec<f64> = after.iter().zip(&pressure).map(|(a, p)| a - p).collect();
        let sums = Sums {
            // Relative to a reference pressure of one.
            pressure_increment: after.iter().map(|p| p - 1.0).sum(),
            move_on_gap: dot(&moved, &gap),
            pressure_on_gap: dot(&after, &gap),
            move_on_height: dot(&moved, &heights),
            pressure_on_height: dot(&after, &heights),
            ..Sums::default()
        };
        let total = pressure.iter().sum();
        let line = LineSearch::new(&sums, (NODES * NODES) as f64, total, reference);
        ([pressure, gap, moved], line)
    }

    #[test]
    fn sums_describe_the_scaled_move() {
        let ([pressure, gap, moved], line) = example();
        let whole: Vec<f64> =
            moved.iter().zip(&pressure).map(|(m, p)| line.scale * (p + m) - p).collect();
        assert!(whole.iter().sum::<f64>().abs() < 1e-12, "keeps the mean");
        let image = sunk(&whole);
        let curvature = line.curvature(dot(&moved, &sunk(&moved)));
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
    fn a_move_of_a_yielding_material_is_not_scaled() {
        let ([pressure, gap, moved], _) = example();
        let after: f64 = pressure.iter().zip(&moved).map(|(p, m)| p + m).sum();
        let (before, total, offset) = (pressure.iter().sum::<f64>(), 1.1 * after, 0.07);
        let sums = Sums {
            pressure_increment: after - 1.0,
            move_on_gap: dot(&moved, &gap),
            ..Sums::default()
        };
        let line = LineSearch::yielding(&sums, 1.0, [before, total], offset);
        let curvature = line.curvature(dot(&moved, &sunk(&moved)));
        // Gaps are measured from the offset.
        let slope = moved.iter().zip(&gap).map(|(m, g)| m * (g - offset)).sum::<f64>();
        assert!(close(line.slope, slope));
        assert!(close(curvature, dot(&moved, &sunk(&moved))));
        assert!(close(line.best(curvature) * curvature, (-slope).max(0.0)));
        assert_eq!(line.best(-curvature), 0.0);
        assert_eq!(line.scale, 1.0);
        assert!(!line.loses_load());
    }

    #[test]
    fn only_a_move_down_the_slope_and_up_again_has_a_best_part() {
        let (_, line) = example();
        let with_slope = |slope| LineSearch { slope, ..line };
        assert_eq!(with_slope(-6.0).best(2.0), 3.0);
        // Rounding may produce either sign.
        for (slope, curvature) in [(6.0, 2.0), (6.0, -2.0), (-6.0, -2.0), (-6.0, 0.0), (0.0, 0.0)] {
            assert_eq!(with_slope(slope).best(curvature), 0.0);
        }
    }

    #[test]
    fn a_move_that_takes_all_pressure_away_sheds_the_load() {
        let nothing_left = Sums { pressure_increment: -1.0, ..Sums::default() };
        assert!(LineSearch::new(&nothing_left, 1.0, 1.0, 0.0).loses_load());
        let (_, line) = example();
        assert!(!line.loses_load());
    }
}
