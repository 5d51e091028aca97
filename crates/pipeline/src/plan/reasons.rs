//! Why tasks would run.
//!
//! A key says that a task is another one than before, not why. The study as it last ran is on
//! [`Record`]: comparing it stage by stage, point by point, with the study as it is now says what
//! was edited, and following the plan says which tasks that reaches.

pub mod changes;
pub mod record;

use std::collections::HashMap;

use changes::{Cause, Field, PointChange, Shown, StageChanges, Why};
use record::{Place, Record, StageRecord};

use crate::plan::Plan;
use asperity_stages::{Kind, Reach};
use asperity_tables::store::Store;

/// Why each stage's missing tasks would run.
#[derive(Debug)]
pub struct Reasons {
    pub stages: Vec<Vec<Group>>,
}

/// Missing tasks of one stage that would run for the same causes.
#[derive(Debug)]
pub struct Group {
    /// What happened, in this stage and in those that it depends on.
    pub causes: Vec<Cause>,
    /// The tasks, in order.
    pub tasks: Vec<usize>,
}

impl Reasons {
    /// Explains the missing tasks of a plan; `now` is the record of the study as it is, `before`
    /// the one that its last run left.
    pub fn of(
        plan: &Plan,
        now: &Record,
        before: Option<&Record>,
        missing: &[usize],
        store: &Store,
    ) -> Reasons {
        let mut is_missing = vec![false; plan.tasks.len()];
        missing.iter().for_each(|&task| is_missing[task] = true);
        let partners = partners(before, now);
        let mut walk = Walk::new(plan, now);
        for partner in &partners {
            match before {
                None => walk.first_run(),
                Some(_) => walk.compare(*partner),
            }
        }
        let stages = (0..plan.stages.len()).map(|stage| {
            let tasks = plan.stages[stage].tasks.iter().zip(&walk.own[stage]);
            let mut groups = Groups::default();
            for (&task, &set) in tasks.filter(|(task, _)| is_missing[**task]) {
                let unchanged = (set == EMPTY)
                    .then(|| lost(partners[stage], store.has_damaged(plan.tasks[task].key)));
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

/// Groups in the order of their first tasks, each found by what sets it apart.
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

/// Why a task is missing that nothing has changed.
fn lost(partner: Option<&StageRecord>, is_damaged: bool) -> Why {
    match partner {
        _ if is_damaged => Why::Damaged,
        Some(stage) if stage.finished == stage.tasks => Why::Missing,
        _ => Why::Unfinished,
    }
}

/// The stage on record that each stage was: that of its name, or the only other one of its kind.
fn partners<'a>(before: Option<&'a Record>, now: &Record) -> Vec<Option<&'a StageRecord>> {
    let Some(before) = before else {
        return vec![None; now.stages.len()];
    };
    let is_known = |name: &str| now.stages.iter().any(|stage| stage.name == name);
    let renamed = |kind: Kind| {
        let left = before.stages.iter().filter(move |old| old.kind == kind);
        let mut left = left.filter(|old| !is_known(&old.name));
        left.next().filter(|_| left.next().is_none())
    };
    let partner = |stage: &StageRecord| {
        let named = before.stages.iter().find(|old| old.name == stage.name);
        match named {
            Some(old) => (old.kind == stage.kind).then_some(old),
            None => renamed(stage.kind),
        }
    };
    now.stages.iter().map(partner).collect()
}

/// Goes through the plan, inputs first, and carries what happened from task to task.
struct Walk<'a> {
    plan: &'a Plan,
    now: &'a Record,
    sets: Sets,
    /// By stage and position: what makes that task another one than before.
    own: Vec<Vec<usize>>,
    /// By task: the first stage that it belongs to.
    stage_of: Vec<Option<usize>>,
    /// By task: what later stages see of that.
    passed_on: Vec<usize>,
    /// By task: surfaces that are no longer beside it.
    fewer: Vec<usize>,
    /// By stage: what happened to it and all before it.
    gone: Vec<Gone>,
}

/// What is not there any more, or not where it was, from the surfaces down to a stage.
#[derive(Clone, Copy, Default)]
struct Gone {
    /// Points of surfaces.
    surfaces: usize,
    /// Anything else.
    others: usize,
    /// What came in another order.
    order: usize,
}

/// What happened in a stage, as sets.
struct Here {
    to_all: usize,
    points: Vec<Point>,
    /// By the position of a stage that it did not read before.
    reads_more: HashMap<usize, usize>,
    gone: Gone,
}

/// What happened to a point, as sets.
struct Point {
    before: usize,
    realizations_before: u32,
    /// For realizations beyond those on record.
    beyond: usize,
    keeps_identity: bool,
    fewer: usize,
}

impl<'a> Walk<'a> {
    /// Nothing is known yet.
    fn new(plan: &'a Plan, now: &'a Record) -> Walk<'a> {
        Walk {
            plan,
            now,
            sets: Sets::default(),
            own: Vec::new(),
            stage_of: vec![None; plan.tasks.len()],
            passed_on: vec![EMPTY; plan.tasks.len()],
            fewer: vec![EMPTY; plan.tasks.len()],
            gone: Vec::new(),
        }
    }

    /// The next stage, of a study of which there is no record.
    fn first_run(&mut self) {
        let stage = self.own.len();
        let why = Why::FirstRun;
        let set = self.sets.one(Cause { stage, why });
        self.own.push(vec![set; self.plan.stages[stage].tasks.len()]);
    }

    /// The next stage, and what it was before.
    fn compare(&mut self, partner: Option<&StageRecord>) {
        let stage = self.own.len();
        let record = &self.now.stages[stage];
        let changes = StageChanges::between(partner, record);
        let here = self.here(stage, record, &changes);
        let tasks = self.plan.stages[stage].tasks.iter().zip(record.places());
        let own = tasks.map(|(&task, place)| self.task(stage, task, place, &here));
        let own = own.collect();
        self.own.push(own);
        self.gone.push(here.gone);
    }

    /// What makes a task another one than before.
    fn task(&mut self, stage: usize, task: usize, place: Place, here: &Here) -> usize {
        let point = &here.points[place.point];
        let at_point =
            if place.realization < point.realizations_before { point.before } else { point.beyond };
        let inputs = self.inputs(task, here);
        let own = self.sets.union(at_point, inputs);
        let passed_on =
            if point.keeps_identity { self.sets.union(here.to_all, inputs) } else { own };
        // A task of several stages was there before if it was there for one of them.
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

    /// What a task sees of what it reads.
    fn inputs(&mut self, task: usize, here: &Here) -> usize {
        let task = &self.plan.tasks[task];
        let reach = task.recipe.reach();
        let mut set = EMPTY;
        for &input in &task.inputs {
            let seen = match self.passed_on[input] {
                EMPTY => {
                    let stage = self.stage_of[input].expect("inputs come first");
                    here.reads_more.get(&stage).copied().unwrap_or(EMPTY)
                }
                seen => seen,
            };
            set = self.sets.union(set, seen);
            if reach != Reach::Single {
                set = self.sets.union(set, self.fewer[input]);
            }
        }
        if reach != Reach::Single {
            set = self.sets.union(set, here.gone.others);
        }
        if reach == Reach::All {
            set = self.sets.union(set, here.gone.surfaces);
        }
        match set {
            EMPTY if reach == Reach::All => here.gone.order,
            _ => set,
        }
    }

    fn here(&mut self, stage: usize, record: &StageRecord, changes: &StageChanges) -> Here {
        let cause = |why: Why| Cause { stage, why };
        let to_all = self.sets.all(changes.to_all.iter().cloned().map(cause));
        let points = changes.points.iter().zip(&record.points);
        let points =
            points.map(|(change, point)| self.point(stage, to_all, change, point.realizations));
        let points = points.collect();
        let more = self.now.positions(&changes.reads_more).map(|read| {
            let name = self.now.stages[read].name.clone();
            (read, self.sets.one(cause(Why::ReadsMore { name })))
        });
        let reads_more = more.collect();
        Here { to_all, points, reads_more, gone: self.gone(stage, record, changes) }
    }

    fn point(&mut self, stage: usize, to_all: usize, change: &PointChange, now: u32) -> Point {
        let cause = |why: Why| Cause { stage, why };
        let changed = self.sets.all(change.why.iter().cloned().map(cause));
        let both = self.sets.union(to_all, changed);
        let realizations_before = change.realizations_before.unwrap_or(now);
        let new = (now > realizations_before)
            .then(|| Why::New { fields: realizations(realizations_before, now) });
        let fewer = (now < realizations_before)
            .then(|| Why::Fewer { fields: realizations(now, realizations_before) });
        let [new, fewer] = [new, fewer].map(|why| self.sets.all(why.map(cause)));
        Point {
            before: both,
            realizations_before,
            beyond: self.sets.union(both, new),
            keeps_identity: change.keeps_identity,
            fewer,
        }
    }

    /// What is not there any more from the surfaces down to this stage.
    fn gone(&mut self, stage: usize, record: &StageRecord, changes: &StageChanges) -> Gone {
        let cause = |why: Why| Cause { stage, why };
        let gone = self.sets.all(changes.gone.iter().cloned().map(cause));
        let order = changes.is_reordered.then_some(cause(Why::Reordered));
        let order = self.sets.all(order);
        let mut sum = match record.kind {
            Kind::Generate => Gone { surfaces: gone, others: EMPTY, order },
            _ => Gone { surfaces: EMPTY, others: gone, order },
        };
        for read in self.now.positions(&record.reads) {
            let above = self.gone[read];
            sum.surfaces = self.sets.union(sum.surfaces, above.surfaces);
            sum.others = self.sets.union(sum.others, above.others);
            sum.order = self.sets.union(sum.order, above.order);
        }
        sum
    }
}

/// Realizations from one number up to, but not with, another.
fn realizations(from: u32, to: u32) -> Vec<Field> {
    let value = match to.saturating_sub(from) {
        0 | 1 => from.to_string(),
        _ => format!("{from} … {}", to - 1),
    };
    vec![Field { field: "realization".to_owned(), value: Shown(value) }]
}

/// The set of no causes.
const EMPTY: usize = 0;

/// Sets of causes by number, each kept once: a hundred thousand tasks share a handful of them.
#[derive(Debug)]
struct Sets {
    causes: Vec<Cause>,
    /// Positions of causes, ascending.
    sets: Vec<Vec<usize>>,
    known_causes: HashMap<Cause, usize>,
    known: HashMap<Vec<usize>, usize>,
    unions: HashMap<(usize, usize), usize>,
}

impl Default for Sets {
    fn default() -> Sets {
        Sets {
            causes: Vec::new(),
            sets: vec![Vec::new()],
            known_causes: HashMap::new(),
            known: HashMap::from([(Vec::new(), EMPTY)]),
            unions: HashMap::new(),
        }
    }
}

impl Sets {
    /// The set of one cause.
    fn one(&mut self, cause: Cause) -> usize {
        let next = self.causes.len();
        let position = *self.known_causes.entry(cause.clone()).or_insert(next);
        if position == next {
            self.causes.push(cause);
        }
        self.number(vec![position])
    }

    /// The set of several causes.
    fn all(&mut self, causes: impl IntoIterator<Item = Cause>) -> usize {
        causes.into_iter().fold(EMPTY, |set, cause| {
            let one = self.one(cause);
            self.union(set, one)
        })
    }

    /// The causes of either set.
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

    /// What is in a set, in the order in which it was met.
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
