//! Compares transforms with the Fourier sum, and convolutions with transforms.

use std::f64::consts::TAU;
use std::num::NonZeroUsize;

use super::*;

/// Meshes of odd, even and prime numbers of nodes, some with more than one tile of columns.
const MESHES: [[usize; 2]; 13] = [
    [1, 1],
    [2, 2],
    [3, 3],
    [4, 4],
    [7, 7],
    [8, 8],
    [13, 13],
    [36, 36],
    [1, 40],
    [40, 1],
    [7, 8],
    [36, 5],
    [6, 13],
];

fn map(nodes: [usize; 2]) -> Vec<f64> {
    let mut state = 12345_u64;
    let mut draw = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..nodes[0] * nodes[1]).map(|_| draw()).collect()
}

fn naive(map: &[f64], [nodes_x, nodes_y]: [usize; 2]) -> Vec<Complex<f64>> {
    let columns = nodes_y / 2 + 1;
    let entry = |index: usize| {
        let (k_x, k_y) = (index / columns, index % columns);
        let term = |node: usize| {
            let turns_x = (k_x * (node / nodes_y) % nodes_x) as f64 / nodes_x as f64;
            let turns_y = (k_y * (node % nodes_y) % nodes_y) as f64 / nodes_y as f64;
            Complex::from_polar(map[node], -TAU * (turns_x + turns_y))
        };
        (0..map.len()).map(term).sum()
    };
    (0..nodes_x * columns).map(entry).collect()
}

/// Returns the factor of a wave, in a kernel that changes if the axes are exchanged.
fn factor(k_x: usize, k_y: usize) -> f64 {
    1.0 / (1.0 + k_y as f64 + 0.3 * k_x as f64)
}

#[test]
fn forward_is_the_fourier_sum() {
    for nodes in MESHES {
        let (map, transform) = (map(nodes), Transform::new(nodes));
        let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
        transform.forward(&map, &mut spectrum, &mut transform.scratch());
        for (fast, slow) in spectrum.iter().zip(naive(&map, nodes)) {
            // The naive sum itself rounds N² terms of order one.
            assert!((fast - slow).norm() < 1e-12, "{nodes:?}: {fast} against {slow}");
        }
    }
}

#[test]
fn inverse_undoes_forward_up_to_the_number_of_nodes() {
    for nodes in MESHES {
        let (map, transform) = (map(nodes), Transform::new(nodes));
        let mut scratch = transform.scratch();
        let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
        let mut back = vec![0.0; map.len()];
        transform.forward(&map, &mut spectrum, &mut scratch);
        transform.inverse(&mut spectrum, &mut back, &mut scratch);
        for (value, back) in map.iter().zip(back) {
            assert!((value - back / map.len() as f64).abs() < 1e-15);
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
                let alone = [0, nodes[1] - index % columns].contains(&(index % columns));
                value.norm_sqr() * if alone { 1.0 } else { 2.0 }
            })
            .sum();
        let in_space: f64 = map.iter().map(|value| value * value).sum();
        let in_spectrum = power / map.len() as f64;
        assert!((in_space - in_spectrum).abs() < 1e-13 * in_space, "{nodes:?}");
    }
}

/// Convolves a map with the kernel of [`factor`] in double precision and three separate steps:
/// forward transform, product, inverse transform.
fn convolved_apart(map: &[f64], nodes: [usize; 2]) -> Vec<f64> {
    let transform = Transform::new(nodes);
    let mut scratch = transform.scratch();
    let columns = transform.spectrum_columns();
    let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
    transform.forward(map, &mut spectrum, &mut scratch);
    for (index, value) in spectrum.iter_mut().enumerate() {
        let (i, k_y) = (index / columns, index % columns);
        *value *= factor(i.min(nodes[0] - i), k_y) / map.len() as f64;
    }
    let mut apart = vec![0.0; map.len()];
    transform.inverse(&mut spectrum, &mut apart, &mut scratch);
    apart
}

