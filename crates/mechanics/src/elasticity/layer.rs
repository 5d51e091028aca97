//! Layer on a rigid base, and coating on a half-space, under a periodic pressure.
//!
//! A pressure wave displaces the surface by û = 2 f(|q| t) p̂/(E* |q|), where t is the thickness,
//! E* the modulus of the layer, and f the factor by which the base changes the displacement of a
//! half-space of the material of the layer. f tends to 1 for waves that are shorter than the
//! thickness. With the shear modulus G₁ and Poisson's ratio ν₁ of the layer, G₂ and ν₂ of the
//! substrate, μ = G₁/G₂ and θ = exp(−2x),
//!
//! f(x) = (1 + 4xκθ − λκθ²)/(1 − (λ + κ + 4κx²)θ + λκθ²),
//! λ = 1 − 4(1 − ν₁)/(1 + μ(3 − 4ν₂)), κ = (μ − 1)/(μ + 3 − 4ν₁)
//!
//! (O'Sullivan & King, *J. Tribol.* 110, 1988, 235). A rigid base to which the layer is bonded is
//! the limit μ = 0. If the layer slides on the base without friction, for any ν₁,
//! f(x) = (cosh 2x − 1)/(sinh 2x + 2x).
//!
//! A uniform pressure compresses a layer on a rigid base by p t/M with M = E(1 − ν)/((1 + ν)(1 −
//! 2ν)), on both bases, because a uniform layer cannot slide. This is not the limit q → 0 of the
//! frictionless base. It moves all nodes alike and changes neither contact nor gap, so the operator
//! leaves it out, as it leaves out the far field of a half-space.

use std::f64::consts::{PI, TAU};

use thiserror::Error;

use super::ElasticOperator;
use crate::grid::Grid;

/// Product of wavenumber and thickness above which the factor is 1 to the last bit.
const THICK: f64 = 40.0;

/// Exponent of the factor f by which the preconditioner softens waves.
///
/// The extension of the residual is less smooth than the displacement of a thin incompressible
/// layer, whose stiffness grows with the wavelength. With the true stiffness, such a layer takes
/// three times the pairs, and with an exponent of 0.2 up to 1.5 times.
const SOFTENING: f64 = 0.3;

/// The same for compressible layers on a rigid base, which take up to two more pairs with 0.3.
const COMPRESSIBLE_SOFTENING: f64 = 0.2;

/// Poisson's ratio above which a layer counts as incompressible.
const INCOMPRESSIBLE: f64 = 0.47;

/// Exponent of the factor c = f_max^−`CAUTION` of the preconditioner of a stiff coating.
///
/// Corrections by the true stiffness are too large there, because the displacement under a stiff
/// coating is smoother than the extension of the residual. Without the factor, coatings with twenty
/// times the shear modulus of the substrate take 1.3 to 1.7 times the pairs.
const CAUTION: f64 = 0.25;

/// Connection between a layer and its rigid base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Base {
    /// The layer adheres to the base.
    Bonded,
    /// The layer slides on the base without friction and does not lift off.
    Frictionless,
}

impl Base {
    /// Returns the name used in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Base::Bonded => "bonded",
            Base::Frictionless => "frictionless",
        }
    }
}

/// Body below a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Support {
    /// Rigid base.
    Rigid(Base),
    /// Half-space to which the layer is bonded.
    HalfSpace {
        /// Poisson's ratio of the half-space.
        poisson_ratio: f64,
        /// Shear modulus of the layer over that of the half-space.
        modulus_ratio: f64,
    },
}

/// Elastic layer on a rigid base or on a half-space.
///
/// ```
/// use asperity_mechanics::elasticity::{Base, Layer, Support};
///
/// let layer = Layer::new(0.05, 0.3, Support::Rigid(Base::Bonded))?;
/// // Waves shorter than the thickness do not feel the base. Long waves press a Winkler foundation.
/// assert_eq!(layer.factor(50.0), 1.0);
/// let winkler = 1e-3 * (1.0 - 2.0 * 0.3) / (2.0 * (1.0 - 0.3_f64).powi(2));
/// assert!((layer.factor(1e-3) / winkler - 1.0).abs() < 1e-6);
/// assert!(Layer::new(0.05, 0.6, Support::Rigid(Base::Bonded)).is_err());
/// # Ok::<(), asperity_mechanics::elasticity::LayerError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    thickness: f64,
    poisson_ratio: f64,
    support: Support,
    /// Factor of all stiffnesses in the preconditioner.
    caution: f64,
    /// Exponent of the factor f by which the preconditioner softens waves.
    softening: f64,
}

