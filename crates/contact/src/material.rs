//! Elastic materials and layers.

use std::fmt::Debug;

use asperity_mechanics::elasticity::{self, Base, LayerError, Support};
use thiserror::Error;

use crate::scale::ContactPressure;
use crate::{Length, Pressure, ReducedPressure};

/// Elastic half-space or layer, against which a rough rigid surface is pressed.
///
/// With two elastic bodies, the effective modulus is that of both,
/// 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂.
///
/// `P` is the type of pressures: [`Pressure`], or [`ReducedPressure`] for a material without a
/// modulus, whose results are in units of E* h′.
///
/// ```
/// use asperity_contact::{Layer, Length, Material, Pressure, ReducedPressure};
///
/// let steel = Material::from_young(Pressure::gigapascals(210.0), 0.3)?;
/// let soft = steel.hardness(Pressure::gigapascals(1.5))?;
/// let coated = steel.layer(Layer::bonded(Length::micrometres(2.0), 0.3)?);
/// let any = Material::reduced().hardness(ReducedPressure::new(0.3))?;
/// # Ok::<(), asperity_contact::MaterialError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material<P = Pressure> {
    /// Effective modulus in pascals; 1 for a reduced material.
    modulus: f64,
    hardness: Option<P>,
    layer: Option<Layer>,
}

/// Reason why a material or a layer is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// A modulus is not positive and finite.
    #[error("a modulus of {0}; it must be positive and finite")]
    Modulus(Pressure),
    /// Poisson's ratio is not above −1 and at most ½.
    #[error("a Poisson's ratio of {0}; it must be above -1 and at most 0.5")]
    PoissonRatio(f64),
    /// The hardness is not positive and finite.
    #[error(
        "a hardness of {0} (in Pa, or in units of E* × rms slope); it must be positive and finite"
    )]
    Hardness(f64),
    /// The thickness of a layer is not positive and finite.
    #[error("a layer of thickness {0}; it must be positive and finite")]
    Thickness(Length),
    /// The ratio of the shear moduli of a layer and its substrate is not positive and finite.
    #[error("a ratio of shear moduli of {0}; it must be positive and finite")]
    ModulusRatio(f64),
}

impl Material<Pressure> {
    /// Creates an elastic material from the effective modulus E*.
    ///
    /// # Errors
    /// Fails if the modulus is not positive and finite.
    pub fn elastic(effective_modulus: Pressure) -> Result<Self, MaterialError> {
        let modulus = effective_modulus.in_pascals();
        if modulus > 0.0 && modulus.is_finite() {
            Ok(Self { modulus, hardness: None, layer: None })
        } else {
            Err(MaterialError::Modulus(effective_modulus))
        }
    }

    /// Creates an elastic material from Young's modulus and Poisson's ratio of one body; the other
    /// body is rigid.
    ///
    /// # Errors
    /// Fails if the modulus is not positive and finite, or if Poisson's ratio is not above −1 and
    /// at most ½.
    pub fn from_young(modulus: Pressure, poisson_ratio: f64) -> Result<Self, MaterialError> {
        Self::elastic(Pressure::pascals(1.0 / compliance(modulus, poisson_ratio)?))
    }

    /// Creates an elastic material from Young's moduli and Poisson's ratios of two bodies.
    ///
    /// # Errors
    /// Fails as [`Material::from_young`].
    pub fn from_bodies(bodies: [(Pressure, f64); 2]) -> Result<Self, MaterialError> {
        let [(one, its_ratio), (other, others_ratio)] = bodies;
        let compliance = compliance(one, its_ratio)? + compliance(other, others_ratio)?;
        Self::elastic(Pressure::pascals(1.0 / compliance))
    }
}

/// Returns (1 − ν²)/E.
fn compliance(modulus: Pressure, poisson_ratio: f64) -> Result<f64, MaterialError> {
    if !(poisson_ratio > -1.0 && poisson_ratio <= 0.5) {
        return Err(MaterialError::PoissonRatio(poisson_ratio));
    }
    let Material { modulus, .. } = Material::elastic(modulus)?;
    Ok((1.0 - poisson_ratio * poisson_ratio) / modulus)
}

impl Material<ReducedPressure> {
    /// Creates an elastic material without a modulus, whose pressures are in units of E* h′.
    pub fn reduced() -> Self {
        Self { modulus: 1.0, hardness: None, layer: None }
    }
}

impl<P: ContactPressure> Material<P> {
    /// Bounds the pressure by a hardness, at which the material yields.
    ///
    /// # Errors
    /// Fails if the hardness is not positive and finite.
    pub fn hardness(self, hardness: P) -> Result<Self, MaterialError> {
        let number = hardness.number();
        if number > 0.0 && number.is_finite() {
            Ok(Self { hardness: Some(hardness), ..self })
        } else {
            Err(MaterialError::Hardness(number))
        }
    }

    /// Makes the material the one of a layer.
    pub fn layer(self, layer: Layer) -> Self {
        Self { layer: Some(layer), ..self }
    }

    pub(crate) fn parts(&self) -> (f64, Option<P>, Option<Layer>) {
        (self.modulus, self.hardness, self.layer)
    }
}

/// Layer on a rigid base, or coating on a half-space. E* is the effective modulus of the layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    thickness: Length,
    poisson_ratio: f64,
    support: Support,
}

impl Layer {
    /// Creates a layer that adheres to a rigid base.
    ///
    /// # Errors
    /// Fails if the thickness is not positive and finite, or if Poisson's ratio is not above −1 and
    /// at most ½.
    pub fn bonded(thickness: Length, poisson_ratio: f64) -> Result<Self, MaterialError> {
        Self::new(thickness, poisson_ratio, Support::Rigid(Base::Bonded))
    }

    /// Creates a layer that slides on a rigid base without friction and does not lift off.
    ///
    /// # Errors
    /// Fails as [`Layer::bonded`].
    pub fn frictionless(thickness: Length, poisson_ratio: f64) -> Result<Self, MaterialError> {
        Self::new(thickness, poisson_ratio, Support::Rigid(Base::Frictionless))
    }

    /// Creates a coating that adheres to a half-space. `modulus_ratio` is the shear modulus of the
    /// coating over that of the half-space.
    ///
    /// # Errors
    /// Fails as [`Layer::bonded`], and if the ratio is not positive and finite.
    pub fn on_half_space(
        thickness: Length,
        poisson_ratio: f64,
        modulus_ratio: f64,
        poisson_ratio_of_half_space: f64,
    ) -> Result<Self, MaterialError> {
        let support =
            Support::HalfSpace { poisson_ratio: poisson_ratio_of_half_space, modulus_ratio };
        Self::new(thickness, poisson_ratio, support)
    }

    fn new(thickness: Length, poisson_ratio: f64, support: Support) -> Result<Self, MaterialError> {
        let layer = Self { thickness, poisson_ratio, support };
        layer.below(1.0)?;
        Ok(layer)
    }

    /// Returns the layer below cells with this longer side in metres.
    pub(crate) fn below(&self, longer_side: f64) -> Result<elasticity::Layer, MaterialError> {
        let thickness = self.thickness.in_metres() / longer_side;
        elasticity::Layer::new(thickness, self.poisson_ratio, self.support).map_err(|error| {
            match error {
                LayerError::PoissonRatio(ratio) => MaterialError::PoissonRatio(ratio),
                LayerError::ModulusRatio(ratio) => MaterialError::ModulusRatio(ratio),
                _ => MaterialError::Thickness(self.thickness),
            }
        })
    }
}
