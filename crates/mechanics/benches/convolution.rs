//! Benchmark of a convolution, compared with bare transforms of rustfft and with the memory
//! bandwidth.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use asperity_mechanics::elasticity::{Factor, PeriodicHalfSpace, kernel};
use asperity_mechanics::fft::{Real, Transform};
use asperity_mechanics::grid::Grid;
use asperity_mechanics::threads::Threads;
use divan::{Bencher, black_box, counter::BytesCount};
use realfft::RealFftPlanner;
use rustfft::{FftPlanner, num_complex::Complex};

const NODES: [usize; 4] = [256, 512, 1024, 2048];

fn main() {
    divan::main();
}

/// Measures the forward transform, product and inverse transform of a convolution.
#[divan::bench(types = [f32, f64], args = NODES)]
fn convolution<T: Real>(bencher: Bencher, nodes: usize) {
    let grid = Grid::square(nodes, 1.0).expect("a mesh has nodes");
    let transform = Transform::<T>::new(grid.nodes());
    let kernel = kernel(&Threads::one(), &PeriodicHalfSpace::new(grid), Factor::Displacement);
    let field = vec![T::one(); nodes * nodes];
    let mut out = field.clone();
    let mut scratch = transform.scratch();
    bencher.bench_local(|| transform.convolve(&kernel, black_box(&field), &mut out, &mut scratch));
}

/// Measures as many transforms by rustfft as a convolution needs: all rows and columns forward and
/// back.
///
/// There is no kernel, and columns are contiguous already.
#[divan::bench(types = [f32, f64], args = NODES)]
fn rustfft_transforms<T: Real>(bencher: Bencher, nodes: usize) {
    let columns = nodes / 2 + 1;
    let (mut real, mut complex) = (RealFftPlanner::<T>::new(), FftPlanner::<T>::new());
    let row_forward = real.plan_fft_forward(nodes);
    let row_inverse = real.plan_fft_inverse(nodes);
    let column_forward = complex.plan_fft_forward(nodes);
    let column_inverse = complex.plan_fft_inverse(nodes);
    let mut field = vec![T::one(); nodes * nodes];
    let mut spectrum = vec![Complex::<T>::default(); columns * nodes];
    let lengths = [
        row_forward.get_scratch_len(),
        row_inverse.get_scratch_len(),
        column_forward.get_inplace_scratch_len(),
        column_inverse.get_inplace_scratch_len(),
    ];
    let longest = lengths.into_iter().max().unwrap_or(0);
    let mut scratch = vec![Complex::default(); longest];
    bencher.bench_local(|| {
        let rows = field.chunks_exact_mut(nodes);
        for (row, half) in rows.zip(spectrum.chunks_exact_mut(columns)) {
            row_forward
                .process_with_scratch(row, half, &mut scratch)
                .expect("buffers are of the planned lengths");
        }
        column_forward.process_with_scratch(&mut spectrum, &mut scratch);
        column_inverse.process_with_scratch(&mut spectrum, &mut scratch);
        let rows = field.chunks_exact_mut(nodes);
        for (row, half) in rows.zip(spectrum.chunks_exact_mut(columns)) {
            half[0].im = T::zero();
            half[columns - 1].im = T::zero();
            row_inverse
                .process_with_scratch(half, row, &mut scratch)
                .expect("buffers are of the planned lengths");
            // Normalises, so that numbers stay finite.
            let factor = T::nearest(1.0 / (nodes * nodes) as f64);
            row.iter_mut().for_each(|value| *value = *value * factor);
        }
    });
}

/// Measures the memory bandwidth with a ← b + s c on maps of the same size.
#[divan::bench(types = [f32, f64], args = NODES)]
fn triad<T: Real>(bencher: Bencher, nodes: usize) {
    let [mut a, b, c] = [0.0, 1.0, 2.0].map(|value| vec![T::nearest(value); nodes * nodes]);
    bencher.counter(BytesCount::new(3 * nodes * nodes * size_of::<T>())).bench_local(|| {
        let s = black_box(T::nearest(0.5));
        for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
            *a = *b + s * *c;
        }
        black_box(&mut a);
    });
}
