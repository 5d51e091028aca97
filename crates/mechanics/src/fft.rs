//! Real Fourier transforms of periodic maps, and convolutions.
//!
//! A map of N_x × N_y nodes is row-major, with node (i, j) at index `i * N_y + j`. Its spectrum
//! contains the non-negative half of the wavenumbers along a row. With M = N_y/2 + 1 columns, its
//! entry at index `i * M + j` is
//!
//! ĥ(k_x, k_y) = Σ h(i, j) exp(−2πi (k_x i/N_x + k_y j/N_y)), k_x = i or i − N_x, k_y = j.
//!
//! The other half follows from ĥ(−k) = ĥ(k)*. Neither direction is normalised: a forward and an
//! inverse transform multiply a map by N_x N_y.
//!
//! There are two implementations. `half_spectrum` transforms any mesh with rustfft. `packed` only
//! convolves. It takes half the time, but requires meshes of 2^a·3^b·5^c nodes a side with enough
//! factors of two. It rounds alike on all vector `registers`. Convolutions take most of the time of
//! a series of loads.
//!
//! A map may be a corner of a larger mesh, padded with zeros (`rows`).
//!
//! A convolution begins with a pass that writes the rows of the map, multiplies the spectrum by the
//! kernel, and ends with a pass that reads the rows of the result. Rows may be stored in the memory
//! of their spectra, so that they need not be transformed twice. [`Threads`] share the work by
//! blocks of rows and of columns.

use rustfft::FftNum;
use rustfft::num_complex::Complex;

use super::instructions::Instructions;
use super::threads::Threads;

mod half_spectrum;
mod packed;
mod registers;
mod rows;

pub(crate) use rows::in_corner;
pub use rows::{Band, Row, visit_pairs};

use half_spectrum::HalfSpectrum;
use packed::Packed;
use registers::Vectorize;
use rows::{Aligned, Padded, cut, cut_pairs};

/// Floating-point number of single or double precision.
pub trait Real: FftNum + Default + PartialOrd + From<u8> + Into<f64> + Vectorize {
    /// Returns the number of this precision that is nearest to `value`.
    fn nearest(value: f64) -> Self;

    /// Returns self + a b, rounded once.
    fn plus_product(self, a: Self, b: Self) -> Self;
}

impl Real for f32 {
    fn nearest(value: f64) -> Self {
        value as Self
    }

    fn plus_product(self, a: Self, b: Self) -> Self {
        a.mul_add(b, self)
    }
}

impl Real for f64 {
    fn nearest(value: f64) -> Self {
        value
    }

    fn plus_product(self, a: Self, b: Self) -> Self {
        a.mul_add(b, self)
    }
}

/// Number of rows in a batch. Threads divide a map into whole batches.
pub const ROW_BATCH: usize = 8;

/// Content of the scratch memory during a convolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stored {
    Nothing,
    /// Rows of the map.
    Rows,
    /// Transforms of the rows.
    Spectra,
}

/// Pass over the rows of a map, which reads, writes or replaces them.
///
/// A pass can also apply a mask, convert the precision or compute sums, which saves further passes
/// over memory. Threads share a pass: each visits a range of consecutive rows.
pub trait Rows<T>: Sized + Send {
    /// Reads, writes or replaces `values`, one row of the map. Each thread visits its rows in
    /// ascending order.
    fn row(&mut self, row: Row, values: &mut [T]);

    /// Keeps the rows before `row`, and returns a pass over the other rows.
    ///
    /// This method is called before any row is visited. `row` is even or the end of the map. If the
    /// pass visits all rows, `row` is a multiple of [`ROW_BATCH`] or the end of the map.
    fn split_off(&mut self, row: Row) -> Self;

    /// Merges the results of `later`, a pass that [`split_off`](Self::split_off) has returned and
    /// that has visited its rows. Parts are merged in ascending order of their rows.
    fn append(&mut self, _later: Self) {}
}

/// Plan for the transforms and convolutions of one mesh in one precision.
///
/// Buffers are in a separate [`Scratch`], so several computations can share a plan.
pub struct Transform<T> {
    /// Numbers of nodes along x and y of the convolved maps. A map fills the mesh or a corner of
    /// it.
    map: [usize; 2],
    nodes: [usize; 2],
    half_spectrum: HalfSpectrum<T>,
    packed: Option<Packed<T>>,
}

/// Buffers of a [`Transform`], which contain the convolution in progress, and the threads that
/// share its work.
pub struct Scratch<T> {
    threads: Threads,
    half_spectrum: half_spectrum::Scratch<T>,
    packed: Option<packed::Scratch<T>>,
}

/// Even convolution kernel on one mesh: one real factor for each pair (|k_x|, |k_y|).
pub struct Kernel<T> {
    nodes: [usize; 2],
    factors: Aligned<T>,
}

