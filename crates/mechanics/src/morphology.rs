//! Morphology of the contact region: area, perimeter and clusters of the nodes in contact.
//!
//! - [`map`]: the contact map, with one bit per node;
//! - [`area`]: area, perimeter, and the contact area corrected for the mesh;
//! - [`clusters`]: connected regions of contact or of gap.

pub mod area;
pub mod clusters;
pub mod map;
