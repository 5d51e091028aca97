//! Finished and missing tasks of a study, with reasons and costs.
//!
//! [`Status`] reads the store and the record of the last run; `Progress` also reads the receipts
//! and the queue of a cluster.

use std::collections::{BTreeSet, HashMap, HashSet};

use bytesize::ByteSize;
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::submission::{measured, queued};
use super::{Session, SessionError};
use asperity_mechanics::threads::Threads;
use asperity_pipeline::adaptive_sampling::SampledStudy;
use asperity_pipeline::cluster::receipts::{self, Receipt};
use asperity_pipeline::cluster::slurm::{Queued, SlurmError};
use asperity_pipeline::cluster::submission::job_name;
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::forecast::remaining::Remaining;
use asperity_pipeline::forecast::{self, memory};
use asperity_pipeline::plan::reasons::changes::Cause;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::plan::reasons::{Group, Reasons};
use asperity_pipeline::plan::sources::Sources;
use asperity_pipeline::plan::{Kind, Plan, PlannedStage};
use asperity_pipeline::runner;
use asperity_pipeline::study::{StageSummary, Warning};
use asperity_tables::store::Store;
use asperity_tables::table::{Table, TableError};

pub use asperity_pipeline::adaptive_sampling::{AdaptiveStage, Condition, Finding, MeshSurfaces};
pub use asperity_pipeline::cluster::receipts::FailedTask;
pub use asperity_pipeline::plan::reasons::changes::{Change, Field, Shown, Why};
pub use asperity_pipeline::plan::sources::TasksFromStore;

/// Plan of a study compared with the store and the last run.
#[derive(Debug)]
#[non_exhaustive]
pub struct Status {
    /// Warnings about the study and its stages.
    pub warnings: Vec<Warning>,
    /// Surfaces and loads of the stages.
    pub(crate) summaries: Vec<StageSummary>,
    pub plan: Plan,
    /// Indices of tasks that are not in the store, ascending.
    pub missing: Vec<usize>,
    /// State of the stages with adaptive sampling.
    pub(crate) adaptive: Vec<AdaptiveStage>,
    sources: Sources,
    reasons: Reasons,
    cost: CostModel,
}

/// Finished and missing tasks of a stage, with the reasons.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct StageStatus<'a> {
    /// Name of the stage and numbers of its tasks.
    #[serde(flatten)]
    pub count: StageCount<'a>,
    /// Read-only stores from which tables of finished tasks are read.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) stores: Vec<TasksFromStore>,
    /// Missing tasks, grouped by reason.
    pub reasons: Vec<Reason<'a>>,
    /// Expected core-seconds of the missing tasks.
    #[serde(rename = "core_hours", serialize_with = "in_hours")]
    pub seconds: f64,
}

/// Missing tasks of one stage that run for the same causes.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct Reason<'a> {
    pub tasks: usize,
    /// Number of rows that these tasks compute; `None` if they compute whole tables.
    pub(crate) rows: Option<usize>,
    /// Descriptions of these rows, one for each way in which they are computed.
    pub(crate) remaining: Vec<String>,
    /// Expected core-seconds of these tasks.
    #[serde(rename = "core_hours", serialize_with = "in_hours")]
    pub seconds: f64,
    /// Changes that make these tasks run, in this stage or in stages that it depends on.
    pub(crate) causes: Vec<NamedCause<'a>>,
    #[serde(skip)]
    stage: &'a str,
}

/// Cause that makes tasks run, with the stage where it occurred.
#[derive(Debug, Serialize)]
pub(crate) struct NamedCause<'a> {
    pub(crate) stage: &'a str,
    #[serde(flatten)]
    pub(crate) why: &'a Why,
}

/// Numbers of finished and missing tasks of a stage.
#[derive(Debug, Clone, Copy, Serialize)]
#[non_exhaustive]
pub struct StageCount<'a> {
    pub name: &'a str,
    pub kind: Kind,
    /// Indices of the stage's tasks in the plan.
    #[serde(skip)]
    pub tasks: &'a [usize],
    /// Number of tasks that are in the store.
    pub cached: usize,
    /// Number of tasks that are not in the store.
    pub to_run: usize,
}

