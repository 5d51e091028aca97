//! Two-level preconditioner for the first iterations, with a stiffness on a mesh of blocks and a
//! nodal stiffness.
//!
//! The first iterations of a load only find the nodes in contact. Until these are found,
//! corrections need not be as accurate as those of Eᵀ K E. Let r be
//! the gap of free nodes. Π r are the means of r over the free nodes of each block of `extension`.
//! P r are the means over all nodes of each block, after r is extended to the nodes that are not
//! free. The correction is
//!
//! s (r − Π r) + Pᵀ K P r.
//!
//! It is symmetric and positive, like the accurate correction. s is a stiffness for waves shorter
//! than a block. K is |q|/2, divided by the factor by which block means reduce a wave. The
//! convolution with K is on a sixteenth of the nodes, which costs almost nothing compared with a
//! pair of transforms. An iteration takes two thirds of the time and makes about the same progress
//! (docs/notes/solver-pairs.md).

use std::f64::consts::PI;

use pulp::Simd;

use super::Extension;
use crate::elasticity::ElasticOperator;
use crate::fft::{Kernel, Row, Scratch, Transform};
use crate::solver::lanes::{Pass, Wide};
use crate::threads::Threads;

/// Ratio of the stiffness s of waves shorter than a block to the nodal stiffness. With 0.45, loads
/// take 3 per cent more pairs; with 0.8, up to a quarter more.
const SHORT_WAVES: f64 = 0.6;

/// Two-level preconditioner, with a stiffness for block means and another for shorter waves.
pub struct TwoLevel {
    blocks: [usize; 2],
    transform: Transform<f32>,
    kernel: Kernel<f32>,
    /// Stiffness s of waves shorter than a block.
    stiffness: f32,
}

/// Buffers of a [`TwoLevel`].
pub struct BlockBuffers {
    scratch: Scratch<f32>,
    /// Sums of the residual over the free nodes of each block, which [`TwoLevel::correct`] replaces
    /// by pressures on these nodes.
    sums: Vec<f32>,
}

impl BlockBuffers {
    pub fn set_threads(&mut self, threads: &Threads) {
        self.scratch.set_threads(threads.clone());
    }
}

impl TwoLevel {
    /// Creates the preconditioner of a body; `blocks` are the numbers of blocks along x and y.
    pub fn new(
        threads: &Threads,
        body: &dyn ElasticOperator,
        nodal_stiffness: f64,
        blocks: [usize; 2],
    ) -> Self {
        let transform = Transform::new(blocks);
        let kernel = Kernel::from_columns(threads, blocks, |k_y, factors| {
            for (k_x, factor) in factors.iter_mut().enumerate() {
                let waves = [k_x, k_y];
                let part = part_in_means(k_x, blocks[0]) * part_in_means(k_y, blocks[1]);
                *factor = body.preconditioner(waves) / part;
            }
        });
        Self { blocks, transform, kernel, stiffness: (SHORT_WAVES * nodal_stiffness) as f32 }
    }

    pub fn buffers(&self, threads: &Threads) -> BlockBuffers {
        BlockBuffers {
            scratch: self.transform.scratch_on(threads.clone()),
            sums: vec![0.0; self.blocks[0] * self.blocks[1]],
        }
    }

    /// Computes [Pᵀ K P r − s Π r](self), the block part of the corrections, from the residual r
    /// that was added to `extension`. The result is the output of the transpose of `extension`.
    pub fn correct(
        &self,
        threads: &Threads,
        extension: &mut Extension,
        buffers: &mut BlockBuffers,
    ) {
        let BlockBuffers { scratch, sums } = buffers;
        self.transform.begin(&mut extension.extend_means(threads, sums), scratch);
        self.transform.multiply(&self.kernel, scratch);
        self.transform.finish(&mut extension.block_pressures(self.stiffness, sums), scratch);
        extension.collect_means(threads, sums);
    }

    /// Returns [s r](self), the nodal part of the corrections, with the residual r = `gap` −
    /// `level`.
    pub fn nodal<'a>(&self, gap: &'a [f32], level: f64) -> Nodal<'a> {
        Nodal { gap, level: level as f32, stiffness: self.stiffness }
    }
}

