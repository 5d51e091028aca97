//! Maps of a finished study as arrays.

use asperity::session::{ChosenLoad, Coordinate, Map, MapKind, SessionError};
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
pub fn coordinates(conditions: Conditions) -> Vec<Coordinate> {
    conditions.into_iter().map(|(column, value)| Coordinate::new(column, value)).collect()
}

/// Load or mean gap of a map: a number in the unit of the study, or a text such as `10 MPa`.
#[derive(FromPyObject)]
pub enum Load {
    Number(f64),
    Text(String),
}

impl Load {
    /// Returns the load that the number or the text chooses.
    ///
    /// # Errors
    /// Returns an error if the text is no pressure.
    pub fn chosen(self) -> Result<ChosenLoad, SessionError> {
        match self {
            Load::Number(number) => Ok(number.into()),
            Load::Text(text) => {
                let chosen = ChosenLoad::prescribed(&text);
                chosen.map_err(|error| SessionError::Refused(error.to_string()))
            }
        }
    }
}
