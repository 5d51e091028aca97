//! `asperity._asperity`, the extension module of the Python package.
//!
//! It only translates between Python and the library, which computes all numbers, tables and
//! messages. The public interface is the package in `python/asperity`.

mod command;
mod conversion;
mod errors;
mod interruption;
mod pressing;
mod progress;
mod session;
mod statistics;
mod surfaces;
mod table;
mod theories;

use pyo3::prelude::*;

#[pymodule]
mod _asperity {
    use super::*;

    #[pymodule_export]
    use super::command::main;
    #[pymodule_export]
    use super::pressing::{Pressing, placed};
    #[pymodule_export]
    use super::session::{Session, study_name, toml};
    #[pymodule_export]
    use super::statistics::{areal_parameters, material_ratio, power_spectrum, statistics};
    #[pymodule_export]
    use super::surfaces::{
        align, crop, draw, fill, implausible, length, level, level_through, read, remove_islands,
        remove_spikes, write_gwyddion,
    };
    #[pymodule_export]
    use super::table::Table;
    #[pymodule_export]
    use super::theories::{asperities, corrected_area, evolution, fit_evolution, persson};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        asperity::internal::silence_panics();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
