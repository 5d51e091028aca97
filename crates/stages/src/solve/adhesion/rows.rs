//! Rows of the states of a path, and their table.

use arrow::array::ArrayRef;

use crate::columns::*;
use crate::reduced_units::{PressureUnit, Scales};
use crate::solve::Control;
use crate::solve::adhesion::Params;
use crate::solve::parts::counted;
use crate::stage::first_real;
use crate::table_columns::Values::{Count, OptionalReal, Real, Text};
use crate::table_columns::{TableColumns, column, column_if, column_in_role};
use crate::{StageError, nominal_area};
use asperity_mechanics::adhesion::{AdhesiveState, Stop};
use asperity_mechanics::distribution::EqualBins;
use asperity_mechanics::grid::Boundary;
use asperity_tables::column::{Column, Role, bytes, optional_list};
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

/// A solved state with the quantities from which its row is made.
pub struct StateRow<'a> {
    solved: &'a Solved<'a>,
    state: &'a AdhesiveState,
    surface: &'a SurfaceScales,
    mean: MeanState,
    dissipated: Option<f64>,
}

impl StateRow<'_> {
    /// Returns the state, or `None` if the surfaces are apart.
    fn bound(&self) -> Option<&AdhesiveState> {
        self.solved.gap.map(|_| self.state)
    }

    /// Returns a pressure in the unit of the modulus; `None` if the surfaces are apart.
    fn in_unit(&self, reduced: fn(&AdhesiveState) -> f64) -> Option<f64> {
        Some(reduced(self.bound()?) * self.surface.scales.pressure())
    }

    fn pull_off_pressure(&self) -> Option<f64> {
        self.state.pull_off_load.map(|load| load * self.surface.scales.pressure())
    }

    fn fraction(&self, count: usize) -> f64 {
        let [nodes_x, nodes_y] = self.surface.scales.nodes;
        count as f64 / (nodes_x * nodes_y) as f64
    }
}

fn is_free(params: &Params) -> bool {
    params.boundary == Boundary::Free
}

/// Returns the roles of `load`, `pressure` and `mean_gap`. The one that the path prescribes
/// identifies the row.
fn roles(params: &Params) -> [Role; 3] {
    match params.control {
        Control::Load => {
            let [load, pressure] = params.load_unit.roles(Role::Load);
            [load, pressure, Role::Result]
        }
        Control::Gap | Control::Displacement => [Role::Result, Role::Result, Role::Load],
    }
}

