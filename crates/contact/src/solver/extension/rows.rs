//! Rows of the mesh to the smallest blocks, and back: what passes over the mesh work with to continue what free
//! nodes ask for.
//!
//! Threads part at multiples of [`SIDE`] rows, so that a row of blocks is one thread's.

use pulp::Simd;

use super::super::active_groups::ALL;
use super::super::flags::FREE;
use super::super::lanes::{Lanes, REST, split, split_mut};
use super::interpolation::{interpolate, is_before, repeat, shares, sum};
use super::{Extension, Level, SIDE};
use crate::fft::{Band, ROWS_TOGETHER, Row};

const _: () = assert!(ROWS_TOGETHER.is_multiple_of(SIDE));

/// Rows of what free nodes ask for, to be added up.
pub struct AskedRows<'a> {
    rows: usize,
    blocks: usize,
    free: Band<'a, f32>,
    values: Band<'a, f32>,
    /// Free nodes in a row of blocks so far, and what they ask for.
    sums: [Vec<f32>; 2],
}

impl Extension {
    /// All rows of what free nodes ask for.
    pub fn asked_rows(&mut self) -> AskedRows<'_> {
        let smallest = &mut self.levels[0];
        let blocks = smallest.blocks[1];
        AskedRows {
            rows: self.map[0],
            blocks,
            free: Band::of(&mut smallest.free),
            values: Band::of(&mut smallest.values),
            sums: [vec![0.0; SIDE * blocks], vec![0.0; SIDE * blocks]],
        }
    }

    /// All rows of the continuation.
    pub fn continued_rows(&self) -> ContinuedRows<'_> {
        ContinuedRows::of(&self.levels[0])
    }
}

impl AskedRows<'_> {
    /// Adds a row, with zeros where nodes are not free, and of numbers that are marked where they are:
    /// in groups with a free node alone.
    #[inline(always)]
    pub fn add_row<S: Simd, const R: usize>(
        &mut self,
        simd: S,
        row: Row,
        asked: &[f32],
        carry: &[f32],
        groups: &[bool],
    ) {
        let [free, values] = &mut self.sums;
        let (free_sums, last_free) = split_mut::<S, R>(&mut free[..asked.len()]);
        let (sums, last_sums) = split_mut::<S, R>(&mut values[..asked.len()]);
        let (asked, last_asked) = split::<S, R>(asked);
        let (carry, last_carry) = split::<S, R>(carry);
        add_asked(simd, groups, free_sums, sums, asked, carry);
        let rest = &ALL[..last_asked.len()];
        add_asked(REST, rest, last_free, last_sums, last_asked, last_carry);
        if ends_blocks(row, self.rows) {
            let place = Row::new(row.index() / SIDE, self.blocks);
            let bands = [&mut self.free, &mut self.values];
            for (sums, band) in self.sums.iter_mut().zip(bands) {
                sum(sums.as_chunks::<SIDE>().0, band.row(place));
                sums.fill(0.0);
            }
        }
    }

    pub fn split_off(&mut self, row: Row) -> Self {
        let place = Row::new(row.index().div_ceil(SIDE), self.blocks);
        Self {
            free: self.free.split_off(place),
            values: self.values.split_off(place),
            sums: self.sums.clone(),
            ..*self
        }
    }
}

#[inline(always)]
fn add_asked<S: Simd, const R: usize>(
    simd: S,
    groups: &[bool],
    free_sums: &mut [[S::f32s; R]],
    sums: &mut [[S::f32s; R]],
    asked: &[[S::f32s; R]],
    carry: &[[S::f32s; R]],
) {
    let one = Lanes::all(simd, 1.0);
    let rows = asked.iter().zip(carry);
    let rows = free_sums.iter_mut().zip(sums).zip(rows).zip(groups);
    for (((free_sum, sum), (asked, carry)), has_free) in rows {
        if !has_free {
            continue;
        }
        let free = Lanes::of(simd, *carry).has(FREE).or_zero(one);
        *free_sum = (Lanes::of(simd, *free_sum) + free).numbers();
        *sum = (Lanes::of(simd, *sum) + Lanes::of(simd, *asked)).numbers();
    }
}

/// Rows of the continuation.
pub struct ContinuedRows<'a> {
    smallest: &'a Level,
    /// A row of blocks, with one more before and after.
    near: Vec<f32>,
    /// The rows of blocks before, here and after, interpolated along the row,
    rows: [Vec<f32>; 3],
    /// and which of them is here.
    here: Option<usize>,
}

impl<'a> ContinuedRows<'a> {
    fn of(smallest: &'a Level) -> Self {
        let blocks = smallest.blocks[1];
        Self {
            smallest,
            near: vec![0.0; blocks + 2],
            rows: std::array::from_fn(|_| vec![0.0; SIDE * blocks]),
            here: None,
        }
    }

    /// The two rows, of no fewer nodes, that the continuation of a row lies between, with their shares.
    #[inline(always)]
    pub fn row(&mut self, row: Row) -> [(&[f32], f32); 2] {
        let (block, part) = (row.index() / SIDE, row.index() % SIDE);
        if self.here != Some(block) {
            self.go_to(block);
        }
        let [own, other] = shares::<SIDE>(part);
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

    pub fn split_off(&self) -> Self {
        Self::of(self.smallest)
    }
}

/// Whether a row is the last of its blocks.
#[inline(always)]
pub fn ends_blocks(row: Row, rows: usize) -> bool {
    row.index() % SIDE == SIDE - 1 || row.index() + 1 == rows
}
