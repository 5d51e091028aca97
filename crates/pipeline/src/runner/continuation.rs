//! Tables whose rows depend on the rows before them, such as the states of a path with adhesion.
//!
//! Such a table is stored as a whole. A task looks for the longest stored table with which its own
//! table [begins](asperity_stages::Stage::beginning) and continues from the last row of it. A task
//! that is interrupted stores its finished rows as such a beginning.

use std::time::Duration;

use crate::plan::Plan;
use crate::runner::row_writer::WrittenFiles;
use asperity_stages::FinishedRows;
use asperity_tables::parquet::Columns;
use asperity_tables::store::series::{FileName, TableRef};
use asperity_tables::store::{Store, StoreError};
use asperity_tables::table::Table;

/// Beginnings of the table of a running task.
pub struct Continuation<'a> {
    store: &'a Store,
    plan: &'a Plan,
    task: usize,
    /// File with the rows that the task has stored so far, unless it existed before.
    written: WrittenFiles<'a>,
}

impl<'a> Continuation<'a> {
    /// Creates the receiver of the finished rows of a task, which are due every `every`.
    pub fn new(store: &'a Store, plan: &'a Plan, task: usize, every: Duration) -> Continuation<'a> {
        Continuation { store, plan, task, written: WrittenFiles::new(store, every) }
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
        self.written.replace(Vec::new());
    }
}

impl FinishedRows for Continuation<'_> {
    fn are_due(&self) -> bool {
        self.written.are_due() && self.plan.beginning(self.task, 1).is_some()
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
        self.written.replace(vec![FileName { key, rows: None }]);
        Ok(())
    }
}
