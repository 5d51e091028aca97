//! Stages of a Fourier transform, down to blocks of one register's length.
//!
//! In the forward transform, each stage splits blocks into as many parts as its radix (decimation
//! in frequency). In the inverse transform, each stage joins them again (decimation in time). In
//! between, blocks stay in the order of [`Stages::block_indices`]; nothing is reordered. The parts
//! of a block are short Fourier sums, computed in registers.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use pulp::bytemuck;

use crate::fft::Real;
use crate::fft::registers::{PartOf, Registers};
use crate::fft::rows::Aligned;

/// Stages of a Fourier transform of a given length, down to blocks of one register.
///
/// If `ALONG` is true, consecutive numbers of one transform share a register. Otherwise each lane
/// belongs to a different transform.
pub struct Stages<T, const ALONG: bool> {
    stages: Vec<Stage<T>>,
    block_indices: Vec<usize>,
}

struct Stage<T> {
    radix: usize,
    /// Number of registers in a block that this stage splits.
    block: usize,
    /// Twiddle factors exp(−2πi jq/n) for each index j within a part and each part q = 1, …, radix
    /// − 1, where n is the number of values in a block. The real and the imaginary part of a factor
    /// each take one register if `ALONG`, otherwise one number.
    twiddles: Aligned<T>,
}

impl<T: Real, const ALONG: bool> Stages<T, ALONG> {
    /// Plans the stages of a transform of `length` numbers, down to blocks of `lanes` numbers.
    /// Returns `None` unless `length / lanes` has only the factors 2, 3 and 5.
    pub fn new(length: usize, lanes: usize) -> Option<Self> {
        let radices = radices(length / lanes)?;
        let width = if ALONG { lanes } else { 1 };
        let mut stages = Vec::new();
        let mut block_indices = vec![0];
        let mut block = length;
        for radix in radices {
            let part = block / radix;
            // The lowest digit of a frequency is the index of the part that contains it.
            block_indices = (0..radix)
                .flat_map(|q| block_indices.iter().map(move |index| index + q * part / lanes))
                .collect();
            stages.push(Stage {
                radix,
                block: block / width,
                twiddles: twiddles(block, radix, width),
            });
            block = part;
        }
        Some(Self { stages, block_indices })
    }

    /// Returns the indices of the blocks in the order of frequencies: element k is the index of the
    /// block with the frequencies k, k + K, k + 2K, …, where K is the number of blocks.
    pub fn block_indices(&self) -> &[usize] {
        &self.block_indices
    }

    #[inline(always)]
    pub fn forward<R: Registers<Number = T>>(
        &self,
        r: R,
        re: &mut [R::Lanes],
        im: &mut [R::Lanes],
    ) {
        for stage in &self.stages {
            match stage.radix {
                2 => stage.cut::<2, ALONG, R>(r, re, im),
                3 => stage.cut::<3, ALONG, R>(r, re, im),
                4 => stage.cut::<4, ALONG, R>(r, re, im),
                5 => stage.cut::<5, ALONG, R>(r, re, im),
                _ => stage.cut::<8, ALONG, R>(r, re, im),
            }
        }
    }

    /// Applies the inverse of [`Stages::forward`] in place, without normalisation: both together
    /// multiply by the number of blocks.
    #[inline(always)]
    pub fn inverse<R: Registers<Number = T>>(
        &self,
        r: R,
        re: &mut [R::Lanes],
        im: &mut [R::Lanes],
    ) {
        // Exchanging real and imaginary parts turns a forward transform into an inverse one.
        for stage in self.stages.iter().rev() {
            match stage.radix {
                2 => stage.join::<2, ALONG, R>(r, im, re),
                3 => stage.join::<3, ALONG, R>(r, im, re),
                4 => stage.join::<4, ALONG, R>(r, im, re),
                5 => stage.join::<5, ALONG, R>(r, im, re),
                _ => stage.join::<8, ALONG, R>(r, im, re),
            }
        }
    }
}

