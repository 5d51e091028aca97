//! What a study has, what it would compute, why, and at what cost.
//!
//! [`Status`] looks at the store and the record of the last run; [`Progress`] also at the receipts
//! and the queue of a cluster.

use std::collections::{BTreeSet, HashMap, HashSet};

use bytesize::ByteSize;
use serde::{Serialize, Serializer};

use super::submission::{measured, queued};
use super::{Session, SessionError};
use asperity_contact::threads::Threads;
use asperity_pipeline::adaptive_sampling::SampledStudy;
use asperity_pipeline::cluster::receipts::{self, Receipt};
use asperity_pipeline::cluster::slurm::{Queued, SlurmError};
use asperity_pipeline::cluster::submission::job_name;
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::forecast::{self, memory};
use asperity_pipeline::plan::reasons::changes::Cause;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::plan::reasons::{Group, Reasons};
use asperity_pipeline::plan::{Kind, Plan, PlannedStage};
use asperity_pipeline::runner;
use asperity_pipeline::study::Warning;
use asperity_tables::store::Store;
use asperity_tables::table::{Table, TableError};

pub use asperity_pipeline::adaptive_sampling::{AdaptiveStage, Condition, Finding};
pub use asperity_pipeline::cluster::receipts::FailedTask;
pub use asperity_pipeline::plan::reasons::changes::{Change, Field, Shown, Why};

/// A plan beside the store and the last run.
#[derive(Debug)]
pub struct Status {
    /// What should be known of the study before it is run.
    pub warnings: Vec<Warning>,
    pub plan: Plan,
    /// The tasks that the store lacks.
    pub missing: Vec<usize>,
    /// The stages whose number of surfaces is not given.
    pub adaptive: Vec<AdaptiveStage>,
    reasons: Reasons,
    cost: CostModel,
}

/// How much of a stage there is, and why the rest would run.
#[derive(Debug, Serialize)]
pub struct StageStatus<'a> {
    /// The stage, and how many of its tasks are in the store.
    #[serde(flatten)]
    pub count: StageCount<'a>,
    /// Its missing tasks, by what makes them run.
    pub reasons: Vec<Reason<'a>>,
    /// Seconds of one core that they are expected to take.
    #[serde(rename = "core_hours", serialize_with = "in_hours")]
    pub seconds: f64,
}

/// Missing tasks of one stage that would run for the same causes.
#[derive(Debug, Serialize)]
pub struct Reason<'a> {
    pub tasks: usize,
    /// Seconds of one core that they are expected to take.
    #[serde(rename = "core_hours", serialize_with = "in_hours")]
    pub seconds: f64,
    /// What happened, in this stage and in those that it depends on.
    pub causes: Vec<NamedCause<'a>>,
    #[serde(skip)]
    stage: &'a str,
}

/// One thing that makes tasks run, and the stage where it happened.
#[derive(Debug, Serialize)]
pub struct NamedCause<'a> {
    pub stage: &'a str,
    /// What happened there.
    #[serde(flatten)]
    pub why: &'a Why,
}

/// How much of one stage is finished.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct StageCount<'a> {
    pub name: &'a str,
    pub kind: Kind,
    /// Its tasks, as the plan numbers them.
    #[serde(skip)]
    pub tasks: &'a [usize],
    /// Its tasks that are finished.
    pub cached: usize,
    /// Its tasks that are not.
    pub to_run: usize,
}

/// A stage whose number of surfaces is not given.
#[derive(Debug, Serialize)]
pub struct GrowingStage<'a> {
    pub name: &'a str,
    /// How many surfaces a point has.
    pub surfaces: u32,
    /// How many it has at most.
    pub at_most: u32,
    /// Until when there will be more.
    pub until: String,
    /// Whether that is reached, once it can be told.
    pub holds: Option<bool>,
    /// The claims that are not decided, once that can be told.
    pub undecided: Option<Vec<&'static str>>,
}

impl<'a> StageCount<'a> {
    /// How much of each stage of a plan is finished; `missing` ascend.
    pub fn all(plan: &'a Plan, missing: &[usize]) -> Vec<StageCount<'a>> {
        let count = |stage: &'a PlannedStage| {
            let is_missing = |task: &&usize| missing.binary_search(task).is_ok();
            let to_run = stage.tasks.iter().filter(is_missing).count();
            StageCount {
                name: &stage.name,
                kind: stage.kind,
                tasks: &stage.tasks,
                cached: stage.tasks.len() - to_run,
                to_run,
            }
        };
        plan.stages.iter().map(count).collect()
    }

    /// How many of these tasks, which ascend, are the stage's.
    pub fn among(&self, tasks: &[usize]) -> usize {
        self.tasks.iter().filter(|task| tasks.binary_search(task).is_ok()).count()
    }
}

