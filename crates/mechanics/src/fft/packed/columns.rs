//! Convolution of a tile and its opposite along columns: transforms, product with the kernel and
//! inverse transforms.
//!
//! With M blocks, the frequency k + pM has index p in block k. Its opposite is in block M − k at
//! index L − 1 − p. For k = 0 it is in block 0 at L − p (at 0 if p = 0). Opposite frequencies have
//! the same kernel factors, so these are stored for half of the blocks. Block k of a tile is
//! multiplied together with block M − k of the opposite tile, and block k of the opposite tile with
//! block M − k of the tile.

use std::f64::consts::TAU;

use pulp::bytemuck;

use super::stages::{Complex, Stages, fourier};
use crate::fft::Real;
use crate::fft::registers::{MAX_LANES, PartOf, Registers, Work, transpose};
use crate::fft::rows::Aligned;
use crate::grid::magnitude;
use crate::threads::Threads;

pub struct Columns<T> {
    nodes: [usize; 2],
    lanes: usize,
    stages: Stages<T, false>,
    /// For each block k ≤ M/2, the L values of cos θ, then the L values of sin θ. Here θ =
    /// 2πk_x/N_x for the frequencies k_x = k + pM of the block.
    turns: Aligned<T>,
}

impl<T: Real> Columns<T> {
    /// Plans the transforms of columns of N_x/2 complex numbers, with N_x = `nodes[0]`. Returns
    /// `None` unless N_x/(2 `lanes`) has only the factors 2, 3 and 5.
    pub fn new(nodes: [usize; 2], lanes: usize) -> Option<Self> {
        let length = nodes[0];
        let blocks = length / 2 / lanes;
        let angles = |block: usize| {
            (0..lanes).map(move |p| TAU * (block + p * blocks) as f64 / length as f64)
        };
        let turns = (0..=blocks / 2).flat_map(|block| {
            let (cos, sin) = (angles(block).map(libm::cos), angles(block).map(libm::sin));
            cos.chain(sin)
        });
        Some(Self {
            nodes,
            lanes,
            stages: Stages::new(length / 2, lanes)?,
            turns: turns.map(T::nearest).collect(),
        })
    }

    /// Computes the factors S and D of a kernel, as the module [`packed`](super) defines them.
    ///
    /// The result is ordered by tile k_y mod N_y/L, then by block k_x mod M, then by index p of k_y
    /// in the tile. For each of these there is one register of S and one of D, with a lane for each
    /// k_x of the block. `factors(k_y, column)` writes the factors for k_x = 0, 1, …, N_x/2 to
    /// `column`.
    ///
    /// Only the first half of the tiles and of the blocks is stored, because opposite frequencies
    /// have the same factors. S and D are doubled, because only half as many complex numbers are
    /// transformed as there are nodes.
    pub fn kernel(
        &self,
        threads: &Threads,
        factors: impl Fn(usize, &mut [f64]) + Sync,
    ) -> Aligned<T> {
        let ([nodes_x, nodes_y], l) = (self.nodes, self.lanes);
        let (tiles, blocks) = (nodes_y / l, nodes_x / 2 / l);
        let of_tile = self.kernel_of_tile();
        let mut kernel = Aligned::zeros((tiles / 2 + 1) * of_tile);
        let mut shares: Vec<_> = kernel.chunks_exact_mut(of_tile).enumerate().collect();
        let fill = |column: &mut Vec<f64>, (tile, kernel): &mut (usize, &mut [T])| {
            for p in 0..l {
                factors(magnitude(*tile + p * tiles, nodes_y), column);
                let registers = kernel.chunks_exact_mut(2 * l).skip(p).step_by(l);
                for (block, registers) in registers.enumerate() {
                    let (sums, differences) = registers.split_at_mut(l);
                    for (p, (sum, difference)) in sums.iter_mut().zip(differences).enumerate() {
                        let k_x = block + p * blocks;
                        let (near, far) = (column[k_x], column[nodes_x / 2 - k_x]);
                        *sum = T::nearest(near + far);
                        *difference = T::nearest(near - far);
                    }
                }
            }
        };
        let workers = threads.workers(nodes_x * nodes_y);
        let column = || vec![0.0; nodes_x / 2 + 1];
        workers.for_each(&mut Vec::new(), column, &mut shares, fill);
        drop(shares);
        kernel
    }

    fn kernel_of_tile(&self) -> usize {
        let blocks = self.nodes[0] / 2 / self.lanes;
        (blocks / 2 + 1) * 2 * self.lanes * self.lanes
    }

