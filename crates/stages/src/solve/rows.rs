//! Rows of solved loads and their table.

use arrow::array::ArrayRef;

use crate::columns::*;
use crate::nominal_area;
use crate::reduced_units::{PressureUnit, Scales, SurfaceHardness};
use crate::solve::parts::{self, LoadParts};
use crate::solve::{Control, NO_CONTACT, NOT_REACHED, PAIR_LIMIT, Params};
use crate::table_columns::Values::{Count, OptionalReal, Real, Text};
use crate::table_columns::{TableColumns, column, column_if, column_in_role};
use asperity_mechanics::asperities::AsperityOutcome;
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::morphology::map::ContactMap;
use asperity_mechanics::solver::{Outcome, Stop};
use asperity_mechanics::threads::Threads;
use asperity_tables::column::{Column, Role, bytes};
use asperity_tables::table::Table;

/// Result of one load.
#[derive(Debug, Clone)]
pub struct SolvedLoad {
    /// Load in the unit of the manifest, or the prescribed gap or displacement.
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

/// A solved load on one surface.
pub struct LoadRow<'a> {
    solved: &'a SolvedLoad,
    outcome: &'a Outcome,
    /// Mean pressure in the unit of the moduli.
    pressure: f64,
    /// Force in newtons, if the manifest gives loads as forces.
    force: Option<f64>,
    saturated_fraction: f64,
    hardness: Option<SurfaceHardness>,
    /// Units of length and of pressure of the solver.
    length: f64,
    unit: f64,
}

impl<'a> LoadRow<'a> {
    fn new(
        solved: &'a SolvedLoad,
        params: &Params,
        scales: &Scales,
        hardness: Option<SurfaceHardness>,
    ) -> LoadRow<'a> {
        let [nodes_x, nodes_y] = scales.nodes;
        let outcome = &solved.outcome;
        let pressure = match (params.control, params.load_unit) {
            (Control::Load, PressureUnit::Absolute) => solved.given,
            _ => scales.mean_pressure(solved.load),
        };
        LoadRow {
            solved,
            outcome,
            pressure,
            force: params.newtons.map(|newtons| nominal_area::force(pressure, newtons)),
            saturated_fraction: outcome.saturated_nodes as f64 / (nodes_x * nodes_y) as f64,
            hardness,
            length: scales.length(),
            unit: scales.pressure(),
        }
    }

    /// Returns the outcome of an asperity model, which all loads of its tables have.
    fn asperities(&self) -> AsperityOutcome {
        self.solved.asperities.expect("the summits are Hertz contacts")
    }

    fn plastic_work(&self) -> Option<f64> {
        Some(self.outcome.yielded_depth * (self.hardness?.pressure * self.length))
    }

    fn compression(&self, index: usize) -> Option<f64> {
        Some(self.solved.compression?[index] * self.length)
    }

    fn yielded_depth(&self) -> f64 {
        self.outcome.yielded_depth * self.length
    }
}

fn of_summits(params: &Params) -> bool {
    params.asperities.is_some()
}

fn is_on_rigid_base(params: &Params) -> bool {
    params.layer.is_some_and(|layer| layer.is_on_rigid_base())
}

fn yields(params: &Params) -> bool {
    params.hardness.is_some()
}

fn unloads(params: &Params) -> bool {
    yields(params) && params.branch.is_some()
}

/// Returns the role of a prescribed length, which only tables with this control have.
fn prescribed(params: &Params, control: Control) -> Option<Role> {
    (params.control == control).then_some(Role::Load)
}

/// Returns the roles of `load` and `pressure`.
fn roles(params: &Params) -> [Role; 2] {
    match params.control {
        Control::Load => params.load_unit.roles(Role::Load),
        Control::Gap | Control::Displacement => [Role::Result; 2],
    }
}

/// Returns the role of the force, which is derived from the load, if it is known.
fn role_of_force(params: &Params) -> Option<Role> {
    params.newtons.map(|_| if params.control.is_load() { Role::Derived } else { Role::Result })
}

