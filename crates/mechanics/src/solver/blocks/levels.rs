//! Passes between the levels of the pyramid.
//!
//! The values of blocks are interpolated linearly along each axis to their parts, which are smaller
//! blocks or nodes; the transpose collects values of parts. A part lies between the centres of the
//! block that contains it and of a neighbouring block. Rows are stored with one additional block at
//! each end, because they are periodic.

use pulp::Simd;

use crate::fft::Row;
use crate::solver::lanes::Pass;

const HALVES: usize = 2;

/// Pass over rows of larger blocks that sets each block to the sum of the values of its four
/// smaller blocks.
pub struct SumQuarters<'a> {
    fine: [usize; 2],
    values: &'a [f32],
    /// Sum of two rows of smaller blocks, padded to an even number of blocks.
    sums: Vec<f32>,
}

impl<'a> SumQuarters<'a> {
    pub fn new(fine: [usize; 2], values: &'a [f32]) -> Self {
        Self { fine, values, sums: vec![0.0; fine[1].next_multiple_of(HALVES)] }
    }
}

impl Pass<f32> for SumQuarters<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, coarse: &mut [f32]) {
        let [rows, blocks] = self.fine;
        let sums = &mut self.sums[..blocks];
        let first = HALVES * row.index();
        sums.copy_from_slice(Row::new(first, blocks).of(self.values));
        if first + 1 < rows {
            add(sums, Row::new(first + 1, blocks).of(self.values), 1.0);
        }
        sum(self.sums.as_chunks::<HALVES>().0, coarse);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self::new(self.fine, self.values)
    }

    fn append(&mut self, _: Self) {}
}

/// Pass over rows of blocks that replaces the sum R of the residual over n free nodes by the
/// weighted mean (R + w v)/(n + w). v is the outer value, interpolated from larger blocks, and w
/// its weight.
pub struct MeansWithOuter<'a> {
    free: &'a [f32],
    around: f32,
    coarse: [usize; 2],
    values: &'a [f32],
    /// Row of larger blocks, interpolated between two rows, with one more block before and after.
    mixed: Vec<f32>,
    /// The row `mixed`, interpolated to smaller blocks.
    between: Vec<f32>,
}

impl<'a> MeansWithOuter<'a> {
    pub fn new(free: &'a [f32], around: f32, coarse: [usize; 2], values: &'a [f32]) -> Self {
        Self {
            free,
            around,
            coarse,
            values,
            mixed: vec![0.0; coarse[1] + 2],
            between: vec![0.0; HALVES * coarse[1]],
        }
    }
}

impl Pass<f32> for MeansWithOuter<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, sums: &mut [f32]) {
        let [rows, blocks] = self.coarse;
        let [(own, of_own), (other, of_other)] = around::<HALVES>(row.index(), rows);
        let own = Row::new(own, blocks).of(self.values);
        let other = Row::new(other, blocks).of(self.values);
        for (mixed, (own, other)) in self.mixed[1..].iter_mut().zip(own.iter().zip(other)) {
            *mixed = of_own * own + of_other * other;
        }
        repeat(&mut self.mixed);
        interpolate(&self.mixed, self.between.as_chunks_mut::<HALVES>().0);
        let weight = self.around;
        let free = row.of(self.free);
        for ((sum, free), between) in sums.iter_mut().zip(free).zip(&self.between) {
            *sum = (*sum + weight * between) / (free + weight);
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self::new(self.free, self.around, self.coarse, self.values)
    }

    fn append(&mut self, _: Self) {}
}

/// Pass that adds, to each row of smallest blocks, the values that its two neighbouring rows of
/// blocks have collected for it (`for_neighbours`).
pub struct JoinRows<'a> {
    blocks: [usize; 2],
    for_neighbours: &'a [Vec<f32>; 2],
}

impl<'a> JoinRows<'a> {
    pub fn new(blocks: [usize; 2], for_neighbours: &'a [Vec<f32>; 2]) -> Self {
        Self { blocks, for_neighbours }
    }
}

impl Pass<f32> for JoinRows<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let [rows, blocks] = self.blocks;
        let before = (row.index() + rows - 1) % rows;
        let after = (row.index() + 1) % rows;
        let [for_before, for_after] = self.for_neighbours;
        add(values, Row::new(after, blocks).of(for_before), 1.0);
        add(values, Row::new(before, blocks).of(for_after), 1.0);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self::new(self.blocks, self.for_neighbours)
    }

    fn append(&mut self, _: Self) {}
}

/// Pass over rows of blocks that divides each value by n + w, with the number n of free nodes of
/// the block and the weight w of its outer value.
pub struct Divide<'a> {
    free: &'a [f32],
    around: f32,
}

impl<'a> Divide<'a> {
    pub fn new(free: &'a [f32], around: f32) -> Self {
        Self { free, around }
    }
}

impl Pass<f32> for Divide<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let weight = self.around;
        for (value, free) in values.iter_mut().zip(row.of(self.free)) {
            *value /= free + weight;
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}

/// Pass over rows of larger blocks that applies the transpose of the interpolation of outer values:
/// it sets each block to a weighted sum of the smaller blocks in it and next to it.
pub struct TransposeInterpolation<'a> {
    fine: [usize; 2],
    weight: f32,
    coarse: [usize; 2],
    values: &'a [f32],
    /// Weighted sum of rows of smaller blocks, with two more blocks before and after.
    sums: Vec<f32>,
}

impl<'a> TransposeInterpolation<'a> {
    pub fn new(fine: [usize; 2], weight: f32, coarse: [usize; 2], values: &'a [f32]) -> Self {
        Self { fine, weight, coarse, values, sums: vec![0.0; HALVES * (coarse[1] + 2)] }
    }
}

impl Pass<f32> for TransposeInterpolation<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, coarse: &mut [f32]) {
        let ([rows, blocks], larger) = (self.fine, self.coarse[0]);
        let (own, before) = (row.index(), (row.index() + larger - 1) % larger);
        let after = (own + 1) % larger;
        let [of_own, of_other] = weights::<HALVES>(0);
        self.sums.fill(0.0);
        for (index, share) in [
            (HALVES * own, of_own),
            (HALVES * own + 1, of_own),
            (HALVES * before + 1, of_other),
            (HALVES * after, of_other),
        ] {
            if index < rows {
                let values = Row::new(index, blocks).of(self.values);
                add(&mut self.sums[HALVES..][..blocks], values, self.weight * share);
            }
        }
        let sums = self.sums.as_chunks_mut::<HALVES>().0;
        repeat(sums);
        gather(sums, coarse);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self::new(self.fine, self.weight, self.coarse, self.values)
    }

    fn append(&mut self, _: Self) {}
}

/// Pass over rows of smaller blocks that adds the value of the larger block that contains them.
pub struct AddParent<'a> {
    coarse: [usize; 2],
    values: &'a [f32],
}

impl<'a> AddParent<'a> {
    pub fn new(coarse: [usize; 2], values: &'a [f32]) -> Self {
        Self { coarse, values }
    }
}

impl Pass<f32> for AddParent<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, fine: &mut [f32]) {
        let coarse = Row::new(row.index() / HALVES, self.coarse[1]).of(self.values);
        for (values, given) in fine.chunks_mut(HALVES).zip(coarse) {
            for value in values {
                *value += given;
            }
        }
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self { ..*self }
    }

    fn append(&mut self, _: Self) {}
}

#[inline(always)]
fn add(sums: &mut [f32], values: &[f32], factor: f32) {
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
