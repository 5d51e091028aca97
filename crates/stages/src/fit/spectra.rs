//! The self-affine power spectrum, fitted to the measured spectra of the surfaces of one parameter
//! point.

use std::collections::BTreeMap;

use super::Params;
use super::rows::{self, Row};
use crate::columns::{DEGREES_OF_FREEDOM, SPECTRAL_DENSITY, WAVENUMBER};
use crate::ensemble::{Member, Members, grouped};
use asperity_statistics::FitError;
use asperity_statistics::self_affine::{RingOfSurfaces, SelfAffineProblem};
use asperity_tables::column::Role;
use asperity_tables::table::{Table, TableError};

/// Fits every parameter point.
///
/// # Errors
/// When the input holds no measured spectra.
pub fn run(table: &Table, params: &Params) -> Result<Table, TableError> {
    let parameters = table.in_role(Role::Parameter).without(&[WAVENUMBER.name]);
    let (mut standing, mut fits) = (Vec::new(), Vec::new());
    for rows in grouped(&parameters) {
        let (rings, surfaces) = rings(table, &rows)?;
        standing.push((rows[0], surfaces));
        fits.push(fit(rings, params).unwrap_or_else(|error| Row::failed(&error)));
    }
    let table = rows::table(&parameters, &standing, params, &fits);
    // Nothing is solved, and no variance of densities is to be explained.
    Ok(table.without(&["unconverged", "r_squared"]))
}

fn fit(rings: Vec<RingOfSurfaces>, params: &Params) -> Result<Row, FitError> {
    let problem = SelfAffineProblem::new(rings, params.window());
    let fit = problem.fit()?;
    let beyond_plateau = fit.rolloff.map(|rolloff| [rolloff, fit.plateau]);
    let values = [fit.hurst].into_iter();
    Ok(Row {
        values: values.chain(beyond_plateau.into_iter().flatten()).collect(),
        rms_residual: Some(fit.rms_residual),
        reduced_chi_square: Some(fit.reduced_chi_square),
        data: fit.data,
        masked: Some(fit.masked),
        ..Row::with(problem.intervals(&fit, &params.bootstrap()))
    })
}

/// The rings that all surfaces of a point have, ascending, and how many surfaces there are; rows
/// that tell what an earlier one tells are passed over.
fn rings(table: &Table, rows: &[usize]) -> Result<(Vec<RingOfSurfaces>, usize), TableError> {
    let column = |name: &str| table.reals(name);
    let (wavenumbers, freedoms) = (column(WAVENUMBER.name)?, column(DEGREES_OF_FREEDOM.name)?);
    let densities = column(SPECTRAL_DENSITY.name)?;
    let members = Members::of(table)?;
    let mut surfaces: BTreeMap<Member, BTreeMap<u64, usize>> = BTreeMap::new();
    for &row in rows {
        let own = surfaces.entry(members.of_row(row)).or_default();
        // Positive numbers sort as their bits do.
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
