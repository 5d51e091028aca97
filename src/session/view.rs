//! Pictures of the maps of one task: plain, and animated over the loads or the states of a path.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use serde::Serialize;

use super::SessionError;
use super::formatting::{counted, short};
use super::maps::{Map, MapKind, Overlay, PathState, TaskMaps};
use super::output_files::{has_suffix, is_stream, write_output};
use super::task_choice::ChosenLoad;
use asperity_mechanics::grid::Grid;
use asperity_report::animation::{AnimationFormat, animation};
use asperity_report::map_pictures::{
    NodeValues, Quantity, StillFormat, contacts_panel, pixels, still,
};
use asperity_report::{MapPanel, Raster, Scale, digits, length_in_words, pressure_in_words};
use asperity_stages::columns::LOAD;
use asperity_stages::ensemble::prescribed_length;
use asperity_stages::per_axis::PerAxis;
use asperity_tables::key::TaskKey;

/// Number of digits of the key in file names.
const KEY_DIGITS: usize = 8;
/// Largest number of pixels of a map along one side in an animation.
const MAX_ANIMATED_PIXELS: usize = 1024;

/// Choice of what a picture shows.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(crate) struct ViewOptions {
    /// Map to draw (default: heights for surfaces, contact for loads).
    #[arg(long, value_enum)]
    map: Option<MapKind>,

    /// Draw an animation with one picture for each load, or for each state along a path, all with
    /// the same colours.
    ///
    /// Files that end in `.gif` or `.apng` are always animations.
    #[arg(long, conflicts_with_all = ["load", "gap"])]
    pub(crate) animate: bool,

    /// Time for each picture of an animation, in seconds (default: 0.08 to 0.8, by the number of
    /// pictures, and 1.5 for the last one).
    #[arg(long, value_name = "SECONDS", value_parser = hundredths)]
    pub(crate) frame_time: Option<u16>,
}

/// Parses a time in seconds as hundredths of a second, the unit of GIF files.
fn hundredths(word: &str) -> Result<u16, String> {
    let in_range = word.parse().ok().filter(|seconds| (0.02..=60.0).contains(seconds));
    let seconds: f64 = in_range.ok_or_else(|| "expected 0.02 to 60 seconds".to_owned())?;
    Ok((100.0 * seconds).round() as u16)
}

/// Picture of a map with its description.
#[derive(Debug, Serialize)]
pub(crate) struct Picture {
    /// One map, or the maps at ascending loads.
    #[serde(skip)]
    panels: Vec<MapPanel>,
    #[serde(skip)]
    is_path: bool,
    /// Branch of a path whose contacts are drawn in one map.
    #[serde(skip)]
    branch: Option<String>,
    /// File to write.
    pub(crate) file: PathBuf,
    /// Key of the requested task, which may differ from the task that contains the map.
    pub(crate) task: TaskKey,
    pub(crate) map: MapKind,
    /// Number of nodes along x and y.
    pub(crate) nodes: PerAxis<usize>,
    /// Load of the map, or `None` for heights, for contacts at all loads and for animations.
    pub(crate) load: Option<f64>,
    /// Name of the column of the load: `load` for reduced loads, `pressure` for loads in the unit
    /// of the moduli, `mean_gap` for prescribed mean gaps.
    pub(crate) load_column: Option<&'static str>,
    /// Unit of the load, or `None` if it is unknown.
    pub(crate) load_unit: Option<String>,
    /// State of a path; `None` for several states.
    #[serde(flatten)]
    pub(crate) state: Option<PathState>,
    /// Number of pictures, one for each load of an animation.
    pub(crate) pictures: usize,
    /// Smallest value of the colour scale; `None` for contacts.
    pub(crate) lowest: Option<f64>,
    /// Largest value of the colour scale; `None` for contacts.
    pub(crate) highest: Option<f64>,
    pub(crate) unit: Option<String>,
}

/// Format of a file with a picture, which its suffix names.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PictureFormat {
    name: &'static str,
    still: Option<StillFormat>,
    animation: Option<AnimationFormat>,
}