impl<'a> GrowingStage<'a> {
    /// The stages of a study whose number of surfaces is not given.
    pub fn all(stages: &'a [AdaptiveStage]) -> Vec<GrowingStage<'a>> {
        let growing = |stage: &'a AdaptiveStage| GrowingStage {
            name: &stage.name,
            surfaces: stage.surfaces,
            at_most: stage.growth.at_most,
            until: stage.growth.until.to_string(),
            holds: stage.holds(),
            undecided: stage.undecided(),
        };
        stages.iter().map(growing).collect()
    }
}

impl Reason<'_> {
    /// Its causes, each in a phrase, as one reads it who reads of the stage.
    pub fn phrases(&self) -> Vec<String> {
        let phrase = |cause: &NamedCause| match cause.stage == self.stage {
            true => cause.why.to_string(),
            false => format!("upstream `{}`: {}", cause.stage, cause.why),
        };
        self.causes.iter().map(phrase).collect()
    }
}

/// How cores are shared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sharing {
    /// Tasks that can be worked on at once.
    pub at_once: usize,
    /// The most cores that one of them can use.
    pub each: usize,
}

impl Status {
    /// Looks at the store and the study's record, and writes nothing.
    pub(super) fn of(sampled: SampledStudy, store: &Store, record: Option<&Record>) -> Status {
        let SampledStudy { study, plan, stages } = sampled;
        let missing = runner::missing(&plan, store);
        let now = Record::new(&study, &plan, &missing);
        Status {
            warnings: study.warnings(),
            reasons: Reasons::new(&plan, &now, record, &missing, store),
            plan,
            adaptive: stages,
            missing,
            cost: CostModel::default(),
        }
    }

    /// Every stage, in the order of the plan.
    pub fn stages(&self) -> Vec<StageStatus<'_>> {
        let counts = StageCount::all(&self.plan, &self.missing).into_iter();
        let stages = counts.zip(&self.reasons.stages);
        stages
            .map(|(count, groups)| {
                let reasons: Vec<Reason> =
                    groups.iter().map(|group| self.reason(group, count.name)).collect();
                let seconds = reasons.iter().map(|reason| reason.seconds).sum();
                StageStatus { count, reasons, seconds }
            })
            .collect()
    }

    fn reason<'a>(&'a self, group: &'a Group, stage: &'a str) -> Reason<'a> {
        let named = |cause: &'a Cause| NamedCause {
            stage: &self.plan.stages[cause.stage].name,
            why: &cause.why,
        };
        Reason {
            tasks: group.tasks.len(),
            seconds: self.cost.seconds_of(&self.plan, &group.tasks),
            causes: group.causes.iter().map(named).collect(),
            stage,
        }
    }

    /// Seconds of one core that everything missing is expected to take: a task of two stages
    /// counts once.
    pub fn total_seconds(&self) -> f64 {
        self.cost.seconds_of(&self.plan, &self.missing)
    }

    /// How many of so many cores will share a surface.
    pub fn sharing(&self, cores: usize) -> Sharing {
        let counts = StageCount::all(&self.plan, &self.missing);
        let at_once = counts.iter().map(|count| count.to_run).max();
        let solved = self.missing.iter().map(|&task| &self.plan.tasks[task]);
        let solved = solved.filter(|task| task.recipe.kind() == Kind::Solve);
        let meshes = solved.map(|task| task.nodes[0] * task.nodes[1]);
        let each = meshes.map(Threads::worthwhile).max().unwrap_or(1);
        Sharing { at_once: at_once.unwrap_or(0).clamp(1, cores), each: each.min(cores) }
    }

    /// The least memory that computing everything missing takes: the program, and the largest task.
    pub fn least_memory(&self) -> ByteSize {
        memory::PROGRAM + memory::of_largest(&self.plan, &self.missing)
    }

    /// Its tasks one by one, a row each: stage, key, whether it is there, seconds of one core, and
    /// what places it in the study.
    pub fn tasks(&self) -> impl Iterator<Item = Result<Table, TableError>> {
        forecast::worklist(&self.plan, &self.missing, &self.cost)
    }
}

/// How far a study has come.
#[derive(Debug, Clone, Serialize)]
pub struct Progress {
    pub study: String,
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
    pub name: String,
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
        let missing = runner::missing(plan, &self.data.open_read_only()?);
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
                let own = count.tasks.iter();
                own.filter(|task| tasks.contains(task)).count()
            };
            let (running, failed) = (among(&running), among(&failed));
            StageProgress {
                name: count.name.to_owned(),
                kind: count.kind,
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
            Err(SessionError::Slurm(SlurmError::NotInstalled { .. })) => Ok(None),
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
                running.filter_map(|queued| Some(job_name(queued.array, queued.element?)));
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
    let receipts = receipts.iter().filter(|receipt| receipt.may_be_running());
    receipts.filter(|receipt| is_latest(receipt) && receipt.job.as_ref().is_none_or(runs)).collect()
}

/// Seconds as hours.
pub(super) fn in_hours<S: Serializer>(seconds: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(seconds / 3600.0)
}
