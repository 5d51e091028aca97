//! Developed area and texture direction of a surface: Sdr and Std of ISO 25178-2.
//!
//! The other areal parameters are in [`descriptors`](super::descriptors) (height parameters and
//! Sdq), [`autocorrelation`](super::autocorrelation) (Sal, Str),
//! [`material_ratio`](super::material_ratio) and [`peaks`](super::peaks).

use std::f64::consts::{PI, TAU};

use rustfft::num_complex::Complex;

use super::descriptors::from_first_node;
use super::moments::modes_mut;
use super::power_spectrum::windowed;
use super::surface::Surface;
use crate::fft::Transform;
use crate::grid::{Boundary, Grid};

/// Computes the developed interfacial area ratio Sdr: the area of the surface over that of its
/// projection, minus one (ISO 25178-2:2021, 4.4.3).
///
/// For a periodic map, it is the mean of (1 + |∇h|²)^½ − 1 over the nodes, with the gradient of the
/// trigonometric interpolant. Modes at the Nyquist wavenumber have no slope at the nodes. For other
/// maps, each rectangle of four nodes is divided into two triangles along either diagonal, and
/// the areas of both divisions are averaged (annex D.3).
///
/// ```
/// use asperity_mechanics::grid::{Boundary, Cell, Grid};
/// use asperity_mechanics::topography::areal::developed_area_ratio;
/// use asperity_mechanics::topography::surface::Surface;
///
/// // An inclined plane h = 3x/4 is longer than its projection by a factor of 5/4.
/// let grid = Grid::new([4, 4], Cell::new([4.0, 4.0])?)?;
/// let plane = (0..16).map(|node| 0.75 * grid.indices(node)[0] as f64).collect();
/// let plane = Surface::new(grid, plane)?;
/// assert_eq!(developed_area_ratio(&plane, Boundary::Free), 0.25);
/// # Ok::<(), asperity_mechanics::topography::surface::SurfaceError>(())
/// ```
pub fn developed_area_ratio(surface: &Surface, boundary: Boundary) -> f64 {
    match boundary {
        Boundary::Periodic => ratio_of_interpolant(surface),
        Boundary::Free => ratio_of_triangles(surface),
    }
}

/// Returns (1 + g)^½ − 1 for a square gradient g, without cancellation for small slopes.
fn excess_area(square_gradient: f64) -> f64 {
    square_gradient / ((1.0 + square_gradient).sqrt() + 1.0)
}

fn ratio_of_interpolant(surface: &Surface) -> f64 {
    let (grid, nodes) = (surface.grid(), surface.grid().nodes());
    let transform = Transform::new(nodes);
    let heights = transform.spectrum(&from_first_node(surface.heights()));
    let mut square_gradients = vec![0.0; grid.count()];
    let factor = TAU / grid.cell().longer_side() / grid.count() as f64;
    for axis in 0..2 {
        let mut slopes = heights.clone();
        for (waves, value) in modes_mut(&mut slopes, nodes) {
            // The interpolant has no slope at the Nyquist wavenumber of the axis.
            let is_nyquist = 2.0 * waves[axis].abs() == nodes[axis] as f64;
            let wavenumber = if is_nyquist { 0.0 } else { grid.cell().wavevector(waves)[axis] };
            *value *= Complex::new(0.0, factor * wavenumber);
        }
        for (square, slope) in square_gradients.iter_mut().zip(transform.field(slopes)) {
            *square += slope * slope;
        }
    }
    square_gradients.into_iter().map(excess_area).sum::<f64>() / grid.count() as f64
}

fn ratio_of_triangles(surface: &Surface) -> f64 {
    let [nodes_x, nodes_y] = surface.grid().nodes();
    let [step_x, step_y] = surface.grid().spacing();
    let at = |i: usize, j: usize| surface.heights()[i * nodes_y + j];
    let mut sum = 0.0;
    for i in 1..nodes_x {
        for j in 1..nodes_y {
            let [low, right, left, high] = [at(i - 1, j - 1), at(i, j - 1), at(i - 1, j), at(i, j)];
            let along_x = [(right - low) / step_x, (high - left) / step_x];
            let along_y = [(left - low) / step_y, (high - right) / step_y];
            // Each corner has a triangle, whose slopes are those of the two edges at the corner.
            for slope_x in along_x {
                for slope_y in along_y {
                    sum += excess_area(slope_x * slope_x + slope_y * slope_y) / 4.0;
                }
            }
        }
    }
    sum / ((nodes_x - 1) * (nodes_y - 1)).max(1) as f64
}

/// Number of directions between 0° and 180° that [`texture_direction`] compares.
const DIRECTIONS: u32 = 360;

