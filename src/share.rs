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

use chrono::{DateTime, NaiveDate, Utc};
use serde::Serialize;

use asperity_manifest::diagnostics::shell_word;
use asperity_pipeline::results::ResultsError;
use asperity_tables::store::StoreError;

pub use archive::UnportablePath;
pub(crate) use contents::Contents;

/// Options of an archive of a study.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct ShareOptions {
    /// Archive to write (default: `STUDY.zip` in the current folder).
    #[arg(long, short, value_name = "FILE.zip")]
    pub(crate) output: Option<PathBuf>,

    /// Include the tables of the store, with all maps.
    ///
    /// With them, `run` in the unpacked archive has nothing to compute. Without them, it recomputes
    /// everything; the tables of the stages can be read in both cases.
    #[arg(long)]
    pub(crate) store: bool,

    /// Overwrite an existing archive (other files are never overwritten).
    #[arg(long)]
    pub(crate) replace: bool,

    /// License of the archive, as an SPDX identifier, such as CC-BY-4.0, or a URL.
    #[arg(long)]
    pub(crate) license: Option<String>,

    /// Author of the archive (can be repeated).
    #[arg(long = "author", value_name = "NAME")]
    pub(crate) authors: Vec<String>,

    /// Date of the archive (default: today, UTC).
    ///
    /// The same study and date give the same bytes.
    #[arg(long, value_name = "YYYY-MM-DD", default_value_t = today(), hide_default_value = true)]
    pub(crate) date: NaiveDate,
}

fn today() -> NaiveDate {
    utc(SystemTime::now()).date_naive()
}

/// Size and contents of a written archive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct SharedStudy {
    pub(crate) archive: PathBuf,
    pub(crate) bytes: u64,
    /// Number of tables of stages in the archive.
    pub(crate) tables: usize,
    /// Number of tables of tasks in the archive, or `None` without the store.
    pub(crate) stored: Option<usize>,
    /// Number of tasks of the study, or `None` without the store.
    pub(crate) tasks: Option<usize>,
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
