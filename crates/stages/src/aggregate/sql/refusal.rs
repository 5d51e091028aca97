//! Why a query has no answer, in words for people who asked it.

use polars::prelude::PolarsError;

use super::statement::Statement;

/// Why a query has no answer.
#[derive(Debug, thiserror::Error)]
pub enum QueryError {
    /// It is no query, or asks for what cannot be done.
    #[error("{0}")]
    Refused(String),
    /// It names a table or a column that is not there.
    #[error("{message}")]
    Unknown {
        /// What is not there.
        message: String,
        /// The name.
        name: String,
        /// Names that would do.
        known: Vec<String>,
    },
}

impl QueryError {
    /// A table that is not among those that can be asked.
    pub fn no_table<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> QueryError {
        QueryError::Unknown {
            message: format!("there is no table `{name}`"),
            name: name.to_owned(),
            known: known.into_iter().map(str::to_owned).collect(),
        }
    }

    /// What polars says, told of the tables that the query names.
    pub(super) fn of_polars(
        error: &PolarsError,
        statement: &Statement,
        tables: &[(String, Vec<String>)],
    ) -> QueryError {
        let text = error.to_string();
        let reason = text.lines().map(str::trim).find(|line| !line.is_empty());
        let reason = reason.unwrap_or("polars gives no reason");
        unknown_of_a_table(reason, statement, tables)
            .or_else(|| unknown_anywhere(reason))
            .unwrap_or_else(|| QueryError::Refused(shortened(reason)))
    }
}

/// Polars prints whole syntax trees of what it does not know.
fn shortened(reason: &str) -> String {
    const LONGEST: usize = 200;
    match reason.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &reason[..end]),
        None => reason.to_owned(),
    }
}

/// `no column named 'laod' found in table 'a'`.
fn unknown_of_a_table(
    reason: &str,
    statement: &Statement,
    tables: &[(String, Vec<String>)],
) -> Option<QueryError> {
    let (name, rest) = quoted_after("no column named ", reason)?;
    let (alias, _) = quoted_after("found in table ", rest)?;
    let alias = alias.trim_matches('"');
    let table = statement.aliases.get(alias).map_or(alias, String::as_str);
    let table = tables.iter().find(|(known, _)| known == table);
    let known = table.map_or_else(Vec::new, |(_, columns)| columns.clone());
    Some(QueryError::Unknown {
        message: format!("`{alias}` has no column `{name}`"),
        name: name.to_owned(),
        known,
    })
}

/// `unable to find column "laod"; valid columns: ["load", "area", "load:other"]`, where the last
/// one is polars' own name for a column that two joined tables have.
fn unknown_anywhere(reason: &str) -> Option<QueryError> {
    let (name, mut rest) = quoted_after("unable to find column ", reason)?;
    let mut known = Vec::new();
    while let Some((column, after)) = quoted(rest) {
        known.push(column.to_owned());
        rest = after;
    }
    known.retain(|column| !column.contains(':'));
    Some(QueryError::Unknown {
        message: format!("there is no column `{name}`"),
        name: name.to_owned(),
        known,
    })
}

/// What stands in quotes after some words, and what follows.
fn quoted_after<'a>(words: &str, text: &'a str) -> Option<(&'a str, &'a str)> {
    let (_, rest) = text.split_once(words)?;
    quoted(rest)
}

/// What stands in the next quotes, and what follows.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let start = text.find(['\'', '"'])?;
    let quote = text[start..].chars().next()?;
    text[start + 1..].split_once(quote)
}
