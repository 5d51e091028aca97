//! Contact of surfaces that attract each other, along a path of loads or mean gaps.
//!
//! With adhesion the contact of a surface has several states under one load. Each state of a path
//! starts from the state before it, so a row depends on the whole path up to it. The table is
//! therefore stored as a whole. A longer path with the same first states continues from the stored
//! gaps of the last of them; see [`Stage::beginning`].

mod path;
mod rows;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use serde::Serialize;

use crate::columns::*;
use crate::nominal_area::{self, NominalArea};
use crate::per_axis::PerAxis;
use crate::reduced_units::PressureUnit;
use crate::solve::{Control, pressed};
use crate::surface::pair;
use crate::version::{PartVersion, Version};
use crate::{
    Context, Effort, Extent, Footprint, Input, Kind, Recipe, Stage, StageError, beside_coordinates,
};
use asperity_mechanics::adhesion::{AdhesivePath, Settings};
use asperity_mechanics::distribution::EqualBins;
use asperity_mechanics::grid::Boundary;
use asperity_tables::column::{Column, Value};
use asperity_tables::parquet::Columns;
use asperity_tables::table::Table;

pub use self::path::{ContactPath, PathFields, StateMaps, displacement};

/// Version of the numbers with adhesion. Only recipes with adhesion contain it, so raising it does
/// not recompute other contacts.
pub const VERSION: Version = Version::new(
    1,
    &[
        "the pull-off load is ten times as accurate",
        "descents end in the state also where nodes are about to close, and states of symmetric \
         surfaces are no saddle points",
        "new columns `repulsive_pressure` and `pressure_in_contact`, for the mean contact pressure",
        "another preconditioner and longer steps: fewer pairs of transforms, other last digits",
        "residuals are at most a hundredth of the largest attraction and of the load: under loads \
         far below E* h′, states did not bear them",
    ],
);

/// Number of pairs of transforms by which a state takes fewer pairs if the tolerance is tenfold.
/// With the default tolerance of the solver, 1e-9, it takes [`AdhesivePath::PAIRS_PER_STATE`].
/// Decreases of 3 to 8 pairs were counted on 32² and 64² nodes.
const PAIRS_PER_DECADE: f64 = 6.0;

/// Number of additional pairs of transforms to find the pull-off load. On 32² to 128² nodes, 430 to
/// 1140 were counted with the default tolerance, and twice as many with a free boundary.
const PAIRS_OF_PULL_OFF: f64 = 900.0;

/// Ratio of the time of a pair to that of a pair without adhesion, measured on 256² and 512² nodes.
/// The pairs are in double precision, and an iteration makes more passes over the mesh.
const PAIR_COST: f64 = 5.5;

/// Ratio of the time of a state with a free boundary to the time with a periodic boundary, measured
/// on 128² and 256² nodes.
const FREE: f64 = 13.0;

/// Code in the column `stop` of states in which the surfaces are apart.
pub const PULLED_OFF: &str = "pulled-off";

/// Code in the column `stop` of states that no longer move and are not in balance.
pub const STALLED: &str = "stalled";

/// Code in the column `stop` of states whose mean gap is not the prescribed one.
pub const GAP_NOT_REACHED: &str = "gap-not-reached";

/// Parameters of a path on one surface.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Params {
    pub version: u32,
    /// Effective elastic modulus E* of the two bodies.
    pub effective_modulus: f64,
    /// Unit of the loads.
    pub load_unit: PressureUnit,
    /// Symbol of the unit of all pressures, which is a label.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_unit: Option<&'static str>,
    /// Force on the nominal area under the pressure 1 in newtons, if the manifest gives loads as
    /// forces. Only surfaces with this area are pressed, and the loads are mean pressures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub newtons: Option<f64>,
    /// Work of adhesion w in the unit of the modulus times the unit of length; at least zero.
    pub work: f64,
    /// Range ρ of the interaction in the unit of length; positive.
    pub range: f64,
    pub control: Control,
    /// Loads, or mean gaps in the unit of length, in the order of the path. There is at least one.
    pub targets: Vec<f64>,
    /// Largest accepted error of a pressure, in units of E* × rms slope.
    pub tolerance: f64,
    /// Maximum number of pairs of transforms for one state.
    pub max_pairs: u32,
    /// True if the pressures and gaps of all states are stored.
    pub keeps_maps: bool,
    /// Bins of the pressures above zero. Bins of the same width count negative pressures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_bins: Option<EqualBins>,
    /// Bins of the gaps outside contact, in units of the rms height.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_bins: Option<EqualBins>,
    #[serde(skip_serializing_if = "Boundary::is_periodic")]
    pub boundary: Boundary,
    /// Shift of the second surface along x and y in fractions of the sides, if two rough surfaces
    /// are pressed against each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift: Option<PerAxis<f64>>,
    /// True if the loads are plain numbers and `load_unit` is left out, although other pressures of
    /// the stage have a unit. It is not part of the recipe.
    #[serde(skip)]
    pub loads_lack_unit: bool,
}

/// Returns the light columns of all paths, without the parameter columns of surfaces.
pub fn all_columns() -> Vec<Column> {
    let settings =
        [ADHESIVE_TOLERANCE, WORK_OF_ADHESION, INTERACTION_RANGE, CONTROL, PRESSURE_UNIT, BOUNDARY];
    [&settings[..], &rows::columns().all()].concat()
}

impl Params {
    fn settings(&self) -> Settings {
        Settings { tolerance: self.tolerance, pair_limit: self.max_pairs, ..Settings::OF_STUDIES }
    }

