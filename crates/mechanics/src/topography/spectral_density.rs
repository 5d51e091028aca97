//! Tabulated isotropic power spectral densities, and random surfaces drawn from them.
//!
//! The density C(q) is a function of the angular wavenumber, in length⁴, with
//! ∫ C d²q/(2π)² = h_rms². It is zero outside the table.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::ops::RangeInclusive;

use thiserror::Error;

use super::draws::{Draws, ModeDraw, Wave, Waves};
use super::moments::MomentSum;
use super::prescribed_heights::{HeightDistribution, adjust_phases};
use super::surface::Surface;
use crate::grid::Grid;
use crate::threads::Threads;

/// Maximum relative difference of two wavenumbers that count as equal.
///
/// Wavenumbers may have been rounded when they were written as text.
const ROUNDING: f64 = 1e-9;

/// Isotropic power spectral density C(q) that is given by a table.
///
/// Wavenumbers are positive and ascending. Densities are finite and not negative, and at least one
/// is positive.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralDensity(Shape);

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    /// Points (q, C), with ln C linear in ln q between them.
    ///
    /// If one of two neighbouring densities is zero, the density between them is zero.
    Points(Vec<[f64; 2]>),
    /// Density C of each ring. Ring n contains the wavenumbers that round to n × `step`.
    Rings { step: f64, densities: Vec<f64> },
}

/// Reason why a table is not a spectral density.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[expect(missing_docs, reason = "the error messages document the variants")]
pub enum SpectralDensityError {
    #[error("the spectral density has {found} wavenumbers; it needs at least 2")]
    TooFew { found: usize },
    #[error(
        "the wavenumber at point {number} is {wavenumber:?}; wavenumbers must be positive and \
         ascending"
    )]
    Wavenumber { number: usize, wavenumber: f64 },
    #[error(
        "the density at point {number} is {density:?}; densities must be finite and not negative"
    )]
    Density { number: usize, density: f64 },
    #[error("every density is zero; at least one must be positive")]
    Flat,
}

impl SpectralDensity {
    /// Creates a density from points (q, C), with a power law between neighbouring points.
    ///
    /// # Errors
    /// Fails if there are fewer than two points, if wavenumbers are not positive and ascending, if
    /// a density is negative or not finite, or if all densities are zero.
    pub fn from_points(points: Vec<[f64; 2]>) -> Result<Self, SpectralDensityError> {
        if points.len() < 2 {
            let found = points.len();
            return Err(SpectralDensityError::TooFew { found });
        }
        let mut before = 0.0;
        for (number, &[wavenumber, _]) in (1..).zip(&points) {
            if !(wavenumber.is_finite() && wavenumber > before) {
                return Err(SpectralDensityError::Wavenumber { number, wavenumber });
            }
            before = wavenumber;
        }
        check_densities(points.iter().map(|&[_, density]| density))?;
        Ok(Self(Shape::Points(points)))
    }

    /// Creates a piecewise constant density from pairs (n, C) of rings of wavenumbers.
    ///
    /// Ring n contains the wavenumbers that round to n × `step`. Omitted rings have a density of
    /// zero.
    ///
    /// On a cell of side L = 2π/`step`, the expected density of each ring of a drawn surface is
    /// then C. Interpolation between the rings would change it, because the density falls by more
    /// than half within each of the first rings.
    ///
    /// # Errors
    /// Fails if a density is negative or not finite, or if all densities are zero.
    pub fn from_rings(
        step: f64,
        rings: impl IntoIterator<Item = (u32, f64)>,
    ) -> Result<Self, SpectralDensityError> {
        let mut densities = Vec::new();
        for (ring, density) in rings {
            let ring = ring as usize;
            densities.resize(densities.len().max(ring + 1), 0.0);
            densities[ring] = density;
        }
        check_densities(densities.iter().copied())?;
        Ok(Self(Shape::Rings { step, densities }))
    }

    /// Converts the density to another unit of length, where one old unit is `factor` new units.
    #[must_use]
    pub fn in_unit(mut self, factor: f64) -> Self {
        let square = factor * factor;
        let fourth = square * square;
        match &mut self.0 {
            Shape::Points(points) => {
                for [wavenumber, density] in points {
                    *wavenumber /= factor;
                    *density *= fourth;
                }
            }
            Shape::Rings { step, densities } => {
                *step /= factor;
                densities.iter_mut().for_each(|density| *density *= fourth);
            }
        }
        self
    }

