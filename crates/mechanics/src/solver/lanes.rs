//! Arithmetic on rows, sixteen numbers at a time, in one or several registers.
//!
//! Sums have the same order on all processors: [`Lanes`] always holds sixteen numbers, in one or
//! several registers. Functions on registers are `#[inline(always)]` and contain no closures,
//! because only then are they compiled with the instructions of their [`Pass`].
//!
//! A sum of doubles depends on the order of its terms, so sums over the mesh are added up in the
//! order of its rows ([`InOrder`]). Each thread keeps a list with the sum of each of its rows. At
//! the end these are added, as if one thread had visited all rows.

use std::ops::{Add, BitAnd, BitOr, Mul, Neg, Range, Sub};

use pulp::{NullaryFnOnce, Scalar, Scalar512b, Simd};

use crate::fft::{Band, ROW_BATCH, Real, Row, Rows};
use crate::instructions::Instructions;
use crate::threads::Threads;

/// Number of values in [`Lanes`], and number of partial sums of a row.
pub const LANES: usize = 16;

/// Pass over the rows of a map, in which `R` registers hold sixteen numbers.
pub trait Pass<T>: Sized + Send {
    fn row<S: Simd, const R: usize>(&mut self, simd: S, row: Row, values: &mut [T]);

    fn split_off(&mut self, row: Row) -> Self;

    fn append(&mut self, _later: Self) {}
}

/// Adapter that runs a pass with the vector instructions in use.
pub struct Wide<P>(pub P);

impl<T, P: Pass<T>> Rows<T> for Wide<P> {
    fn row(&mut self, row: Row, values: &mut [T]) {
        let pass = &mut self.0;
        match Instructions::in_use() {
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(simd) => {
                simd.vectorize(Run::<_, _, _, 1>(pass, simd, row, values))
            }
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(simd) => simd.vectorize(Run::<_, _, _, 2>(pass, simd, row, values)),
            Instructions::Portable => pass.row::<_, 1>(Scalar512b, row, values),
        }
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self(self.0.split_off(row))
    }

    fn append(&mut self, later: Self) {
        self.0.append(later.0);
    }
}

struct Run<'a, P, T, S, const R: usize>(&'a mut P, S, Row, &'a mut [T]);

impl<P: Pass<T>, T, S: Simd, const R: usize> NullaryFnOnce for Run<'_, P, T, S, R> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.row::<S, R>(self.1, self.2, self.3);
    }
}

/// Runs a pass over the rows of a map with `nodes` nodes per row, on several threads.
pub fn over_rows<T: Send, P: Pass<T>>(
    threads: &Threads,
    map: &mut [T],
    nodes: usize,
    pass: &mut P,
) {
    let count = map.len() / nodes;
    let workers = threads.workers(map.len());
    let mut whole = Band::new(map);
    let mut blocks: Vec<(Range<usize>, Band<T>, Wide<P>)> = Vec::new();
    let mut end = count;
    for block in workers.cuts(count.div_ceil(ROW_BATCH)).into_iter().rev() {
        let first = Row::new(ROW_BATCH * block, nodes);
        blocks.push((first.index..end, whole.split_off(first), Wide(pass.split_off(first))));
        end = first.index;
    }
    workers.for_each(
        &mut Vec::new(),
        || (),
        &mut blocks,
        |(), (rows, band, pass)| {
            for row in rows.clone().map(|index| Row::new(index, nodes)) {
                pass.row(row, band.row(row));
            }
        },
    );
    for (.., part) in blocks.into_iter().rev() {
        pass.append(part.0);
    }
}

