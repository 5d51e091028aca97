//! A study shared out among the machines of a cluster.
//!
//! A [`Shard`](shard::Shard) is a part of a study's surfaces that follows from their keys alone, so that no two
//! machines need to agree on anything. What computed a shard leaves a [receipt](receipts), and writes
//! no other file but the tables of tasks. Any scheduler that can count will do; for Slurm there are
//! [scripts](script), as many elements as the [expected cost](sizing) asks for, and its
//! [commands](slurm).

pub mod files;
pub mod pace;
pub mod receipts;
pub mod script;
pub mod settings;
pub mod shard;
pub mod sizing;
pub mod slurm;
pub mod submission;
