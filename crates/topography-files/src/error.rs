//! What can be wrong with a file of a format.

use thiserror::Error;

/// Why bytes are not a file of one format.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum FormatError {
    #[error("it does not start as such files do")]
    Signature,
    #[error("the file ends after {found} bytes, {needed} are needed")]
    CutOff { needed: usize, found: usize },
    #[error("`{entry}` is missing")]
    Missing { entry: String },
    #[error("`{entry}` is {value}, it must be {allowed}")]
    Value { entry: String, value: String, allowed: String },
    #[error(
        "{} × {} heights of {element} bytes need {needed} bytes, {found} are there",
        nodes[0], nodes[1]
    )]
    Heights { nodes: [usize; 2], element: usize, needed: u128, found: usize },
    #[error("{} × {} nodes are more than the 2^30 that are read", nodes[0], nodes[1])]
    TooMany { nodes: [i64; 2] },
    #[error("line {line}: {problem}")]
    Line { line: usize, problem: String },
    #[error("{part} is damaged: {reason}")]
    Damaged { part: String, reason: String },
    #[error("{0}")]
    Unsupported(String),
}

/// Why a channel of a file cannot be told.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum ChannelError {
    #[error("the file has no channel `{wanted}`")]
    Unknown {
        wanted: String,
        /// What its channels are called.
        names: Vec<String>,
    },
    #[error("channels of the file have numbers from 1 to {count}, {number} is none of them")]
    Beyond { number: usize, count: usize },
    #[error(
        "the channels {} of the file are all called `{wanted}`: choose by number",
        numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
    )]
    Ambiguous {
        wanted: String,
        /// From 1 on.
        numbers: Vec<usize>,
    },
}

impl FormatError {
    /// An entry that has to be there is not.
    pub(super) fn missing(entry: impl Into<String>) -> FormatError {
        FormatError::Missing { entry: entry.into() }
    }

    /// An entry has a value that it cannot have.
    pub(super) fn value(entry: &str, value: impl ToString, allowed: &str) -> FormatError {
        // What a file holds in place of a number may be anything, and of any length.
        let value: String = value.to_string().chars().take(60).collect();
        FormatError::Value { entry: entry.to_owned(), value, allowed: allowed.to_owned() }
    }

    /// A part of the file cannot be decoded.
    pub(super) fn damaged(part: &str, reason: impl ToString) -> FormatError {
        FormatError::Damaged { part: part.to_owned(), reason: reason.to_string() }
    }

    /// The file is sound, but nothing that can be read.
    pub(super) fn unsupported(what: impl Into<String>) -> FormatError {
        FormatError::Unsupported(what.into())
    }
}

/// A number that is finite.
pub(super) fn finite(entry: &str, value: f64) -> Result<f64, FormatError> {
    match value.is_finite() {
        true => Ok(value),
        false => Err(FormatError::value(entry, value, "finite")),
    }
}

/// A factor: finite and not zero.
pub(super) fn factor(entry: &str, value: f64) -> Result<f64, FormatError> {
    match value.is_finite() && value != 0.0 {
        true => Ok(value),
        false => Err(FormatError::value(entry, value, "finite and not zero")),
    }
}
