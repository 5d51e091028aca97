//! Statistical studies of rough contact.
//!
//! A researcher writes a **manifest**: surfaces to generate, loads to press them with, what to
//! measure, correct, fit and aggregate. This crate computes what it asks for, keeps every
//! intermediate table, and computes nothing twice. The story, in the order in which data flows:
//!
//! 1. [`manifest`] – what the user wrote, key by key, list by list; [`written`] reads one table.
//! 2. [`study`] – the same with every value checked: past it nobody checks again.
//! 3. [`plan`] – the tasks, each named by a key that holds everything that decides its table.
//! 4. [`runner`] – computes what the [`store`] lacks, one surface to a core.
//! 5. [`results`] – one tidy Parquet table per stage, for polars, pandas or DuckDB; whoever only
//!    looks is [`results::reading`] them and writes nothing.
//! 6. [`claims`] – what the 2015 paper says, put to those tables.
//! 7. [`report`] – a page to look at, and the figures for a paper.
//!
//! A program that works with studies asks a [`session`], as the command line does.
//!
//! [`verify`] looks whether all that is on disk is as it was written, [`prune`] finds what nobody
//! needs any more.
//!
//! [`adaptive_sampling`] finds out how many surfaces a mean needs, [`reasons`] why tasks would run,
//! [`caveats`] beside which surfaces theories do not belong.
//!
//! What a task does is said in [`stages`], the physics in [`contact`], the statistics in
//! [`fitting`]. `contact` and `fitting` know no files, `store` knows no physics; `stages`
//! introduces them to each other.
//!
//! The reference is Yastrebov, Anciaux & Molinari, *From infinitesimal to full contact between
//! rough surfaces: evolution of the contact area*, Int. J. Solids Struct. 52 (2015) 83–102.

// What is to be told goes to an observer or into a result: others than terminals call this.
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![warn(unnameable_types)]

pub(crate) mod names;

pub(crate) mod manifest;

pub(crate) mod written;

pub mod study;

pub(crate) mod ensemble;

pub mod plan;

pub(crate) mod worklist;

pub(crate) mod adaptive_sampling;

pub(crate) mod reasons;

pub(crate) mod runner;

pub(crate) mod results;

pub(crate) mod failures;

pub(crate) mod caveats;

pub(crate) mod claims;

pub(crate) mod report;

pub mod session;

pub(crate) mod data_folder;

pub(crate) mod verify;

pub(crate) mod prune;

pub(crate) mod figures;

pub(crate) mod stages;

#[allow(unnameable_types, reason = "sealed: what numbers transforms are for")]
pub mod contact;

pub mod fitting;

pub mod store;

pub(crate) mod surface_files;

pub(crate) mod diagnostics;

pub(crate) mod decimal;

pub(crate) mod cost;

pub(crate) mod memory;

pub mod cli;
