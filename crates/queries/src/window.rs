//! Window functions: `sum(x) over (partition by k order by load)`.
//!
//! Polars has no frames and does not treat rows alike that compare equal in `order by`. This module
//! computes all window functions as the standard defines them.

use std::cmp::Ordering;
use std::ops::Range;

use arrow::array::AsArray;
use arrow::datatypes::{Float64Type, Int64Type};
use polars::prelude::{
    BooleanChunked, Column, DataType, Expr, Field, IdxCa, IdxSize, IntoColumn, NamedFrom,
    PlSmallStr, PolarsError, PolarsResult, Schema, Series, col,
};
use polars_plan::dsl::udf::UserDefinedFunction;
use polars_plan::dsl::{BaseColumnUdf, new_column_udf};
use polars_plan::prelude::FunctionOptions;

use crate::frame;

/// Function that a window computes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WindowFunction {
    RowNumber,
    Rank,
    DenseRank,
    PercentRank,
    CumeDist,
    /// Number of the part of the partition, of as many parts as the number says.
    Ntile(usize),
    /// Value some rows later, or earlier if the number is negative.
    Offset(isize),
    First,
    Last,
    /// Value of the row with this number in the frame, counted from one.
    Nth(usize),
    /// Number of values, or of rows without an argument.
    Count,
    Sum,
    Average,
    Minimum,
    Maximum,
    /// Variance; the number is subtracted from the count in the denominator.
    Variance(usize),
    StandardDeviation(usize),
    /// Quantile with linear interpolation.
    Quantile(f64),
    /// Smallest value whose cumulative share reaches the number.
    DiscreteQuantile(f64),
}

/// Bound of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    Unbounded,
    /// Rows after the current row; negative before it.
    Rows(isize),
    /// First or last row that is equal to the current row in `order by`.
    Peers,
}

/// Direction of a column of `order by`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    pub descending: bool,
    pub nulls_first: bool,
}

/// Window function over columns of a frame. The arguments come first, then the columns of
/// `partition by`, then those of `order by`.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    pub function: WindowFunction,
    pub arguments: Vec<String>,
    pub partition: Vec<String>,
    pub order: Vec<(String, Direction)>,
    pub frame: (Bound, Bound),
}

impl Window {
    /// Returns the expression that computes the window function.
    pub fn expression(&self) -> Expr {
        let order = self.order.iter().map(|(name, _)| name);
        let names = self.arguments.iter().chain(&self.partition).chain(order);
        let inputs: Vec<Expr> = names.map(|name| col(name.as_str())).collect();
        let (window, typed) = (self.clone(), self.clone());
        let compute = move |columns: &mut [Column]| window.compute(columns);
        let field = move |_: &Schema, fields: &[Field]| {
            let input = fields.first().map_or(DataType::Null, |field| field.dtype().clone());
            Ok(Field::new(PlSmallStr::EMPTY, typed.output(input)))
        };
        let function = UserDefinedFunction {
            name: PlSmallStr::EMPTY,
            fun: new_column_udf(BaseColumnUdf::new(compute, field)),
            options: FunctionOptions::length_preserving(),
        };
        function.call(inputs)
    }

    /// Returns the type of the values for an argument of this type.
    fn output(&self, argument: DataType) -> DataType {
        use WindowFunction::*;
        match self.function {
            RowNumber | Rank | DenseRank | Ntile(_) | Count => DataType::Int64,
            Sum if !argument.is_float() => DataType::Int64,
            Offset(_) | First | Last | Nth(_) | Minimum | Maximum => argument,
            _ => DataType::Float64,
        }
    }

