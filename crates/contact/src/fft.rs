//! Real transforms of a periodic map, and the convolution that never writes its spectrum back.
//!
//! A map of N_x × N_y nodes is row-major, node (i, j) at `i * N_y + j`. Its spectrum keeps the
//! non-negative half of the wavenumbers along a row: with M = N_y/2 + 1 columns, entry (i, j) at
//! `i * M + j` is
//!
//! ĥ(k_x, k_y) = Σ h(i, j) exp(−2πi (k_x i/N_x + k_y j/N_y)), k_x = i or i − N_x, k_y = j,
//!
//! and the other half follows from ĥ(−k) = ĥ(k)*. Neither direction is normalised: forward then
//! inverse multiplies by N_x N_y.
//!
//! `half_spectrum` does all this on any mesh, with rustfft. A sweep of loads is little else than
//! convolutions, so these have a second way, `packed`, which takes half the time on meshes of
//! 2^a·3^b·5^c nodes a side with enough twos, and rounds alike whatever the processor's
//! `registers`.
//!
//! Maps may be a corner of a larger mesh, padded by zeros (`rows`).
//!
//! A convolution is begun by writing rows, multiplied, and finished by reading rows. Where the
//! result of one makes the map of the next, row by row, both happen in one turn, and memory is
//! passed over once. Where all rows have to be seen before the first can be replaced, they are kept
//! in place of their spectra, and not transformed twice. [`Threads`] share all this: rows and
//! columns by blocks.

use rustfft::FftNum;
use rustfft::num_complex::Complex;

use super::instructions::Instructions;
use super::threads::Threads;

mod half_spectrum;
mod packed;
mod registers;
mod rows;

pub(crate) use rows::in_corner;
pub use rows::{Band, Row, see_pairs};

use half_spectrum::HalfSpectrum;
use packed::Packed;
use registers::Vectorize;
use rows::{Aligned, Padded, cut, cut_pairs};

/// Single or double precision.
pub trait Real: FftNum + Default + PartialOrd + From<u8> + Into<f64> + Vectorize {
    /// The nearest number of this precision.
    fn nearest(value: f64) -> Self;
}

impl Real for f32 {
    fn nearest(value: f64) -> Self {
        value as Self
    }
}

impl Real for f64 {
    fn nearest(value: f64) -> Self {
        value
    }
}

/// Rows that one thread has together: threads part at multiples of them.
pub const ROWS_TOGETHER: usize = 8;

/// What a convolution in progress has of the rows of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Held {
    Nothing,
    /// The rows themselves,
    Rows,
    /// or their spectra.
    Spectra,
}

/// What a pass over a map does with its rows.
///
/// Masks, casts and sums done here cost no pass over memory of their own.
///
/// Threads share it: each has some consecutive rows.
pub trait Rows<T>: Sized + Send {
    /// Writes a row of a map, reads it, or replaces it by that of another one; called once per row,
    /// in ascending order.
    fn row(&mut self, row: Row, values: &mut [T]);

    /// Keeps the rows before one, an even one, and hands on the others. Nothing was seen yet. Where
    /// all rows are seen, the one is a multiple of [`ROWS_TOGETHER`], or there are no others.
    fn split_off(&mut self, row: Row) -> Self;

    /// Takes back what was split off last, when all its rows were seen.
    fn append(&mut self, later: Self);
}

/// Planned transforms of one mesh in one precision; cheap to share, since buffers are the caller's.
pub struct Transform<T> {
    /// Nodes of the maps that are convolved: all, or a corner of them.
    map: [usize; 2],
    nodes: [usize; 2],
    half_spectrum: HalfSpectrum<T>,
    packed: Option<Packed<T>>,
}

/// What a [`Transform`] writes on the way, a convolution in progress among it, and the threads that
/// work on it.
pub struct Scratch<T> {
    threads: Threads,
    half_spectrum: half_spectrum::Scratch<T>,
    packed: Option<packed::Scratch<T>>,
}

/// An even convolution on one mesh, as a factor for each wavenumber, in the order in which
/// [`Transform::convolve`] needs them.
pub struct Kernel<T> {
    nodes: [usize; 2],
    factors: Aligned<T>,
}

impl<T: Real> Kernel<T> {
    /// The convolution that multiplies the wave (k_x, k_y) by `factor(|k_x|, |k_y|)`, for these up
    /// to N_x/2 and N_y/2.
    pub fn new(nodes: [usize; 2], factor: impl Fn(usize, usize) -> f64 + Sync) -> Self {
        Self::of_columns(&Threads::one(), nodes, |k_y, factors| {
            for (k_x, value) in factors.iter_mut().enumerate() {
                *value = factor(k_x, k_y);
            }
        })
    }

