//! Tables for Python, with Arrow's PyCapsule interface.

use arrow::array::{Array, AsArray};
use arrow::datatypes::{DataType, Float64Type, Int64Type};
use arrow::ffi::FFI_ArrowSchema;
use arrow::ffi_stream::FFI_ArrowArrayStream;
use arrow::record_batch::RecordBatchIterator;
use arrow::util::display::array_value_to_string;
use asperity::session::TableUnits;
use asperity::tables::table;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyList};

use crate::errors::{surface_error, unknown_name};

/// Table whose columns have units and meanings.
#[pyclass(frozen, module = "asperity._asperity")]
pub struct Table(table::Table);

impl From<table::Table> for Table {
    fn from(table: table::Table) -> Table {
        Table(table)
    }
}

#[pymethods]
impl Table {
    /// Exports the rows as an Arrow stream that shares the memory of the table.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // The interface permits ignoring the requested types; the consumer must cast.
        drop(requested_schema);
        let batch = self.0.batch().clone();
        let schema = batch.schema();
        let stream = RecordBatchIterator::new([Ok(batch)], schema);
        let stream = FFI_ArrowArrayStream::new(Box::new(stream));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }

    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.0.batch().schema().as_ref())
            .map_err(|error| surface_error(py, &error))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema")
    }

    fn rows(&self) -> usize {
        self.0.rows()
    }

    fn names(&self) -> Vec<String> {
        self.0.names().into_iter().map(str::to_owned).collect()
    }

    /// Returns name, type, role, unit and meaning of every column.
    ///
    /// If all rows have the same units of length and pressure, the units are named.
    fn descriptions(&self) -> Vec<(String, &'static str, String, String, String)> {
        let units = TableUnits::from_table(&self.0);
        let described = self.0.descriptions_in_units().into_iter().map(|column| {
            let unit = units.name(&column.unit);
            (column.name, column.kind, column.role, unit, column.meaning)
        });
        described.collect()
    }

    /// Returns a copy of a column: a NumPy array with NaN for nulls, or a Python list of texts,
    /// bytes or lists.
    fn column<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let Some(array) = self.0.batch().column_by_name(name) else {
            let message = format!(
                "the table has no column `{name}`; available: {}",
                self.0.names().join(", ")
            );
            return Err(unknown_name(py, message));
        };
        values(py, array.as_ref())
    }

    /// Returns the memory address of the first value of a column, to test that readers do not copy.
    fn address(&self, name: &str) -> Option<usize> {
        let array = self.0.batch().column_by_name(name)?.to_data();
        Some(array.buffers().first()?.as_ptr() as usize)
    }

    /// Formats the first rows as text.
    fn cells(&self, rows: usize) -> Vec<Vec<String>> {
        let batch = self.0.batch();
        let cell = |array: &dyn Array, row: usize| match array.data_type() {
            _ if array.is_null(row) => String::new(),
            DataType::Float64 => {
                let number = array.as_primitive::<Float64Type>().value(row);
                format!("{number:.6e}").parse().map_or(String::new(), |n: f64| n.to_string())
            }
            DataType::LargeBinary => format!("{} bytes", array.as_binary::<i64>().value(row).len()),
            DataType::LargeList(_) => format!("{} values", array.as_list::<i64>().value(row).len()),
            _ => array_value_to_string(array, row).unwrap_or_default(),
        };
        let line = |row: usize| {
            let columns = batch.columns().iter();
            columns.map(|array| cell(array.as_ref(), row)).collect()
        };
        (0..rows.min(self.0.rows())).map(line).collect()
    }
}

fn values<'py>(py: Python<'py>, array: &dyn Array) -> PyResult<Bound<'py, PyAny>> {
    let list = |values: Vec<Option<Bound<'py, PyAny>>>| Ok(PyList::new(py, values)?.into_any());
    match array.data_type() {
        DataType::Float64 => Ok(reals(py, array)),
        DataType::Int64 if array.null_count() == 0 => {
            let values = array.as_primitive::<Int64Type>().values();
            Ok(PyArray1::from_slice(py, values).into_any())
        }
        DataType::Int64 => {
            let integers = array.as_primitive::<Int64Type>().iter();
            let values = integers.map(|value| value.map_or(f64::NAN, |value| value as f64));
            Ok(PyArray1::from_iter(py, values).into_any())
        }
        DataType::Boolean if array.null_count() == 0 => {
            let values = array.as_boolean().iter().flatten();
            Ok(PyArray1::from_vec(py, values.collect::<Vec<bool>>()).into_any())
        }
        DataType::Boolean => {
            let values: Vec<Option<bool>> = array.as_boolean().iter().collect();
            Ok(PyList::new(py, values)?.into_any())
        }
        DataType::LargeBinary => {
            let values = array.as_binary::<i64>().iter();
            list(values.map(|bytes| Some(PyBytes::new(py, bytes?).into_any())).collect())
        }
        DataType::LargeList(_) => {
            let values = array.as_list::<i64>().iter();
            list(values.map(|values| Some(reals(py, values?.as_ref()))).collect())
        }
        _ => {
            let values: Vec<Option<&str>> = array.as_string::<i32>().iter().collect();
            Ok(PyList::new(py, values)?.into_any())
        }
    }
}

fn reals<'py>(py: Python<'py>, array: &dyn Array) -> Bound<'py, PyAny> {
    let numbers = array.as_primitive::<Float64Type>();
    if numbers.null_count() == 0 {
        return PyArray1::from_slice(py, numbers.values()).into_any();
    }
    let values = numbers.iter().map(|value| value.unwrap_or(f64::NAN));
    PyArray1::from_iter(py, values).into_any()
}
