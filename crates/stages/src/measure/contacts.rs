//! Measures of the contact map of each load: areas, edges, clusters, percolation, and the stiffness
//! of the interface.
//!
//! The incremental stiffness is K = dp₀/dδ, where δ is the approach of the bodies. δ is
//! interpolated by a parabola in ln p₀ through a load and its two neighbours. K = p₀/(dδ/d ln p₀)
//! is then exact for p₀ ∝ exp(δ/u₀) (Persson, *Phys. Rev. Lett.* 99, 2007, 125502), and its error
//! grows with the square of the distance of the loads. A load has no stiffness if a neighbour is
//! missing, did not converge, or differs by more than a tenth of the load.

use arrow::array::{Array, ArrayRef};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::bodies::Conduction;
use crate::columns::*;
use crate::grids::{self, Grids};
use crate::measure::conduction;
use crate::table_columns::Values::{Count, Flag, OptionalReal, Real, Text};
use crate::table_columns::{TableColumns, column, column_if};
use crate::version::Version;
use crate::{Context, Input, StageError, solve};
use asperity_mechanics::grid::Grid;
use asperity_mechanics::morphology::area::ContactArea;
use asperity_mechanics::morphology::clusters::Clusters;
use asperity_mechanics::morphology::map::ContactMap;
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::column::{Column, Role, optional_reals};
use asperity_tables::table::Table;

/// Maximum relative distance of a neighbouring load, with a margin for the rounding of loads.
const MAX_LOAD_STEP: f64 = 0.1 + 1e-9;

/// Columns that are copied from the solved loads if they exist, in addition to the columns of the
/// flow.
const COPIED: [Column; 8] = [
    SATURATED_NODES,
    SATURATED_FRACTION,
    MEAN_GAP,
    UNIFORM_COMPRESSION,
    APPROACH,
    MEAN_YIELDED_DEPTH,
    ENERGY,
    STOP,
];

/// Version of the measures of contacts with adhesion.
pub const ADHESION_VERSION: Version = Version::new(
    1,
    &["paths of mean gaps have loads; `stiffness_finite_difference` is null where a path turns"],
);

/// Columns that are copied from the states of a path with adhesion, in addition.
const COPIED_WITH_ADHESION: [Column; 9] = [
    STEP,
    REPULSIVE_FRACTION,
    ATTRACTIVE_PRESSURE,
    ELASTIC_ENERGY,
    ADHESION_ENERGY,
    DISSIPATED_ENERGY,
    PULL_OFF_LOAD,
    PULL_OFF_PRESSURE,
    TABOR,
];

/// Nodes whose area, edges and clusters are measured.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum NodeSet {
    /// Nodes in contact.
    #[default]
    Contact,
    /// Nodes with positive pressure, for contacts with adhesion, where a node in contact may be
    /// pulled.
    Repulsive,
}

impl NodeSet {
    /// Returns true for nodes in contact.
    pub fn is_contact(&self) -> bool {
        *self == NodeSet::Contact
    }

    fn name(self) -> &'static str {
        match self {
            NodeSet::Contact => "contact",
            NodeSet::Repulsive => "repulsive",
        }
    }

    fn column(self) -> Column {
        match self {
            NodeSet::Contact => CONTACT,
            NodeSet::Repulsive => REPULSIVE,
        }
    }

    /// Returns the column with the pressures of the nodes, as a mean over the nominal area. Without
    /// adhesion this is the load: all other nodes have no pressure.
    fn pressure(self, attracts: bool) -> Column {
        match self {
            _ if !attracts => PRESSURE,
            NodeSet::Contact => PRESSURE_IN_CONTACT,
            NodeSet::Repulsive => REPULSIVE_PRESSURE,
        }
    }
}

/// Settings that decide which columns are computed from contact maps.
struct Settings {
    attracts: bool,
    /// True if the stiffness is computed as a finite difference.
    stiffness: bool,
    rectangles: bool,
}

