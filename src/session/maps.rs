//! Maps of one task: heights of a surface, and contact, pressures, gaps and displacements under a
//! load or in a state of a path.
//!
//! Heights and pressures that are not stored, gaps and displacements are computed when they are
//! read. The results are the same as those of a run: loads do not depend on each other, and a path
//! with adhesion is followed from its beginning.

mod solved;

use std::sync::atomic::AtomicBool;

use clap::ValueEnum;
use serde::Serialize;

use self::solved::SolvedTask;
use super::task_choice::{ChosenLoad, ChosenRows, Coordinate, chosen_task, only_state, rows_under};
use super::{DataFolder, Observer, Session, SessionError, name_lookup, open_read_only};
use asperity_manifest::decimal;
use asperity_manifest::keys::quantity::Unit;
use asperity_mechanics::grid::Grid;
use asperity_mechanics::morphology::map::ContactMap;
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::surface::Surface;
use asperity_stages::columns::{EFFECTIVE_MODULUS, LOAD, RMS_SLOPE};
use asperity_stages::ensemble::{load_column, prescribed_length};
use asperity_stages::surface_files::{SurfaceFileError, SurfaceFiles};
use asperity_stages::units::{TableUnits, length_unit, pressure_unit};
use asperity_stages::{Kind, StageError, grids, surface};
use asperity_tables::column::Value;
use asperity_tables::key::TaskKey;
use asperity_tables::store::Store;
use asperity_tables::store::provenance::Provenance;

/// Quantity that a map shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum MapKind {
    /// Heights of the surface, positive towards the elastic body.
    #[value(alias = "height")]
    Heights,
    /// Nodes in contact.
    Contact,
    /// Nodes with positive pressure, only for contacts with adhesion. The other nodes in contact
    /// are pulled.
    Repulsive,
    /// Contact pressures, zero outside contact. With adhesion, they are negative where the surfaces
    /// attract each other.
    #[value(alias = "pressure")]
    Pressures,
    /// Gaps between the surfaces, zero in elastic contact and negative where the material yields.
    #[value(alias = "gaps")]
    Gap,
    /// Displacements of the elastic body, positive into the body.
    #[value(alias = "displacements")]
    Displacement,
}

impl MapKind {
    /// Returns true for maps of nodes that belong to a set or not.
    pub fn is_set(self) -> bool {
        matches!(self, MapKind::Contact | MapKind::Repulsive)
    }

    /// Returns the name in options and file names.
    pub(crate) fn name(self) -> &'static str {
        match self {
            MapKind::Heights => "heights",
            MapKind::Contact => "contact",
            MapKind::Repulsive => "repulsive",
            MapKind::Pressures => "pressures",
            MapKind::Gap => "gap",
            MapKind::Displacement => "displacement",
        }
    }
}

/// One value for each node of a mesh.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Map {
    pub kind: MapKind,
    /// Values, row-major: node (i, j) at x = iΔx and y = jΔy is element i·N_y + j. In a map of a
    /// set, such as the nodes in contact, nodes of the set have the value 1, and the others 0. Gaps
    /// are infinite if the surfaces have pulled off.
    pub values: Vec<f64>,
    pub grid: Grid,
    /// Unit of the sides, or `None` if the study gives none.
    pub length_unit: Option<String>,
    /// Unit of the values, or `None` if it is unknown or the values are numbers.
    pub unit: Option<String>,
    /// Load or mean gap in the unit of the study, or `None` for heights.
    pub load: Option<f64>,
    /// Branch and number of the state along its path, or `None` if the contact is not a path.
    pub state: Option<PathState>,
    /// Unit of pressures, if it is known.
    pub pressure_unit: Option<String>,
    /// Effective modulus E* in the unit of pressures, or `None` for heights.
    pub effective_modulus: Option<f64>,
    /// Column of the load: `load` for reduced loads, `pressure` for loads in the unit of the
    /// moduli, and `mean_gap`, `prescribed_gap` or `prescribed_displacement` for prescribed
    /// lengths.
    pub load_column: Option<&'static str>,
    /// Unit of the load, or `None` if it is unknown.
    pub load_unit: Option<String>,
}

