//! Rows of the tables of fits: the result of a fit, the columns of fitted parameters, and the
//! columns that all laws have.

use arrow::array::ArrayRef;

use super::Params;
use super::contact_evolution::{Datum, EvolutionChoices, Kappa};
use super::laws::{Law, PlainLaw};
use super::status;
use crate::columns::{flag, integer, parameter, parameter_text, real, text};
use asperity_statistics::bootstrap::{Interval, Intervals};
use asperity_statistics::{FitError, GoodnessOfFit};
use asperity_tables::column::{
    Code, Column, integers, optional_flags, optional_reals, reals, texts,
};
use asperity_tables::table::Table;

/// Maximum fraction of the data that may be left out of a fit because the logarithm is undefined.
const MAX_MASKED_FRACTION: f64 = 0.2;

/// Result of the fit of one parameter point.
#[derive(Default)]
pub struct Row {
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

impl Row {
    /// Creates a row with intervals and without any other values.
    pub fn from_intervals(intervals: Intervals) -> Row {
        Row {
            failed_replicates: intervals.failed,
            intervals: intervals.intervals,
            ..Row::default()
        }
    }

    /// Creates the row of a fit with these values of the parameters.
    pub fn fitted(values: Vec<f64>, goodness: &GoodnessOfFit, intervals: Intervals) -> Row {
        Row {
            values,
            rms_residual: Some(goodness.rms_residual),
            r_squared: goodness.r_squared,
            data: goodness.data,
            masked: Some(goodness.masked),
            ..Row::from_intervals(intervals)
        }
    }

    /// Creates the row of a failed fit.
    pub fn failed(error: &FitError) -> Row {
        Row { failure: Some(status::from_error(error)), ..Row::default() }
    }

    /// Returns the row, or a failure if too many data were left out.
    pub fn unless_masked(self) -> Row {
        let masked = self.masked.unwrap_or(0);
        let all = self.data + masked;
        if masked as f64 <= MAX_MASKED_FRACTION * all as f64 {
            return self;
        }
        self.refused(status::TOO_MANY_MASKED)
    }

    /// Returns the row, or a failure if a parameter is not finite because the data do not bound it.
    pub fn unless_unbounded(self) -> Row {
        if self.values.iter().all(|value| value.is_finite()) {
            return self;
        }
        self.refused(status::UNBOUNDED)
    }

