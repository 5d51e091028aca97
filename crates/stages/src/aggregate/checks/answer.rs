//! Checks of what a query answers.

use crate::StageError;
use crate::aggregate::keys::AggregateTable;
use crate::aggregate::sql::QueryError;
use asperity_manifest::diagnostics::{Problem, Problems, chain, did_you_mean, listed};
use asperity_manifest::written::{Section, Written};
use asperity_tables::table::Table;

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
            let label = match did_you_mean(name, answer.names()) {
                Some(meant) => format!("did you mean \"{meant}\"?"),
                None => "unknown column".to_owned(),
            };
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
        let label = match did_you_mean(name, known()) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => "this query".to_owned(),
        };
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
