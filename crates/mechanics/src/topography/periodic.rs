//! Periodic continuation of measured maps, and resampling of periodic maps.
//!
//! A measured map is a window on a larger surface, and its opposite edges do not match. If it is
//! treated as periodic, the steps at the edges add a tail |ĥ|² ~ q^(−2) along the axes to its
//! spectrum, which dominates slope and curvature. [`detrend`], [`mirror`] and [`taper`] reduce the
//! steps; each affects the statistics of the map.
//!
//! [`resampled`] samples the trigonometric interpolant of a periodic map on another grid. Modes
//! that both grids resolve do not change; all other modes are zero. With an even number of nodes,
//! the entry at the Nyquist wavenumber is the sum of the modes k and −k. On a finer grid, each of
//! the two modes gets half of it. On a coarser grid, both modes are added.

use std::cmp::Ordering;
use std::f64::consts::PI;

use rustfft::num_complex::Complex;
use serde::{Deserialize, Serialize};

use super::surface::Surface;
use crate::fft::Transform;
use crate::grid::{Cell, Grid, magnitude};

/// Treatment of the edges of a measured map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "edges", rename_all = "lowercase")]
pub enum Edges {
    /// No change: the map is periodic.
    Periodic,
    /// No change: the map is not periodic.
    Open,
    /// Removal of the mean plane, then continuation by mirror images; see [`mirror`].
    Mirror,
    /// Removal of the mean plane, then fading to the mean height at the edges; see [`taper`].
    Taper {
        /// Fraction of each side that is faded at each of its two ends, at most one half.
        taper_fraction: f64,
    },
}

impl Edges {
    /// Returns the name used in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Edges::Periodic => "periodic",
            Edges::Open => "open",
            Edges::Mirror => "mirror",
            Edges::Taper { .. } => "taper",
        }
    }

    /// Returns the map after this treatment of its edges.
    pub fn close(self, map: Surface) -> Surface {
        match self {
            Edges::Periodic | Edges::Open => map,
            Edges::Mirror => mirror(&detrend(&map)),
            Edges::Taper { taper_fraction } => taper(&detrend(&map), taper_fraction),
        }
    }
}

/// Returns the map minus its least-squares plane.
///
/// This removes the tilt of the sample, and the part of the longest waves that resembles a plane.
/// The mean height becomes zero. Opposite edges still do not match.
pub fn detrend(surface: &Surface) -> Surface {
    let grid = surface.grid();
    let middle = grid.nodes().map(|nodes| (nodes as f64 - 1.0) / 2.0);
    let offset = |node: usize| {
        let [i, j] = grid.indices(node);
        [i as f64 - middle[0], j as f64 - middle[1]]
    };
    let (mut sum, mut along_x, mut along_y) = (0.0, 0.0, 0.0);
    for (node, height) in surface.heights().iter().enumerate() {
        let [x, y] = offset(node);
        sum += height;
        along_x += x * height;
        along_y += y * height;
    }
    // On a complete grid, 1, x and y are orthogonal, so that each slope follows from one sum.
    let mean = sum / grid.count() as f64;
    let [nodes_x, nodes_y] = grid.nodes();
    let slope_x = along_x / (nodes_y as f64 * square_offsets(nodes_x)).max(f64::MIN_POSITIVE);
    let slope_y = along_y / (nodes_x as f64 * square_offsets(nodes_y)).max(f64::MIN_POSITIVE);
    map_nodes(surface, |node, height| {
        let [x, y] = offset(node);
        height - (mean + slope_x * x + slope_y * y)
    })
}

/// Returns Σ (i − (n − 1)/2)² over i = 0, …, n − 1, with n = `nodes`.
fn square_offsets(nodes: usize) -> f64 {
    let middle = (nodes as f64 - 1.0) / 2.0;
    (0..nodes).map(|index| (index as f64 - middle).powi(2)).sum()
}

/// Returns the map with its three mirror images, on a cell of twice the sides.
///
/// The heights match at all edges, and their distribution does not change. If the map has a slope
/// across an edge, the slope is discontinuous there. The larger cell has no more independent
/// asperities than the map. For an anisotropic map, the directions +45° and −45° are mixed.
pub fn mirror(surface: &Surface) -> Surface {
    let grid = surface.grid();
    let nodes = grid.nodes();
    let cell = Cell::new(grid.cell().size().map(|side| 2.0 * side));
    let doubled = cell
        .and_then(|cell| Grid::new(nodes.map(|nodes| 2 * nodes), cell))
        .expect("twice the sides and nodes of a valid grid are a valid grid");
    let fold = |index: usize, nodes: usize| index.min(2 * nodes - 1 - index);
    let heights = (0..doubled.count())
        .map(|node| {
            let [i, j] = doubled.indices(node);
            surface.heights()[fold(i, nodes[0]) * nodes[1] + fold(j, nodes[1])]
        })
        .collect();
    Surface::new(doubled, heights).expect("copies of finite heights")
}

