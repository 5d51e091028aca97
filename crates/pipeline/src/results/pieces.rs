//! A stage's table, put together from those of its tasks.

use std::ops::Range;

use super::published::Lacking;
use super::{PATH, ResultsError, TASK};
use crate::plan::{Plan, PlannedStage};
use asperity_stages::columns::CONTENT;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_tables::column::{optional_texts, texts};
use asperity_tables::parquet::GROUP;
use asperity_tables::stacking::Stacking;
use asperity_tables::store::StoreError;
use asperity_tables::table::{Table, TableError};

/// Tables of a stage's finished tasks in the order of the plan. As many of them are held in memory
/// as fit there; the others are read again.
#[derive(Debug)]
pub struct Pieces {
    parts: Vec<Part>,
    stacking: Stacking,
    damaged: Vec<(usize, StoreError)>,
    /// Bytes of tables that may still be held.
    room: usize,
}

/// Tasks whose rows are stored in one table.
#[derive(Debug)]
pub struct Part {
    /// Each task with its number of rows.
    pub tasks: Vec<(usize, usize)>,
    layout: usize,
    table: Option<Table>,
}

impl Part {
    fn rows(&self) -> usize {
        self.tasks.iter().map(|(_, rows)| rows).sum()
    }
}

impl Pieces {
    /// Creates an empty collection with room for this many bytes.
    pub fn within(room: usize) -> Pieces {
        Pieces { parts: Vec::new(), stacking: Stacking::default(), damaged: Vec::new(), room }
    }

    /// Adds the rows of tasks that lie under each other in one table, so many of each.
    pub fn add_all(&mut self, tasks: &[usize], rows: &[usize], table: Table) {
        let bytes = table.bytes_held();
        let is_held = bytes <= self.room;
        if is_held {
            self.room -= bytes;
        }
        self.parts.push(Part {
            tasks: tasks.iter().copied().zip(rows.iter().copied()).collect(),
            layout: self.stacking.add(&table),
            table: is_held.then_some(table),
        });
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
        self.parts.is_empty() && self.damaged.is_empty()
    }

    /// Returns the tasks.
    ///
    /// # Errors
    /// When tables are damaged.
    pub fn tasks(&mut self) -> Result<Vec<usize>, ResultsError> {
        if !self.damaged.is_empty() {
            let tables = std::mem::take(&mut self.damaged);
            return Err(ResultsError::Damaged { tables });
        }
        let tasks = self.parts.iter().flat_map(|part| &part.tasks);
        Ok(tasks.map(|(task, _)| *task).collect())
    }

    /// Returns the columns that the tables of some tasks lack.
    pub fn lacking(&self) -> Lacking {
        let parts = self.parts.iter().map(|part| (part.layout, part.rows()));
        Lacking::of(&self.stacking, &parts.collect::<Vec<_>>())
    }

    /// The number of all rows.
    pub fn rows(&self) -> usize {
        self.parts.iter().map(Part::rows).sum()
    }

    /// Stacks all rows, which must be held in memory.
    ///
    /// # Errors
    /// When tables are damaged, or contradict each other.
    pub fn stacked(
        mut self,
        plan: &Plan,
        stage: &PlannedStage,
        sources: &SurfaceFiles,
    ) -> Result<(Vec<usize>, Option<Table>), ResultsError> {
        let tasks = self.tasks()?;
        let frame = Frame { plan, stage, sources };
        let all = self.rows();
        let mut groups = self.tables(frame, all.max(1), |_| unreachable!("all tables are held"));
        let table = groups.next().transpose()?.filter(|_| !tasks.is_empty());
        Ok((tasks, table))
    }

    /// Stacks rows into row groups, each row with the key of its task. Yields at least one table,
    /// which may be empty. `read` reads the tables that are not held.
    pub fn groups<'a>(
        self,
        frame: Frame<'a>,
        read: impl FnMut(&Part) -> Result<Table, ResultsError> + 'a,
    ) -> impl Iterator<Item = Result<Table, ResultsError>> + 'a {
        self.tables(frame, GROUP, read)
    }

    fn tables<'a>(
        self,
        frame: Frame<'a>,
        most: usize,
        mut read: impl FnMut(&Part) -> Result<Table, ResultsError> + 'a,
    ) -> impl Iterator<Item = Result<Table, ResultsError>> + 'a {
        let Pieces { parts, stacking, .. } = self;
        let mut parts = parts.into_iter();
        let mut rest: Option<Rows> = None;
        let mut is_first = true;
        std::iter::from_fn(move || {
            let (mut group, mut left) = (Vec::new(), most);
            while left > 0 {
                let next = match rest.take() {
                    Some(rows) => rows,
                    None => match parts.next() {
                        Some(mut part) => {
                            let table = part.table.take().map_or_else(|| read(&part), Ok);
                            match table {
                                Ok(table) => frame.rows(part, table),
                                Err(error) => return Some(Err(error)),
                            }
                        }
                        None => break,
                    },
                };
                let count = next.table.rows().min(left);
                left -= count;
                rest = (count < next.table.rows()).then(|| next.slice(count..next.table.rows()));
                group.push(next.slice(0..count));
            }
            let is_over = group.is_empty() && !is_first;
            is_first = false;
            (!is_over).then(|| frame.stacked(&stacking, group))
        })
    }
}

/// Rows of a stage with the keys of their tasks.
struct Rows {
    layout: usize,
    table: Table,
    keys: Table,
}

impl Rows {
    fn slice(&self, rows: Range<usize>) -> Rows {
        Rows {
            layout: self.layout,
            table: self.table.slice(rows.clone()),
            keys: self.keys.slice(rows),
        }
    }
}

/// Context in which rows are completed by the keys of their tasks and the paths of surface files.
#[derive(Clone, Copy)]
pub struct Frame<'a> {
    /// All tasks.
    pub plan: &'a Plan,
    /// The stage whose table is put together.
    pub stage: &'a PlannedStage,
    /// The files of measured surfaces.
    pub sources: &'a SurfaceFiles,
}

impl Frame<'_> {
    fn rows(self, part: Part, table: Table) -> Rows {
        let keys = part.tasks.iter().flat_map(|(task, rows)| {
            let key = self.plan.tasks[*task].key.to_string();
            std::iter::repeat_n(key, *rows)
        });
        Rows {
            layout: part.layout,
            keys: Table::new(table.rows(), vec![(TASK, texts(keys))]),
            table,
        }
    }

    fn stacked(self, stacking: &Stacking, rows: Vec<Rows>) -> Result<Table, ResultsError> {
        let contradiction =
            |source: TableError| ResultsError::Table { stage: self.stage.name.clone(), source };
        let (tables, keys): (Vec<(usize, Table)>, Vec<Table>) =
            rows.into_iter().map(|rows| ((rows.layout, rows.table), rows.keys)).unzip();
        let table = stacking.stack(&tables).map_err(contradiction)?;
        let keys = match keys.is_empty() {
            true => Table::empty(&[TASK]),
            false => Table::stack(&keys).map_err(contradiction)?,
        };
        Ok(with_paths(table, self.sources).beside(&keys))
    }
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
