//! Continues over all nodes what free ones ask for, and hands back to them what the others are
//! asked for then.
//!
//! Where the gap of free nodes is r, the pressure on them that closes it is that which the
//! stiffness K has for r continued by the displacement that this pressure causes elsewhere. Of all
//! continuations E r this one has the least energy ⟨E r, K E r⟩: it is ⟨r, S r⟩, where S is the
//! stiffness of the free nodes alone. So Eᵀ K E is symmetric and no less than S for any linear E,
//! and close to S if E r is about as smooth as displacements are. What zeros elsewhere cost is a
//! jump at each edge of contact: then the eigenvalues of S⁻¹ Eᵀ K E reach from 1 to 5 or 20, as the
//! logarithm of wavelength over spot (long waves ask for far too much), and with the present E to
//! 1.2 or 1.4 on all meshes, for all spectra and from light loads to nearly full contact.
//!
//! E is a pyramid of means. Each block of 4 × 4 nodes, and of 2 × 2 blocks, and so on, takes the
//! sum over its free nodes together with the value of the larger blocks around it, interpolated
//! linearly, which weighs as much as [`WEIGHT`] of the block's nodes. Around the largest block is
//! zero. So a value fades with the distance from contact over which contact is sparse: were it not
//! to fade, what one node asks for would spread as far as there is no other.
//!
//! Passes over the mesh work on a row of blocks at a time (`rows`): the rows of nodes in it are
//! added up node by node, and then along the row. The pyramid has a sixteenth of the nodes
//! (`levels`).

use super::lanes::over_rows;
use crate::threads::Threads;

mod levels;
mod rows;

pub use rows::{ContinuedRows, GivenRows, ResidualRows, TakenRows};

use levels::{AddWhole, Divide, GatherAround, JoinRows, MixAround, SumQuarters};

/// Nodes along a side of the smallest blocks: with 2, hardly fewer iterations.
const SIDE: usize = 4;

/// What the value around a block weighs, in nodes over those of the block. Largest eigenvalues from
/// 0.006 to 1 E* × rms slope: 1.2 to 1.4; with half or double of it, 1.2 to 2.
const WEIGHT: f32 = 0.25;

/// The pyramid; its mesh is taken to repeat, for what is continued need not be exact.
pub struct Extension {
    levels: Vec<Level>,
    /// What rows of the smallest blocks have taken for the rows before them, and for those after.
    for_neighbours: [Vec<f32>; 2],
    /// Of the map, along x and y,
    map: [usize; 2],
    /// and of the mesh that it is a corner of.
    nodes: [usize; 2],
    /// Else it continues by zeros: corrections are then less far-reaching, for a search that has
    /// gone astray with others.
    pub continues: bool,
}

/// Blocks of one size.
struct Level {
    /// Along x and y.
    blocks: [usize; 2],
    /// What the value around each weighs, in nodes.
    around: f32,
    /// Free nodes,
    free: Vec<f32>,
    /// and sums over them, or what has become of these.
    values: Vec<f32>,
}

impl Extension {
    /// Over a mesh of `nodes`, of which the map is a corner or all: nodes around it ask for
    /// nothing.
    pub fn new(map: [usize; 2], nodes: [usize; 2]) -> Self {
        let (mut side, mut levels) = (SIDE, Vec::new());
        loop {
            let blocks = nodes.map(|nodes| nodes.div_ceil(side));
            let area = side.min(nodes[0]) * side.min(nodes[1]);
            let count = blocks[0] * blocks[1];
            levels.push(Level {
                blocks,
                around: WEIGHT * area as f32,
                free: vec![0.0; count],
                values: vec![0.0; count],
            });
            if blocks == [1, 1] {
                break;
            }
            side *= 2;
        }
        let smallest = levels[0].values.len();
        Self {
            levels,
            for_neighbours: [vec![0.0; smallest], vec![0.0; smallest]],
            map,
            nodes,
            continues: true,
        }
    }

    /// Makes of all rows that were asked for what is to be written.
    pub fn extend(&mut self, threads: &Threads) {
        if !self.continues {
            return self.levels[0].values.fill(0.0);
        }
        self.clear_beyond_map();
        for finer in 0..self.levels.len() - 1 {
            let [fine, coarse] = self.pair(finer);
            for (of, to) in [(&fine.free, &mut coarse.free), (&fine.values, &mut coarse.values)] {
                let mut pass = SumQuarters::new(fine.blocks, of);
                over_rows(threads, to, coarse.blocks[1], &mut pass);
            }
        }
        self.divide_top();
        for finer in (0..self.levels.len() - 1).rev() {
            let [fine, coarse] = self.pair(finer);
            let mut pass = MixAround::new(&fine.free, fine.around, coarse.blocks, &coarse.values);
            over_rows(threads, &mut fine.values, fine.blocks[1], &mut pass);
        }
    }

    /// Makes of all rows that were taken what is to be handed back: the transpose of
    /// [`Extension::extend`].
    pub fn collect(&mut self, threads: &Threads) {
        let smallest = &mut self.levels[0];
        let mut pass = JoinRows::new(smallest.blocks, &self.for_neighbours);
        over_rows(threads, &mut smallest.values, smallest.blocks[1], &mut pass);
        self.hand_down(threads);
    }

    /// Hands what the smallest blocks have taken to those with free nodes.
    fn hand_down(&mut self, threads: &Threads) {
        if !self.continues {
            return self.levels[0].values.fill(0.0);
        }
        for finer in 0..self.levels.len() - 1 {
            let [fine, coarse] = self.pair(finer);
            let mut pass = Divide::new(&fine.free, fine.around);
            over_rows(threads, &mut fine.values, fine.blocks[1], &mut pass);
            let mut pass = GatherAround::new(fine.blocks, fine.around, coarse.blocks, &fine.values);
            over_rows(threads, &mut coarse.values, coarse.blocks[1], &mut pass);
        }
        self.divide_top();
        for finer in (0..self.levels.len() - 1).rev() {
            let [fine, coarse] = self.pair(finer);
            let mut pass = AddWhole::new(coarse.blocks, &coarse.values);
            over_rows(threads, &mut fine.values, fine.blocks[1], &mut pass);
        }
    }

    /// What lies there was not asked.
    fn clear_beyond_map(&mut self) {
        let smallest = &mut self.levels[0];
        let asked = self.map[0].div_ceil(SIDE) * smallest.blocks[1];
        smallest.values[asked..].fill(0.0);
    }

    /// Around the largest block is zero.
    fn divide_top(&mut self) {
        let top = self.levels.last_mut().expect("one block at least");
        top.values[0] /= top.free[0] + top.around;
    }

    /// A level and the next one, of larger blocks.
    fn pair(&mut self, finer: usize) -> [&mut Level; 2] {
        self.levels.get_disjoint_mut([finer, finer + 1]).expect("there is a larger block")
    }
}

#[cfg(test)]
pub(super) mod tests;