    /// Replaces the result by a failure that keeps only the numbers of data.
    fn refused(self, failure: Code) -> Row {
        Row { failure: Some(failure), masked: self.masked, data: self.data, ..Row::default() }
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

/// Estimate of a parameter, with its interval if there is one.
#[derive(Clone, Copy)]
pub struct Estimate {
    pub value: f64,
    pub interval: Option<Interval>,
}

/// Columns of a fitted parameter: estimate, ends of the interval, standard error.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Label in the summary of a stage; `None` if the summary omits the parameter.
    pub label: Option<&'static str>,
    pub value: Column,
    lower: Column,
    upper: Column,
    error: Column,
}

impl Parameter {
    /// Declares a parameter that is a pure number. `names` are the names of its columns, in the
    /// order of [`Parameter::columns`].
    pub const fn number(names: [&'static str; 4], meaning: &'static str) -> Parameter {
        Parameter::of_unit("1", names, meaning)
    }

    /// Declares a parameter with a unit.
    pub const fn of_unit(
        unit: &'static str,
        names: [&'static str; 4],
        meaning: &'static str,
    ) -> Parameter {
        let [value, lower, upper, error] = names;
        Parameter {
            label: None,
            value: real(value, unit, meaning),
            lower: real(
                lower,
                unit,
                "lower end of the bootstrap interval at the confidence level of the stage",
            ),
            upper: real(
                upper,
                unit,
                "upper end of the bootstrap interval at the confidence level of the stage",
            ),
            error: real(error, unit, "standard error by bootstrap"),
        }
    }

    /// Sets the label in the summary of a stage.
    pub const fn with_label(self, label: &'static str) -> Parameter {
        Parameter { label: Some(label), ..self }
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
        let estimates: Vec<Option<Estimate>> = estimates.collect();
        let column = |value: fn(&Estimate) -> Option<f64>| {
            let values = estimates.iter().map(|estimate| value(estimate.as_ref()?));
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

// Columns that the tables of all laws have.
pub const LAW: Column = parameter_text("law", "law that is fitted").with_codes(&[
    Code {
        word: "contact-evolution",
        meaning: "contact evolution law of Yastrebov, Anciaux & Molinari (2015)",
    },
    Code {
        word: "mean-pressure",
        meaning: "growth of the mean contact pressure p̄ with the load, dp̄/dp₀ = β a^(μ − 1)",
    },
    Code {
        word: "scaled-erf",
        meaning: "contact area a near full contact under the load y, a = erf(β √2 y)",
    },
    Code {
        word: "load-separation",
        meaning: "load as a function of the mean gap ū, p₀ = p_c exp(−ū/u₀)",
    },
    Code {
        word: "mesh-convergence",
        meaning: "contact area of one surface on several meshes, A_N = A* + c S_d Δx",
    },
    Code {
        word: "gap-percolation",
        meaning: "contact area and load at which the gap ceases to percolate",
    },
    Code {
        word: "self-affine",
        meaning: "power spectral density, C(q) = C₀ for q ≤ q_r and C₀ (q/q_r)^(−2(1 + H)) for \
                  q > q_r",
    },
    Code {
        word: "limits",
        meaning: "limit of an observable where small parameters vanish, Q = Q₀ + Σ cⱼ fⱼ(xⱼ)",
    },
]);
pub const SURFACES: Column = integer("surfaces", "1", "number of surfaces in the fit");
pub const UNCONVERGED: Column = integer(
    "unconverged",
    "1",
    "number of rows whose load did not converge; the fit includes them",
);
pub const DATA: Column = integer("data", "1", "number of data that the law is fitted to");
pub const RMS_RESIDUAL: Column = real("rms_residual", "1", "root mean square residual");
pub const CHI_SQUARE: Column = real(
    "reduced_chi_square",
    "1",
    "χ² divided by the degrees of freedom, with variances from the scatter between surfaces",
);
pub const BOOTSTRAP: Column =
    integer("bootstrap", "1", "number of bootstrap resamplings of surfaces");
pub const BOOTSTRAP_FAILED: Column =
    integer("bootstrap_failed", "1", "number of resamplings that could not be fitted");
pub const STATUS: Column =
    text("status", "how the fit ended, or why values are missing").with_codes(status::CODES);

// Columns that only some laws have.
const DATUM: Column = parameter_text("fitted_to", "quantity whose residuals are minimised")
    .with_codes(&[
        Code { word: "slope", meaning: "slope of the mean area between neighbouring loads" },
        Code { word: "area", meaning: "mean area" },
    ]);
const KAPPA_IS: Column = parameter_text("kappa_is", "how κ is determined").with_codes(&[
    Code { word: "given", meaning: "κ is a number of the manifest" },
    Code { word: "free", meaning: "κ is fitted with the other parameters" },
    Code {
        word: "minimal-convex",
        meaning: "κ is the smallest value for which the fitted slope is convex",
    },
]);
const KAPPA_GIVEN: Column =
    parameter("kappa_given", "1", "κ from the manifest; null unless `kappa_is` is `given`");
const WINDOW_LOWER: Column =
    parameter("window_lower", "E* × rms slope", "smallest load of the fitted data");
const WINDOW_UPPER: Column =
    parameter("window_upper", "E* × rms slope", "largest load of the fitted data");
const WAVENUMBER_LOWER: Column =
    parameter("wavenumber_lower", "1/length", "smallest wavenumber of the fitted data");
const WAVENUMBER_UPPER: Column =
    parameter("wavenumber_upper", "1/length", "largest wavenumber of the fitted data");
const KAPPA_CONVEX: Column = real(
    "kappa_convex",
    "1",
    "smallest κ for which the fitted slope of this parameter point is convex",
);
const MASKED: Column = integer(
    "masked",
    "1",
    "number of data in the window that were left out because they have no logarithm",
);
const R_SQUARED: Column = real(
    "r_squared",
    "1",
    "coefficient of determination: fraction of the variance that the fit explains",
);
const CONVEX: Column = flag("convex", "whether the fitted slope is convex in the window");

/// Returns the columns that laws with these parameters may add.
pub fn columns(parameters: impl IntoIterator<Item = Parameter>) -> Vec<Column> {
    let law = [
        LAW,
        DATUM,
        KAPPA_IS,
        KAPPA_GIVEN,
        WINDOW_LOWER,
        WINDOW_UPPER,
        WAVENUMBER_LOWER,
        WAVENUMBER_UPPER,
    ];
    let estimates = parameters.into_iter().flat_map(Parameter::columns);
    let quality = [
        KAPPA_CONVEX,
        CONVEX,
        MASKED,
        SURFACES,
        UNCONVERGED,
        DATA,
        RMS_RESIDUAL,
        R_SQUARED,
        CHI_SQUARE,
        BOOTSTRAP,
        BOOTSTRAP_FAILED,
        STATUS,
    ];
    law.into_iter().chain(estimates).chain(quality).collect()
}

/// Creates the table of fits. `fitted` holds, for each fit, the index of the row of `coordinates`
/// with the parameters, and the number of surfaces.
pub fn table(
    coordinates: &Table,
    fitted: &[(usize, usize)],
    params: &Params,
    rows: &[Row],
) -> Table {
    let (of_rows, surfaces): (Vec<usize>, Vec<usize>) = fitted.iter().copied().unzip();
    let rows: Vec<&Row> = rows.iter().collect();
    let mut columns = law_columns(params, rows.len());
    columns.extend(estimates(params, &rows));
    columns.extend(quality(&surfaces, params, &rows));
    coordinates.pick(&of_rows).with(columns)
}

/// Returns the columns that distinguish this fit from other fits of the same points: the law, its
/// choices, and the window.
pub fn law_columns(params: &Params, count: usize) -> Vec<(Column, ArrayRef)> {
    let mut columns = vec![(LAW, texts(vec![params.law.word(); count]))];
    columns.extend(choices(&params.law, count));
    let [from, to] = params.window;
    let [lower, upper] = match &params.law {
        Law::Plain(PlainLaw::SelfAffine) => [WAVENUMBER_LOWER, WAVENUMBER_UPPER],
        _ => [WINDOW_LOWER, WINDOW_UPPER],
    };
    columns.push((lower, reals(vec![from; count])));
    columns.push((upper, reals(vec![to; count])));
    columns
}

/// Returns the columns of the parameters and their intervals.
pub fn estimates(params: &Params, rows: &[&Row]) -> Vec<(Column, ArrayRef)> {
    let parameters = params.law.parameters().iter().enumerate();
    let columns = parameters.flat_map(|(index, parameter)| {
        parameter.filled(rows.iter().map(|row| {
            let interval = row.intervals.as_ref().and_then(|all| all.get(index));
            let value = row.values.get(index).copied().unwrap_or(f64::NAN);
            Some(Estimate { value, interval: interval.copied() })
        }))
    });
    columns.collect()
}

fn choices(law: &Law, count: usize) -> Vec<(Column, ArrayRef)> {
    let Law::ContactEvolution(EvolutionChoices { to, kappa }) = law else {
        return Vec::new();
    };
    let to = match to {
        Datum::Slope => "slope",
        Datum::Area => "area",
    };
    let (kappa_is, given) = match kappa {
        Kappa::Given(kappa) => ("given", Some(*kappa)),
        Kappa::Free => ("free", None),
        Kappa::MinimalConvex => ("minimal-convex", None),
    };
    vec![
        (DATUM, texts(vec![to; count])),
        (KAPPA_IS, texts(vec![kappa_is; count])),
        (KAPPA_GIVEN, optional_reals(vec![given; count])),
    ]
}

/// Returns the columns with the data, the quality and the status of fits.
pub fn quality(surfaces: &[usize], params: &Params, rows: &[&Row]) -> Vec<(Column, ArrayRef)> {
    let real = |value: fn(&Row) -> Option<f64>| optional_reals(rows.iter().map(|row| value(row)));
    let mut columns = Vec::new();
    if let Law::ContactEvolution(law) = &params.law {
        if law.kappa == Kappa::MinimalConvex {
            columns.push((KAPPA_CONVEX, real(|row| row.own_kappa)));
        }
        columns.push((CONVEX, optional_flags(rows.iter().map(|row| row.convex))));
    }
    let surfaces = surfaces.iter().map(|&surfaces| surfaces as i64);
    if !matches!(params.law, Law::ContactEvolution(_)) {
        let masked = rows.iter().map(|row| row.masked.unwrap_or(0) as i64);
        columns.push((MASKED, integers(masked)));
    }
    columns.extend([
        (SURFACES, integers(surfaces)),
        (UNCONVERGED, integers(rows.iter().map(|row| row.unconverged as i64))),
        (DATA, integers(rows.iter().map(|row| row.data as i64))),
        (RMS_RESIDUAL, real(|row| row.rms_residual)),
        (R_SQUARED, real(|row| row.r_squared)),
        (CHI_SQUARE, real(|row| row.reduced_chi_square)),
        (BOOTSTRAP, integers(vec![i64::from(params.bootstrap); rows.len()])),
        (BOOTSTRAP_FAILED, integers(rows.iter().map(|row| row.failed_replicates as i64))),
        (STATUS, texts(rows.iter().map(|row| row.status()))),
    ]);
    columns
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::fit::{contact_evolution, limits};

    #[test]
    fn every_law_has_a_code() {
        let plain = PlainLaw::ALL.map(|law| law.definition().word);
        let laws = plain.into_iter().chain([contact_evolution::WORD, limits::WORD]);
        let codes = LAW.codes.iter().map(|code| code.word);
        assert_eq!(codes.collect::<BTreeSet<_>>(), laws.collect::<BTreeSet<_>>());
    }
}
