//! Random surfaces with a prescribed height distribution and a prescribed spectrum.
//!
//! A Gaussian surface is the start. Two steps alternate, which Schreiber & Schmitz 1996 introduced
//! for time series, and Pérez-Ràfols & Almqvist 2019 apply to rough surfaces:
//!
//! 1. The heights are replaced in the order of their ranks by the quantiles of the distribution.
//! 2. Each mode gets its modulus back and keeps its phase. Modes outside the spectrum are removed.
//!
//! Each step finds the nearest surface with this distribution, or with this spectrum. The rms
//! difference between the surfaces before and after the first step therefore never grows, and the
//! iterations end when it hardly falls. The second step is the last one. The spectrum, and with it
//! rms height, rms slope and Nayak's parameter, is therefore exact, and the surface has no waves
//! beyond the upper cutoff. The distribution is approximate; [`HeightDistribution::deviation`]
//! measures how closely a surface follows it.
//!
//! The iterations run on a mesh of their own, which depends on the modes and not on the mesh of the
//! surface. Surfaces on different meshes are thus sums of the same waves. Only the phases differ
//! from those of the Gaussian surface, and all of them depend on each other: unlike that of a
//! Gaussian surface, a higher upper cutoff changes the phases of all modes.

use std::f64::consts::SQRT_2;

use rustfft::num_complex::Complex;

use super::draws::{Wave, row_of};
use super::johnson::{Johnson, MomentsError};
use super::surface::Surface;
use crate::fft::Transform;
use crate::theory::persson::erfc_inverse;
use crate::threads::Threads;

/// Number of nodes per shortest wave of the mesh of the iterations. With more nodes, skewness and
/// kurtosis change by less than a thousandth.
const NODES_PER_WAVE: usize = 3;
/// Minimum number of nodes of this mesh along an axis, so that the distribution is resolved if
/// there are few waves.
const MIN_NODES: usize = 48;
/// Maximum number of iterations. It takes about 30 to reach a skewness of −1, and 80 for −2.
const MAX_ITERATIONS: usize = 100;
/// Relative fall of the rms difference per iteration below which the iterations end.
const SLOW: f64 = 0.01;

/// Shape of a height distribution: that of the heights about their mean in units of the rms height.
#[derive(Debug, Clone, PartialEq)]
pub enum HeightDistribution {
    /// A distribution of Johnson's system.
    Johnson(Johnson),
    /// The distribution of a sample of heights, which are in ascending order. Between them,
    /// quantiles are linear.
    Sample(Vec<f64>),
}

impl HeightDistribution {
    /// Returns the distribution of Johnson's system with this skewness and kurtosis (3 for a
    /// Gaussian surface).
    ///
    /// # Errors
    /// Fails if there is no such distribution, see [`Johnson::with_moments`].
    pub fn from_moments(skewness: f64, kurtosis: f64) -> Result<Self, MomentsError> {
        Johnson::with_moments(skewness, kurtosis).map(Self::Johnson)
    }

    /// Returns the distribution of the heights of a surface, or `None` for a flat surface.
    pub fn from_surface(surface: &Surface) -> Option<Self> {
        let mut heights = surface.heights().to_vec();
        heights.sort_unstable_by(f64::total_cmp);
        standardise(&mut heights).then_some(Self::Sample(heights))
    }

    /// Returns the rms difference between the sorted heights of a surface and the quantiles of the
    /// distribution, in units of the rms height. Returns `None` for a flat surface.
    ///
    /// This is the Wasserstein distance of order two between both distributions. That of a normal
    /// distribution to one with skewness −1 and kurtosis 5 is 0.22.
    pub fn deviation(&self, surface: &Surface) -> Option<f64> {
        let Some(Self::Sample(heights)) = Self::from_surface(surface) else {
            return None;
        };
        let quantiles = self.quantiles(heights.len());
        let squares = heights.iter().zip(&quantiles).map(|(one, other)| (one - other).powi(2));
        Some((squares.sum::<f64>() / heights.len() as f64).sqrt())
    }

