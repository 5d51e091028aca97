//! One task as a picture: its heights, contacts or pressures, and which task of a study is meant.

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

use super::words::{counted, short};
use super::{DataFolder, Session, SessionError, UnknownName, names};
use asperity_contact::grid::Grid;
use asperity_contact::morphology::map::ContactMap;
use asperity_contact::threads::Threads;
use asperity_report::{Raster, Scale};
use asperity_stages::columns::{CONTACT, LOAD, PRESSURE, PRESSURES, UNIT};
use asperity_stages::ensemble::load_column;
use asperity_stages::generate::{self, PerAxis};
use asperity_stages::grids::Grids;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::{Kind, StageError};
use asperity_tables::parquet::Columns;
use asperity_tables::store::files::{Existing, write_file};
use asperity_tables::store::key::{Provenance, TaskKey};
use asperity_tables::store::{Store, StoreError};
use asperity_tables::table::Table;

/// Relative difference between a typed number and a column, since tables show rounded numbers.
const ROUNDING: f64 = 1e-3;

/// Digits of a key in the name of a file.
const KEY_DIGITS: usize = 8;

/// The first bytes of every PNG file.
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// What is drawn of a task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Map {
    Heights,
    Contact,
    Pressures,
}

/// What to draw of a task.
#[derive(Debug, Clone, Copy, Default)]
pub struct ViewOptions {
    /// The map; when left out, the heights of surfaces and the contact under loads.
    pub map: Option<Map>,
    /// The load, in the unit of the study; without it contacts at all loads, and pressures at the
    /// heaviest.
    pub load: Option<f64>,
}

/// A map as a picture.
#[derive(Debug, Serialize)]
pub struct Picture {
    #[serde(skip)]
    raster: Raster,
    /// The task that was asked for; what is drawn may be of the one that it was computed from.
    pub task: TaskKey,
    pub map: Map,
    /// Along x and y.
    pub nodes: PerAxis<usize>,
    /// The load; `None` for heights and for contacts at all loads.
    pub load: Option<f64>,
    /// The column that holds it: `load` where loads are reduced, `pressure` where they are in
    /// pascals.
    pub load_column: Option<&'static str>,
    /// What the ends of the colours mean; none where there are but two colours.
    pub lowest: Option<f64>,
    pub highest: Option<f64>,
    pub unit: Option<String>,
}

/// A column and the value that it must have.
#[derive(Debug, Clone)]
pub struct Coordinate {
    column: String,
    value: String,
}

impl Session<'_> {
    /// Draws the one task of a stage whose rows have these coordinates.
    ///
    /// # Errors
    /// When there is no such task or more than one, or it has no such map.
    pub fn view(
        &self,
        stage: &str,
        coordinates: &[Coordinate],
        options: ViewOptions,
    ) -> Result<Picture, SessionError> {
        let tables = self.tables()?;
        let task = chosen_task(stage, coordinates, options.load, &tables.table(stage)?)?;
        if !tables.reading.reader.store().has(task) {
            return Err(SessionError::NoMaps {
                task,
                store: self.data.store(),
                manifest: self.manifest.clone(),
            });
        }
        let picture =
            draw(task, options, &self.data.open_read_only()?, &tables.reading.study.sources)?;
        Ok(Picture { task, ..picture })
    }
}

/// Draws a finished task, by its key or the first digits of it.
///
/// # Errors
/// When there is no such task or more than one, or it has no such map.
pub fn finished_task(
    word: &str,
    data: &DataFolder,
    options: ViewOptions,
) -> Result<Picture, SessionError> {
    let task = names::finished(word, data)?;
    // No key knows where the files of measured surfaces lie.
    let picture = draw(task, options, &data.open_read_only()?, &SurfaceFiles::default())?;
    Ok(Picture { task, ..picture })
}

