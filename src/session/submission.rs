//! Sharing a study out among the nodes of a Slurm cluster, and what comes after its elements.

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
use asperity_pipeline::cluster::submission::{ScriptOptions, ScriptPaths, job_name};
use asperity_pipeline::cluster::{receipts, sizing, slurm};
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::forecast::memory::MemoryLimit;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::owner;
use asperity_pipeline::results::reader::ResultReader;
use asperity_pipeline::{cluster, runner};
use asperity_tables::store::files::{Existing, make_folder, write_whole};

pub use asperity_pipeline::cluster::settings::{self, Settings};
pub use asperity_pipeline::cluster::sizing::{Sizing, ranges};
pub use asperity_pipeline::cluster::slurm::Job;
pub use asperity_pipeline::cluster::submission::{Round, Scripts, Submission};

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
    pub study: String,
    /// Its elements, and what they are expected to take.
    pub sizing: Sizing,
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
        let store = self.data.open_read_only()?;
        if !options.replace {
            let reader = ResultReader::new(store.clone(), &self.data.results_of(&study.name));
            owner::check(&self.manifest, study, plan, &reader)?;
        }
        let missing = runner::missing(plan, &store);
        let receipts = self.all_receipts()?;
        let cost = measured(&receipts);
        let largest_array = slurm::largest_array();
        let sizing = Sizing::new(plan, &missing, &cost, &options.settings, largest_array);
        MemoryLimit::new(Some(sizing.memory), sizing.cores as usize).fits(plan, &missing)?;
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let places = ScriptPaths {
            program: options.program.clone(),
            data: absolute(self.data.path()),
            manifest: absolute(&self.manifest),
            folder: absolute(&self.data.cluster_of(&study.name)),
        };
        let processors = receipts.iter().filter(|receipt| !receipt.pace.is_empty());
        let processors: BTreeSet<&str> =
            processors.map(|receipt| receipt.processor.as_str()).collect();
        let extras = ScriptOptions { report: options.report, replace: options.replace };
        Ok(PlannedSubmission {
            study: study.name.clone(),
            scripts: Scripts::new(&study.name, &sizing, &options.settings, &places, extras)?,
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
            per_element: settings.per_element.unwrap_or(sizing::DEFAULT_HOURS),
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

/// The last job computes by itself what takes its cores no longer than so many hours.
const LITTLE: f64 = 1.0 / 12.0;

/// What the last job does.
#[derive(Debug, Clone, Default)]
pub struct FinishOptions {
    /// How often something was submitted again before.
    pub round: u32,
    /// Surfaces to work on at once, memory, and whether another manifest's tables may be lost.
    pub run: RunOptions,
    /// Whether to write the page, too.
    pub report: bool,
}

/// What came of the last job.
#[derive(Debug)]
pub struct Finished {
    /// Elements of the round before that left no receipt: their nodes have not got the program, or
    /// not the data, or they never began.
    pub silent: Vec<u32>,
    pub outcome: FinishOutcome,
}

/// What the last job did.
#[derive(Debug)]
pub enum FinishOutcome {
    /// Much was missing, and has been submitted again.
    SubmittedAgain(Round),
    /// All was done that could be, and the page was written if it was wanted.
    Done(Box<RunReport>, Option<Report>),
}

impl Session<'_> {
    /// What comes after the elements: computes what is little, submits again what is much, and in
    /// the end writes the tables and, if wanted, the page. Stages that draw surfaces until a mean is
    /// known draw more in rounds, too.
    ///
    /// # Errors
    /// When nothing has been submitted, Slurm does not take what is submitted again, and as
    /// [`Session::run`].
    pub fn finish(
        &self,
        options: &FinishOptions,
        stop: &AtomicBool,
    ) -> Result<Finished, SessionError> {
        let study = self.study()?.name;
        let folder = self.data.cluster_of(&study);
        let mut submission = Submission::read(&folder)?.ok_or_else(|| {
            SessionError::NotSubmitted { study: study.clone(), manifest: self.manifest.clone() }
        })?;
        let silent = self.silent(&study, &submission)?;
        while !stop.load(Ordering::Relaxed) {
            let (elements, seconds) = self.left(submission.elements)?;
            if elements.is_empty() {
                break;
            }
            let jobs = options.run.jobs.map_or(1, NonZeroUsize::get) as f64;
            if seconds / 3600.0 / jobs > LITTLE.min(submission.per_element) {
                if options.round >= submission.rounds {
                    break;
                }
                let round = submit_round(&folder, elements, options.round + 1)?;
                submission.submitted.push(round.clone());
                submission.write(&folder)?;
                let outcome = FinishOutcome::SubmittedAgain(round);
                return Ok(Finished { silent, outcome });
            }
            // More surfaces may be drawn once these are there: the next turn sees them.
            let whole =
                RunOptions { selection: Selection::Shard(Shard::WHOLE), ..options.run.clone() };
            if self.run(&whole, stop)?.outcome.computed.is_empty() {
                break;
            }
        }
        let report = self.run(&options.run, stop)?;
        let is_whole = !report.outcome.interrupted && !report.outcome.halted;
        let page = match options.report && is_whole {
            true => Some(self.report(&ReportOptions::default())?),
            false => None,
        };
        let outcome = FinishOutcome::Done(Box::new(report), page);
        Ok(Finished { silent, outcome })
    }

    /// The elements that have something to do which has not failed, and the seconds of one core that
    /// it is expected to take.
    fn left(&self, elements: u32) -> Result<(Vec<u32>, f64), SessionError> {
        let SampledStudy { study, plan, .. } = &self.sampled()?;
        let missing = runner::missing(plan, &self.data.open_read_only()?);
        let own = receipts::read(&self.data.receipts_of(&study.name))?;
        let untried = without_failed(plan, &missing, &own);
        let cost = measured(&self.all_receipts()?);
        Ok(sizing::shards_of(plan, &untried, &cost, elements))
    }

    fn silent(&self, study: &str, submission: &Submission) -> Result<Vec<u32>, SessionError> {
        let last = submission.submitted.last();
        let Some((Some(array), elements)) = last.map(|round| (round.array, &round.elements)) else {
            return Ok(Vec::new());
        };
        let receipts = receipts::read(&self.data.receipts_of(study))?;
        let told = receipts.iter().filter_map(|receipt| receipt.job.as_deref());
        let told: HashSet<&str> = told.collect();
        let is_silent = |element: &u32| !told.contains(job_name(array, *element).as_str());
        Ok(elements.iter().copied().filter(is_silent).collect())
    }
}

/// The jobs of a study in the queue, by their names.
pub(super) fn queued(study: &str) -> Result<Vec<Queued>, SessionError> {
    Ok(slurm::queue(&[study, &format!("{study}-finish")])?)
}

/// Submits the elements, if there are any, and the job after them, which is told how often something
/// was submitted before.
fn submit_round(folder: &Path, elements: Vec<u32>, round: u32) -> Result<Round, SessionError> {
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

/// The missing tasks but those that have failed, and what reads them. What failed only because a
/// node could store nothing has not been tried.
fn without_failed(plan: &Plan, missing: &[usize], receipts: &[Receipt]) -> Vec<usize> {
    let tried = receipts.iter().filter(|receipt| !receipt.halted);
    let failed = tried.flat_map(|receipt| receipt.failed.iter().map(|failed| failed.task.as_str()));
    let failed: HashSet<&str> = failed.collect();
    if failed.is_empty() {
        return missing.to_vec();
    }
    let mut is_lost = vec![false; plan.tasks.len()];
    // Inputs come before the tasks that read them.
    for &task in missing {
        let planned = &plan.tasks[task];
        is_lost[task] = failed.contains(planned.key.to_string().as_str())
            || planned.inputs.iter().any(|&input| is_lost[input]);
    }
    missing.iter().copied().filter(|&task| !is_lost[task]).collect()
}
