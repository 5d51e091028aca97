//! One archive of a study, for a colleague, a paper or a repository: manifest, input files, tables,
//! plan and versions and, if wanted, the tables of the store, with checksums and a description of all
//! of it.
//!
//! Unpacked, it is a folder in which the study can be run: the manifest finds its files, and `data/`
//! is the folder of finished work. With the tables of the store a run has nothing to do; without
//! them tables can be read and asked in SQL, and a run computes them anew, to the same bytes.

pub mod archive;
pub mod contents;
pub mod day;
pub mod error;
pub mod places;
pub mod research_object;
pub mod words;
