//! Fits as rows of a table: what came of each, the columns of parameters, and those of all laws.

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

/// Share of the data that may be left out.
const MOST_MASKED: f64 = 0.2;

/// The outcome for one point.
#[derive(Default)]
pub struct Row {
    /// The law's parameters, in its order; empty if the fit failed.
    pub values: Vec<f64>,
    pub intervals: Option<Vec<Interval>>,
    /// Replicates that could not be fitted.
    pub failed_replicates: usize,
    /// The smallest convex κ of this point alone.
    pub own_kappa: Option<f64>,
    pub rms_residual: Option<f64>,
    pub r_squared: Option<f64>,
    pub reduced_chi_square: Option<f64>,
    pub data: usize,
    /// Rows whose load did not converge.
    pub unconverged: usize,
    /// Data left out, because their logarithm does not exist.
    pub masked: Option<usize>,
    pub convex: Option<bool>,
    /// Reason why the fit, or a part of it, has no values.
    pub failure: Option<Code>,
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
        Row { failure: Some(status::of(error)), ..Row::default() }
    }

    /// The same row, or a failure if too many data had to be left out.
    pub fn unless_masked(self) -> Row {
        let masked = self.masked.unwrap_or(0);
        let all = self.data + masked;
        if masked as f64 <= MOST_MASKED * all as f64 {
            return self;
        }
        self.refused(status::TOO_MANY_MASKED)
    }

    /// The same row, or a failure if a parameter is beyond all numbers: then the data do not bound
    /// it.
    pub fn unless_unbounded(self) -> Row {
        if self.values.iter().all(|value| value.is_finite()) {
            return self;
        }
        self.refused(status::UNBOUNDED)
    }

    /// A row that says how many data there are, and why there is no fit.
    fn refused(self, failure: Code) -> Row {
        Row { failure: Some(failure), masked: self.masked, data: self.data, ..Row::default() }
    }

    /// Returns the code of the column `status`.
    pub fn status(&self) -> &'static str {
        self.failure.unwrap_or(status::FITTED).word
    }
}

/// The names of a parameter's columns: its estimate, the ends of its interval and its standard
/// error.
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

/// The estimate of a parameter, and its interval if there is one.
#[derive(Clone, Copy)]
pub struct Estimate {
    pub value: f64,
    pub interval: Option<Interval>,
}

/// A parameter as columns: its estimate, the ends of its interval and its standard error.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// What one line calls it, if it has room for it.
    pub symbol: Option<&'static str>,
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
            value: real(value, unit, meaning),
            lower: real(lower, unit, "lower end of the interval"),
            upper: real(upper, unit, "upper end of the interval"),
            error: real(error, unit, "standard error by bootstrap"),
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

    /// Its columns, filled with estimates; values and ends of intervals that are no finite number
    /// are null.
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
pub const LAW: Column = parameter_text("law", "the law that is fitted");
pub const SURFACES: Column = integer("surfaces", "1", "surfaces pooled");
pub const UNCONVERGED: Column =
    integer("unconverged", "1", "rows whose load did not converge; they are fitted all the same");
pub const DATA: Column = integer("data", "1", "data fitted");
pub const RMS_RESIDUAL: Column = real("rms_residual", "1", "root mean square residual");
pub const CHI_SQUARE: Column = real(
    "reduced_chi_square",
    "1",
    "χ² over degrees of freedom, from the scatter between surfaces",
);
pub const BOOTSTRAP: Column = integer("bootstrap", "1", "resamplings of whole surfaces");
pub const BOOTSTRAP_FAILED: Column =
    integer("bootstrap_failed", "1", "resamplings that could not be fitted");
pub const STATUS: Column =
    text("status", "how the fit ended, or why values are missing").with_codes(status::CODES);

// Columns of some laws.
const DATUM: Column = parameter_text("fitted_to", "quantity whose residuals are minimised")
    .with_codes(&[
        Code { word: "slope", meaning: "the slope of the area between neighbouring loads" },
        Code { word: "area", meaning: "the area" },
    ]);
const KAPPA_IS: Column = parameter_text("kappa_is", "how κ is determined").with_codes(&[
    Code { word: "given", meaning: "κ is a number of the manifest" },
    Code { word: "free", meaning: "κ is fitted with the other parameters" },
    Code {
        word: "minimal-convex",
        meaning: "κ is the smallest value for which the fitted slope is convex",
    },
]);
const KAPPA_GIVEN: Column = parameter("kappa_given", "1", "κ that is given, if it is");
const WINDOW_LOWER: Column =
    parameter("window_lower", "E* × rms slope", "smallest load that counts");
const WINDOW_UPPER: Column =
    parameter("window_upper", "E* × rms slope", "largest load that counts");
const WAVENUMBER_LOWER: Column =
    parameter("wavenumber_lower", "1/length", "smallest wavenumber that counts");
const WAVENUMBER_UPPER: Column =
    parameter("wavenumber_upper", "1/length", "largest wavenumber that counts");
const KAPPA_CONVEX: Column =
    real("kappa_convex", "1", "smallest κ that makes this point's slopes convex");
const MASKED: Column = integer(
    "masked",
    "1",
    "data that the law cannot have: no increase of the mean pressure, or full contact",
);
const R_SQUARED: Column =
    real("r_squared", "1", "share of the data's variance that the fit explains");
const CONVEX: Column = flag("convex", "whether the fitted slope is convex in the window");

/// Every column that a law may add, with those of these parameters.
pub fn columns(parameters: impl IntoIterator<Item = Parameter>) -> Vec<Column> {
    let placed = [
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
    placed.into_iter().chain(estimates).chain(quality).collect()
}

/// One row a fit: where it belongs, what was fitted, how well. `standing` has a row of the input
/// that stands for each, and the number of surfaces.
pub fn table(place: &Table, standing: &[(usize, usize)], params: &Params, rows: &[Row]) -> Table {
    let (standing, surfaces): (Vec<usize>, Vec<usize>) = standing.iter().copied().unzip();
    let rows: Vec<&Row> = rows.iter().collect();
    let mut columns = placed(params, rows.len());
    columns.extend(estimates(params, &rows));
    columns.extend(quality(&surfaces, params, &rows));
    place.pick(&standing).with(columns)
}

/// What places a fit among others of its points.
pub fn placed(params: &Params, count: usize) -> Vec<(Column, ArrayRef)> {
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

/// The law's parameters and their intervals.
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

/// How much was fitted, how well, and how it went.
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
