//! Conversion between the units of the solver and of the manifest.
//!
//! The units of the solver are those of [`Units`].

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::StageError;
use crate::columns::*;
use crate::ensemble::load_column;
use crate::version::Version;
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::reduced::{ReducedHeights, Units};
use asperity_mechanics::solver::{self, Hardness, HardnessError};
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::column::{Column, Role, Value};
use asperity_tables::table::Table;

/// The unit of loads and hardnesses in a manifest.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PressureUnit {
    /// Pressures are multiples of E* × rms slope.
    #[default]
    Relative,
    /// Pressures have the unit of the moduli.
    Absolute,
}

impl PressureUnit {
    /// Returns the unit in which the loads of solved contacts were given.
    pub fn of_solved(solved: &Table) -> PressureUnit {
        match load_column(solved) {
            name if name == PRESSURE.name => PressureUnit::Absolute,
            _ => PressureUnit::Relative,
        }
    }

    /// Returns the columns `load` and `pressure`. The column with the unit of the manifest is a
    /// parameter, and the other column is derived from it for each surface.
    pub fn load_columns(self) -> [Column; 2] {
        let [reduced, absolute] = self.roles(Role::Load);
        [LOAD.with_role(reduced), PRESSURE.with_role(absolute)]
    }

    /// Returns the columns `hardness` and `hardness_reduced`. The column with the unit of the
    /// manifest is a parameter, and the other column is derived from it.
    pub fn hardness_columns(self) -> [Column; 2] {
        let [reduced, absolute] = self.roles(Role::Parameter);
        [HARDNESS.with_role(absolute), HARDNESS_REDUCED.with_role(reduced)]
    }

    /// Returns the roles of two columns with the same pressure: in units of E* × rms slope, and in
    /// the unit of the moduli. The column with the unit of the manifest has the role `given`.
    pub fn roles(self, given: Role) -> [Role; 2] {
        match self {
            PressureUnit::Relative => [given, Role::Derived],
            PressureUnit::Absolute => [Role::Derived, given],
        }
    }
}

/// The unit of loads, the value of `load_unit`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum LoadUnit {
    /// Loads are multiples of E* × rms slope.
    #[serde(rename = "relative")]
    Relative,
    /// Loads have the unit of the moduli.
    #[serde(rename = "absolute")]
    Absolute,
    /// All pressures of the stage are in pascals.
    Pa,
    /// All pressures of the stage are in kilopascals.
    #[serde(rename = "kPa")]
    Kilopascal,
    /// All pressures of the stage are in megapascals.
    MPa,
    /// All pressures of the stage are in gigapascals.
    GPa,
    /// All pressures of the stage are in newtons per square millimetre.
    #[serde(rename = "N/mm²")]
    NewtonPerSquareMillimetre,
    /// All pressures of the stage are in bar.
    #[serde(rename = "bar")]
    Bar,
}

/// Scales that convert values of the solver to the units of the manifest, for one surface.
pub struct Scales {
    /// Number of nodes along x and y.
    pub nodes: [usize; 2],
    units: Units,
}

impl Scales {
    /// Divides the heights of a surface by the unit of length. Returns them with the scales.
    ///
    /// # Errors
    /// If the rms slope or the modulus is invalid, or if a height overflows.
    pub fn reduce(
        surface: Surface,
        rms_slope: f64,
        effective_modulus: f64,
    ) -> Result<(ReducedHeights, Scales), StageError> {
        let grid = surface.grid();
        let units = Units::new(grid.cell(), rms_slope, effective_modulus)?;
        let heights = units.reduced_heights(surface).map_err(StageError::Heights)?;
        Ok((heights, Scales { nodes: grid.nodes(), units }))
    }

    /// Returns the unit of length, L × h′.
    pub fn length(&self) -> f64 {
        self.units.length()
    }

    /// Returns the unit of pressure, E* × h′.
    pub fn pressure(&self) -> f64 {
        self.units.pressure()
    }

    /// Converts a pressure of the manifest to units of E* × h′. The result is rounded, so that
    /// loads in either unit are equal.
    pub fn reduced_pressure(&self, given: f64, unit: PressureUnit) -> f64 {
        match unit {
            PressureUnit::Relative => given,
            PressureUnit::Absolute => self.units.reduced_pressure(given),
        }
    }

    /// Converts a reduced load to a mean pressure in the unit of the moduli.
    pub fn mean_pressure(&self, load: f64) -> f64 {
        self.units.mean_pressure(load)
    }

