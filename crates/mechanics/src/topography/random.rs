//! Random self-affine surfaces, drawn mode by mode.

use serde::{Deserialize, Serialize};

use super::draws::{Draws, ModeDraw, Wave, Waves};
use super::moments::{MomentSum, Moments};
use super::prescribed_heights::{HeightDistribution, adjust_phases};
use super::spectrum::Spectrum;
use super::surface::Surface;
use crate::grid::{Cell, Grid};
use crate::threads::Threads;

/// Distribution of the moduli of the Fourier coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Amplitude {
    /// Complex Gaussian coefficients, as in filtered white noise (Hu & Tonder 1992).
    ///
    /// The mean power of each mode follows the spectral density. Spectral moments scatter between
    /// realizations.
    #[serde(rename = "filter")]
    Gaussian,
    /// Moduli proportional to the square root of the spectral density, with random phases.
    #[serde(rename = "random-phase")]
    Deterministic,
}

/// Random surface that is defined by its modes, independently of any mesh.
///
/// ```
/// use asperity_mechanics::grid::Grid;
/// use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
/// use asperity_mechanics::topography::spectrum::Spectrum;
///
/// let spectrum = Spectrum { hurst: 0.8, k_lower: 2, k_rolloff: 2, k_upper: 8, anisotropy: None };
/// let amplitude = Amplitude::Gaussian;
/// let surface = RandomSurface { spectrum, amplitude, rms_slope: 0.1, seed: 7, realization: 0 };
/// let coarse = surface.draw(Grid::square(32, 1.0)?);
/// assert!((surface.moments(coarse.grid().cell()).rms_slope() - 0.1).abs() < 1e-12);
/// // Every second node of a finer mesh has the same height.
/// let fine = surface.draw(Grid::square(64, 1.0)?);
/// let shared = |node: usize| 2 * (node / 32) * 64 + 2 * (node % 32);
/// for (node, height) in coarse.heights().iter().enumerate() {
///     assert!((height - fine.heights()[shared(node)]).abs() < 1e-12);
/// }
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RandomSurface {
    /// Power spectral density. The expected power of each mode is proportional to it.
    #[serde(flatten)]
    pub spectrum: Spectrum,
    /// Distribution of the modulus of each mode.
    #[serde(rename = "method")]
    pub amplitude: Amplitude,
    /// Rms slope √⟨|∇h|²⟩ of each realization. The heights of each realization are scaled to it.
    pub rms_slope: f64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Index of the realization. Realizations are statistically independent.
    pub realization: u32,
}

/// Mean power |ĥ|² of the modes in a ring: modes with wavenumbers |k| that round to the same
/// integer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// Rounded wavenumber |k|, in units of 2π/L.
    pub wavenumber: u32,
    /// Number of pairs of modes ±k in the ring.
    pub pairs: u32,
    /// Mean of |ĥ|² over the modes of the ring in this realization, in length².
    pub power: f64,
    /// Mean of the expected |ĥ|² over the modes of the ring, in length².
    pub mean_power: f64,
}

impl RandomSurface {
    /// Returns the heights of the surface on a grid, in the unit of the grid's sides.
    ///
    /// Different grids have the same heights at shared nodes. [`RandomSurface::rms_slope`] is the
    /// rms slope of the modes. If the shortest waves have exactly two nodes, the Fourier transform
    /// of the heights gives a slightly different slope, because it does not resolve phases at the
    /// Nyquist wavenumber.
    ///
    /// # Panics
    /// Panics if the shortest wave along an axis has fewer than two nodes.
    pub fn draw(&self, grid: Grid) -> Surface {
        self.draw_on(&Threads::one(), grid, None)
    }

