//! Events of a session for observers, and the progress that follows from them.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::path::Path;
use std::time::{Duration, Instant};

use bytesize::ByteSize;

use super::formatting::{chain, counted, duration, shell_word};
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::forecast::remaining::Remaining;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::study::Warning;
use asperity_stages::Kind;
use asperity_tables::store::{Store, StoreError};
use asperity_tables::table::Table;

pub use asperity_pipeline::forecast::memory::MemoryLimit;
pub use asperity_pipeline::outcome::Damage;

/// Receiver of the events of a session.
///
/// Worker threads call it, too. Every `Fn(Event)` that is `Sync` implements it.
pub trait Observer: Sync {
    /// Receives an event. The task that causes the event waits until this method returns.
    fn on_event(&self, event: Event<'_>);
}

impl<F: Fn(Event<'_>) + Sync> Observer for F {
    fn on_event(&self, event: Event<'_>) {
        self(event);
    }
}

/// Event of a session.
///
/// Tasks are indices into the plan of the most recent `Begun`.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Event<'a> {
    /// Message that does not end the command.
    Notice(Notice<'a>),
    /// Start of a batch of tasks; a run may compute several batches in sequence.
    Begun(Batch<'a>),
    /// Start of a single task.
    Started(usize),
    /// Task, and the fraction of it that is finished, from 0 to 1.
    Advanced(usize, f64),
    /// End of a task, with or without success.
    Finished(usize),
    /// End of the batch, with or without success.
    Ended,
    /// Failed tasks, as rows of the table of failures.
    Failed(&'a Table),
}

/// Tasks that a run computes together.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Batch<'a> {
    /// Plan of the study with all tasks known so far.
    pub plan: &'a Plan,
    /// Indices of the tasks to compute.
    pub tasks: &'a [usize],
    /// Store before the run, which may have some rows of the tasks.
    pub store: &'a Store,
    /// Number of tasks of the plan that are in the store and not in `tasks`.
    pub cached: usize,
}

impl fmt::Display for Batch<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (to_run, all) = (self.tasks.len(), self.plan.tasks.len());
        let numbers = task_numbers(to_run, self.cached, all);
        write!(formatter, "{}: {numbers}", self.plan.study)
    }
}

/// Formats the numbers of tasks of a batch: to run, finished, and left for later.
fn task_numbers(to_run: usize, finished: usize, all: usize) -> String {
    let numbers = format!("{} to run, {finished} finished", counted(to_run, "task"));
    match all.saturating_sub(to_run + finished) {
        0 => numbers,
        later => format!("{numbers}, {later} left for later"),
    }
}

