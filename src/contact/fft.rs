//! Real transforms of a periodic square map, and the convolution that never writes its spectrum back.
//!
//! A map is row-major, node (i, j) at `i * nodes + j`. Its spectrum keeps the non-negative half of
//! the wavenumbers along a row: with M = N/2 + 1 columns, entry (i, j) at `i * M + j` is
//!
//! ĥ(k_x, k_y) = Σ h(x, y) exp(−2πi (k_x x + k_y y)/N), k_x = i or i − N, k_y = j,
//!
//! and the other half follows from ĥ(−k) = ĥ(k)*. Neither direction is normalised: forward then
//! inverse multiplies by N².

use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftNum, FftPlanner, num_complex::Complex};

/// Columns transformed together: one cache line of single precision or two of double, so that no
/// line is fetched in vain, and a tile that stays in the second-level cache.
const TILE_COLUMNS: usize = 8;

/// Single or double precision.
pub trait Real: FftNum + Default + PartialOrd + From<u8> + Into<f64> {
    /// The largest finite number.
    const MAX: Self;
}

impl Real for f32 {
    const MAX: Self = Self::MAX;
}

impl Real for f64 {
    const MAX: Self = Self::MAX;
}

/// What goes into a convolution and what becomes of its result, row by row.
///
/// Masks, casts and sums done here cost no pass over memory of their own.
pub trait Rows<T> {
    /// Writes row `row` of the map to convolve; called once per row, in ascending order.
    fn fill(&mut self, row: usize, values: &mut [T]);
    /// Reads row `row` of the convolved map, and may overwrite it; called once per row, in ascending
    /// order, after all rows have been filled.
    fn take(&mut self, row: usize, values: &mut [T]);
}

/// Planned transforms of one mesh in one precision; cheap to share, since buffers are the caller's.
pub struct Transform<T> {
    nodes: usize,
    row_forward: Arc<dyn RealToComplex<T>>,
    row_inverse: Arc<dyn ComplexToReal<T>>,
    column_forward: Arc<dyn Fft<T>>,
    column_inverse: Arc<dyn Fft<T>>,
}

/// What a [`Transform`] writes on the way; any contents will do.
pub struct Scratch<T> {
    row: Vec<T>,
    tile: Vec<Complex<T>>,
    butterflies: Vec<Complex<T>>,
    /// A whole half spectrum, grown by the first convolution.
    spectrum: Vec<Complex<T>>,
}

impl<T: Real> Transform<T> {
    /// Plans the transforms of a mesh of `nodes` × `nodes`: any number from 1, primes included.
    pub fn new(nodes: usize) -> Self {
        assert!(nodes > 0, "a mesh has at least one node");
        let mut real = RealFftPlanner::new();
        let mut complex = FftPlanner::new();
        Self {
            nodes,
            row_forward: real.plan_fft_forward(nodes),
            row_inverse: real.plan_fft_inverse(nodes),
            column_forward: complex.plan_fft_forward(nodes),
            column_inverse: complex.plan_fft_inverse(nodes),
        }
    }

    /// Nodes per side.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Wavenumbers kept along a row, N/2 + 1.
    pub fn spectrum_columns(&self) -> usize {
        self.nodes / 2 + 1
    }

    /// Entries of a half spectrum, N (N/2 + 1).
    pub fn spectrum_len(&self) -> usize {
        self.nodes * self.spectrum_columns()
    }

    /// Entries of a kernel, (N/2 + 1)²: see [`Transform::convolve`].
    pub fn kernel_len(&self) -> usize {
        self.spectrum_columns() * self.spectrum_columns()
    }

    /// Buffers for one caller at a time.
    pub fn scratch(&self) -> Scratch<T> {
        let butterflies = [
            self.row_forward.get_scratch_len(),
            self.row_inverse.get_scratch_len(),
            self.column_forward.get_inplace_scratch_len(),
            self.column_inverse.get_inplace_scratch_len(),
        ];
        let longest = butterflies.into_iter().max().unwrap_or(0);
        Scratch {
            row: vec![T::zero(); self.nodes],
            tile: vec![Complex::default(); TILE_COLUMNS * self.nodes],
            butterflies: vec![Complex::default(); longest],
            spectrum: Vec::new(),
        }
    }

    /// Transforms a map of N² values into its half spectrum, unnormalised.
    pub fn forward(&self, field: &[T], spectrum: &mut [Complex<T>], scratch: &mut Scratch<T>) {
        assert_eq!(field.len(), self.nodes * self.nodes);
        self.forward_rows(spectrum, scratch, |i, row| {
            row.copy_from_slice(&field[i * self.nodes..][..self.nodes]);
        });
        self.transform_columns(spectrum, scratch, |tile, _, butterflies| {
            self.column_forward.process_with_scratch(tile, butterflies);
        });
    }

    /// Transforms a half spectrum into N² values, unnormalised; the spectrum is destroyed.
    pub fn inverse(&self, spectrum: &mut [Complex<T>], field: &mut [T], scratch: &mut Scratch<T>) {
        assert_eq!(field.len(), self.nodes * self.nodes);
        self.transform_columns(spectrum, scratch, |tile, _, butterflies| {
            self.column_inverse.process_with_scratch(tile, butterflies);
        });
        self.inverse_rows(spectrum, scratch, |i, row| {
            field[i * self.nodes..][..self.nodes].copy_from_slice(row);
        });
    }

