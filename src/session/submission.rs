//! Running a study on a Slurm cluster: a job array that computes the surfaces, and a last job that
//! completes the study.

use std::collections::{BTreeSet, HashSet};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use super::{
    Report, ReportOptions, RunOptions, RunReport, SampledStudy, Selection, Session, SessionError,
    Shard,
};
use asperity_pipeline::cluster::receipts::Receipt;
use asperity_pipeline::cluster::slurm::Queued;
use asperity_pipeline::cluster::submission::{ScriptPaths, Scripts, job_name};
use asperity_pipeline::cluster::{receipts, sizing, slurm};
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::forecast::memory::MemoryLimit;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::owner;
use asperity_pipeline::{cluster, runner};
use asperity_tables::store::files::{make_folder, write_whole};

pub(crate) use asperity_pipeline::cluster::settings::Settings;
pub(crate) use asperity_pipeline::cluster::sizing::{Sizing, ranges};
pub(crate) use asperity_pipeline::cluster::slurm::Job;
pub(crate) use asperity_pipeline::cluster::submission::{Round, ScriptOptions, Submission};
pub(crate) use asperity_pipeline::settings_file::SettingsFile;

/// Default of the maximum number of resubmissions.
const DEFAULT_ROUNDS: u32 = 3;

/// Scripts and expected cost of a submission.
#[derive(Debug)]
pub(crate) struct PlannedSubmission {
    pub(crate) study: String,
    /// Array elements with their expected times.
    pub(crate) sizing: Sizing,
    scripts: Scripts,
    /// Processors whose receipts give the speed; empty if the speed was measured on this machine.
    pub(crate) processors: Vec<String>,
    /// Number of tasks that are not in the store.
    pub(crate) missing: usize,
    /// Folder of scripts and receipts of the study.
    pub(crate) folder: PathBuf,
    settings: Settings,
}

impl PlannedSubmission {
    /// Returns the paths of the two scripts and their texts.
    pub(crate) fn scripts(&self) -> [(PathBuf, &str); 2] {
        let Scripts { element, finish } = &self.scripts;
        let folder = &self.folder;
        [(Submission::element_script(folder), element), (Submission::finish_script(folder), finish)]
    }
}

