//! Maps of a finished study as arrays.

use asperity::session::maps::{Map, MapKind};
use asperity::session::{Coordinate, SessionError};
use numpy::PyArray2;
use pyo3::prelude::*;

use crate::conversion;

/// Conditions on columns, as pairs of a name and a value.
pub type Conditions = Vec<(String, String)>;

/// Heights, sides, unit, whether the surface is periodic, and its rms slope.
pub type Heights<'py> = (Bound<'py, PyArray2<f64>>, (f64, f64), Option<String>, bool, f64);

/// Arguments of the class `Map`, converted to a dictionary.
#[derive(IntoPyObject)]
pub struct MapArguments<'py> {
    values: Bound<'py, PyAny>,
    size: (f64, f64),
    unit: Option<String>,
    length_unit: Option<String>,
    load: Option<f64>,
    load_unit: Option<String>,
}

impl<'py> MapArguments<'py> {
    pub fn new(py: Python<'py>, map: Map) -> PyResult<MapArguments<'py>> {
        let [along_x, along_y] = map.grid.cell().size();
        let nodes = map.grid.nodes();
        let values = match map.kind {
            kind if kind.is_set() => {
                let belongs = map.values.iter().map(|value| *value > 0.0).collect();
                conversion::map::<bool>(py, belongs, nodes)?.into_any()
            }
            _ => conversion::map(py, map.values, nodes)?.into_any(),
        };
        Ok(MapArguments {
            values,
            size: (along_x, along_y),
            unit: map.unit,
            length_unit: map.length_unit,
            load: map.load,
            load_unit: map.load_unit,
        })
    }
}

/// Returns the kind of map of a quantity of the class `Map`.
pub fn kind(quantity: &str) -> MapKind {
    match quantity {
        "contact" => MapKind::Contact,
        "pressure" => MapKind::Pressures,
        "gap" => MapKind::Gap,
        _ => MapKind::Displacement,
    }
}

/// Converts conditions on columns.
///
/// # Errors
/// Returns an error for columns of the load.
pub fn coordinates(conditions: Conditions) -> Result<Vec<Coordinate>, SessionError> {
    let coordinates = conditions.into_iter().map(|(column, value)| {
        let message = format!(
            "`{column}` identifies no surface; choose the load of a map by `load`, and give none \
             for heights"
        );
        Coordinate::new(column, value).map_err(|_| SessionError::Refused(message))
    });
    coordinates.collect()
}
