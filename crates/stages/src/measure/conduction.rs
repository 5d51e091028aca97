//! Conductance of contacts, which follows from their stiffness.

use std::f64::consts::PI;

use arrow::array::{Array, ArrayRef};

use crate::bodies::Conduction;
use crate::columns::*;
use crate::grids::Grids;
use crate::{StageError, units};
use asperity_contact::conductance::SpotConductance;
use asperity_contact::grid::{Boundary, Grid};
use asperity_contact::morphology::map::ContactMap;
use asperity_manifest::keys::quantity::{Dimension, Unit};
use asperity_tables::column::{Column, integers, optional_reals, reals};
use asperity_tables::table::Table;
use asperity_topography_files::length_ratio;

/// Version of the conductance of separate spots in periodic cells.
pub const SPOTS_VERSION: u32 = 2;

/// Returns the columns of the conductance of contacts, which the table of the solved loads decides.
pub fn columns(solved: &Table, conduction: Option<Conduction>) -> Vec<Column> {
    if !solved.has(FROZEN_STIFFNESS.name) {
        return Vec::new();
    }
    let mut columns = CONDUCTANCE.to_vec();
    if solved.has(UNLOADING_STIFFNESS.name) {
        columns.insert(1, UNLOADING_STIFFNESS);
    }
    let Some(Conduction { conductivity, resistivity }) = conduction else {
        return columns;
    };
    let has_force = solved.has(PRESSURE_UNIT.name);
    columns.extend(has_force.then_some(FORCE));
    columns.extend(conductivity.iter().flat_map(|_| THERMAL));
    columns.extend(resistivity.iter().flat_map(|_| ELECTRICAL));
    let yields = has_force && solved.has(HARDNESS.name);
    columns.extend(resistivity.filter(|_| yields).map(|_| HOLM_RESISTANCE));
    columns
}

/// Returns all columns of the conductance.
pub fn all_columns() -> Vec<Column> {
    let further = [UNLOADING_STIFFNESS, FORCE, HOLM_RESISTANCE];
    [&CONDUCTANCE[..], &further, &THERMAL, &ELECTRICAL].concat()
}

/// Computes the conductance of each contact from its stiffness, beside that of separate spots.
///
/// # Errors
/// Returns an error if a column is missing or a contact map does not fit its mesh.
pub fn conductances(
    solved: &Table,
    grids: Grids,
    boundary: Boundary,
    conduction: Option<Conduction>,
) -> Result<Vec<(Column, ArrayRef)>, StageError> {
    let maps = solved.bytes(CONTACT.name)?;
    // Barber's analogy is one of elastic half-spaces.
    let layers = solved.reals(LAYER_THICKNESS.name).ok();
    let is_half_space = |row: usize| layers.is_none_or(|layers| layers.is_null(row));
    let stiffness = |column: Column| -> Result<Vec<Option<f64>>, StageError> {
        Ok(solved.reals(column.name)?.iter().collect())
    };
    // A current flows through all nodes in contact, also where the material has yielded.
    let yields = solved.has(UNLOADING_STIFFNESS.name);
    let of_all_nodes = if yields { UNLOADING_STIFFNESS } else { FROZEN_STIFFNESS };
    let stiffnesses = stiffness(of_all_nodes)?.into_iter().enumerate();
    let conductance: Vec<Option<f64>> =
        stiffnesses.map(|(row, value)| value.filter(|_| is_half_space(row))).collect();
    let mut prepared: Option<(Grid, SpotConductance)> = None;
    let (mut spots, mut radii, mut greenwood) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..solved.rows() {
        let grid = grids.grid(row)?;
        let map = ContactMap::from_bytes(grid.nodes(), maps.value(row)).map_err(StageError::Map)?;
        let (_, spot_conductance) = match prepared.take().filter(|(of, _)| *of == grid) {
            Some(prepared) => prepared,
            None => (grid, SpotConductance::new(grid, boundary)),
        };
        let (grid, spot_conductance) = prepared.insert((grid, spot_conductance));
        let found = spot_conductance.of_map(&map);
        spots.push(found.count as i64);
        radii.push(found.mean_radius.map(|radius| radius * grid.cell().longer_side()));
        greenwood.push(found.greenwood.filter(|_| is_half_space(row)));
    }
    let mut columns = vec![(FROZEN_STIFFNESS, optional_reals(stiffness(FROZEN_STIFFNESS)?))];
    if yields {
        columns.push((UNLOADING_STIFFNESS, optional_reals(stiffness(UNLOADING_STIFFNESS)?)));
    }
    columns.extend([
        (CONTACT_CONDUCTANCE, optional_reals(conductance.iter().copied())),
        (SPOTS, integers(spots)),
        (MEAN_SPOT_RADIUS, optional_reals(radii)),
        (GREENWOOD_CONDUCTANCE, optional_reals(greenwood.iter().copied())),
    ]);
    if let Some(conduction) = conduction {
        let cell = |row| -> Result<Cell, StageError> { Ok(Cell::new(solved, grids.grid(row)?)) };
        let cells = (0..solved.rows()).map(cell).collect::<Result<Vec<_>, StageError>>()?;
        columns.extend(in_si(solved, &cells, conduction, [&conductance, &greenwood])?);
    }
    Ok(columns)
}

