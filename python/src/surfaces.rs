//! Functions that generate, read and prepare height maps.

use std::error::Error;
use std::path::PathBuf;

use asperity::direct;
use asperity::internal::surface_files::{MAX_BYTES, SurfaceFileError};
use asperity::internal::write_gwyddion as write_map;
use asperity::tables::store::regular::read_regular;
use asperity::topography_files::{Quantity, Size, SuspectNumber, is_marker};
use asperity_mechanics::topography::alignment::{Alignment, LineFit, MAX_DEGREE};
use asperity_mechanics::topography::fill::Fill;
use asperity_mechanics::topography::level::{Level, ThreePoints};
use asperity_mechanics::topography::outliers::{MAX_WINDOW, Spikes, islands};
use asperity_mechanics::topography::preparation::Crop;
use asperity_mechanics::topography::surface::{Axis, Scan, check_range};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::conversion::{self, HeightMap, map, named, scan};
use crate::errors::{direct_error, session_error, surface_error, value_error};
use crate::interruption::interruptible;
use crate::table::Table;

/// Heights of a map; NaN if missing.
type Heights<'py> = Bound<'py, PyArray2<f64>>;

/// Heights, sides, unit, rms slope, periodicity, table row and warnings of a generated surface.
type Drawn<'py> = (Heights<'py>, [f64; 2], Option<String>, f64, bool, Table, Vec<String>);

/// Generates the surface that the keys of a `generate` stage define.
#[pyfunction]
pub fn draw<'py>(
    py: Python<'py>,
    keys: &Bound<'py, PyDict>,
    realization: u32,
) -> PyResult<Drawn<'py>> {
    let keys = conversion::keys(keys)?;
    let drawn = interruptible(py, move || direct::draw(&keys, realization))?
        .map_err(|error| direct_error(py, &error))?;
    let grid = drawn.surface.grid();
    let heights = map(py, drawn.surface.into_heights(), grid.nodes())?;
    let unit = Some(drawn.unit).filter(|unit| !unit.is_empty());
    let (size, row) = (grid.cell().size(), drawn.row.into());
    Ok((heights, size, unit, drawn.rms_slope, drawn.is_periodic, row, drawn.warnings))
}

/// Reads a length with a unit, such as `100 um`, in the unit `unit` or in its own unit.
#[pyfunction]
#[pyo3(signature = (text, unit=None))]
pub fn length(py: Python<'_>, text: &str, unit: Option<&str>) -> PyResult<(f64, String)> {
    direct::length(text, unit).map_err(|error| direct_error(py, &error.into()))
}

/// Returns warnings if the heights or the sides of a map were probably read in a wrong unit.
#[pyfunction]
pub fn implausible(
    py: Python<'_>,
    heights: HeightMap<'_>,
    unit: Option<&str>,
    has_given_sides: bool,
) -> PyResult<Vec<String>> {
    let (grid, values) = conversion::heights(py, &heights)?;
    let in_unit = unit.unwrap_or_default();
    let warnings = || direct::implausible(grid, values, in_unit, has_given_sides);
    let checked = py.detach(|| check_range(grid, values).map(|()| warnings()));
    checked.map_err(|error| surface_error(py, &error))
}

/// Writes a map to a file of Gwyddion.
#[pyfunction]
pub fn write_gwyddion(
    py: Python<'_>,
    path: PathBuf,
    heights: HeightMap<'_>,
    unit: Option<&str>,
) -> PyResult<()> {
    let scan = scan(py, &heights)?;
    let written = py.detach(|| write_map(&path, &scan, unit));
    written.map_err(|error| session_error(py, &error))
}

/// Heights, sides in the unit of the heights, unit, name of the channel, names of all channels,
/// format of a file, and notes for warnings.
type Read<'py> = (
    Heights<'py>,
    Option<[f64; 2]>,
    Option<String>,
    String,
    Vec<String>,
    &'static str,
    Vec<String>,
);

