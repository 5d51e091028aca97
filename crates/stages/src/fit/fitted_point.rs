//! Result of the fit of one parameter point.

use arrow::array::ArrayRef;

use crate::columns::{codes, columns, integer, parameter_text, real};
use crate::fit::status;
use asperity_statistics::bootstrap::{Interval, Intervals};
use asperity_statistics::{FitError, GoodnessOfFit};
use asperity_tables::column::{Code, Column, optional_reals};

/// Maximum fraction of the data that may be left out of a fit because the logarithm is undefined.
const MAX_MASKED_FRACTION: f64 = 0.2;

/// Result of the fit of one parameter point.
#[derive(Default)]
pub struct FittedPoint {
    /// Parameters in the order of the law; empty if the fit failed.
    pub values: Vec<f64>,
    pub intervals: Option<Vec<Interval>>,
    /// Number of resamplings that could not be fitted.
    pub failed_replicates: usize,
    /// Smallest κ of the contact evolution law for which the slopes of this point are convex.
    pub own_kappa: Option<f64>,
    pub rms_residual: Option<f64>,
    pub r_squared: Option<f64>,
    pub reduced_chi_square: Option<f64>,
    pub data: usize,
    /// Number of rows for which the solver did not converge.
    pub unconverged: usize,
    /// Number of data that were left out because the logarithm is undefined.
    pub masked: Option<usize>,
    pub convex: Option<bool>,
    /// Reason why all values or some values are missing.
    pub failure: Option<Code>,
}

impl FittedPoint {
    /// Creates a row with intervals and without any other values.
    pub fn from_intervals(intervals: Intervals) -> FittedPoint {
        FittedPoint {
            failed_replicates: intervals.failed,
            intervals: intervals.intervals,
            ..FittedPoint::default()
        }
    }

    /// Creates the row of a fit with these values of the parameters.
    pub fn fitted(values: Vec<f64>, goodness: &GoodnessOfFit, intervals: Intervals) -> FittedPoint {
        FittedPoint {
            values,
            rms_residual: Some(goodness.rms_residual),
            r_squared: goodness.r_squared,
            data: goodness.data,
            masked: Some(goodness.masked),
            ..FittedPoint::from_intervals(intervals)
        }
    }

    /// Creates the row of a failed fit.
    pub fn failed(error: &FitError) -> FittedPoint {
        FittedPoint { failure: Some(status::from_error(error)), ..FittedPoint::default() }
    }

    /// Returns the row, or a failure if too many data were left out.
    pub fn unless_masked(self) -> FittedPoint {
        let masked = self.masked.unwrap_or(0);
        let all = self.data + masked;
        if masked as f64 <= MAX_MASKED_FRACTION * all as f64 {
            return self;
        }
        self.refused(status::TOO_MANY_MASKED)
    }

    /// Returns the row, or a failure if a parameter is not finite because the data do not bound it.
    pub fn unless_unbounded(self) -> FittedPoint {
        if self.values.iter().all(|value| value.is_finite()) {
            return self;
        }
        self.refused(status::UNBOUNDED)
    }

    /// Replaces the result by a failure that keeps only the numbers of data.
    fn refused(self, failure: Code) -> FittedPoint {
        FittedPoint {
            failure: Some(failure),
            masked: self.masked,
            data: self.data,
            ..FittedPoint::default()
        }
    }

    /// Returns the code of the column `status`.
    pub fn status(&self) -> &'static str {
        self.failure.unwrap_or(status::FITTED).word
    }
}

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

columns! {
    /// law that is fitted
    pub const LAW: Column = parameter_text("law").with_codes(codes![
        /// contact evolution law of Yastrebov, Anciaux & Molinari (2015)
        "contact-evolution",
        /// growth of the mean contact pressure p̄ with the load, dp̄/dp₀ = β a^(μ − 1)
        "mean-pressure",
        /// contact area a near full contact under the load y, a = erf(β √2 y)
        "scaled-erf",
        /// load as a function of the mean gap ū, p₀ = p_c exp(−ū/u₀)
        "load-separation",
        /// contact area of one surface on several meshes, A_N = A* + c S_d Δx
        "mesh-convergence",
        /// contact area and load at which the gap ceases to percolate
        "gap-percolation",
        /// power spectral density, C(q) = C₀ for q ≤ q_r and C₀ (q/q_r)^(−2(1 + H)) for q > q_r
        "self-affine",
        /// limit of an observable where small parameters vanish, Q = Q₀ + Σ cⱼ fⱼ(xⱼ)
        "limits",
    ]);
    /// number of surfaces in the fit
    pub const SURFACES: Column = integer("surfaces", "1");
    /// number of rows whose load did not converge; the fit includes them
    pub const UNCONVERGED: Column = integer("unconverged", "1");
    /// number of data that the law is fitted to
    pub const DATA: Column = integer("data", "1");
    /// root mean square residual
    pub const RMS_RESIDUAL: Column = real("rms_residual", "1");
    /// χ² divided by the degrees of freedom, with variances from the scatter between surfaces
    pub const CHI_SQUARE: Column = real("reduced_chi_square", "1");
    /// number of bootstrap resamplings of surfaces
    pub const BOOTSTRAP: Column = integer("bootstrap", "1");
    /// number of resamplings that could not be fitted
    pub const BOOTSTRAP_FAILED: Column = integer("bootstrap_failed", "1");
}
