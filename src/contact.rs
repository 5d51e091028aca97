//! Surfaces, half-spaces and what happens between them.
//!
//! Heights are positive towards the elastic body. Maps are row-major: node (i, j) of a mesh with N
//! nodes a side is element i·N + j and lies at x = iΔx, y = jΔx. Wavenumbers k are integers,
//! k = L/λ; angular ones are q = 2πk/L. Everything elastic depends on the load
//! y = p₀/(E* h′) alone, where h′ = √⟨|∇h|²⟩ is the rms slope: solvers and models work in it.

pub mod area;
pub mod assumptions;
pub mod clusters;
pub mod correction;
pub mod descriptors;
pub mod draw;
pub mod fft;
pub mod half_space;
pub mod histogram;
pub mod law;
pub mod map;
pub mod measured;
pub mod models;
pub mod moments;
pub mod nayak;
pub mod periodic;
pub mod persson;
pub mod shapes;
pub mod solver;
pub mod spectrum;
pub mod surface;
