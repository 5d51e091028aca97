//! Balance of the mean pressure while pressures are clipped at both bounds.
//!
//! If the material yields, pressures cannot be scaled back to their mean after a move, because
//! saturated ones would leave their bound. Instead, a direction is shifted before the move by a
//! constant that makes up for all that will be clipped, estimated from free nodes in a sample of
//! rows. Similarly, the residual is measured from an offset for which it would add as much pressure
//! to some nodes as it removes from others. This matters if few or no nodes are elastic: their mean
//! gap then says nothing, and nodes jump between both bounds. [`Nodes`] finds the shift of
//! pressures within bounds that changes their sum by a given amount.

use super::evaluation::Convergence;
use super::lanes::Wide;
use super::passes::{GapSums, MIN_SAMPLE_NODES, PeekGap};
use super::search::Search;
use super::{Hardness, Solver};

/// Remaining reduction of the residual below which all free nodes are used to balance moves.
const BALANCED_REDUCTION: f64 = 1e-3;

/// Sums of a search under a hardness.
#[derive(Debug, Clone, Copy)]
pub struct Balance {
    pub sum: f64,
    pub free_offset: f64,
}

impl Balance {
    pub fn seen(seen: &GapSums, sum: f64, offset: f64) -> Self {
        Self { sum, free_offset: offset + seen.free_sum / seen.free_nodes.max(1.0) }
    }
}

impl Search {
    /// Returns whether a sample of rows is too small to balance a move, given the remaining
    /// reduction of the residual.
    ///
    /// Near the end, elastic pressures are scaled to restore the missing load. A few strips of
    /// nodes bear it, and their gaps open by more than the tolerance.
    pub(super) fn must_balance(&self, reduction: f64) -> bool {
        self.bound.is_some() && reduction > BALANCED_REDUCTION
    }

    /// Returns the mean to subtract from a direction, so that clipped pressures gain the missing
    /// load.
    ///
    /// The estimate uses the free nodes collected from `rows` rows.
    pub(super) fn balanced_mean(
        &mut self,
        [step, share]: [f64; 2],
        missing_load: f64,
        rows: usize,
    ) -> Option<f64> {
        let hardness = self.bound?;
        self.candidates.follow(step as f32, share as f32, &self.last_moves);
        let part = rows as f64 / self.nodes[0] as f64;
        let shift = self.candidates.shift(part * missing_load, hardness.pressure() as f32)?;
        Some(-shift / step)
    }

    /// Returns the offset after a move for which the sum of bounded pressures would not change if
    /// nodes did not interact.
    ///
    /// It is estimated from a sample of rows, or from all rows if the sample is too small. Close to
    /// a solution it is the mean gap of elastic nodes.
    pub(super) fn peek_offset(
        &mut self,
        part: f64,
        convergence: Convergence,
        sees_all_rows: bool,
    ) -> f64 {
        let hardness = self.ceiling();
        let Convergence { offset, error } = convergence;
        let mut peek = Wide(PeekGap {
            gap: &self.gap,
            reference_pressure: &self.reference_pressure,
            pressure_increment: &self.pressure_increment,
            last_step: &self.last_step,
            part: part as f32,
            stiffness: self.nodal_stiffness as f32,
            range: [(offset + error) as f32, (offset - error) as f32],
            nodes: Nodes::default(),
            level: offset as f32,
        });
        let (single, scratch) = (&self.transform, &mut self.scratch);
        single.peek(&self.sample.pairs(), &mut peek, scratch);
        if sees_all_rows || peek.0.is_too_small() {
            single.peek(&self.sample.other_pairs(), &mut peek, scratch);
        }
        let shift = peek.0.nodes.shift(0.0, hardness as f32).unwrap_or(0.0);
        offset + shift / self.nodal_stiffness
    }
}

impl Solver {
    /// Returns the offset for which the sum of bounded pressures would not change if nodes did not
    /// interact.
    ///
    /// The mean gap of elastic nodes, from which errors are measured, may be that of one or two
    /// nodes.
    pub(super) fn balanced_offset(&mut self, hardness: Hardness, convergence: Convergence) -> f64 {
        self.search.candidates.clear();
        self.gather(self.search.sample.pairs(), hardness, convergence);
        if (self.search.candidates.len() as f64) < MIN_SAMPLE_NODES {
            self.gather(self.search.sample.other_pairs(), hardness, convergence);
        }
        let shift = self.search.candidates.shift(0.0, hardness.pressure() as f32);
        convergence.offset + shift.unwrap_or(0.0) / self.search.nodal_stiffness
    }

