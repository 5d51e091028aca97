//! Fits as rows of a table.

use arrow::array::ArrayRef;

use super::points::Point;
use super::{Datum, Kappa, Law, Params};
use crate::fitting::FitError;
use crate::fitting::bootstrap::{Interval, Intervals};
use crate::store::column::ColumnKind::{Flag, Integer, Real, Text};
use crate::store::column::{Column, Role, integers, optional_flags, optional_reals, reals, texts};
use crate::store::table::Table;

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

    /// A row that says why there is no fit.
    pub fn failed(error: &FitError) -> Row {
        Row {
            failure: Some(error.to_string()),
            ..Row::default()
        }
    }

    /// The same row, or a failure if so many data are left out that the rest speaks for itself
    /// alone.
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

    fn status(&self) -> &str {
        self.failure.as_deref().unwrap_or(FITTED)
    }
}

/// A parameter and its interval.
struct Parameter {
    value: Column,
    lower: Column,
    upper: Column,
    error: Column,
}

const fn parameter(names: [&'static str; 4], meaning: &'static str) -> Parameter {
    parameter_in("1", names, meaning)
}

const fn parameter_in(
    unit: &'static str,
    names: [&'static str; 4],
    meaning: &'static str,
) -> Parameter {
    let [value, lower, upper, error] = names;
    Parameter {
        value: Column::result(value, Real, unit, meaning),
        lower: Column::result(lower, Real, unit, "lower end of the interval"),
        upper: Column::result(upper, Real, unit, "upper end of the interval"),
        error: Column::result(error, Real, unit, "standard error by bootstrap"),
    }
}

const KAPPA: Parameter = parameter(
    [
        "kappa",
        "kappa_lower",
        "kappa_upper",
        "kappa_standard_error",
    ],
    "κ: slope of area against load at first touch",
);
const BETA: Parameter = parameter(
    ["beta", "beta_lower", "beta_upper", "beta_standard_error"],
    "β of the contact evolution law",
);
const MU: Parameter = parameter(
    ["mu", "mu_lower", "mu_upper", "mu_standard_error"],
    "μ of the contact evolution law; slopes are convex for μ ≤ 1",
);
const EXPONENT: Parameter = parameter(
    [
        "exponent",
        "exponent_lower",
        "exponent_upper",
        "exponent_standard_error",
    ],
    "exponent of dp̄/dp₀ as a power of the area, μ − 1",
);
const PREFACTOR: Parameter = parameter(
    [
        "prefactor",
        "prefactor_lower",
        "prefactor_upper",
        "prefactor_standard_error",
    ],
    "prefactor of dp̄/dp₀ as a power of the area, β",
);
const ERF_SCALE: Parameter = parameter(
    [
        "erf_scale",
        "erf_scale_lower",
        "erf_scale_upper",
        "erf_scale_standard_error",
    ],
    "β of a = erf(β √2 y); 1 in Persson's theory",
);
const DECAY_LENGTH: Parameter = parameter_in(
    "length",
    [
        "decay_length",
        "decay_length_lower",
        "decay_length_upper",
        "decay_length_standard_error",
    ],
    "u₀ of p₀ = p_c exp(−ū/u₀): how much the mean gap falls while the load grows by the factor e",
);
const CLOSING_LOAD: Parameter = parameter_in(
    "E* × rms slope",
    [
        "closing_load",
        "closing_load_lower",
        "closing_load_upper",
        "closing_load_standard_error",
    ],
    "p_c of p₀ = p_c exp(−ū/u₀): the load at which the exponential has no gap left",
);

const MESH_COEFFICIENT: Parameter = parameter(
    [
        "mesh_coefficient",
        "mesh_coefficient_lower",
        "mesh_coefficient_upper",
        "mesh_coefficient_standard_error",
    ],
    "c of A_N = A* + c S_d Δx: the share of S_d Δx that the mesh adds",
);

const LAW: Column = Column::parameter("law", Text, "", "the law that is fitted");
const DATUM: Column = Column::parameter("fitted_to", Text, "", "what the residuals are taken of");
const KAPPA_IS: Column = Column::parameter("kappa_is", Text, "", "given, free or minimal-convex");
const KAPPA_GIVEN: Column =
    Column::parameter("kappa_given", Real, "1", "κ that is given, if it is");
const WINDOW_LOWER: Column = Column::parameter(
    "window_lower",
    Real,
    "E* × rms slope",
    "smallest load that counts",
);
const WINDOW_UPPER: Column = Column::parameter(
    "window_upper",
    Real,
    "E* × rms slope",
    "largest load that counts",
);
const KAPPA_CONVEX: Column = Column::result(
    "kappa_convex",
    Real,
    "1",
    "smallest κ that makes this point's slopes convex",
);
const SURFACES: Column = Column::result("surfaces", Integer, "1", "surfaces pooled");
const UNCONVERGED: Column = Column::result(
    "unconverged",
    Integer,
    "1",
    "rows whose load did not converge; they are fitted all the same",
);
const MASKED: Column = Column::result(
    "masked",
    Integer,
    "1",
    "data that the law cannot have: no increase of the mean pressure, or full contact",
);
const DATA: Column = Column::result("data", Integer, "1", "data fitted");
const RMS_RESIDUAL: Column = Column::result("rms_residual", Real, "1", "root mean square residual");
const R_SQUARED: Column = Column::result(
    "r_squared",
    Real,
    "1",
    "share of the data's variance that the fit explains",
);
const CHI_SQUARE: Column = Column::result(
    "reduced_chi_square",
    Real,
    "1",
    "χ² over degrees of freedom, from the scatter between surfaces",
);
const CONVEX: Column = Column::result(
    "convex",
    Flag,
    "",
    "whether the fitted slope is convex in the window",
);
const BOOTSTRAP: Column =
    Column::result("bootstrap", Integer, "1", "resamplings of whole surfaces");
const BOOTSTRAP_FAILED: Column = Column::result(
    "bootstrap_failed",
    Integer,
    "1",
    "resamplings that could not be fitted",
);
/// Whether there is a fit.
pub const STATUS: Column = Column::result("status", Text, "", "fitted, or why there are no values");

/// Every column that a law of one parameter point may add.
pub fn columns() -> Vec<Column> {
    let parameters = [
        KAPPA,
        BETA,
        MU,
        EXPONENT,
        PREFACTOR,
        ERF_SCALE,
        DECAY_LENGTH,
        CLOSING_LOAD,
        MESH_COEFFICIENT,
    ];
    let placed = [
        LAW,
        DATUM,
        KAPPA_IS,
        KAPPA_GIVEN,
        WINDOW_LOWER,
        WINDOW_UPPER,
    ];
    let estimates = parameters.into_iter().flat_map(|parameter| {
        [
            parameter.value,
            parameter.lower,
            parameter.upper,
            parameter.error,
        ]
    });
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

/// One row per point: where it belongs, what was fitted, how well.
pub fn table(input: &Table, points: &[Point], params: &Params, rows: &[Row]) -> Table {
    let standing: Vec<usize> = points.iter().map(|point| point.row).collect();
    let count = rows.len();
    let mut columns = placed(params, count);
    let rows: Vec<&Row> = rows.iter().collect();
    columns.extend(estimates(params, &rows));
    let surfaces: Vec<usize> = points.iter().map(|point| point.surfaces).collect();
    columns.extend(quality(&surfaces, params, &rows));
    let parameters = input.in_role(Role::Parameter);
    parameters.pick(&standing).with(columns)
}

/// What places a fit among others of its points.
pub fn placed(params: &Params, count: usize) -> Vec<(Column, ArrayRef)> {
    let mut columns = vec![(LAW, texts(vec![law_name(&params.law); count]))];
    columns.extend(choices(&params.law, count));
    let [from, to] = params.window;
    columns.push((WINDOW_LOWER, reals(vec![from; count])));
    columns.push((WINDOW_UPPER, reals(vec![to; count])));
    columns
}

/// The law's parameters and their intervals.
pub fn estimates(params: &Params, rows: &[&Row]) -> Vec<(Column, ArrayRef)> {
    let parameters = parameters(&params.law).into_iter().enumerate();
    let columns = parameters.flat_map(|(index, parameter)| estimate(parameter, index, rows));
    columns.collect()
}

fn law_name(law: &Law) -> &'static str {
    match law {
        Law::ContactEvolution { .. } => "contact-evolution",
        Law::MeanPressure => "mean-pressure",
        Law::ScaledErf => "scaled-erf",
        Law::LoadSeparation => "load-separation",
        Law::MeshConvergence => "mesh-convergence",
    }
}

fn parameters(law: &Law) -> Vec<Parameter> {
    match law {
        Law::ContactEvolution { .. } => vec![KAPPA, BETA, MU],
        Law::MeanPressure => vec![EXPONENT, PREFACTOR],
        Law::ScaledErf => vec![ERF_SCALE],
        Law::LoadSeparation => vec![DECAY_LENGTH, CLOSING_LOAD],
        Law::MeshConvergence => vec![MESH_COEFFICIENT],
    }
}

fn choices(law: &Law, count: usize) -> Vec<(Column, ArrayRef)> {
    let Law::ContactEvolution { to, kappa } = law else {
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

fn estimate(parameter: Parameter, index: usize, rows: &[&Row]) -> [(Column, ArrayRef); 4] {
    let interval = |value: fn(&Interval) -> f64| {
        let of = |row: &&Row| {
            let end = row.intervals.as_ref()?.get(index).map(value)?;
            end.is_finite().then_some(end)
        };
        optional_reals(rows.iter().map(of).collect::<Vec<_>>())
    };
    let values = rows.iter().map(|row| row.values.get(index).copied());
    [
        (parameter.value, optional_reals(values)),
        (parameter.lower, interval(|interval| interval.lower)),
        (parameter.upper, interval(|interval| interval.upper)),
        (
            parameter.error,
            interval(|interval| interval.standard_error),
        ),
    ]
}

/// How much was fitted, how well, and how it went.
pub fn quality(surfaces: &[usize], params: &Params, rows: &[&Row]) -> Vec<(Column, ArrayRef)> {
    let real = |value: fn(&Row) -> Option<f64>| optional_reals(rows.iter().map(|row| value(row)));
    let mut columns = Vec::new();
    if let Law::ContactEvolution { kappa, .. } = params.law {
        if kappa == Kappa::MinimalConvex {
            columns.push((KAPPA_CONVEX, real(|row| row.own_kappa)));
        }
        columns.push((CONVEX, optional_flags(rows.iter().map(|row| row.convex))));
    }
    let surfaces = surfaces.iter().map(|&surfaces| surfaces as i64);
    if !matches!(params.law, Law::ContactEvolution { .. }) {
        let masked = rows.iter().map(|row| row.masked.unwrap_or(0) as i64);
        columns.push((MASKED, integers(masked)));
    }
    columns.extend([
        (SURFACES, integers(surfaces)),
        (
            UNCONVERGED,
            integers(rows.iter().map(|row| row.unconverged as i64)),
        ),
        (DATA, integers(rows.iter().map(|row| row.data as i64))),
        (RMS_RESIDUAL, real(|row| row.rms_residual)),
        (R_SQUARED, real(|row| row.r_squared)),
        (CHI_SQUARE, real(|row| row.reduced_chi_square)),
        (
            BOOTSTRAP,
            integers(vec![i64::from(params.bootstrap); rows.len()]),
        ),
        (
            BOOTSTRAP_FAILED,
            integers(rows.iter().map(|row| row.failed_replicates as i64)),
        ),
        (STATUS, texts(rows.iter().map(|row| row.status()))),
    ]);
    columns
}
