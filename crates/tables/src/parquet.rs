//! Tables as Parquet, byte for byte the same every time.

mod decode;
/// For fuzzing, which gets no further than a wrong digest without it.
#[doc(hidden)]
pub mod digest;
mod encode;
mod footer;
mod foreign;
mod parts;
mod schema;
mod thrift;

use std::io;

use arrow::datatypes::DataType;

use crate::store::key::TaskKey;

pub use decode::{decode, decode_bytes};
pub use encode::{GROUP, encode, write_parts};
pub use foreign::NumberColumns;
pub use parts::TableFile;
pub use thrift::Claim;

/// Verifies all bytes of a file and returns its metadata.
///
/// # Errors
/// When the file is no Parquet, is damaged, or holds types that are not ours.
pub fn verify(file: std::fs::File) -> Result<Metadata, ParquetError> {
    TableFile::open(file)?.verified()
}

/// Prefix of our entries in a file's metadata.
const PREFIX: &str = "asperity.";
/// Our entries that no caller hears of as such.
const KEY: &str = "key";
const FIELDS: &str = "fields";
const DIGESTED: &str = "digested";

/// What a file says of itself.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Metadata {
    /// The task's key; a study's table of many tasks has none.
    pub key: Option<TaskKey>,
    /// Anything else, by name: recipe, versions, inputs.
    pub entries: Vec<(String, String)>,
}

impl Metadata {
    /// An entry by name.
    pub fn get(&self, name: &str) -> Option<&str> {
        let found = self.entries.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str())
    }
}

/// Which columns to read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Columns {
    /// All.
    All,
    /// All but those that fill disks.
    Light,
}

/// A file is no table of ours.
#[derive(Debug, thiserror::Error)]
pub enum ParquetError {
    /// It is no Parquet, or a damaged one.
    #[error(transparent)]
    Parquet(#[from] parquet::errors::ParquetError),
    /// Its columns cannot be decoded.
    #[error(transparent)]
    Arrow(#[from] arrow::error::ArrowError),
    /// It cannot be read to its end.
    #[error(transparent)]
    Read(#[from] io::Error),
    /// Its bytes are not those that were written.
    #[error("its content does not match its digest")]
    Digest,
    /// Its footer claims what no file holds.
    #[error("its footer claims {0}")]
    Footer(#[from] Claim),
    /// A page of its columns does.
    #[error("a page of column `{column}` claims {claim}")]
    Page {
        /// The column.
        column: String,
        /// What the page claims.
        claim: Claim,
    },
    /// Its parts contradict each other.
    #[error("its parts contradict each other")]
    Malformed,
    /// A column holds something that no table of ours holds.
    #[error("its column `{name}` holds {found}")]
    Schema {
        /// The column.
        name: String,
        /// Its type.
        found: DataType,
    },
    /// What it says of its columns is not true of them.
    #[error("it does not hold the columns that it names")]
    Columns,
    /// It is another task's table, or another stage's.
    #[error("it does not hold the table of {owner}")]
    Foreign {
        /// Whose table was asked for.
        owner: String,
    },
}
