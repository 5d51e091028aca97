//! Statistics and power spectra of height maps.

use asperity::internal::areal::{Areal, Settings};
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::topography::descriptors::{Descriptors, Roughness};
use asperity_mechanics::topography::differences;
use asperity_mechanics::topography::material_ratio::MaterialRatioCurve;
use asperity_mechanics::topography::power_spectrum::rings;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::conversion::{self, HeightMap};
use crate::errors::value_error;

/// Names and values of statistics; undefined values are `None`.
type Statistics = Vec<(&'static str, Option<f64>)>;

/// Computes the statistics of a map, named like table columns.
#[pyfunction]
pub fn statistics(
    py: Python<'_>,
    heights: HeightMap<'_>,
    is_periodic: bool,
) -> PyResult<Statistics> {
    let surface = conversion::surface(py, &heights)?;
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

/// Computes the parameters of ISO 25178-2, in the order of the columns of a `measure` stage.
#[pyfunction]
pub fn areal_parameters(
    py: Python<'_>,
    heights: HeightMap<'_>,
    is_periodic: bool,
    volume_ratios: [f64; 2],
    threshold: f64,
    pruning: f64,
) -> PyResult<Statistics> {
    let [peak_ratio, dale_ratio] = volume_ratios;
    for (name, value, is_valid, words) in [
        ("peak_ratio", peak_ratio, (0.0..=1.0).contains(&peak_ratio), "from 0 to 1"),
        ("dale_ratio", dale_ratio, (0.0..=1.0).contains(&dale_ratio), "from 0 to 1"),
        ("dale_ratio", dale_ratio, dale_ratio > peak_ratio, "above `peak_ratio`"),
        ("correlation_threshold", threshold, threshold > 0.0 && threshold < 1.0, "between 0 and 1"),
        ("pruning", pruning, pruning > 0.0 && pruning <= 1.0, "above 0 and at most 1"),
    ] {
        if !is_valid {
            return Err(value_error(py, format!("`{name}` is {value}, but must be {words}")));
        }
    }
    let surface = conversion::surface(py, &heights)?;
    let settings = Settings {
        peak_ratio: Some(peak_ratio),
        dale_ratio: Some(dale_ratio),
        correlation_threshold: Some(threshold),
        pruning: Some(pruning),
        ..Settings::default()
    };
    let values = py.detach(|| {
        let curve = MaterialRatioCurve::from_surface(&surface);
        Areal { settings, ..Areal::all() }.values(&surface, boundary(is_periodic), Some(&curve))
    });
    Ok(values.into_iter().map(|(column, value)| (column.name, value)).collect())
}

/// Evaluates the material ratio curve of a map: Smr(c) at heights c above the mean, or Smc(mr) at
/// material ratios mr.
#[pyfunction]
pub fn material_ratio<'py>(
    py: Python<'py>,
    heights: HeightMap<'py>,
    function: &str,
    values: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let surface = conversion::surface(py, &heights)?;
    let of = match function {
        "smr" => MaterialRatioCurve::ratio_at,
        "smc" => MaterialRatioCurve::height_at,
        other => return Err(value_error(py, format!("no function `{other}`"))),
    };
    let wrong = values.as_slice()?.iter().find(|value| !(0.0..=1.0).contains(*value));
    if let Some(ratio) = wrong.filter(|_| function == "smc") {
        return Err(value_error(py, format!("ratio is {ratio}, but must be from 0 to 1")));
    }
    let curve = py.detach(|| MaterialRatioCurve::from_surface(&surface));
    Ok(PyArray1::from_iter(py, values.as_slice()?.iter().map(|value| of(&curve, *value))))
}

/// Angular wavenumber, spectral density and number of modes for each ring.
type Spectrum<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i64>>);

/// Computes the power spectral density, averaged over rings of wavevectors.
#[pyfunction]
pub fn power_spectrum<'py>(
    py: Python<'py>,
    heights: HeightMap<'py>,
    is_periodic: bool,
) -> PyResult<Spectrum<'py>> {
    let surface = conversion::surface(py, &heights)?;
    let side = surface.grid().cell().longer_side();
    let all = py.detach(|| rings(&surface, boundary(is_periodic)));
    // The mean height is not part of the roughness.
    let rings: Vec<_> = all.into_iter().filter(|ring| ring.waves > 0).collect();
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
