//! Checks of the conditions that numbers of surfaces follow from.

use arrow::datatypes::DataType;

use super::ClaimNames;
use super::graph::Graph;
use crate::manifest::StageTable;
use asperity_manifest::diagnostics::{Problem, Problems, did_you_mean, listed};
use asperity_manifest::written::Written;
use asperity_stages::Kind;
use asperity_stages::columns::SURFACE;
use asperity_stages::form::Points;
use asperity_stages::generate::growth::{AT_LEAST, KnownMean, Until, parse};
use asperity_stages::generate::keys::Growing;
use asperity_statistics::intervals::FEWEST_SURFACES;
use asperity_tables::column::Role;
use asperity_tables::table::Table;

/// A stage whose surfaces are as many as a condition asks for, and the condition as it is written.
struct Conditional<'a> {
    stage: usize,
    growing: &'a Growing,
    written: &'a Written<String>,
    until: Until,
}

impl Conditional<'_> {
    fn problem(&self, message: String, label: &str) -> Problem {
        Problem::new(message, self.written.span.clone(), label)
    }
}

fn conditions(stages: &[StageTable]) -> impl Iterator<Item = Conditional<'_>> {
    let stages = stages.iter().enumerate();
    stages.filter_map(|(stage, table)| {
        let Some(Points::Generate(points)) = &table.points else {
            return None;
        };
        let growing = points.growing()?;
        let written = growing.until.written()?;
        let until = parse(&written.value)?;
        Some(Conditional { stage, growing, written, until })
    })
}

/// The stages whose tables conditions on means look at.
pub fn looked_at(stages: &[StageTable]) -> Vec<usize> {
    let named = |name: &str| stages.iter().position(|stage| stage.name.value == name);
    conditions(stages)
        .filter_map(|condition| match &condition.until {
            Until::Mean(mean) => named(&mean.stage),
            Until::Claims(_) => None,
        })
        .collect()
}

/// Checks that conditions on means look at tables with rows for each surface, and those on claims at
/// claims that surfaces decide; `empty` gives the tables of stages without rows, as far as they are
/// known, and `claims` the names of all claims.
pub fn check<'t>(
    stages: &[StageTable],
    graph: &Graph,
    (empty, claims): (impl Fn(usize) -> Option<&'t Table>, ClaimNames),
    problems: &mut Problems,
) {
    for condition in conditions(stages) {
        let problem = match &condition.until {
            Until::Mean(mean) => of_mean(&condition, mean, stages, graph, &empty),
            Until::Claims(names) => of_claims(&condition, names, &claims()),
        };
        problem.into_iter().for_each(|problem| problems.push(problem));
    }
}

fn of_mean<'t>(
    condition: &Conditional,
    mean: &KnownMean,
    stages: &[StageTable],
    graph: &Graph,
    empty: &impl Fn(usize) -> Option<&'t Table>,
) -> Option<Problem> {
    let names = || stages.iter().map(|stage| stage.name.value.as_str());
    let Some(looked_at) = names().position(|name| name == mean.stage) else {
        let label = meant(&mean.stage, names(), "unknown stage");
        let message = format!("there is no stage `{}`", mean.stage);
        let help = format!("the stages are {}", listed(names(), "and"));
        return Some(condition.problem(message, &label).help(help));
    };
    let surfaces = &stages[condition.stage].name.value;
    if !reads(graph, looked_at, condition.stage) {
        let message = format!("`{}` does not read `{surfaces}`", mean.stage);
        return Some(condition.problem(message, "its rows say nothing of these surfaces"));
    }
    let table = empty(looked_at)?;
    let is_pooled = matches!(stages[looked_at].kind, Some(Kind::Fit | Kind::Aggregate));
    if is_pooled || !table.has(SURFACE.name) {
        let message = format!("`{}` has no rows for each surface", mean.stage);
        let label = "must be a stage that looks at surfaces one by one";
        return Some(condition.problem(message, label));
    }
    let columns = numbers(table);
    if columns.contains(&mean.column.as_str()) {
        return None;
    }
    let label = meant(&mean.column, columns.iter().copied(), "unknown column");
    let message = format!("`{}` has no column of results `{}`", mean.stage, mean.column);
    let help = format!("there are {}", listed(columns.iter().copied(), "and"));
    Some(condition.problem(message, &label).help(help))
}

fn of_claims(condition: &Conditional, names: &[String], known: &[&str]) -> Option<Problem> {
    if let Some(unknown) = names.iter().find(|name| !known.contains(&name.as_str())) {
        let message = format!("there is no claim `{unknown}` that surfaces decide");
        let label = meant(unknown, known.iter().copied(), "unknown claim");
        let help = "`asperity claims` lists them; closed forms decide some, whatever the surfaces";
        return Some(condition.problem(message, &label).help(help));
    }
    let at_least = condition.growing.at_least.written();
    let at_least = at_least.filter(|written| written.value < FEWEST_SURFACES as i64)?;
    let message = format!("`at_least = {}` is too few for claims", at_least.value);
    let label = format!("{FEWEST_SURFACES} or more: of fewer surfaces no scatter is known");
    let help = format!("left out, it is {AT_LEAST}");
    Some(Problem::new(message, at_least.span.clone(), label).help(help))
}

/// What was meant by a name, or that it is unknown.
fn meant<'a>(name: &str, known: impl Iterator<Item = &'a str>, otherwise: &str) -> String {
    let meant = did_you_mean(name, known);
    meant.map_or_else(|| otherwise.to_owned(), |meant| format!("did you mean `{meant}`?"))
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
