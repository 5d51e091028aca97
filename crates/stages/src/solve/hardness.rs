//! The hardness of a material, as it is given and on one surface.

use serde::Serialize;

use super::PressureUnit;
use asperity_contact::solver;
use asperity_tables::column::{Column, Value};

/// Version of the numbers of loads that are solved under a hardness. It is a part of their recipes alone:
/// where it is raised and that of the stage is not, elastic loads are not computed again.
const VERSION: u32 = 3;

/// The highest pressure that a material bears, as it is given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(into = "HardnessRecipe")]
pub struct GivenHardness {
    /// Positive.
    pub pressure: f64,
    /// What it is measured in.
    pub unit: PressureUnit,
}

/// What recipes say of it.
#[derive(Serialize)]
struct HardnessRecipe {
    pressure: f64,
    unit: PressureUnit,
    version: u32,
}

impl From<GivenHardness> for HardnessRecipe {
    fn from(GivenHardness { pressure, unit }: GivenHardness) -> Self {
        Self { pressure, unit, version: VERSION }
    }
}

impl GivenHardness {
    /// The coordinate that it is before a surface is known.
    pub fn coordinate(&self) -> (Column, Value) {
        let [absolute, reduced] = self.unit.hardness_columns();
        let column = match self.unit {
            PressureUnit::Absolute => absolute,
            PressureUnit::Relative => reduced,
        };
        (column, Value::Real(self.pressure))
    }
}

/// The same on one surface, in both units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceHardness {
    /// In the unit of the modulus.
    pub pressure: f64,
    /// In units of E* × rms slope.
    pub reduced: solver::Hardness,
    /// The unit in which the manifest gives it.
    pub given: PressureUnit,
}

impl SurfaceHardness {
    /// The coordinates of its rows.
    pub fn coordinates(&self) -> [(Column, Value); 2] {
        let [absolute, reduced] = self.given.hardness_columns();
        [(absolute, Value::Real(self.pressure)), (reduced, Value::Real(self.reduced.pressure()))]
    }
}