impl PictureFormat {
    /// Returns the format of a file. Streams without a suffix receive PNG.
    ///
    /// # Errors
    /// Returns an error if no format has the suffix.
    pub(crate) fn from_path(path: &Path) -> Result<PictureFormat, SessionError> {
        let formats = [
            ("png", "PNG", Some(StillFormat::Png), Some(AnimationFormat::Apng)),
            ("svg", "SVG", Some(StillFormat::Svg), None),
            ("pdf", "PDF", Some(StillFormat::Pdf), None),
            ("apng", "PNG", None, Some(AnimationFormat::Apng)),
            ("gif", "GIF", None, Some(AnimationFormat::Gif)),
        ];
        let named = formats.into_iter().find(|(suffix, ..)| has_suffix(path, suffix));
        let found = named.or(is_stream(path).then_some(formats[0]));
        let (_, name, still, animation) = found.ok_or_else(|| {
            SessionError::refused(format!(
                "`{}` must end in `.png`, `.svg`, `.pdf`, or for animations `.gif`, `.apng`",
                path.display()
            ))
        })?;
        Ok(PictureFormat { name, still, animation })
    }

    /// Returns whether files of this format are animations, whatever the options are.
    pub(crate) fn is_animation(self) -> bool {
        self.still.is_none()
    }
}

impl Picture {
    /// Draws a map of a task, or its maps at all loads.
    ///
    /// # Errors
    /// Returns the same errors as [`TaskMaps::map`].
    pub(crate) fn draw(
        maps: &mut TaskMaps,
        options: ViewOptions,
        load: Option<ChosenLoad>,
        stop: &AtomicBool,
    ) -> Result<Picture, SessionError> {
        let has_contact = maps.kinds().contains(&MapKind::Contact);
        let default = if has_contact { MapKind::Contact } else { MapKind::Heights };
        let kind = options.map.unwrap_or(default);
        let is_overlay = load.is_none() && !options.animate && maps.rows().len() != 1;
        if kind == MapKind::Contact && is_overlay {
            return Picture::of_all_contacts(maps);
        }
        let shown = shown_maps(maps, kind, load, options.animate, stop)?;
        let scales = shown.iter().map(|map| map.node_values().scale());
        let scale = scales.reduce(Scale::covering).expect("there is a map");
        let mut picture = Picture::new(maps.task, kind, shown[0].grid);
        for map in &shown {
            let panel = map.node_values().panel(map.title(), &scale);
            picture.add(panel, map.grid);
        }
        if let [map] = shown.as_slice() {
            (picture.load, picture.state) = (map.load, map.state.clone());
        }
        picture.is_path = maps.is_path();
        picture.load_column = shown[0].load_column;
        picture.load_unit.clone_from(&shown[0].load_unit);
        picture.pictures = shown.len();
        if !kind.is_set() {
            let (lowest, highest) = scale.range().into_inner();
            (picture.lowest, picture.highest) = (Some(lowest), Some(highest));
            picture.unit = Some(shown[0].unit.clone().unwrap_or_default());
        }
        Ok(picture)
    }

    /// Draws the contacts at all loads in one map.
    fn of_all_contacts(maps: &TaskMaps) -> Result<Picture, SessionError> {
        let Overlay { grid, contacts, loads, load_name, branch, length_unit } = maps.overlay()?;
        let ticks: Vec<String> = loads.iter().map(|load| digits(*load, 3)).collect();
        let along = |branch: &String| format!("contact along the {branch}");
        let title = branch.as_ref().map_or("contact at all loads".to_owned(), along);
        let is_separation = branch.as_ref().is_some_and(|name| name.starts_with("separation"));
        let changes = if is_separation { "ends" } else { "begins" };
        let label = format!("{load_name} at which contact {changes}");
        let panel = contacts_panel(title, grid, &contacts, &ticks, label, length_unit.as_deref());
        let mut picture = Picture::new(maps.task, MapKind::Contact, grid);
        picture.add(panel, grid);
        picture.branch = branch;
        Ok(picture)
    }