/// Position of a state along a path.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct PathState {
    /// Direction of the path at the state: `approach`, `separation`, `approach-2`.
    pub branch: String,
    /// Number of the state along the path, from 1.
    pub step: i64,
}

impl Session<'_> {
    /// Returns a map of the only task of `stage` that matches all `coordinates`, under the load
    /// `load`, or under the largest load.
    ///
    /// # Errors
    /// Returns an error if not exactly one task or state of a path matches, if the task has no such
    /// map, or on interruption by `stop`.
    pub fn map(
        &self,
        stage: &str,
        coordinates: &[Coordinate],
        kind: MapKind,
        load: Option<ChosenLoad>,
        stop: &AtomicBool,
    ) -> Result<Map, SessionError> {
        self.maps(stage, coordinates, load)?.map(kind, load, stop)
    }

    /// Returns the surface of the only task of `stage` that matches all `coordinates`.
    ///
    /// # Errors
    /// Returns an error if not exactly one task matches, or if a surface file is missing.
    pub fn surface(
        &self,
        stage: &str,
        coordinates: &[Coordinate],
    ) -> Result<DrawnSurface, SessionError> {
        self.maps(stage, coordinates, None)?.into_surface()
    }

    /// Opens the maps of the only task of `stage` that matches all `coordinates`. A load
    /// restricts the rows that must match.
    ///
    /// # Errors
    /// Returns an error if not exactly one task matches, or if the task has no maps.
    pub(crate) fn maps(
        &self,
        stage: &str,
        coordinates: &[Coordinate],
        load: Option<ChosenLoad>,
    ) -> Result<TaskMaps, SessionError> {
        let tables = self.tables()?;
        let (task, rows) = chosen_task(stage, coordinates, load, &tables.table(stage)?)?;
        let plan = &tables.reading.plan;
        let is_stored = plan
            .task_of(task)
            .is_some_and(|planned| tables.reading.reader.store().has(&plan.tasks[planned].table));
        if !is_stored {
            return Err(SessionError::NoMaps {
                task,
                store: self.data.store(),
                manifest: self.manifest.clone(),
            });
        }
        let study = &tables.reading.study;
        let store = tables.reading.reader.store().clone();
        let mut maps = TaskMaps::open(task, store, study.sources.clone())?;
        maps.show_in(&study.output_units);
        maps.keep(&rows);
        Ok(maps)
    }
}

/// Opens the maps of the finished task whose key begins with `word`, with the rows that match all
/// `coordinates`. The observer receives a notice about each listed store that cannot be used.
///
/// # Errors
/// Returns an error if not exactly one task matches, if the task has no maps, or if no row matches.
pub(crate) fn finished_task(
    word: &str,
    coordinates: &[Coordinate],
    data: &DataFolder,
    observer: &dyn Observer,
) -> Result<TaskMaps, SessionError> {
    let store = open_read_only(data, observer)?;
    let task = name_lookup::finished(word, &store, data)?;
    // The paths of measured surfaces are known from a manifest only.
    let mut maps = TaskMaps::open(task, store, SurfaceFiles::default())?;
    if let Some(contact) = &mut maps.contact {
        for coordinate in coordinates {
            contact.rows = coordinate.filter(&contact.table, &contact.rows)?;
        }
    }
    Ok(maps)
}

/// Maps of a task and of the tasks that it reads.
pub(crate) struct TaskMaps {
    /// Key of the requested task, which may differ from the tasks that contain the maps.
    pub(crate) task: TaskKey,
    store: Store,
    sources: SurfaceFiles,
    surface: SurfaceTask,
    contact: Option<SolvedTask>,
    /// Units of output, where they differ from those of the store.
    output_units: TableUnits,
}

/// Task of a surface, which is read or drawn when it is needed.
struct SurfaceTask {
    key: TaskKey,
    drawn: Option<DrawnSurface>,
}

/// Surface of a task.
#[non_exhaustive]
pub struct DrawnSurface {
    pub surface: Surface,
    /// Rms slope of the table, which defines reduced loads.
    pub rms_slope: f64,
    pub is_periodic: bool,
    /// Unit of length, or `None` if the study gives none.
    pub unit: Option<String>,
}

