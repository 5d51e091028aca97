//! One archive of a study, for others to read, check and go on with.

use std::path::PathBuf;

use super::Session;
use super::error::SessionError;
use super::events::{Event, Notice};
use crate::share::contents::{Contents, Selection};
use asperity_claims::decisions::PaperClaims;
use asperity_pipeline::results::reading::Reading;

pub use crate::share::day::{Day, NoDay};
pub use crate::share::error::ShareError;
pub use crate::share::places::Unplaceable;

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
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SharedStudy {
    /// Where it is.
    pub archive: PathBuf,
    /// How many bytes it has.
    pub size: u64,
    /// How many tables of stages it holds.
    pub tables: usize,
    /// Of how many tasks it holds the tables, and how many the study has; none without the store.
    pub stored: Option<(usize, usize)>,
}

/// Writes the archive.
pub fn write(session: &Session, options: &ShareOptions) -> Result<SharedStudy, SessionError> {
    // The files of surfaces must be there: they go along.
    let data = session.data();
    let reading = Reading::of(session.study()?, data.look()?, &data.results(), &PaperClaims)?;
    let named = || PathBuf::from(format!("{}.zip", reading.plan.study));
    let path = options.output.clone().unwrap_or_else(named);
    if !options.replace && path.symlink_metadata().is_ok() {
        return Err(ShareError::Exists { path }.into());
    }
    let selection = Selection {
        store: options.store,
        day: options.day,
        license: options.license.as_deref(),
        authors: &options.authors,
    };
    let contents = Contents::of(&reading, session.manifest(), data, &selection)?;
    contents.check_place(&path)?;
    for (stage, finished, tasks) in &contents.incomplete {
        session.tell(Event::Notice(Notice::Incomplete {
            stage,
            finished: *finished,
            tasks: *tasks,
            manifest: session.manifest(),
        }));
    }
    let (tables, stored) = (contents.tables, contents.stored);
    contents.write(&path, &selection)?;
    let size = path.metadata().map_or(0, |metadata| metadata.len());
    Ok(SharedStudy { archive: path, size, tables, stored })
}
