//! Power spectral densities of a map and of its profiles along an axis.
//!
//! Wavenumbers q = 2π/λ are angular. The density C(q) of a map is normalised so that
//! ∫ C d²q/(2π)² over the plane is the mean square height. The density C₁(q) of profiles is
//! normalised so that ∫ C₁ dq/π over q > 0 is the mean square height.
//!
//! A map that is not periodic is multiplied by the Hann window sin²(π x/L) along each axis, and the
//! density is divided by the mean square of the window. Without the window, the steps between
//! opposite edges would add a tail q^(−2) along the axes. The window correlates neighbouring modes,
//! see [`INDEPENDENT_FRACTION`].

use std::f64::consts::TAU;

use rustfft::num_complex::Complex;

use super::descriptors::deviations;
use super::moments::{multiplicity, signed_wavenumber};
use super::periodic::window;
use super::surface::{Axis, Surface, for_each_line};
use crate::fft::Transform;
use crate::grid::Boundary;

/// Ratio of the number of independent modes to the number of modes, for maps multiplied by the Hann
/// window.
///
/// The equivalent noise bandwidth of the window is 3/2 modes along each axis (Harris 1978).
pub const INDEPENDENT_FRACTION: f64 = 4.0 / 9.0;

/// Ring of modes with wavenumbers |k| that round to the same integer, in units of 2π/L.
///
/// L is the longer side of the cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// Rounded wavenumber, in units of 2π/L.
    pub waves: u32,
    /// Number of modes in the ring. The modes k and −k count as two.
    pub modes: u32,
    /// Mean of C(q) over the modes of the ring, in length⁴.
    pub density: f64,
}

impl Ring {
    /// Returns the angular wavenumber 2π `waves`/L in the middle of the ring, for a cell with the
    /// longer side L.
    pub fn wavenumber(&self, longer_side: f64) -> f64 {
        TAU * f64::from(self.waves) / longer_side
    }
}

/// Computes the radial average of the power spectral density in each ring that contains modes.
///
/// Rings extend to the corners of the spectrum. Beyond the Nyquist wavenumber, they lack the modes
/// along the axes. For a periodic map, Σ C × modes / (L_x L_y) is the mean square height about the
/// mean, up to rounding.
///
/// ```
/// use asperity_mechanics::grid::{Boundary, Grid};
/// use asperity_mechanics::topography::power_spectrum::rings;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// // A wave of amplitude Δ with 3 periods on a cell of side 2: ⟨h²⟩ = Δ²/2. The third ring has 16
/// // modes, and the area of the cell is 4.
/// let wave = Shape::Wave { amplitude: 0.1, waves: 3 }.draw(Grid::square(32, 2.0)?);
/// let rings = rings(&wave, Boundary::Periodic);
/// assert_eq!((rings[2].waves, rings[2].modes), (3, 16));
/// assert!((rings[2].density - 0.005 * 4.0 / 16.0).abs() < 1e-15);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
pub fn rings(surface: &Surface, boundary: Boundary) -> Vec<Ring> {
    let (nodes, cell) = (surface.grid().nodes(), surface.grid().cell());
    let corner = cell.wavenumber(nodes.map(|nodes| (nodes / 2) as f64));
    let mut sums = vec![(0.0, 0.0); corner.round() as usize + 1];
    let unit = for_each_mode(surface, boundary, |waves, modes, power| {
        let ring = cell.wavenumber(waves).round() as usize;
        sums[ring].0 += modes;
        sums[ring].1 += modes * power;
    });
    let ring = |(waves, (modes, power)): (usize, (f64, f64))| {
        (modes > 0.0).then(|| Ring {
            waves: waves as u32,
            modes: modes as u32,
            density: unit * power / modes,
        })
    };
    sums.into_iter().enumerate().filter_map(ring).collect()
}

/// Passes the modes of a map to `with`: the number of waves along x and y, the number of modes ±k
/// that share this entry of the half spectrum, and |ĥ|² up to a factor. Returns the factor that
/// converts |ĥ|² to the density C(q). The mean, and entries that repeat another one, are left out.
pub(super) fn for_each_mode(
    surface: &Surface,
    boundary: Boundary,
    mut with: impl FnMut([f64; 2], f64, f64),
) -> f64 {
    let grid = surface.grid();
    let [nodes_x, nodes_y] = grid.nodes();
    let (heights, square_window) = windowed(surface, boundary);
    let spectrum = Transform::new(grid.nodes()).spectrum(&heights);
    for (i, row) in spectrum.chunks_exact(nodes_y / 2 + 1).enumerate() {
        let k_x = signed_wavenumber(i, nodes_x);
        for (k_y, value) in row.iter().enumerate() {
            let modes = multiplicity(i, k_y, grid.nodes());
            if modes > 0.0 {
                with([k_x, k_y as f64], modes, value.norm_sqr());
            }
        }
    }
    grid.cell().area() / (grid.count() as f64).powi(2) / square_window
}

