//! The command `asperity`, for the entry point of the Python package.

use std::ffi::OsString;
use std::io::{Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

use asperity::internal::command;
use pyo3::prelude::*;

/// Runs a command line, handles signals and returns the exit code.
///
/// `program` is the executable that cluster jobs run.
#[pyfunction]
#[pyo3(signature = (line, program=None))]
pub fn main(py: Python<'_>, line: Vec<OsString>, program: Option<PathBuf>) -> u8 {
    py.detach(|| {
        let code = command(line, program.as_deref());
        // A Rust program flushes at exit; a Python process does not. Ignore errors: stdout may be
        // closed.
        let _ = stdout().flush();
        code_number(code)
    })
}

/// Returns the number of an exit code, which the standard library does not expose.
fn code_number(code: ExitCode) -> u8 {
    let mut numbers = 0..=u8::MAX;
    numbers.find(|number| ExitCode::from(*number) == code).unwrap_or(1)
}
