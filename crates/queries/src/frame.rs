//! Conversion between tables and polars data frames. Queries read only the columns that they need.
//!
//! Columns of tables without nulls are copied as one block of memory, others value by value.
//! Sharing memory would require `unsafe`.

use std::any::Any;
use std::sync::{Arc, Mutex};

use arrow::array::{Array, ArrayRef, AsArray, BooleanArray, Float64Array, Int64Array, StringArray};
use arrow::datatypes::{Float64Type, Int64Type};
use polars::prelude::{
    AnonymousScan, AnonymousScanArgs, Column, DataFrame, DataType, LazyFrame, NamedFrom,
    PlSmallStr, PolarsError, PolarsResult, ScanArgsAnonymous, SchemaRef, Series,
};

use crate::FrameError;
use asperity_tables::parallel::locked;
use asperity_tables::source::TableSource;
use asperity_tables::store::StoreError;
use asperity_tables::table::Table;

/// Converts a table to a polars data frame.
///
/// # Errors
/// Returns an error if two columns have the same name.
pub fn from_table(table: &Table) -> Result<DataFrame, FrameError> {
    let arrays = table.names().into_iter().zip(table.batch().columns());
    let columns = arrays.map(|(name, array)| Column::from(series(name, array.as_ref())));
    DataFrame::new(table.rows(), columns.collect()).map_err(polars_error)
}

fn series(name: &str, array: &dyn Array) -> Series {
    let name = PlSmallStr::from_str(name);
    let is_whole = array.null_count() == 0;
    if let Some(values) = array.as_primitive_opt::<Float64Type>() {
        if is_whole {
            Series::new(name, &values.values()[..])
        } else {
            Series::new(name, values.iter().collect::<Vec<_>>())
        }
    } else if let Some(values) = array.as_primitive_opt::<Int64Type>() {
        if is_whole {
            Series::new(name, &values.values()[..])
        } else {
            Series::new(name, values.iter().collect::<Vec<_>>())
        }
    } else if let Some(values) = array.as_boolean_opt() {
        Series::new(name, values.iter().collect::<Vec<_>>())
    } else {
        let texts = array.as_string::<i32>();
        Series::new(name, texts.iter().collect::<Vec<_>>())
    }
}

/// Converts the columns of a data frame to the types of tables.
///
/// # Errors
/// Returns an error if a column holds anything but numbers, flags and text.
pub fn columns(frame: &DataFrame) -> Result<Vec<(String, ArrayRef)>, FrameError> {
    let columns = frame.columns().iter();
    columns.map(|column| Ok((column.name().to_string(), array(column)?))).collect()
}

/// Converts a column to the type of a table's column.
///
/// # Errors
/// Returns an error if the column holds anything but numbers, flags and text.
pub fn array(column: &Column) -> Result<ArrayRef, FrameError> {
    let cast = |to: &DataType| column.cast(to).map_err(polars_error);
    let array: ArrayRef = match column.dtype() {
        kind if kind.is_float() => {
            let reals = cast(&DataType::Float64)?;
            Arc::new(reals.f64().map_err(polars_error)?.iter().collect::<Float64Array>())
        }
        kind if kind.is_integer() => {
            let integers = cast(&DataType::Int64)?;
            Arc::new(integers.i64().map_err(polars_error)?.iter().collect::<Int64Array>())
        }
        DataType::Boolean => {
            Arc::new(column.bool().map_err(polars_error)?.iter().collect::<BooleanArray>())
        }
        DataType::String => {
            Arc::new(column.str().map_err(polars_error)?.iter().collect::<StringArray>())
        }
        DataType::Null => Arc::new(Float64Array::new_null(column.len())),
        other => {
            let name = column.name();
            let reason =
                format!("column `{name}` has the type {other}; cast it to a number or to text");
            return Err(FrameError::Aggregate { reason });
        }
    };
    Ok(array)
}

/// Converts an error of polars and drops the query plan at the end of its message.
pub fn polars_error(error: PolarsError) -> FrameError {
    let text = error.to_string();
    let reason = text.lines().map(str::trim).find(|line| !line.is_empty());
    FrameError::Aggregate { reason: reason.unwrap_or("polars gives no reason").to_owned() }
}

/// Creates a lazy frame that reads the columns of a table on demand.
///
/// # Errors
/// Returns an error if two columns have the same name.
pub fn lazy(table: TableSource, first_error: &FirstStoreError) -> Result<LazyFrame, FrameError> {
    let empty = table.first(&column_indices(&table, None), 0);
    let schema = from_table(&empty.map_err(FrameError::Store)?)?.schema().clone();
    let arguments = ScanArgsAnonymous {
        schema: Some(schema.clone()),
        name: "table of a stage",
        ..ScanArgsAnonymous::default()
    };
    let scan = Scan { table, schema, first_error: first_error.clone() };
    LazyFrame::anonymous_scan(Arc::new(scan), arguments).map_err(polars_error)
}

/// Slot for the first error of the store while a query reads tables. An error of polars can carry
/// only the text of such an error.
#[derive(Clone, Default)]
pub struct FirstStoreError(Arc<Mutex<Option<StoreError>>>);

impl FirstStoreError {
    /// Takes the first recorded error.
    pub fn take(&self) -> Option<StoreError> {
        locked(&self.0).take()
    }

    fn record(&self, error: StoreError) -> PolarsError {
        let text = error.to_string();
        let mut first = locked(&self.0);
        first.get_or_insert(error);
        PolarsError::ComputeError(text.into())
    }
}

/// Returns the number of rows of a table that [`lazy`] has wrapped.
pub fn rows_of(table: &dyn AnonymousScan) -> usize {
    let known = table.as_any().downcast_ref::<Scan>();
    known.map_or(0, |scan| scan.table.rows())
}

struct Scan {
    table: TableSource,
    schema: SchemaRef,
    first_error: FirstStoreError,
}

impl AnonymousScan for Scan {
    fn as_any(&self) -> &dyn Any {
        self
    }

    fn scan(&self, wanted: AnonymousScanArgs) -> PolarsResult<DataFrame> {
        let given = wanted.with_columns.as_deref();
        let names = given.map(|names| names.iter().map(|name| name.as_str()).collect::<Vec<_>>());
        let rows = wanted.n_rows.unwrap_or(usize::MAX);
        let read = self.table.first(&column_indices(&self.table, names.as_deref()), rows);
        let table = read.map_err(|error| self.first_error.record(error))?;
        from_table(&table).map_err(|error| PolarsError::ComputeError(error.to_string().into()))
    }

    fn schema(&self, _: Option<usize>) -> PolarsResult<SchemaRef> {
        Ok(self.schema.clone())
    }

    fn allows_projection_pushdown(&self) -> bool {
        true
    }
}

/// Returns the indices of the columns with these names, or of all columns if `names` is `None`.
fn column_indices(table: &TableSource, names: Option<&[&str]>) -> Vec<usize> {
    let schema = table.schema();
    match names {
        Some(names) => names.iter().filter_map(|name| schema.index_of(name).ok()).collect(),
        None => (0..schema.fields().len()).collect(),
    }
}