/// Computes the power spectral density C₁(q) of the profiles along an axis, in length³.
///
/// The wavenumbers are q = 2πn/L with n = 1, …, N/2, for N nodes on the side L along the axis. The
/// density is the mean of |ĥ|² L over all profiles, each relative to its own mean. For a periodic
/// map, the mean square height of the profiles about their means is (2 Σ C₁)/L for odd N, and
/// (2 Σ C₁ − C₁(πN/L))/L for even N.
pub fn profiles(surface: &Surface, axis: Axis, boundary: Boundary) -> Vec<f64> {
    let mut sums = vec![0.0; axis.select(surface.grid().nodes()) / 2];
    let mut lines = 0.0;
    let unit = for_each_profile(surface, axis, boundary, |spectrum| {
        for (sum, value) in sums.iter_mut().zip(spectrum) {
            *sum += value.norm_sqr();
        }
        lines += 1.0;
    });
    sums.into_iter().map(|sum| unit / lines * sum).collect()
}

/// Computes the density C₁(q) of single profiles along an axis, as [`profiles`] does of all.
///
/// If the map has more than `count` profiles, `count` of them are taken at even distances.
pub fn line_spectra(
    surface: &Surface,
    axis: Axis,
    boundary: Boundary,
    count: usize,
) -> Vec<Vec<f64>> {
    let [nodes_x, nodes_y] = surface.grid().nodes();
    let total = match axis {
        Axis::X => nodes_y,
        Axis::Y => nodes_x,
    };
    let taken = count.min(total);
    let mut densities: Vec<Vec<f64>> = Vec::with_capacity(taken);
    let mut line = 0;
    let unit = for_each_profile(surface, axis, boundary, |spectrum| {
        if densities.len() < taken && line == densities.len() * total / taken {
            densities.push(spectrum.iter().map(Complex::norm_sqr).collect());
        }
        line += 1;
    });
    densities.iter_mut().flatten().for_each(|density| *density *= unit);
    densities
}

/// Passes the amplitudes of the modes 1, …, N/2 of each profile along an axis to `with`. Returns
/// the factor that converts |ĥ|² to the density C₁(q).
fn for_each_profile(
    surface: &Surface,
    axis: Axis,
    boundary: Boundary,
    mut with: impl FnMut(&[Complex<f64>]),
) -> f64 {
    let nodes = axis.select(surface.grid().nodes());
    let side = axis.select(surface.grid().cell().size());
    let weights = weights(nodes, boundary);
    let transform = Transform::new([1, nodes]);
    let mut scratch = transform.scratch();
    let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
    for_each_line(surface, axis, |line| {
        let mut line = deviations(line);
        line.iter_mut().zip(&weights).for_each(|(height, weight)| *height *= weight);
        transform.forward(&line, &mut spectrum, &mut scratch);
        with(&spectrum[1..]);
    });
    side / (nodes as f64).powi(2) / mean_square(&weights)
}

/// Returns w (h − ⟨h⟩) for the window w, and ⟨w²⟩.
///
/// The window is one everywhere for a periodic map, and the Hann window otherwise.
pub(super) fn windowed(surface: &Surface, boundary: Boundary) -> (Vec<f64>, f64) {
    let mut heights = deviations(surface.heights());
    let [weights_x, weights_y] = surface.grid().nodes().map(|nodes| weights(nodes, boundary));
    for (row, weight) in heights.chunks_exact_mut(weights_y.len()).zip(&weights_x) {
        for (height, weight_y) in row.iter_mut().zip(&weights_y) {
            *height *= weight * weight_y;
        }
    }
    (heights, mean_square(&weights_x) * mean_square(&weights_y))
}