impl<'a> StageCount<'a> {
    /// Counts the tasks of each stage of a plan; `missing` must be sorted.
    pub(crate) fn all(plan: &'a Plan, missing: &[usize]) -> Vec<StageCount<'a>> {
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

    /// Returns the number of the given tasks that belong to the stage; `tasks` must be sorted.
    pub(crate) fn among(&self, tasks: &[usize]) -> usize {
        self.tasks.iter().filter(|task| tasks.binary_search(task).is_ok()).count()
    }
}

/// Returns the JSON output for the adaptive stages of a study. `holds` is null, and so are the
/// `undecided` claims, if the condition cannot be evaluated yet.
pub(crate) fn growing(stages: &[AdaptiveStage]) -> Vec<Value> {
    let growing = stages.iter().map(|stage| {
        let mut growing = json!({
            "name": stage.name,
            "surfaces": stage.surfaces,
            "at_most": stage.growth.at_most,
            "until": stage.growth.until.to_string(),
            "holds": stage.holds(),
            "undecided": stage.undecided(),
        });
        if !stage.meshes.is_empty() {
            let mesh =
                |mesh: &MeshSurfaces| json!({ "nodes": mesh.nodes, "surfaces": mesh.surfaces });
            growing["meshes"] = stage.meshes.iter().map(mesh).collect();
        }
        growing
    });
    growing.collect()
}

impl Reason<'_> {
    /// Returns a phrase for each cause; causes in earlier stages begin with the
    /// name of the stage.
    pub fn phrases(&self) -> Vec<String> {
        let phrase = |cause: &NamedCause| {
            if cause.stage == self.stage {
                cause.why.to_string()
            } else {
                format!("earlier stage `{}`: {}", cause.stage, cause.why.brief())
            }
        };
        self.causes.iter().map(phrase).collect()
    }
}

impl Status {
    /// Compares the plan with the store and the record of the last run.
    pub(super) fn new(sampled: SampledStudy, store: &Store, record: Option<&Record>) -> Status {
        let SampledStudy { study, plan, stages } = sampled;
        let missing = runner::missing(&plan, store);
        let now = Record::new(&study, &plan, &missing);
        Status {
            warnings: study.warnings(),
            summaries: study.summaries(),
            reasons: Reasons::new(&plan, &now, record, &missing, store),
            cost: CostModel::default().for_remaining(Remaining::new(&plan, &missing, store)),
            sources: Sources::new(&plan, &missing, store),
            plan,
            adaptive: stages,
            missing,
        }
    }

    /// Returns the status of every stage, in the order of the plan.
    pub fn stages(&self) -> Vec<StageStatus<'_>> {
        let counts = StageCount::all(&self.plan, &self.missing).into_iter();
        let stages = counts.zip(&self.plan.stages).zip(&self.reasons.stages);
        stages
            .map(|((count, planned), groups)| {
                let reasons: Vec<Reason> =
                    groups.iter().map(|group| self.reason(group, count.name)).collect();
                let seconds = reasons.iter().map(|reason| reason.seconds).sum();
                StageStatus { count, stores: self.sources.of_stage(planned), reasons, seconds }
            })
            .collect()
    }