    /// Returns the parameter columns that all rows share, with their values.
    fn setting(&self) -> Vec<(Column, Value)> {
        let mut setting = vec![
            (EFFECTIVE_MODULUS, Value::Real(self.effective_modulus)),
            (WORK_OF_ADHESION, Value::Real(self.work)),
            (INTERACTION_RANGE, Value::Real(self.range)),
            (CONTROL, Value::Text(self.control.name().to_owned())),
            (ADHESIVE_TOLERANCE, Value::Real(self.tolerance)),
            (MAX_PAIRS, Value::Integer(i64::from(self.max_pairs))),
        ];
        if let Some(unit) = self.pressure_unit {
            setting.push((PRESSURE_UNIT, Value::Text(unit.to_owned())));
        }
        if self.boundary == Boundary::Free {
            setting.push((BOUNDARY, Value::Text(self.boundary.name().to_owned())));
        }
        setting
    }

    /// Returns the Tabor parameter (R w²/E*²)^(1/3)/ρ with R = 1/√m₄, given the rms curvature √m₄.
    /// Returns `None` for a flat surface.
    pub fn tabor(&self, curvature: f64) -> Option<f64> {
        let stretch = self.work / self.effective_modulus;
        (curvature > 0.0).then(|| libm::cbrt(stretch * stretch / curvature) / self.range)
    }

    /// Returns the reciprocal of criterion 10 of Pastewka & Robbins, 2w/(E* ρ h′) (κ ρ/h′²)^(2/3),
    /// given the rms slope h′ and half the rms Laplacian κ. Returns `None` for a flat surface.
    pub fn stickiness(&self, slope: f64, half_laplacian: f64) -> Option<f64> {
        let pull = 2.0 * self.work / (self.effective_modulus * self.range * slope);
        let ratio = libm::cbrt(half_laplacian * self.range / (slope * slope));
        (slope > 0.0 && half_laplacian > 0.0).then_some(pull * ratio * ratio)
    }

    /// Returns the same path on another nominal area, with loads that are the same forces.
    pub fn on_area(&self, area: &NominalArea) -> Params {
        let after = self.pressure_unit.and_then(|unit| area.newtons(unit));
        let (Some(_), Some(after)) = (self.newtons, after) else { return self.clone() };
        let targets = nominal_area::pressures(&self.given_targets(), Some(after));
        Params { newtons: Some(after), targets, ..self.clone() }
    }

    /// Returns the loads or mean gaps as the manifest gives them; loads may be forces.
    pub fn given_targets(&self) -> Vec<f64> {
        let given = |target: &f64| match self.newtons {
            Some(newtons) => nominal_area::force(*target, newtons),
            None => *target,
        };
        self.targets.iter().map(given).collect()
    }

    /// Returns the symbol of the unit of [`Params::given_targets`], if they are loads.
    pub fn unit_of_given_loads(&self) -> Option<&'static str> {
        self.newtons.map(|_| "N").or(self.unit_of_loads())
    }

    /// Returns the symbol of the unit of the loads; `None` for reduced loads, for mean gaps, and if
    /// the manifest names no unit.
    pub fn unit_of_loads(&self) -> Option<&'static str> {
        let is_pressure = self.load_unit == PressureUnit::Absolute && self.control == Control::Load;
        self.pressure_unit.filter(|_| is_pressure)
    }
}

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Solve
    }

    fn part_versions(&self) -> Vec<PartVersion> {
        vec![PartVersion::new("version", "adhesion", VERSION)]
    }

    fn run(&self, inputs: &[Input], context: &Context) -> Result<Table, StageError> {
        let (surface, table) = pressed(inputs, context)?;
        path::solve(self, surface, table, context)
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        let settings = self.setting().into_iter().map(|(column, _)| column);
        let columns: Vec<Column> = settings.chain(rows::columns().of(self)).collect();
        Ok(beside_coordinates(&columns, inputs)?)
    }

    /// Returns true, because the columns depend on control and boundary.
    fn columns_depend_on_params(&self) -> bool {
        true
    }

    fn columns_read(&self) -> Columns {
        Columns::All
    }

    /// Returns the memory of the solver and of the maps in the table: two bits per node and state,
    /// and the stored pressures and gaps.
    fn footprint(&self) -> Footprint {
        let states = self.targets.len() as f64;
        let kept = if self.keeps_maps { 2.0 * states } else { 1.0 };
        Footprint {
            work: AdhesivePath::bytes_per_node(self.boundary),
            table: states / 4.0 + 8.0 * kept,
        }
    }

    fn coordinates(&self) -> Vec<(Column, Value)> {
        self.setting()
    }

    fn rows(&self, _: usize) -> usize {
        self.targets.len()
    }

    fn effort(&self, _: Extent) -> Effort {
        let decades = libm::log10(self.tolerance / Settings::default().tolerance);
        let of_state = AdhesivePath::PAIRS_PER_STATE - PAIRS_PER_DECADE * decades;
        let is_pulled =
            self.control == Control::Load && self.targets.iter().any(|load| *load < 0.0);
        let of_pull_off = if is_pulled { PAIRS_OF_PULL_OFF } else { 0.0 };
        let pairs = of_state.max(PAIRS_PER_DECADE) * self.targets.len() as f64 + of_pull_off;
        let of_boundary = match self.boundary {
            Boundary::Periodic => 1.0,
            Boundary::Free => FREE,
        };
        Effort::pairs(of_boundary * PAIR_COST * pairs)
    }

    fn reads_input(&self, input: &Recipe) -> bool {
        pair::is_at(self.shift, input)
            && nominal_area::is_of(input, self.newtons, self.pressure_unit)
    }

    fn beginning(&self, rows: usize) -> Option<Recipe> {
        let shorter = self.targets.get(..rows).filter(|shorter| shorter.len() < self.targets.len());
        let targets = shorter?.to_vec();
        Some(Recipe::Adhesion(Arc::new(Params { targets, ..self.clone() })))
    }
}
