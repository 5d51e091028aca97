//! Transforms of any mesh: rows by realfft, columns by rustfft.

use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner, num_complex::Complex};

use super::aligned::Aligned;
use super::{Real, Row, Rows};

/// Columns transformed together: one cache line of single precision or two of double, so that no
/// line is fetched in vain, and a tile that stays in the second-level cache.
const TILE_COLUMNS: usize = 8;

/// Plans of one mesh.
pub struct HalfSpectrum<T> {
    nodes: [usize; 2],
    /// Rows of the maps that are convolved: beyond these there are zeros, which no row transform is
    /// spent on.
    filled_rows: usize,
    row_forward: Arc<dyn RealToComplex<T>>,
    row_inverse: Arc<dyn ComplexToReal<T>>,
    column_forward: Arc<dyn Fft<T>>,
    column_inverse: Arc<dyn Fft<T>>,
}

pub struct Scratch<T> {
    row: Vec<T>,
    tile: Vec<Complex<T>>,
    butterflies: Vec<Complex<T>>,
    /// A whole half spectrum, grown by the first convolution.
    spectrum: Vec<Complex<T>>,
}

/// The factors of a convolution as [`HalfSpectrum::multiply`] reads them: (|k_x|, |k_y|) at
/// `|k_y| * (N_x/2 + 1) + |k_x|`.
pub fn kernel<T: Real>(nodes: [usize; 2], factor: impl Fn(usize, usize) -> f64) -> Aligned<T> {
    let [waves_x, waves_y] = nodes.map(|nodes| nodes / 2 + 1);
    (0..waves_x * waves_y)
        .map(|index| T::nearest(factor(index % waves_x, index / waves_x)))
        .collect()
}

impl<T: Real> HalfSpectrum<T> {
    /// For maps of so many rows, on a mesh of no fewer.
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

    /// Wavenumbers kept along a row.
    pub fn columns(&self) -> usize {
        self.nodes[1] / 2 + 1
    }

    /// Entries of a half spectrum.
    pub fn len(&self) -> usize {
        self.nodes[0] * self.columns()
    }

