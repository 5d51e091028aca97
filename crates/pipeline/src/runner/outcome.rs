//! What became of tasks: computed, failed, mended.

use std::collections::HashMap;
use std::path::PathBuf;

use crate::plan::Plan;
use asperity_stages::StageError;
use asperity_tables::store::key::TaskKey;
use asperity_tables::store::{Store, StoreError};
use asperity_tables::table::TableError;

/// What became of a plan.
#[derive(Debug, Default)]
pub struct RunOutcome {
    /// Tasks computed now.
    pub computed: Vec<usize>,
    /// Tasks that could not be computed, and why.
    pub failed: Vec<(usize, TaskError)>,
    /// Tables that were damaged, and quarantined.
    pub damaged: Vec<Damage>,
    /// Whether the user stopped the run.
    pub interrupted: bool,
    /// Whether the run stopped because its tables cannot be stored.
    pub halted: bool,
}

impl RunOutcome {
    /// Adds what became of the same plan later.
    pub fn append(&mut self, later: RunOutcome) {
        self.computed.extend(later.computed);
        self.computed.sort_unstable();
        self.failed.extend(later.failed);
        self.damaged.extend(later.damaged);
        self.interrupted |= later.interrupted;
        self.halted |= later.halted;
    }

    /// The same, told of the tasks of a plan that has grown.
    pub fn moved(mut self, from: &Plan, to: &Plan) -> RunOutcome {
        let places = to.tasks.iter().enumerate();
        let places: HashMap<TaskKey, usize> =
            places.map(|(place, task)| (task.key, place)).collect();
        let place = |task: usize| places.get(&from.tasks[task].key).copied();
        self.computed = self.computed.into_iter().filter_map(place).collect();
        self.computed.sort_unstable();
        let failed = self.failed.into_iter();
        self.failed = failed.filter_map(|(task, error)| Some((place(task)?, error))).collect();
        for damage in &mut self.damaged {
            damage.task = place(damage.task).unwrap_or(damage.task);
        }
        self
    }
}

/// A table that was damaged, and is computed again.
#[derive(Debug)]
pub struct Damage {
    /// Whose table it was.
    pub task: usize,
    /// What is wrong with its file.
    pub cause: StoreError,
    /// Where the file is now.
    pub quarantined: PathBuf,
}

impl Damage {
    /// Quarantines a task's damaged file; nothing if another process has already mended it.
    ///
    /// # Errors
    /// When the store cannot be written.
    pub fn quarantine(
        plan: &Plan,
        task: usize,
        store: &Store,
        cause: StoreError,
    ) -> Result<Option<Damage>, StoreError> {
        let quarantined = store.quarantine(plan.tasks[task].key)?;
        Ok(quarantined.map(|quarantined| Damage { task, cause, quarantined }))
    }
}

/// Why a task has no table.
#[derive(Debug, thiserror::Error)]
pub enum TaskError {
    /// The work itself failed.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The input tables of a task take too much memory.
    #[error(
        "takes about {takes} of memory for the tables that it reads, more than the {room} that there is for \
         it: allow more by `--memory`, or have fewer bins, loads or surfaces"
    )]
    Inputs {
        /// Memory that they take.
        takes: String,
        /// Memory that is available.
        room: String,
    },
    /// A task computed a number that is not finite.
    #[error("{found}, and tables hold finite numbers or null; {}", match is_query {
        true => "a division by `nullif(x, 0)` gives null where x is zero",
        false => "an input may be too large or too small; if none is, please report this",
    })]
    NotFinite {
        /// The number.
        found: TableError,
        /// Whether a query computes it.
        is_query: bool,
    },
    /// Another task failed, without which it cannot be computed.
    #[error("needs task {0}, which failed")]
    Upstream(TaskKey),
    /// The system does not give the memory that the work takes.
    #[error(
        "takes {takes} of memory, which the system does not give it now: allow the process more, \
         run with fewer `--jobs`, or choose a coarser mesh"
    )]
    Memory {
        /// How much that is.
        takes: String,
    },
    /// The work panicked: a bug of ours.
    #[error("panicked: {0}; this is a bug, please report it")]
    Panic(String),
}
