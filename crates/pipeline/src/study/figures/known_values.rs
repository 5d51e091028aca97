//! Values of the coordinates of a table that are known before the study runs.

use std::collections::BTreeSet;

use asperity_stages::columns::{CORRECTION, LOAD, PRESSURE};
use asperity_stages::{Recipe, Stage as _, Work};
use asperity_tables::column::{Column, Role, Value};

/// Returns all values that a coordinate has in the table of a stage, or `None` if they are not
/// known. `stages` are the works of the stage and of all stages that it reads, directly or not.
pub fn known_values<'w>(
    stages: impl IntoIterator<Item = &'w Work>,
    column: &str,
) -> Option<BTreeSet<Value>> {
    let mut values = BTreeSet::new();
    for work in stages {
        let surfaces = work.surfaces().iter();
        let of_surfaces = surfaces.map(|surfaces| Some(of(surfaces.params.coordinates(), column)));
        let recipes = work.recipes().iter().map(|recipe| of_recipe(recipe, column));
        let of_recipes: Vec<Vec<Value>> = of_surfaces.chain(recipes).collect::<Option<_>>()?;
        // A column that only some tasks add has unknown values in the rows of the others.
        let added = of_recipes.iter().filter(|values| !values.is_empty()).count();
        if added > 0 && added < of_recipes.len() {
            return None;
        }
        values.extend(of_recipes.into_iter().flatten());
    }
    (!values.is_empty()).then_some(values)
}

/// Returns the values that a recipe adds to the rows of its inputs. Returns `None` for a query,
/// which can rename columns.
fn of_recipe(recipe: &Recipe, column: &str) -> Option<Vec<Value>> {
    match recipe {
        Recipe::Aggregate(params) if params.query().is_some() => return None,
        Recipe::Solve(params) => {
            if column == params.load_column().name {
                return Some(params.loads.iter().copied().map(Value::Real).collect());
            }
            if [LOAD.name, PRESSURE.name].contains(&column) {
                return None;
            }
        }
        Recipe::Correct(params) if column == CORRECTION.name => {
            let names = params.corrections.iter();
            return Some(names.map(|one| Value::Text(one.name.clone())).collect());
        }
        _ => {}
    }
    Some(of(recipe.coordinates(), column))
}

fn of(coordinates: Vec<(Column, Value)>, name: &str) -> Vec<Value> {
    let named = coordinates
        .into_iter()
        .filter(|(column, _)| column.name == name && column.role == Role::Parameter);
    named.map(|(_, value)| value).collect()
}