    /// The same, of which `factors` sets those of one |k_y| and |k_x| = 0, 1, …, N_x/2, made by
    /// several threads.
    pub fn of_columns(
        threads: &Threads,
        nodes: [usize; 2],
        factors: impl Fn(usize, &mut [f64]) + Sync,
    ) -> Self {
        // What two unnormalised transforms leave.
        let normalisation = 1.0 / (nodes[0] as f64 * nodes[1] as f64);
        let normalised = |k_y: usize, column: &mut [f64]| {
            factors(k_y, column);
            for factor in column {
                *factor *= normalisation;
            }
        };
        let factors = match plan_packed(nodes[0], nodes) {
            Some(packed) => packed.kernel(threads, normalised),
            None => half_spectrum::kernel(nodes, normalised),
        };
        Self { nodes, factors }
    }
}

fn plan_packed<T: Real>(rows: usize, nodes: [usize; 2]) -> Option<Packed<T>> {
    Packed::new(rows, nodes, Instructions::in_use())
}

impl<T: Real> Transform<T> {
    /// Plans the transforms of a mesh of N_x × N_y nodes: any numbers from 1, primes included.
    pub fn new(nodes: [usize; 2]) -> Self {
        Self::padded(nodes, nodes)
    }

    /// Plans convolutions of maps of the first size, continued by zeros on a mesh of the second: of
    /// four times the nodes, say, at three times the cost, since no row beyond a map's is
    /// transformed.
    pub fn padded(map: [usize; 2], nodes: [usize; 2]) -> Self {
        assert!(map[0] * map[1] > 0, "a mesh has at least one node");
        assert!(map[0] <= nodes[0] && map[1] <= nodes[1], "padding adds");
        Self {
            map,
            nodes,
            half_spectrum: HalfSpectrum::new(map[0], nodes),
            packed: plan_packed(map[0], nodes),
        }
    }

    /// Nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    fn count(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    /// Wavenumbers kept along a row, N_y/2 + 1.
    pub(crate) fn spectrum_columns(&self) -> usize {
        self.half_spectrum.columns()
    }

    /// Entries of a half spectrum, N_x (N_y/2 + 1).
    pub(crate) fn spectrum_len(&self) -> usize {
        self.half_spectrum.len()
    }

    /// Buffers for one caller at a time, on one thread.
    pub fn scratch(&self) -> Scratch<T> {
        self.scratch_on(Threads::one())
    }

    /// Buffers for one caller at a time, whose work these threads share.
    pub(crate) fn scratch_on(&self, threads: Threads) -> Scratch<T> {
        Scratch {
            threads,
            half_spectrum: self.half_spectrum.scratch(),
            packed: self.packed.as_ref().map(Packed::scratch),
        }
    }

    /// Transforms a map into its half spectrum, unnormalised.
    pub fn forward(&self, field: &[T], spectrum: &mut [Complex<T>], scratch: &mut Scratch<T>) {
        assert_eq!(field.len(), self.count());
        assert_eq!(spectrum.len(), self.spectrum_len());
        let Scratch { threads, half_spectrum, .. } = scratch;
        self.half_spectrum.forward(field, spectrum, threads, half_spectrum);
    }

    /// Transforms a half spectrum into a map, unnormalised; the spectrum is destroyed.
    pub fn inverse(&self, spectrum: &mut [Complex<T>], field: &mut [T], scratch: &mut Scratch<T>) {
        assert_eq!(field.len(), self.count());
        assert_eq!(spectrum.len(), self.spectrum_len());
        let Scratch { threads, half_spectrum, .. } = scratch;
        self.half_spectrum.inverse(spectrum, field, threads, half_spectrum);
    }

    /// Convolves a map with a kernel.
    pub fn convolve(
        &self,
        kernel: &Kernel<T>,
        field: &[T],
        out: &mut [T],
        scratch: &mut Scratch<T>,
    ) {
        let count = self.map[0] * self.map[1];
        assert_eq!((field.len(), out.len()), (count, count));
        self.begin_with(field, scratch);
        self.multiply(kernel, scratch);
        self.finish(&mut Sink(Band::of(out)), scratch);
    }

    /// Begins a convolution of the map whose rows are written.
    pub fn begin(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.pass(Held::Nothing, Held::Spectra, rows, scratch);
    }

    /// Begins the convolution of a map.
    pub(crate) fn begin_with(&self, field: &[T], scratch: &mut Scratch<T>) {
        self.begin(&mut Source(field), scratch);
    }

    /// Goes on with a convolution: forward, multiply, inverse, a few columns at a time. Returns the
    /// sum of map × convolved map.
    pub fn multiply(&self, kernel: &Kernel<T>, scratch: &mut Scratch<T>) -> f64 {
        assert_eq!(kernel.nodes, self.nodes, "a kernel is made for one mesh");
        let factors = &kernel.factors;
        match self.way(scratch) {
            Way::Packed(packed, threads, scratch) => packed.multiply(factors, threads, scratch),
            Way::HalfSpectrum(plain, threads, scratch) => plain.multiply(factors, threads, scratch),
        }
    }

