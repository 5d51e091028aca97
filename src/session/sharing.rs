//! Writing of the archive of a study.

use std::path::PathBuf;

use serde::Serialize;

use super::{Event, Notice, Session, SessionError};
use crate::share::{Contents, ShareError, ShareOptions};
use asperity_claims::DeclaredClaims;
use asperity_pipeline::results::StudyResults;

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

impl Session<'_> {
    /// Writes an archive of the study, which can run in the unpacked folder.
    ///
    /// # Errors
    /// Returns an error if the manifest or one of its input files cannot be read, if a table is
    /// damaged or out of date, or if the archive cannot be written.
    pub(crate) fn share(&self, options: &ShareOptions) -> Result<SharedStudy, SessionError> {
        // Not `self.reading()`: the archive needs the files of measured surfaces.
        let data = self.data();
        let reading = StudyResults::new(
            self.study()?,
            self.open_read_only()?,
            &data.results(),
            &DeclaredClaims,
        )?;
        let named = || PathBuf::from(format!("{}.zip", reading.plan.study));
        let archive = options.output.clone().unwrap_or_else(named);
        if !options.replace && archive.symlink_metadata().is_ok() {
            return Err(ShareError::Exists { path: archive }.into());
        }
        let contents = Contents::collect(&reading, self.manifest(), data, options)?;
        contents.check_output(&archive)?;
        for (stage, finished, tasks) in &contents.incomplete {
            self.notify(Event::Notice(Notice::Incomplete {
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