impl Picture {
    /// A name for its file, which tells it from other pictures.
    pub fn file_name(&self) -> String {
        let load = self.load_in_words().map(|load| format!("-{load}"));
        let key = &self.task.to_string()[..KEY_DIGITS];
        format!("{key}-{}{}.png", self.map.name(), load.unwrap_or_default())
    }

    /// What it shows, in a line.
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

    /// Writes it as [`write_png`] does.
    ///
    /// # Errors
    /// As [`write_png`].
    pub fn write(&self, path: &Path, replace: bool) -> Result<(), SessionError> {
        write_png(path, &self.raster.to_png(), replace)
    }

    /// The load as captions and names of files state it: `0.1000`, or `1e8` in pascals.
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

/// Draws what there is of a task, or of the one that it was computed from.
fn draw(
    key: TaskKey,
    options: ViewOptions,
    store: &Store,
    sources: &SurfaceFiles,
) -> Result<Picture, SessionError> {
    let (table, provenance) = store.read_with_provenance(key, Columns::All)?;
    let kind = Kind::ALL.into_iter().find(|kind| kind.name() == provenance.stage);
    let finished = FinishedTask { key, table, provenance };
    let load = options.load;
    match (kind, options.map) {
        (Some(Kind::Generate), None | Some(Map::Heights)) if load.is_some() => {
            Err(SessionError::Refused(
                "heights are those of the surface before it is pressed; leave out `--load`"
                    .to_owned(),
            ))
        }
        (Some(Kind::Generate), None | Some(Map::Heights)) => finished.heights(sources),
        (Some(Kind::Generate), Some(map)) => Err(SessionError::Refused(format!(
            "task {key} made a surface and knows no {}; name one that pressed it",
            map.name()
        ))),
        (Some(Kind::Solve), None | Some(Map::Contact)) => finished.contact(load),
        (Some(Kind::Solve), Some(Map::Pressures)) => finished.pressures(load),
        _ => match finished.provenance.inputs.as_slice() {
            [input] => draw(*input, options, store, sources),
            inputs => Err(SessionError::Refused(format!(
                "task {key} has no map of its own, and reads {}: name one of them",
                counted(inputs.len(), "other task")
            ))),
        },
    }
}

/// A finished task's table, and how it came about.
struct FinishedTask {
    key: TaskKey,
    table: Table,
    provenance: Provenance,
}

impl FinishedTask {
    /// Heights that were not kept are drawn again.
    fn heights(&self, sources: &SurfaceFiles) -> Result<Picture, SessionError> {
        let params: generate::Params =
            serde_json::from_str(&self.provenance.recipe).map_err(SessionError::Recipe)?;
        let surface = params.surface(&self.table, sources, &Threads::one());
        let surface = surface.map_err(|error| match error {
            StageError::Source(source) => SessionError::NotRedrawn(source),
            other => other.into(),
        })?;
        let unit = match self.table.texts(UNIT.name) {
            Ok(units) => units.value(0).to_owned(),
            Err(_) => String::new(),
        };
        let (grid, heights) = (surface.grid(), surface.heights());
        let raster = Raster::of_heights(grid.nodes(), heights);
        Ok(self.picture(Map::Heights, raster, grid).with_range(&Scale::of_heights(heights), unit))
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
            return Ok(self.picture(Map::Contact, Raster::of_contacts(&maps), grid));
        };
        let row = rows_under(&self.table, &rows, load)?[0];
        let raster = Raster::of_contact(&map(row)?);
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
            let message = "no pressures are kept of this task; the key `pressures` of its stage \
                           keeps them";
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
            self.picture(Map::Pressures, Raster::of_pressures(grid.nodes(), &pressures), grid);
        let picture = picture.with_range(&Scale::of_pressures(&pressures), String::new());
        picture.under(&self.table, row)
    }