/// Message about a study, its tables or a run.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Notice<'a> {
    /// Warning about the study or its results.
    Study(&'a Warning),
    /// The memory limit allows fewer parallel tasks than there are cores.
    ScarceMemory {
        /// Memory of the largest task.
        largest: ByteSize,
        /// Number of such tasks that fit into memory at the same time.
        at_once: u64,
        /// Number of cores or of missing tasks, whichever is smaller.
        jobs: usize,
        /// Memory limit of the run.
        allowance: MemoryLimit,
    },
    /// Damaged table of a task. The task is computed again.
    Damaged(&'a Damage),
    /// A table of a stage that was edited after a run wrote it.
    Edited {
        /// Path of the new table, and the previous path of the edited one.
        path: &'a Path,
        /// New path of the edited file.
        quarantined: &'a Path,
    },
    /// A table in the results folder that belongs to no stage of the study.
    Orphan(&'a Path),
    /// The results folder belonged to another manifest with the same study name, which no longer
    /// exists.
    FormerOwner {
        manifest: &'a Path,
        /// Results folder of the study.
        folder: &'a Path,
    },
    /// A read-only store that a settings file lists cannot be used.
    UnusableStore(&'a StoreError),
    /// Another process deletes tables of this store, and the command waits until it has ended.
    Waiting(&'a Path),
    /// The record of the run could not be written.
    RecordNotSaved(&'a StoreError),
    /// Path of a missing file of a measured surface. The results for its last known version are
    /// used.
    Recalled(&'a Path),
    /// The table of a stage is read although some of its tasks are missing.
    Incomplete {
        stage: &'a str,
        /// Number of finished tasks of the stage.
        finished: usize,
        /// Number of all tasks of the stage.
        tasks: usize,
        manifest: &'a Path,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// Information about a normal state.
    Note,
    /// Possible problem that needs attention.
    Warning,
}

impl Notice<'_> {
    /// Returns the severity of the notice.
    pub fn severity(&self) -> Severity {
        let is_warning = matches!(
            self,
            Notice::Study(_)
                | Notice::Damaged(_)
                | Notice::Edited { .. }
                | Notice::UnusableStore(_)
                | Notice::RecordNotSaved(_)
        );
        if is_warning { Severity::Warning } else { Severity::Note }
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Severity::Note => "note",
            Severity::Warning => "warning",
        })
    }
}

impl fmt::Display for Notice<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Notice::Study(warning) => write!(formatter, "{warning}"),
            Notice::ScarceMemory { largest, at_once, jobs, allowance } => {
                write!(
                    formatter,
                    "{at_once} of {jobs} tasks of {} run in parallel to stay below {allowance}",
                    largest.display().si()
                )
            }
            Notice::Damaged(damage) => {
                let cause = chain(&damage.cause);
                match &damage.quarantined {
                    Some(path) => write!(formatter, "{cause}; set aside as `{}`", path.display()),
                    None => write!(formatter, "{cause}; left in place and computed again"),
                }
            }
            Notice::Waiting(store) => write!(
                formatter,
                "waiting for the lock of `{}`, which a process that deletes tables has",
                store.display()
            ),
            Notice::UnusableStore(error) => formatter.write_str(&chain(*error)),
            Notice::Edited { path, quarantined } => write!(
                formatter,
                "`{}` was edited after `asperity run` wrote it; set aside as `{}`",
                path.display(),
                quarantined.display()
            ),
            Notice::Orphan(path) => write!(
                formatter,
                "`{}` belongs to a stage that the study no longer has; you can delete it",
                path.display()
            ),
            Notice::FormerOwner { manifest, folder } => write!(
                formatter,
                "the results in `{}` were those of `{}`, which no longer exists",
                folder.display(),
                manifest.display()
            ),
            Notice::RecordNotSaved(error) => {
                write!(
                    formatter,
                    "{}; `asperity explain` cannot compare with this run",
                    chain(*error)
                )
            }
            Notice::Recalled(path) => write!(
                formatter,
                "surface file `{}` cannot be read; the tables of its last version are used",
                path.display()
            ),
            Notice::Incomplete { stage, finished, tasks, manifest } => write!(
                formatter,
                "`{stage}` is incomplete, {finished} of {} computed; `asperity run {}` continues",
                counted(*tasks, "task"),
                shell_word(manifest),
            ),
        }
    }
}

/// Progress of a batch of tasks, computed from the events that an [`Observer`] receives.
#[derive(Debug)]
pub struct RunProgress {
    /// Kind and expected core-seconds of each task.
    tasks: HashMap<usize, (Kind, f64)>,
    /// Expected core-seconds of all tasks.
    expected: f64,
    begun: Instant,
    finished: usize,
    /// Expected core-seconds of finished tasks.
    done: f64,
    /// Expected core-seconds of the finished part of each running task.
    under_way: BTreeMap<usize, f64>,
}

impl RunProgress {
    /// Starts to measure the progress of a batch of tasks.
    pub fn new(batch: Batch<'_>) -> RunProgress {
        let remaining = Remaining::new(batch.plan, batch.tasks, batch.store);
        let cost = CostModel::default().for_remaining(remaining);
        let expected = |&task: &usize| {
            let kind = batch.plan.tasks[task].recipe.kind();
            (task, (kind, cost.seconds(batch.plan, task)))
        };
        let tasks: HashMap<usize, (Kind, f64)> = batch.tasks.iter().map(expected).collect();
        RunProgress {
            expected: tasks.values().map(|(_, seconds)| seconds).sum(),
            tasks,
            begun: Instant::now(),
            finished: 0,
            done: 0.0,
            under_way: BTreeMap::new(),
        }
    }

    /// Records that the fraction `share` of a task is finished.
    pub fn advanced(&mut self, task: usize, share: f64) {
        self.under_way.insert(task, share * self.seconds(task));
    }

    /// Records the end of a task, with or without success.
    pub fn finished(&mut self, task: usize) {
        self.finished += 1;
        self.done += self.seconds(task);
        self.under_way.remove(&task);
    }

    /// Returns the kind of a task of the batch; `None` for other tasks.
    pub fn kind(&self, task: usize) -> Option<Kind> {
        self.tasks.get(&task).map(|(kind, _)| *kind)
    }

    /// Returns the number of tasks of the batch.
    pub fn tasks(&self) -> usize {
        self.tasks.len()
    }

    /// Returns the number of finished tasks.
    pub fn tasks_done(&self) -> usize {
        self.finished
    }

    /// Returns the finished fraction of the expected core-seconds.
    pub fn share(&self) -> f64 {
        let done = self.done + self.under_way.values().sum::<f64>();
        (done / self.expected).min(1.0)
    }

    /// Returns the remaining time at the present speed; `None` in the first percent of the work.
    pub fn time_left(&self) -> Option<Duration> {
        time_left(self.begun.elapsed(), self.share())
    }

    /// Formats the remaining time, such as `2 min 5 s left`; `…` if it is unknown.
    pub(crate) fn time_left_in_words(&self) -> String {
        self.time_left().map_or("…".to_owned(), |left| duration(left) + " left")
    }

    fn seconds(&self, task: usize) -> f64 {
        self.tasks.get(&task).map_or(0.0, |(_, seconds)| *seconds)
    }
}

impl fmt::Display for RunProgress {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (finished, tasks) = (self.finished, counted(self.tasks.len(), "task"));
        write!(formatter, "{finished} of {tasks}, {}", self.time_left_in_words())
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
    fn tasks_left_for_later_are_not_finished() {
        assert_eq!(task_numbers(2, 33, 35), "2 tasks to run, 33 finished");
        assert_eq!(task_numbers(1, 0, 35), "1 task to run, 0 finished, 34 left for later");
    }

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