    /// A half spectrum's filled rows, and the others.
    fn split<'a>(&self, spectrum: &'a mut [Complex<T>]) -> [&'a mut [Complex<T>]; 2] {
        spectrum
            .split_at_mut(self.filled_rows * self.columns())
            .into()
    }

    fn row(&self, index: usize) -> Row {
        Row::new(index, self.nodes[1])
    }

    pub fn scratch(&self) -> Scratch<T> {
        let butterflies = [
            self.row_forward.get_scratch_len(),
            self.row_inverse.get_scratch_len(),
            self.column_forward.get_inplace_scratch_len(),
            self.column_inverse.get_inplace_scratch_len(),
        ];
        let longest = butterflies.into_iter().max().unwrap_or(0);
        Scratch {
            row: vec![T::zero(); self.nodes[1]],
            tile: vec![Complex::default(); (TILE_COLUMNS * self.nodes[0]).max(self.columns())],
            butterflies: vec![Complex::default(); longest],
            spectrum: Vec::new(),
        }
    }

    pub fn forward(&self, field: &[T], spectrum: &mut [Complex<T>], scratch: &mut Scratch<T>) {
        self.forward_rows(spectrum, scratch, |i, row| {
            row.copy_from_slice(self.row(i).of(field));
        });
        self.transform_columns(spectrum, scratch, |tile, _, butterflies| {
            self.column_forward.process_with_scratch(tile, butterflies);
        });
    }

    pub fn inverse(&self, spectrum: &mut [Complex<T>], field: &mut [T], scratch: &mut Scratch<T>) {
        self.transform_columns(spectrum, scratch, |tile, _, butterflies| {
            self.column_inverse.process_with_scratch(tile, butterflies);
        });
        self.inverse_rows(spectrum, scratch, |i, row| {
            self.row(i).of_mut(field).copy_from_slice(row);
        });
    }

    pub fn begin(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        let mut spectrum = std::mem::take(&mut scratch.spectrum);
        spectrum.resize(self.len(), Complex::default());
        let [filled, zeros] = self.split(&mut spectrum);
        self.forward_rows(filled, scratch, |i, row| rows.row(self.row(i), row));
        zeros.fill(Complex::default());
        scratch.spectrum = spectrum;
    }

    /// Forward, multiply, inverse, one tile of columns at a time.
    pub fn multiply(&self, kernel: &[T], scratch: &mut Scratch<T>) -> f64 {
        let [nodes_x, nodes_y] = self.nodes;
        let mut spectrum = std::mem::take(&mut scratch.spectrum);
        let mut sum = 0.0;
        self.transform_columns(&mut spectrum, scratch, |tile, first, butterflies| {
            self.column_forward.process_with_scratch(tile, butterflies);
            let columns = (first..).zip(kernel.chunks_exact(nodes_x / 2 + 1).skip(first));
            for (column, (k_y, symbol)) in tile.chunks_exact_mut(nodes_x).zip(columns) {
                // All but the lowest and the Nyquist column stand for their opposites too.
                let alone = k_y == 0 || 2 * k_y == nodes_y;
                sum += multiply_by_even(column, symbol) * if alone { 1.0 } else { 2.0 };
            }
            self.column_inverse.process_with_scratch(tile, butterflies);
        });
        scratch.spectrum = spectrum;
        sum
    }

    pub fn turn(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        let mut spectrum = std::mem::take(&mut scratch.spectrum);
        let [filled, zeros] = self.split(&mut spectrum);
        zeros.fill(Complex::default());
        for (i, row) in filled.chunks_exact_mut(self.columns()).enumerate() {
            self.inverse_row(row, &mut scratch.row, &mut scratch.butterflies);
            rows.row(self.row(i), &mut scratch.row);
            self.forward_row(&mut scratch.row, row, &mut scratch.butterflies);
        }
        scratch.spectrum = spectrum;
    }

    pub fn finish(&self, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        let mut spectrum = std::mem::take(&mut scratch.spectrum);
        let [filled, _] = self.split(&mut spectrum);
        self.inverse_rows(filled, scratch, |i, row| rows.row(self.row(i), row));
        scratch.spectrum = spectrum;
    }

    pub fn peek(&self, pair: usize, rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        for row in [2 * pair, 2 * pair + 1] {
            let Some(half) = scratch.spectrum.chunks_exact(self.columns()).nth(row) else {
                return;
            };
            let copy = &mut scratch.tile[..half.len()];
            copy.copy_from_slice(half);
            self.inverse_row(copy, &mut scratch.row, &mut scratch.butterflies);
            rows.row(self.row(row), &mut scratch.row);
        }
    }

    fn forward_rows(
        &self,
        spectrum: &mut [Complex<T>],
        scratch: &mut Scratch<T>,
        mut read: impl FnMut(usize, &mut [T]),
    ) {
        for (i, out) in spectrum.chunks_exact_mut(self.columns()).enumerate() {
            read(i, &mut scratch.row);
            self.forward_row(&mut scratch.row, out, &mut scratch.butterflies);
        }
    }

    fn inverse_rows(
        &self,
        spectrum: &mut [Complex<T>],
        scratch: &mut Scratch<T>,
        mut write: impl FnMut(usize, &mut [T]),
    ) {
        for (i, row) in spectrum.chunks_exact_mut(self.columns()).enumerate() {
            self.inverse_row(row, &mut scratch.row, &mut scratch.butterflies);
            write(i, &mut scratch.row);
        }
    }

    fn forward_row(&self, row: &mut [T], half: &mut [Complex<T>], butterflies: &mut [Complex<T>]) {
        self.row_forward
            .process_with_scratch(row, half, butterflies)
            .expect("buffers are sized by the plan");
    }

    fn inverse_row(&self, half: &mut [Complex<T>], row: &mut [T], butterflies: &mut [Complex<T>]) {
        // Zero for a real map, but for rounding; the complex-to-real plan insists.
        half[0].im = T::zero();
        if row.len().is_multiple_of(2) {
            half[row.len() / 2].im = T::zero();
        }
        self.row_inverse
            .process_with_scratch(half, row, butterflies)
            .expect("buffers are sized by the plan");
    }

    /// Gathers tile after tile of columns, lets `action(tile, first column, butterflies)` change
    /// them, and scatters them back. Columns are contiguous in the tile.
    fn transform_columns(
        &self,
        spectrum: &mut [Complex<T>],
        scratch: &mut Scratch<T>,
        mut action: impl FnMut(&mut [Complex<T>], usize, &mut [Complex<T>]),
    ) {
        let (nodes, columns) = (self.nodes[0], self.columns());
        for first in (0..columns).step_by(TILE_COLUMNS) {
            let width = TILE_COLUMNS.min(columns - first);
            let tile = &mut scratch.tile[..width * nodes];
            for (i, row) in spectrum.chunks_exact(columns).enumerate() {
                for (j, value) in row[first..][..width].iter().enumerate() {
                    tile[j * nodes + i] = *value;
                }
            }
            action(tile, first, &mut scratch.butterflies);
            for (i, row) in spectrum.chunks_exact_mut(columns).enumerate() {
                for (j, value) in row[first..][..width].iter_mut().enumerate() {
                    *value = tile[j * nodes + i];
                }
            }
        }
    }
}

/// Multiplies wavenumbers 0, 1, …, −1 by the symbol of their magnitude. Returns the sum of what they
/// were times what they are.
fn multiply_by_even<T: Real>(column: &mut [Complex<T>], symbol: &[T]) -> f64 {
    let (positive, negative) = column.split_at_mut(symbol.len());
    let positive = positive.iter_mut().zip(symbol);
    let waves = positive.chain(negative.iter_mut().rev().zip(&symbol[1..]));
    let mut sum = 0.0;
    for (value, factor) in waves {
        let product = value.norm_sqr() * *factor;
        sum += product.into();
        *value = *value * *factor;
    }
    sum
}
