//! Pictures of the heights, contacts or pressures of one task.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;
use std::str::FromStr;

use arrow::array::{Array, AsArray};
use arrow::datatypes::{DataType, Float64Type};
use arrow::util::display::array_value_to_string;
use clap::ValueEnum;
use serde::Serialize;

use super::words::{counted, listed, short};
use super::{DataFolder, Session, SessionError, UnknownName, names};
use asperity_contact::grid::Grid;
use asperity_contact::morphology::map::ContactMap;
use asperity_contact::threads::Threads;
use asperity_report::{Raster, Scale};
use asperity_stages::columns::{CONTACT, LOAD, PRESSURE, PRESSURES, UNIT};
use asperity_stages::ensemble::load_column;
use asperity_stages::generate::{self, PerAxis};
use asperity_stages::grids::Grids;
use asperity_stages::surface_files::{SurfaceFileError, SurfaceFiles};
use asperity_stages::{Kind, StageError};
use asperity_tables::store::files::{Existing, write_file};
use asperity_tables::store::key::{Provenance, TaskKey};
use asperity_tables::store::{Store, StoreError};
use asperity_tables::table::Table;

/// Relative tolerance between a typed number and a column, because tables show rounded numbers.
const ROUNDING: f64 = 1e-3;

/// Number of digits of the key in file names.
const KEY_DIGITS: usize = 8;

/// First bytes of every PNG file.
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Quantity that a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Map {
    Heights,
    Contact,
    Pressures,
}

/// Options of [`Session::view`] and [`finished_task`].
#[derive(Debug, Clone, Copy, Default)]
pub struct ViewOptions {
    /// Map to draw (default: heights for surfaces, contact for loads).
    pub map: Option<Map>,
    /// Load in the unit of the study (default: contacts at all loads, pressures at the largest).
    pub load: Option<f64>,
}

/// Picture of a map with its description.
#[derive(Debug, Serialize)]
pub struct Picture {
    #[serde(skip)]
    raster: Raster,
    /// Key of the requested task, which may differ from the task that contains the map.
    pub task: TaskKey,
    pub map: Map,
    /// Number of nodes along x and y.
    pub nodes: PerAxis<usize>,
    /// Load of the map, or `None` for heights and for contacts at all loads.
    pub load: Option<f64>,
    /// Name of the column of the load: `load` for reduced loads, `pressure` for loads in pascals.
    pub load_column: Option<&'static str>,
    /// Smallest value of the colour scale; `None` for contacts.
    pub lowest: Option<f64>,
    /// Largest value of the colour scale; `None` for contacts.
    pub highest: Option<f64>,
    pub unit: Option<String>,
}

/// Column and the value that a row must have in it.
#[derive(Debug, Clone)]
pub struct Coordinate {
    column: String,
    value: String,
}

impl Session<'_> {
    /// Draws the only task of `stage` that matches all `coordinates`.
    ///
    /// # Errors
    /// Returns an error if not exactly one task matches, or if the task has no such map.
    pub fn view(
        &self,
        stage: &str,
        coordinates: &[Coordinate],
        options: ViewOptions,
    ) -> Result<Picture, SessionError> {
        let tables = self.tables()?;
        let task = chosen_task(stage, coordinates, options.load, &tables.table(stage)?)?;
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
        let store = self.data.open_read_only()?;
        let picture = draw(task, options, &store, &tables.reading.study.sources);
        let picture = picture.map_err(|error| match error {
            SessionError::NoMap { .. } => {
                let stages = tables.reading.plan.stages.iter();
                let drawn =
                    stages.filter(|stage| [Kind::Generate, Kind::Solve].contains(&stage.kind));
                let names = listed(drawn.map(|stage| stage.name.as_str()), "or");
                SessionError::Refused(format!("stage `{stage}` has no maps; choose {names}"))
            }
            other => other,
        })?;
        Ok(Picture { task, ..picture })
    }
}

/// Draws the finished task whose key begins with `word`.
///
/// # Errors
/// Returns an error if not exactly one task matches, or if the task has no such map.
pub fn finished_task(
    word: &str,
    data: &DataFolder,
    options: ViewOptions,
) -> Result<Picture, SessionError> {
    let task = names::finished(word, data)?;
    // The paths of measured surfaces are known from a manifest only.
    let picture = draw(task, options, &data.open_read_only()?, &SurfaceFiles::default())?;
    Ok(Picture { task, ..picture })
}

impl Picture {
    /// Returns a file name that is unique for the picture.
    pub fn file_name(&self) -> String {
        let load = self.load_in_words().map(|load| format!("-{load}"));
        let key = &self.task.to_string()[..KEY_DIGITS];
        format!("{key}-{}{}.png", self.map.name(), load.unwrap_or_default())
    }

