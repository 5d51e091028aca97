//! A periodic map on other nodes: its trigonometric interpolant, sampled.
//!
//! Modes that both meshes carry stay as they are, and modes that only one of them carries are none of
//! the other's. What a mesh of an even number of nodes knows of its highest wave along an axis is the
//! sum of both directions: on a finer one each has half of it, from a finer one both are added.

use std::cmp::Ordering;

use rustfft::num_complex::Complex;

use super::surface::Surface;
use crate::fft::Transform;
use crate::grid::{Grid, magnitude};

/// The map on so many nodes along x and y of the same cell; node (0, 0) stays where it is.
///
/// Exact where no wave is lost: going to a finer mesh and back restores the map to rounding.
///
/// # Panics
/// When there is no node.
pub fn resampled(surface: &Surface, nodes: [usize; 2]) -> Surface {
    let before = surface.grid();
    if before.nodes() == nodes {
        return surface.clone();
    }
    let after = Grid::new(nodes, before.cell()).expect("a mesh with nodes that can be counted");
    let [from, to] = [before.nodes(), nodes].map(Transform::<f64>::new);
    let mut spectrum = vec![Complex::default(); from.spectrum_len()];
    from.forward(surface.heights(), &mut spectrum, &mut from.scratch());
    let mode = |[row, column]: [usize; 2]| {
        let [nodes_x, nodes_y] = before.nodes();
        let columns = from.spectrum_columns();
        match column < columns {
            true => spectrum[row * columns + column],
            // The other half of a real map's spectrum.
            false => spectrum[(nodes_x - row) % nodes_x * columns + nodes_y - column].conj(),
        }
    };
    let along_x = sources(before.nodes()[0], nodes[0]);
    let along_y = sources(before.nodes()[1], nodes[1]);
    let share = 1.0 / before.count() as f64;
    let modes = along_x.iter().flat_map(|rows| {
        let columns = along_y.iter().take(to.spectrum_columns());
        columns.map(|columns| {
            let mut sum = Complex::default();
            for (row, weight_x) in rows.iter().flatten() {
                for (column, weight_y) in columns.iter().flatten() {
                    sum += mode([*row, *column]) * (weight_x * weight_y);
                }
            }
            sum * share
        })
    });
    let mut spectrum: Vec<Complex<f64>> = modes.collect();
    let mut heights = vec![0.0; after.count()];
    to.inverse(&mut spectrum, &mut heights, &mut to.scratch());
    Surface::new(after, heights).expect("interpolants of finite heights are finite")
}

/// One entry of a spectrum, and its weight.
type Source = Option<(usize, f64)>;

/// For each entry of the spectrum of `after` numbers those of `before` numbers that it is made of.
fn sources(before: usize, after: usize) -> Vec<[Source; 2]> {
    let carried = before.min(after);
    let source = |entry: usize| {
        let wavenumber = magnitude(entry, after);
        let opposite = before - wavenumber.min(before);
        match (2 * wavenumber).cmp(&carried) {
            Ordering::Less if entry <= after / 2 => [Some((wavenumber, 1.0)), None],
            Ordering::Less => [Some((opposite, 1.0)), None],
            Ordering::Equal => match before.cmp(&after) {
                Ordering::Less => [Some((wavenumber, 0.5)), None],
                Ordering::Equal => [Some((wavenumber, 1.0)), None],
                Ordering::Greater => [Some((wavenumber, 1.0)), Some((opposite, 1.0))],
            },
            Ordering::Greater => [None, None],
        }
    };
    (0..after).map(source).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::grid::samples::rectangle;

    /// Waves up to 3 along x and 2 along y, at the nodes of a mesh.
    fn waves(nodes: [usize; 2]) -> Surface {
        let grid = rectangle(nodes, [3.0, 2.0]);
        let heights = (0..grid.count()).map(|node| {
            let [i, j] = grid.place(node);
            let x = TAU * i as f64 / nodes[0] as f64;
            let y = TAU * j as f64 / nodes[1] as f64;
            1.0 + libm::sin(3.0 * x + 2.0 * y + 0.4) + libm::cos(x - 2.0 * y) + libm::sin(3.0 * x)
        });
        Surface::new(grid, heights.collect()).unwrap()
    }

    #[track_caller]
    fn assert_equal(found: &Surface, expected: &Surface) {
        assert_eq!(found.grid(), expected.grid());
        for (found, expected) in found.heights().iter().zip(expected.heights()) {
            assert!((found - expected).abs() < 1e-13, "{found} {expected}");
        }
    }

    #[test]
    fn every_mesh_shows_the_same_waves() {
        let meshes = [[7, 5], [8, 6], [9, 16], [20, 6], [31, 24]];
        for (from, to) in meshes.into_iter().flat_map(|from| meshes.map(|to| (from, to))) {
            assert_equal(&resampled(&waves(from), to), &waves(to));
        }
    }

    #[test]
    fn a_finer_mesh_and_back_is_the_map() {
        for nodes in [[8, 6], [7, 8], [1, 5], [2, 2]] {
            let grid = rectangle(nodes, [1.0, 1.0]);
            let heights = (0..grid.count()).map(|node| libm::sin(7.0 * (node * node) as f64));
            let rough = Surface::new(grid, heights.collect()).unwrap();
            for finer in [[16, 12], [9, 13], [8, 8]] {
                assert_equal(&resampled(&resampled(&rough, finer), nodes), &rough);
            }
        }
    }

    #[test]
    fn the_highest_wave_of_a_mesh_stays_real_between_its_nodes() {
        let grid = rectangle([4, 4], [1.0, 1.0]);
        let heights = (0..16).map(|node| [1.0, -1.0][grid.place(node)[0] % 2]);
        let wave = Surface::new(grid, heights.collect()).unwrap();
        let finer = resampled(&wave, [16, 4]);
        for node in 0..64 {
            let x = (node / 4) as f64 / 16.0;
            assert!((finer.heights()[node] - libm::cos(2.0 * TAU * x)).abs() < 1e-14);
        }
    }

    #[test]
    fn waves_that_a_coarser_mesh_cannot_carry_are_none_of_it() {
        let short = rectangle([32, 4], [1.0, 1.0]);
        let heights = (0..128).map(|node| {
            let x = (node / 4) as f64 / 32.0;
            libm::cos(TAU * 2.0 * x) + libm::cos(TAU * 9.0 * x)
        });
        let coarse = resampled(&Surface::new(short, heights.collect()).unwrap(), [8, 4]);
        for node in 0..32 {
            let x = (node / 4) as f64 / 8.0;
            assert!((coarse.heights()[node] - libm::cos(TAU * 2.0 * x)).abs() < 1e-14);
        }
    }
}
