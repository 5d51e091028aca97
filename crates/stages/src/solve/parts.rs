//! Results of a load that are computed only on request, from its pressures: the parts of its row.
//!
//! Pressures and gaps are counted in bins, and the flow through the gap, the stiffness of the
//! contact and the conductance through a layer are computed. The flow is a key of `solve` and not
//! of `measure`, because the gaps of 56 loads at 512² would take 0.1 GB per surface.
//!
//! A part can be added to a load that is stored with its pressures. To give the same bytes, parts
//! are always computed from the stored form of the pressures, which are in the unit of the moduli,
//! and from the mean gap in the column `mean_gap`.

use std::sync::Arc;

use arrow::array::{ArrayRef, AsArray, Float64Array, Float64Builder, LargeListArray};
use arrow::buffer::NullBuffer;
use arrow::datatypes::Float64Type;

use crate::StageError;
use crate::bodies::LayerConduction;
use crate::columns::*;
use crate::solve::{Params, Pressures, Stiffness};
use crate::unloading::Branch;
use crate::version::Version;
use asperity_mechanics::distribution::EqualBins;
use asperity_mechanics::flow::{BYTES_PER_NODE, Flow, Unconverged};
use asperity_mechanics::solver::Conductor;
use asperity_tables::column::{Column, lists, optional_reals, reals, texts};
use asperity_tables::store::series::{Part, PartRows};
use asperity_tables::table::Table;

/// Parts of the row of a load; parts that are not requested are `None`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LoadParts {
    /// Flows along x and y, in the solver's unit of length.
    pub flow: Option<[Result<Flow, Unconverged>; 2]>,
    /// Pressure of each node in the unit of the moduli, zero outside contact.
    pub pressures: Option<Vec<f64>>,
    /// Number of pressures in each bin, then the number above all bins.
    pub pressure_counts: Option<Vec<f64>>,
    /// Number of gaps in each bin, then the number above all bins.
    pub gap_counts: Option<Vec<f64>>,
    /// Stiffness in units of E* over the longer side; infinite in full contact. `None` also if
    /// `max_pairs` pairs of transforms were not enough.
    pub stiffness: Option<f64>,
    /// Stiffness of unloading, in the same form.
    pub unloading_stiffness: Option<f64>,
    /// Conductance of a contact with a layer, in units of k_s over the longer side, in the same
    /// form.
    pub conductance: Option<f64>,
}

/// Cost of the gap under one load, in pairs of single-precision transforms. The gap takes one pair
/// of double-precision transforms.
const PAIRS_OF_GAP: f64 = 2.5;

/// Cost of computing the flow along both axes under one load, in pairs of transforms. It was
/// measured on 512² and 1024² nodes, from light loads to loads near percolation; a sealed gap takes
/// almost no time.
const PAIRS_OF_FLOW: f64 = 165.0;

/// Cost of a stiffness under one load, in pairs of transforms. Half of its nine pairs are in
/// double precision.
const PAIRS_OF_STIFFNESS: f64 = 18.0;

/// Cost of the conductance of a contact with a layer under one load, in pairs of transforms. Thin
/// layers on a worse conductor take up to 19 pairs, half of them in double precision.
const PAIRS_OF_CONDUCTANCE: f64 = 24.0;

/// Memory for the stiffness under one load, in bytes per node: two maps, and five numbers for each
/// node in contact.
const BYTES_OF_STIFFNESS: f64 = 56.0;

impl Params {
    /// Returns whether a part is computed from the gap under each load.
    pub(super) fn reads_gap(&self) -> bool {
        self.flow || self.gap_bins.is_some()
    }

    /// Returns whether a part is computed from the pressures under each load.
    pub(super) fn reads_pressures(&self) -> bool {
        self.reads_gap() || self.pressure_bins.is_some() || self.freezes_contact()
    }

    /// Returns whether a part is a response of the contact whose nodes in contact stay the same.
    fn freezes_contact(&self) -> bool {
        !self.stiffness.is_none() || self.layer_conduction.is_some()
    }

    /// Returns the memory for computing the parts of one load, in bytes per node.
    pub(super) fn part_bytes_per_node(&self) -> f64 {
        let flow = if self.flow { BYTES_PER_NODE } else { 0.0 };
        let maps = [self.reads_pressures(), self.reads_gap()];
        let stiffness = if self.freezes_contact() { BYTES_OF_STIFFNESS } else { 0.0 };
        let conductance = self.layer_conduction.map_or(0.0, |_| Conductor::BYTES_PER_NODE);
        flow + stiffness
            + conductance
            + maps.map(|is_read| if is_read { 8.0 } else { 0.0 }).iter().sum::<f64>()
    }