/// Error of an invalid layer.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum LayerError {
    /// The thickness is not a positive, finite number.
    #[error("the thickness of a layer must be positive and finite, not {0}")]
    Thickness(f64),
    /// Poisson's ratio of the layer or of the half-space below it is impossible.
    #[error("Poisson's ratio must be above -1 and at most 0.5, not {0}")]
    PoissonRatio(f64),
    /// The ratio of the shear moduli is not a positive, finite number.
    #[error("the ratio of shear moduli must be positive and finite, not {0}")]
    ModulusRatio(f64),
}

impl Layer {
    /// Creates a layer. The thickness is in units of the longer side L of the cell.
    ///
    /// # Errors
    /// Returns an error for a thickness or a ratio of moduli that is not positive and finite, and
    /// for a Poisson's ratio that is not above −1 and at most ½.
    pub fn new(thickness: f64, poisson_ratio: f64, support: Support) -> Result<Self, LayerError> {
        let is_positive = |number: f64| number.is_finite() && number > 0.0;
        let is_ratio = |number: f64| number > -1.0 && number <= 0.5;
        if !is_positive(thickness) {
            return Err(LayerError::Thickness(thickness));
        }
        if !is_ratio(poisson_ratio) {
            return Err(LayerError::PoissonRatio(poisson_ratio));
        }
        if let Support::HalfSpace { poisson_ratio: below, modulus_ratio } = support {
            if !is_ratio(below) {
                return Err(LayerError::PoissonRatio(below));
            }
            if !is_positive(modulus_ratio) {
                return Err(LayerError::ModulusRatio(modulus_ratio));
            }
        }
        let is_compressible =
            matches!(support, Support::Rigid(_)) && poisson_ratio < INCOMPRESSIBLE;
        let softening = if is_compressible { COMPRESSIBLE_SOFTENING } else { SOFTENING };
        let layer = Self { thickness, poisson_ratio, support, caution: 1.0, softening };
        let softest = layer.factor(TAU * thickness).max(1.0);
        Ok(Self { caution: libm::pow(softest, -CAUTION), ..layer })
    }

    /// Returns the thickness in units of the longer side.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Returns the displacement under a pressure wave over that of a half-space of the material of
    /// the layer; `x` > 0 is the wavenumber times the thickness.
    pub fn factor(&self, x: f64) -> f64 {
        if x > THICK {
            return 1.0;
        }
        match self.support {
            Support::Rigid(Base::Frictionless) => frictionless(x),
            Support::Rigid(Base::Bonded) => bonded(x, self.poisson_ratio, [0.0, 0.0]),
            Support::HalfSpace { poisson_ratio, modulus_ratio } => {
                bonded(x, self.poisson_ratio, [modulus_ratio, poisson_ratio])
            }
        }
    }

    /// Returns the compression of the layer under a uniform unit pressure, in units of the longer
    /// side over E*.
    ///
    /// Returns `None` for a coating, because the displacement of the half-space below it is
    /// undefined.
    pub fn uniform_compliance(&self) -> Option<f64> {
        let nu = self.poisson_ratio;
        match self.support {
            Support::Rigid(_) => {
                Some(self.thickness * (1.0 - 2.0 * nu) / ((1.0 - nu) * (1.0 - nu)))
            }
            Support::HalfSpace { .. } => None,
        }
    }
}

/// Returns the factor of a layer that slides on its base, (1 − θ)²/(1 + 4xθ − θ²).
fn frictionless(x: f64) -> f64 {
    let falls = libm::expm1(-2.0 * x);
    falls * falls / (4.0 * x * libm::exp(-2.0 * x) - libm::expm1(-4.0 * x))
}

/// Returns the factor of a layer that is bonded to a half-space with the ratio μ of shear moduli
/// and Poisson's ratio ν₂; μ = 0 is a rigid base.
///
/// Numerator and denominator of the formula of the module are multiplied by (1 + μb)(μ + a) e²ˣ/2,
/// with a = 3 − 4ν₁ and b = 3 − 4ν₂, and are ordered such that no term cancels another for small x.
/// The common factor e⁻²ˣ of their hyperbolic functions avoids an overflow.
fn bonded(x: f64, poisson_ratio: f64, [mu, below]: [f64; 2]) -> f64 {
    let (a, b) = (3.0 - 4.0 * poisson_ratio, 3.0 - 4.0 * below);
    let decay = libm::exp(-2.0 * x);
    let sinh = -0.5 * libm::expm1(-4.0 * x);
    let cosh = 0.5 * (1.0 + decay * decay);
    let square_sinh = 0.25 * libm::expm1(-2.0 * x) * libm::expm1(-2.0 * x);
    let mixed = 0.5 * mu * (1.0 + a) * (1.0 + b);
    let difference = (mu - 1.0) * (1.0 + mu * b);
    let sum = (a - 1.0) + mu * (1.0 - b) * (3.0 - a) / 2.0 + 2.0 * mu * mu * b;
    let numerator = sum * sinh - difference * sinh_minus_argument(x, decay) + mixed * cosh;
    let constant = 0.5 * (1.0 + a) * (1.0 + a) * decay;
    let denominator = constant
        + (1.0 + a) * (2.0 + mu * (b - 1.0)) * square_sinh
        + 2.0 * difference * (square_sinh - x * x * decay)
        + mixed * sinh;
    numerator / denominator
}

