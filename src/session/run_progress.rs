//! How far the tasks of a run have come, and how long they will go on.

use std::collections::{BTreeMap, HashMap};
use std::time::{Duration, Instant};

use super::events::Batch;
use asperity_pipeline::forecast::CostModel;
use asperity_stages::Kind;

/// Tasks that are computed together, as an [`Observer`](super::Observer) hears of them: what they are
/// expected to take, and how much of it is done.
#[derive(Debug)]
pub struct RunProgress {
    tasks: HashMap<usize, Expected>,
    /// Seconds of one core that all of them are expected to take.
    expected: f64,
    begun: Instant,
    finished: usize,
    /// Expected seconds of finished tasks.
    done: f64,
    /// Expected seconds done of tasks under way.
    under_way: BTreeMap<usize, f64>,
}

/// What a task is, and how many seconds of one core it is expected to take.
#[derive(Debug)]
struct Expected {
    kind: Kind,
    seconds: f64,
}

impl RunProgress {
    /// Begins to count the tasks that are to run.
    pub fn new(batch: Batch<'_>) -> RunProgress {
        let cost = CostModel::default();
        let expected = |&task: &usize| {
            let kind = batch.plan.tasks[task].recipe.kind();
            let seconds = cost.seconds(&batch.plan.tasks[task]);
            (task, Expected { kind, seconds })
        };
        let tasks: HashMap<usize, Expected> = batch.tasks.iter().map(expected).collect();
        RunProgress {
            expected: tasks.values().map(|expected| expected.seconds).sum(),
            tasks,
            begun: Instant::now(),
            finished: 0,
            done: 0.0,
            under_way: BTreeMap::new(),
        }
    }

    /// So much of a task is done, from 0 to 1.
    pub fn advanced(&mut self, task: usize, share: f64) {
        self.under_way.insert(task, share * self.seconds(task));
    }

    /// A task is done, or has failed.
    pub fn finished(&mut self, task: usize) {
        self.finished += 1;
        self.done += self.seconds(task);
        self.under_way.remove(&task);
    }

    /// What a task does, if it is one of them.
    pub fn kind(&self, task: usize) -> Option<Kind> {
        self.tasks.get(&task).map(|expected| expected.kind)
    }

    /// How many tasks there are.
    pub fn tasks(&self) -> usize {
        self.tasks.len()
    }

    /// How many of them are done.
    pub fn tasks_done(&self) -> usize {
        self.finished
    }

    /// The share of the expected work that is done, from 0 to 1.
    pub fn share(&self) -> f64 {
        let done = self.done + self.under_way.values().sum::<f64>();
        done / self.expected
    }

    /// Time that the rest takes at the pace so far, once there is a pace.
    pub fn time_left(&self) -> Option<Duration> {
        time_left(self.begun.elapsed(), self.share())
    }

    fn seconds(&self, task: usize) -> f64 {
        let expected = self.tasks.get(&task);
        expected.map_or(0.0, |expected| expected.seconds)
    }
}

fn time_left(elapsed: Duration, share_done: f64) -> Option<Duration> {
    let seconds = elapsed.as_secs_f64() * (1.0 - share_done) / share_done;
    (share_done > 0.01).then(|| Duration::from_secs_f64(seconds.max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_done_in_a_minute_leaves_nine() {
        let left = time_left(Duration::from_secs(60), 0.1);
        assert_eq!(left.map(|left| left.as_secs()), Some(540));
    }

    #[test]
    fn nothing_done_promises_nothing() {
        assert_eq!(time_left(Duration::from_secs(60), 0.0), None);
    }
}
