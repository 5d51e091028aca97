//! Tables whose columns say what they mean, as Parquet files and in a store that keeps each once.
//!
//! The crate knows no physics and no manifest: a table is columns with a unit, a meaning and a role,
//! and a key is the digest of whatever made the table.
//!
//! | module | what it holds |
//! |---|---|
//! | [`mod@column`] | description of a column: name, unit, meaning, role, type |
//! | [`table`] | a table in memory, with typed access to its columns; tables put under one another |
//! | [`cells`] | values of single cells as text |
//! | [`parquet`] | files of tables, with digests that reveal damage; files of others, with bounded memory |
//! | [`source`] | tables on disk that are read column by column |
//! | [`store`] | finished tables by key and the records of what made them; see its own list |
//! | [`parallel`] | work on several threads that end with the call |

pub mod cells;
pub mod column;
pub mod parallel;
pub mod parquet;
pub mod source;
pub mod store;
pub mod table;
