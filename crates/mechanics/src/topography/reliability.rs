//! Wavelengths of a measured map that its instrument resolved.
//!
//! Two effects limit the short wavelengths of a scan:
//!
//! - **The tip.** A sphere of radius R cannot follow a peak whose curvature exceeds 1/R. [`Tip`]
//!   finds the scale below which the peaks of the map are nearly that sharp (Sanner et al. 2022,
//!   doi:10.1016/j.apsadv.2021.100190).
//! - **Noise.** Heights with uncorrelated errors of variance σ² on a grid with the steps Δx and Δy
//!   have the power spectral density σ² Δx Δy at all wavenumbers. [`NoiseFloor`] is this plateau,
//!   and the wavelength at which the surface has the same density as the noise.
//!
//! [`Reliability`] combines both, and states which share of the mean square slope comes from
//! shorter waves.

use std::f64::consts::{LN_2, SQRT_2, TAU};

use super::differences;
use super::power_spectrum::for_each_mode;
use super::surface::{Axis, Scan, Surface};
use crate::grid::{Boundary, Grid};

/// Largest curvature of a peak that counts as resolved, in units of 1/R.
///
/// Sanner et al. 2022 derive one half from simulated scans.
pub const SAFETY_FACTOR: f64 = 0.5;

/// Relative accuracy of the cutoff of a tip.
const ACCURACY: f64 = 1e-7;

/// Number of bands of wavenumbers per factor of two in which [`NoiseFloor`] averages a spectrum.
const BANDS_PER_OCTAVE: usize = 4;

/// Shortest wavelength of a map that the instrument resolved, with its reasons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reliability {
    /// Cutoff of the tip, in the unit of the sides; `None` if the tip resolved every scale of the
    /// map, or if its radius is unknown.
    pub tip: Option<f64>,
    /// Noise of the map; `None` if its spectrum has no plateau, or if it was not analysed.
    pub noise: Option<NoiseFloor>,
    /// Shortest reliable wavelength, in the unit of the sides: the larger of the two cutoffs, and
    /// at least two grid spacings.
    pub wavelength: f64,
    /// Share of the mean square slope of the map that comes from shorter waves, from 0 to 1.
    pub unreliable_share: f64,
    /// Rms slope √⟨|∇h|²⟩ of the waves that are at least as long as `wavelength`.
    pub rms_slope: f64,
}

impl Reliability {
    /// Determines the shortest reliable wavelength of a complete map.
    ///
    /// `tip` is the cutoff of the tip, see [`Tip::cutoff`]. With `analyses_noise`, the noise of the
    /// map is analysed, too.
    ///
    /// Slopes are those of [`differences::moments_within`]. The share is computed from the power
    /// spectral density, which for a map that is not periodic is that of the map multiplied by a
    /// Hann window.
    pub fn new(
        surface: &Surface,
        boundary: Boundary,
        tip: Option<f64>,
        analyses_noise: bool,
    ) -> Self {
        let grid = surface.grid();
        let modes = modes(surface, boundary);
        let noise = if analyses_noise { NoiseFloor::from_modes(&modes, grid) } else { None };
        let cutoffs = [tip, noise.map(|noise| noise.wavelength)].into_iter().flatten();
        let wavelength = cutoffs.fold(TAU / nyquist(grid), f64::max);
        let largest = TAU / wavelength * (1.0 + 1e-9);
        let (mut all, mut shorter) = (0.0, 0.0);
        for mode in &modes {
            all += mode.square_slope;
            if mode.wavenumber > largest {
                shorter += mode.square_slope;
            }
        }
        let unreliable_share = if all > 0.0 { shorter / all } else { 0.0 };
        let rms_slope = differences::moments_within(surface, boundary).rms_slope();
        let rms_slope = rms_slope * (1.0 - unreliable_share).sqrt();
        Self { tip, noise, wavelength, unreliable_share, rms_slope }
    }
}

/// Sphere at the end of the tip of a scanning probe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tip {
    /// Radius of the sphere, in the unit of the map's sides.
    pub radius: f64,
}

