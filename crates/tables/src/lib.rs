//! Tables with described columns, Parquet files of tables, and the store of finished tables.
//!
//! The crate contains no physics and does not read manifests. A table is a set of columns with
//! unit, meaning and role. A key is the digest of everything that decides the content of a table.
//!
//! | module | contents |
//! |---|---|
//! | [`mod@column`] | description of a column: name, unit, meaning, role, type |
//! | [`table`] | table in memory with typed access to its columns; concatenation of tables |
//! | [`key`] | keys of tasks: hashes of everything that decides their tables |
//! | [`cells`] | formatting of cells as text |
//! | [`parquet`] | Parquet files with digests; Parquet files of other programs |
//! | [`source`] | tables in files or in memory, read column by column |
//! | [`store`] | finished tables by key, each with its recipe |
//! | [`parallel`] | calls that run on several threads |

#[cfg(not(unix))]
compile_error!(
    "asperity needs Linux or macOS, because its store uses the permissions and file names of Unix; \
     on Windows, use the Windows Subsystem for Linux"
);

pub mod cells;
pub mod column;
pub mod key;
pub mod parallel;
pub mod parquet;
pub mod source;
pub mod store;
pub mod table;
