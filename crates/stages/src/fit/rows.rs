//! Fits as rows of a table.

use arrow::array::ArrayRef;

use super::Params;
use super::common_columns::{
    BOOTSTRAP, BOOTSTRAP_FAILED, CHI_SQUARE, DATA, LAW, RMS_RESIDUAL, STATUS, SURFACES, UNCONVERGED,
};
use super::contact_evolution::{Datum, EvolutionChoices, Kappa};
use super::laws::{Law, PlainLaw};
use super::parameter::Parameter;
use super::points::Point;
use super::row::Row;
use asperity_tables::column::ColumnKind::{Flag, Integer, Real, Text};
use asperity_tables::column::{
    Column, Role, integers, optional_flags, optional_reals, reals, texts,
};
use asperity_tables::table::Table;

const DATUM: Column = Column::parameter("fitted_to", Text, "", "what the residuals are taken of");
const KAPPA_IS: Column = Column::parameter("kappa_is", Text, "", "given, free or minimal-convex");
const KAPPA_GIVEN: Column =
    Column::parameter("kappa_given", Real, "1", "κ that is given, if it is");
const WINDOW_LOWER: Column =
    Column::parameter("window_lower", Real, "E* × rms slope", "smallest load that counts");
const WINDOW_UPPER: Column =
    Column::parameter("window_upper", Real, "E* × rms slope", "largest load that counts");
const WAVENUMBER_LOWER: Column =
    Column::parameter("wavenumber_lower", Real, "1/length", "smallest wavenumber that counts");
const WAVENUMBER_UPPER: Column =
    Column::parameter("wavenumber_upper", Real, "1/length", "largest wavenumber that counts");
const KAPPA_CONVEX: Column =
    Column::result("kappa_convex", Real, "1", "smallest κ that makes this point's slopes convex");
const MASKED: Column = Column::result(
    "masked",
    Integer,
    "1",
    "data that the law cannot have: no increase of the mean pressure, or full contact",
);
const R_SQUARED: Column =
    Column::result("r_squared", Real, "1", "share of the data's variance that the fit explains");
const CONVEX: Column =
    Column::result("convex", Flag, "", "whether the fitted slope is convex in the window");

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

/// One row per point: where it belongs, what was fitted, how well.
pub fn table(input: &Table, points: &[Point], params: &Params, rows: &[Row]) -> Table {
    let standing: Vec<usize> = points.iter().map(|point| point.row).collect();
    let count = rows.len();
    let mut columns = placed(params, count);
    let rows: Vec<&Row> = rows.iter().collect();
    columns.extend(estimates(params, &rows));
    let surfaces: Vec<usize> = points.iter().map(|point| point.members.len()).collect();
    columns.extend(quality(&surfaces, params, &rows));
    let parameters = input.in_role(Role::Parameter);
    parameters.pick(&standing).with(columns)
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
    let columns = parameters.flat_map(|(index, parameter)| parameter.estimates(index, rows));
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
