//! Archives of studies for colleagues, papers and repositories.
//!
//! An archive contains the manifest, its input files, the tables, the plan and the versions, with
//! checksums and a description. It can also contain the tables of the store.
//!
//! The study can run in the unpacked folder: the manifest finds its files, and `data/` is the data
//! folder. With the tables of the store, a run has nothing to compute. Without them, tables can be
//! read and queried, and a run computes them again with the same bytes.

mod archive;
mod contents;
mod research_object;

use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use asperity_manifest::diagnostics::shell_word;
use asperity_pipeline::results::ResultsError;
use asperity_tables::store::StoreError;
use chrono::{DateTime, Utc};

pub use archive::UnportablePath;
pub(crate) use archive::is_archive;
pub(crate) use chrono::NaiveDate as Day;
pub(crate) use contents::Contents;

/// Options of an archive of a study.
#[derive(Debug, Clone)]
pub(crate) struct ShareOptions {
    /// Path of the archive (default: `STUDY.zip` in the current folder).
    pub(crate) output: Option<PathBuf>,
    /// Include the tables of the store with all maps, so that a run in the unpacked folder has
    /// nothing to compute.
    pub(crate) store: bool,
    /// Overwrite an existing archive.
    pub(crate) replace: bool,
    /// Date in the description of the archive. Archives of the same study, options and date have
    /// the same bytes.
    pub(crate) day: Day,
    /// License in the description, as an SPDX identifier or a URL.
    pub(crate) license: Option<String>,
    /// Names of the authors in the description.
    pub(crate) authors: Vec<String>,
}

/// Converts a moment to UTC. Moments before 1970 become its first second.
pub(crate) fn utc(moment: SystemTime) -> DateTime<Utc> {
    let since = moment.duration_since(UNIX_EPOCH).unwrap_or_default();
    DateTime::from_timestamp(since.as_secs().try_into().unwrap_or(0), 0).unwrap_or_default()
}

/// Failure to create an archive of a study.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShareError {
    #[error("`{}` already exists; use `--replace` to overwrite it", path.display())]
    Exists { path: PathBuf },
    #[error(
        "`{}` is a file of the study; choose another file with `--output`",
        path.display()
    )]
    Input { path: PathBuf },
    #[error(
        "`{}` was not written by `asperity share`; choose another file with `--output`",
        path.display()
    )]
    OtherKind { path: PathBuf },
    #[error(transparent)]
    UnportablePath(#[from] UnportablePath),
    #[error(
        "the archive needs the name `{path}` for its own file; rename the file of the manifest"
    )]
    Clash { path: String },
    #[error(
        "the table of `{stage}` is out of date; run `asperity run {}` first",
        shell_word(manifest)
    )]
    Outdated { stage: String, manifest: PathBuf },
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Results(#[from] ResultsError),
    #[error(
        "`{study}` has no tables for the current manifest; run `asperity run {}` first",
        shell_word(manifest)
    )]
    Nothing { study: String, manifest: PathBuf },
}