impl Session<'_> {
    /// Creates the scripts and estimates the cost, without writing or submitting anything.
    ///
    /// # Errors
    /// Returns the same errors as [`Session::prepare`].
    pub(crate) fn plan_submission(
        &self,
        program: PathBuf,
        settings: Settings,
        options: ScriptOptions,
    ) -> Result<PlannedSubmission, SessionError> {
        let (SampledStudy { study, plan, .. }, store) = &self.sampled()?;
        if !options.replace {
            owner::check(&self.manifest, study, plan, &self.data.results_of(&study.name))?;
        }
        let missing = runner::missing(plan, store);
        let receipts = self.all_receipts()?;
        let cost = measured(&receipts);
        let largest_array = slurm::largest_array();
        let sizing = Sizing::new(plan, &missing, &cost, &settings, largest_array);
        MemoryLimit::new(Some(sizing.memory), sizing.cores as usize).fits(plan, &missing)?;
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let paths = ScriptPaths {
            program,
            data: absolute(self.data.path()),
            manifest: absolute(&self.manifest),
            folder: absolute(&self.data.cluster_of(&study.name)),
        };
        let measured = receipts.iter().filter(|receipt| !receipt.pace.is_empty());
        let processors: BTreeSet<&str> =
            measured.map(|receipt| receipt.processor.as_str()).collect();
        Ok(PlannedSubmission {
            study: study.name.clone(),
            scripts: Scripts::new(&study.name, &sizing, &settings, &paths, options)?,
            sizing,
            processors: processors.into_iter().map(str::to_owned).collect(),
            missing: missing.len(),
            folder: paths.folder,
            settings,
        })
    }

    /// Writes the scripts and submits a job array and a last job that runs after it.
    ///
    /// # Errors
    /// Returns an error if jobs of the study are already in the queue, Slurm is not installed or
    /// rejects the jobs, or the folder cannot be written.
    pub(crate) fn submit(&self, planned: &PlannedSubmission) -> Result<Submission, SessionError> {
        let PlannedSubmission { study, sizing, folder, settings, .. } = planned;
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
            rounds: settings.rounds.unwrap_or(DEFAULT_ROUNDS),
            per_element: settings.per_element.unwrap_or(sizing::DEFAULT_HOURS),
            core_hours: sizing.core_hours + sizing.core_hours_after,
            submitted: Vec::new(),
        };
        for (path, text) in planned.scripts() {
            write_whole(&path, text.as_bytes(), folder)?;
        }
        let elements = sizing.hours.keys().copied().collect();
        submission.submitted.push(submit_round(folder, elements, 0)?);
        submission.write(folder)?;
        Ok(submission)
    }

    /// Cancels waiting and running jobs of the study and returns their numbers.
    ///
    /// # Errors
    /// Returns an error if the manifest is invalid, the study has not been submitted, or Slurm is
    /// not installed.
    pub(crate) fn cancel(&self) -> Result<Vec<String>, SessionError> {
        let study = self.study()?.name;
        let own = self.submitted_jobs()?;
        if own.is_empty() {
            return Err(SessionError::NotSubmitted { study, manifest: self.manifest.clone() });
        }
        let queued = queued(&study)?;
        let distinct: BTreeSet<Job> = queued.iter().map(|queued| queued.array).collect();
        let jobs: Vec<Job> = distinct.into_iter().filter(|job| own.contains(job)).rev().collect();
        if !jobs.is_empty() {
            // The last job is cancelled first, because it would start when the array ends.
            slurm::cancel(&jobs)?;
        }
        Ok(jobs.iter().map(Job::to_string).collect())
    }

    /// Returns the submitted jobs of the study.
    pub(super) fn submitted_jobs(&self) -> Result<HashSet<Job>, SessionError> {
        let submission = Submission::read(&self.data.cluster_of(&self.study()?.name))?;
        let jobs = submission.map_or_else(Vec::new, |submission| submission.jobs());
        Ok(jobs.into_iter().collect())
    }

    /// Reads the receipts of all studies, because the speed of a processor does not depend on the
    /// study.
    pub(super) fn all_receipts(&self) -> Result<Vec<Receipt>, SessionError> {
        Ok(cluster::receipts(self.data.path())?)
    }
}

/// Maximum expected time, in hours, of a remainder that the last job computes itself.
const SMALL_REMAINDER: f64 = 1.0 / 12.0;

/// Outcome of the last job.
#[derive(Debug)]
pub(crate) enum FinishOutcome {
    /// A large remainder was submitted again.
    SubmittedAgain(Round),
    /// The final run is done; the report was written if requested.
    Done(Box<RunReport>, Option<Report>),
}