/// Returns the largest difference between the result of `convolve` and that of [`convolved_apart`].
fn worst_error<T: Real>(nodes: [usize; 2], convolve: impl FnOnce(&[T], &mut [T])) -> f64 {
    let map: Vec<T> = map(nodes).into_iter().map(T::nearest).collect();
    let mut fused = vec![T::zero(); map.len()];
    convolve(&map, &mut fused);
    let exact_map: Vec<f64> = map.into_iter().map(Into::into).collect();
    let apart = convolved_apart(&exact_map, nodes);
    let errors = fused.into_iter().zip(apart).map(|(fused, apart)| {
        let fused: f64 = fused.into();
        (fused - apart).abs()
    });
    errors.fold(0.0, f64::max)
}

fn convolution_error<T: Real>(nodes: [usize; 2]) -> f64 {
    let transform = Transform::<T>::new(nodes);
    worst_error(nodes, |map, out| {
        let kernel = Kernel::new(nodes, factor);
        transform.convolve(&kernel, map, out, &mut transform.scratch());
    })
}

/// Returns the error of the packed convolution, and appends the bits of its result to `bits`.
///
/// Returns `None` if the mesh does not consist of whole registers.
fn packed_error<T: Real>(
    nodes: [usize; 2],
    instructions: Instructions,
    bits: &mut Vec<u64>,
) -> Option<f64> {
    let packed = Packed::<T>::new(nodes[0], nodes, instructions)?;
    Some(worst_error(nodes, |field, out| {
        let factors = |k_y: usize, column: &mut [f64]| {
            for (k_x, value) in column.iter_mut().enumerate() {
                *value = factor(k_x, k_y) / field.len() as f64;
            }
        };
        let kernel = packed.kernel(&Threads::one(), factors);
        let mut scratch = packed.scratch();
        let one = &Threads::one();
        let rows = &mut Source(field);
        packed.pass(Stored::Nothing, Stored::Spectra, rows, one, &mut scratch);
        let work = packed.multiply(&kernel, one, &mut scratch);
        let rows = &mut Sink(Band::new(out));
        packed.pass(Stored::Spectra, Stored::Nothing, rows, one, &mut scratch);
        let numbers = out.iter().map(|number| (*number).into());
        bits.extend(numbers.chain([work]).map(f64::to_bits));
    }))
}

// Values stay below one half and are rounded a few dozen times.
const DOUBLE_ROUNDING: f64 = 1e-14;
const SINGLE_ROUNDING: f64 = 2e-6;

#[test]
fn convolution_is_forward_times_kernel_then_inverse() {
    // With the factors 2, 3 and 5, in more than one order, and with 7 and 11.
    let squares = [60, 64, 96, 112, 160, 176, 240, 288].map(|nodes| [nodes; 2]);
    let rectangles = [[32, 240], [240, 32], [64, 48], [96, 64], [64, 50]];
    for nodes in MESHES.into_iter().chain(squares).chain(rectangles) {
        assert!(convolution_error::<f64>(nodes) < DOUBLE_ROUNDING, "{nodes:?}");
        assert!(convolution_error::<f32>(nodes) < SINGLE_ROUNDING, "{nodes:?}");
    }
}

#[test]
fn every_instruction_set_convolves_to_the_same_bits() {
    // One block, blocks by 2, 3, 4, 5 and 8, and several stages.
    let squares = [32, 64, 96, 128, 160, 256, 480, 512].map(|nodes| [nodes; 2]);
    let rectangles = [[32, 16], [64, 16], [32, 512], [512, 32], [160, 96], [96, 240]];
    for nodes in squares.into_iter().chain(rectangles) {
        same_bits::<f64>(nodes, DOUBLE_ROUNDING);
        same_bits::<f32>(nodes, SINGLE_ROUNDING);
    }
}

