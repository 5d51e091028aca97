//! Steps between the levels of the pyramid.
//!
//! The values of blocks are interpolated linearly along each axis to their parts, which are smaller
//! blocks or nodes; the transpose collects values of parts. A part lies between the centres of the
//! block that contains it and of a neighbouring block. Rows are stored with one additional block at
//! each end, because they are periodic.

use crate::fft::Row;
use crate::solver::lanes::{for_rows, for_rows_with};
use crate::threads::Threads;

const HALVES: usize = 2;

/// Sets larger blocks to the sums of the `values` of their four smaller blocks.
pub fn sum_quarters(
    threads: &Threads,
    [[rows, blocks], coarse]: [[usize; 2]; 2],
    values: &[f32],
    sums: &mut [f32],
) {
    // Sum of two rows of smaller blocks, padded to an even number of blocks.
    let both = vec![0.0; blocks.next_multiple_of(HALVES)];
    for_rows_with(threads, sums, coarse[1], both, |both, row, sums| {
        let first = HALVES * row.index;
        both[..blocks].copy_from_slice(Row::new(first, blocks).of(values));
        if first + 1 < rows {
            add(both, Row::new(first + 1, blocks).of(values), 1.0);
        }
        sum(both.as_chunks::<HALVES>().0, sums);
    });
}

/// Replaces the sum R of the residual over n free nodes of each smaller block by the weighted mean
/// (R + w v)/(n + w). v is the outer value, interpolated from the `values` of larger blocks, and w
/// = `weight`.
pub fn means_with_outer(
    threads: &Threads,
    [fine, [rows, blocks]]: [[usize; 2]; 2],
    (values, free, weight): (&[f32], &[f32], f32),
    sums: &mut [f32],
) {
    // Row of larger blocks, interpolated between two rows, with one more block before and after;
    // and this row, interpolated to smaller blocks.
    let buffers = [vec![0.0; blocks + 2], vec![0.0; HALVES * blocks]];
    for_rows_with(threads, sums, fine[1], buffers, |[mixed, between], row, sums| {
        let [(own, of_own), (other, of_other)] = around::<HALVES>(row.index, rows);
        let [own, other] = [own, other].map(|row| Row::new(row, blocks).of(values));
        for (mixed, (own, other)) in mixed[1..].iter_mut().zip(own.iter().zip(other)) {
            *mixed = of_own * own + of_other * other;
        }
        repeat(mixed);
        interpolate(mixed, between.as_chunks_mut::<HALVES>().0);
        for ((sum, free), between) in sums.iter_mut().zip(row.of(free)).zip(&*between) {
            *sum = (*sum + weight * between) / (free + weight);
        }
    });
}

/// Applies the transpose of the interpolation of outer values: sets each larger block to a weighted
/// sum of the `values` of the smaller blocks in it and next to it.
pub fn transpose_interpolation(
    threads: &Threads,
    [[rows, blocks], [larger, coarse_blocks]]: [[usize; 2]; 2],
    (values, weight): (&[f32], f32),
    sums: &mut [f32],
) {
    // Weighted sum of rows of smaller blocks, with two more blocks before and after.
    let weighted = vec![0.0; HALVES * (coarse_blocks + 2)];
    for_rows_with(threads, sums, coarse_blocks, weighted, |weighted, row, sums| {
        let (own, before) = (row.index, (row.index + larger - 1) % larger);
        let after = (own + 1) % larger;
        let [of_own, of_other] = weights::<HALVES>(0);
        weighted.fill(0.0);
        for (index, share) in [
            (HALVES * own, of_own),
            (HALVES * own + 1, of_own),
            (HALVES * before + 1, of_other),
            (HALVES * after, of_other),
        ] {
            if index < rows {
                let values = Row::new(index, blocks).of(values);
                add(&mut weighted[HALVES..][..blocks], values, weight * share);
            }
        }
        let weighted = weighted.as_chunks_mut::<HALVES>().0;
        repeat(weighted);
        gather(weighted, sums);
    });
}