/// Steps between the points of a ray through the spectrum, in units of 2π/L.
const RAY_STEP: f64 = 0.25;

/// Computes the texture direction Std in degrees: the direction in which the angular amplitude
/// density of the spectrum is largest (ISO 25178-2:2021, 4.3.4). `None` for a flat surface.
///
/// The direction is the angle from the x axis to the wavevector, anticlockwise, from 0° to 180°.
/// Equally, it is the angle from the y axis to the lay: a grating of ridges along y has Std = 0.
/// The angular amplitude density ∫ |ĥ(q)| q dq is integrated from 2π/L to the smaller Nyquist
/// wavenumber, with the longer side L, every half degree. Between the modes, |ĥ| is interpolated
/// bilinearly. A wave with n periods determines the angle to about 1/n radians.
///
/// Maps that are not periodic are multiplied by a Hann window; otherwise the steps between opposite
/// edges would give 0° or 90° for most maps.
///
/// ```
/// use asperity_mechanics::grid::{Boundary, Grid};
/// use asperity_mechanics::topography::areal::texture_direction;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// let ridges_along_y = Shape::Wave { amplitude: 0.1, waves: 8 }.draw(Grid::square(64, 1.0)?);
/// assert_eq!(texture_direction(&ridges_along_y, Boundary::Periodic), Some(0.0));
/// assert_eq!(texture_direction(&ridges_along_y, Boundary::Free), Some(0.0));
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
pub fn texture_direction(surface: &Surface, boundary: Boundary) -> Option<f64> {
    let spectrum = Amplitudes::from_surface(surface, boundary);
    let mut largest = 0.0;
    let mut direction = None;
    for step in 0..DIRECTIONS {
        let degrees = 180.0 * f64::from(step) / f64::from(DIRECTIONS);
        let density = spectrum.angular_density(degrees);
        if density > largest {
            largest = density;
            direction = Some(degrees);
        }
    }
    direction
}

/// Amplitudes |ĥ| of the modes of a map, not normalised.
struct Amplitudes {
    grid: Grid,
    /// Half spectrum, with rows of k_y from 0 to N_y/2.
    values: Vec<f64>,
}

impl Amplitudes {
    fn from_surface(surface: &Surface, boundary: Boundary) -> Self {
        let grid = surface.grid();
        let (heights, _) = windowed(surface, boundary);
        let mut spectrum = Transform::new(grid.nodes()).spectrum(&heights);
        spectrum[0] = Complex::default();
        Self {
            grid,
            values: spectrum.into_iter().map(|value: Complex<f64>| value.norm()).collect(),
        }
    }

    /// Returns ∫ |ĥ(q)| q dq in a direction from the x axis, up to a factor.
    fn angular_density(&self, degrees: f64) -> f64 {
        let (sine, cosine) = libm::sincos(PI * degrees / 180.0);
        let aspect = self.grid.cell().aspect();
        let nodes = self.grid.nodes();
        let nyquist = [0, 1].map(|axis| (nodes[axis] / 2) as f64 * aspect[axis]);
        let last = ((nyquist[0].min(nyquist[1]) - 1.0) / RAY_STEP) as usize;
        let radii = (0..=last).map(|step| 1.0 + RAY_STEP * step as f64);
        radii.map(|q| q * self.between([q * cosine / aspect[0], q * sine / aspect[1]])).sum()
    }

    /// Interpolates between the amplitudes of the four modes around (k_x, k_y), where k_y ≥ 0.
    fn between(&self, [k_x, k_y]: [f64; 2]) -> f64 {
        let [low_x, low_y] = [k_x.floor(), k_y.floor()];
        let [x, y] = [k_x - low_x, k_y - low_y];
        let (i, j) = (low_x as isize, low_y as usize);
        let along_x = |j: usize| (1.0 - x) * self.at(i, j) + x * self.at(i + 1, j);
        (1.0 - y) * along_x(j) + y * along_x(j + 1)
    }

