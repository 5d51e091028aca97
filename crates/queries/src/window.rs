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

const ASCENDING: Direction = Direction { descending: false, nulls_first: false };

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
        let partition: Vec<_> = partition_by
            .iter()
            .map(|column| codes(column, ASCENDING))
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
        let argument = Argument::new(self.function, arguments.first(), rows)?;
        let mut cells = vec![Cell::Null; rows];
        for part in sorted.chunk_by(|&a, &b| compare(&partition, a, b).is_eq()) {
            let (mut running, mut start) = (Running::default(), 0);
            let peers = part.chunk_by(|&a, &b| compare(&order, a, b).is_eq());
            for (group, peers) in peers.enumerate() {
                let equal = start..start + peers.len();
                for index in equal.clone() {
                    let place = Place { part, index, group, equal: equal.clone() };
                    cells[part[index]] = self.cell(&place, &argument, &mut running)?;
                }
                start = equal.end;
            }
        }
        self.column(&cells, arguments)
    }

    fn cell(
        &self,
        place: &Place<'_>,
        argument: &Argument,
        running: &mut Running,
    ) -> PolarsResult<Cell> {
        use WindowFunction::*;
        let Place { part, index, group, ref equal } = *place;
        let length = part.len();
        let first = match self.frame.0 {
            Bound::Unbounded => 0,
            Bound::Rows(offset) => index.saturating_add_signed(offset).min(length),
            Bound::Peers => equal.start,
        };
        let end = match self.frame.1 {
            Bound::Unbounded => length,
            // An offset before the first row leaves zero, the end of an empty frame.
            Bound::Rows(offset) => (index + 1).saturating_add_signed(offset).min(length),
            Bound::Peers => equal.end,
        };
        let frame = first..end.max(first);
        let share = |rows: usize, of: usize| Cell::Real(rows as f64 / of.max(1) as f64);
        let number = |number: usize| Cell::Integer(number as i64);
        let at = |index: Option<usize>| {
            index.and_then(|index| part.get(index)).map_or(Cell::Null, |&row| Cell::Row(row))
        };
        let in_frame = |index: Option<usize>| at(index.filter(|index| frame.contains(index)));
        Ok(match self.function {
            RowNumber => number(index + 1),
            Rank => number(equal.start + 1),
            DenseRank => number(group + 1),
            PercentRank => share(equal.start, length - 1),
            CumeDist => share(equal.end, length),
            Ntile(count) => number(tile(index, length, count)),
            Offset(offset) => at(index.checked_add_signed(offset)),
            First => in_frame(Some(frame.start)),
            Last => in_frame(frame.end.checked_sub(1)),
            Nth(number) => in_frame(Some(frame.start + number - 1)),
            _ => {
                running.move_to(frame, part, argument);
                running.value(self.function, argument.integer.is_some())?
            }
        })
    }

    /// Returns the column of the computed values.
    fn column(&self, cells: &[Cell], arguments: &[Column]) -> PolarsResult<Column> {
        use WindowFunction::*;
        let name = PlSmallStr::EMPTY;
        let input = arguments.first().map_or(DataType::Null, |column| column.dtype().clone());
        if let Offset(_) | First | Last | Nth(_) | Minimum | Maximum = self.function {
            let row =
                |cell: &Cell| if let Cell::Row(row) = cell { Some(*row as IdxSize) } else { None };
            let taken = arguments[0].take(&cells.iter().map(row).collect::<IdxCa>())?;
            let Some(default) = arguments.get(1) else {
                return Ok(taken);
            };
            let inside: BooleanChunked =
                cells.iter().map(|cell| Some(row(cell).is_some())).collect();
            if default.dtype().is_float() && taken.dtype().is_integer() {
                let message = "`lag` and `lead` of integers need an integer as their third \
                               argument; write `cast(… as double)` in the first one";
                return Err(PolarsError::ComputeError(message.into()));
            }
            return taken.zip_with(&inside, &default.strict_cast(taken.dtype())?);
        }
        Ok(if self.output(input) == DataType::Int64 {
            let integer =
                |cell: &Cell| if let Cell::Integer(one) = cell { Some(*one) } else { None };
            Series::new(name, cells.iter().map(integer).collect::<Vec<_>>()).into_column()
        } else {
            let real = |cell: &Cell| if let Cell::Real(one) = cell { Some(*one) } else { None };
            Series::new(name, cells.iter().map(real).collect::<Vec<_>>()).into_column()
        })
    }
}

/// Place of a row in its partition, whose rows are sorted.
struct Place<'a> {
    /// Rows of the partition.
    part: &'a [usize],
    /// Index of the row in the partition.
    index: usize,
    /// Number of groups of equal rows before the one of the row.
    group: usize,
    /// Indices of the rows that are equal to the row in `order by`.
    equal: Range<usize>,
}