    fn new(task: TaskKey, map: MapKind, grid: Grid) -> Picture {
        Picture {
            panels: Vec::new(),
            is_path: false,
            branch: None,
            file: PathBuf::new(),
            task,
            map,
            nodes: PerAxis(grid.nodes()),
            load: None,
            load_column: None,
            load_unit: None,
            state: None,
            pictures: 1,
            lowest: None,
            highest: None,
            unit: None,
        }
    }

    /// Adds a map with square pixels.
    fn add(&mut self, panel: MapPanel, grid: Grid) {
        let raster = panel.raster.in_proportion(grid.cell().size());
        self.panels.push(MapPanel { raster, ..panel });
    }

    /// Returns a file name that is unique for the picture.
    pub(crate) fn file_name(&self) -> String {
        let load = self.load_in_words().map(|load| format!("-{load}"));
        let path = self.state.as_ref().map(|state| &state.branch).or(self.branch.as_ref());
        let branch = path.map(|branch| format!("-{branch}"));
        let key = &self.task.to_string()[..KEY_DIGITS];
        let [load, branch] = [load, branch].map(Option::unwrap_or_default);
        format!("{key}-{}{load}{branch}.png", self.map.name())
    }

    /// Describes the picture in one line.
    pub(crate) fn caption(&self) -> String {
        let load = match (self.map, self.load) {
            (MapKind::Heights, _) => String::new(),
            (_, Some(load)) => {
                let load = load_with_unit(load, self.load_column, self.load_unit.as_deref());
                match &self.state {
                    Some(state) => format!(" at {load} on the {}", state.branch),
                    None => format!(" at {load}"),
                }
            }
            (_, None) if self.panels.len() > 1 => {
                let one = if self.is_path { "state" } else { "load" };
                format!(" at {}", counted(self.panels.len(), one))
            }
            (_, None) => match &self.branch {
                Some(branch) => format!(" along the {branch}"),
                None => " at all loads".to_owned(),
            },
        };
        let extent = match (self.lowest, self.highest) {
            (Some(lowest), Some(highest)) => {
                let unit = self.unit.as_deref().unwrap_or_default();
                format!(", {} … {} {unit}", short(lowest), short(highest))
            }
            _ => String::new(),
        };
        let PerAxis([nodes_x, nodes_y]) = self.nodes;
        let range = extent.trim_end();
        format!("{}{load} on {nodes_x} × {nodes_y} nodes{range}", self.map.name())
    }

    /// Writes the picture with its title and bars in the format of the suffix; see
    /// [`write_output`]. `frame_time` is that of [`ViewOptions`].
    ///
    /// # Errors
    /// Returns an error if no format has the suffix, if an animation cannot have the format, if the
    /// picture is too large, or if the file must not be overwritten or cannot be written.
    pub(crate) fn write(&self, frame_time: Option<u16>, replace: bool) -> Result<(), SessionError> {
        let path = &self.file;
        let format = PictureFormat::from_path(path)?;
        let bytes = match (format.still, format.animation, self.panels.as_slice()) {
            (Some(format), _, [panel]) => still(panel, format)?,
            (_, Some(format), panels) => animation(&frames(panels)?, format, frame_time),
            _ => {
                return Err(SessionError::refused(format!(
                    "`{}` cannot hold an animation; use `.gif`, `.apng` or `.png`",
                    path.display()
                )));
            }
        };
        write_output(path, &bytes, format.name, replace)
    }

    /// Writes the map alone, one pixel for each node, as a PNG file.
    ///
    /// # Errors
    /// Returns an error if the suffix is not `.png`, for an animation, or if the file must not be
    /// overwritten or cannot be written.
    pub(crate) fn write_bare(&self, replace: bool) -> Result<(), SessionError> {
        let format = PictureFormat::from_path(&self.file)?.still;
        let (Some(StillFormat::Png), [panel]) = (format, &self.panels[..]) else {
            return Err(SessionError::refused("`--bare` writes a single PNG picture"));
        };
        write_output(&self.file, &panel.raster.to_png(), "PNG", replace)
    }

    /// Formats the load for file names: `0.1000`, or `1e8` in pascals.
    fn load_in_words(&self) -> Option<String> {
        let (load, column) = (self.load?, self.load_column?);
        Some(if column == LOAD.name { format!("{load:.4}") } else { short(load) })
    }
}