    /// Returns C at the angular wavenumber q = `wavenumber`, or zero outside the table.
    pub fn at(&self, wavenumber: f64) -> f64 {
        match &self.0 {
            Shape::Rings { step, densities } => {
                let ring = (wavenumber / step).round() as usize;
                densities.get(ring).copied().unwrap_or(0.0)
            }
            Shape::Points(points) => {
                let next = points.partition_point(|&[known, _]| known < wavenumber);
                let is_at = |known: f64| (wavenumber / known - 1.0).abs() <= ROUNDING;
                match (next.checked_sub(1).map(|left| points[left]), points.get(next)) {
                    (_, Some(&[known, density])) if is_at(known) => density,
                    (Some([known, density]), _) if is_at(known) => density,
                    (Some(left), Some(&right)) => between(left, right, wavenumber),
                    _ => 0.0,
                }
            }
        }
    }

    /// Returns the smallest and the largest angular wavenumber of the table.
    pub fn range(&self) -> [f64; 2] {
        match &self.0 {
            Shape::Points(points) => [points[0][0], points[points.len() - 1][0]],
            Shape::Rings { step, densities } => [0.5 * step, (densities.len() as f64 - 0.5) * step],
        }
    }
}

/// Returns C(`wavenumber`) by a power law between two points (q, C).
fn between([left, low]: [f64; 2], [right, high]: [f64; 2], wavenumber: f64) -> f64 {
    if low == 0.0 || high == 0.0 {
        return 0.0;
    }
    let fraction = log_ratio(wavenumber, left) / log_ratio(right, left);
    let rise = fraction * log_ratio(high, low);
    let factor = libm::exp(rise);
    if factor.is_finite() && factor > 0.0 { low * factor } else { libm::exp(libm::log(low) + rise) }
}

/// Returns ln(a/b), even if a/b overflows or underflows.
fn log_ratio(a: f64, b: f64) -> f64 {
    let ratio = a / b;
    if ratio.is_finite() && ratio > 0.0 { libm::log(ratio) } else { libm::log(a) - libm::log(b) }
}

fn check_densities(densities: impl Iterator<Item = f64>) -> Result<(), SpectralDensityError> {
    let mut is_flat = true;
    for (number, density) in (1..).zip(densities) {
        if !(density.is_finite() && density >= 0.0) {
            return Err(SpectralDensityError::Density { number, density });
        }
        is_flat &= density == 0.0;
    }
    if is_flat { Err(SpectralDensityError::Flat) } else { Ok(()) }
}

/// Gaussian random surface with a tabulated spectral density.
///
/// The random numbers depend only on seed, realization and mode. On two grids of one cell, the
/// surfaces therefore differ only by the waves that the coarser grid cannot resolve. If two modes
/// coincide at the Nyquist wavenumber of a grid, the surface contains only one of them.
///
/// ```
/// use std::f64::consts::TAU;
///
/// use asperity_mechanics::grid::{Boundary, Grid};
/// use asperity_mechanics::topography::spectral_density::TabulatedSurface;
/// use asperity_mechanics::topography::spectral_density::SpectralDensity;
///
/// // The density is constant from 4 to 12 waves along a side of one.
/// let density = SpectralDensity::from_points(vec![[TAU * 4.0, 1e-6], [TAU * 12.0, 1e-6]])?;
/// let surface = TabulatedSurface { density: &density, rms_slope: None, seed: 1, realization: 0 };
/// let grid = Grid::square(32, 1.0).unwrap();
/// let square: f64 = surface.draw(grid).heights().iter().map(|height| height * height).sum();
/// // Each of the π (12² − 4²) modes contributes 1e-6.
/// assert!((square / 1024.0 / (402.0 * 1e-6) - 1.0).abs() < 0.2);
/// # Ok::<(), asperity_mechanics::topography::spectral_density::SpectralDensityError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TabulatedSurface<'a> {
    /// Power spectral density, in the unit of the grid's sides.
    pub density: &'a SpectralDensity,
    /// Rms slope √⟨|∇h|²⟩ to which the heights are scaled. If it is `None`, they are not scaled.
    pub rms_slope: Option<f64>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Index of the realization. Realizations are statistically independent.
    pub realization: u32,
}

