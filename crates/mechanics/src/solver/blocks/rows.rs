//! Passes between rows of nodes and rows of the smallest blocks: sums of the residual, the
//! extension, its transpose, and block means for the two-level preconditioner.
//!
//! Threads split passes at multiples of [`SIDE`] rows, so that each row of blocks belongs to one
//! thread.

use pulp::Simd;

use super::extension::{Extension, Level, SIDE};
use super::levels::{add, gather, interpolate, is_before, repeat, sum, weights};
use crate::fft::{Band, ROW_BATCH, Row, Rows};
use crate::solver::lanes::{LANES, Lanes, REST, Shared, Visit, for_rows, split, split_mut};
use crate::solver::marks::{ALL, FREE};
use crate::threads::Threads;

const _: () = assert!(ROW_BATCH.is_multiple_of(SIDE));

/// Sums of the residual of free nodes in the smallest blocks, to which rows of the map are added
/// one by one.
pub struct ResidualRows<'a> {
    rows: usize,
    blocks: usize,
    free: Band<'a, f32>,
    values: Band<'a, f32>,
    /// Number of free nodes and sum of residuals in the present row of blocks, for each column of
    /// nodes.
    sums: [Vec<f32>; 2],
}

impl Extension {
    pub fn residual_rows(&mut self) -> ResidualRows<'_> {
        let smallest = &mut self.levels[0];
        let blocks = smallest.blocks[1];
        ResidualRows {
            rows: self.map[0],
            blocks,
            free: Band::new(&mut smallest.free),
            values: Band::new(&mut smallest.values),
            sums: [vec![0.0; SIDE * blocks], vec![0.0; SIDE * blocks]],
        }
    }

    pub fn extended_rows(&self) -> ExtendedRows<'_> {
        ExtendedRows::new(&self.levels[0])
    }
}

impl ResidualRows<'_> {
    /// Adds a row of the residual, which must be zero at nodes that are not free; `last_step` holds
    /// the flags of the nodes. Only the groups marked in `groups` are added; these have a free
    /// node.
    #[inline(always)]
    pub fn add_row<S: Simd, const R: usize>(
        &mut self,
        simd: S,
        row: Row,
        residual: &[f32],
        last_step: &[f32],
        groups: &[bool],
    ) {
        let [free, values] = &mut self.sums;
        let (free_sums, last_free) = split_mut::<S, R>(&mut free[..residual.len()]);
        let (sums, last_sums) = split_mut::<S, R>(&mut values[..residual.len()]);
        let (residual, last_residual) = split::<S, R>(residual);
        let (last_step, rest_step) = split::<S, R>(last_step);
        add_residual(simd, groups, free_sums, sums, residual, last_step);
        let rest = &ALL[..last_residual.len()];
        add_residual(REST, rest, last_free, last_sums, last_residual, rest_step);
        if ends_blocks(row, self.rows) {
            let block_row = Row::new(row.index / SIDE, self.blocks);
            let bands = [&mut self.free, &mut self.values];
            for (sums, band) in self.sums.iter_mut().zip(bands) {
                sum(sums.as_chunks::<SIDE>().0, band.row(block_row));
                sums.fill(0.0);
            }
        }
    }
}

impl Shared for ResidualRows<'_> {
    fn split_off(&mut self, row: Row) -> Self {
        let block_row = Row::new(row.index.div_ceil(SIDE), self.blocks);
        Self {
            free: self.free.split_off(block_row),
            values: self.values.split_off(block_row),
            sums: self.sums.clone(),
            ..*self
        }
    }
}

#[inline(always)]
fn add_residual<S: Simd, const R: usize>(
    simd: S,
    groups: &[bool],
    free_sums: &mut [[S::f32s; R]],
    sums: &mut [[S::f32s; R]],
    residual: &[[S::f32s; R]],
    last_step: &[[S::f32s; R]],
) {
    let one = Lanes::all(simd, 1.0);
    let rows = residual.iter().zip(last_step);
    let rows = free_sums.iter_mut().zip(sums).zip(rows).zip(groups);
    for (((free_sum, sum), (residual, last_step)), has_free) in rows {
        if !has_free {
            continue;
        }
        let free = Lanes::of(simd, *last_step).has(FREE).or_zero(one);
        *free_sum = (Lanes::of(simd, *free_sum) + free).numbers();
        *sum = (Lanes::of(simd, *sum) + Lanes::of(simd, *residual)).numbers();
    }
}

