//! Asperity models: rough contact as the sum of the Hertz contacts of summits that ignore each other.
//!
//! All of them see the roughness through Nayak's parameter α alone, once separations s are in units
//! of the rms height √m0 and loads y = p₀/(E* h′) in those of the rms slope h′ = √(2 m2). Summits
//! of one mean curvature have Gaussian heights; a model is a set of such classes, each a
//! Greenwood-Williamson contact of its own, and what it takes for the shape of a summit.

pub mod asperities;
mod chebyshev;
mod ellipticity;
pub mod full_contact;
pub(crate) mod gaussian_heights;
pub mod hertz;
mod quadrature;
pub mod summits;

use std::sync::LazyLock;

use self::ellipticity::EllipticityMeans;
use self::hertz::Ellipse;

/// What a model takes for the summits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AsperityModel {
    /// Elliptic Hertz contacts of all summits (Bush, Gibson & Thomas 1975).
    BushGibsonThomas,
    /// Spheres of the geometric mean of the principal curvatures (Greenwood 2006).
    SimplifiedElliptic,
    /// Spheres of the arithmetic mean of the principal curvatures, the Nayak-Thomas model.
    MeanCurvature,
    /// Spheres of one radius, R = (3/8)√(π/m4) (Greenwood & Williamson 1966), with the parameters
    /// of McCool 1986.
    GreenwoodWilliamson,
}

impl AsperityModel {
    /// The c of κ = √(2π) (1 − c α/s² + O(s⁻⁴)), the secant at large separation.
    ///
    /// `None` for spheres of one radius, whose area is never proportional to the load.
    pub fn curvature_coefficient(self) -> Option<f64> {
        match self {
            Self::BushGibsonThomas => Some(19.0 / 108.0),
            Self::SimplifiedElliptic => Some(1.0 / 12.0),
            Self::MeanCurvature => Some(1.0 / 4.0),
            Self::GreenwoodWilliamson => None,
        }
    }

    fn ellipticity(self) -> Option<&'static EllipticityMeans> {
        static ELLIPSES: LazyLock<EllipticityMeans> = LazyLock::new(|| {
            EllipticityMeans::new(|ratio| {
                let ellipse = Ellipse::of_curvature_ratio(ratio);
                (ellipse.area_factor, ellipse.load_factor)
            })
        });
        static GEOMETRIC: LazyLock<EllipticityMeans> = LazyLock::new(|| {
            EllipticityMeans::new(|ratio| {
                let arithmetic_over_geometric = 0.5 * (1.0 + ratio) / ratio.sqrt();
                (arithmetic_over_geometric, arithmetic_over_geometric.sqrt())
            })
        });
        static ARITHMETIC: LazyLock<EllipticityMeans> =
            LazyLock::new(|| EllipticityMeans::new(|_| (1.0, 1.0)));
        match self {
            Self::BushGibsonThomas => Some(&ELLIPSES),
            Self::SimplifiedElliptic => Some(&GEOMETRIC),
            Self::MeanCurvature => Some(&ARITHMETIC),
            Self::GreenwoodWilliamson => None,
        }
    }
}

#[cfg(test)]
mod tests;
