//! SQL over the tables of a study, and deterministic computation with data frames of polars.
//!
//! | module | content |
//! |---|---|
//! | [`frame`] | conversion between tables and data frames |
//! | [`engine`] | execution on one thread, in the order of the rows, within a limit of memory |
//! | `statement` | parsing a query, its limits, and functions that polars computes otherwise |
//! | `plan` | the steps of a query, each of which polars computes rightly |
//! | `units` | units of the columns of an answer, which follow from the query |
//! | `functions`, `window` | functions and window functions that polars does not have |
//!
//! This is a crate of its own because walking and copying the syntax tree of SQL is half of the
//! code that a compiler would write for the stages.

pub mod engine;
pub mod frame;
mod functions;
mod plan;
mod statement;
mod units;
mod window;

pub use engine::silence_panics;
pub use units::{Origin, origins};

use std::collections::BTreeSet;

use bytesize::ByteSize;
use polars::prelude::{DataFrame, PolarsError};

use asperity_tables::source::TableSource;
use asperity_tables::store::StoreError;
use frame::FirstStoreError;
use plan::Planner;
use statement::Statement;

/// Reason why a query cannot be answered.
#[derive(Debug, thiserror::Error)]
pub enum QueryError {
    /// The text is not a query, or the query is not supported.
    #[error("{0}")]
    Refused(String),
    /// A table or a column does not exist.
    #[error("{message}")]
    Unknown {
        message: String,
        name: String,
        /// Existing names that the query could use instead.
        known: Vec<String>,
    },
}

/// Reason why a data frame cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    #[error("cannot answer the query")]
    Query(#[from] QueryError),
    /// A table that a query reads is damaged.
    #[error(transparent)]
    Store(StoreError),
    #[error("cannot aggregate: {reason}")]
    Aggregate { reason: String },
}

/// Returns the tables that a query reads, without the tables that it defines by `with`.
///
/// # Errors
/// Returns an error if the query cannot be parsed.
pub fn tables_of(query: &str) -> Result<BTreeSet<String>, QueryError> {
    engine::on_query_thread(|| Ok(Statement::read(query)?.tables))
}

/// Answers a query over tables. `names` are the names of all existing tables.
///
/// Only the columns that the query needs are read. Groups come in the order of the first row of
/// each group, joined rows in the order of the left table, and rows that compare equal in a sort
/// keep the order of the input. The last digits do not depend on the number of cores.
///
/// # Errors
/// Returns an error if the query cannot be parsed, if it names a table or column that does not
/// exist, if the answer takes more memory than `memory`, or if a table is damaged.
pub fn answer(
    query: &str,
    tables: Vec<(String, TableSource)>,
    names: &[String],
    memory: ByteSize,
) -> Result<DataFrame, FrameError> {
    engine::on_query_thread(|| planned(query, tables, names, memory))
}

fn planned(
    query: &str,
    tables: Vec<(String, TableSource)>,
    names: &[String],
    memory: ByteSize,
) -> Result<DataFrame, FrameError> {
    let statement = Statement::read(query)?;
    check_names(&statement, names)?;
    let columns: Vec<(String, Vec<String>)> =
        tables.iter().map(|(name, table)| (name.clone(), table.names())).collect();
    let first_error = FirstStoreError::default();
    let lazy =
        tables.into_iter().map(|(name, table)| Ok((name, frame::lazy(table, &first_error)?)));
    let frames = lazy.collect::<Result<Vec<_>, FrameError>>()?;
    let converted = |error: &PolarsError| QueryError::from_polars(error, &statement, &columns);
    let planned = Planner::new(frames, memory, &converted).answer(statement.query.clone());
    let answer =
        planned.and_then(|frame| engine::collect(frame, memory).map_err(|error| converted(&error)));
    answer.map_err(|error| match first_error.take() {
        Some(error) => FrameError::Store(error),
        None => error.into(),
    })
}

/// Checks that all tables exist and that `with` defines no table with the name of a stage, which
/// polars would ignore.
fn check_names(statement: &Statement, names: &[String]) -> Result<(), QueryError> {
    let known = || names.iter().map(String::as_str);
    let is_known = |name: &&String| known().any(|known| known == *name);
    if let Some(hidden) = statement.defines.iter().find(is_known) {
        return Err(QueryError::Refused(format!(
            "`with {hidden}` uses the name of a stage; use another name"
        )));
    }
    match statement.tables.iter().find(|name| !is_known(name)) {
        Some(name) => Err(QueryError::no_table(name, known())),
        None => Ok(()),
    }
}

impl QueryError {
    /// Creates the error for a table that does not exist.
    pub fn no_table<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> QueryError {
        QueryError::Unknown {
            message: format!("there is no table `{name}`"),
            name: name.to_owned(),
            known: known.into_iter().map(str::to_owned).collect(),
        }
    }

    /// Converts an error of polars, and names tables and columns as the query does.
    fn from_polars(
        error: &PolarsError,
        statement: &Statement,
        tables: &[(String, Vec<String>)],
    ) -> QueryError {
        let text = error.to_string();
        let first = text.lines().map(str::trim).find(|line| !line.is_empty());
        let reason = first.unwrap_or("polars gives no reason");
        unknown_of_a_table(reason, statement, tables)
            .or_else(|| unknown_anywhere(reason))
            .unwrap_or_else(|| QueryError::Refused(shortened(reason)))
    }
}

/// Limits the length of a message, because polars prints whole syntax trees in it.
fn shortened(reason: &str) -> String {
    const MAX_LENGTH: usize = 200;
    match reason.char_indices().nth(MAX_LENGTH) {
        Some((end, _)) => format!("{}…", &reason[..end]),
        None => reason.to_owned(),
    }
}

/// Parses the message `no column named 'laod' found in table 'a'`.
fn unknown_of_a_table(
    reason: &str,
    statement: &Statement,
    tables: &[(String, Vec<String>)],
) -> Option<QueryError> {
    let (name, rest) = quoted_after("no column named ", reason)?;
    let (quoted, _) = quoted_after("found in table ", rest)?;
    let alias = quoted.trim_matches('"');
    let table = statement.aliases.get(alias).map_or(alias, String::as_str);
    let table = tables.iter().find(|(known, _)| known == table);
    let known = table.map_or_else(Vec::new, |(_, columns)| columns.clone());
    Some(QueryError::Unknown {
        message: format!("`{alias}` has no column `{name}`"),
        name: name.to_owned(),
        known,
    })
}

/// Parses the message `unable to find column "laod"; valid columns: ["load", "area",
/// "load:other"]`.
///
/// Polars gives the name `load:other` to a column that two joined tables have. Names that start
/// with `__` are those of the planner.
fn unknown_anywhere(reason: &str) -> Option<QueryError> {
    let (name, mut rest) = quoted_after("unable to find column ", reason)?;
    let mut known = Vec::new();
    while let Some((column, after)) = quoted(rest) {
        known.push(column.to_owned());
        rest = after;
    }
    known.retain(|column| !column.contains(':') && !column.starts_with("__"));
    Some(QueryError::Unknown {
        message: format!("there is no column `{name}`"),
        name: name.to_owned(),
        known,
    })
}

/// Returns the first quoted text after a prefix, and the remaining text.
fn quoted_after<'a>(prefix: &str, text: &'a str) -> Option<(&'a str, &'a str)> {
    let (_, rest) = text.split_once(prefix)?;
    quoted(rest)
}

/// Returns the first quoted text and the remaining text.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let start = text.find(['\'', '"'])?;
    let quote = text[start..].chars().next()?;
    text[start + 1..].split_once(quote)
}
