//! Fits of the self-affine power spectrum to the measured spectra of the surfaces of a parameter
//! point.

use std::collections::BTreeMap;

use super::fitted_point::FittedPoint;
use super::{Params, rows};
use crate::columns::{DEGREES_OF_FREEDOM, SPECTRAL_DENSITY, WAVENUMBER};
use crate::ensemble::{Member, Members, grouped};
use asperity_statistics::FitError;
use asperity_statistics::self_affine::{RingOfSurfaces, SelfAffineProblem};
use asperity_tables::column::Role;
use asperity_tables::table::{Table, TableError};

/// Fits the spectra of every parameter point.
///
/// # Errors
/// Returns an error if the input lacks the columns of measured spectra.
pub fn run(table: &Table, params: &Params) -> Result<Table, TableError> {
    let parameters = table.in_role(Role::Parameter).without(&[WAVENUMBER.name]);
    let (mut fitted, mut fits) = (Vec::new(), Vec::new());
    for rows in grouped(&parameters) {
        let (rings, surfaces) = rings(table, &rows)?;
        fitted.push((rows[0], surfaces));
        fits.push(fit(rings, params).unwrap_or_else(|error| FittedPoint::failed(&error)));
    }
    let table = rows::table(&parameters, &fitted, params, &fits);
    // Spectra are not solved, and the fit of densities has no coefficient of determination.
    Ok(table.without(&["unconverged", "r_squared"]))
}

fn fit(rings: Vec<RingOfSurfaces>, params: &Params) -> Result<FittedPoint, FitError> {
    let problem = SelfAffineProblem::new(rings, params.window());
    let fit = problem.fit()?;
    let plateau = fit.rolloff.map(|rolloff| [rolloff, fit.plateau]);
    let values = [fit.hurst].into_iter();
    Ok(FittedPoint {
        values: values.chain(plateau.into_iter().flatten()).collect(),
        rms_residual: Some(fit.rms_residual),
        reduced_chi_square: Some(fit.reduced_chi_square),
        data: fit.data,
        masked: Some(fit.masked),
        ..FittedPoint::from_intervals(problem.intervals(&fit, &params.bootstrap()))
    })
}

/// Returns the rings of wavevectors that all surfaces of a point have, in ascending order, and the
/// number of surfaces. Rows with the same surface and ring as an earlier row are ignored.
fn rings(table: &Table, rows: &[usize]) -> Result<(Vec<RingOfSurfaces>, usize), TableError> {
    let column = |name: &str| table.reals(name);
    let (wavenumbers, freedoms) = (column(WAVENUMBER.name)?, column(DEGREES_OF_FREEDOM.name)?);
    let densities = column(SPECTRAL_DENSITY.name)?;
    let members = Members::new(table)?;
    let mut surfaces: BTreeMap<Member, BTreeMap<u64, usize>> = BTreeMap::new();
    for &row in rows {
        let own = surfaces.entry(members.of_row(row)).or_default();
        // The bits of positive numbers have the same order as the numbers.
        own.entry(wavenumbers.value(row).to_bits()).or_insert(row);
    }
    let Some(first) = surfaces.values().next() else {
        return Ok((Vec::new(), 0));
    };
    let ring = |(wavenumber, row): (&u64, &usize)| {
        let of_surface =
            |own: &BTreeMap<u64, usize>| own.get(wavenumber).map(|&row| densities.value(row));
        Some(RingOfSurfaces {
            wavenumber: f64::from_bits(*wavenumber),
            freedom: freedoms.value(*row),
            densities: surfaces.values().map(of_surface).collect::<Option<_>>()?,
        })
    };
    Ok((first.iter().filter_map(ring).collect(), surfaces.len()))
}
