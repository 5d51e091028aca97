//! What has been submitted of a study, as its folder keeps it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::slurm::Job;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{Existing, write_whole};

/// What has been submitted of a study, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Submission {
    /// Parts that its surfaces are shared out into.
    pub elements: u32,
    /// Cores of an element.
    pub cores: u32,
    /// How often what is missing may be submitted again.
    pub rounds: u32,
    /// Hours that an element was to take.
    pub per_element: f64,
    /// Core-hours that all was expected to take.
    pub core_hours: f64,
    /// What was submitted, the first time and again.
    pub submitted: Vec<Round>,
}

/// An array of elements, and the job after it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Round {
    /// The array; none where only what comes after the elements was left to do.
    pub array: Option<Job>,
    /// Its elements.
    pub elements: Vec<u32>,
    /// The job that finishes.
    pub finish: Job,
}

impl Submission {
    /// Where it is kept.
    fn path(folder: &Path) -> PathBuf {
        folder.join("submission.json")
    }

    /// The script of its elements.
    pub fn element_script(folder: &Path) -> PathBuf {
        folder.join("element.sh")
    }

    /// The script of the job after them.
    pub fn finish_script(folder: &Path) -> PathBuf {
        folder.join("finish.sh")
    }

    /// What the folder of a study keeps; none if nothing has been submitted.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn read(folder: &Path) -> Result<Option<Submission>, StoreError> {
        let path = Submission::path(folder);
        let unreadable = |source| StoreError::Read { path: path.clone(), source };
        let bytes = match fs::read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            bytes => bytes.map_err(unreadable)?,
        };
        let submission = serde_json::from_slice(&bytes);
        submission.map(Some).map_err(|error| unreadable(error.into()))
    }

    /// Keeps it in the folder of a study.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), StoreError> {
        let bytes = serde_json::to_vec_pretty(self).expect("it is plain data");
        write_whole(&Submission::path(folder), &bytes, Existing::Replace, folder)
    }

    /// All jobs that were submitted.
    pub fn jobs(&self) -> Vec<Job> {
        let rounds = self.submitted.iter();
        let jobs = rounds.flat_map(|round| [round.array, Some(round.finish)]);
        jobs.flatten().collect()
    }
}

/// What the receipt of an element names as its job.
pub fn name_of(array: Job, element: u32) -> String {
    format!("{array}_{element}")
}
