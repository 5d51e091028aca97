//! What a run shall do, and with what.

use std::num::NonZeroUsize;
use std::time::Duration;

use bytesize::ByteSize;

use super::error::TaskNameError;
use super::task_names::planned;
use asperity_contact::threads::available_cores;
use asperity_pipeline::cluster::shard::Shard;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::runner;
use asperity_tables::store::Store;

/// What a run shall do, and with what. The default computes all that is missing.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// Cores to work on, one surface on each, or several cores on one where there are fewer surfaces;
    /// as many as there are when left out.
    pub jobs: Option<NonZeroUsize>,
    /// Memory to keep to, by working on fewer surfaces at once; seven eighths of what there is for
    /// the process when left out.
    pub memory: Option<ByteSize>,
    /// Which tasks to compute.
    pub selection: Selection,
    /// Whether to take the place of another manifest whose study has the same name.
    pub replace: bool,
    /// The job of a scheduler that the run belongs to, as the receipt of a shard names it.
    pub job: Option<String>,
    /// How often a long block of loads keeps how far it has come, to go on from there when its
    /// process has ended; every ten minutes when left out.
    pub checkpoint_every: Option<Duration>,
}

/// Nobody minds to compute so long again.
pub(super) const CHECKPOINT_EVERY: Duration = Duration::from_secs(600);

/// Which tasks of a study a run computes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Selection {
    /// All that the store lacks, and as many surfaces as its tables ask for.
    #[default]
    Missing,
    /// One task, even if its table is there, and what it lacks: its key, or the first digits of
    /// it.
    Task(String),
    /// What the store lacks of one part of the surfaces, as far as it hangs on one surface alone. No
    /// table of a stage is written, but a receipt.
    Shard(Shard),
}

impl RunOptions {
    /// Cores to work on.
    pub(super) fn cores(&self) -> NonZeroUsize {
        self.jobs.unwrap_or_else(available_cores)
    }
}

impl Selection {
    /// The tasks that are meant, of those that the plan has by now and of which the store lacks
    /// some.
    pub(super) fn tasks(
        &self,
        plan: &Plan,
        missing: &[usize],
        store: &Store,
    ) -> Result<Vec<usize>, TaskNameError> {
        Ok(match self {
            Selection::Missing => missing.to_vec(),
            Selection::Task(key) => runner::alone(plan, planned(key, plan)?, store),
            Selection::Shard(shard) => shard.tasks(plan, missing),
        })
    }
}
