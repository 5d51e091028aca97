//! Tables with described columns, their Parquet files, and the store that keeps each table once.
//!
//! The crate knows neither physics nor manifests. A table is a set of columns with unit, meaning
//! and role. A key is the digest of everything that decides a table.
//!
//! | module | contents |
//! |---|---|
//! | [`mod@column`] | description of a column: name, unit, meaning, role, type |
//! | [`table`] | table in memory with typed access to its columns; concatenation of tables |
//! | [`cells`] | cells formatted as text |
//! | [`parquet`] | Parquet files with digests, and bounded reading of foreign Parquet files |
//! | [`source`] | tables in files or in memory, read column by column |
//! | [`store`] | finished tables by key, with the recipe of each |
//! | [`parallel`] | work on several threads that end with the call |

pub mod cells;
pub mod column;
pub mod parallel;
pub mod parquet;
pub mod source;
pub mod store;
pub mod table;
