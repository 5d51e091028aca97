//! Sharing a study out among the nodes of a Slurm cluster.

use std::collections::{BTreeSet, HashSet};
use std::path::{Path, PathBuf};

use super::{SampledStudy, Session, SessionError};
use asperity_pipeline::cluster;
use asperity_pipeline::cluster::receipts;
use asperity_pipeline::cluster::receipts::Receipt;
use asperity_pipeline::cluster::sizing;
use asperity_pipeline::cluster::slurm;
use asperity_pipeline::cluster::slurm::Queued;
use asperity_pipeline::cluster::submission::{Extras, Places};
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::forecast::memory::Allowance;
use asperity_pipeline::results::archive::Archive;
use asperity_pipeline::results::owner;
use asperity_pipeline::runner;
use asperity_tables::store::files::{Existing, make_folder, write_whole};

pub use asperity_pipeline::cluster::settings::Settings;
pub use asperity_pipeline::cluster::sizing::Sizing;
pub use asperity_pipeline::cluster::slurm::Job;
pub use asperity_pipeline::cluster::submission::Scripts;
pub use asperity_pipeline::cluster::submission::{Round, Submission};

/// How often what is missing is submitted again, unless somebody says otherwise.
const ROUNDS: u32 = 3;

/// What shall be submitted, and how.
#[derive(Debug, Clone, Default)]
pub struct SubmitOptions {
    /// Where elements run, and with what.
    pub settings: Settings,
    /// The program that they run, by an absolute path or a name for `PATH`.
    pub program: PathBuf,
    /// Whether the last job writes the page, too.
    pub report: bool,
    /// Whether to take the place of another manifest whose study has the same name.
    pub replace: bool,
}

/// What would be submitted, and what it is expected to take.
#[derive(Debug)]
pub struct PlannedSubmission {
    /// The study's name.
    pub study: String,
    /// Its elements, and what they are expected to take.
    pub sizing: Sizing,
    /// The scripts.
    pub scripts: Scripts,
    /// The processors whose receipts tell the pace; none where it was measured on this machine.
    pub processors: Vec<String>,
    /// Tasks that the store lacks.
    pub missing: usize,
    /// The folder of the study's scripts and receipts.
    pub folder: PathBuf,
    settings: Settings,
}

