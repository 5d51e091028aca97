//! Functions of numbers that polars computes otherwise than most SQL databases.

use polars::prelude::{
    Column, DataType, Field, IntoColumn, NamedFrom, PlSmallStr, PolarsError, PolarsResult, Schema,
    Series,
};
use polars::sql::FunctionRegistry;
use polars_plan::dsl::udf::UserDefinedFunction;
use polars_plan::dsl::{BaseColumnUdf, new_column_udf};
use polars_plan::prelude::FunctionOptions;

/// Name of the function that rounds a number to a number of decimals, halves away from zero.
pub const ROUND: &str = "__round";

/// Name of the function that converts a value to an integer, to the nearest one if it is a number
/// and to the even one of two.
pub const INTEGER: &str = "__integer";

/// Name of the function that returns the remainder of a division, with the sign of the dividend.
pub const REMAINDER: &str = "__remainder";

/// Name of the function that returns the quotient of a division without its decimals.
pub const QUOTIENT: &str = "__quotient";

/// The functions of this module, for the SQL of polars.
pub struct Functions;

impl FunctionRegistry for Functions {
    fn register(&mut self, name: &str, _: UserDefinedFunction) -> PolarsResult<()> {
        Err(PolarsError::ComputeError(format!("cannot add the function {name}").into()))
    }

    fn get_udf(&self, name: &str) -> PolarsResult<Option<UserDefinedFunction>> {
        let compute = match name {
            ROUND => round,
            INTEGER => integer,
            REMAINDER => remainder,
            QUOTIENT => quotient,
            _ => return Ok(None),
        };
        let is_integer = name == INTEGER;
        let field = move |_: &Schema, fields: &[Field]| {
            let reals = fields.iter().any(|field| field.dtype().is_float());
            let kind = if reals && !is_integer { DataType::Float64 } else { DataType::Int64 };
            Ok(Field::new(
                fields.first().map_or(PlSmallStr::EMPTY, |field| field.name().clone()),
                kind,
            ))
        };
        Ok(Some(UserDefinedFunction {
            name: name.into(),
            fun: new_column_udf(BaseColumnUdf::new(compute, field)),
            options: FunctionOptions::elementwise(),
        }))
    }

    fn contains(&self, name: &str) -> bool {
        [ROUND, INTEGER, REMAINDER, QUOTIENT].contains(&name)
    }
}

fn round(columns: &mut [Column]) -> PolarsResult<Column> {
    let digits = columns[1].strict_cast(&DataType::Int64)?.i64()?.first().unwrap_or(0);
    if columns[0].dtype().is_integer() && digits >= 0 {
        return columns[0].strict_cast(&DataType::Int64);
    }
    // Powers of ten up to 10²² are exact.
    let scale = libm::exp10(digits.unsigned_abs().min(300) as f64).round();
    let rounded = |value: f64| {
        if digits < 0 {
            return (value / scale).round() * scale;
        }
        let scaled = value * scale;
        // The part of the product that has been rounded away decides what only looks like a half.
        let is_below = value.mul_add(scale, -scaled) * scaled < 0.0 && scaled.fract().abs() == 0.5;
        let rounded = if is_below { scaled.trunc() } else { scaled.round() } / scale;
        if rounded.is_finite() { rounded } else { value }
    };
    let name = columns[0].name().clone();
    let numbers = columns[0].strict_cast(&DataType::Float64)?;
    let values: Vec<_> = numbers.f64()?.iter().map(|value| value.map(rounded)).collect();
    Ok(Series::new(name, values).into_column())
}

fn integer(columns: &mut [Column]) -> PolarsResult<Column> {
    let column = &columns[0];
    if column.dtype().is_float() {
        let numbers = column.strict_cast(&DataType::Float64)?;
        let values = numbers.f64()?.iter();
        let rounded = values.map(|value| value.map(f64::round_ties_even)).collect::<Vec<_>>();
        let rounded = Series::new(column.name().clone(), rounded);
        return Ok(rounded.strict_cast(&DataType::Int64)?.into_column());
    }
    column.strict_cast(&DataType::Int64)
}

fn remainder(columns: &mut [Column]) -> PolarsResult<Column> {
    divided(columns, i64::checked_rem, |a, b| a % b)
}

fn quotient(columns: &mut [Column]) -> PolarsResult<Column> {
    divided(columns, i64::checked_div, |a, b| (a / b).trunc())
}

/// Divides numbers row by row. A division by zero gives null.
fn divided(
    columns: &mut [Column],
    of_integers: fn(i64, i64) -> Option<i64>,
    of_reals: fn(f64, f64) -> f64,
) -> PolarsResult<Column> {
    let rows = if columns.iter().any(Column::is_empty) {
        0
    } else {
        columns.iter().map(Column::len).max().unwrap_or(0)
    };
    let name = columns[0].name().clone();
    let whole = columns.iter().all(|column| !column.dtype().is_float());
    let kind = if whole { DataType::Int64 } else { DataType::Float64 };
    let cast = |column: &Column| {
        let cast = column.strict_cast(&kind)?;
        Ok::<_, PolarsError>(if cast.len() == 1 { cast.new_from_index(0, rows) } else { cast })
    };
    let (a, b) = (cast(&columns[0])?, cast(&columns[1])?);
    let series = if whole {
        let pairs = a.i64()?.iter().zip(b.i64()?.iter());
        let values: Vec<_> = pairs.map(|(a, b)| of_integers(a?, b?)).collect();
        Series::new(name, values)
    } else {
        let pairs = a.f64()?.iter().zip(b.f64()?.iter());
        let divided = |(a, b): (Option<f64>, Option<f64>)| {
            let (a, b) = (a?, b?);
            (b != 0.0).then(|| of_reals(a, b))
        };
        Series::new(name, pairs.map(divided).collect::<Vec<_>>())
    };
    Ok(series.into_column())
}
