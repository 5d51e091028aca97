//! Surfaces of a study whose statistics violate the assumptions of theories of rough contact.

use crate::StageError;
use crate::aggregate::{Groups, Statistic, grouped};
use crate::columns::M02;
use asperity_mechanics::topography::descriptors::Statistics;
use asperity_tables::table::Table;

/// Departures of the surfaces of one parameter point from isotropic Gaussian roughness.
#[derive(Debug, Clone, PartialEq)]
pub struct PointDepartures {
    /// Table of one row with the parameter columns of the point.
    pub coordinates: Table,
    /// Description of each departure from isotropic Gaussian roughness.
    pub departures: Vec<String>,
}

/// Columns whose means over the surfaces are checked for departures.
const DESCRIBED: [&str; 8] =
    ["m20", "m02", "m40", "m04", "m22", "skewness", "excess_kurtosis", "effective_modes"];

/// Returns the departures from isotropic Gaussian roughness at each parameter point of a table of
/// surfaces.
///
/// Departures are found from means over the surfaces of a point, because theories describe
/// ensembles.
///
/// # Errors
/// Returns an error if the table lacks the descriptors of surfaces.
pub fn points(surfaces: &Table) -> Result<Vec<PointDepartures>, StageError> {
    // Theories describe surfaces; profiles have no slope across their line.
    if !surfaces.has(M02.name) {
        return Ok(vec![]);
    }
    let groups = Groups {
        group_by: None,
        over: DESCRIBED.map(str::to_owned).into(),
        statistics: vec![Statistic::Mean],
        models: vec![],
    };
    let reduced = grouped(surfaces, &groups)?;
    let means = DESCRIBED.map(|name| reduced.reals(&format!("{name}_mean")));
    let [m20, m02, m40, m04, m22, skewness, kurtosis, modes] = means;
    let (m20, m02, m40, m04, m22) = (m20?, m02?, m40?, m04?, m22?);
    let heights = skewness?.iter().zip(kurtosis?).zip(modes?);
    let points = heights.enumerate().map(|(row, ((skewness, excess_kurtosis), modes))| {
        let statistics = Statistics {
            slopes: [m20.value(row), m02.value(row)],
            curvatures: [m40.value(row), m04.value(row)],
            mixed: m22.value(row),
            skewness,
            excess_kurtosis,
            effective_modes: modes.unwrap_or(f64::INFINITY),
        };
        PointDepartures {
            coordinates: reduced.coordinates().pick(&[row]),
            departures: statistics.departures(),
        }
    });
    Ok(points.collect())
}
