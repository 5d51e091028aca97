//! The solver's units and the user's: pressures over E* × rms slope, lengths over side × rms slope.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::columns::*;
use asperity_contact::grid::Grid;
use asperity_contact::solver;
use asperity_contact::solver::{Hardness, HardnessError};
use asperity_contact::topography::surface::Surface;
use asperity_manifest::decimal;
use asperity_tables::column::{Column, Role, Value};

/// What loads and hardnesses are measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PressureUnit {
    /// In units of E* × rms slope.
    Relative,
    /// As pressures, in the unit of the moduli.
    Absolute,
}

impl PressureUnit {
    /// Returns the columns `load` and `pressure`. The one that the manifest gives is a coordinate,
    /// and the other is derived from it on each surface.
    pub fn load_columns(self) -> [Column; 2] {
        let [reduced, absolute] = self.roles(Role::Load);
        [LOAD.with_role(reduced), PRESSURE.with_role(absolute)]
    }

    /// Returns the columns `hardness` and `hardness_reduced`. The one that the manifest gives is a
    /// parameter, and the other is derived from it.
    pub fn hardness_columns(self) -> [Column; 2] {
        let [reduced, absolute] = self.roles(Role::Parameter);
        [HARDNESS.with_role(absolute), HARDNESS_REDUCED.with_role(reduced)]
    }

    /// Returns the roles of a reduced value and of the same value in pascals; `given` is the role
    /// of the one that the manifest gives.
    fn roles(self, given: Role) -> [Role; 2] {
        match self {
            PressureUnit::Relative => [given, Role::Derived],
            PressureUnit::Absolute => [Role::Derived, given],
        }
    }
}

/// From the solver's units to the user's.
pub struct Scales {
    pub nodes: [usize; 2],
    /// The longer side of the cell.
    side: f64,
    /// rms slope; a flat surface counts as one of slope 1, which changes no result.
    slope: f64,
    /// E* × rms slope.
    pressure: f64,
}

impl Scales {
    pub fn of(grid: Grid, rms_slope: f64, effective_modulus: f64) -> Scales {
        let slope = if rms_slope > 0.0 { rms_slope } else { 1.0 };
        Scales {
            nodes: grid.nodes(),
            side: grid.cell().longer_side(),
            slope,
            pressure: effective_modulus * slope,
        }
    }

    pub fn reduced(&self, surface: Surface) -> Vec<f64> {
        let unit = self.side * self.slope;
        let mut heights = surface.into_heights();
        heights.iter_mut().for_each(|height| *height /= unit);
        heights
    }

    /// The unit of lengths: side × rms slope.
    pub fn length(&self) -> f64 {
        self.side * self.slope
    }

    /// The unit of pressures: E* × rms slope.
    pub fn pressure(&self) -> f64 {
        self.pressure
    }

    /// A pressure in units of E* × rms slope; blocks in either unit agree on it.
    pub fn reduced_pressure(&self, given: f64, unit: PressureUnit) -> f64 {
        match unit {
            PressureUnit::Relative => given,
            PressureUnit::Absolute => decimal::nearest(given / self.pressure),
        }
    }

    /// The mean pressure of a load.
    pub fn mean_pressure(&self, load: f64) -> f64 {
        decimal::nearest(load * self.pressure)
    }

    /// A hardness on this surface.
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

/// Version of the numbers of loads that are solved under a hardness. It is a part of their recipes
/// alone: where it is raised and that of the stage is not, elastic loads are not computed again.
const HARDNESS_VERSION: u32 = 3;

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
        Self { pressure, unit, version: HARDNESS_VERSION }
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