    /// Returns the same as [`RandomSurface::draw`], computed by several threads.
    ///
    /// With a distribution of heights, the modes have the same moduli, but phases with which the
    /// heights have this distribution, see [`prescribed_heights`](super::prescribed_heights).
    /// Moments, rings and rms slope stay the same.
    ///
    /// # Panics
    /// Panics if the shortest wave along an axis has fewer than two nodes.
    pub fn draw_on(
        &self,
        threads: &Threads,
        grid: Grid,
        distribution: Option<&HeightDistribution>,
    ) -> Surface {
        for (nodes, waves) in grid.nodes().into_iter().zip(self.spectrum.max_waves(grid.cell())) {
            assert!(2 * waves as usize <= nodes, "{nodes} nodes cannot resolve {waves} waves");
        }
        let (mut waves, mut adjusted) = (Waves::new(grid.nodes()), Vec::new());
        let mut sum = MomentSum::new(grid.cell());
        self.for_each_pair(grid.cell(), |k_x, k_y, density, draw| {
            let power = self.power(density, &draw);
            sum.add_pair([k_x.into(), k_y.into()], 2.0 * power);
            let coefficient = power.sqrt() * draw.phase();
            let wave = Wave { waves: [k_x, k_y as i32], coefficient };
            if distribution.is_some() { adjusted.push(wave) } else { waves.add(wave) }
        });
        if let Some(distribution) = distribution {
            adjust_phases(&mut adjusted, distribution, threads);
            adjusted.into_iter().for_each(|wave| waves.add(wave));
        }
        let heights = waves.heights(threads, self.scale(&sum));
        Surface::new(grid, heights).expect("a sum of finite waves is finite")
    }

    /// Returns the spectral moments of the realization, summed over its modes.
    pub fn moments(&self, cell: Cell) -> Moments {
        self.realized_and_expected_moments(cell).0
    }

    /// Returns the spectral moments of the realization, and the expected moments.
    ///
    /// The expected moments are sums over all modes with their expected power, scaled to the same
    /// rms slope. The moments of realizations scatter around them.
    pub fn realized_and_expected_moments(&self, cell: Cell) -> (Moments, Moments) {
        let [mut drawn, mut mean] = [MomentSum::new(cell); 2];
        self.for_each_pair(cell, |k_x, k_y, density, draw| {
            let power = self.power(density, &draw);
            drawn.add_pair([k_x.into(), k_y.into()], 2.0 * power);
            mean.add_pair([k_x.into(), k_y.into()], 2.0 * density);
        });
        let moments = |sum: MomentSum| sum.finish(self.scale(&sum));
        (moments(drawn), moments(mean))
    }

    /// Returns the mean power |ĥ|² of each [`Ring`] that contains modes, in ascending order of
    /// wavenumber.
    ///
    /// [`Ring::mean_power`] is scaled to the same rms slope as [`Ring::power`].
    pub fn rings(&self, cell: Cell) -> Vec<Ring> {
        let [mut drawn, mut mean] = [MomentSum::new(cell); 2];
        let rings = 1 + self.spectrum.k_upper as usize;
        let mut sums = vec![(0, 0.0, 0.0); rings];
        self.for_each_pair(cell, |k_x, k_y, density, draw| {
            let power = self.power(density, &draw);
            drawn.add_pair([k_x.into(), k_y.into()], 2.0 * power);
            mean.add_pair([k_x.into(), k_y.into()], 2.0 * density);
            let (pairs, power_sum, density_sum) =
                &mut sums[cell.wavenumber([k_x.into(), k_y.into()]).round() as usize];
            *pairs += 1;
            *power_sum += power;
            *density_sum += density;
        });
        let [drawn, mean] = [drawn, mean].map(|sum| self.scale(&sum).powi(2));
        let ring = |(wavenumber, (pairs, power, density)): (usize, (u32, f64, f64))| {
            (pairs > 0).then(|| Ring {
                wavenumber: wavenumber as u32,
                pairs,
                power: drawn * power / f64::from(pairs),
                mean_power: mean * density / f64::from(pairs),
            })
        };
        sums.into_iter().enumerate().filter_map(ring).collect()
    }

