//! Convolutions that transform pairs of rows as complex rows, with full vector registers.
//!
//! Rows 2i and 2i + 1 of the map are the real and imaginary part of row i of a complex map z with
//! N_x/2 × N_y nodes. Its transform Z(k_x, k_y), k_x modulo N_x/2, is E + iO, where E and O are the
//! transforms of the even and the odd rows. With w = exp(−iθ), θ = 2πk_x/N_x, the transform of the
//! real map is E + wO at k_x and E − wO at k_x + N_x/2. Let K and K′ be the kernel's factors at
//! these two wavenumbers. Then the convolution is the product
//!
//! Z(k) ← (S − D sin θ) Z(k) + i D cos θ Z(−k)*, S = (K + K′)/2, D = (K − K′)/2.
//!
//! No real transform is needed, and there is no separate Nyquist column.
//!
//! The layout of the data lets every instruction use full registers of L numbers:
//!
//! 1. *Rows.* Each register holds L neighbours of a row. [`Stages`] split the row into N_y/L
//!    blocks. Each block is one register and contains k_y = k, k + N_y/L, k + 2N_y/L, …. The
//!    registers k of all rows form a tile.
//! 2. *Columns* (`columns`). A tile fits into the second-level cache, and each lane of its
//!    registers is a column. Stages split the columns into blocks of L × L numbers, which are then
//!    transformed along both sides, with a transposition in between. The blocks of k and −k are
//!    multiplied together and transformed back the same way.
//! 3. *Rows* again, in reverse order.
//!
//! A map in the corner of the mesh fills only the first rows. The other rows are neither
//! transformed nor stored: a tile contains the filled rows only, and is padded with zeros while its
//! columns are transformed.
//!
//! Each thread transforms blocks of batches of rows, which have a part of every tile, and then
//! pairs of tiles. [`Store`] copies complex rows from a batch to the tiles, transformed or not, and
//! [`Fetch`] copies them back.

#![expect(
    clippy::needless_range_loop,
    reason = "several registers are indexed alike, as in the formulas"
)]

use std::ops::Deref;

use pulp::bytemuck;

use super::registers::{Registers, Work};
use super::rows::Aligned;
use super::{ROW_BATCH, Real, Row, Rows, Stored, cut, cut_pairs};
use crate::instructions::Instructions;
use crate::threads::{Threads, Workers};

mod columns;
mod stages;

use columns::Columns;
use stages::Stages;

/// Number of complex rows that are transformed and copied to the tiles together. With fewer rows, a
/// cache line of a tile would be written in several steps; more would not fit into the first-level
/// cache.
const BATCH: usize = ROW_BATCH / 2;

/// Number of unused registers after each tile. They place the registers of one row in different
/// tiles into different cache sets.
const PADDING: usize = 2;

pub struct Packed<T> {
    nodes: [usize; 2],
    /// Number of rows of the convolved maps, rounded up to a multiple of [`ROW_BATCH`]. The other
    /// rows of the mesh are zero.
    filled_rows: usize,
    instructions: Instructions,
    rows: Stages<T, true>,
    columns: Columns<T>,
}

pub struct Scratch<T> {
    /// All tiles, one after another: the real parts, the imaginary parts and the padding of each
    /// tile.
    ///
    /// The memory consists of doubles for both precisions `T`, so that they can share it.
    tiles: Aligned<f64>,
    buffers: Vec<Buffers<T>>,
}

impl<T: Real> Scratch<T> {
    /// Takes the tiles of `other` if they are longer than the tiles of `self`, and frees them
    /// otherwise. The convolutions in progress in both scratches are lost.
    pub fn take_over<U>(&mut self, other: &mut Scratch<U>) {
        if other.tiles.len() > self.tiles.len() {
            self.tiles = std::mem::replace(&mut other.tiles, Aligned::zeros(0));
        } else {
            other.tiles = Aligned::zeros(0);
        }
    }
}

struct Buffers<T> {
    rows: Aligned<T>,
    spare: Aligned<T>,
}