    /// Describes the picture in one line.
    pub fn caption(&self) -> String {
        let load = match (self.map, self.load_column.zip(self.load_in_words())) {
            (Map::Heights, _) => String::new(),
            (_, Some((column, load))) => format!(" at {column} {load}"),
            (_, None) => " at all loads".to_owned(),
        };
        let range = match (self.lowest, self.highest) {
            (Some(lowest), Some(highest)) => {
                let unit = self.unit.as_deref().unwrap_or_default();
                format!(", {} … {} {unit}", short(lowest), short(highest))
            }
            _ => String::new(),
        };
        let PerAxis([nodes_x, nodes_y]) = self.nodes;
        let range = range.trim_end();
        format!("{}{load} on {nodes_x} × {nodes_y} nodes{range}", self.map.name())
    }

    /// Writes the picture with [`write_png`].
    ///
    /// # Errors
    /// Returns the same errors as [`write_png`].
    pub fn write(&self, path: &Path, replace: bool) -> Result<(), SessionError> {
        write_png(path, &self.raster.to_png(), replace)
    }

    /// Formats the load for captions and file names: `0.1000`, or `1e8` in pascals.
    fn load_in_words(&self) -> Option<String> {
        let (load, column) = (self.load?, self.load_column?);
        Some(if column == LOAD.name { format!("{load:.4}") } else { load_as_typed(load) })
    }

    fn under(mut self, table: &Table, row: usize) -> Result<Picture, SessionError> {
        let column = load_column(table);
        self.load = Some(table.reals(column)?.value(row));
        self.load_column = Some(column);
        Ok(self)
    }

    fn with_range(mut self, scale: &Scale, unit: String) -> Picture {
        let (lowest, highest) = scale.range().into_inner();
        (self.lowest, self.highest, self.unit) = (Some(lowest), Some(highest), Some(unit));
        self
    }
}

impl Map {
    fn name(self) -> &'static str {
        match self {
            Map::Heights => "heights",
            Map::Contact => "contact",
            Map::Pressures => "pressures",
        }
    }
}

/// Draws a map of a task. If the task has no map but a single input, draws a map of this input.
fn draw(
    key: TaskKey,
    options: ViewOptions,
    store: &Store,
    sources: &SurfaceFiles,
) -> Result<Picture, SessionError> {
    let (table, provenance) = store.read_with_provenance(key)?;
    let kind = Kind::ALL.into_iter().find(|kind| kind.name() == provenance.stage);
    let finished = FinishedTask { key, table, provenance };
    let load = options.load;
    match (kind, options.map) {
        (Some(Kind::Generate), None | Some(Map::Heights)) if load.is_some() => Err(
            SessionError::Refused("heights do not depend on the load; omit `--load`".to_owned()),
        ),
        (Some(Kind::Generate), None | Some(Map::Heights)) => finished.heights(sources),
        (Some(Kind::Generate), Some(map)) => Err(SessionError::Refused(format!(
            "task {key} generates a surface and has no {}; choose a task of a `solve` stage",
            map.name()
        ))),
        (Some(Kind::Solve), None | Some(Map::Contact)) => finished.contact(load),
        (Some(Kind::Solve), Some(Map::Pressures)) => finished.pressures(load),
        _ => match finished.provenance.inputs.as_slice() {
            [input] => draw(*input, options, store, sources),
            _ => Err(SessionError::NoMap { task: key }),
        },
    }
}

/// Table of a finished task with its provenance.
struct FinishedTask {
    key: TaskKey,
    table: Table,
    provenance: Provenance,
}

impl FinishedTask {
    /// Draws the heights. Generates the surface again if its heights are not stored.
    fn heights(&self, sources: &SurfaceFiles) -> Result<Picture, SessionError> {
        let params: generate::Params =
            serde_json::from_str(&self.provenance.recipe).map_err(SessionError::Recipe)?;
        let surface = params.surface(&self.table, sources, &Threads::one());
        let surface = surface.map_err(|error| match error {
            StageError::Source(SurfaceFileError::Unknown { .. }) => SessionError::NotRedrawn,
            other => other.into(),
        })?;
        let unit = match self.table.texts(UNIT.name) {
            Ok(units) => units.value(0).to_owned(),
            Err(_) => String::new(),
        };
        let (grid, heights) = (surface.grid(), surface.heights());
        let raster = Raster::from_heights(grid.nodes(), heights);
        Ok(self.picture(Map::Heights, raster, grid).with_range(&Scale::from_heights(heights), unit))
    }