pub struct ExtendedRows<'a> {
    smallest: &'a Level,
    /// Row of blocks, with one more block before and after.
    near: Vec<f32>,
    /// Previous, present and next row of blocks, interpolated to the nodes along the row.
    rows: [Vec<f32>; 3],
    here: Option<usize>,
}

impl<'a> ExtendedRows<'a> {
    fn new(smallest: &'a Level) -> Self {
        let blocks = smallest.blocks[1];
        Self {
            smallest,
            near: vec![0.0; blocks + 2],
            rows: std::array::from_fn(|_| vec![0.0; SIDE * blocks]),
            here: None,
        }
    }

    /// Returns the row `row` of the extension as two rows of values, each with a weight. The
    /// weighted sum of both rows is the extended residual of each node.
    ///
    /// Both slices may be longer than the row of nodes.
    #[inline(always)]
    pub fn row(&mut self, row: Row) -> [(&[f32], f32); 2] {
        let (block, part) = (row.index / SIDE, row.index % SIDE);
        if self.here != Some(block) {
            self.go_to(block);
        }
        let [own, other] = weights::<SIDE>(part);
        let [before, here, after] = &self.rows;
        let neighbour = if is_before::<SIDE>(part) { before } else { after };
        [(here, own), (neighbour, other)]
    }

    #[inline(always)]
    fn go_to(&mut self, block: usize) {
        let rows = self.smallest.blocks[0];
        if block > 0 && self.here == Some(block - 1) {
            self.rows.rotate_left(1);
        } else {
            self.interpolate(0, (block + rows - 1) % rows);
            self.interpolate(1, block);
        }
        self.interpolate(2, (block + 1) % rows);
        self.here = Some(block);
    }

    #[inline(always)]
    fn interpolate(&mut self, which: usize, block: usize) {
        let blocks = self.smallest.blocks[1];
        let values = Row::new(block, blocks).of(&self.smallest.values);
        self.near[1..=blocks].copy_from_slice(values);
        repeat(&mut self.near);
        interpolate(&self.near, self.rows[which].as_chunks_mut::<SIDE>().0);
    }
}

impl Shared for ExtendedRows<'_> {
    fn split_off(&mut self, _: Row) -> Self {
        Self::new(self.smallest)
    }
}

/// Returns whether a row of nodes is the last one of its row of blocks, on a mesh of `rows` rows.
#[inline(always)]
pub fn ends_blocks(row: Row, rows: usize) -> bool {
    row.index % SIDE == SIDE - 1 || row.index + 1 == rows
}

/// Input of the transpose of the extension: sums, in the smallest blocks, of pressures on nodes
/// that are not free, weighted like the interpolation. Rows of the mesh are added one by one.
pub struct TransposeInput<'a> {
    rows: usize,
    blocks: usize,
    /// Sums for the previous, the present and the next row of blocks.
    bands: [Band<'a, f32>; 3],
    /// The same sums for each column of nodes in the present row of blocks, with one more block
    /// before and after.
    sums: [Vec<f32>; 3],
}

impl Extension {
    pub fn transpose_input(&mut self) -> TransposeInput<'_> {
        self.transpose_input_and_free().0
    }

    /// Returns the input of the transpose, and the numbers of free nodes in the smallest blocks.
    pub fn transpose_input_and_free(&mut self) -> (TransposeInput<'_>, Band<'_, f32>) {
        let Self { levels, for_neighbours: [for_before, for_after], .. } = self;
        let Level { blocks, free, values, .. } = &mut levels[0];
        let input = TransposeInput {
            rows: self.nodes[0],
            blocks: blocks[1],
            bands: [for_before, values, for_after].map(|map| Band::new(map)),
            sums: empty_sums(blocks[1]),
        };
        (input, Band::new(free))
    }

    pub fn transpose_output(&self) -> TransposeOutput<'_> {
        TransposeOutput::new(&self.levels[0])
    }
}

