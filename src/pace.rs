//! How long work takes on this machine, before it is done.
//!
//! Nearly all time of a study goes into pairs of transforms, so that the expectation is a count of
//! pairs times the seconds that one takes, measured here and now.

use std::cell::RefCell;
use std::collections::BTreeMap;

use crate::contact::solver::pace;
use crate::plan::{Plan, Task};

/// Seconds of one core that tasks are expected to take.
#[derive(Debug, Default)]
pub struct Pace {
    seconds_per_pair: RefCell<BTreeMap<usize, f64>>,
}

impl Pace {
    /// Seconds of one core for a task.
    pub fn seconds(&self, task: &Task) -> f64 {
        let effort = task.recipe.effort(task.nodes);
        let in_pairs = match effort.pairs {
            0.0 => 0.0,
            pairs => pairs * self.seconds_per_pair(task.nodes),
        };
        effort.seconds + in_pairs
    }

    /// Seconds of one core for several tasks of a plan.
    pub fn seconds_of(&self, plan: &Plan, tasks: &[usize]) -> f64 {
        tasks
            .iter()
            .map(|&task| self.seconds(&plan.tasks[task]))
            .sum()
    }

    /// Measured once for each mesh.
    fn seconds_per_pair(&self, nodes: usize) -> f64 {
        let mut known = self.seconds_per_pair.borrow_mut();
        *known
            .entry(nodes)
            .or_insert_with(|| pace::seconds_per_pair(nodes))
    }
}
