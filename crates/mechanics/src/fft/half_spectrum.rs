//! Transforms of any mesh, with realfft for rows and rustfft for columns.

use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use super::rows::Aligned;
use super::{Band, ROW_BATCH, Real, Row, Rows, Sink, Source, Stored, cut, cut_pairs};
use crate::threads::{Threads, Workers};

/// Number of columns that are copied to a tile and transformed together. Their entries in one row
/// fill one cache line in single precision or two in double precision, so every byte of a fetched
/// line is used. A tile fits into the second-level cache.
const TILE_COLUMNS: usize = 8;

pub struct HalfSpectrum<T> {
    nodes: [usize; 2],
    /// Number of rows of the convolved maps. The other rows of the mesh are zero and are not
    /// transformed.
    filled_rows: usize,
    row_forward: Arc<dyn RealToComplex<T>>,
    row_inverse: Arc<dyn ComplexToReal<T>>,
    column_forward: Arc<dyn Fft<T>>,
    column_inverse: Arc<dyn Fft<T>>,
}

pub struct Scratch<T> {
    /// Half spectrum of the mesh, allocated by the first convolution.
    spectrum: Vec<Complex<T>>,
    buffers: Vec<Buffers<T>>,
}

impl<T> Scratch<T> {
    /// Frees the spectrum. The convolution in progress is lost; the next one allocates it again.
    pub fn release(&mut self) {
        self.spectrum = Vec::new();
    }
}

struct Buffers<T> {
    row: Vec<T>,
    tile: Vec<Complex<T>>,
    butterflies: Vec<Complex<T>>,
}

/// Consecutive columns of a half spectrum that one thread transforms.
struct ColumnShare<'a, T> {
    first: usize,
    /// The entries of these columns in each row of the spectrum.
    rows: Vec<&'a mut [Complex<T>]>,
    /// Numbers that `action` of [`HalfSpectrum::transform_columns`] has appended.
    found: Vec<f64>,
}

/// Returns the factors of a kernel, with the factor of the wave (k_x, k_y) at index `|k_y| * (N_x/2
/// + 1) + |k_x|`.
///
/// `factors(k_y, column)` writes the factors for k_x = 0, 1, …, N_x/2 to `column`.
pub fn kernel<T: Real>(nodes: [usize; 2], factors: impl Fn(usize, &mut [f64])) -> Aligned<T> {
    let [waves_x, waves_y] = nodes.map(|nodes| nodes / 2 + 1);
    let mut column = vec![0.0; waves_x];
    let mut kernel = Aligned::zeros(waves_x * waves_y);
    for (k_y, kernel) in kernel.chunks_exact_mut(waves_x).enumerate() {
        factors(k_y, &mut column);
        for (value, factor) in kernel.iter_mut().zip(&column) {
            *value = T::nearest(*factor);
        }
    }
    kernel
}

impl<T: Real> HalfSpectrum<T> {
    /// Plans the transforms of a mesh in which maps fill the first `filled_rows` rows.
    pub fn new(filled_rows: usize, nodes: [usize; 2]) -> Self {
        let [column_length, row_length] = nodes;
        let mut real = RealFftPlanner::new();
        let mut complex = FftPlanner::new();
        Self {
            nodes,
            filled_rows,
            row_forward: real.plan_fft_forward(row_length),
            row_inverse: real.plan_fft_inverse(row_length),
            column_forward: complex.plan_fft_forward(column_length),
            column_inverse: complex.plan_fft_inverse(column_length),
        }
    }

    pub fn columns(&self) -> usize {
        self.nodes[1] / 2 + 1
    }

    pub fn len(&self) -> usize {
        self.nodes[0] * self.columns()
    }

