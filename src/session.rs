//! A study in use: its manifest, and the folder that keeps what is computed of it.
//!
//! Whoever works with studies – the command line, a cluster, Python, a test – asks a [`Session`]
//! to check, plan, run and read one. It prints nothing, reads no environment and hears no signals:
//! what is to be told goes to an [`Observer`], what stops a run is a flag, and what goes wrong is a
//! [`SessionError`].
//!
//! ```
//! use std::fs;
//! use std::sync::atomic::AtomicBool;
//!
//! use asperity::session::{Event, RunOptions, Session};
//!
//! let folder = tempfile::tempdir()?;
//! let manifest = folder.path().join("study.toml");
//! fs::write(&manifest, r#"
//!     [study]
//!     name = "small"
//!     [stage.surfaces]
//!     kind = "generate"
//!     nodes = 16
//!     hurst = 0.8
//!     k_lower = 1
//!     k_upper = 4
//!     [stage.contact]
//!     kind = "solve"
//!     from = "surfaces"
//!     loads = [0.05, 0.1]
//! "#)?;
//!
//! let print = |event: Event| {
//!     if let Event::Notice(notice) = event {
//!         eprintln!("{}: {notice}", notice.severity());
//!     }
//! };
//! let session = Session::new(&manifest, folder.path().join("data")).observed_by(&print);
//! assert_eq!(session.status()?.missing.len(), 2);
//!
//! let stop = AtomicBool::new(false);
//! let report = session.run(&RunOptions::default(), &stop)?;
//! assert_eq!(report.outcome.computed.len(), 2);
//! assert_eq!(session.table("contact")?.rows(), 2);
//! let heaviest = session.sql("select max(load) as load from contact")?;
//! assert_eq!(heaviest.reals("load")?.value(0), 0.1);
//!
//! // What is there is not computed again.
//! let report = session.run(&RunOptions::default(), &stop)?;
//! assert!(report.outcome.computed.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod advice;
pub mod claims;
pub mod error;
pub mod events;
pub mod failures;
pub mod maintenance;
pub mod names;
pub mod new_manifest;
pub mod results;
pub mod run;
pub mod status;
pub mod submission;
pub mod surface;
pub mod view;
pub mod words;

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use asperity_claims::PaperClaims;
use asperity_pipeline::data_folder;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::results::read_study;
use asperity_pipeline::study::Study;
use asperity_tables::store::Store;
use asperity_tables::store::users::HostState;

pub use crate::share::{Day, NoDay, ShareError, ShareOptions, SharedStudy, Unplaceable};
pub use advice::StudyAdvice;
pub use asperity_claims::names as claim_names;
pub use asperity_contact::instructions::Instructions;
pub use asperity_pipeline::cluster::shard::{InvalidShard, Shard};
pub use asperity_pipeline::data_folder::DataFolder;
pub use asperity_pipeline::plan::{Plan, PlannedStage};
pub use asperity_pipeline::results::{StageRows, StudyResults};
pub use asperity_pipeline::study::Warning;
pub use asperity_stages::aggregate::sql::silence_panics;
pub use claims::StudyClaims;
pub use error::SessionError;
pub use events::{Event, Notice, Observer, RunProgress};
pub use names::UnknownName;
pub use results::{Bars, DescribedColumns, Report, ReportOptions, Table, Tables};
pub use run::{PreparedRun, RunOptions, RunReport, SampledStudy, Selection};
pub use status::{Progress, Status};
pub use submission::{FinishOptions, FinishOutcome, Finished, PlannedSubmission, SubmitOptions};

pub(crate) use asperity_tables::parallel;
pub(crate) use asperity_tables::store::StoreError;
pub(crate) use asperity_tables::store::files::make_folder;

/// A manifest and a folder of data, as whoever works with both has them.
///
/// It holds nothing but where they are: the manifest is read again whenever it is asked something,
/// so that it may be edited meanwhile.
#[derive(Clone)]
pub struct Session<'a> {
    manifest: PathBuf,
    data: DataFolder,
    observer: &'a dyn Observer,
}

impl fmt::Debug for Session<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut session = formatter.debug_struct("Session");
        session.field("manifest", &self.manifest);
        session.field("data", &self.data).finish_non_exhaustive()
    }
}

impl Session<'static> {
    /// A manifest and a folder of data, neither of which is looked at yet; the folder need not
    /// exist.
    pub fn new(manifest: impl Into<PathBuf>, data: impl Into<PathBuf>) -> Session<'static> {
        Session {
            manifest: manifest.into(),
            data: DataFolder::new(data),
            observer: &|_: Event<'_>| {},
        }
    }
}