    /// Ends a convolution, whose rows are read, and begins that of the map by which they are
    /// replaced.
    pub fn turn(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.pass(Held::Spectra, Held::Spectra, rows, scratch);
    }

    /// Ends a convolution, whose rows are read.
    pub fn finish(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.pass(Held::Spectra, Held::Nothing, rows, scratch);
    }

    /// Ends a convolution, whose rows are read, and keeps the map by which they are replaced.
    pub(crate) fn finish_and_keep(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.pass(Held::Spectra, Held::Rows, rows, scratch);
    }

    /// Reads the rows of a map that was kept, and begins the convolution of the map by which they
    /// are replaced.
    pub(crate) fn turn_kept(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.pass(Held::Rows, Held::Spectra, rows, scratch);
    }

    /// Reads the rows of a map that was kept.
    pub(crate) fn finish_kept(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.pass(Held::Rows, Held::Nothing, rows, scratch);
    }

    /// Reads, for each of these pairs, rows 2 `pair` and, if there is one, 2 `pair` + 1 of a
    /// convolution about to end. Pairs ascend.
    pub fn peek(&self, pairs: &[usize], rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.peek_at(Held::Spectra, pairs, rows, scratch);
    }

    /// The same of a map that was kept.
    pub(crate) fn peek_kept(
        &self,
        pairs: &[usize],
        rows: &mut impl Rows<T>,
        scratch: &mut Scratch<T>,
    ) {
        self.peek_at(Held::Rows, pairs, rows, scratch);
    }

    /// Goes over all rows, of which there is one thing before and another one after.
    fn pass(&self, from: Held, to: Held, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.padded_rows(rows, |rows| match self.way(scratch) {
            Way::Packed(packed, threads, scratch) => packed.pass(from, to, rows, threads, scratch),
            Way::HalfSpectrum(plain, threads, scratch) => {
                plain.pass(from, to, rows, threads, scratch);
            }
        });
    }

    fn peek_at(
        &self,
        from: Held,
        pairs: &[usize],
        rows: &mut impl Rows<T>,
        scratch: &mut Scratch<T>,
    ) {
        self.padded_rows(rows, |rows| match self.way(scratch) {
            Way::Packed(packed, threads, scratch) => {
                packed.peek(from, pairs, rows, threads, scratch);
            }
            Way::HalfSpectrum(plain, threads, scratch) => {
                plain.peek(from, pairs, rows, threads, scratch);
            }
        });
    }

    /// Lets rows of maps be seen as rows of the whole mesh.
    fn padded_rows<P: Rows<T>>(&self, rows: &mut P, see: impl FnOnce(&mut Padded<P>)) {
        in_corner(self.map, rows, see);
    }

    fn way<'a>(&'a self, scratch: &'a mut Scratch<T>) -> Way<'a, T> {
        let threads = &scratch.threads;
        match (&self.packed, &mut scratch.packed) {
            (Some(packed), Some(scratch)) => Way::Packed(packed, threads, scratch),
            _ => Way::HalfSpectrum(&self.half_spectrum, threads, &mut scratch.half_spectrum),
        }
    }
}

/// How a mesh is convolved.
enum Way<'a, T> {
    Packed(&'a Packed<T>, &'a Threads, &'a mut packed::Scratch<T>),
    HalfSpectrum(&'a HalfSpectrum<T>, &'a Threads, &'a mut half_spectrum::Scratch<T>),
}

impl<T: Real> Scratch<T> {
    /// Takes over memory of another one, whose convolution in progress is lost: for convolutions of
    /// both precisions in turn.
    pub(crate) fn take_over<U>(&mut self, other: &mut Scratch<U>) {
        other.half_spectrum.release();
        if let (Some(own), Some(other)) = (&mut self.packed, &mut other.packed) {
            own.take_over(other);
        }
    }
}

impl<T> Scratch<T> {
    /// Lets these threads share the work from now on.
    pub fn work_on(&mut self, threads: Threads) {
        self.threads = threads;
    }
}

/// Rows of a map to convolve.
struct Source<'a, T>(&'a [T]);

impl<T: Real> Rows<T> for Source<'_, T> {
    fn row(&mut self, row: Row, values: &mut [T]) {
        values.copy_from_slice(row.of(self.0));
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self(self.0)
    }

    fn append(&mut self, _: Self) {}
}

/// Rows of a convolved map.
struct Sink<'a, T>(Band<'a, T>);

impl<T: Real> Rows<T> for Sink<'_, T> {
    fn row(&mut self, row: Row, values: &mut [T]) {
        self.0.row(row).copy_from_slice(values);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self(self.0.split_off(row))
    }

    fn append(&mut self, _: Self) {}
}

#[cfg(test)]
mod tests;
