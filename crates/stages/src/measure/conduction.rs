//! Conductance of contacts, which follows from their stiffness. A `solve` stage computes that of
//! contacts with a layer.

use std::f64::consts::PI;

use arrow::array::{Array, ArrayRef, Float64Array};

use crate::bodies::{Conduction, LayerConduction};
use crate::columns::*;
use crate::grids::Grids;
use crate::table_columns::Values::{Count, OptionalReal, Real};
use crate::table_columns::{TableColumns, column, column_if};
use crate::version::Version;
use crate::{StageError, units};
use asperity_manifest::keys::quantity::{Dimension, Unit};
use asperity_mechanics::conductance::SpotConductance;
use asperity_mechanics::grid::{Boundary, Grid};
use asperity_tables::column::Column;
use asperity_tables::table::Table;
use asperity_topography_files::length_ratio;

/// Version of the conductance of separate spots in periodic cells.
pub const SPOTS_VERSION: Version =
    Version::new(1, &["Greenwood's formula has the centres of the spots, not the nearest nodes"]);

/// Settings that decide which columns tables have.
pub struct Settings {
    /// True if the material yields, so that the stiffness of unloading is known.
    yields: bool,
    conduction: Conduction,
    /// True if the forces on the cells are known, because pressures have a unit.
    has_force: bool,
    /// True if the solved loads have a column of forces already.
    are_forces: bool,
    has_hardness: bool,
}

/// Conductance of one contact, with the data for its conversion to units of the SI.
pub struct Conductance {
    stiffness: Option<f64>,
    unloading_stiffness: Option<f64>,
    /// Conductance in units of k_s over the longer side; `None` on a layer without conductivities.
    conductance: Option<f64>,
    /// Conductance by Greenwood's formula, in the same unit.
    greenwood: Option<f64>,
    spots: usize,
    mean_radius: Option<f64>,
    /// Conductivity k_s and resistivity ρ_s of the bodies; NaN if they are unknown.
    conductivity: f64,
    resistivity: f64,
    /// Layer with conductivities, if there is one.
    layer: Option<ConductingLayer>,
    /// Longer side in metres, and nominal area in m². Validation refuses surfaces without a unit of
    /// length, whose conductances would be null here.
    side: f64,
    area: f64,
    /// Force in newtons.
    force: f64,
    hardness: Option<f64>,
    /// Unit of the hardness in pascals.
    pascals: f64,
}

/// Layer through which the heat or the current flows.
#[derive(Clone, Copy)]
struct ConductingLayer {
    /// Thickness in metres.
    thickness: f64,
    conduction: LayerConduction,
}

impl Conductance {
    fn thermal_conductance(&self) -> Option<f64> {
        finite(self.conductance? * self.conductivity / self.side)
    }

    fn thermal_resistance(&self) -> Option<f64> {
        finite(self.side / (self.conductance? * self.conductivity * self.area))
    }

    /// Returns the specific electrical resistance of a contact with a conductance.
    fn specific(&self, conductance: Option<f64>) -> Option<f64> {
        finite(self.resistivity * self.side / conductance?)
    }

    /// Returns the electrical resistance of a whole cell with a conductance.
    fn resistance(&self, conductance: Option<f64>) -> Option<f64> {
        finite(self.resistivity * self.side / conductance? / self.area)
    }

    /// Returns k_s/k₁ = ρ₁/ρ_s of the layer times its thickness.
    fn thickness_of_pair(&self) -> Option<f64> {
        let layer = self.layer?;
        Some(layer.thickness * 2.0 / (1.0 + layer.conduction.to_counter_body))
    }

    fn layer_thermal_resistance(&self) -> Option<f64> {
        finite(self.thickness_of_pair()? / (self.conductivity * self.area))
    }

    fn layer_electrical_resistance(&self) -> Option<f64> {
        finite(self.thickness_of_pair()? * self.resistivity / self.area)
    }

    fn holm_resistance(&self) -> Option<f64> {
        if self.layer.is_some() {
            return None;
        }
        Some(self.resistivity / 2.0 * (PI * self.hardness? * self.pascals / self.force).sqrt())
    }
}

/// Returns a number if it is finite: a contact without conductance has no finite resistance.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn has_layer(settings: &Settings) -> bool {
    settings.conduction.layer.is_some()
}

fn heats(settings: &Settings) -> bool {
    settings.conduction.conductivity.is_some()
}

fn conducts(settings: &Settings) -> bool {
    settings.conduction.resistivity.is_some()
}

