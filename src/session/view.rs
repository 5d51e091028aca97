//! Pictures of the maps of one task: plain, and animated over the loads or the states of a path.

use std::path::Path;
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

/// Options of [`Session::view`] and [`Picture::draw`].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ViewOptions {
    /// Map to draw (default: heights for surfaces, contact for loads).
    pub(crate) map: Option<MapKind>,
    /// Load (default: contacts at all loads, other maps at the largest load or, along a path, at
    /// the smallest mean gap).
    pub(crate) load: Option<ChosenLoad>,
    /// Draw one picture for each load, with the same colours.
    pub(crate) animate: bool,
    /// Time for each picture of an animation, in hundredths of a second (default: by the number of
    /// pictures).
    pub(crate) frame_time: Option<u16>,
}

/// Picture of a map with its description.
#[derive(Debug, Serialize)]
pub(crate) struct Picture {
    /// One map, or the maps at ascending loads.
    #[serde(skip)]
    panels: Vec<MapPanel>,
    #[serde(skip)]
    frame_time: Option<u16>,
    #[serde(skip)]
    is_path: bool,
    /// Branch of a path whose contacts are drawn in one map.
    #[serde(skip)]
    branch: Option<String>,
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PictureFormat {
    Still(StillFormat),
    Animation(AnimationFormat),
    /// PNG, or APNG for an animation.
    Png,
}

impl PictureFormat {
    /// Returns the format of a file. Streams without a suffix receive PNG.
    ///
    /// # Errors
    /// Returns an error if no format has the suffix.
    pub(crate) fn from_path(path: &Path) -> Result<PictureFormat, SessionError> {
        let formats = [
            ("png", PictureFormat::Png),
            ("svg", PictureFormat::Still(StillFormat::Svg)),
            ("pdf", PictureFormat::Still(StillFormat::Pdf)),
            ("apng", PictureFormat::Animation(AnimationFormat::Apng)),
            ("gif", PictureFormat::Animation(AnimationFormat::Gif)),
        ];
        let found = formats.into_iter().find(|(suffix, _)| has_suffix(path, suffix));
        match found {
            Some((_, format)) => Ok(format),
            None if is_stream(path) => Ok(PictureFormat::Png),
            None => Err(SessionError::refused(format!(
                "`{}` must end in `.png`, `.svg`, `.pdf`, or for animations `.gif`, `.apng`",
                path.display()
            ))),
        }
    }

    /// Returns whether files of this format are animations, whatever the options are.
    pub(crate) fn is_animation(self) -> bool {
        matches!(self, PictureFormat::Animation(_))
    }

    fn name(self) -> &'static str {
        match self {
            PictureFormat::Png
            | PictureFormat::Still(StillFormat::Png)
            | PictureFormat::Animation(AnimationFormat::Apng) => "PNG",
            PictureFormat::Still(StillFormat::Svg) => "SVG",
            PictureFormat::Still(StillFormat::Pdf) => "PDF",
            PictureFormat::Animation(AnimationFormat::Gif) => "GIF",
        }
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
        stop: &AtomicBool,
    ) -> Result<Picture, SessionError> {
        let default = if maps.kinds().contains(&MapKind::Contact) {
            MapKind::Contact
        } else {
            MapKind::Heights
        };
        let kind = options.map.unwrap_or(default);
        let is_one_state = maps.rows().len() == 1;
        let is_overlay = options.load.is_none() && !options.animate && !is_one_state;
        if kind == MapKind::Contact && is_overlay {
            return Picture::of_all_contacts(maps);
        }
        let shown = if options.animate {
            animated(maps, kind, options.load, stop)?
        } else {
            vec![still_map(maps, kind, options.load, stop)?]
        };
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
        picture.frame_time = options.frame_time;
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
        let Overlay { grid, contacts, loads, branch } = maps.overlay()?;
        let load = maps.load_in_words();
        let ticks: Vec<String> = loads.iter().map(|load| digits(*load, 3)).collect();
        let (title, changes) = match &branch {
            None => ("contact at all loads".to_owned(), "begins"),
            Some(branch) => (
                format!("contact along the {branch}"),
                if branch.starts_with("separation") { "ends" } else { "begins" },
            ),
        };
        let label = format!("{load} at which contact {changes}");
        let unit = maps.length_unit();
        let panel = contacts_panel(title, grid, &contacts, &ticks, label, unit.as_deref());
        let mut picture = Picture::new(maps.task, MapKind::Contact, grid);
        picture.add(panel, grid);
        picture.branch = branch;
        Ok(picture)
    }

