//! What comes after the elements of a submission.

use std::collections::HashSet;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};

use super::submission::{measured, submit_round};
use super::{
    Report, ReportOptions, RunOptions, RunReport, SampledStudy, Selection, Session, SessionError,
    report,
};
use asperity_pipeline::cluster::receipts;
use asperity_pipeline::cluster::receipts::Receipt;
use asperity_pipeline::cluster::shard::Shard;
use asperity_pipeline::cluster::sizing;
use asperity_pipeline::cluster::submission::{Round, Submission, name_of};
use asperity_pipeline::plan::Plan;
use asperity_pipeline::runner;

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
    /// What it did.
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
            true => Some(report::write(self, &ReportOptions::default())?),
            false => None,
        };
        let outcome = FinishOutcome::Done(Box::new(report), page);
        Ok(Finished { silent, outcome })
    }

    /// The elements that have something to do which has not failed, and the seconds of one core that
    /// it is expected to take.
    fn left(&self, elements: u32) -> Result<(Vec<u32>, f64), SessionError> {
        let SampledStudy { study, plan, .. } = &self.sampled()?;
        let missing = runner::missing(plan, &self.data.look()?);
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
        let is_silent = |element: &u32| !told.contains(name_of(array, *element).as_str());
        Ok(elements.iter().copied().filter(is_silent).collect())
    }
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