/// Nodal part of corrections, `stiffness` × (gap − `level`) at each node.
#[derive(Clone, Copy)]
pub struct Nodal<'a> {
    pub gap: &'a [f32],
    pub level: f32,
    pub stiffness: f32,
}

impl Nodal<'_> {
    /// Calls `visit` with a pass that hands rows of corrections to `pass`, whatever the rows hold.
    pub fn over<P: Pass<f32>>(
        self,
        row_nodes: usize,
        pass: &mut Wide<P>,
        visit: impl FnOnce(&mut Wide<NodalRows<P>>),
    ) {
        let mut rows = Wide(NodalRows { of: self, pass: pass.0.split_off(Row::new(0, row_nodes)) });
        visit(&mut rows);
        pass.0.append(rows.0.pass);
    }
}

/// Pass that computes rows of nodal corrections and hands them to another pass.
pub struct NodalRows<'a, P> {
    of: Nodal<'a>,
    pass: P,
}

impl<P: Pass<f32>> Pass<f32> for NodalRows<'_, P> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f32]) {
        let Nodal { gap, level, stiffness } = self.of;
        for (value, gap) in values.iter_mut().zip(row.of(gap)) {
            *value = stiffness * (gap - level);
        }
        self.pass.row::<S, R>(simd, row, values);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { of: self.of, pass: self.pass.split_off(row) }
    }

    fn append(&mut self, later: Self) {
        self.pass.append(later.pass);
    }
}