/// Returns the columns that are computed from contact maps.
fn columns() -> TableColumns<Settings, Contact> {
    TableColumns::<Settings, Contact>::new([
        column_if(|settings| settings.attracts, NODE_SET, Text(|one| one.set.name())),
        column(AREA_FRACTION, Real(|one| one.area.fraction())),
        column(CONTACT_NODES, Count(|one| one.area.contact_nodes)),
        column(SWITCHES_ALONG_ROWS, Count(|one| one.area.switches_along_rows)),
        column(SWITCHES_ALONG_COLUMNS, Count(|one| one.area.switches_along_columns)),
        column_if(|of| of.rectangles, SWITCHES_X, Count(|one| one.area.switches_along_columns)),
        column_if(|of| of.rectangles, SWITCHES_Y, Count(|one| one.area.switches_along_rows)),
        column(SWITCHES, Count(|one| one.area.switches())),
        column(PERIMETER_MANHATTAN, Real(|one| one.area.manhattan_perimeter(one.grid))),
        column(PERIMETER_EUCLIDEAN, Real(|one| one.area.euclidean_perimeter(one.grid))),
        column(EDGE_NODES_4, Count(|one| one.area.edge_nodes_4)),
        column(EDGE_NODES_8, Count(|one| one.area.edge_nodes_8)),
        column(INTERIOR_NODES, Count(|one| one.area.interior_nodes)),
        column(CLUSTERS, Count(|one| one.contact.count)),
        column(LARGEST_CLUSTER, Count(|one| one.contact.largest)),
        column(PERCOLATES_X, Flag(|one| one.contact.around_x)),
        column(PERCOLATES_Y, Flag(|one| one.contact.around_y)),
        column(GAP_PERCOLATES_X, Flag(|one| one.gap.around_x)),
        column(GAP_PERCOLATES_Y, Flag(|one| one.gap.around_y)),
        column(MEAN_CONTACT_PRESSURE, OptionalReal(Contact::mean_pressure)),
        column(SECANT, OptionalReal(Contact::secant)),
        column_if(|settings| settings.stiffness, STIFFNESS, OptionalReal(|one| one.stiffness)),
    ])
}

/// Returns the columns of all measured contacts, without parameter columns.
pub fn all_columns() -> Vec<Column> {
    let of_paths = [LOAD, PRESSURE].map(|column| column.with_role(Role::Result));
    let copied = [&COPIED[..], &COPIED_WITH_ADHESION, &[ADHESIVE_STOP], &of_paths, &FLOW].concat();
    let filled = [FILLED_AREA_SHARE];
    [&columns().all()[..], &copied, &conduction::columns().all(), &filled].concat()
}

/// Recipe of the measures of contact maps.
#[derive(Debug, Default, Clone, PartialEq, Serialize)]
pub struct ContactMeasures {
    /// True if the stiffness of the interface is measured, too. Omitted from the recipe if
    /// false, so that existing keys stay valid.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub stiffness: bool,
    /// Nodes that are measured. Omitted from the recipe for nodes in contact, so that existing
    /// keys stay valid.
    #[serde(skip_serializing_if = "NodeSet::is_contact")]
    pub set: NodeSet,
    /// Conductivities of the bodies. Omitted from the recipe if the manifest gives none, so
    /// that existing keys stay valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conduction: Option<Conduction>,
    /// Version of the formula of separate spots. Omitted from the recipe unless a stage has
    /// periodic contacts with a stiffness, so that existing keys stay valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spots_version: Option<u32>,
    /// Version of the measures of contacts with adhesion. Omitted from the recipe without
    /// adhesion, so that existing keys stay valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adhesion_version: Option<u32>,
    /// True if a surface of the stage has filled nodes, whose share of the contact area is then
    /// measured, too. Omitted from the recipe if false, so that existing keys stay valid.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub filled: bool,
}