/// Value of a window function in a row.
#[derive(Clone, Copy)]
enum Cell {
    Null,
    Integer(i64),
    Real(f64),
    /// Value of the argument in this row.
    Row(usize),
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

/// Argument of a window function in each row.
struct Argument {
    /// Values as real numbers; empty if the function does not calculate with them.
    real: Vec<Option<f64>>,
    /// Values as integers, if they are.
    integer: Option<Vec<Option<i64>>>,
    /// Order of the values, the best first; empty unless the function needs it.
    order: Vec<i64>,
    /// Whether there is a value; always true without an argument.
    is_present: Vec<bool>,
}

impl Argument {
    fn new(
        function: WindowFunction,
        column: Option<&Column>,
        rows: usize,
    ) -> PolarsResult<Argument> {
        use WindowFunction::*;
        let is_present = vec![true; rows];
        let mut argument = Argument { real: vec![], integer: None, order: vec![], is_present };
        let Some(column) = column else { return Ok(argument) };
        match function {
            Minimum => argument.order = codes(column, ASCENDING)?,
            Maximum => argument.order = codes(column, Direction { descending: true, ..ASCENDING })?,
            Sum | Average | Variance(_) | StandardDeviation(_) | Quantile(_)
            | DiscreteQuantile(_) => {
                if !column.dtype().is_float() {
                    let integers = column.strict_cast(&DataType::Int64)?;
                    argument.integer = Some(integers.i64()?.iter().collect());
                }
                argument.real = column.strict_cast(&DataType::Float64)?.f64()?.iter().collect();
            }
            _ => {}
        }
        argument.is_present =
            column.is_not_null().iter().map(|known| known == Some(true)).collect();
        Ok(argument)
    }
}

/// Statistics of the rows of a frame.
#[derive(Default)]
struct Running {
    frame: Range<usize>,
    count: usize,
    real_sum: f64,
    integer_sum: i128,
    mean: f64,
    /// Sum of squared deviations from the mean.
    squares: f64,
    /// Row with the smallest or largest value.
    best: Option<usize>,
    /// Values for quantiles.
    values: Vec<f64>,
    /// Number of values at the beginning of `values` that are sorted.
    sorted: usize,
}

impl Running {
    /// Adds the rows of a frame. If the frame only grows at its end, the rows before are kept, so
    /// that sums from the first row on take linear time. Values are never subtracted, which would
    /// lose digits.
    fn move_to(&mut self, frame: Range<usize>, part: &[usize], argument: &Argument) {
        if self.frame.start != frame.start || self.frame.end > frame.end {
            *self = Running { frame: frame.start..frame.start, ..Running::default() };
        }
        for &row in &part[self.frame.end..frame.end] {
            if argument.is_present[row] {
                self.add(row, argument);
            }
        }
        self.frame = frame;
    }

    fn add(&mut self, row: usize, argument: &Argument) {
        self.count += 1;
        if let Some(code) = argument.order.get(row)
            && self.best.is_none_or(|best| *code < argument.order[best])
        {
            self.best = Some(row);
        }
        if let Some(integer) = argument.integer.as_ref().and_then(|all| all[row]) {
            self.integer_sum += i128::from(integer);
        }
        if let Some(&Some(value)) = argument.real.get(row) {
            self.real_sum += value;
            let deviation = value - self.mean;
            self.mean += deviation / self.count as f64;
            self.squares += deviation * (value - self.mean);
            self.values.push(value);
        }
    }

    /// Returns the value of a function for the frame.
    fn value(&mut self, function: WindowFunction, is_integer: bool) -> PolarsResult<Cell> {
        use WindowFunction::*;
        let variance = |less: usize| self.squares / (self.count - less) as f64;
        let real = match function {
            Count => return Ok(Cell::Integer(self.count as i64)),
            Minimum | Maximum => return Ok(self.best.map_or(Cell::Null, Cell::Row)),
            _ if self.count == 0 => return Ok(Cell::Null),
            Sum if is_integer => {
                let sum = i64::try_from(self.integer_sum).map_err(|_| {
                    PolarsError::ComputeError("a sum of integers exceeds 64 bits".into())
                })?;
                return Ok(Cell::Integer(sum));
            }
            Average if is_integer => self.integer_sum as f64 / self.count as f64,
            Sum => self.real_sum,
            Average => self.real_sum / self.count as f64,
            Variance(less) | StandardDeviation(less) if self.count <= less => {
                return Ok(Cell::Null);
            }
            Variance(less) => variance(less),
            StandardDeviation(less) => variance(less).sqrt(),
            Quantile(share) | DiscreteQuantile(share) => {
                // All rows of a frame without bounds have the same sorted values.
                if self.sorted < self.values.len() {
                    self.values.sort_by(f64::total_cmp);
                    self.sorted = self.values.len();
                }
                quantile(&self.values, share, matches!(function, Quantile(_)))
            }
            _ => unreachable!("the other functions depend on the place of the row only"),
        };
        Ok(Cell::Real(real))
    }
}

/// Returns a quantile of sorted values, of which there is at least one.
fn quantile(sorted: &[f64], share: f64, interpolates: bool) -> f64 {
    let last = sorted.len() - 1;
    if !interpolates {
        let index = (share * sorted.len() as f64).ceil() as usize;
        return sorted[index.saturating_sub(1).min(last)];
    }
    let position = share * last as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (position - below as f64) * (sorted[above] - sorted[below])
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