/// Calls `visit` on all rows of a map with `nodes` nodes per row, on several threads, and adds up
/// the results in the order of the rows.
///
/// Only a [`Pass`] is certain to be compiled with the vector instructions in use.
pub fn sum_rows<T: Send, A: Accumulate + Send>(
    threads: &Threads,
    map: &mut [T],
    nodes: usize,
    visit: impl Fn(Row, &mut [T]) -> A + Copy + Send,
) -> A {
    let push =
        move |found: &mut InOrder<A>, row: Row, values: &mut [T]| found.push(visit(row, values));
    for_rows_with(threads, map, nodes, InOrder::new(), push).total()
}

/// Calls `visit` on all rows as [`sum_rows`] does.
pub fn for_rows<T: Send>(
    threads: &Threads,
    map: &mut [T],
    nodes: usize,
    visit: impl Fn(Row, &mut [T]) + Copy + Send,
) {
    for_rows_with(threads, map, nodes, (), move |(): &mut (), row, values| visit(row, values));
}

/// Calls `visit` on all rows with the state of their thread, and returns the joined states.
pub fn for_rows_with<T: Send, S: Shared>(
    threads: &Threads,
    map: &mut [T],
    nodes: usize,
    state: S,
    visit: impl Fn(&mut S, Row, &mut [T]) + Copy + Send,
) -> S {
    let mut pass = Visit { state, visit };
    over_rows(threads, map, nodes, &mut pass);
    pass.state
}

/// Pass that calls a function with the state of the thread and a row.
pub struct Visit<S, F> {
    pub state: S,
    visit: F,
}

impl<S, F> Visit<S, F> {
    /// Returns the pass for a transform.
    pub fn rows<T>(state: S, visit: F) -> Wide<Self>
    where
        F: Fn(&mut S, Row, &mut [T]),
    {
        Wide(Self { state, visit })
    }
}

impl<T, P: Shared, F: Fn(&mut P, Row, &mut [T]) + Copy + Send> Pass<T> for Visit<P, F> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [T]) {
        (self.visit)(&mut self.state, row, values);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { state: self.state.split_off(row), visit: self.visit }
    }

    fn append(&mut self, later: Self) {
        self.state.append(later.state);
    }
}

/// State of a pass over rows that several threads share: maps that are written, buffers, and what
/// is collected.
pub trait Shared: Sized + Send {
    /// Splits off the state for the rows from `row` on.
    fn split_off(&mut self, row: Row) -> Self;

    fn append(&mut self, _later: Self) {}
}

impl Shared for () {
    fn split_off(&mut self, _: Row) {}
}

/// A buffer, whose content is not kept between rows.
impl Shared for Vec<f32> {
    fn split_off(&mut self, _: Row) -> Self {
        self.clone()
    }
}

impl<V: Send> Shared for Band<'_, V> {
    fn split_off(&mut self, row: Row) -> Self {
        Band::split_off(self, row)
    }
}

impl<A: Accumulate + Send> Shared for InOrder<A> {
    fn split_off(&mut self, _: Row) -> Self {
        Self::new()
    }

    fn append(&mut self, later: Self) {
        InOrder::append(self, later);
    }
}

impl<S: Shared, const N: usize> Shared for [S; N] {
    fn split_off(&mut self, row: Row) -> Self {
        self.each_mut().map(|part| part.split_off(row))
    }

    fn append(&mut self, later: Self) {
        self.iter_mut().zip(later).for_each(|(part, later)| part.append(later));
    }
}

impl<A: Shared, B: Shared> Shared for (A, B) {
    fn split_off(&mut self, row: Row) -> Self {
        (self.0.split_off(row), self.1.split_off(row))
    }

    fn append(&mut self, later: Self) {
        self.0.append(later.0);
        self.1.append(later.1);
    }
}

#[inline(always)]
pub fn split<S: Simd, const R: usize>(row: &[f32]) -> (&[[S::f32s; R]], &[[f32; 1]]) {
    let (whole, rest) = row.split_at(row.len() / LANES * LANES);
    (S::as_simd_f32s(whole).0.as_chunks().0, rest.as_chunks().0)
}