/// Returns the map after multiplication of its heights about the mean by a Tukey window, which
/// fades the edges to the mean height.
///
/// `edge` is the fraction of each side that is faded at each of its two ends, at most one half.
/// With one half, the window is the Hann window, which reduces the variance to (3/8)² on average.
/// Heights and slopes match at the edges, and the interior does not change. The faded rim has lower
/// peaks, which reduces rms height and slope, and additional slopes of order rms height /
/// (`edge` × side).
pub fn taper(surface: &Surface, edge: f64) -> Surface {
    let grid = surface.grid();
    let [window_x, window_y] = grid.nodes().map(|nodes| window(nodes, edge));
    let mean = surface.heights().iter().sum::<f64>() / grid.count() as f64;
    map_nodes(surface, |node, height| {
        let [i, j] = grid.indices(node);
        mean + window_x[i] * window_y[j] * (height - mean)
    })
}

/// Returns the Tukey window on a line of `nodes` nodes. `edge` is the fraction of the line that is
/// faded at each of its two ends.
pub(super) fn window(nodes: usize, edge: f64) -> Vec<f64> {
    let faded = edge.min(0.5) * nodes as f64;
    (0..nodes)
        .map(|index| index.min(nodes - 1 - index) as f64 + 0.5)
        .map(|depth| if depth < faded { libm::sin(PI / 2.0 * depth / faded).powi(2) } else { 1.0 })
        .collect()
}

fn map_nodes(surface: &Surface, change: impl Fn(usize, f64) -> f64) -> Surface {
    let heights =
        surface.heights().iter().enumerate().map(|(node, height)| change(node, *height)).collect();
    Surface::new(surface.grid(), heights).expect("averages of finite heights are finite")
}

/// Returns the trigonometric interpolant of a periodic map on a grid of `nodes` on the same cell.
/// Node (0, 0) keeps its position.
///
/// The interpolation is exact for all waves that both grids resolve. Resampling to a finer grid and
/// back restores the map up to rounding.
///
/// # Panics
/// Panics if N_x or N_y of `nodes` is zero.
pub fn resampled(surface: &Surface, nodes: [usize; 2]) -> Surface {
    let before = surface.grid();
    if before.nodes() == nodes {
        return surface.clone();
    }
    let after = Grid::new(nodes, before.cell())
        .expect("the numbers of nodes are positive and their product does not overflow");
    let [from, to] = [before.nodes(), nodes].map(Transform::<f64>::new);
    let spectrum = from.spectrum(surface.heights());
    let mode = |[row, column]: [usize; 2]| {
        let [nodes_x, nodes_y] = before.nodes();
        let columns = from.spectrum_columns();
        if column < columns {
            spectrum[row * columns + column]
        } else {
            // The mode −k is the complex conjugate of the mode k, because heights are real.
            spectrum[(nodes_x - row) % nodes_x * columns + nodes_y - column].conj()
        }
    };
    let along_x = sources(before.nodes()[0], nodes[0]);
    let along_y = sources(before.nodes()[1], nodes[1]);
    let normalisation = 1.0 / before.count() as f64;
    let modes = along_x.iter().flat_map(|rows| {
        let columns = along_y.iter().take(to.spectrum_columns());
        columns.map(|columns| {
            let mut sum = Complex::default();
            for (row, weight_x) in rows.iter().flatten() {
                for (column, weight_y) in columns.iter().flatten() {
                    sum += mode([*row, *column]) * (weight_x * weight_y);
                }
            }
            sum * normalisation
        })
    });
    Surface::new(after, to.field(modes.collect()))
        .expect("interpolants of finite heights are finite")
}

/// Index of a Fourier coefficient and its weight, or `None` for no contribution.
type Source = Option<(usize, f64)>;

