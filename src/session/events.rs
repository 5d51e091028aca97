//! What a session tells while it works, to whoever observes it, and how far that says a run has come.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::path::Path;
use std::time::{Duration, Instant};

use bytesize::ByteSize;

use asperity_manifest::diagnostics::{chain, counted};
use asperity_pipeline::forecast::CostModel;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::study::Warning;
use asperity_stages::Kind;
use asperity_tables::store::StoreError;
use asperity_tables::table::Table;

pub use asperity_pipeline::forecast::memory::MemoryLimit;
pub use asperity_pipeline::runner::Damage;

/// Hears what happens while a session works, some of it from the threads that compute. Every
/// `Fn(Event)` that threads may share is one.
pub trait Observer: Sync {
    /// Something has happened. Who takes long to hear it holds up the task that tells it.
    fn hear(&self, event: Event<'_>);
}

impl<F: Fn(Event<'_>) + Sync> Observer for F {
    fn hear(&self, event: Event<'_>) {
        self(event);
    }
}

/// What happens while a session works. Tasks are numbers of the plan that was begun last.
#[derive(Debug, Clone, Copy)]
pub enum Event<'a> {
    /// Something should be known, and nothing ends for it.
    Notice(Notice<'a>),
    /// Tasks are about to be computed; a run may do so several times, one after the other.
    Begun(Batch<'a>),
    /// A task began.
    Started(usize),
    /// A share of a task is done, from 0 to 1.
    Advanced(usize, f64),
    /// A task is done, or has failed.
    Finished(usize),
    /// All that was begun has ended, one way or the other.
    Ended,
    /// Tasks could not be computed: rows of the table of failures.
    Failed(&'a Table),
}

/// Tasks that are computed together.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// All tasks of the study, as many as are known by now.
    pub plan: &'a Plan,
    /// Those that are to be computed.
    pub tasks: &'a [usize],
    /// How many others are in the store.
    pub cached: usize,
}

/// Something that should be known of a study, of its tables or of a run.
#[derive(Debug, Clone, Copy)]
pub enum Notice<'a> {
    /// Of the study, before it is run, or of what it has found.
    Study(&'a Warning),
    /// Memory is for fewer tasks at once than there are threads.
    ScarceMemory {
        /// What the largest task takes.
        largest: ByteSize,
        /// How many of it there is memory for.
        at_once: u64,
        /// How many threads there are.
        jobs: usize,
        /// What the run keeps to.
        allowance: MemoryLimit,
    },
    /// A task's table was damaged, and is computed again.
    Damaged(&'a Damage),
    /// A stage's table was not as any run had written it.
    Edited {
        /// Where it was, and where a new one is.
        path: &'a Path,
        /// Where it is now.
        quarantined: &'a Path,
    },
    /// A table in the folder of results is of no stage that the study has.
    Orphan(&'a Path),
    /// What the study is could not be written down.
    NotRemembered(&'a StoreError),
    /// The file of a measured surface is gone, and is taken to be as it was.
    Recalled(&'a Path),
    /// Not all tasks of a stage are finished whose table is read.
    Incomplete {
        stage: &'a str,
        /// How many of its tasks are finished.
        finished: usize,
        /// How many it has.
        tasks: usize,
        manifest: &'a Path,
    },
}

/// How much a notice should worry who hears it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// All is as it should be.
    Note,
    /// Something is not.
    Warning,
}

impl Notice<'_> {
    /// How much it should worry who hears it.
    pub fn severity(&self) -> Severity {
        match self {
            Notice::Study(_)
            | Notice::Damaged(_)
            | Notice::Edited { .. }
            | Notice::NotRemembered(_) => Severity::Warning,
            Notice::ScarceMemory { .. }
            | Notice::Orphan(_)
            | Notice::Recalled(_)
            | Notice::Incomplete { .. } => Severity::Note,
        }
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
                let largest = largest.display().si();
                write!(
                    formatter,
                    "the largest task takes {largest}: {at_once} at once, not {jobs}, in {allowance}"
                )
            }
            Notice::Damaged(damage) => {
                let (cause, quarantined) = (chain(&damage.cause), damage.quarantined.display());
                write!(formatter, "{cause}; set aside as `{quarantined}`")
            }
            Notice::Edited { path, quarantined } => write!(
                formatter,
                "`{}` was not as it had been written; set aside as `{}`",
                path.display(),
                quarantined.display()
            ),
            Notice::Orphan(path) => write!(
                formatter,
                "`{}` is of a stage that the study no longer has; you may delete it",
                path.display()
            ),
            Notice::NotRemembered(error) => {
                write!(formatter, "{}; `explain` will not know this run", chain(*error))
            }
            Notice::Recalled(path) => write!(
                formatter,
                "surface file `{}` cannot be read; its tables are those of it as it was",
                path.display()
            ),
            Notice::Incomplete { stage, finished, tasks, manifest } => write!(
                formatter,
                "`{stage}` is not complete, {finished} of {} computed; `asperity run {}` goes on",
                counted(*tasks, "task"),
                manifest.display(),
            ),
        }
    }
}

/// Tasks that are computed together, as an [`Observer`] hears of them: what they are
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