/// Part of the tiles for one thread: the real and imaginary parts of consecutive complex rows in
/// each tile.
type Shares<'a, T> = Vec<[&'a mut [T]; 2]>;

impl<T: Real> Packed<T> {
    /// Plans convolutions of maps with `rows` rows, padded to a mesh of `nodes`.
    ///
    /// Returns `None` unless N_x/(2L) and N_y/L are integers with only the factors 2, 3 and 5,
    /// where L is the number of lanes of a register.
    pub fn new(rows: usize, nodes: [usize; 2], instructions: Instructions) -> Option<Self> {
        let lanes = T::LANES;
        let [nodes_x, nodes_y] = nodes;
        if !nodes_x.is_multiple_of(2 * lanes) || !nodes_y.is_multiple_of(lanes) {
            return None;
        }
        Some(Self {
            nodes,
            filled_rows: rows.next_multiple_of(ROW_BATCH),
            instructions,
            rows: Stages::new(nodes_y, lanes)?,
            columns: Columns::new(nodes, lanes)?,
        })
    }

    /// Computes the factors S and D of a kernel, as the [module](self) defines them, in the order
    /// in which [`Packed::multiply`] reads them.
    ///
    /// `factors(k_y, column)` writes the factors for k_x = 0, 1, …, N_x/2 to `column`.
    pub fn kernel(
        &self,
        threads: &Threads,
        factors: impl Fn(usize, &mut [f64]) + Sync,
    ) -> Aligned<T> {
        self.columns.kernel(threads, factors)
    }

    /// Creates an empty scratch. The first convolution allocates its tiles.
    pub fn scratch(&self) -> Scratch<T> {
        Scratch { tiles: Aligned::zeros(0), buffers: Vec::new() }
    }

    fn tiles_len(&self) -> usize {
        self.nodes[1] / T::LANES * self.tile_len()
    }

    fn buffers(&self) -> Buffers<T> {
        let [column, row] = self.nodes;
        // Space for a copy of a tile that is its own opposite, or for two padded tiles.
        let whole_tiles = if self.filled_rows < column { 2 } else { 1 };
        Buffers {
            rows: Aligned::zeros(ROW_BATCH * row),
            spare: Aligned::zeros(whole_tiles * column * T::LANES),
        }
    }

    fn tile_len(&self) -> usize {
        (self.filled_rows + PADDING) * T::LANES
    }