    /// Returns the expected pairs of transforms for the parts of one load.
    pub(super) fn pairs_of_parts(&self) -> f64 {
        let gap = if self.reads_gap() { PAIRS_OF_GAP } else { 0.0 };
        let stiffness = match self.stiffness {
            Stiffness::None => 0.0,
            Stiffness::Loading => PAIRS_OF_STIFFNESS,
            Stiffness::LoadingAndUnloading => 2.0 * PAIRS_OF_STIFFNESS,
        };
        let conductance = self.layer_conduction.map_or(0.0, |_| PAIRS_OF_CONDUCTANCE);
        gap + stiffness + conductance + if self.flow { PAIRS_OF_FLOW } else { 0.0 }
    }

    /// Returns the parameters with only those parts that `wanted` accepts.
    pub(super) fn with_parts(&self, wanted: impl Fn(&Part) -> bool) -> Params {
        let keeps_pressures = self.loads.iter().any(|load| self.keeps_pressures_at(*load));
        Params {
            pressures: if keeps_pressures && wanted(&pressures()) {
                self.pressures.clone()
            } else {
                Pressures::None
            },
            flow: self.flow && wanted(&flow()),
            stiffness: match stiffness(self.stiffness) {
                Some(part) if wanted(&part) => self.stiffness,
                _ => Stiffness::None,
            },
            layer_conduction: self.layer_conduction.filter(|of| wanted(&conductance(*of))),
            pressure_bins: self.pressure_bins.filter(|bins| wanted(&pressure_counts(*bins))),
            gap_bins: self.gap_bins.filter(|bins| wanted(&gap_counts(self.branch, *bins))),
            ..self.clone()
        }
    }
}

/// Returns the part with the stored pressures.
pub fn pressures() -> Part {
    Part { name: "pressures".to_owned(), columns: vec![PRESSURES.name], is_heavy: true }
}

/// Version of the numbers of the flow. Only its part and the recipes with a flow contain it.
pub const FLOW_VERSION: Version =
    Version::new(1, &["another solver, whose certified error is at most 1e-6 in place of 1e-8"]);

/// Returns the part with the flow through the gap.
pub fn flow() -> Part {
    Part {
        name: format!("flow_{}", FLOW_VERSION.number()),
        columns: FLOW.map(|column| column.name).to_vec(),
        is_heavy: false,
    }
}

/// Returns the part with the stiffness of the contact, if it is computed. A part with the stiffness
/// of unloading has another name, so that stored parts without it are computed again.
pub fn stiffness(stiffness: Stiffness) -> Option<Part> {
    let (name, columns) = match stiffness {
        Stiffness::None => return None,
        Stiffness::Loading => ("stiffness", vec![FROZEN_STIFFNESS.name]),
        Stiffness::LoadingAndUnloading => {
            ("stiffnesses", vec![FROZEN_STIFFNESS.name, UNLOADING_STIFFNESS.name])
        }
    };
    Some(Part { name: name.to_owned(), columns, is_heavy: false })
}

/// Returns the part with the conductance of a contact with a layer.
pub fn conductance(LayerConduction { to_substrate, to_counter_body }: LayerConduction) -> Part {
    Part {
        name: format!("conductance_{to_substrate}_{to_counter_body}"),
        columns: vec![CONTACT_CONDUCTANCE.name],
        is_heavy: false,
    }
}

/// Returns the part with the counts of pressures in bins.
pub fn pressure_counts(bins: EqualBins) -> Part {
    counts(PRESSURE_COUNTS, bins)
}

/// Returns the part with the counts of gaps in bins. On the branch of unloading, the name of the
/// part has the version of its numbers.
pub fn gap_counts(branch: Option<Branch>, bins: EqualBins) -> Part {
    let mut part = counts(GAP_COUNTS, bins);
    if matches!(branch, Some(Branch::Unloading(_))) {
        part.name.push_str("_v2");
    }
    part
}

fn counts(column: Column, EqualBins { count, to }: EqualBins) -> Part {
    Part {
        name: format!("{}_{count}_{to}", column.name),
        columns: vec![column.name],
        is_heavy: true,
    }
}

/// Returns the requested parts with the loads that have them, in the order of their columns.
pub fn requested(params: &Params) -> Vec<PartRows> {
    let kept: Vec<f64> =
        params.loads.iter().copied().filter(|load| params.keeps_pressures_at(*load)).collect();
    let parts = [
        params.flow.then(flow),
        stiffness(params.stiffness),
        params.layer_conduction.map(conductance),
        (!kept.is_empty()).then(pressures),
        params.pressure_bins.map(pressure_counts),
        params.gap_bins.map(|bins| gap_counts(params.branch, bins)),
    ];
    let rows = |part: Part| {
        let values = if part == pressures() { kept.clone() } else { params.loads.clone() };
        PartRows { part, values }
    };
    parts.into_iter().flatten().map(rows).collect()
}