fn empty_sums(blocks: usize) -> [Vec<f32>; 3] {
    std::array::from_fn(|_| vec![0.0; SIDE * (blocks + 2)])
}

impl TransposeInput<'_> {
    /// Adds a row of pressures except at free nodes. Only groups marked in `groups` have free
    /// nodes, by the flags in `last_step`; nodes beyond the length of `last_step` are not free.
    #[inline(always)]
    pub fn collect_row<S: Simd, const R: usize>(
        &mut self,
        simd: S,
        row: Row,
        values: &[f32],
        last_step: &[f32],
        groups: &[bool],
    ) {
        let part = row.index % SIDE;
        let [before, here, after] = &mut self.sums;
        let neighbour = if is_before::<SIDE>(part) { before } else { after };
        let (values, beyond) = values.split_at(last_step.len());
        let (own, own_beyond) = here[SIDE..].split_at_mut(last_step.len());
        let (other, other_beyond) = neighbour[SIDE..].split_at_mut(last_step.len());
        let weights = weights::<SIDE>(part);
        take_all(weights, own_beyond, other_beyond, beyond);
        let (own, last_own) = split_mut::<S, R>(own);
        let (other, last_other) = split_mut::<S, R>(other);
        let (values, last_values) = split::<S, R>(values);
        let (last_step, rest_step) = split::<S, R>(last_step);
        take(simd, weights, groups, own, other, values, last_step);
        let rest = &ALL[..last_values.len()];
        take(REST, weights, rest, last_own, last_other, last_values, rest_step);
        if ends_blocks(row, self.rows) {
            let block_row = Row::new(row.index / SIDE, self.blocks);
            for (sums, band) in self.sums.iter_mut().zip(&mut self.bands) {
                let nodes = sums.as_chunks_mut::<SIDE>().0;
                repeat(nodes);
                gather(nodes, band.row(block_row));
                sums.fill(0.0);
            }
        }
    }
}

impl Shared for TransposeInput<'_> {
    fn split_off(&mut self, row: Row) -> Self {
        let block_row = Row::new(row.index.div_ceil(SIDE), self.blocks);
        Self {
            bands: self.bands.each_mut().map(|band| band.split_off(block_row)),
            sums: empty_sums(self.blocks),
            ..*self
        }
    }
}

#[inline(always)]
fn take<S: Simd, const R: usize>(
    simd: S,
    [of_own, of_other]: [f32; 2],
    groups: &[bool],
    own: &mut [[S::f32s; R]],
    other: &mut [[S::f32s; R]],
    values: &[[S::f32s; R]],
    last_step: &[[S::f32s; R]],
) {
    let (of_own, of_other) = (Lanes::all(simd, of_own), Lanes::all(simd, of_other));
    let zero = Lanes::all(simd, 0.0);
    let rows = values.iter().zip(last_step);
    let rows = own.iter_mut().zip(other).zip(rows).zip(groups);
    for (((own, other), (value, last_step)), has_free) in rows {
        let mut taken = Lanes::of(simd, *value);
        if *has_free {
            let free = Lanes::of(simd, *last_step).has(FREE);
            taken = free.choose(zero, taken);
        }
        *own = Lanes::of(simd, *own).plus(of_own, taken).numbers();
        *other = Lanes::of(simd, *other).plus(of_other, taken).numbers();
    }
}

#[inline(always)]
fn take_all([of_own, of_other]: [f32; 2], own: &mut [f32], other: &mut [f32], values: &[f32]) {
    for ((own, other), value) in own.iter_mut().zip(other).zip(values) {
        *own += of_own * value;
        *other += of_other * value;
    }
}

/// Output of the transpose of the extension: one value for each of the smallest blocks, used only
/// at the free nodes of the block.
pub struct TransposeOutput<'a> {
    smallest: &'a Level,
    /// Present row of blocks, with the value of each block repeated for each of its nodes.
    nodes: Vec<f32>,
    here: Option<usize>,
}

impl<'a> TransposeOutput<'a> {
    fn new(smallest: &'a Level) -> Self {
        Self { smallest, nodes: vec![0.0; SIDE * smallest.blocks[1]], here: None }
    }

