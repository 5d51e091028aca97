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

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::{SystemTime, UNIX_EPOCH};

use asperity_manifest::diagnostics::shell_word;
use asperity_pipeline::results::ResultsError;
use asperity_tables::store::StoreError;
use chrono::{DateTime, NaiveDate, Utc};

pub use archive::UnportablePath;
pub(crate) use archive::is_archive;
pub(crate) use contents::Contents;

/// Options of an archive of a study.
#[derive(Debug, Clone)]
pub struct ShareOptions {
    /// Path of the archive (default: `STUDY.zip` in the current folder).
    pub output: Option<PathBuf>,
    /// Include the tables of the store with all maps, so that a run in the unpacked folder has
    /// nothing to compute.
    pub store: bool,
    /// Overwrite an existing archive.
    pub replace: bool,
    /// Date in the description of the archive. Archives of the same study, options and date have
    /// the same bytes.
    pub day: Day,
    /// License in the description, as an SPDX identifier or a URL.
    pub license: Option<String>,
    /// Names of the authors in the description.
    pub authors: Vec<String>,
}

/// Date in the format of ISO 8601, such as `2026-11-22`.
///
/// ```
/// use std::time::UNIX_EPOCH;
///
/// use asperity::session::Day;
///
/// assert_eq!(Day::from_time(UNIX_EPOCH).to_string(), "1970-01-01");
/// assert_eq!("2024-02-29".parse::<Day>()?.to_string(), "2024-02-29");
/// assert!("2025-02-29".parse::<Day>().is_err());
/// # Ok::<(), asperity::session::InvalidDay>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Day(NaiveDate);

/// Error for a text that is not a valid date.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a date; use the format YYYY-MM-DD, such as 2026-11-22")]
pub struct InvalidDay(String);

impl Day {
    /// Returns the date of a moment in UTC.
    pub fn from_time(moment: SystemTime) -> Day {
        Day(utc(moment).date_naive())
    }
}

/// Converts a moment to UTC. Moments before 1970 become its first second.
pub(crate) fn utc(moment: SystemTime) -> DateTime<Utc> {
    let since = moment.duration_since(UNIX_EPOCH).unwrap_or_default();
    DateTime::from_timestamp(since.as_secs().try_into().unwrap_or(0), 0).unwrap_or_default()
}

impl FromStr for Day {
    type Err = InvalidDay;

    fn from_str(text: &str) -> Result<Day, InvalidDay> {
        let day = NaiveDate::parse_from_str(text, "%Y-%m-%d");
        day.map(Day).map_err(|_| InvalidDay(text.to_owned()))
    }
}

impl fmt::Display for Day {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.0.format("%Y-%m-%d"))
    }
}

/// Failure to create an archive of a study.
#[derive(Debug, thiserror::Error)]
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