fn same_bits<T: Real>(nodes: [usize; 2], rounding: f64) {
    let convolved = |instructions: Instructions| {
        let mut bits = Vec::new();
        let error = packed_error::<T>(nodes, instructions, &mut bits).expect("no other factors");
        assert!(error < rounding, "{instructions:?}, {nodes:?}: {error}");
        bits
    };
    let all: Vec<_> = Instructions::all().into_iter().map(convolved).collect();
    assert!(all.windows(2).all(|pair| pair[0] == pair[1]), "{nodes:?}");
}

#[test]
fn meshes_of_other_factors_are_left_to_rustfft() {
    for instructions in Instructions::all() {
        let squares = [1, 2, 6, 31, 100, 7 * 32, 11 * 64].map(|nodes| [nodes; 2]);
        for nodes in squares.into_iter().chain([[64, 36], [40, 64], [7 * 32, 64]]) {
            assert!(Packed::<f32>::new(nodes[0], nodes, instructions).is_none(), "{nodes:?}");
        }
    }
}

/// Meshes that `packed` convolves, and meshes that only `half_spectrum` convolves.
const BOTH_METHODS: [[usize; 2]; 8] =
    [[1, 1], [7, 7], [36, 36], [64, 64], [480, 480], [5, 36], [96, 32], [32, 160]];

/// Meshes for both implementations that are large enough for three threads.
const SHARED: [[usize; 2]; 4] = [[640, 640], [700, 601], [832, 480], [1, 500_000]];

fn threads(count: usize) -> Threads {
    Threads::new(NonZeroUsize::new(count).unwrap())
}

/// Returns the bits of the half spectrum of a map, of its inverse transform, and of two
/// convolutions: of the whole mesh and of a map in its corner.
fn bits_on<T: Real>(threads: &Threads, nodes: [usize; 2]) -> Vec<u64> {
    let map: Vec<T> = map(nodes).into_iter().map(T::nearest).collect();
    let transform = Transform::new(nodes);
    let mut scratch = transform.scratch_on(threads.clone());
    let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
    transform.forward(&map, &mut spectrum, &mut scratch);
    let mut numbers: Vec<T> = spectrum.iter().flat_map(|z| [z.re, z.im]).collect();
    let mut back = vec![T::zero(); map.len()];
    transform.inverse(&mut spectrum, &mut back, &mut scratch);
    numbers.extend(&back);
    let mut bits: Vec<u64> = numbers.into_iter().map(|x| x.into().to_bits()).collect();
    for corner in [nodes, nodes.map(|nodes| nodes.div_ceil(2))] {
        let (transform, kernel) = (Transform::padded(corner, nodes), Kernel::new(nodes, factor));
        let mut scratch = transform.scratch_on(threads.clone());
        let field = &map[..corner[0] * corner[1]];
        let mut out = vec![T::zero(); field.len()];
        transform.begin(&mut Source(field), &mut scratch);
        bits.push(transform.multiply(&kernel, &mut scratch).to_bits());
        transform.finish(&mut Sink(Band::new(&mut out)), &mut scratch);
        bits.extend(out.into_iter().map(|x| x.into().to_bits()));
    }
    bits
}

#[test]
fn any_number_of_threads_has_the_same_bits() {
    for nodes in SHARED {
        let single = bits_on::<f32>(&Threads::one(), nodes);
        let double = bits_on::<f64>(&Threads::one(), nodes);
        for count in [2, 3, 8] {
            let threads = threads(count);
            assert!(bits_on::<f32>(&threads, nodes) == single, "{count}, {nodes:?}");
            assert!(bits_on::<f64>(&threads, nodes) == double, "{count}, {nodes:?}");
        }
    }
}

