//! Nodes whose pressure may change, and the shift of their changes that keeps the mean pressure.

use super::lanes::Shared;
use crate::fft::Row;

/// Accuracy of the shift that [`Candidates::shift`] returns, as a fraction of the largest change.
const PRECISION: f64 = 1e-6;

const ROUNDING: f64 = 1e-7;

const STEPS: usize = 40;

/// Pressures and proposed changes of the nodes whose pressure may change.
#[derive(Default)]
pub struct Candidates {
    pressure: Vec<f32>,
    /// Proposed change of the pressure of each node; [`Candidates::shift`] returns the number to
    /// add to all of them.
    change: Vec<f32>,
    /// Last step of each node, where [`Candidates::follow`] needs it.
    last_step: Vec<f32>,
}

impl Shared for Candidates {
    fn split_off(&mut self, _: Row) -> Self {
        Self::default()
    }

    fn append(&mut self, mut later: Self) {
        self.pressure.append(&mut later.pressure);
        self.change.append(&mut later.change);
        self.last_step.append(&mut later.last_step);
    }
}

impl Candidates {
    pub fn clear(&mut self) {
        self.pressure.clear();
        self.change.clear();
        self.last_step.clear();
    }

    pub fn len(&self) -> usize {
        self.pressure.len()
    }

    /// Replaces each change z by τ (z + β s), with the step length τ and the last step s of the
    /// node.
    pub fn follow(&mut self, step_length: f32, beta: f32) {
        for (change, last) in self.change.iter_mut().zip(&self.last_step) {
            *change = step_length * (*change + beta * last);
        }
    }

    /// Appends the first `count` of `N` nodes, given by pressures, changes and last steps. Copying
    /// all `N` is faster, because their number is fixed.
    #[inline(always)]
    pub fn extend<const N: usize>(&mut self, nodes: &[[f32; N]; 3], count: usize) {
        let length = self.len() + count;
        let maps = [&mut self.pressure, &mut self.change, &mut self.last_step];
        for (map, values) in maps.into_iter().zip(nodes) {
            map.extend_from_slice(values);
            map.truncate(length);
        }
    }

    #[inline(always)]
    pub fn push(&mut self, pressure: f32, change: f32) {
        self.pressure.push(pressure);
        self.change.push(change);
    }

