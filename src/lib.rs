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
//! | grids and periodic cells | [`Grid`](mechanics::grid::Grid), [`Cell`](mechanics::grid::Cell) |
//! | random surfaces, simple shapes, given heights | [`RandomSurface`], [`Shape`], [`Surface`] |
//! | files of measured heights | [`read`](topography_files::read), [`TopographyFile`] |
//! | roughness parameters and spectral moments | [`Descriptors`], [`Moments`] |
//! | contact under a load | [`Solver`](mechanics::solver::Solver) on a [`PeriodicHalfSpace`] |
//! | single surfaces and contacts without a study | [`direct::draw`], [`direct::Pressing`] |
//! | contact area, perimeter, clusters | [`ContactMap`], [`ContactArea`], [`Clusters`] |
//! | theories | [`persson`](mechanics::theory::persson), [`Asperities`], [`ContactEvolution`] |
//! | laws fitted to ensembles of curves | [`statistics`] |
//!
//! This example presses a surface with three loads, in units of E* × rms slope (here 1):
//!
//! ```
//! use asperity_mechanics::elasticity::PeriodicHalfSpace;
//! use asperity_mechanics::grid::Grid;
//! use asperity_mechanics::morphology::{area::ContactArea, map::ContactMap};
//! use asperity_mechanics::solver::{Settings, Solver, Stop};
//! use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
//! use asperity_mechanics::topography::spectrum::Spectrum;
//!
//! let grid = Grid::square(64, 1.0)?;
//! let spectrum = Spectrum { hurst: 0.8, k_lower: 2, k_rolloff: 2, k_upper: 16, anisotropy: None };
//! let amplitude = Amplitude::Gaussian;
//! let surface = RandomSurface { spectrum, amplitude, rms_slope: 1.0, seed: 1, realization: 0 };
//! let mut solver = Solver::new(PeriodicHalfSpace::new(grid), surface.draw(grid).heights());
//! let mut lighter = 0.0;
//! for load in [0.01, 0.05, 0.1] {
//!     let outcome = solver.press(load, &Settings::default(), &|| false);
//!     assert_eq!(outcome.stop, Stop::Converged);
//!     let map = ContactMap::from_pressures(grid.nodes(), solver.pressure());
//!     let contact = ContactArea::from_map(&map);
//!     println!("{load}: {} {}", contact.fraction(), contact.manhattan_perimeter(grid));
//!     assert!(contact.fraction() > lighter);
//!     lighter = contact.fraction();
//! }
//! # Ok::<(), asperity_mechanics::grid::GridError>(())
//! ```
//!
//! Crates that are not re-exported here are internal; `docs/architecture.md` describes all crates.
//!
//! The reference is Yastrebov, Anciaux & Molinari, *From infinitesimal to full contact between
//! rough surfaces: evolution of the contact area*, Int. J. Solids Struct. 52 (2015) 83–102.
//!
//! [`Asperities`]: mechanics::theory::models::Asperities
//! [`Clusters`]: mechanics::morphology::clusters::Clusters
//! [`ContactArea`]: mechanics::morphology::area::ContactArea
//! [`ContactEvolution`]: mechanics::theory::law::ContactEvolution
//! [`ContactMap`]: mechanics::morphology::map::ContactMap
//! [`Descriptors`]: mechanics::topography::descriptors::Descriptors
//! [`Moments`]: mechanics::topography::moments::Moments
//! [`PeriodicHalfSpace`]: mechanics::elasticity::PeriodicHalfSpace
//! [`RandomSurface`]: mechanics::topography::random::RandomSurface
//! [`Shape`]: mechanics::topography::shapes::Shape
//! [`Surface`]: mechanics::topography::surface::Surface
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
    pub use asperity_queries::silence_panics;
    pub use asperity_stages::{spectrum_files, surface_files};
}

#[doc(hidden)]
pub use asperity_mechanics as mechanics;
pub use asperity_pipeline::direct;
pub use asperity_statistics as statistics;
pub use asperity_tables as tables;
pub use asperity_topography_files as topography_files;