/// Contact maps of several loads, for one picture.
pub(crate) struct Overlay {
    pub(crate) grid: Grid,
    /// Maps at ascending loads, or from the farthest to the nearest state of a branch.
    pub(crate) contacts: Vec<ContactMap>,
    /// Loads or mean gaps of the maps, in the unit of the study.
    pub(crate) loads: Vec<f64>,
    /// Name of the loads with their unit: `load`, `mean pressure (MPa)`, `mean gap (µm)`.
    pub(crate) load_name: String,
    /// Branch of the states, or `None` if the contact is not a path.
    pub(crate) branch: Option<String>,
    /// Unit of length of the surface, if it is known.
    pub(crate) length_unit: Option<String>,
}

impl TaskMaps {
    /// Opens the maps of a task. If the task has none but a single input, opens the maps of this
    /// input.
    fn open(task: TaskKey, store: Store, sources: SurfaceFiles) -> Result<TaskMaps, SessionError> {
        let mut key = task;
        loop {
            let (table, Provenance { stage, inputs, .. }) = store.read_with_provenance(key)?;
            let kind = Kind::ALL.into_iter().find(|kind| kind.name() == stage);
            let (surface, contact) = match (kind, inputs.as_slice()) {
                (Some(Kind::Generate), _) => (key, None),
                (Some(Kind::Solve), [surface]) => (*surface, Some(SolvedTask::new(table)?)),
                (_, [input]) => {
                    key = *input;
                    continue;
                }
                _ => return Err(SessionError::NoMap { task }),
            };
            let surface = SurfaceTask { key: surface, drawn: None };
            let output_units = TableUnits::default();
            return Ok(TaskMaps { task, store, sources, surface, contact, output_units });
        }
    }

    /// Shows numbers in these units.
    fn show_in(&mut self, units: &TableUnits) {
        self.output_units = units.clone();
        if let Some(contact) = &mut self.contact {
            contact.show_in(units);
        }
    }

    /// Keeps only the chosen rows, because the store may have more loads than the study.
    fn keep(&mut self, chosen: &ChosenRows) {
        if let (Some(contact), Some((column, values))) = (&mut self.contact, chosen) {
            let Some(column) = contact.shown.batch().column_by_name(column) else { return };
            let value = |row: usize| Value::from_array(column.as_ref(), row);
            contact.rows.retain(|&row| value(row).is_some_and(|value| values.contains(&value)));
        }
    }

    /// Returns the rows of the loads in ascending order, or of the states in the order of their
    /// path; none for a surface.
    pub(crate) fn rows(&self) -> Vec<usize> {
        self.contact.as_ref().map_or(Vec::new(), |contact| contact.rows.clone())
    }

    /// Returns the loads in these rows, and the branches of states of a path.
    ///
    /// # Errors
    /// Returns an error if the table is not one of solved loads.
    pub(crate) fn loads(&self, rows: &[usize]) -> Result<(Vec<f64>, Vec<String>), SessionError> {
        let Some(contact) = &self.contact else { return Ok((Vec::new(), Vec::new())) };
        let loads = contact.shown.reals(load_column(&contact.shown))?;
        let mut branches = Vec::new();
        for &row in rows {
            branches.extend(contact.path_state(row)?.map(|state| state.branch));
        }
        Ok((rows.iter().map(|&row| loads.value(row)).collect(), branches))
    }

    /// Returns true if the task is a path with adhesion.
    pub(crate) fn is_path(&self) -> bool {
        self.contact.as_ref().is_some_and(SolvedTask::is_path)
    }

    /// Returns true if the surfaces have pulled off in the state of a row.
    ///
    /// # Errors
    /// Returns an error if the table is not one of solved loads.
    pub(crate) fn is_apart(&self, row: usize) -> Result<bool, SessionError> {
        self.contact.as_ref().map_or(Ok(false), |contact| contact.is_apart(row))
    }

