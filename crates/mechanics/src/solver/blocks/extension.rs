//! Extension E of the residual of free nodes to all nodes, and its transpose.
//!
//! Let r be the gap of free nodes above the offset. The pressure on free nodes that closes this gap
//! displaces other nodes, too. If r is extended to all nodes by these displacements, this pressure
//! is the stiffness K times the extended r. Of all extensions E r this one has the least energy ⟨E
//! r, K E r⟩ = ⟨r, S r⟩, where S is the stiffness of the free nodes alone. Therefore, for any
//! linear E, the preconditioner Eᵀ K E is symmetric and Eᵀ K E − S is positive semidefinite. It is
//! close to S if E r is about as smooth as displacements are.
//!
//! Extension by zeros has a jump at each edge of contact, and its corrections of long waves are far
//! too large. The eigenvalues of S⁻¹ Eᵀ K E then extend from 1 to 5 or even 20 and grow with the
//! logarithm of the ratio of wavelength to contact size. With the present E the largest eigenvalue
//! is 1.2 to 1.4 on all meshes, for all spectra, and from light loads to nearly full contact.
//!
//! E is a pyramid of means. The smallest blocks have 4 × 4 nodes, and each larger block has 2 × 2
//! blocks of the next smaller size. Each block gets a weighted mean of two values: the residual at
//! its free nodes, and the *outer value*, which is interpolated linearly from larger blocks. The
//! outer value counts as [`WEIGHT`] of the block's nodes; that of the largest block is zero. The
//! extension therefore decays with the distance from contact, more slowly where contact is sparse.
//! Without decay, the residual of an isolated node would spread to its nearest neighbours at any
//! distance.
//!
//! Passes over the mesh process one row of blocks at a time (`rows`): they first add up the rows of
//! nodes of the blocks, and then the nodes along the row. The smallest blocks are a sixteenth of
//! the nodes (`levels`).

use std::iter::successors;

use super::levels::{add, add_parents, means_with_outer, sum_quarters, transpose_interpolation};
use crate::elasticity::ElasticOperator;
use crate::fft::Row;
use crate::solver::lanes::for_rows;
use crate::threads::Threads;

/// Number of nodes along a side of the smallest blocks. With 2 instead of 4, the solver needs
/// hardly fewer iterations.
pub const SIDE: usize = 4;

/// Weight of the [outer value](self) in the mean of a block, as a fraction of the nodes of the
/// block.
///
/// With this weight, the largest eigenvalues of S⁻¹ Eᵀ K E for loads from 0.006 to 1 E* × rms slope
/// are 1.2 to 1.4; with half or double the weight they are 1.2 to 2.
const WEIGHT: f32 = 0.25;

/// Largest factor of [`WEIGHT`] for bodies other than a half-space.
const MAX_WEIGHT_FACTOR: f64 = 256.0;

/// Returns the weight of the outer value in the mean of a block, as a fraction of the nodes of the
/// block. `relative` is the displacement of waves of twice the side of the block, relative to a
/// half-space.
///
/// The smaller it is, the less a block displaces its surroundings, and the faster the extension
/// must decay. Without this factor, bonded layers that are thin compared with the cell take 1.2 to
/// 2 times the pairs, and up to ten times if they are incompressible. Below a stiff coating,
/// displacements are smoother than on a half-space, and with a smaller weight the extension is
/// smoother, too: coatings of twenty times the modulus take a fifth fewer pairs.
fn weight_of(relative: f64) -> f32 {
    if relative > 1.0 {
        return WEIGHT / relative as f32;
    }
    WEIGHT * (1.0 / (relative * relative)).clamp(1.0, MAX_WEIGHT_FACTOR) as f32
}

/// Pyramid of block means, which extends the residual of free nodes to all nodes of a mesh.
///
/// It treats the mesh as periodic, which suffices for a preconditioner.
pub struct Extension {
    pub levels: Vec<Level>,
    /// Two maps of the smallest blocks, used by the transpose. They contain the pressures that each
    /// row of blocks adds to the previous and to the next row of blocks.
    pub for_neighbours: [Vec<f32>; 2],
    pub map: [usize; 2],
    /// Numbers of nodes of the mesh; the map is a corner of the mesh.
    pub nodes: [usize; 2],
    /// False to extend the residual by zeros, which makes corrections local. This is needed after
    /// steps that were far too long.
    pub is_enabled: bool,
}

pub struct Level {
    pub blocks: [usize; 2],
    /// Weight of the [outer value](self) of each block, as a number of nodes.
    around: f32,
    pub free: Vec<f32>,
    /// Sums of the residual over free nodes, or the means computed from them.
    pub values: Vec<f32>,
}