impl Session<'_> {
    /// The same, with somebody who hears what happens.
    pub fn observed_by(self, observer: &dyn Observer) -> Session<'_> {
        Session { manifest: self.manifest, data: self.data, observer }
    }

    /// Where the manifest is.
    pub fn manifest(&self) -> &Path {
        &self.manifest
    }

    /// The folder of data.
    pub fn data(&self) -> &DataFolder {
        &self.data
    }

    /// The study that the manifest asks for, checked.
    ///
    /// # Errors
    /// Everything that is wrong with the manifest.
    pub fn study(&self) -> Result<Study, SessionError> {
        Ok(Study::read(&self.manifest, claim_names)?)
    }

    /// The study and its plan, with as many surfaces as the tables in the store ask for.
    ///
    /// # Errors
    /// When the manifest makes no sense, or a table cannot be read that decides on surfaces.
    pub fn sampled(&self) -> Result<SampledStudy, SessionError> {
        let store = self.data.open_read_only()?;
        Ok(SampledStudy::from_tables(self.study()?, &store, &PaperClaims)?)
    }

    /// What the study has, what it would compute, why, and at what cost. Nothing is written.
    ///
    /// # Errors
    /// As [`Session::sampled`].
    pub fn status(&self) -> Result<Status, SessionError> {
        let sampled = self.sampled()?;
        let record = Record::read(&self.data.records(), &sampled.study.name);
        Ok(Status::of(sampled, &self.data.open_read_only()?, record.as_ref()))
    }

    /// Computes what is missing and writes the stages' tables, until all is done or `stop` is set.
    ///
    /// # Errors
    /// When the manifest makes no sense, a task takes more memory than there is, the tables are
    /// another manifest's, or the data cannot be read or written. Tasks that fail are no errors,
    /// but rows of the table of failures.
    pub fn run(&self, options: &RunOptions, stop: &AtomicBool) -> Result<RunReport, SessionError> {
        self.prepare(options)?.execute(stop)
    }

    /// Everything of a run before something is computed: the store is made if it is not there, and
    /// what is refused is refused now.
    ///
    /// # Errors
    /// As [`Session::run`].
    pub fn prepare(&self, options: &RunOptions) -> Result<PreparedRun<'_>, SessionError> {
        PreparedRun::new(self, options)
    }

    /// What has been computed of the study, to be looked at: nothing is written. Files of measured
    /// surfaces that are gone are taken to be as they were; the observer hears of each.
    ///
    /// # Errors
    /// As [`Session::sampled`].
    pub fn reading(&self) -> Result<StudyResults, SessionError> {
        let (store, results) = (self.data.open_read_only()?, self.data.results());
        let study = read_study(&self.manifest, claim_names, &store, &results)?;
        for file in study.sources.recalled() {
            self.tell(Event::Notice(Notice::Recalled(file)));
        }
        Ok(StudyResults::new(study, store, &results, &PaperClaims)?)
    }

    /// The study's tables, to be read one by one or asked in SQL.
    ///
    /// # Errors
    /// As [`Session::reading`].
    pub fn tables(&self) -> Result<Tables<'_>, SessionError> {
        Tables::of(self)
    }

    /// A stage's table, by the stage's name, or the one of failures: see [`Tables::table`].
    ///
    /// # Errors
    /// When there is no such stage, nothing of it is computed, or a table is damaged.
    pub fn table(&self, name: &str) -> Result<Table, SessionError> {
        self.tables()?.table(name)
    }

    /// What the last runs could not compute, a row each: its task, why, and what computes it alone.
    ///
    /// # Errors
    /// When the table is damaged.
    pub fn failures(&self) -> Result<Table, SessionError> {
        self.table(asperity_manifest::names::FAILURES)
    }

    /// The answer to a query in the SQL of polars, in which every stage is a table.
    ///
    /// # Errors
    /// When it is no query, names what is not there, or a table cannot be had.
    pub fn sql(&self, query: &str) -> Result<Table, SessionError> {
        self.tables()?.sql(query)
    }

    /// What the columns of the stages' tables mean, or of the one of this name; nothing need have
    /// been computed.
    ///
    /// # Errors
    /// When the manifest makes no sense, or there is no such stage.
    pub fn columns(&self, stage: Option<&str>) -> Result<Vec<DescribedColumns>, SessionError> {
        DescribedColumns::of_study(&self.reading()?.study, stage)
    }

    /// What the 2015 paper says, judged by the tables.
    ///
    /// # Errors
    /// When the tables cannot be read.
    pub fn claims(&self) -> Result<StudyClaims, SessionError> {
        StudyClaims::of(self)
    }

    /// Writes the page of figures and tables, and each figure.
    ///
    /// # Errors
    /// When the tables cannot be read, a file cannot be written, or a page is there that shows
    /// more or is another manifest's.
    pub fn report(&self, options: &ReportOptions) -> Result<Report, SessionError> {
        results::write_report(self, options)
    }

    /// The store, for work: what ended processes have left unfinished is swept away.
    fn open(&self) -> Result<Store, SessionError> {
        // What cannot be swept does no harm.
        let _ = data_folder::delete_unfinished(&self.data, &HostState::here());
        Ok(Store::open(&self.data.store())?)
    }

    pub(crate) fn tell(&self, event: Event<'_>) {
        self.observer.hear(event);
    }
}
