//! Translation and reversal of maps, which bring the map of a second body to its place above the
//! first one.
//!
//! The gap between two rough bodies depends on their heights towards each other alone. It is the
//! gap between a flat body and the sum h₁(x) + h₂(x − s), where s is the lateral shift of the
//! second body.

use std::f64::consts::{PI, TAU};

use rustfft::num_complex::Complex;

use super::surface::{Axis, Surface, SurfaceError};
use crate::fft::Transform;

/// Largest distance of a shift from a whole number of nodes, in mesh steps, that counts as
/// rounding.
const ROUNDING: f64 = 1e-9;

/// Returns the shift as numbers of nodes in 0 … N − 1, or `None` if it is not a whole number
/// along one axis. `shift` has fractions of the sides along x and y.
pub fn whole_nodes(nodes: [usize; 2], shift: [f64; 2]) -> Option<[usize; 2]> {
    let along = |axis: Axis| {
        let (nodes, shift) = (axis.select(nodes), axis.select(shift));
        let steps = shift * nodes as f64;
        let is_whole = (steps - steps.round()).abs() < ROUNDING;
        is_whole.then(|| (steps.round() as i64).rem_euclid(nodes as i64) as usize)
    };
    Some([along(Axis::X)?, along(Axis::Y)?])
}

/// Returns the periodic map h(x − s), where s is `shift` times the sides along x and y.
///
/// A shift by whole nodes copies the heights. Any other shift multiplies each Fourier mode by its
/// phase e^(−i q·s). The modes k and −k share an entry at the Nyquist wavenumber of an even number
/// of nodes; the entry is multiplied by the mean cos(q s) of their phases.
pub fn translated(surface: &Surface, shift: [f64; 2]) -> Surface {
    let grid = surface.grid();
    let nodes = grid.nodes();
    let heights = match whole_nodes(nodes, shift) {
        Some(steps) => rotated(surface.heights(), nodes, steps),
        None => with_phases(surface.heights(), nodes, shift),
    };
    Surface::new(grid, heights).expect("interpolants of finite heights are finite")
}

/// Returns the heights moved by whole nodes.
fn rotated(heights: &[f64], [nodes_x, nodes_y]: [usize; 2], steps: [usize; 2]) -> Vec<f64> {
    let [steps_x, steps_y] = steps;
    let mut moved = Vec::with_capacity(heights.len());
    for i in 0..nodes_x {
        let from = (i + nodes_x - steps_x) % nodes_x * nodes_y;
        let row = &heights[from..from + nodes_y];
        moved.extend_from_slice(&row[nodes_y - steps_y..]);
        moved.extend_from_slice(&row[..nodes_y - steps_y]);
    }
    moved
}

/// Returns the trigonometric interpolant of the heights at nodes moved by any shift.
fn with_phases(heights: &[f64], nodes: [usize; 2], shift: [f64; 2]) -> Vec<f64> {
    let transform = Transform::<f64>::new(nodes);
    let mut spectrum = transform.spectrum(heights);
    let [along_x, along_y] = Axis::BOTH.map(|axis| phases(axis.select(nodes), axis.select(shift)));
    let normalisation = 1.0 / heights.len() as f64;
    let rows = spectrum.chunks_exact_mut(transform.spectrum_columns());
    for (row, phase_x) in rows.zip(along_x) {
        for (mode, phase_y) in row.iter_mut().zip(&along_y) {
            *mode *= phase_x * phase_y * normalisation;
        }
    }
    transform.field(spectrum)
}

/// Returns the phase e^(−2πi k s) of each Fourier coefficient along an axis, for a shift by the
/// fraction s of the side.
fn phases(nodes: usize, shift: f64) -> Vec<Complex<f64>> {
    let phase = |entry: usize| {
        if 2 * entry == nodes {
            return Complex::new(libm::cos(PI * shift * nodes as f64), 0.0);
        }
        let wavenumber = if 2 * entry > nodes { entry as f64 - nodes as f64 } else { entry as f64 };
        let (sin, cos) = libm::sincos(-TAU * wavenumber * shift);
        Complex::new(cos, sin)
    };
    (0..nodes).map(phase).collect()
}

/// Returns the map with the order of its nodes along an axis reversed, as it appears from its back.
pub fn reversed(surface: &Surface, axis: Axis) -> Surface {
    let [nodes_x, nodes_y] = surface.grid().nodes();
    let rows = surface.heights().chunks_exact(nodes_y);
    let mut heights = Vec::with_capacity(nodes_x * nodes_y);
    match axis {
        Axis::X => rows.rev().for_each(|row| heights.extend_from_slice(row)),
        Axis::Y => rows.for_each(|row| heights.extend(row.iter().rev())),
    }
    Surface::new(surface.grid(), heights).expect("the heights are those of a surface")
}