#[test]
fn every_row_is_seen_once_in_ascending_order() {
    /// Pass that checks the order of rows. It stores the index of its first row, and the index
    /// after the last visited row.
    struct Calls(usize, usize);
    impl Rows<f64> for Calls {
        fn row(&mut self, row: Row, values: &mut [f64]) {
            assert_eq!(row.index, self.1);
            self.1 += 1;
            values.fill(1.0);
        }

        fn split_off(&mut self, row: Row) -> Self {
            Self(row.index, row.index)
        }

        fn append(&mut self, later: Self) {
            assert_eq!(self.1, later.0);
            self.1 = later.1;
        }
    }
    for nodes in BOTH_METHODS.into_iter().chain(SHARED) {
        let (transform, kernel) = (Transform::new(nodes), Kernel::new(nodes, factor));
        let mut scratch = transform.scratch_on(threads(3));
        let mut calls = [Calls(0, 0), Calls(0, 0), Calls(0, 0)];
        transform.begin(&mut calls[0], &mut scratch);
        transform.multiply(&kernel, &mut scratch);
        transform.pass(Stored::Spectra, Stored::Spectra, &mut calls[1], &mut scratch);
        transform.multiply(&kernel, &mut scratch);
        transform.finish(&mut calls[2], &mut scratch);
        assert!(calls.iter().all(|calls| calls.1 == nodes[0]));
    }
}

#[test]
fn finish_and_begin_is_finish_then_begin() {
    /// Pass that multiplies each row by three.
    struct Triple;
    impl Rows<f64> for Triple {
        fn row(&mut self, _: Row, values: &mut [f64]) {
            values.iter_mut().for_each(|value| *value *= 3.0);
        }

        fn split_off(&mut self, _: Row) -> Self {
            Self
        }

        fn append(&mut self, _: Self) {}
    }
    for nodes in BOTH_METHODS {
        let (transform, kernel) = (Transform::new(nodes), Kernel::new(nodes, factor));
        let mut scratch = transform.scratch();
        let field = map(nodes);
        let [mut apart, mut at_once] = [field.clone(), field.clone()];
        transform.convolve(&kernel, &field, &mut apart, &mut scratch);
        apart.iter_mut().for_each(|value| *value *= 3.0);
        transform.convolve(&kernel, &apart.clone(), &mut apart, &mut scratch);

        let field = &field;
        transform.begin(&mut Source(field), &mut scratch);
        transform.multiply(&kernel, &mut scratch);
        transform.pass(Stored::Spectra, Stored::Spectra, &mut Triple, &mut scratch);
        transform.multiply(&kernel, &mut scratch);
        let out = &mut at_once;
        transform.finish(&mut Sink(Band::new(out)), &mut scratch);
        assert_eq!(apart, at_once);
    }
}

#[test]
fn a_peek_shows_two_rows_of_the_result() {
    struct GapSums<'a> {
        map: &'a [f64],
        rows: Vec<usize>,
    }
    impl Rows<f64> for GapSums<'_> {
        fn row(&mut self, row: Row, values: &mut [f64]) {
            assert_eq!(values, row.of(self.map));
            self.rows.push(row.index);
        }

        fn split_off(&mut self, _: Row) -> Self {
            Self { map: self.map, rows: Vec::new() }
        }

        fn append(&mut self, later: Self) {
            self.rows.extend(later.rows);
        }
    }
    for nodes in BOTH_METHODS.into_iter().chain(SHARED) {
        let (transform, kernel) = (Transform::new(nodes), Kernel::new(nodes, factor));
        let mut scratch = transform.scratch_on(threads(3));
        let field = &map(nodes);
        let mut convolved = vec![0.0; field.len()];
        transform.convolve(&kernel, field, &mut convolved, &mut scratch);
        transform.begin(&mut Source(field), &mut scratch);
        transform.multiply(&kernel, &mut scratch);
        let mut seen = GapSums { map: &convolved, rows: Vec::new() };
        let pairs = Vec::from_iter(0..nodes[0].div_ceil(2));
        transform.peek(Stored::Spectra, &pairs, &mut seen, &mut scratch);
        assert_eq!(seen.rows, Vec::from_iter(0..nodes[0]));
    }
}

