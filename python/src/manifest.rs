//! Manifests in memory that are not files yet.

use std::path::PathBuf;

use asperity::study::Study;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::conversion;
use crate::errors::{manifest_error, value_error};

/// Converts tables to the text of a manifest.
#[pyfunction]
pub fn toml(py: Python<'_>, tables: &Bound<'_, PyDict>) -> PyResult<String> {
    let tables = conversion::keys(tables)?;
    ::toml::to_string(&tables).map_err(|error| value_error(py, error.to_string()))
}

/// Validates the text of a manifest and returns the name of the study; `folder` is the base of
/// relative paths of surface files.
#[pyfunction]
pub fn study_name(py: Python<'_>, text: &str, folder: PathBuf) -> PyResult<String> {
    let study = Study::parse(text, "manifest", &folder);
    study.map(|study| study.name).map_err(|errors| manifest_error(py, &errors))
}
