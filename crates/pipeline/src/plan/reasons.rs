//! Reasons why tasks of a study would run.
//!
//! A new key shows that a task has changed, but not why. The [`Record`] describes the study at its
//! last run. Comparing it with the present study, stage by stage and point by point, shows which
//! parameters were edited. Following the inputs of the tasks then shows which tasks each edit
//! affects.

pub mod changes;
pub mod differences;
pub mod record;

use std::collections::{BTreeSet, HashMap};

use indexmap::{IndexMap, IndexSet};

use changes::{Cause, Field, Shown, StageChanges, Why};
use record::{Record, StageRecord};

use crate::plan::Plan;
use asperity_stages::{InputScope, Kind};
use asperity_tables::store::Store;

/// Reasons why missing tasks would run, by stage.
#[derive(Debug)]
pub struct Reasons {
    pub stages: Vec<Vec<Group>>,
}

/// Missing tasks of one stage that would run for the same causes.
#[derive(Debug)]
pub struct Group {
    /// Changes that make the tasks run, in this stage or in stages that it depends on.
    pub causes: Vec<Cause>,
    pub tasks: Vec<usize>,
}

impl Reasons {
    /// Explains the missing tasks of a plan by comparing the present study (`now`) with the record
    /// of its last run (`before`). The indices in `missing` must be in ascending order.
    pub fn new(
        plan: &Plan,
        now: &Record,
        before: Option<&Record>,
        missing: &[usize],
        store: &Store,
    ) -> Reasons {
        let mut walk = Walk {
            plan,
            now,
            causes: IndexSet::new(),
            passed_on: vec![None; plan.tasks.len()],
            removed: Vec::new(),
            reordered: Vec::new(),
        };
        let counterparts = counterparts(before, now);
        let stages = plan.stages.iter().enumerate().map(|(stage, planned)| {
            let counterpart = counterparts[stage];
            let causes = match before {
                None => vec![walk.add(stage, [Why::FirstRun]); planned.tasks.len()],
                Some(_) => walk.compare(stage, counterpart),
            };
            let mut groups: IndexMap<Causes, Vec<usize>> = IndexMap::new();
            for (&task, mut causes) in planned.tasks.iter().zip(causes) {
                if missing.binary_search(&task).is_err() {
                    continue;
                }
                if causes.is_empty() {
                    causes = walk.without_change(stage, task, counterpart, store);
                }
                groups.entry(causes).or_default().push(task);
            }
            let group = |(causes, tasks): (Causes, _)| Group {
                causes: causes.into_iter().map(|cause| walk.causes[cause].clone()).collect(),
                tasks,
            };
            groups.into_iter().map(group).collect()
        });
        Reasons { stages: stages.collect() }
    }
}

/// Finds, for each stage of `now`, the corresponding stage of `before`.
///
/// It is the stage of the same name, if its kind is the same, too. If no stage has this name, it is
/// the stage of the same kind whose name no longer exists, provided that there is exactly one.
/// Otherwise it is `None`.
fn counterparts<'a>(before: Option<&'a Record>, now: &Record) -> Vec<Option<&'a StageRecord>> {
    let Some(before) = before else {
        return vec![None; now.stages.len()];
    };
    let is_known = |name: &str| now.stages.iter().any(|stage| stage.name == name);
    let renamed = |kind: Kind| {
        let of_kind = before.stages.iter().filter(move |old| old.kind == kind);
        let mut left = of_kind.filter(|old| !is_known(&old.name));
        left.next().filter(|_| left.next().is_none())
    };
    let counterpart = |stage: &StageRecord| {
        let named = before.stages.iter().find(|old| old.name == stage.name);
        match named {
            Some(old) => (old.kind == stage.kind).then_some(old),
            None => renamed(stage.kind),
        }
    };
    now.stages.iter().map(counterpart).collect()
}

/// Indices of causes in [`Walk::causes`].
type Causes = BTreeSet<usize>;

/// Traversal of the stages in the order of the plan. It determines the causes of each task from the
/// changes of its stage and point, and from the causes of its inputs.
struct Walk<'a> {
    plan: &'a Plan,
    now: &'a Record,
    causes: IndexSet<Cause>,
    /// Causes that each task passes on to the tasks that read it, once a stage with it was visited.
    passed_on: Vec<Option<Causes>>,
    /// For each visited stage, what was removed in it and in the stages that it reads: parameter
    /// points, surfaces and inputs.
    removed: Vec<Causes>,
    /// For each visited stage, changes of the order in it and in the stages that it reads.
    reordered: Vec<Causes>,
}

