//! Maps of the loads on a surface, or of the states of a path with adhesion.

use std::sync::atomic::{AtomicBool, Ordering};

use arrow::array::{Array, AsArray};
use arrow::datatypes::Float64Type;

use super::{MapKind, Overlay, PathState, SurfaceTask, factor, scaled};
use crate::session::SessionError;
use asperity_mechanics::grid::Grid;
use asperity_mechanics::morphology::map::ContactMap;
use asperity_mechanics::reduced::Units;
use asperity_mechanics::threads::{Threads, available_cores};
use asperity_stages::columns::{
    BRANCH, CONTACT, EFFECTIVE_MODULUS, GAPS, LOAD, MEAN_DISPLACEMENT, MEAN_GAP, PRESCRIBED_GAP,
    PRESSURES, REPULSIVE, STEP,
};
use asperity_stages::ensemble::{load_column, prescribed_length};
use asperity_stages::grids::Grids;
use asperity_stages::output_units::Conversion;
use asperity_stages::solve::ContactFields;
use asperity_stages::solve::adhesion::{PathFields, StateMaps, displacement};
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::units::{TableUnits, length_unit, pressure_unit};
use asperity_stages::{Kind, StageError};
use asperity_tables::column::Role;
use asperity_tables::store::Store;
use asperity_tables::table::Table;

/// Solved loads of a surface, or states of a path.
pub(crate) struct SolvedTask {
    /// All rows of the task.
    pub(crate) table: Table,
    /// The rows in the units of output.
    pub(crate) shown: Table,
    pub(crate) grid: Grid,
    /// Rows that the study has and that were chosen.
    pub(crate) rows: Vec<usize>,
    fields: Option<Fields>,
    /// Row of the last load or state that was solved, with its maps.
    solved: Option<(usize, StateMaps)>,
}

/// Contact whose maps are computed again.
enum Fields {
    Loads(Box<ContactFields>),
    Path(Box<PathFields>),
}

impl SolvedTask {
    pub(crate) fn new(table: Table) -> Result<SolvedTask, SessionError> {
        let grid = Grids::new(&table)?.grid(0)?;
        let rows = (0..table.rows()).collect();
        let shown = table.clone();
        Ok(SolvedTask { table, shown, grid, rows, fields: None, solved: None })
    }

    /// Shows numbers in these units.
    pub(crate) fn show_in(&mut self, units: &TableUnits) {
        let from = TableUnits::from_table(&self.table);
        let conversion = Conversion { from, to: units.clone() };
        let without_maps = self.table.not_in_role(Role::Heavy);
        self.shown = conversion.stored_table(&without_maps, Kind::Solve);
    }

    /// Returns true for a path with adhesion.
    pub(crate) fn is_path(&self) -> bool {
        self.table.has(STEP.name)
    }

    /// Returns the position of a row along its path, or `None` if the contact is not a path.
    pub(crate) fn path_state(&self, row: usize) -> Result<Option<PathState>, SessionError> {
        if !self.is_path() {
            return Ok(None);
        }
        Ok(Some(PathState {
            branch: self.table.texts(BRANCH.name)?.value(row).to_owned(),
            step: self.table.integers(STEP.name)?.value(row),
        }))
    }

    /// Returns true if the surfaces have pulled off in a row.
    pub(crate) fn is_apart(&self, row: usize) -> Result<bool, SessionError> {
        Ok(self.table.reals(MEAN_GAP.name)?.is_null(row))
    }

    /// Returns the row of the largest load. Of a path, it is the first state with the smallest mean
    /// gap.
    pub(crate) fn heaviest(&self) -> Result<Option<usize>, SessionError> {
        let gaps = self.table.reals(MEAN_GAP.name)?;
        let rows = self.rows.iter().copied();
        let bound = rows.filter(|&row| self.is_path() && gaps.is_valid(row));
        let nearest = bound.min_by(|&one, &other| gaps.value(one).total_cmp(&gaps.value(other)));
        let is_first = load_column(&self.table) == PRESCRIBED_GAP.name;
        let heaviest = if is_first { self.rows.first() } else { self.rows.last() };
        Ok(nearest.or(heaviest.copied()))
    }

    /// Returns the contact maps of all loads, or of the states of the first branch of a path.
    pub(crate) fn overlay(&self) -> Result<Overlay, SessionError> {
        let first = self.rows.first().map(|&row| self.path_state(row)).transpose()?.flatten();
        let mut rows = self.rows.clone();
        let branch = first.map(|state| state.branch);
        if let Some(branch) = &branch {
            let branches = self.table.texts(BRANCH.name)?;
            rows.retain(|&row| branches.value(row) == branch);
            if branch.starts_with("separation") {
                rows.reverse();
            }
        }
        let given = load_column(&self.shown);
        if given == PRESCRIBED_GAP.name {
            rows.reverse();
        }
        let loads = self.shown.reals(given)?;
        let contacts = rows.iter().map(|&row| self.set(MapKind::Contact, row));
        let [stored, shown] = [&self.table, &self.shown].map(length_unit);
        let (name, unit) = match prescribed_length(given) {
            Some(name) => (name, shown.clone()),
            None if given == LOAD.name => ("load", None),
            None => ("mean pressure", pressure_unit(&self.shown)),
        };
        Ok(Overlay {
            grid: scaled(self.grid, factor(stored.as_deref(), shown.as_deref()))?,
            contacts: contacts.collect::<Result<_, _>>()?,
            loads: rows.iter().map(|&row| loads.value(row)).collect(),
            load_name: unit.map_or_else(|| name.to_owned(), |unit| format!("{name} ({unit})")),
            branch,
            length_unit: shown,
        })
    }

