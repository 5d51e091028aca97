//! Elasticity: which displacement a pressure on the surface of a body causes, and how stiff the body
//! is in return.
//!
//! - [`half_space`]: the isotropic half-space under a pressure that repeats for ever.

pub mod half_space;
