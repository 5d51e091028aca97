//! Reasons why tasks of a study would run.
//!
//! A new key shows that a task has changed, but not why. The [`Record`] describes the study at its
//! last run. Comparing it with the present study, stage by stage and point by point, shows which
//! parameters were edited. Following the inputs of the tasks then shows which tasks each edit
//! affects.

pub mod changes;
pub mod differences;
pub mod record;

use std::collections::HashMap;

use changes::{Cause, Field, PointChange, Shown, StageChanges, Why};
use record::{GridPosition, Record, StageRecord};

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
    /// of its last run (`before`).
    pub fn new(
        plan: &Plan,
        now: &Record,
        before: Option<&Record>,
        missing: &[usize],
        store: &Store,
    ) -> Reasons {
        let mut is_missing = vec![false; plan.tasks.len()];
        missing.iter().for_each(|&task| is_missing[task] = true);
        let counterparts = counterparts(before, now);
        let mut walk = Walk::new(plan, now);
        for counterpart in &counterparts {
            match before {
                None => walk.first_run(),
                Some(_) => walk.compare(*counterpart),
            }
        }
        let stages = (0..plan.stages.len()).map(|stage| {
            let tasks = plan.stages[stage].tasks.iter().zip(&walk.own[stage]);
            let mut groups = Groups::default();
            for (&task, &set) in tasks.filter(|(task, _)| is_missing[**task]) {
                let unchanged = (set == EMPTY).then(|| {
                    cause_of_missing(
                        counterparts[stage],
                        store.has_damaged(plan.tasks[task].table.key),
                    )
                });
                groups.add(task, (set, unchanged), |(set, unchanged)| match unchanged {
                    Some(why) => vec![Cause { stage, why }],
                    None => walk.sets.causes(set),
                });
            }
            groups.all
        });
        Reasons { stages: stages.collect() }
    }
}

/// Groups of tasks with the same causes, in the order of their first tasks. `known` has the index
/// of the group of each set of causes.
#[derive(Default)]
struct Groups {
    all: Vec<Group>,
    known: HashMap<(usize, Option<Why>), usize>,
}

impl Groups {
    fn add(
        &mut self,
        task: usize,
        by: (usize, Option<Why>),
        causes: impl FnOnce((usize, Option<Why>)) -> Vec<Cause>,
    ) {
        let next = self.all.len();
        let group = *self.known.entry(by.clone()).or_insert(next);
        if group == next {
            self.all.push(Group { causes: causes(by), tasks: Vec::new() });
        }
        self.all[group].tasks.push(task);
    }
}

