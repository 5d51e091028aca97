//! Arithmetic on rows, as many numbers at a time as a register holds.
//!
//! pulp finds out what the processor can do. All that runs on registers is `#[inline(always)]` and
//! free of closures: only so is it compiled with the instructions that were found.

use std::ops::{Add, BitOr, Mul, Neg, Sub};

use pulp::{Arch, Simd, WithSimd};

use crate::contact::fft::{Real, Row, Rows};

/// Partial sums of a row where compilers choose the registers: the widest, in single precision.
pub const LANES: usize = 16;

/// What a pass over the mesh does with its rows, in the registers that it is given.
pub trait Pass<T> {
    /// As [`Rows::row`].
    fn row<S: Simd>(&mut self, simd: S, row: Row, values: &mut [T]);
}

/// The rows of a pass, in the widest registers that the processor has.
pub struct Wide<'a, P>(pub &'a mut P);

impl<T, P: Pass<T>> Rows<T> for Wide<'_, P> {
    fn row(&mut self, row: Row, values: &mut [T]) {
        Arch::new().dispatch(Dispatch(self.0, row, values));
    }
}

struct Dispatch<'a, T, P>(&'a mut P, Row, &'a mut [T]);

impl<T, P: Pass<T>> WithSimd for Dispatch<'_, T, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.0.row(simd, self.1, self.2);
    }
}

/// Runs a pass over the rows of a map, with so many nodes in a row.
pub fn over_rows<T>(map: &mut [T], nodes: usize, pass: &mut impl Pass<T>) {
    for (index, values) in map.chunks_exact_mut(nodes).enumerate() {
        Wide(pass).row(Row::new(index, nodes), values);
    }
}

/// Numbers in a register.
#[derive(Clone, Copy)]
pub struct Lanes<S: Simd>(S, S::f32s);

/// A choice for each number in a register.
#[derive(Clone, Copy)]
pub struct Choice<S: Simd>(S, S::m32s);

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub fn of(simd: S, numbers: S::f32s) -> Self {
        Self(simd, numbers)
    }

    #[inline(always)]
    pub fn all(simd: S, number: f32) -> Self {
        Self(simd, simd.splat_f32s(number))
    }

    #[inline(always)]
    pub fn numbers(self) -> S::f32s {
        self.1
    }

    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(self.0, self.0.max_f32s(self.1, other.1))
    }

    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(self.0, self.0.min_f32s(self.1, other.1))
    }

    #[inline(always)]
    pub fn is_below(self, other: Self) -> Choice<S> {
        Choice(self.0, self.0.less_than_f32s(self.1, other.1))
    }

    /// self + a b
    #[inline(always)]
    pub fn plus(self, a: Self, b: Self) -> Self {
        Self(self.0, self.0.mul_add_e_f32s(a.1, b.1, self.1))
    }

    /// Of the bits of each number, those of `bits`.
    #[inline(always)]
    fn bits(self, bits: u32) -> S::u32s {
        let simd = self.0;
        simd.and_u32s(simd.transmute_u32s_f32s(self.1), simd.splat_u32s(bits))
    }

    /// Whether `bit` of each number is set.
    #[inline(always)]
    pub fn has(self, bit: u32) -> Choice<S> {
        let bits = self.bits(bit);
        Choice(self.0, self.0.equal_u32s(bits, self.0.splat_u32s(bit)))
    }

    /// The numbers with the bits of `mask` replaced by `bit` where chosen, or by none.
    #[inline(always)]
    pub fn with(self, mask: u32, [(bit, so), (other, other_so)]: [(u32, Choice<S>); 2]) -> Self {
        let simd = self.0;
        let none = simd.splat_u32s(0);
        let bits = simd.select_u32s(so.1, simd.splat_u32s(bit), none);
        let others = simd.select_u32s(other_so.1, simd.splat_u32s(other), none);
        let rest = self.bits(!mask);
        let numbers = simd.or_u32s(rest, simd.or_u32s(bits, others));
        Self(simd, simd.transmute_f32s_u32s(numbers))
    }

    #[inline(always)]
    pub fn total(self) -> f64 {
        f64::from(self.0.reduce_sum_f32s(self.1))
    }

    #[inline(always)]
    pub fn highest(self) -> f32 {
        self.0.reduce_max_f32s(self.1)
    }

    #[inline(always)]
    pub fn lowest(self) -> f32 {
        self.0.reduce_min_f32s(self.1)
    }
}

impl<S: Simd> Choice<S> {
    #[inline(always)]
    pub fn choose(self, yes: Lanes<S>, no: Lanes<S>) -> Lanes<S> {
        Lanes(self.0, self.0.select_f32s(self.1, yes.1, no.1))
    }

    #[inline(always)]
    pub fn or_zero(self, yes: Lanes<S>) -> Lanes<S> {
        self.choose(yes, Lanes::all(self.0, 0.0))
    }
}

impl<S: Simd> BitOr for Choice<S> {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0, self.0.or_m32s(self.1, other.1))
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0, self.0.add_f32s(self.1, other.1))
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0, self.0.sub_f32s(self.1, other.1))
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0, self.0.mul_f32s(self.1, other.1))
    }
}

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0, self.0.neg_f32s(self.1))
    }
}

/// One or zero.
#[inline(always)]
pub fn weight<T: Real>(counts: bool) -> T {
    T::from(u8::from(counts))
}

#[inline(always)]
pub fn greater<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// Σ a, in the precision of its terms.
#[inline(always)]
pub fn total<T: Real>(a: &[T]) -> f64 {
    sum_by(a, a, |a, _| a)
}

/// Σ term(a, b), in the precision of the term.
#[inline(always)]
pub fn sum_by<A: Copy, B: Copy, T: Real>(a: &[A], b: &[B], term: impl Fn(A, B) -> T) -> f64 {
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut partial = [T::zero(); LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            partial[lane] = partial[lane] + term(a[lane], b[lane]);
        }
    }
    for (lane, (a, b)) in a_rest.iter().zip(b_rest).enumerate() {
        partial[lane] = partial[lane] + term(*a, *b);
    }
    partial.into_iter().map(Into::into).sum()
}
