//! Rows of solved loads and their table.

use arrow::array::ArrayRef;

use super::parts::LoadParts;
use super::{PAIR_LIMIT, Params, parts};
use crate::columns::*;
use crate::reduced_units::{PressureUnit, Scales, SurfaceHardness};
use crate::unloading;
use crate::unloading::Branch;
use asperity_contact::asperities::AsperityOutcome;
use asperity_contact::grid::Boundary;
use asperity_contact::morphology::map::ContactMap;
use asperity_contact::solver::{Outcome, Stop};
use asperity_contact::threads::Threads;
use asperity_tables::column::{Column, bytes, integers, reals, texts};
use asperity_tables::table::Table;

/// Result of one load.
#[derive(Debug, Clone)]
pub struct SolvedLoad {
    /// Load in the unit of the manifest.
    pub given: f64,
    /// Load in units of E* × rms slope.
    pub load: f64,
    /// Result in the units of the solver.
    pub outcome: Outcome,
    /// Contact map in the format of the column `contact`.
    pub contact: Vec<u8>,
    /// Mean displacement over the map in the solver's unit, if displacements are absolute.
    pub displacement: Option<f64>,
    /// Uniform compression of a layer on a rigid base and approach of the bodies, in the solver's
    /// unit of length.
    pub compression: Option<[f64; 2]>,
    /// Further results of an asperity model.
    pub asperities: Option<AsperityOutcome>,
    pub parts: LoadParts,
}

/// Returns the contact map of these pressures in the format of the column `contact`.
pub fn contact_map(threads: &Threads, nodes: [usize; 2], pressures: &[f64]) -> Vec<u8> {
    ContactMap::from_pressures_on(threads, nodes, pressures).to_bytes()
}

/// Choice of the columns that only some tables of solved loads have.
#[derive(Debug, Clone, Copy)]
pub struct OptionalColumns {
    pub boundary: Boundary,
    pub asperities: bool,
    pub flow: bool,
    pub stiffness: bool,
    /// True if the body has a layer, or only layers on a rigid base.
    pub layer: bool,
    pub rigid_base: bool,
    /// Unit in which loads are given.
    pub load_unit: PressureUnit,
    /// True if the unit of pressure has a name.
    pub pressure_unit: bool,
    /// Unit in which the hardness is given, if the material yields.
    pub hardness: Option<PressureUnit>,
    /// Branch of a path that goes up and down.
    pub branch: Option<Branch>,
}

/// Returns the light columns of solved loads, without the parameter columns of surfaces.
pub fn columns(optional: OptionalColumns) -> Vec<Column> {
    let OptionalColumns {
        boundary,
        asperities,
        flow,
        load_unit,
        pressure_unit,
        hardness,
        branch,
        ..
    } = optional;
    let mut columns = SOLVED.to_vec();
    let mut insert_after = |column: Column, new: &[Column]| {
        let index = columns.iter().position(|other| *other == column);
        let index = 1 + index.expect("all tables have the column");
        columns.splice(index..index, new.iter().copied());
    };
    if optional.stiffness {
        let unloading = hardness.map(|_| UNLOADING_STIFFNESS);
        insert_after(STOP, unloading.as_slice());
        insert_after(STOP, &[FROZEN_STIFFNESS]);
    }
    if flow {
        insert_after(STOP, &FLOW);
    }
    if let Some(unit) = hardness {
        insert_after(MEAN_GAP, &[MEAN_YIELDED_DEPTH]);
        if let Some(branch) = branch {
            insert_after(MEAN_YIELDED_DEPTH, &unloading::RESULTS);
            let own: Vec<_> = branch.setting(load_unit).iter().map(|(column, _)| *column).collect();
            insert_after(MAX_PAIRS, &own);
        }
        insert_after(CONTACT_NODES, &[SATURATED_NODES, SATURATED_FRACTION]);
        insert_after(MAX_PAIRS, &unit.hardness_columns());
    }
    if asperities {
        insert_after(CONTACT_NODES, &ASPERITY_COLUMNS);
        insert_after(MAX_PAIRS, &[INTERACTION]);
    }
    if optional.layer {
        insert_after(MAX_PAIRS, &LAYER_PARAMETERS);
    }
    if optional.rigid_base {
        insert_after(MEAN_GAP, &LAYER_RESULTS);
    }
    if boundary == Boundary::Free {
        insert_after(MEAN_GAP, &[MEAN_DISPLACEMENT]);
        insert_after(MAX_PAIRS, &[BOUNDARY]);
    }
    if pressure_unit {
        insert_after(MAX_PAIRS, &[PRESSURE_UNIT]);
    }
    for own in load_unit.load_columns() {
        let listed = columns.iter_mut().find(|column| column.name == own.name);
        *listed.expect("all tables have both columns") = own;
    }
    columns
}

