//! Scalar parameters of a surface, and a test of the assumptions of contact theories.
//!
//! - [`Descriptors`]: spectral moments, parameters of the height distribution, and the load of full
//!   contact;
//! - [`Roughness`]: areal parameters with their names in ISO 25178-2;
//! - [`Statistics`]: departures from isotropic Gaussian roughness.
//!
//! Persson's theory, the asperity models, and Nayak's α and density of summits assume isotropic
//! Gaussian roughness. Ground, worn or wavy surfaces with the same moments m₀, m₂ and m₄ have a
//! different contact area.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex;

use super::differences;
use super::moments::{Moments, signed_wavenumber};
use super::surface::Surface;
use crate::fft::Transform;
use crate::grid::{Boundary, Grid};
use crate::threads::Threads;

/// Scalar descriptors of a periodic surface, with lengths in the unit of its heights.
///
/// For a flat surface, skewness, kurtosis and Nayak's parameter are `None` and all others are zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Descriptors {
    /// Spectral moments of the heights.
    pub moments: Moments,
    /// Rms height √⟨h²⟩ about the mean.
    pub rms_height: f64,
    /// Rms slope √⟨|∇h|²⟩ of the surface.
    pub rms_slope: f64,
    /// Nayak's parameter α = m₀ m₄/m₂².
    pub nayak: Option<f64>,
    /// Density of summits of an isotropic Gaussian surface with these moments, √3/(18π) m₄/m₂, in
    /// 1/length².
    pub summit_density: f64,
    /// Number of summits per area (L/2π)², where L is the longer side of the cell.
    pub summit_density_integer: f64,
    /// Skewness ⟨h³⟩/⟨h²⟩^(3/2) of the heights; zero for a Gaussian distribution.
    pub skewness: Option<f64>,
    /// Excess kurtosis ⟨h⁴⟩/⟨h²⟩² − 3 of the heights; zero for a Gaussian distribution.
    pub excess_kurtosis: Option<f64>,
    /// Effective number of independent modes, see [`Moments::effective_modes`].
    pub effective_modes: f64,
    /// Minimum load p₀/(E* h′) at which all nodes are in contact.
    ///
    /// In full contact, the pressure is p₀ + (E*/2) F⁻¹(|q| ĥ). Contact is full if the minimum of
    /// this pressure is not negative. The load is exact for these nodes. A coarser grid does not
    /// resolve the deepest valleys.
    pub full_contact_load: f64,
}

impl Descriptors {
    /// Computes the descriptors of a periodic surface.
    pub fn from_surface(surface: &Surface) -> Self {
        Self::from_surface_on(&Threads::one(), surface)
    }

    /// Computes the same as [`Descriptors::from_surface`], with several threads.
    pub fn from_surface_on(threads: &Threads, surface: &Surface) -> Self {
        let grid = surface.grid();
        let mut heights = from_first_node(surface.heights());

        let transform = Transform::new(grid.nodes());
        let mut scratch = transform.scratch_on(threads.clone());
        let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
        transform.forward(&heights, &mut spectrum, &mut scratch);
        let (moments, shape) = threads.join(
            grid.count(),
            || Moments::from_half_spectrum(&spectrum, grid),
            || distribution_shape(&heights),
        );
        let (skewness, excess_kurtosis) = shape.unzip();
        multiply_by_half_wavenumber(threads, &mut spectrum, grid);
        transform.inverse(&mut spectrum, &mut heights, &mut scratch);
        let deepest = heights.iter().copied().fold(0.0, f64::min);

        let rms_slope = moments.rms_slope();
        Self {
            moments,
            rms_height: moments.rms_height(),
            rms_slope,
            nayak: moments.nayak(),
            summit_density: moments.summit_density(),
            summit_density_integer: moments.summit_density_integer(grid.cell()),
            skewness,
            excess_kurtosis,
            effective_modes: moments.effective_modes(),
            full_contact_load: if rms_slope > 0.0 { -deepest / rms_slope } else { 0.0 },
        }
    }
}

