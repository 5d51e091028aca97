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

/// Creates a grid from the numbers of nodes and the sides along x and y.
pub fn grid(py: Python<'_>, nodes: [usize; 2], size: [f64; 2]) -> PyResult<Grid> {
    let grid = Cell::new(size).and_then(|cell| Grid::new(nodes, cell));
    grid.map_err(|error| surface_error(py, &error))
}

/// Returns the grid and the heights of an array, without a copy; missing heights are not finite.
///
/// The heights may be read without the global lock, as NumPy's own functions do: no other thread
/// may change the array meanwhile.
pub fn heights<'a>(
    py: Python<'_>,
    heights: &'a PyReadonlyArray2<'_, f64>,
    size: [f64; 2],
) -> PyResult<(Grid, &'a [f64])> {
    let shape = heights.shape();
    Ok((grid(py, [shape[0], shape[1]], size)?, heights.as_slice()?))
}

/// Copies an array of heights into a scan; missing heights are NaN.
pub fn scan(py: Python<'_>, array: &PyReadonlyArray2<'_, f64>, size: [f64; 2]) -> PyResult<Scan> {
    copied(py, array, size, Scan::new)
}

/// Copies an array of heights without missing points into a surface.
pub fn surface(
    py: Python<'_>,
    array: &PyReadonlyArray2<'_, f64>,
    size: [f64; 2],
) -> PyResult<Surface> {
    copied(py, array, size, Surface::new)
}

/// Copies an array of heights while other Python threads run.
fn copied<T: Send>(
    py: Python<'_>,
    array: &PyReadonlyArray2<'_, f64>,
    size: [f64; 2],
    new: fn(Grid, Vec<f64>) -> Result<T, SurfaceError>,
) -> PyResult<T> {
    let (grid, values) = heights(py, array, size)?;
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
