//! Rows of the mesh to the smallest blocks, and back: what passes over the mesh work with to hand back what
//! other nodes are asked for.

use pulp::Simd;

use super::super::active_groups::ALL;
use super::super::flags::FREE;
use super::super::lanes::{LANES, Lanes, REST, split, split_mut};
use super::interpolation::{gather, is_before, repeat, shares};
use super::rows::ends_blocks;
use super::{Extension, Level, SIDE};
use crate::fft::{Band, Row};

/// Rows of what nodes that are not free are asked for, to be taken.
pub struct TakenRows<'a> {
    rows: usize,
    blocks: usize,
    /// For the rows of blocks before, here and after,
    bands: [Band<'a, f32>; 3],
    /// and in the present one so far, with a block more before and after.
    sums: [Vec<f32>; 3],
}

impl Extension {
    /// All rows of what the other nodes are asked for.
    pub fn taken_rows(&mut self) -> TakenRows<'_> {
        let smallest = &mut self.levels[0];
        let blocks = smallest.blocks[1];
        let [for_before, for_after] = &mut self.for_neighbours;
        TakenRows {
            rows: self.nodes[0],
            blocks,
            bands: [for_before, &mut smallest.values, for_after].map(|map| Band::of(map)),
            sums: empty_sums(blocks),
        }
    }

    /// All rows of what is handed back.
    pub fn given_rows(&self) -> GivenRows<'_> {
        GivenRows::of(&self.levels[0])
    }
}

fn empty_sums(blocks: usize) -> [Vec<f32>; 3] {
    std::array::from_fn(|_| vec![0.0; SIDE * (blocks + 2)])
}

impl TakenRows<'_> {
    /// Takes a row, where nodes are not marked as free, as no node is but in these groups, and beyond the
    /// marks.
    #[inline(always)]
    pub fn take_row<S: Simd, const R: usize>(
        &mut self,
        simd: S,
        row: Row,
        values: &[f32],
        carry: &[f32],
        groups: &[bool],
    ) {
        let part = row.index() % SIDE;
        let [before, here, after] = &mut self.sums;
        let neighbour = if is_before::<SIDE>(part) { before } else { after };
        let (values, beyond) = values.split_at(carry.len());
        let (own, own_beyond) = here[SIDE..].split_at_mut(carry.len());
        let (other, other_beyond) = neighbour[SIDE..].split_at_mut(carry.len());
        let shares = shares::<SIDE>(part);
        take_all(shares, own_beyond, other_beyond, beyond);
        let (own, last_own) = split_mut::<S, R>(own);
        let (other, last_other) = split_mut::<S, R>(other);
        let (values, last_values) = split::<S, R>(values);
        let (carry, last_carry) = split::<S, R>(carry);
        take(simd, shares, groups, own, other, values, carry);
        let rest = &ALL[..last_values.len()];
        take(REST, shares, rest, last_own, last_other, last_values, last_carry);
        if ends_blocks(row, self.rows) {
            let place = Row::new(row.index() / SIDE, self.blocks);
            for (sums, band) in self.sums.iter_mut().zip(&mut self.bands) {
                let nodes = sums.as_chunks_mut::<SIDE>().0;
                repeat(nodes);
                gather(nodes, band.row(place));
                sums.fill(0.0);
            }
        }
    }

    pub fn split_off(&mut self, row: Row) -> Self {
        let place = Row::new(row.index().div_ceil(SIDE), self.blocks);
        Self {
            bands: self.bands.each_mut().map(|band| band.split_off(place)),
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
    carry: &[[S::f32s; R]],
) {
    let (of_own, of_other) = (Lanes::all(simd, of_own), Lanes::all(simd, of_other));
    let zero = Lanes::all(simd, 0.0);
    let rows = values.iter().zip(carry);
    let rows = own.iter_mut().zip(other).zip(rows).zip(groups);
    for (((own, other), (value, carry)), has_free) in rows {
        let mut taken = Lanes::of(simd, *value);
        if *has_free {
            let free = Lanes::of(simd, *carry).has(FREE);
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

/// Rows of what is handed back: the same to all nodes of a block, of which only free ones matter.
pub struct GivenRows<'a> {
    smallest: &'a Level,
    /// A row of blocks, for each node,
    nodes: Vec<f32>,
    /// and which.
    here: Option<usize>,
}

impl<'a> GivenRows<'a> {
    fn of(smallest: &'a Level) -> Self {
        Self { smallest, nodes: vec![0.0; SIDE * smallest.blocks[1]], here: None }
    }

    /// Adds it to a row, in groups with a free node.
    #[inline(always)]
    pub fn give_row(&mut self, row: Row, values: &mut [f32], groups: &[bool]) {
        let block = row.index() / SIDE;
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

    pub fn split_off(&self) -> Self {
        Self::of(self.smallest)
    }
}

#[inline(always)]
fn give(values: &mut [f32], given: &[f32]) {
    for (value, given) in values.iter_mut().zip(given) {
        *value += given;
    }
}