/// Returns the counts of values in bins, followed by the count above all bins.
pub fn counted(bins: EqualBins, values: impl Iterator<Item = f64>) -> Vec<f64> {
    let counts = bins.counts(values);
    counts.bins.into_iter().chain([counts.beyond]).map(|count| count as f64).collect()
}

/// Returns the columns of the requested parts. `mean_gaps` has the mean gap under each load in the
/// unit of the surface, in which `length` is the solver's unit of length.
pub fn columns(
    params: &Params,
    length: f64,
    mean_gaps: &[f64],
    mut parts: Vec<LoadParts>,
) -> Vec<(Column, ArrayRef)> {
    let mut columns = Vec::new();
    if params.flow {
        columns.extend(flow_columns(length, mean_gaps, &parts));
    }
    let finite = |stiffness: fn(&LoadParts) -> Option<f64>| {
        optional_reals(parts.iter().map(|of| stiffness(of).filter(|value| value.is_finite())))
    };
    if !params.stiffness.is_none() {
        columns.push((FROZEN_STIFFNESS, finite(|of| of.stiffness)));
    }
    if params.stiffness == Stiffness::LoadingAndUnloading {
        columns.push((UNLOADING_STIFFNESS, finite(|of| of.unloading_stiffness)));
    }
    if params.layer_conduction.is_some() {
        columns.push((CONTACT_CONDUCTANCE, finite(|of| of.conductance)));
    }
    if params.pressures != Pressures::None {
        let kept = parts.iter_mut().map(|of| of.pressures.take()).collect();
        columns.push((PRESSURES, pressure_lists(kept)));
    }
    if params.pressure_bins.is_some() {
        columns.push((PRESSURE_COUNTS, count_lists(&parts, |of| of.pressure_counts.as_deref())));
    }
    if params.gap_bins.is_some() {
        columns.push((GAP_COUNTS, count_lists(&parts, |of| of.gap_counts.as_deref())));
    }
    columns
}

/// Returns a list of pressures for each load, with nulls outside contact, or null if no pressures
/// are stored for the load.
fn pressure_lists(kept: Vec<Option<Vec<f64>>>) -> ArrayRef {
    let lengths: Vec<usize> = kept.iter().map(|of| of.as_ref().map_or(0, Vec::len)).collect();
    let is_kept = NullBuffer::from_iter(kept.iter().map(Option::is_some));
    let mut values = Float64Builder::with_capacity(lengths.iter().sum());
    for pressures in kept.into_iter().flatten() {
        for pressure in pressures {
            values.append_option((pressure > 0.0).then_some(pressure));
        }
    }
    let complete = lists(values.finish(), lengths);
    if is_kept.null_count() == 0 {
        return complete;
    }
    let (field, offsets, values, _) = complete.as_list::<i64>().clone().into_parts();
    Arc::new(LargeListArray::new(field, offsets, values, Some(is_kept)))
}

fn count_lists(parts: &[LoadParts], counts: impl Fn(&LoadParts) -> Option<&[f64]>) -> ArrayRef {
    let each = || parts.iter().map(|of| counts(of).unwrap_or_default());
    let values: Vec<f64> = each().flatten().copied().collect();
    lists(Float64Array::from(values), each().map(<[f64]>::len))
}

fn flow_columns(
    length: f64,
    mean_gaps: &[f64],
    parts: &[LoadParts],
) -> impl Iterator<Item = (Column, ArrayRef)> {
    let flows = parts.iter().map(|of| of.flow.as_ref().expect("the flow of each load is computed"));
    let flows: Vec<_> = flows.collect();
    let conductivities = |axis: usize| -> Vec<Option<f64>> {
        let found = flows.iter().map(|flows| flows[axis].ok());
        found.map(|flow| flow.map(|flow| flow.conductivity * length.powi(3))).collect()
    };
    let factors = |conductivities: &[Option<f64>]| {
        let loads = conductivities.iter().zip(mean_gaps);
        // Without a channel, the mean gap may be zero, too.
        let factor = |k: f64, gap: f64| if k > 0.0 { k / gap.powi(3) } else { 0.0 };
        optional_reals(loads.map(|(k, gap)| k.map(|k| factor(k, *gap))))
    };
    let [along_x, along_y] = [0, 1].map(conductivities);
    let columns = [
        factors(&along_x),
        factors(&along_y),
        optional_reals(along_x),
        optional_reals(along_y),
        reals(flows.iter().map(|[x, y]| residual(x).max(residual(y)))),
        texts(flows.iter().map(|flows| stop_name(flows))),
    ];
    FLOW.into_iter().zip(columns)
}

fn residual(flow: &Result<Flow, Unconverged>) -> f64 {
    match flow {
        Ok(flow) => flow.residual,
        Err(unconverged) => unconverged.residual,
    }
}