    /// Calls `visit(k_x, k_y, density, draw)` for one mode of each pair ±k.
    ///
    /// `density` is the expected |ĥ|² of the mode, and `draw` its random numbers. The density is
    /// not yet scaled to the rms slope.
    fn for_each_pair(&self, cell: Cell, mut visit: impl FnMut(i32, u32, f64, ModeDraw)) {
        let mut densities = self.spectrum.densities();
        let square_length = self.spectrum.square_length();
        let draws = Draws::new(self.seed, self.realization);
        for row in self.spectrum.rows(cell) {
            let of_row = draws.row(row.k_x, *row.k_y.start());
            for (k_y, draw) in row.k_y.zip(of_row) {
                let wavevector = cell.wavevector([row.k_x.into(), k_y.into()]);
                let density = densities.at(square_length.at(wavevector));
                visit(row.k_x, k_y, density, draw);
            }
        }
    }

    /// Returns |ĥ|² of a mode with this spectral density, not yet scaled to the rms slope.
    fn power(&self, density: f64, draw: &ModeDraw) -> f64 {
        match self.amplitude {
            Amplitude::Gaussian => density * draw.power(),
            Amplitude::Deterministic => density,
        }
    }

    /// Returns the factor of the heights that scales the modes in `sum` to the rms slope, or zero
    /// if there are none.
    fn scale(&self, sum: &MomentSum) -> f64 {
        let square_slope = sum.square_slope();
        if square_slope > 0.0 { self.rms_slope / square_slope.sqrt() } else { 0.0 }
    }
}

#[cfg(test)]
pub(crate) mod samples {
    use super::*;

