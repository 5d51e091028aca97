//! Which surfaces of a study are not what theories of rough contact assume, by their own numbers.

use crate::StageError;
use crate::aggregate::{Groups, Statistic, grouped};
use asperity_contact::topography::descriptors::Statistics;
use asperity_tables::table::Table;

/// Surfaces of one parameter point.
#[derive(Debug, Clone, PartialEq)]
pub struct PointDepartures {
    /// Their coordinates, in one row.
    pub place: Table,
    /// In which respects they are no isotropic Gaussian roughness; none if they may be.
    pub departures: Vec<String>,
}

/// What the departures are averaged from.
const DESCRIBED: [&str; 8] =
    ["m20", "m02", "m40", "m04", "m22", "skewness", "excess_kurtosis", "effective_modes"];

/// The parameter points of a table of surfaces, each with the means over its surfaces: theories
/// speak of ensembles.
///
/// # Errors
/// When the table describes no surfaces.
pub fn points(surfaces: &Table) -> Result<Vec<PointDepartures>, StageError> {
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
            place: reduced.coordinates().pick(&[row]),
            departures: statistics.departures(),
        }
    });
    Ok(points.collect())
}