    /// Collects nodes of pairs of rows whose pressure may change.
    fn gather(&mut self, pairs: Vec<usize>, hardness: Hardness, convergence: Convergence) {
        let Convergence { offset, error } = convergence;
        for pair in pairs {
            let first = 2 * pair * self.search.nodes[1];
            let last = self.pressure.len().min(first + 2 * self.search.nodes[1]);
            for (p, gap) in self.pressure[first..last].iter().zip(&self.search.gap[first..last]) {
                let above = f64::from(*gap) - offset;
                let may_change = match *p {
                    0.0 => above < error,
                    p if p >= hardness.pressure() => above > -error,
                    _ => true,
                };
                if may_change {
                    let change = -self.search.nodal_stiffness * above;
                    self.search.candidates.push(*p as f32, change as f32);
                }
            }
        }
    }
}

/// Accuracy of shifts and sums relative to the largest change, and limits by single precision and
/// by the number of steps.
const PRECISION: f64 = 1e-6;

const ROUNDING: f64 = 1e-7;

const STEPS: usize = 40;

/// Nodes whose pressures may change.
#[derive(Default)]
pub struct Nodes {
    pressure: Vec<f32>,
    /// Change of the pressure of each node, before the common shift.
    change: Vec<f32>,
}

impl Nodes {
    pub fn clear(&mut self) {
        self.pressure.clear();
        self.change.clear();
    }

    pub fn len(&self) -> usize {
        self.pressure.len()
    }

    /// Adds `share` times `others` to the changes and multiplies them by `step`.
    pub fn follow(&mut self, step: f32, share: f32, others: &[f32]) {
        for (change, other) in self.change.iter_mut().zip(others) {
            *change = step * (*change + share * other);
        }
    }

    pub fn append(&mut self, mut later: Self) {
        self.pressure.append(&mut later.pressure);
        self.change.append(&mut later.change);
    }

    /// Appends the first `first` nodes. Copying a fixed size uses one register.
    #[inline(always)]
    pub fn extend<const N: usize>(
        &mut self,
        pressures: &[f32; N],
        changes: &[f32; N],
        first: usize,
    ) {
        let nodes = self.len() + first;
        self.pressure.extend_from_slice(pressures);
        self.change.extend_from_slice(changes);
        self.pressure.truncate(nodes);
        self.change.truncate(nodes);
    }

    #[inline(always)]
    pub fn push(&mut self, pressure: f32, change: f32) {
        self.pressure.push(pressure);
        self.change.push(change);
    }

    /// Returns the shift of all changes with which the bounded pressures gain `missing_load` in
    /// sum.
    ///
    /// If several shifts do, any of them. `None` without nodes, or if the sum is out of reach.
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
            // Pressures that are not clipped count to their last digit, even if they are much
            // larger than the changes.
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

    /// Returns the shifts with which all nodes are at the lower or at the upper bound.
    fn range(&self, ceiling: f32) -> (f64, f64) {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for (pressure, change) in self.pressure.iter().zip(&self.change) {
            let after = pressure + change;
            (low, high) = (low.min(after), high.max(after));
        }
        (-f64::from(high), f64::from(ceiling) - f64::from(low))
    }

    /// Returns Σ term(pressure, change), in chunks that single precision can add up.
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

    fn nodes(nodes: &[(f32, f32)]) -> Nodes {
        let mut all = Nodes::default();
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
    fn nodes_at_their_bounds_leave_it_to_the_others() {
        // The first falls to zero and loses one; the last would exceed the ceiling.
        let all = nodes(&[(1.0, -3.0), (2.0, 0.0), (3.0, 0.0), (4.0, 7.0)]);
        assert!((all.shift(0.0, 4.0).unwrap() - 0.5).abs() < 1e-6);
    }

    #[test]
    fn nodes_that_jump_from_bound_to_bound_are_chosen_by_how_much_they_want_to() {
        // Two of three nodes that want to rise may, because two fall.
        let all = nodes(&[(0.0, 900.0), (0.0, 800.0), (0.0, 700.0), (1.0, -800.0), (1.0, -900.0)]);
        let shift = all.shift(0.0, 1.0).unwrap();
        assert!((-800.0..=-699.0).contains(&shift), "{shift}");
    }

    #[test]
    fn a_sum_out_of_reach_has_no_shift() {
        assert_eq!(Nodes::default().shift(0.0, 1.0), None);
        assert_eq!(nodes(&[(0.5, 0.0)]).shift(0.6, 1.0), None);
        assert_eq!(nodes(&[(0.5, 0.0)]).shift(-0.6, 1.0), None);
    }
}