    fn workers<'a>(&self, threads: &'a Threads) -> Workers<'a> {
        threads.workers(self.filled_rows * self.nodes[1])
    }

    fn allocate(&self, scratch: &mut Scratch<T>) {
        let doubles = self.tiles_len() * size_of::<T>() / size_of::<f64>();
        if scratch.tiles.len() < doubles {
            // Free the small buffer before allocating the large one.
            scratch.tiles = Aligned::zeros(0);
            scratch.tiles = Aligned::zeros(doubles);
        }
    }

    pub fn multiply(&self, kernel: &[T], threads: &Threads, scratch: &mut Scratch<T>) -> f64 {
        let Scratch { tiles, buffers } = scratch;
        let workers = self.workers(threads);
        let whole = self.numbers_mut(tiles).chunks_exact_mut(self.tile_len());
        let tiles = whole.map(|tile| &mut tile[..self.filled_rows * T::LANES]);
        let mut pairs = self.columns.pairs(tiles, self.rows.block_indices(), kernel);
        workers.for_each(
            buffers,
            || self.buffers(),
            &mut pairs,
            |buffers, pair| {
                let work =
                    columns::Convolve { columns: &self.columns, pair, spare: &mut buffers.spare };
                T::vectorize(self.instructions, work);
            },
        );
        pairs.iter().fold(0.0, |sum, pair| sum + pair.sum)
    }

    /// Passes each filled row to `rows`.
    ///
    /// The tiles hold `from` before the pass and `to` after it: nothing, the rows, or the
    /// transforms of the rows. Rows are transformed after reading and before writing as needed.
    pub fn pass(
        &self,
        from: Stored,
        to: Stored,
        rows: &mut impl Rows<T>,
        threads: &Threads,
        scratch: &mut Scratch<T>,
    ) {
        if from == Stored::Nothing {
            self.allocate(scratch);
        }
        let nodes_y = self.nodes[1];
        let Scratch { tiles, buffers } = scratch;
        let workers = self.workers(threads);
        let batches = workers.cuts(self.filled_rows / ROW_BATCH).into_iter();
        let firsts: Vec<usize> = batches.map(|batch| ROW_BATCH * batch).collect();
        let shares = self.cut_tiles(self.numbers_mut(tiles), &firsts);
        let parts = cut(rows, &firsts, nodes_y);
        let mut blocks: Vec<_> = firsts.into_iter().zip(shares).zip(parts).collect();
        workers.for_each(
            buffers,
            || self.buffers(),
            &mut blocks,
            |buffers, ((first, tiles), rows)| {
                let batch = &mut buffers.rows;
                let filled = 2 * tiles[0][0].len() / T::LANES;
                for own in (0..filled).step_by(ROW_BATCH) {
                    self.fetch::<BATCH, _>(from, own / 2, batch, tiles);
                    for (row, values) in (*first + own..).zip(batch.chunks_exact_mut(nodes_y)) {
                        rows.row(Row::new(row, nodes_y), values);
                    }
                    self.store(to, own / 2, batch, tiles);
                }
            },
        );
        for (_, part) in blocks {
            rows.append(part);
        }
    }

    fn numbers_mut<'a>(&self, tiles: &'a mut [f64]) -> &'a mut [T] {
        &mut bytemuck::cast_slice_mut(tiles)[..self.tiles_len()]
    }

    /// Splits each tile into parts that begin at the rows `firsts` of the mesh. Returns one share
    /// of all tiles for each entry of `firsts`.
    fn cut_tiles<'a>(&self, tiles: &'a mut [T], firsts: &[usize]) -> Vec<Shares<'a, T>> {
        let ends = firsts[1..].iter().chain([&self.filled_rows]);
        let lengths: Vec<usize> =
            firsts.iter().zip(ends).map(|(first, end)| (end - first) / 2 * T::LANES).collect();
        let count = self.nodes[1] / T::LANES;
        let mut shares: Vec<_> = firsts.iter().map(|_| Vec::with_capacity(count)).collect();
        for tile in tiles.chunks_exact_mut(self.tile_len()) {
            let (mut re, mut im) = tile.split_at_mut(self.filled_rows / 2 * T::LANES);
            for (share, length) in shares.iter_mut().zip(&lengths) {
                let (own_re, own_im);
                (own_re, re) = re.split_at_mut(*length);
                (own_im, im) = im.split_at_mut(*length);
                share.push([own_re, own_im]);
            }
        }
        shares
    }

    pub fn peek(
        &self,
        from: Stored,
        pairs: &[usize],
        rows: &mut impl Rows<T>,
        threads: &Threads,
        scratch: &mut Scratch<T>,
    ) {
        let nodes_y = self.nodes[1];
        let Scratch { tiles, buffers } = scratch;
        let tiles: &[T] = bytemuck::cast_slice(tiles);
        let whole = tiles[..self.tiles_len()].chunks_exact(self.tile_len());
        let tiles: Vec<[&[T]; 2]> =
            whole.map(|tile| tile.split_at(self.filled_rows / 2 * T::LANES).into()).collect();
        let workers = threads.workers(2 * pairs.len() * nodes_y);
        let (parts, pairs) = cut_pairs(rows, pairs, &workers, nodes_y);
        let mut blocks: Vec<_> = parts.into_iter().zip(pairs).collect();
        let look = |buffers: &mut Buffers<T>, (rows, pairs): &mut (_, &[usize])| {
            let batch = &mut buffers.rows[..2 * nodes_y];
            for &pair in *pairs {
                self.fetch::<1, _>(from, pair, batch, &tiles);
                for (row, values) in (2 * pair..).zip(batch.chunks_exact_mut(nodes_y)) {
                    Rows::row(rows, Row::new(row, nodes_y), values);
                }
            }
        };
        workers.for_each(buffers, || self.buffers(), &mut blocks, look);
        for (part, _) in blocks {
            rows.append(part);
        }
    }

    fn store(&self, to: Stored, first: usize, batch: &mut [T], tiles: &mut Shares<T>) {
        if to == Stored::Nothing {
            return;
        }
        let work = Store {
            stages: (to == Stored::Spectra).then_some(&self.rows),
            row_nodes: self.nodes[1],
            first,
            batch,
            tiles,
        };
        T::vectorize(self.instructions, work);
    }

    fn fetch<const ROWS: usize, B: Deref<Target = [T]>>(
        &self,
        from: Stored,
        first: usize,
        batch: &mut [T],
        tiles: &[[B; 2]],
    ) {
        if from == Stored::Nothing {
            return;
        }
        let work = Fetch::<ROWS, T, B> {
            stages: (from == Stored::Spectra).then_some(&self.rows),
            row_nodes: self.nodes[1],
            first,
            batch,
            tiles,
        };
        T::vectorize(self.instructions, work);
    }
}