    /// Returns the shift s for which Σ clamp(p + Δp + s, 0, `ceiling`) = Σ clamp(p, 0, `ceiling`) +
    /// `missing_load`, with the pressure p and the change Δp of each node.
    ///
    /// If several shifts satisfy this, returns one of them. Returns `None` if there are no nodes or
    /// if no shift can reach this sum.
    pub fn shift(&self, missing_load: f64, ceiling: f32) -> Option<f64> {
        let count = self.len() as f64;
        let before: f64 = self.total(|pressure, _| pressure.clamp(0.0, ceiling));
        let wanted = before + missing_load;
        if !(wanted >= 0.0 && wanted <= count * f64::from(ceiling) && count > 0.0) {
            return None;
        }
        let (mut low, mut high) = self.range(ceiling);
        if !(low.is_finite() && high.is_finite()) {
            return None;
        }
        let largest = self.largest_change() + missing_load.abs() / count;
        let close = PRECISION * largest.min(f64::from(ceiling));
        let balanced = close + ROUNDING / PRECISION * close * count;
        let mut shift = 0.0_f64.clamp(low, high);
        for _ in 0..STEPS {
            let by = shift as f32;
            let after = |pressure: f32, change: f32| pressure + (change + by);
            // Changes that are not clipped are added to their last digit, even if pressures are
            // much larger.
            let gained = self.total(|p, change| {
                let beyond = p - p.clamp(0.0, ceiling);
                (change + by).clamp(-p, ceiling - p) + beyond
            });
            let inside = self.total(|p, change| {
                let after = after(p, change);
                f32::from(u8::from(after > 0.0 && after < ceiling))
            });
            let missing = missing_load - gained;
            *(if missing > 0.0 { &mut low } else { &mut high }) = shift;
            let step = missing / inside;
            if missing.abs() <= balanced || step.abs() <= close || high - low <= close {
                return Some(shift);
            }
            let next = shift + step;
            shift = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        Some(shift)
    }

    fn largest_change(&self) -> f64 {
        let larger = |largest: f32, change: &f32| largest.max(change.abs());
        f64::from(self.change.iter().fold(0.0, larger))
    }

    /// Returns the highest shift s for which p + Δp + s ≤ 0 at all nodes, and the lowest for which
    /// p + Δp + s ≥ `ceiling` at all nodes.
    fn range(&self, ceiling: f32) -> (f64, f64) {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for (pressure, change) in self.pressure.iter().zip(&self.change) {
            let after = pressure + change;
            (low, high) = (low.min(after), high.max(after));
        }
        (-f64::from(high), f64::from(ceiling) - f64::from(low))
    }

    /// Returns Σ term(p, Δp) over all nodes, in single precision within chunks of 256 nodes and in
    /// double precision over the chunks.
    fn total(&self, term: impl Fn(f32, f32) -> f32) -> f64 {
        const CHUNK: usize = 256;
        let chunks = self.pressure.chunks(CHUNK).zip(self.change.chunks(CHUNK));
        let sums = chunks.map(|(pressure, change)| {
            let mut partial = [0.0_f32; 16];
            let (pressures, rest) = pressure.as_chunks::<16>();
            let (changes, changes_rest) = change.as_chunks::<16>();
            for (pressure, change) in pressures.iter().zip(changes) {
                for lane in 0..16 {
                    partial[lane] += term(pressure[lane], change[lane]);
                }
            }
            for (lane, (pressure, change)) in rest.iter().zip(changes_rest).enumerate() {
                partial[lane] += term(*pressure, *change);
            }
            partial.into_iter().map(f64::from).sum::<f64>()
        });
        sums.sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(nodes: &[(f32, f32)]) -> Candidates {
        let mut all = Candidates::default();
        for (pressure, change) in nodes {
            all.push(*pressure, *change);
        }
        all
    }

    #[test]
    fn between_their_bounds_nodes_share_equally() {
        let all = nodes(&[(1.0, 0.5), (2.0, -0.25), (3.0, 0.0), (4.0, 0.0)]);
        assert!((all.shift(0.0, 10.0).unwrap() + 0.0625).abs() < 1e-6);
        assert!((all.shift(1.0, 10.0).unwrap() - 0.1875).abs() < 1e-6);
    }

    #[test]
    fn nodes_at_their_bounds_do_not_take_part_in_the_shift() {
        // The first node falls to zero and loses one; the last would exceed the ceiling.
        let all = nodes(&[(1.0, -3.0), (2.0, 0.0), (3.0, 0.0), (4.0, 7.0)]);
        assert!((all.shift(0.0, 4.0).unwrap() - 0.5).abs() < 1e-6);
    }

    #[test]
    fn of_nodes_that_jump_between_bounds_those_with_the_largest_changes_jump() {
        // Two of the three nodes with positive changes may rise, because two nodes fall.
        let all = nodes(&[(0.0, 900.0), (0.0, 800.0), (0.0, 700.0), (1.0, -800.0), (1.0, -900.0)]);
        let shift = all.shift(0.0, 1.0).unwrap();
        assert!((-800.0..=-699.0).contains(&shift), "{shift}");
    }

    #[test]
    fn a_sum_out_of_reach_has_no_shift() {
        assert_eq!(Candidates::default().shift(0.0, 1.0), None);
        assert_eq!(nodes(&[(0.5, 0.0)]).shift(0.6, 1.0), None);
        assert_eq!(nodes(&[(0.5, 0.0)]).shift(-0.6, 1.0), None);
    }
}
