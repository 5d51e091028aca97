//! How far a study has come on a cluster: what the store, the receipts and the queue say.

use std::collections::{BTreeSet, HashMap, HashSet};

use serde::Serialize;

use super::status::StageCount;
use super::submission::{measured, queued};
use super::{SampledStudy, Session, SessionError};
use asperity_pipeline::cluster::receipts;
use asperity_pipeline::cluster::receipts::Receipt;
use asperity_pipeline::cluster::slurm::{Queued, SlurmError};
use asperity_pipeline::cluster::submission::name_of;
use asperity_pipeline::runner;
use asperity_stages::Kind;

pub use asperity_pipeline::cluster::receipts::FailedTask;

/// How far a study has come.
#[derive(Debug, Clone, Serialize)]
pub struct Progress {
    /// Its name.
    pub study: String,
    /// Its stages, in the order of the plan.
    pub stages: Vec<StageProgress>,
    /// Core-hours that shards have taken, as their receipts say.
    pub core_hours_spent: f64,
    /// Core-hours that everything missing is expected to take.
    pub core_hours_left: f64,
    /// Hours until it is done, if as many cores go on as are at work now.
    pub hours_left: Option<f64>,
    /// Cores at work on shards.
    pub cores: usize,
    /// Jobs in the queue; none where there is no Slurm.
    pub queue: Option<Queue>,
    /// Why elements have failed, the latest first.
    pub failures: Vec<FailedTask>,
}

/// Jobs of a study in the queue.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Queue {
    /// Elements that run.
    pub running: usize,
    /// Elements that wait.
    pub waiting: usize,
    /// Why they wait, in words of Slurm's.
    pub reasons: BTreeSet<String>,
    /// The job that finishes, and what it does.
    pub finish: Option<String>,
}

/// How far a stage has come: how many of its tasks are …
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StageProgress {
    /// Its name.
    pub name: String,
    /// What it does.
    pub kind: Kind,
    /// … in the store …
    pub done: usize,
    /// … under way …
    pub running: usize,
    /// … still to come …
    pub waiting: usize,
    /// … tried in vain.
    pub failed: usize,
}

impl Progress {
    /// Whether nothing more will happen by itself: all is done, or nobody is at work or in the queue.
    pub fn is_over(&self) -> bool {
        let is_queued = |queue: &Queue| queue.running + queue.waiting > 0 || queue.finish.is_some();
        self.cores == 0 && !self.queue.as_ref().is_some_and(is_queued)
    }
}

impl Session<'_> {
    /// How far the study has come, wherever it is computed. Nothing is written.
    ///
    /// # Errors
    /// As [`Session::status`], or when Slurm is here and does not answer.
    pub fn progress(&self) -> Result<Progress, SessionError> {
        let SampledStudy { study, plan, .. } = &self.sampled()?;
        let missing = runner::missing(plan, &self.data.look()?);
        let queue = self.own_queue(&study.name)?;
        let own = receipts::read(&self.data.receipts_of(&study.name))?;
        let at_work = at_work(&own, queue.as_deref());
        let places: HashMap<String, usize> =
            missing.iter().map(|&task| (plan.tasks[task].key.to_string(), task)).collect();
        let place = |key: &String| places.get(key).copied();
        let under_way = at_work.iter().flat_map(|receipt| &receipt.under_way);
        let running: HashSet<usize> = under_way.filter_map(place).collect();
        let in_vain = own.iter().filter(|receipt| !receipt.halted);
        let in_vain = in_vain.flat_map(|receipt| &receipt.failed);
        let failed = in_vain.filter_map(|failed| place(&failed.task));
        let failed: HashSet<usize> = failed.filter(|task| !running.contains(task)).collect();
        let stages = StageCount::all(plan, &missing).into_iter().map(|count| {
            let among = |tasks: &HashSet<usize>| {
                let own = count.stage.tasks.iter();
                own.filter(|task| tasks.contains(task)).count()
            };
            let (running, failed) = (among(&running), among(&failed));
            StageProgress {
                name: count.stage.name.clone(),
                kind: count.stage.kind,
                done: count.cached,
                running,
                waiting: count.to_run - running - failed,
                failed,
            }
        });
        let cores: usize = at_work.iter().map(|receipt| receipt.threads).sum();
        let cost = measured(&self.all_receipts()?);
        let core_hours_left = cost.seconds_of(plan, &missing) / 3600.0;
        let seconds = own.iter().fold(0.0, |sum, receipt| sum + receipt.seconds);
        let failures = own.iter().rev().flat_map(|receipt| receipt.failed.clone());
        Ok(Progress {
            study: study.name.clone(),
            stages: stages.collect(),
            core_hours_spent: seconds / 3600.0,
            core_hours_left,
            hours_left: (cores > 0).then(|| core_hours_left / cores as f64),
            cores,
            queue: queue.map(|queue| Queue::of(&queue)),
            failures: failures.filter(|failed| place(&failed.task).is_some()).collect(),
        })
    }

    /// The study's jobs in the queue; none where there is no Slurm.
    fn own_queue(&self, study: &str) -> Result<Option<Vec<Queued>>, SessionError> {
        let own = self.submitted_jobs()?;
        if own.is_empty() {
            return Ok(None);
        }
        match queued(study) {
            Err(SessionError::Slurm(SlurmError::NotHere { .. })) => Ok(None),
            queued => {
                let mut queued = queued?;
                queued.retain(|queued| own.contains(&queued.array));
                Ok(Some(queued))
            }
        }
    }
}

impl Queue {
    fn of(queue: &[Queued]) -> Queue {
        let mut counts = Queue::default();
        for queued in queue {
            match (queued.element, queued.is_running()) {
                (None, true) => counts.finish = Some("runs".to_owned()),
                (None, false) => counts.finish = Some("waits".to_owned()),
                (Some(_), true) => counts.running += 1,
                (Some(_), false) => {
                    counts.waiting += 1;
                    counts.reasons.insert(queued.reason.clone());
                }
            }
        }
        counts.reasons.retain(|reason| !matches!(reason.as_str(), "" | "None"));
        counts
    }
}

/// The receipts of processes that are at work: of an element, while it runs in the queue.
fn at_work<'a>(receipts: &'a [Receipt], queue: Option<&[Queued]>) -> Vec<&'a Receipt> {
    let runs = |name: &String| {
        queue.is_none_or(|queue| {
            let running = queue.iter().filter(|queued| queued.is_running());
            let mut names =
                running.filter_map(|queued| Some(name_of(queued.array, queued.element?)));
            names.any(|running| running == *name)
        })
    };
    let mut latest: HashMap<&str, u64> = HashMap::new();
    for receipt in receipts {
        if let Some(job) = &receipt.job {
            let begun = latest.entry(job).or_default();
            *begun = receipt.begun.max(*begun);
        }
    }
    // An element that was begun again has the receipt of its death still.
    let is_latest = |receipt: &Receipt| {
        let job = receipt.job.as_deref();
        job.is_none_or(|job| latest.get(job) == Some(&receipt.begun))
    };
    let receipts = receipts.iter().filter(|receipt| receipt.may_be_at_work());
    receipts.filter(|receipt| is_latest(receipt) && receipt.job.as_ref().is_none_or(runs)).collect()
}
