//! What a Parquet file may not claim.

use thiserror::Error;

use super::kind::Kind;

/// How deep lists and structures, or groups of columns, are within each other at most: the reader
/// passes over as many, and its stack holds them.
pub const DEEPEST: usize = 64;

/// Why bytes are not read any further.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum Claim {
    #[error("more bytes than it has")]
    Bytes,
    #[error("a list of {0} truth values, which Parquet has none of")]
    Truths(usize),
    #[error("a list of {0} elements, more than it has bytes")]
    Elements(usize),
    #[error("lists and structures more than {DEEPEST} deep within each other")]
    Deep,
    #[error("a value of type {0}, which Thrift has not")]
    Kind(u8),
    #[error("a value of type {found:?} where Parquet has one of type {known:?}")]
    Another { found: Kind, known: Kind },
    #[error("a number of more than 64 bits")]
    Number,
    #[error("a group of {0} columns, which it has not")]
    Columns(i64),
    #[error("columns whose names take more than {0} bytes with those of their groups")]
    Names(usize),
    #[error("{0} bytes once it is unpacked, for which its column has too few rows")]
    Unpacked(i64),
    #[error("a dictionary of {0} values, for which it has too few bytes")]
    Values(i64),
}