impl Extension {
    /// Creates the pyramid for a mesh with `nodes` nodes along x and y.
    ///
    /// `relative` are the displacements of waves relative to a half-space, at wavelengths of twice
    /// the sides of the blocks, from the smallest blocks on; blocks beyond the list have 1.
    ///
    /// The map occupies a corner with `map` nodes; nodes outside the map are never free.
    pub fn new(map: [usize; 2], nodes: [usize; 2], relative: &[f64]) -> Self {
        let (mut side, mut levels) = (SIDE, Vec::new());
        loop {
            let blocks = nodes.map(|nodes| nodes.div_ceil(side));
            let area = side.min(nodes[0]) * side.min(nodes[1]);
            let count = blocks[0] * blocks[1];
            levels.push(Level {
                blocks,
                around: weight_of(relative.get(levels.len()).copied().unwrap_or(1.0)) * area as f32,
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
            is_enabled: true,
        }
    }

    /// Returns the displacements of waves of a body relative to a half-space, at wavelengths of
    /// twice the sides of the blocks.
    pub fn relative_displacements(body: &dyn ElasticOperator) -> Vec<f64> {
        let most = body.stiffness_nodes().into_iter().max().unwrap_or(1);
        let sides = successors(Some(SIDE), |side| (*side < most).then_some(2 * side));
        let waves = sides.map(|side| body.grid().smaller_steps() / (2 * side) as f64);
        waves.map(|wavenumber| body.relative_displacement(wavenumber)).collect()
    }

    /// Replaces the sums of the residual in the smallest blocks by weighted means of the residual
    /// and the [outer value](self), from which [`ExtendedRows`] are interpolated.
    pub fn extend(&mut self, threads: &Threads) {
        if !self.is_enabled {
            return self.levels[0].values.fill(0.0);
        }
        self.clear_beyond_map();
        for finer in 0..self.levels.len() - 1 {
            let [fine, coarse] = self.pair(finer);
            for (of, to) in [(&fine.free, &mut coarse.free), (&fine.values, &mut coarse.values)] {
                sum_quarters(threads, [fine.blocks, coarse.blocks], of, to);
            }
        }
        self.divide_top();
        for finer in (0..self.levels.len() - 1).rev() {
            let [fine, coarse] = self.pair(finer);
            let outer = (&coarse.values[..], &fine.free[..], fine.around);
            means_with_outer(threads, [fine.blocks, coarse.blocks], outer, &mut fine.values);
        }
    }

    /// Applies the transpose of [`Extension::extend`] to the values collected by
    /// [`TransposeInput`].
    pub fn collect(&mut self, threads: &Threads) {
        let Self { levels, for_neighbours: [for_before, for_after], .. } = self;
        let Level { blocks: [rows, blocks], ref mut values, .. } = levels[0];
        for_rows(threads, values, blocks, |row, values| {
            let before = (row.index + rows - 1) % rows;
            let after = (row.index + 1) % rows;
            add(values, Row::new(after, blocks).of(for_before), 1.0);
            add(values, Row::new(before, blocks).of(for_after), 1.0);
        });
        self.transpose_pyramid(threads);
    }

    /// Applies [`Extension::collect`] with the numbers of free nodes that the smallest blocks have
    /// now, while those of larger blocks are still to be added up.
    pub fn collect_anew(&mut self, threads: &Threads) {
        for finer in 0..self.levels.len() - 1 {
            let [fine, coarse] = self.pair(finer);
            let blocks = [fine.blocks, coarse.blocks];
            sum_quarters(threads, blocks, &fine.free, &mut coarse.free);
        }
        self.collect(threads);
    }

    /// Applies the transpose of the pyramid of means to the values of the smallest blocks, in
    /// place.
    pub fn transpose_pyramid(&mut self, threads: &Threads) {
        if !self.is_enabled {
            return self.levels[0].values.fill(0.0);
        }
        for finer in 0..self.levels.len() - 1 {
            let [fine, coarse] = self.pair(finer);
            let Level { blocks, around: weight, free, values } = &mut *fine;
            for_rows(threads, values, blocks[1], |row, values| {
                for (value, free) in values.iter_mut().zip(row.of(free)) {
                    *value /= free + *weight;
                }
            });
            let (blocks, inner) = ([fine.blocks, coarse.blocks], (&fine.values[..], fine.around));
            transpose_interpolation(threads, blocks, inner, &mut coarse.values);
        }
        self.divide_top();
        for finer in (0..self.levels.len() - 1).rev() {
            let [fine, coarse] = self.pair(finer);
            let blocks = [fine.blocks, coarse.blocks];
            add_parents(threads, blocks, &coarse.values, &mut fine.values);
        }
    }

    /// Sets the values of the smallest blocks outside the map to zero: these nodes have no
    /// residual.
    pub fn clear_beyond_map(&mut self) {
        let smallest = &mut self.levels[0];
        let asked = self.map[0].div_ceil(SIDE) * smallest.blocks[1];
        smallest.values[asked..].fill(0.0);
    }

    /// Divides the value of the largest block by n + w, where n is the number of free nodes in the
    /// block and w the weight of the outer value (zero here).
    fn divide_top(&mut self) {
        let top = self.levels.last_mut().expect("one block at least");
        top.values[0] /= top.free[0] + top.around;
    }

    /// Returns the level `finer` and the next level, which has larger blocks.
    fn pair(&mut self, finer: usize) -> [&mut Level; 2] {
        self.levels.get_disjoint_mut([finer, finer + 1]).expect("there is a larger block")
    }
}

#[cfg(test)]
pub mod tests;