/// Splits a mutable row as [`split`] does.
#[inline(always)]
pub fn split_mut<S: Simd, const R: usize>(
    row: &mut [f32],
) -> (&mut [[S::f32s; R]], &mut [[f32; 1]]) {
    let (whole, rest) = row.split_at_mut(row.len() / LANES * LANES);
    (S::as_mut_simd_f32s(whole).0.as_chunks_mut().0, rest.as_chunks_mut().0)
}

/// Instructions for the single numbers at the end of a row.
pub const REST: Scalar = Scalar;

/// Sixteen numbers, or a single number at the end of a row.
#[derive(Clone, Copy)]
pub struct Lanes<S: Simd, const R: usize>(S, [S::f32s; R]);

/// Mask with true or false for each lane.
#[derive(Clone, Copy)]
pub struct Mask<S: Simd, const R: usize>(S, [S::m32s; R]);

impl<S: Simd, const R: usize> Lanes<S, R> {
    #[inline(always)]
    pub fn of(simd: S, numbers: [S::f32s; R]) -> Self {
        Self(simd, numbers)
    }

    #[inline(always)]
    pub fn all(simd: S, number: f32) -> Self {
        Self(simd, [simd.splat_f32s(number); R])
    }

    #[inline(always)]
    pub fn numbers(self) -> [S::f32s; R] {
        self.1
    }

    #[inline(always)]
    pub fn max(mut self, other: Self) -> Self {
        for i in 0..R {
            self.1[i] = self.0.max_f32s(self.1[i], other.1[i]);
        }
        self
    }

    #[inline(always)]
    pub fn min(mut self, other: Self) -> Self {
        for i in 0..R {
            self.1[i] = self.0.min_f32s(self.1[i], other.1[i]);
        }
        self
    }

    #[inline(always)]
    pub fn is_below(self, other: Self) -> Mask<S, R> {
        let mut below = self.none();
        for i in 0..R {
            below.1[i] = self.0.less_than_f32s(self.1[i], other.1[i]);
        }
        below
    }

    #[inline(always)]
    fn none(self) -> Mask<S, R> {
        let zero = self.0.splat_f32s(0.0);
        Mask(self.0, [self.0.less_than_f32s(zero, zero); R])
    }

    /// Returns self + a b, rounded once.
    #[inline(always)]
    pub fn plus(mut self, a: Self, b: Self) -> Self {
        for i in 0..R {
            self.1[i] = self.0.mul_add_f32s(a.1[i], b.1[i], self.1[i]);
        }
        self
    }

    /// Returns, for each number, whether `bit` is set in its representation.
    #[inline(always)]
    pub fn has(self, bit: u32) -> Mask<S, R> {
        let mut set = self.none();
        let bits = self.0.splat_u32s(bit);
        for i in 0..R {
            let found = self.0.and_u32s(self.0.transmute_u32s_f32s(self.1[i]), bits);
            set.1[i] = self.0.equal_u32s(found, bits);
        }
        set
    }

    /// Clears the bits of `mask` in all lanes, and sets each bit of `bits` in the lanes in which
    /// the mask next to it is true.
    #[inline(always)]
    pub fn with<const B: usize>(mut self, mask: u32, bits: [(u32, Mask<S, R>); B]) -> Self {
        let simd = self.0;
        let (none, rest) = (simd.splat_u32s(0), simd.splat_u32s(!mask));
        for i in 0..R {
            let mut numbers = simd.and_u32s(simd.transmute_u32s_f32s(self.1[i]), rest);
            for (bit, so) in bits {
                let bit = simd.select_u32s(so.1[i], simd.splat_u32s(bit), none);
                numbers = simd.or_u32s(numbers, bit);
            }
            self.1[i] = simd.transmute_f32s_u32s(numbers);
        }
        self
    }

