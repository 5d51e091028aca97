//! Surfaces, elastic bodies and what happens between them: the numerics, which know no files and no
//! tables.
//!
//! - [`asperities`]: Hertz' contacts of the summits of a surface, with and without interaction;
//! - [`grid`]: where the nodes of all maps lie;
//! - [`topography`]: rough surfaces, drawn or measured, and their statistics;
//! - [`elasticity`]: what a pressure does to the surface of a body;
//! - [`instructions`]: which vector instructions of the processor they run on;
//! - [`fft`]: the transforms that both are computed with;
//! - [`solver`]: which nodes of a surface touch under a load, and with which pressure;
//! - [`flow`]: what flows through the gap between them;
//! - [`morphology`]: area, perimeter and clusters of the nodes that touch;
//! - [`distribution`]: how many of them bear which pressure;
//! - [`theory`]: what the area should be;
//! - [`threads`]: who shares the work on a surface.
//!
//! Maps are row-major: node (i, j) of a grid of N_x × N_y nodes is element i·N_y + j and lies at
//! x = iΔx, y = jΔy. Wavenumbers k count waves along the longer side L of the cell, k = L/λ; angular
//! ones are q = 2πk/L. Everything
//! elastic depends on the load y = p₀/(E* h′) alone, where h′ = √⟨|∇h|²⟩ is the rms slope: solvers
//! and models work in it.

pub mod asperities;
pub mod distribution;
pub mod elasticity;
pub mod fft;
pub mod flow;
pub mod grid;
pub mod instructions;
pub mod morphology;
pub mod solver;
pub mod theory;
pub mod threads;
pub mod topography;

/// The example of the README is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