    /// Returns `count` ascending heights with this distribution, with mean zero and a mean square
    /// of one: the quantiles of the probabilities (i + 1/2)/`count`.
    fn quantiles(&self, count: usize) -> Vec<f64> {
        let probability = |index: usize| (index as f64 + 0.5) / count as f64;
        let mut quantiles: Vec<f64> = match self {
            Self::Johnson(johnson) => {
                let mut quantiles = vec![johnson.at(0.0); count];
                for index in 0..count / 2 {
                    let z = SQRT_2
                        * erfc_inverse(2.0 * probability(index)).expect("is between 0 and 1");
                    quantiles[index] = johnson.at(-z);
                    quantiles[count - 1 - index] = johnson.at(z);
                }
                quantiles
            }
            Self::Sample(heights) => {
                let last = heights.len() - 1;
                let at = |index: usize| {
                    let position =
                        (probability(index) * heights.len() as f64 - 0.5).clamp(0.0, last as f64);
                    let below = position as usize;
                    let fraction = position - below as f64;
                    let [low, high] = [heights[below], heights[(below + 1).min(last)]];
                    low + fraction * (high - low)
                };
                (0..count).map(at).collect()
            }
        };
        standardise(&mut quantiles);
        quantiles
    }
}

/// Subtracts the mean and divides by the root mean square. Returns `false`, and leaves the values
/// unchanged, if all are equal.
fn standardise(ascending: &mut [f64]) -> bool {
    if ascending.first() == ascending.last() {
        return false;
    }
    let count = ascending.len() as f64;
    let mean = ascending.iter().sum::<f64>() / count;
    ascending.iter_mut().for_each(|value| *value -= mean);
    let rms = (ascending.iter().map(|value| value * value).sum::<f64>() / count).sqrt();
    ascending.iter_mut().for_each(|value| *value /= rms);
    true
}

/// Changes the phases of the waves such that their sum has a height distribution, as far as
/// possible. Moduli do not change.
pub(super) fn adjust_phases(
    waves: &mut [Wave],
    distribution: &HeightDistribution,
    threads: &Threads,
) {
    let rms_height = waves.iter().map(|wave| 2.0 * wave.coefficient.norm_sqr()).sum::<f64>().sqrt();
    let [nodes_x, nodes_y] = own_mesh(waves);
    let count = nodes_x * nodes_y;
    let mut quantiles = distribution.quantiles(count);
    quantiles.iter_mut().for_each(|height| *height *= rms_height);

    let transform = Transform::new([nodes_x, nodes_y]);
    let columns = transform.spectrum_columns();
    let scratch = &mut transform.scratch_on(threads.clone());
    let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
    let mut heights = vec![0.0; count];
    let mut ranked: Vec<(f64, u32)> = Vec::with_capacity(count);
    let mut difference = f64::INFINITY;
    for _ in 0..MAX_ITERATIONS {
        spectrum.fill(Complex::default());
        for Wave { waves: [k_x, k_y], coefficient } in &*waves {
            spectrum[row_of(*k_x, nodes_x) * columns + *k_y as usize] = *coefficient;
            if *k_y == 0 {
                spectrum[row_of(-k_x, nodes_x) * columns] = coefficient.conj();
            }
        }
        transform.inverse(&mut spectrum, &mut heights, scratch);

        ranked.clear();
        ranked.extend(heights.iter().copied().zip(0..));
        ranked.sort_unstable_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        let mut squares = 0.0;
        for ((height, node), quantile) in ranked.iter().zip(&quantiles) {
            squares += (height - quantile).powi(2);
            heights[*node as usize] = *quantile;
        }

        transform.forward(&heights, &mut spectrum, scratch);
        for Wave { waves: [k_x, k_y], coefficient } in &mut *waves {
            let value = spectrum[row_of(*k_x, nodes_x) * columns + *k_y as usize];
            let modulus = value.norm();
            if modulus > 0.0 {
                *coefficient = coefficient.norm() / modulus * value;
            }
        }

        let before = std::mem::replace(&mut difference, (squares / count as f64).sqrt());
        if difference > (1.0 - SLOW) * before {
            break;
        }
    }
}

