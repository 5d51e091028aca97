//! Goes through the plan, inputs first, and carries what happened from task to task.

use std::collections::HashMap;

use super::cause::{Cause, Field, Shown, Why};
use super::changes::{PointChange, StageChanges};
use super::record::{Place, Record, StageRecord};
use super::sets::{EMPTY, Sets};
use crate::plan::Plan;
use asperity_stages::{Kind, Reach};

/// What has been found out, stage after stage.
pub struct Walk<'a> {
    plan: &'a Plan,
    now: &'a Record,
    /// All sets of causes.
    pub sets: Sets,
    /// By stage and position: what makes that task another one than before.
    pub own: Vec<Vec<usize>>,
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
    pub fn new(plan: &'a Plan, now: &'a Record) -> Walk<'a> {
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
    pub fn first_run(&mut self) {
        let stage = self.own.len();
        let why = Why::FirstRun;
        let set = self.sets.one(Cause { stage, why });
        self.own.push(vec![set; self.plan.stages[stage].tasks.len()]);
    }

    /// The next stage, and what it was before.
    pub fn compare(&mut self, partner: Option<&StageRecord>) {
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
        let at_point = match place.realization < point.realizations_before {
            true => point.before,
            false => point.beyond,
        };
        let inputs = self.inputs(task, here);
        let own = self.sets.union(at_point, inputs);
        let passed_on = match point.keeps_identity {
            true => self.sets.union(here.to_all, inputs),
            false => own,
        };
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