/// Adds to each smaller block the value of the larger block that contains it.
pub fn add_parents(
    threads: &Threads,
    [fine, coarse]: [[usize; 2]; 2],
    values: &[f32],
    sums: &mut [f32],
) {
    for_rows(threads, sums, fine[1], |row, sums| {
        let values = Row::new(row.index / HALVES, coarse[1]).of(values);
        for (sums, value) in sums.chunks_mut(HALVES).zip(values) {
            sums.iter_mut().for_each(|sum| *sum += value);
        }
    });
}

/// Adds `factor` × `values` to `sums`.
#[inline(always)]
pub fn add(sums: &mut [f32], values: &[f32], factor: f32) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// Returns the weights of a block and of its neighbour in the linear interpolation to part `part`
/// of the `SIDE` parts of this block.
#[inline(always)]
pub fn weights<const SIDE: usize>(part: usize) -> [f32; 2] {
    let other = (2 * part + 1).abs_diff(SIDE) as f32 / (2 * SIDE) as f32;
    [1.0 - other, other]
}

/// Returns whether part `part` of a block lies between the centres of this block and of the
/// previous one; otherwise it lies towards the next one.
#[inline(always)]
pub fn is_before<const SIDE: usize>(part: usize) -> bool {
    part < SIDE / 2
}

/// Returns the two blocks between which the part `index` of a periodic row of `blocks` blocks is
/// interpolated, with their weights: first the block that contains the part, then its neighbour.
#[inline(always)]
pub fn around<const SIDE: usize>(index: usize, blocks: usize) -> [(usize, f32); 2] {
    let (block, part) = (index / SIDE, index % SIDE);
    let [own, other] = weights::<SIDE>(part);
    let neighbour =
        if is_before::<SIDE>(part) { (block + blocks - 1) % blocks } else { (block + 1) % blocks };
    [(block, own), (neighbour, other)]
}

/// Sets the first element of a periodic row to a copy of the last but one, and the last element to
/// a copy of the second.
#[inline(always)]
pub fn repeat<V: Copy>(row: &mut [V]) {
    let last = row.len() - 1;
    (row[0], row[last]) = (row[last - 1], row[1]);
}

/// Interpolates a row of blocks to its parts; `blocks` has one more block before and after.
#[inline(always)]
pub fn interpolate<const SIDE: usize>(blocks: &[f32], parts: &mut [[f32; SIDE]]) {
    for (parts, near) in parts.iter_mut().zip(blocks.windows(3)) {
        let (before, own, after) = (near[0], near[1], near[2]);
        for (part, value) in parts.iter_mut().enumerate() {
            let [of_own, of_other] = weights::<SIDE>(part);
            let other = if is_before::<SIDE>(part) { before } else { after };
            *value = of_own * own + of_other * other;
        }
    }
}

/// Applies the transpose of [`interpolate`]; `parts` has the parts of one more block before and
/// after.
#[inline(always)]
pub fn gather<const SIDE: usize>(parts: &[[f32; SIDE]], blocks: &mut [f32]) {
    for (block, near) in blocks.iter_mut().zip(parts.windows(3)) {
        let (before, own, after) = (near[0], near[1], near[2]);
        let (mut of_block, mut of_others) = (0.0, 0.0);
        for (part, own) in own.iter().enumerate() {
            let [of_own, of_other] = weights::<SIDE>(part);
            // The first parts of the next block lie towards this block.
            let other = if is_before::<SIDE>(part) { after[part] } else { before[part] };
            of_block += of_own * own;
            of_others += of_other * other;
        }
        *block = of_block + of_others;
    }
}

#[inline(always)]
pub fn sum<const SIDE: usize>(parts: &[[f32; SIDE]], blocks: &mut [f32]) {
    for (block, parts) in blocks.iter_mut().zip(parts) {
        *block = 0.0;
        for part in parts {
            *block += part;
        }
    }
}
