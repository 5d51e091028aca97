//! Comparison of the columns of two tables whose rows are matched.

use std::cmp::Ordering;

use arrow::array::{Array, ArrayRef, AsArray};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Float64Type};
use serde::Serialize;

use super::rows::{MatchedRows, RowGroup};
use asperity_pipeline::results::OWN_COLUMNS;
use asperity_stages::columns::{REALIZATION, SEED, SURFACE};
use asperity_stages::ensemble::ParameterPoint;
use asperity_stages::units::TableUnits;
use asperity_statistics::differences::MeanDifference;
use asperity_statistics::intervals::LEVEL;
use asperity_tables::column::{REDUCED, Role};
use asperity_tables::table::Table;

/// Largest relative difference of two numbers that count as equal: twelve digits.
const RESOLUTION: f64 = 1e-12;

/// Comparison of a column that both tables have.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ColumnComparison {
    pub column: String,
    pub unit: String,
    /// True if the head of the column shows the unit (see [`TableUnits::shown`]).
    #[serde(skip)]
    pub has_named_unit: bool,
    /// Number of rows of the same surface, point and load whose values differ.
    pub differing: usize,
    /// Means at each point and load; empty if the column has no numbers.
    pub means: Vec<MeanComparison>,
}

/// Comparison of the means of a column at one parameter point and load.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MeanComparison {
    pub point: ParameterPoint,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load: Option<f64>,
    /// Number among rows that no column distinguishes, from 1.
    #[serde(skip_serializing_if = "is_one")]
    pub row: usize,
    pub test: Test,
    /// Numbers of values in the means of A and of B.
    pub values_a: usize,
    pub values_b: usize,
    pub mean_a: f64,
    pub mean_b: f64,
    /// Mean of B minus mean of A; exactly zero if all values are equal in twelve digits.
    pub difference: f64,
    /// Difference divided by the magnitude of the mean of A; `None` if that mean is zero.
    pub relative: Option<f64>,
    /// 95 % confidence interval of the difference; `None` for a single value.
    pub lower: Option<f64>,
    pub upper: Option<f64>,
    /// Probability of such a difference between equal means.
    pub p_value: Option<f64>,
    /// The same probability after Holm's correction for all comparisons of the study.
    pub p_corrected: Option<f64>,
    /// True if the corrected probability is below 5 %; `None` without an interval or a difference.
    pub is_more_than_noise: Option<bool>,
}

fn is_one(number: &usize) -> bool {
    *number == 1
}

/// Choice of the values in the means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Test {
    /// Values of the surfaces that both tables have, compared surface by surface.
    Paired,
    /// Values of all surfaces, because no surface is in both tables; compared by Welch's test.
    Welch,
}

impl ColumnComparison {
    /// Returns whether the values of the column are equal in twelve digits.
    pub fn is_equal(&self) -> bool {
        self.differing == 0 && self.means.iter().all(MeanComparison::is_equal)
    }

    /// Returns the mean that differs most: first those beyond noise, then by relative difference.
    pub(crate) fn largest(&self) -> Option<&MeanComparison> {
        let different = self.means.iter().filter(|mean| !mean.is_equal());
        different.max_by(|one, other| one.by_size(other))
    }
}

impl MeanComparison {
    pub fn is_equal(&self) -> bool {
        self.difference == 0.0
    }

    /// Orders differences: those that are noise first, then by the difference relative to the
    /// larger mean.
    pub(crate) fn by_size(&self, other: &MeanComparison) -> Ordering {
        let relative = |mean: &MeanComparison| {
            let scale = mean.mean_a.abs().max(mean.mean_b.abs());
            if scale == 0.0 { 0.0 } else { (mean.difference / scale).abs() }
        };
        let is_real = |mean: &MeanComparison| mean.is_more_than_noise == Some(true);
        is_real(self).cmp(&is_real(other)).then(relative(self).total_cmp(&relative(other)))
    }