    /// Pairs each tile k with its opposite, the tile −k. Tile k is item `block_indices[k]` of
    /// `tiles`.
    pub fn pairs<'a>(
        &self,
        tiles: impl Iterator<Item = &'a mut [T]>,
        block_indices: &[usize],
        kernel: &'a [T],
    ) -> Vec<Pair<'a, T>> {
        let mut waiting: Vec<Option<&mut [T]>> = tiles.map(Some).collect();
        let count = block_indices.len();
        let kernels = kernel.chunks_exact(self.kernel_of_tile());
        let pairs = (0..=count / 2).zip(kernels).map(|(k, kernel)| Pair {
            near: waiting[block_indices[k]].take().expect("each is in one pair"),
            far: waiting[block_indices[(count - k) % count]].take(),
            kernel,
            lowest: k == 0,
            sum: 0.0,
        });
        pairs.collect()
    }
}

/// Tile k (`near`) and its opposite, the tile −k (`far`). `far` is `None` if both are the same
/// tile.
pub struct Pair<'a, T> {
    near: &'a mut [T],
    far: Option<&'a mut [T]>,
    /// Factors S and D of the tile `near`, as [`Columns::kernel`] orders them.
    kernel: &'a [T],
    /// `true` if `near` is the tile with k = 0.
    lowest: bool,
    /// Contribution of this pair to Σ f (k∗f) over the nodes, with the map f and the kernel k.
    /// [`Convolve`] sets it.
    pub sum: f64,
}

pub struct Convolve<'a, 'b, T> {
    pub columns: &'a Columns<T>,
    pub pair: &'a mut Pair<'b, T>,
    /// Buffer for one tile with all N_x/2 complex rows, or for two if tiles must be padded.
    pub spare: &'a mut [T],
}

impl<T: Real> Work<T> for Convolve<'_, '_, T> {
    #[inline(always)]
    fn run<R: Registers<Number = T>>(self, r: R) {
        let stages = &self.columns.stages;
        let nodes = self.columns.nodes[0];
        let Pair { near, far, kernel, lowest, sum } = self.pair;
        let near: &mut [R::Lanes] = bytemuck::cast_slice_mut(near);
        let mut far: Option<&mut [R::Lanes]> =
            far.as_deref_mut().map(bytemuck::cast_slice_mut::<T, R::Lanes>);
        let spare: &mut [R::Lanes] = bytemuck::cast_slice_mut(self.spare);
        let is_whole = near.len() == nodes;
        let alone = far.is_none();
        let mut pair = if !is_whole {
            let (first, second) = spare.split_at_mut(nodes);
            pad_tile(r, near, first);
            pad_tile(r, far.as_deref().unwrap_or(near), second);
            [first, second]
        } else if let Some(far) = &mut far {
            [&mut *near, &mut **far]
        } else {
            spare.copy_from_slice(near);
            [&mut *near, &mut *spare]
        };
        for tile in &mut pair {
            let (re, im) = tile.split_at_mut(nodes / 2);
            stages.forward(r, re, im);
        }
        let [here, there] = &mut pair;
        let kernel = bytemuck::cast_slice(kernel);
        let [own, opposite] = multiply(r, self.columns, kernel, here, there, *lowest);
        *sum = total::<R>(own) + if alone { 0.0 } else { total::<R>(opposite) };
        for tile in &mut pair {
            let (re, im) = tile.split_at_mut(nodes / 2);
            stages.inverse(r, re, im);
        }
        if !is_whole {
            let (first, second) = spare.split_at(nodes);
            truncate_tile(first, near);
            if let Some(far) = far {
                truncate_tile(second, far);
            }
        }
    }
}

/// Copies the filled rows of `tile` to `whole`, and sets the other rows of `whole` to zero.
#[inline(always)]
fn pad_tile<R: Registers>(r: R, tile: &[R::Lanes], whole: &mut [R::Lanes]) {
    let half = tile.len() / 2;
    let whole_half = whole.len() / 2;
    let parts = whole.chunks_exact_mut(whole_half);
    for (tile, whole) in tile.chunks_exact(half).zip(parts) {
        whole[..half].copy_from_slice(tile);
        whole[half..].fill(r.splat(R::Number::default()));
    }
}

/// Copies the filled rows of `whole` to `tile`.
#[inline(always)]
fn truncate_tile<V: Copy>(whole: &[V], tile: &mut [V]) {
    let half = tile.len() / 2;
    let parts = whole.chunks_exact(whole.len() / 2);
    for (tile, whole) in tile.chunks_exact_mut(half).zip(parts) {
        tile.copy_from_slice(&whole[..half]);
    }
}

#[inline(always)]
fn total<R: Registers<Number: Real>>(lanes: R::Lanes) -> f64 {
    let numbers: &[R::Number] = bytemuck::cast_slice(std::slice::from_ref(&lanes));
    numbers.iter().map(|number| (*number).into()).sum()
}