/// Returns the number of nodes along x and y of the mesh on which phases are adjusted. It depends
/// on the waves alone.
fn own_mesh(waves: &[Wave]) -> [usize; 2] {
    [0, 1].map(|axis| {
        let most = waves.iter().map(|wave| wave.waves[axis].unsigned_abs()).max();
        let needed = (NODES_PER_WAVE * most.unwrap_or(0) as usize).max(MIN_NODES);
        // Transforms are fast if the nodes have small factors.
        let has_small_factors = |nodes: &usize| {
            let odd = nodes >> nodes.trailing_zeros();
            odd < *nodes && [1, 3, 5, 9, 15, 25, 27, 45].contains(&odd)
        };
        (needed..).find(has_small_factors).expect("powers of two have no bound")
    })
}

/// Returns the number of nodes of the mesh on which the phases of modes are adjusted, if there are
/// at most `max_waves` waves along x and y.
pub fn nodes_of_iterations(max_waves: [u32; 2]) -> usize {
    let longest =
        Wave { waves: max_waves.map(|waves| waves as i32), coefficient: Complex::default() };
    own_mesh(&[longest]).iter().product()
}

/// Largest number of iterations, each with a pair of transforms, for forecasts.
pub const ITERATIONS: f64 = MAX_ITERATIONS as f64;

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use super::*;
    use crate::grid::Boundary;
    use crate::grid::samples::{cell, rectangle, square};
    use crate::topography::descriptors::skewness_and_excess_kurtosis;
    use crate::topography::moments::Moments;
    use crate::topography::power_spectrum;
    use crate::topography::random::{RandomSurface, samples::random};
    use crate::topography::spectral_density::{SpectralDensity, TabulatedSurface};

    fn johnson(skewness: f64, kurtosis: f64) -> HeightDistribution {
        HeightDistribution::from_moments(skewness, kurtosis).unwrap()
    }

    /// Returns skewness and kurtosis of a surface.
    fn shape(surface: &Surface) -> [f64; 2] {
        let (skewness, excess) = skewness_and_excess_kurtosis(surface).unwrap();
        [skewness, excess + 3.0]
    }

    fn draw(random: &RandomSurface, nodes: usize, heights: &HeightDistribution) -> Surface {
        random.draw_on(&Threads::one(), square(nodes, 1.0), Some(heights))
    }

    #[test]
    fn skewness_and_kurtosis_are_reached() {
        let random = random(4, 64, 3);
        for [skewness, kurtosis] in [[-1.0, 5.0], [-2.0, 10.0], [0.0, 2.0], [1.0, 4.0], [0.0, 3.0]]
        {
            let heights = johnson(skewness, kurtosis);
            let surface = draw(&random, 256, &heights);
            let [found_skewness, found_kurtosis] = shape(&surface);
            let case = format!("({skewness}, {kurtosis}): {found_skewness}, {found_kurtosis}");
            assert!((found_skewness - skewness).abs() < 0.03, "{case}");
            assert!((found_kurtosis / kurtosis - 1.0).abs() < 0.03, "{case}");
            let deviation = heights.deviation(&surface).unwrap();
            assert!(deviation < 0.02, "{case}: {deviation}");
        }
    }

    #[test]
    fn every_mode_keeps_its_power() {
        let random = random(2, 30, 5);
        for grid in [square(128, 1.0), rectangle([64, 96], [1.0, 0.75])] {
            let skewed = random.draw_on(&Threads::one(), grid, Some(&johnson(-1.5, 6.0)));
            let gaussian = random.draw(grid);
            let [found, exact] = [&skewed, &gaussian]
                .map(|surface| power_spectrum::rings(surface, Boundary::Periodic));
            let most = exact.iter().map(|ring| ring.density).fold(0.0, f64::max);
            for (found, exact) in found.iter().zip(&exact) {
                assert!((found.density - exact.density).abs() < 1e-13 * most, "{exact:?}");
            }
            let [found, exact] = [&skewed, &gaussian].map(Moments::from_surface);
            assert!((found.rms_slope() / exact.rms_slope() - 1.0).abs() < 1e-12);
            assert!((found.m40 / exact.m40 - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn every_mesh_shows_the_same_surface() {
        let random = random(4, 32, 7);
        let heights = johnson(-1.0, 5.0);
        let [coarse, fine] = [64, 192].map(|nodes| draw(&random, nodes, &heights));
        let rms_height = random.moments(cell(1.0)).rms_height();
        for (node, height) in coarse.heights().iter().enumerate() {
            let shared = fine.heights()[3 * (node / 64) * 192 + 3 * (node % 64)];
            assert!((height - shared).abs() < 1e-12 * rms_height);
        }
        let [coarse, fine] = [coarse, fine].map(|surface| shape(&surface));
        assert!((coarse[0] - fine[0]).abs() < 0.02 && (coarse[1] - fine[1]).abs() < 0.1);
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        // 540² nodes are enough for two threads.
        let random = random(4, 175, 1);
        let heights = johnson(-1.0, 5.0);
        let drawn = [1, 3].map(|threads| {
            let threads = Threads::new(NonZeroUsize::new(threads).unwrap());
            random.draw_on(&threads, square(512, 1.0), Some(&heights))
        });
        assert!(drawn[0] == drawn[1]);
    }

    #[test]
    fn heights_of_another_surface_are_those_of_its_sample() {
        let other = draw(&random(2, 20, 1), 96, &johnson(-1.5, 6.0));
        let heights = HeightDistribution::from_surface(&other).unwrap();
        assert!(heights.deviation(&other).unwrap() < 1e-12);
        let surface = draw(&random(4, 64, 2), 256, &heights);
        let [found, exact] = [&surface, &other].map(shape);
        assert!((found[0] - exact[0]).abs() < 0.03, "{found:?} {exact:?}");
        assert!((found[1] / exact[1] - 1.0).abs() < 0.03, "{found:?} {exact:?}");
    }

    #[test]
    fn tabulated_spectra_keep_their_slope() {
        let points = [4.0, 60.0].map(|k: f64| [std::f64::consts::TAU * k, 1e-6 * k.powf(-3.0)]);
        let density = SpectralDensity::from_points(points.to_vec()).unwrap();
        // The density extends beyond the waves that 64 nodes resolve.
        let tabulated =
            TabulatedSurface { density: &density, rms_slope: Some(0.2), seed: 1, realization: 0 };
        let grid = square(64, 1.0);
        let surface = tabulated.draw_on(&Threads::one(), grid, Some(&johnson(-1.0, 4.5)));
        let slope = Moments::from_surface(&surface).rms_slope();
        assert!((slope / 0.2 - 1.0).abs() < 1e-12, "{slope}");
        let [skewness, kurtosis] = shape(&surface);
        assert!((skewness + 1.0).abs() < 0.1 && (kurtosis - 4.5).abs() < 0.5);
    }

    #[test]
    fn few_modes_cannot_follow_a_distribution() {
        let one_ring = random(1, 1, 3);
        let heights = johnson(-2.0, 10.0);
        let surface = draw(&one_ring, 32, &heights);
        assert!(heights.deviation(&surface).unwrap() > 0.2);
        assert!(
            HeightDistribution::from_surface(&Surface::new(square(4, 1.0), vec![1.0; 16]).unwrap())
                .is_none()
        );
    }
}
