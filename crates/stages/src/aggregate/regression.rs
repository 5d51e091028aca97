//! The least-squares line through the rows of a group, against their load.
//!
//! Its columns are called as standard SQL calls the functions, `REGR_SLOPE` and `REGR_INTERCEPT`. A
//! row without a value is left out, and rows under one load alone have no line.

use polars::prelude::{DataType, Expr, NULL, col, lit, when};

use super::super::columns::LOAD;

/// The slope.
pub fn slope(values: &Expr) -> Expr {
    let Line { loads, values } = Line::of(values);
    let from_mean = loads.clone() - loads.clone().mean();
    let joint = (from_mean.clone() * (values.clone() - values.mean())).sum();
    // Of equal loads, rounding of the mean would leave some scatter.
    let differ = loads.clone().min().lt(loads.max());
    let slope = joint / (from_mean.clone() * from_mean).sum();
    when(differ).then(slope).otherwise(lit(NULL))
}

/// The value at zero load.
pub fn intercept(values: &Expr) -> Expr {
    let Line { loads, values: known } = Line::of(values);
    known.mean() - slope(values) * loads.mean()
}

/// What a line goes through.
struct Line {
    loads: Expr,
    values: Expr,
}

impl Line {
    fn of(values: &Expr) -> Line {
        let is_known = values.clone().is_not_null();
        Line {
            loads: col(LOAD.name).filter(is_known),
            values: values.clone().drop_nulls().cast(DataType::Float64),
        }
    }
}