/// Transforms the blocks of a tile (`here`) and its opposite (`there`), multiplies them by the
/// kernel, and transforms them back, in place.
///
/// `kernel` contains S and D of the tile `here`, as [`Columns::kernel`] orders them. Let Z be the
/// transform of the tile, and Z′ its product with the kernel. Returns Σ Re(Z* Z′) over `here` and
/// over `there`, one sum per lane. By Parseval's theorem, the total over all tiles is Σ f (k∗f)
/// over the nodes, with the map f and the kernel k.
#[inline(always)]
fn multiply<R: Registers<Number: Real>>(
    r: R,
    columns: &Columns<R::Number>,
    kernel: &[R::Lanes],
    here: &mut [R::Lanes],
    there: &mut [R::Lanes],
    lowest_tile: bool,
) -> [R::Lanes; 2] {
    let mut sums = [r.splat(R::Number::default()); 2];
    let block_indices = columns.stages.block_indices();
    let blocks = block_indices.len();
    let turns: &[R::Lanes] = bytemuck::cast_slice(&columns.turns);
    let factors = kernel.chunks_exact(2 * R::LANES);
    for ((k, kernel), turns) in (0..blocks).zip(factors).zip(turns.chunks_exact(2)) {
        let turn = [turns[0], turns[1]];
        let opposite = (blocks - k) % blocks;
        let order = Order::opposite(k == 0);
        let tile_order = Order::opposite(lowest_tile);
        let mut x = transform_block(r, here, block_indices[k], Order::Ascending);
        let mut y = transform_block(r, there, block_indices[opposite], order);
        let [own, other] = &mut sums;
        for p in 0..R::LANES {
            let q = tile_order.index(p, R::LANES);
            let factors = [kernel[2 * p], kernel[2 * p + 1]];
            multiply_pair(r, factors, turn, [&mut x[p], &mut y[q]], [own, other]);
        }
        inverse_block(r, here, block_indices[k], Order::Ascending, &mut x);
        inverse_block(r, there, block_indices[opposite], order, &mut y);
        if opposite == k {
            continue;
        }
        let mut x = transform_block(r, there, block_indices[k], Order::Ascending);
        let mut y = transform_block(r, here, block_indices[opposite], order);
        for p in 0..R::LANES {
            let q = tile_order.index(p, R::LANES);
            let factors = [kernel[2 * p], kernel[2 * p + 1]];
            multiply_pair(r, factors, turn, [&mut x[q], &mut y[p]], [other, own]);
        }
        inverse_block(r, there, block_indices[k], Order::Ascending, &mut x);
        inverse_block(r, here, block_indices[opposite], order, &mut y);
    }
    sums
}

/// Applies Z(k) ← (S − D sin θ) Z(k) + i D cos θ Z(−k)* to Z(k) = `here` and to Z(−k) = `there`.
///
/// S is `sum` and D is `difference`. Adds Re(Z* Z′) of both frequencies to `own` and `other`, where
/// Z′ is the new value.
#[inline(always)]
fn multiply_pair<R: Registers>(
    r: R,
    [sum, difference]: [R::Lanes; 2],
    [cos, sin]: [R::Lanes; 2],
    [here, there]: [&mut Complex<R::Lanes>; 2],
    [own, other]: [&mut R::Lanes; 2],
) {
    let direct = r.sub_product(sum, difference, sin);
    // At −k, θ becomes π − θ and the kernel factors K and K′ are exchanged: D and cos θ change
    // sign.
    let direct_opposite = r.add_product(sum, difference, sin);
    let crossed = r.mul(difference, cos);
    let (a, b) = (*here, *there);
    *here = Complex {
        re: r.add_product(r.mul(direct, a.re), crossed, b.im),
        im: r.add_product(r.mul(direct, a.im), crossed, b.re),
    };
    *there = Complex {
        re: r.add_product(r.mul(direct_opposite, b.re), crossed, a.im),
        im: r.add_product(r.mul(direct_opposite, b.im), crossed, a.re),
    };
    for (sum, (before, after)) in [(own, (a, *here)), (other, (b, *there))] {
        *sum = r.add_product(*sum, before.re, after.re);
        *sum = r.add_product(*sum, before.im, after.im);
    }
}

/// Order of the L frequencies of a block.
#[derive(Clone, Copy)]
enum Order {
    /// Frequency p at index p.
    Ascending,
    /// Frequency p at index L − 1 − p, where its opposite is in [`Order::Ascending`].
    Descending,
    /// Frequency p at index (L − p) mod L: the descending order of block 0.
    DescendingFromZero,
}

impl Order {
    #[inline(always)]
    fn opposite(lowest: bool) -> Self {
        if lowest { Self::DescendingFromZero } else { Self::Descending }
    }

