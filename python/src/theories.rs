//! Theories, laws and corrections as functions of arrays.

use asperity::statistics::evolution::{EvolutionProblem, Kappa, Quantity};
use asperity::statistics::{Curves, Window};
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::morphology::area::{ContactArea, PI_OVER_EIGHT, YASTREBOV_2017};
use asperity_mechanics::morphology::map::ContactMap;
use asperity_mechanics::theory::law::ContactEvolution;
use asperity_mechanics::theory::models::{Asperities, AsperityModel, Contact};
use asperity_mechanics::theory::persson as theory;
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::conversion::named;
use crate::errors::{fit_error, value_error};

/// Evaluates a function of Persson's theory; NaN where it is not defined.
#[pyfunction]
pub fn persson<'py>(
    py: Python<'py>,
    function: &str,
    values: PyReadonlyArray1<'py, f64>,
    load: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let of: Box<dyn Fn(f64) -> f64> = match function {
        "area" => Box::new(theory::area),
        "noncontact" => Box::new(theory::noncontact),
        "slope" => Box::new(theory::slope),
        "curvature" => Box::new(theory::curvature),
        "slope_curvature" => Box::new(theory::slope_curvature),
        "load" => Box::new(|area| theory::load(area).unwrap_or(f64::NAN)),
        "load_leaving" => Box::new(|left| theory::load_at_noncontact(left).unwrap_or(f64::NAN)),
        "approach" => Box::new(theory::approach),
        "pressure_density" => Box::new(move |pressure| theory::pressure_density(load, pressure)),
        other => return Err(value_error(py, format!("no function `{other}`"))),
    };
    Ok(each(py, values.as_slice()?, of))
}

/// Returns separation, load, area, slope and stiffness of an asperity model at the given
/// separations or loads; NaN for loads that no separation gives.
#[pyfunction]
pub fn asperities<'py>(
    py: Python<'py>,
    model: &str,
    nayak: f64,
    at: &str,
    values: PyReadonlyArray1<'py, f64>,
) -> PyResult<[Bound<'py, PyArray1<f64>>; 5]> {
    let models = [
        ("bush-gibson-thomas", AsperityModel::BushGibsonThomas),
        ("simplified-elliptic", AsperityModel::SimplifiedElliptic),
        ("mean-curvature", AsperityModel::MeanCurvature),
        ("greenwood-williamson", AsperityModel::GreenwoodWilliamson),
    ];
    let model = named(py, "model", models, model)?;
    let asperities =
        Asperities::new(model, nayak).map_err(|error| value_error(py, error.to_string()))?;
    let values = values.as_slice()?.to_vec();
    let at_separations = at == "separation";
    let contact = |value| {
        if at_separations {
            Some(asperities.at_separation(value))
        } else {
            asperities.at_load(value)
        }
    };
    let contacts: Vec<Option<Contact>> = py.detach(|| values.into_iter().map(contact).collect());
    let column = |of: fn(&Contact) -> f64| {
        let values = contacts.iter().map(|contact| contact.as_ref().map_or(f64::NAN, of));
        PyArray1::from_iter(py, values)
    };
    Ok([
        column(|contact| contact.separation),
        column(|contact| contact.load),
        column(|contact| contact.area),
        column(|contact| contact.slope),
        column(|contact| contact.stiffness),
    ])
}

/// Evaluates a function of a contact evolution law; NaN where it is not defined.
#[pyfunction]
pub fn evolution<'py>(
    py: Python<'py>,
    law: [f64; 3],
    function: &str,
    values: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let [kappa, beta, mu] = law;
    let law = ContactEvolution { kappa, beta, mu };
    let of: Box<dyn Fn(f64) -> f64> = match function {
        "area" => Box::new(move |load| law.area(load)),
        "slope" => Box::new(move |load| law.slope(load)),
        "curvature" => Box::new(move |load| law.curvature(load)),
        "load" => Box::new(move |area| law.load(area).unwrap_or(f64::NAN)),
        "mean_pressure" => Box::new(move |load| law.mean_pressure(load)),
        other => return Err(value_error(py, format!("no function `{other}`"))),
    };
    Ok(each(py, values.as_slice()?, of))
}

fn each<'py>(
    py: Python<'py>,
    values: &[f64],
    of: impl Fn(f64) -> f64,
) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_iter(py, values.iter().map(|value| of(*value)))
}

/// Fits the parameters κ, β and μ of a contact evolution law to areas of shape (surfaces, loads).
#[pyfunction]
#[pyo3(signature = (loads, areas, window, quantity, kappa=None, least_convex=false))]
pub fn fit_evolution(
    py: Python<'_>,
    loads: PyReadonlyArray1<'_, f64>,
    areas: PyReadonlyArray2<'_, f64>,
    window: [f64; 2],
    quantity: &str,
    kappa: Option<f64>,
    least_convex: bool,
) -> PyResult<[f64; 3]> {
    let quantities = [("area", Quantity::Area), ("slope", Quantity::Slope)];
    let quantity = named(py, "quantity", quantities, quantity)?;
    let kappa = match (kappa, least_convex) {
        (Some(kappa), _) => Kappa::Given(kappa),
        (None, true) => Kappa::LeastConvex,
        (None, false) => Kappa::Free,
    };
    let [from, to] = window;
    let loads = loads.as_slice()?.to_vec();
    let rows = areas.as_slice()?.chunks(areas.shape()[1].max(1));
    let areas: Vec<Vec<f64>> = rows.map(<[f64]>::to_vec).collect();
    let fitted = py.detach(|| {
        let curves = Curves::new(loads, areas)?;
        EvolutionProblem::new(&curves, quantity, Window { from, to })?.fit(kappa)
    });
    let law = fitted.map_err(|error| fit_error(py, &error))?.law;
    Ok([law.kappa, law.beta, law.mu])
}

/// Returns the counted and the corrected area fraction of a contact map, and the lower and upper
/// bound of the area fraction.
#[pyfunction]
pub fn corrected_area(
    py: Python<'_>,
    contact: PyReadonlyArray2<'_, bool>,
    coefficient: &str,
    is_periodic: bool,
) -> PyResult<[f64; 4]> {
    let coefficients = [("none", 0.0), ("pi/8", PI_OVER_EIGHT), ("2017", YASTREBOV_2017)];
    let coefficient = named(py, "coefficient", coefficients, coefficient)?;
    let shape = [contact.shape()[0], contact.shape()[1]];
    if shape.contains(&0) {
        return Err(value_error(py, "a contact map must have at least one node".to_owned()));
    }
    let touches = contact.as_slice()?.iter();
    let pressures: Vec<f64> = touches.map(|touches| f64::from(u8::from(*touches))).collect();
    let boundary = if is_periodic { Boundary::Periodic } else { Boundary::Free };
    let counted = py.detach(|| {
        let map = ContactMap::from_pressures(shape, &pressures).with_boundary(boundary);
        ContactArea::from_map(&map).counted()
    });
    let [lower, upper] = counted.bounds();
    Ok([counted.fraction(), counted.corrected(coefficient), lower, upper])
}
