//! Blocks of loads on one surface, solved at every node or as Hertzian contacts of the summits.

use std::io::{self, Write};

use arrow::array::ArrayRef;

use super::Params;
use super::maps::{Distributions, Flows};
use super::solved::Solved;
use super::units::Scales;
use crate::columns::*;
use crate::{Context, Effort, StageError};
use asperity_contact::asperities::{Asperities, AsperityOutcome, Interaction};
use asperity_contact::grid::Grid;
use asperity_contact::solver::{HalfSpace, Outcome, Solver, Stop, Watch};
use asperity_contact::threads::Threads;
use asperity_contact::topography::surface::Surface;
use asperity_tables::column::{Column, integers, reals};
use asperity_tables::table::Table;

/// Contact of one surface under a block of loads: the solver and the rows of finished loads.
///
/// The solver works with dimensionless numbers: it receives heights in units of side × rms slope
/// and returns pressures in units of E* × rms slope.
pub struct Block {
    params: Params,
    grid: Grid,
    scales: Scales,
    /// Loads in units of E* × rms slope, ascending.
    loads: Vec<f64>,
    solver: Solver,
    rows: Solved,
    /// True if every node is in contact and none yields under the last and all remaining loads.
    stays_in_full_contact: bool,
}

impl Block {
    /// Prepares a block for a surface with this rms slope, and continues from a checkpoint if there
    /// is a valid one.
    ///
    /// # Errors
    /// Returns an error if the heaviest load exceeds the hardness of the material.
    pub fn new(
        params: &Params,
        surface: Surface,
        rms_slope: f64,
        checkpoint: Option<&[u8]>,
        threads: Threads,
    ) -> Result<Block, StageError> {
        let grid = surface.grid();
        let scales = Scales::new(grid, rms_slope, params.effective_modulus);
        let hardness = params.hardness.map(|given| scales.hardness(given));
        let hardness = hardness.transpose()?;
        let body = HalfSpace {
            boundary: params.boundary,
            hardness: hardness.map(|hardness| hardness.reduced),
        };
        let given = params.loads.iter();
        let loads: Vec<f64> =
            given.map(|&given| scales.reduced_pressure(given, params.load_unit)).collect();
        let heaviest = *loads.last().expect("a block has a load");
        body.hardness.map_or(Ok(()), |bound| bound.check_load(heaviest))?;
        let heights = scales.reduced_heights(surface);
        let begin = || {
            let mut solver = body.solver_with_threads(threads.clone(), grid, &heights);
            let under_unit_pressure = solver.displacement_under_unit_pressure();
            let distributions = Distributions::new(params.pressure_bins, params.gap_bins, &heights);
            let flows = params.flow.then(|| Flows::new(grid));
            let rows = Solved::new(hardness, under_unit_pressure, distributions, flows);
            (solver, rows)
        };
        let (mut solver, mut rows) = begin();
        if let Some(checkpoint) = checkpoint
            && rows.restore(&mut solver, checkpoint).is_err()
        {
            (solver, rows) = begin();
        }
        Ok(Block {
            params: params.clone(),
            grid,
            scales,
            loads,
            solver,
            rows,
            stays_in_full_contact: false,
        })
    }

    /// Replaces the threads of the solver.
    pub fn set_threads(&mut self, threads: Threads) {
        self.solver.set_threads(threads);
    }

    /// Returns all loads, in units of E* × rms slope.
    pub fn loads(&self) -> &[f64] {
        &self.loads
    }

    /// Solves the next load of the block. Returns `None` after the last load, or if every node is
    /// in contact and none yields under all remaining loads.
    ///
    /// # Errors
    /// Returns an error on interruption. The load may then be solved again, except after an
    /// interruption during the computation of a flow.
    pub fn press(&mut self, watch: &dyn Watch) -> Result<Option<Outcome>, StageError> {
        let index = self.rows.count();
        if self.stays_in_full_contact || index == self.loads.len() {
            return Ok(None);
        }
        let load = self.loads[index];
        let settings = self.params.settings();
        let outcome = self.solver.press(load, &settings, watch);
        if outcome.stop == Stop::Interrupted {
            return Err(StageError::Interrupted);
        }
        let keep = self.params.keeps_pressures_at(self.params.loads[index]);
        self.rows.evaluate_maps(&mut self.solver, watch)?;
        let (pressure, threads) = (self.solver.pressure(), self.solver.threads());
        self.rows.push(load, outcome, pressure, keep, &self.scales, threads);
        let heaviest = self.loads.last().copied().unwrap_or(load);
        self.stays_in_full_contact =
            outcome.stop == Stop::FullContact && self.solver.reaches_full_contact(heaviest);
        Ok(Some(outcome))
    }

