//! Read-only stores from which the finished tasks of a plan are read.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::plan::{Plan, PlannedStage};
use asperity_tables::store::Store;
use asperity_tables::store::series::Listing;

/// For each finished task of a plan, the read-only stores from which its table is read.
#[derive(Debug, Default)]
pub struct Sources {
    stores: Vec<PathBuf>,
    /// Indices of stores, by task. Empty if there are no read-only stores.
    of_tasks: Vec<BTreeSet<usize>>,
}

/// Number of finished tasks whose tables are read from a store, as a whole or in part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TasksFromStore {
    pub store: PathBuf,
    pub tasks: usize,
}

impl Sources {
    /// Finds the read-only stores of the tasks that are not in `missing`, which must be in
    /// ascending order. Tasks in a folder that cannot be listed have none.
    pub fn new(plan: &Plan, missing: &[usize], store: &Store) -> Sources {
        let stores: Vec<PathBuf> = store.layers().map(Path::to_owned).collect();
        if stores.is_empty() {
            return Sources::default();
        }
        let listing = Listing::new(store);
        let of_tasks = plan.tasks.iter().enumerate().map(|(task, planned)| {
            match missing.binary_search(&task) {
                Ok(_) => BTreeSet::new(),
                Err(_) => listing.layers_of(&planned.table).unwrap_or_default(),
            }
        });
        Sources { of_tasks: of_tasks.collect(), stores }
    }

    /// Counts the tasks of a stage that are read from each read-only store. A task that is read
    /// from two stores counts in both.
    pub fn of_stage(&self, stage: &PlannedStage) -> Vec<TasksFromStore> {
        self.counted(&stage.tasks)
    }

    /// Counts the tasks of all stages that are read from each read-only store.
    pub fn all(&self) -> Vec<TasksFromStore> {
        self.counted(&(0..self.of_tasks.len()).collect::<Vec<_>>())
    }

    /// Returns the read-only stores from which the table of a task is read.
    pub fn of_task(&self, task: usize) -> impl Iterator<Item = &Path> {
        let stores = self.of_tasks.get(task).into_iter().flatten();
        stores.map(|&store| self.stores[store].as_path())
    }

    pub fn is_empty(&self) -> bool {
        self.of_tasks.iter().all(BTreeSet::is_empty)
    }

    fn counted(&self, tasks: &[usize]) -> Vec<TasksFromStore> {
        let count = |store: usize| {
            let of_tasks = tasks.iter().filter_map(|&task| self.of_tasks.get(task));
            of_tasks.filter(|stores| stores.contains(&store)).count()
        };
        let stores = self.stores.iter().enumerate();
        let counted = stores.map(|(index, store)| (store.clone(), count(index)));
        let counts = counted.filter(|(_, tasks)| *tasks > 0);
        counts.map(|(store, tasks)| TasksFromStore { store, tasks }).collect()
    }
}