/// Returns the map of a quantity under a load, or for an animation its maps at all loads or along a
/// path. States without a gap are left out of an animation of gaps. In the contact map of a path,
/// nodes with positive pressure have the value 2.
fn shown_maps(
    maps: &mut TaskMaps,
    kind: MapKind,
    load: Option<ChosenLoad>,
    animate: bool,
    stop: &AtomicBool,
) -> Result<Vec<Map>, SessionError> {
    if animate && (kind == MapKind::Heights || load.is_some()) {
        return Err(SessionError::refused(
            "an animation shows all loads; omit `--load` and `--gap`, and choose no heights",
        ));
    }
    if kind == MapKind::Heights {
        return Ok(vec![maps.map(kind, load, stop)?]);
    }
    let mut rows = Vec::new();
    for row in if animate { maps.rows() } else { Vec::new() } {
        if kind != MapKind::Gap || !maps.is_apart(row)? {
            rows.push(row);
        }
    }
    if rows.is_empty() {
        // Of an animation, the error says what the task lacks.
        let row = maps.row(kind, load)?;
        if kind == MapKind::Gap && maps.is_apart(row)? {
            let message = "the surfaces have pulled off; choose another state or another map";
            return Err(SessionError::refused(message));
        }
        rows.push(row);
    }
    let map = |row: usize| {
        let mut map = maps.map_of_row(kind, row, stop)?;
        if kind == MapKind::Contact && maps.is_path() {
            let repulsive = maps.map_of_row(MapKind::Repulsive, row, stop)?;
            map.values.iter_mut().zip(repulsive.values).for_each(|(node, pushed)| *node += pushed);
        }
        Ok(map)
    };
    rows.into_iter().map(map).collect()
}

/// Draws the pictures of an animation.
fn frames(panels: &[MapPanel]) -> Result<Vec<Raster>, SessionError> {
    let frame = |panel: &MapPanel| {
        let raster = panel.raster.at_most(MAX_ANIMATED_PIXELS);
        Ok(pixels(&MapPanel { raster, ..panel.clone() })?)
    };
    panels.iter().map(frame).collect()
}

impl Map {
    /// Returns the values with what a picture needs to know about them.
    fn node_values(&self) -> NodeValues<'_> {
        NodeValues {
            quantity: match self.kind {
                MapKind::Heights => Quantity::Height,
                MapKind::Contact if self.state.is_some() => Quantity::AdhesiveContact,
                MapKind::Contact => Quantity::Contact,
                MapKind::Repulsive => Quantity::Repulsive,
                MapKind::Pressures => Quantity::Pressure,
                MapKind::Gap => Quantity::Gap,
                MapKind::Displacement => Quantity::Displacement,
            },
            values: &self.values,
            grid: self.grid,
            unit: self.unit.as_deref(),
            length_unit: self.length_unit.as_deref(),
            effective_modulus: self.effective_modulus.unwrap_or(1.0),
        }
    }

    /// Returns quantity, load and branch: `gap at load 0.1`, `gap at 10 MPa · separation`.
    fn title(&self) -> String {
        let name = match self.kind {
            MapKind::Repulsive => "repulsive nodes",
            kind => kind.name(),
        };
        match self.load {
            Some(load) => {
                let unit = self.load_unit.as_deref();
                let load = load_with_unit(load, self.load_column, unit);
                let branch = self.state.as_ref().map(|state| format!(" · {}", state.branch));
                format!("{name} at {load}{}", branch.unwrap_or_default())
            }
            None => name.to_owned(),
        }
    }
}

/// Formats a load in the unit of its column: `load 0.1`, or `10 MPa`.
fn load_with_unit(load: f64, column: Option<&str>, unit: Option<&str>) -> String {
    if let Some(name) = column.and_then(prescribed_length) {
        return format!("{name} {}", length_in_words(load, unit));
    }
    match unit {
        _ if column == Some(LOAD.name) => format!("load {}", digits(load, 4)),
        Some(unit) => pressure_in_words(load, unit),
        None => format!("pressure {} in the unit of E*", short(load)),
    }
}