/// Returns the heights minus the height of the first node. They are exactly zero for a flat
/// surface.
pub(super) fn from_first_node(heights: &[f64]) -> Vec<f64> {
    heights.iter().map(|height| height - heights[0]).collect()
}

/// Returns the heights less their mean.
pub(super) fn deviations(heights: &[f64]) -> Vec<f64> {
    let mut deviations = from_first_node(heights);
    let mean = deviations.iter().sum::<f64>() / deviations.len() as f64;
    deviations.iter_mut().for_each(|height| *height -= mean);
    deviations
}

/// Returns skewness and excess kurtosis of the heights, or `None` for a flat surface.
pub fn skewness_and_excess_kurtosis(surface: &Surface) -> Option<(f64, f64)> {
    distribution_shape(&from_first_node(surface.heights()))
}

/// Returns skewness and excess kurtosis of the values, or `None` if all are equal.
fn distribution_shape(values: &[f64]) -> Option<(f64, f64)> {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let [mut second, mut third, mut fourth] = [0.0; 3];
    for value in values {
        let deviation = value - mean;
        let square = deviation * deviation;
        second += square;
        third += square * deviation;
        fourth += square * square;
    }
    let variance = second / count;
    (variance > 0.0).then(|| {
        let skewness = third / count / (variance * variance.sqrt());
        (skewness, fourth / count / (variance * variance) - 3.0)
    })
}

/// Multiplies the half spectrum of heights by |q|/2, which gives the half spectrum of the
/// full-contact pressures in units of E*. Includes the factor 1/(N_x N_y) of the inverse transform.
fn multiply_by_half_wavenumber(threads: &Threads, spectrum: &mut [Complex<f64>], grid: Grid) {
    let ([nodes_x, nodes_y], cell) = (grid.nodes(), grid.cell());
    let factor = 0.5 * TAU / cell.longer_side() / grid.count() as f64;
    let mut rows: Vec<(usize, &mut [Complex<f64>])> =
        spectrum.chunks_exact_mut(nodes_y / 2 + 1).enumerate().collect();
    let multiply = |(): &mut (), (i, row): &mut (usize, &mut [Complex<f64>])| {
        let k_x = signed_wavenumber(*i, nodes_x);
        for (k_y, value) in row.iter_mut().enumerate() {
            *value *= factor * cell.wavenumber([k_x, k_y as f64]);
        }
    };
    let workers = threads.workers(grid.count());
    workers.for_each(&mut Vec::new(), || (), &mut rows, multiply);
}

/// Height parameters of ISO 25178-2:2021, 4.2, and the gradient Sdq (4.4.2), of heights about their
/// mean.
///
/// [`Roughness::from_surface`] does not level or filter the map; see
/// [`preparation`](super::preparation).
///
/// ```
/// use asperity_mechanics::grid::{Boundary, Grid};
/// use asperity_mechanics::topography::descriptors::Roughness;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// // A wave of amplitude Δ: Sq = Δ/√2, Sz = 2Δ, Sku = 3/2.
/// let wave = Shape::Wave { amplitude: 0.1, waves: 1 }.draw(Grid::square(64, 1.0)?);
/// let found = Roughness::from_surface(&wave, Boundary::Periodic);
/// assert!((found.sq - 0.1 * 0.5_f64.sqrt()).abs() < 1e-15);
/// assert!((found.sz - 0.2).abs() < 1e-15);
/// assert!((found.sku.unwrap() - 1.5).abs() < 1e-12);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roughness {
    /// Root mean square height Sq.
    pub sq: f64,
    /// Arithmetic mean height Sa, the mean of |h|.
    pub sa: f64,
    /// Maximum peak height Sp, the height of the highest node above the mean.
    pub sp: f64,
    /// Maximum pit depth Sv, the depth of the lowest node below the mean.
    pub sv: f64,
    /// Maximum height Sz, the difference between the highest and the lowest node.
    pub sz: f64,
    /// Skewness Ssk, or `None` for a flat surface.
    pub ssk: Option<f64>,
    /// Kurtosis Sku, 3 for a Gaussian distribution; `None` for a flat surface.
    pub sku: Option<f64>,
    /// Root mean square gradient Sdq.
    ///
    /// For a periodic map, it is computed from Fourier modes; for other maps, from finite
    /// differences.
    pub sdq: f64,
}