/// Returns (sinh 2x − 2x) e⁻²ˣ; `decay` is e⁻²ˣ.
fn sinh_minus_argument(x: f64, decay: f64) -> f64 {
    let y = 2.0 * x;
    if y > 1.0 {
        return -0.5 * libm::expm1(-2.0 * y) - y * decay;
    }
    // The Taylor series y³/3! + y⁵/5! + … up to y¹⁹/19!, because the difference would cancel.
    let mut series = 1.0;
    for order in (4..=18).rev().step_by(2) {
        series = 1.0 + y * y / f64::from(order * (order + 1)) * series;
    }
    y * y * y / 6.0 * series * decay
}

impl Layered for Layer {
    const HAS_COARSER_GRIDS: bool = true;

    fn factor_at(&self, wavenumber: f64) -> f64 {
        self.factor(TAU * wavenumber * self.thickness)
    }

    /// Returns |q|/(2 f) × c f^s with the factor c of `CAUTION` and the exponent s of `SOFTENING`.
    fn preconditioner(&self, k: f64, f: f64) -> f64 {
        PI * k / f * libm::pow(f, self.softening) * self.caution
    }
}

/// Layer on a half-space or a base, which multiplies the response of a half-space to each wave.
pub trait Layered: Copy + Send + Sync {
    /// Whether a solution on a coarser grid is a useful initial guess.
    const HAS_COARSER_GRIDS: bool;

    /// Returns the response to a wave relative to that of a half-space, at a wavenumber in units of
    /// 1/L.
    fn factor_at(&self, wavenumber: f64) -> f64;

    /// Returns the stiffness in the preconditioner of the solver, at the wavenumber `k` with the
    /// factor `f`.
    fn preconditioner(&self, k: f64, f: f64) -> f64;
}

/// Periodic pressure on a [`Layer`], or periodic flux through a layer.
///
/// ```
/// use std::f64::consts::PI;
///
/// use asperity_mechanics::elasticity::{Base, ElasticOperator, Layer, PeriodicLayer, Support};
/// use asperity_mechanics::grid::Grid;
///
/// let layer = Layer::new(0.05, 0.3, Support::Rigid(Base::Bonded)).expect("a valid layer");
/// let body = PeriodicLayer::new(Grid::square(64, 1.0)?, layer);
/// // A pressure with three periods displaces by 2p f(qt)/q, q = 2π · 3.
/// let f = layer.factor(6.0 * PI * 0.05);
/// assert!((body.displacement([3, 0]) - f / (3.0 * PI)).abs() < 1e-15);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodicLayer<L> {
    grid: Grid,
    layer: L,
}

impl<L: Layered> PeriodicLayer<L> {
    /// Creates the layer below a grid. Only the ratio of the sides of the cell matters, because the
    /// thickness is in units of the longer side.
    pub fn new(grid: Grid, layer: L) -> Self {
        Self { grid, layer }
    }

    /// Returns the wavenumber k = |q|/2π of a wave in units of 1/L, also for Nyquist waves.
    fn wavenumber(&self, waves: [usize; 2]) -> f64 {
        self.grid.cell().wavenumber(waves.map(|waves| waves as f64))
    }
}

impl<L: Layered + 'static> ElasticOperator for PeriodicLayer<L> {
    fn grid(&self) -> Grid {
        self.grid
    }

    fn on_coarser(&self, grid: Grid) -> Option<Box<dyn ElasticOperator>> {
        L::HAS_COARSER_GRIDS.then(|| Box::new(Self::new(grid, self.layer)) as Box<_>)
    }

    /// Returns û/p̂ = 2 f/|q|, and zero at q = 0.
    fn displacement(&self, waves: [usize; 2]) -> f64 {
        let k = self.wavenumber(waves);
        if k > 0.0 { self.layer.factor_at(k) / (PI * k) } else { 0.0 }
    }

    /// Returns p̂/û = |q|/(2 f), and zero at q = 0.
    fn stiffness(&self, waves: [usize; 2]) -> f64 {
        let k = self.wavenumber(waves);
        if k > 0.0 { PI * k / self.layer.factor_at(k) } else { 0.0 }
    }

    fn preconditioner(&self, waves: [usize; 2]) -> f64 {
        let k = self.wavenumber(waves);
        if k > 0.0 { self.layer.preconditioner(k, self.layer.factor_at(k)) } else { 0.0 }
    }

    fn relative_displacement(&self, wavenumber: f64) -> f64 {
        self.layer.factor_at(wavenumber)
    }
}

#[cfg(test)]
mod tests;
