//! The passes over the mesh that a solution is made of, fused with the convolutions they feed.

mod correct;
mod evaluate;
mod motion;

pub use correct::{Aim, Correct, Extension, Sums};
pub use evaluate::{Evaluate, Tally};
pub use motion::{Course, Glide, Land, Move, Retreat, Step};