impl Session<'_> {
    /// Completes a submitted study after its array has ended.
    ///
    /// Runs small remainders locally, resubmits large ones, and finally writes the tables and, if
    /// requested, the HTML report. Surfaces of adaptive stages are added in rounds, too. Tasks have
    /// been resubmitted `earlier_rounds` times before. Also returns the array elements of the
    /// previous round without a receipt: they never started, or their nodes cannot access the
    /// program or the data.
    ///
    /// # Errors
    /// Returns an error if the study has not been submitted or Slurm rejects a resubmission. Also
    /// returns the errors of [`Session::run`].
    pub(crate) fn finish(
        &self,
        earlier_rounds: u32,
        options: &RunOptions,
        with_report: bool,
        stop: &AtomicBool,
    ) -> Result<(FinishOutcome, Vec<u32>), SessionError> {
        let study = self.study()?.name;
        let folder = self.data.cluster_of(&study);
        let mut submission = Submission::read(&folder)?.ok_or_else(|| {
            SessionError::NotSubmitted { study: study.clone(), manifest: self.manifest.clone() }
        })?;
        let silent = self.silent(&study, &submission)?;
        while !stop.load(Ordering::Relaxed) {
            let (elements, seconds) = self.remainder(submission.elements)?;
            if elements.is_empty() {
                break;
            }
            let jobs = options.jobs.map_or(1, NonZeroUsize::get) as f64;
            if seconds / 3600.0 / jobs > SMALL_REMAINDER.min(submission.per_element) {
                if earlier_rounds >= submission.rounds {
                    break;
                }
                let round = submit_round(&folder, elements, earlier_rounds + 1)?;
                submission.submitted.push(round.clone());
                submission.write(&folder)?;
                return Ok((FinishOutcome::SubmittedAgain(round), silent));
            }
            // The next turn of the loop includes surfaces that adaptive sampling adds now.
            let all_surfaces =
                RunOptions { selection: Selection::Shard(Shard::WHOLE), ..options.clone() };
            if self.run(&all_surfaces, stop)?.outcome.computed.is_empty() {
                break;
            }
        }
        let report = self.run(options, stop)?;
        let is_whole = !report.outcome.interrupted && !report.outcome.halted;
        let page = (with_report && is_whole).then(|| self.report(&ReportOptions::default()));
        Ok((FinishOutcome::Done(Box::new(report), page.transpose()?), silent))
    }

    /// Returns the array elements with missing tasks that have not failed, if the surfaces are
    /// split into `elements` parts. Also returns the expected core-seconds of these tasks.
    fn remainder(&self, elements: u32) -> Result<(Vec<u32>, f64), SessionError> {
        let (SampledStudy { study, plan, .. }, store) = &self.sampled()?;
        let missing = runner::missing(plan, store);
        let own = receipts::read(&self.data.receipts_of(&study.name))?;
        let untried = without_failed(plan, &missing, &own);
        let cost = measured(&self.all_receipts()?);
        Ok(sizing::shards_of(plan, &untried, &cost, elements))
    }

    /// Returns the array elements that have left no receipt in the last round.
    fn silent(&self, study: &str, submission: &Submission) -> Result<Vec<u32>, SessionError> {
        let last = submission.submitted.last();
        let Some((Some(array), elements)) = last.map(|round| (round.array, &round.elements)) else {
            return Ok(Vec::new());
        };
        let receipts = receipts::read(&self.data.receipts_of(study))?;
        let jobs: HashSet<&str> =
            receipts.iter().filter_map(|receipt| receipt.job.as_deref()).collect();
        let is_silent = |element: &u32| !jobs.contains(job_name(array, *element).as_str());
        Ok(elements.iter().copied().filter(is_silent).collect())
    }
}

/// Returns the jobs in the queue that have the names of this study's jobs.
pub(super) fn queued(study: &str) -> Result<Vec<Queued>, SessionError> {
    Ok(slurm::queue(&[study, &format!("{study}-finish")])?)
}

/// Submits a job array of the given elements, unless there are none, and then the last job, whose
/// argument is the number of the round.
fn submit_round(folder: &Path, elements: Vec<u32>, round: u32) -> Result<Round, SessionError> {
    let array = if elements.is_empty() {
        None
    } else {
        let numbers = sizing::ranges(elements.iter().copied());
        let script = Submission::element_script(folder);
        Some(slurm::submit(&script, Some(&numbers), None, &[])?)
    };
    let script = Submission::finish_script(folder);
    let finish = match slurm::submit(&script, None, array, &[round.to_string()]) {
        Ok(job) => job,
        Err(error) => {
            // Without the last job, nothing would complete the study.
            let _ = slurm::cancel(array.as_slice());
            return Err(error.into());
        }
    };
    Ok(Round { array, elements, finish })
}

/// Returns the cost model measured by these receipts, or on this machine if there are none.
pub(super) fn measured(receipts: &[Receipt]) -> CostModel {
    CostModel::measured(receipts::paces(receipts).seconds_per_pair())
}

/// Returns the tasks in `missing` that neither failed, according to the receipts, nor depend on a
/// failed task.
///
/// Failures in runs that could not store tables do not count.
fn without_failed(plan: &Plan, missing: &[usize], receipts: &[Receipt]) -> Vec<usize> {
    let tried = receipts.iter().filter(|receipt| !receipt.halted);
    let failures = tried.flat_map(|receipt| &receipt.failed);
    let failed: HashSet<&str> = failures.map(|failed| failed.task.as_str()).collect();
    if failed.is_empty() {
        return missing.to_vec();
    }
    let mut is_lost = vec![false; plan.tasks.len()];
    // Inputs come before the tasks that read them.
    for &task in missing {
        let planned = &plan.tasks[task];
        is_lost[task] = failed.contains(planned.table.key.to_string().as_str())
            || planned.inputs.iter().any(|&input| is_lost[input]);
    }
    missing.iter().copied().filter(|&task| !is_lost[task]).collect()
}