impl TabulatedSurface<'_> {
    /// Draws the heights on a grid. They are zero if no mode of the grid has a positive density.
    pub fn draw(&self, grid: Grid) -> Surface {
        self.draw_on(&Threads::one(), grid, None)
    }

    /// Draws the same heights as [`TabulatedSurface::draw`], with several threads. With a
    /// distribution of heights, the modes have the same moduli, but phases with which the heights
    /// have this distribution, see [`prescribed_heights`](super::prescribed_heights).
    pub fn draw_on(
        &self,
        threads: &Threads,
        grid: Grid,
        distribution: Option<&HeightDistribution>,
    ) -> Surface {
        let Some(distribution) = distribution else {
            return self.sum(threads, grid, self.waves(grid));
        };
        let mut waves: Vec<Wave> = self.waves(grid).collect();
        adjust_phases(&mut waves, distribution, threads);
        self.sum(threads, grid, waves.into_iter())
    }

    /// Iterates over the waves of the surface on a grid, not yet scaled to the rms slope.
    fn waves(&self, grid: Grid) -> impl Iterator<Item = Wave> {
        let draws = Draws::new(self.seed, self.realization);
        let density_of_pair = move |k_x: i32, k_y: i32| {
            self.density.at(wavenumber(grid, k_x, k_y)) / grid.cell().area()
        };
        modes(grid, self.density.range()[1]).flat_map(move |(k_x, columns)| {
            let of_row = draws.row(k_x, *columns.start() as u32);
            columns.zip(of_row).filter_map(move |(k_y, draw)| {
                let mean_power = density_of_pair(k_x, k_y);
                (mean_power > 0.0).then(|| drawn(grid, [k_x, k_y], mean_power, &draw))
            })
        })
    }

    /// Returns the sum of the waves, scaled to the rms slope.
    fn sum(&self, threads: &Threads, grid: Grid, waves: impl Iterator<Item = Wave>) -> Surface {
        let mut summed = Waves::new(grid.nodes());
        let mut sum = MomentSum::new(grid.cell());
        for wave in waves {
            sum.add_pair(wave.waves.map(f64::from), power_on(grid, &wave));
            summed.add(wave);
        }
        let square_slope = sum.square_slope();
        let scale = match self.rms_slope {
            Some(rms_slope) if square_slope > 0.0 => rms_slope / square_slope.sqrt(),
            _ => 1.0,
        };
        let heights = summed.heights(threads, scale);
        Surface::new(grid, heights).expect("a sum of finite waves is finite")
    }
}

/// Returns `true` if a mode of the grid has a positive density.
pub fn occupies(density: &SpectralDensity, grid: Grid) -> bool {
    let mut modes = modes(grid, density.range()[1]);
    modes.any(|(k_x, mut columns)| columns.any(|k_y| density.at(wavenumber(grid, k_x, k_y)) > 0.0))
}

/// Returns a wave with a random coefficient, whose expected |c|² is `mean_power`.
fn drawn(grid: Grid, waves: [i32; 2], mean_power: f64, draw: &ModeDraw) -> Wave {
    let coefficient = (mean_power * draw.power()).sqrt() * draw.phase();
    let share = if is_own_opposite(grid, waves) { FRAC_1_SQRT_2 } else { 1.0 };
    Wave { waves, coefficient: share * coefficient }
}

/// Returns the mean square height of a wave on a grid.
fn power_on(grid: Grid, wave: &Wave) -> f64 {
    if is_own_opposite(grid, wave.waves) {
        // k and −k are the same mode, with the heights ±2 Re(c) on the grid.
        (2.0 * wave.coefficient.re).powi(2)
    } else {
        2.0 * wave.coefficient.norm_sqr()
    }
}

/// Returns whether k and −k coincide on a grid.
fn is_own_opposite(grid: Grid, waves: [i32; 2]) -> bool {
    let is_own_opposite = |axis: usize| {
        waves[axis] == 0 || 2 * waves[axis].unsigned_abs() as usize == grid.nodes()[axis]
    };
    is_own_opposite(0) && is_own_opposite(1)
}

