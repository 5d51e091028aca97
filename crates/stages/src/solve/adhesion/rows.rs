//! Rows of the states of a path, and their table.

use arrow::array::ArrayRef;

use super::{Params, state_columns};
use crate::StageError;
use crate::columns::*;
use crate::reduced_units::{PressureUnit, Scales};
use crate::solve::adhesion::control::Control;
use crate::solve::parts::counted;
use asperity_contact::adhesion::{AdhesiveState, Stop};
use asperity_contact::distribution::EqualBins;
use asperity_contact::grid::Boundary;
use asperity_tables::column::{
    Column, bytes, integers, optional_list, optional_reals, reals, texts,
};
use asperity_tables::table::Table;

/// Units of the solver for one surface, and numbers that describe its roughness.
pub struct SurfaceScales {
    pub scales: Scales,
    /// Tabor parameter and stickiness; `None` for a flat surface.
    pub tabor: Option<f64>,
    pub stickiness: Option<f64>,
    /// Root mean square height in the unit of the solver, if gaps are counted.
    pub rms_height: f64,
}

/// A solved state with its maps.
pub struct Solved<'a> {
    /// Index of the state along the path.
    pub index: usize,
    /// Load or mean gap in the unit of the manifest.
    pub given: f64,
    pub branch: &'a str,
    pub state: AdhesiveState,
    /// Maps of the nodes in contact and with positive pressure, in the format of `contact`.
    pub contact: Vec<u8>,
    pub repulsive: Vec<u8>,
    /// Gaps in the unit of the solver; `None` if the surfaces are apart.
    pub gap: Option<&'a [f64]>,
    /// Pressures in the unit of the solver.
    pub pressure: &'a [f64],
}

/// Returns the row of a state. `surface` is the row of the surface in the table of its stage, and
/// `before` the row of the state before it.
pub fn row(
    params: &Params,
    of_surface: &SurfaceScales,
    surface: &Table,
    solved: Solved,
    before: Option<&Table>,
) -> Result<Table, StageError> {
    let Solved { index, given, branch, state, contact, repulsive, gap, pressure } = solved;
    let scales = &of_surface.scales;
    let unit = scales.pressure();
    let nodes = (scales.nodes[0] * scales.nodes[1]) as f64;
    let is_bound = gap.is_some();
    let known = |value: f64| optional_reals([is_bound.then_some(value)]);
    let mean = MeanState::new(params, scales, given, &state, is_bound);
    let dissipated = mean.dissipated_since(before)?;
    let mut columns: Vec<(Column, ArrayRef)> =
        params.setting().into_iter().map(|(column, value)| (column, value.repeated(1))).collect();
    columns.push((BRANCH, texts([branch])));
    let [load, absolute, mean_gap] = state_columns(params.control, params.load_unit);
    columns.extend([
        (load, reals([mean.load])),
        (absolute, reals([mean.pressure])),
        (mean_gap, optional_reals([mean.gap])),
    ]);
    if let Some(displacement) = mean.displacement {
        columns.push((MEAN_DISPLACEMENT, reals([displacement])));
        if params.control == Control::Gap {
            columns.push((PRESCRIBED_GAP, reals([given])));
        }
    }
    columns.extend([
        (STEP, integers([index as i64 + 1])),
        (TABOR, optional_reals([of_surface.tabor])),
        (STICKINESS, optional_reals([of_surface.stickiness])),
        (ADHESIVE_CONTACT_NODES, integers([state.contact_nodes as i64])),
        (CONTACT_FRACTION, reals([state.contact_nodes as f64 / nodes])),
        (REPULSIVE_NODES, integers([state.repulsive_nodes as i64])),
        (REPULSIVE_FRACTION, reals([state.repulsive_nodes as f64 / nodes])),
        (ATTRACTIVE_PRESSURE, known(state.attractive_pressure * unit)),
        (REPULSIVE_PRESSURE, known(state.repulsive_pressure * unit)),
        (PRESSURE_IN_CONTACT, known(state.pressure_in_contact * unit)),
        (PEAK_PRESSURE, known(state.peak_pressure * unit)),
        (ELASTIC_ENERGY, optional_reals([mean.elastic])),
        (ADHESION_ENERGY, optional_reals([mean.adhesion])),
        (DISSIPATED_ENERGY, optional_reals([dissipated])),
        (PULL_OFF_LOAD, optional_reals([state.pull_off_load])),
        (PAIRS, integers([i64::from(state.pairs)])),
        (ADHESIVE_RESIDUAL, known(state.residual)),
        (ADHESIVE_STOP, texts([stop_name(state.stop)])),
        (CONTACT, bytes([contact])),
        (REPULSIVE, bytes([repulsive])),
        (GAPS, optional_list(gap)),
    ]);
    if params.keeps_maps {
        let pressures: Vec<f64> = pressure.iter().map(|pressure| pressure * unit).collect();
        columns.push((PRESSURES, optional_list(Some(&pressures))));
    }
    if let Some(bins) = params.pressure_bins {
        let attraction = params.work / params.range / unit;
        let counts = gap.map(|_| pressure_counts(bins, attraction, pressure));
        columns.push((PRESSURE_COUNTS, optional_list(counts.as_deref())));
    }
    if let Some(bins) = params.gap_bins {
        let open = |gap: &[f64]| {
            let open = gap.iter().filter(|gap| **gap > 0.0);
            counted(bins, open.map(|gap| gap / of_surface.rms_height))
        };
        columns.push((GAP_COUNTS, optional_list(gap.map(open).as_deref())));
    }
    Ok(surface.coordinates().with(columns))
}

