//! The `asperity` command, as the entry point of the wheel.

use std::ffi::OsString;
use std::io::{Write, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

use asperity::cli;
use pyo3::prelude::*;

/// Runs a command line and returns the exit code of the process, whose signals it hears. `program`
/// is what starts the command again on the nodes of a cluster.
#[pyfunction]
#[pyo3(signature = (line, program=None))]
pub fn main(py: Python<'_>, line: Vec<OsString>, program: Option<PathBuf>) -> u8 {
    py.detach(|| {
        let code = cli::run(line, program.as_deref());
        // A process of Rust would do so at its end. Nobody is left to tell if it fails.
        let _ = stdout().flush();
        number(code)
    })
}

/// What the standard library says to the system and to nobody else.
fn number(code: ExitCode) -> u8 {
    let mut numbers = 0..=u8::MAX;
    numbers.find(|number| ExitCode::from(*number) == code).unwrap_or(1)
}
