//! Solution of the states of a path on one surface.

use arrow::array::{Array, AsArray};
use arrow::datatypes::Float64Type;

use super::Params;
use super::rows::{self, SurfaceScales};
use crate::columns::*;
use crate::reduced_units::Scales;
use crate::solve::contact;
use crate::solve::control::Control;
use crate::{Context, StageError, branch_names};
use asperity_mechanics::adhesion::{Adhesion, AdhesivePath, Stop, Target};
use asperity_mechanics::elasticity::{ElasticOperator, FreeHalfSpace, PeriodicHalfSpace};
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::morphology::map::ContactMap;
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::differences;
use asperity_mechanics::topography::moments::Moments;
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::column::optional_list;
use asperity_tables::table::Table;

/// Solves the states of a path, or the states beyond those that are stored. `row` is the row of the
/// surface in the table of its stage.
///
/// # Errors
/// Returns an error on interruption, after the finished states were stored.
pub fn solve(
    params: &Params,
    surface: Surface,
    row: &Table,
    context: &Context,
) -> Result<Table, StageError> {
    let mut path = ContactPath::new(params, surface, row, context.threads.clone())?;
    if let Some(stored) = context.stored {
        path.resume(stored)?;
    }
    let keep = |path: &ContactPath| {
        let finished = &params.targets[..path.count()];
        context.finished.keep(finished, &path.table()?).map_err(StageError::Store)
    };
    let states = params.targets.len();
    while path.count() < states {
        if let Err(error) = path.step(context.interrupted) {
            if matches!(error, StageError::Interrupted) && path.count() > 0 {
                keep(&path)?;
            }
            return Err(error);
        }
        (context.advance)(path.count() as f64 / states as f64);
        if path.count() < states && context.finished.are_due() {
            keep(&path)?;
        }
    }
    path.table()
}

/// A path on one surface, whose states are solved one after the other.
pub struct ContactPath {
    params: Params,
    /// Coordinates of the surface, a table of one row.
    surface: Table,
    scales: SurfaceScales,
    solver: AdhesivePath,
    threads: Threads,
    /// Branch of each state.
    branches: Vec<String>,
    /// Rows of the solved states. The last row has its gaps. The rows before it have them only if
    /// the maps of all states are stored.
    rows: Vec<Table>,
}

impl ContactPath {
    /// Prepares a path on a surface. `row` is the row of the surface in the table of its stage.
    ///
    /// # Errors
    /// Returns an error if the adhesion is beyond the range of numbers of the solver.
    pub fn new(
        params: &Params,
        surface: Surface,
        row: &Table,
        threads: Threads,
    ) -> Result<ContactPath, StageError> {
        let rms_slope = row.reals(RMS_SLOPE.name)?.value(0);
        // The edges of an isolated patch do not match.
        let moments = match params.boundary {
            Boundary::Periodic => Moments::from_surface(&surface),
            Boundary::Free => differences::moments(&surface),
        };
        let half_laplacian = 0.5 * (moments.m40 + 2.0 * moments.m22 + moments.m04).sqrt();
        let (solver, scales, rms_height) = prepared(params, surface, rms_slope, threads.clone())?;
        Ok(ContactPath {
            surface: row.coordinates(),
            scales: SurfaceScales {
                scales,
                tabor: params.tabor(moments.fourth().sqrt()),
                stickiness: params.stickiness(rms_slope, half_laplacian),
                rms_height,
            },
            solver,
            threads,
            branches: branches(params.control, &params.targets),
            rows: Vec::with_capacity(params.targets.len()),
            params: params.clone(),
        })
    }

    /// Sets the threads that share the work. The rows do not depend on their number.
    pub fn set_threads(&mut self, threads: Threads) {
        self.solver.set_threads(threads.clone());
        self.threads = threads;
    }

    /// Returns the number of solved states.
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// Returns the table of the solved states.
    ///
    /// # Errors
    /// Returns an error if the rows differ in their columns, which is a bug.
    pub fn table(&self) -> Result<Table, StageError> {
        Ok(Table::stack(&self.rows)?)
    }

    /// Returns the row of a solved state.
    pub fn row(&self, state: usize) -> Option<&Table> {
        self.rows.get(state)
    }

    /// Returns the pressures of the last solved state, in the unit of the modulus.
    pub fn pressure(&self) -> Vec<f64> {
        let unit = self.scales.scales.pressure();
        self.solver.pressure().iter().map(|pressure| pressure * unit).collect()
    }

    /// Returns the gaps of the last solved state in the unit of the surface, or `None` if the
    /// surfaces are apart.
    pub fn gap(&self) -> Option<Vec<f64>> {
        let unit = self.scales.scales.length();
        Some(self.solver.gap()?.iter().map(|gap| gap * unit).collect())
    }

