//! Fourier sums of a few terms, in registers.

use std::f64::consts::FRAC_1_SQRT_2;

use super::super::Real;
use super::super::registers::Registers;

/// Complex numbers in as many lanes, real and imaginary parts in registers of their own.
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

/// a + i b
#[inline(always)]
fn plus_i<R: Registers>(r: R, a: Complex<R::Lanes>, b: Complex<R::Lanes>) -> Complex<R::Lanes> {
    Complex { re: r.sub(a.re, b.im), im: r.add(a.im, b.re) }
}

/// a − i b
#[inline(always)]
fn minus_i<R: Registers>(r: R, a: Complex<R::Lanes>, b: Complex<R::Lanes>) -> Complex<R::Lanes> {
    Complex { re: r.add(a.re, b.im), im: r.sub(a.im, b.re) }
}

/// a + f b
#[inline(always)]
fn plus_scaled<R: Registers>(
    r: R,
    a: Complex<R::Lanes>,
    f: R::Lanes,
    b: Complex<R::Lanes>,
) -> Complex<R::Lanes> {
    Complex { re: r.add_product(a.re, f, b.re), im: r.add_product(a.im, f, b.im) }
}

/// a − f b
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

/// X_k = Σ x_j exp(−2πi jk/n) in the place of x, for n of 2, 3, 4, 5, 8 and 16.
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

/// Two sums of four, of the even and of the odd terms.
#[inline(always)]
fn eight<R: Registers>(r: R, x: &mut [Complex<R::Lanes>]) {
    let even = four(r, [x[0], x[2], x[4], x[6]]);
    let odd = four(r, [x[1], x[3], x[5], x[7]]);
    // An eighth of a turn, and three, multiply by √½ (1 − i) and −√½ (1 + i).
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

/// Four sums of four of every fourth term, turned, and four sums of four of those.
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

/// Sine and cosine of one and of two fifths of a turn.
const FIFTHS: [[f64; 2]; 2] = [
    [0.951_056_516_295_153_5, 0.309_016_994_374_947_45],
    [0.587_785_252_292_473_2, -0.809_016_994_374_947_3],
];

/// Sine and cosine of so many sixteenths of a turn.
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
