//! Maps of one task: heights of a surface, and contact, pressures, gaps and displacements under a
//! load.
//!
//! Heights and pressures that are not stored, gaps and displacements are computed when they are
//! read. The results are the same as those of a run, because loads do not depend on each other.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use arrow::array::{Array, AsArray};
use arrow::datatypes::Float64Type;
use clap::ValueEnum;
use serde::Serialize;

use super::coordinates::{ChosenLoad, Coordinate, chosen_task, rows_under};
use super::words::listed;
use super::{DataFolder, Observer, Session, SessionError, names, open_read_only};
use asperity_contact::grid::Grid;
use asperity_contact::morphology::map::ContactMap;
use asperity_contact::threads::Threads;
use asperity_contact::topography::surface::Surface;
use asperity_stages::columns::{CONTACT, EFFECTIVE_MODULUS, LOAD, PRESSURES, RMS_SLOPE};
use asperity_stages::ensemble::load_column;
use asperity_stages::generate;
use asperity_stages::grids::Grids;
use asperity_stages::solve::ContactFields;
use asperity_stages::surface_files::{SurfaceFileError, SurfaceFiles};
use asperity_stages::units::{length_unit, pressure_unit};
use asperity_stages::{Kind, StageError};
use asperity_tables::store::Store;
use asperity_tables::store::key::{Provenance, TaskKey};
use asperity_tables::table::Table;

/// Quantity that a map shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MapKind {
    /// Heights of the surface, positive towards the elastic body.
    #[value(alias = "height")]
    Heights,
    /// Nodes in contact.
    Contact,
    /// Contact pressures, zero outside contact.
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
    pub const ALL: [MapKind; 5] = [
        MapKind::Heights,
        MapKind::Contact,
        MapKind::Pressures,
        MapKind::Gap,
        MapKind::Displacement,
    ];

    /// Returns the name in options and file names.
    pub fn name(self) -> &'static str {
        match self {
            MapKind::Heights => "heights",
            MapKind::Contact => "contact",
            MapKind::Pressures => "pressures",
            MapKind::Gap => "gap",
            MapKind::Displacement => "displacement",
        }
    }
}

/// One value for each node of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    pub kind: MapKind,
    /// Values, row-major: node (i, j) at x = iΔx and y = jΔy is element i·N_y + j. Nodes in contact
    /// have the value 1 in a map of the contact, and the others 0.
    pub values: Vec<f64>,
    pub grid: Grid,
    /// Unit of the sides, or `None` if the study gives none.
    pub length_unit: Option<String>,
    /// Unit of the values, or `None` if it is unknown or the values are numbers.
    pub unit: Option<String>,
    /// Load in the unit of the study, or `None` for heights.
    pub load: Option<f64>,
    /// Unit of pressures, if it is known.
    pub pressure_unit: Option<String>,
    /// Effective modulus E* in the unit of pressures, or `None` for heights.
    pub effective_modulus: Option<f64>,
    /// Column of the load: `load` for reduced loads, `pressure` for loads in the unit of the
    /// moduli.
    pub load_column: Option<&'static str>,
    /// Unit of the load, or `None` if it is unknown.
    pub load_unit: Option<String>,
}

impl Session<'_> {
    /// Returns a map of the only task of `stage` that matches all `coordinates`, under the load
    /// `load`, or under the largest load.
    ///
    /// # Errors
    /// Returns an error if not exactly one task matches, if the task has no such map, or on
    /// interruption by `stop`.
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

    /// Opens the maps of the only task of `stage` that matches all `coordinates`. A load
    /// restricts the rows that must match.
    ///
    /// # Errors
    /// Returns an error if not exactly one task matches, or if the task has no maps.
    pub fn maps(
        &self,
        stage: &str,
        coordinates: &[Coordinate],
        load: Option<ChosenLoad>,
    ) -> Result<TaskMaps, SessionError> {
        let tables = self.tables()?;
        let chosen = chosen_task(stage, coordinates, load, &tables.table(stage)?)?;
        let (task, plan) = (chosen.key, &tables.reading.plan);
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
        let sources = tables.reading.study.sources.clone();
        let maps = TaskMaps::open(task, self.open_read_only()?, sources);
        let maps = maps.map_err(|error| match error {
            SessionError::NoMap { .. } => {
                let stages = plan.stages.iter();
                let drawn =
                    stages.filter(|stage| [Kind::Generate, Kind::Solve].contains(&stage.kind));
                let names = listed(drawn.map(|stage| stage.name.as_str()), "or");
                SessionError::Refused(format!("stage `{stage}` has no maps; choose {names}"))
            }
            other => other,
        })?;
        maps.only(chosen.loads)
    }
}

/// Opens the maps of the finished task whose key begins with `word`. The observer receives a notice
/// about each listed store that cannot be used.
///
/// # Errors
/// Returns an error if not exactly one task matches, or if the task has no maps.
pub fn finished_task(
    word: &str,
    data: &DataFolder,
    observer: &dyn Observer,
) -> Result<TaskMaps, SessionError> {
    let store = open_read_only(data, observer)?;
    let task = names::finished(word, &store, data)?;
    // The paths of measured surfaces are known from a manifest only.
    TaskMaps::open(task, store, SurfaceFiles::default())
}