    /// Adds the output of the transpose to the row `row` of corrections, in groups with a free
    /// node.
    #[inline(always)]
    pub fn add_to_row(&mut self, row: Row, values: &mut [f32], groups: &[bool]) {
        let block = row.index / SIDE;
        if self.here != Some(block) {
            let given = Row::new(block, self.smallest.blocks[1]).of(&self.smallest.values);
            let nodes = self.nodes.as_chunks_mut::<SIDE>().0;
            for (nodes, given) in nodes.iter_mut().zip(given) {
                *nodes = [*given; SIDE];
            }
            self.here = Some(block);
        }
        let (given, last_given) = self.nodes.split_at(values.len() / LANES * LANES);
        let (values, last_values) = values.as_chunks_mut::<LANES>();
        let nodes = values.iter_mut().zip(given.as_chunks::<LANES>().0);
        for ((values, given), has_free) in nodes.zip(groups) {
            if *has_free {
                give(values, given);
            }
        }
        give(last_values, last_given);
    }
}

impl Shared for TransposeOutput<'_> {
    fn split_off(&mut self, _: Row) -> Self {
        Self::new(self.smallest)
    }
}

#[inline(always)]
fn give(values: &mut [f32], given: &[f32]) {
    for (value, given) in values.iter_mut().zip(given) {
        *value += given;
    }
}

/// Number of nodes of a whole block. Nodes missing at the end of the mesh count as not free.
const AREA: f32 = (SIDE * SIDE) as f32;

impl Extension {
    /// Returns the numbers of the smallest blocks of a mesh along x and y.
    pub fn blocks_of(nodes: [usize; 2]) -> [usize; 2] {
        nodes.map(|nodes| nodes.div_ceil(SIDE))
    }

    /// Extends the residual of free nodes. Returns a pass that writes the mean of the extended
    /// residual over each of the smallest blocks.
    ///
    /// Also sets `sums` to the sum of the residual over the free nodes of each block.
    pub fn extend_means(&mut self, threads: &Threads, sums: &mut [f32]) -> impl Rows<f32> {
        self.clear_beyond_map();
        sums.copy_from_slice(&self.levels[0].values);
        self.extend(threads);
        let (sums, Level { free, values, .. }) = (&*sums, &self.levels[0]);
        Visit::rows((), |(): &mut (), row: Row, means: &mut [f32]| {
            let nodes = row.of(free).iter().zip(row.of(values));
            for ((mean, sum), (free, continued)) in means.iter_mut().zip(row.of(sums)).zip(nodes) {
                *mean = (sum + (AREA - free) * continued) / AREA;
            }
        })
    }

    /// Returns a pass over the pressures q that the block means cause, which prepares the
    /// transpose.
    ///
    /// For each block it replaces the sum R of the residual over n free nodes, in `sums`, by q −
    /// `stiffness` × R/n, the pressure to be added at these nodes. For the transpose of the
    /// extension, it stores q times the number of other nodes.
    pub fn block_pressures<'a>(
        &'a mut self,
        stiffness: f32,
        sums: &'a mut [f32],
    ) -> impl Rows<f32> {
        let Level { free, values, .. } = &mut self.levels[0];
        let (free, maps) = (&*free, [values, sums].map(Band::new));
        Visit::rows(maps, move |[for_others, given], row, residual| {
            let blocks = for_others.row(row).iter_mut().zip(given.row(row));
            let nodes = residual.iter().zip(row.of(free));
            for ((for_others, given), (residual, free)) in blocks.zip(nodes) {
                *for_others = (AREA - free) * residual;
                // A block without free nodes has a sum of zero.
                *given = residual - stiffness * *given / free.max(1.0);
            }
        })
    }

    /// Applies the transpose of the extension to the values that [`Extension::block_pressures`]
    /// stored, and adds the pressure of each block in `given`.
    pub fn collect_means(&mut self, threads: &Threads, given: &[f32]) {
        self.transpose_pyramid(threads);
        let Level { blocks, values, .. } = &mut self.levels[0];
        for_rows(threads, values, blocks[1], |row, values| add(values, row.of(given), 1.0));
    }
}