/// Returns the sum of the heights of two maps with the same numbers of nodes, on the grid of the
/// first one.
///
/// # Errors
/// Fails if the second map has another number of nodes, or if a sum overflows.
pub fn sum(first: &Surface, second: &Surface) -> Result<Surface, SurfaceError> {
    let heights = first.heights().iter().zip(second.heights()).map(|(one, other)| one + other);
    if first.grid().nodes() != second.grid().nodes() {
        let (found, nodes) = (second.grid().count(), first.grid().nodes());
        return Err(SurfaceError::Count { found, nodes });
    }
    Surface::new(first.grid(), heights.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::rectangle;

    /// Samples a function of the positions x and y, as fractions of the sides.
    fn surface(nodes: [usize; 2], height: impl Fn(f64, f64) -> f64) -> Surface {
        let grid = rectangle(nodes, [1.0, 2.0]);
        let height = |node: usize| {
            let [i, j] = grid.indices(node);
            height(i as f64 / nodes[0] as f64, j as f64 / nodes[1] as f64)
        };
        Surface::new(grid, (0..grid.count()).map(height).collect()).unwrap()
    }

    fn waves(x: f64, y: f64) -> f64 {
        libm::cos(TAU * (2.0 * x + y) + 0.3) + 0.5 * libm::sin(TAU * (x - 3.0 * y)) + 0.2
    }

    fn largest_difference(one: &Surface, other: &Surface) -> f64 {
        let pairs = one.heights().iter().zip(other.heights());
        pairs.map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn translated_waves_are_the_waves_at_the_moved_positions() {
        for nodes in [[8, 8], [9, 7], [8, 12], [15, 8]] {
            let map = surface(nodes, waves);
            for [s, t] in [[0.25, 0.5], [0.1, 0.0], [0.07, -0.23], [1.3, 1.0 / 3.0]] {
                let expected = surface(nodes, |x, y| waves(x - s, y - t));
                let difference = largest_difference(&translated(&map, [s, t]), &expected);
                assert!(difference < 1e-14, "{nodes:?}, {s}, {t}: {difference}");
            }
        }
    }

    #[test]
    fn a_shift_by_whole_nodes_moves_the_heights_themselves() {
        let nodes = [6, 4];
        let heights: Vec<f64> = (0..24).map(f64::from).collect();
        let map = Surface::new(rectangle(nodes, [1.0, 2.0]), heights).unwrap();
        let moved = translated(&map, [1.0 / 6.0, -0.25]);
        for [i, j] in (0..24).map(|node| map.grid().indices(node)) {
            let from = (i + 5) % 6 * 4 + (j + 1) % 4;
            assert_eq!(moved.heights()[i * 4 + j], map.heights()[from]);
        }
        assert_eq!(translated(&map, [0.0, 0.0]), map);
        assert_eq!(translated(&map, [2.0, -1.0]), map);
        // A shift that is written with thirteen digits is one by whole nodes.
        assert_eq!(whole_nodes([96, 96], [0.010_416_666_666_7, 0.5]), Some([1, 48]));
        assert_eq!(whole_nodes([96, 96], [0.1, 0.0]), None);
    }

    #[test]
    fn phases_by_whole_nodes_are_the_moved_heights() {
        let map = surface([8, 6], |x, y| libm::sin(40.0 * x + 17.0 * x * y) + y);
        let (nodes, heights) = (map.grid().nodes(), map.heights());
        let moved = with_phases(heights, nodes, [0.375, 0.5]);
        for (one, other) in moved.iter().zip(rotated(heights, nodes, [3, 3])) {
            assert!((one - other).abs() < 1e-14);
        }
    }

    #[test]
    fn the_wave_at_the_nyquist_wavenumber_is_multiplied_by_the_cosine_of_its_phase() {
        let map = surface([8, 8], |x, _| libm::cos(TAU * 4.0 * x));
        let expected = surface([8, 8], |x, _| libm::cos(TAU * 4.0 * x) * libm::cos(TAU * 0.2));
        assert!(largest_difference(&translated(&map, [0.05, 0.0]), &expected) < 1e-15);
    }

    #[test]
    fn reversing_twice_restores_the_map() {
        let map = surface([5, 4], waves);
        for axis in Axis::BOTH {
            assert_ne!(reversed(&map, axis), map);
            assert_eq!(reversed(&reversed(&map, axis), axis), map);
        }
        let [first, last] = [0, 4].map(|row: usize| row * 4..(row + 1) * 4);
        assert_eq!(reversed(&map, Axis::X).heights()[first], map.heights()[last]);
        assert_eq!(reversed(&map, Axis::Y).heights()[0], map.heights()[3]);
    }

    #[test]
    fn maps_on_other_grids_have_no_sum() {
        let (one, other) = (surface([4, 4], waves), surface([4, 6], waves));
        assert_eq!(sum(&one, &one).unwrap(), one.clone().scaled(2.0).unwrap());
        assert!(matches!(sum(&one, &other), Err(SurfaceError::Count { found: 24, .. })));
    }
}
