//! What a stage's keys are checked against.

use super::Rows;
use crate::diagnostics::Problems;
use crate::sources::Sources;
use crate::store::table::Table;

/// What is known when a stage's keys are checked.
pub struct Given<'a> {
    /// The study's seed.
    pub seed: u64,
    /// The files of measured surfaces.
    pub sources: &'a mut Sources,
    /// What the rows that the stage reads are about, where that can be told.
    pub read: Option<Rows>,
    /// What it reads, without rows, where that is known.
    pub input: Option<&'a Table>,
    /// Hears of whatever is wrong.
    pub problems: &'a mut Problems,
}