/// Maps of a task and of the tasks that it reads.
pub struct TaskMaps {
    /// Key of the requested task, which may differ from the tasks that contain the maps.
    pub task: TaskKey,
    store: Store,
    sources: SurfaceFiles,
    surface: SurfaceTask,
    contact: Option<SolvedTask>,
}

/// Task of a surface, which is read or drawn when it is needed.
struct SurfaceTask {
    key: TaskKey,
    drawn: Option<DrawnSurface>,
}

/// Surface of a task.
pub struct DrawnSurface {
    pub surface: Surface,
    /// Rms slope of the table, which defines reduced loads.
    pub rms_slope: f64,
    pub is_periodic: bool,
    /// Unit of length, or `None` if the study gives none.
    pub unit: Option<String>,
}

/// Solved loads of a surface.
struct SolvedTask {
    table: Table,
    grid: Grid,
    fields: Option<ContactFields>,
    /// Row of the last load that was solved, with its pressures.
    solved: Option<(usize, Vec<f64>)>,
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
            return Ok(TaskMaps { task, store, sources, surface, contact });
        }
    }

    /// Keeps only the rows with these loads, because the store may have more loads than the study.
    fn only(mut self, loads: Option<Vec<f64>>) -> Result<TaskMaps, SessionError> {
        if let (Some(loads), Some(contact)) = (loads, &mut self.contact) {
            let all = contact.loads()?;
            let is_wanted = |row: &usize| loads.contains(&all[*row]);
            let rows: Vec<usize> = (0..all.len()).filter(is_wanted).collect();
            contact.table = contact.table.pick(&rows);
        }
        Ok(self)
    }

    /// Returns the loads in ascending order, in the unit of the study; none for a surface.
    ///
    /// # Errors
    /// Returns an error if the table is not one of solved loads.
    pub fn loads(&self) -> Result<Vec<f64>, SessionError> {
        self.contact.as_ref().map_or(Ok(Vec::new()), SolvedTask::loads)
    }

    /// Returns the unit of length of the surface, if it is known without reading the heights.
    pub fn length_unit(&self) -> Option<String> {
        length_unit(&self.contact.as_ref()?.table)
    }

    /// Names the load with its unit: `load`, `mean pressure (MPa)`.
    pub fn load_in_words(&self) -> String {
        let Some(contact) = &self.contact else { return "load".to_owned() };
        if load_column(&contact.table) == LOAD.name {
            return "load".to_owned();
        }
        match pressure_unit(&contact.table) {
            Some(unit) => format!("mean pressure ({unit})"),
            None => "mean pressure".to_owned(),
        }
    }

    /// Returns the quantities that the task has maps of.
    pub fn kinds(&self) -> &'static [MapKind] {
        if self.contact.is_some() { &MapKind::ALL } else { &[MapKind::Heights] }
    }

    /// Returns the contact map of every load.
    ///
    /// # Errors
    /// Returns an error if the task generates a surface, or if a map is damaged.
    pub fn contacts(&self) -> Result<(Grid, Vec<ContactMap>), SessionError> {
        let contact = self.solved(MapKind::Contact)?;
        let maps = (0..contact.table.rows()).map(|row| contact.contact(row));
        Ok((contact.grid, maps.collect::<Result<_, _>>()?))
    }

    /// Returns the map of a quantity under a load, or under the largest load.
    ///
    /// # Errors
    /// Returns an error if the task has no such map or no such load, if a surface file is missing,
    /// or on interruption by `stop`.
    pub fn map(
        &mut self,
        kind: MapKind,
        load: Option<ChosenLoad>,
        stop: &AtomicBool,
    ) -> Result<Map, SessionError> {
        if kind == MapKind::Heights {
            if load.is_some() {
                let message = "heights do not depend on the load; omit `--load`";
                return Err(SessionError::Refused(message.to_owned()));
            }
            return self.heights();
        }
        let contact = self.solved(kind)?;
        let column = load_column(&contact.table);
        let rows: Vec<usize> = (0..contact.table.rows()).collect();
        let row = match load {
            Some(load) => rows_under(&contact.table, &rows, load)?[0],
            None => rows.last().copied().ok_or(SessionError::NoMap { task: self.task })?,
        };
        let load = contact.table.reals(column)?.value(row);
        let (grid, length_unit) = (contact.grid, length_unit(&contact.table));
        let pressure_unit = pressure_unit(&contact.table);
        let effective_modulus = contact.table.reals(EFFECTIVE_MODULUS.name)?.value(row);
        let load_unit = match column {
            _ if column == LOAD.name => Some(LOAD.unit.to_owned()),
            _ => pressure_unit.clone(),
        };
        let unit = match kind {
            MapKind::Contact => None,
            MapKind::Pressures => pressure_unit.clone(),
            MapKind::Heights | MapKind::Gap | MapKind::Displacement => length_unit.clone(),
        };
        let values = match kind {
            MapKind::Contact => {
                let map = contact.contact(row)?;
                let touches = |node| {
                    let [i, j] = grid.indices(node);
                    map.get(i, j)
                };
                (0..grid.count()).map(|node| f64::from(u8::from(touches(node)))).collect()
            }
            _ => self.field(kind, row, stop)?,
        };
        Ok(Map {
            kind,
            values,
            grid,
            length_unit,
            unit,
            load: Some(load),
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
    pub fn into_surface(self) -> Result<DrawnSurface, SessionError> {
        self.surface.read(&self.store, &self.sources)
    }

    fn solved(&self, kind: MapKind) -> Result<&SolvedTask, SessionError> {
        self.contact.as_ref().ok_or_else(|| {
            SessionError::Refused(format!(
                "task {} generates a surface and has no {}; choose a task of a `solve` stage",
                self.task,
                kind.name()
            ))
        })
    }

    fn heights(&mut self) -> Result<Map, SessionError> {
        let drawn = self.surface.draw(&self.store, &self.sources)?;
        Ok(Map {
            kind: MapKind::Heights,
            values: drawn.surface.heights().to_vec(),
            grid: drawn.surface.grid(),
            length_unit: drawn.unit.clone(),
            unit: drawn.unit.clone(),
            load: None,
            pressure_unit: None,
            effective_modulus: None,
            load_column: None,
            load_unit: None,
        })
    }

    /// Returns pressures, gaps or displacements in the row of a load.
    fn field(
        &mut self,
        kind: MapKind,
        row: usize,
        stop: &AtomicBool,
    ) -> Result<Vec<f64>, SessionError> {
        let contact = self.contact.as_mut().expect("the row of a load was found");
        let stored = contact.stored_pressures(row);
        if let (MapKind::Pressures, Some(stored)) = (kind, &stored) {
            return Ok(stored.clone());
        }
        if contact.fields.is_none() {
            let drawn = self.surface.draw(&self.store, &self.sources)?;
            let threads = threads(contact.grid);
            let (surface, slope) = (drawn.surface.clone(), drawn.rms_slope);
            contact.fields = Some(ContactFields::new(&contact.table, surface, slope, threads)?);
        }
        let load = contact.loads()?[row];
        let fields = contact.fields.as_mut().expect("the fields were prepared");
        let pressures = match (stored, &contact.solved) {
            (Some(stored), _) => stored,
            (None, Some((solved, pressures))) if *solved == row => pressures.clone(),
            (None, _) => {
                let is_interrupted = || stop.load(Ordering::Relaxed);
                let pressures = fields.pressures(load, &is_interrupted)?;
                contact.solved = Some((row, pressures.clone()));
                pressures
            }
        };
        let field = match kind {
            MapKind::Gap => fields.gap(pressures),
            MapKind::Displacement => fields.displacement(pressures),
            MapKind::Heights | MapKind::Contact | MapKind::Pressures => Some(pressures),
        };
        field.ok_or_else(|| {
            SessionError::Refused(format!(
                "an asperity model has no map of the {}; choose contact or pressures",
                kind.name()
            ))
        })
    }
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
        let params: generate::Params =
            serde_json::from_str(&provenance.recipe).map_err(SessionError::Recipe)?;
        let surface = params.surface(&table, sources, &Threads::one());
        let surface = surface.map_err(|error| match error {
            StageError::Source(SurfaceFileError::Unknown { .. }) => SessionError::NotRedrawn,
            other => other.into(),
        })?;
        let rms_slope = table.reals(RMS_SLOPE.name)?.value(0);
        let is_periodic = !params.origin.is_open();
        Ok(DrawnSurface { surface, rms_slope, is_periodic, unit: length_unit(&table) })
    }
}

impl SolvedTask {
    fn new(table: Table) -> Result<SolvedTask, SessionError> {
        let grid = Grids::new(&table)?.grid(0)?;
        Ok(SolvedTask { table, grid, fields: None, solved: None })
    }

    fn loads(&self) -> Result<Vec<f64>, SessionError> {
        Ok(self.table.reals(load_column(&self.table))?.values().to_vec())
    }

    fn contact(&self, row: usize) -> Result<ContactMap, SessionError> {
        let bytes = self.table.bytes(CONTACT.name)?.value(row);
        ContactMap::from_bytes(self.grid.nodes(), bytes).map_err(SessionError::Map)
    }

    /// Returns the pressures in a row if they are stored.
    fn stored_pressures(&self, row: usize) -> Option<Vec<f64>> {
        let lists = self.table.lists(PRESSURES.name).ok()?;
        if lists.is_null(row) || lists.value_length(row) == 0 {
            return None;
        }
        let list = lists.value(row);
        let pressures = list.as_primitive::<Float64Type>().iter();
        Some(pressures.map(Option::unwrap_or_default).collect())
    }
}

/// Returns threads for a mesh on all cores of the machine. Results do not depend on their number.
fn threads(grid: Grid) -> Threads {
    let cores = thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    Threads::for_mesh(cores, grid.count())
}