    fn compute(&self, columns: &[Column]) -> PolarsResult<Column> {
        let rows = columns.first().map_or(0, Column::len);
        let (arguments, keys) = columns.split_at(self.arguments.len());
        let (partition_by, order_by) = keys.split_at(self.partition.len());
        let ascending = Direction { descending: false, nulls_first: false };
        let partition: Vec<_> = partition_by
            .iter()
            .map(|column| codes(column, ascending))
            .collect::<PolarsResult<_>>()?;
        let ordered = order_by.iter().zip(&self.order);
        let order: Vec<_> =
            ordered.map(|(column, (_, to))| codes(column, *to)).collect::<PolarsResult<_>>()?;
        let compare = |keys: &[Vec<i64>], a: usize, b: usize| {
            let orders = keys.iter().map(|key| key[a].cmp(&key[b]));
            orders.fold(Ordering::Equal, Ordering::then)
        };
        let mut sorted: Vec<usize> = (0..rows).collect();
        // The sort is stable: rows that compare equal keep their order.
        sorted.sort_by(|&a, &b| compare(&partition, a, b).then_with(|| compare(&order, a, b)));
        let mut values = Values::new(self, arguments, rows)?;
        let mut parts = sorted.chunk_by(|&a, &b| compare(&partition, a, b).is_eq());
        parts.try_for_each(|part| {
            let mut start = 0;
            let peers = part.chunk_by(|&a, &b| compare(&order, a, b).is_eq()).map(|peers| {
                start += peers.len();
                start - peers.len()..start
            });
            self.partition(part, &peers.collect::<Vec<_>>(), &mut values)
        })?;
        values.column(self, arguments)
    }

