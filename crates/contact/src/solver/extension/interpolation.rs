//! Between blocks and their parts, along one side: linear interpolation, and its transpose.
//!
//! A part of a block lies between the centre of its own block and that of the one before or after.
//! Rows begin and end with one block more, of the row's other end.

/// The share of the own block and of the other one in part `part` of `SIDE`.
#[inline(always)]
pub fn shares<const SIDE: usize>(part: usize) -> [f32; 2] {
    let other = (2 * part + 1).abs_diff(SIDE) as f32 / (2 * SIDE) as f32;
    [1.0 - other, other]
}

/// Whether the other block is the one before.
#[inline(always)]
pub fn is_before<const SIDE: usize>(part: usize) -> bool {
    part < SIDE / 2
}

/// The blocks around a part: its own and the other, of `blocks` which repeat, with their shares.
#[inline(always)]
pub fn around<const SIDE: usize>(index: usize, blocks: usize) -> [(usize, f32); 2] {
    let (block, part) = (index / SIDE, index % SIDE);
    let [own, other] = shares::<SIDE>(part);
    let neighbour =
        if is_before::<SIDE>(part) { (block + blocks - 1) % blocks } else { (block + 1) % blocks };
    [(block, own), (neighbour, other)]
}

/// Sets the first of a row and the last, which are not of it, as if it repeated.
#[inline(always)]
pub fn repeat<V: Copy>(row: &mut [V]) {
    let last = row.len() - 1;
    (row[0], row[last]) = (row[last - 1], row[1]);
}

/// Interpolates blocks, which begin and end with one more.
#[inline(always)]
pub fn interpolate<const SIDE: usize>(blocks: &[f32], parts: &mut [[f32; SIDE]]) {
    for (parts, near) in parts.iter_mut().zip(blocks.windows(3)) {
        let (before, own, after) = (near[0], near[1], near[2]);
        for (part, value) in parts.iter_mut().enumerate() {
            let [of_own, of_other] = shares::<SIDE>(part);
            let other = if is_before::<SIDE>(part) { before } else { after };
            *value = of_own * own + of_other * other;
        }
    }
}

/// The transpose: what blocks have a share in, of parts which begin and end with those of one more.
#[inline(always)]
pub fn gather<const SIDE: usize>(parts: &[[f32; SIDE]], blocks: &mut [f32]) {
    for (block, near) in blocks.iter_mut().zip(parts.windows(3)) {
        let (before, own, after) = (near[0], near[1], near[2]);
        let (mut of_block, mut of_others) = (0.0, 0.0);
        for (part, own) in own.iter().enumerate() {
            let [of_own, of_other] = shares::<SIDE>(part);
            // The first parts of the block after lie towards this one.
            let other = if is_before::<SIDE>(part) { after[part] } else { before[part] };
            of_block += of_own * own;
            of_others += of_other * other;
        }
        *block = of_block + of_others;
    }
}

/// Sums over the parts of blocks.
#[inline(always)]
pub fn sum<const SIDE: usize>(parts: &[[f32; SIDE]], blocks: &mut [f32]) {
    for (block, parts) in blocks.iter_mut().zip(parts) {
        *block = 0.0;
        for part in parts {
            *block += part;
        }
    }
}
