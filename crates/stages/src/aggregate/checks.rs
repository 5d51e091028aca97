//! Checks of the stages that reduce tables to statistics.

mod answer;
mod columns;
mod models;
mod statistics;

use std::collections::BTreeMap;
use std::sync::Arc;

use super::keys::AggregateTable;
use super::{Groups, Meaning, Params, Sql};
use crate::{Given, Recipe};
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::written::checks::Checks;
use asperity_manifest::written::{Section, Written};
use asperity_tables::table::Table;
use columns::{check_numbers, check_outputs, named_columns};

pub use answer::{is_query, validate_answer};

/// The reduction of a stage.
pub fn recipes(section: &Section<AggregateTable>, given: &mut Given) -> Option<Vec<Recipe>> {
    let point = section.points.first()?;
    let checks = &mut Checks::of(section, point, given.problems);
    let params = params(&point.table, given.input, checks)?;
    Some(vec![Recipe::Aggregate(Arc::new(params))])
}

fn params(table: &AggregateTable, input: Option<&Table>, checks: &mut Checks) -> Option<Params> {
    if let Some(sql) = table.sql.written() {
        return query(table, sql, checks);
    }
    checks.forbidden("columns", &table.columns, "for the answer of a query")?;
    let group_by = match table.group_by.written() {
        None => Some(None),
        Some(written) => named_columns("group_by", written, input, checks).map(Some),
    };
    let over = checks.required("over", &table.over).and_then(|written| {
        let over = named_columns("over", written, input, checks)?;
        check_numbers(written, input, checks).map(|()| over)
    });
    let named = group_by.as_ref().and_then(|names| names.as_deref());
    let statistics = statistics::statistics(&table.statistics, named, input, checks);
    let models = models::models(table, input, checks);
    let groups =
        Groups { group_by: group_by?, over: over?, statistics: statistics?, models: models? };
    check_outputs(table, &groups, checks)?;
    Some(Params::Groups(groups))
}

fn query(table: &AggregateTable, sql: &Written<String>, checks: &mut Checks) -> Option<Params> {
    let why = "`sql` says it all";
    let group_by = checks.forbidden("group_by", &table.group_by, why);
    let over = checks.forbidden("over", &table.over, why);
    let statistics = checks.forbidden("statistics", &table.statistics, why);
    let models = checks.forbidden("models", &table.models, why);
    let columns = meanings(table, checks);
    if sql.value.trim().is_empty() {
        let label = "must be a query";
        checks.report("sql", Problem::new("`sql` is empty", sql.span.clone(), label));
        return None;
    }
    let clear = group_by.and(over).and(statistics).and(models);
    let columns = columns?;
    clear.map(|()| Params::Sql(Sql { query: sql.value.clone(), tables: Vec::new(), columns }))
}

/// What the manifest says of the columns of a query's answer.
fn meanings(table: &AggregateTable, checks: &mut Checks) -> Option<BTreeMap<String, Meaning>> {
    let mut clear = Some(());
    let written = table.columns.written();
    let columns = written.iter().flat_map(|columns| &columns.value);
    let columns = columns.map(|(name, Written { value, span })| {
        if value.meaning.trim().is_empty() {
            let message = format!("the `meaning` of {name:?} is empty");
            let problem = Problem::new(message, span.clone(), "must be a phrase");
            checks.report("columns", problem);
            clear = None;
        }
        let meaning = Meaning { unit: value.unit.clone(), meaning: value.meaning.clone() };
        (name.clone(), meaning)
    });
    let columns = columns.collect();
    clear.map(|()| columns)
}