    /// Splits a half spectrum into the rows below `filled_rows` and the other rows.
    fn split<'a>(&self, spectrum: &'a mut [Complex<T>]) -> [&'a mut [Complex<T>]; 2] {
        spectrum.split_at_mut(self.filled_rows * self.columns()).into()
    }

    fn row(&self, index: usize) -> Row {
        Row::new(index, self.nodes[1])
    }

    pub fn scratch(&self) -> Scratch<T> {
        Scratch { spectrum: Vec::new(), buffers: Vec::new() }
    }

    fn buffers(&self) -> Buffers<T> {
        let butterflies = [
            self.row_forward.get_scratch_len(),
            self.row_inverse.get_scratch_len(),
            self.column_forward.get_inplace_scratch_len(),
            self.column_inverse.get_inplace_scratch_len(),
        ];
        let longest = butterflies.into_iter().max().unwrap_or(0);
        Buffers {
            row: vec![T::zero(); self.nodes[1]],
            tile: vec![Complex::default(); (TILE_COLUMNS * self.nodes[0]).max(self.columns())],
            butterflies: vec![Complex::default(); longest],
        }
    }

    pub fn forward(
        &self,
        field: &[T],
        spectrum: &mut [Complex<T>],
        threads: &Threads,
        scratch: &mut Scratch<T>,
    ) {
        let buffers = &mut scratch.buffers;
        let rows = &mut Source(field);
        self.pass_over(Stored::Nothing, Stored::Spectra, rows, spectrum, threads, buffers);
        self.transform_columns(spectrum, threads, buffers, |tile, _, butterflies, _| {
            self.column_forward.process_with_scratch(tile, butterflies);
        });
    }

    pub fn inverse(
        &self,
        spectrum: &mut [Complex<T>],
        field: &mut [T],
        threads: &Threads,
        scratch: &mut Scratch<T>,
    ) {
        let buffers = &mut scratch.buffers;
        self.transform_columns(spectrum, threads, buffers, |tile, _, butterflies, _| {
            self.column_inverse.process_with_scratch(tile, butterflies);
        });
        let rows = &mut Sink(Band::new(field));
        self.pass_over(Stored::Spectra, Stored::Nothing, rows, spectrum, threads, buffers);
    }

    /// Reads each filled row from the half spectrum in the form `from`, passes it to `rows`, and
    /// writes it back in the form `to`.
    pub fn pass(
        &self,
        from: Stored,
        to: Stored,
        rows: &mut impl Rows<T>,
        threads: &Threads,
        scratch: &mut Scratch<T>,
    ) {
        let Scratch { spectrum, buffers } = scratch;
        spectrum.resize(self.len(), Complex::default());
        let [filled, zeros] = self.split(spectrum);
        self.pass_over(from, to, rows, filled, threads, buffers);
        if to == Stored::Spectra {
            zeros.fill(Complex::default());
        }
    }

    /// Multiplies the spectrum in `scratch` by a kernel, one tile of columns at a time. Returns Σ f
    /// (k∗f) over the nodes, with the map f and the kernel k.
    pub fn multiply(&self, kernel: &[T], threads: &Threads, scratch: &mut Scratch<T>) -> f64 {
        let [nodes_x, nodes_y] = self.nodes;
        let Scratch { spectrum, buffers } = scratch;
        let multiply = |tile: &mut [Complex<T>],
                        first: usize,
                        butterflies: &mut [Complex<T>],
                        found: &mut Vec<f64>| {
            self.column_forward.process_with_scratch(tile, butterflies);
            let columns = (first..).zip(kernel.chunks_exact(nodes_x / 2 + 1).skip(first));
            for (column, (k_y, symbol)) in tile.chunks_exact_mut(nodes_x).zip(columns) {
                // All columns except the lowest and the Nyquist column also represent the opposite
                // wavenumbers.
                let alone = k_y == 0 || 2 * k_y == nodes_y;
                found.push(multiply_by_even(column, symbol) * if alone { 1.0 } else { 2.0 });
            }
            self.column_inverse.process_with_scratch(tile, butterflies);
        };
        let found = self.transform_columns(spectrum, threads, buffers, multiply);
        found.into_iter().fold(0.0, |sum, found| sum + found)
    }

    fn pass_over(
        &self,
        from: Stored,
        to: Stored,
        rows: &mut impl Rows<T>,
        spectrum: &mut [Complex<T>],
        threads: &Threads,
        buffers: &mut Vec<Buffers<T>>,
    ) {
        let count = spectrum.len() / self.columns();
        let workers = threads.workers(count * self.nodes[1]);
        let blocks = workers.cuts(count.div_ceil(ROW_BATCH)).into_iter();
        let firsts: Vec<usize> = blocks.map(|block| ROW_BATCH * block).collect();
        let parts = cut(rows, &firsts, self.nodes[1]);
        let mut rest = spectrum;
        let mut blocks = Vec::with_capacity(firsts.len());
        let ends = firsts[1..].iter().copied().chain([count]);
        for ((&first, end), rows) in firsts.iter().zip(ends).zip(parts) {
            let own;
            (own, rest) = rest.split_at_mut((end - first) * self.columns());
            blocks.push((first, own, rows));
        }
        workers.for_each(
            buffers,
            || self.buffers(),
            &mut blocks,
            |buffers, (first, halves, rows)| {
                let Buffers { row: values, butterflies, .. } = buffers;
                for (row, half) in (*first..).zip(halves.chunks_exact_mut(self.columns())) {
                    match from {
                        Stored::Nothing => (),
                        Stored::Rows => unpack(half, values),
                        Stored::Spectra => self.inverse_row(half, values, butterflies),
                    }
                    rows.row(self.row(row), values);
                    match to {
                        Stored::Nothing => (),
                        Stored::Rows => pack(values, half),
                        Stored::Spectra => self.forward_row(values, half, butterflies),
                    }
                }
            },
        );
        for (_, _, part) in blocks {
            rows.append(part);
        }
    }

    pub fn peek(
        &self,
        from: Stored,
        pairs: &[usize],
        rows: &mut impl Rows<T>,
        threads: &Threads,
        scratch: &mut Scratch<T>,
    ) {
        let Scratch { spectrum, buffers } = scratch;
        let workers = threads.workers(2 * pairs.len() * self.nodes[1]);
        let (parts, pairs) = cut_pairs(rows, pairs, &workers, self.nodes[1]);
        let mut blocks: Vec<_> = parts.into_iter().zip(pairs).collect();
        let look = |buffers: &mut Buffers<T>, (rows, pairs): &mut (_, &[usize])| {
            for row in pairs.iter().flat_map(|pair| [2 * pair, 2 * pair + 1]) {
                let Some(half) = spectrum.chunks_exact(self.columns()).nth(row) else {
                    return;
                };
                if from == Stored::Rows {
                    unpack(half, &mut buffers.row);
                } else {
                    let copy = &mut buffers.tile[..half.len()];
                    copy.copy_from_slice(half);
                    self.inverse_row(copy, &mut buffers.row, &mut buffers.butterflies);
                }
                Rows::row(rows, self.row(row), &mut buffers.row);
            }
        };
        workers.for_each(buffers, || self.buffers(), &mut blocks, look);
        for (part, _) in blocks {
            rows.append(part);
        }
    }

    fn forward_row(&self, row: &mut [T], half: &mut [Complex<T>], butterflies: &mut [Complex<T>]) {
        self.row_forward
            .process_with_scratch(row, half, butterflies)
            .expect("buffers are sized by the plan");
    }

    fn inverse_row(&self, half: &mut [Complex<T>], row: &mut [T], butterflies: &mut [Complex<T>]) {
        // The imaginary part is zero for a real map, except for rounding. realfft requires an exact
        // zero.
        half[0].im = T::zero();
        if row.len().is_multiple_of(2) {
            half[row.len() / 2].im = T::zero();
        }
        self.row_inverse
            .process_with_scratch(half, row, butterflies)
            .expect("buffers are sized by the plan");
    }

    /// Transforms all columns of `spectrum` in place with `action`, one tile of columns at a time.
    ///
    /// Each tile is copied to a buffer in which columns are contiguous, and copied back afterwards.
    /// The arguments of `action` are the tile, the index of its first column, a buffer, and a list
    /// to which it may append numbers. Returns these numbers in the order of the columns.
    fn transform_columns(
        &self,
        spectrum: &mut [Complex<T>],
        threads: &Threads,
        buffers: &mut Vec<Buffers<T>>,
        action: impl Fn(&mut [Complex<T>], usize, &mut [Complex<T>], &mut Vec<f64>) + Sync,
    ) -> Vec<f64> {
        let nodes = self.nodes[0];
        let workers = threads.workers(spectrum.len());
        let mut shares = self.cut_columns(spectrum, &workers);
        let transform = |buffers: &mut Buffers<T>, share: &mut ColumnShare<T>| {
            let columns = share.rows[0].len();
            for start in (0..columns).step_by(TILE_COLUMNS) {
                let width = TILE_COLUMNS.min(columns - start);
                let tile = &mut buffers.tile[..width * nodes];
                for (i, row) in share.rows.iter().enumerate() {
                    for (j, value) in row[start..][..width].iter().enumerate() {
                        tile[j * nodes + i] = *value;
                    }
                }
                let first = share.first + start;
                action(tile, first, &mut buffers.butterflies, &mut share.found);
                for (i, row) in share.rows.iter_mut().enumerate() {
                    for (j, value) in row[start..][..width].iter_mut().enumerate() {
                        *value = tile[j * nodes + i];
                    }
                }
            }
        };
        workers.for_each(buffers, || self.buffers(), &mut shares, transform);
        shares.into_iter().flat_map(|share| share.found).collect()
    }

    /// Divides the columns of a half spectrum into blocks of whole tiles, for the threads of
    /// `workers`.
    fn cut_columns<'a>(
        &self,
        spectrum: &'a mut [Complex<T>],
        workers: &Workers,
    ) -> Vec<ColumnShare<'a, T>> {
        let columns = self.columns();
        let cuts = workers.cuts(columns.div_ceil(TILE_COLUMNS)).into_iter();
        let firsts: Vec<usize> = cuts.map(|tile| tile * TILE_COLUMNS).collect();
        let ends: Vec<usize> = firsts[1..].iter().copied().chain([columns]).collect();
        let mut shares: Vec<ColumnShare<T>> = firsts
            .iter()
            .map(|&first| ColumnShare {
                first,
                rows: Vec::with_capacity(self.nodes[0]),
                found: Vec::new(),
            })
            .collect();
        for mut row in spectrum.chunks_exact_mut(columns) {
            for (share, end) in shares.iter_mut().zip(&ends) {
                let own;
                (own, row) = row.split_at_mut(end - share.first);
                share.rows.push(own);
            }
        }
        shares
    }
}

