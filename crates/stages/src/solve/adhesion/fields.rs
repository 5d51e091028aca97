//! Pressures, gaps and displacements of every node, computed again by following the path.
//!
//! Tables contain the nodes in contact of every state, and other maps only on request. A state
//! depends on the states before it, so the path is followed from its beginning. The maps are the
//! same as those of the run, bit for bit.

use super::path::{prepared, target};
use super::{Params, VERSION};
use crate::columns::*;
use crate::ensemble::load_column;
use crate::reduced_units::{PressureUnit, Scales};
use crate::solve::control::Control;
use crate::{StageError, solve};
use asperity_mechanics::adhesion::{AdhesivePath, Stop};
use asperity_mechanics::solver::Watch;
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::table::{Table, TableError};

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
        let number = |column: &str| table.reals(column).map(|values| values.value(0));
        let given = load_column(table);
        let may_miss = table.has(PRESCRIBED_GAP.name);
        let targets = if may_miss { PRESCRIBED_GAP.name } else { given };
        Ok(Params {
            version: VERSION.number(),
            effective_modulus: number(EFFECTIVE_MODULUS.name)?,
            load_unit: if given == PRESSURE.name {
                PressureUnit::Absolute
            } else {
                PressureUnit::Relative
            },
            pressure_unit: None,
            newtons: None,
            work: number(WORK_OF_ADHESION.name)?,
            range: number(INTERACTION_RANGE.name)?,
            control: if given == MEAN_GAP.name { Control::Gap } else { Control::Load },
            targets: table.reals(targets)?.values().to_vec(),
            tolerance: number(TOLERANCE.name)?,
            max_pairs: u32::try_from(table.integers(MAX_PAIRS.name)?.value(0)).unwrap_or(u32::MAX),
            keeps_maps: false,
            pressure_bins: None,
            gap_bins: None,
            boundary: solve::boundary_of(table),
            shift: None,
            loads_lack_unit: false,
        })
    }
}

#[cfg(test)]
mod tests {
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
