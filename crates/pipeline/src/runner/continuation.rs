//! Tables whose rows depend on the rows before them, such as the states of a path with adhesion.
//!
//! Such a table is stored as a whole. A task looks for the longest stored table with which its own
//! table [begins](asperity_stages::Stage::beginning) and continues from the last row of it. A task
//! that is interrupted stores its finished rows as such a beginning.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::plan::Plan;
use asperity_stages::FinishedRows;
use asperity_tables::parallel::locked;
use asperity_tables::parquet::Columns;
use asperity_tables::store::series::{FileName, TableRef};
use asperity_tables::store::{Store, StoreError};
use asperity_tables::table::Table;

/// Beginnings of the table of a running task.
pub struct Continuation<'a> {
    store: &'a Store,
    plan: &'a Plan,
    task: usize,
    every: Duration,
    written: Mutex<Written>,
}

struct Written {
    /// Time at which rows were stored last, or at which the task started.
    last: Instant,
    /// File with the rows that the task has stored so far, unless it existed before.
    file: Option<FileName>,
}

impl<'a> Continuation<'a> {
    /// Creates the receiver of the finished rows of a task, which are due every `every`.
    pub fn new(store: &'a Store, plan: &'a Plan, task: usize, every: Duration) -> Continuation<'a> {
        let written = Mutex::new(Written { last: Instant::now(), file: None });
        Continuation { store, plan, task, every, written }
    }

    /// Reads the longest beginning that is stored. A beginning that cannot be read counts as not
    /// stored, because the task can compute it again.
    pub fn stored(&self) -> Option<Table> {
        let (_, table) = self.plan.stored_beginning(self.task, self.store)?;
        self.store.read(&table, Columns::All).ok()
    }

    /// Removes the rows that the task has stored while it was running, because its table is stored
    /// now.
    pub fn finish(&self) {
        if let Some(file) = locked(&self.written).file.take() {
            self.store.remove_superseded(&file);
        }
    }
}

impl FinishedRows for Continuation<'_> {
    fn are_due(&self) -> bool {
        locked(&self.written).last.elapsed() >= self.every
            && self.plan.beginning(self.task, 1).is_some()
    }

    fn keep(&self, _: &[f64], rows: &Table) -> Result<(), StoreError> {
        let Some(beginning) = self.plan.beginning(self.task, rows.rows()) else {
            return Ok(());
        };
        let key = beginning.key();
        if self.store.has(&TableRef::from(key)) {
            return Ok(());
        }
        self.store.publish(&beginning, rows)?;
        let mut written = locked(&self.written);
        if let Some(before) = written.file.replace(FileName { key, rows: None }) {
            self.store.remove_superseded(&before);
        }
        written.last = Instant::now();
        Ok(())
    }
}