/// Reads a channel of a topography file.
#[pyfunction]
#[pyo3(signature = (path, channel=None, missing=None, mask=true))]
pub fn read<'py>(
    py: Python<'py>,
    path: PathBuf,
    channel: Option<String>,
    missing: Option<f64>,
    mask: bool,
) -> PyResult<Read<'py>> {
    let read = py.detach(|| read_regular(&path, MAX_BYTES));
    let bytes = read.map_err(|source| match source.raw_os_error() {
        Some(_) => source.into(),
        None => surface_error(py, &SurfaceFileError::Read { path: path.clone(), source }),
    })?;
    let parsed = py.detach(|| asperity::topography_files::read(&bytes));
    let file = parsed.map_err(|error| surface_error(py, &error))?;
    let index = match &channel {
        Some(wanted) => file.find(wanted).map_err(|error| {
            let names: Vec<String> =
                file.channels().iter().map(|channel| format!("`{}`", channel.name())).collect();
            value_error(py, format!("{error}; available channels: {}", names.join(", ")))
        })?,
        None => file.default_channel().map(|one| one.index).ok_or_else(|| {
            let message = format!(
                "`{}` has no channel of heights; name a channel with `channel`",
                path.display()
            );
            value_error(py, message)
        })?,
    };
    let channels = file.channels();
    let masked = &channels[index];
    let chosen = &if mask { masked.clone() } else { masked.clone().without_mask() };
    let unit = chosen.unit().map(str::to_owned);
    // Ignore sides whose unit differs from the unit of the heights.
    let size = match (chosen.quantity(), chosen.size()) {
        (Quantity::Unitless, Size::Unitless(sides)) => Some(sides),
        (Quantity::Height | Quantity::Other(_), Size::Metres(sides)) => Some(sides),
        _ => None,
    };
    let decode = || missing.map_or_else(|| chosen.map(), |marker| chosen.map_without(marker));
    let (decoded, suspect) = py.detach(|| (decode(), chosen.suspect_number()));
    let notes = chosen.notes().into_iter();
    // Notes name keys of a manifest.
    let mut notes: Vec<String> =
        notes.map(|note| note.replace("`mask = false`", "`mask=False`")).collect();
    let default = file.default_channel().filter(|one| channel.is_none() && one.is_ambiguous);
    notes.extend(default.map(|one| {
        let (number, name) = (one.index + 1, chosen.name());
        format!("channel {number}, `{name}`, is read, {}; choose one with `channel`", one.reason)
    }));
    if let Some(SuspectNumber { number, count, .. }) = suspect
        && missing.is_none_or(|marker| !is_marker(number, marker))
    {
        notes.push(format!(
            "{count} points have the number {number:?}, far from all others; if it marks points \
             without a height, give `missing={number:?}`"
        ));
    }
    let nodes = decoded.nodes();
    let (heights, _) = decoded.into_parts();
    let names = channels.iter().map(|channel| channel.name().to_owned());
    Ok((
        map(py, heights, nodes)?,
        size,
        unit,
        chosen.name().to_owned(),
        names.collect(),
        file.format().name(),
        notes,
    ))
}

/// Subtracts a form, such as the mean plane.
#[pyfunction]
pub fn level<'py>(py: Python<'py>, heights: HeightMap<'py>, form: &str) -> PyResult<Heights<'py>> {
    let forms = [Level::None, Level::Mean, Level::Plane, Level::Quadric];
    let form = named(py, "form", forms.map(|form| (form.name(), form)), form)?;
    changed(py, &heights, |scan| Ok(form.level(scan)))
}

/// Subtracts the plane through the heights at three positions.
#[pyfunction]
pub fn level_through<'py>(
    py: Python<'py>,
    heights: HeightMap<'py>,
    points: [[f64; 2]; 3],
) -> PyResult<Heights<'py>> {
    let [a, b, c] = points;
    changed(py, &heights, |scan| Ok(ThreePoints { a, b, c }.level(&scan, [0, 0])?))
}

