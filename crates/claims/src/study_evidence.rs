//! What the tables of a study say to claims: sorted by kind, and with the fits that take κ to its limits
//! read from their inputs, surface by surface.

use crate::Evidence;
use crate::evidence::{KindTable, LimitsFit};
use asperity_pipeline::plan::Plan;
use asperity_pipeline::study::Study;
use asperity_stages::Recipe;
use asperity_stages::fit::laws::Law;
use asperity_tables::table::{Table, TableError};

/// What the tables of the stages, in the order of the plan and as far as they are there, say to claims.
///
/// # Errors
/// When a table lacks a column that its kind of stage writes.
pub fn of(study: &Study, plan: &Plan, tables: &[Option<Table>]) -> Result<Evidence, TableError> {
    let stages = plan.stages.iter().zip(tables);
    let finished = stages
        .filter_map(|(stage, table)| Some(KindTable { kind: stage.kind, table: table.clone()? }));
    let finished: Vec<KindTable> = finished.collect();
    Evidence::of(&finished)?.with_limits(&limits(study, plan, tables)?)
}

/// The fits of limits, each with the rows that it reads.
fn limits(
    study: &Study,
    plan: &Plan,
    tables: &[Option<Table>],
) -> Result<Vec<LimitsFit>, TableError> {
    let mut fits = Vec::new();
    for (stage, planned) in study.stages.iter().zip(&plan.stages) {
        for &task in &planned.tasks {
            let Recipe::Fit(params) = &plan.tasks[task].recipe else {
                continue;
            };
            let Law::Limits(choices) = &params.law else {
                continue;
            };
            let inputs = stage.inputs.iter();
            let inputs: Vec<Table> = inputs.filter_map(|&input| tables[input].clone()).collect();
            if !inputs.is_empty() {
                fits.push(LimitsFit {
                    choices: choices.as_ref().clone(),
                    window: params.window(),
                    table: Table::stack(&inputs)?,
                });
            }
        }
    }
    Ok(fits)
}