    fn reason<'a>(&'a self, group: &'a Group, stage: &'a str) -> Reason<'a> {
        let named = |cause: &'a Cause| NamedCause {
            stage: &self.plan.stages[cause.stage].name,
            why: &cause.why,
        };
        let remaining = self.cost.remaining();
        let kind = self.plan.tasks[group.tasks[0]].recipe.kind();
        Reason {
            tasks: group.tasks.len(),
            rows: remaining.rows(&self.plan, &group.tasks),
            remaining: remaining.phrases(&self.plan, kind, &group.tasks),
            seconds: self.cost.seconds_of(&self.plan, &group.tasks),
            causes: group.causes.iter().map(named).collect(),
            stage,
        }
    }

    /// Returns the expected core-seconds of all missing tasks; a task that belongs to two stages
    /// counts once.
    pub fn total_seconds(&self) -> f64 {
        self.cost.seconds_of(&self.plan, &self.missing)
    }

    /// Returns how a run would distribute the given number of cores: the largest number of parallel
    /// tasks, and that of cores per task.
    pub(crate) fn core_distribution(&self, cores: usize) -> (usize, usize) {
        let counts = StageCount::all(&self.plan, &self.missing);
        let at_once = counts.iter().map(|count| count.to_run).max();
        let missing = self.missing.iter().map(|&task| &self.plan.tasks[task]);
        let solved = missing.filter(|task| task.recipe.kind() == Kind::Solve);
        // The loads of a surface are solved in parallel, unless they are a path, and so are the
        // parts of a large mesh.
        let useful = solved.map(|task| {
            let rows = if task.table.series.is_some() { task.rows } else { 1 };
            Threads::useful_for(task.nodes[0] * task.nodes[1]).max(rows)
        });
        let each = useful.max().unwrap_or(1);
        (at_once.unwrap_or(0).clamp(1, cores), each.min(cores))
    }

    /// Returns the minimum memory of a run: the program plus the largest missing task.
    pub fn least_memory(&self) -> ByteSize {
        memory::PROGRAM + memory::of_largest(&self.plan, &self.missing)
    }

    /// Lists the tasks in tables with a row for each task: stage, key, state, expected
    /// core-seconds, read-only store if there is any, and parameters.
    pub(crate) fn tasks(&self) -> impl Iterator<Item = Result<Table, TableError>> {
        forecast::worklist(&self.plan, &self.missing, &self.cost, &self.sources)
    }
}

/// Progress of a study on all machines.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Progress {
    pub(crate) study: String,
    pub(crate) stages: Vec<StageProgress>,
    /// Core-hours used by shards, from their receipts.
    pub(crate) core_hours_spent: f64,
    /// Expected core-hours of the missing tasks.
    pub(crate) core_hours_left: f64,
    /// Expected hours until the end on the cores in use; `None` if no core is in use.
    pub(crate) hours_left: Option<f64>,
    /// Number of cores that compute shards now.
    pub(crate) cores: usize,
    /// Jobs of the study in the queue. `None` if the study was not submitted or Slurm is not
    /// installed.
    pub(crate) queue: Option<Queue>,
    /// Failed tasks of array elements, newest first.
    pub(crate) failures: Vec<FailedTask>,
}

/// Jobs of a study in the queue.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Queue {
    /// Number of running array elements.
    pub(crate) running: usize,
    /// Number of waiting array elements.
    pub(crate) waiting: usize,
    /// Reasons for waiting, as Slurm reports them.
    pub(crate) reasons: BTreeSet<String>,
    /// State of the last job, `runs` or `waits`, if it is in the queue.
    pub(crate) finish: Option<String>,
}

/// Numbers of the tasks of a stage by state.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct StageProgress {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    /// Number of tasks in the store.
    pub(crate) done: usize,
    /// Number of tasks that are running now.
    pub(crate) running: usize,
    /// Number of tasks that have not started.
    pub(crate) waiting: usize,
    /// Number of tasks that have failed.
    pub(crate) failed: usize,
    /// Read-only stores from which tables of finished tasks are read.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) stores: Vec<TasksFromStore>,
}

impl Progress {
    /// Returns whether no process is running and no job is in the queue.
    pub(crate) fn is_over(&self) -> bool {
        let is_queued = |queue: &Queue| queue.running + queue.waiting > 0 || queue.finish.is_some();
        self.cores == 0 && !self.queue.as_ref().is_some_and(is_queued)
    }
}