    /// Computes the values of one partition, whose rows are sorted.
    fn partition(
        &self,
        part: &[usize],
        peers: &[Range<usize>],
        values: &mut Values,
    ) -> PolarsResult<()> {
        let length = part.len();
        let mut running = Running::default();
        for (group, equal) in peers.iter().enumerate() {
            for index in equal.clone() {
                let first = match self.frame.0 {
                    Bound::Unbounded => 0,
                    Bound::Rows(offset) => index.saturating_add_signed(offset).min(length),
                    Bound::Peers => equal.start,
                };
                let end = match self.frame.1 {
                    Bound::Unbounded => length,
                    Bound::Rows(offset) => (index + 1).saturating_add_signed(offset).min(length),
                    Bound::Peers => equal.end,
                };
                // An offset before the first row leaves `index + 1` at zero, which is empty, too.
                let frame = first..end.max(first);
                let row = part[index];
                let share = |rows: usize, of: usize| rows as f64 / of.max(1) as f64;
                let at = |index: usize| part.get(index).map(|&row| row as IdxSize);
                match self.function {
                    WindowFunction::RowNumber => values.integers[row] = Some(index as i64 + 1),
                    WindowFunction::Rank => values.integers[row] = Some(equal.start as i64 + 1),
                    WindowFunction::DenseRank => values.integers[row] = Some(group as i64 + 1),
                    WindowFunction::PercentRank => {
                        values.reals[row] = Some(share(equal.start, length - 1));
                    }
                    WindowFunction::CumeDist => values.reals[row] = Some(share(equal.end, length)),
                    WindowFunction::Ntile(count) => {
                        values.integers[row] = Some(tile(index, length, count) as i64);
                    }
                    WindowFunction::Offset(offset) => {
                        values.rows[row] = index.checked_add_signed(offset).and_then(at);
                    }
                    WindowFunction::First => {
                        values.rows[row] = at(frame.start).filter(|_| !frame.is_empty());
                    }
                    WindowFunction::Last => {
                        values.rows[row] =
                            at(frame.end.wrapping_sub(1)).filter(|_| !frame.is_empty());
                    }
                    WindowFunction::Nth(number) => {
                        let index = frame.start + number - 1;
                        values.rows[row] = at(index).filter(|_| frame.contains(&index));
                    }
                    _ => {
                        running.move_to(frame, part, values);
                        running.store(self.function, row, values)?;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Returns the number, from one, of the part that contains a row. The first parts have one row
/// more if `length` is not a multiple of `count`.
fn tile(index: usize, length: usize, count: usize) -> usize {
    let (size, larger) = (length / count, length % count);
    let in_larger = larger * (size + 1);
    1 + if index < in_larger {
        index / (size + 1)
    } else {
        larger + (index - in_larger) / size.max(1)
    }
}

/// Argument of a window function and the values that have been computed, one for each row.
struct Values {
    /// Argument as real numbers; empty if the function does not calculate with it.
    real: Vec<Option<f64>>,
    /// Argument as integers, if it has integers.
    integer: Option<Vec<Option<i64>>>,
    /// Order of the values of the argument; empty unless the function needs it.
    order: Vec<i64>,
    /// Whether the argument has a value; empty without an argument.
    is_present: Vec<bool>,
    integers: Vec<Option<i64>>,
    reals: Vec<Option<f64>>,
    /// Rows whose argument is the value.
    rows: Vec<Option<IdxSize>>,
}

impl Values {
    fn new(window: &Window, arguments: &[Column], rows: usize) -> PolarsResult<Values> {
        use WindowFunction::*;
        let mut values = Values {
            real: Vec::new(),
            integer: None,
            order: Vec::new(),
            is_present: Vec::new(),
            integers: vec![None; rows],
            reals: vec![None; rows],
            rows: vec![None; rows],
        };
        let Some(argument) = arguments.first() else {
            return Ok(values);
        };
        match window.function {
            Minimum | Maximum => {
                let ascending = Direction { descending: false, nulls_first: false };
                values.order = codes(argument, ascending)?;
            }
            Sum | Average | Variance(_) | StandardDeviation(_) | Quantile(_)
            | DiscreteQuantile(_) => {
                if !argument.dtype().is_float() {
                    let integers = argument.strict_cast(&DataType::Int64)?;
                    values.integer = Some(integers.i64()?.iter().collect());
                }
                let reals = argument.strict_cast(&DataType::Float64)?;
                values.real = reals.f64()?.iter().collect();
            }
            _ => {}
        }
        values.is_present =
            argument.is_not_null().iter().map(|known| known == Some(true)).collect();
        Ok(values)
    }

    /// Returns the column of the computed values.
    fn column(self, window: &Window, arguments: &[Column]) -> PolarsResult<Column> {
        use WindowFunction::*;
        if let Offset(_) | First | Last | Nth(_) | Minimum | Maximum = window.function {
            let rows: IdxCa = self.rows.iter().copied().collect();
            let taken = arguments[0].take(&rows)?;
            let Some(default) = arguments.get(1) else {
                return Ok(taken);
            };
            let inside: BooleanChunked = self.rows.iter().map(|row| Some(row.is_some())).collect();
            if default.dtype().is_float() && taken.dtype().is_integer() {
                let message = "`lag` and `lead` of integers need an integer as their third \
                               argument; write `cast(… as double)` in the first one";
                return Err(PolarsError::ComputeError(message.into()));
            }
            return taken.zip_with(&inside, &default.strict_cast(taken.dtype())?);
        }
        let name = PlSmallStr::EMPTY;
        let input = arguments.first().map_or(DataType::Null, |column| column.dtype().clone());
        Ok(match window.output(input) {
            DataType::Int64 => Series::new(name, self.integers).into_column(),
            _ => Series::new(name, self.reals).into_column(),
        })
    }
}

/// Statistics of the rows of a frame.
#[derive(Default)]
struct Running {
    frame: Range<usize>,
    rows: usize,
    count: usize,
    real_sum: f64,
    integer_sum: i128,
    mean: f64,
    /// Sum of squared deviations from the mean.
    squares: f64,
    least: Option<usize>,
    greatest: Option<usize>,
    /// Values for quantiles.
    values: Vec<f64>,
    /// Number of values at the beginning of `values` that are sorted.
    sorted: usize,
}

impl Running {
    /// Adds the rows of a frame. If the frame only grows at its end, the rows before are kept, so
    /// that sums from the first row on take linear time. Values are never subtracted, which would
    /// lose digits.
    fn move_to(&mut self, frame: Range<usize>, part: &[usize], values: &Values) {
        if self.frame.start != frame.start || self.frame.end > frame.end {
            *self = Running { frame: frame.start..frame.start, ..Running::default() };
        }
        for &row in &part[self.frame.end..frame.end] {
            self.add(row, values);
        }
        self.frame = frame;
    }

    fn add(&mut self, row: usize, values: &Values) {
        self.rows += 1;
        if !values.is_present.get(row).copied().unwrap_or(true) {
            return;
        }
        self.count += 1;
        if let Some(code) = values.order.get(row) {
            let is_better = |best: Option<usize>, to: Ordering| {
                best.is_none_or(|best| code.cmp(&values.order[best]) == to)
            };
            if is_better(self.least, Ordering::Less) {
                self.least = Some(row);
            }
            if is_better(self.greatest, Ordering::Greater) {
                self.greatest = Some(row);
            }
        }
        if let Some(integer) = values.integer.as_ref().and_then(|all| all[row]) {
            self.integer_sum += i128::from(integer);
        }
        if let Some(&Some(value)) = values.real.get(row) {
            self.real_sum += value;
            let deviation = value - self.mean;
            self.mean += deviation / self.count as f64;
            self.squares += deviation * (value - self.mean);
            self.values.push(value);
        }
    }

    /// Stores the value of a function for a row.
    fn store(
        &mut self,
        function: WindowFunction,
        row: usize,
        values: &mut Values,
    ) -> PolarsResult<()> {
        use WindowFunction::*;
        let known = |value: f64| (self.count > 0).then_some(value);
        let variance = |less: usize| {
            let degrees = self.count.checked_sub(less).filter(|&degrees| degrees > 0);
            degrees.map(|degrees| self.squares / degrees as f64)
        };
        match function {
            Count => {
                let count = if values.is_present.is_empty() { self.rows } else { self.count };
                values.integers[row] = Some(count as i64);
            }
            Sum if values.integer.is_some() => {
                let sum = i64::try_from(self.integer_sum).map_err(|_| {
                    PolarsError::ComputeError("a sum of integers exceeds 64 bits".into())
                })?;
                values.integers[row] = (self.count > 0).then_some(sum);
            }
            Sum => values.reals[row] = known(self.real_sum),
            Average => {
                let sum = match values.integer {
                    Some(_) => self.integer_sum as f64,
                    None => self.real_sum,
                };
                values.reals[row] = known(sum / self.count as f64);
            }
            Minimum => values.rows[row] = self.least.map(|row| row as IdxSize),
            Maximum => values.rows[row] = self.greatest.map(|row| row as IdxSize),
            Variance(less) => values.reals[row] = variance(less),
            StandardDeviation(less) => values.reals[row] = variance(less).map(f64::sqrt),
            Quantile(share) | DiscreteQuantile(share) => {
                // All rows of a frame without bounds have the same sorted values.
                if self.sorted < self.values.len() {
                    self.values.sort_by(f64::total_cmp);
                    self.sorted = self.values.len();
                }
                let interpolates = matches!(function, Quantile(_));
                values.reals[row] = quantile(&self.values, share, interpolates);
            }
            _ => unreachable!("the other functions depend on the place of the row only"),
        }
        Ok(())
    }
}

/// Returns a quantile of sorted values.
fn quantile(sorted: &[f64], share: f64, interpolates: bool) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    if !interpolates {
        let index = (share * sorted.len() as f64).ceil() as usize;
        return Some(sorted[index.saturating_sub(1).min(last)]);
    }
    let position = share * last as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(last);
    Some(sorted[below] + (position - below as f64) * (sorted[above] - sorted[below]))
}

/// Replaces the values of a column by integers of the same order.
fn codes(column: &Column, to: Direction) -> PolarsResult<Vec<i64>> {
    let array = frame::array(column)
        .map_err(|error| PolarsError::ComputeError(error.to_string().into()))?;
    let ranks = if let Some(values) = array.as_primitive_opt::<Float64Type>() {
        // Adding zero makes −0 equal to 0. The bits of positive numbers are in their order; those
        // of negative numbers are in the reverse one. NaN is the largest value, of either sign.
        let bits = |value: f64| {
            let value = if value.is_nan() { f64::NAN.copysign(1.0) } else { value + 0.0 };
            let bits = value.to_bits() as i64;
            bits ^ (((bits >> 63) as u64) >> 1) as i64
        };
        ranks(values.iter().map(|value| value.map(bits)).collect())
    } else if let Some(values) = array.as_primitive_opt::<Int64Type>() {
        ranks(values.iter().collect())
    } else if let Some(values) = array.as_boolean_opt() {
        ranks(values.iter().collect())
    } else {
        ranks(array.as_string::<i32>().iter().collect())
    };
    let null = if to.nulls_first { i64::MIN } else { i64::MAX };
    let code = |rank: usize| if to.descending { -(rank as i64) } else { rank as i64 };
    Ok(ranks.into_iter().map(|rank| rank.map_or(null, code)).collect())
}

/// Returns the rank of each value among all different values.
fn ranks<T: Ord + Copy>(values: Vec<Option<T>>) -> Vec<Option<usize>> {
    let mut different: Vec<T> = values.iter().copied().flatten().collect();
    different.sort_unstable();
    different.dedup();
    let rank = |value: T| different.partition_point(|known| *known < value);
    values.into_iter().map(|value| value.map(rank)).collect()
}
