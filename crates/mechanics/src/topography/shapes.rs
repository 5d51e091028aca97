//! Simple shapes whose contact has a closed form.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::surface::Surface;
use crate::grid::Grid;

const X: usize = 0;
const Y: usize = 1;

/// Simple shape of a surface, with lengths in the unit of the sides of the cell.
///
/// ```
/// use asperity_mechanics::grid::Grid;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// let wave = Shape::Wave { amplitude: 0.1, waves: 2 };
/// let surface = wave.draw(Grid::square(16, 1.0)?);
/// // Crests at x = 0 and 1/2, a trough at 1/4, all the same along y.
/// let along_x = |i: usize| surface.heights()[i * 16];
/// assert_eq!([along_x(0), along_x(4), along_x(8)], [0.1, -0.1, 0.1]);
/// assert_eq!(surface.heights()[0], surface.heights()[15]);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "kebab-case")]
#[expect(missing_docs, reason = "the formulas document the fields")]
pub enum Shape {
    /// Paraboloid h = −r²/(2R) around the centre of the cell.
    ///
    /// If the contact is much smaller than the cell, it is a Hertz contact.
    Paraboloid { radius: f64 },
    /// Wave h = Δ cos(2π n x/L_x) with n = `waves`, the contact of Westergaard 1939.
    Wave { amplitude: f64, waves: u32 },
    /// Product of two waves, h = Δ cos(2π n x/L_x) cos(2π n y/L_y).
    ///
    /// On a square, this is the contact of Johnson, Greenwood & Higginson 1985.
    WaveProduct { amplitude: f64, waves: u32 },
    /// Sum of two waves, h = Δ [cos(2π n x/L_x) + cos(2π n y/L_y)].
    ///
    /// On a square, this is a [`Shape::WaveProduct`] of twice the amplitude, rotated by
    /// 45°, with wavelengths longer by a factor of √2.
    WaveSum { amplitude: f64, waves: u32 },
    /// Flat punch, h = 0 within `radius` of the centre of the cell and h = −`depth` outside.
    #[serde(rename = "flat-punch")]
    Punch { radius: f64, depth: f64 },
}

impl Shape {
    /// Returns the heights of the shape on a grid.
    ///
    /// # Panics
    /// Panics if a height is not finite, for example with an infinite length or a radius R = 0.
    pub fn draw(&self, grid: Grid) -> Surface {
        let heights = (0..grid.count()).map(|node| self.height(grid, grid.indices(node))).collect();
        Surface::new(grid, heights).expect("lengths are finite and radii positive")
    }

    fn height(&self, grid: Grid, indices: [usize; 2]) -> f64 {
        let (nodes, size) = (grid.nodes(), grid.cell().size());
        let square_radius = || {
            let from_centre =
                |axis: usize| (indices[axis] as f64 / nodes[axis] as f64 - 0.5) * size[axis];
            from_centre(X).powi(2) + from_centre(Y).powi(2)
        };
        let wave = |axis: usize, waves: u32| {
            // The phase is modulo one period, so that all periods have the same bits.
            let phase = (indices[axis] * waves as usize) % nodes[axis];
            libm::cos(TAU * phase as f64 / nodes[axis] as f64)
        };
        match *self {
            Self::Paraboloid { radius } => -square_radius() / (2.0 * radius),
            Self::Wave { amplitude, waves } => amplitude * wave(X, waves),
            Self::WaveProduct { amplitude, waves } => amplitude * wave(X, waves) * wave(Y, waves),
            Self::WaveSum { amplitude, waves } => amplitude * (wave(X, waves) + wave(Y, waves)),
            Self::Punch { radius, .. } if square_radius() <= radius * radius => 0.0,
            Self::Punch { depth, .. } => -depth,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::{rectangle, square};
    use crate::topography::moments::Moments;

    #[test]
    fn paraboloid_has_its_summit_in_the_centre_and_its_radius_there() {
        let surface = Shape::Paraboloid { radius: 0.4 }.draw(square(64, 2.0));
        let at = |i: usize, j: usize| surface.heights()[i * 64 + j];
        assert_eq!(at(32, 32), 0.0);
        let curvature =
            (at(31, 32) - 2.0 * at(32, 32) + at(33, 32)) / surface.grid().spacing()[0].powi(2);
        assert!((curvature + 1.0 / 0.4).abs() < 1e-12);
        assert_eq!(at(20, 40), at(40, 20));
        assert_eq!(at(20, 32), at(44, 32));
    }

    #[test]
    fn wave_repeats_exactly_and_varies_along_x_only() {
        let surface = Shape::Wave { amplitude: 0.1, waves: 4 }.draw(square(32, 1.0));
        for (node, height) in surface.heights().iter().enumerate() {
            assert_eq!(*height, surface.heights()[(node / 32 % 8) * 32]);
        }
        assert_eq!(surface.heights()[0], 0.1);
        assert_eq!(surface.heights()[4 * 32], -0.1);
    }

    #[test]
    fn waves_have_the_slopes_of_their_derivatives() {
        let (amplitude, waves) = (0.1, 3);
        let steepest = (TAU * 3.0 * amplitude).powi(2);
        let slopes = [
            (Shape::Wave { amplitude, waves }, [steepest / 2.0, 0.0]),
            (Shape::WaveProduct { amplitude, waves }, [steepest / 4.0; 2]),
            (Shape::WaveSum { amplitude, waves }, [steepest / 2.0; 2]),
        ];
        for (shape, exact) in slopes {
            let moments = Moments::from_surface(&shape.draw(square(30, 1.0)));
            for (found, exact) in [moments.m20, moments.m02].into_iter().zip(exact) {
                assert!((found - exact).abs() < 1e-13, "{shape:?}: {found}");
            }
        }
    }

    #[test]
    fn a_rectangle_has_its_centre_and_its_waves_on_both_axes() {
        let grid = rectangle([12, 20], [1.0, 2.0]);
        let at = |shape: Shape, i: usize, j: usize| shape.draw(grid).heights()[i * 20 + j];
        let bowl = Shape::Paraboloid { radius: 0.5 };
        assert_eq!(at(bowl, 6, 10), 0.0);
        // The nodes are three steps of 1/12 from the centre along x, five of 1/10 along y;
        // r²/(2R) = r².
        assert!((at(bowl, 9, 10) + 0.0625).abs() < 1e-15);
        assert!((at(bowl, 6, 15) + 0.25).abs() < 1e-15);
        let (amplitude, waves) = (1.0, 2);
        let product = Shape::WaveProduct { amplitude, waves };
        assert_eq!(at(product, 3, 0), -1.0);
        assert_eq!(at(product, 0, 5), -1.0);
    }

    #[test]
    fn punch_covers_the_area_of_its_disc() {
        let shape = Shape::Punch { radius: 0.3, depth: 2.0 };
        let surface = shape.draw(square(256, 1.0));
        let top = surface.heights().iter().filter(|&&h| h == 0.0).count();
        let bottom = surface.heights().iter().filter(|&&h| h == -2.0).count();
        assert_eq!(top + bottom, 256 * 256);
        let fraction = top as f64 / (256.0 * 256.0);
        // The disc has a radius of 77 nodes; its number of nodes is accurate to a few of the 480 on
        // its edge.
        assert!((fraction / (TAU / 2.0 * 0.09) - 1.0).abs() < 2e-3);
    }
}
