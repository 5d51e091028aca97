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

use super::levels::{
    AddParent, Divide, JoinRows, MeansWithOuter, SumQuarters, TransposeInterpolation,
};
use crate::elasticity::ElasticOperator;
use crate::solver::lanes::over_rows;
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
                let mut pass = SumQuarters::new(fine.blocks, of);
                over_rows(threads, to, coarse.blocks[1], &mut pass);
            }
        }
        self.divide_top();
        for finer in (0..self.levels.len() - 1).rev() {
            let [fine, coarse] = self.pair(finer);
            let mut pass =
                MeansWithOuter::new(&fine.free, fine.around, coarse.blocks, &coarse.values);
            over_rows(threads, &mut fine.values, fine.blocks[1], &mut pass);
        }
    }

    /// Applies the transpose of [`Extension::extend`] to the values collected by
    /// [`TransposeInput`].
    pub fn collect(&mut self, threads: &Threads) {
        let smallest = &mut self.levels[0];
        let mut pass = JoinRows::new(smallest.blocks, &self.for_neighbours);
        over_rows(threads, &mut smallest.values, smallest.blocks[1], &mut pass);
        self.transpose_pyramid(threads);
    }

    /// Applies [`Extension::collect`] with the numbers of free nodes that the smallest blocks have
    /// now, while those of larger blocks are still to be added up.
    pub fn collect_anew(&mut self, threads: &Threads) {
        for finer in 0..self.levels.len() - 1 {
            let [fine, coarse] = self.pair(finer);
            let mut pass = SumQuarters::new(fine.blocks, &fine.free);
            over_rows(threads, &mut coarse.free, coarse.blocks[1], &mut pass);
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
            let mut pass = Divide::new(&fine.free, fine.around);
            over_rows(threads, &mut fine.values, fine.blocks[1], &mut pass);
            let mut pass =
                TransposeInterpolation::new(fine.blocks, fine.around, coarse.blocks, &fine.values);
            over_rows(threads, &mut coarse.values, coarse.blocks[1], &mut pass);
        }
        self.divide_top();
        for finer in (0..self.levels.len() - 1).rev() {
            let [fine, coarse] = self.pair(finer);
            let mut pass = AddParent::new(coarse.blocks, &coarse.values);
            over_rows(threads, &mut fine.values, fine.blocks[1], &mut pass);
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
pub mod tests {
    //! Tests of extensions on meshes of all sizes.

    use pulp::Scalar512b;

    use super::*;
    use crate::fft::Row;
    use crate::solver::blocks::{ResidualRows, TransposeInput};
    use crate::solver::lanes::weight;
    use crate::solver::marks::{FREE, has};

    /// Returns numbers from −0.5 to 0.5, the same for the same seed.
    pub fn noise(seed: u64, count: usize) -> Vec<f32> {
        let mut state = seed;
        let mut draw = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1_u64 << 24) as f32 - 0.5
        };
        (0..count).map(|_| draw()).collect()
    }

    fn rows([rows, row_nodes]: [usize; 2]) -> impl Iterator<Item = Row> {
        (0..rows).map(move |index| Row::new(index, row_nodes))
    }

    /// Calls `visit` on all rows, with the pass `P` split at each of `cuts`.
    fn over<P>(
        nodes: [usize; 2],
        cuts: &[usize],
        whole: P,
        split_off: impl Fn(&mut P, Row) -> P,
        mut visit: impl FnMut(&mut P, Row),
    ) {
        let mut parts = vec![whole];
        let mut firsts = vec![0];
        for cut in cuts.iter().rev().map(|cut| *cut.min(&nodes[0])) {
            let part = split_off(&mut parts[0], Row::new(cut, nodes[1]));
            parts.insert(1, part);
            firsts.insert(1, cut);
        }
        for row in rows(nodes) {
            let part = firsts.partition_point(|first| *first <= row.index()) - 1;
            visit(&mut parts[part], row);
        }
    }

    /// Returns the extension of the residual of free nodes over the mesh of which the map is a
    /// corner.
    fn continued(
        extension: &mut Extension,
        cuts: &[usize],
        residual: &[f32],
        last_step: &[f32],
    ) -> Vec<f32> {
        let [map, nodes] = [extension.map, extension.nodes];
        over(map, cuts, extension.residual_rows(), ResidualRows::split_off, |part, row| {
            part.add_row::<_, 1>(Scalar512b, row, row.of(residual), row.of(last_step), &[true; 64])
        });
        extension.extend(&Threads::one());
        let mut values = vec![0.0; nodes[0] * nodes[1]];
        over(
            nodes,
            cuts,
            extension.extended_rows(),
            |part, _| part.split_off(),
            |part, row| {
                let [(own, of_own), (other, of_other)] = part.row(row);
                for (value, (own, other)) in
                    row.of_mut(&mut values).iter_mut().zip(own.iter().zip(other))
                {
                    *value = of_own * own + of_other * other;
                }
            },
        );
        values
    }

    fn handed_back(
        extension: &mut Extension,
        cuts: &[usize],
        values: &[f32],
        last_step: &[f32],
    ) -> Vec<f32> {
        let [map, nodes] = [extension.map, extension.nodes];
        over(nodes, cuts, extension.transpose_input(), TransposeInput::split_off, |part, row| {
            let inside = row.index() < map[0];
            let marks = inside.then(|| Row::new(row.index(), map[1]).of(last_step));
            let marks = marks.unwrap_or_default();
            part.collect_row::<_, 1>(Scalar512b, row, row.of(values), marks, &[true; 64])
        });
        extension.collect(&Threads::one());
        let mut given = vec![0.0; last_step.len()];
        over(
            map,
            cuts,
            extension.transpose_output(),
            |part, _| part.split_off(),
            |part, row| part.add_to_row(row, row.of_mut(&mut given), &[true; 64]),
        );
        given
    }

    fn marks(seed: u64, count: usize, share: f32) -> Vec<f32> {
        let free = |draw: f32| u32::from(draw + 0.5 < share) * FREE;
        let marked = |draw| f32::from_bits(free(draw));
        noise(seed, count).into_iter().map(marked).collect()
    }

    /// Returns a map in the corner of a mesh, with the value `beyond` around it.
    fn in_corner(map: &[f32], [own, nodes]: [[usize; 2]; 2], beyond: f32) -> Vec<f32> {
        let mut all = vec![beyond; nodes[0] * nodes[1]];
        for (values, row) in all.chunks_mut(nodes[1]).zip(rows(own)) {
            values[..own[1]].copy_from_slice(row.of(map));
        }
        all
    }

    fn dot(a: &[f32], b: &[f32]) -> f64 {
        a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum()
    }

    #[test]
    fn collecting_is_the_transpose_of_extending() {
        let whole = [[64, 64], [50, 37], [128, 6], [6, 90], [9, 12], [1, 9], [3, 3], [1, 1]];
        let corners =
            [[[40, 48], [64, 64]], [[50, 37], [96, 64]], [[33, 5], [33, 10]], [[1, 1], [2, 2]]];
        let meshes = whole.map(|nodes| [nodes; 2]).into_iter().chain(corners);
        for (seed, [map, nodes]) in meshes.enumerate() {
            let count = map[0] * map[1];
            let last_step = marks(7 + seed as u64, count, 0.2);
            let free: Vec<f32> =
                last_step.iter().map(|last_step| weight(has(*last_step, FREE))).collect();
            let product = |values: Vec<f32>, weights: &[f32]| -> Vec<f32> {
                let weighed = values.iter().zip(weights);
                weighed.map(|(value, weight)| value * weight).collect()
            };
            let fixed: Vec<f32> = free.iter().map(|free| 1.0 - free).collect();
            let fixed = in_corner(&fixed, [map, nodes], 1.0);
            let residual = product(noise(1, count), &free);
            let outside = product(noise(2, fixed.len()), &fixed);
            let mut extension = Extension::new(map, nodes, &[]);
            let forth = dot(&continued(&mut extension, &[], &residual, &last_step), &outside);
            let back = dot(&residual, &handed_back(&mut extension, &[], &outside, &last_step));
            assert!((forth - back).abs() < 1e-5 * (1.0 + forth.abs()), "{nodes:?}: {forth} {back}");
        }
    }

    #[test]
    fn a_residual_on_all_nodes_is_extended_almost_unchanged() {
        let nodes = [96, 80];
        let residual = vec![2.0; 96 * 80];
        let last_step = vec![f32::from_bits(FREE); 96 * 80];
        let values = continued(&mut Extension::new(nodes, nodes, &[]), &[], &residual, &last_step);
        // The outer value has a weight of a fifth in each block. The outer value of the largest
        // block is zero.
        assert!(values.iter().all(|value| (1.99..=2.0).contains(value)));
    }

    #[test]
    fn the_residual_of_one_node_decays_with_distance() {
        let nodes = [64, 64];
        let (mut residual, mut last_step) = (vec![0.0; 64 * 64], vec![0.0; 64 * 64]);
        (residual[0], last_step[0]) = (1.0, f32::from_bits(FREE));
        let values = continued(&mut Extension::new(nodes, nodes, &[]), &[], &residual, &last_step);
        let diagonal = [1, 4, 8, 16, 31].map(|place| values[place * 65]);
        assert!(diagonal.is_sorted_by(|near, far| near > far), "{diagonal:?}");
        assert!(diagonal[0] < 0.5 && diagonal[4] > 0.0);
    }

    #[test]
    fn the_map_repeats() {
        let nodes = [64, 64];
        let from = |node: usize| {
            let (mut residual, mut last_step) = (vec![0.0; 64 * 64], vec![0.0; 64 * 64]);
            (residual[node], last_step[node]) = (1.0, f32::from_bits(FREE));
            continued(&mut Extension::new(nodes, nodes, &[]), &[], &residual, &last_step)
        };
        // Shifted by half a side, all blocks except the largest are as before.
        let (corner, middle) = (from(0), from(32 * 65));
        for x in 0..64 {
            for y in 0..64 {
                let moved = middle[(x + 32) % 64 * 64 + (y + 32) % 64];
                assert_eq!(corner[64 * x + y], moved);
            }
        }
    }

    #[test]
    fn rows_of_several_threads_give_the_same_bits() {
        for (map, nodes) in [([64, 48], [64, 48]), ([50, 37], [50, 37]), ([50, 37], [64, 64])] {
            let count = map[0] * map[1];
            let last_step = marks(3, count, 0.3);
            let residual: Vec<f32> = noise(4, count)
                .iter()
                .zip(&last_step)
                .map(|(residual, last_step)| weight::<f32>(has(*last_step, FREE)) * residual)
                .collect();
            let values = noise(5, nodes[0] * nodes[1]);
            let both = |cuts: &[usize]| {
                let mut extension = Extension::new(map, nodes, &[]);
                let continued = continued(&mut extension, cuts, &residual, &last_step);
                let given = handed_back(&mut extension, cuts, &values, &last_step);
                [continued, given].map(|map| map.into_iter().map(f32::to_bits).collect::<Vec<_>>())
            };
            let alone = both(&[]);
            // The last part may have no rows.
            for cuts in [vec![8], vec![24, 32], vec![16, 40, nodes[0]]] {
                assert_eq!(both(&cuts), alone);
            }
        }
    }
}
