//! A look at gaps in a sample of rows, or in all.

use pulp::Simd;

use super::super::flags::{FREE, PRESSED, SATURATED, has};
use super::super::lanes::Pass;
use super::super::shift::Nodes;
use super::base::Base;
use super::peek::FEWEST_NODES;
use crate::fft::Row;

/// Nodes that a gap may ask to change, after a move, in rows of the displacement under it, or as
/// they are.
pub struct PeekGap<'a> {
    /// Before the move.
    pub gap: &'a [f32],
    pub base: &'a Base,
    /// After the move.
    pub increment: &'a [f32],
    /// Moves of free nodes, and marks by the pressure after them.
    pub carry: &'a [f32],
    /// How much of the move is kept.
    pub part: f32,
    /// What unit gaps take from pressures.
    pub stiffness: f32,
    /// The highest gap of nodes without pressure, and the lowest of saturated ones, that count.
    pub range: [f32; 2],
    /// The pressures, and what gaps less `level` take from them.
    pub nodes: Nodes,
    pub level: f32,
}

impl PeekGap<'_> {
    /// Whether too little was seen to go by.
    pub fn saw_too_little(&self) -> bool {
        (self.nodes.len() as f64) < FEWEST_NODES
    }
}

impl Pass<f32> for PeekGap<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let (gap, carry) = (row.of(self.gap), row.of(self.carry));
        let pressure = self.base.row(row).iter().zip(row.of(self.increment));
        let taken = 1.0 - self.part;
        let [highest, lowest] = self.range;
        let gaps = values.iter().zip(gap);
        for (((value, gap), carry), (base, increment)) in gaps.zip(carry).zip(pressure) {
            let gap = gap + self.part * *value;
            let is_free = has(*carry, FREE);
            let may_change = if is_free && taken > 0.0 {
                true
            } else if has(*carry, SATURATED) {
                gap > lowest
            } else {
                has(*carry, PRESSED) || gap < highest
            };
            if may_change {
                let back = if is_free { taken * carry } else { 0.0 };
                let change = self.stiffness * (self.level - gap);
                self.nodes.push(base + (increment - back), change);
            }
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { nodes: Nodes::default(), ..*self }
    }

    fn append(&mut self, later: Self) {
        self.nodes.append(later.nodes);
    }
}
