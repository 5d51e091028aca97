//! What ends a session's work early.

use std::io;
use std::path::PathBuf;

use asperity_manifest::diagnostics::{ManifestErrors, did_you_mean, listed, wrapped};
use asperity_tables::store::StoreError;
use asperity_tables::store::key::{NoKey, TaskKey};
use asperity_tables::table::TableError;

pub use crate::share::error::ShareError;
pub use asperity_pipeline::adaptive_sampling::SamplingError;
pub use asperity_pipeline::cluster::slurm::SlurmError;
pub use asperity_pipeline::cluster::submission::ControlCharacter;
pub use asperity_pipeline::forecast::memory::TooLarge;
pub use asperity_pipeline::results::ResultsError;
pub use asperity_pipeline::results::owner::Taken;
pub use asperity_report::ReportError;
pub use asperity_report::charts::pixels::PixelsError;
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
            SessionError::Text(_)
            | SessionError::Store(_)
            | SessionError::Sampling(_)
            | SessionError::Results(_)
            | SessionError::Table(_)
            | SessionError::Stage(_)
            | SessionError::Slurm(_)
            | SessionError::Report(_)
            | SessionError::NotComputed { .. } => false,
        }
    }
}

/// A name that is not there, what may have been meant, and what there is.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}{}\nthere is {}", meant(name, known), there_is(known))]
pub struct UnknownName {
    /// What is not there.
    pub message: String,
    /// The name.
    pub name: String,
    /// Names that would do.
    pub known: Vec<String>,
}

impl UnknownName {
    /// `message` says what is not there.
    pub fn new(message: String, name: &str, known: &[&str]) -> UnknownName {
        UnknownName {
            message,
            name: name.to_owned(),
            known: known.iter().map(|known| (*known).to_owned()).collect(),
        }
    }

    /// A study has no stage of this name.
    pub fn stage(name: &str, stages: &[&str]) -> UnknownName {
        UnknownName::new(format!("the study has no stage `{name}`"), name, stages)
    }
}

fn meant(name: &str, known: &[String]) -> String {
    let meant = did_you_mean(name, known.iter().map(String::as_str));
    meant.map_or_else(String::new, |meant| format!("; did you mean `{meant}`?"))
}

fn there_is(known: &[String]) -> String {
    wrapped(&listed(known.iter().map(String::as_str), "and"))
}

fn all(keys: &[TaskKey]) -> String {
    let keys: Vec<String> = keys.iter().map(TaskKey::to_string).collect();
    listed(keys.iter().map(String::as_str), "and")
}

/// No task is known by a word, or several are.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TaskNameError {
    /// It is neither a key nor digits enough of one.
    #[error(transparent)]
    NoKey(#[from] NoKey),
    /// It begins the keys of several tasks.
    #[error("`{digits}` begins the keys of several tasks: {}", all(keys))]
    Ambiguous {
        /// The digits.
        digits: String,
        /// The keys.
        keys: Vec<TaskKey>,
    },
    /// No finished task has it.
    #[error("no task {word} is finished in `{}`", store.display())]
    NotFinished {
        /// The word.
        word: String,
        /// The store's folder.
        store: PathBuf,
    },
    /// No task of the study has it.
    #[error("`{study}` has no task {word}")]
    NotPlanned {
        /// The word.
        word: String,
        /// The study's name.
        study: String,
    },
}