/// Returns sin(x)/x with x = π `waves`/`blocks`, the factor by which means over blocks reduce the
/// amplitude of a wave.
fn part_in_means(waves: usize, blocks: usize) -> f64 {
    let half = PI * waves as f64 / blocks as f64;
    if waves == 0 { 1.0 } else { libm::sin(half) / half }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use pulp::{Scalar512b, Simd};

    use super::*;
    use crate::elasticity::{Factor, FreeHalfSpace, PeriodicHalfSpace};
    use crate::fft::{Row, visit_pairs};
    use crate::grid::samples::{rectangle, square};
    use crate::solver::blocks::TransposeOutput;
    use crate::solver::blocks::extension::tests::noise;
    use crate::solver::lanes::Pass;
    use crate::solver::lanes::Shared;
    use crate::solver::marks::{FREE, has};

    /// Free nodes of a body, and their preconditioner.
    struct Body {
        nodes: [usize; 2],
        last_step: Vec<f32>,
        two_level: TwoLevel,
        extension: Extension,
    }

    impl Body {
        fn new(body: &dyn ElasticOperator, is_free: impl Fn(usize) -> bool) -> Self {
            let (threads, nodes) = (Threads::one(), body.grid().nodes());
            let extension = Extension::new(nodes, body.stiffness_nodes(), &[]);
            let stiffness = body.nodal(Factor::Stiffness, &threads);
            let blocks = Extension::blocks_of(body.stiffness_nodes());
            let marked = |node| f32::from_bits(u32::from(is_free(node)) * FREE);
            Self {
                nodes,
                last_step: (0..nodes[0] * nodes[1]).map(marked).collect(),
                two_level: TwoLevel::new(&threads, body, stiffness, blocks),
                extension,
            }
        }

        fn on_free(&self, map: &[f32]) -> Vec<f32> {
            let free = |last_step: &f32| f32::from(u8::from(has(*last_step, FREE)));
            let nodes = map.iter().zip(&self.last_step);
            nodes.map(|(value, last_step)| value * free(last_step)).collect()
        }

        /// Returns the corrections of a gap on free nodes.
        fn corrected(&mut self, gap: &[f32]) -> Vec<f32> {
            let (threads, [rows, row_nodes]) = (Threads::one(), self.nodes);
            let gap = self.on_free(gap);
            let mut asked = self.extension.residual_rows();
            for row in (0..rows).map(|row| Row::new(row, row_nodes)) {
                let (values, last_step) = (row.of(&gap), row.of(&self.last_step));
                asked.add_row::<_, 1>(Scalar512b, row, values, last_step, &[true; 64]);
            }
            let mut buffers = self.two_level.buffers(&threads);
            self.two_level.correct(&threads, &mut self.extension, &mut buffers);
            let mut pass =
                Wide(Keep { given: self.extension.transpose_output(), rows: Vec::new() });
            let pairs: Vec<usize> = (0..rows.div_ceil(2)).collect();
            let nodal = self.two_level.nodal(&gap, 0.0);
            nodal.over(row_nodes, &mut pass, |rows| {
                visit_pairs(&threads, &pairs, self.nodes, rows);
            });
            self.on_free(&pass.0.rows)
        }
    }

    /// Pass that keeps a copy of each row after adding the output of the transpose.
    struct Keep<'a> {
        given: TransposeOutput<'a>,
        rows: Vec<f32>,
    }

    impl Pass<f32> for Keep<'_> {
        fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
            self.given.add_to_row(row, values, &[true; 64]);
            self.rows.extend_from_slice(values);
        }

        fn split_off(&mut self, row: Row) -> Self {
            Self { given: self.given.split_off(row), rows: Vec::new() }
        }

        fn append(&mut self, mut later: Self) {
            self.rows.append(&mut later.rows);
        }
    }

    fn dot(a: &[f32], b: &[f32]) -> f64 {
        let products = a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b));
        products.sum()
    }

    /// Returns whether a node belongs to a pattern of strips, spots and single nodes.
    fn patches(node: usize) -> bool {
        node.is_multiple_of(7) || node % 40 < 11 || (node / 97).is_multiple_of(5)
    }

    #[test]
    fn it_is_symmetric_and_positive_on_all_meshes() {
        let bodies: [Box<dyn ElasticOperator>; 5] = [
            Box::new(PeriodicHalfSpace::new(square(64, 1.0))),
            Box::new(PeriodicHalfSpace::new(rectangle([30, 49], [30.0, 49.0]))),
            Box::new(PeriodicHalfSpace::new(rectangle([33, 18], [1.0, 2.0]))),
            Box::new(PeriodicHalfSpace::new(square(5, 1.0))),
            Box::new(FreeHalfSpace::new(square(36, 1.0))),
        ];
        for body in bodies {
            let count = body.grid().count();
            let mut body = Body::new(&*body, patches);
            let (a, b) = (noise(1, count), noise(2, count));
            let (of_a, of_b) = (body.corrected(&a), body.corrected(&b));
            let size = (dot(&a, &of_a) * dot(&b, &of_b)).sqrt();
            assert!(dot(&body.on_free(&a), &of_a) > 0.0 && dot(&body.on_free(&b), &of_b) > 0.0);
            let difference = dot(&a, &of_b) - dot(&b, &of_a);
            assert!(difference.abs() < 1e-5 * size, "{difference} of {size}");
        }
    }

    #[test]
    fn in_full_contact_waves_are_corrected_by_the_sum_of_both_levels() {
        let grid = square(64, 1.0);
        let half_space = PeriodicHalfSpace::new(grid);
        let own = SHORT_WAVES * half_space.nodal(Factor::Stiffness, &Threads::one());
        let mut body = Body::new(&half_space, |_| true);
        // The waves have few enough periods to avoid aliasing on sixteen blocks.
        for waves in [[1, 0], [2, 3], [5, 4], [0, 7]] {
            let wave = |node: usize| {
                let [i, j] = grid.indices(node);
                (TAU * (waves[0] * i + waves[1] * j) as f64 / 64.0).cos() as f32
            };
            let gap: Vec<f32> = (0..grid.count()).map(wave).collect();
            let asked = dot(&gap, &body.corrected(&gap)) / dot(&gap, &gap);
            // The reductions of a wave by means over four nodes, and by means over continuous
            // blocks.
            let half = waves.map(|waves| PI * waves as f64 / 64.0);
            let of_nodes = |half: f64| (4.0 * half).sin() / (4.0 * half.sin());
            let mean: f64 =
                half.map(|half| if half > 0.0 { of_nodes(half) } else { 1.0 }).iter().product();
            let part: f64 = waves.map(|waves| part_in_means(waves, 16)).iter().product();
            let expected =
                own * (1.0 - mean * mean) + half_space.stiffness(waves) * mean * mean / part;
            assert!((asked / expected - 1.0).abs() < 1e-5, "{waves:?}: {asked}, {expected}");
        }
    }
}
