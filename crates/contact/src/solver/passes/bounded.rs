//! Pressures up to the hardness: brought up to date with a search, and scaled.
//!
//! Few nodes are in elastic contact where a material yields, strips around saturated ones. They are gathered, for their
//! pressures may have to be scaled several times.

use pulp::Simd;

use super::super::flags::{SATURATED, has};
use super::super::lanes::{LANES, Pass, sum_by, weight};
use super::base::Base;
use super::evaluate::promote;
use crate::fft::Row;

/// Brings pressures up to date with their search, and tallies them. Single precision knows the hardness
/// less well.
pub struct PromoteYielding<'a> {
    pub hardness: f64,
    pub base: &'a Base,
    pub increment: &'a [f32],
    /// Marked where nodes are saturated.
    pub carry: &'a [f32],
    pub tally: Tally,
}

impl Pass<f64> for PromoteYielding<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        promote(1.0, self.base.row(row), row.of(self.increment), pressure);
        for (p, carry) in pressure.iter_mut().zip(row.of(self.carry)) {
            let is_saturated = has(*carry, SATURATED) || *p > self.hardness;
            *p = if is_saturated { self.hardness } else { *p };
        }
        self.tally.add(row, pressure);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { tally: Tally::below(self.hardness), ..*self }
    }

    fn append(&mut self, later: Self) {
        self.tally.join(later.tally);
    }
}

/// Nodes in elastic contact, and how many saturated ones there are. As a pass of its own it brings down to
/// the hardness what is above.
pub struct Tally {
    pub hardness: f64,
    pub saturated_nodes: f64,
    /// Ascending. Meshes with more of them than this holds fit into no memory.
    elastic: Vec<u32>,
}

impl Tally {
    /// Nothing so far, under this hardness.
    pub fn below(hardness: f64) -> Self {
        Self { hardness, saturated_nodes: 0.0, elastic: Vec::new() }
    }

    #[inline(always)]
    fn add(&mut self, row: Row, pressure: &[f64]) {
        let hardness = self.hardness;
        self.saturated_nodes += sum_by(pressure, pressure, |p, _| weight::<f64>(p >= hardness));
        let (groups, rest) = pressure.as_chunks::<LANES>();
        let mut first = row.range().start as u32;
        for group in groups {
            self.gather(first, group);
            first += LANES as u32;
        }
        self.gather(first, rest);
    }

    /// Gathers elastic nodes of no more than a group of neighbours, from the first one on.
    #[inline(always)]
    fn gather(&mut self, first: u32, pressures: &[f64]) {
        let mut elastic = [0; LANES];
        let mut count = 0;
        let mut any = false;
        for p in pressures {
            any |= (*p != 0.0) & (*p < self.hardness);
        }
        if !any {
            return;
        }
        for (node, p) in (first..).zip(pressures) {
            elastic[count] = node;
            count += usize::from((*p != 0.0) & (*p < self.hardness));
        }
        self.elastic.extend_from_slice(&elastic[..count]);
    }

    fn join(&mut self, mut later: Self) {
        self.saturated_nodes += later.saturated_nodes;
        self.elastic.append(&mut later.elastic);
    }

    /// Σ of elastic pressures: row by row, sixteen partial sums in each.
    pub fn elastic_sum(&self, pressure: &[f64], row_nodes: usize) -> f64 {
        let mut sum = 0.0;
        for nodes in self
            .elastic
            .chunk_by(|one, next| *one as usize / row_nodes == *next as usize / row_nodes)
        {
            let mut partial = [0.0; LANES];
            for node in nodes {
                partial[*node as usize % row_nodes % LANES] += pressure[*node as usize];
            }
            sum += partial.into_iter().sum::<f64>();
        }
        sum
    }

    /// Scales elastic pressures, and says how many nodes are saturated then that were not.
    pub fn scale(&mut self, pressure: &mut [f64], scale: f64) -> usize {
        let before = self.elastic.len();
        let hardness = self.hardness;
        self.elastic.retain(|node| {
            let p = &mut pressure[*node as usize];
            *p *= scale;
            let stays = *p < hardness;
            *p = p.min(hardness);
            stays
        });
        let saturated = before - self.elastic.len();
        self.saturated_nodes += saturated as f64;
        saturated
    }
}

impl Pass<f64> for Tally {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, pressure: &mut [f64]) {
        for p in &mut *pressure {
            *p = p.min(self.hardness);
        }
        self.add(row, pressure);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self::below(self.hardness)
    }

    fn append(&mut self, later: Self) {
        self.join(later);
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::lanes::over_rows;
    use super::*;
    use crate::threads::Threads;

    #[test]
    fn elastic_nodes_are_scaled_until_they_saturate() {
        // Rows of a whole group and four nodes of the next.
        let nodes = 20;
        let mut pressure: Vec<f64> = [0.0, 0.25, 1.5, 0.5].repeat(10);
        let mut tally = Tally::below(1.0);
        over_rows(&Threads::one(), &mut pressure, nodes, &mut tally);
        let odd = Vec::from_iter((1..40).step_by(2));
        assert_eq!((tally.saturated_nodes, &tally.elastic), (10.0, &odd));
        assert_eq!(tally.elastic_sum(&pressure, nodes), 7.5);

        assert_eq!(tally.scale(&mut pressure, 2.0), 10);
        assert_eq!(pressure, [0.0, 0.5, 1.0, 1.0].repeat(10));
        assert_eq!(tally.saturated_nodes, 20.0);
        assert_eq!(tally.elastic_sum(&pressure, nodes), 5.0);
        assert_eq!(tally.scale(&mut pressure, 1.5), 0);
    }
}