/// Computation that copies a batch of complex rows to the tiles.
struct Store<'a, 'b, T> {
    /// Stages of the transform that is applied before copying; `None` for no transform.
    pub stages: Option<&'a Stages<T, true>>,
    pub row_nodes: usize,
    /// Index, in `tiles`, of the first complex row of the batch.
    pub first: usize,
    pub batch: &'a mut [T],
    pub tiles: &'a mut Shares<'b, T>,
}

impl<T: Real> Work<T> for Store<'_, '_, T> {
    #[inline(always)]
    fn run<R: Registers<Number = T>>(self, r: R) {
        let registers = self.row_nodes / R::LANES;
        let batch: &mut [R::Lanes] = bytemuck::cast_slice_mut(self.batch);
        if let Some(stages) = self.stages {
            for row in batch.chunks_exact_mut(2 * registers) {
                let (re, im) = row.split_at_mut(registers);
                stages.forward(r, re, im);
            }
        }
        let start = self.first * R::LANES;
        for (j, [re, im]) in self.tiles.iter_mut().enumerate() {
            let re = &mut re[start..][..BATCH * R::LANES];
            let im = &mut im[start..][..BATCH * R::LANES];
            let re: &mut [R::Lanes] = bytemuck::cast_slice_mut(re);
            let im: &mut [R::Lanes] = bytemuck::cast_slice_mut(im);
            for k in 0..BATCH {
                re[k] = batch[2 * k * registers + j];
                im[k] = batch[(2 * k + 1) * registers + j];
            }
        }
    }
}

/// Computation that copies `ROWS` complex rows from the tiles to `batch`.
struct Fetch<'a, const ROWS: usize, T, B> {
    /// Stages of the inverse transform that is applied after copying; `None` for no transform.
    pub stages: Option<&'a Stages<T, true>>,
    pub row_nodes: usize,
    pub first: usize,
    pub batch: &'a mut [T],
    pub tiles: &'a [[B; 2]],
}

impl<const ROWS: usize, T: Real, B: Deref<Target = [T]>> Work<T> for Fetch<'_, ROWS, T, B> {
    #[inline(always)]
    fn run<R: Registers<Number = T>>(self, r: R) {
        let registers = self.row_nodes / R::LANES;
        let batch: &mut [R::Lanes] = bytemuck::cast_slice_mut(self.batch);
        let start = self.first * R::LANES;
        for (j, [re, im]) in self.tiles.iter().enumerate() {
            let re: &[R::Lanes] = bytemuck::cast_slice(&re[start..][..ROWS * R::LANES]);
            let im: &[R::Lanes] = bytemuck::cast_slice(&im[start..][..ROWS * R::LANES]);
            for k in 0..ROWS {
                batch[2 * k * registers + j] = re[k];
                batch[(2 * k + 1) * registers + j] = im[k];
            }
        }
        if let Some(stages) = self.stages {
            for row in batch.chunks_exact_mut(2 * registers) {
                let (re, im) = row.split_at_mut(registers);
                stages.inverse(r, re, im);
            }
        }
    }
}
