//! The boundary condition of a contact in recipes.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::version::Version;
use asperity_mechanics::grid::Boundary;

/// Version of the numbers of loads with a free boundary. It is part of their recipes only, so that
/// raising it does not recompute periodic loads.
pub const FREE_BOUNDARY_VERSION: Version = Version::new(
    2,
    &["pressures that a step clips are taken from the nodes around them: fewer pairs of \
       transforms, other last digits"],
);

#[derive(Serialize, Deserialize)]
struct BoundaryRecipe {
    beyond: Boundary,
    version: u32,
}

/// Serializes the boundary for a recipe.
pub fn serialize<S: Serializer>(boundary: &Boundary, serializer: S) -> Result<S::Ok, S::Error> {
    let recipe = BoundaryRecipe { beyond: *boundary, version: FREE_BOUNDARY_VERSION.number() };
    recipe.serialize(serializer)
}

/// Reads the boundary from a recipe.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Boundary, D::Error> {
    BoundaryRecipe::deserialize(deserializer).map(|recipe| recipe.beyond)
}
