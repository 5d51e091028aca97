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
    ) -> Result<(Vec<usize>, Option<Stacked>), ResultsError> {
        if !self.damaged.is_empty() {
            let tables = self.damaged;
            return Err(ResultsError::Damaged { tables });
        }
        let (tasks, pieces): (Vec<usize>, Vec<Table>) = self.tables.into_iter().unzip();
        if tasks.is_empty() {
            return Ok((tasks, None));
        }
        let stacked = Table::stack(&pieces).map_err(|source| ResultsError::Table {
            stage: stage.name.clone(),
            source,
        })?;
        let lacking = Lacking::of(&pieces, &stacked);
        let keys = tasks.iter().zip(&pieces).flat_map(|(&task, piece)| {
            let key = plan.tasks[task].key.to_string();
            std::iter::repeat_n(key, piece.rows())
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