    pub fn random(k_lower: u32, k_upper: u32, seed: u64) -> RandomSurface {
        RandomSurface {
            spectrum: Spectrum {
                hurst: 0.8,
                k_lower,
                k_rolloff: k_lower,
                k_upper,
                anisotropy: None,
            },
            amplitude: Amplitude::Gaussian,
            rms_slope: 1.0,
            seed,
            realization: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use rustfft::num_complex::Complex;

    use super::*;
    use crate::fft::Transform;
    use crate::grid::samples::{cell, rectangle, square};
    use crate::topography::draws::row_of;
    use crate::topography::spectrum::Anisotropy;

    fn random(amplitude: Amplitude, k_lower: u32, k_upper: u32) -> RandomSurface {
        RandomSurface { amplitude, rms_slope: 0.02, ..samples::random(k_lower, k_upper, 2015) }
    }

    fn assert_close(found: f64, exact: f64, tolerance: f64) {
        let error = (found / exact - 1.0).abs();
        assert!(error < tolerance, "{found} should be {exact}");
    }

    #[test]
    fn rings_hold_the_power_of_all_modes() {
        let random = random(Amplitude::Gaussian, 4, 64);
        let rings = random.rings(cell(3.0));
        let square_height: f64 =
            rings.iter().map(|ring| 2.0 * f64::from(ring.pairs) * ring.power).sum();
        assert_close(square_height, random.moments(cell(3.0)).m00, 1e-12);
        let wavenumbers = rings.iter().map(|ring| ring.wavenumber);
        assert!(wavenumbers.eq(4..=64), "every ring between the cutoffs has modes");
    }

    #[test]
    fn rings_fall_as_the_spectrum_does() {
        let rings = random(Amplitude::Deterministic, 4, 64).rings(cell(1.0));
        let at = |wavenumber: usize| rings[wavenumber - 4];
        assert_eq!(at(32).power, at(32).mean_power);
        // A ring is one wavenumber wide. At 32, the power falls by a ninth across a ring.
        let expected = 2_f64.powf(-2.0 * (1.0 + 0.8));
        assert_close(at(60).power / at(30).power, expected, 0.01);
    }

    #[test]
    fn every_mesh_shows_the_same_surface() {
        for amplitude in [Amplitude::Gaussian, Amplitude::Deterministic] {
            // The coarsest mesh has two modes at its Nyquist wavenumber.
            let random = random(amplitude, 4, 64);
            let fine = random.draw(square(512, 1.0));
            let rms_height = random.moments(cell(1.0)).rms_height();
            for nodes in [128, 256] {
                let step = 512 / nodes;
                for (node, height) in random.draw(square(nodes, 1.0)).heights().iter().enumerate() {
                    let shared = step * (node / nodes) * 512 + step * (node % nodes);
                    // The tolerance allows for rounding of sums over ten thousand modes.
                    assert!((height - fine.heights()[shared]).abs() < 1e-12 * rms_height);
                }
            }
        }
    }

    #[test]
    fn a_higher_cutoff_adds_modes_and_keeps_the_others() {
        let [low, high] = [16, 31].map(|k_upper| {
            let surface = random(Amplitude::Gaussian, 4, k_upper).draw(square(64, 1.0));
            let transform = Transform::new([64; 2]);
            let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
            transform.forward(surface.heights(), &mut spectrum, &mut transform.scratch());
            move |k_x: i32, k_y: usize| spectrum[row_of(k_x, 64) * 33 + k_y]
        });
        let ratio = low(4, 0) / high(4, 0);
        assert!(ratio.norm() > 1.0, "the slope is shared with more modes");
        for (k_x, k_y) in [(-4, 0), (0, 16), (-7, 9), (11, 3)] {
            assert!((low(k_x, k_y) / high(k_x, k_y) - ratio).norm() < 1e-11);
        }
    }

    #[test]
    fn slope_is_the_one_asked_for_in_every_realization() {
        for amplitude in [Amplitude::Gaussian, Amplitude::Deterministic] {
            for realization in 0..3 {
                let surface = RandomSurface { realization, ..random(amplitude, 1, 15) };
                for side in [1.0, 2.5] {
                    let slope = Moments::from_surface(&surface.draw(square(32, side))).rms_slope();
                    assert_close(slope, 0.02, 1e-13);
                }
            }
        }
    }

    #[test]
    fn every_mesh_of_a_rectangle_shows_the_same_surface() {
        let random = random(Amplitude::Gaussian, 4, 30);
        let size = [2.0, 0.75];
        let [coarse, fine] = [[60, 24], [120, 72]].map(|nodes| random.draw(rectangle(nodes, size)));
        let rms_height = random.moments(coarse.grid().cell()).rms_height();
        for (node, height) in coarse.heights().iter().enumerate() {
            let [i, j] = coarse.grid().indices(node);
            let shared = fine.heights()[2 * i * 72 + 3 * j];
            assert!((height - shared).abs() < 1e-12 * rms_height);
        }
    }

    #[test]
    fn moments_of_the_modes_are_those_of_the_mesh() {
        for grid in [square(32, 2.5), rectangle([14, 36], [1.0, 2.5])] {
            moments_agree(&random(Amplitude::Gaussian, 2, 15), grid);
        }
    }

    fn moments_agree(surface: &RandomSurface, grid: Grid) {
        let (modes, mesh) =
            (surface.moments(grid.cell()), Moments::from_surface(&surface.draw(grid)));
        assert_close(mesh.rms_slope(), 0.02, 1e-13);
        assert_close(modes.m00, mesh.m00, 1e-13);
        assert_close(modes.m20, mesh.m20, 1e-13);
        assert_close(modes.m02, mesh.m02, 1e-13);
        assert_close(modes.m22, mesh.m22, 1e-13);
        assert_close(modes.m40, mesh.m40, 1e-13);
        assert_close(modes.m04, mesh.m04, 1e-13);
        assert_close(modes.effective_modes(), mesh.effective_modes(), 1e-13);
    }

    #[test]
    fn deterministic_moduli_give_the_sums_over_the_lattice_of_modes() {
        // (k_lower, k_upper, α, D, effective modes), summed over the whole annulus in Python.
        let sums = [
            (1, 32, 43.907438965701495, 4.944027327049505, 5.184543977857162),
            (4, 64, 12.3413395996431, 23.100322026423022, 91.83554119769903),
            (16, 128, 5.263759124960063, 110.01537689845746, 1499.1122607919833),
        ];
        for (k_lower, k_upper, nayak, density, effective) in sums {
            let [scattering, fixed] =
                [Amplitude::Gaussian, Amplitude::Deterministic].map(|amplitude| {
                    random(amplitude, k_lower, k_upper).realized_and_expected_moments(cell(3.0))
                });
            assert_eq!(fixed.0, fixed.1);
            assert_eq!(scattering.1, fixed.1);
            assert_close(fixed.1.nayak().unwrap(), nayak, 1e-12);
            assert_close(fixed.1.summit_density_integer(cell(3.0)), density, 1e-12);
            assert_close(fixed.1.effective_modes(), effective, 1e-12);
        }
    }

    #[test]
    fn deterministic_moduli_are_isotropic() {
        let moments = random(Amplitude::Deterministic, 4, 64).moments(cell(1.0));
        assert_close(moments.m20, moments.m02, 1e-13);
        assert_close(moments.m40, moments.m04, 1e-13);
        // Over a circle, ⟨cos² sin²⟩ is a third of ⟨cos⁴⟩; the lattice is nearly isotropic.
        assert_close(3.0 * moments.m22, moments.m40, 0.02);
    }

    #[test]
    fn a_grain_divides_slopes_along_itself_by_its_ratio() {
        let moments = |ratio: f64, angle: f64| {
            let isotropic = random(Amplitude::Deterministic, 8, 64);
            let anisotropy = Anisotropy::new(ratio, angle);
            let spectrum = Spectrum { anisotropy, ..isotropic.spectrum };
            let surface = RandomSurface { spectrum, ..isotropic };
            surface.moments(cell(1.0))
        };
        let along_x = moments(2.0, 0.0);
        // The tolerance is the difference between the sum over modes and the integral.
        assert_close(along_x.m02 / along_x.m20, 4.0, 0.02);
        assert_close(along_x.m04 / along_x.m40, 16.0, 0.02);
        let along_y = moments(2.0, 90.0);
        assert_close(along_y.m20, along_x.m02, 1e-12);
        assert_close(along_y.m04, along_x.m40, 1e-12);
        let between = moments(2.0, 45.0);
        assert_close(between.m20, between.m02, 1e-12);
        // A stretched isotropic spectrum has m₂₂ : m₄₀ = (1/16 − 1/6 + 1) : (1/16 + 1/2 + 1).
        assert_close(between.m22 / between.m40, 43.0 / 75.0, 0.02);
    }

    #[test]
    fn a_grain_keeps_the_draws_of_the_modes_that_it_keeps() {
        let isotropic = random(Amplitude::Gaussian, 4, 16);
        let stretched = RandomSurface {
            spectrum: Spectrum {
                anisotropy: Anisotropy::new(1.0 + 1e-9, 30.0),
                ..isotropic.spectrum
            },
            ..isotropic
        };
        let [one, other] = [isotropic, stretched].map(|surface| surface.draw(square(64, 1.0)));
        let rms_height = isotropic.moments(cell(1.0)).rms_height();
        for (one, other) in one.heights().iter().zip(other.heights()) {
            // The anisotropy removes a hundredth of all modes, those on the cutoffs.
            assert!((one - other).abs() < rms_height);
        }
        let product: f64 = one.heights().iter().zip(other.heights()).map(|(a, b)| a * b).sum();
        let squares = [&one, &other].map(|s| s.heights().iter().map(|h| h * h).sum::<f64>());
        assert!(product / (squares[0] * squares[1]).sqrt() > 0.95);
    }

    #[test]
    fn gaussian_moduli_scatter_around_the_published_mean() {
        let (mut nayak, mut density) = (0.0, 0.0);
        for realization in 0..8 {
            let surface = RandomSurface { realization, ..random(Amplitude::Gaussian, 4, 64) };
            let moments = surface.moments(cell(1.0));
            nayak += moments.nayak().unwrap() / 8.0;
            density += moments.summit_density_integer(cell(1.0)) / 8.0;
        }
        // Means of 200 surfaces are 12.33 ± 0.06 and 23.1; one surface scatters by 0.8 and 0.5.
        assert!((nayak - 12.33).abs() < 3.0 * 0.8 / 8_f64.sqrt());
        assert!((density - 23.1).abs() < 3.0 * 0.5 / 8_f64.sqrt());
    }

    #[test]
    fn a_spectrum_without_modes_is_flat() {
        let flat = random(Amplitude::Gaussian, 8, 4);
        assert_eq!(flat.moments(cell(1.0)), Moments::default());
        assert!(flat.draw(square(16, 1.0)).heights().iter().all(|h| *h == 0.0));
    }
}
