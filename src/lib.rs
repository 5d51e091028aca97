//! Statistical studies of the contact of rough surfaces.
//!
//! Surfaces are generated or read, and an FFT boundary-element solver presses them from first touch
//! to full contact. The contacts are measured, corrected for the mesh, fitted and averaged. A TOML
//! manifest defines a study; each of its stages becomes a table, and finished results are reused.
//!
//! The main entry points:
//!
//! | purpose | type or function |
//! |---|---|
//! | studies: validate, plan, run, read, query in SQL, report | [`session::Session`] |
//! | manifests and their tasks, before a run | [`study::Study`], [`plan::Plan`] |
//! | tables, columns and Parquet files | [`tables::table::Table`], [`tables::parquet`] |
//! | one contact in metres and pascals, without a study | [`contact`] |
//! | the same by the keys of a manifest | [`direct::draw`], [`direct::Pressing`] |
//! | files of measured heights | [`read`](topography_files::read), [`TopographyFile`] |
//! | laws fitted to ensembles of curves | [`statistics`] |
//!
//! This example presses a surface with three loads:
//!
//! ```
//! use asperity::contact::{Contact, Grid, Length, Material, Pressure, RandomSurface, Spectrum};
//!
//! let grid = Grid::square(64, Length::micrometres(100.0))?;
//! let spectrum = Spectrum::new(0.8, 2..=16)?;
//! let surface = RandomSurface::with_rms_slope(spectrum, 0.1).seed(1).draw(grid)?;
//! let contact = Contact::periodic(&surface, Material::elastic(Pressure::gigapascals(100.0))?)?;
//! let mut lighter = 0.0;
//! for megapascals in [100.0, 500.0, 1000.0] {
//!     let pressed = contact.press(Pressure::megapascals(megapascals))?;
//!     println!("{megapascals} MPa: {} of the area", pressed.area_fraction());
//!     assert!(pressed.area_fraction() > lighter);
//!     lighter = pressed.area_fraction();
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Crates that are not re-exported here are internal; `docs/architecture.md` describes all crates.
//!
//! The reference is Yastrebov, Anciaux & Molinari, *From infinitesimal to full contact between
//! rough surfaces: evolution of the contact area*, Int. J. Solids Struct. 52 (2015) 83–102.
//!
//! [`TopographyFile`]: topography_files::TopographyFile

// Every type in a public signature must be nameable.
#![warn(unnameable_types, unreachable_pub)]

pub mod session;

/// Tasks of a study, in the order in which a run computes them.
pub mod plan {
    pub use asperity_pipeline::plan::{Kind, Plan, PlannedStage, Task};
}

/// Validated manifests.
pub mod study {
    pub use asperity_pipeline::study::{
        Growth, ManifestErrors, Problem, Stage, StageSummary, Study, Until, Warning,
    };
}

mod cli;
mod share;

/// What the executable, the Python module and fuzz tests use; not a library interface.
#[doc(hidden)]
pub mod internal {
    pub use crate::cli::diff::comparison_text;
    pub use crate::cli::terminal::escaped;
    pub use crate::cli::{run as command, user_settings};
    pub use crate::session::export::write_gwyddion;
    pub use asperity_manifest::diagnostics::chain;
    pub use asperity_queries::silence_panics;
    pub use asperity_stages::measure::areal;
    pub use asperity_stages::{spectrum_files, surface_files};
}

pub use asperity_contact as contact;
/// Types in the signatures of [`direct`], internal otherwise.
#[doc(hidden)]
pub use asperity_mechanics as mechanics;
pub use asperity_pipeline::direct;
pub use asperity_statistics as statistics;
pub use asperity_tables as tables;
pub use asperity_topography_files as topography_files;
