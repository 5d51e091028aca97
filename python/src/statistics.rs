//! Statistics and power spectra of height maps.

use asperity_mechanics::grid::Boundary;
use asperity_mechanics::topography::areal::{developed_area_ratio, texture_direction};
use asperity_mechanics::topography::autocorrelation::Autocorrelation;
use asperity_mechanics::topography::descriptors::{Descriptors, Roughness};
use asperity_mechanics::topography::differences;
use asperity_mechanics::topography::material_ratio::MaterialRatioCurve;
use asperity_mechanics::topography::peaks::Peaks;
use asperity_mechanics::topography::power_spectrum::rings;
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::conversion;
use crate::errors::value_error;

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

/// Computes the parameters of ISO 25178-2, in the order of the columns of a `measure` stage.
#[pyfunction]
pub fn areal_parameters(
    py: Python<'_>,
    heights: PyReadonlyArray2<'_, f64>,
    size: [f64; 2],
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
    let surface = conversion::surface(py, &heights, size)?;
    let boundary = boundary(is_periodic);
    Ok(py.detach(|| {
        let of = Roughness::from_surface(&surface, boundary);
        let lengths = Autocorrelation::from_surface(&surface, boundary).decay_lengths(threshold);
        let curve = MaterialRatioCurve::from_surface(&surface);
        let stratified = curve.stratified();
        let volumes = curve.volumes(volume_ratios);
        let peaks = Peaks::from_surface(&surface, boundary, pruning);
        vec![
            ("Sq", Some(of.sq)),
            ("Ssk", of.ssk),
            ("Sku", of.sku),
            ("Sp", Some(of.sp)),
            ("Sv", Some(of.sv)),
            ("Sz", Some(of.sz)),
            ("Sa", Some(of.sa)),
            ("Sdq", Some(of.sdq)),
            ("Sdr", Some(developed_area_ratio(&surface, boundary))),
            ("Sal", lengths.shortest),
            ("Str", lengths.aspect_ratio()),
            ("Std", texture_direction(&surface, boundary)),
            ("Sk", Some(stratified.sk)),
            ("Spk", Some(stratified.spk)),
            ("Svk", Some(stratified.svk)),
            ("Smr1", Some(stratified.smr1)),
            ("Smr2", Some(stratified.smr2)),
            ("Vmp", Some(volumes.vmp)),
            ("Vmc", Some(volumes.vmc)),
            ("Vvc", Some(volumes.vvc)),
            ("Vvv", Some(volumes.vvv)),
            ("Spd", Some(peaks.density)),
            ("Spc", peaks.curvature),
        ]
    }))
}

/// Evaluates the material ratio curve of a map: Smr(c) at heights c above the mean, or Smc(mr) at
/// material ratios mr.
#[pyfunction]
pub fn material_ratio<'py>(
    py: Python<'py>,
    heights: PyReadonlyArray2<'py, f64>,
    size: [f64; 2],
    function: &str,
    values: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let surface = conversion::surface(py, &heights, size)?;
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
    heights: PyReadonlyArray2<'py, f64>,
    size: [f64; 2],
    is_periodic: bool,
) -> PyResult<Spectrum<'py>> {
    let surface = conversion::surface(py, &heights, size)?;
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
