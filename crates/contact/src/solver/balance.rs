//! Moves that keep the mean pressure although they are clipped at both bounds.
//!
//! Where the material yields, pressures cannot be scaled back to their mean after a move: what is
//! saturated would leave its bound. So a direction is shifted, before it is followed, by as much as
//! makes up for all that will be clipped: what that is, free nodes in a sample of rows show. And
//! gaps ask from an offset which takes as much pressure from some as it gives to others. That
//! matters where few nodes are elastic or none: their mean gap says nothing then, while nodes
//! change places between both bounds. [`Nodes`] tell which shift of pressures within bounds changes
//! their sum by as much as it should.

use super::evaluation::Convergence;
use super::lanes::Wide;
use super::passes::{FEWEST_NODES, PeekGap, Seen};
use super::search::Search;
use super::{Hardness, Solver};

/// Where the residual is yet to be reduced by less than this, moves are balanced by all free nodes.
const BALANCED_REDUCTION: f64 = 1e-3;

/// What a search under a hardness knows of its pressures besides the gap.
#[derive(Debug, Clone, Copy)]
pub struct Balance {
    /// Σ pressure.
    pub sum: f64,
    /// Mean gap of free nodes.
    pub free_offset: f64,
}

impl Balance {
    pub fn seen(seen: &Seen, sum: f64, offset: f64) -> Self {
        Self { sum, free_offset: offset + seen.free_sum / seen.free_nodes.max(1.0) }
    }
}

impl Search {
    /// Whether a sample of rows shows too little of what pressures will lack, for a move after
    /// which the residual is yet to be reduced by this factor. Near the end elastic pressures are
    /// scaled by what is missing_load then; a few strips of nodes bear it, and their gaps open by more
    /// than the tolerance.
    pub(super) fn must_balance(&self, reduction: f64) -> bool {
        self.bound.is_some() && reduction > BALANCED_REDUCTION
    }

    /// What is to be subtracted from a direction so that it brings what pressures lack when they
    /// are clipped, as far as the free nodes that were gathered in so many rows show it.
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

    /// The offset after a move from which gaps ask that pressures, kept within their bounds, change
    /// by nothing in sum, were each node alone: what a sample of rows shows of it, or all if it
    /// shows too little. Close to a solution, it is the mean gap of elastic nodes.
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
        if sees_all_rows || peek.0.saw_too_little() {
            single.peek(&self.sample.other_pairs(), &mut peek, scratch);
        }
        let shift = peek.0.nodes.shift(0.0, hardness as f32).unwrap_or(0.0);
        offset + shift / self.nodal_stiffness
    }
}

impl Solver {
    /// The offset from which gaps ask that pressures, kept within their bounds, change by nothing
    /// in sum, were each node alone. The mean gap of elastic nodes, from which errors are measured,
    /// may be that of one or two.
    pub(super) fn balanced_offset(&mut self, hardness: Hardness, convergence: Convergence) -> f64 {
        self.search.candidates.clear();
        self.gather(self.search.sample.pairs(), hardness, convergence);
        if (self.search.candidates.len() as f64) < FEWEST_NODES {
            self.gather(self.search.sample.other_pairs(), hardness, convergence);
        }
        let shift = self.search.candidates.shift(0.0, hardness.pressure() as f32);
        convergence.offset + shift.unwrap_or(0.0) / self.search.nodal_stiffness
    }

    /// Gathers nodes of pairs of rows whose gap may ask for another pressure.
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

/// Shifts and sums are found to so much of the largest change, as far as single precision knows
/// them, or in so many steps.
const PRECISION: f64 = 1e-6;

const ROUNDING: f64 = 1e-7;

const STEPS: usize = 40;

/// Nodes whose pressures may change.
#[derive(Default)]
pub struct Nodes {
    pressure: Vec<f32>,
    /// What their pressure is to change by, but for a shift common to all.
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

    /// Makes the changes `step` times as large, after `share` of other ones were added.
    pub fn follow(&mut self, step: f32, share: f32, others: &[f32]) {
        for (change, other) in self.change.iter_mut().zip(others) {
            *change = step * (*change + share * other);
        }
    }

    /// Adds those that were gathered later.
    pub fn append(&mut self, mut later: Self) {
        self.pressure.append(&mut later.pressure);
        self.change.append(&mut later.change);
    }

    /// Adds the first of these, with what each is to change by. Copies of one size take a register.
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

    /// The shift of all changes with which pressures, kept between zero and `ceiling`, come to
    /// `missing_load` more than they do. Of several such shifts, any; none without nodes, or if even
    /// all at their bounds do not.
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
            // What is not clipped counts to its last digit, though pressures are much larger.
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

    /// Shifts with which all nodes are at one bound or the other.
    fn range(&self, ceiling: f32) -> (f64, f64) {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for (pressure, change) in self.pressure.iter().zip(&self.change) {
            let after = pressure + change;
            (low, high) = (low.min(after), high.max(after));
        }
        (-f64::from(high), f64::from(ceiling) - f64::from(low))
    }

    /// Σ term(pressure, change), in chunks that single precision bears.
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
        // The first falls to zero, which takes away one; the last would pass the ceiling.
        let all = nodes(&[(1.0, -3.0), (2.0, 0.0), (3.0, 0.0), (4.0, 7.0)]);
        assert!((all.shift(0.0, 4.0).unwrap() - 0.5).abs() < 1e-6);
    }

    #[test]
    fn nodes_that_jump_from_bound_to_bound_are_chosen_by_how_much_they_want_to() {
        // Two of three that want to rise may, for two fall.
        let all = nodes(&[(0.0, 900.0), (0.0, 800.0), (0.0, 700.0), (1.0, -800.0), (1.0, -900.0)]);
        let shift = all.shift(0.0, 1.0).unwrap();
        assert!((-800.0..=-699.0).contains(&shift), "{shift}");
    }

    #[test]
    fn what_no_shift_does_is_said() {
        assert_eq!(Nodes::default().shift(0.0, 1.0), None);
        assert_eq!(nodes(&[(0.5, 0.0)]).shift(0.6, 1.0), None);
        assert_eq!(nodes(&[(0.5, 0.0)]).shift(-0.6, 1.0), None);
    }
}
