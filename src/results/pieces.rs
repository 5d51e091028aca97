//! A stage's table, put together from those of its tasks.

use super::published::Lacking;
use super::{PATH, ResultsError, TASK};
use crate::plan::{Plan, PlannedStage};
use crate::stages::columns::CONTENT;
use crate::store::StoreError;
use crate::store::column::{optional_texts, texts};
use crate::store::table::Table;
use crate::surface_files::SurfaceFiles;

/// The tables of a stage's finished tasks, in the plan's order.
#[derive(Debug, Default)]
pub struct Pieces {
    tasks: Vec<Part>,
    tables: Vec<Table>,
    damaged: Vec<(usize, StoreError)>,
}

/// A task, and how many rows it has.
#[derive(Debug)]
struct Part {
    task: usize,
    rows: usize,
}

impl Pieces {
    /// Adds the rows of tasks that lie under each other in one table, so many of each.
    pub fn add_all(&mut self, tasks: &[usize], rows: &[usize], table: Table) {
        let parts = tasks.iter().zip(rows);
        self.tasks
            .extend(parts.map(|(&task, &rows)| Part { task, rows }));
        self.tables.push(table);
    }

    /// Adds what came of reading a task's table.
    ///
    /// # Errors
    /// When it cannot be read, and computing it again would not help.
    pub fn add(&mut self, task: usize, read: Result<Table, StoreError>) -> Result<(), StoreError> {
        match read {
            Ok(table) => self.add_all(&[task], &[table.rows()], table),
            Err(error) if error.is_mendable() => self.damaged.push((task, error)),
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Whether nothing has been added.
    pub fn is_empty(&self) -> bool {
        self.tables.is_empty() && self.damaged.is_empty()
    }

    /// The tasks, and their rows one under the other, each with the task that it came from; no
    /// table without tasks.
    ///
    /// # Errors
    /// When tables are damaged, or contradict each other.
    pub fn stacked(
        self,
        plan: &Plan,
        stage: &PlannedStage,
        sources: &SurfaceFiles,
    ) -> Result<(Vec<usize>, Option<Stacked>), ResultsError> {
        if !self.damaged.is_empty() {
            let tables = self.damaged;
            return Err(ResultsError::Damaged { tables });
        }
        let tasks: Vec<usize> = self.tasks.iter().map(|part| part.task).collect();
        if tasks.is_empty() {
            return Ok((tasks, None));
        }
        let stacked = Table::stack(&self.tables).map_err(|source| ResultsError::Table {
            stage: stage.name.clone(),
            source,
        })?;
        let lacking = Lacking::of(&self.tables, &stacked);
        let keys = self.tasks.iter().flat_map(|part| {
            let key = plan.tasks[part.task].key.to_string();
            std::iter::repeat_n(key, part.rows)
        });
        let table = with_paths(stacked, sources).with(vec![(TASK, texts(keys))]);
        Ok((tasks, Some(Stacked { table, lacking })))
    }
}

/// The rows of several tasks.
pub struct Stacked {
    /// One under the other.
    pub table: Table,
    /// Which columns the tables of some have not got.
    pub lacking: Lacking,
}

/// Names the file of measured surfaces, which no key knows.
fn with_paths(table: Table, sources: &SurfaceFiles) -> Table {
    let Ok(contents) = table.texts(CONTENT.name) else {
        return table;
    };
    let path = |content: Option<&str>| {
        let path = sources.path_of_hex(content?);
        Some(path.map_or_else(String::new, |path| path.display().to_string()))
    };
    let paths = optional_texts(contents.iter().map(path));
    table.with(vec![(PATH, paths)])
}
