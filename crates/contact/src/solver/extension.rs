//! Extension E of the residual of free nodes over all nodes, and its transpose.
//!
//! Let r be the gap of free nodes above the offset. The pressure on free nodes that closes it is
//! the stiffness K times r extended by the displacement that this pressure causes elsewhere. Of all
//! extensions E r this one has the least energy ⟨E r, K E r⟩ = ⟨r, S r⟩, where S is the stiffness
//! of the free nodes alone. So Eᵀ K E is symmetric and not less than S for any linear E, and close
//! to S if E r is about as smooth as displacements are.
//!
//! Extension by zeros has a jump at each edge of contact. The eigenvalues of S⁻¹ Eᵀ K E then reach
//! from 1 to 5 or 20, growing as the logarithm of wavelength over spot size, because corrections of
//! long waves are far too large. With the present E they reach 1.2 or 1.4 on all meshes, for all
//! spectra, and from light loads to nearly full contact.
//!
//! E is a pyramid of means. Each block of 4 × 4 nodes, each block of 2 × 2 such blocks, and so on,
//! gets a weighted mean: of its free nodes, and of the linearly interpolated value of the larger
//! blocks around it, which counts as [`WEIGHT`] of the block's nodes. The value around the largest
//! block is zero. So the extension decays with the distance from contact over which contact is
//! sparse. Without decay the residual of an isolated node would spread to its nearest neighbours,
//! however far.
//!
//! Passes over the mesh process one row of blocks at a time (`rows`): they add up its rows of
//! nodes, and then the nodes along the row. The pyramid has a sixteenth of the nodes (`levels`).

use super::lanes::over_rows;
use crate::threads::Threads;

mod levels;
mod rows;

pub use rows::{ContinuedRows, GivenRows, ResidualRows, TakenRows};

use levels::{AddWhole, Divide, GatherAround, JoinRows, MixAround, SumQuarters};

/// Nodes along a side of the smallest blocks; with 2, there are hardly fewer iterations.
const SIDE: usize = 4;

/// Weight of the value around a block, over the nodes of the block. The largest eigenvalues from
/// 0.006 to 1 E* × rms slope are 1.2 to 1.4; with half or double the weight 1.2 to 2.
const WEIGHT: f32 = 0.25;

/// Pyramid of means on a mesh that is taken as periodic; the extension need not be exact.
pub struct Extension {
    levels: Vec<Level>,
    /// Values that rows of the smallest blocks collected for the rows before and after them.
    for_neighbours: [Vec<f32>; 2],
    map: [usize; 2],
    /// Nodes of the mesh, of which the map is a corner.
    nodes: [usize; 2],
    /// If false, the extension is zero: corrections reach less far, for a search that went astray.
    pub continues: bool,
}

struct Level {
    blocks: [usize; 2],
    /// Weight of the value around each block, in nodes.
    around: f32,
    free: Vec<f32>,
    /// Sums over free nodes, or values derived from them.
    values: Vec<f32>,
}

impl Extension {
    /// Creates the pyramid of a mesh of which the map is a corner; nodes around the map are not
    /// free.
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

    /// Computes the extension from the sums of the residual.
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

    /// Computes the transpose of [`Extension::extend`] from the collected values.
    pub fn collect(&mut self, threads: &Threads) {
        let smallest = &mut self.levels[0];
        let mut pass = JoinRows::new(smallest.blocks, &self.for_neighbours);
        over_rows(threads, &mut smallest.values, smallest.blocks[1], &mut pass);
        self.hand_down(threads);
    }

    /// Distributes the values of the smallest blocks to blocks with free nodes.
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

    /// Clears values beyond the map, where no residual was added.
    fn clear_beyond_map(&mut self) {
        let smallest = &mut self.levels[0];
        let asked = self.map[0].div_ceil(SIDE) * smallest.blocks[1];
        smallest.values[asked..].fill(0.0);
    }

    /// Completes the largest block, around which the value is zero.
    fn divide_top(&mut self) {
        let top = self.levels.last_mut().expect("one block at least");
        top.values[0] /= top.free[0] + top.around;
    }

    /// Returns a level and the next one, of larger blocks.
    fn pair(&mut self, finer: usize) -> [&mut Level; 2] {
        self.levels.get_disjoint_mut([finer, finer + 1]).expect("there is a larger block")
    }
}

#[cfg(test)]
pub(super) mod tests;