/// Returns the light columns of solved loads, without the coordinates of surfaces, the settings and
/// the parts.
pub fn columns<'a>() -> TableColumns<Params, LoadRow<'a>> {
    TableColumns::<Params, LoadRow>::new([
        column_in_role(
            PRESCRIBED_GAP,
            |of| prescribed(of, Control::Gap),
            Real(|row| row.solved.given),
        ),
        column_in_role(
            PRESCRIBED_DISPLACEMENT,
            |params| prescribed(params, Control::Displacement),
            Real(|row| row.solved.given),
        ),
        column_in_role(LOAD, |params| Some(roles(params)[0]), Real(|row| row.solved.load)),
        column_in_role(PRESSURE, |params| Some(roles(params)[1]), Real(|row| row.pressure)),
        column_in_role(FORCE, role_of_force, OptionalReal(|row| row.force)),
        column(CONTACT_NODES, Count(|row| row.outcome.contact_nodes)),
        column_if(of_summits, CONTACTS, Count(|row| row.asperities().contacts)),
        column_if(of_summits, OVERLAPPING_CONTACTS, Count(|row| row.asperities().overlapping)),
        column_if(of_summits, ASPERITY_AREA_FRACTION, Real(|row| row.asperities().area_fraction)),
        column_if(of_summits, OVERLAPPING_SHARE, Real(|row| row.asperities().overlapping_fraction)),
        column_if(
            of_summits,
            NOMINAL_DISPLACEMENT,
            Real(|row| row.asperities().nominal_displacement * row.length),
        ),
        column_if(yields, SATURATED_NODES, Count(|row| row.outcome.saturated_nodes)),
        column_if(yields, SATURATED_FRACTION, Real(|row| row.saturated_fraction)),
        column(MEAN_GAP, Real(|row| row.outcome.mean_gap * row.length)),
        column_if(
            |params| params.boundary == Boundary::Free,
            MEAN_DISPLACEMENT,
            OptionalReal(|row| Some(row.solved.displacement? * row.length)),
        ),
        column_if(is_on_rigid_base, UNIFORM_COMPRESSION, OptionalReal(|row| row.compression(0))),
        column_if(is_on_rigid_base, APPROACH, OptionalReal(|row| row.compression(1))),
        column_if(yields, MEAN_YIELDED_DEPTH, Real(LoadRow::yielded_depth)),
        column_if(unloads, RESIDUAL_DEPTH, Real(LoadRow::yielded_depth)),
        column_if(unloads, PLASTIC_WORK, OptionalReal(LoadRow::plastic_work)),
        column(ENERGY, Real(|row| row.outcome.energy * (row.unit * row.length))),
        column(PEAK_PRESSURE, Real(|row| row.outcome.peak_pressure * row.unit)),
        column(PAIRS, Count(|row| row.outcome.pairs as usize)),
        column(RESIDUAL, Real(|row| row.outcome.residual)),
        column(STOP, Text(|row| stop_name(row.outcome.stop))),
    ])
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
    let of_hardness = hardness.iter().flat_map(SurfaceHardness::coordinates);
    let coordinates = params.setting().into_iter().chain(of_hardness);
    let mut table: Vec<(Column, ArrayRef)> =
        coordinates.map(|(column, value)| (column, value.repeated(count))).collect();
    let row = |solved| LoadRow::new(solved, params, scales, hardness);
    let rows: Vec<LoadRow> = loads.iter().map(row).collect();
    table.extend(columns().filled(params, &rows));
    table.push((CONTACT, bytes(loads.iter().map(|load| &load.contact))));
    let length = scales.length();
    let mean_gaps: Vec<f64> = loads.iter().map(|load| load.outcome.mean_gap * length).collect();
    table.extend(parts::columns(params, length, &mean_gaps, parts));
    surface.coordinates().pick(&vec![0; count]).with(table)
}

/// Returns the code of a load in the column `stop`.
fn stop_name(stop: Stop) -> &'static str {
    match stop {
        Stop::Converged => "converged",
        Stop::FullContact => "full-contact",
        Stop::PairLimit => PAIR_LIMIT,
        Stop::Interrupted => "interrupted",
        Stop::NoContact => NO_CONTACT,
        Stop::NotReached => NOT_REACHED,
    }
}
