//! Outcome of a run: computed, damaged and failed tasks.

use std::path::PathBuf;

use asperity_stages::StageError;
use asperity_tables::key::TaskKey;
use asperity_tables::store::{DamagedFile, Store, StoreError};
use asperity_tables::table::TableError;

/// Outcome of running a plan. Tasks are given by their keys, which stay the same when the study
/// grows.
#[derive(Debug, Default)]
pub struct RunOutcome {
    pub computed: Vec<TaskKey>,
    /// Tasks that could not be computed, and the reasons.
    pub failed: Vec<(TaskKey, TaskError)>,
    pub damaged: Vec<Damage>,
    pub interrupted: bool,
    /// True if the run stopped because tables could not be stored.
    pub halted: bool,
}

impl RunOutcome {
    /// Adds the outcome of a later run.
    pub fn append(&mut self, later: RunOutcome) {
        self.computed.extend(later.computed);
        self.failed.extend(later.failed);
        self.damaged.extend(later.damaged);
        self.interrupted |= later.interrupted;
        self.halted |= later.halted;
    }
}

/// A damaged table that is recomputed.
#[derive(Debug)]
pub struct Damage {
    /// Key of the table.
    pub table: TaskKey,
    pub cause: StoreError,
    /// New path of the damaged file, or `None` if the file is in a read-only store.
    pub quarantined: Option<PathBuf>,
}

impl Damage {
    /// Sets all damaged files of a table aside: quarantines them, or ignores them if they are in a
    /// read-only store. `cause` is the error of reading the table, if it was read.
    pub fn set_aside(
        table: TaskKey,
        store: &Store,
        cause: Option<StoreError>,
    ) -> Result<Vec<Damage>, StoreError> {
        // The file of such an error is ignored already.
        let in_layer = cause.filter(|cause| matches!(cause, StoreError::InLayer(_)));
        let ignored = in_layer.map(|cause| DamagedFile { cause, quarantined: None });
        let found = ignored.into_iter().chain(store.set_damaged_aside(table)?);
        let damage =
            found.map(|DamagedFile { cause, quarantined }| Damage { table, cause, quarantined });
        Ok(damage.collect())
    }
}

/// Reason why a task failed or was not started.
#[derive(Debug, thiserror::Error)]
pub enum TaskError {
    #[error(transparent)]
    Stage(#[from] StageError),
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The input tables take too much memory.
    #[error(
        "needs about {takes} of memory for the tables that it reads, more than the {room} \
         available: increase `--memory`, or reduce the number of bins, loads or surfaces"
    )]
    Inputs { takes: String, room: String },
    /// The result contains a number that is not finite.
    #[error("{found}, but tables hold only finite numbers and nulls; {}", if *is_query {
        "divide by `nullif(x, 0)` to get null where x is zero"
    } else {
        "check for inputs that are too large or too small, or report this as a bug"
    })]
    NotFinite { found: TableError, is_query: bool },
    /// A task that this one depends on has failed.
    #[error("needs task {0}, which failed")]
    Upstream(TaskKey),
    /// The system does not provide the memory that the task needs.
    #[error(
        "needs {takes} of memory, which the system does not provide now: raise the memory limit of \
         the process, use fewer `--jobs`, or choose a coarser mesh"
    )]
    Memory { takes: String },
    /// The task panicked, which is a bug of asperity.
    #[error("panicked: {0}; this is a bug, please report it")]
    Panic(String),
}