/// Returns the code of a load in the column `flow_stop`.
fn stop_name(flows: &[Result<Flow, Unconverged>; 2]) -> &'static str {
    let is_closed =
        |flow: &Result<Flow, Unconverged>| flow.is_ok_and(|flow| flow.conductivity == 0.0);
    match flows {
        flows if flows.iter().any(Result::is_err) => "iteration-limit",
        flows if flows.iter().all(is_closed) => "no-channel",
        _ => "converged",
    }
}

/// Row of a load with only its parts.
#[derive(Debug, Clone)]
pub struct AddedParts {
    /// Load in the unit of the manifest.
    pub load: f64,
    /// Stored mean gap.
    pub mean_gap: f64,
    pub parts: LoadParts,
}

/// Stored loads to which parts are added.
pub struct StoredLoads<'a> {
    mean_gaps: &'a Float64Array,
    pressures: &'a LargeListArray,
}

impl StoredLoads<'_> {
    /// Finds the columns from which parts are computed.
    ///
    /// # Errors
    /// Returns an error if the table lacks a column.
    pub fn new(stored: &Table) -> Result<StoredLoads<'_>, StageError> {
        Ok(StoredLoads {
            mean_gaps: stored.reals(MEAN_GAP.name)?,
            pressures: stored.lists(PRESSURES.name)?,
        })
    }

    pub fn mean_gap(&self, row: usize) -> f64 {
        self.mean_gaps.value(row)
    }

    /// Returns the stored pressure of each node, zero outside contact.
    pub fn pressures(&self, row: usize) -> Vec<f64> {
        let pressures = self.pressures.value(row);
        pressures.as_primitive::<Float64Type>().iter().map(Option::unwrap_or_default).collect()
    }
}

/// Returns a table with the column of the load and the columns of the requested parts.
pub fn table(params: &Params, length: f64, rows: Vec<AddedParts>) -> Table {
    let column = (params.load_column(), reals(rows.iter().map(|row| row.load)));
    let mean_gaps: Vec<f64> = rows.iter().map(|row| row.mean_gap).collect();
    let count = rows.len();
    let parts = rows.into_iter().map(|row| row.parts).collect();
    let parts = columns(params, length, &mean_gaps, parts);
    Table::new(count, [column].into_iter().chain(parts).collect())
}

#[cfg(test)]
mod tests {
    use arrow::array::Array;

    use super::*;
    use crate::solve::tests::params;

    #[test]
    fn flows_are_null_without_convergence_and_zero_without_a_channel() {
        let open = Flow { conductivity: 0.5, residual: 1e-9 };
        let closed = Flow { conductivity: 0.0, residual: 0.0 };
        let unconverged = Unconverged { residual: 0.1 };
        let flows = [[Ok(open), Ok(closed)], [Ok(closed); 2], [Err(unconverged); 2]];
        let parts =
            flows.map(|flows| LoadParts { flow: Some(flows), ..LoadParts::default() }).to_vec();
        let params = Params { flow: true, ..params() };
        let columns = columns(&params, 2.0, &[1.0, 0.0, 0.2], parts);
        let table = Table::new(3, columns);
        assert_eq!(table.names(), flow().columns);
        let values = |column: Column| -> Vec<Option<f64>> {
            table.reals(column.name).unwrap().iter().collect()
        };
        assert_eq!(values(FLOW_CONDUCTIVITY_X), [Some(4.0), Some(0.0), None]);
        assert_eq!(values(FLOW_FACTOR_X), [Some(4.0), Some(0.0), None]);
        assert_eq!(values(FLOW_FACTOR_Y), [Some(0.0), Some(0.0), None]);
        assert_eq!(values(FLOW_RESIDUAL), [Some(1e-9), Some(0.0), Some(0.1)]);
        let stops: Vec<_> = table.texts(FLOW_STOP.name).unwrap().iter().flatten().collect();
        assert_eq!(stops, ["converged", "no-channel", "iteration-limit"]);
    }

    #[test]
    fn pressures_are_null_outside_contact_and_for_loads_without_them() {
        let column = pressure_lists(vec![Some(vec![0.0, 2.0]), None]);
        let column = column.as_list::<i64>();
        assert!(column.is_valid(0) && column.is_null(1));
        let first = column.value(0);
        let first: Vec<_> = first.as_primitive::<Float64Type>().iter().collect();
        assert_eq!(first, [None, Some(2.0)]);
    }

    #[test]
    fn names_of_parts_hold_their_bins() {
        let name = pressure_counts(EqualBins { count: 40, to: 2.5 }).name;
        assert_eq!(name, "pressure_counts_40_2.5");
        assert_eq!(gap_counts(None, EqualBins { count: 8, to: 3.0 }).name, "gap_counts_8_3");
    }
}
