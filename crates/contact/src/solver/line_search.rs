//! What a move does, before the gap under it is known.
//!
//! A move m, from clipping alone, is followed by scaling all pressures by s, so that they keep
//! their mean: together, from pressure p with gap g and displacement u, these are the move
//! d = s m + (s − 1) p, with displacement A d = s A m + (s − 1) u. All that a line search asks for
//! follows from sums over m, p, g and u, and from ⟨m, A m⟩.
//!
//! Where the material yields, saturated pressures are not to be scaled, and what scaling the
//! elastic ones alone would displace is not known. There d = m, and what pressures lack to their
//! mean is left to the next direction. The energy counts with the work of what they lack on the
//! offset.
//!
//! [`Steps`] say how far a direction is followed before it is known how far would have been best,
//! and [`History`] what the iterations of one load have learnt of its moves.

use super::passes::{PendingUpdate, Sums};

/// The most that pressures may have to be scaled by after a move.
const WORST_SCALE: f64 = 2.0;

/// The whole move as a line from the pressure before it.
#[derive(Debug, Clone, Copy)]
pub struct LineSearch {
    /// s
    pub scale: f64,
    /// By which pressures after the move would have to be scaled.
    needed_scale: f64,
    /// ⟨d, g⟩: for d has no mean, whatever offset gaps are counted from.
    slope: f64,
    /// ⟨p, A d⟩
    along: f64,
    /// ⟨p, g⟩
    pressure_on_gap: f64,
    /// ⟨m, u⟩ and ⟨p, u⟩
    move_on_displacement: f64,
    work: f64,
    /// Σ p
    total: f64,
}

impl LineSearch {
    /// A move whose pressures come to `reference_sum + sums.pressure_increment`, and are to come to `total`; gaps are
    /// u less height and `reference`.
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

    /// The same where the material yields. The move starts from pressures that come to `before`,
    /// and gaps of free nodes have the mean `offset`.
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

    /// The same with elastic pressures scaled after the move, so that they come to what they
    /// should.
    pub fn then_scaled(self, scale: f64, offset: f64) -> Self {
        let missing_load = self.total - self.total / self.needed_scale;
        Self {
            slope: self.slope + (scale - 1.0) * self.pressure_on_gap - offset * missing_load,
            ..self
        }
    }

    /// ⟨d, A d⟩, twice the elastic energy of the move alone, from ⟨m, A m⟩.
    pub fn curvature(&self, own_work: f64) -> f64 {
        let rest = self.scale - 1.0;
        self.scale * self.scale * own_work
            + rest * (2.0 * self.scale * self.move_on_displacement + rest * self.work)
    }

    /// Whether the move sheds so much of the load that it is better not made: all of it, perhaps,
    /// if the direction follows a sample that missed what matters, or leads out of all numbers.
    pub fn sheds_load(&self) -> bool {
        let scale = self.needed_scale;
        !(scale > 0.0 && scale <= WORST_SCALE && self.slope.is_finite())
    }

    /// Which part of the move leads to the lowest energy; zero for a move of no length, without
    /// curvature, or against the slope: only rounding is left in it.
    pub fn best(&self, curvature: f64) -> f64 {
        if self.slope < 0.0 && curvature > 0.0 { -self.slope / curvature } else { 0.0 }
    }

    /// The mean of the gap, weighted by pressure, after `part` of the move.
    pub fn offset(&self, part: f64, curvature: f64) -> f64 {
        let linear = self.slope + self.along;
        (self.pressure_on_gap + part * (linear + part * curvature)) / self.total
    }

    /// What [`LineSearch::offset`] will be after the whole move, if that is about the best part.
    pub fn expected_offset(&self) -> f64 {
        self.offset(1.0, self.slope.abs())
    }
}

/// Iterations of one load whose steps are told apart; later ones share the last.
const STEPS: usize = 16;

/// The step before any was learnt. Corrections are too large by up to a third; with one half, first
/// loads take half as many pairs again.
const UNTRIED_STEP: f64 = 0.9;

/// Steps stay above what surfaces of all kinds were seen to need: a load that ends in rounding must
/// not teach the next. More than the whole correction closes the gap only of nodes about to be let
/// go; one load may have many of them, and the next one none.
const STEP_RANGE: (f64, f64) = (0.1, 1.0);

/// The steps that each iteration of a load learnt from earlier loads.
#[derive(Clone)]
pub struct Steps([f64; STEPS]);

impl Default for Steps {
    fn default() -> Self {
        Self([UNTRIED_STEP; STEPS])
    }
}

impl Steps {
    pub fn of(&self, iteration: usize) -> f64 {
        self.0[iteration.min(STEPS - 1)]
    }

    /// All of them, in the order of iterations.
    pub fn all(&self) -> &[f64] {
        &self.0
    }

    /// Those that [`Steps::all`] has told, one after the other.
    pub fn restored<E>(mut next: impl FnMut() -> Result<f64, E>) -> Result<Steps, E> {
        let mut steps = Steps::default();
        for step in &mut steps.0 {
            *step = next()?;
        }
        Ok(steps)
    }