impl ContactMeasures {
    /// Measures the contacts of solved loads.
    pub fn measure(&self, input: &Input, context: &Context) -> Result<Table, StageError> {
        let measured = measure(&input.table, self, self.set)?;
        if !self.filled {
            return Ok(measured);
        }
        let surface = input.surface.expect("the plan measures one surface at a time");
        let nodes = surface.filled_nodes(context.sources)?;
        Ok(measured.with(vec![filled_area_share(&input.table, self.set, nodes.as_ref())?]))
    }
}

/// Measures the maps of the nodes in `set`, and optionally the stiffness as a finite difference.
/// `conduction` are the conductivities of the bodies, if they are known. A table without rows may
/// lack the maps.
///
/// # Errors
/// Returns an error if a column is missing or a contact map does not fit its mesh.
pub fn measure(
    solved: &Table,
    measures: &ContactMeasures,
    set: NodeSet,
) -> Result<Table, StageError> {
    let &ContactMeasures { stiffness, conduction, .. } = measures;
    let grids = Grids::new(solved)?;
    let boundary = solve::boundary_of(solved);
    let attracts = solved.has(WORK_OF_ADHESION.name);
    let pressures = solved.reals(set.pressure(attracts).name)?;
    let loads = solved.reals(LOAD.name)?;
    let maps = grids.maps(solved, set.column())?;
    let stiffnesses =
        if stiffness { stiffnesses(solved, grids)? } else { vec![None; solved.rows()] };
    let contact = |(row, map): (usize, ContactMap)| {
        let map = map.with_boundary(boundary);
        Ok(Contact {
            grid: grids.grid(row)?,
            area: ContactArea::from_map(&map),
            contact: Clusters::of_contact(&map),
            gap: Clusters::of_gap(&map),
            set,
            attracts,
            load: loads.value(row),
            pressure: pressures.value(row),
            stiffness: stiffnesses[row],
        })
    };
    let measured = maps.into_iter().enumerate().map(contact);
    let measured = measured.collect::<Result<Vec<_>, StageError>>()?;
    let settings = Settings { attracts, stiffness, rectangles: grids::has_rectangles(solved) };
    let computed = columns().filled(&settings, &measured);
    let coordinates = solved.coordinates();
    let copied = [&[LOAD, PRESSURE], &COPIED[..], &COPIED_WITH_ADHESION].concat();
    let [copied, flows] = [&copied[..], &FLOW].map(|columns| {
        let own = columns.iter().filter(|column| !coordinates.has(column.name));
        let names: Vec<&str> = own.map(|column| column.name).collect();
        solved.only(&names)
    });
    let measured = coordinates.with(computed).beside(&copied).beside(&flows);
    if !solved.has(FROZEN_STIFFNESS.name) {
        return Ok(measured);
    }
    Ok(measured.with(conduction::conductances(solved, grids, boundary, conduction)?))
}

/// Returns the share of the contact area on filled nodes under each load. `filled` has positive
/// numbers at these nodes; it is `None` if the surface has no such nodes.
///
/// # Errors
/// Returns an error if a column is missing or a contact map does not fit its mesh.
fn filled_area_share(
    solved: &Table,
    set: NodeSet,
    filled: Option<&Surface>,
) -> Result<(Column, ArrayRef), StageError> {
    let Some(filled) = filled else {
        return Ok((FILLED_AREA_SHARE, optional_reals(vec![None; solved.rows()])));
    };
    let grid = filled.grid();
    let share = |map: ContactMap| {
        let is_filled = |node: &usize| filled.heights()[*node] > 0.0;
        let is_in_contact = |node: &usize| {
            let [i, j] = grid.indices(*node);
            map.get(i, j)
        };
        let both = (0..grid.count()).filter(is_filled).filter(is_in_contact).count();
        let nodes = map.count();
        (nodes > 0).then(|| both as f64 / nodes as f64)
    };
    let shares = Grids::new(solved)?.maps(solved, set.column())?.into_iter().map(share);
    Ok((FILLED_AREA_SHARE, optional_reals(shares)))
}

