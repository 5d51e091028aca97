//! Convolutions of two rows at a time, as many numbers at a time as a register holds.
//!
//! Rows 2i and 2i + 1 of the map are real and imaginary part of row i of a complex map z, N_x/2 × N_y.
//! Its transform Z(k_x, k_y), k_x modulo N_x/2, is E + iO, where E and O belong to the even and the
//! odd rows; that of the real map is E + wO at k_x and E − wO at k_x + N_x/2, with
//! w = exp(−iθ), θ = 2πk_x/N_x. Let K and K′ be the kernel's factors at these two. Then multiplying by
//! them is
//!
//! Z(k) ← (S − D sin θ) Z(k) + i D cos θ Z(−k)*, S = (K + K′)/2, D = (K − K′)/2,
//!
//! so that nothing real is ever transformed, and no Nyquist column is left over.
//!
//! The work is laid out so that every instruction works on full registers of L numbers:
//!
//! 1. *Rows.* L neighbours of a row share a register. [`Stages`] cut the row in N_y/L blocks, each a
//!    register, which stand for k_y = k, k + N_y/L, k + 2N_y/L, …. Register k of all rows is a tile.
//! 2. *Columns* (`columns`). A tile is small enough for the second-level cache and has contiguous
//!    columns, one a lane. Stages cut them in blocks of L × L numbers, which are then transformed
//!    along both sides, transposed in between. The blocks of k and −k meet, are multiplied, and go
//!    the same way back.
//! 3. *Rows* again, backwards.
//!
//! A map on a corner of the mesh fills its first rows only. The others are neither transformed nor
//! kept: a tile holds what it has of the first ones, and is completed by zeros where its columns are
//! transformed.

#![expect(
    clippy::needless_range_loop,
    reason = "several registers are indexed alike, as in the formulas"
)]

use pulp::bytemuck;

use super::aligned::Aligned;
use super::registers::{Registers, Work};
use super::{Real, Row, Rows};
use crate::contact::instructions::Instructions;

mod butterflies;
mod columns;
mod stages;

use columns::Columns;
use stages::Stages;

/// Complex rows that are transformed and then dealt out to the tiles together, since fewer would
/// leave a tile before a cache line's neighbours are written, and more the first-level cache.
const BATCH: usize = 4;

/// Cache lines between tiles, so that a row's registers in all of them do not compete for a few
/// places in the cache.
const PADDING: usize = 2;

/// Plans of one mesh.
pub struct Packed<T> {
    nodes: [usize; 2],
    /// Rows, whole batches of them, beyond which there are zeros.
    filled_rows: usize,
    instructions: Instructions,
    rows: Stages<T, true>,
    columns: Columns<T>,
}

pub struct Scratch<T> {
    rows: Aligned<T>,
    /// Tile after tile: real parts, imaginary parts, padding.
    tiles: Aligned<T>,
    spare: Aligned<T>,
}

impl<T: Real> Packed<T> {
    /// For maps of so many rows, on a mesh of no fewer. None if either side is no multiple of the
    /// lanes, that across the rows of twice the lanes, by factors of 2, 3 and 5.
    pub fn new(rows: usize, nodes: [usize; 2], instructions: Instructions) -> Option<Self> {
        let lanes = T::LANES;
        let [nodes_x, nodes_y] = nodes;
        if !nodes_x.is_multiple_of(2 * lanes) || !nodes_y.is_multiple_of(lanes) {
            return None;
        }
        Some(Self {
            nodes,
            filled_rows: rows.next_multiple_of(2 * BATCH),
            instructions,
            rows: Stages::new(nodes_y, lanes)?,
            columns: Columns::new(nodes, lanes)?,
        })
    }

    /// The kernel with `factor(|k_x|, |k_y|)`, as [`Packed::multiply`] reads it.
    pub fn kernel(&self, factor: impl Fn(usize, usize) -> f64) -> Aligned<T> {
        self.columns.kernel(factor)
    }

    pub fn scratch(&self) -> Scratch<T> {
        let [column, row] = self.nodes;
        // Of a tile that is its own opposite, or of two that are to be completed.
        let whole_tiles = if self.filled_rows < column { 2 } else { 1 };
        Scratch {
            rows: Aligned::zeros(2 * BATCH * row),
            tiles: Aligned::zeros(row / T::LANES * self.tile_len()),
            spare: Aligned::zeros(whole_tiles * column * T::LANES),
        }
    }

    fn tile_len(&self) -> usize {
        (self.filled_rows + PADDING) * T::LANES
    }

    pub fn begin(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.pass::<false, true>(rows, scratch);
    }

    pub fn multiply(&self, kernel: &[T], scratch: &mut Scratch<T>) -> f64 {
        let mut sum = 0.0;
        let work = columns::Convolve {
            columns: &self.columns,
            places: self.rows.places(),
            kernel,
            tiles: &mut scratch.tiles,
            filled_rows: self.filled_rows,
            tile_len: self.tile_len(),
            spare: &mut scratch.spare,
            sum: &mut sum,
        };
        T::vectorize(self.instructions, work);
        sum
    }