impl Tip {
    /// Returns the length of the stencil below which the peaks of a map are too sharp for the tip.
    ///
    /// The second derivative along the scan lines at the scale ℓ is
    /// (h(x + ℓ) − 2 h(x) + h(x − ℓ))/ℓ², and the stencil has the length λ = 2ℓ. The cutoff is the
    /// λ at which the most negative second derivative of the map is −[`SAFETY_FACTOR`]/R. Between
    /// the nodes, heights are interpolated linearly. Stencils with a missing point do not count. On
    /// a periodic map, stencils continue across the edges.
    ///
    /// The result is `None` if even the smallest stencil satisfies the condition, and the side
    /// along the scan lines if not even the largest one does. Heights of neighbouring lines often
    /// differ by more than the roughness, so the curvature across them says nothing about the tip.
    ///
    /// ```
    /// use asperity_mechanics::grid::{Boundary, Grid};
    /// use asperity_mechanics::topography::reliability::Tip;
    /// use asperity_mechanics::topography::shapes::Shape;
    /// use asperity_mechanics::topography::surface::Axis;
    ///
    /// // The curvature of a paraboloid is 1/R at every scale.
    /// let dome = Shape::Paraboloid { radius: 0.25 }.draw(Grid::square(16, 1.0)?);
    /// let cutoff = |tip: Tip| tip.cutoff(&dome.clone().into(), Axis::X, Boundary::Free);
    /// assert_eq!(cutoff(Tip { radius: 0.12 }), None);
    /// assert_eq!(cutoff(Tip { radius: 0.13 }), Some(1.0));
    /// # Ok::<(), asperity_mechanics::grid::GridError>(())
    /// ```
    pub fn cutoff(self, map: &Scan, lines: Axis, boundary: Boundary) -> Option<f64> {
        let (nodes, step) = (lines.select(map.grid().nodes()), lines.select(map.grid().spacing()));
        let limit = SAFETY_FACTOR / self.radius;
        let is_too_sharp = |steps: f64| peak_curvature(map, lines, boundary, steps) > limit;
        let longest = match boundary {
            Boundary::Periodic => nodes as f64 / 2.0,
            Boundary::Free => (nodes.saturating_sub(1) / 2) as f64,
        };
        if longest < 1.0 || !is_too_sharp(1.0) {
            return None;
        }
        if is_too_sharp(longest) {
            return Some(lines.select(map.grid().cell().size()));
        }
        let (mut sharp, mut blunt) = (1.0, longest);
        while blunt - sharp > ACCURACY * blunt {
            let middle = 0.5 * (sharp + blunt);
            if is_too_sharp(middle) {
                sharp = middle;
            } else {
                blunt = middle;
            }
        }
        Some(2.0 * blunt * step)
    }
}

/// Returns the largest negative second derivative along the scan lines over a distance of `steps`
/// grid spacings, as a positive number.
fn peak_curvature(map: &Scan, lines: Axis, boundary: Boundary, steps: f64) -> f64 {
    let [nodes_x, nodes_y] = map.grid().nodes();
    let (count, others, along, across) = match lines {
        Axis::X => (nodes_x, nodes_y, nodes_y, 1),
        Axis::Y => (nodes_y, nodes_x, 1, nodes_y),
    };
    let (inner, outer) = (steps.floor() as usize, steps.ceil() as usize);
    let part = steps - steps.floor();
    let heights = map.heights();
    let mut least = f64::INFINITY;
    let middles = match boundary {
        Boundary::Periodic => 0..count,
        Boundary::Free => outer..count - outer,
    };
    for i in middles {
        let wrapped = |i: usize| i % count * along;
        let [before_near, before_far] = [inner, outer].map(|by| wrapped(i + count - by));
        let [after_near, after_far] = [inner, outer].map(|by| wrapped(i + by));
        for j in 0..others {
            let height = |line: usize| heights[line + j * across];
            let between = |near: usize, far: usize| {
                let near = height(near);
                near + part * (height(far) - near)
            };
            let before = between(before_near, before_far);
            let after = between(after_near, after_far);
            // The minimum ignores NaN, the result of a stencil with a missing point.
            least = least.min(before + after - 2.0 * height(i * along));
        }
    }
    let distance = steps * lines.select(map.grid().spacing());
    -least / (distance * distance)
}

