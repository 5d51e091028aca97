//! Arithmetic on rows that compilers turn into vector instructions, and whose order is fixed.
//!
//! Sums run in [`LANES`] interleaved partial sums, and masks multiply instead of branching. Wider
//! registers change the speed and no bit of the result.

use pulp::{Arch, Simd, WithSimd};

use crate::contact::fft::{Real, Rows};

/// Partial sums of a row: the widest register, in single precision.
pub const LANES: usize = 16;

/// Work on a row. A trait and not a closure, since `#[inline(always)]` is heeded only here.
pub trait Work {
    type Output;
    /// Gains by [`wide`] only if it, and all that it calls, is `#[inline(always)]`.
    fn run(self) -> Self::Output;
}

/// Runs `work`, compiled for the widest registers that the processor has.
#[inline(always)]
pub fn wide<W: Work>(work: W) -> W::Output {
    Arch::new().dispatch(Run(work))
}

struct Run<W>(W);

impl<W: Work> WithSimd for Run<W> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> W::Output {
        self.0.run()
    }
}

/// Rows whose arithmetic is [`wide`].
pub struct Wide<'a, R>(pub &'a mut R);

impl<T, R: Rows<T>> Rows<T> for Wide<'_, R> {
    fn fill(&mut self, row: usize, values: &mut [T]) {
        wide(Fill(self.0, row, values));
    }

    fn take(&mut self, row: usize, values: &mut [T]) {
        wide(Take(self.0, row, values));
    }
}

struct Fill<'a, T, R>(&'a mut R, usize, &'a mut [T]);

impl<T, R: Rows<T>> Work for Fill<'_, T, R> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.0.fill(self.1, self.2);
    }
}

struct Take<'a, T, R>(&'a mut R, usize, &'a mut [T]);

impl<T, R: Rows<T>> Work for Take<'_, T, R> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.0.take(self.1, self.2);
    }
}

/// One or zero.
#[inline(always)]
pub fn weight<T: Real>(counts: bool) -> T {
    T::from(u8::from(counts))
}

/// One of two finite numbers, without the branch that a compiler would make of a choice.
#[inline(always)]
pub fn either<T: Real>(first: bool, a: T, b: T) -> T {
    let weight = weight::<T>(first);
    weight * a + (T::one() - weight) * b
}

#[inline(always)]
pub fn greater<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

#[inline(always)]
pub fn lesser<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// Σ a b, in the precision of its terms.
#[inline(always)]
pub fn dot<T: Real>(a: &[T], b: &[T]) -> f64 {
    sum_by(a, b, |a, b| a * b)
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
