//! Entry point for the command line, cluster jobs, Python and tests.
//!
//! A [`Session`] is a manifest with its data folder. It validates, plans, runs and reads the study.
//! It does not print, read the environment or handle signals: an [`Observer`] receives events, a
//! flag stops a run, and a [`SessionError`] describes a failure.
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
//! // Finished tasks are not computed again.
//! let report = session.run(&RunOptions::default(), &stop)?;
//! assert!(report.outcome.computed.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod claims;
pub mod diff;
pub mod error;
pub mod errors;
pub mod events;
pub mod maps;
pub mod results;
pub mod run;
pub mod status;

pub(crate) mod advice;
pub(crate) mod export;
pub(crate) mod failures;
pub(crate) mod formatting;
pub(crate) mod index;
pub(crate) mod maintenance;
pub(crate) mod name_lookup;
pub(crate) mod output_files;
pub(crate) mod submission;
pub(crate) mod task_choice;
pub(crate) mod topography_file;
pub(crate) mod view;

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use crate::share::{Contents, ShareError};
use asperity_claims::DeclaredClaims;
use asperity_pipeline::data_folder;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::results::read_study;
use asperity_pipeline::study::Study;
use asperity_tables::store::Store;
use asperity_tables::store::users::HostState;

pub use asperity_pipeline::cluster::shard::{InvalidShard, Shard};
pub use asperity_pipeline::data_folder::DataFolder;
pub use asperity_pipeline::manifest::setting::Setting;
pub use asperity_pipeline::plan::{Plan, PlannedStage};
pub use asperity_pipeline::study::Warning;
pub use asperity_stages::units::TableUnits;
pub use claims::StudyClaims;
pub use error::SessionError;
pub use errors::StudyErrors;
pub use events::{Event, Notice, Observer, RunProgress};
pub use maps::{Map, MapKind};
pub use name_lookup::UnknownName;
pub use results::{DescribedColumns, Report, ReportOptions, Table, Tables};
pub use run::{PreparedRun, RunOptions, RunReport, SampledStudy, Selection};
pub use status::Status;
pub use task_choice::{ChosenLoad, Coordinate, InvalidCoordinate, InvalidLoad};

pub(crate) use crate::share::{ShareOptions, SharedStudy};
pub(crate) use asperity_mechanics::instructions::Instructions;
pub(crate) use asperity_pipeline::results::StudyResults;
pub(crate) use asperity_pipeline::settings_file::FILE as SETTINGS_FILE;
pub(crate) use asperity_stages::per_axis::PerAxis;
pub(crate) use asperity_tables::parallel;
pub(crate) use asperity_tables::store::StoreError;
pub(crate) use asperity_tables::store::files::make_folder;
pub(crate) use index::StudyIndex;
pub(crate) use maps::TaskMaps;
pub(crate) use results::Bars;
pub(crate) use status::Progress;
pub(crate) use submission::{FinishOutcome, PlannedSubmission};

/// Manifest of a study with its data folder.
///
/// The session stores only the two paths and the settings. Each method reads the manifest again, so
/// the manifest may change between calls.
#[derive(Clone)]
pub struct Session<'a> {
    manifest: PathBuf,
    settings: Vec<Setting>,
    data: DataFolder,
    observer: &'a dyn Observer,
}

impl fmt::Debug for Session<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut session = formatter.debug_struct("Session");
        session.field("manifest", &self.manifest).field("settings", &self.settings);
        session.field("data", &self.data).finish_non_exhaustive()
    }
}

impl Session<'static> {
    /// Creates a session without reading the manifest; the data folder need not exist.
    ///
    /// The settings file `asperity.toml` is searched next to the manifest and in the data folder.
    pub fn new(manifest: impl Into<PathBuf>, data: impl Into<PathBuf>) -> Session<'static> {
        Session::with_data(manifest, DataFolder::new(data))
    }

    /// Creates a session as [`Session::new`] does, for a data folder with further settings files.
    pub fn with_data(manifest: impl Into<PathBuf>, data: DataFolder) -> Session<'static> {
        let manifest = manifest.into();
        Session {
            data: data.for_manifest(&manifest),
            manifest,
            settings: Vec::new(),
            observer: &|_: Event<'_>| {},
        }
    }
}