    /// Returns the sum of all lanes. Adds numbers eight lanes apart, then four, two and one.
    #[inline(always)]
    pub fn total(mut self) -> f64 {
        let mut registers = R;
        while registers > 1 {
            registers /= 2;
            for i in 0..registers {
                self.1[i] = self.0.add_f32s(self.1[i], self.1[i + registers]);
            }
        }
        f64::from(self.0.reduce_sum_f32s(self.1[0]))
    }

    #[inline(always)]
    pub fn highest(self) -> f32 {
        let mut highest = self.1[0];
        for register in self.1 {
            highest = self.0.max_f32s(highest, register);
        }
        self.0.reduce_max_f32s(highest)
    }

    #[inline(always)]
    pub fn lowest(self) -> f32 {
        let mut lowest = self.1[0];
        for register in self.1 {
            lowest = self.0.min_f32s(lowest, register);
        }
        self.0.reduce_min_f32s(lowest)
    }
}

impl<S: Simd, const R: usize> Mask<S, R> {
    #[inline(always)]
    pub fn choose(self, mut yes: Lanes<S, R>, no: Lanes<S, R>) -> Lanes<S, R> {
        for i in 0..R {
            yes.1[i] = self.0.select_f32s(self.1[i], yes.1[i], no.1[i]);
        }
        yes
    }

    #[inline(always)]
    pub fn or_zero(self, yes: Lanes<S, R>) -> Lanes<S, R> {
        self.choose(yes, Lanes::all(self.0, 0.0))
    }

    /// Returns whether the mask is true in any lane.
    #[inline(always)]
    pub fn any(self) -> bool {
        let mut any = self.1[0];
        for i in 1..R {
            any = self.0.or_m32s(any, self.1[i]);
        }
        if const { size_of::<S::m32s>() < size_of::<S::f32s>() } {
            return self.0.first_true_m32s(any) < S::F32_LANES;
        }
        let (one, zero) = (self.0.splat_f32s(1.0), self.0.splat_f32s(0.0));
        let ones = self.0.select_f32s(any, one, zero);
        self.0.reduce_max_f32s(ones) > 0.0
    }

    /// Clears the lanes that are true in `other`.
    #[inline(always)]
    pub fn unless(mut self, other: Self) -> Self {
        for i in 0..R {
            let both = self.0.and_m32s(self.1[i], other.1[i]);
            self.1[i] = self.0.xor_m32s(self.1[i], both);
        }
        self
    }
}

/// Implements operators of [`Lanes`] and [`Mask`] register by register.
macro_rules! operators {
    ($($operator:ident::$method:ident for $numbers:ident: $on_registers:ident;)+) => {$(
        impl<S: Simd, const R: usize> $operator for $numbers<S, R> {
            type Output = Self;

            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for i in 0..R {
                    self.1[i] = self.0.$on_registers(self.1[i], other.1[i]);
                }
                self
            }
        }
    )+};
}

operators! {
    BitAnd::bitand for Mask: and_m32s;
    BitOr::bitor for Mask: or_m32s;
    Add::add for Lanes: add_f32s;
    Sub::sub for Lanes: sub_f32s;
    Mul::mul for Lanes: mul_f32s;
}

impl<S: Simd, const R: usize> Neg for Lanes<S, R> {
    type Output = Self;

    #[inline(always)]
    fn neg(mut self) -> Self {
        for i in 0..R {
            self.1[i] = self.0.neg_f32s(self.1[i]);
        }
        self
    }
}

#[inline(always)]
pub fn weight<T: Real>(counts: bool) -> T {
    T::from(u8::from(counts))
}

#[inline(always)]
pub fn greater<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

pub fn highest_of(row: &[f64]) -> f64 {
    highest_by(row, |number| number)
}

/// Returns the highest `value` of the numbers of a row, or −∞ of an empty one.
pub fn highest_by(row: &[f64], value: impl Fn(f64) -> f64) -> f64 {
    let mut highest = [f64::NEG_INFINITY; LANES];
    for chunk in row.chunks(LANES) {
        for (highest, number) in highest.iter_mut().zip(chunk) {
            *highest = greater(*highest, value(*number));
        }
    }
    highest.into_iter().fold(f64::NEG_INFINITY, greater)
}