/// Computes the stiffness at each load of a block, in units of E* over the longer side.
///
/// The approach of the bodies is the mean displacement of the elastic surface (only for a free
/// boundary) plus the mean yielded depth minus the mean gap.
fn stiffnesses(solved: &Table, grids: Grids) -> Result<Vec<Option<f64>>, StageError> {
    let pressures = solved.reals(PRESSURE.name)?;
    let gaps = solved.reals(MEAN_GAP.name)?;
    let moduli = solved.reals(EFFECTIVE_MODULUS.name)?;
    let stops = solved.texts(STOP.name)?;
    let [displacements, depths] =
        [MEAN_DISPLACEMENT, MEAN_YIELDED_DEPTH].map(|column| solved.reals(column.name).ok());
    let approach = |row| Approach {
        pressure: pressures.value(row),
        approach: [displacements, depths]
            .into_iter()
            .flatten()
            .filter(|depths| depths.is_valid(row))
            .fold(-gaps.value(row), |sum, depths| sum + depths.value(row)),
        is_solved: !solve::is_unconverged(stops.value(row)),
    };
    let loads: Vec<_> = (0..solved.rows()).map(approach).collect();
    let found = stiffness_of_block(&loads).into_iter().enumerate();
    found
        .map(|(row, stiffness)| {
            let side = grids.grid(row)?.cell().longer_side();
            Ok(stiffness.map(|stiffness| stiffness * side / moduli.value(row)))
        })
        .collect()
}

/// Measures of one contact map.
struct Contact {
    grid: Grid,
    area: ContactArea,
    contact: Clusters,
    gap: Clusters,
    set: NodeSet,
    attracts: bool,
    load: f64,
    /// Pressure of the nodes in `set`, as a mean over the nominal area.
    pressure: f64,
    stiffness: Option<f64>,
}

impl Contact {
    fn mean_pressure(&self) -> Option<f64> {
        (self.area.contact_nodes > 0).then(|| self.pressure / self.area.fraction())
    }

    fn secant(&self) -> Option<f64> {
        (self.load > 0.0 && !self.attracts).then(|| self.area.fraction() / self.load)
    }
}

/// Mean pressure and approach of the bodies under one load of a block.
#[derive(Debug, Clone, Copy)]
struct Approach {
    pressure: f64,
    /// Approach δ of the bodies, measured from an arbitrary fixed reference.
    approach: f64,
    /// False if the solution of the load did not converge.
    is_solved: bool,
}

/// Computes the stiffness at each load of a block, in units of pressure over length. Where the
/// loads turn, it is `None`.
fn stiffness_of_block(loads: &[Approach]) -> Vec<Option<f64>> {
    let load = |row: Option<usize>| loads.get(row?).copied();
    let stiffness =
        |row: usize| at_middle([load(row.checked_sub(1))?, loads[row], load(Some(row + 1))?]);
    (0..loads.len()).map(stiffness).collect()
}

