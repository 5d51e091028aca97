//! One archive of a study, for a colleague, a paper or a repository: manifest, input files, tables,
//! plan and versions and, if wanted, the tables of the store, with checksums and a description of all
//! of it.
//!
//! Unpacked, it is a folder in which the study can be run: the manifest finds its files, and `data/`
//! is the folder of finished work. With the tables of the store a run has nothing to do; without
//! them tables can be read and asked in SQL, and a run computes them anew, to the same bytes.

mod archive;
mod contents;
mod research_object;

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::{SystemTime, UNIX_EPOCH};

use chrono::{DateTime, NaiveDate};
use serde::Serialize;

use crate::session::{Event, Notice, Session, SessionError};
use asperity_claims::PaperClaims;
use asperity_pipeline::results::ResultsError;
use asperity_pipeline::results::StudyResults;
use asperity_tables::store::StoreError;
use contents::Contents;

pub use archive::Unplaceable;

/// What goes into an archive, and where that is.
#[derive(Debug, Clone)]
pub struct ShareOptions {
    /// The archive; `STUDY.zip` in the current folder when left out.
    pub output: Option<PathBuf>,
    /// Whether the tables of the store go along, with all maps, so that a run has nothing to do.
    pub store: bool,
    /// Whether to take the place of a file that is there.
    pub replace: bool,
    /// The day that its description gives. Everything else follows from the study, so that two
    /// archives of one day are equal.
    pub day: Day,
    /// The license that its description gives: an identifier of SPDX, or an address.
    pub license: Option<String>,
    /// The names of the authors that its description gives.
    pub authors: Vec<String>,
}

/// An archive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SharedStudy {
    pub archive: PathBuf,
    pub bytes: u64,
    /// How many tables of stages it holds.
    pub tables: usize,
    /// Of how many tasks it holds the tables; none without the store.
    pub stored: Option<usize>,
    /// How many tasks the study has; none without the store.
    pub tasks: Option<usize>,
}

impl Session<'_> {
    /// Writes one archive of the study, which unpacks to a folder that it can be run in: see
    /// [`ShareOptions`].
    ///
    /// # Errors
    /// When the manifest or a file that it names cannot be read, a table is damaged or not that of
    /// the study as it is now, or the archive cannot be written.
    pub fn share(&self, options: &ShareOptions) -> Result<SharedStudy, SessionError> {
        // The files of surfaces must be there: they go along.
        let data = self.data();
        let reading = StudyResults::new(
            self.study()?,
            data.open_read_only()?,
            &data.results(),
            &PaperClaims,
        )?;
        let named = || PathBuf::from(format!("{}.zip", reading.plan.study));
        let archive = options.output.clone().unwrap_or_else(named);
        if !options.replace && archive.symlink_metadata().is_ok() {
            return Err(ShareError::Exists { path: archive }.into());
        }
        let contents = Contents::of(&reading, self.manifest(), data, options)?;
        contents.check_place(&archive)?;
        for (stage, finished, tasks) in &contents.incomplete {
            self.tell(Event::Notice(Notice::Incomplete {
                stage,
                finished: *finished,
                tasks: *tasks,
                manifest: self.manifest(),
            }));
        }
        let (tables, stored) = (contents.tables, contents.stored);
        contents.write(&archive, options)?;
        let bytes = archive.metadata().map_or(0, |metadata| metadata.len());
        let (stored, tasks) = stored.unzip();
        Ok(SharedStudy { archive, bytes, tables, stored, tasks })
    }
}

/// A day of the calendar, written as ISO 8601 has it: `2026-11-22`.
///
/// ```
/// use std::time::UNIX_EPOCH;
///
/// use asperity::session::Day;
///
/// assert_eq!(Day::of(UNIX_EPOCH).to_string(), "1970-01-01");
/// assert_eq!("2024-02-29".parse::<Day>()?.to_string(), "2024-02-29");
/// assert!("2025-02-29".parse::<Day>().is_err());
/// # Ok::<(), asperity::session::NoDay>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Day(NaiveDate);

/// A text is no day.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no day: year, month and day, as in 2026-11-22")]
pub struct NoDay(String);

impl Day {
    /// The day on which a moment lies, in universal time.
    pub fn of(moment: SystemTime) -> Day {
        let seconds = moment.duration_since(UNIX_EPOCH);
        let seconds = seconds.map_or(0, |since| since.as_secs().try_into().unwrap_or(0));
        Day(DateTime::from_timestamp(seconds, 0).unwrap_or_default().date_naive())
    }
}

impl FromStr for Day {
    type Err = NoDay;

    fn from_str(text: &str) -> Result<Day, NoDay> {
        let day = NaiveDate::parse_from_str(text, "%Y-%m-%d");
        day.map(Day).map_err(|_| NoDay(text.to_owned()))
    }
}

impl fmt::Display for Day {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.0.format("%Y-%m-%d"))
    }
}

/// A study cannot be put into an archive.
#[derive(Debug, thiserror::Error)]
pub enum ShareError {
    #[error("`{}` is there already; `--replace` puts another in its place", path.display())]
    Exists { path: PathBuf },
    #[error("`{}` is a file of the study and is not replaced; name another with `--output`", path.display())]
    Input { path: PathBuf },
    #[error(
        "`{}` is not an archive that `asperity share` wrote and is not replaced; name another file \
         with `--output`",
        path.display()
    )]
    OtherKind { path: PathBuf },
    #[error(transparent)]
    Unplaceable(#[from] Unplaceable),
    #[error(
        "two files would be `{place}` in the archive, which keeps that name for itself; move or \
         rename the one that the manifest names"
    )]
    Clash { place: String },
    #[error(
        "the table of `{stage}` is not that of the study as it is now; `asperity run {}` writes it",
        manifest.display()
    )]
    Outdated { stage: String, manifest: PathBuf },
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Results(#[from] ResultsError),
    #[error("`{study}` has no tables yet; `asperity run {}` computes them", manifest.display())]
    Nothing { study: String, manifest: PathBuf },
}