/// White noise of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseFloor {
    /// Power spectral density of the noise, in length⁴.
    pub density: f64,
    /// Wavelength below which the noise has more power than the surface: there the density of the
    /// map is twice that of the noise.
    pub wavelength: f64,
    /// Rms height of the noise on the nodes.
    pub rms_height: f64,
}

/// White noise of a map, and its part of the slopes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseShare {
    /// Noise of the map.
    pub floor: NoiseFloor,
    /// Share of the mean square slope of the map that comes from the noise, from 0 to 1.
    pub share: f64,
}

impl NoiseFloor {
    /// Finds the noise of a complete map, with its share of the mean square slope as in
    /// [`Reliability::new`], or returns `None` if its spectrum has no plateau.
    ///
    /// The density of each band of wavenumbers, four to an octave, is the median over its modes
    /// divided by ln 2. For a Gaussian surface this is the mean. In contrast to the mean, it is
    /// hardly affected by the few modes of a vibration or of offsets between scan lines.
    ///
    /// The noise is the density between q_N/√2 and the Nyquist wavenumber q_N of the larger grid
    /// spacing. It is a plateau if the density between q_N/2 and q_N/√2 is less than √2 times as
    /// large. Self-affine surfaces fall more steeply, even with H → 0. Therefore noise is found if
    /// its wavelength is at least about four grid spacings. If it is that short, the surface still
    /// contributes to the plateau, and the wavelength is up to a tenth too long.
    pub fn with_share(surface: &Surface, boundary: Boundary) -> Option<NoiseShare> {
        let modes = modes(surface, boundary);
        let floor = Self::from_modes(&modes, surface.grid())?;
        let (mut all, mut of_noise) = (0.0, 0.0);
        for mode in modes.iter().filter(|mode| mode.density > 0.0) {
            all += mode.square_slope;
            of_noise += mode.square_slope / mode.density * floor.density;
        }
        let share = if all > 0.0 { (of_noise / all).min(1.0) } else { 0.0 };
        Some(NoiseShare { floor, share })
    }

    fn from_modes(modes: &[Mode], grid: Grid) -> Option<NoiseFloor> {
        let bands = bands(modes, nyquist(grid));
        let half = |first: usize| {
            let [one, other] = [bands.get(first)?, bands.get(first + 1)?];
            Some((one.density * other.density).sqrt())
        };
        let (density, before) = (half(0)?, half(BANDS_PER_OCTAVE / 2)?);
        if !(density > 0.0 && before < SQRT_2 * density) {
            return None;
        }
        let end = bands.iter().position(|band| band.density >= 2.0 * density);
        let wavelength = match end {
            Some(0) => return None,
            // Noise at all wavelengths of the map.
            None => grid.cell().longer_side(),
            Some(end) => {
                let (noisy, clear) = (bands[end - 1], bands[end]);
                let rise = libm::log(2.0 * density / noisy.density);
                let part = rise / libm::log(clear.density / noisy.density);
                TAU / libm::exp(
                    noisy.log_wavenumber + part * (clear.log_wavenumber - noisy.log_wavenumber),
                )
            }
        };
        let [step_x, step_y] = grid.spacing();
        let rms_height = (density / (step_x * step_y)).sqrt();
        Some(NoiseFloor { density, wavelength, rms_height })
    }
}

/// Modes with similar wavenumbers.
#[derive(Debug, Clone, Copy)]
struct Band {
    /// Mean of ln q over the modes.
    log_wavenumber: f64,
    density: f64,
}

/// Returns the bands of modes up to the Nyquist wavenumber, in descending order of wavenumbers.
/// Bands without modes are left out.
fn bands(modes: &[Mode], nyquist: f64) -> Vec<Band> {
    let mut found: Vec<(f64, Vec<f64>)> = Vec::new();
    for mode in modes {
        let below = BANDS_PER_OCTAVE as f64 * libm::log2(nyquist / mode.wavenumber) + 1e-9;
        if below < 0.0 {
            continue;
        }
        let index = below as usize;
        if index >= found.len() {
            found.resize(index + 1, (0.0, Vec::new()));
        }
        found[index].0 += libm::log(mode.wavenumber);
        found[index].1.push(mode.density);
    }
    let band = |(logarithms, mut densities): (f64, Vec<f64>)| {
        let count = densities.len();
        let (_, median, _) = densities.select_nth_unstable_by(count / 2, f64::total_cmp);
        Band { log_wavenumber: logarithms / count as f64, density: *median / LN_2 }
    };
    found.into_iter().filter(|(_, densities)| !densities.is_empty()).map(band).collect()
}