    /// Compares the means of a group. Differences up to `noise` are rounding errors.
    fn new(group: &RowGroup, a: &Values, b: &Values, noise: f64) -> Option<MeanComparison> {
        let pairs: Vec<(f64, f64)> =
            group.pairs().filter_map(|(row, other)| Some((a[row]?, b[other]?))).collect();
        let test = if group.pairs().next().is_some() { Test::Paired } else { Test::Welch };
        let all = |side: usize, values: &Values| {
            group.rows[side].values().filter_map(|&row| values[row]).collect()
        };
        let (values_a, values_b): (Vec<f64>, Vec<f64>) = match test {
            Test::Paired => pairs.iter().copied().unzip(),
            Test::Welch => (all(0, a), all(1, b)),
        };
        if values_a.is_empty() || values_b.is_empty() {
            return None;
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let [mean_a, mean_b] = [&values_a, &values_b].map(|values| mean(values));
        let (is_equal, tested) = match test {
            Test::Paired => {
                let differences: Vec<f64> = pairs.iter().map(|(a, b)| b - a).collect();
                let is_equal = pairs.iter().all(|&(a, b)| is_same(a, b, noise));
                (is_equal, MeanDifference::paired(&differences))
            }
            Test::Welch => {
                (is_same(mean_a, mean_b, noise), MeanDifference::independent(&values_a, &values_b))
            }
        };
        let found = tested.filter(|_| !is_equal);
        let value = found.map_or(mean_b - mean_a, |found| found.value);
        let difference = if is_equal { 0.0 } else { value };
        let interval = found.map(|found| found.interval(LEVEL));
        Some(MeanComparison {
            point: group.point.clone(),
            load: group.load,
            row: group.repetition,
            test,
            values_a: values_a.len(),
            values_b: values_b.len(),
            mean_a,
            mean_b,
            difference,
            relative: (mean_a != 0.0).then(|| difference / mean_a.abs()),
            lower: interval.map(|[lower, _]| lower),
            upper: interval.map(|[_, upper]| upper),
            p_value: found.map(|found| found.p_value()),
            p_corrected: None,
            is_more_than_noise: None,
        })
    }
}

/// Numbers of a column, or `None` where a value is null.
type Values = Vec<Option<f64>>;

/// Compares the columns of two tables, except those that identify rows.
pub(crate) fn compare(a: &Table, b: &Table, matched: &MatchedRows) -> Vec<ColumnComparison> {
    let units = TableUnits::from_table(a);
    let units = if units == TableUnits::from_table(b) { units } else { TableUnits::default() };
    let descriptions = a.descriptions().into_iter();
    let columns = descriptions.filter(|column| is_compared(a, &column.name) && b.has(&column.name));
    let compared = columns.map(|column| {
        let [array_a, array_b] =
            [a, b].map(|table| table.batch().column_by_name(&column.name).expect("both have it"));
        let pairs = matched.groups.iter().flat_map(RowGroup::pairs);
        let (differing, means) = match (numbers(array_a), numbers(array_b)) {
            (Some(a), Some(b)) => {
                let noise = RESOLUTION * largest_mean(&matched.groups, [&a, &b]);
                let differs = |&(row, other): &(usize, usize)| !are_same(a[row], b[other], noise);
                let groups = matched.groups.iter();
                let means = groups.filter_map(|group| MeanComparison::new(group, &a, &b, noise));
                (pairs.filter(differs).count(), means.collect())
            }
            _ => {
                let differs =
                    |&(row, other): &(usize, usize)| !is_same_cell(array_a, row, array_b, other);
                (pairs.filter(differs).count(), Vec::new())
            }
        };
        let has_named_unit = units.shown(&column.unit).is_some();
        let unit = units.name(&column.unit);
        ColumnComparison { column: column.name, unit, has_named_unit, differing, means }
    });
    compared.collect()
}

/// Returns the names of the compared columns of `of` that `other` lacks.
pub(crate) fn lacking(of: &Table, other: &Table) -> Vec<String> {
    let names = of.names().into_iter().filter(|name| is_compared(of, name) && !other.has(name));
    names.map(str::to_owned).collect()
}

/// Returns whether a column is compared: whether it neither identifies rows nor repeats another
/// column in another unit. The columns of tasks and surface names contain hashes of all parameters.
fn is_compared(table: &Table, name: &str) -> bool {
    let field = table.batch().schema_ref().field_with_name(name).expect("the table has the column");
    let identifies = matches!(Role::from_field(field), Some(Role::Parameter | Role::Load));
    let repeats = field.metadata().contains_key(REDUCED);
    let others = [SEED.name, REALIZATION.name, SURFACE.name];
    !identifies && !repeats && !others.contains(&name) && !OWN_COLUMNS.contains(&name)
}

/// Reads a column of numbers or flags, with 1 for true. Returns `None` for other types.
fn numbers(array: &ArrayRef) -> Option<Values> {
    let types = [DataType::Float64, DataType::Int64, DataType::Boolean];
    let is_number = types.contains(array.data_type());
    let reals = is_number.then(|| cast(array, &DataType::Float64)).transpose().ok()??;
    Some(reals.as_primitive::<Float64Type>().iter().collect())
}

/// Returns whether the compared columns of two tables have the same bits, row by row.
pub(crate) fn are_identical(a: &Table, b: &Table) -> bool {
    let compared = |table: &Table| table.keep(|name, _| is_compared(table, name));
    compared(a).batch().columns() == compared(b).batch().columns()
}

/// Returns the largest magnitude of the means of a column at the points and loads of both tables.
fn largest_mean(groups: &[RowGroup], values: [&Values; 2]) -> f64 {
    let means = groups.iter().flat_map(|group| {
        [0, 1].map(|side| {
            let own = group.rows[side].values().filter_map(|&row| values[side][row]);
            let (sum, count) = own.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
            sum / f64::from(count.max(1))
        })
    });
    means.map(f64::abs).filter(|mean| mean.is_finite()).fold(0.0, f64::max)
}

/// Returns whether two numbers are equal in twelve digits, or differ by at most `noise`.
fn is_same(one: f64, other: f64, noise: f64) -> bool {
    let tolerance = noise.max(RESOLUTION * one.abs().max(other.abs()));
    one == other || (one - other).abs() <= tolerance
}

/// Returns whether two numbers are the same in the sense of [`is_same`], or both are null.
fn are_same(one: Option<f64>, other: Option<f64>, noise: f64) -> bool {
    match (one, other) {
        (Some(one), Some(other)) => is_same(one, other, noise),
        _ => one == other,
    }
}

/// Returns whether two cells are equal; lists are equal if their numbers are.
fn is_same_cell(a: &ArrayRef, row: usize, b: &ArrayRef, other: usize) -> bool {
    if let (Some(a), Some(b)) = (a.as_list_opt::<i64>(), b.as_list_opt::<i64>())
        && a.is_valid(row)
        && b.is_valid(other)
    {
        let (a, b) = (numbers(&a.value(row)), numbers(&b.value(other)));
        return a.zip(b).is_some_and(|(a, b)| {
            a.len() == b.len() && a.iter().zip(&b).all(|(one, other)| are_same(*one, *other, 0.0))
        });
    }
    a.data_type() == b.data_type() && a.slice(row, 1) == b.slice(other, 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_stages::columns::LOAD;
    use asperity_tables::column::{Column, ColumnKind, integers, optional_reals, reals, texts};

    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");
    const STATUS: Column = Column::result("status", ColumnKind::Text, "", "status");

    fn table(seed: i64, areas: &[Option<f64>]) -> Table {
        let count = areas.len();
        Table::new(
            count,
            vec![
                (SEED, integers(std::iter::repeat_n(seed, count))),
                (REALIZATION, integers(0..count as i64)),
                (AREA, optional_reals(areas.iter().copied())),
                (STATUS, texts((0..count).map(|row| format!("{seed}{row}")))),
            ],
        )
    }

    fn compared(a: &Table, b: &Table) -> Vec<ColumnComparison> {
        compare(a, b, &MatchedRows::new(a, b).unwrap())
    }

    #[test]
    fn values_of_the_same_surface_are_compared_in_pairs() {
        let a = table(7, &[Some(1.0), Some(2.0), Some(3.0), None]);
        let b = table(7, &[Some(1.5), Some(2.5), Some(3.8), Some(9.0)]);
        let [area, status] = &compared(&a, &b)[..] else { panic!("two columns") };
        assert_eq!((area.differing, status.differing), (4, 0));
        let mean = &area.means[0];
        assert_eq!((mean.test, mean.values_a, mean.values_b), (Test::Paired, 3, 3));
        let differences = MeanDifference::paired(&[0.5, 0.5, 0.8]).unwrap();
        assert!((mean.difference - 0.6).abs() < 1e-15);
        let [lower, upper] = differences.interval(0.95);
        assert!((mean.lower.unwrap() - lower).abs() < 1e-14);
        assert!((mean.upper.unwrap() - upper).abs() < 1e-14);
        assert!((mean.relative.unwrap() - 0.3).abs() < 1e-15);
    }

    #[test]
    fn other_seeds_are_independent_surfaces() {
        let a = table(7, &[Some(1.0), Some(2.0), Some(3.0)]);
        let b = table(8, &[Some(4.0), Some(5.0)]);
        let compared = compared(&a, &b);
        let mean = &compared[0].means[0];
        assert_eq!((mean.test, mean.values_a, mean.values_b), (Test::Welch, 3, 2));
        assert_eq!(mean.difference, 2.5);
        assert_eq!(compared[1].differing, 0, "texts of different surfaces are not compared");
    }

    #[test]
    fn numbers_that_agree_in_twelve_digits_are_equal() {
        let a = table(7, &[Some(1.0), Some(2.0)]);
        let close = table(7, &[Some(1.0 + 1e-13), Some(2.0)]);
        let other = table(7, &[Some(1.0 + 1e-11), Some(2.0)]);
        assert!(compared(&a, &close)[0].is_equal() && !are_identical(&a, &close));
        assert_eq!(compared(&a, &close)[0].means[0].difference, 0.0);
        assert!(!compared(&a, &other)[0].is_equal());
        // One mean is zero but for rounding, relative to the other mean.
        let near_zero = |first: f64| {
            let loads = [0.1, 0.2];
            table(7, &[Some(first), Some(1.0)]).with(vec![(LOAD, reals(loads))])
        };
        let columns = |second: f64| compared(&near_zero(3e-17), &near_zero(second));
        assert!(columns(-2e-14)[0].is_equal());
        assert!(!columns(-2e-11)[0].is_equal());
        assert!(are_identical(&a, &a));
    }

    #[test]
    fn a_single_pair_has_a_difference_and_no_interval() {
        let [a, b] = [1.0, 3.0].map(|area| table(7, &[Some(area)]));
        let mean = &compared(&a, &b)[0].means[0];
        assert_eq!((mean.difference, mean.lower, mean.p_value), (2.0, None, None));
    }
}
