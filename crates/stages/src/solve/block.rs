//! A block of loads on one surface: solved for at every node, or as Hertz' contacts of its summits.

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

/// One surface, the solver that presses it, and the rows of the loads that it was pressed by.
///
/// The problem is linear and homogeneous, so the solver knows neither lengths nor moduli: heights
/// go in in units of side × rms slope, pressures come out in units of E* × rms slope.
pub struct Block {
    params: Params,
    grid: Grid,
    scales: Scales,
    /// In units of E* × rms slope, ascending.
    loads: Vec<f64>,
    solver: Solver,
    rows: Solved,
    /// Whether every node touches and none yields under the last load and all that are to come.
    is_flattened: bool,
}

impl Block {
    /// Prepares a surface of this rms slope, for these threads to work on; the block goes on from what
    /// was kept of it, if anything was.
    ///
    /// # Errors
    /// When the material does not bear the heaviest load.
    pub fn new(
        params: &Params,
        surface: Surface,
        rms_slope: f64,
        kept: Option<&[u8]>,
        threads: Threads,
    ) -> Result<Block, StageError> {
        let grid = surface.grid();
        let scales = Scales::of(grid, rms_slope, params.effective_modulus);
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
        body.hardness.map_or(Ok(()), |bound| bound.bear(heaviest))?;
        let heights = scales.reduced(surface);
        let begin = || {
            let mut solver = body.solver_on(threads.clone(), grid, &heights);
            let under_unit_pressure = solver.under_unit_pressure();
            let distributions = Distributions::new(params.pressure_bins, params.gap_bins, &heights);
            let flows = params.flow.then(|| Flows::on(grid));
            let rows = Solved::of(hardness, under_unit_pressure, distributions, flows);
            (solver, rows)
        };
        let (mut solver, mut rows) = begin();
        if let Some(kept) = kept
            && rows.restore(&mut solver, kept).is_err()
        {
            (solver, rows) = begin();
        }
        Ok(Block { params: params.clone(), grid, scales, loads, solver, rows, is_flattened: false })
    }

    /// Shares the work among these threads from now on.
    pub fn work_on(&mut self, threads: Threads) {
        self.solver.work_on(threads);
    }

    /// All its loads, in units of E* × rms slope.
    pub fn loads(&self) -> &[f64] {
        &self.loads
    }

    /// Presses by the next load. `None` after the last one, and after the first from which on every
    /// node touches and none yields.
    ///
    /// # Errors
    /// When it is told to stop; the load may be pressed again then, unless a flow was being found.
    pub fn press(&mut self, watch: &dyn Watch) -> Result<Option<Outcome>, StageError> {
        let index = self.rows.count();
        if self.is_flattened || index == self.loads.len() {
            return Ok(None);
        }
        let load = self.loads[index];
        let settings = self.params.settings();
        let outcome = self.solver.press(load, &settings, watch);
        if outcome.stop == Stop::Interrupted {
            return Err(StageError::Interrupted);
        }
        let keep = self.params.keeps_pressures_at(self.params.loads[index]);
        self.rows.look_at_maps(&mut self.solver, watch)?;
        let (pressure, threads) = (self.solver.pressure(), self.solver.threads());
        self.rows.push(load, outcome, pressure, keep, &self.scales, threads);
        let heaviest = self.loads.last().copied().unwrap_or(load);
        self.is_flattened =
            outcome.stop == Stop::FullContact && self.solver.is_flattened_by(heaviest);
        Ok(Some(outcome))
    }

    /// How many loads are done.
    pub fn count(&self) -> usize {
        self.rows.count()
    }

    /// Whether loads are left to press by.
    pub fn goes_on(&self) -> bool {
        !self.is_flattened && self.count() < self.loads.len()
    }

    /// Where its nodes lie.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// What turns the solver's units into the user's.
    pub fn scales(&self) -> &Scales {
        &self.scales
    }

    /// The solver, as the last load has left it.
    pub fn solver(&mut self) -> &mut Solver {
        &mut self.solver
    }

    /// Which nodes a load has brought into contact, by its number from 0 on.
    pub fn contact(&self, load: usize) -> Option<&[u8]> {
        self.rows.contact(load)
    }

    /// Writes how far it has come.
    pub fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        self.rows.save(&self.solver, out)
    }

    /// The rows so far, beside the coordinates of the surface in its row; pressure fields that were
    /// kept go into it and are kept no longer.
    pub fn table(&mut self, surface: &Table) -> Table {
        self.rows.table(&self.params, surface, &self.scales)
    }
}

/// Pairs of transforms that an explicit interaction takes for a load, in those of single precision.
const PAIRS_PER_LOAD: f64 = 24.0;
/// Seconds for each node and load, of summits and of the map that is drawn.
const PER_NODE: f64 = 1e-8;

/// Bytes for each node: the surface and its pressures, and of an explicit interaction two maps, the
/// factors of their kernel, and what transforms write on the way.
pub fn asperity_bytes_per_node(interaction: Interaction) -> f64 {
    match interaction {
        Interaction::None | Interaction::MeanField => 24.0,
        Interaction::Explicit => 72.0,
    }
}

/// What the loads are expected to cost.
pub fn asperity_effort(
    interaction: Interaction,
    loads: usize,
    [nodes_x, nodes_y]: [usize; 2],
) -> Effort {
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
pub fn press_asperities(
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
    let columns = asperity_columns(&outcomes, &scales);
    Ok(rows.with(columns).table(params, table, &scales))
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
        (OVERLAPPING_SHARE, real(|one| one.overlapping_share, 1.0)),
        (NOMINAL_DISPLACEMENT, real(|one| one.nominal_displacement, scales.length())),
    ]
}
