//! Export of maps: VTK image data for ParaView, NumPy arrays, and files of Gwyddion.
//!
//! Arrays are named in the singular: `height`, `contact`, `repulsive`, `pressure`, `gap` and
//! `displacement`. The first axis of a NumPy array is x, and the second is y, as in the library and
//! in Python. With several loads or states of a path, the load or the state is the first of three
//! axes. VTK files have x, y and z. Each node is a cell around its position, so that areas and
//! integrals over cells are those of the tables.

mod gwyddion;

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::ValueEnum;
use serde::Serialize;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::SessionError;
use super::formatting::listed;
use super::maps::{Map, MapKind, TaskMaps};
use super::output_files::{write_output, write_output_with};
use super::task_choice::ChosenLoad;
use asperity_mechanics::topography::surface::Scan;
use asperity_stages::columns::LOAD;
use asperity_stages::ensemble::prescribed_length;
use asperity_stages::per_axis::PerAxis;
use asperity_tables::key::TaskKey;
use asperity_tables::store::files::folder_of;

/// Maps of a task at one or several loads, for an export. They are computed while the files are
/// written, one load after the other, so that only the maps of one load are in memory.
pub(crate) struct Export<'m> {
    maps: &'m mut TaskMaps,
    stop: &'m AtomicBool,
    heights: Option<Map>,
    /// Quantities that depend on the load.
    kinds: Vec<MapKind>,
    /// Rows of the loads in ascending order, or of the states in the order of their path.
    rows: Vec<usize>,
    loads: Vec<f64>,
    /// Branches of the states; empty if the contact is not a path.
    branches: Vec<String>,
    /// Maps at the first load, which give the mesh and the units; empty for a surface.
    first: Vec<Map>,
    /// True if one load was asked for, whose arrays then have no axis of loads.
    is_single: bool,
}

/// NumPy array with elements that follow later, little-endian.
struct Array {
    name: &'static str,
    /// Type in NumPy's notation, such as `<f8`.
    element: String,
    shape: Vec<usize>,
}

/// Files of an export with their content.
#[derive(Debug, Serialize)]
pub(crate) struct Exported {
    pub(crate) files: Vec<PathBuf>,
    pub(crate) task: TaskKey,
    /// Names of the arrays.
    pub(crate) arrays: Vec<&'static str>,
    /// Number of nodes along x and y.
    pub(crate) nodes: PerAxis<usize>,
    pub(crate) side: PerAxis<f64>,
    pub(crate) unit: Option<String>,
    pub(crate) pressure_unit: Option<String>,
    /// Exported loads or mean gaps, in the unit of the column `load_column`.
    pub(crate) loads: Vec<f64>,
    pub(crate) load_column: Option<&'static str>,
    /// Branches of the exported states of a path.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) branches: Vec<String>,
}

/// Writes the heights of a map to a file of Gwyddion, with missing points under a mask. `unit` is
/// the unit of the heights and of the sides. Another file of Gwyddion is overwritten.
///
/// # Errors
/// Returns an error if the map needs more than 4 GB, if the path is that of a file of another kind,
/// or if the file cannot be written.
pub fn write_gwyddion(path: &Path, scan: &Scan, unit: Option<&str>) -> Result<(), SessionError> {
    let map = Map::of_heights(scan.grid(), scan.heights().to_vec(), unit.map(str::to_owned));
    let file = gwyddion::native(&[gwyddion::Channel { map: &map, mask: None }])?;
    write_output(path, &file, "Gwyddion", true)
}

/// Format of an export, which the suffix of the file names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportFormat {
    /// VTK image data of one load.
    Vti,
    /// ParaView collection with a file of VTK image data for each load.
    Pvd,
    /// One NumPy array.
    Npy,
    /// NumPy arrays with sides, loads and units.
    Npz,
    /// Gwyddion simple field of one map.
    Gsf,
    /// Gwyddion file of one load.
    Gwy,
}

