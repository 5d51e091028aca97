//! Statistical studies of rough contact: surfaces are drawn or read, pressed from first touch to full
//! contact with an FFT boundary-element solver, measured, corrected, fitted and aggregated. A study
//! is one TOML manifest; each of its stages becomes a table, and nothing is computed twice.
//!
//! What a program meets first:
//!
//! | for | there is |
//! |---|---|
//! | a manifest and its data: check, plan, run, read, ask in SQL, report | [`session::Session`] |
//! | a manifest's text and its tasks, before anything is computed | [`study::Study`], [`plan::Plan`] |
//! | tables, their columns and files | [`tables::table::Table`], [`tables::parquet`] |
//! | where nodes lie | [`Grid`](contact::grid::Grid), [`Cell`](contact::grid::Cell) |
//! | heights: drawn, of a simple shape, any | [`RandomSurface`](contact::topography::random::RandomSurface), [`Shape`](contact::topography::shapes::Shape), [`Surface`](contact::topography::surface::Surface) |
//! | maps of heights in the files of instruments and of NumPy | [`read`](topography_files::read), [`TopographyFile`](topography_files::TopographyFile) |
//! | what heights are like | [`Descriptors`](contact::topography::descriptors::Descriptors), [`Moments`](contact::topography::moments::Moments) |
//! | contact under a load | [`Solver`](contact::solver::Solver) on a [`PeriodicHalfSpace`](contact::elasticity::PeriodicHalfSpace) |
//! | surfaces and contacts by the keys of a manifest, without one | [`direct::draw`], [`direct::Pressing`] |
//! | what contact looks like | [`ContactMap`](contact::morphology::map::ContactMap), [`ContactArea`](contact::morphology::area::ContactArea), [`Clusters`](contact::morphology::clusters::Clusters) |
//! | what it should be | [`persson`](contact::theory::persson), [`Asperities`](contact::theory::models::Asperities), [`ContactEvolution`](contact::theory::law::ContactEvolution) |
//! | laws fitted to curves of many surfaces | [`statistics`] |
//!
//! A surface under a few loads, in units of E* × its rms slope, which is one here:
//!
//! ```
//! use asperity::contact::elasticity::PeriodicHalfSpace;
//! use asperity::contact::grid::Grid;
//! use asperity::contact::morphology::{area::ContactArea, map::ContactMap};
//! use asperity::contact::solver::{Settings, Solver, Stop};
//! use asperity::contact::topography::random::{Amplitude, RandomSurface};
//! use asperity::contact::topography::spectrum::Spectrum;
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
//! # Ok::<(), asperity::contact::grid::GridError>(())
//! ```
//!
//! The crates that are not re-exported here are parts of the program; `docs/architecture.md` describes
//! all of them.
//!
//! The reference is Yastrebov, Anciaux & Molinari, *From infinitesimal to full contact between
//! rough surfaces: evolution of the contact area*, Int. J. Solids Struct. 52 (2015) 83–102.

// What something public returns has a public name, too.
#![warn(unnameable_types)]

pub mod session;

/// The command: what it prints is for people, and no function of it for programs.
#[doc(hidden)]
pub mod cli;

mod share;

pub use asperity_contact as contact;
pub use asperity_pipeline::{direct, plan, study};
/// What fuzzing needs of it.
#[doc(hidden)]
pub use asperity_stages::spectrum_files;
pub use asperity_statistics as statistics;
pub use asperity_tables as tables;
pub use asperity_topography_files as topography_files;