fn at_middle(three: [Approach; 3]) -> Option<f64> {
    let [before, here, after] = three;
    let is_far =
        |load: &Approach| (load.pressure - here.pressure).abs() > MAX_LOAD_STEP * here.pressure;
    if three.iter().any(|load| !load.is_solved || is_far(load)) {
        return None;
    }
    let run = |to: Approach, from: Approach| libm::log(to.pressure / from.pressure);
    let slope = |to: Approach, from: Approach| (to.approach - from.approach) / run(to, from);
    let (left, right) = (run(here, before), run(after, here));
    // A path with adhesion may turn here.
    if left * right <= 0.0 {
        return None;
    }
    let slope = (right * slope(here, before) + left * slope(after, here)) / (left + right);
    // In full contact of a periodic body the approach stops growing.
    (slope > 0.0).then(|| here.pressure / slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_tables::column::{bytes, integers, reals, texts};

    #[test]
    fn the_mean_contact_pressure_is_null_without_contact() {
        let map = |pressures: [f64; 4]| ContactMap::from_pressures([2, 2], &pressures).to_bytes();
        let maps = [map([0.0; 4]), map([0.0, 3.0, 0.0, 5.0])];
        let ones = || reals([1.0; 2]);
        let columns = vec![
            (NODES, integers([2; 2])),
            (SIDE, ones()),
            (LOAD, ones()),
            (PRESSURE, reals([2.0; 2])),
            (MEAN_GAP, ones()),
            (ENERGY, ones()),
            (STOP, texts(["converged"; 2])),
            (CONTACT, bytes(&maps)),
        ];
        let measures = ContactMeasures::default();
        let measured = measure(&Table::new(2, columns), &measures, measures.set).unwrap();
        let means = measured.reals(MEAN_CONTACT_PRESSURE.name).unwrap();
        assert!(means.is_null(0), "not infinite");
        assert_eq!(means.value(1), 4.0);
    }

    fn block(pressures: &[f64], approach: impl Fn(f64) -> f64) -> Vec<Approach> {
        let load =
            |&pressure: &f64| Approach { pressure, approach: approach(pressure), is_solved: true };
        pressures.iter().map(load).collect()
    }

    #[test]
    fn the_stiffness_of_an_exponential_is_proportional_to_the_pressure() {
        let pressures = [0.01, 0.0105, 0.0115, 0.012, 0.013];
        let found = stiffness_of_block(&block(&pressures, |pressure| 0.4 * pressure.ln()));
        assert_eq!((found[0], found[4]), (None, None));
        for (found, pressure) in found[1..4].iter().zip(&pressures[1..]) {
            assert!((found.unwrap() - pressure / 0.4).abs() < 1e-12 * pressure);
        }
    }

    #[test]
    fn the_error_for_a_power_law_is_of_second_order_in_the_step() {
        // Hertz: p ∝ d^(3/2), so that K = 3/2 p/d.
        let error = |ratio: f64| {
            let pressures = [1.0 / ratio, 1.0, ratio];
            let found = stiffness_of_block(&block(&pressures, |pressure| pressure.powf(2.0 / 3.0)));
            (found[1].unwrap() - 1.5).abs()
        };
        assert!((error(1.1) / error(1.05) - 4.0).abs() < 0.5);
    }

    #[test]
    fn a_path_has_no_stiffness_where_it_turns_and_one_stiffness_on_both_branches() {
        let pressures = [0.95, 1.0, 1.05, 1.0, 0.95];
        let found = stiffness_of_block(&block(&pressures, |pressure| 0.4 * pressure.ln()));
        assert_eq!(found[2], None);
        for found in [found[1], found[3]] {
            assert!((found.unwrap() - 2.5).abs() < 1e-12);
        }
    }

    #[test]
    fn loads_with_neighbours_farther_than_a_tenth_have_no_stiffness() {
        let found =
            |pressures: [f64; 3]| stiffness_of_block(&block(&pressures, |pressure| pressure))[1];
        for near in [[0.9, 1.0, 1.1], [0.009, 0.01, 0.011], [45.0, 50.0, 55.0]] {
            assert!((found(near).unwrap() - 1.0).abs() < 0.01, "{near:?}");
        }
        for far in [[0.89, 1.0, 1.1], [0.9, 1.0, 1.11], [0.5, 1.0, 2.0]] {
            assert_eq!(found(far), None);
        }
    }

    #[test]
    fn loads_that_did_not_converge_and_their_neighbours_have_no_stiffness() {
        let mut loads = block(&[1.0, 1.05, 1.1, 1.15, 1.2], |pressure| pressure);
        loads[1].is_solved = false;
        let found = stiffness_of_block(&loads);
        assert_eq!(found.iter().filter(|value| value.is_some()).count(), 1);
        assert!(found[3].is_some());
    }

    #[test]
    fn full_contact_and_few_loads_have_no_stiffness() {
        let flat = stiffness_of_block(&block(&[1.0, 1.05, 1.1], |_| 0.0));
        assert_eq!(flat, [None; 3]);
        for count in 0..3 {
            let loads = block(&[1.0, 1.05][..count.min(2)], |pressure| pressure);
            assert_eq!(stiffness_of_block(&loads), vec![None; count.min(2)]);
        }
    }
}
