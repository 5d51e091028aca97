//! Why tasks would run.
//!
//! A key says that a task is another one than before, not why. The study as it last ran is on
//! [`Record`]: comparing it stage by stage, point by point, with the study as it is now says what
//! was edited, and following the plan says which tasks that reaches.

pub mod cause;
mod changes;
pub mod record;
mod sets;
mod walk;

use std::collections::HashMap;

use crate::plan::Plan;
use asperity_stages::Kind;
use asperity_tables::store::Store;
use cause::{Cause, Why};
use record::{Record, StageRecord};
use sets::EMPTY;
use walk::Walk;

/// Why each stage's missing tasks would run.
#[derive(Debug)]
pub struct Reasons {
    /// In the order of the plan.
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
