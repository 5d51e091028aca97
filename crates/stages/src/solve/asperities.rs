//! Asperity models: Hertzian contacts of the summits in place of the solved contact.

use super::Params;
use super::parallel::LoadTask;
use super::parts::LoadParts;
use super::rows::{self, SolvedLoad, contact_map};
use crate::columns::RMS_SLOPE;
use crate::reduced_units::Scales;
use crate::{Context, Effort, StageError};
use asperity_mechanics::asperities::{Asperities, Interaction};
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::table::Table;

/// Cost per load of an explicit interaction, in pairs of single-precision transforms: 16 to 23 were
/// counted on 256² and 512² nodes.
const EXPLICIT_PAIRS_PER_LOAD: f64 = 24.0;
/// Seconds per node and load for the summits and the contact map.
const SECONDS_PER_NODE: f64 = 1e-8;

/// Returns the memory per node of an asperity model, in bytes.
///
/// The model needs the surface and the pressures. An explicit interaction also needs two maps, the
/// factors of the kernel, and the work space of the transforms.
pub fn bytes_per_node(interaction: Interaction) -> f64 {
    match interaction {
        Interaction::None | Interaction::MeanField => 24.0,
        Interaction::Explicit => 72.0,
    }
}

/// Returns the expected cost of an asperity model under this number of loads.
pub fn effort(interaction: Interaction, loads: usize, [nodes_x, nodes_y]: [usize; 2]) -> Effort {
    let pairs = match interaction {
        Interaction::None | Interaction::MeanField => 0.0,
        Interaction::Explicit => EXPLICIT_PAIRS_PER_LOAD * loads as f64,
    };
    let effort = Effort::pairs(pairs);
    let seconds = SECONDS_PER_NODE * (nodes_x * nodes_y * loads) as f64;
    Effort { seconds: effort.seconds + seconds, ..effort }
}

/// Solves the asperity model of one surface under all loads. `row` is the row of the surface in the
/// table of its stage.
///
/// # Errors
/// Returns an error if the surface has no summit, or on interruption.
pub fn solve(
    params: &Params,
    interaction: Interaction,
    surface: Surface,
    row: &Table,
    context: &Context,
) -> Result<Table, StageError> {
    let grid = surface.grid();
    let rms_slope = row.reals(RMS_SLOPE.name)?.value(0);
    let (heights, scales) = Scales::reduce(surface, rms_slope, params.effective_modulus)?;
    let mut asperities = Asperities::new(&heights, interaction)?;
    let task = LoadTask::new(context, &params.loads, EXPLICIT_PAIRS_PER_LOAD);
    task.run(
        &mut asperities,
        |_| None,
        |asperities, index, watch| {
            if watch.is_interrupted() {
                return Err(StageError::Interrupted);
            }
            let given = params.loads[index];
            let load = scales.reduced_pressure(given, params.load_unit);
            let solved = asperities.press(load, &params.settings());
            let pressures = asperities.pressure();
            let stored = || pressures.iter().map(|p| p * scales.pressure()).collect();
            let pressures_kept = params.keeps_pressures_at(given).then(stored);
            Ok(SolvedLoad {
                given,
                load,
                outcome: solved.outcome,
                contact: contact_map(context.threads, grid.nodes(), pressures),
                displacement: None,
                compression: None,
                asperities: Some(solved),
                parts: LoadParts { pressures: pressures_kept, ..LoadParts::default() },
            })
        },
        |loads| rows::table(params, &scales, None, row, loads),
    )
}
