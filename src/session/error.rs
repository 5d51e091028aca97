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
    #[error(transparent)]
    Manifest(#[from] ManifestErrors),
    /// The manifest's text cannot be read once more.
    #[error(transparent)]
    Text(io::Error),
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Nobody can tell how many surfaces the study has.
    #[error(transparent)]
    Sampling(Box<SamplingError>),
    #[error(transparent)]
    Results(#[from] ResultsError),
    #[error(transparent)]
    Table(#[from] TableError),
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
    #[error("{0}")]
    Query(String),
    #[error(transparent)]
    Report(#[from] ReportError),
    #[error(transparent)]
    Share(#[from] ShareError),
    #[error(transparent)]
    Slurm(#[from] SlurmError),
    /// A text cannot be written into a batch script.
    #[error(transparent)]
    Script(#[from] ControlCharacter),
    /// What is asked for is not there, or not possible.
    #[error("{0}")]
    Refused(String),
    #[error(transparent)]
    SurfaceFile(#[from] SurfaceFileError),
    #[error("cannot read surface file `{}`", path.display())]
    Topography { path: PathBuf, source: Box<TopographyFileError> },
    /// A measured surface can be drawn only with its study, which knows the file.
    #[error("{0}; name the manifest and its stage instead of the key")]
    NotRedrawn(SurfaceFileError),
    #[error(
        "the maps of task {task} are not in `{}`, only its rows are there; `asperity run {}` computes \
         them again",
        store.display(),
        manifest.display()
    )]
    NoMaps { task: TaskKey, store: PathBuf, manifest: PathBuf },
    #[error(transparent)]
    Map(MapError),
    #[error(transparent)]
    Recipe(serde_json::Error),
    #[error("`{}` is in use by another process; prune it afterwards", store.display())]
    InUse { store: PathBuf },
    #[error(
        "{} may be at work on other machines, shard {shard} of `{study}` on {machine} among them, and \
         no lock tells of those; prune afterwards, or with `--force` if you know that they have ended",
        counted(*elements, "element")
    )]
    AtWork {
        elements: usize,
        /// The shard of one of them.
        shard: Shard,
        study: String,
        machine: String,
    },
    #[error(
        "`{study}` is in the queue already, as job {job}: `asperity status {}` says how far it is, \
         `asperity cancel {}` ends it",
        manifest.display(),
        manifest.display()
    )]
    InQueue { study: String, job: String, manifest: PathBuf },
    #[error("`{study}` has not been submitted; `asperity submit {}` does it", manifest.display())]
    NotSubmitted { study: String, manifest: PathBuf },
    #[error(
        "nothing of `{stage}` is computed yet, as the manifest has it now; `asperity run {}` does it",
        manifest.display()
    )]
    NotComputed { stage: String, manifest: PathBuf },
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
