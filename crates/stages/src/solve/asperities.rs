//! Presses the summits of a surface, load after load.

use arrow::array::ArrayRef;

use super::Params;
use super::solved::{Scales, Solved};
use crate::columns::*;
use crate::{Context, Effort, StageError};
use asperity_contact::asperities::{Asperities, AsperityOutcome, Interaction};
use asperity_contact::topography::surface::Surface;
use asperity_tables::column::{Column, integers, reals};
use asperity_tables::table::Table;

/// Pairs of transforms that an explicit interaction takes for a load, in those of single precision.
const PAIRS_PER_LOAD: f64 = 24.0;
/// Seconds for each node and load, of summits and of the map that is drawn.
const PER_NODE: f64 = 1e-8;

/// Bytes for each node: the surface and its pressures, and of an explicit interaction two maps, the
/// factors of their kernel, and what transforms write on the way.
pub fn bytes_per_node(interaction: Interaction) -> f64 {
    match interaction {
        Interaction::None | Interaction::MeanField => 24.0,
        Interaction::Explicit => 72.0,
    }
}

/// What the loads are expected to cost.
pub fn effort(interaction: Interaction, loads: usize, [nodes_x, nodes_y]: [usize; 2]) -> Effort {
    let pairs = match interaction {
        Interaction::None | Interaction::MeanField => 0.0,
        Interaction::Explicit => PAIRS_PER_LOAD * loads as f64,
    };
    let effort = Effort::pairs(pairs);
    Effort { seconds: effort.seconds + PER_NODE * (nodes_x * nodes_y * loads) as f64, ..effort }
}

/// Presses one surface through all loads.
///
/// # Errors
/// When the surface has no summit, or on interruption.
pub fn run(
    params: &Params,
    interaction: Interaction,
    (surface, table): (Surface, &Table),
    context: &Context,
) -> Result<Table, StageError> {
    let grid = surface.grid();
    let rms_slope = table.reals(RMS_SLOPE.name)?.value(0);
    let scales = Scales::of(grid, rms_slope, params.effective_modulus);
    let loads = params.loads.iter();
    let loads: Vec<f64> =
        loads.map(|&given| scales.reduced_pressure(given, params.load_unit)).collect();
    let mut asperities = Asperities::new(grid, &scales.reduced(surface), interaction)?;
    let mut rows = Solved::default();
    let mut outcomes = Vec::with_capacity(loads.len());
    for (index, (&given, &load)) in params.loads.iter().zip(&loads).enumerate() {
        if (context.interrupted)() {
            return Err(StageError::Interrupted);
        }
        let pressed = asperities.press(load, &params.settings());
        let keep = params.keeps_pressures_at(given);
        rows.push(load, pressed.outcome, asperities.pressure(), keep, &scales, context.threads);
        outcomes.push(pressed);
        (context.advance)((index + 1) as f64 / loads.len() as f64);
    }
    let columns = columns(&outcomes, &scales);
    Ok(rows.with(columns).table(params, table, &scales))
}

fn columns(outcomes: &[AsperityOutcome], scales: &Scales) -> Vec<(Column, ArrayRef)> {
    let whole = |value: fn(&AsperityOutcome) -> usize| {
        integers(outcomes.iter().map(|one| value(one) as i64).collect::<Vec<_>>())
    };
    let real = |value: fn(&AsperityOutcome) -> f64, unit: f64| {
        reals(outcomes.iter().map(|one| value(one) * unit).collect::<Vec<_>>())
    };
    vec![
        (CONTACTS, whole(|one| one.contacts)),
        (OVERLAPPING_CONTACTS, whole(|one| one.overlapping)),
        (ASPERITY_AREA_FRACTION, real(|one| one.area_fraction, 1.0)),
        (OVERLAPPING_SHARE, real(|one| one.overlapping_share, 1.0)),
        (NOMINAL_DISPLACEMENT, real(|one| one.nominal_displacement, scales.length())),
    ]
}