    /// Takes over the stored rows with which the path begins, and the state of the last of them.
    fn resume(&mut self, stored: &Table) -> Result<(), StageError> {
        self.rows = (0..stored.rows()).map(|row| stored.slice(row..row + 1)).collect();
        self.return_to_last_state()
    }

    /// Sets the solver to the state of the last row, or to surfaces that are apart.
    fn return_to_last_state(&mut self) -> Result<(), StageError> {
        let gap = match self.rows.last() {
            Some(row) => {
                let gaps = row.lists(GAPS.name)?;
                gaps.is_valid(0).then(|| gaps.value(0))
            }
            None => None,
        };
        self.solver.resume(gap.map(|gap| gap.as_primitive::<Float64Type>().values().to_vec()));
        Ok(())
    }

    /// Solves the next state. Returns false if the path has no further state.
    ///
    /// # Errors
    /// Returns an error if `interrupted` returned true. The call can then be repeated.
    pub fn step(&mut self, interrupted: &dyn Fn() -> bool) -> Result<bool, StageError> {
        let index = self.rows.len();
        let Some(&given) = self.params.targets.get(index) else { return Ok(false) };
        let target = target(&self.params, &self.scales.scales, given);
        let state = self.solver.step(target, &self.params.settings(), &interrupted);
        if state.stop == Stop::Interrupted {
            self.return_to_last_state()?;
            return Err(StageError::Interrupted);
        }
        let nodes = self.scales.scales.nodes;
        let map =
            |values: &[f64]| ContactMap::from_pressures_on(&self.threads, nodes, values).to_bytes();
        let gap = self.solver.gap();
        let touches: Vec<f64> = match gap {
            Some(gap) => gap.iter().map(|gap| f64::from(u8::from(*gap == 0.0))).collect(),
            None => vec![0.0; nodes[0] * nodes[1]],
        };
        let solved = rows::Solved {
            index,
            given,
            branch: &self.branches[index],
            state,
            contact: map(&touches),
            repulsive: map(self.solver.pressure()),
            gap,
            pressure: self.solver.pressure(),
        };
        let row = rows::row(&self.params, &self.scales, &self.surface, solved, self.rows.last())?;
        if let Some(last) = self.rows.last_mut().filter(|_| !self.params.keeps_maps) {
            *last = last.replacing(GAPS.name, optional_list(None));
        }
        self.rows.push(row);
        Ok(true)
    }
}

/// Returns the solver of a path on a surface, with the bodies apart, the units of the solver, and
/// the rms height in these units, which is 1 if no gaps are counted.
pub fn prepared(
    params: &Params,
    surface: Surface,
    rms_slope: f64,
    threads: Threads,
) -> Result<(AdhesivePath, Scales, f64), StageError> {
    let grid = surface.grid();
    let (heights, scales) = Scales::reduce(surface, rms_slope, params.effective_modulus)?;
    let (length, pressure) = (scales.length(), scales.pressure());
    let adhesion = Adhesion::new(params.work / (pressure * length), params.range / length)?;
    let body: &dyn ElasticOperator = match params.boundary {
        Boundary::Periodic => &PeriodicHalfSpace::new(grid),
        Boundary::Free => &FreeHalfSpace::new(grid),
    };
    let rms_height = params.gap_bins.map_or(1.0, |_| contact::rms(heights.as_slice()));
    Ok((AdhesivePath::new(threads, body, adhesion, &heights), scales, rms_height))
}

/// Converts a load or a mean gap of the manifest to the units of the solver.
pub fn target(params: &Params, scales: &Scales, given: f64) -> Target {
    match params.control {
        Control::Gap => Target::MeanGap(given / scales.length()),
        Control::Load => Target::Load(scales.reduced_pressure(given, params.load_unit)),
        Control::Displacement => unreachable!("a path with adhesion prescribes loads or gaps"),
    }
}

/// Returns the branch of each state of a path. The first state belongs to the approach.
fn branches(control: Control, targets: &[f64]) -> Vec<String> {
    let approaches = |pair: &[f64]| (pair[1] > pair[0]) == (control == Control::Load);
    let later = targets.windows(2).map(approaches);
    let all = std::iter::once(true).chain(later);
    branch_names::numbered(all.map(|approaches| if approaches { "approach" } else { "separation" }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_change_where_the_path_turns() {
        let loads = branches(Control::Load, &[0.0, 0.1, 0.2, 0.1, -0.1, 0.1]);
        let expected =
            ["approach", "approach", "approach", "separation", "separation", "approach-2"];
        assert_eq!(loads, expected);
        let gaps = branches(Control::Gap, &[0.3, 0.2, 0.3]);
        assert_eq!(gaps, ["approach", "approach", "separation"]);
    }
}
