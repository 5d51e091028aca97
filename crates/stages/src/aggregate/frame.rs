//! Tables to polars and back, by plain column vectors.
//!
//! Columns without nulls cross as one copy of their memory, others value by value; without a copy it
//! would take `unsafe`.

use std::sync::Arc;

use arrow::array::{Array, ArrayRef, AsArray, BooleanArray, Float64Array, Int64Array, StringArray};
use arrow::datatypes::{Float64Type, Int64Type};
use polars::prelude::{Column, DataFrame, DataType, NamedFrom, PlSmallStr, PolarsError, Series};

use crate::StageError;
use asperity_tables::table::Table;

/// A table as polars knows it.
///
/// # Errors
/// When two columns have one name.
pub fn of(table: &Table) -> Result<DataFrame, StageError> {
    let columns = table.names().into_iter().zip(table.batch().columns());
    let columns = columns.map(|(name, array)| Column::from(series(name, array.as_ref())));
    DataFrame::new(table.rows(), columns.collect()).map_err(polars_error)
}

fn series(name: &str, array: &dyn Array) -> Series {
    let name = PlSmallStr::from_str(name);
    let is_whole = array.null_count() == 0;
    if let Some(values) = array.as_primitive_opt::<Float64Type>() {
        match is_whole {
            true => Series::new(name, &values.values()[..]),
            false => Series::new(name, values.iter().collect::<Vec<_>>()),
        }
    } else if let Some(values) = array.as_primitive_opt::<Int64Type>() {
        match is_whole {
            true => Series::new(name, &values.values()[..]),
            false => Series::new(name, values.iter().collect::<Vec<_>>()),
        }
    } else if let Some(values) = array.as_boolean_opt() {
        Series::new(name, values.iter().collect::<Vec<_>>())
    } else {
        let texts = array.as_string::<i32>();
        Series::new(name, texts.iter().collect::<Vec<_>>())
    }
}

/// The columns of a frame, named, in the types of our tables.
///
/// # Errors
/// When a column holds something else than numbers, truth values and text.
pub fn columns(frame: &DataFrame) -> Result<Vec<(String, ArrayRef)>, StageError> {
    let columns = frame.columns().iter();
    columns.map(|column| Ok((column.name().to_string(), array(column)?))).collect()
}

fn array(column: &Column) -> Result<ArrayRef, StageError> {
    let cast = |to: &DataType| column.cast(to).map_err(polars_error);
    let array: ArrayRef = match column.dtype() {
        kind if kind.is_float() => {
            let cast = cast(&DataType::Float64)?.rechunk();
            let values = cast.f64().map_err(polars_error)?;
            match values.cont_slice() {
                Ok(values) => Arc::new(Float64Array::from(values.to_vec())),
                Err(_) => Arc::new(values.iter().collect::<Float64Array>()),
            }
        }
        kind if kind.is_integer() => {
            let cast = cast(&DataType::Int64)?.rechunk();
            let values = cast.i64().map_err(polars_error)?;
            match values.cont_slice() {
                Ok(values) => Arc::new(Int64Array::from(values.to_vec())),
                Err(_) => Arc::new(values.iter().collect::<Int64Array>()),
            }
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
            let reason = format!("column `{name}` holds {other}; cast it to a number or to text");
            return Err(StageError::Aggregate { reason });
        }
    };
    Ok(array)
}

/// What polars says, without the plan that it prints behind.
pub fn polars_error(error: PolarsError) -> StageError {
    let text = error.to_string();
    let reason = text.lines().map(str::trim).find(|line| !line.is_empty());
    StageError::Aggregate { reason: reason.unwrap_or("polars gives no reason").to_owned() }
}