/// Iterates over one mode of each pair ±k of a grid, without the mean. Each item is k_x and a range
/// of k_y.
///
/// |q_x| and |q_y| are at most `max_wavenumber`.
fn modes(grid: Grid, max_wavenumber: f64) -> impl Iterator<Item = (i32, RangeInclusive<i32>)> {
    let size = grid.cell().size();
    let max_waves = |axis: usize| {
        let within = (max_wavenumber * size[axis] / TAU * (1.0 + 1e-12)).floor();
        (grid.nodes()[axis] / 2).min(within as usize) as i32
    };
    let [max_x, max_y] = [max_waves(0), max_waves(1)];
    let [nodes_x, nodes_y] = grid.nodes();
    let is_nyquist = |waves: i32, nodes: usize| 2 * waves.unsigned_abs() as usize == nodes;
    let rows = -max_x..=max_x;
    rows.filter(move |&k_x| k_x >= 0 || !is_nyquist(k_x, nodes_x)).map(move |k_x| {
        // For k_x < 0, the modes k_y = ±N/2 coincide with the opposite of a mode with k_x > 0.
        let hidden = k_x < 0 && is_nyquist(max_y, nodes_y);
        (k_x, i32::from(k_x <= 0)..=max_y - i32::from(hidden))
    })
}

