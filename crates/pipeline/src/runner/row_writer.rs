//! Writer of the rows of a running task.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::plan::Plan;
use crate::plan::missing_rows::RowGroup;
use asperity_stages::FinishedRows;
use asperity_tables::parallel::locked;
use asperity_tables::store::provenance::Provenance;
use asperity_tables::store::series::{FileName, Part};
use asperity_tables::store::{Store, StoreError};
use asperity_tables::table::Table;

/// Writer of the rows of a group, also while the task is running.
pub struct RowWriter<'a> {
    store: &'a Store,
    provenance: Provenance,
    column: &'static str,
    group: &'a RowGroup,
    written: WrittenFiles<'a>,
}

/// Files that a running task has written so far.
pub struct WrittenFiles<'a> {
    store: &'a Store,
    every: Duration,
    /// Time at which rows were stored last, or at which the task started, and the files.
    state: Mutex<(Instant, Vec<FileName>)>,
}

impl<'a> WrittenFiles<'a> {
    /// Creates the empty list. Finished rows are due every `every`.
    pub fn new(store: &'a Store, every: Duration) -> WrittenFiles<'a> {
        WrittenFiles { store, every, state: Mutex::new((Instant::now(), Vec::new())) }
    }

    pub fn are_due(&self) -> bool {
        locked(&self.state).0.elapsed() >= self.every
    }

    /// Replaces the files by others, which have their rows, and removes them.
    pub fn replace(&self, files: Vec<FileName>) {
        let mut state = locked(&self.state);
        for file in state.1.iter().filter(|file| !files.contains(file)) {
            self.store.remove_superseded(file);
        }
        *state = (Instant::now(), files);
    }
}

impl<'a> RowWriter<'a> {
    /// Creates the writer of a group of rows of a task. Finished rows are due every `every`.
    pub fn new(
        store: &'a Store,
        plan: &Plan,
        task: usize,
        column: &'static str,
        group: &'a RowGroup,
        every: Duration,
    ) -> RowWriter<'a> {
        let written = WrittenFiles::new(store, every);
        RowWriter { store, provenance: plan.provenance(task), column, group, written }
    }

    /// Stores the rows with these values, and removes the files that this writer wrote before,
    /// because their rows are among these.
    ///
    /// # Errors
    /// Returns an error if the disk is full or the folder is not writable.
    pub fn write(&self, values: &[f64], rows: &Table) -> Result<(), StoreError> {
        let mut files = Vec::new();
        let mut publish = |part: Option<&Part>, table: &Table| {
            let file =
                self.store.publish_rows(&self.provenance, self.column, values, part, table)?;
            files.push(file);
            Ok::<_, StoreError>(())
        };
        // Parts come first: rows count as stored once the columns of all rows are there.
        let parts = &self.group.parts;
        for part in parts {
            let columns: Vec<&str> =
                [self.column].into_iter().chain(part.columns.clone()).collect();
            publish(Some(part), &rows.only(&columns))?;
        }
        if self.group.is_new {
            let of_parts: Vec<&str> =
                parts.iter().flat_map(|part| part.columns.iter().copied()).collect();
            publish(None, &rows.without(&of_parts))?;
        }
        self.written.replace(files);
        Ok(())
    }
}

impl FinishedRows for RowWriter<'_> {
    fn are_due(&self) -> bool {
        self.written.are_due()
    }

    fn keep(&self, values: &[f64], rows: &Table) -> Result<(), StoreError> {
        if values.is_empty() { Ok(()) } else { self.write(values, rows) }
    }
}