#[test]
fn a_stored_map_is_convolved_as_one_that_was_written() {
    /// Pass that copies each row to a band, and then multiplies it by a factor.
    struct Times<'a>(f64, Band<'a, f64>);
    impl Rows<f64> for Times<'_> {
        fn row(&mut self, row: Row, values: &mut [f64]) {
            self.1.row(row).copy_from_slice(values);
            values.iter_mut().for_each(|value| *value *= self.0);
        }

        fn split_off(&mut self, row: Row) -> Self {
            Self(self.0, self.1.split_off(row))
        }

        fn append(&mut self, _: Self) {}
    }
    let whole = BOTH_METHODS.into_iter().chain(SHARED);
    for (map_nodes, nodes) in whole.map(|nodes| (nodes, nodes)).chain(CORNERS) {
        let kernel = Kernel::new(nodes, factor);
        let transform = Transform::padded(map_nodes, nodes);
        let mut scratch = transform.scratch_on(threads(3));
        let field = &map(map_nodes);
        let [mut once, mut seen, mut kept, mut twice] =
            std::array::from_fn(|_| vec![0.0; field.len()]);
        transform.convolve(&kernel, field, &mut once, &mut scratch);
        transform.begin(&mut Source(field), &mut scratch);
        transform.multiply(&kernel, &mut scratch);
        transform.pass(
            Stored::Spectra,
            Stored::Rows,
            &mut Times(2.0, Band::new(&mut seen)),
            &mut scratch,
        );
        assert!(seen == once, "{nodes:?}");
        let doubled: Vec<f64> = once.iter().map(|value| 2.0 * value).collect();
        let pairs: Vec<usize> = (0..map_nodes[0] / 2).step_by(3).collect();
        let mut peeked = doubled.clone();
        transform.peek(Stored::Rows, &pairs, &mut Times(1.0, Band::new(&mut peeked)), &mut scratch);
        assert!(peeked == doubled, "{nodes:?}");
        transform.pass(
            Stored::Rows,
            Stored::Spectra,
            &mut Times(3.0, Band::new(&mut kept)),
            &mut scratch,
        );
        assert!(kept == doubled, "{nodes:?}");
        transform.multiply(&kernel, &mut scratch);
        transform.pass(
            Stored::Spectra,
            Stored::Rows,
            &mut Times(1.0, Band::new(&mut twice)),
            &mut scratch,
        );
        let six_times: Vec<f64> = doubled.iter().map(|value| 3.0 * value).collect();
        let mut expected = vec![0.0; field.len()];
        transform.pass(
            Stored::Rows,
            Stored::Nothing,
            &mut Times(1.0, Band::new(&mut seen)),
            &mut scratch,
        );
        assert!(seen == twice, "{nodes:?}");
        transform.convolve(&kernel, &six_times, &mut expected, &mut scratch);
        assert!(twice == expected, "{nodes:?}");
    }
}

#[test]
fn multiply_returns_the_sum_of_map_times_convolved_map() {
    for nodes in MESHES.into_iter().chain(BOTH_METHODS) {
        let (transform, kernel) = (Transform::new(nodes), Kernel::new(nodes, factor));
        let mut scratch = transform.scratch();
        let field = &map(nodes);
        let mut convolved = vec![0.0; field.len()];
        transform.begin(&mut Source(field), &mut scratch);
        let told = transform.multiply(&kernel, &mut scratch);
        let out = &mut convolved;
        transform.finish(&mut Sink(Band::new(out)), &mut scratch);
        let work: f64 = field.iter().zip(&convolved).map(|(a, b)| a * b).sum();
        assert!((told - work).abs() < 1e-13 * work, "{nodes:?}: {told}, {work}");
    }
}

