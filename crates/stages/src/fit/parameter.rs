//! Fitted parameters and their columns.

use arrow::array::ArrayRef;

use crate::columns::{columns, real};
use asperity_statistics::bootstrap::Interval;
use asperity_tables::column::{Column, optional_reals};

/// Returns the names of the columns of a parameter: estimate, ends of the interval, standard error.
macro_rules! names {
    ($($part:literal),+) => {
        [
            concat!($($part),+),
            concat!($($part),+, "_lower"),
            concat!($($part),+, "_upper"),
            concat!($($part),+, "_standard_error"),
        ]
    };
}
pub(super) use names;

columns! {
    /// lower end of the bootstrap interval at the confidence level of the stage
    const LOWER: Column = real("lower", "1");
    /// upper end of the bootstrap interval at the confidence level of the stage
    const UPPER: Column = real("upper", "1");
    /// standard error by bootstrap
    const STANDARD_ERROR: Column = real("standard_error", "1");
}

/// Estimate of a parameter, with its interval if there is one.
#[derive(Clone, Copy)]
pub struct Estimate {
    pub value: f64,
    pub interval: Option<Interval>,
}

/// Columns of a fitted parameter: estimate, ends of the interval, standard error.
#[derive(Debug, Clone, Copy)]
pub struct FitParameter {
    /// Label in the summary of a stage; `None` if the summary omits the parameter.
    pub label: Option<&'static str>,
    pub value: Column,
    lower: Column,
    upper: Column,
    error: Column,
}

impl FitParameter {
    /// Declares a parameter that is a pure number. `names` are the names of its columns, in the
    /// order of [`FitParameter::columns`].
    pub const fn number(names: [&'static str; 4]) -> FitParameter {
        FitParameter::of_unit("1", names)
    }

    /// Declares a parameter with a unit.
    pub const fn of_unit(unit: &'static str, names: [&'static str; 4]) -> FitParameter {
        let [value, lower, upper, error] = names;
        FitParameter {
            label: None,
            value: real(value, unit),
            lower: Column { name: lower, unit, ..LOWER },
            upper: Column { name: upper, unit, ..UPPER },
            error: Column { name: error, unit, ..STANDARD_ERROR },
        }
    }

    /// Sets the meaning of the estimate.
    pub const fn with_meaning(self, meaning: &'static str) -> FitParameter {
        FitParameter { value: self.value.with_meaning(meaning), ..self }
    }

    /// Sets the label in the summary of a stage.
    pub const fn with_label(self, label: &'static str) -> FitParameter {
        FitParameter { label: Some(label), ..self }
    }

    /// Returns the columns of the estimate, of the ends of the interval and of the standard error.
    pub const fn columns(self) -> [Column; 4] {
        [self.value, self.lower, self.upper, self.error]
    }

    /// Returns the columns with estimates. Values and ends of intervals that are not finite become
    /// null.
    pub fn filled(
        self,
        estimates: impl Iterator<Item = Option<Estimate>>,
    ) -> [(Column, ArrayRef); 4] {
        let found: Vec<Option<Estimate>> = estimates.collect();
        let column = |value: fn(&Estimate) -> Option<f64>| {
            let values = found.iter().map(|estimate| value(estimate.as_ref()?));
            optional_reals(values.map(|value| value.filter(|value| value.is_finite())))
        };
        [
            (self.value, column(|one| Some(one.value))),
            (self.lower, column(|one| Some(one.interval?.lower))),
            (self.upper, column(|one| Some(one.interval?.upper))),
            (self.error, column(|one| Some(one.interval?.standard_error))),
        ]
    }
}
