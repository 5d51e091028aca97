//! Blocks of nodes, on which the preconditioner extends and averages residuals.

mod extension;
mod levels;
mod rows;
mod two_level;

pub use extension::{Extension, SIDE};
pub use rows::{ExtendedRows, ResidualRows, TransposeInput, TransposeOutput};
pub use two_level::{BlockBuffers, Nodal, TwoLevel};
