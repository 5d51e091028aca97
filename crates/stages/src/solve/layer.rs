//! Layers and coatings: their recipes and columns.

use serde::Serialize;

use crate::columns::*;
use crate::stage::first_real;
use crate::version::Version;
use asperity_mechanics::elasticity::{Base, Layer, LayerError, Support};
use asperity_tables::column::{Column, Value};
use asperity_tables::table::{Table, TableError};

/// Version of the numbers of layers. Only recipes with a layer contain it.
pub const VERSION: Version = Version::new(
    1,
    &["pressures that a step clips are taken from the nodes around them: fewer pairs of \
       transforms, other last digits"],
);

/// A layer as given in the manifest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(into = "LayerRecipe")]
pub struct GivenLayer {
    /// Thickness in the unit of the lengths of the surfaces.
    pub thickness: f64,
    pub poisson_ratio: f64,
    pub support: Support,
}

/// The form of [`GivenLayer`] in recipes.
#[derive(Serialize)]
struct LayerRecipe {
    thickness: f64,
    poisson_ratio: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    base: Option<Base>,
    #[serde(skip_serializing_if = "Option::is_none")]
    modulus_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    substrate_poisson_ratio: Option<f64>,
    version: u32,
}

impl From<GivenLayer> for LayerRecipe {
    fn from(GivenLayer { thickness, poisson_ratio, support }: GivenLayer) -> Self {
        let (base, below) = match support {
            Support::Rigid(base) => (Some(base), None),
            Support::HalfSpace { poisson_ratio, modulus_ratio } => {
                (None, Some((modulus_ratio, poisson_ratio)))
            }
        };
        Self {
            thickness,
            poisson_ratio,
            base,
            modulus_ratio: below.map(|(ratio, _)| ratio),
            substrate_poisson_ratio: below.map(|(_, ratio)| ratio),
            version: VERSION.number(),
        }
    }
}

impl GivenLayer {
    /// Returns the layer below cells with this longer side.
    pub fn below(&self, longer_side: f64) -> Result<Layer, LayerError> {
        Layer::new(self.thickness / longer_side, self.poisson_ratio, self.support)
    }

    /// Returns whether the layer lies on a rigid base, so that the approach of the bodies is
    /// defined.
    pub fn is_on_rigid_base(&self) -> bool {
        matches!(self.support, Support::Rigid(_))
    }

    /// Returns the parameter columns of the layer with their values.
    pub fn coordinates(&self) -> Vec<(Column, Value)> {
        let mut coordinates = vec![
            (LAYER_THICKNESS, Value::Real(self.thickness)),
            (LAYER_POISSON_RATIO, Value::Real(self.poisson_ratio)),
        ];
        match self.support {
            Support::Rigid(base) => {
                coordinates.push((LAYER_BASE, Value::Text(base.name().to_owned())));
            }
            Support::HalfSpace { poisson_ratio, modulus_ratio } => coordinates.extend([
                (LAYER_MODULUS_RATIO, Value::Real(modulus_ratio)),
                (SUBSTRATE_POISSON_RATIO, Value::Real(poisson_ratio)),
            ]),
        }
        coordinates
    }

    /// Reads the layer from the table of a task; `None` for a half-space.
    pub fn of_solved(solved: &Table) -> Result<Option<GivenLayer>, TableError> {
        let number = |column: Column| first_real(solved, column);
        let (Some(thickness), Some(poisson_ratio)) =
            (number(LAYER_THICKNESS)?, number(LAYER_POISSON_RATIO)?)
        else {
            return Ok(None);
        };
        let below = number(LAYER_MODULUS_RATIO)?.zip(number(SUBSTRATE_POISSON_RATIO)?);
        let support = match below {
            Some((modulus_ratio, poisson_ratio)) => {
                Support::HalfSpace { poisson_ratio, modulus_ratio }
            }
            None => {
                let words = solved.texts(LAYER_BASE.name)?;
                let is_named = |base: &Base| words.iter().next().flatten() == Some(base.name());
                let base = [Base::Bonded, Base::Frictionless].into_iter().find(is_named);
                Support::Rigid(base.unwrap_or(Base::Bonded))
            }
        };
        Ok(Some(GivenLayer { thickness, poisson_ratio, support }))
    }
}
