//! What a stage's keys are checked against.

use super::Rows;
use crate::diagnostics::Problems;
use crate::store::table::Table;
use crate::surface_files::SurfaceFiles;

/// What is known when a stage's keys are checked.
pub struct Given<'a> {
    /// The study's seed.
    pub seed: u64,
    /// The files of measured surfaces.
    pub sources: &'a mut SurfaceFiles,
    /// What the rows that the stage reads are about, where that can be told.
    pub read: Option<Rows>,
    /// What it reads, without rows, where that is known.
    pub input: Option<&'a Table>,
    /// Hears of whatever is wrong.
    pub problems: &'a mut Problems,
}