    fn new(task: TaskKey, map: MapKind, grid: Grid) -> Picture {
        Picture {
            panels: Vec::new(),
            frame_time: None,
            is_path: false,
            branch: None,
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
    /// [`write_output`].
    ///
    /// # Errors
    /// Returns an error if no format has the suffix, if an animation cannot have the format, if the
    /// picture is too large, or if the file must not be overwritten or cannot be written.
    pub(crate) fn write(&self, path: &Path, replace: bool) -> Result<(), SessionError> {
        let format = PictureFormat::from_path(path)?;
        let bytes = match (format, self.panels.as_slice()) {
            (PictureFormat::Animation(format), panels) => {
                animation(&frames(panels)?, format, self.frame_time)
            }
            (PictureFormat::Png, [panel]) => still(panel, StillFormat::Png)?,
            (PictureFormat::Png, panels) => {
                animation(&frames(panels)?, AnimationFormat::Apng, self.frame_time)
            }
            (PictureFormat::Still(format), [panel]) => still(panel, format)?,
            (PictureFormat::Still(_), _) => {
                return Err(SessionError::refused(format!(
                    "`{}` cannot hold an animation; use `.gif`, `.apng` or `.png`",
                    path.display()
                )));
            }
        };
        write_output(path, &bytes, format.name(), replace)
    }

    /// Writes the map alone, one pixel for each node, as a PNG file.
    ///
    /// # Errors
    /// Returns an error if the suffix is not `.png`, for an animation, or if the file must not be
    /// overwritten or cannot be written.
    pub(crate) fn write_bare(&self, path: &Path, replace: bool) -> Result<(), SessionError> {
        let (PictureFormat::Png, [panel]) = (PictureFormat::from_path(path)?, &self.panels[..])
        else {
            return Err(SessionError::refused("`--bare` writes a single PNG picture"));
        };
        write_output(path, &panel.raster.to_png(), "PNG", replace)
    }

    /// Formats the load for file names: `0.1000`, or `1e8` in pascals.
    fn load_in_words(&self) -> Option<String> {
        let (load, column) = (self.load?, self.load_column?);
        Some(if column == LOAD.name { format!("{load:.4}") } else { short(load) })
    }
}

/// Returns the map of a quantity under a load.
fn still_map(
    maps: &mut TaskMaps,
    kind: MapKind,
    load: Option<ChosenLoad>,
    stop: &AtomicBool,
) -> Result<Map, SessionError> {
    if kind == MapKind::Heights {
        return maps.map(kind, load, stop);
    }
    let row = maps.row(kind, load)?;
    if kind == MapKind::Gap && maps.is_apart(row)? {
        return Err(SessionError::refused(
            "the surfaces have pulled off; choose another state or another map",
        ));
    }
    drawn_map(maps, kind, row, stop)
}

/// Returns the map of a quantity in a row. In the contact map of a path, nodes with positive
/// pressure have the value 2.
fn drawn_map(
    maps: &mut TaskMaps,
    kind: MapKind,
    row: usize,
    stop: &AtomicBool,
) -> Result<Map, SessionError> {
    let mut map = maps.map_of_row(kind, row, stop)?;
    if kind == MapKind::Contact && maps.is_path() {
        let repulsive = maps.map_of_row(MapKind::Repulsive, row, stop)?;
        map.values.iter_mut().zip(repulsive.values).for_each(|(node, pushed)| *node += pushed);
    }
    Ok(map)
}

/// Returns the maps of a quantity at all loads, or along a path. States without a gap are left out
/// of an animation of gaps.
fn animated(
    maps: &mut TaskMaps,
    kind: MapKind,
    load: Option<ChosenLoad>,
    stop: &AtomicBool,
) -> Result<Vec<Map>, SessionError> {
    if kind == MapKind::Heights || load.is_some() {
        return Err(SessionError::refused(
            "an animation shows all loads; omit `--load` and `--gap`, and choose no heights",
        ));
    }
    let mut rows = Vec::new();
    for row in maps.rows() {
        if kind != MapKind::Gap || !maps.is_apart(row)? {
            rows.push(row);
        }
    }
    if rows.is_empty() {
        // The error says what the task lacks.
        return Ok(vec![still_map(maps, kind, None, stop)?]);
    }
    rows.into_iter().map(|row| drawn_map(maps, kind, row, stop)).collect()
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