impl Session<'_> {
    /// Returns the session with an observer that receives its events.
    pub fn observed_by(self, observer: &dyn Observer) -> Session<'_> {
        let Session { manifest, settings, data, .. } = self;
        Session { manifest, settings, data, observer }
    }

    /// Returns the session with settings, which override keys of the manifest. The study has the
    /// same results folder; a setting has the same effect as an edit of the manifest.
    pub fn with_settings(self, settings: impl IntoIterator<Item = Setting>) -> Self {
        Session { settings: settings.into_iter().collect(), ..self }
    }

    /// Returns the path of the manifest.
    pub fn manifest(&self) -> &Path {
        &self.manifest
    }

    /// Returns the settings that override keys of the manifest.
    pub fn settings(&self) -> &[Setting] {
        &self.settings
    }

    /// Returns the data folder of the study.
    pub fn data(&self) -> &DataFolder {
        &self.data
    }

    /// Reads the manifest and returns its validated study.
    ///
    /// # Errors
    /// Returns an error if the manifest is invalid; the error lists all its problems.
    pub fn study(&self) -> Result<Study, SessionError> {
        Ok(Study::read(&self.manifest, &self.settings)?)
    }

    /// Returns the study and its plan, with the number of surfaces that adaptive sampling requires,
    /// and the store.
    ///
    /// # Errors
    /// Returns an error if the manifest is invalid, or a table that decides the number of surfaces
    /// cannot be read.
    pub(crate) fn sampled(&self) -> Result<(SampledStudy, Store), SessionError> {
        let store = open_read_only(&self.data, self.observer)?;
        Ok((SampledStudy::from_tables(self.study()?, &store, &DeclaredClaims)?, store))
    }

    /// Returns the finished and the missing tasks of each stage, with the reasons why tasks will
    /// run and their expected costs. Writes nothing.
    ///
    /// # Errors
    /// Returns an error if the manifest is invalid, or a table that decides the number of surfaces
    /// cannot be read.
    pub fn status(&self) -> Result<Status, SessionError> {
        let (sampled, store) = self.sampled()?;
        let record = Record::read(&self.data.records(), &sampled.study.name);
        Ok(Status::new(sampled, &store, record.as_ref()))
    }

    /// Computes missing tasks and writes the tables of the stages, until all tasks are finished or
    /// `stop` is set.
    ///
    /// # Errors
    /// Returns an error if the manifest is invalid, if a task needs more memory than available, if
    /// the tables belong to another manifest, or if data cannot be read or written. The failure of
    /// a task is not an error but a row of the table of failures.
    pub fn run(&self, options: &RunOptions, stop: &AtomicBool) -> Result<RunReport, SessionError> {
        self.prepare(options)?.execute(stop)
    }

    /// Opens or creates the store, and performs all checks that precede the computation of a run.
    ///
    /// # Errors
    /// Returns the same errors as [`Session::run`].
    pub fn prepare(&self, options: &RunOptions) -> Result<PreparedRun<'_>, SessionError> {
        PreparedRun::new(self, options)
    }

    /// Returns the results of the study without writing anything.
    ///
    /// If the file of a measured surface is missing, the results for its last known version are
    /// used, and the observer receives a notice.
    ///
    /// # Errors
    /// Returns the same errors as [`Session::sampled`].
    pub(crate) fn reading(&self) -> Result<StudyResults, SessionError> {
        let (store, results) = (open_read_only(&self.data, self.observer)?, self.data.results());
        let study = read_study(&self.manifest, &self.settings, &store, &results)?;
        for file in study.sources.recalled() {
            self.notify(Event::Notice(Notice::Recalled(file)));
        }
        Ok(StudyResults::new(study, store, &results, &DeclaredClaims)?)
    }

    /// Opens the tables of the study, for reading and for SQL queries.
    ///
    /// # Errors
    /// Returns the same errors as [`Session::status`].
    pub fn tables(&self) -> Result<Tables<'_>, SessionError> {
        Ok(Tables { session: self, reading: self.reading()? })
    }

    /// Reads the table of a stage, or the table of failures (see [`Tables::table`]).
    ///
    /// # Errors
    /// Returns an error if the stage does not exist or has no results, or if a table is damaged.
    pub fn table(&self, name: &str) -> Result<Table, SessionError> {
        self.tables()?.table(name)
    }

    /// Reads the table of failures: each row names a task, the reason of its failure, and a command
    /// that computes the task again.
    ///
    /// # Errors
    /// Returns an error if the table is damaged.
    pub fn failures(&self) -> Result<Table, SessionError> {
        self.table(asperity_manifest::names::FAILURES)
    }

    /// Runs an SQL query (polars dialect) in which every stage is a table.
    ///
    /// # Errors
    /// Returns an error if the query is invalid or contains unknown names, or if a table cannot be
    /// read.
    pub fn sql(&self, query: &str) -> Result<Table, SessionError> {
        Ok(self.tables()?.sql(query)?.0)
    }

    /// Describes the columns of one stage or of all stages; the study need not have run.
    ///
    /// # Errors
    /// Returns an error if the manifest is invalid or the stage does not exist.
    pub fn columns(&self, stage: Option<&str>) -> Result<Vec<DescribedColumns>, SessionError> {
        DescribedColumns::for_study(&self.reading()?.study, stage)
    }

    /// Tests the claims of the study with its tables.
    ///
    /// # Errors
    /// Returns an error if the tables cannot be read.
    pub fn claims(&self) -> Result<StudyClaims, SessionError> {
        StudyClaims::read(self)
    }

    /// Writes an HTML page of figures and tables, and each figure as a file.
    ///
    /// # Errors
    /// Returns an error if the tables cannot be read, a file cannot be written, or an existing page
    /// belongs to another manifest.
    pub fn report(&self, options: &ReportOptions) -> Result<Report, SessionError> {
        results::write_report(self, options)
    }

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
            open_read_only(data, self.observer)?,
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

    /// Opens the store for writing and deletes unfinished files of ended processes.
    fn open(&self) -> Result<Store, SessionError> {
        // Ignore errors: unfinished files do no harm.
        let _ = data_folder::delete_unfinished(&self.data, &HostState::here());
        notify_of_lock(&self.data, self.observer);
        Ok(self.data.open()?)
    }

    pub(crate) fn notify(&self, event: Event<'_>) {
        self.observer.on_event(event);
    }
}

/// Sends a notice if a process that deletes tables has locked a store of a data folder, because
/// opening the stores then waits for this process.
fn notify_of_lock(data: &DataFolder, observer: &dyn Observer) {
    if let Some(store) = data.locked_store() {
        observer.on_event(Event::Notice(Notice::Waiting(&store)));
    }
}

/// Opens the store of a data folder for reading. The observer receives a notice about each listed
/// store that cannot be used.
fn open_read_only(data: &DataFolder, observer: &dyn Observer) -> Result<Store, SessionError> {
    notify_of_lock(data, observer);
    let (store, unusable) = data.open_available()?;
    let notices = unusable.iter().map(|error| Event::Notice(Notice::UnusableStore(error)));
    notices.for_each(|notice| observer.on_event(notice));
    Ok(store)
}
