//! The hardness of a material, as it is given and on one surface.

use serde::Serialize;

use super::PressureUnit;
use crate::contact::solver;
use crate::stages::columns::{HARDNESS, HARDNESS_REDUCED};
use crate::store::column::{Column, Value};

/// The highest pressure that a material bears, as it is given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GivenHardness {
    /// Positive.
    pub pressure: f64,
    /// What it is measured in.
    pub unit: PressureUnit,
}

impl GivenHardness {
    /// The coordinate that it is before a surface is known.
    pub fn coordinate(&self) -> (Column, Value) {
        let column = match self.unit {
            PressureUnit::Absolute => HARDNESS,
            PressureUnit::Relative => HARDNESS_REDUCED,
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
}

impl SurfaceHardness {
    /// The coordinates of its rows.
    pub fn coordinates(&self) -> [(Column, Value); 2] {
        [
            (HARDNESS, Value::Real(self.pressure)),
            (HARDNESS_REDUCED, Value::Real(self.reduced.pressure())),
        ]
    }
}
