//! Areal Gaussian filter of ISO 16610-61.
//!
//! The weighting function is s(x, y) = exp(−π (x² + y²)/(αλ_c)²)/(αλ_c)² with α = √(ln 2/π). A wave
//! of length λ has the [`transmission`] exp(−π (αλ_c/λ)²) in all directions, which is one half at
//! the cutoff λ_c.
//!
//! On a periodic map, each mode is multiplied by its transmission. On other maps, the weights are
//! normalised over the nodes inside the map. Near an edge the mean is therefore one-sided. The
//! weighting function is a product of functions of x and y, so rows and columns are averaged one
//! after the other.

use std::f64::consts::{LN_2, PI};

use super::moments::modes_mut;
use super::surface::Surface;
use crate::fft::Transform;

/// Exponent x above which weights e^(−x) are omitted: e^(−40) = 4e−18 is below rounding errors.
const NEGLIGIBLE: f64 = 40.0;

/// Returns the factor by which [`low_pass`] multiplies the amplitude of a wave:
/// 2^(−(cutoff/wavelength)²).
///
/// Cutoff and wavelength are in the same unit.
///
/// ```
/// use asperity_mechanics::topography::gaussian::transmission;
///
/// assert!((transmission(0.8, 0.8) - 0.5).abs() < 1e-15);
/// assert!((transmission(0.8, 1.6) - 0.5_f64.powf(0.25)).abs() < 1e-15);
/// ```
pub fn transmission(cutoff: f64, wavelength: f64) -> f64 {
    // exp(−π α² (λ_c/λ)²)
    libm::exp(-LN_2 * (cutoff / wavelength).powi(2))
}

/// Returns the waviness of a map: the map after the Gaussian low-pass filter.
///
/// A wave keeps the fraction [`transmission`] of its amplitude: one half at `cutoff`, and less if
/// it is shorter.
///
/// The cutoff is in the unit of the sides. `is_periodic` selects the filter of periodic maps.
pub fn low_pass(surface: &Surface, cutoff: f64, is_periodic: bool) -> Surface {
    let means = if is_periodic {
        filter_modes(surface, |wavenumber| transmission(cutoff, 1.0 / wavenumber))
    } else {
        average_inside(surface, cutoff)
    };
    Surface::new(surface.grid(), means).expect("means of finite heights are finite")
}

/// Returns the roughness of a map: the map minus the result of [`low_pass`].
///
/// A wave keeps the fraction 1 − [`transmission`] of its amplitude: one half at `cutoff`, and less
/// if it is longer. The mean height is removed. The parameters are those of [`low_pass`].
pub fn high_pass(surface: &Surface, cutoff: f64, is_periodic: bool) -> Surface {
    let waviness = low_pass(surface, cutoff, is_periodic);
    let heights = surface.heights().iter().zip(waviness.heights());
    let rough = heights.map(|(height, mean)| height - mean);
    Surface::new(surface.grid(), rough.collect()).expect("differences of heights are finite")
}

/// Returns the heights after multiplication of each mode by `factor(1/λ)`, with the wavelength λ of
/// the mode.
fn filter_modes(surface: &Surface, factor: impl Fn(f64) -> f64) -> Vec<f64> {
    let grid = surface.grid();
    let [side_x, side_y] = grid.cell().size();
    let transform = Transform::new(grid.nodes());
    let mut spectrum = transform.spectrum(surface.heights());
    for ([k_x, k_y], value) in modes_mut(&mut spectrum, grid.nodes()) {
        let (along_x, along_y) = (k_x / side_x, k_y / side_y);
        let wavenumber = (along_x * along_x + along_y * along_y).sqrt();
        *value *= factor(wavenumber) / grid.count() as f64;
    }
    transform.field(spectrum)
}

/// Returns the heights after the low-pass filter for maps that are not periodic: for each node, the
/// weighted mean over the nodes inside the map.
fn average_inside(surface: &Surface, cutoff: f64) -> Vec<f64> {
    let grid = surface.grid();
    let [nodes_x, nodes_y] = grid.nodes();
    let [along_x, along_y] = [0, 1].map(|axis| weights(cutoff / grid.spacing()[axis]));
    // With heights relative to the first one, rounding errors do not depend on the mean height.
    let reference = surface.heights()[0];
    let heights: Vec<f64> = surface.heights().iter().map(|height| height - reference).collect();
    let mut rows = vec![0.0; heights.len()];
    let norms = normalisation(nodes_x, &along_x);
    for (i, row) in rows.chunks_exact_mut(nodes_y).enumerate() {
        for (other, weight) in neighbours(i, nodes_x, &along_x) {
            add(row, &heights[other * nodes_y..][..nodes_y], weight / norms[i]);
        }
    }
    let norms = normalisation(nodes_y, &along_y);
    let mut means = vec![reference; heights.len()];
    for (row, means) in rows.chunks_exact(nodes_y).zip(means.chunks_exact_mut(nodes_y)) {
        let mut sums = vec![0.0; nodes_y];
        for (steps, &weight) in along_y.iter().enumerate().take(nodes_y) {
            add(&mut sums[..nodes_y - steps], &row[steps..], weight);
            if steps > 0 {
                add(&mut sums[steps..], &row[..nodes_y - steps], weight);
            }
        }
        let all = means.iter_mut().zip(sums).zip(&norms);
        all.for_each(|((mean, sum), norm)| *mean += sum / norm);
    }
    means
}