    /// Returns the quantities that the task has maps of.
    pub(crate) fn kinds(&self) -> Vec<MapKind> {
        let Some(contact) = &self.contact else { return vec![MapKind::Heights] };
        let all = MapKind::value_variants().iter().copied();
        all.filter(|kind| contact.is_path() || *kind != MapKind::Repulsive).collect()
    }

    /// Returns the contact maps of all loads, or of the states of the first branch of a path.
    ///
    /// # Errors
    /// Returns an error if the task generates a surface, or if a map is damaged.
    pub(crate) fn overlay(&self) -> Result<Overlay, SessionError> {
        self.solved(MapKind::Contact)?.overlay()
    }

    /// Returns the map of a quantity under a load, or under the largest load. Of a path, the state
    /// with the smallest mean gap is taken if no load is given.
    ///
    /// # Errors
    /// Returns an error if the task has no such map, no such load or several states with this load,
    /// if a surface file is missing, or on interruption by `stop`.
    pub(crate) fn map(
        &mut self,
        kind: MapKind,
        load: Option<ChosenLoad>,
        stop: &AtomicBool,
    ) -> Result<Map, SessionError> {
        if kind == MapKind::Heights {
            if load.is_some() {
                return Err(SessionError::refused(
                    "heights do not depend on the load; omit `--load` or `--gap`",
                ));
            }
            return self.heights();
        }
        let row = self.row(kind, load)?;
        self.map_of_row(kind, row, stop)
    }

    /// Returns the row of the map of a quantity under a load, or under the largest load.
    ///
    /// # Errors
    /// Returns the errors of [`TaskMaps::map`].
    pub(crate) fn row(
        &self,
        kind: MapKind,
        load: Option<ChosenLoad>,
    ) -> Result<usize, SessionError> {
        let contact = self.solved(kind)?;
        match load {
            Some(load) => {
                let rows = rows_under(&contact.shown, &contact.rows, load)?;
                only_state(&contact.shown, &rows)
            }
            None => contact.heaviest()?.ok_or(SessionError::NoMap { task: self.task }),
        }
    }

    /// Returns the map of a quantity in a row of the task.
    ///
    /// # Errors
    /// Returns the errors of [`TaskMaps::map`].
    pub(crate) fn map_of_row(
        &mut self,
        kind: MapKind,
        row: usize,
        stop: &AtomicBool,
    ) -> Result<Map, SessionError> {
        let contact = self.solved(kind)?;
        let column = load_column(&contact.shown);
        let load = contact.shown.reals(column)?.value(row);
        let [stored, shown] = [&contact.table, &contact.shown]
            .map(|table| [length_unit(table), pressure_unit(table)]);
        let [length, pressure] =
            [0, 1].map(|of| factor(stored[of].as_deref(), shown[of].as_deref()));
        let [length_unit, pressure_unit] = shown;
        let grid = contact.grid;
        let effective_modulus = contact.shown.reals(EFFECTIVE_MODULUS.name)?.value(row);
        let load_unit = match column {
            _ if column == LOAD.name => Some(LOAD.unit.to_owned()),
            _ if prescribed_length(column).is_some() => length_unit.clone(),
            _ => pressure_unit.clone(),
        };
        let unit = match kind {
            MapKind::Contact | MapKind::Repulsive => None,
            MapKind::Pressures => pressure_unit.clone(),
            MapKind::Heights | MapKind::Gap | MapKind::Displacement => length_unit.clone(),
        };
        let state = contact.path_state(row)?;
        let factor = if kind == MapKind::Pressures { pressure } else { length };
        let mut values: Vec<f64> = if kind.is_set() {
            let map = contact.set(kind, row)?;
            let has = |node| {
                let [i, j] = grid.indices(node);
                map.get(i, j)
            };
            (0..grid.count()).map(|node| f64::from(u8::from(has(node)))).collect()
        } else {
            let contact = self.contact.as_mut().expect("the row of a load was found");
            contact.field(kind, row, &mut self.surface, (&self.store, &self.sources), stop)?
        };
        if !kind.is_set() {
            values.iter_mut().for_each(|value| *value *= factor);
        }
        Ok(Map {
            kind,
            values,
            grid: scaled(grid, length)?,
            length_unit,
            unit,
            load: Some(load),
            state,
            load_column: Some(column),
            load_unit,
            pressure_unit,
            effective_modulus: Some(effective_modulus),
        })
    }