fn wavenumber(grid: Grid, k_x: i32, k_y: i32) -> f64 {
    let cell = grid.cell();
    TAU / cell.longer_side() * cell.wavenumber([k_x, k_y].map(f64::from))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::grid::Boundary;
    use crate::grid::samples::{rectangle, square};
    use crate::topography::moments::Moments;
    use crate::topography::power_spectrum;
    use crate::topography::power_spectrum::Ring;

    fn power_law(exponent: f64, waves: [f64; 2]) -> SpectralDensity {
        let point = |k: f64| [TAU * k, 1e-6 * libm::pow(k, -exponent)];
        SpectralDensity::from_points(waves.map(point).to_vec()).unwrap()
    }

    #[test]
    fn between_two_points_the_density_is_a_power_law() {
        let density = power_law(3.6, [1.0, 100.0]);
        for k in [1.0, 1.7, 10.0, 99.0, 100.0] {
            let exact = 1e-6 * libm::pow(k, -3.6);
            assert!((density.at(TAU * k) / exact - 1.0).abs() < 1e-13);
        }
        assert_eq!(density.at(TAU * 0.999), 0.0);
        assert!(density.at(TAU * (1.0 - 1e-12)) > 0.0);
        assert_eq!(density.at(TAU * 100.001), 0.0);
    }

    #[test]
    fn a_power_law_is_exact_if_its_ratios_overflow() {
        let falling = vec![[1e-200, 1e200], [1e200, 1e-200]];
        let rising = vec![[1e-200, 1e-200], [1e200, 1e200]];
        for q in [1e-199, 1e-3, 1.0, 1e199] {
            let at =
                |points: &[[f64; 2]]| SpectralDensity::from_points(points.to_vec()).unwrap().at(q);
            assert!((at(&falling) * q - 1.0).abs() < 1e-12, "{q}");
            assert!((at(&rising) / q - 1.0).abs() < 1e-12, "{q}");
        }
    }

    #[test]
    fn a_density_beside_zero_is_zero() {
        let points = vec![[1.0, 2.0], [2.0, 0.0], [3.0, 1.0], [4.0, 1.0]];
        let density = SpectralDensity::from_points(points).unwrap();
        let found = [1.0, 1.5, 2.0, 2.5, 3.0, 3.5].map(|q| density.at(q));
        assert_eq!(found, [2.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
    }

    #[test]
    fn numbers_that_are_no_density_are_refused() {
        let found = |points: Vec<[f64; 2]>| SpectralDensity::from_points(points).unwrap_err();
        let number = 2;
        assert_eq!(found(vec![[1.0, 1.0]]), SpectralDensityError::TooFew { found: 1 });
        assert_eq!(
            found(vec![[1.0, 1.0], [1.0, 1.0]]),
            SpectralDensityError::Wavenumber { number, wavenumber: 1.0 }
        );
        assert_eq!(
            found(vec![[1.0, 1.0], [2.0, -1.0]]),
            SpectralDensityError::Density { number, density: -1.0 }
        );
        assert_eq!(found(vec![[1.0, 0.0], [2.0, 0.0]]), SpectralDensityError::Flat);
    }

    fn surface(density: &SpectralDensity, realization: u32) -> TabulatedSurface<'_> {
        TabulatedSurface { density, rms_slope: None, seed: 11, realization }
    }

    #[test]
    fn another_unit_of_length_changes_numbers_and_no_surface() {
        let density = power_law(3.0, [2.0, 12.0]);
        let metres = surface(&density, 0).draw(square(32, 1.0));
        let millimetres = density.clone().in_unit(1e3);
        let other = surface(&millimetres, 0).draw(square(32, 1e3));
        for (one, other) in metres.heights().iter().zip(other.heights()) {
            assert!((1e3 * one - other).abs() < 1e-12);
        }
    }

    #[test]
    fn every_mesh_shows_the_same_surface() {
        let density = power_law(3.0, [2.0, 9.0]);
        let size = [1.0, 0.75];
        let [coarse, fine] =
            [[30, 24], [60, 72]].map(|nodes| surface(&density, 3).draw(rectangle(nodes, size)));
        let rms_height = Moments::from_surface(&fine).rms_height();
        for (node, height) in coarse.heights().iter().enumerate() {
            let [i, j] = coarse.grid().indices(node);
            let shared = fine.heights()[2 * i * 72 + 3 * j];
            assert!((height - shared).abs() < 1e-12 * rms_height);
        }
    }

    #[test]
    fn slope_is_scaled_where_it_is_asked_for() {
        // The density extends to the corners of the grid and includes waves at Nyquist.
        let density = power_law(2.0, [1.0, 100.0]);
        for grid in [square(16, 1.0), rectangle([9, 12], [1.0, 0.5])] {
            let scaled = TabulatedSurface { rms_slope: Some(0.3), ..surface(&density, 0) };
            let slope = Moments::from_surface(&scaled.draw(grid)).rms_slope();
            assert!((slope / 0.3 - 1.0).abs() < 1e-12, "{slope}");
        }
    }

    #[test]
    fn a_mesh_without_modes_in_the_range_is_known() {
        let density = power_law(2.0, [1.1, 1.3]);
        // This cell has the wavenumbers 1 and √2, but none between them.
        assert!(!occupies(&density, square(16, 1.0)));
        assert!(occupies(&density, square(16, 2.0)), "√5 of half the wavenumber");
        assert!(surface(&density, 0).draw(square(16, 1.0)).heights() == [0.0; 256]);
    }

    /// Returns the rings of drawn surfaces, with their densities averaged over the surfaces.
    fn mean_rings(density: &SpectralDensity, grid: Grid, surfaces: u32) -> Vec<Ring> {
        let mut mean: Vec<Ring> = Vec::new();
        for realization in 0..surfaces {
            let drawn = surface(density, realization).draw(grid);
            let rings = power_spectrum::rings(&drawn, Boundary::Periodic);
            mean.resize(rings.len(), Ring { density: 0.0, ..rings[0] });
            for (mean, ring) in mean.iter_mut().zip(rings) {
                mean.waves = ring.waves;
                mean.modes = ring.modes;
                mean.density += ring.density / f64::from(surfaces);
            }
        }
        mean
    }

    #[test]
    fn surfaces_have_the_density_of_every_ring_up_to_the_corners_of_the_mesh() {
        for grid in [square(16, 1.0), rectangle([16, 9], [1.0, 0.7])] {
            let rings = (1..12).map(|ring| (ring, f64::from(ring).powi(-3)));
            let density = SpectralDensity::from_rings(TAU, rings).unwrap();
            let surfaces = 400;
            for ring in mean_rings(&density, grid, surfaces) {
                if ring.waves >= 12 {
                    continue;
                }
                let exact = f64::from(ring.waves).powi(-3);
                // Each surface has modes/2 pairs with exponentially distributed powers. The
                // tolerance is four standard errors.
                let error = (2.0 / f64::from(ring.modes * surfaces)).sqrt();
                let deviation = ring.density / exact - 1.0;
                assert!(deviation.abs() < 4.0 * error, "{ring:?}: {deviation}");
            }
        }
    }
}