/// Size of a cell in units of the SI.
struct Cell {
    /// Longer side in metres.
    side: f64,
    /// Nominal area in m².
    area: f64,
}

impl Cell {
    /// Returns the cell of a grid. Validation refuses surfaces without a unit of length, whose
    /// conductances would be null here.
    fn new(solved: &Table, grid: Grid) -> Cell {
        let unit = units::length_unit(solved);
        let metres = unit.and_then(|unit| length_ratio(&unit, "m")).unwrap_or(f64::NAN);
        let cell = grid.cell();
        Cell { side: metres * cell.longer_side(), area: metres * metres * cell.area() }
    }
}

/// Returns the forces, and the conductances and resistances in units of the SI. `conductances` are
/// those of the contact and of Greenwood's formula, in units of k_s over the longer side.
fn in_si(
    solved: &Table,
    cells: &[Cell],
    conduction: Conduction,
    [conductance, greenwood]: [&[Option<f64>]; 2],
) -> Result<Vec<(Column, ArrayRef)>, StageError> {
    let repeated = |value: f64| reals(cells.iter().map(|_| value));
    let column = |values: &[Option<f64>], value: &dyn Fn(&Cell, f64) -> f64| {
        let rows = cells.iter().zip(values).map(|(cell, given)| Some(value(cell, (*given)?)));
        // A contact without conductance has no finite resistance.
        optional_reals(rows.map(|value| value.filter(|value| value.is_finite())))
    };
    let mut columns = Vec::new();
    let forces = forces(solved, cells)?;
    if let Some(forces) = &forces {
        columns.push((FORCE, reals(forces.iter().copied())));
    }
    if let Some(k) = conduction.conductivity {
        columns.extend([
            (PAIR_CONDUCTIVITY, repeated(k)),
            (THERMAL_CONDUCTANCE, column(conductance, &|cell, given| given * k / cell.side)),
            (
                THERMAL_RESISTANCE,
                column(conductance, &|cell, given| cell.side / (given * k * cell.area)),
            ),
        ]);
    }
    if let Some(rho) = conduction.resistivity {
        let specific = |cell: &Cell, given: f64| rho * cell.side / given;
        let total = |cell: &Cell, given: f64| specific(cell, given) / cell.area;
        columns.extend([
            (PAIR_RESISTIVITY, repeated(rho)),
            (SPECIFIC_RESISTANCE, column(conductance, &specific)),
            (ELECTRICAL_RESISTANCE, column(conductance, &total)),
            (GREENWOOD_RESISTANCE, column(greenwood, &total)),
        ]);
        if let (Some(forces), Ok(hardness)) = (forces, solved.reals(HARDNESS.name)) {
            let pascals = pascals(solved);
            let holm = forces.iter().zip(hardness).map(|(force, hardness)| {
                Some(rho / 2.0 * (PI * hardness? * pascals / force).sqrt())
            });
            columns.push((HOLM_RESISTANCE, optional_reals(holm)));
        }
    }
    Ok(columns)
}

/// Returns the force on each cell in newtons, if the pressures have a unit.
fn forces(solved: &Table, cells: &[Cell]) -> Result<Option<Vec<f64>>, StageError> {
    if !solved.has(PRESSURE_UNIT.name) {
        return Ok(None);
    }
    let pascals = pascals(solved);
    let pressures = solved.reals(PRESSURE.name)?.values();
    let force = |(cell, pressure): (&Cell, &f64)| pressure * pascals * cell.area;
    Ok(Some(cells.iter().zip(pressures.iter()).map(force).collect()))
}

/// Returns the unit of the pressures of a table in pascals.
fn pascals(solved: &Table) -> f64 {
    let symbol = units::pressure_unit(solved);
    let unit = symbol.as_deref().and_then(Unit::find);
    unit.map_or(f64::NAN, |unit| unit.factor_to(Unit::si(Dimension::Pressure)))
}
