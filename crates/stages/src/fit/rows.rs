//! Tables of fits: a row for each fit.

use arrow::array::ArrayRef;

use super::Params;
use super::columns::{
    BOOTSTRAP, BOOTSTRAP_FAILED, CHI_SQUARE, DATA, LAW, RMS_RESIDUAL, SURFACES, UNCONVERGED,
};
use super::contact_evolution::{Datum, EvolutionChoices, Kappa};
use super::laws::{Law, PlainLaw};
use super::parameter::{Estimate, Parameter};
use super::row::Row;
use super::status::STATUS;
use crate::columns::{flag, integer, parameter, parameter_text, real};
use asperity_tables::column::{
    Code, Column, integers, optional_flags, optional_reals, reals, texts,
};
use asperity_tables::table::Table;

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
    let all: Vec<&Row> = rows.iter().collect();
    let mut columns = law_columns(params, all.len());
    columns.extend(estimates(params, &all));
    columns.extend(quality(&surfaces, params, &all));
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
    if !matches!(params.law, Law::ContactEvolution(_)) {
        let masked = rows.iter().map(|row| row.masked.unwrap_or(0) as i64);
        columns.push((MASKED, integers(masked)));
    }
    columns.extend([
        (SURFACES, integers(surfaces.iter().map(|&surfaces| surfaces as i64))),
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