    /// Learns, by half, that `best` times the step would have been right.
    pub fn learn(&mut self, iteration: usize, best: f64) {
        let (least, most) = STEP_RANGE;
        let step = &mut self.0[iteration.min(STEPS - 1)];
        *step = (*step * (0.5 + 0.5 * best.min(2.0))).clamp(least, most);
    }
}

/// A move of which less than this part would have been best is taken back to that part. Below one
/// half it would have raised the energy.
const SMALLEST_PART: f64 = 0.5;

/// Where less than this part would have been best, all of it is taken back, and the next steps are
/// shortened: a small part would leave a trace of pressure on many nodes that should have none, so
/// that directions would go on to count with them.
const RECKLESS_PART: f64 = 0.25;

/// Where less than this part would have been best, the next step is shorter by as much: while many
/// nodes change between free and bound, one step too long follows another.
const EXPECTED_PART: f64 = 0.8;

/// While steps are shortened further than this, corrections go without a continuation of the gap.
/// Where many nodes are clipped, the rest of what was meant for all may lead uphill.
const CONTINUED_DAMPING: f64 = 0.5;

/// Steps are shortened as far as this only if directions are wrong altogether: made for the rows of
/// a sample, it may be, where contact follows the rows.
const LEAST_DAMPING: f64 = 0.01;

/// What iterations of one load leave to later ones, besides the steps.
pub struct History {
    /// Whether they began where a coarser mesh led.
    pub is_nested: bool,
    pub iteration: usize,
    /// Shortens steps after one that went much too far. Without it, a step that clips too many
    /// nodes to go downhill would be taken back and tried again for ever.
    pub damping: f64,
    /// Shortens the step after one that went somewhat too far.
    pub caution: f64,
    /// Whether all rows are looked at, and not a sample.
    pub sees_all_rows: bool,
    /// The last move, if it was evaluated.
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
    /// Of iterations that begin where a coarser mesh led.
    pub fn nested() -> Self {
        Self { is_nested: true, ..Self::default() }
    }

    /// Learns from a move of which the part `best` would have been right. Says which part to keep.
    pub fn learn(&mut self, steps: &mut Steps, best: f64) -> f64 {
        if self.damping == 1.0 {
            steps.learn(self.iteration, best * self.caution);
        }
        // What the first move clips of a guess is not to be taken back, and tells of the next only
        // where little is clipped: after a coarser mesh.
        let is_first = self.iteration == 0;
        let short = !is_first && best < SMALLEST_PART;
        if !is_first || self.is_nested {
            let went_too_far = best < EXPECTED_PART;
            self.caution = if went_too_far { best.max(SMALLEST_PART) } else { 1.0 };
        }
        self.iteration += 1;
        if !short {
            self.damping = (2.0 * self.damping).min(1.0);
            return 1.0;
        }
        if best < RECKLESS_PART {
            self.shorten_steps();
            return 0.0;
        }
        best
    }

    /// Whether corrections are made with a continuation of the gap.
    pub fn continues(&self) -> bool {
        self.damping >= CONTINUED_DAMPING
    }

    pub fn shorten_steps(&mut self) {
        self.damping *= 0.5;
        self.sees_all_rows |= self.damping < LEAST_DAMPING;
    }
}

/// A move that has been made, but for its pending update.
#[derive(Clone, Copy)]
pub struct LastMove {
    pub pending: PendingUpdate,
    /// ⟨move, its displacement⟩, twice the elastic energy of the move alone.
    pub curvature: f64,
    /// The part of the move that should be added to it.
    pub missed: f64,
    /// How much higher the offset is after it.
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

    /// Pressure and gap before, the move before scaling, and the line along it all.
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
            // Counted from a reference_sum of one.
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
    fn sums_tell_what_the_scaled_move_does() {
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
    fn where_the_material_yields_a_move_is_weighed_as_it_is() {
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
        // Gaps count from the offset.
        let slope = moved.iter().zip(&gap).map(|(m, g)| m * (g - offset)).sum::<f64>();
        assert!(close(line.slope, slope));
        assert!(close(curvature, dot(&moved, &sunk(&moved))));
        assert!(close(line.best(curvature) * curvature, (-slope).max(0.0)));
        assert_eq!(line.best(-curvature), 0.0);
        assert_eq!(line.scale, 1.0);
        assert!(!line.sheds_load());
    }

    #[test]
    fn only_a_move_down_the_slope_and_up_again_has_a_best_part() {
        let (_, line) = example();
        let with_slope = |slope| LineSearch { slope, ..line };
        assert_eq!(with_slope(-6.0).best(2.0), 3.0);
        // Rounding may turn either sign.
        for (slope, curvature) in [(6.0, 2.0), (6.0, -2.0), (-6.0, -2.0), (-6.0, 0.0), (0.0, 0.0)] {
            assert_eq!(with_slope(slope).best(curvature), 0.0);
        }
    }

    #[test]
    fn a_move_that_takes_all_pressure_away_sheds_the_load() {
        let nothing_left = Sums { pressure_increment: -1.0, ..Sums::default() };
        assert!(LineSearch::new(&nothing_left, 1.0, 1.0, 0.0).sheds_load());
        let (_, line) = example();
        assert!(!line.sheds_load());
    }
}