impl ExportFormat {
    /// Returns the format of a file.
    ///
    /// # Errors
    /// Returns an error if no format has the suffix.
    pub(crate) fn from_path(path: &Path) -> Result<ExportFormat, SessionError> {
        let suffix = path.extension().unwrap_or_default().to_string_lossy();
        <ExportFormat as ValueEnum>::from_str(&suffix, true).map_err(|_| {
            SessionError::refused(format!(
                "`{}` must end in `.vti` (VTK, one load), `.pvd` (VTK, all loads), `.npy` \
                 (NumPy, one map), \
                 `.npz` (NumPy), `.gsf` (Gwyddion, one map) or `.gwy` (Gwyddion, one load)",
                path.display()
            ))
        })
    }
}

impl<'m> Export<'m> {
    /// Prepares the export of the maps of a task: of the quantities `kinds`, or of all that the
    /// task has, at one load or at all loads.
    ///
    /// # Errors
    /// Returns the same errors as [`TaskMaps::map`].
    pub(crate) fn new(
        maps: &'m mut TaskMaps,
        kinds: &[MapKind],
        load: Option<ChosenLoad>,
        stop: &'m AtomicBool,
    ) -> Result<Export<'m>, SessionError> {
        let kinds = if kinds.is_empty() { maps.kinds() } else { kinds.to_vec() };
        let with_heights = kinds.contains(&MapKind::Heights);
        let heights = with_heights.then(|| maps.map(MapKind::Heights, None, stop)).transpose()?;
        let others = kinds.iter().copied().filter(|kind| *kind != MapKind::Heights);
        let mut export = Export {
            stop,
            heights,
            kinds: others.collect(),
            rows: Vec::new(),
            loads: Vec::new(),
            branches: Vec::new(),
            first: Vec::new(),
            is_single: load.is_some(),
            maps,
        };
        if let Some(&kind) = export.kinds.first() {
            export.rows = match load {
                Some(load) => vec![export.maps.row(kind, Some(load))?],
                None => export.maps.rows(),
            };
            (export.loads, export.branches) = export.maps.loads(&export.rows)?;
            // Without rows, this fails with the reason.
            let first = export.rows.first().copied();
            export.first = export.at(first.map_or_else(|| export.maps.row(kind, None), Ok)?)?;
        }
        if export.first.is_empty() && export.heights.is_none() {
            return Err(SessionError::NoMap { task: export.maps.task });
        }
        Ok(export)
    }

    /// Reads or computes the maps in a row.
    fn at(&mut self, row: usize) -> Result<Vec<Map>, SessionError> {
        self.kinds.iter().map(|kind| self.maps.map_of_row(*kind, row, self.stop)).collect()
    }

    /// Writes the maps in the format of the suffix; see [`write_output`].
    ///
    /// # Errors
    /// Returns an error if the format cannot hold the maps, if a map cannot be computed, or if a
    /// file must not be overwritten or cannot be written.
    pub(crate) fn write(mut self, path: &Path, replace: bool) -> Result<Exported, SessionError> {
        let mut files = vec![path.to_owned()];
        match ExportFormat::from_path(path)? {
            ExportFormat::Vti => {
                self.check_one_load(path, "vti", "pvd")?;
                write_output(path, &self.vti(&self.first), "VTK", replace)?;
            }
            ExportFormat::Gsf => {
                self.only_array(path, "gsf", "gwy")?;
                self.check_one_load(path, "gsf", "npz")?;
                let field = gwyddion::simple_field(self.any());
                write_output(path, &field, "Gwyddion", replace)?;
            }
            ExportFormat::Gwy => {
                self.check_one_load(path, "gwy", "npz")?;
                let file = gwyddion::native(&self.gwyddion_channels())?;
                write_output(path, &file, "Gwyddion", replace)?;
            }
            ExportFormat::Pvd => {
                let folder = path.with_extension("");
                let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
                let mut collection = String::new();
                for index in 0..self.rows.len() {
                    let maps = self.at(self.rows[index])?;
                    let file = format!("{index:04}.vti");
                    // The loads of a path do not ascend.
                    let state = maps[0].state.as_ref();
                    let time = state.map_or(self.loads[index], |state| state.step as f64);
                    let _ = writeln!(
                        collection,
                        "    <DataSet timestep=\"{time}\" part=\"0\" file=\"{}/{file}\"/>",
                        escaped(&name)
                    );
                    files.push(folder.join(&file));
                    write_output(&folder.join(&file), &self.vti(&maps), "VTK", replace)?;
                }
                // The format has no unit of time.
                let time = match (self.maps.is_path(), self.load_unit()) {
                    (true, _) => "number of the state".to_owned(),
                    (false, None) => self.load_name().to_owned(),
                    (false, Some(unit)) => format!("{} in {unit}", self.load_name()),
                };
                let collection = format!(
                    "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n  \
                     <!-- timestep: {} -->\n  <Collection>\n{collection}  </Collection>\n\
                     </VTKFile>\n",
                    escaped(&time)
                );
                write_output(path, collection.as_bytes(), "VTK", replace)?;
            }
            ExportFormat::Npy => {
                let array = self.only_array(path, "npy", "npz")?;
                write_output_with(path, "NumPy", &MAGIC[..4], replace, |file| {
                    self.write_arrays(&mut [(&array, file)])
                })?;
            }
            ExportFormat::Npz => {
                write_output_with(path, "NumPy archive", b"PK\x03\x04", replace, |file| {
                    self.write_archive(file, folder_of(path))
                })?;
            }
        }
        let kinds = self.heights.iter().map(|map| map.kind).chain(self.kinds.iter().copied());
        let map = self.any();
        Ok(Exported {
            files,
            task: self.maps.task,
            arrays: kinds.map(array_name).collect(),
            nodes: PerAxis(map.grid.nodes()),
            side: PerAxis(map.grid.cell().size()),
            unit: map.length_unit.clone(),
            pressure_unit: map.pressure_unit.clone(),
            load_column: map.load_column,
            loads: self.loads,
            branches: self.branches,
        })
    }

    /// Checks that the export has one load. Otherwise the error advises to write all loads to a
    /// file with another suffix.
    fn check_one_load(&self, path: &Path, suffix: &str, of_all: &str) -> Result<(), SessionError> {
        if self.rows.len() <= 1 {
            return Ok(());
        }
        let (one, options) = if self.maps.is_path() {
            ("state", "`--load` or `--gap`")
        } else {
            ("load", "`--load`")
        };
        Err(SessionError::refused(format!(
            "a `.{suffix}` file holds one {one}, but the task has {}; choose one with {options}, \
             or write all to `{}`",
            self.rows.len(),
            path.with_extension(of_all).display()
        )))
    }

    /// Returns the only array of an export. Otherwise the error advises to write all arrays to a
    /// file with another suffix.
    fn only_array(&self, path: &Path, suffix: &str, of_all: &str) -> Result<Array, SessionError> {
        let mut arrays = self.arrays();
        match (arrays.pop(), arrays.len()) {
            (Some(array), 0) => Ok(array),
            (last, _) => Err(SessionError::refused(format!(
                "a `.{suffix}` file holds one array; choose one of {} with `--map`, or write all \
                 to `{}`",
                listed(arrays.iter().chain(&last).map(|array| array.name), "or"),
                path.with_extension(of_all).display()
            ))),
        }
    }

    /// Returns the channels of a Gwyddion file: one for each map, except that the contact is the
    /// mask of the heights if both are exported.
    fn gwyddion_channels(&self) -> Vec<gwyddion::Channel<'_>> {
        let contact = self.first.iter().find(|map| map.kind == MapKind::Contact);
        let mask = contact.filter(|_| self.heights.is_some());
        let heights = self.heights.iter().map(|map| gwyddion::Channel { map, mask });
        let others = self.first.iter().filter(|map| mask.is_none() || map.kind != MapKind::Contact);
        heights.chain(others.map(|map| gwyddion::Channel { map, mask: None })).collect()
    }

    /// Writes arrays, each to its own writer.
    fn write_arrays<W: Write>(&mut self, arrays: &mut [(&Array, W)]) -> io::Result<()> {
        for (array, writer) in arrays.iter_mut() {
            writer.write_all(&array.header())?;
        }
        let of_loads = usize::from(self.heights.is_some());
        if let (Some(heights), Some((_, writer))) = (&self.heights, arrays.first_mut()) {
            writer.write_all(&elements(heights.kind, heights.values.iter().copied()))?;
        }
        for row in self.rows.clone() {
            let maps = self.at(row).map_err(io::Error::other)?;
            for ((_, writer), map) in arrays[of_loads..].iter_mut().zip(&maps) {
                writer.write_all(&elements(map.kind, map.values.iter().copied()))?;
            }
        }
        Ok(())
    }

    /// Writes an archive of the arrays with the sides, the loads and the units. All quantities of a
    /// load are computed together, but an archive has one array after the other: they wait in
    /// temporary files in `folder`.
    fn write_archive(&mut self, file: &mut File, folder: &Path) -> io::Result<()> {
        let arrays = self.arrays();
        let mut parts = Vec::new();
        for array in &arrays {
            parts.push((array, tempfile::tempfile_in(folder)?));
        }
        self.write_arrays(&mut parts)?;
        let mut archive = ZipWriter::new(file);
        let mut add = |name: &str, length: u64, content: &mut dyn Read| {
            // With the earliest date of the format, equal maps give equal bytes.
            let options = SimpleFileOptions::default()
                .compression_method(CompressionMethod::Deflated)
                .last_modified_time(DateTime::default())
                .large_file(length >= u64::from(u32::MAX));
            archive.start_file(format!("{name}.npy"), options)?;
            io::copy(content, &mut archive)
        };
        for (array, mut part) in parts {
            let length = part.stream_position()?;
            part.rewind()?;
            add(array.name, length, &mut part)?;
        }
        for (array, elements) in self.small_arrays() {
            let bytes = [array.header(), elements].concat();
            add(array.name, bytes.len() as u64, &mut bytes.as_slice())?;
        }
        archive.finish()?;
        Ok(())
    }

    /// Returns a map that shares mesh and units with all others.
    fn any(&self) -> &Map {
        self.first.first().or(self.heights.as_ref()).expect("an export has a map")
    }

    /// Returns VTK image data with the heights and the maps of a load. Nodes are cells, of which x
    /// varies fastest. As points, they would bound one cell less along each side: filters that keep
    /// or integrate cells would give other areas and forces.
    fn vti(&self, of_load: &[Map]) -> Vec<u8> {
        let ([nodes_x, nodes_y], [step_x, step_y]) =
            (self.any().grid.nodes(), self.any().grid.spacing());
        let extent = format!("0 {nodes_x} 0 {nodes_y} 0 0");
        let [first_x, first_y] = [step_x, step_y].map(|step| -0.5 * step);
        let (mut arrays, mut data) = (String::new(), Vec::new());
        for map in self.heights.iter().chain(of_load) {
            let element = if map.kind.is_set() { "UInt8" } else { "Float64" };
            let _ = writeln!(
                arrays,
                "        <DataArray type=\"{element}\" Name=\"{}\" format=\"appended\" \
                 offset=\"{}\">{}</DataArray>",
                array_name(map.kind),
                data.len(),
                map.unit.as_deref().map_or_else(String::new, units_label),
            );
            let columns = (0..nodes_y).flat_map(|j| (0..nodes_x).map(move |i| i * nodes_y + j));
            let bytes = elements(map.kind, columns.map(|node| map.values[node]));
            data.extend((bytes.len() as u64).to_le_bytes());
            data.extend(bytes);
        }
        let number = of_load.first().and_then(|map| map.load);
        let load = number.map_or_else(String::new, |load| {
            format!(
                "    <FieldData>\n      <DataArray type=\"Float64\" Name=\"{}\" \
                 NumberOfTuples=\"1\" format=\"ascii\">{}{}</DataArray>\n    </FieldData>\n",
                self.load_name(),
                self.load_unit().map_or_else(String::new, units_label),
                load
            )
        });
        let head = format!(
            "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\">\n  <ImageData WholeExtent=\"{extent}\" \
             Origin=\"{first_x} {first_y} 0\" Spacing=\"{step_x} {step_y} {step_x}\">\n\
             {load}    <Piece Extent=\"{extent}\">\n      \
             <CellData>\n{arrays}      </CellData>\n    </Piece>\n  </ImageData>\n  \
             <AppendedData encoding=\"raw\">\n_"
        );
        let tail = b"\n  </AppendedData>\n</VTKFile>\n";
        [head.as_bytes(), &data, tail].concat()
    }

    /// Returns the name of the array of the loads.
    fn load_name(&self) -> &'static str {
        let column = self.any().load_column;
        column.filter(|name| prescribed_length(name).is_some()).unwrap_or(LOAD.name)
    }

    /// Returns the unit of the loads, if it is known.
    fn load_unit(&self) -> Option<&str> {
        self.first.first()?.load_unit.as_deref()
    }

    /// Returns the arrays of all quantities.
    fn arrays(&self) -> Vec<Array> {
        let nodes = self.any().grid.nodes();
        let of_map = |kind: MapKind, shape: Vec<usize>| {
            let element = if kind.is_set() { "|b1" } else { "<f8" };
            Array { name: array_name(kind), element: element.to_owned(), shape }
        };
        let heights = self.heights.iter().map(|_| of_map(MapKind::Heights, nodes.to_vec()));
        let loads = (!self.is_single).then_some(self.rows.len());
        let kinds = self.kinds.iter();
        let under_load = kinds.map(|kind| of_map(*kind, loads.into_iter().chain(nodes).collect()));
        heights.chain(under_load).collect()
    }

    /// Returns the arrays of the sides, the loads and the units, with their elements.
    fn small_arrays(&self) -> Vec<(Array, Vec<u8>)> {
        let map = self.any();
        let reals = |name, shape: Vec<usize>, values: &[f64]| {
            let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            (Array { name, element: "<f8".to_owned(), shape }, bytes)
        };
        let of_loads = || if self.is_single { vec![] } else { vec![self.loads.len()] };
        let mut arrays = vec![reals("side", vec![2], &map.grid.cell().size())];
        if !self.loads.is_empty() {
            arrays.push(reals(self.load_name(), of_loads(), &self.loads));
        }
        if !self.branches.is_empty() {
            arrays.push(texts("branch", of_loads(), &self.branches));
        }
        let units = [
            ("unit", &map.length_unit),
            ("pressure_unit", &map.pressure_unit),
            ("load_unit", &map.load_unit),
        ];
        let named =
            |(name, unit): (_, &Option<String>)| Some(texts(name, vec![], &[unit.clone()?]));
        arrays.extend(units.into_iter().filter_map(named));
        arrays
    }
}

