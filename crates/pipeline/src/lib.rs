//! Pipeline from a manifest to tables: checks, plans and runs a study and reads its results.
//!
//! Data flows in one direction: [`manifest`] → [`study`] → [`plan`] → [`runner`] → [`results`].
//! This crate contains no claims about physics and draws no figures. The session passes in the rule
//! that decides claims.
//!
//! | module | what it does |
//! |---|---|
//! | [`manifest`] | reads the keys of each stage; contains the JSON schema and the template |
//! | [`study`] | checks conditions on several stages, and warns |
//! | [`plan`] | lists the tasks with their keys, and explains why a task would run |
//! | [`forecast`] | predicts how long tasks take and how much memory they need |
//! | [`runner`] | computes the tasks that the store lacks |
//! | [`outcome`] | lists the computed, damaged and failed tasks of a run |
//! | [`adaptive_sampling`] | adds surfaces until a mean is precise enough or claims are decided |
//! | [`results`] | publishes one table per stage, reads the rows, and lists failures |
//! | [`data_folder`] | defines the layout of the data folder, and finds files that no study needs |
//! | [`settings_file`] | reads `asperity.toml`: stores of a group and settings of cluster jobs |
//! | [`cluster`] | splits a study among machines and Slurm jobs |
//! | [`direct`] | generates single surfaces and solves their contact, without a study |

pub mod adaptive_sampling;
pub mod cluster;
pub mod data_folder;
pub mod direct;
pub mod forecast;
pub mod manifest;
pub mod outcome;
pub mod plan;
pub mod results;
pub mod runner;
pub mod settings_file;
pub mod study;