impl Roughness {
    /// Computes the parameters of a surface. `boundary` selects how slopes are computed.
    pub fn from_surface(surface: &Surface, boundary: Boundary) -> Self {
        let heights = from_first_node(surface.heights());
        let count = heights.len() as f64;
        let mean = heights.iter().sum::<f64>() / count;
        let mean_of = |value: fn(f64) -> f64| {
            let deviations = heights.iter().map(|height| value(height - mean));
            deviations.sum::<f64>() / count
        };
        let (ssk, excess) = skewness_and_excess_kurtosis(surface).unzip();
        let [highest, lowest] = [f64::max, f64::min]
            .map(|pick: fn(f64, f64) -> f64| heights.iter().copied().fold(0.0, pick));
        Self {
            sq: mean_of(|deviation| deviation * deviation).sqrt(),
            sa: mean_of(f64::abs),
            sp: highest - mean,
            sv: mean - lowest,
            sz: highest - lowest,
            ssk,
            sku: excess.map(|excess: f64| excess + 3.0),
            sdq: differences::moments_within(surface, boundary).rms_slope(),
        }
    }
}

/// Maximum ratio of moments along x and y, m₂₀/m₀₂ or m₄₀/m₀₄ or their inverses, of a surface that
/// counts as isotropic.
///
/// None of 1600 random isotropic surfaces with H = 0.3 and 0.8, k_lower = 1, 2, 4 and 8 and
/// k_upper = 32 reached it.
const ISOTROPIC: f64 = 1.5;

/// Maximum |skewness| of a surface that counts as Gaussian.
///
/// With H = 0.8 and k_lower = 1, 12 % of random surfaces exceed it, because they have about five
/// effective modes. With k_lower = 2, 1 % exceed it; with k_lower ≥ 4, none.
const SYMMETRIC: f64 = 0.5;

/// Maximum |excess kurtosis| of a surface that counts as Gaussian.
///
/// With k_lower = 1, 1.5 % of the random surfaces of [`SYMMETRIC`] exceed it; with larger k_lower,
/// none.
const MESOKURTIC: f64 = 1.0;

/// Minimum [`Moments::effective_modes`] of a surface that counts as Gaussian.
///
/// With n modes of fixed amplitude, the excess kurtosis is −1.5/n.
const ENOUGH_MODES: f64 = 10.0;

/// Statistics of surfaces (means over several surfaces) that can show anisotropy and non-Gaussian
/// heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Spectral moments m₂₀ and m₀₂: mean square slopes along x and y.
    pub slopes: [f64; 2],
    /// Spectral moments m₄₀ and m₀₄: mean square curvatures along x and y.
    pub curvatures: [f64; 2],
    /// Spectral moment m₂₂, which equals m₄/3 for isotropic surfaces.
    pub mixed: f64,
    /// Skewness of the heights, or `None` if it is unknown.
    pub skewness: Option<f64>,
    /// Excess kurtosis of the heights, or `None` if it is unknown.
    pub excess_kurtosis: Option<f64>,
    /// Effective number of independent modes, see [`Moments::effective_modes`].
    pub effective_modes: f64,
}