    /// Returns the surface of the task.
    ///
    /// # Errors
    /// Returns an error if a surface file is missing.
    pub(crate) fn into_surface(mut self) -> Result<DrawnSurface, SessionError> {
        let Map { grid, values, unit, .. } = self.heights()?;
        let surface = Surface::new(grid, values).map_err(StageError::Heights)?;
        let DrawnSurface { rms_slope, is_periodic, .. } =
            *self.surface.draw(&self.store, &self.sources)?;
        Ok(DrawnSurface { surface, rms_slope, is_periodic, unit })
    }

    fn solved(&self, kind: MapKind) -> Result<&SolvedTask, SessionError> {
        let contact = self.contact.as_ref().ok_or_else(|| {
            SessionError::refused(format!(
                "task {} generates a surface and has no {}; choose a task of a `solve` stage",
                self.task,
                kind.name()
            ))
        })?;
        if kind == MapKind::Repulsive && !contact.is_path() {
            return Err(SessionError::refused(
                "without adhesion, the map `contact` shows the repulsive nodes",
            ));
        }
        Ok(contact)
    }

    fn heights(&mut self) -> Result<Map, SessionError> {
        let drawn = self.surface.draw(&self.store, &self.sources)?;
        let units = TableUnits { length: drawn.unit.clone(), ..TableUnits::default() };
        let unit = units.in_output(&self.output_units).length;
        let factor = factor(drawn.unit.as_deref(), unit.as_deref());
        let values = drawn.surface.heights().iter().map(|height| height * factor).collect();
        Ok(Map::of_heights(scaled(drawn.surface.grid(), factor)?, values, unit))
    }
}

impl Map {
    /// Creates a map of heights in the unit of the sides.
    pub(crate) fn of_heights(grid: Grid, values: Vec<f64>, unit: Option<String>) -> Map {
        Map {
            kind: MapKind::Heights,
            values,
            grid,
            length_unit: unit.clone(),
            unit,
            load: None,
            state: None,
            pressure_unit: None,
            effective_modulus: None,
            load_column: None,
            load_unit: None,
        }
    }
}

/// Returns the factor that converts numbers from one unit to another; 1 if one is not known.
fn factor(from: Option<&str>, to: Option<&str>) -> f64 {
    let [from, to] = [from, to].map(|unit| unit.and_then(Unit::find));
    from.zip(to).map_or(1.0, |(from, to)| from.factor_to(to))
}

/// Returns a grid whose sides are multiplied by a factor.
fn scaled(grid: Grid, factor: f64) -> Result<Grid, SessionError> {
    if factor == 1.0 {
        return Ok(grid);
    }
    let sides = grid.cell().size().map(|side| decimal::nearest(factor * side));
    Ok(grids::grid(grid.nodes(), sides)?)
}

impl SurfaceTask {
    /// Returns the surface. Generates it again if its heights are not stored.
    fn draw(
        &mut self,
        store: &Store,
        sources: &SurfaceFiles,
    ) -> Result<&DrawnSurface, SessionError> {
        let drawn = match self.drawn.take() {
            Some(drawn) => drawn,
            None => self.read(store, sources)?,
        };
        Ok(self.drawn.insert(drawn))
    }

    fn read(&self, store: &Store, sources: &SurfaceFiles) -> Result<DrawnSurface, SessionError> {
        let (table, provenance) = store.read_with_provenance(self.key)?;
        let params: surface::Params =
            serde_json::from_str(&provenance.recipe).map_err(SessionError::Recipe)?;
        let drawn = params.surface(&table, sources, &Threads::one());
        let surface = drawn.map_err(|error| match error {
            StageError::Source(SurfaceFileError::Unknown { .. }) => SessionError::NotRedrawn,
            other => other.into(),
        })?;
        let rms_slope = table.reals(RMS_SLOPE.name)?.value(0);
        let is_periodic = !params.origin.is_open();
        Ok(DrawnSurface { surface, rms_slope, is_periodic, unit: length_unit(&table) })
    }
}
