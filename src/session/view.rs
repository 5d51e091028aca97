//! Pictures of the heights, contacts or pressures of one task.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde::Serialize;

use super::coordinates::{Coordinate, load_as_typed};
use super::maps::{MapKind, TaskMaps};
use super::words::short;
use super::{Session, SessionError};
use asperity_contact::grid::Grid;
use asperity_report::{CONTACT, GAP, Raster, Scale};
use asperity_stages::columns::LOAD;
use asperity_stages::generate::PerAxis;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{Existing, write_file};
use asperity_tables::store::key::TaskKey;

/// Number of digits of the key in file names.
const KEY_DIGITS: usize = 8;

/// First bytes of every PNG file.
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Options of [`Session::view`] and [`finished_task`].
#[derive(Debug, Clone, Copy, Default)]
pub struct ViewOptions {
    /// Map to draw (default: heights for surfaces, contact for loads).
    pub map: Option<MapKind>,
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
    pub map: MapKind,
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

impl Session<'_> {
    /// Draws the only task of `stage` that matches all `coordinates`.
    ///
    /// # Errors
    /// Returns an error if not exactly one task matches, if the task has no such map, or on
    /// interruption by `stop`.
    pub fn view(
        &self,
        stage: &str,
        coordinates: &[Coordinate],
        options: ViewOptions,
        stop: &AtomicBool,
    ) -> Result<Picture, SessionError> {
        Picture::draw(&mut self.maps(stage, coordinates, options.load)?, options, stop)
    }
}

impl Picture {
    /// Draws a map of a task.
    ///
    /// # Errors
    /// Returns the same errors as [`TaskMaps::map`].
    pub fn draw(
        maps: &mut TaskMaps,
        options: ViewOptions,
        stop: &AtomicBool,
    ) -> Result<Picture, SessionError> {
        let default = if maps.kinds().contains(&MapKind::Contact) {
            MapKind::Contact
        } else {
            MapKind::Heights
        };
        let kind = options.map.unwrap_or(default);
        if kind == MapKind::Contact && options.load.is_none() {
            let (grid, contacts) = maps.contacts()?;
            return Ok(Picture::new(maps.task, kind, grid, Raster::from_contacts(&contacts)));
        }
        let map = maps.map(kind, options.load, stop)?;
        let (nodes, values) = (map.grid.nodes(), map.values.as_slice());
        let (raster, scale) = match kind {
            MapKind::Contact => {
                let colour = |value| if value > 0.0 { CONTACT } else { GAP };
                (Raster::from_values(nodes, values, colour), Scale::from_pressures(values))
            }
            MapKind::Pressures => {
                (Raster::from_pressures(nodes, values), Scale::from_pressures(values))
            }
            MapKind::Heights | MapKind::Gap | MapKind::Displacement => {
                (Raster::from_heights(nodes, values), Scale::from_heights(values))
            }
        };
        let mut picture = Picture::new(maps.task, kind, map.grid, raster);
        (picture.load, picture.load_column) = (map.load, map.load_column);
        if kind != MapKind::Contact {
            let (lowest, highest) = scale.range().into_inner();
            (picture.lowest, picture.highest) = (Some(lowest), Some(highest));
            picture.unit = Some(map.unit.unwrap_or_default());
        }
        Ok(picture)
    }

    fn new(task: TaskKey, map: MapKind, grid: Grid, raster: Raster) -> Picture {
        Picture {
            raster: raster.in_proportion(grid.cell().size()),
            task,
            map,
            nodes: PerAxis(grid.nodes()),
            load: None,
            load_column: None,
            lowest: None,
            highest: None,
            unit: None,
        }
    }

    /// Returns a file name that is unique for the picture.
    pub fn file_name(&self) -> String {
        let load = self.load_in_words().map(|load| format!("-{load}"));
        let key = &self.task.to_string()[..KEY_DIGITS];
        format!("{key}-{}{}.png", self.map.name(), load.unwrap_or_default())
    }

    /// Describes the picture in one line.
    pub fn caption(&self) -> String {
        let load = match (self.map, self.load_column.zip(self.load_in_words())) {
            (MapKind::Heights, _) => String::new(),
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