/// Returns the reason why a task has no table although its key has not changed. `counterpart` is
/// the earlier version of its stage.
fn cause_of_missing(counterpart: Option<&StageRecord>, is_damaged: bool) -> Why {
    match counterpart {
        _ if is_damaged => Why::Damaged,
        Some(stage) if stage.finished == stage.tasks => Why::Missing,
        _ => Why::Unfinished,
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

/// Traversal of the stages in the order of the plan. It determines the causes of each task from the
/// changes of its stage and point, and from the causes of its inputs.
///
/// A `usize` that stands for a set of causes is an index into [`CauseSets`].
struct Walk<'a> {
    plan: &'a Plan,
    now: &'a Record,
    sets: CauseSets,
    /// Set of causes of each task, by index of the stage and index of the task within the stage.
    own: Vec<Vec<usize>>,
    /// Last visited stage that contains each task, or `None` if no such stage was visited.
    stage_of: Vec<Option<usize>>,
    /// Set of causes that each task passes on to the tasks that read it.
    passed_on: Vec<usize>,
    /// For each task, set of the causes due to realizations that were removed at its parameter
    /// point.
    fewer: Vec<usize>,
    /// For each visited stage, causes due to items that were removed or reordered in it or in the
    /// stages that it reads.
    removals: Vec<Removals>,
}

/// Sets of the causes due to removed or reordered items in a stage and in all stages that it reads,
/// directly or indirectly.
#[derive(Clone, Copy, Default)]
struct Removals {
    /// Set of the causes due to removed parameter points of stages that generate surfaces.
    surfaces: usize,
    /// Set of the causes due to all other removed parameter points, and to removed inputs.
    others: usize,
    /// Set of the causes due to a changed order.
    order: usize,
}

/// Sets of causes that arise in one stage.
struct StageCauses {
    to_all: usize,
    points: Vec<PointCauses>,
    /// For each stage that this stage did not read before, by its index, the set with the cause
    /// [`Why::ReadsMore`].
    reads_more: HashMap<usize, usize>,
    removals: Removals,
}

/// Sets of causes that arise at one parameter point.
struct PointCauses {
    /// Set of causes of the tasks whose realization existed in the last run.
    before: usize,
    realizations_before: u32,
    /// Set of causes of the tasks whose realization is new.
    beyond: usize,
    keeps_identity: bool,
    fewer: usize,
}

impl<'a> Walk<'a> {
    fn new(plan: &'a Plan, now: &'a Record) -> Walk<'a> {
        Walk {
            plan,
            now,
            sets: CauseSets::default(),
            own: Vec::new(),
            stage_of: vec![None; plan.tasks.len()],
            passed_on: vec![EMPTY; plan.tasks.len()],
            fewer: vec![EMPTY; plan.tasks.len()],
            removals: Vec::new(),
        }
    }

    /// Visits the next stage of a study without a record. All its tasks get the cause
    /// [`Why::FirstRun`].
    fn first_run(&mut self) {
        let stage = self.own.len();
        let why = Why::FirstRun;
        let set = self.sets.one(Cause { stage, why });
        self.own.push(vec![set; self.plan.stages[stage].tasks.len()]);
    }

    /// Visits the next stage and compares it with its earlier version `counterpart`.
    fn compare(&mut self, counterpart: Option<&StageRecord>) {
        let stage = self.own.len();
        let record = &self.now.stages[stage];
        let changes = StageChanges::between(counterpart, record);
        let stage_causes = self.stage_causes(stage, record, &changes);
        let tasks = self.plan.stages[stage].tasks.iter().zip(record.grid_positions());
        let causes = tasks.map(|(&task, position)| self.task(stage, task, position, &stage_causes));
        let own = causes.collect();
        self.own.push(own);
        self.removals.push(stage_causes.removals);
    }

    /// Returns the index of the set of causes why a task differs from the last run. Also records
    /// the stage of the task and the sets that it passes on.
    fn task(
        &mut self,
        stage: usize,
        task: usize,
        position: GridPosition,
        stage_causes: &StageCauses,
    ) -> usize {
        let point = &stage_causes.points[position.point];
        let at_point = if position.realization < point.realizations_before {
            point.before
        } else {
            point.beyond
        };
        let inputs = self.inputs(task, stage_causes);
        let own = self.sets.union(at_point, inputs);
        let passed_on =
            if point.keeps_identity { self.sets.union(stage_causes.to_all, inputs) } else { own };
        // A task of several stages existed before if it existed for any of them.
        let is_known = self.stage_of[task].replace(stage).is_some();
        if !is_known || passed_on == EMPTY {
            self.passed_on[task] = passed_on;
        }
        let above = match self.plan.tasks[task].inputs[..] {
            [input] => self.fewer[input],
            _ => EMPTY,
        };
        self.fewer[task] = self.sets.union(point.fewer, above);
        own
    }

    /// Returns the index of the set of causes that a task inherits from the tasks that it reads.
    fn inputs(&mut self, task: usize, stage_causes: &StageCauses) -> usize {
        let task = &self.plan.tasks[task];
        let reach = task.recipe.input_scope();
        let mut set = EMPTY;
        for &input in &task.inputs {
            let seen = match self.passed_on[input] {
                EMPTY => {
                    let stage = self.stage_of[input].expect("inputs come first");
                    stage_causes.reads_more.get(&stage).copied().unwrap_or(EMPTY)
                }
                seen => seen,
            };
            set = self.sets.union(set, seen);
            if reach != InputScope::Single {
                set = self.sets.union(set, self.fewer[input]);
            }
        }
        if reach != InputScope::Single {
            set = self.sets.union(set, stage_causes.removals.others);
        }
        if reach == InputScope::All {
            set = self.sets.union(set, stage_causes.removals.surfaces);
        }
        match set {
            EMPTY if reach == InputScope::All => stage_causes.removals.order,
            _ => set,
        }
    }

    fn stage_causes(
        &mut self,
        stage: usize,
        record: &StageRecord,
        changes: &StageChanges,
    ) -> StageCauses {
        let cause = |why: Why| Cause { stage, why };
        let to_all = self.sets.all(changes.to_all.iter().cloned().map(cause));
        let points = changes.points.iter().zip(&record.points);
        let causes =
            points.map(|(change, point)| self.point(stage, to_all, change, point.realizations));
        let points = causes.collect();
        let more = self.now.positions(&changes.reads_more).map(|read| {
            let name = self.now.stages[read].name.clone();
            (read, self.sets.one(cause(Why::ReadsMore { name })))
        });
        let reads_more = more.collect();
        StageCauses { to_all, points, reads_more, removals: self.removals(stage, record, changes) }
    }

    fn point(
        &mut self,
        stage: usize,
        to_all: usize,
        change: &PointChange,
        now: u32,
    ) -> PointCauses {
        let cause = |why: Why| Cause { stage, why };
        let changed = self.sets.all(change.why.iter().cloned().map(cause));
        let both = self.sets.union(to_all, changed);
        let realizations_before = change.realizations_before.unwrap_or(now);
        let new = (now > realizations_before)
            .then(|| Why::New { fields: realizations(realizations_before, now) });
        let fewer = (now < realizations_before)
            .then(|| Why::Fewer { fields: realizations(now, realizations_before) });
        let [new, fewer] = [new, fewer].map(|why| self.sets.all(why.map(cause)));
        PointCauses {
            before: both,
            realizations_before,
            beyond: self.sets.union(both, new),
            keeps_identity: change.keeps_identity,
            fewer,
        }
    }

    /// Returns the sets of the causes due to items that were removed or reordered in the stage
    /// `stage` and in all stages that it reads, directly or indirectly.
    fn removals(&mut self, stage: usize, record: &StageRecord, changes: &StageChanges) -> Removals {
        let cause = |why: Why| Cause { stage, why };
        let removals = self.sets.all(changes.removed.iter().cloned().map(cause));
        let order = changes.is_reordered.then_some(cause(Why::Reordered));
        let order = self.sets.all(order);
        let mut sum = match record.kind {
            Kind::Generate => Removals { surfaces: removals, others: EMPTY, order },
            _ => Removals { surfaces: EMPTY, others: removals, order },
        };
        for read in self.now.positions(&record.reads) {
            let above = self.removals[read];
            sum.surfaces = self.sets.union(sum.surfaces, above.surfaces);
            sum.others = self.sets.union(sum.others, above.others);
            sum.order = self.sets.union(sum.order, above.order);
        }
        sum
    }
}

