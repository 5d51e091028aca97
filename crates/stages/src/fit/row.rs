//! What came of one fit.

use asperity_statistics::bootstrap::{Interval, Intervals};
use asperity_statistics::{FitError, GoodnessOfFit};

/// The word in the `status` column for a fit that has values; those that have none say why.
pub const FITTED: &str = "fitted";

/// Share of the data that may be left out.
const MOST_MASKED: f64 = 0.2;

/// The outcome for one point.
#[derive(Default)]
pub struct Row {
    /// The law's parameters, in its order; empty if the fit failed.
    pub values: Vec<f64>,
    /// Their intervals.
    pub intervals: Option<Vec<Interval>>,
    /// Replicates that could not be fitted.
    pub failed_replicates: usize,
    /// The smallest convex κ of this point alone.
    pub own_kappa: Option<f64>,
    /// Root mean square of what the fit leaves.
    pub rms_residual: Option<f64>,
    /// Coefficient of determination.
    pub r_squared: Option<f64>,
    /// χ² per degree of freedom.
    pub reduced_chi_square: Option<f64>,
    /// Number of data.
    pub data: usize,
    /// Rows whose load did not converge.
    pub unconverged: usize,
    /// Data left out, because their logarithm does not exist.
    pub masked: Option<usize>,
    /// Whether the fitted slope is convex.
    pub convex: Option<bool>,
    /// Why there is no fit.
    pub failure: Option<String>,
}

impl Row {
    /// A row with intervals, to be filled in.
    pub fn with(intervals: Intervals) -> Row {
        Row {
            failed_replicates: intervals.failed,
            intervals: intervals.intervals,
            ..Row::default()
        }
    }

    /// A row of a law that has nothing free but its parameters.
    pub fn fitted(values: Vec<f64>, goodness: &GoodnessOfFit, intervals: Intervals) -> Row {
        Row {
            values,
            rms_residual: Some(goodness.rms_residual),
            r_squared: goodness.r_squared,
            data: goodness.data,
            masked: Some(goodness.masked),
            ..Row::with(intervals)
        }
    }

    /// A row that says why there is no fit.
    pub fn failed(error: &FitError) -> Row {
        Row { failure: Some(error.to_string()), ..Row::default() }
    }

    /// Turns a row with an infinite parameter into a failure: the data do not bound the parameter.
    pub fn unless_masked(self) -> Row {
        let masked = self.masked.unwrap_or(0);
        let all = self.data + masked;
        if masked as f64 <= MOST_MASKED * all as f64 {
            return self;
        }
        Row {
            failure: Some(format!(
                "{masked} of {all} data have no logarithm, {:.0} % is the most: the mean contact \
                 pressure does not grow, or contact is full; try another window or correction",
                100.0 * MOST_MASKED
            )),
            masked: self.masked,
            data: self.data,
            ..Row::default()
        }
    }

    /// The same row, or a failure if a parameter is beyond all numbers: then the data do not bound
    /// it.
    pub fn unless_unbounded(self) -> Row {
        if self.values.iter().all(|value| value.is_finite()) {
            return self;
        }
        Row {
            failure: Some(
                "a fitted parameter is beyond 1e308: the data do not bound it, try another window"
                    .to_owned(),
            ),
            masked: self.masked,
            data: self.data,
            ..Row::default()
        }
    }

    /// The word for it.
    pub fn status(&self) -> &str {
        self.failure.as_deref().unwrap_or(FITTED)
    }
}
