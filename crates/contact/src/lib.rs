//! Frictionless contact of a rough surface with an elastic half-space, from first touch to full
//! contact, by the boundary element method with fast Fourier transforms; no files and no tables.
//!
//! | module | |
//! |---|---|
//! | [`topography`] | rough surfaces, drawn, of simple shapes or measured, and their statistics |
//! | [`solver`] | pressure and gap under a load: which nodes of a surface touch |
//! | [`morphology`] | area, perimeter and clusters of the nodes that touch |
//! | [`distribution`] | how many nodes bear which pressure, or have which gap |
//! | [`flow`] | what flows through the gap |
//! | [`theory`] | the area by Persson's theory, by asperity models, and by a law with an exponent |
//! | [`asperities`] | Hertz' contacts of the summits of a surface, with and without interaction |
//! | [`elasticity`] | what a pressure does to the surface of a body |
//! | [`grid`] | where the nodes of all maps lie, and what is beyond their edges |
//! | [`fft`], [`instructions`] | transforms, convolutions, and their vector instructions |
//! | [`threads`] | who shares the work on a surface |
//!
//! A surface of a [spectrum](topography::spectrum) or from a map is a
//! [`Surface`](topography::surface::Surface). A [`Solver`](solver::Solver) presses its heights,
//! load after load, into a [`PeriodicHalfSpace`](elasticity::PeriodicHalfSpace) or a
//! [`FreeHalfSpace`](elasticity::FreeHalfSpace); a [`ContactMap`](morphology::map::ContactMap) of
//! the pressure has its [`ContactArea`](morphology::area::ContactArea) and
//! [`Clusters`](morphology::clusters::Clusters). The README has an example, and `examples/press.rs`
//! another.
//!
//! Maps are row-major: node (i, j) of a grid of N_x × N_y nodes is element i·N_y + j and lies at x
//! = iΔx, y = jΔy. Wavenumbers k count waves along the longer side L of the cell, k = L/λ; angular
//! ones are q = 2πk/L. Everything elastic depends on the load y = p₀/(E* h′) alone, where h′ =
//! √⟨|∇h|²⟩ is the rms slope: solvers and models work in it.

#![warn(missing_docs, unnameable_types)]

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