    fn grid(&self) -> Result<Grid, SessionError> {
        Ok(Grids::of(&self.table)?.grid(0)?)
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

/// Returns those of the rows that have this load, at least one.
///
/// # Errors
/// When there is none; the message names the nearest load.
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
            let [asked, nearest] = [load, loads.value(nearest)].map(load_as_typed);
            format!(
                "no row has `{column}` = {asked}; the nearest is {nearest}, which `--load {nearest}` \
                 draws"
            )
        }
        None => "there is no load".to_owned(),
    }))
}

/// A load as a user would write it: `0.1`, `1e8`.
fn load_as_typed(load: f64) -> String {
    match (1e-4..1e6).contains(&load) {
        true => short(load),
        false => format!("{load:e}"),
    }
}

impl FromStr for Coordinate {
    type Err = String;

    fn from_str(word: &str) -> Result<Coordinate, String> {
        let (column, value) = word
            .split_once('=')
            .ok_or("a coordinate is a column and its value, as in `k_upper=32`")?;
        if [LOAD.name, PRESSURE.name].contains(&column) {
            return Err("`--load` says which load to draw".to_owned());
        }
        Ok(Coordinate { column: column.to_owned(), value: value.to_owned() })
    }
}

/// The one task of a stage that computed such rows.
fn chosen_task(
    stage: &str,
    coordinates: &[Coordinate],
    load: Option<f64>,
    table: &Table,
) -> Result<TaskKey, SessionError> {
    let mut rows: Vec<usize> = (0..table.rows()).collect();
    for coordinate in coordinates {
        rows = coordinate.among(table, &rows)?;
    }
    if let Some(load) = load.filter(|_| table.has(LOAD.name)) {
        rows = rows_under(table, &rows, load)?;
    }
    let rows = table.pick(&rows);
    let tasks = rows.texts("task")?;
    let tasks: BTreeSet<&str> = tasks.iter().flatten().collect();
    if tasks.len() == 1 {
        let key = tasks.into_iter().collect::<String>().parse();
        return Ok(key.map_err(names::TaskNameError::from)?);
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
    Err(SessionError::Refused(format!("{tasks} of `{stage}` are meant; say which by{differing}")))
}

impl Coordinate {
    /// Those of the rows that have the value; at least one.
    fn among(&self, table: &Table, rows: &[usize]) -> Result<Vec<usize>, SessionError> {
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
            let message = format!("no row has `{column}` = {value}; there is {there}");
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

/// The values of a column, each once, in order of appearance.
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
/// A file that holds the same picture stays as it is. Another PNG file is replaced if `replace` is
/// set, and a file of another kind never.
///
/// # Errors
/// When the name has another ending, the file must not be replaced, or it cannot be written.
pub fn write_png(path: &Path, png: &[u8], replace: bool) -> Result<(), SessionError> {
    let shown = path.display();
    let refused = |message: String| Err(SessionError::Refused(message));
    if is_stream(path) {
        return Ok(fs::write(path, png).map_err(|source| unwritten(path, source))?);
    }
    let ending = path.extension().unwrap_or_default();
    if !ending.eq_ignore_ascii_case("png") {
        return refused(format!(
            "pictures are written as PNG files, and `{shown}` does not end in `.png`; name `{}`",
            path.with_extension("png").display()
        ));
    }
    if let Some(there) = beginning(path, png.len() + 1)? {
        if there == png {
            return Ok(());
        }
        if !there.starts_with(SIGNATURE) {
            return refused(format!(
                "`{shown}` is not a PNG file and is not replaced; name another"
            ));
        }
        if !replace {
            return refused(format!("`{shown}` is there already; `--replace` overwrites it"));
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

/// Returns the first bytes of a file, or none if there is no such file.
fn beginning(path: &Path, most: usize) -> Result<Option<Vec<u8>>, StoreError> {
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(most as u64).read_to_end(&mut bytes));
    match read {
        Ok(_) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(unwritten(path, source)),
    }
}

fn unwritten(path: &Path, source: io::Error) -> StoreError {
    StoreError::Write { path: path.to_owned(), source }
}