/// Returns the light columns of the states of a path, without the coordinates of surfaces and the
/// settings.
pub fn columns<'a>() -> TableColumns<Params, StateRow<'a>> {
    TableColumns::<Params, StateRow>::new([
        column(BRANCH, Text(|row| row.solved.branch)),
        column_in_role(LOAD, |params| Some(roles(params)[0]), Real(|row| row.mean.load)),
        column_in_role(PRESSURE, |params| Some(roles(params)[1]), Real(|row| row.mean.pressure)),
        column_in_role(MEAN_GAP, |params| Some(roles(params)[2]), OptionalReal(|row| row.mean.gap)),
        column_if(|params| params.newtons.is_some(), FORCE, OptionalReal(|row| row.mean.force)),
        column_if(is_free, MEAN_DISPLACEMENT, OptionalReal(|row| row.mean.displacement)),
        column_if(
            |params| is_free(params) && params.control == Control::Gap,
            PRESCRIBED_GAP,
            Real(|row| row.solved.given),
        ),
        column(STEP, Count(|row| row.solved.index + 1)),
        column(TABOR, OptionalReal(|row| row.surface.tabor)),
        column(STICKINESS, OptionalReal(|row| row.surface.stickiness)),
        column(ADHESIVE_CONTACT_NODES, Count(|row| row.state.contact_nodes)),
        column(CONTACT_FRACTION, Real(|row| row.fraction(row.state.contact_nodes))),
        column(REPULSIVE_NODES, Count(|row| row.state.repulsive_nodes)),
        column(REPULSIVE_FRACTION, Real(|row| row.fraction(row.state.repulsive_nodes))),
        column(ATTRACTIVE_PRESSURE, OptionalReal(|row| row.in_unit(|s| s.attractive_pressure))),
        column(REPULSIVE_PRESSURE, OptionalReal(|row| row.in_unit(|s| s.repulsive_pressure))),
        column(PRESSURE_IN_CONTACT, OptionalReal(|row| row.in_unit(|s| s.pressure_in_contact))),
        column(PEAK_PRESSURE, OptionalReal(|row| row.in_unit(|s| s.peak_pressure))),
        column(ELASTIC_ENERGY, OptionalReal(|row| row.mean.elastic)),
        column(ADHESION_ENERGY, OptionalReal(|row| row.mean.adhesion)),
        column(DISSIPATED_ENERGY, OptionalReal(|row| row.dissipated)),
        column(PULL_OFF_LOAD, OptionalReal(|row| row.state.pull_off_load)),
        column(PULL_OFF_PRESSURE, OptionalReal(StateRow::pull_off_pressure)),
        column(PAIRS, Count(|row| row.state.pairs as usize)),
        column(ADHESIVE_RESIDUAL, OptionalReal(|row| row.bound().map(|state| state.residual))),
        column(ADHESIVE_STOP, Text(|row| stop_name(row.state.stop))),
    ])
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
    let unit = of_surface.scales.pressure();
    let mean = MeanState::new(params, &of_surface.scales, &solved);
    let dissipated = mean.dissipated_since(before)?;
    let row =
        StateRow { solved: &solved, state: &solved.state, surface: of_surface, mean, dissipated };
    let mut table: Vec<(Column, ArrayRef)> =
        params.setting().into_iter().map(|(column, value)| (column, value.repeated(1))).collect();
    table.extend(columns().filled(params, &[row]));
    let Solved { contact, repulsive, gap, pressure, .. } = solved;
    table.extend([
        (CONTACT, bytes([contact])),
        (REPULSIVE, bytes([repulsive])),
        (GAPS, optional_list(gap)),
    ]);
    if params.keeps_maps {
        let pressures: Vec<f64> = pressure.iter().map(|pressure| pressure * unit).collect();
        table.push((PRESSURES, optional_list(Some(&pressures))));
    }
    if let Some(bins) = params.pressure_bins {
        let attraction = params.work / params.range / unit;
        let counts = gap.map(|_| pressure_counts(bins, attraction, pressure));
        table.push((PRESSURE_COUNTS, optional_list(counts.as_deref())));
    }
    if let Some(bins) = params.gap_bins {
        let open = |gap: &[f64]| {
            let open = gap.iter().filter(|gap| **gap > 0.0);
            counted(bins, open.map(|gap| gap / of_surface.rms_height))
        };
        table.push((GAP_COUNTS, optional_list(gap.map(open).as_deref())));
    }
    Ok(surface.coordinates().with(table))
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
    /// Force in newtons, if the manifest gives loads as forces.
    force: Option<f64>,
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
    fn new(params: &Params, scales: &Scales, solved: &Solved) -> MeanState {
        let (given, state, is_bound) = (solved.given, &solved.state, solved.gap.is_some());
        let unit = scales.pressure() * scales.length();
        let [load, pressure] = match (params.control, params.load_unit) {
            (Control::Gap | Control::Displacement, _) => {
                [state.mean_pressure, state.mean_pressure * scales.pressure()]
            }
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
            force: params.newtons.map(|newtons| nominal_area::force(pressure, newtons)),
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
        let value = |column: Column| first_real(before, column);
        let (Some(lost), Some(elastic), Some(adhesion), Some(gap_before)) = (
            value(DISSIPATED_ENERGY)?,
            value(ELASTIC_ENERGY)?,
            value(ADHESION_ENERGY)?,
            value(MEAN_GAP)?,
        ) else {
            return Ok(Some(0.0));
        };
        let displacement_before = value(MEAN_DISPLACEMENT)?.unwrap_or(0.0);
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
