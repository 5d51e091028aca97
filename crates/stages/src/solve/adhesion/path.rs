//! Solution of the states of a path on one surface.

use arrow::array::{Array, AsArray};
use arrow::datatypes::Float64Type;

use super::Params;
use super::keys::Control;
use super::rows::{self, SurfaceScales};
use crate::columns::*;
use crate::solve::units::Scales;
use crate::{Context, StageError};
use asperity_contact::adhesion::{Adhesion, AdhesivePath, Stop, Target};
use asperity_contact::elasticity::{FreeHalfSpace, PeriodicHalfSpace};
use asperity_contact::grid::Boundary;
use asperity_contact::morphology::map::ContactMap;
use asperity_contact::topography::moments::Moments;
use asperity_contact::topography::surface::Surface;
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
    let mut path = Path::new(params, surface, row, context)?;
    let mut rows = match context.stored {
        Some(stored) => path.resumed(stored)?,
        None => Vec::new(),
    };
    let states = params.targets.len();
    while rows.len() < states {
        match path.step(rows.len(), rows.last()) {
            Ok(next) => rows.push(next),
            Err(error) => {
                if matches!(error, StageError::Interrupted) && !rows.is_empty() {
                    path.keep(&rows)?;
                }
                return Err(error);
            }
        }
        (context.advance)(rows.len() as f64 / states as f64);
        if rows.len() < states && context.finished.are_due() {
            path.keep(&rows)?;
        }
    }
    path.table(&rows)
}

/// A path on one surface.
struct Path<'a> {
    params: &'a Params,
    context: &'a Context<'a>,
    /// Row of the surface in the table of its stage.
    surface: &'a Table,
    scales: SurfaceScales,
    solver: AdhesivePath,
    /// Branch of each state.
    branches: Vec<String>,
}

impl<'a> Path<'a> {
    fn new(
        params: &'a Params,
        surface: Surface,
        row: &'a Table,
        context: &'a Context<'a>,
    ) -> Result<Path<'a>, StageError> {
        let grid = surface.grid();
        let rms_slope = row.reals(RMS_SLOPE.name)?.value(0);
        let scales = Scales::new(grid, rms_slope, params.effective_modulus);
        let (length, pressure) = (scales.length(), scales.pressure());
        let adhesion = Adhesion::new(params.work / (pressure * length), params.range / length)?;
        let curvature = Moments::from_surface(&surface).fourth().sqrt();
        let heights = scales.reduced_heights(surface);
        let threads = context.threads.clone();
        Ok(Path {
            params,
            context,
            surface: row,
            scales: SurfaceScales { scales, curvature },
            solver: match params.boundary {
                Boundary::Periodic => {
                    AdhesivePath::new(threads, &PeriodicHalfSpace::new(grid), adhesion, &heights)
                }
                Boundary::Free => {
                    AdhesivePath::new(threads, &FreeHalfSpace::new(grid), adhesion, &heights)
                }
            },
            branches: branches(params.control, &params.targets),
        })
    }

    /// Takes over the stored rows with which the path begins, and the state of the last of them.
    fn resumed(&mut self, stored: &Table) -> Result<Vec<Table>, StageError> {
        let last = stored.rows() - 1;
        let gaps = stored.lists(GAPS.name)?;
        let gap = gaps.is_valid(last).then(|| gaps.value(last));
        self.solver.resume(gap.map(|gap| gap.as_primitive::<Float64Type>().values().to_vec()));
        Ok((0..=last).map(|row| stored.slice(row..row + 1)).collect())
    }

    /// Solves the state with this index. Returns its row, given the row of the state before it.
    fn step(&mut self, index: usize, before: Option<&Table>) -> Result<Table, StageError> {
        let Params { control, load_unit, .. } = *self.params;
        let given = self.params.targets[index];
        let target = match control {
            Control::Gap => Target::MeanGap(given / self.scales.scales.length()),
            Control::Load => Target::Load(self.scales.scales.reduced_pressure(given, load_unit)),
        };
        let watch = || (self.context.interrupted)();
        let state = self.solver.step(target, &self.params.settings(), &watch);
        if state.stop == Stop::Interrupted {
            return Err(StageError::Interrupted);
        }
        let [nodes_x, nodes_y] = self.scales.scales.nodes;
        let map = |values: &[f64]| {
            let nodes = [nodes_x, nodes_y];
            ContactMap::from_pressures_on(self.context.threads, nodes, values).to_bytes()
        };
        let gap = self.solver.gap();
        let touches: Vec<f64> = match gap {
            Some(gap) => gap.iter().map(|gap| f64::from(u8::from(*gap == 0.0))).collect(),
            None => vec![0.0; nodes_x * nodes_y],
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
        rows::row(self.params, &self.scales, self.surface, solved, before)
    }

    /// Stores the finished rows, so that the path can be resumed after the last of them.
    fn keep(&self, rows: &[Table]) -> Result<(), StageError> {
        let finished = &self.params.targets[..rows.len()];
        self.context.finished.keep(finished, &self.table(rows)?).map_err(StageError::Store)
    }

    /// Returns the table of the finished states. Unless all maps are stored, only the last row
    /// keeps its gaps.
    fn table(&self, rows: &[Table]) -> Result<Table, StageError> {
        rows::table(rows, self.params.keeps_maps)
    }
}

/// Returns the branch of each state of a path. The first state belongs to the approach.
fn branches(control: Control, targets: &[f64]) -> Vec<String> {
    let mut turns = [0_usize; 2];
    let mut direction = None;
    let mut before = None;
    let mut names = Vec::with_capacity(targets.len());
    for &target in targets {
        let grows = before.is_none_or(|before| target > before);
        let is_first = before.is_none();
        let approaches = is_first || (grows == (control == Control::Load));
        if direction != Some(approaches) {
            direction = Some(approaches);
            turns[usize::from(approaches)] += 1;
        }
        let word = if approaches { "approach" } else { "separation" };
        names.push(match turns[usize::from(approaches)] {
            1 => word.to_owned(),
            turn => format!("{word}-{turn}"),
        });
        before = Some(target);
    }
    names
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