impl Walk<'_> {
    fn add(&mut self, stage: usize, causes: impl IntoIterator<Item = Why>) -> Causes {
        let indices = causes.into_iter().map(|why| Cause { stage, why });
        indices.map(|cause| self.causes.insert_full(cause).0).collect()
    }

    /// Compares the next stage with its earlier version `counterpart`. Returns the causes why each
    /// of its tasks differs from the last run.
    fn compare(&mut self, stage: usize, counterpart: Option<&StageRecord>) -> Vec<Causes> {
        let (plan, record) = (self.plan, &self.now.stages[stage]);
        let changes = StageChanges::between(counterpart, record);
        let to_all = self.add(stage, changes.to_all);
        let mut removed = self.add(stage, changes.removed);
        let mut reordered = self.add(stage, changes.is_reordered.then_some(Why::Reordered));
        let mut added_inputs: HashMap<usize, Causes> = HashMap::new();
        for name in &record.reads {
            let Some(read) = self.now.stages.iter().position(|stage| stage.name == *name) else {
                continue;
            };
            removed.extend(&self.removed[read]);
            reordered.extend(&self.reordered[read]);
            if changes.reads_more.contains(name) {
                let cause = self.add(stage, [Why::ReadsMore { name: name.clone() }]);
                added_inputs.extend(plan.stages[read].tasks.iter().map(|&t| (t, cause.clone())));
            }
        }
        // A surface is drawn once for each measured spectrum, and a recipe is evaluated for each
        // input.
        let sum: u32 = record.points.iter().map(|point| point.realizations).sum();
        let copies = (record.tasks / sum.max(1) as usize).max(1);
        let mut tasks = plan.stages[stage].tasks.iter();
        let mut all = Vec::new();
        for (change, point) in changes.points.into_iter().zip(&record.points) {
            let at_point = &to_all | &self.add(stage, change.why);
            let now = point.realizations;
            let before = change.realizations_before.unwrap_or(now);
            let new = (now > before).then(|| Why::New { fields: realizations(before, now) });
            let beyond = &at_point | &self.add(stage, new);
            let fewer = (now < before).then(|| Why::Fewer { fields: realizations(now, before) });
            removed.append(&mut self.add(stage, fewer));
            // In this order no task is taken beyond the last realization.
            let numbers = (0..now).cycle().take(copies * now as usize);
            for (realization, &task) in numbers.zip(tasks.by_ref()) {
                let mut inherited = Causes::new();
                for input in &plan.tasks[task].inputs {
                    let seen = self.passed_on[*input].as_ref().filter(|seen| !seen.is_empty());
                    inherited
                        .extend(seen.or_else(|| added_inputs.get(input)).into_iter().flatten());
                }
                let own = &inherited | if realization < before { &at_point } else { &beyond };
                let passed_on =
                    if change.keeps_identity { &inherited | &to_all } else { own.clone() };
                // A task of several stages existed before if it existed for any of them.
                if self.passed_on[task].is_none() || passed_on.is_empty() {
                    self.passed_on[task] = Some(passed_on);
                }
                all.push(own);
            }
        }
        self.removed.push(removed);
        self.reordered.push(reordered);
        all
    }

    /// Returns the reason why a task has no table although none of its own inputs has changed.
    /// `counterpart` is the earlier version of its stage.
    fn without_change(
        &mut self,
        stage: usize,
        task: usize,
        counterpart: Option<&StageRecord>,
        store: &Store,
    ) -> Causes {
        let task = &self.plan.tasks[task];
        let scope = task.recipe.input_scope();
        let why = if store.has_damaged(task.table.key) {
            Why::Damaged
        } else if scope != InputScope::Single && !self.removed[stage].is_empty() {
            return self.removed[stage].clone();
        } else if scope == InputScope::All && !self.reordered[stage].is_empty() {
            return self.reordered[stage].clone();
        } else if counterpart.is_some_and(|stage| stage.finished == stage.tasks) {
            Why::Missing
        } else {
            Why::Unfinished
        };
        self.add(stage, [why])
    }
}

fn realizations(from: u32, to: u32) -> Vec<Field> {
    let value = match to.saturating_sub(from) {
        0 | 1 => from.to_string(),
        _ => format!("{from} … {}", to - 1),
    };
    vec![Field { field: "realization".to_owned(), value: Shown(value) }]
}