    /// Convolves a map with an even kernel: forward, multiply, inverse, one tile of columns at a time.
    ///
    /// The kernel is real and even in both wavenumbers, so only |k_x|, |k_y| ≤ N/2 are stored, at
    /// `|k_y| * (N/2 + 1) + |k_x|`. Nothing is normalised here: a kernel that should act as its
    /// symbol carries the factor 1/N².
    pub fn convolve(&self, kernel: &[T], field: &[T], out: &mut [T], scratch: &mut Scratch<T>) {
        let (nodes, cells) = (self.nodes, self.nodes * self.nodes);
        assert_eq!((field.len(), out.len()), (cells, cells));
        self.convolve_rows(kernel, &mut Maps { nodes, field, out }, scratch);
    }

    /// The convolution of [`Transform::convolve`], of rows that its user fills and takes.
    pub fn convolve_rows(&self, kernel: &[T], rows: &mut impl Rows<T>, scratch: &mut Scratch<T>) {
        assert_eq!(kernel.len(), self.kernel_len());
        let mut spectrum = std::mem::take(&mut scratch.spectrum);
        spectrum.resize(self.spectrum_len(), Complex::default());
        self.forward_rows(&mut spectrum, scratch, |i, row| rows.fill(i, row));
        self.transform_columns(&mut spectrum, scratch, |tile, first, butterflies| {
            self.column_forward.process_with_scratch(tile, butterflies);
            let columns = kernel.chunks_exact(self.spectrum_columns()).skip(first);
            for (column, symbol) in tile.chunks_exact_mut(self.nodes).zip(columns) {
                multiply_by_even(column, symbol);
            }
            self.column_inverse.process_with_scratch(tile, butterflies);
        });
        self.inverse_rows(&mut spectrum, scratch, |i, row| rows.take(i, row));
        scratch.spectrum = spectrum;
    }

    fn forward_rows(
        &self,
        spectrum: &mut [Complex<T>],
        scratch: &mut Scratch<T>,
        mut read: impl FnMut(usize, &mut [T]),
    ) {
        assert_eq!(spectrum.len(), self.spectrum_len());
        for (i, out) in spectrum
            .chunks_exact_mut(self.spectrum_columns())
            .enumerate()
        {
            read(i, &mut scratch.row);
            self.row_forward
                .process_with_scratch(&mut scratch.row, out, &mut scratch.butterflies)
                .expect("buffers are sized by the plan");
        }
    }

    fn inverse_rows(
        &self,
        spectrum: &mut [Complex<T>],
        scratch: &mut Scratch<T>,
        mut write: impl FnMut(usize, &mut [T]),
    ) {
        assert_eq!(spectrum.len(), self.spectrum_len());
        for (i, row) in spectrum
            .chunks_exact_mut(self.spectrum_columns())
            .enumerate()
        {
            // Zero for a real map, but for rounding; the complex-to-real plan insists.
            row[0].im = T::zero();
            if self.nodes.is_multiple_of(2) {
                row[self.nodes / 2].im = T::zero();
            }
            self.row_inverse
                .process_with_scratch(row, &mut scratch.row, &mut scratch.butterflies)
                .expect("buffers are sized by the plan");
            write(i, &mut scratch.row);
        }
    }

    /// Gathers tile after tile of columns, lets `action(tile, first column, butterflies)` change
    /// them, and scatters them back. Columns are contiguous in the tile.
    fn transform_columns(
        &self,
        spectrum: &mut [Complex<T>],
        scratch: &mut Scratch<T>,
        mut action: impl FnMut(&mut [Complex<T>], usize, &mut [Complex<T>]),
    ) {
        let (nodes, columns) = (self.nodes, self.spectrum_columns());
        assert_eq!(spectrum.len(), self.spectrum_len());
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

/// Rows of whole maps, for a convolution that does nothing on the way.
struct Maps<'a, T> {
    nodes: usize,
    field: &'a [T],
    out: &'a mut [T],
}

impl<T: Real> Rows<T> for Maps<'_, T> {
    fn fill(&mut self, row: usize, values: &mut [T]) {
        values.copy_from_slice(&self.field[row * self.nodes..][..self.nodes]);
    }

    fn take(&mut self, row: usize, values: &mut [T]) {
        self.out[row * self.nodes..][..self.nodes].copy_from_slice(values);
    }
}

