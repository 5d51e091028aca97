//! Conduction through a layer on a substrate, in contact with another body: the drop of the
//! potential under a flux.
//!
//! A wave of flux j with the wavenumber q enters a half-space of conductivity k and raises the
//! potential of its surface by j/(k q). A layer of thickness t and conductivity k₁ on a half-space
//! of conductivity k₂ multiplies this by a factor g, for k = k₁,
//!
//! g(x) = (1 + γ e⁻²ˣ)/(1 − γ e⁻²ˣ) = (r + tanh x)/(1 + r tanh x),
//!
//! with x = q t, γ = (k₁ − k₂)/(k₁ + k₂) and r = k₁/k₂. r = 0 is a substrate that conducts
//! perfectly, such as a base of metal below a layer of polymer. The same flux leaves the other
//! body, a half-space of conductivity k₃, so that the drop of the potential over the contact is
//!
//! φ̂ = [g(x)/k₁ + 1/k₃] ĵ/q = 2 f(x) ĵ/(k_s q), f = (g + c)/(1 + c),
//!
//! with c = k₁/k₃ and 2/k_s = 1/k₁ + 1/k₃. For f = 1 this is the displacement of an elastic
//! half-space under a pressure, with k_s for E*: the analogy of Barber. f is not the factor of an
//! elastic layer, so the conductance does not follow from the stiffness.

use std::f64::consts::{PI, TAU};

use thiserror::Error;

use crate::elasticity::Layered;

/// Exponent of the factor f by which the preconditioner softens waves, as for elastic layers.
const SOFTENING: f64 = 0.3;

/// Layer through which heat or an electric current flows into a substrate, and the other body of
/// the contact.
///
/// ```
/// use asperity_mechanics::conduction::LayeredConductor;
///
/// // A film with a hundredth of the conductivity of both bodies, 2 % of the side thick.
/// let film = LayeredConductor::new(0.02, 0.01, 0.01)?;
/// // Waves shorter than the thickness do not feel the substrate.
/// assert_eq!(film.factor(50.0), 1.0);
/// // Long waves meet the film as a resistance in series.
/// let thin = 1e-6;
/// let in_series = (0.01 + thin + 0.01) / 1.01;
/// assert!((film.factor(thin) / in_series - 1.0).abs() < 1e-6);
/// assert!(LayeredConductor::new(0.02, -1.0, 0.0).is_err());
/// # Ok::<(), asperity_mechanics::conduction::ConductorError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayeredConductor {
    /// Thickness of the layer in units of the longer side.
    thickness: f64,
    /// Conductivity of the layer over that of the substrate.
    to_substrate: f64,
    /// Conductivity of the layer over that of the other body.
    to_counter_body: f64,
}

/// Error of an impossible layered conductor.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum ConductorError {
    /// The thickness is not a positive, finite number.
    #[error("the thickness of a layer must be positive and finite, not {0}")]
    Thickness(f64),
    /// A ratio of conductivities is negative or not finite.
    #[error("a ratio of conductivities must be finite and not negative, not {0}")]
    Ratio(f64),
}

impl LayeredConductor {
    /// Creates a layered conductor.
    ///
    /// The thickness is in units of the longer side of the cell. `to_substrate` and
    /// `to_counter_body` are the conductivity of the layer over that of the substrate and of the
    /// other body, and 0 for a body that conducts perfectly.
    ///
    /// # Errors
    /// Returns an error for a thickness that is not positive and finite, and for ratios that are
    /// negative or not finite.
    pub fn new(
        thickness: f64,
        to_substrate: f64,
        to_counter_body: f64,
    ) -> Result<Self, ConductorError> {
        if !(thickness.is_finite() && thickness > 0.0) {
            return Err(ConductorError::Thickness(thickness));
        }
        let is_ratio = |ratio: &f64| ratio.is_finite() && *ratio >= 0.0;
        if let Some(ratio) = [to_substrate, to_counter_body].into_iter().find(|r| !is_ratio(r)) {
            return Err(ConductorError::Ratio(ratio));
        }
        Ok(Self { thickness, to_substrate, to_counter_body })
    }

    /// Returns the thickness of the layer in units of the longer side.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Returns the drop of the potential under a wave of flux over that of two half-spaces, of the
    /// material of the layer and of the other body; `x` > 0 is the wavenumber times the thickness.
    pub fn factor(&self, x: f64) -> f64 {
        let falls = libm::tanh(x);
        let layered = (self.to_substrate + falls) / (1.0 + self.to_substrate * falls);
        (layered + self.to_counter_body) / (1.0 + self.to_counter_body)
    }
}

/// A flux takes the place of the pressure and the drop of the potential that of the displacement,
/// in units of k_s over the longer side. The mean flux causes no drop: what a uniform flux meets
/// in the bodies, t/k₁ in the layer, is no resistance of the contact.
impl Layered for LayeredConductor {
    const HAS_COARSER_GRIDS: bool = false;

    fn factor_at(&self, wavenumber: f64) -> f64 {
        self.factor(TAU * wavenumber * self.thickness)
    }

    /// Returns |q|/(2 f) × f^s with the exponent s of `SOFTENING`.
    fn preconditioner(&self, k: f64, f: f64) -> f64 {
        PI * k * libm::pow(f, SOFTENING - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn conductor(to_substrate: f64, to_counter_body: f64) -> LayeredConductor {
        LayeredConductor::new(0.05, to_substrate, to_counter_body).unwrap()
    }

    #[test]
    fn a_layer_is_its_images_in_the_substrate() {
        for (to_substrate, x) in [(0.0, 0.3), (0.1, 0.02), (10.0, 1.0), (1e3, 0.5), (1.0, 0.7)] {
            let gamma = (to_substrate - 1.0) / (to_substrate + 1.0);
            let image = gamma * f64::exp(-2.0 * x);
            let expected = (1.0 + image) / (1.0 - image);
            let found = conductor(to_substrate, 0.0).factor(x);
            assert!((found / expected - 1.0).abs() < 1e-12, "{to_substrate}, {x}");
        }
    }

    #[test]
    fn a_thin_layer_leaves_the_substrate_and_a_thick_one_hides_it() {
        for to_substrate in [0.01, 1.0, 100.0] {
            let found = conductor(to_substrate, 0.0);
            // 2 f/(k_s q) is 1/(k₂ q) and 1/(k₁ q) with k_s = 2 k₁.
            assert!((found.factor(1e-12) / to_substrate - 1.0).abs() < 1e-9);
            assert_eq!(found.factor(40.0), 1.0);
        }
        // On a perfect conductor, the layer is a series resistance q t/(k₁ q) for long waves.
        assert!((conductor(0.0, 0.0).factor(1e-4) / 1e-4 - 1.0).abs() < 1e-8);
    }

    #[test]
    fn the_other_body_adds_its_own_drop() {
        // With equal conductivities, half of the drop is that of the other body.
        assert!((conductor(0.0, 1.0).factor(0.2) - (0.2_f64.tanh() + 1.0) / 2.0).abs() < 1e-15);
        // A layer of the material of its substrate is no layer.
        for x in [1e-3, 0.4, 3.0] {
            assert!((conductor(1.0, 5.0).factor(x) - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn impossible_conductors_are_refused() {
        let ratio = LayeredConductor::new(1.0, 0.0, f64::INFINITY);
        assert_eq!(ratio, Err(ConductorError::Ratio(f64::INFINITY)));
        assert_eq!(LayeredConductor::new(0.0, 1.0, 1.0), Err(ConductorError::Thickness(0.0)));
    }
}