/// Returns the sum of `a`, with sixteen partial sums in the precision of the terms.
#[inline(always)]
pub fn total<T: Real>(a: &[T]) -> f64 {
    sum_by(a, a, |a, _| a)
}

/// Returns Σ term(a, b), with sixteen partial sums in the precision of the terms.
#[inline(always)]
pub fn sum_by<A: Copy, B: Copy, T: Real>(a: &[A], b: &[B], term: impl Fn(A, B) -> T) -> f64 {
    sum_over_groups(std::iter::repeat(&true), a, b, term)
}

/// Returns Σ term(a, b) over the groups of sixteen neighbours that are true in `groups`, and over
/// the last numbers, which do not fill a group.
#[inline(always)]
pub fn sum_over_groups<'a, A: Copy, B: Copy, T: Real>(
    groups: impl IntoIterator<Item = &'a bool>,
    a: &[A],
    b: &[B],
    term: impl Fn(A, B) -> T,
) -> f64 {
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut partial = [T::zero(); LANES];
    for ((a, b), counts) in a.iter().zip(b).zip(groups) {
        if !counts {
            continue;
        }
        for lane in 0..LANES {
            partial[lane] = partial[lane] + term(a[lane], b[lane]);
        }
    }
    for (lane, (a, b)) in a_rest.iter().zip(b_rest).enumerate() {
        partial[lane] = partial[lane] + term(*a, *b);
    }
    partial.into_iter().map(Into::into).sum()
}

/// Result that is accumulated over the rows of the mesh, from its default on.
pub trait Accumulate: Copy + Default {
    fn add(&mut self, later: Self);
}

impl Accumulate for f64 {
    fn add(&mut self, later: Self) {
        *self += later;
    }
}

/// Sums and maxima over the mesh.
#[derive(Debug, Clone, Copy)]
pub struct Totals<const K: usize, const H: usize> {
    pub sums: [f64; K],
    pub highest: [f64; H],
}

impl<const K: usize, const H: usize> Default for Totals<K, H> {
    fn default() -> Self {
        Self { sums: [0.0; K], highest: [f64::NEG_INFINITY; H] }
    }
}

impl<const K: usize, const H: usize> Accumulate for Totals<K, H> {
    fn add(&mut self, later: Self) {
        for k in 0..K {
            self.sums[k] += later.sums[k];
        }
        for h in 0..H {
            self.highest[h] = greater(self.highest[h], later.highest[h]);
        }
    }
}

/// Results of single rows, in the order of the rows, so that their total does not depend on the
/// number of threads.
pub struct InOrder<F>(Vec<F>);

impl<F: Accumulate> InOrder<F> {
    pub fn new() -> Self {
        Self(Vec::new())
    }

    pub fn push(&mut self, found: F) {
        self.0.push(found);
    }

    pub fn append(&mut self, mut later: Self) {
        self.0.append(&mut later.0);
    }

    pub fn total(&self) -> F {
        self.0.iter().fold(F::default(), |mut total, found| {
            total.add(*found);
            total
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_do_not_depend_on_the_split_between_threads() {
        // Any other order rounds differently.
        let terms = [1.0, 1e16, -1e16, 3.0, 1e-3];
        let one_by_one = terms.iter().fold(0.0, |sum, term| sum + term);
        for cut in 0..=terms.len() {
            let (mut first, mut last) = (InOrder::new(), InOrder::new());
            terms[..cut].iter().for_each(|term| first.push(*term));
            terms[cut..].iter().for_each(|term| last.push(*term));
            first.append(last);
            assert_eq!(first.total(), one_by_one);
        }
        assert_eq!(InOrder::<f64>::new().total(), 0.0);
    }
}
