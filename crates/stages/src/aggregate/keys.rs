//! Keys of the stages that reduce tables, and how they are checked.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::sql::QueryError;
use super::{Groups, Meaning, Model, OF_THE_SPECTRUM, Params, Sql, Statistic};
use crate::{Given, Recipe, StageError};
use asperity_manifest::diagnostics::{
    Problem, Problems, Span, chain, did_you_mean, listed, suggestion,
};
use asperity_manifest::written::checks::Checks;
use asperity_manifest::written::{Key, Section, Written, table};
use asperity_tables::table::Table;

/// Reduces tables to statistics.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AggregateTable {
    /// A query over the stages named in `from`; it replaces the other keys. Rows that no `order by`
    /// tells apart come in the order of the rows that they are made of.
    pub sql: Key<String>,
    /// What columns of the query's answer mean, by their names: `{ unit = "…", meaning = "…" }`.
    /// Columns called as in the tables that are read mean the same unless it is said here.
    pub columns: Key<BTreeMap<String, Written<ColumnTable>>>,
    /// Columns that name a group; every coordinate but surface, seed and realization when left out.
    pub group_by: Key<Vec<Written<String>>>,
    /// Columns to reduce.
    pub over: Key<Vec<Written<String>>>,
    /// What to compute of each: `"mean"`, `"sd"`, `"sem"`, `"min"`, `"max"`, `"median"`, quantiles
    /// such as `"q05"`, confidence intervals of the mean such as `"ci95"` (Student's t). `"sem"`
    /// and intervals count surfaces: rows of one seed and realization are one sample. Against
    /// `load` the `"slope"` of the mean, the `"secant"`, and the `"approach"` of an area a to full
    /// contact, −ln[(1 − a) y √(2π)]; and in groups that span several loads `"regr_slope"` and
    /// `"regr_intercept"` of the least-squares line against `load`.
    #[schemars(extend("default" = ["mean", "sd", "sem"]))]
    pub statistics: Key<Vec<Written<String>>>,
    /// Theories whose area stands beside, under each row's load, as `area_MODEL`; with the slope,
    /// secant or approach to full contact where `statistics` ask for it. Asperity models take
    /// Nayak's parameter α of the spectrum over the modes of the cell, as `nayak_lattice` has it.
    pub models: Key<Vec<Written<Model>>>,
}

table!(AggregateTable, swept: [], lists: ["group_by", "over", "statistics", "models"]);

/// What a column of a query's answer means.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColumnTable {
    /// Unit of its values: `"1"` for pure numbers, empty where units make no sense.
    #[serde(default)]
    pub unit: String,
    /// One phrase that says what it means.
    pub meaning: String,
}

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
    let statistics = statistics(&table.statistics, named, input, checks);
    let models = models(table, input, checks);
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

/// Columns that every reduction adds.
const COUNTS: [&str; 3] = ["count", "surfaces", "unconverged"];

/// Columns of the input, each once.
fn named_columns(
    key: &str,
    written: &Written<Vec<Written<String>>>,
    input: Option<&Table>,
    checks: &mut Checks,
) -> Option<Vec<String>> {
    if written.value.is_empty() {
        let label = "must name at least one column";
        let problem = Problem::new(format!("`{key}` is empty"), written.span.clone(), label);
        checks.report(key, problem);
        return None;
    }
    let mut seen = BTreeMap::new();
    let mut complete = true;
    for Written { value, span } in &written.value {
        if let Some(before) = seen.insert(value.as_str(), span) {
            let message = format!("`{key}` names {value:?} twice");
            let problem = Problem::new(message, span.clone(), "here again");
            checks.problems.push(problem.and(before.clone(), "first here"));
            complete = false;
        }
        if let Some(input) = input.filter(|input| !input.has(value)) {
            let names = || input.names();
            let message = format!("the stages in `from` have no column {value:?}");
            checks.problems.push(match did_you_mean(value, names()) {
                Some(meant) => {
                    let label = format!("did you mean \"{meant}\"?");
                    Problem::new(message, span.clone(), label)
                }
                None => Problem::new(message, span.clone(), "unknown column")
                    .help(format!("their columns are {}", listed(names(), "and"))),
            });
            complete = false;
        }
    }
    complete.then(|| written.value.iter().map(|column| column.value.clone()).collect())
}

