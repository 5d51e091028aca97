//! Moves that keep the mean pressure although they are clipped at both bounds.
//!
//! Where the material yields, pressures cannot be scaled back to their mean after a move: what is
//! saturated would leave its bound. So a direction is shifted, before it is followed, by as much as
//! makes up for all that will be clipped: what that is, free nodes in a sample of rows show. And gaps
//! ask from an offset which takes as much pressure from some as it gives to others. That matters
//! where few nodes are elastic or none: their mean gap says nothing then, while nodes change places
//! between both bounds.

use super::lanes::Wide;
use super::passes::{FEWEST_NODES, PeekGap, Seen};
use super::search::Search;
use super::shift::Nodes;
use super::survey::Standing;
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
    /// Whether a sample of rows shows too little of what pressures will lack, for a move after which the
    /// residual is yet to be reduced by this factor. Near the end elastic pressures are scaled by what
    /// is lacked then; a few strips of nodes bear it, and their gaps open by more than the tolerance.
    pub(super) fn must_balance(&self, reduction: f64) -> bool {
        self.bound.is_some() && reduction > BALANCED_REDUCTION
    }

    /// What is to be subtracted from a direction so that it brings what pressures lack when they are
    /// clipped, as far as the free nodes that were gathered in so many rows show it.
    pub(super) fn balanced_mean(
        &mut self,
        [step, share]: [f64; 2],
        lacked: f64,
        rows: usize,
    ) -> Option<f64> {
        let hardness = self.bound?;
        self.asking.follow(step as f32, share as f32, &self.last_moves);
        let part = rows as f64 / self.nodes[0] as f64;
        let shift = self.asking.shift(part * lacked, hardness.pressure() as f32)?;
        Some(-shift / step)
    }

    /// The offset after a move from which gaps ask that pressures, kept within their bounds, change
    /// by nothing in sum, were each node alone: what a sample of rows shows of it, or all if it
    /// shows too little. Close to a solution, it is the mean gap of elastic nodes.
    pub(super) fn peek_offset(
        &mut self,
        part: f64,
        standing: Standing,
        sees_all_rows: bool,
    ) -> f64 {
        let hardness = self.ceiling();
        let Standing { offset, error } = standing;
        let mut peek = Wide(PeekGap {
            gap: &self.gap,
            base: &self.base,
            increment: &self.increment,
            carry: &self.carry,
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
    /// The offset from which gaps ask that pressures, kept within their bounds, change by nothing in
    /// sum, were each node alone. The mean gap of elastic nodes, from which errors are measured, may
    /// be that of one or two.
    pub(super) fn balanced_offset(&mut self, hardness: Hardness, standing: Standing) -> f64 {
        self.search.asking.clear();
        self.gather(self.search.sample.pairs(), hardness, standing);
        if (self.search.asking.len() as f64) < FEWEST_NODES {
            self.gather(self.search.sample.other_pairs(), hardness, standing);
        }
        let shift = self.search.asking.shift(0.0, hardness.pressure() as f32);
        standing.offset + shift.unwrap_or(0.0) / self.search.nodal_stiffness
    }

    /// Gathers nodes of pairs of rows whose gap may ask for another pressure.
    fn gather(&mut self, pairs: Vec<usize>, hardness: Hardness, standing: Standing) {
        let Standing { offset, error } = standing;
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
                    self.search.asking.push(*p as f32, change as f32);
                }
            }
        }
    }
}