/// Numbers of nodes of a map, and of the mesh of which it fills a corner. Some maps end within a
/// batch of rows.
const CORNERS: [([usize; 2], [usize; 2]); 8] = [
    ([1, 1], [2, 2]),
    ([5, 7], [10, 14]),
    ([5, 7], [9, 7]),
    ([32, 32], [64, 64]),
    ([48, 80], [96, 160]),
    ([33, 40], [96, 96]),
    ([256, 16], [512, 32]),
    ([64, 32], [64, 64]),
];

/// Returns a map of `rows` × `row_nodes` nodes, padded with zeros to `nodes`.
fn padded(map: &[f64], [rows, row_nodes]: [usize; 2], nodes: [usize; 2]) -> Vec<f64> {
    let mut whole = vec![0.0; nodes[0] * nodes[1]];
    for (row, values) in whole.chunks_exact_mut(nodes[1]).enumerate().take(rows) {
        values[..row_nodes].copy_from_slice(Row::new(row, row_nodes).of(map));
    }
    whole
}

#[test]
fn a_corner_is_convolved_to_the_bytes_of_the_whole_mesh_with_zeros() {
    for (corner, nodes) in CORNERS {
        let field = map(corner);
        let kernel = Kernel::new(nodes, factor);
        let mut out = vec![0.0; field.len()];
        let transform = Transform::padded(corner, nodes);
        transform.convolve(&kernel, &field, &mut out, &mut transform.scratch());

        let whole = padded(&field, corner, nodes);
        let mut expected = vec![0.0; whole.len()];
        let transform = Transform::new(nodes);
        transform.convolve(&kernel, &whole, &mut expected, &mut transform.scratch());
        for (row, out) in out.chunks_exact(corner[1]).enumerate() {
            let expected = &Row::new(row, nodes[1]).of(&expected)[..corner[1]];
            assert!(out == expected, "{corner:?} of {nodes:?}, row {row}");
        }
    }
}

#[test]
fn a_corner_is_chained_peeked_and_summed_as_the_whole_mesh() {
    /// Pass that records, for each row, its sum times its index from 1.
    #[derive(Default)]
    struct Sum(Vec<f64>);
    impl Rows<f64> for Sum {
        fn row(&mut self, row: Row, values: &mut [f64]) {
            let sum: f64 = values.iter().sum();
            self.0.push((row.index + 1) as f64 * sum);
        }

        fn split_off(&mut self, _: Row) -> Self {
            Self::default()
        }

        fn append(&mut self, later: Self) {
            self.0.extend(later.0);
        }
    }
    for (corner, nodes) in CORNERS {
        let (field, kernel) = (map(corner), Kernel::new(nodes, factor));
        let (once, twice) = (&mut vec![0.0; field.len()], &mut vec![0.0; field.len()]);
        let transform = Transform::padded(corner, nodes);
        let mut scratch = transform.scratch();
        transform.convolve(&kernel, &field, once, &mut scratch);
        transform.convolve(&kernel, once, twice, &mut scratch);

        transform.begin(&mut Source(&field), &mut scratch);
        let work = transform.multiply(&kernel, &mut scratch);
        let expected: f64 = field.iter().zip(&*once).map(|(a, b)| a * b).sum();
        assert!((work - expected).abs() < 1e-13 * work, "{corner:?}");
        let [mut peeked, mut turned] = [Sum::default(), Sum::default()];
        let pairs = Vec::from_iter(0..corner[0].div_ceil(2));
        transform.peek(Stored::Spectra, &pairs, &mut peeked, &mut scratch);
        transform.pass(Stored::Spectra, Stored::Spectra, &mut turned, &mut scratch);
        // Pairs may contain a row of zeros beyond the map.
        let beyond = peeked.0.split_off(corner[0]);
        assert!(beyond.into_iter().all(|sum| sum == 0.0), "{corner:?}");
        assert_eq!(peeked.0, turned.0);
        transform.multiply(&kernel, &mut scratch);
        let mut out = vec![0.0; field.len()];
        transform.finish(&mut Sink(Band::new(&mut out)), &mut scratch);
        assert!(out == *twice, "{corner:?} of {nodes:?}");
    }
}
