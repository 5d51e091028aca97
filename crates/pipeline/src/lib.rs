//! Pipeline from a manifest to tables, which checks, plans and runs a study and reads its results.
//!
//! Data flows one way: [`manifest`] → [`study`] → [`plan`] → [`runner`] → [`results`]. This crate
//! contains no claims about physics and draws no figures. The session passes in the rule that
//! decides claims.
//!
//! | module | what it does |
//! |---|---|
//! | [`manifest`] | reads a manifest into the keys of its stages; JSON schema; template |
//! | [`study`] | checks that involve several stages; warnings |
//! | [`plan`] | tasks and their keys; reasons why a task would run |
//! | [`forecast`] | predicts how long tasks take and how much memory they need |
//! | [`runner`] | computes the tasks that the store lacks |
//! | [`adaptive_sampling`] | adds surfaces until a mean is precise enough or claims are decided |
//! | [`results`] | publishes one table per stage, reads the rows, and lists failures |
//! | [`data_folder`] | layout of the data folder; finds files that no study needs |
//! | [`cluster`] | splits a study among machines and Slurm jobs |
//! | [`direct`] | generates and presses single surfaces from the keys of a manifest |

pub mod adaptive_sampling;
pub mod cluster;
pub mod data_folder;
pub mod direct;
pub mod forecast;
pub mod manifest;
pub mod plan;
pub mod results;
pub mod runner;
pub mod study;