impl Session<'_> {
    /// Returns the progress of the study on this machine and on the cluster, without writing
    /// anything.
    ///
    /// # Errors
    /// Returns the same errors as [`Session::status`], and an error if Slurm is installed but does
    /// not answer.
    pub(crate) fn progress(&self) -> Result<Progress, SessionError> {
        let (SampledStudy { study, plan, .. }, store) = &self.sampled()?;
        let missing = runner::missing(plan, store);
        let sources = Sources::new(plan, &missing, store);
        let queue = self.own_queue(&study.name)?;
        let own = receipts::read(&self.data.receipts_of(&study.name))?;
        let at_work = at_work(&own, queue.as_deref());
        let indices: HashMap<String, usize> =
            missing.iter().map(|&task| (plan.tasks[task].table.key.to_string(), task)).collect();
        let index = |key: &String| indices.get(key).copied();
        let under_way = at_work.iter().flat_map(|receipt| &receipt.under_way);
        let running: HashSet<usize> = under_way.filter_map(index).collect();
        let counted = own.iter().filter(|receipt| !receipt.halted);
        let tried = counted.flat_map(|receipt| &receipt.failed).filter_map(|one| index(&one.task));
        let failed: HashSet<usize> = tried.filter(|task| !running.contains(task)).collect();
        let counts = StageCount::all(plan, &missing).into_iter().zip(&plan.stages);
        let stages = counts.map(|(count, planned)| {
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
                stores: sources.of_stage(planned),
            }
        });
        let cores: usize = at_work.iter().map(|receipt| receipt.threads).sum();
        let remaining = Remaining::new(plan, &missing, store);
        let cost = measured(&self.all_receipts()?).for_remaining(remaining);
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
            queue: queue.map(|queue| Queue::from_jobs(&queue)),
            failures: failures.filter(|failed| index(&failed.task).is_some()).collect(),
        })
    }

    /// Returns the submitted jobs of the study that are in the queue. Returns `None` if no job was
    /// submitted or Slurm is not installed.
    fn own_queue(&self, study: &str) -> Result<Option<Vec<Queued>>, SessionError> {
        let own = self.submitted_jobs()?;
        if own.is_empty() {
            return Ok(None);
        }
        match queued(study) {
            Err(SessionError::Slurm(SlurmError::NotInstalled { .. })) => Ok(None),
            answer => {
                let mut queued = answer?;
                queued.retain(|queued| own.contains(&queued.array));
                Ok(Some(queued))
            }
        }
    }
}

impl Queue {
    fn from_jobs(queue: &[Queued]) -> Queue {
        let mut counts = Queue::default();
        for queued in queue {
            match (queued.element, queued.is_running()) {
                (None, true) => counts.finish = Some("runs".to_owned()),
                (None, false) => counts.finish = Some("waits".to_owned()),
                (Some(_), true) => counts.running += 1,
                (Some(_), false) => counts.waiting += 1,
            }
            if !queued.is_running() {
                counts.reasons.insert(queued.reason.clone());
            }
        }
        // The last job always waits for the array.
        counts.reasons.retain(|reason| !matches!(reason.as_str(), "" | "None" | "Dependency"));
        counts
    }
}

/// Returns the receipts of processes that may be running. Of an array element, only the latest
/// receipt counts, and only if `queue` (where it is known) lists the element as running.
fn at_work<'a>(receipts: &'a [Receipt], queue: Option<&[Queued]>) -> Vec<&'a Receipt> {
    let listed = queue.map(|queue| -> HashSet<String> {
        let running = queue.iter().filter(|queued| queued.is_running());
        running.filter_map(|queued| Some(job_name(queued.array, queued.element?))).collect()
    });
    let runs = |name: &String| listed.as_ref().is_none_or(|listed| listed.contains(name));
    let mut latest: HashMap<&str, u64> = HashMap::new();
    for receipt in receipts {
        if let Some(job) = &receipt.job {
            let begun = latest.entry(job).or_default();
            *begun = receipt.begun.max(*begun);
        }
    }
    // A restarted element still has the receipt of its previous start.
    let is_latest = |receipt: &Receipt| {
        let job = receipt.job.as_deref();
        job.is_none_or(|job| latest.get(job) == Some(&receipt.begun))
    };
    let running = receipts.iter().filter(|receipt| receipt.may_be_running());
    running.filter(|receipt| is_latest(receipt) && receipt.job.as_ref().is_none_or(runs)).collect()
}

/// Serializes a number of seconds, which may be unknown, as hours.
pub(super) fn in_hours<S: Serializer>(
    seconds: &(impl Into<Option<f64>> + Copy),
    serializer: S,
) -> Result<S::Ok, S::Error> {
    (*seconds).into().map(|seconds| seconds / 3600.0).serialize(serializer)
}
