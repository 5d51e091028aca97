//! Checks of the columns that are grouped by and reduced.

use std::collections::BTreeMap;

use crate::aggregate::Groups;
use crate::aggregate::keys::AggregateTable;
use asperity_manifest::diagnostics::{Problem, did_you_mean, listed};
use asperity_manifest::written::checks::Checks;
use asperity_manifest::written::{Key, Written};
use asperity_tables::table::Table;

/// Columns that every reduction adds.
const COUNTS: [&str; 3] = ["count", "surfaces", "unconverged"];

/// Columns of the input, each once.
pub fn named_columns(
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
pub fn check_numbers(
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
pub fn check_outputs(table: &AggregateTable, groups: &Groups, checks: &mut Checks) -> Option<()> {
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