/// Returns the weights of nodes at a distance of 0, 1, 2, … grid spacings, relative to the weight
/// at 0. `cutoff` is in grid spacings.
fn weights(cutoff: f64) -> Vec<f64> {
    // π/α² = π²/ln 2
    let exponent = |steps: usize| PI * PI / LN_2 * (steps as f64 / cutoff).powi(2);
    let exponents = (0..).map(exponent).take_while(|exponent| *exponent < NEGLIGIBLE);
    exponents.map(|exponent| libm::exp(-exponent)).collect()
}

/// Iterates, in ascending order, over the nodes of a line that contribute to the mean at `node`,
/// with their weights. The line has `nodes` nodes.
fn neighbours(node: usize, nodes: usize, weights: &[f64]) -> impl Iterator<Item = (usize, f64)> {
    let reach = weights.len() - 1;
    let within = node.saturating_sub(reach)..=(node + reach).min(nodes - 1);
    within.map(move |other| (other, weights[other.abs_diff(node)]))
}

/// Returns, for each node of a line, the sum of the weights of its [`neighbours`].
fn normalisation(nodes: usize, weights: &[f64]) -> Vec<f64> {
    let sum = |node: usize| neighbours(node, nodes, weights).map(|(_, weight)| weight).sum();
    (0..nodes).map(sum).collect()
}

fn add(sums: &mut [f64], heights: &[f64], weight: f64) {
    for (sum, height) in sums.iter_mut().zip(heights) {
        *sum += weight * height;
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::grid::samples::rectangle;

    fn surface(nodes: [usize; 2], size: [f64; 2], height: impl Fn(f64, f64) -> f64) -> Surface {
        let grid = rectangle(nodes, size);
        let [step_x, step_y] = grid.spacing();
        let heights = (0..grid.count()).map(|node| {
            let [i, j] = grid.indices(node);
            height(i as f64 * step_x, j as f64 * step_y)
        });
        Surface::new(grid, heights.collect()).unwrap()
    }

    #[test]
    fn half_of_a_wave_at_the_cutoff_passes_in_any_direction() {
        let size = [2.0, 1.5];
        for waves in [[4.0, 0.0], [0.0, 3.0], [4.0, 3.0]] {
            let along = [waves[0] / size[0], waves[1] / size[1]];
            let phase = |x: f64, y: f64| TAU * (along[0] * x + along[1] * y) + 0.3;
            let wave = surface([40, 54], size, |x, y| 5.0 + libm::cos(phase(x, y)));
            let cutoff = 1.0 / (along[0] * along[0] + along[1] * along[1]).sqrt();
            let [low, high] = [low_pass, high_pass].map(|filter| filter(&wave, cutoff, true));
            for ((height, low), high) in
                wave.heights().iter().zip(low.heights()).zip(high.heights())
            {
                assert!((low - 5.0 - (height - 5.0) / 2.0).abs() < 1e-14);
                assert!((high - (height - 5.0) / 2.0).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn far_from_the_edges_of_an_open_map_waves_pass_as_those_of_a_periodic_one() {
        // Sums over nodes differ from integrals by 2^(−(λ_c/Δ − λ_c/λ)²): 2^(−196) at 15 steps.
        let wave = surface([240, 90], [24.0, 9.0], |x, _| libm::cos(TAU * x / 1.5));
        for cutoff in [1.5, 3.0] {
            let passed = low_pass(&wave, cutoff, false);
            let share = transmission(cutoff, 1.5);
            for i in 100..140 {
                for j in 0..90 {
                    let (found, whole) = (passed.heights()[i * 90 + j], wave.heights()[i * 90 + j]);
                    assert!((found - share * whole).abs() < 1e-14, "{found} {whole}");
                }
            }
        }
    }

    #[test]
    fn a_constant_is_its_own_mean_up_to_the_edges() {
        let flat = surface([9, 30], [0.9, 3.0], |_, _| 7.5);
        for is_periodic in [false, true] {
            for (low, high) in low_pass(&flat, 2.0, is_periodic)
                .heights()
                .iter()
                .zip(high_pass(&flat, 2.0, is_periodic).heights())
            {
                assert!((low - 7.5).abs() < 1e-14 && high.abs() < 1e-14);
            }
        }
    }

    #[test]
    fn both_filters_together_are_the_map() {
        let rough = surface([13, 21], [1.0, 1.0], |x, y| libm::sin(40.0 * x * y) + x);
        for is_periodic in [false, true] {
            let [low, high] = [low_pass, high_pass].map(|filter| filter(&rough, 0.3, is_periodic));
            for (node, height) in rough.heights().iter().enumerate() {
                let sum = low.heights()[node] + high.heights()[node];
                assert!((sum - height).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn means_inside_a_map_are_those_of_the_definition() {
        let rough = surface([12, 7], [1.2, 1.4], |x, y| libm::sin(9.0 * x) + 3.0 * y);
        let grid = rough.grid();
        let [step_x, step_y] = grid.spacing();
        let passed = low_pass(&rough, 0.5, false);
        for node in 0..grid.count() {
            let [i, j] = grid.indices(node);
            let (mut sum, mut all) = (0.0, 0.0);
            for (other, height) in rough.heights().iter().enumerate() {
                let [k, l] = grid.indices(other);
                let [x, y] = [k as f64 - i as f64, l as f64 - j as f64];
                let square = (x * step_x).powi(2) + (y * step_y).powi(2);
                let alpha = (LN_2 / PI).sqrt();
                let weight = libm::exp(-PI * square / (alpha * 0.5_f64).powi(2));
                sum += weight * height;
                all += weight;
            }
            assert!((passed.heights()[node] - sum / all).abs() < 1e-14);
        }
    }
}
