//! From a manifest to tables: a study is checked, planned, run and read again.
//!
//! Data flows one way: [`manifest`] → [`study`] → [`plan`] → [`runner`] → [`results`]. The crate knows
//! no claim of any paper and draws nothing; the session passes in what decides claims.
//!
//! | module | what it does |
//! |---|---|
//! | [`manifest`] | reads a manifest into the keys of its stages; JSON schema; template |
//! | [`study`] | checks what concerns several stages; warnings |
//! | [`plan`] | tasks and their keys; why a task would run |
//! | [`forecast`] | predicts how long tasks take and how much memory they need |
//! | [`runner`] | computes the tasks that the store lacks |
//! | [`adaptive_sampling`] | draws surfaces until a mean is known or claims are decided |
//! | [`results`] | publishes one table per stage, reads rows again, and says what went wrong |
//! | [`data_folder`] | what lies where on disk, and what nothing needs any more |
//! | [`cluster`] | shares a study among machines and jobs of Slurm |
//! | [`direct`] | draws and presses single surfaces by the keys of a manifest |

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
