//! What a stage of a study does.

use super::generate::growth::PlannedSurfaces;
use super::{Kind, Reach, Recipe, StageError, generate};
use asperity_tables::table::Table;

/// What a stage does, the points of its grid in order.
#[derive(Debug, Clone, PartialEq)]
pub enum Work {
    /// Makes surfaces.
    Generate(Vec<PlannedSurfaces>),
    /// Reads what other stages made, by each of these recipes; there is at least one, and all are of
    /// one kind.
    Evaluate(Vec<Recipe>),
}

impl Work {
    /// The kind of stage that does it.
    pub fn kind(&self) -> Kind {
        match self {
            Work::Generate(_) => Kind::Generate,
            Work::Evaluate(recipes) => recipes.first().expect("a grid has a point").kind(),
        }
    }

    /// The recipes by which it reads other stages.
    pub fn recipes(&self) -> &[Recipe] {
        match self {
            Work::Generate(_) => &[],
            Work::Evaluate(recipes) => recipes,
        }
    }

    /// An upper bound on the number of its tasks, given that of its inputs.
    pub fn tasks(&self, inputs: usize) -> usize {
        match self {
            Work::Generate(surfaces) => {
                let tasks = surfaces.iter().map(|surfaces| {
                    let spectra = match surfaces.params.origin.reads_stage() {
                        true => inputs,
                        false => 1,
                    };
                    spectra.saturating_mul(surfaces.at_most() as usize)
                });
                tasks.fold(0, usize::saturating_add)
            }
            Work::Evaluate(recipes) => {
                let tasks = recipes.iter().map(|recipe| match recipe.reach() {
                    Reach::Single | Reach::Point => inputs,
                    Reach::All => 1,
                });
                tasks.fold(0, usize::saturating_add)
            }
        }
    }

    /// Its stage's table without rows, given those of the stages that it reads and their names.
    ///
    /// # Errors
    /// When a query cannot be answered, or a column is missing that the work needs.
    pub fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        let recipes = match self {
            Work::Generate(surfaces) => {
                let params = surfaces.iter().map(|surfaces| &surfaces.params);
                return Ok(generate::empty_table(params));
            }
            Work::Evaluate(recipes) => recipes,
        };
        let mut tables = Vec::new();
        for recipe in recipes {
            tables.push(recipe.empty_table(inputs)?);
            if !recipe.has_columns_of_its_own() {
                break;
            }
        }
        Ok(Table::stack(&tables)?)
    }
}
