//! Why it cannot be told how many surfaces a study has.

use asperity_stages::StageError;
use asperity_tables::store::StoreError;
use asperity_tables::table::TableError;

/// It cannot be told whether a condition holds.
#[derive(Debug, thiserror::Error)]
pub enum SamplingError {
    /// A table cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The mean cannot be taken.
    #[error("cannot tell whether `{until}` holds")]
    Mean {
        /// The condition.
        until: String,
        /// Why.
        source: StageError,
    },
    /// Claims cannot be judged.
    #[error("cannot tell whether claims are decided")]
    Claims(#[from] TableError),
}
