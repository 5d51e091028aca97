//! Conversion of numbers, texts and arrays between Python and the library.

use std::num::NonZeroUsize;

use asperity_mechanics::grid::{Cell, Grid};
use asperity_mechanics::topography::surface::{Scan, Surface, SurfaceError, check_range};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyOverflowError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};
use toml::{Table, Value};

use crate::errors::{surface_error, value_error};

/// Converts the keys of a stage; omits keys that are `None`.
pub fn keys(dict: &Bound<'_, PyDict>) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, value) in dict {
        if !value.is_none() {
            table.insert(key.extract()?, toml_value(&value)?);
        }
    }
    Ok(table)
}

/// Converts a Python value, including values of NumPy and `pathlib`, to a TOML value.
fn toml_value(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if let Ok(truth) = value.cast::<PyBool>() {
        return Ok(Value::Boolean(truth.is_true()));
    }
    if value.is_instance_of::<PyInt>() {
        let number = value.extract().map_err(|_| {
            PyOverflowError::new_err(format!(
                "{value} is too large for a manifest; use a 64-bit integer"
            ))
        });
        return Ok(Value::Integer(number?));
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(Value::Float(value.extract()?));
    }
    if value.is_instance_of::<PyString>() {
        return Ok(Value::String(value.extract()?));
    }
    if let Ok(dict) = value.cast::<PyDict>() {
        return Ok(Value::Table(keys(dict)?));
    }
    if value.hasattr("__fspath__")? {
        return toml_value(&value.call_method0("__fspath__")?);
    }
    // Arrays and numbers of NumPy.
    if value.hasattr("tolist")? {
        return toml_value(&value.call_method0("tolist")?);
    }
    if let Ok(items) = value.try_iter() {
        let values = items.map(|item| toml_value(&item?));
        return Ok(Value::Array(values.collect::<PyResult<_>>()?));
    }
    let kind = value.get_type().name()?;
    let message = format!("{value} has the type `{kind}`, which a manifest cannot contain");
    Err(PyTypeError::new_err(message))
}

/// Array of heights, with the sides of the map.
pub type HeightMap<'py> = (PyReadonlyArray2<'py, f64>, [f64; 2]);

/// Returns the grid and the heights of a map, without a copy; missing heights are not finite.
///
/// The heights may be read without the global lock, as NumPy's own functions do: no other thread
/// may change the array meanwhile.
pub fn heights<'a>(py: Python<'_>, map: &'a HeightMap<'_>) -> PyResult<(Grid, &'a [f64])> {
    let (array, size) = map;
    let nodes = [array.shape()[0], array.shape()[1]];
    let grid = Cell::new(*size).and_then(|cell| Grid::new(nodes, cell));
    Ok((grid.map_err(|error| surface_error(py, &error))?, array.as_slice()?))
}

/// Copies a map into a scan; missing heights are NaN.
pub fn scan(py: Python<'_>, map: &HeightMap<'_>) -> PyResult<Scan> {
    copied(py, map, Scan::new)
}

/// Copies a map without missing points into a surface.
pub fn surface(py: Python<'_>, map: &HeightMap<'_>) -> PyResult<Surface> {
    copied(py, map, Surface::new)
}

/// Copies a map while other Python threads run.
fn copied<T: Send>(
    py: Python<'_>,
    map: &HeightMap<'_>,
    new: fn(Grid, Vec<f64>) -> Result<T, SurfaceError>,
) -> PyResult<T> {
    let (grid, values) = heights(py, map)?;
    let made = py.detach(|| check_range(grid, values).and_then(|()| new(grid, values.to_vec())));
    made.map_err(|error| surface_error(py, &error))
}

/// Maximum value of the argument `jobs`, as on the command line.
const MAX_JOBS: usize = 1024;

/// Checks a number of cores; `None` stands for all cores.
pub fn jobs(py: Python<'_>, jobs: Option<usize>) -> PyResult<Option<NonZeroUsize>> {
    let checked = jobs.map(|jobs| {
        let bounded = NonZeroUsize::new(jobs).filter(|jobs| jobs.get() <= MAX_JOBS);
        bounded.ok_or_else(|| {
            let message = format!("`jobs` is {jobs}, but must be from 1 to {MAX_JOBS}");
            value_error(py, message)
        })
    });
    checked.transpose()
}

/// Converts a map to an array [x, y] without a copy.
pub fn map<T: numpy::Element>(
    py: Python<'_>,
    values: Vec<T>,
    nodes: [usize; 2],
) -> PyResult<Bound<'_, PyArray2<T>>> {
    PyArray1::from_vec(py, values).reshape(nodes)
}

/// Returns the item of `all` whose name is `wanted`.
pub fn named<T, const N: usize>(
    py: Python<'_>,
    what: &str,
    all: [(&str, T); N],
    wanted: &str,
) -> PyResult<T> {
    let names = all.each_ref().map(|(name, _)| format!("\"{name}\"")).join(", ");
    let found = all.into_iter().find(|(name, _)| *name == wanted);
    let message = || format!("unknown {what} \"{wanted}\"; use one of {names}");
    found.map(|(_, item)| item).ok_or_else(|| value_error(py, message()))
}