    /// Returns the amplitude of a mode, or zero beyond the Nyquist wavenumber.
    fn at(&self, k_x: isize, k_y: usize) -> f64 {
        let [nodes_x, nodes_y] = self.grid.nodes();
        if k_y > nodes_y / 2 || k_x.unsigned_abs() > nodes_x / 2 {
            return 0.0;
        }
        self.values[k_x.rem_euclid(nodes_x as isize) as usize * (nodes_y / 2 + 1) + k_y]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::{rectangle, square};
    use crate::topography::descriptors::Roughness;
    use crate::topography::random::samples;
    use crate::topography::shapes::Shape;

    const BOUNDARIES: [Boundary; 2] = [Boundary::Periodic, Boundary::Free];

    #[test]
    fn a_wave_is_as_long_as_its_arc() {
        // The arc length of a wave of amplitude Δ, by Simpson's rule over a quarter of a period.
        let (amplitude, waves) = (0.3, 2);
        let steep = TAU * f64::from(waves) * amplitude;
        let length = |phase: f64| (1.0 + (steep * libm::sin(phase)).powi(2)).sqrt();
        let (steps, mut exact) = (10_000, 0.0);
        for step in 0..=steps {
            let weight = if step == 0 || step == steps { 1 } else { 2 + 2 * (step % 2) };
            exact += f64::from(weight) * length(PI / 2.0 * f64::from(step) / f64::from(steps));
        }
        let exact = exact / (3.0 * f64::from(steps)) - 1.0;
        let wave = Shape::Wave { amplitude, waves }.draw(rectangle([512, 4], [1.0, 2.0]));
        let found = developed_area_ratio(&wave, Boundary::Periodic);
        assert!((found - exact).abs() < 1e-12, "{found} should be {exact}");
        // The last of 512 steps, which returns to the crest, is outside the map and nearly level.
        let found = developed_area_ratio(&wave, Boundary::Free) * 511.0 / 512.0;
        assert!((found / exact - 1.0).abs() < 1e-3, "{found} should be {exact}");
    }

    #[test]
    fn small_slopes_add_half_of_their_mean_square() {
        let rough = samples::random(2, 16, 1).draw(rectangle([64, 48], [1.0, 1.0]));
        let flattened = rough.scaled(1e-4).unwrap();
        for boundary in BOUNDARIES {
            let ratio = developed_area_ratio(&flattened, boundary);
            let half_square = Roughness::from_surface(&flattened, boundary).sdq.powi(2) / 2.0;
            // Triangles and gradients average over different edges of the map.
            let tolerance = if boundary == Boundary::Free { 0.05 } else { 1e-6 };
            assert!((ratio / half_square - 1.0).abs() < tolerance, "{ratio} {half_square}");
        }
    }

    #[test]
    fn one_row_and_one_node_have_no_area_to_develop() {
        for nodes in [[1, 1], [1, 8], [8, 1]] {
            let grid = rectangle(nodes, [1.0, 1.0]);
            let heights = (0..grid.count()).map(|node| (node % 3) as f64).collect();
            let surface = Surface::new(grid, heights).unwrap();
            assert_eq!(developed_area_ratio(&surface, Boundary::Free), 0.0);
            assert!(developed_area_ratio(&surface, Boundary::Periodic).is_finite());
            texture_direction(&surface, Boundary::Free);
        }
    }

    #[test]
    fn the_direction_of_a_wave_is_that_of_its_wavevector() {
        let grid = rectangle([96, 128], [3.0, 4.0]);
        for [k_x, k_y] in [[9, 0], [0, 12], [9, 12], [-9, 12], [12, 4]] {
            let height = |node: usize| {
                let [i, j] = grid.indices(node);
                let [x, y] = [i as f64 / 96.0, j as f64 / 128.0];
                libm::cos(TAU * (f64::from(k_x) * x + f64::from(k_y) * y))
            };
            let surface = Surface::new(grid, (0..grid.count()).map(height).collect()).unwrap();
            let exact = (f64::from(k_y) / 4.0).atan2(f64::from(k_x) / 3.0).to_degrees();
            for boundary in BOUNDARIES {
                let found = texture_direction(&surface, boundary).unwrap();
                assert!((found - exact).abs() <= 1.5, "{found} should be {exact}");
            }
        }
    }

    #[test]
    fn an_inclined_map_has_the_direction_of_its_texture() {
        // Without a window, the step of 20 amplitudes between the edges would give 90°.
        let grid = square(128, 1.0);
        let height = |node: usize| {
            let [x, y] = grid.indices(node).map(|index| index as f64 / 128.0);
            libm::cos(TAU * 16.0 * (x + y)) + 20.0 * y
        };
        let surface = Surface::new(grid, (0..grid.count()).map(height).collect()).unwrap();
        assert_eq!(texture_direction(&surface, Boundary::Free), Some(45.0));
    }

    #[test]
    fn a_flat_surface_has_neither_area_nor_direction() {
        let flat = Surface::new(square(16, 1.0), vec![0.1; 256]).unwrap();
        for boundary in BOUNDARIES {
            assert_eq!(developed_area_ratio(&flat, boundary), 0.0);
            assert_eq!(texture_direction(&flat, boundary), None);
        }
    }
}
