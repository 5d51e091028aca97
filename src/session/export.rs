//! Export of maps: VTK image data for ParaView, and NumPy arrays.
//!
//! Arrays are named in the singular: `height`, `contact`, `pressure`, `gap` and `displacement`. The
//! first axis of a NumPy array is x, and the second is y, as in the library and in Python. With
//! several loads, the load is the first of three axes. VTK files have x, y and z, with one node
//! along z.

use std::fmt::Write as _;
use std::io::{self, Cursor, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use serde::Serialize;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::SessionError;
use super::coordinates::ChosenLoad;
use super::maps::{Map, MapKind, TaskMaps};
use super::outputs::{has_suffix, write_output};
use super::words::listed;
use asperity_contact::grid::Grid;
use asperity_stages::generate::PerAxis;
use asperity_tables::store::key::TaskKey;

/// Maps of a task at one or several loads, for an export.
pub struct ExportedMaps {
    task: TaskKey,
    grid: Grid,
    length_unit: Option<String>,
    pressure_unit: Option<String>,
    load_column: Option<&'static str>,
    heights: Option<Map>,
    /// Maps under each load, in ascending order.
    loads: Vec<LoadMaps>,
    /// True if one load was asked for, whose arrays then have no axis of loads.
    is_single: bool,
}

struct LoadMaps {
    load: f64,
    maps: Vec<Map>,
}

/// Elements of a NumPy array, little-endian.
struct Array {
    name: &'static str,
    /// Type in NumPy's notation, such as `<f8`.
    element: String,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

/// Files of an export with their content.
#[derive(Debug, Serialize)]
pub struct Exported {
    pub files: Vec<PathBuf>,
    pub task: TaskKey,
    /// Names of the arrays.
    pub arrays: Vec<&'static str>,
    /// Number of nodes along x and y.
    pub nodes: PerAxis<usize>,
    pub side: PerAxis<f64>,
    pub unit: Option<String>,
    pub pressure_unit: Option<String>,
    /// Exported loads, in the unit of the column `load_column`.
    pub loads: Vec<f64>,
    pub load_column: Option<&'static str>,
}

/// Format of an export, which the suffix of the file names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExportFormat {
    /// VTK image data of one load.
    Vti,
    /// ParaView collection with a file of VTK image data for each load.
    Pvd,
    /// One NumPy array.
    Npy,
    /// NumPy arrays with sides, loads and units.
    Npz,
}

impl ExportFormat {
    /// Returns the format of a file.
    ///
    /// # Errors
    /// Returns an error if no format has the suffix.
    pub fn from_path(path: &Path) -> Result<ExportFormat, SessionError> {
        let formats = [
            ("vti", ExportFormat::Vti),
            ("pvd", ExportFormat::Pvd),
            ("npy", ExportFormat::Npy),
            ("npz", ExportFormat::Npz),
        ];
        let found = formats.into_iter().find(|(suffix, _)| has_suffix(path, suffix));
        found.map(|(_, format)| format).ok_or_else(|| {
            SessionError::Refused(format!(
                "the format of `{}` is unknown; maps are exported to files that end in `.vti` (VTK, \
                 one load), `.pvd` (VTK, all loads), `.npy` (NumPy, one map) or `.npz` (NumPy); \
                 `asperity table --csv` prints tables, and `asperity view` draws pictures",
                path.display()
            ))
        })
    }
}

impl ExportedMaps {
    /// Reads or computes the maps of a task: of the quantities `kinds`, or of all that the task
    /// has, at one load or at all loads.
    ///
    /// # Errors
    /// Returns the same errors as [`TaskMaps::map`].
    pub fn read(
        maps: &mut TaskMaps,
        kinds: &[MapKind],
        load: Option<ChosenLoad>,
        stop: &AtomicBool,
    ) -> Result<ExportedMaps, SessionError> {
        let kinds = if kinds.is_empty() { maps.kinds() } else { kinds };
        let heights = kinds.contains(&MapKind::Heights);
        let heights = heights.then(|| maps.map(MapKind::Heights, None, stop)).transpose()?;
        let under_load = || kinds.iter().filter(|kind| **kind != MapKind::Heights);
        let loads = match load {
            Some(load) => vec![Some(load)],
            None => maps.loads()?.into_iter().map(|load| Some(load.into())).collect(),
        };
        // Without loads, the map of the first quantity fails with the reason.
        let loads = if loads.is_empty() && under_load().count() > 0 { vec![None] } else { loads };
        let mut exported = Vec::new();
        for load in loads {
            let of_load = under_load().map(|kind| maps.map(*kind, load, stop));
            let of_load: Vec<Map> = of_load.collect::<Result<_, _>>()?;
            if let Some(load) = of_load.first().and_then(|map| map.load) {
                exported.push(LoadMaps { load, maps: of_load });
            }
        }
        let first = exported.first().map(|of| &of.maps[0]).or(heights.as_ref());
        let first = first.ok_or(SessionError::NoMap { task: maps.task })?;
        Ok(ExportedMaps {
            task: maps.task,
            grid: first.grid,
            length_unit: first.length_unit.clone(),
            pressure_unit: first.pressure_unit.clone(),
            load_column: first.load_column,
            heights,
            loads: exported,
            is_single: load.is_some(),
        })
    }

    /// Writes the maps in the format of the suffix; see [`write_output`].
    ///
    /// # Errors
    /// Returns an error if the format cannot hold the maps, or if a file must not be overwritten or
    /// cannot be written.
    pub fn write(&self, path: &Path, replace: bool) -> Result<Exported, SessionError> {
        let mut files = vec![path.to_owned()];
        match ExportFormat::from_path(path)? {
            ExportFormat::Vti => {
                if self.loads.len() > 1 {
                    return Err(SessionError::Refused(format!(
                        "a `.vti` file holds one load, but the task has {}; choose one with \
                         `--load`, or write all to `{}`",
                        self.loads.len(),
                        path.with_extension("pvd").display()
                    )));
                }
                write_output(path, &self.vti(self.loads.first()), "VTK", replace)?;
            }
            ExportFormat::Pvd => {
                let folder = path.with_extension("");
                let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
                let mut collection = String::new();
                for (index, of) in self.loads.iter().enumerate() {
                    let file = format!("{index:04}.vti");
                    let _ = writeln!(
                        collection,
                        "    <DataSet timestep=\"{}\" part=\"0\" file=\"{}/{file}\"/>",
                        of.load,
                        escaped(&name)
                    );
                    files.push(folder.join(&file));
                    write_output(&folder.join(&file), &self.vti(Some(of)), "VTK", replace)?;
                }
                let collection = format!(
                    "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n  \
                     <Collection>\n{collection}  </Collection>\n</VTKFile>\n"
                );
                write_output(path, collection.as_bytes(), "VTK", replace)?;
            }
            ExportFormat::Npy => {
                let arrays = self.arrays();
                let [array] = arrays.as_slice() else {
                    return Err(SessionError::Refused(format!(
                        "a `.npy` file holds one array; choose one of {} with `--map`, or write \
                         all to `{}`",
                        listed(arrays.iter().map(|array| array.name), "or"),
                        path.with_extension("npz").display()
                    )));
                };
                write_output(path, &array.npy(), "NumPy", replace)?;
            }
            ExportFormat::Npz => write_output(path, &self.npz(), "NumPy archive", replace)?,
        }
        Ok(self.exported(files))
    }

    fn exported(&self, files: Vec<PathBuf>) -> Exported {
        Exported {
            files,
            task: self.task,
            arrays: self.kinds().map(array_name).collect(),
            nodes: PerAxis(self.grid.nodes()),
            side: PerAxis(self.grid.cell().size()),
            unit: self.length_unit.clone(),
            pressure_unit: self.pressure_unit.clone(),
            loads: self.loads.iter().map(|of| of.load).collect(),
            load_column: self.load_column,
        }
    }

    fn kinds(&self) -> impl Iterator<Item = MapKind> {
        let of_load = self.loads.first().map_or(&[][..], |of| &of.maps);
        self.heights.iter().chain(of_load).map(|map| map.kind)
    }

    /// Returns VTK image data with the heights and the maps of a load. Nodes are points, of which x
    /// varies fastest.
    fn vti(&self, of: Option<&LoadMaps>) -> Vec<u8> {
        let ([nodes_x, nodes_y], [step_x, step_y]) = (self.grid.nodes(), self.grid.spacing());
        let extent = format!("0 {} 0 {} 0 0", nodes_x - 1, nodes_y - 1);
        let (mut arrays, mut data) = (String::new(), Vec::new());
        for map in self.heights.iter().chain(of.map_or(&[][..], |of| &of.maps)) {
            let is_flag = map.kind == MapKind::Contact;
            let element = if is_flag { "UInt8" } else { "Float64" };
            let _ = writeln!(
                arrays,
                "        <DataArray type=\"{element}\" Name=\"{}\" format=\"appended\" \
                 offset=\"{}\">{}</DataArray>",
                array_name(map.kind),
                data.len(),
                map.unit.as_deref().map_or_else(String::new, units_label),
            );
            let columns = (0..nodes_y).flat_map(|j| (0..nodes_x).map(move |i| i * nodes_y + j));
            let values = columns.map(|node| map.values[node]);
            let bytes: Vec<u8> = if is_flag {
                values.map(|value| value as u8).collect()
            } else {
                values.flat_map(f64::to_le_bytes).collect()
            };
            data.extend((bytes.len() as u64).to_le_bytes());
            data.extend(bytes);
        }
        let load = of.map_or_else(String::new, |of| {
            format!(
                "    <FieldData>\n      <DataArray type=\"Float64\" Name=\"load\" \
                 NumberOfTuples=\"1\" format=\"ascii\">{}</DataArray>\n    </FieldData>\n",
                of.load
            )
        });
        let head = format!(
            "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\">\n  <ImageData WholeExtent=\"{extent}\" Origin=\"0 0 0\" \
             Spacing=\"{step_x} {step_y} {step_x}\">\n{load}    <Piece Extent=\"{extent}\">\n      \
             <PointData>\n{arrays}      </PointData>\n    </Piece>\n  </ImageData>\n  \
             <AppendedData encoding=\"raw\">\n_"
        );
        let tail = b"\n  </AppendedData>\n</VTKFile>\n";
        [head.as_bytes(), &data, tail].concat()
    }

    /// Returns the arrays of all quantities.
    fn arrays(&self) -> Vec<Array> {
        let nodes = self.grid.nodes();
        let heights = self.heights.iter().map(|map| Array::of_maps(&[map], nodes.to_vec()));
        let quantities = self.loads.first().map_or(0, |of| of.maps.len());
        let under_load = (0..quantities).map(|index| {
            let maps: Vec<&Map> = self.loads.iter().map(|of| &of.maps[index]).collect();
            let loads = (!self.is_single).then_some(maps.len());
            Array::of_maps(&maps, loads.into_iter().chain(nodes).collect())
        });
        heights.chain(under_load).collect()
    }

    /// Returns an archive of the arrays with the sides, the loads and the units.
    fn npz(&self) -> Vec<u8> {
        let mut arrays = self.arrays();
        arrays.push(Array::of_reals("side", vec![2], self.grid.cell().size()));
        if !self.loads.is_empty() {
            let shape = if self.is_single { vec![] } else { vec![self.loads.len()] };
            arrays.push(Array::of_reals("load", shape, self.loads.iter().map(|of| of.load)));
        }
        let units = [("unit", &self.length_unit), ("pressure_unit", &self.pressure_unit)];
        let units = units.into_iter().filter_map(|(name, unit)| Some((name, unit.as_deref()?)));
        arrays.extend(units.map(|(name, unit)| Array::of_text(name, unit)));
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        // With the earliest date of the format, equal maps give equal bytes.
        let options = |length: usize| {
            SimpleFileOptions::default()
                .compression_method(CompressionMethod::Deflated)
                .last_modified_time(DateTime::default())
                .large_file(length >= u32::MAX as usize)
        };
        for array in arrays {
            let bytes = array.npy();
            let name = format!("{}.npy", array.name);
            let started = archive.start_file(name, options(bytes.len()));
            let written =
                started.map_err(io::Error::other).and_then(|()| archive.write_all(&bytes));
            written.expect("writing to memory cannot fail");
        }
        archive.finish().expect("writing to memory cannot fail").into_inner()
    }
}

impl Array {
    fn of_maps(maps: &[&Map], shape: Vec<usize>) -> Array {
        let name = array_name(maps[0].kind);
        let values = maps.iter().flat_map(|map| map.values.iter().copied());
        if maps[0].kind == MapKind::Contact {
            let bytes = values.map(|value| value as u8).collect();
            return Array { name, element: "|b1".to_owned(), shape, bytes };
        }
        Array::of_reals(name, shape, values)
    }

    fn of_reals(
        name: &'static str,
        shape: Vec<usize>,
        values: impl IntoIterator<Item = f64>,
    ) -> Array {
        let bytes = values.into_iter().flat_map(f64::to_le_bytes).collect();
        Array { name, element: "<f8".to_owned(), shape, bytes }
    }

    fn of_text(name: &'static str, text: &str) -> Array {
        let bytes = text.chars().flat_map(|letter| u32::from(letter).to_le_bytes()).collect();
        Array { name, element: format!("<U{}", text.chars().count()), shape: vec![], bytes }
    }

    /// Returns the array as a file of NumPy's format 1.0.
    fn npy(&self) -> Vec<u8> {
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
        [MAGIC, &length, header.as_bytes(), &self.bytes].concat()
    }
}

/// First bytes of a NumPy file of version 1.0.
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// Returns the name of the array of a quantity.
fn array_name(kind: MapKind) -> &'static str {
    match kind {
        MapKind::Heights => "height",
        MapKind::Contact => "contact",
        MapKind::Pressures => "pressure",
        MapKind::Gap => "gap",
        MapKind::Displacement => "displacement",
    }
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