/// Returns the columns of the conductance of contacts.
pub fn columns() -> TableColumns<Settings, Conductance> {
    TableColumns::<Settings, Conductance>::new([
        column(FROZEN_STIFFNESS, OptionalReal(|one| one.stiffness)),
        column_if(|of| of.yields, UNLOADING_STIFFNESS, OptionalReal(|one| one.unloading_stiffness)),
        column(CONTACT_CONDUCTANCE, OptionalReal(|one| one.conductance)),
        column(SPOTS, Count(|one| one.spots)),
        column(MEAN_SPOT_RADIUS, OptionalReal(|one| one.mean_radius)),
        column(GREENWOOD_CONDUCTANCE, OptionalReal(|one| one.greenwood)),
        column_if(|of| of.has_force && !of.are_forces, FORCE, Real(|one| one.force)),
        column_if(
            has_layer,
            SUBSTRATE_CONDUCTIVITY_RATIO,
            OptionalReal(|one| Some(one.layer?.conduction.to_substrate)),
        ),
        column_if(
            has_layer,
            COUNTER_CONDUCTIVITY_RATIO,
            OptionalReal(|one| Some(one.layer?.conduction.to_counter_body)),
        ),
        column_if(heats, PAIR_CONDUCTIVITY, Real(|one| one.conductivity)),
        column_if(heats, THERMAL_CONDUCTANCE, OptionalReal(Conductance::thermal_conductance)),
        column_if(heats, THERMAL_RESISTANCE, OptionalReal(Conductance::thermal_resistance)),
        column_if(
            |settings| heats(settings) && has_layer(settings),
            LAYER_THERMAL_RESISTANCE,
            OptionalReal(Conductance::layer_thermal_resistance),
        ),
        column_if(conducts, PAIR_RESISTIVITY, Real(|one| one.resistivity)),
        column_if(conducts, SPECIFIC_RESISTANCE, OptionalReal(|one| one.specific(one.conductance))),
        column_if(
            conducts,
            ELECTRICAL_RESISTANCE,
            OptionalReal(|one| one.resistance(one.conductance)),
        ),
        column_if(
            conducts,
            GREENWOOD_RESISTANCE,
            OptionalReal(|one| one.resistance(one.greenwood)),
        ),
        column_if(
            |settings| conducts(settings) && has_layer(settings),
            LAYER_ELECTRICAL_RESISTANCE,
            OptionalReal(Conductance::layer_electrical_resistance),
        ),
        column_if(
            |of| conducts(of) && of.has_force && of.has_hardness,
            HOLM_RESISTANCE,
            OptionalReal(Conductance::holm_resistance),
        ),
    ])
}

/// Returns the conductance of each contact, from its stiffness or as solved for a layer, beside
/// that of separate spots.
///
/// # Errors
/// Returns an error if a column is missing or a contact map does not fit its mesh.
pub fn conductances(
    solved: &Table,
    grids: Grids,
    boundary: Boundary,
    conduction: Option<Conduction>,
) -> Result<Vec<(Column, ArrayRef)>, StageError> {
    let number = |column: Column| solved.optional(column.name, Table::reals);
    let stiffnesses = solved.reals(FROZEN_STIFFNESS.name)?;
    let unloading = number(UNLOADING_STIFFNESS)?;
    let through_layer = number(CONTACT_CONDUCTANCE)?;
    let pressures = solved.reals(PRESSURE.name)?;
    let [layers, hardnesses] = [number(LAYER_THICKNESS)?, number(HARDNESS)?];
    let settings = Settings {
        yields: unloading.is_some(),
        conduction: conduction.unwrap_or_default(),
        has_force: conduction.is_some() && solved.has(PRESSURE_UNIT.name),
        are_forces: solved.has(FORCE.name),
        has_hardness: hardnesses.is_some(),
    };
    let Conduction { conductivity, resistivity, layer } = settings.conduction;
    let pascals = pascals(solved);
    let unit = units::length_unit(solved);
    let metres = unit.and_then(|unit| length_ratio(&unit, "m")).unwrap_or(f64::NAN);
    let value = |values: &Float64Array, row: usize| values.is_valid(row).then(|| values.value(row));
    let mut prepared: Option<(Grid, SpotConductance)> = None;
    let mut rows = Vec::with_capacity(solved.rows());
    for (row, map) in grids.maps(solved, CONTACT)?.into_iter().enumerate() {
        let grid = grids.grid(row)?;
        let (_, of_spots) = match prepared.take().filter(|(of, _)| *of == grid) {
            Some(prepared) => prepared,
            None => (grid, SpotConductance::new(grid, boundary)),
        };
        let (_, of_spots) = prepared.insert((grid, of_spots));
        let found = of_spots.of_map(&map);
        let thickness = layers.and_then(|layers| value(layers, row));
        // A current flows through all nodes in contact, also where the material has yielded.
        let of_all_nodes = value(unloading.unwrap_or(stiffnesses), row);
        let conductance = match thickness {
            // Barber's analogy is one of elastic half-spaces.
            None => of_all_nodes,
            Some(_) => through_layer.and_then(|values| value(values, row)),
        };
        let area = metres * metres * grid.cell().area();
        rows.push(Conductance {
            stiffness: value(stiffnesses, row),
            unloading_stiffness: unloading.and_then(|values| value(values, row)),
            conductance,
            greenwood: found.greenwood.filter(|_| thickness.is_none()),
            spots: found.count,
            mean_radius: found.mean_radius.map(|radius| radius * grid.cell().longer_side()),
            conductivity: conductivity.unwrap_or(f64::NAN),
            resistivity: resistivity.unwrap_or(f64::NAN),
            layer: thickness.zip(layer).map(|(thickness, conduction)| ConductingLayer {
                thickness: thickness * metres,
                conduction,
            }),
            side: metres * grid.cell().longer_side(),
            area,
            force: pressures.value(row) * pascals * area,
            hardness: hardnesses.and_then(|values| value(values, row)),
            pascals,
        });
    }
    Ok(columns().filled(&settings, &rows))
}

/// Returns the unit of the pressures of a table in pascals.
fn pascals(solved: &Table) -> f64 {
    let symbol = units::pressure_unit(solved);
    let unit = symbol.as_deref().and_then(Unit::find);
    unit.map_or(f64::NAN, |unit| unit.factor_to(Unit::si(Dimension::Pressure)))
}