impl Statistics {
    /// Returns the name and value of each statistic that contradicts isotropic Gaussian roughness.
    ///
    /// The list is empty if no statistic contradicts it.
    pub fn departures(&self) -> Vec<String> {
        let [[along_x, along_y], [bent_x, bent_y]] = [self.slopes, self.curvatures];
        let pairs = [
            ("m₂₀/m₀₂", along_x, along_y),
            ("m₄₀/m₀₄", bent_x, bent_y),
            ("3 m₂₂/m₄", 3.0 * self.mixed, (bent_x + bent_y) / 2.0),
        ];
        let ratios = pairs.into_iter().filter_map(|(name, one, other)| {
            let is_alike = one <= ISOTROPIC * other && other <= ISOTROPIC * one;
            (!is_alike).then(|| {
                if one < 1e3 * other {
                    format!("{name} = {:.2}", one / other)
                } else {
                    format!("{name} > 1000")
                }
            })
        });
        let skewed = self.skewness.filter(|value| value.abs() > SYMMETRIC);
        let peaked = self.excess_kurtosis.filter(|value| value.abs() > MESOKURTIC);
        let few = (self.effective_modes < ENOUGH_MODES).then_some(self.effective_modes);
        let rounded = |value: f64| format!("{value:.1}").replace('-', "−");
        let heights = [
            skewed.map(|value| format!("skewness {}", rounded(value))),
            peaked.map(|value| format!("excess kurtosis {}", rounded(value))),
            few.map(|value| format!("{} effective modes", rounded(value))),
        ];
        ratios.chain(heights.into_iter().flatten()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{Descriptors, *};
    use crate::grid::samples::square;
    use crate::topography::random::{Amplitude, RandomSurface, samples};
    use crate::topography::shapes::Shape;
    use crate::topography::surface::Surface;

    fn assert_close(found: f64, exact: f64) {
        assert!((found - exact).abs() < 1e-12, "{found} should be {exact}");
    }

    /// Returns a surface of unit rms slope from a fixed formula, which other programs can
    /// reproduce.
    fn golden_surface(nodes: usize) -> Surface {
        let mut heights = vec![0.0; nodes * nodes];
        let mut square_slope = 0.0;
        for (k_x, k_y) in (-8..=8_i32).flat_map(|k_x| (0..=8).map(move |k_y| (k_x, k_y))) {
            let square = k_x * k_x + k_y * k_y;
            if (k_y == 0 && k_x <= 0) || !(4..=64).contains(&square) {
                continue;
            }
            let amplitude = f64::from(square).powf(-0.9);
            let [xx, y, xy] = [k_x * k_x, k_y, k_x * k_y].map(f64::from);
            let turn = 0.6180339887498949 * xx + 0.4142135623730951 * y + 0.7320508075688772 * xy;
            square_slope += 0.5 * (amplitude * TAU).powi(2) * f64::from(square);
            for (node, height) in heights.iter_mut().enumerate() {
                let (i, j) = ((node / nodes) as f64, (node % nodes) as f64);
                let along = (f64::from(k_x) * i + f64::from(k_y) * j) / nodes as f64;
                *height += amplitude * (TAU * (along + turn)).cos();
            }
        }
        heights.iter_mut().for_each(|h| *h /= square_slope.sqrt());
        Surface::new(square(nodes, 1.0), heights).unwrap()
    }

    #[test]
    fn full_contact_load_of_a_known_surface_agrees_with_another_program() {
        // The loads are results of an independent implementation in Python.
        for (nodes, load) in [(64, 1.3257859146181756), (128, 1.3326186670460385)] {
            let surface = golden_surface(nodes);
            let descriptors = Descriptors::from_surface(&surface);
            // The tolerance allows for cosines of phases up to a hundred periods.
            assert!((surface.heights()[0] + 0.009119742340787058).abs() < 1e-13);
            assert_close(descriptors.rms_slope, 1.0);
            assert_close(descriptors.full_contact_load, load);
        }
    }

    #[test]
    fn a_wavy_surface_is_flattened_by_its_westergaard_pressure() {
        // A wave has p* = πE*Δ/λ and h′ = √2 πΔ/λ. A product of two waves has p* = √2 πE*Δ/λ.
        let (amplitude, waves) = (0.01, 3);
        let wave =
            Descriptors::from_surface(&Shape::Wave { amplitude, waves }.draw(square(48, 2.0)));
        assert_close(wave.full_contact_load, 0.5_f64.sqrt());
        let product = Descriptors::from_surface(
            &Shape::WaveProduct { amplitude, waves }.draw(square(48, 2.0)),
        );
        assert_close(product.full_contact_load, 1.0);
    }

    #[test]
    fn two_levels_have_the_skewness_and_kurtosis_of_a_bernoulli_trial() {
        let shape = Shape::Punch { radius: 0.3, depth: 5.0 };
        let surface = shape.draw(square(32, 1.0));
        let top = surface.heights().iter().filter(|&&h| h == 0.0).count();
        let share = top as f64 / 1024.0;
        let variance = share * (1.0 - share);
        let descriptors = Descriptors::from_surface(&surface);
        let skewness = (1.0 - 2.0 * share) / variance.sqrt();
        assert_close(descriptors.skewness.unwrap(), skewness);
        assert_close(descriptors.excess_kurtosis.unwrap(), (1.0 - 6.0 * variance) / variance);
    }

    #[test]
    fn kurtosis_of_a_ring_of_modes_falls_as_their_number() {
        // The sum of two wavevectors of equal length determines both, so no other modes contribute
        // to ⟨h⁴⟩ and the relation is exact. Rings of radius 5 and 25 have 6 and 10 pairs of modes.
        for (radius, pairs) in [(1, 2.0), (5, 6.0), (25, 10.0)] {
            let ring = RandomSurface {
                amplitude: Amplitude::Deterministic,
                ..samples::random(radius, radius, 1)
            };
            // More than four nodes per wave avoid aliasing of the fourth power.
            let descriptors = Descriptors::from_surface(&ring.draw(square(128, 1.0)));
            assert_close(descriptors.effective_modes, pairs);
            assert_close(descriptors.excess_kurtosis.unwrap(), -1.5 / pairs);
        }
    }

    #[test]
    fn a_flat_surface_has_no_shape_and_zeros_elsewhere() {
        // The mean of these heights is not exactly representable.
        for (nodes, height) in [(1, 5.0), (7, 0.1), (12, -1e9 / 3.0)] {
            let flat = Surface::new(square(nodes, 2.0), vec![height; nodes * nodes]).unwrap();
            let expected = Descriptors {
                moments: Moments::default(),
                rms_height: 0.0,
                rms_slope: 0.0,
                nayak: None,
                summit_density: 0.0,
                summit_density_integer: 0.0,
                skewness: None,
                excess_kurtosis: None,
                effective_modes: 0.0,
                full_contact_load: 0.0,
            };
            assert_eq!(Descriptors::from_surface(&flat), expected);
        }
    }

    #[test]
    fn raising_a_surface_changes_nothing() {
        let surface = golden_surface(32);
        let raised = surface.heights().iter().map(|h| h + 1.0).collect();
        let raised = Descriptors::from_surface(&Surface::new(square(32, 1.0), raised).unwrap());
        let descriptors = Descriptors::from_surface(&surface);
        assert_close(raised.rms_height, descriptors.rms_height);
        assert_close(raised.full_contact_load, descriptors.full_contact_load);
        assert_close(raised.skewness.unwrap(), descriptors.skewness.unwrap());
    }

    #[test]
    fn a_punch_has_the_roughness_of_two_levels() {
        let punch = Shape::Punch { radius: 0.3, depth: 2.0 };
        let surface = punch.draw(square(32, 1.0));
        let share = surface.heights().iter().filter(|&&h| h == 0.0).count() as f64 / 1024.0;
        let found = Roughness::from_surface(&surface, Boundary::Free);
        assert_eq!(found.sz, 2.0);
        assert!((found.sq - 2.0 * (share * (1.0 - share)).sqrt()).abs() < 1e-14);
        assert!((found.sa - 4.0 * share * (1.0 - share)).abs() < 1e-14);
        assert!((found.sp - 2.0 * (1.0 - share)).abs() < 1e-14);
        assert!((found.sv - 2.0 * share).abs() < 1e-14);
    }

    #[test]
    fn a_flat_surface_has_no_shape_of_its_heights() {
        let flat = Surface::new(square(4, 1.0), vec![7.1; 16]).unwrap();
        let found = Roughness::from_surface(&flat, Boundary::Periodic);
        assert_eq!([found.sq, found.sa, found.sp, found.sv, found.sz, found.sdq], [0.0; 6]);
        assert_eq!((found.ssk, found.sku), (None, None));
    }

    #[test]
    fn the_height_of_the_mean_changes_nothing() {
        let low = Shape::Paraboloid { radius: 0.5 }.draw(square(16, 1.0));
        let high = low.heights().iter().map(|height| height + 64.0).collect();
        let high = Surface::new(low.grid(), high).unwrap();
        let [low, high] =
            [low, high].map(|surface| Roughness::from_surface(&surface, Boundary::Free));
        for (low, high) in
            [(low.sq, high.sq), (low.sa, high.sa), (low.ssk.unwrap(), high.ssk.unwrap())]
        {
            assert!((low - high).abs() < 1e-12);
        }
    }

    fn departures(surface: &Surface) -> Vec<String> {
        let seen = Descriptors::from_surface(surface);
        let moments = seen.moments;
        let statistics = Statistics {
            slopes: [moments.m20, moments.m02],
            curvatures: [moments.m40, moments.m04],
            mixed: moments.m22,
            skewness: seen.skewness,
            excess_kurtosis: seen.excess_kurtosis,
            effective_modes: moments.effective_modes(),
        };
        statistics.departures()
    }

    fn random(k_lower: u32) -> Surface {
        samples::random(k_lower, 32, 1).draw(square(64, 1.0))
    }

    fn with(surface: &Surface, height: impl Fn(f64) -> f64) -> Surface {
        let heights = surface.heights().iter().map(|&h| height(h)).collect();
        Surface::new(surface.grid(), heights).unwrap()
    }

    #[test]
    fn random_isotropic_surfaces_are_what_theories_assume() {
        assert_eq!(departures(&random(4)), Vec::<String>::new());
    }

    #[test]
    fn long_waves_alone_are_few() {
        let found = departures(&random(1)).join(", ");
        assert!(found.contains("effective modes"), "{found}");
    }

    #[test]
    fn worn_summits_make_heights_skewed_and_peaked() {
        let rough = random(4);
        let found = departures(&with(&rough, |height| -height.abs().powi(2))).join(", ");
        assert!(found.contains("skewness −") && found.contains("kurtosis"), "{found}");
        // The same surface upside down.
        let turned = departures(&with(&rough, |height| height.abs().powi(2))).join(", ");
        assert!(turned.contains("skewness ") && !turned.contains("skewness −"), "{turned}");
    }

    #[test]
    fn a_wave_in_one_direction_has_no_slope_in_the_other() {
        let wave = |shape: Shape| departures(&shape.draw(square(64, 1.0))).join(", ");
        let along_x = wave(Shape::Wave { amplitude: 0.1, waves: 2 });
        assert!(along_x.contains("m₂₀/m₀₂ > 1000"), "{along_x}");
        // A sum of two waves along the axes has m₂₂ = 0 and is not isotropic.
        let both = wave(Shape::WaveSum { amplitude: 0.1, waves: 2 });
        assert!(both.contains("3 m₂₂/m₄ = 0.00") && !both.contains("m₂₀/m₀₂"), "{both}");
    }
}