/// A mode ±q of a map.
#[derive(Debug, Clone, Copy)]
struct Mode {
    /// Angular wavenumber |q|.
    wavenumber: f64,
    /// Power spectral density, in length⁴.
    density: f64,
    /// Contribution to the mean square slope, up to a factor that all modes share.
    square_slope: f64,
}

/// Returns the modes of a map, without the mean.
fn modes(surface: &Surface, boundary: Boundary) -> Vec<Mode> {
    let grid = surface.grid();
    let (size, spacing) = (grid.cell().size(), grid.spacing());
    let mut modes = Vec::with_capacity(grid.count() / 2 + 1);
    let unit = for_each_mode(surface, boundary, |waves, multiplicity, power| {
        let along = [0, 1].map(|axis| TAU * waves[axis] / size[axis]);
        let slope = [0, 1].map(|axis| match boundary {
            Boundary::Periodic => along[axis],
            // Differences between neighbouring nodes, as in `differences`.
            Boundary::Free => 2.0 / spacing[axis] * libm::sin(0.5 * along[axis] * spacing[axis]),
        });
        let square = |[x, y]: [f64; 2]| x * x + y * y;
        modes.push(Mode {
            wavenumber: square(along).sqrt(),
            density: power,
            square_slope: multiplicity * power * square(slope),
        });
    });
    modes.iter_mut().for_each(|mode| mode.density *= unit);
    modes
}