/// Subtracts a function of each scan line from that line.
#[pyfunction]
pub fn align<'py>(
    py: Python<'py>,
    heights: HeightMap<'py>,
    by: &str,
    along: &str,
    degree: u32,
) -> PyResult<Heights<'py>> {
    if degree > MAX_DEGREE {
        let message = format!("degree is {degree}, but must be from 0 to {MAX_DEGREE}");
        return Err(value_error(py, message));
    }
    let fits = [LineFit::Median, LineFit::Differences, LineFit::Polynomial { degree }];
    let by = named(py, "by", fits.map(|fit| (fit.name(), fit)), by)?;
    let along = named(py, "along", Axis::BOTH.map(|axis| (axis.name(), axis)), along)?;
    changed(py, &heights, |scan| Ok(Alignment { along, by }.align(&scan)))
}

/// Makes the spikes of a map missing.
#[pyfunction]
pub fn remove_spikes<'py>(
    py: Python<'py>,
    heights: HeightMap<'py>,
    threshold: f64,
    window: u32,
    is_periodic: bool,
) -> PyResult<Heights<'py>> {
    let is_odd = (3..=MAX_WINDOW).contains(&window) && !window.is_multiple_of(2);
    if threshold.is_nan() || threshold <= 0.0 || !is_odd {
        let message = format!(
            "threshold is {threshold} and window is {window}, but the threshold must be positive, and the \
             window an odd number from 3 to {MAX_WINDOW}"
        );
        return Err(value_error(py, message));
    }
    changed(py, &heights, |scan| {
        let found = Spikes { threshold, window }.find(&scan, is_periodic);
        Ok(scan.without(&found))
    })
}

/// Makes groups of at most `limit` points that missing points surround missing.
#[pyfunction]
pub fn remove_islands<'py>(
    py: Python<'py>,
    heights: HeightMap<'py>,
    limit: usize,
    is_periodic: bool,
) -> PyResult<Heights<'py>> {
    changed(py, &heights, |scan| {
        let found = islands(&scan, limit, is_periodic);
        Ok(scan.without(&found))
    })
}

/// Fills missing points with heights.
#[pyfunction]
pub fn fill<'py>(
    py: Python<'py>,
    heights: HeightMap<'py>,
    method: &str,
    is_periodic: bool,
) -> PyResult<Heights<'py>> {
    let methods = [Fill::Harmonic, Fill::Nearest, Fill::Lowest];
    let method = named(py, "method", methods.map(|method| (method.name(), method)), method)?;
    changed(py, &heights, |scan| Ok(method.fill(scan, is_periodic)?.into()))
}

/// Returns the heights of a changed copy of a map; other Python threads run while `change` does.
fn changed<'py>(
    py: Python<'py>,
    heights: &HeightMap<'py>,
    change: impl FnOnce(Scan) -> Result<Scan, Box<dyn Error + Send + Sync>> + Send,
) -> PyResult<Heights<'py>> {
    let scan = scan(py, heights)?;
    let changed = py.detach(|| change(scan)).map_err(|error| surface_error(py, &*error))?;
    map(py, changed.heights().to_vec(), changed.grid().nodes())
}

/// Returns a part of a map and its sides.
#[pyfunction]
pub fn crop<'py>(
    py: Python<'py>,
    heights: HeightMap<'py>,
    from: [f64; 2],
    part: [f64; 2],
) -> PyResult<(Heights<'py>, [f64; 2])> {
    let scan = scan(py, &heights)?;
    let window = Crop { from, size: part }.window(scan.grid());
    let part = scan.cropped(window.map_err(|error| surface_error(py, &error))?);
    let grid = part.grid();
    let heights = map(py, part.heights().to_vec(), grid.nodes())?;
    Ok((heights, grid.cell().size()))
}