    /// Converts the hardness of the manifest to both units for this surface.
    ///
    /// # Errors
    /// If the reduced hardness is not positive and finite.
    pub fn hardness(&self, given: GivenHardness) -> Result<SurfaceHardness, HardnessError> {
        let GivenHardness { pressure, unit } = given;
        Ok(SurfaceHardness {
            pressure: match unit {
                PressureUnit::Relative => self.units.mean_pressure(pressure),
                PressureUnit::Absolute => pressure,
            },
            reduced: Hardness::new(self.reduced_pressure(pressure, unit))?,
            given: unit,
        })
    }
}

/// Version of the solver for a material with a hardness. Only recipes with a hardness contain it,
/// so raising it does not recompute elastic contacts.
pub const HARDNESS_VERSION: Version = Version::new(3, &[]);

/// The hardness of a material as given in the manifest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(into = "HardnessRecipe", from = "HardnessRecipe")]
pub struct GivenHardness {
    /// Hardness in the unit `unit`; positive.
    pub pressure: f64,
    /// Unit of the given hardness.
    pub unit: PressureUnit,
}

/// The form of [`GivenHardness`] in recipes.
#[derive(Serialize, Deserialize)]
struct HardnessRecipe {
    pressure: f64,
    unit: PressureUnit,
    version: u32,
}

impl From<GivenHardness> for HardnessRecipe {
    fn from(GivenHardness { pressure, unit }: GivenHardness) -> Self {
        Self { pressure, unit, version: HARDNESS_VERSION.number() }
    }
}

impl From<HardnessRecipe> for GivenHardness {
    fn from(HardnessRecipe { pressure, unit, .. }: HardnessRecipe) -> Self {
        Self { pressure, unit }
    }
}

impl GivenHardness {
    /// Returns the column of the hardness in the unit of the manifest, with its value. The value in
    /// the other unit depends on the rms slope of the surface.
    pub fn coordinate(&self) -> (Column, Value) {
        let [absolute, reduced] = self.unit.hardness_columns();
        let column = match self.unit {
            PressureUnit::Absolute => absolute,
            PressureUnit::Relative => reduced,
        };
        (column, Value::Real(self.pressure))
    }
}

/// The hardness of a material on one surface, in both units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceHardness {
    /// Hardness in the unit of the moduli.
    pub pressure: f64,
    /// Hardness in units of E* × rms slope.
    pub reduced: solver::Hardness,
    /// Unit of the hardness in the manifest.
    pub given: PressureUnit,
}

impl SurfaceHardness {
    /// Returns the columns `hardness` and `hardness_reduced` with their values, for the rows of the
    /// surface.
    pub fn coordinates(&self) -> [(Column, Value); 2] {
        let [absolute, reduced] = self.given.hardness_columns();
        [(absolute, Value::Real(self.pressure)), (reduced, Value::Real(self.reduced.pressure()))]
    }
}

/// Version of the numbers of loads with a free boundary. It is part of their recipes only, so that
/// raising it does not recompute periodic loads.
pub const FREE_BOUNDARY_VERSION: Version = Version::new(
    2,
    &["pressures that a step clips are taken from the nodes around them: fewer pairs of \
       transforms, other last digits"],
);

#[derive(Serialize, Deserialize)]
struct BoundaryRecipe {
    beyond: Boundary,
    version: u32,
}

/// Serializes the boundary for a recipe.
pub fn serialize_free_boundary<S: Serializer>(
    boundary: &Boundary,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let recipe = BoundaryRecipe { beyond: *boundary, version: FREE_BOUNDARY_VERSION.number() };
    recipe.serialize(serializer)
}

/// Reads the boundary from a recipe.
pub fn deserialize_free_boundary<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Boundary, D::Error> {
    BoundaryRecipe::deserialize(deserializer).map(|recipe| recipe.beyond)
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_manifest::decimal;
    use asperity_mechanics::grid::Cell;

    #[test]
    fn loads_are_rounded_as_the_numbers_of_a_manifest_are() {
        let units = Units::new(Cell::square(1.0).unwrap(), 0.1, 3.0).unwrap();
        for load in [0.01, 1.0 / 3.0, 2e-17, 12345.678, 0.0, -0.07] {
            assert_eq!(units.mean_pressure(load), decimal::nearest(load * units.pressure()));
            assert_eq!(units.reduced_pressure(load), decimal::nearest(load / units.pressure()));
        }
    }
}
