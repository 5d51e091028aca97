//! Checks of the conditions that numbers of surfaces follow from.

use arrow::datatypes::DataType;

use super::graph::Graph;
use crate::diagnostics::{Problem, Problems, did_you_mean, listed};
use crate::manifest::StageTable;
use crate::stages::Kind;
use crate::stages::columns::SURFACE;
use crate::stages::form::Points;
use crate::stages::generate::growth::{Until, parse};
use crate::store::column::Role;
use crate::store::table::Table;
use crate::written::Written;

/// A stage whose surfaces are as many as a condition asks for, and the condition as it is written.
struct Conditional<'a> {
    stage: usize,
    written: &'a Written<String>,
    until: Until,
}

fn conditions(stages: &[StageTable]) -> impl Iterator<Item = Conditional<'_>> {
    let stages = stages.iter().enumerate();
    stages.filter_map(|(stage, table)| {
        let Some(Points::Generate(points)) = &table.points else {
            return None;
        };
        let written = points.condition()?;
        let until = parse(&written.value)?;
        Some(Conditional {
            stage,
            written,
            until,
        })
    })
}

/// The stages whose tables conditions look at.
pub fn looked_at(stages: &[StageTable]) -> Vec<usize> {
    let named = |name: &str| stages.iter().position(|stage| stage.name.value == name);
    conditions(stages)
        .filter_map(|condition| named(&condition.until.stage))
        .collect()
}

/// Checks that conditions look at tables with rows for each surface; `empty` gives the tables of
/// stages without rows, as far as they are known.
pub fn check<'t>(
    stages: &[StageTable],
    graph: &Graph,
    empty: impl Fn(usize) -> Option<&'t Table>,
    problems: &mut Problems,
) {
    for Conditional {
        stage,
        written,
        until,
    } in conditions(stages)
    {
        let problem =
            |message: String, label: &str| Problem::new(message, written.span.clone(), label);
        let names = || stages.iter().map(|stage| stage.name.value.as_str());
        let Some(looked_at) = names().position(|name| name == until.stage) else {
            let meant = did_you_mean(&until.stage, names());
            let label = meant.map_or("unknown stage".to_owned(), |m| {
                format!("did you mean `{m}`?")
            });
            let message = format!("there is no stage `{}`", until.stage);
            let help = format!("the stages are {}", listed(names(), "and"));
            problems.push(problem(message, &label).help(help));
            continue;
        };
        let surfaces = &stages[stage].name.value;
        if !reads(graph, looked_at, stage) {
            let message = format!("`{}` does not read `{surfaces}`", until.stage);
            problems.push(problem(message, "its rows say nothing of these surfaces"));
            continue;
        }
        let Some(table) = empty(looked_at) else {
            continue;
        };
        let is_pooled = matches!(stages[looked_at].kind, Some(Kind::Fit | Kind::Aggregate));
        if is_pooled || !table.has(SURFACE.name) {
            let message = format!("`{}` has no rows for each surface", until.stage);
            let label = "must be a stage that looks at surfaces one by one";
            problems.push(problem(message, label));
            continue;
        }
        let columns = numbers(table);
        if !columns.contains(&until.column.as_str()) {
            let meant = did_you_mean(&until.column, columns.iter().copied());
            let label = meant.map_or("unknown column".to_owned(), |m| {
                format!("did you mean `{m}`?")
            });
            let message = format!(
                "`{}` has no column of results `{}`",
                until.stage, until.column
            );
            let help = format!("there are {}", listed(columns.iter().copied(), "and"));
            problems.push(problem(message, &label).help(help));
        }
    }
}

/// Whether rows of a stage come from another, itself included.
fn reads(graph: &Graph, stage: usize, source: usize) -> bool {
    let mut is_above = vec![false; graph.inputs.len()];
    let mut next = vec![stage];
    while let Some(stage) = next.pop() {
        if !std::mem::replace(&mut is_above[stage], true) {
            next.extend(graph.inputs[stage].iter().flatten());
        }
    }
    is_above[source]
}

/// The columns that hold results and are numbers.
fn numbers(table: &Table) -> Vec<&str> {
    let fields = table.batch().schema_ref().fields().iter();
    let is_number = |kind: &DataType| matches!(kind, DataType::Float64 | DataType::Int64);
    let is_result = |role: Option<&String>| role.is_some_and(|role| role == Role::Result.name());
    let numbers = fields
        .filter(|field| is_number(field.data_type()) && is_result(field.metadata().get("role")));
    numbers.map(|field| field.name().as_str()).collect()
}