/// Multiplies wavenumbers 0, 1, …, −1 by the symbol of their magnitude.
fn multiply_by_even<T: Real>(column: &mut [Complex<T>], symbol: &[T]) {
    let (positive, negative) = column.split_at_mut(symbol.len());
    for (value, factor) in positive.iter_mut().zip(symbol) {
        *value = *value * *factor;
    }
    for (value, factor) in negative.iter_mut().rev().zip(&symbol[1..]) {
        *value = *value * *factor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Odd, even, prime, and wider than one tile of columns.
    const MESHES: [usize; 8] = [1, 2, 3, 4, 7, 8, 13, 36];

    fn map(nodes: usize) -> Vec<f64> {
        let mut state = 12345_u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..nodes * nodes).map(|_| draw()).collect()
    }

    fn naive(map: &[f64], nodes: usize) -> Vec<Complex<f64>> {
        let columns = nodes / 2 + 1;
        let entry = |index: usize| {
            let (k_x, k_y) = (index / columns, index % columns);
            let term = |node: usize| {
                let turns = (k_x * (node / nodes) + k_y * (node % nodes)) % nodes;
                Complex::from_polar(map[node], -TAU * turns as f64 / nodes as f64)
            };
            (0..nodes * nodes).map(term).sum()
        };
        (0..nodes * columns).map(entry).collect()
    }

    /// An even kernel without further symmetry, so that swapped axes show.
    fn kernel(transform: &Transform<f64>) -> Vec<f64> {
        let columns = transform.spectrum_columns();
        (0..transform.kernel_len())
            .map(|index| 1.0 / (1.0 + (index / columns) as f64 + 0.3 * (index % columns) as f64))
            .collect()
    }

    #[test]
    fn forward_is_the_fourier_sum() {
        for nodes in MESHES {
            let (map, transform) = (map(nodes), Transform::new(nodes));
            let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
            transform.forward(&map, &mut spectrum, &mut transform.scratch());
            for (fast, slow) in spectrum.iter().zip(naive(&map, nodes)) {
                // The naive sum itself rounds N² terms of order one.
                assert!(
                    (fast - slow).norm() < 1e-12,
                    "{nodes}: {fast} against {slow}"
                );
            }
        }
    }

    #[test]
    fn inverse_undoes_forward_up_to_the_number_of_nodes() {
        for nodes in MESHES {
            let (map, transform) = (map(nodes), Transform::new(nodes));
            let mut scratch = transform.scratch();
            let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
            let mut back = vec![0.0; nodes * nodes];
            transform.forward(&map, &mut spectrum, &mut scratch);
            transform.inverse(&mut spectrum, &mut back, &mut scratch);
            for (value, back) in map.iter().zip(back) {
                assert!((value - back / (nodes * nodes) as f64).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn power_is_the_same_in_space_and_in_the_spectrum() {
        for nodes in MESHES {
            let (map, transform) = (map(nodes), Transform::new(nodes));
            let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
            transform.forward(&map, &mut spectrum, &mut transform.scratch());
            let columns = transform.spectrum_columns();
            let power: f64 = spectrum
                .iter()
                .enumerate()
                .map(|(index, value)| {
                    let alone = [0, nodes - index % columns].contains(&(index % columns));
                    value.norm_sqr() * if alone { 1.0 } else { 2.0 }
                })
                .sum();
            let in_space: f64 = map.iter().map(|value| value * value).sum();
            let in_spectrum = power / (nodes * nodes) as f64;
            assert!((in_space - in_spectrum).abs() < 1e-13 * in_space, "{nodes}");
        }
    }

    #[test]
    fn convolution_is_forward_times_kernel_then_inverse() {
        for nodes in MESHES {
            let (map, transform) = (map(nodes), Transform::new(nodes));
            let (kernel, mut scratch) = (kernel(&transform), transform.scratch());
            let mut fused = vec![0.0; nodes * nodes];
            transform.convolve(&kernel, &map, &mut fused, &mut scratch);

            let columns = transform.spectrum_columns();
            let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
            transform.forward(&map, &mut spectrum, &mut scratch);
            for (index, value) in spectrum.iter_mut().enumerate() {
                let (i, k_y) = (index / columns, index % columns);
                *value *= kernel[k_y * columns + i.min(nodes - i)];
            }
            let mut apart = vec![0.0; nodes * nodes];
            transform.inverse(&mut spectrum, &mut apart, &mut scratch);
            for (fused, apart) in fused.iter().zip(apart) {
                assert!(
                    (fused - apart).abs() < 1e-13 * (nodes * nodes) as f64,
                    "{nodes}"
                );
            }
        }
    }

    #[test]
    fn single_precision_agrees_to_its_rounding() {
        let (map, nodes) = (map(36), 36);
        let single_map: Vec<f32> = map.iter().map(|value| *value as f32).collect();
        let (double, single) = (Transform::<f64>::new(nodes), Transform::<f32>::new(nodes));
        let norm = 1.0 / (nodes * nodes) as f64;
        let kernel: Vec<f64> = kernel(&double).iter().map(|value| value * norm).collect();
        let single_kernel: Vec<f32> = kernel.iter().map(|value| *value as f32).collect();
        let (mut wide, mut narrow) = (vec![0.0; nodes * nodes], vec![0.0; nodes * nodes]);
        double.convolve(&kernel, &map, &mut wide, &mut double.scratch());
        single.convolve(
            &single_kernel,
            &single_map,
            &mut narrow,
            &mut single.scratch(),
        );
        for (wide, narrow) in wide.iter().zip(narrow) {
            // A few dozen roundings of values below one half.
            assert!((wide - f64::from(narrow)).abs() < 1e-6);
        }
    }
}