/// Returns the table of solved loads of one surface. The parameters of the surface are taken from
/// the one-row table `surface`. The columns of parts are the last ones.
pub fn table(
    params: &Params,
    scales: &Scales,
    hardness: Option<SurfaceHardness>,
    surface: &Table,
    mut loads: Vec<SolvedLoad>,
) -> Table {
    let count = loads.len();
    let parts: Vec<LoadParts> =
        loads.iter_mut().map(|load| std::mem::take(&mut load.parts)).collect();
    let real = |value: fn(&Outcome) -> f64, unit: f64| {
        reals(loads.iter().map(|load| value(&load.outcome) * unit))
    };
    let whole = |value: fn(&Outcome) -> usize| {
        integers(loads.iter().map(|load| value(&load.outcome) as i64))
    };
    let (length, pressure) = (scales.length(), scales.pressure());
    let of_hardness = hardness.iter().flat_map(SurfaceHardness::coordinates);
    let coordinates = params.setting().into_iter().chain(of_hardness);
    let mut columns: Vec<(Column, ArrayRef)> =
        coordinates.map(|(column, value)| (column, value.repeated(count))).collect();
    let mean_pressure = |load: &SolvedLoad| match params.load_unit {
        PressureUnit::Relative => scales.mean_pressure(load.load),
        PressureUnit::Absolute => load.given,
    };
    let [load_column, pressure_column] = params.load_unit.load_columns();
    columns.extend([
        (load_column, reals(loads.iter().map(|load| load.load))),
        (pressure_column, reals(loads.iter().map(mean_pressure))),
        (CONTACT_NODES, whole(|outcome| outcome.contact_nodes)),
    ]);
    if params.asperities.is_some() {
        let outcomes: Vec<_> = loads.iter().filter_map(|load| load.asperities).collect();
        columns.extend(asperity_columns(&outcomes, length));
    }
    if hardness.is_some() {
        let nodes = (scales.nodes[0] * scales.nodes[1]) as f64;
        let fraction = |load: &SolvedLoad| load.outcome.saturated_nodes as f64 / nodes;
        columns.extend([
            (SATURATED_NODES, whole(|outcome| outcome.saturated_nodes)),
            (SATURATED_FRACTION, reals(loads.iter().map(fraction))),
        ]);
    }
    columns.push((MEAN_GAP, real(|outcome| outcome.mean_gap, length)));
    if params.boundary == Boundary::Free {
        let displacements = loads.iter().filter_map(|load| load.displacement);
        columns.push((MEAN_DISPLACEMENT, reals(displacements.map(|value| value * length))));
    }
    if params.layer.is_some_and(|layer| layer.is_on_rigid_base()) {
        for (index, column) in LAYER_RESULTS.into_iter().enumerate() {
            let lengths = loads.iter().filter_map(|load| Some(load.compression?[index] * length));
            columns.push((column, reals(lengths)));
        }
    }
    if hardness.is_some() {
        columns.push((MEAN_YIELDED_DEPTH, real(|outcome| outcome.yielded_depth, length)));
    }
    if let (Some(hardness), Some(_)) = (hardness, params.branch) {
        columns.push((RESIDUAL_DEPTH, real(|outcome| outcome.yielded_depth, length)));
        let work = hardness.pressure * length;
        columns.push((PLASTIC_WORK, real(|outcome| outcome.yielded_depth, work)));
    }
    columns.extend([
        (ENERGY, real(|outcome| outcome.energy, pressure * length)),
        (PEAK_PRESSURE, real(|outcome| outcome.peak_pressure, pressure)),
        (PAIRS, whole(|outcome| outcome.pairs as usize)),
        (RESIDUAL, real(|outcome| outcome.residual, 1.0)),
        (STOP, texts(loads.iter().map(|load| stop_name(load.outcome.stop)))),
        (CONTACT, bytes(loads.iter().map(|load| &load.contact))),
    ]);
    let mean_gaps: Vec<f64> = loads.iter().map(|load| load.outcome.mean_gap * length).collect();
    columns.extend(parts::columns(params, length, &mean_gaps, parts));
    surface.coordinates().pick(&vec![0; count]).with(columns)
}

fn asperity_columns(
    outcomes: &[AsperityOutcome],
    length: f64,
) -> impl Iterator<Item = (Column, ArrayRef)> {
    let whole = |value: fn(&AsperityOutcome) -> usize| {
        integers(outcomes.iter().map(|outcome| value(outcome) as i64))
    };
    let real = |value: fn(&AsperityOutcome) -> f64, unit: f64| {
        reals(outcomes.iter().map(|outcome| value(outcome) * unit))
    };
    let columns = [
        whole(|outcome| outcome.contacts),
        whole(|outcome| outcome.overlapping),
        real(|outcome| outcome.area_fraction, 1.0),
        real(|outcome| outcome.overlapping_fraction, 1.0),
        real(|outcome| outcome.nominal_displacement, length),
    ];
    ASPERITY_COLUMNS.into_iter().zip(columns)
}

/// Returns the code of a load in the column `stop`.
fn stop_name(stop: Stop) -> &'static str {
    match stop {
        Stop::Converged => "converged",
        Stop::FullContact => "full-contact",
        Stop::PairLimit => PAIR_LIMIT,
        Stop::Interrupted => "interrupted",
    }
}