    pub fn turn(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.pass::<true, true>(rows, scratch);
    }

    pub fn finish(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.pass::<true, false>(rows, scratch);
    }

    /// Goes over all rows that are not zero for certain, which may come from the tiles and may go
    /// there.
    fn pass<const COME: bool, const GO: bool>(
        &self,
        rows: &mut impl Rows<T>,
        scratch: &mut Scratch<T>,
    ) {
        let nodes_y = self.nodes[1];
        let batch = &mut scratch.rows;
        for first in (0..self.filled_rows).step_by(2 * BATCH) {
            if COME {
                self.inverse::<BATCH>(first / 2, batch, &scratch.tiles);
            }
            for (row, values) in (first..).zip(batch.chunks_exact_mut(nodes_y)) {
                rows.row(Row::new(row, nodes_y), values);
            }
            if GO {
                self.forward(first / 2, batch, &mut scratch.tiles);
            }
        }
    }

    pub fn peek(&self, pair: usize, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        let nodes_y = self.nodes[1];
        let batch = &mut scratch.rows[..2 * nodes_y];
        self.inverse::<1>(pair, batch, &scratch.tiles);
        for (row, values) in (2 * pair..).zip(batch.chunks_exact_mut(nodes_y)) {
            rows.row(Row::new(row, nodes_y), values);
        }
    }

    fn forward(&self, first: usize, batch: &mut [T], tiles: &mut [T]) {
        let work = Forward {
            stages: &self.rows,
            nodes: [self.filled_rows, self.nodes[1]],
            tile_len: self.tile_len(),
            first,
            batch,
            tiles,
        };
        T::vectorize(self.instructions, work);
    }

    fn inverse<const ROWS: usize>(&self, first: usize, batch: &mut [T], tiles: &[T]) {
        let work = Inverse::<ROWS, T> {
            stages: &self.rows,
            nodes: [self.filled_rows, self.nodes[1]],
            tile_len: self.tile_len(),
            first,
            batch,
            tiles,
        };
        T::vectorize(self.instructions, work);
    }
}

/// Takes a batch of complex rows to the tiles.
struct Forward<'a, T> {
    stages: &'a Stages<T, true>,
    /// Rows that tiles have something of, and nodes in them.
    nodes: [usize; 2],
    /// Numbers in a tile.
    tile_len: usize,
    /// The first complex row.
    first: usize,
    batch: &'a mut [T],
    tiles: &'a mut [T],
}

impl<T: Real> Work<T> for Forward<'_, T> {
    #[inline(always)]
    fn run<R: Registers<Number = T>>(self, r: R) {
        let registers = self.nodes[1] / R::LANES;
        let batch: &mut [R::Lanes] = bytemuck::cast_slice_mut(self.batch);
        for row in batch.chunks_exact_mut(2 * registers) {
            let (re, im) = row.split_at_mut(registers);
            self.stages.forward(r, re, im);
        }
        let tiles: &mut [R::Lanes] = bytemuck::cast_slice_mut(self.tiles);
        let tiles = tiles.chunks_exact_mut(self.tile_len / R::LANES);
        for (j, tile) in tiles.enumerate() {
            let (re, im) = tile.split_at_mut(self.nodes[0] / 2);
            let re = &mut re[self.first..][..BATCH];
            let im = &mut im[self.first..][..BATCH];
            for k in 0..BATCH {
                re[k] = batch[2 * k * registers + j];
                im[k] = batch[(2 * k + 1) * registers + j];
            }
        }
    }
}

/// Brings so many complex rows back from the tiles.
struct Inverse<'a, const ROWS: usize, T> {
    stages: &'a Stages<T, true>,
    nodes: [usize; 2],
    tile_len: usize,
    first: usize,
    batch: &'a mut [T],
    tiles: &'a [T],
}

impl<const ROWS: usize, T: Real> Work<T> for Inverse<'_, ROWS, T> {
    #[inline(always)]
    fn run<R: Registers<Number = T>>(self, r: R) {
        let registers = self.nodes[1] / R::LANES;
        let batch: &mut [R::Lanes] = bytemuck::cast_slice_mut(self.batch);
        let tiles: &[R::Lanes] = bytemuck::cast_slice(self.tiles);
        let tiles = tiles.chunks_exact(self.tile_len / R::LANES);
        for (j, tile) in tiles.enumerate() {
            let (re, im) = tile.split_at(self.nodes[0] / 2);
            let re = &re[self.first..][..ROWS];
            let im = &im[self.first..][..ROWS];
            for k in 0..ROWS {
                batch[2 * k * registers + j] = re[k];
                batch[(2 * k + 1) * registers + j] = im[k];
            }
        }
        for row in batch.chunks_exact_mut(2 * registers) {
            let (re, im) = row.split_at_mut(registers);
            self.stages.inverse(r, re, im);
        }
    }
}
