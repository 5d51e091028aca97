//! The parameters of laws, as columns.

use arrow::array::ArrayRef;

use super::row::Row;
use asperity_statistics::bootstrap::Interval;
use asperity_tables::column::ColumnKind::Real;
use asperity_tables::column::{Column, optional_reals};

/// A parameter and its interval.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// What one line calls it, if it has room for it.
    pub symbol: Option<&'static str>,
    /// Its estimate.
    pub value: Column,
    lower: Column,
    upper: Column,
    error: Column,
}

impl Parameter {
    /// A pure number; the names are those of its estimate, of the ends of its interval and of its
    /// standard error.
    pub const fn number(names: [&'static str; 4], meaning: &'static str) -> Parameter {
        Parameter::of_unit("1", names, meaning)
    }

    /// The same in a unit.
    pub const fn of_unit(
        unit: &'static str,
        names: [&'static str; 4],
        meaning: &'static str,
    ) -> Parameter {
        let [value, lower, upper, error] = names;
        Parameter {
            symbol: None,
            value: Column::result(value, Real, unit, meaning),
            lower: Column::result(lower, Real, unit, "lower end of the interval"),
            upper: Column::result(upper, Real, unit, "upper end of the interval"),
            error: Column::result(error, Real, unit, "standard error by bootstrap"),
        }
    }

    /// The same, with what one line calls it.
    pub const fn called(self, symbol: &'static str) -> Parameter {
        Parameter { symbol: Some(symbol), ..self }
    }

    /// Its columns.
    pub const fn columns(self) -> [Column; 4] {
        [self.value, self.lower, self.upper, self.error]
    }

    /// The columns of the parameter at a place among those of its law.
    pub fn estimates(self, index: usize, rows: &[&Row]) -> [(Column, ArrayRef); 4] {
        let interval = |value: fn(&Interval) -> f64| {
            let of = |row: &&Row| {
                let end = row.intervals.as_ref()?.get(index).map(value)?;
                end.is_finite().then_some(end)
            };
            optional_reals(rows.iter().map(of).collect::<Vec<_>>())
        };
        let value = |row: &&Row| row.values.get(index).copied().filter(|value| value.is_finite());
        let values = rows.iter().map(value);
        [
            (self.value, optional_reals(values)),
            (self.lower, interval(|interval| interval.lower)),
            (self.upper, interval(|interval| interval.upper)),
            (self.error, interval(|interval| interval.standard_error)),
        ]
    }
}
