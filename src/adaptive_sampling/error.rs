//! Why it cannot be told how many surfaces a study has.

use crate::stages::StageError;
use crate::store::StoreError;
use crate::store::table::TableError;

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