fn realizations(from: u32, to: u32) -> Vec<Field> {
    let value = match to.saturating_sub(from) {
        0 | 1 => from.to_string(),
        _ => format!("{from} … {}", to - 1),
    };
    vec![Field { field: "realization".to_owned(), value: Shown(value) }]
}

/// Index of the empty set of causes.
const EMPTY: usize = 0;

/// Sets of causes, each stored once and referred to by its index. A hundred thousand tasks share a
/// handful of sets.
#[derive(Debug)]
struct CauseSets {
    causes: Vec<Cause>,
    /// Sets of causes, each as indices into `causes` in ascending order.
    sets: Vec<Vec<usize>>,
    known_causes: HashMap<Cause, usize>,
    known: HashMap<Vec<usize>, usize>,
    unions: HashMap<(usize, usize), usize>,
}

impl Default for CauseSets {
    fn default() -> CauseSets {
        CauseSets {
            causes: Vec::new(),
            sets: vec![Vec::new()],
            known_causes: HashMap::new(),
            known: HashMap::from([(Vec::new(), EMPTY)]),
            unions: HashMap::new(),
        }
    }
}

impl CauseSets {
    /// Returns the index of the set that contains only `cause`.
    fn one(&mut self, cause: Cause) -> usize {
        let next = self.causes.len();
        let position = *self.known_causes.entry(cause.clone()).or_insert(next);
        if position == next {
            self.causes.push(cause);
        }
        self.number(vec![position])
    }

    /// Returns the index of the set of the given causes.
    fn all(&mut self, causes: impl IntoIterator<Item = Cause>) -> usize {
        causes.into_iter().fold(EMPTY, |set, cause| {
            let one = self.one(cause);
            self.union(set, one)
        })
    }

    /// Returns the index of the union of two sets.
    fn union(&mut self, one: usize, other: usize) -> usize {
        match (one.min(other), one.max(other)) {
            (EMPTY, set) => set,
            (same, set) if same == set => set,
            pair => match self.unions.get(&pair) {
                Some(&known) => known,
                None => {
                    let mut both = [&self.sets[pair.0][..], &self.sets[pair.1]].concat();
                    both.sort_unstable();
                    both.dedup();
                    let number = self.number(both);
                    self.unions.insert(pair, number);
                    number
                }
            },
        }
    }

    /// Returns the causes in a set, in the order in which they were added.
    fn causes(&self, set: usize) -> Vec<Cause> {
        self.sets[set].iter().map(|&cause| self.causes[cause].clone()).collect()
    }

    fn number(&mut self, set: Vec<usize>) -> usize {
        let next = self.sets.len();
        let number = *self.known.entry(set.clone()).or_insert(next);
        if number == next {
            self.sets.push(set);
        }
        number
    }
}