/// Returns an array of texts with its elements, which have the same number of letters in a file.
fn texts(name: &'static str, shape: Vec<usize>, values: &[String]) -> (Array, Vec<u8>) {
    let letters = values.iter().map(|text| text.chars().count()).max().unwrap_or(0);
    let padded = |text: &String| {
        let characters = text.chars().map(u32::from).chain(std::iter::repeat(0)).take(letters);
        characters.flat_map(u32::to_le_bytes).collect::<Vec<_>>()
    };
    let bytes = values.iter().flat_map(padded).collect();
    (Array { name, element: format!("<U{letters}"), shape }, bytes)
}

impl Array {
    /// Returns the beginning of a file of NumPy's format 1.0, which the elements follow.
    fn header(&self) -> Vec<u8> {
        let shape: Vec<String> = self.shape.iter().map(usize::to_string).collect();
        // Python's tuple of one element ends with a comma.
        let end = if shape.len() == 1 { "," } else { "" };
        let mut header = format!(
            "{{'descr': '{}', 'fortran_order': False, 'shape': ({}{end}), }}",
            self.element,
            shape.join(", ")
        );
        // The data begin at a multiple of 64 bytes, after a line feed.
        while !(MAGIC.len() + 2 + header.len() + 1).is_multiple_of(64) {
            header.push(' ');
        }
        header.push('\n');
        let length = (header.len() as u16).to_le_bytes();
        [MAGIC, &length, header.as_bytes()].concat()
    }
}

/// Returns the elements of an array with the values of a map.
fn elements(kind: MapKind, values: impl Iterator<Item = f64>) -> Vec<u8> {
    if kind.is_set() {
        values.map(|value| value as u8).collect()
    } else {
        values.flat_map(f64::to_le_bytes).collect()
    }
}

/// First bytes of a NumPy file of version 1.0.
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// Returns the name of the array of a quantity: that of its maps in the singular.
fn array_name(kind: MapKind) -> &'static str {
    kind.name().trim_end_matches('s')
}

/// Returns the element that names the unit of an array, as VTK writes it.
fn units_label(unit: &str) -> String {
    format!(
        "<InformationKey name=\"UNITS_LABEL\" location=\"vtkDataArray\">{}</InformationKey>",
        escaped(unit)
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
