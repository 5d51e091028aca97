//! What lies beyond the edges of a surface, as recipes and tables say it.

use serde::{Serialize, Serializer};

use crate::columns::BOUNDARY;
use asperity_contact::grid::Boundary;
use asperity_tables::table::Table;

/// Version of the numbers of loads that are solved with nothing beyond the edges. It is a part of their recipes
/// alone: where it is raised and that of the stage is not, periodic loads are not computed again.
const VERSION: u32 = 2;

#[derive(Serialize)]
struct BoundaryRecipe {
    beyond: Boundary,
    version: u32,
}

/// Writes what recipes say where it is not the surface again.
pub fn recipe<S: Serializer>(boundary: &Boundary, serializer: S) -> Result<S::Ok, S::Error> {
    let recipe = BoundaryRecipe { beyond: *boundary, version: VERSION };
    recipe.serialize(serializer)
}

/// What the table of one task says.
pub fn of(solved: &Table) -> Boundary {
    let words = solved.texts(BOUNDARY.name);
    let is_free =
        words.is_ok_and(|words| words.iter().flatten().any(|word| word == Boundary::Free.name()));
    match is_free {
        true => Boundary::Free,
        false => Boundary::Periodic,
    }
}