impl<T: Real> Stage<T> {
    #[inline(always)]
    fn cut<const RADIX: usize, const ALONG: bool, R: Registers<Number = T>>(
        &self,
        r: R,
        re: &mut [R::Lanes],
        im: &mut [R::Lanes],
    ) {
        let (r, block) = (r.part(), self.block * R::PARTS);
        let part = block / RADIX;
        let re: &mut [PartOf<R>] = bytemuck::cast_slice_mut(re);
        let im: &mut [PartOf<R>] = bytemuck::cast_slice_mut(im);
        for (re, im) in re.chunks_exact_mut(block).zip(im.chunks_exact_mut(block)) {
            let firsts = (0..part).step_by(R::PARTS);
            for (first, twiddles) in firsts.zip(self.twiddles_of::<RADIX, ALONG, R>()) {
                for lane in 0..R::PARTS {
                    let j = first + lane;
                    let mut x = [at(re, im, j); RADIX];
                    for q in 1..RADIX {
                        x[q] = at(re, im, j + q * part);
                    }
                    fourier(r, &mut x);
                    (re[j], im[j]) = (x[0].re, x[0].im);
                    for q in 1..RADIX {
                        let x = times(r, x[q], twiddle::<ALONG, R>(r, twiddles, q, lane));
                        (re[j + q * part], im[j + q * part]) = (x.re, x.im);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn join<const RADIX: usize, const ALONG: bool, R: Registers<Number = T>>(
        &self,
        r: R,
        re: &mut [R::Lanes],
        im: &mut [R::Lanes],
    ) {
        let (r, block) = (r.part(), self.block * R::PARTS);
        let part = block / RADIX;
        let re: &mut [PartOf<R>] = bytemuck::cast_slice_mut(re);
        let im: &mut [PartOf<R>] = bytemuck::cast_slice_mut(im);
        for (re, im) in re.chunks_exact_mut(block).zip(im.chunks_exact_mut(block)) {
            let firsts = (0..part).step_by(R::PARTS);
            for (first, twiddles) in firsts.zip(self.twiddles_of::<RADIX, ALONG, R>()) {
                for lane in 0..R::PARTS {
                    let j = first + lane;
                    let mut x = [at(re, im, j); RADIX];
                    for q in 1..RADIX {
                        let turn = twiddle::<ALONG, R>(r, twiddles, q, lane);
                        x[q] = times(r, at(re, im, j + q * part), turn);
                    }
                    fourier(r, &mut x);
                    for q in 0..RADIX {
                        (re[j + q * part], im[j + q * part]) = (x[q].re, x[q].im);
                    }
                }
            }
        }
    }

    /// Iterates over `twiddles` in slices, one for each register of a part.
    #[inline(always)]
    fn twiddles_of<const RADIX: usize, const ALONG: bool, R: Registers<Number = T>>(
        &self,
    ) -> impl Iterator<Item = &[T]> {
        let width = if ALONG { R::LANES } else { 1 };
        self.twiddles.chunks_exact(2 * (RADIX - 1) * width)
    }
}

#[inline(always)]
fn at<V: Copy>(re: &[V], im: &[V], index: usize) -> Complex<V> {
    Complex { re: re[index], im: im[index] }
}

/// Returns the twiddle factor of part `q` from one slice of [`Stage::twiddles_of`], for processor
/// register number `lane` of a register.
#[inline(always)]
fn twiddle<const ALONG: bool, R: Registers>(
    part: R::Part,
    twiddles: &[R::Number],
    q: usize,
    lane: usize,
) -> Complex<PartOf<R>> {
    if ALONG {
        let registers: &[PartOf<R>] = bytemuck::cast_slice(twiddles);
        Complex {
            re: registers[2 * (q - 1) * R::PARTS + lane],
            im: registers[(2 * (q - 1) + 1) * R::PARTS + lane],
        }
    } else {
        Complex { re: part.splat(twiddles[2 * (q - 1)]), im: part.splat(twiddles[2 * (q - 1) + 1]) }
    }
}

fn twiddles<T: Real>(length: usize, radix: usize, width: usize) -> Aligned<T> {
    let mut twiddles = Vec::new();
    for first in (0..length / radix).step_by(width) {
        for q in 1..radix {
            let angles =
                (first..first + width).map(|j| -TAU * (j * q % length) as f64 / length as f64);
            twiddles.extend(angles.clone().map(|angle| T::nearest(libm::cos(angle))));
            twiddles.extend(angles.map(|angle| T::nearest(libm::sin(angle))));
        }
    }
    twiddles.into_iter().collect()
}

/// Factors `n` into the radices 5, 3, 8, 4 and 2, in this order. Returns `None` if this is not
/// possible.
///
/// It prefers 8, but splits 16 into 4 × 4, so that 2 occurs only if `n` has a single factor of two.
fn radices(mut n: usize) -> Option<Vec<usize>> {
    let mut radices = Vec::new();
    for odd in [5, 3] {
        while n.is_multiple_of(odd) {
            radices.push(odd);
            n /= odd;
        }
    }
    while n > 1 {
        let radix = match n {
            2 => 2,
            4 | 16 => 4,
            _ if n.is_multiple_of(8) => 8,
            _ => return None,
        };
        radices.push(radix);
        n /= radix;
    }
    Some(radices)
}

/// Complex numbers, one in each lane: a register of real parts and a register of imaginary parts.
#[derive(Clone, Copy)]
pub struct Complex<V> {
    pub re: V,
    pub im: V,
}

#[inline(always)]
pub fn times<R: Registers>(r: R, a: Complex<R::Lanes>, b: Complex<R::Lanes>) -> Complex<R::Lanes> {
    Complex {
        re: r.sub_product(r.mul(a.re, b.re), a.im, b.im),
        im: r.add_product(r.mul(a.im, b.re), a.re, b.im),
    }
}

#[inline(always)]
fn plus<R: Registers>(r: R, a: Complex<R::Lanes>, b: Complex<R::Lanes>) -> Complex<R::Lanes> {
    Complex { re: r.add(a.re, b.re), im: r.add(a.im, b.im) }
}

#[inline(always)]
fn minus<R: Registers>(r: R, a: Complex<R::Lanes>, b: Complex<R::Lanes>) -> Complex<R::Lanes> {
    Complex { re: r.sub(a.re, b.re), im: r.sub(a.im, b.im) }
}

#[inline(always)]
fn plus_i<R: Registers>(r: R, a: Complex<R::Lanes>, b: Complex<R::Lanes>) -> Complex<R::Lanes> {
    Complex { re: r.sub(a.re, b.im), im: r.add(a.im, b.re) }
}

#[inline(always)]
fn minus_i<R: Registers>(r: R, a: Complex<R::Lanes>, b: Complex<R::Lanes>) -> Complex<R::Lanes> {
    Complex { re: r.add(a.re, b.im), im: r.sub(a.im, b.re) }
}

#[inline(always)]
fn plus_scaled<R: Registers>(
    r: R,
    a: Complex<R::Lanes>,
    f: R::Lanes,
    b: Complex<R::Lanes>,
) -> Complex<R::Lanes> {
    Complex { re: r.add_product(a.re, f, b.re), im: r.add_product(a.im, f, b.im) }
}

#[inline(always)]
fn minus_scaled<R: Registers>(
    r: R,
    a: Complex<R::Lanes>,
    f: R::Lanes,
    b: Complex<R::Lanes>,
) -> Complex<R::Lanes> {
    Complex { re: r.sub_product(a.re, f, b.re), im: r.sub_product(a.im, f, b.im) }
}

#[inline(always)]
fn scaled<R: Registers>(r: R, f: R::Lanes, b: Complex<R::Lanes>) -> Complex<R::Lanes> {
    Complex { re: r.mul(f, b.re), im: r.mul(f, b.im) }
}

#[inline(always)]
fn constant<R: Registers>(r: R, value: f64) -> R::Lanes {
    r.splat(R::Number::nearest(value))
}

/// Replaces the n elements of `x` by X_k = Σ x_j exp(−2πi jk/n), in each lane, for n = 2, 3, 4, 5,
/// 8 or 16.
#[inline(always)]
pub fn fourier<R: Registers>(r: R, x: &mut [Complex<R::Lanes>]) {
    match x {
        [a, b] => [*a, *b] = [plus(r, *a, *b), minus(r, *a, *b)],
        [a, b, c] => [*a, *b, *c] = three(r, [*a, *b, *c]),
        [a, b, c, d] => [*a, *b, *c, *d] = four(r, [*a, *b, *c, *d]),
        [a, b, c, d, e] => [*a, *b, *c, *d, *e] = five(r, [*a, *b, *c, *d, *e]),
        _ if x.len() == 8 => eight(r, x),
        _ => sixteen(r, x),
    }
}

#[inline(always)]
fn three<R: Registers>(r: R, [a, b, c]: [Complex<R::Lanes>; 3]) -> [Complex<R::Lanes>; 3] {
    let (sum, difference) = (plus(r, b, c), minus(r, b, c));
    let middle = minus_scaled(r, a, constant(r, 0.5), sum);
    let turned = scaled(r, constant(r, 0.75_f64.sqrt()), difference);
    [plus(r, a, sum), minus_i(r, middle, turned), plus_i(r, middle, turned)]
}

#[inline(always)]
fn four<R: Registers>(r: R, [a, b, c, d]: [Complex<R::Lanes>; 4]) -> [Complex<R::Lanes>; 4] {
    let (ac, bd) = (plus(r, a, c), plus(r, b, d));
    let (a_c, b_d) = (minus(r, a, c), minus(r, b, d));
    [plus(r, ac, bd), minus_i(r, a_c, b_d), minus(r, ac, bd), plus_i(r, a_c, b_d)]
}

#[inline(always)]
fn five<R: Registers>(r: R, [a, b, c, d, e]: [Complex<R::Lanes>; 5]) -> [Complex<R::Lanes>; 5] {
    let [[sin_1, cos_1], [sin_2, cos_2]] = FIFTHS;
    let (cos_1, cos_2) = (constant(r, cos_1), constant(r, cos_2));
    let (sin_1, sin_2) = (constant(r, sin_1), constant(r, sin_2));
    let (be, cd) = (plus(r, b, e), plus(r, c, d));
    let (b_e, c_d) = (minus(r, b, e), minus(r, c, d));
    let even_1 = plus_scaled(r, plus_scaled(r, a, cos_1, be), cos_2, cd);
    let even_2 = plus_scaled(r, plus_scaled(r, a, cos_2, be), cos_1, cd);
    let odd_1 = plus_scaled(r, scaled(r, sin_2, c_d), sin_1, b_e);
    let odd_2 = minus_scaled(r, scaled(r, sin_2, b_e), sin_1, c_d);
    [
        plus(r, plus(r, a, be), cd),
        minus_i(r, even_1, odd_1),
        minus_i(r, even_2, odd_2),
        plus_i(r, even_2, odd_2),
        plus_i(r, even_1, odd_1),
    ]
}

/// Computes [`fourier`] for n = 8 from two transforms of length 4, of the even and of the odd
/// elements.
#[inline(always)]
fn eight<R: Registers>(r: R, x: &mut [Complex<R::Lanes>]) {
    let even = four(r, [x[0], x[2], x[4], x[6]]);
    let odd = four(r, [x[1], x[3], x[5], x[7]]);
    // exp(−2πi/8) = √½ (1 − i) and exp(−2πi · 3/8) = −√½ (1 + i).
    let half_root = constant(r, FRAC_1_SQRT_2);
    let one_eighth = minus_i(r, odd[1], odd[1]);
    let five_eighths = plus_i(r, odd[3], odd[3]);
    x[0] = plus(r, even[0], odd[0]);
    x[1] = plus_scaled(r, even[1], half_root, one_eighth);
    x[2] = minus_i(r, even[2], odd[2]);
    x[3] = minus_scaled(r, even[3], half_root, five_eighths);
    x[4] = minus(r, even[0], odd[0]);
    x[5] = minus_scaled(r, even[1], half_root, one_eighth);
    x[6] = plus_i(r, even[2], odd[2]);
    x[7] = plus_scaled(r, even[3], half_root, five_eighths);
}

/// Computes [`fourier`] for n = 16 from four transforms of length 4, each of every fourth element,
/// and four more of their results.
#[inline(always)]
fn sixteen<R: Registers>(r: R, x: &mut [Complex<R::Lanes>]) {
    let mut columns = [[x[0]; 4]; 4];
    for (j, column) in columns.iter_mut().enumerate() {
        *column = four(r, [x[j], x[4 + j], x[8 + j], x[12 + j]]);
        for (k, value) in column.iter_mut().enumerate() {
            if j * k > 0 {
                let (sin, cos) = SIXTEENTHS[j * k];
                let turn = Complex { re: constant(r, cos), im: constant(r, -sin) };
                *value = times(r, *value, turn);
            }
        }
    }
    let [a, b, c, d] = columns;
    for k in 0..4 {
        [x[k], x[4 + k], x[8 + k], x[12 + k]] = four(r, [a[k], b[k], c[k], d[k]]);
    }
}

/// Sine and cosine of 2π/5 and of 4π/5.
const FIFTHS: [[f64; 2]; 2] = [
    [0.951_056_516_295_153_5, 0.309_016_994_374_947_45],
    [0.587_785_252_292_473_2, -0.809_016_994_374_947_3],
];

/// Sine and cosine of 2πj/16 for j = 0, 1, …, 9.
const SIXTEENTHS: [(f64, f64); 10] = {
    const SIN: f64 = 0.382_683_432_365_089_8;
    const COS: f64 = 0.923_879_532_511_286_7;
    const MIXED: f64 = FRAC_1_SQRT_2;
    [
        (0.0, 1.0),
        (SIN, COS),
        (MIXED, MIXED),
        (COS, SIN),
        (1.0, 0.0),
        (COS, -SIN),
        (MIXED, -MIXED),
        (SIN, -COS),
        (0.0, -1.0),
        (-SIN, -COS),
    ]
};
