//! Shapes whose contact has a closed form.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::surface::Surface;

/// A periodic surface of simple shape, peaks up; lengths in the unit of the side of the cell.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "kebab-case")]
#[expect(missing_docs, reason = "the formula of each names them")]
pub enum Shape {
    /// h = −r²/(2R) around the centre of the cell: Hertz's contact while it is small in the cell.
    Paraboloid { radius: f64 },
    /// h = Δ cos(2π n x/L): Westergaard's contact. `waves` is n.
    Wave { amplitude: f64, waves: u32 },
    /// h = Δ cos(2π n x/L) cos(2π n y/L): the contact of Johnson, Greenwood & Higginson 1985.
    WaveProduct { amplitude: f64, waves: u32 },
    /// h = Δ [cos(2π n x/L) + cos(2π n y/L)]: the same contact, turned by 45° and √2 shorter.
    WaveSum { amplitude: f64, waves: u32 },
    /// Zero within a disc of the given radius around the centre, −`depth` outside.
    #[serde(rename = "flat-punch")]
    Punch { radius: f64, depth: f64 },
}

impl Shape {
    /// The heights on a mesh of `nodes` per side; radii must be positive, all lengths finite.
    pub fn draw(&self, nodes: usize, side: f64) -> Surface {
        let heights = (0..nodes * nodes)
            .map(|node| self.height(node / nodes, node % nodes, nodes, side))
            .collect();
        Surface::new(nodes, side, heights).expect("lengths are finite and radii positive")
    }

    fn height(&self, i: usize, j: usize, nodes: usize, side: f64) -> f64 {
        let square_radius = || {
            let from_centre = |index: usize| (index as f64 / nodes as f64 - 0.5) * side;
            from_centre(i).powi(2) + from_centre(j).powi(2)
        };
        let wave = |index: usize, waves: u32| {
            // Reduced to one turn, so that all waves of a surface are equal to the last bit.
            let phase = (index * waves as usize) % nodes;
            libm::cos(TAU * phase as f64 / nodes as f64)
        };
        match *self {
            Self::Paraboloid { radius } => -square_radius() / (2.0 * radius),
            Self::Wave { amplitude, waves } => amplitude * wave(i, waves),
            Self::WaveProduct { amplitude, waves } => amplitude * wave(i, waves) * wave(j, waves),
            Self::WaveSum { amplitude, waves } => amplitude * (wave(i, waves) + wave(j, waves)),
            Self::Punch { radius, .. } if square_radius() <= radius * radius => 0.0,
            Self::Punch { depth, .. } => -depth,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::topography::moments::Moments;

    #[test]
    fn paraboloid_has_its_summit_in_the_centre_and_its_radius_there() {
        let surface = Shape::Paraboloid { radius: 0.4 }.draw(64, 2.0);
        let at = |i: usize, j: usize| surface.heights()[i * 64 + j];
        assert_eq!(at(32, 32), 0.0);
        let curvature = (at(31, 32) - 2.0 * at(32, 32) + at(33, 32)) / surface.spacing().powi(2);
        assert!((curvature + 1.0 / 0.4).abs() < 1e-12);
        assert_eq!(at(20, 40), at(40, 20));
        assert_eq!(at(20, 32), at(44, 32));
    }

    #[test]
    fn wave_repeats_exactly_and_varies_along_x_only() {
        let surface = Shape::Wave {
            amplitude: 0.1,
            waves: 4,
        }
        .draw(32, 1.0);
        for (node, height) in surface.heights().iter().enumerate() {
            assert_eq!(*height, surface.heights()[(node / 32 % 8) * 32]);
        }
        assert_eq!(surface.heights()[0], 0.1);
        assert_eq!(surface.heights()[4 * 32], -0.1);
    }

    #[test]
    fn waves_have_the_slopes_of_their_derivatives() {
        let (amplitude, waves) = (0.1, 3);
        let square = (TAU * 3.0 * amplitude).powi(2);
        let slopes = [
            (Shape::Wave { amplitude, waves }, [square / 2.0, 0.0]),
            (Shape::WaveProduct { amplitude, waves }, [square / 4.0; 2]),
            (Shape::WaveSum { amplitude, waves }, [square / 2.0; 2]),
        ];
        for (shape, exact) in slopes {
            let moments = Moments::of(&shape.draw(30, 1.0));
            for (found, exact) in [moments.m20, moments.m02].into_iter().zip(exact) {
                assert!((found - exact).abs() < 1e-13, "{shape:?}: {found}");
            }
        }
    }

    #[test]
    fn punch_covers_the_area_of_its_disc() {
        let shape = Shape::Punch {
            radius: 0.3,
            depth: 2.0,
        };
        let surface = shape.draw(256, 1.0);
        let top = surface.heights().iter().filter(|&&h| h == 0.0).count();
        let bottom = surface.heights().iter().filter(|&&h| h == -2.0).count();
        assert_eq!(top + bottom, 256 * 256);
        let fraction = top as f64 / (256.0 * 256.0);
        // The count of nodes in a disc of 77 nodes is right to a few nodes along its edge of 480.
        assert!((fraction / (TAU / 2.0 * 0.09) - 1.0).abs() < 2e-3);
    }
}