/// Maximum number of bins of negative pressures. The lowest of them also counts all lower
/// pressures.
const MAX_BINS_BELOW: f64 = 10_000.0;

/// Counts pressures in bins of equal width, from the bin that holds the largest attraction to the
/// bins above zero, followed by the count above all bins.
///
/// Negative pressures are counted by their size, so that a pressure just below zero is never
/// rounded into the bin above zero. Most nodes far from contact have such pressures.
fn pressure_counts(bins: EqualBins, attraction: f64, pressures: &[f64]) -> Vec<f64> {
    // The pressure of the strongest attraction lies in the lowest bin in spite of rounding.
    let below = (attraction / bins.width() - 1e-9).ceil().clamp(1.0, MAX_BINS_BELOW);
    let mirrored = EqualBins { count: below as u32, to: below * bins.width() };
    let tensions = pressures.iter().filter(|pressure| **pressure < 0.0);
    let tensions = mirrored.counts(tensions.map(|pressure| -pressure));
    let mut negative: Vec<f64> = tensions.bins.iter().rev().map(|count| *count as f64).collect();
    negative[0] += tensions.beyond as f64;
    let positive = pressures.iter().copied().filter(|pressure| *pressure >= 0.0);
    negative.extend(counted(bins, positive));
    negative
}

/// Mean quantities of a state in the units of the manifest.
struct MeanState {
    load: f64,
    pressure: f64,
    /// Mean gap and energies; `None` if the surfaces are apart.
    gap: Option<f64>,
    elastic: Option<f64>,
    adhesion: Option<f64>,
    /// Mean displacement of the elastic body; `None` if the boundary is periodic, where it is zero.
    displacement: Option<f64>,
}

impl MeanState {
    /// Converts a state. The prescribed quantity keeps the value of the manifest exactly, except
    /// for the mean gap of an isolated patch that is not reached.
    fn new(
        params: &Params,
        scales: &Scales,
        given: f64,
        state: &AdhesiveState,
        is_bound: bool,
    ) -> MeanState {
        let unit = scales.pressure() * scales.length();
        let [load, pressure] = match (params.control, params.load_unit) {
            (Control::Gap, _) => [state.mean_pressure, state.mean_pressure * scales.pressure()],
            (Control::Load, PressureUnit::Relative) => [given, scales.mean_pressure(given)],
            (Control::Load, PressureUnit::Absolute) => {
                [scales.reduced_pressure(given, params.load_unit), given]
            }
        };
        let found = state.mean_gap * scales.length();
        let is_given = params.control == Control::Gap
            && (params.boundary.is_periodic() || state.stop == Stop::Converged);
        let gap = is_bound.then_some(if is_given { given } else { found });
        let known = |energy: f64| is_bound.then_some(energy * unit);
        MeanState {
            load,
            pressure,
            gap,
            elastic: known(state.elastic_energy),
            adhesion: known(state.adhesion_energy),
            displacement: (params.boundary == Boundary::Free)
                .then(|| state.mean_displacement * scales.length()),
        }
    }

    /// Returns the energy that was lost along the path up to this state: what was lost before, plus
    /// the work of the mean pressure since then, by the trapezoidal rule, minus the change of
    /// energy. Zero where a path begins; `None` if the surfaces are apart.
    fn dissipated_since(&self, before: Option<&Table>) -> Result<Option<f64>, StageError> {
        let (Some(gap), Some(energy)) = (self.gap, self.energy()) else {
            return Ok(None);
        };
        let Some(before) = before else {
            return Ok(Some(0.0));
        };
        let value = |column: Column| -> Result<Option<f64>, StageError> {
            Ok(before.reals(column.name)?.iter().next().flatten())
        };
        let (Some(lost), Some(elastic), Some(adhesion), Some(gap_before)) = (
            value(DISSIPATED_ENERGY)?,
            value(ELASTIC_ENERGY)?,
            value(ADHESION_ENERGY)?,
            value(MEAN_GAP)?,
        ) else {
            return Ok(Some(0.0));
        };
        let displacement_before = value(MEAN_DISPLACEMENT).ok().flatten().unwrap_or(0.0);
        let displacement = self.displacement.unwrap_or(0.0) - displacement_before;
        let pressure_before = before.reals(PRESSURE.name)?.value(0);
        let approach = displacement - (gap - gap_before);
        let work = 0.5 * (self.pressure + pressure_before) * approach;
        Ok(Some(lost + work - (energy - elastic - adhesion)))
    }

    fn energy(&self) -> Option<f64> {
        Some(self.elastic? + self.adhesion?)
    }
}

/// Returns the code of a state in the column `stop`.
fn stop_name(stop: Stop) -> &'static str {
    match stop {
        Stop::Converged => "converged",
        Stop::PulledOff => super::PULLED_OFF,
        Stop::PairLimit => crate::solve::PAIR_LIMIT,
        Stop::Stalled => super::STALLED,
        Stop::GapNotReached => super::GAP_NOT_REACHED,
        Stop::Interrupted => "interrupted",
    }
}
