use std::path::{Path, PathBuf};

use super::Shard;
use super::name_lookup::UnknownName;
use asperity_manifest::diagnostics::{ManifestErrors, counted, shell_word};
use asperity_mechanics::morphology::map::MapError;
use asperity_pipeline::data_folder::OpenError;
use asperity_tables::key::TaskKey;
use asperity_tables::store::StoreError;
use asperity_tables::store::series::FileName;
use asperity_tables::table::TableError;
use asperity_topography_files::TopographyFileError;

pub use super::name_lookup::TaskNameError;
pub use crate::share::{ShareError, UnportablePath};
pub use asperity_pipeline::adaptive_sampling::SamplingError;
pub use asperity_pipeline::cluster::slurm::SlurmError;
pub use asperity_pipeline::cluster::submission::ControlCharacter;
pub use asperity_pipeline::forecast::memory::TooLarge;
pub use asperity_pipeline::results::ResultsError;
pub use asperity_pipeline::results::owner::Taken;
pub use asperity_report::{PixelsError, ReportError};
pub use asperity_stages::StageError;
pub use asperity_stages::error::QueryError;
pub use asperity_stages::map_file::MapFileError;
pub use asperity_stages::surface_files::{ContentHash, SurfaceFileError};

/// Failure of a method of a session.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    #[error(transparent)]
    Manifest(#[from] ManifestErrors),
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Adaptive sampling cannot decide the number of surfaces.
    #[error(transparent)]
    Sampling(Box<SamplingError>),
    #[error(transparent)]
    Results(#[from] ResultsError),
    #[error(transparent)]
    Table(#[from] TableError),
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The tables of the study belong to another manifest.
    #[error(transparent)]
    Taken(#[from] Taken),
    /// A task needs more memory than available.
    #[error(transparent)]
    Memory(#[from] TooLarge),
    /// A task key is unknown or ambiguous.
    #[error(transparent)]
    Task(#[from] TaskNameError),
    /// A name of a stage, claim or column is unknown.
    #[error(transparent)]
    Unknown(#[from] UnknownName),
    #[error(
        "`{}` has no studies; compute one, or name another folder with `--data`",
        data.display()
    )]
    NoStudies { data: PathBuf },
    #[error("{0}")]
    Query(String),
    #[error(transparent)]
    Report(#[from] ReportError),
    #[error(transparent)]
    Share(#[from] ShareError),
    #[error(transparent)]
    Slurm(#[from] SlurmError),
    /// A text contains characters that a batch script cannot contain.
    #[error(transparent)]
    Script(#[from] ControlCharacter),
    /// The request cannot be fulfilled.
    #[error("{0}")]
    Refused(String),
    #[error(transparent)]
    SurfaceFile(#[from] SurfaceFileError),
    #[error("cannot read surface file `{}`", path.display())]
    Topography { path: PathBuf, source: Box<TopographyFileError> },
    /// A measured surface cannot be drawn from its key, because only the manifest names its file.
    #[error("only the manifest names the file of this measured surface; give manifest and stage")]
    NotRedrawn,
    #[error(
        "`{}` has no maps of task {task}; `asperity run {}` computes them",
        store.display(),
        shell_word(manifest)
    )]
    NoMaps { task: TaskKey, store: PathBuf, manifest: PathBuf },
    #[error("task {task} has no map; choose a task of a `generate` or `solve` stage")]
    NoMap { task: TaskKey },
    #[error(transparent)]
    Map(MapError),
    /// A picture cannot be drawn.
    #[error(transparent)]
    Picture(#[from] PixelsError),
    #[error(transparent)]
    Recipe(serde_json::Error),
    #[error("`{}` is in use by another process; prune when that process has ended", store.display())]
    InUse { store: PathBuf },
    #[error(
        "{} may be running, such as shard {shard} of `{study}` on {machine}; use `--force` if not",
        counted(*elements, "array element")
    )]
    AtWork {
        elements: usize,
        /// Shard of one of these elements.
        shard: Shard,
        study: String,
        machine: String,
    },
    #[error(
        "`{study}` is already in the queue as job {job}; `asperity cancel {}` cancels it",
        shell_word(manifest)
    )]
    InQueue { study: String, job: String, manifest: PathBuf },
    #[error(
        "`{study}` has not been submitted; run `asperity submit {}` first",
        shell_word(manifest)
    )]
    NotSubmitted { study: String, manifest: PathBuf },
    #[error(
        "`{name}` has no results for the current manifest; run `asperity run {}` first",
        shell_word(manifest)
    )]
    NotComputed {
        /// Name of the stage or of the study.
        name: String,
        manifest: PathBuf,
    },
}

impl From<OpenError> for SessionError {
    fn from(error: OpenError) -> SessionError {
        match error {
            OpenError::Settings(errors) => SessionError::Manifest(errors),
            OpenError::Store(error) => SessionError::Store(error),
        }
    }
}

impl From<SamplingError> for SessionError {
    fn from(error: SamplingError) -> SessionError {
        SessionError::Sampling(Box::new(error))
    }
}

impl SessionError {
    /// Creates the error of a request that cannot be fulfilled.
    pub(crate) fn refused(message: impl Into<String>) -> SessionError {
        SessionError::Refused(message.into())
    }

    /// Returns the error of the file that could not be read or written.
    fn of_file(&self) -> Option<&StoreError> {
        match self {
            SessionError::Store(error)
            | SessionError::Stage(StageError::Store(error))
            | SessionError::Results(ResultsError::Store(error))
            | SessionError::Report(ReportError::Store(error))
            | SessionError::Share(
                ShareError::Store(error) | ShareError::Results(ResultsError::Store(error)),
            ) => Some(error),
            _ => None,
        }
    }

    /// Returns the path of a damaged file.
    pub(crate) fn damaged_path(&self) -> Option<&Path> {
        match self.of_file()? {
            StoreError::Damaged { path, .. } => Some(path),
            _ => None,
        }
    }

    /// Returns the key of a table whose rows are lost with a damaged file of a read-only store.
    pub(crate) fn lost_in_layer(&self) -> Option<TaskKey> {
        let StoreError::InLayer(cause) = self.of_file()? else { return None };
        let (StoreError::Damaged { path, .. } | StoreError::Read { path, .. }) = &**cause else {
            return None;
        };
        Some(path.file_name()?.to_str()?.parse::<FileName>().ok()?.key)
    }

    /// Returns whether the request or the manifest is wrong, as opposed to a failure of the
    /// program.
    pub fn is_misuse(&self) -> bool {
        match self {
            SessionError::Manifest(_)
            | SessionError::Taken(_)
            | SessionError::Memory(_)
            | SessionError::Unknown(_)
            | SessionError::Query(_)
            | SessionError::Script(_)
            | SessionError::Refused(_)
            | SessionError::NoMap { .. }
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