/// Stores the numbers of `row`, not transformed, in the memory of its half spectrum.
fn pack<T: Real>(row: &[T], half: &mut [Complex<T>]) {
    for (values, kept) in row.chunks(2).zip(half) {
        *kept = Complex::new(values[0], values.get(1).copied().unwrap_or_default());
    }
}

fn unpack<T: Real>(half: &[Complex<T>], row: &mut [T]) {
    for (values, kept) in row.chunks_mut(2).zip(half) {
        values[0] = kept.re;
        if let [_, second] = values {
            *second = kept.im;
        }
    }
}

/// Multiplies a column ĥ(k), in the order k = 0, 1, …, −2, −1, by the factors K(|k|) in `symbol`.
///
/// Returns Σ K(|k|) |ĥ(k)|², with ĥ before the multiplication.
fn multiply_by_even<T: Real>(column: &mut [Complex<T>], symbol: &[T]) -> f64 {
    let (positive, negative) = column.split_at_mut(symbol.len());
    let first_half = positive.iter_mut().zip(symbol);
    let waves = first_half.chain(negative.iter_mut().rev().zip(&symbol[1..]));
    let mut sum = 0.0;
    for (value, factor) in waves {
        let product = value.norm_sqr() * *factor;
        sum += product.into();
        *value = *value * *factor;
    }
    sum
}
