//! Areal roughness parameters under the names of ISO 25178-2.

use super::descriptors::{from_first_node, shape_of_heights};
use super::differences;
use super::moments::Moments;
use super::surface::Surface;
use crate::grid::Boundary;

/// Parameters of heights about their mean; whether they have been levelled or filtered is for who
/// made the map.
///
/// ```
/// use asperity_contact::grid::{Boundary, Grid};
/// use asperity_contact::topography::roughness::Roughness;
/// use asperity_contact::topography::shapes::Shape;
///
/// // A wave of amplitude Δ: Sq = Δ/√2, Sz = 2Δ, Sku = 3/2.
/// let wave = Shape::Wave { amplitude: 0.1, waves: 1 }.draw(Grid::square(64, 1.0)?);
/// let found = Roughness::of(&wave, Boundary::Periodic);
/// assert!((found.sq - 0.1 * 0.5_f64.sqrt()).abs() < 1e-15);
/// assert!((found.sz - 0.2).abs() < 1e-15);
/// assert!((found.sku.unwrap() - 1.5).abs() < 1e-12);
/// # Ok::<(), asperity_contact::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roughness {
    /// Root mean square height.
    pub sq: f64,
    /// Mean of the absolute height.
    pub sa: f64,
    /// Distance of the highest and the lowest node.
    pub sz: f64,
    /// Skewness of the heights; a flat surface has none.
    pub ssk: Option<f64>,
    /// Kurtosis of the heights, 3 for a Gaussian; a flat surface has none.
    pub sku: Option<f64>,
    /// Root mean square gradient: of the Fourier modes of a periodic map, of differences between
    /// neighbours of any other.
    pub sdq: f64,
}

impl Roughness {
    /// Measures a surface.
    pub fn of(surface: &Surface, boundary: Boundary) -> Self {
        let heights = from_first_node(surface.heights());
        let count = heights.len() as f64;
        let mean = heights.iter().sum::<f64>() / count;
        let mean_of = |value: fn(f64) -> f64| {
            let deviations = heights.iter().map(|height| value(height - mean));
            deviations.sum::<f64>() / count
        };
        let (ssk, excess) = shape_of_heights(surface).unzip();
        let moments = match boundary {
            Boundary::Periodic => Moments::of(surface),
            Boundary::Free => differences::moments(surface),
        };
        let extreme = |pick: fn(f64, f64) -> f64| heights.iter().copied().fold(0.0, pick);
        Self {
            sq: mean_of(|deviation| deviation * deviation).sqrt(),
            sa: mean_of(f64::abs),
            sz: extreme(f64::max) - extreme(f64::min),
            ssk,
            sku: excess.map(|excess: f64| excess + 3.0),
            sdq: moments.rms_slope(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::square;
    use crate::topography::shapes::Shape;

    #[test]
    fn a_punch_has_the_roughness_of_two_levels() {
        let punch = Shape::Punch { radius: 0.3, depth: 2.0 };
        let surface = punch.draw(square(32, 1.0));
        let share = surface.heights().iter().filter(|&&h| h == 0.0).count() as f64 / 1024.0;
        let found = Roughness::of(&surface, Boundary::Free);
        assert_eq!(found.sz, 2.0);
        assert!((found.sq - 2.0 * (share * (1.0 - share)).sqrt()).abs() < 1e-14);
        assert!((found.sa - 4.0 * share * (1.0 - share)).abs() < 1e-14);
    }

    #[test]
    fn a_flat_surface_has_no_shape_of_its_heights() {
        let flat = Surface::new(square(4, 1.0), vec![7.1; 16]).unwrap();
        let found = Roughness::of(&flat, Boundary::Periodic);
        assert_eq!([found.sq, found.sa, found.sz, found.sdq], [0.0; 4]);
        assert_eq!((found.ssk, found.sku), (None, None));
    }

    #[test]
    fn the_height_of_the_mean_changes_nothing() {
        let low = Shape::Paraboloid { radius: 0.5 }.draw(square(16, 1.0));
        let high = low.heights().iter().map(|height| height + 64.0).collect();
        let high = Surface::new(low.grid(), high).unwrap();
        let [low, high] = [low, high].map(|surface| Roughness::of(&surface, Boundary::Free));
        for (low, high) in
            [(low.sq, high.sq), (low.sa, high.sa), (low.ssk.unwrap(), high.ssk.unwrap())]
        {
            assert!((low - high).abs() < 1e-12);
        }
    }
}