fn weights(nodes: usize, boundary: Boundary) -> Vec<f64> {
    match boundary {
        Boundary::Periodic => vec![1.0; nodes],
        Boundary::Free => window(nodes, 0.5),
    }
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::{rectangle, square};
    use crate::topography::moments::Moments;
    use crate::topography::random::samples;
    use crate::topography::shapes::Shape;

    fn rough(nodes: [usize; 2], size: [f64; 2]) -> Surface {
        let height = |node: usize| 5.0 + libm::sin(7.0 + (node * node) as f64);
        let grid = rectangle(nodes, size);
        Surface::new(grid, (0..grid.count()).map(height).collect()).unwrap()
    }

    fn assert_close(found: f64, exact: f64) {
        assert!((found - exact).abs() < 1e-12 * exact.abs(), "{found} should be {exact}");
    }

    #[test]
    fn the_density_of_all_modes_is_the_variance_of_the_heights() {
        for (nodes, size) in [([8, 8], [1.0, 1.0]), ([15, 6], [3.0, 0.5]), ([6, 15], [0.2, 0.7])] {
            let surface = rough(nodes, size);
            let sum: f64 = rings(&surface, Boundary::Periodic)
                .iter()
                .map(|ring| ring.density * f64::from(ring.modes))
                .sum();
            assert_close(sum / (size[0] * size[1]), Moments::from_surface(&surface).m00);
        }
    }

    #[test]
    fn every_mode_but_the_mean_is_in_one_ring() {
        for nodes in [[8, 8], [7, 9], [8, 5], [2, 64]] {
            let rings = rings(&rough(nodes, [1.0, 2.0]), Boundary::Periodic);
            let modes: u32 = rings.iter().map(|ring| ring.modes).sum();
            assert_eq!(modes as usize, nodes[0] * nodes[1] - 1);
        }
    }

    #[test]
    fn profiles_have_the_variance_about_their_means() {
        for (nodes, axis) in
            [([8, 6], Axis::X), ([9, 6], Axis::X), ([5, 12], Axis::Y), ([5, 13], Axis::Y)]
        {
            let surface = rough(nodes, [3.0, 2.0]);
            let densities = profiles(&surface, axis, Boundary::Periodic);
            let along = axis.select(nodes);
            let last = densities[densities.len() - 1];
            let once = if along % 2 == 0 { last } else { 0.0 };
            let integral = (2.0 * densities.iter().sum::<f64>() - once) / axis.select([3.0, 2.0]);
            let mut variance = 0.0;
            for_each_line(&surface, axis, |line| {
                let mean = line.iter().sum::<f64>() / line.len() as f64;
                variance += line.iter().map(|h| (h - mean).powi(2)).sum::<f64>();
            });
            assert_close(integral, variance / surface.heights().len() as f64);
        }
    }

    #[test]
    fn a_wave_has_its_power_at_its_own_wavenumber() {
        let wave = Shape::Wave { amplitude: 0.2, waves: 5 };
        let surface = wave.draw(rectangle([32, 16], [2.0, 1.0]));
        let densities = profiles(&surface, Axis::X, Boundary::Periodic);
        // The mean square height is Δ²/2 = 2 C₁/L.
        assert_close(densities[4], 0.02);
        let along_y = profiles(&surface, Axis::Y, Boundary::Periodic);
        assert!(along_y.iter().all(|density| *density < 1e-30));
    }

    #[test]
    fn the_mean_over_single_profiles_is_the_spectrum_of_all() {
        let surface = rough([12, 6], [3.0, 2.0]);
        let all = profiles(&surface, Axis::X, Boundary::Free);
        let lines = line_spectra(&surface, Axis::X, Boundary::Free, 100);
        assert_eq!(lines.len(), 6);
        for (mode, density) in all.iter().enumerate() {
            assert_close(lines.iter().map(|line| line[mode]).sum::<f64>() / 6.0, *density);
        }
        // Lines 0, 1, 3 and 4 are nearly evenly spaced.
        let some = line_spectra(&surface, Axis::X, Boundary::Free, 4);
        assert_eq!(some, [0, 1, 3, 4].map(|line: usize| lines[line].clone()));
    }

    #[test]
    fn the_window_keeps_the_power_of_a_random_surface() {
        let mut random = samples::random(16, 60, 3);
        random.spectrum.k_rolloff = 32;
        let surface = random.draw(square(256, 1.0));
        let [whole, windowed] =
            [Boundary::Periodic, Boundary::Free].map(|boundary| rings(&surface, boundary));
        let power = |rings: &[Ring], waves: std::ops::RangeInclusive<u32>| -> f64 {
            let own = rings.iter().filter(|ring| waves.contains(&ring.waves));
            own.map(|ring| ring.density * f64::from(ring.modes)).sum()
        };
        // Of about 3200 modes, 4/9 are independent under the window: an error of 3.7 %. The
        // tolerance is two such errors.
        let ratio = power(&windowed, 20..=50) / power(&whole, 20..=50);
        assert!((ratio - 1.0).abs() < 0.075, "{ratio}");
    }

    #[test]
    fn an_inclined_plane_has_no_tail_under_the_window() {
        let plane = |grid: crate::grid::Grid| {
            let heights = (0..grid.count()).map(|node| grid.indices(node)[0] as f64);
            Surface::new(grid, heights.collect()).unwrap()
        };
        let surface = plane(square(128, 1.0));
        let [periodic, free] = [Boundary::Periodic, Boundary::Free].map(|boundary| {
            let densities = profiles(&surface, Axis::X, boundary);
            densities[40] / densities[1]
        });
        // The density of a sawtooth falls as q^(−2), under the Hann window as q^(−6).
        assert!(periodic > 1e-3, "{periodic}");
        assert!(free < 1e-6, "{free}");
    }
}
