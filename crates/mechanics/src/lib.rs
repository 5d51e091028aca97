//! Frictionless contact of a rough surface with an elastic half-space, from first touch to full
//! contact, by the boundary element method with fast Fourier transforms.
//!
//! The crate is internal to asperity and can change in any version; `asperity-contact` is the
//! interface for other programs. It does not read or write files.
//!
//! | module | contents |
//! |---|---|
//! | [`topography`] | random, simple and measured surfaces, and their statistics |
//! | [`solver`] | pressure and gap of a surface under a load |
//! | [`adhesion`] | adhesive contact along a path of loads or mean gaps |
//! | [`morphology`] | area, perimeter and clusters of the contact |
//! | [`conductance`] | spots of the contact, and their thermal or electrical conductance |
//! | [`conduction`] | spreading of heat and currents in layers |
//! | [`partial_slip`] | partial slip under tangential loads, at a constant normal load |
//! | [`distribution`] | histograms of pressures and gaps |
//! | [`flow`] | flow of a fluid through the gap |
//! | [`theory`] | contact area by Persson's theory, asperity models and the evolution law |
//! | [`asperities`] | Hertzian contacts of the summits of a surface, with and without interaction |
//! | [`elasticity`] | displacement of the surface of a body under a pressure |
//! | [`grid`] | nodes of the maps, and their boundary condition |
//! | [`reduced`] | units of the solvers, and the heights that they accept |
//! | [`fft`], [`instructions`] | Fourier transforms, convolutions, and vector instructions |
//! | [`threads`] | threads that share the work on one surface |
//!
//! [`RandomSurface`](topography::random::RandomSurface) and
//! [`Preparation`](topography::preparation::Preparation) return a
//! [`Surface`](topography::surface::Surface). A [`Solver`](solver::Solver) computes its contact
//! with an elastic body under one load after another. The body is a
//! [`PeriodicHalfSpace`](elasticity::PeriodicHalfSpace) or a
//! [`FreeHalfSpace`](elasticity::FreeHalfSpace). The nodes with positive pressure form a
//! [`ContactMap`](morphology::map::ContactMap), from which
//! [`ContactArea`](morphology::area::ContactArea) and
//! [`Clusters`](morphology::clusters::Clusters) are computed.
//!
//! ```
//! use asperity_mechanics::elasticity::PeriodicHalfSpace;
//! use asperity_mechanics::grid::Grid;
//! use asperity_mechanics::morphology::{area::ContactArea, map::ContactMap};
//! use asperity_mechanics::reduced::Units;
//! use asperity_mechanics::solver::{Settings, Solver, Stop};
//! use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
//! use asperity_mechanics::topography::spectrum::Spectrum;
//!
//! let grid = Grid::square(64, 1.0)?;
//! let spectrum = Spectrum { hurst: 0.8, k_lower: 2, k_rolloff: 2, k_upper: 16, anisotropy: None };
//! let amplitude = Amplitude::Gaussian;
//! let surface = RandomSurface { spectrum, amplitude, rms_slope: 0.1, seed: 1, realization: 0 };
//! let units = Units::new(grid.cell(), surface.rms_slope, 1.0)?;
//! let heights = units.reduced_heights(surface.draw(grid))?;
//! let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &heights);
//! let outcome = solver.press(0.05, &Settings::default(), &|| false);
//! assert_eq!(outcome.stop, Stop::Converged);
//! let map = ContactMap::from_pressures(grid.nodes(), solver.pressure());
//! assert!((0.0..0.2).contains(&ContactArea::from_map(&map).fraction()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Conventions
//!
//! - Maps are row-major. Node (i, j) of a grid of N_x × N_y nodes is element i·N_y + j and lies at
//!   x = iΔx, y = jΔy.
//! - Wavenumbers k count waves along the longer side L of the cell: k = L/λ. Angular wavenumbers
//!   are q = 2πk/L.
//! - The load is reduced: y = p₀/(E* h′), with the mean pressure p₀, the effective modulus E* and
//!   the rms slope h′ = √⟨|∇h|²⟩. The elastic contact depends on y alone.
//! - Heights are positive towards the elastic body.

#![warn(missing_docs, unnameable_types)]
// Tests compare with tolerances.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod adhesion;
pub mod asperities;
pub mod conductance;
pub mod conduction;
pub mod distribution;
pub mod elasticity;
pub mod fft;
pub mod flow;
pub mod grid;
pub mod instructions;
pub mod morphology;
pub mod partial_slip;
pub mod reduced;
pub mod solver;
pub mod theory;
pub mod threads;
pub mod topography;
