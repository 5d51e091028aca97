//! A stage's table, put together from those of its tasks.

use super::{PATH, ResultsError, TASK};
use crate::plan::{Plan, PlannedStage};
use crate::stages::columns::CONTENT;
use crate::store::StoreError;
use crate::store::column::texts;
use crate::store::table::Table;
use crate::surface_files::SurfaceFiles;

/// The tables of a stage's finished tasks, in the plan's order.
#[derive(Debug, Default)]
pub struct Pieces {
    tables: Vec<(usize, Table)>,
    damaged: Vec<(usize, StoreError)>,
}

impl Pieces {
    /// Adds what came of reading a task's table.
    ///
    /// # Errors
    /// When it cannot be read, and computing it again would not help.
    pub fn add(&mut self, task: usize, read: Result<Table, StoreError>) -> Result<(), StoreError> {
        match read {
            Ok(table) => self.tables.push((task, table)),
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
    ) -> Result<(Vec<usize>, Option<Table>), ResultsError> {
        if !self.damaged.is_empty() {
            let tables = self.damaged;
            return Err(ResultsError::Damaged { tables });
        }
        let tables = self.tables.iter().map(|(task, table)| {
            let key = plan.tasks[*task].key.to_string();
            let keys = std::iter::repeat_n(key, table.rows());
            with_paths(table.clone(), sources).with(vec![(TASK, texts(keys))])
        });
        let tables: Vec<Table> = tables.collect();
        let stacked = (!tables.is_empty()).then(|| Table::stack(&tables));
        let stacked = stacked.transpose().map_err(|source| ResultsError::Table {
            stage: stage.name.clone(),
            source,
        })?;
        let tasks = self.tables.into_iter().map(|(task, _)| task);
        Ok((tasks.collect(), stacked))
    }
}

/// Names the file of measured surfaces, which no key knows.
fn with_paths(table: Table, sources: &SurfaceFiles) -> Table {
    let Ok(contents) = table.texts(CONTENT.name) else {
        return table;
    };
    let paths = contents
        .iter()
        .map(|content| content.and_then(|hash| sources.path_of_hex(hash)))
        .map(|path| {
            path.map(|path| path.display().to_string())
                .unwrap_or_default()
        });
    let paths = texts(paths.collect::<Vec<_>>());
    table.with(vec![(PATH, paths)])
}
