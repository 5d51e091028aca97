//! Pass that finds the pressures that a step would clip.

use pulp::Simd;

use super::{Direction, ReferencePressure};
use crate::fft::{Band, Row};
use crate::solver::blocks::{SIDE, TransposeInput, TransposeOutput};
use crate::solver::lanes::{Pass, Shared};
use crate::solver::marks::{ActiveGroups, FREE, has};

/// Pass over corrections that adds up, in blocks, what clipping would add to the pressures after a
/// step to keep them within their bounds. It changes no pressure, and counts the free nodes that
/// remain.
pub struct FindClipped<'a> {
    pub direction: Direction,
    /// Upper bound of the pressures.
    pub ceiling: f32,
    pub reference_pressure: &'a ReferencePressure,
    pub pressure_increment: &'a [f32],
    pub last_step: &'a [f32],
    pub active: &'a ActiveGroups,
    /// Output of the transpose of the extension, which is added to the corrections.
    pub transposed: TransposeOutput<'a>,
    /// Pressure that is taken from each free node of a block. It clips further nodes.
    pub compensation: &'a [f32],
    /// Pressures that clipping adds to nodes, weighted like the interpolation between blocks.
    pub clipped: TransposeInput<'a>,
    /// Number of free nodes in each block that are not clipped.
    pub remaining: Band<'a, f32>,
    /// Number of blocks in a row.
    pub blocks: usize,
    /// Buffers for a row of nodes, extended to whole blocks: the compensation at each node, and 1
    /// for nodes that remain free.
    pub rows: [Vec<f32>; 2],
}

impl Pass<f32> for FindClipped<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [f32]) {
        self.transposed.add_to_row(row, values, self.active.free_row(row));
        let block_row = Row::new(row.index / SIDE, self.blocks);
        let [compensation, remains] = &mut self.rows;
        let of_blocks = block_row.of(self.compensation);
        for (nodes, of_block) in compensation.as_chunks_mut::<SIDE>().0.iter_mut().zip(of_blocks) {
            *nodes = [*of_block; SIDE];
        }
        let (direction, ceiling) = (self.direction, self.ceiling);
        let reference = self.reference_pressure.row(row);
        let pressures = reference.iter().zip(row.of(self.pressure_increment));
        let others = row.of(self.last_step).iter().zip(&*compensation);
        let nodes = values.iter_mut().zip(&mut *remains).zip(pressures).zip(others);
        for (((value, remains), (base, increment)), (last_step, compensation)) in nodes {
            let is_free = has(*last_step, FREE);
            let last = if is_free { *last_step } else { 0.0 };
            let after = direction.unclipped(*value, base + increment, last);
            let (is_above, is_below) = (after > *compensation, after - compensation < ceiling);
            let bound = if is_above { ceiling } else { 0.0 };
            let remains_free = is_free & is_above & is_below;
            *value = if is_free & !remains_free { bound - after } else { 0.0 };
            *remains = if remains_free { 1.0 } else { 0.0 };
        }
        self.clipped.collect_row::<S, R>(simd, row, values, &[], &[]);
        let remaining = self.remaining.row(block_row);
        if row.index.is_multiple_of(SIDE) {
            remaining.fill(0.0);
        }
        for (remaining, nodes) in remaining.iter_mut().zip(remains.as_chunks::<SIDE>().0) {
            *remaining += nodes.iter().sum::<f32>();
        }
    }

    fn split_off(&mut self, row: Row) -> Self {
        let block_row = Row::new(row.index.div_ceil(SIDE), self.blocks);
        Self {
            transposed: self.transposed.split_off(row),
            clipped: self.clipped.split_off(row),
            remaining: self.remaining.split_off(block_row),
            rows: self.rows.clone(),
            ..*self
        }
    }
}