/// Statistics are taken of numbers.
fn check_numbers(
    written: &Written<Vec<Written<String>>>,
    input: Option<&Table>,
    checks: &mut Checks,
) -> Option<()> {
    let mut clear = Some(());
    for Written { value, span } in &written.value {
        if input.is_some_and(|input| input.texts(value).is_ok()) {
            let message = format!("the column {value:?} holds texts");
            let label = "has no mean, nor any other statistic";
            checks.problems.push(Problem::new(message, span.clone(), label));
            clear = None;
        }
    }
    clear
}

/// What comes out must not be called like a group's column.
fn check_outputs(table: &AggregateTable, groups: &Groups, checks: &mut Checks) -> Option<()> {
    let written = |key: &Key<Vec<Written<String>>>, index: usize| {
        key.written().map(|list| list.value[index].span.clone())
    };
    let grouping = groups.group_by.iter().flatten().enumerate();
    let mut clear = Some(());
    for (index, column) in grouping {
        let place = written(&table.group_by, index)?;
        if COUNTS.contains(&column.as_str()) {
            let message = format!("{column:?} is a column that every reduction adds");
            checks.problems.push(Problem::new(message, place, "cannot name a group"));
            clear = None;
            continue;
        }
        for (reduced, over) in groups.over.iter().enumerate() {
            let place = place.clone();
            let over_place = written(&table.over, reduced)?;
            let is_statistic = |name: &str| {
                let mut statistics = groups.statistics.iter();
                statistics.any(|one| one.suffixes().iter().any(|suffix| suffix == name))
            };
            let suffix = column.strip_prefix(over.as_str()).and_then(|rest| rest.strip_prefix('_'));
            let problem = if column == over {
                let message = format!("{column:?} names a group and is reduced");
                Problem::new(message, place, "constant within a group")
            } else if suffix.is_some_and(is_statistic) {
                let message = format!("two columns would be called {column:?}");
                Problem::new(message, place, "a group's column")
            } else {
                continue;
            };
            checks.problems.push(problem.and(over_place, "reduced here"));
            clear = None;
        }
    }
    clear
}

/// Returns whether a load, reduced or in pascals, tells groups apart, as it does by default.
fn has_load(group_by: Option<&[String]>) -> bool {
    let is_load = |name: &String| ["load", "pressure"].contains(&name.as_str());
    group_by.is_none_or(|names| names.iter().any(is_load))
}

/// What is asked for, each once.
fn statistics(
    key: &Key<Vec<Written<String>>>,
    group_by: Option<&[String]>,
    input: Option<&Table>,
    checks: &mut Checks,
) -> Option<Vec<Statistic>> {
    let Some(written) = key.written() else {
        return Some(vec![Statistic::Mean, Statistic::Sd, Statistic::Sem]);
    };
    if written.value.is_empty() {
        let label = "must name at least one statistic";
        let problem = Problem::new("`statistics` is empty", written.span.clone(), label);
        checks.report("statistics", problem);
        return None;
    }
    let mut statistics: Vec<Statistic> = Vec::new();
    let mut complete = true;
    for Written { value, span } in &written.value {
        let Some(statistic) = Statistic::named(value) else {
            checks.problems.push(unknown_statistic(value, span.clone()));
            complete = false;
            continue;
        };
        if let Some((message, label)) = misses_load(value, statistic, group_by, input) {
            checks.problems.push(Problem::new(message, span.clone(), label));
            complete = false;
        }
        if statistics.contains(&statistic) {
            let message = format!("`statistics` asks for {value:?} twice");
            checks.problems.push(Problem::new(message, span.clone(), "here again"));
            complete = false;
        }
        statistics.push(statistic);
    }
    complete.then_some(statistics)
}

/// What keeps a statistic from being taken against the load, if it is one of those: slopes follow
/// the groups of a curve from load to load, lines go through the loads within a group.
fn misses_load(
    word: &str,
    statistic: Statistic,
    group_by: Option<&[String]>,
    input: Option<&Table>,
) -> Option<(String, &'static str)> {
    let names_groups = match statistic {
        Statistic::Slope | Statistic::Secant | Statistic::Approach => true,
        Statistic::RegressionSlope | Statistic::RegressionIntercept => false,
        _ => return None,
    };
    if names_groups && !has_load(group_by) {
        let message = format!("{word:?} is taken against `load`, which names no group");
        return Some((message, "needs `load` in `group_by`"));
    }
    if input.is_some_and(|input| !input.has("load")) {
        let message = format!("{word:?} is taken against `load`, which the input has not");
        return Some((message, "needs rows with a `load`"));
    }
    (!names_groups && has_load(group_by)).then(|| {
        let message =
            format!("{word:?} is of a line through several loads, and `load` names groups");
        (message, "needs a `group_by` without `load`")
    })
}

