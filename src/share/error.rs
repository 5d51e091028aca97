//! Why a study cannot be put into an archive.

use std::path::PathBuf;

use super::places::Unplaceable;
use asperity_pipeline::results::ResultsError;
use asperity_tables::store::StoreError;

/// A study cannot be put into an archive.
#[derive(Debug, thiserror::Error)]
pub enum ShareError {
    /// The archive is there already.
    #[error("`{}` is there already; `--replace` puts another in its place", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The archive would replace a file that goes into it.
    #[error("`{}` is a file of the study and is not replaced; name another with `--output`", path.display())]
    Input {
        /// The file.
        path: PathBuf,
    },
    /// The archive would replace a file that is not an archive of a study.
    #[error(
        "`{}` is not an archive that `asperity share` wrote and is not replaced; name another file \
         with `--output`",
        path.display()
    )]
    OtherKind {
        /// The file.
        path: PathBuf,
    },
    /// An input file has no place in an archive.
    #[error(transparent)]
    Unplaceable(#[from] Unplaceable),
    /// Two files would have the same place.
    #[error(
        "two files would be `{place}` in the archive, which keeps that name for itself; move or \
         rename the one that the manifest names"
    )]
    Clash {
        /// The place.
        place: String,
    },
    /// The table of a stage is of another state of the manifest or of the store.
    #[error(
        "the table of `{stage}` is not that of the study as it is now; `asperity run {}` writes it",
        manifest.display()
    )]
    Outdated {
        /// The stage.
        stage: String,
        /// The study's manifest.
        manifest: PathBuf,
    },
    /// A table is damaged, or cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Tables of stages cannot be read.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// Nothing of the study is computed.
    #[error("`{study}` has no tables yet; `asperity run {}` computes them", manifest.display())]
    Nothing {
        /// The study's name.
        study: String,
        /// The study's manifest.
        manifest: PathBuf,
    },
}