impl<T: Real> Kernel<T> {
    /// Creates the kernel that multiplies the wave (k_x, k_y) by `factor(|k_x|, |k_y|)`, for |k_x|
    /// ≤ N_x/2 and |k_y| ≤ N_y/2.
    pub fn new(nodes: [usize; 2], factor: impl Fn(usize, usize) -> f64 + Sync) -> Self {
        Self::from_columns(&Threads::one(), nodes, |k_y, factors| {
            for (k_x, value) in factors.iter_mut().enumerate() {
                *value = factor(k_x, k_y);
            }
        })
    }

    /// Creates a kernel from columns of factors, which several threads compute.
    ///
    /// `factors(k_y, column)` writes the factors of the waves (k_x, k_y), k_x = 0, 1, …, N_x/2, to
    /// `column`.
    pub fn from_columns(
        threads: &Threads,
        nodes: [usize; 2],
        factors: impl Fn(usize, &mut [f64]) + Sync,
    ) -> Self {
        // A forward and an inverse transform multiply a map by the number of nodes.
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
    /// Plans the transforms of a mesh of N_x × N_y nodes. Both numbers may be any positive
    /// integers, including primes.
    pub fn new(nodes: [usize; 2]) -> Self {
        Self::padded(nodes, nodes)
    }

    /// Plans convolutions of maps of `map` nodes, padded with zeros to a mesh of `nodes`.
    ///
    /// A mesh of four times the nodes of the map takes only three times as long, because rows of
    /// zeros are not transformed.
    pub fn padded(map: [usize; 2], nodes: [usize; 2]) -> Self {
        assert!(map[0] * map[1] > 0, "a mesh has at least one node");
        assert!(
            map[0] <= nodes[0] && map[1] <= nodes[1],
            "the padded mesh is not smaller than the map"
        );
        Self {
            map,
            nodes,
            half_spectrum: HalfSpectrum::new(map[0], nodes),
            packed: plan_packed(map[0], nodes),
        }
    }

    /// Returns the numbers of nodes of the mesh along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    fn count(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    /// Returns the number of columns of a half spectrum, N_y/2 + 1.
    pub(crate) fn spectrum_columns(&self) -> usize {
        self.half_spectrum.columns()
    }

    /// Returns the number of entries of a half spectrum, N_x (N_y/2 + 1).
    pub(crate) fn spectrum_len(&self) -> usize {
        self.half_spectrum.len()
    }

    /// Creates buffers for transforms on one thread.
    pub fn scratch(&self) -> Scratch<T> {
        self.scratch_on(Threads::one())
    }

    /// Returns the spectrum of a field, see [`Transform::forward`].
    pub(crate) fn spectrum(&self, field: &[T]) -> Vec<Complex<T>> {
        let mut spectrum = vec![Complex::default(); self.spectrum_len()];
        self.forward(field, &mut spectrum, &mut self.scratch());
        spectrum
    }

    /// Returns the field of a spectrum, see [`Transform::inverse`].
    pub(crate) fn field(&self, mut spectrum: Vec<Complex<T>>) -> Vec<T> {
        let mut field = vec![T::zero(); self.count()];
        self.inverse(&mut spectrum, &mut field, &mut self.scratch());
        field
    }

    /// Creates buffers for transforms on the given threads.
    pub(crate) fn scratch_on(&self, threads: Threads) -> Scratch<T> {
        Scratch {
            threads,
            half_spectrum: self.half_spectrum.scratch(),
            packed: self.packed.as_ref().map(Packed::scratch),
        }
    }

    /// Computes the half spectrum ĥ of the map `field`, unnormalised, and writes it to `spectrum`.
    pub fn forward(&self, field: &[T], spectrum: &mut [Complex<T>], scratch: &mut Scratch<T>) {
        assert_eq!(field.len(), self.count());
        assert_eq!(spectrum.len(), self.spectrum_len());
        let Scratch { threads, half_spectrum, .. } = scratch;
        self.half_spectrum.forward(field, spectrum, threads, half_spectrum);
    }

    /// Computes the map of a half spectrum, unnormalised, and writes it to `field`. The content of
    /// `spectrum` is lost.
    pub fn inverse(&self, spectrum: &mut [Complex<T>], field: &mut [T], scratch: &mut Scratch<T>) {
        assert_eq!(field.len(), self.count());
        assert_eq!(spectrum.len(), self.spectrum_len());
        let Scratch { threads, half_spectrum, .. } = scratch;
        self.half_spectrum.inverse(spectrum, field, threads, half_spectrum);
    }

    /// Convolves the map `field` with a kernel and writes the result to `out`.
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
        self.finish(&mut Sink(Band::new(out)), scratch);
    }

    /// Begins a convolution: the pass `rows` writes the rows of the map, and their transforms are
    /// left in `scratch`.
    pub fn begin(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.pass(Stored::Nothing, Stored::Spectra, rows, scratch);
    }

