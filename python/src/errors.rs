//! Conversion of errors to exceptions of `asperity.errors`.

use std::error::Error;

use asperity::direct::DirectError;
use asperity::internal::{chain, escaped};
use asperity::session::SessionError;
use asperity::study::ManifestErrors;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Creates an exception of `asperity.errors`; if that fails, returns the error of the failure.
fn exception(
    py: Python<'_>,
    name: &str,
    arguments: impl for<'py> pyo3::call::PyCallArgs<'py>,
) -> PyErr {
    let class = py.import("asperity.errors").and_then(|module| module.getattr(name));
    match class.and_then(|class| class.call1(arguments)) {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}

/// Creates an exception with the text of an error and its causes.
fn described(py: Python<'_>, name: &str, error: &(dyn Error + 'static)) -> PyErr {
    exception(py, name, (escaped(&chain(error)),))
}

/// Creates a `SurfaceError` for unusable heights or files.
pub fn surface_error(py: Python<'_>, error: &(dyn Error + 'static)) -> PyErr {
    described(py, "SurfaceError", error)
}

/// Converts an error of `asperity::direct`.
pub fn direct_error(py: Python<'_>, error: &DirectError) -> PyErr {
    let is_of_keys = matches!(error, DirectError::Keys(_));
    described(py, if is_of_keys { "ArgumentError" } else { "SurfaceError" }, error)
}

/// Creates a `FitError` for a law that cannot be fitted.
pub fn fit_error(py: Python<'_>, error: &(dyn Error + 'static)) -> PyErr {
    described(py, "FitError", error)
}

/// Creates an `ArgumentError` for an invalid value.
pub fn value_error(py: Python<'_>, message: String) -> PyErr {
    exception(py, "ArgumentError", (escaped(&message),))
}

/// Creates a `ManifestError` with all problems and their positions.
pub fn manifest_error(py: Python<'_>, errors: &ManifestErrors) -> PyErr {
    let described = errors.problems().iter().map(|problem| {
        let position = errors.position(problem);
        let advice = problem.advice().map(str::to_owned);
        (problem.message().to_owned(), position, advice)
    });
    let problems: Vec<_> = described.collect();
    let arguments = (errors.render(false), errors.file().to_owned(), problems);
    exception(py, "ManifestError", arguments)
}

/// Creates an `UnknownNameError` with this message.
pub fn unknown_name(py: Python<'_>, message: String) -> PyErr {
    exception(py, "UnknownNameError", (escaped(&message),))
}

/// Converts an error of a session.
pub fn session_error(py: Python<'_>, error: &SessionError) -> PyErr {
    let name = match error {
        SessionError::Manifest(errors) => return manifest_error(py, errors),
        SessionError::Store(_) | SessionError::Results(_) | SessionError::Table(_) => "StoreError",
        SessionError::Unknown(_) | SessionError::Task(_) => "UnknownNameError",
        SessionError::Query(_) => "QueryError",
        SessionError::NotComputed { .. } | SessionError::NoMaps { .. } => "NotComputedError",
        SessionError::Refused(_) | SessionError::NoMap { .. } => "ArgumentError",
        _ => "Error",
    };
    described(py, name, error)
}

/// Creates the exception for a panic in a thread of the library.
pub fn bug() -> PyErr {
    PyRuntimeError::new_err(
        "internal error of asperity: a thread panicked; please report the message on standard error",
    )
}