    #[inline(always)]
    fn index(self, p: usize, lanes: usize) -> usize {
        match self {
            Self::Ascending => p,
            Self::Descending => lanes - 1 - p,
            Self::DescendingFromZero => (lanes - p) % lanes,
        }
    }
}

/// Applies [`fourier`] to `x`, to one processor register of each element after the other, because
/// the processor has too few registers for all of `x`.
#[inline(always)]
fn fourier_in_parts<R: Registers<Number: Real>>(r: R, x: &mut [Complex<R::Lanes>]) {
    if R::PARTS == 1 {
        return fourier(r, x);
    }
    let part = r.part();
    let zero = part.splat(R::Number::default());
    for lane in 0..R::PARTS {
        let mut y = [Complex { re: zero, im: zero }; MAX_LANES];
        for (y, x) in y.iter_mut().zip(&*x) {
            (y.re, y.im) = (parts::<R>(&x.re)[lane], parts::<R>(&x.im)[lane]);
        }
        fourier(part, &mut y[..R::LANES]);
        for (x, y) in x.iter_mut().zip(y) {
            parts_mut::<R>(&mut x.re)[lane] = y.re;
            parts_mut::<R>(&mut x.im)[lane] = y.im;
        }
    }
}

#[inline(always)]
fn parts<R: Registers>(lanes: &R::Lanes) -> &[PartOf<R>] {
    bytemuck::cast_slice(std::slice::from_ref(lanes))
}

#[inline(always)]
fn parts_mut<R: Registers>(lanes: &mut R::Lanes) -> &mut [PartOf<R>] {
    bytemuck::cast_slice_mut(std::slice::from_mut(lanes))
}

/// Returns the transform of block `block` of a tile along both sides.
///
/// In the tile, each lane is a column. In the result, element p is frequency p along the rows, and
/// its lanes are the frequencies along the columns, in `order`.
#[inline(always)]
fn transform_block<R: Registers<Number: Real>>(
    r: R,
    tile: &[R::Lanes],
    block: usize,
    order: Order,
) -> [Complex<R::Lanes>; MAX_LANES] {
    let (re, im) = tile.split_at(tile.len() / 2);
    let re = &re[block * R::LANES..][..R::LANES];
    let im = &im[block * R::LANES..][..R::LANES];
    let zero = r.splat(R::Number::default());
    let mut x = [Complex { re: zero, im: zero }; MAX_LANES];
    for p in 0..R::LANES {
        x[p] = Complex { re: re[p], im: im[p] };
    }
    fourier_in_parts(r, &mut x[..R::LANES]);
    let (mut re, mut im) = ([zero; MAX_LANES], [zero; MAX_LANES]);
    for p in 0..R::LANES {
        let index = order.index(p, R::LANES);
        (re[index], im[index]) = (x[p].re, x[p].im);
    }
    transpose(r, &mut re);
    transpose(r, &mut im);
    for p in 0..R::LANES {
        x[p] = Complex { re: re[p], im: im[p] };
    }
    fourier_in_parts(r, &mut x[..R::LANES]);
    x
}

/// Applies the inverse of [`transform_block`] to `x`, without normalisation, and writes the result
/// to block `block` of the tile. Both transforms together multiply the block by L². The content of
/// `x` is lost.
#[inline(always)]
fn inverse_block<R: Registers<Number: Real>>(
    r: R,
    tile: &mut [R::Lanes],
    block: usize,
    order: Order,
    x: &mut [Complex<R::Lanes>; MAX_LANES],
) {
    let half = tile.len() / 2;
    let (re_out, im_out) = tile.split_at_mut(half);
    let re_out = &mut re_out[block * R::LANES..][..R::LANES];
    let im_out = &mut im_out[block * R::LANES..][..R::LANES];
    let zero = r.splat(R::Number::default());
    let (mut re, mut im) = ([zero; MAX_LANES], [zero; MAX_LANES]);
    // Exchanging real and imaginary parts makes the transforms inverse.
    for p in 0..R::LANES {
        x[p] = Complex { re: x[p].im, im: x[p].re };
    }
    fourier_in_parts(r, &mut x[..R::LANES]);
    for p in 0..R::LANES {
        (re[p], im[p]) = (x[p].re, x[p].im);
    }
    transpose(r, &mut re);
    transpose(r, &mut im);
    for p in 0..R::LANES {
        let index = order.index(p, R::LANES);
        x[p] = Complex { re: re[index], im: im[index] };
    }
    fourier_in_parts(r, &mut x[..R::LANES]);
    for p in 0..R::LANES {
        (re_out[p], im_out[p]) = (x[p].im, x[p].re);
    }
}