impl Session<'_> {
    /// What would be submitted to a cluster, and what it is expected to take. Nothing is written.
    ///
    /// # Errors
    /// As [`Session::prepare`].
    pub fn plan_submission(
        &self,
        options: &SubmitOptions,
    ) -> Result<PlannedSubmission, SessionError> {
        let SampledStudy { study, plan, .. } = &self.sampled()?;
        let store = self.data.look()?;
        if !options.replace {
            let archive = Archive::of(store.clone(), &self.data.results_of(&study.name));
            owner::check(&self.manifest, study, plan, &archive)?;
        }
        let missing = runner::missing(plan, &store);
        let receipts = self.all_receipts()?;
        let cost = measured(&receipts);
        let largest_array = slurm::largest_array();
        let sizing = Sizing::of(plan, &missing, &cost, &options.settings, largest_array);
        Allowance::of(Some(sizing.memory), sizing.cores as usize).fits(plan, &missing)?;
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let places = Places {
            program: options.program.clone(),
            data: absolute(self.data.path()),
            manifest: absolute(&self.manifest),
            folder: absolute(&self.data.cluster_of(&study.name)),
        };
        let processors = receipts.iter().filter(|receipt| !receipt.pace.is_empty());
        let processors: BTreeSet<&str> =
            processors.map(|receipt| receipt.processor.as_str()).collect();
        let extras = Extras { report: options.report, replace: options.replace };
        Ok(PlannedSubmission {
            study: study.name.clone(),
            scripts: Scripts::of(&study.name, &sizing, &options.settings, &places, extras)?,
            sizing,
            processors: processors.into_iter().map(str::to_owned).collect(),
            missing: missing.len(),
            folder: places.folder,
            settings: options.settings.clone(),
        })
    }

    /// Writes the scripts and submits them: an array of elements, and a job after it that finishes.
    ///
    /// # Errors
    /// When jobs of the study are in the queue already, Slurm is not here or does not take them, or
    /// the folder cannot be written.
    pub fn submit(&self, planned: &PlannedSubmission) -> Result<Submission, SessionError> {
        let PlannedSubmission { study, sizing, scripts, folder, settings, .. } = planned;
        if let Some(queued) = queued(study)?.first() {
            return Err(SessionError::InQueue {
                study: study.clone(),
                job: queued.array.to_string(),
                manifest: self.manifest.clone(),
            });
        }
        make_folder(&folder.join("logs"))?;
        let mut submission = Submission {
            elements: sizing.elements,
            cores: sizing.cores,
            rounds: settings.rounds.unwrap_or(ROUNDS),
            per_element: settings.per_element.unwrap_or(sizing::PER_ELEMENT),
            core_hours: sizing.core_hours + sizing.core_hours_after,
            submitted: Vec::new(),
        };
        for (path, text) in [
            (Submission::element_script(folder), &scripts.element),
            (Submission::finish_script(folder), &scripts.finish),
        ] {
            write_whole(&path, text.as_bytes(), Existing::Replace, folder)?;
        }
        let elements = sizing.hours.keys().copied().collect();
        submission.submitted.push(submit_round(folder, elements, 0)?);
        submission.write(folder)?;
        Ok(submission)
    }

    /// Takes the study's jobs out of the queue, and ends those that run; which those were.
    ///
    /// # Errors
    /// When the manifest makes no sense, or Slurm is not here.
    pub fn cancel(&self) -> Result<Vec<String>, SessionError> {
        let queued = queued(&self.study()?.name)?;
        let own = self.submitted_jobs()?;
        let jobs: BTreeSet<Job> = queued.iter().map(|queued| queued.array).collect();
        let jobs: Vec<Job> = jobs.into_iter().filter(|job| own.contains(job)).rev().collect();
        if !jobs.is_empty() {
            // The one that finishes comes first: it would begin once the array has ended.
            slurm::cancel(&jobs)?;
        }
        Ok(jobs.iter().map(Job::to_string).collect())
    }

    /// Jobs that were submitted of the study.
    pub(super) fn submitted_jobs(&self) -> Result<HashSet<Job>, SessionError> {
        let submission = Submission::read(&self.data.cluster_of(&self.study()?.name))?;
        let jobs = submission.map_or_else(Vec::new, |submission| submission.jobs());
        Ok(jobs.into_iter().collect())
    }

    /// Receipts of all studies of the data: the pace of a processor is that of any.
    pub(super) fn all_receipts(&self) -> Result<Vec<Receipt>, SessionError> {
        Ok(cluster::receipts(self.data.path())?)
    }
}

/// The jobs of a study in the queue, by their names.
pub(super) fn queued(study: &str) -> Result<Vec<Queued>, SessionError> {
    Ok(slurm::queue(&[study, &format!("{study}-finish")])?)
}

/// Submits the elements, if there are any, and the job after them, which is told how often something
/// was submitted before.
pub(super) fn submit_round(
    folder: &Path,
    elements: Vec<u32>,
    round: u32,
) -> Result<Round, SessionError> {
    let array = match elements.is_empty() {
        true => None,
        false => {
            let numbers = sizing::ranges(elements.iter().copied());
            let script = Submission::element_script(folder);
            Some(slurm::submit(&script, Some(&numbers), None, &[])?)
        }
    };
    let script = Submission::finish_script(folder);
    let finish = match slurm::submit(&script, None, array, &[round.to_string()]) {
        Ok(job) => job,
        Err(error) => {
            // Elements that nothing comes after would be half a submission.
            let _ = slurm::cancel(array.as_slice());
            return Err(error.into());
        }
    };
    Ok(Round { array, elements, finish })
}

/// What work costs where these receipts are from; where there are none, here.
pub(super) fn measured(receipts: &[Receipt]) -> CostModel {
    CostModel::measured(receipts::paces(receipts).seconds_per_pair())
}
