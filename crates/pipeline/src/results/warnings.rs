//! Warnings about the results of a study.

use std::collections::HashMap;

use crate::plan::Plan;
use crate::results::TASK;
use crate::study::{Study, Warning, multilevel};
use asperity_stages::aggregate::multilevel_warning;
use asperity_stages::solve::exceeded_hardness::{self, unused_hardness};
use asperity_tables::table::{Table, TableError};

/// Returns the warnings about the results of a study. `read` returns the table of the stage with
/// the given index, or `None` if there is none.
///
/// # Errors
/// Returns an error if a table cannot be read or is not one of its stage.
pub fn warnings<E: From<TableError>>(
    study: &Study,
    plan: &Plan,
    read: impl Fn(usize) -> Result<Option<Table>, E>,
) -> Result<Vec<Warning>, E> {
    let mut warnings = unpaid_levels(study, &read)?;
    for (index, (stage, planned)) in study.stages.iter().zip(&plan.stages).enumerate() {
        // The recipes are those of the study, because stages with different bodies may share a
        // task.
        let recipes = stage.work.recipes();
        if recipes.iter().all(|recipe| unused_hardness(recipe).is_none()) {
            continue;
        }
        let Some(shown) = read(index)? else { continue };
        // Recipes are in the units of the store.
        let table = study.conversion(&stage.name).reversed().table(&shown);
        let tasks_of_each = planned.tasks.len() / recipes.len();
        let groups = recipes.iter().zip(planned.tasks.chunks(tasks_of_each.max(1)));
        let recipe_of_task = groups.flat_map(|(recipe, tasks)| {
            tasks.iter().map(move |&task| (plan.tasks[task].table.key.to_string(), recipe))
        });
        let recipe_of_task: HashMap<String, _> = recipe_of_task.collect();
        let tasks = table.texts(TASK.name)?;
        let hardness_of = |row: usize| unused_hardness(recipe_of_task.get(tasks.value(row))?);
        let messages = exceeded_hardness::warnings(&table, hardness_of)?.into_iter();
        let named = messages.map(|message| Warning { stage: stage.name.clone(), message });
        warnings.extend(named);
    }
    Ok(warnings)
}

/// Returns warnings about multilevel means that would cost less without some meshes.
fn unpaid_levels<E: From<TableError>>(
    study: &Study,
    read: &impl Fn(usize) -> Result<Option<Table>, E>,
) -> Result<Vec<Warning>, E> {
    let mut warnings = Vec::new();
    for stage in &study.stages {
        for means in stage.work.recipes().iter().filter_map(multilevel::means) {
            let inputs = stage.inputs.iter().filter_map(|&input| read(input).transpose());
            let rows = Table::stack(&inputs.collect::<Result<Vec<_>, E>>()?)?;
            // Missing tasks leave meshes with different surfaces, whose means do not exist yet.
            let found =
                means.over.iter().filter_map(|name| multilevel_warning(&rows, name).ok()?);
            warnings.extend(found.map(|message| Warning { stage: stage.name.clone(), message }));
        }
    }
    Ok(warnings)
}