    fn contact(&self, load: Option<f64>) -> Result<Picture, SessionError> {
        let grid = self.grid()?;
        let maps = self.table.bytes(CONTACT.name)?;
        let map = |row: usize| {
            ContactMap::from_bytes(grid.nodes(), maps.value(row)).map_err(SessionError::Map)
        };
        let rows: Vec<usize> = (0..self.table.rows()).collect();
        let Some(load) = load else {
            let maps: Vec<_> = rows.into_iter().map(map).collect::<Result<_, _>>()?;
            return Ok(self.picture(Map::Contact, Raster::from_contacts(&maps), grid));
        };
        let row = rows_under(&self.table, &rows, load)?[0];
        let raster = Raster::from_contact(&map(row)?);
        self.picture(Map::Contact, raster, grid).under(&self.table, row)
    }

    fn pressures(&self, load: Option<f64>) -> Result<Picture, SessionError> {
        let lists = self.table.lists(PRESSURES.name).ok();
        let kept: Vec<usize> = match lists {
            None => vec![],
            Some(lists) => {
                (0..self.table.rows()).filter(|&row| lists.value_length(row) > 0).collect()
            }
        };
        let (Some(lists), Some(&heaviest)) = (lists, kept.last()) else {
            let message = "the pressures of this task are not stored; set the key `pressures` of \
                           its stage to store them";
            return Err(SessionError::Refused(message.to_owned()));
        };
        let row = match load {
            Some(load) => rows_under(&self.table, &kept, load)?[0],
            None => heaviest,
        };
        let list = lists.value(row);
        let pressures = list.as_primitive::<Float64Type>().iter();
        let pressures: Vec<f64> = pressures.map(Option::unwrap_or_default).collect();
        let grid = self.grid()?;
        let picture =
            self.picture(Map::Pressures, Raster::from_pressures(grid.nodes(), &pressures), grid);
        let picture = picture.with_range(&Scale::from_pressures(&pressures), String::new());
        picture.under(&self.table, row)
    }

    fn grid(&self) -> Result<Grid, SessionError> {
        Ok(Grids::new(&self.table)?.grid(0)?)
    }

    fn picture(&self, map: Map, raster: Raster, grid: Grid) -> Picture {
        Picture {
            raster: raster.in_proportion(grid.cell().size()),
            task: self.key,
            map,
            nodes: PerAxis(grid.nodes()),
            load: None,
            load_column: None,
            lowest: None,
            highest: None,
            unit: None,
        }
    }
}

/// Returns the elements of `rows` with the load `load`; there is at least one.
///
/// # Errors
/// Returns an error if no row has this load; the message names the nearest load.
fn rows_under(table: &Table, rows: &[usize], load: f64) -> Result<Vec<usize>, SessionError> {
    let column = load_column(table);
    let loads = table.reals(column)?;
    let distance = |row: usize| (loads.value(row) - load).abs();
    let is_meant = |row: &usize| distance(*row) <= ROUNDING * load.abs();
    let found: Vec<usize> = rows.iter().copied().filter(is_meant).collect();
    if !found.is_empty() {
        return Ok(found);
    }
    let by_distance = |one: &&usize, other: &&usize| distance(**one).total_cmp(&distance(**other));
    let nearest = rows.iter().min_by(by_distance);
    Err(SessionError::Refused(match nearest {
        Some(&nearest) => {
            let [requested, nearest] = [load, loads.value(nearest)].map(load_as_typed);
            format!(
                "no row has `{column}` = {requested}; the nearest is {nearest}: use `--load {nearest}`"
            )
        }
        None => "the task has no loads".to_owned(),
    }))
}

/// Formats a load as users write it: `0.1`, `1e8`.
fn load_as_typed(load: f64) -> String {
    if (1e-4..1e6).contains(&load) { short(load) } else { format!("{load:e}") }
}

impl FromStr for Coordinate {
    type Err = String;

    fn from_str(word: &str) -> Result<Coordinate, String> {
        let (column, value) =
            word.split_once('=').ok_or("expected COLUMN=VALUE, such as `k_upper=32`")?;
        if [LOAD.name, PRESSURE.name].contains(&column) {
            return Err("use `--load` to choose the load".to_owned());
        }
        Ok(Coordinate { column: column.to_owned(), value: value.to_owned() })
    }
}

