//! Statistics and power spectra of height maps.

use asperity::contact::grid::Boundary;
use asperity::contact::topography::descriptors::{Descriptors, Roughness};
use asperity::contact::topography::differences;
use asperity::contact::topography::power_spectrum::rings;
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::conversion;

/// Names and values of statistics; undefined values are `None`.
type Statistics = Vec<(&'static str, Option<f64>)>;

/// Computes the statistics of a map, named like table columns.
#[pyfunction]
pub fn statistics(
    py: Python<'_>,
    heights: PyReadonlyArray2<'_, f64>,
    size: [f64; 2],
    is_periodic: bool,
) -> PyResult<Statistics> {
    let surface = conversion::surface(py, &heights, size)?;
    let boundary = boundary(is_periodic);
    let (roughness, moments, descriptors) = py.detach(|| {
        let descriptors = is_periodic.then(|| Descriptors::from_surface(&surface));
        let moments = match &descriptors {
            Some(descriptors) => descriptors.moments,
            None => differences::moments(&surface),
        };
        (Roughness::from_surface(&surface, boundary), moments, descriptors)
    });
    let of_modes = |value: fn(&Descriptors) -> f64| descriptors.as_ref().map(value);
    Ok(vec![
        ("rms_height", Some(moments.rms_height())),
        ("rms_slope", Some(moments.rms_slope())),
        ("nayak", moments.nayak()),
        ("skewness", roughness.ssk),
        ("excess_kurtosis", roughness.sku.map(|kurtosis| kurtosis - 3.0)),
        ("sa", Some(roughness.sa)),
        ("sz", Some(roughness.sz)),
        ("summit_density", Some(moments.summit_density())),
        ("effective_modes", of_modes(|of| of.effective_modes)),
        ("full_contact_load", of_modes(|of| of.full_contact_load)),
    ])
}

/// Angular wavenumber, spectral density and number of modes for each ring.
type Spectrum<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i64>>);

/// Computes the power spectral density, averaged over rings of wavevectors.
#[pyfunction]
pub fn power_spectrum<'py>(
    py: Python<'py>,
    heights: PyReadonlyArray2<'py, f64>,
    size: [f64; 2],
    is_periodic: bool,
) -> PyResult<Spectrum<'py>> {
    let surface = conversion::surface(py, &heights, size)?;
    let side = surface.grid().cell().longer_side();
    let rings = py.detach(|| rings(&surface, boundary(is_periodic)));
    // The mean height is not part of the roughness.
    let rings: Vec<_> = rings.into_iter().filter(|ring| ring.waves > 0).collect();
    let wavenumbers = rings.iter().map(|ring| ring.wavenumber(side));
    let densities = rings.iter().map(|ring| ring.density);
    let modes = rings.iter().map(|ring| i64::from(ring.modes));
    Ok((
        PyArray1::from_iter(py, wavenumbers),
        PyArray1::from_iter(py, densities),
        PyArray1::from_iter(py, modes),
    ))
}

fn boundary(is_periodic: bool) -> Boundary {
    if is_periodic { Boundary::Periodic } else { Boundary::Free }
}
