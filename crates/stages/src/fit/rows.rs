//! Tables of fits: a row for each fit.

use arrow::array::ArrayRef;

use crate::columns::{codes, columns, flag, integer, parameter, parameter_text, real};
use crate::fit::Params;
use crate::fit::contact_evolution::{EvolutionChoices, Kappa};
use crate::fit::fitted_point::{
    BOOTSTRAP, BOOTSTRAP_FAILED, CHI_SQUARE, DATA, Estimate, FitParameter, FittedPoint, LAW,
    RMS_RESIDUAL, SURFACES, UNCONVERGED,
};
use crate::fit::laws::{Law, PlainLaw};
use crate::fit::status::STATUS;
use crate::table_columns::Values::{Count, OptionalFlag, OptionalReal, Real, Text};
use crate::table_columns::{TableColumns, column, column_if};
use asperity_tables::column::Column;
use asperity_tables::table::Table;

columns! {
    /// quantity whose residuals are minimised
    const DATUM: Column = parameter_text("fitted_to").with_codes(codes![
        /// slope of the mean area between neighbouring loads
        "slope",
        /// mean area
        "area",
    ]);
    /// how κ is determined
    const KAPPA_IS: Column = parameter_text("kappa_is").with_codes(codes![
        /// κ is a number of the manifest
        "given",
        /// κ is fitted with the other parameters
        "free",
        /// κ is the smallest value for which the fitted slope is convex
        "minimal-convex",
    ]);
    /// κ from the manifest; null unless `kappa_is` is `given`
    const KAPPA_GIVEN: Column = parameter("kappa_given", "1");
    /// smallest load of the fitted data
    const WINDOW_LOWER: Column = parameter("window_lower", "E* × rms slope");
    /// largest load of the fitted data
    const WINDOW_UPPER: Column = parameter("window_upper", "E* × rms slope");
    /// smallest wavenumber of the fitted data
    const WAVENUMBER_LOWER: Column = parameter("wavenumber_lower", "1/length");
    /// largest wavenumber of the fitted data
    const WAVENUMBER_UPPER: Column = parameter("wavenumber_upper", "1/length");
    /// smallest κ for which the fitted slope of this parameter point is convex
    const KAPPA_CONVEX: Column = real("kappa_convex", "1");
    /// number of data in the window that were left out because they have no logarithm
    const MASKED: Column = integer("masked", "1");
    /// coefficient of determination: fraction of the variance that the fit explains
    const R_SQUARED: Column = real("r_squared", "1");
    /// whether the fitted slope is convex in the window
    const CONVEX: Column = flag("convex");
}

/// A fit with the parameters of its stage and its number of surfaces.
pub struct FitRow<'a> {
    params: &'a Params,
    fit: &'a FittedPoint,
    surfaces: usize,
}

impl FitRow<'_> {
    fn evolution(&self) -> Option<EvolutionChoices> {
        evolution(self.params)
    }
}

fn evolution(params: &Params) -> Option<EvolutionChoices> {
    match params.law {
        Law::ContactEvolution(choices) => Some(choices),
        _ => None,
    }
}

fn is_evolution(params: &Params) -> bool {
    evolution(params).is_some()
}

fn fits_spectra(params: &Params) -> bool {
    matches!(params.law, Law::Plain(PlainLaw::SelfAffine))
}

/// Returns the columns that distinguish a fit from other fits of the same points: the law, its
/// choices, and the window.
fn law_columns<'a>() -> TableColumns<Params, FitRow<'a>> {
    TableColumns::<Params, FitRow>::new([
        column(LAW, Text(|row| row.params.law.word())),
        column_if(is_evolution, DATUM, Text(|row| row.evolution().map_or("", |law| law.to.name()))),
        column_if(
            is_evolution,
            KAPPA_IS,
            Text(|row| row.evolution().map_or("", |law| law.kappa.name())),
        ),
        column_if(is_evolution, KAPPA_GIVEN, OptionalReal(|row| row.evolution()?.kappa.given())),
        column_if(|of| !fits_spectra(of), WINDOW_LOWER, Real(|row| row.params.window[0])),
        column_if(|of| !fits_spectra(of), WINDOW_UPPER, Real(|row| row.params.window[1])),
        column_if(fits_spectra, WAVENUMBER_LOWER, Real(|row| row.params.window[0])),
        column_if(fits_spectra, WAVENUMBER_UPPER, Real(|row| row.params.window[1])),
    ])
}

/// Returns the columns with the data, the quality and the status of fits.
fn quality_columns<'a>() -> TableColumns<Params, FitRow<'a>> {
    TableColumns::<Params, FitRow>::new([
        column_if(
            |params| evolution(params).is_some_and(|law| law.kappa == Kappa::MinimalConvex),
            KAPPA_CONVEX,
            OptionalReal(|row| row.fit.own_kappa),
        ),
        column_if(is_evolution, CONVEX, OptionalFlag(|row| row.fit.convex)),
        column_if(|of| !is_evolution(of), MASKED, Count(|row| row.fit.masked.unwrap_or(0))),
        column(SURFACES, Count(|row| row.surfaces)),
        column(UNCONVERGED, Count(|row| row.fit.unconverged)),
        column(DATA, Count(|row| row.fit.data)),
        column(RMS_RESIDUAL, OptionalReal(|row| row.fit.rms_residual)),
        column(R_SQUARED, OptionalReal(|row| row.fit.r_squared)),
        column(CHI_SQUARE, OptionalReal(|row| row.fit.reduced_chi_square)),
        column(BOOTSTRAP, Count(|row| row.params.bootstrap as usize)),
        column(BOOTSTRAP_FAILED, Count(|row| row.fit.failed_replicates)),
        column(STATUS, Text(|row| row.fit.status())),
    ])
}

/// Returns the columns that laws with these parameters may add.
pub fn columns(parameters: impl IntoIterator<Item = FitParameter>) -> Vec<Column> {
    let estimates = parameters.into_iter().flat_map(FitParameter::columns);
    let law = law_columns().all().into_iter();
    law.chain(estimates).chain(quality_columns().all()).collect()
}

/// Creates the table of fits. `fitted` holds, for each fit, the index of the row of `coordinates`
/// with the parameters, and the number of surfaces.
pub fn table(
    coordinates: &Table,
    fitted: &[(usize, usize)],
    params: &Params,
    rows: &[FittedPoint],
) -> Table {
    let (of_rows, surfaces): (Vec<usize>, Vec<usize>) = fitted.iter().copied().unzip();
    let all: Vec<&FittedPoint> = rows.iter().collect();
    coordinates.pick(&of_rows).with(columns_of_fits(params, &surfaces, &all).concat())
}

/// Returns the columns of fits: those of the law and its choices, of the parameters with their
/// intervals, and of the quality.
pub fn columns_of_fits(
    params: &Params,
    surfaces: &[usize],
    fits: &[&FittedPoint],
) -> [Vec<(Column, ArrayRef)>; 3] {
    let both = fits.iter().zip(surfaces);
    let rows: Vec<FitRow> =
        both.map(|(fit, surfaces)| FitRow { params, fit, surfaces: *surfaces }).collect();
    [
        law_columns().filled(params, &rows),
        estimates(params, fits),
        quality_columns().filled(params, &rows),
    ]
}

fn estimates(params: &Params, rows: &[&FittedPoint]) -> Vec<(Column, ArrayRef)> {
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