/// Returns the Nyquist wavenumber of the larger grid spacing.
fn nyquist(grid: Grid) -> f64 {
    let [step_x, step_y] = grid.spacing();
    0.5 * TAU / step_x.max(step_y)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::grid::samples::{rectangle, square};
    use crate::topography::shapes::Shape;
    use crate::topography::spectral_density::{SpectralDensity, TabulatedSurface};
    use crate::topography::surface::samples::scan;

    #[test]
    fn the_cutoff_of_a_wave_is_where_its_chords_have_half_the_curvature_of_the_tip() {
        // The crest of Δ cos(2πx/λ) has the curvature 4Δ sin²(πℓ/λ)/ℓ² at the scale ℓ.
        let (amplitude, wavelength) = (0.01, 0.5);
        let wave = Shape::Wave { amplitude, waves: 2 }.draw(rectangle([400, 3], [1.0, 1.0]));
        let distance: f64 = 0.105;
        let sine = (PI * distance / wavelength).sin();
        let curvature = 4.0 * amplitude * sine * sine / (distance * distance);
        let tip = Tip { radius: SAFETY_FACTOR / curvature };
        let found = tip.cutoff(&wave.into(), Axis::X, Boundary::Free).unwrap();
        assert!((found / (2.0 * distance) - 1.0).abs() < 1e-3, "{found}");
    }

    #[test]
    fn stencils_continue_across_the_edges_of_a_periodic_map() {
        // The only crest is at the edge. Its chords are those of the test above with λ = 1.
        let (amplitude, distance) = (0.01, 0.305);
        let wave = Shape::Wave { amplitude, waves: 1 };
        let sine = libm::sin(PI * distance);
        let curvature = 4.0 * amplitude * sine * sine / (distance * distance);
        let tip = Tip { radius: SAFETY_FACTOR / curvature };
        let along_x = wave.draw(rectangle([400, 3], [1.0, 1.0]));
        let transposed = (0..1200).map(|node| along_x.heights()[node % 400 * 3 + node / 400]);
        let along_y = Surface::new(rectangle([3, 400], [1.0, 1.0]), transposed.collect());
        for (map, lines) in [(along_x, Axis::X), (along_y.unwrap(), Axis::Y)] {
            let map = Scan::from(map);
            let found = tip.cutoff(&map, lines, Boundary::Periodic).unwrap();
            assert!((found / (2.0 * distance) - 1.0).abs() < 1e-3, "{found}");
            assert!(tip.cutoff(&map, lines, Boundary::Free).unwrap() < 0.9 * found);
        }
        // A crest that is too sharp for the largest stencil, which is as long as the side.
        let sharp = Tip { radius: 1.0 };
        for nodes in [4, 5] {
            let map = Scan::from(wave.draw(rectangle([nodes, 1], [1.0, 1.0])));
            assert_eq!(sharp.cutoff(&map, Axis::X, Boundary::Periodic), None);
            let map = Scan::from(
                Shape::Wave { amplitude: 1.0, waves: 1 }.draw(rectangle([nodes, 1], [1.0, 1.0])),
            );
            assert_eq!(sharp.cutoff(&map, Axis::X, Boundary::Periodic), Some(1.0));
        }
    }

    #[test]
    fn valleys_and_steps_between_lines_do_not_limit_a_tip() {
        let valley = scan([9, 6], [1.0, 1.0], |x, _| 10.0 * (x - 0.4).abs(), |_, _| false);
        assert_eq!(Tip { radius: 0.1 }.cutoff(&valley, Axis::X, Boundary::Free), None);
        let peak = scan([9, 6], [1.0, 1.0], |x, _| -10.0 * (x - 0.4).abs(), |_, _| false);
        assert!(Tip { radius: 0.1 }.cutoff(&peak, Axis::X, Boundary::Free).is_some());
        let lines = scan([9, 6], [1.0, 1.0], |_, y| 1e3 * (40.0 * y).sin(), |_, _| false);
        assert_eq!(Tip { radius: 0.1 }.cutoff(&lines, Axis::X, Boundary::Free), None);
        assert!(Tip { radius: 0.1 }.cutoff(&lines, Axis::Y, Boundary::Free).is_some());
    }

    #[test]
    fn stencils_with_a_missing_point_do_not_count() {
        let height = |x: f64, _: f64| if (x - 0.5).abs() < 0.01 { 1.0 } else { 0.0 };
        let tip = Tip { radius: 0.1 };
        assert!(
            tip.cutoff(&scan([10, 4], [1.0, 1.0], height, |_, _| false), Axis::X, Boundary::Free)
                .is_some()
        );
        let without_peak = scan([10, 4], [1.0, 1.0], height, |i, _| i == 5);
        assert_eq!(tip.cutoff(&without_peak, Axis::X, Boundary::Free), None);
        assert_eq!(
            tip.cutoff(&scan([10, 4], [1.0, 1.0], height, |_, _| true), Axis::X, Boundary::Free),
            None
        );
    }

    /// Returns a periodic surface with the density (q/q₀)^(−exponent), where q₀ is 2π/`crossover`,
    /// and white noise with the density `noise`.
    fn noisy(nodes: usize, exponent: f64, crossover: f64, noise: f64) -> Surface {
        let grid = square(nodes, 1.0);
        let point = |q: f64| [q, (q * crossover / TAU).powf(-exponent)];
        let density = SpectralDensity::from_points(vec![point(TAU), point(1e4)]).unwrap();
        let surface =
            TabulatedSurface { density: &density, rms_slope: None, seed: 5, realization: 0 };
        // Sums of twelve uniform numbers are nearly Gaussian, with the variance 1.
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut gaussian = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let drawn = surface.draw(grid).into_heights().into_iter();
        let rms_noise = noise.sqrt() * nodes as f64;
        Surface::new(grid, drawn.map(|height| height + rms_noise * gaussian()).collect()).unwrap()
    }

    #[test]
    fn noise_meets_a_self_affine_surface_where_the_densities_are_equal() {
        for (exponent, crossover) in [(3.6, 1.0 / 32.0), (2.4, 1.0 / 24.0), (3.0, 1.0 / 80.0)] {
            let surface = noisy(512, exponent, crossover, 1.0);
            for boundary in [Boundary::Periodic, Boundary::Free] {
                let found = NoiseFloor::with_share(&surface, boundary).unwrap().floor;
                assert!((found.density - 1.0).abs() < 0.08, "{found:?}");
                assert!((found.wavelength / crossover - 1.0).abs() < 0.12, "{crossover} {found:?}");
                assert!((found.rms_height / 512.0 - 1.0).abs() < 0.04);
            }
        }
    }

    #[test]
    fn the_share_of_noise_in_the_slope_is_what_the_noise_adds_to_its_square() {
        let square_slope = |surface: &Surface, boundary: Boundary| {
            differences::moments_within(surface, boundary).rms_slope().powi(2)
        };
        let [clean, rough] = [0.0, 1.0].map(|noise| noisy(256, 4.0, 1.0 / 32.0, noise));
        for boundary in [Boundary::Periodic, Boundary::Free] {
            let found = NoiseFloor::with_share(&rough, boundary).unwrap();
            let exact = 1.0 - square_slope(&clean, boundary) / square_slope(&rough, boundary);
            assert!((found.share / exact - 1.0).abs() < 0.1, "{boundary:?} {found:?} {exact}");
            assert_eq!(NoiseFloor::with_share(&clean, boundary), None);
        }
    }

    #[test]
    fn a_surface_without_noise_has_no_floor() {
        for exponent in [2.0, 2.6, 3.6] {
            let surface = noisy(128, exponent, 0.1, 0.0);
            assert_eq!(NoiseFloor::with_share(&surface, Boundary::Periodic), None);
            assert_eq!(NoiseFloor::with_share(&surface, Boundary::Free), None);
        }
        let flat = Shape::Wave { amplitude: 0.0, waves: 1 }.draw(square(16, 1.0));
        assert_eq!(NoiseFloor::with_share(&flat, Boundary::Periodic), None);
    }

    #[test]
    fn in_a_map_of_noise_alone_only_the_longest_waves_seem_reliable() {
        let noise = noisy(128, 3.0, 1e9, 1.0);
        let found = Reliability::new(&noise, Boundary::Periodic, None, true);
        // The density of a few long waves can exceed that of the noise by chance.
        assert!(found.wavelength > 0.2, "{found:?}");
    }

    #[test]
    fn offsets_of_scan_lines_are_not_white_noise() {
        let surface = noisy(128, 3.6, 0.05, 1.0);
        let clean = NoiseFloor::with_share(&surface, Boundary::Free).unwrap().floor;
        let lines = surface.heights().iter().enumerate();
        let lines =
            lines.map(|(node, height)| height + 300.0 * libm::sin((node % 128).pow(2) as f64));
        let lines = Surface::new(surface.grid(), lines.collect()).unwrap();
        let found = NoiseFloor::with_share(&lines, Boundary::Free).unwrap().floor;
        assert!((found.density / clean.density - 1.0).abs() < 0.1, "{found:?} {clean:?}");
        assert!((found.wavelength / clean.wavelength - 1.0).abs() < 0.1, "{found:?} {clean:?}");
    }

    #[test]
    fn the_slope_of_reliable_waves_is_that_of_the_longer_wave() {
        // Slopes √2 πΔ/λ of 0.02 √2 π and 0.06 √2 π: the short wave has nine tenths of the square.
        let grid = rectangle([96, 64], [1.0, 1.0]);
        let heights = (0..grid.count()).map(|node| {
            let x = grid.indices(node)[0] as f64 / 96.0;
            0.01 * libm::cos(TAU * 2.0 * x) + 0.005 * libm::cos(TAU * 12.0 * x)
        });
        let surface = Surface::new(grid, heights.collect()).unwrap();
        let found = Reliability::new(&surface, Boundary::Periodic, Some(0.2), false);
        assert_eq!((found.wavelength, found.noise), (0.2, None));
        assert!((found.unreliable_share - 0.9).abs() < 1e-12);
        assert!((found.rms_slope / (0.02 * SQRT_2 * PI) - 1.0).abs() < 1e-12);
        // Without a cutoff, all waves of the grid are reliable except those in its corners.
        let all = Reliability::new(&surface, Boundary::Periodic, None, false);
        assert_eq!(all.wavelength, 2.0 / 64.0);
        assert!(all.unreliable_share < 1e-25);
        // A map that is not periodic has the slopes of its differences.
        let open = Reliability::new(&surface, Boundary::Free, Some(0.2), false);
        let sinc = |waves: f64| libm::sin(PI * waves / 96.0) / (PI * waves / 96.0);
        let exact = 0.02 * SQRT_2 * PI * sinc(2.0);
        // The Hann window adds its own slope to that of two waves per side, 8 % here.
        assert!((open.rms_slope / exact - 1.0).abs() < 0.1, "{open:?}");
    }
}