    /// Returns the map of the nodes in contact, or of the repulsive nodes.
    pub(crate) fn set(&self, kind: MapKind, row: usize) -> Result<ContactMap, SessionError> {
        let column = if kind == MapKind::Repulsive { REPULSIVE } else { CONTACT };
        let bytes = self.table.bytes(column.name)?.value(row);
        ContactMap::from_bytes(self.grid.nodes(), bytes).map_err(SessionError::Map)
    }

    /// Returns pressures, gaps or displacements in a row.
    pub(crate) fn field(
        &mut self,
        kind: MapKind,
        row: usize,
        surface: &mut SurfaceTask,
        (store, sources): (&Store, &SurfaceFiles),
        stop: &AtomicBool,
    ) -> Result<Vec<f64>, SessionError> {
        let stored = stored_list(&self.table, PRESSURES.name, row);
        if let (MapKind::Pressures, Some(pressures)) = (kind, &stored) {
            return Ok(pressures.clone());
        }
        let drawn = surface.draw(store, sources)?;
        if self.fields.is_none() {
            // Results do not depend on the number of threads.
            let threads = Threads::for_mesh(available_cores(), self.grid.count());
            let (surface, slope) = (drawn.surface.clone(), drawn.rms_slope);
            self.fields = Some(if self.is_path() {
                Fields::Path(Box::new(PathFields::new(&self.table, surface, slope, threads)?))
            } else {
                Fields::Loads(Box::new(ContactFields::new(&self.table, surface, slope, threads)?))
            });
        }
        let known = self.solved.take().filter(|(solved, _)| *solved == row).map(|(_, maps)| maps);
        let is_interrupted = || stop.load(Ordering::Relaxed);
        let loads = self.table.reals(load_column(&self.table))?;
        match self.fields.as_mut().expect("the fields were prepared") {
            Fields::Loads(fields) => {
                let pressures = match (stored, known) {
                    (Some(pressures), _) => pressures,
                    (None, Some(maps)) => maps.pressures,
                    (None, None) => fields.pressures(loads.value(row), &is_interrupted)?,
                };
                let maps = StateMaps { pressures: pressures.clone(), gap: None };
                self.solved = Some((row, maps));
                let field = match kind {
                    MapKind::Gap => {
                        fields.gap(pressures, self.table.reals(MEAN_GAP.name)?.value(row))
                    }
                    MapKind::Displacement => fields.displacement(pressures),
                    _ => Some(pressures),
                };
                field.ok_or_else(|| {
                    SessionError::refused(format!(
                        "an asperity model has no map of the {}; choose contact or pressures",
                        kind.name()
                    ))
                })
            }
            Fields::Path(fields) => {
                let modulus = self.table.reals(EFFECTIVE_MODULUS.name)?.value(row);
                let units = Units::new(self.grid.cell(), drawn.rms_slope, modulus);
                let unit = units.map_err(StageError::from)?.length();
                let stored = stored_list(&self.table, GAPS.name, row);
                let maps = match (stored, known) {
                    (_, Some(maps)) => maps,
                    (Some(gap), None) if kind != MapKind::Pressures => StateMaps {
                        pressures: Vec::new(),
                        gap: Some(gap.iter().map(|gap| gap * unit).collect()),
                    },
                    _ => fields.state(row, &is_interrupted)?,
                };
                let field = match (kind, &maps.gap) {
                    (MapKind::Pressures, _) => maps.pressures.clone(),
                    (MapKind::Gap, Some(gap)) => gap.clone(),
                    (MapKind::Gap, None) => vec![f64::INFINITY; self.grid.count()],
                    (_, Some(gap)) => {
                        let means = self.table.reals(MEAN_DISPLACEMENT.name).ok();
                        let mean = means.map_or(0.0, |means| means.value(row));
                        displacement(gap, drawn.surface.heights(), mean)
                    }
                    (_, None) => vec![0.0; self.grid.count()],
                };
                if !maps.pressures.is_empty() {
                    self.solved = Some((row, maps));
                }
                Ok(field)
            }
        }
    }
}

/// Returns the values of a row in a column of maps if they are stored.
fn stored_list(table: &Table, column: &str, row: usize) -> Option<Vec<f64>> {
    let lists = table.lists(column).ok()?;
    if lists.is_null(row) || lists.value_length(row) == 0 {
        return None;
    }
    let list = lists.value(row);
    let values = list.as_primitive::<Float64Type>().iter();
    Some(values.map(Option::unwrap_or_default).collect())
}
