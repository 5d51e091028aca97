//! What a study has, what it would compute, why, and at what cost.

use bytesize::ByteSize;

use asperity_contact::threads::Threads;
use asperity_pipeline::adaptive_sampling::SampledStudy;
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::forecast::memory;
use asperity_pipeline::plan::reasons::Reasons;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::plan::{Kind, Plan, PlannedStage};
use asperity_pipeline::study::Warning;
use asperity_pipeline::{forecast, runner};
use asperity_tables::store::Store;
use asperity_tables::table::{Table, TableError};

pub use asperity_pipeline::adaptive_sampling::{AdaptiveStage, Condition, Finding};
pub use asperity_pipeline::plan::reasons::Group;
pub use asperity_pipeline::plan::reasons::changes::{Cause, Change, Field, Shown, Why};

/// A plan beside the store and the last run.
#[derive(Debug)]
pub struct Status {
    /// What should be known of the study before it is run.
    pub warnings: Vec<Warning>,
    /// Its tasks.
    pub plan: Plan,
    /// The tasks that the store lacks.
    pub missing: Vec<usize>,
    /// The stages whose number of surfaces is not given.
    pub adaptive: Vec<AdaptiveStage>,
    reasons: Reasons,
    cost: CostModel,
}

/// How much of a stage there is, and why the rest would run.
#[derive(Debug)]
pub struct StageStatus<'a> {
    /// The stage, and how many of its tasks are in the store.
    pub count: StageCount<'a>,
    /// Its missing tasks, by what makes them run.
    pub groups: &'a [Group],
    /// Seconds of one core that they are expected to take.
    pub seconds: f64,
}

/// How much of one stage is finished.
#[derive(Debug, Clone, Copy)]
pub struct StageCount<'a> {
    /// The stage.
    pub stage: &'a PlannedStage,
    /// Its tasks that are finished.
    pub cached: usize,
    /// Its tasks that are not.
    pub to_run: usize,
}

impl<'a> StageCount<'a> {
    /// How much of each stage of a plan is finished; `missing` ascend.
    pub fn all(plan: &'a Plan, missing: &[usize]) -> Vec<StageCount<'a>> {
        let count = |stage: &'a PlannedStage| {
            let is_missing = |task: &&usize| missing.binary_search(task).is_ok();
            let to_run = stage.tasks.iter().filter(is_missing).count();
            StageCount { stage, cached: stage.tasks.len() - to_run, to_run }
        };
        plan.stages.iter().map(count).collect()
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
        let now = Record::of(&study, &plan, &missing);
        Status {
            warnings: study.warnings(),
            reasons: Reasons::of(&plan, &now, record, &missing, store),
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
            .map(|(count, groups)| StageStatus {
                count,
                groups,
                seconds: groups.iter().map(|group| self.seconds(group)).sum(),
            })
            .collect()
    }

    /// Seconds of one core that a group of tasks is expected to take.
    pub fn seconds(&self, group: &Group) -> f64 {
        self.cost.seconds_of(&self.plan, &group.tasks)
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

    /// A cause in a phrase, as one of this stage reads it.
    pub fn told(&self, cause: &Cause, stage: &str) -> String {
        let origin = self.origin(cause);
        match origin == stage {
            true => cause.why.to_string(),
            false => format!("upstream `{origin}`: {}", cause.why),
        }
    }

    /// The name of the stage where something happened.
    pub fn origin(&self, cause: &Cause) -> &str {
        &self.plan.stages[cause.stage].name
    }

    /// Its tasks one by one, a row each: stage, key, whether it is there, seconds of one core, and
    /// what places it in the study.
    pub fn tasks(&self) -> impl Iterator<Item = Result<Table, TableError>> {
        forecast::worklist(&self.plan, &self.missing, &self.cost)
    }
}