    /// Begins the convolution of the map `field`, as [`begin`](Self::begin).
    pub(crate) fn begin_with(&self, field: &[T], scratch: &mut Scratch<T>) {
        self.begin(&mut Source(field), scratch);
    }

    /// Multiplies the spectrum that [`begin`](Self::begin) left in `scratch` by a kernel.
    ///
    /// A few columns at a time are transformed forward, multiplied and transformed back. Returns
    /// Σ f (k∗f) over the nodes, with the map f and the kernel k.
    pub fn multiply(&self, kernel: &Kernel<T>, scratch: &mut Scratch<T>) -> f64 {
        assert_eq!(kernel.nodes, self.nodes, "the kernel is for another mesh");
        let factors = &kernel.factors;
        match self.method(scratch) {
            Method::Packed(packed, threads, scratch) => packed.multiply(factors, threads, scratch),
            Method::HalfSpectrum(plain, threads, scratch) => {
                plain.multiply(factors, threads, scratch)
            }
        }
    }

    /// Ends a convolution and passes each row of the result to `rows`.
    pub fn finish(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        self.pass(Stored::Spectra, Stored::Nothing, rows, scratch);
    }

    /// Passes some rows in `scratch` to `rows`, as [`pass`](Self::pass) does, without writing them
    /// back. A convolution remains in progress.
    ///
    /// For each k in `pairs`, which must be ascending, these are the rows 2k and 2k + 1 (if it
    /// exists).
    pub(crate) fn peek(
        &self,
        from: Stored,
        pairs: &[usize],
        rows: &mut impl Rows<T>,
        scratch: &mut Scratch<T>,
    ) {
        self.padded_rows(rows, |rows| match self.method(scratch) {
            Method::Packed(packed, threads, scratch) => {
                packed.peek(from, pairs, rows, threads, scratch);
            }
            Method::HalfSpectrum(plain, threads, scratch) => {
                plain.peek(from, pairs, rows, threads, scratch);
            }
        });
    }

    /// Reads each row from `scratch` in the form `from`, passes it to `rows`, and writes it back in
    /// the form `to`.
    pub(crate) fn pass(
        &self,
        from: Stored,
        to: Stored,
        rows: &mut impl Rows<T>,
        scratch: &mut Scratch<T>,
    ) {
        self.padded_rows(rows, |rows| match self.method(scratch) {
            Method::Packed(packed, threads, scratch) => {
                packed.pass(from, to, rows, threads, scratch)
            }
            Method::HalfSpectrum(plain, threads, scratch) => {
                plain.pass(from, to, rows, threads, scratch);
            }
        });
    }

    /// Calls `visit` with `rows`, adapted from the map to the rows of the whole mesh.
    fn padded_rows<P: Rows<T>>(&self, rows: &mut P, visit: impl FnOnce(&mut Padded<P>)) {
        in_corner(self.map, rows, visit);
    }

    fn method<'a>(&'a self, scratch: &'a mut Scratch<T>) -> Method<'a, T> {
        let threads = &scratch.threads;
        match (&self.packed, &mut scratch.packed) {
            (Some(packed), Some(scratch)) => Method::Packed(packed, threads, scratch),
            _ => Method::HalfSpectrum(&self.half_spectrum, threads, &mut scratch.half_spectrum),
        }
    }
}

/// Implementation that convolves maps on this mesh, with the threads and its buffers.
enum Method<'a, T> {
    Packed(&'a Packed<T>, &'a Threads, &'a mut packed::Scratch<T>),
    HalfSpectrum(&'a HalfSpectrum<T>, &'a Threads, &'a mut half_spectrum::Scratch<T>),
}

impl<T: Real> Scratch<T> {
    /// Takes the memory of `other`, so that transforms of two precisions can share it. The
    /// convolutions in progress in both scratches are lost.
    pub(crate) fn take_over<U>(&mut self, other: &mut Scratch<U>) {
        other.half_spectrum.release();
        if let (Some(own), Some(other)) = (&mut self.packed, &mut other.packed) {
            own.take_over(other);
        }
    }
}

impl<T> Scratch<T> {
    /// Sets the threads that share the work.
    pub fn set_threads(&mut self, threads: Threads) {
        self.threads = threads;
    }
}

/// Pass that copies each row of a map into the convolution.
struct Source<'a, T>(&'a [T]);

impl<T: Real> Rows<T> for Source<'_, T> {
    fn row(&mut self, row: Row, values: &mut [T]) {
        values.copy_from_slice(row.of(self.0));
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self(self.0)
    }
}

/// Pass that copies each row of the result of a convolution to a map.
struct Sink<'a, T>(Band<'a, T>);

impl<T: Real> Rows<T> for Sink<'_, T> {
    fn row(&mut self, row: Row, values: &mut [T]) {
        self.0.row(row).copy_from_slice(values);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self(self.0.split_off(row))
    }
}

#[cfg(test)]
mod tests;