    /// Returns the number of finished loads.
    pub fn count(&self) -> usize {
        self.rows.count()
    }

    /// Returns whether another load remains to be solved.
    pub fn has_next_load(&self) -> bool {
        !self.stays_in_full_contact && self.count() < self.loads.len()
    }

    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Returns the factors between the units of the solver and of the user.
    pub fn scales(&self) -> &Scales {
        &self.scales
    }

    /// Returns the solver in its state after the last load.
    pub fn solver(&mut self) -> &mut Solver {
        &mut self.solver
    }

    /// Returns the contact map of the load with this index, in the format of the column `contact`.
    pub fn contact(&self, load: usize) -> Option<&[u8]> {
        self.rows.contact(load)
    }

    /// Writes a checkpoint of the finished loads.
    pub fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        self.rows.save(&self.solver, out)
    }

    /// Returns the table of the finished loads. The parameters of the surface are taken from the
    /// one-row table `surface`. Stored pressure fields are moved into the table.
    pub fn table(&mut self, surface: &Table) -> Table {
        self.rows.table(&self.params, surface, &self.scales)
    }
}

/// Cost per load of an explicit interaction, in pairs of single-precision transforms.
const EXPLICIT_PAIRS_PER_LOAD: f64 = 24.0;
/// Seconds per node and load for the summits and the contact map.
const SECONDS_PER_NODE: f64 = 1e-8;

/// Returns the memory per node of an asperity model, in bytes.
///
/// The model needs the surface and the pressures. An explicit interaction also needs two maps, the
/// factors of the kernel, and the work space of the transforms.
pub fn asperity_bytes_per_node(interaction: Interaction) -> f64 {
    match interaction {
        Interaction::None | Interaction::MeanField => 24.0,
        Interaction::Explicit => 72.0,
    }
}

/// Returns the expected cost of an asperity model under this number of loads.
pub fn asperity_effort(
    interaction: Interaction,
    loads: usize,
    [nodes_x, nodes_y]: [usize; 2],
) -> Effort {
    let pairs = match interaction {
        Interaction::None | Interaction::MeanField => 0.0,
        Interaction::Explicit => EXPLICIT_PAIRS_PER_LOAD * loads as f64,
    };
    let effort = Effort::pairs(pairs);
    Effort {
        seconds: effort.seconds + SECONDS_PER_NODE * (nodes_x * nodes_y * loads) as f64,
        ..effort
    }
}

/// Solves the asperity model of one surface under all loads.
///
/// # Errors
/// Returns an error if the surface has no summit, or on interruption.
pub fn press_asperities(
    params: &Params,
    interaction: Interaction,
    (surface, table): (Surface, &Table),
    context: &Context,
) -> Result<Table, StageError> {
    let grid = surface.grid();
    let rms_slope = table.reals(RMS_SLOPE.name)?.value(0);
    let scales = Scales::new(grid, rms_slope, params.effective_modulus);
    let loads = params.loads.iter();
    let loads: Vec<f64> =
        loads.map(|&given| scales.reduced_pressure(given, params.load_unit)).collect();
    let mut asperities = Asperities::new(grid, &scales.reduced_heights(surface), interaction)?;
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
    let columns = asperity_columns(&outcomes, &scales);
    Ok(rows.with_columns(columns).table(params, table, &scales))
}

fn asperity_columns(outcomes: &[AsperityOutcome], scales: &Scales) -> Vec<(Column, ArrayRef)> {
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
        (OVERLAPPING_SHARE, real(|one| one.overlapping_fraction, 1.0)),
        (NOMINAL_DISPLACEMENT, real(|one| one.nominal_displacement, scales.length())),
    ]
}
