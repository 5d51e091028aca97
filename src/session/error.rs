//! What ends a session's work early.

use std::io;
use std::path::PathBuf;

use super::Shard;
use super::names::{TaskNameError, UnknownName};
use asperity_contact::morphology::map::MapError;
use asperity_manifest::diagnostics::{ManifestErrors, counted};
use asperity_tables::store::StoreError;
use asperity_tables::store::key::TaskKey;
use asperity_tables::table::TableError;
use asperity_topography_files::TopographyFileError;

pub use crate::share::ShareError;
pub use asperity_pipeline::adaptive_sampling::SamplingError;
pub use asperity_pipeline::cluster::slurm::SlurmError;
pub use asperity_pipeline::cluster::submission::ControlCharacter;
pub use asperity_pipeline::forecast::memory::TooLarge;
pub use asperity_pipeline::results::ResultsError;
pub use asperity_pipeline::results::owner::Taken;
pub use asperity_report::PixelsError;
pub use asperity_report::ReportError;
pub use asperity_stages::StageError;
pub use asperity_stages::aggregate::sql::QueryError;
pub use asperity_stages::generate::map_file::MapFileError;
pub use asperity_stages::surface_files::{ContentHash, SurfaceFileError};

/// A session cannot do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The manifest makes no sense.
    #[error(transparent)]
    Manifest(#[from] ManifestErrors),
    /// The manifest's text cannot be read once more.
    #[error(transparent)]
    Text(io::Error),
    /// The store, or another file of the data, failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Nobody can tell how many surfaces the study has.
    #[error(transparent)]
    Sampling(Box<SamplingError>),
    /// The tables of stages failed.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// A table is not what it should be.
    #[error(transparent)]
    Table(#[from] TableError),
    /// What stages compute failed.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The tables of the study are another manifest's.
    #[error(transparent)]
    Taken(#[from] Taken),
    /// A task takes more memory than there is.
    #[error(transparent)]
    Memory(#[from] TooLarge),
    /// No task has this name, or several have.
    #[error(transparent)]
    Task(#[from] TaskNameError),
    /// A name is not there.
    #[error(transparent)]
    Unknown(#[from] UnknownName),
    /// A query cannot be answered.
    #[error("{0}")]
    Query(String),
    /// The page cannot be written.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The study cannot be put into an archive.
    #[error(transparent)]
    Share(#[from] ShareError),
    /// Slurm cannot do what it was asked.
    #[error(transparent)]
    Slurm(#[from] SlurmError),
    /// A text cannot be written into a batch script.
    #[error(transparent)]
    Script(#[from] ControlCharacter),
    /// What is asked for is not there, or not possible.
    #[error("{0}")]
    Refused(String),
    /// A file of surface topography is there and cannot be read.
    #[error("cannot read surface file `{}`", path.display())]
    Topography {
        /// The file.
        path: PathBuf,
        /// Why.
        source: TopographyFileError,
    },
    /// A measured surface can be drawn only with its study, which knows the file.
    #[error("{0}; name the manifest and its stage instead of the key")]
    NotRedrawn(SurfaceFileError),
    /// A task's rows are in the table of its stage, and its own table is not in the store.
    #[error(
        "the maps of task {task} are not in `{}`, only its rows are there; `asperity run {}` computes \
         them again",
        store.display(),
        manifest.display()
    )]
    NoMaps {
        /// The task.
        task: TaskKey,
        /// The store's folder.
        store: PathBuf,
        /// The study's manifest.
        manifest: PathBuf,
    },
    /// The map of contact in a table is none.
    #[error(transparent)]
    Map(MapError),
    /// A recipe is not what its kind of stage writes.
    #[error(transparent)]
    Recipe(serde_json::Error),
    /// Another process uses the store.
    #[error("`{}` is in use by another process; prune it afterwards", store.display())]
    InUse {
        /// The store's folder.
        store: PathBuf,
    },
    /// Elements may be at work on other machines.
    #[error(
        "{} may be at work on other machines, shard {shard} of `{study}` on {machine} among them, and \
         no lock tells of those; prune afterwards, or with `--force` if you know that they have ended",
        counted(*elements, "element")
    )]
    AtWork {
        /// How many.
        elements: usize,
        /// The shard of one of them.
        shard: Shard,
        /// Its study's name.
        study: String,
        /// Its machine.
        machine: String,
    },
    /// Jobs of the study are in the queue, or at work.
    #[error(
        "`{study}` is in the queue already, as job {job}: `asperity status {}` says how far it is, \
         `asperity cancel {}` ends it",
        manifest.display(),
        manifest.display()
    )]
    InQueue {
        /// The study's name.
        study: String,
        /// One of its jobs.
        job: String,
        /// The study's manifest.
        manifest: PathBuf,
    },
    /// Nothing of the study has been submitted.
    #[error("`{study}` has not been submitted; `asperity submit {}` does it", manifest.display())]
    NotSubmitted {
        /// The study's name.
        study: String,
        /// The study's manifest.
        manifest: PathBuf,
    },
    /// A stage has no table yet.
    #[error(
        "nothing of `{stage}` is computed yet, as the manifest has it now; `asperity run {}` does it",
        manifest.display()
    )]
    NotComputed {
        /// The stage.
        stage: String,
        /// The study's manifest.
        manifest: PathBuf,
    },
}

impl From<SamplingError> for SessionError {
    fn from(error: SamplingError) -> SessionError {
        SessionError::Sampling(Box::new(error))
    }
}

impl SessionError {
    /// Whether it was asked for what is not there or not possible, and nothing else went wrong.
    pub fn is_misuse(&self) -> bool {
        match self {
            SessionError::Manifest(_)
            | SessionError::Taken(_)
            | SessionError::Memory(_)
            | SessionError::Unknown(_)
            | SessionError::Query(_)
            | SessionError::Script(_)
            | SessionError::Refused(_)
            | SessionError::InQueue { .. }
            | SessionError::NotSubmitted { .. }
            | SessionError::Report(
                ReportError::ShowsLess { .. }
                | ReportError::NoReport { .. }
                | ReportError::Taken { .. },
            ) => true,
            SessionError::Share(error) => {
                !matches!(error, ShareError::Store(_) | ShareError::Results(_))
            }
            SessionError::Task(error) => !matches!(error, TaskNameError::NotFinished { .. }),
            _ => false,
        }
    }
}
