//! Solution of the states of a path on one surface.

use arrow::array::{Array, AsArray};
use arrow::datatypes::Float64Type;

use crate::columns::*;
use crate::ensemble::load_column;
use crate::reduced_units::{PressureUnit, Scales};
use crate::solve::adhesion::rows::{self, SurfaceScales};
use crate::solve::adhesion::{Params, VERSION};
use crate::solve::{self, Control, contact, max_pairs};
use crate::{Context, StageError, unloading};
use asperity_mechanics::adhesion::{Adhesion, AdhesivePath, Stop, Target};
use asperity_mechanics::elasticity::{ElasticOperator, FreeHalfSpace, PeriodicHalfSpace};
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::morphology::map::ContactMap;
use asperity_mechanics::solver::Watch;
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::differences;
use asperity_mechanics::topography::moments::Moments;
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::column::{Column, optional_list};
use asperity_tables::table::{Table, TableError};

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
    unloading::numbered(all.map(|approaches| if approaches { "approach" } else { "separation" }))
}

/// Path on one surface that is followed again for the maps of its states.
pub struct PathFields {
    params: Params,
    scales: Scales,
    solver: AdhesivePath,
    /// Number of states that were computed.
    computed: usize,
}

/// Maps of a state, row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct StateMaps {
    /// Pressures in the unit of the moduli, negative where the surfaces attract each other more
    /// than they repel each other.
    pub pressures: Vec<f64>,
    /// Gaps in the unit of the surface, zero in contact; `None` if the surfaces are apart.
    pub gap: Option<Vec<f64>>,
}

impl PathFields {
    /// Prepares a surface with the settings and the states of its solved table. The table has all
    /// states of the path, at least one.
    ///
    /// # Errors
    /// Returns an error if the table lacks columns of a path.
    pub fn new(
        solved: &Table,
        surface: Surface,
        rms_slope: f64,
        threads: Threads,
    ) -> Result<PathFields, StageError> {
        let params = Params::of_solved(solved)?;
        let (solver, scales, _) = prepared(&params, surface, rms_slope, threads)?;
        Ok(PathFields { params, scales, solver, computed: 0 })
    }

    /// Returns the maps of the state with this index along the path. An earlier state than the last
    /// one is reached from the beginning of the path.
    ///
    /// # Errors
    /// Returns an error on interruption. The path then begins again.
    pub fn state(&mut self, index: usize, watch: &dyn Watch) -> Result<StateMaps, StageError> {
        if index + 1 < self.computed {
            self.restart();
        }
        while self.computed <= index {
            let target = target(&self.params, &self.scales, self.params.targets[self.computed]);
            let state = self.solver.step(target, &self.params.settings(), watch);
            if state.stop == Stop::Interrupted {
                self.restart();
                return Err(StageError::Interrupted);
            }
            self.computed += 1;
        }
        let times = |values: &[f64], unit: f64| values.iter().map(|value| value * unit).collect();
        Ok(StateMaps {
            pressures: times(self.solver.pressure(), self.scales.pressure()),
            gap: self.solver.gap().map(|gap| times(gap, self.scales.length())),
        })
    }

    fn restart(&mut self) {
        self.solver.resume(None);
        self.computed = 0;
    }
}

/// Returns the displacements of the elastic body, positive into the body, from the gaps and the
/// heights of a surface. Gap and height determine them up to a constant, which follows from the
/// mean displacement.
pub fn displacement(gap: &[f64], heights: &[f64], mean_displacement: f64) -> Vec<f64> {
    let sum = || gap.iter().zip(heights).map(|(gap, height)| gap + height);
    let shift = mean_displacement - sum().sum::<f64>() / gap.len() as f64;
    sum().map(|sum| sum + shift).collect()
}

impl Params {
    /// Returns the settings and the states with which the rows of a path were solved.
    fn of_solved(table: &Table) -> Result<Params, TableError> {
        let number = |column: Column| table.reals(column.name).map(|values| values.value(0));
        let given = load_column(table);
        // Without contact, a path of an isolated patch has no mean gap.
        let may_miss = table.has(PRESCRIBED_GAP.name);
        let targets = if may_miss { PRESCRIBED_GAP.name } else { given };
        Ok(Params {
            version: VERSION.number(),
            effective_modulus: number(EFFECTIVE_MODULUS)?,
            load_unit: PressureUnit::of_solved(table),
            work: number(WORK_OF_ADHESION)?,
            range: number(INTERACTION_RANGE)?,
            control: if given == MEAN_GAP.name { Control::Gap } else { Control::Load },
            targets: table.reals(targets)?.values().to_vec(),
            tolerance: number(TOLERANCE)?,
            max_pairs: max_pairs(table)?,
            boundary: solve::boundary_of(table),
            ..Params::default()
        })
    }
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

#[cfg(test)]
mod tests_of_fields {
    use super::super::tests::{at_gaps, params, whole};
    use super::*;
    use crate::solve::tests::surface;
    use arrow::array::{Array, AsArray};
    use arrow::datatypes::Float64Type;
    use asperity_mechanics::grid::Boundary;

    fn fields(solved: &Table) -> PathFields {
        PathFields::new(solved, surface(), 0.7, Threads::one()).unwrap()
    }

    fn list(table: &Table, column: &str, row: usize) -> Option<Vec<f64>> {
        let lists = table.lists(column).unwrap();
        let list = lists.is_valid(row).then(|| lists.value(row))?;
        Some(list.as_primitive::<Float64Type>().values().to_vec())
    }

    #[test]
    fn maps_of_a_path_that_is_followed_again_are_the_stored_ones() {
        let absolute = Params { load_unit: PressureUnit::Absolute, ..params() };
        let free = Params { boundary: Boundary::Free, ..at_gaps(&[0.3, 0.2]) };
        for params in [params(), absolute, at_gaps(&[0.3, 0.2, 0.1, 0.2]), free] {
            let table = whole(&Params { keeps_maps: true, ..params.clone() });
            let mut fields = fields(&table);
            let length = fields.scales.length();
            // Backwards, so that every state is reached from the beginning of the path.
            for row in (0..params.targets.len()).rev() {
                let maps = fields.state(row, &|| false).unwrap();
                assert_eq!(Some(maps.pressures), list(&table, PRESSURES.name, row));
                let gap = list(&table, GAPS.name, row);
                let gap = gap.map(|gap| gap.iter().map(|gap| gap * length).collect());
                assert_eq!(maps.gap, gap);
            }
        }
    }

    #[test]
    fn an_interrupted_path_begins_again() {
        let table = whole(&at_gaps(&[0.3, 0.2]));
        let mut fields = fields(&table);
        let first = fields.state(0, &|| false).unwrap();
        assert!(matches!(fields.state(1, &|| true), Err(StageError::Interrupted)));
        assert_eq!(fields.state(0, &|| false).unwrap(), first);
    }

    #[test]
    fn the_gap_is_the_displacement_minus_the_height_plus_a_constant() {
        let found = displacement(&[0.0, 0.1, 0.2], &[0.3, 0.2, 0.1], 0.5);
        assert!(found.iter().all(|displacement| (displacement - 0.5).abs() < 1e-15));
        let found = displacement(&[0.0, 0.4], &[0.0, 0.0], 0.0);
        assert!((found[0] + 0.2).abs() < 1e-15 && (found[1] - 0.2).abs() < 1e-15);
    }
}
