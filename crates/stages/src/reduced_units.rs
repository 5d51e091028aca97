//! Conversion between the units of the solver and of the manifest.
//!
//! The solver divides pressures by E* × rms slope, and lengths by longer side × rms slope.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::columns::*;
use crate::version::Version;
use asperity_manifest::decimal;
use asperity_mechanics::grid::Grid;
use asperity_mechanics::solver;
use asperity_mechanics::solver::{Hardness, HardnessError};
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::column::{Column, Role, Value};

/// The unit of loads and hardnesses in a manifest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PressureUnit {
    /// Pressures are multiples of E* × rms slope.
    Relative,
    /// Pressures have the unit of the moduli.
    Absolute,
}

impl PressureUnit {
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
    /// Longer side L of the cell.
    side: f64,
    /// Rms slope h′ of the surface. It is 1 for a flat surface, which changes no result.
    slope: f64,
    /// Unit of pressure, E* × h′.
    pressure: f64,
}

impl Scales {
    /// Creates the scales of a surface.
    pub fn new(grid: Grid, rms_slope: f64, effective_modulus: f64) -> Scales {
        let slope = if rms_slope > 0.0 { rms_slope } else { 1.0 };
        Scales {
            nodes: grid.nodes(),
            side: grid.cell().longer_side(),
            slope,
            pressure: effective_modulus * slope,
        }
    }

    /// Divides the heights of a surface by the unit of length.
    pub fn reduced_heights(&self, surface: Surface) -> Vec<f64> {
        let unit = self.side * self.slope;
        let mut heights = surface.into_heights();
        heights.iter_mut().for_each(|height| *height /= unit);
        heights
    }

    /// Returns the unit of length, L × h′.
    pub fn length(&self) -> f64 {
        self.side * self.slope
    }

    /// Returns the unit of pressure, E* × h′.
    pub fn pressure(&self) -> f64 {
        self.pressure
    }

    /// Converts a pressure of the manifest to units of E* × h′. The result is rounded, so that
    /// loads in either unit are equal.
    pub fn reduced_pressure(&self, given: f64, unit: PressureUnit) -> f64 {
        match unit {
            PressureUnit::Relative => given,
            PressureUnit::Absolute => decimal::nearest(given / self.pressure),
        }
    }

    /// Converts a reduced load to a mean pressure in the unit of the moduli.
    pub fn mean_pressure(&self, load: f64) -> f64 {
        decimal::nearest(load * self.pressure)
    }

    /// Converts the hardness of the manifest to both units for this surface.
    ///
    /// # Errors
    /// If the reduced hardness is not positive and finite.
    pub fn hardness(&self, given: GivenHardness) -> Result<SurfaceHardness, HardnessError> {
        let GivenHardness { pressure, unit } = given;
        Ok(SurfaceHardness {
            pressure: match unit {
                PressureUnit::Relative => decimal::nearest(pressure * self.pressure),
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