fn unknown_statistic(name: &str, span: Span) -> Problem {
    let words = Statistic::words;
    let label = suggestion('"', name, words(), "unknown statistic");
    let help = format!(
        "one of {}, a quantile such as `q05` (5 %) or `q975` (97.5 %), or a confidence interval of \
         the mean such as `ci95` (95 %)",
        listed(words(), "and")
    );
    Problem::new(format!("there is no statistic {name:?}"), span, label).help(help)
}

/// The theories beside the means; each needs rows with a load, and asperity models a spectrum.
fn models(
    table: &AggregateTable,
    input: Option<&Table>,
    checks: &mut Checks,
) -> Option<Vec<Model>> {
    let Some(written) = table.models.written() else {
        return Some(Vec::new());
    };
    let mut models = Vec::new();
    let mut clear = Some(());
    for Written { value, span } in &written.value {
        let model = *value;
        let mut report = |message: String, label: &str| {
            let problem = Problem::new(message, span.clone(), label);
            checks.problems.push(problem);
            clear = None;
        };
        if models.contains(&model) {
            report("`models` names one twice".to_owned(), "here again");
        }
        let wanted: &[&str] = match model.asperities() {
            Some(_) => &OF_THE_SPECTRUM,
            None => &[],
        };
        let is_read = |name: &str| input.is_none_or(|input| input.has(name));
        let is_grouped = |name: &str| {
            let names = |column: &Written<String>| {
                column.value == name || (name == "load" && column.value == "pressure")
            };
            let written = table.group_by.written();
            written.is_none_or(|list| list.value.iter().any(names))
        };
        let wanted = || wanted.iter().copied().chain(["load"]);
        if !wanted().all(is_read) {
            let missing = listed(wanted().filter(|name| !is_read(name)), "and");
            let message = format!("a model needs {missing}, which the input has not");
            report(message, "only for surfaces drawn from a spectrum, under loads");
        } else if !wanted().all(is_grouped) {
            let missing = listed(wanted().filter(|name| !is_grouped(name)), "and");
            let message = format!("a model needs {missing}, which `group_by` leaves out");
            report(message, "has one value per row only if these name the group");
        }
        models.push(model);
    }
    clear.map(|()| models)
}

/// Whether a stage is a query: it looks at each of its inputs as a table of its own.
pub fn is_query(section: &Section<AggregateTable>) -> bool {
    let mut points = section.points.iter();
    points.any(|point| point.table.sql.written().is_some())
}

/// Judges what a query answers to empty tables: what is wrong with it shows before anything is
/// computed.
pub fn validate_answer(
    section: &Section<AggregateTable>,
    answer: Result<Table, StageError>,
    tables: &[(String, Table)],
    problems: &mut Problems,
) -> Option<Table> {
    let written = &section.points.first()?.table;
    let Some(query) = written.sql.written() else {
        return answer.ok();
    };
    let answer = match answer {
        Ok(answer) => answer,
        Err(error) => {
            problems.push(no_answer(&error, query, tables));
            return None;
        }
    };
    for (name, column) in written.columns.written().iter().flat_map(|all| &all.value) {
        if !answer.has(name) {
            let message = format!("the query answers with no column {name:?}");
            let label = suggestion('"', name, answer.names(), "unknown column");
            let help = format!("its columns are {}", listed(answer.names(), "and"));
            problems.push(Problem::new(message, column.span.clone(), label).help(help));
        }
    }
    Some(answer)
}

fn no_answer(error: &StageError, query: &Written<String>, tables: &[(String, Table)]) -> Problem {
    let span = query.span.clone();
    if let StageError::Query(QueryError::Unknown { message, name, known }) = error {
        let known = || known.iter().map(String::as_str);
        let label = suggestion('`', name, known(), "this query");
        let help = format!("there is {}", listed(known(), "and"));
        return Problem::new(format!("the query cannot be answered: {message}"), span, label)
            .help(help);
    }
    let reason = match error {
        StageError::Query(error) => error.to_string(),
        other => chain(other),
    };
    let names = listed(tables.iter().map(|(name, _)| name.as_str()), "and");
    let help = format!(
        "the query, in the SQL of polars, sees {names}; a name with `-` needs double quotes"
    );
    Problem::new(format!("the query cannot be answered: {reason}"), span, "this query").help(help)
}