/// Returns the only task of `stage` that matches all `coordinates` and the load.
fn chosen_task(
    stage: &str,
    coordinates: &[Coordinate],
    load: Option<f64>,
    table: &Table,
) -> Result<TaskKey, SessionError> {
    let mut rows: Vec<usize> = (0..table.rows()).collect();
    for coordinate in coordinates {
        rows = coordinate.filter(table, &rows)?;
    }
    if let Some(load) = load.filter(|_| table.has(LOAD.name)) {
        rows = rows_under(table, &rows, load)?;
    }
    let rows = table.pick(&rows);
    let tasks = rows.texts("task")?;
    let tasks: BTreeSet<&str> = tasks.iter().flatten().collect();
    if tasks.len() == 1 {
        let word: String = tasks.into_iter().collect();
        return word.parse().map_err(|_| names::TaskNameError::InvalidKey { word }.into());
    }
    let columns = rows.coordinates();
    let columns = columns.names().into_iter().zip(columns.batch().columns());
    let differing = columns
        .filter(|(name, _)| ![LOAD.name, PRESSURE.name, "surface"].contains(name))
        .filter_map(|(name, values)| {
            let values = distinct(values.as_ref());
            (values.len() > 1).then(|| format!("\n  {name}={}", values.join(" | ")))
        });
    let differing: String = differing.collect();
    let tasks = counted(tasks.len(), "task");
    Err(SessionError::Refused(format!("{tasks} of `{stage}` match; choose one by{differing}")))
}

impl Coordinate {
    /// Returns the elements of `rows` that have the required value in the column; there is at least
    /// one.
    fn filter(&self, table: &Table, rows: &[usize]) -> Result<Vec<usize>, SessionError> {
        let Coordinate { column, value } = self;
        let coordinates = table.coordinates();
        let Some(values) = coordinates.batch().column_by_name(column) else {
            let message = format!("the table has no coordinate `{column}`");
            return Err(UnknownName::new(message, column, &coordinates.names()).into());
        };
        let has = |row: &usize| is_value(values.as_ref(), *row, value);
        let found: Vec<usize> = rows.iter().copied().filter(has).collect();
        if found.is_empty() {
            let picked = coordinates.pick(rows);
            let there = picked.batch().column_by_name(column);
            let there = there.map(|values| distinct(values.as_ref()).join(", "));
            let there = there.unwrap_or_default();
            let message = format!("no row has `{column}` = {value}; available: {there}");
            return Err(SessionError::Refused(message));
        }
        Ok(found)
    }
}

fn is_value(values: &dyn Array, row: usize, wanted: &str) -> bool {
    if values.is_null(row) {
        return false;
    }
    match (values.data_type(), wanted.parse::<f64>()) {
        (DataType::Float64, Ok(wanted)) => {
            let value = values.as_primitive::<Float64Type>().value(row);
            (value - wanted).abs() <= ROUNDING * wanted.abs()
        }
        _ => array_value_to_string(values, row).is_ok_and(|value| value == wanted),
    }
}

/// Returns the distinct values of a column in order of appearance.
fn distinct(values: &dyn Array) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for row in (0..values.len()).filter(|&row| values.is_valid(row)) {
        let value = array_value_to_string(values, row).unwrap_or_default();
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

/// Writes a picture to a file whose name ends in `.png`.
///
/// A file with the same picture is not changed. Another PNG file is overwritten if `replace` is
/// set; a file of another kind is never overwritten.
///
/// # Errors
/// Returns an error if the name has another extension, or if the file must not be overwritten or
/// cannot be written.
pub fn write_png(path: &Path, png: &[u8], replace: bool) -> Result<(), SessionError> {
    let shown = path.display();
    let refused = |message: String| Err(SessionError::Refused(message));
    if is_stream(path) {
        return Ok(fs::write(path, png).map_err(|source| unwritten(path, source))?);
    }
    let ending = path.extension().unwrap_or_default();
    if !ending.eq_ignore_ascii_case("png") {
        return refused(format!(
            "pictures are written as PNG files, but `{shown}` does not end in `.png`; use `{}`",
            path.with_extension("png").display()
        ));
    }
    if let Some(there) = beginning(path, png.len() + 1)? {
        if there == png {
            return Ok(());
        }
        if !there.starts_with(SIGNATURE) {
            return refused(format!(
                "`{shown}` is not a PNG file and will not be overwritten; choose another file"
            ));
        }
        if !replace {
            return refused(format!("`{shown}` already exists; use `--replace` to overwrite it"));
        }
    }
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let folder = folder.unwrap_or(Path::new("."));
    Ok(write_file(path, png, Existing::Replace, folder)?)
}

/// Returns whether the path is a pipe or a device, such as `/dev/stdout`.
fn is_stream(path: &Path) -> bool {
    let metadata = path.metadata();
    metadata.is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir())
}

/// Returns up to `limit` bytes from the start of a file, or `None` if it does not exist.
fn beginning(path: &Path, limit: usize) -> Result<Option<Vec<u8>>, StoreError> {
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(limit as u64).read_to_end(&mut bytes));
    match read {
        Ok(_) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(unwritten(path, source)),
    }
}

fn unwritten(path: &Path, source: io::Error) -> StoreError {
    StoreError::Write { path: path.to_owned(), source }
}