/// Returns, for each Fourier coefficient of a spectrum of length `after`, the coefficients of the
/// spectrum of length `before` that contribute to it, with weights.
///
/// Coefficients at the Nyquist wavenumber are split into halves or summed.
fn sources(before: usize, after: usize) -> Vec<[Source; 2]> {
    let resolved = before.min(after);
    let source = |entry: usize| {
        let wavenumber = magnitude(entry, after);
        let opposite = before - wavenumber.min(before);
        match (2 * wavenumber).cmp(&resolved) {
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
    use crate::topography::moments::Moments;

    /// Creates the surface `height(i, j)` on a grid of square cells with a side of one along x.
    fn surface(nodes: [usize; 2], height: impl Fn(f64, f64) -> f64) -> Surface {
        let grid = rectangle(nodes, [1.0, nodes[1] as f64 / nodes[0] as f64]);
        let height = |node: usize| {
            let [i, j] = grid.indices(node);
            height(i as f64, j as f64)
        };
        Surface::new(grid, (0..grid.count()).map(height).collect()).unwrap()
    }

    fn rough(nodes: [usize; 2]) -> Surface {
        surface(nodes, |i, j| libm::sin(3.0 * i + i * j) + 0.1 * i - 0.3 * j)
    }

    #[test]
    fn detrended_plane_is_zero() {
        for nodes in [[1, 1], [2, 2], [7, 7], [32, 32], [1, 9], [9, 1], [8, 20]] {
            let plane = surface(nodes, |i, j| 5.0 + 0.25 * i - 0.5 * j);
            for height in detrend(&plane).heights() {
                assert!(height.abs() < 1e-13, "{nodes:?}: {height}");
            }
        }
    }

    #[test]
    fn what_remains_has_no_mean_and_no_tilt() {
        let once = detrend(&rough([20, 13]));
        for (once, twice) in once.heights().iter().zip(detrend(&once).heights()) {
            assert!((once - twice).abs() < 1e-14);
        }
    }

    #[test]
    fn detrending_leaves_a_saddle_alone() {
        let saddle = surface([5, 7], |i, j| (i - 2.0) * (j - 3.0));
        for (before, after) in saddle.heights().iter().zip(detrend(&saddle).heights()) {
            assert!((before - after).abs() < 1e-14);
        }
    }

    #[test]
    fn mirrored_map_is_even_and_meets_itself_at_the_edges() {
        for nodes in [[1, 1], [5, 5], [8, 8], [3, 8], [8, 1]] {
            let map = rough(nodes);
            let mirrored = mirror(&map);
            let grid = mirrored.grid();
            let doubled = map.grid().cell().size().map(|side| 2.0 * side);
            assert_eq!(grid.cell().size(), doubled);
            assert_eq!(grid.spacing(), map.grid().spacing());
            let [width, length] = grid.nodes();
            let at = |i: usize, j: usize| mirrored.heights()[i * length + j];
            for [i, j] in (0..grid.count()).map(|node| grid.indices(node)) {
                assert_eq!(at(i, j), at(width - 1 - i, j));
                assert_eq!(at(i, j), at(i, length - 1 - j));
                if i < nodes[0] && j < nodes[1] {
                    assert_eq!(at(i, j), map.heights()[i * nodes[1] + j]);
                }
            }
        }
    }

    #[test]
    fn mirroring_keeps_the_distribution_of_heights() {
        let map = detrend(&rough([16, 12]));
        let (before, after) = (Moments::from_surface(&map), Moments::from_surface(&mirror(&map)));
        assert!((before.rms_height() - after.rms_height()).abs() < 1e-14);
    }

    #[test]
    fn taper_fades_to_the_mean_and_keeps_the_interior() {
        let map = rough([64, 128]);
        let mean = map.heights().iter().sum::<f64>() / 8192.0;
        let tapered = taper(&map, 0.25);
        for (node, (before, after)) in map.heights().iter().zip(tapered.heights()).enumerate() {
            let [i, j] = map.grid().indices(node);
            let [depth_x, depth_y] = [i.min(63 - i), j.min(127 - j)];
            if depth_x >= 16 && depth_y >= 32 {
                assert!((before - after).abs() < 1e-14);
            }
            if depth_x == 0 || depth_y == 0 {
                // The weight of these nodes is sin² of half a node out of sixteen.
                assert!((after - mean).abs() < 0.0025 * (before - mean).abs() + 1e-14);
            }
        }
    }

    #[test]
    fn hann_window_keeps_nine_sixty_fourths_of_the_variance() {
        // A checkerboard has zero mean and unit variance under any smooth weight.
        let checkerboard = surface([64, 64], |i, j| 1.0 - 2.0 * ((i + j) % 2.0));
        let tapered = taper(&checkerboard, 0.5);
        let square: f64 = tapered.heights().iter().map(|h| h * h).sum();
        assert!((square / 4096.0 - 9.0 / 64.0).abs() < 1e-13);
    }

    #[test]
    fn no_edge_means_no_taper() {
        let map = rough([9, 4]);
        for (before, after) in map.heights().iter().zip(taper(&map, 0.0).heights()) {
            assert!((before - after).abs() < 1e-15);
        }
    }

    /// Returns a sum of waves, up to 3 periods along x and 2 along y, on a grid.
    fn waves(nodes: [usize; 2]) -> Surface {
        let grid = rectangle(nodes, [3.0, 2.0]);
        let heights = (0..grid.count()).map(|node| {
            let [i, j] = grid.indices(node);
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
        let heights = (0..16).map(|node| [1.0, -1.0][grid.indices(node)[0] % 2]);
        let wave = Surface::new(grid, heights.collect()).unwrap();
        let finer = resampled(&wave, [16, 4]);
        for node in 0..64 {
            let x = (node / 4) as f64 / 16.0;
            assert!((finer.heights()[node] - libm::cos(2.0 * TAU * x)).abs() < 1e-14);
        }
    }

    #[test]
    fn a_coarser_mesh_has_only_the_waves_that_it_resolves() {
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
