//! Result of the fit of one parameter point.

use super::status;
use asperity_statistics::bootstrap::{Interval, Intervals};
use asperity_statistics::{FitError, GoodnessOfFit};
use asperity_tables::column::Code;

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
