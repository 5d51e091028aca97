//! Publisher of the results of a study, which writes one table per stage.

use std::fs::File;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use bytesize::ByteSize;

use crate::adaptive_sampling::SampledStudy;
use crate::plan::{Plan, PlannedStage};
use crate::results::owner::{self, Owner};
use crate::results::published_stage::{KIND, MISSING_COLUMNS, MissingColumns, PARTS, light_parts};
use crate::results::reader::ResultReader;
use crate::results::{CONVERTED, ResultsError, TASK, described, digest, file};
use crate::study::EmptyTables;
use asperity_stages::absolute::AbsoluteColumns;
use asperity_stages::output_units::Conversion;
use asperity_stages::surface::labels::with_paths;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::units::TableUnits;
use asperity_tables::column::{Description, texts};
use asperity_tables::key::{Digest, TaskKey};
use asperity_tables::parquet;
use asperity_tables::parquet::{GROUP, Metadata};
use asperity_tables::source::TableSource;
use asperity_tables::store::files::{
    flush_folder, lock_to_write, make_folder, quarantine, write_with,
};
use asperity_tables::store::{Store, StoreError, TaskTables};
use asperity_tables::table::{Stacking, Table, TableError};

/// Published table of a stage, with its number of finished tasks.
#[derive(Debug)]
pub struct PublishedTable {
    pub stage: String,
    pub path: PathBuf,
    pub finished: usize,
    /// New path of a file that had the name of the table but was not written by a run, and was
    /// therefore moved.
    pub quarantined: Option<PathBuf>,
}

impl PublishedTable {
    /// Opens the table without reading its rows.
    pub fn open(&self) -> Result<TableSource, StoreError> {
        Ok(TableSource::open(&self.path)?.0)
    }

    pub fn read(&self) -> Result<Table, StoreError> {
        self.open()?.table()
    }
}

/// Writes the table of each stage that has finished tasks, unless the same table exists.
///
/// The manifest becomes the owner of the folder. If the store has lost the table of a task, its
/// published rows are kept. At most half of `room` is used to hold rows in memory.
pub fn publish(
    sampled: &SampledStudy,
    store: &Store,
    manifest: &Path,
    folder: &Path,
    room: ByteSize,
) -> Result<Vec<PublishedTable>, ResultsError> {
    let folder = folder.join(&sampled.plan.study);
    let publisher = Publisher {
        sampled,
        empty_tables: EmptyTables::new(&sampled.study),
        reader: ResultReader::new(store.clone(), &folder),
        manifest,
        folder,
        room: usize::try_from(room.0 / 2).unwrap_or(usize::MAX),
    };
    let mut damaged = Vec::new();
    let mut published = Vec::new();
    for stage in &sampled.plan.stages {
        match publisher.publish(stage) {
            Ok(table) => published.push(table),
            Err(ResultsError::Damaged { tables }) => damaged.extend(tables),
            Err(error) => return Err(error),
        }
    }
    if published.iter().any(|table| table.finished > 0) {
        // The error is ignored: if all tables exist, the folder need not be writable.
        let _ = publisher.own();
    }
    if damaged.is_empty() { Ok(published) } else { Err(ResultsError::Damaged { tables: damaged }) }
}

/// Writer of the published tables of a study.
struct Publisher<'a> {
    sampled: &'a SampledStudy,
    empty_tables: EmptyTables,
    reader: ResultReader,
    manifest: &'a Path,
    folder: PathBuf,
    /// Maximum size in bytes of the tables that are held in memory.
    room: usize,
}

impl Publisher<'_> {
    /// Records the manifest as the owner of the folder.
    fn own(&self) -> Result<(), StoreError> {
        make_folder(&self.folder)?;
        let SampledStudy { study, plan, .. } = self.sampled;
        Owner::new(self.manifest, study, plan, &self.folder).write(&self.folder)?;
        owner::write_effective_manifest(&study.manifest, &self.folder)
    }

    /// Writes the table of one stage if it has finished tasks, unless the same table exists.
    fn publish(&self, stage: &PlannedStage) -> Result<PublishedTable, ResultsError> {
        let SampledStudy { study, plan, .. } = self.sampled;
        let (description, absolute) = &described(&self.empty_tables, study, &stage.name)?;
        let (sources, conversion) = (&study.sources, &study.conversion(&stage.name));
        let context = RowContext { plan, stage, sources, description, absolute, conversion };
        let path = self.folder.join(file(&stage.name));
        let table = |finished| PublishedTable {
            stage: stage.name.clone(),
            path: path.clone(),
            finished,
            quarantined: None,
        };
        let digest_of = |tasks: &[usize]| digest(context, tasks);
        let there = written_for(&path);
        let is_there = |digest: &String| there.as_ref() == Some(digest);
        let has_rows_of = |tasks: &[usize]| !tasks.is_empty() && is_there(&digest_of(tasks));
        // The store is not listed if nothing has changed.
        if has_rows_of(&stage.tasks) {
            return Ok(table(stage.tasks.len()));
        }
        let have = self.reader.store().have(&plan.tables_of(stage));
        let stored = stage.tasks_where(&have);
        if has_rows_of(&stored) {
            return Ok(table(stored.len()));
        }
        let (mut parts, kept) = self.parts(stage, &have)?;
        if stored.is_empty() {
            return Ok(table(kept.len()));
        }
        let tasks = parts.tasks()?;
        let digest = if kept.is_empty() {
            digest_of(&tasks)
        } else {
            // With another digest, the table is rewritten once the store has all its tasks.
            Digest::from_params(&(digest_of(&tasks), &kept)).to_string()
        };
        let mut published = table(tasks.len());
        if !tasks.is_empty() && !is_there(&digest) {
            published.quarantined = self.write(context, &path, parts, &kept, digest)?;
        }
        Ok(published)
    }

    /// Writes the table of a stage, one row group at a time. `kept` has the keys of the tasks that
    /// only the old published table has.
    ///
    /// If the existing file at `path` was not written by a run, it is quarantined, and its new path
    /// is returned.
    fn write(
        &self,
        context: RowContext,
        path: &Path,
        mut parts: TableParts,
        kept: &[TaskKey],
        digest: String,
    ) -> Result<Option<PathBuf>, ResultsError> {
        let RowContext { plan, stage, .. } = context;
        let (finished, missing, rows) = (parts.tasks()?.len(), parts.missing(), parts.rows());
        let mut groups =
            parts.tables(context, GROUP, |part| Ok(self.read_again(stage, part, kept)?));
        let Some(first) = groups.next().transpose()? else {
            return Ok(None);
        };
        let columns = first.descriptions_in_units();
        let mut metadata = metadata(plan, stage, &columns, &missing, finished, digest);
        if !context.conversion.is_none() {
            let TableUnits { length, pressure } = &context.conversion.from;
            let stored = serde_json::to_string(&(length, pressure)).expect("units are texts");
            metadata.entries.push((CONVERTED.to_owned(), stored));
        }
        self.own()?;
        // Keep other runs on this machine from replacing tables meanwhile.
        let _alone = lock_to_write(&self.folder);
        // A user may have edited the table, but another run may also have replaced it since it was
        // checked.
        let quarantined =
            if written_for(path).is_none() && path.is_file() { quarantine(path)? } else { None };
        let mut unread = None;
        let written = write_with(path, &self.folder, |file| {
            let rest = groups.map_while(|group| group.map_err(|error| unread = Some(error)).ok());
            let parts = std::iter::once(first).chain(rest);
            parquet::write_parts(file, rows, &metadata, parts)?;
            match &unread {
                None => Ok(()),
                Some(error) => Err(io::Error::other(error.to_string())),
            }
        });
        match unread {
            Some(error) => return Err(error),
            None => written?,
        }
        flush_folder(&self.folder)?;
        Ok(quarantined)
    }

    /// Rereads the rows of a part that did not fit into memory when it was first read. `kept` has
    /// the keys of the tasks that only the published table has.
    fn read_again(
        &self,
        stage: &PlannedStage,
        part: &TablePart,
        kept: &[TaskKey],
    ) -> Result<Table, StoreError> {
        let tables = part.tasks.iter().map(|&(task, _)| &self.sampled.plan.tasks[task].table);
        let first = &self.sampled.plan.tasks[part.tasks[0].0];
        if kept.contains(&first.key) {
            return self.reader.light(&first.table);
        }
        match self.reader.published_consecutive(&stage.name, tables) {
            Some((_, table)) => Ok(table),
            None => self.reader.stored(&first.table),
        }
    }

    /// Reads the rows of the finished tasks of a stage; `have` states for each task whether the
    /// store has its table. Also returns the keys of the tasks that only the published table has.
    ///
    /// Published rows are used where possible, because they take fewer reads than the store.
    fn parts(
        &self,
        stage: &PlannedStage,
        have: &[bool],
    ) -> Result<(TableParts, Vec<TaskKey>), StoreError> {
        let (mut parts, mut kept) = (TableParts::within(self.room), Vec::new());
        let planned = &self.sampled.plan.tasks;
        let mut next = 0;
        while let Some(&task) = stage.tasks.get(next) {
            next += 1;
            if have[next - 1] {
                let following = stage.tasks.iter().zip(have).skip(next - 1);
                let stored =
                    following.map_while(|(&task, stored)| stored.then_some(&planned[task].table));
                if let Some((rows, table)) = self.reader.published_consecutive(&stage.name, stored)
                {
                    let tasks = &stage.tasks[next - 1..][..rows.len()];
                    parts.add_all(tasks, &rows, table);
                    next += rows.len() - 1;
                } else {
                    parts.add(task, self.reader.stored(&planned[task].table))?;
                }
            } else if let Some(rows) = self.reader.rows_of(&planned[task].table) {
                parts.add(task, Ok(rows))?;
                kept.push(planned[task].key);
            }
        }
        Ok((parts, kept))
    }
}

/// Returns the metadata of a published table. They include the descriptions of the columns as JSON,
/// because not every reader of Parquet provides the metadata of Arrow fields.
fn metadata(
    plan: &Plan,
    stage: &PlannedStage,
    columns: &[Description],
    missing: &MissingColumns,
    finished: usize,
    digest: String,
) -> Metadata {
    let entry = |name: &str, value: String| (name.to_owned(), value);
    let json = "names, words and numbers are plain data";
    let columns = serde_json::to_string(columns).expect(json);
    let missing = serde_json::to_string(missing).expect(json);
    Metadata {
        key: None,
        entries: vec![
            entry("study", plan.study.clone()),
            entry("stage", stage.name.clone()),
            entry(KIND, stage.kind.name().to_owned()),
            entry("tasks", stage.tasks.len().to_string()),
            entry("finished", finished.to_string()),
            entry("columns", columns),
            entry(MISSING_COLUMNS, missing),
            entry(PARTS, parts_of(plan, stage)),
            entry("digest", digest),
            entry("version", env!("CARGO_PKG_VERSION").to_owned()),
        ],
    }
}

/// Returns the names of the parts of rows whose columns the table of a stage has, if all of its
/// tasks have the same ones.
fn parts_of(plan: &Plan, stage: &PlannedStage) -> String {
    let mut parts = stage.tasks.iter().map(|&task| light_parts(&plan.tasks[task].table));
    let first = parts.next().unwrap_or_default();
    if parts.all(|other| other == first) { first } else { "various".to_owned() }
}

fn written_for(path: &Path) -> Option<String> {
    let metadata = parquet::verify(File::open(path).ok()?).ok()?;
    metadata.get("digest").map(str::to_owned)
}

/// Tables of the finished tasks of a stage, in the order of the plan. As many as fit are held in
/// memory, and the others are reread when needed.
#[derive(Debug)]
pub struct TableParts {
    parts: Vec<TablePart>,
    stacking: Stacking,
    damaged: Vec<(usize, StoreError)>,
    /// Number of bytes that further tables in memory may take.
    room: usize,
}

/// Table with the rows of one task or of several consecutive tasks.
#[derive(Debug)]
pub struct TablePart {
    /// Each task with its number of rows, in the order of the rows.
    pub tasks: Vec<(usize, usize)>,
    layout: usize,
    table: Option<Table>,
}

impl TablePart {
    fn rows(&self) -> usize {
        self.tasks.iter().map(|(_, rows)| rows).sum()
    }
}

impl TableParts {
    /// Creates an empty collection that holds at most `room` bytes in memory.
    pub fn within(room: usize) -> TableParts {
        TableParts { parts: Vec::new(), stacking: Stacking::default(), damaged: Vec::new(), room }
    }

    /// Adds a table with the rows of several tasks; `rows` has the number of rows of each task.
    pub fn add_all(&mut self, tasks: &[usize], rows: &[usize], table: Table) {
        let bytes = table.bytes_held();
        let is_held = bytes <= self.room;
        if is_held {
            self.room -= bytes;
        }
        self.parts.push(TablePart {
            tasks: tasks.iter().copied().zip(rows.iter().copied()).collect(),
            layout: self.stacking.add(&table),
            table: is_held.then_some(table),
        });
    }

    /// Adds the result of reading the table of a task. A damaged table is recorded as such.
    ///
    /// # Errors
    /// Returns an error if the table cannot be read and recomputing it would not help.
    pub fn add(&mut self, task: usize, read: Result<Table, StoreError>) -> Result<(), StoreError> {
        match read {
            Ok(table) => self.add_all(&[task], &[table.rows()], table),
            Err(error) if error.is_recomputable() => self.damaged.push((task, error)),
            Err(error) => return Err(error),
        }
        Ok(())
    }

    pub fn is_empty(&self) -> bool {
        self.parts.is_empty() && self.damaged.is_empty()
    }

    /// Returns the tasks in the order in which they were added.
    ///
    /// # Errors
    /// Returns an error if tables are damaged.
    pub fn tasks(&mut self) -> Result<Vec<usize>, ResultsError> {
        if !self.damaged.is_empty() {
            let tables = std::mem::take(&mut self.damaged);
            return Err(ResultsError::Damaged { tables });
        }
        let tasks = self.parts.iter().flat_map(|part| &part.tasks);
        Ok(tasks.map(|(task, _)| *task).collect())
    }

    /// Returns the columns that some of the tables lack.
    pub fn missing(&self) -> MissingColumns {
        let parts = self.parts.iter().map(|part| (part.layout, part.rows()));
        MissingColumns::new(&self.stacking, &parts.collect::<Vec<_>>())
    }

    /// Returns the total number of rows.
    pub fn rows(&self) -> usize {
        self.parts.iter().map(TablePart::rows).sum()
    }

    /// Returns the tasks, and all rows as one table. All tables must be held in memory.
    ///
    /// # Errors
    /// Returns an error if tables are damaged or contradict each other.
    pub fn stacked(
        mut self,
        context: RowContext,
    ) -> Result<(Vec<usize>, Option<Table>), ResultsError> {
        let tasks = self.tasks()?;
        let all = self.rows();
        let mut groups = self.tables(context, all.max(1), |_| unreachable!("all tables are held"));
        let table = groups.next().transpose()?.filter(|_| !tasks.is_empty());
        Ok((tasks, table))
    }

    /// Returns the rows as a sequence of tables with at most `most` rows. Each row has the key of
    /// its task. There is at least one table, which may be empty. `read` reads a part that is not
    /// held in memory.
    fn tables<'a>(
        self,
        context: RowContext<'a>,
        most: usize,
        mut read: impl FnMut(&TablePart) -> Result<Table, ResultsError> + 'a,
    ) -> impl Iterator<Item = Result<Table, ResultsError>> + 'a {
        let TableParts { parts, stacking, .. } = self;
        let mut waiting = parts.into_iter();
        let mut rest: Option<KeyedRows> = None;
        let mut is_first = true;
        std::iter::from_fn(move || {
            let (mut group, mut left) = (Vec::new(), most);
            while left > 0 {
                let next = match rest.take() {
                    Some(rows) => rows,
                    None => match waiting.next() {
                        Some(mut part) => {
                            let table = part.table.take().map_or_else(|| read(&part), Ok);
                            match table {
                                Ok(table) => context.rows(part, table),
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
            (!is_over).then(|| context.stacked(&stacking, group))
        })
    }
}

/// Rows of a stage, and a table of the same length with the keys of their tasks.
struct KeyedRows {
    layout: usize,
    table: Table,
    keys: Table,
}

impl KeyedRows {
    fn slice(&self, rows: Range<usize>) -> KeyedRows {
        KeyedRows {
            layout: self.layout,
            table: self.table.slice(rows.clone()),
            keys: self.keys.slice(rows),
        }
    }
}

/// Information for adding absolute numbers, paths of surface files and the keys of tasks to rows.
#[derive(Clone, Copy)]
pub struct RowContext<'a> {
    pub plan: &'a Plan,
    pub stage: &'a PlannedStage,
    pub sources: &'a SurfaceFiles,
    /// Published table of the stage without rows, whose columns have units and meanings.
    pub description: &'a Table,
    pub absolute: &'a AbsoluteColumns,
    /// Conversion to the units of output.
    pub conversion: &'a Conversion,
}

impl RowContext<'_> {
    fn rows(self, part: TablePart, table: Table) -> KeyedRows {
        let keys = part.tasks.iter().flat_map(|(task, rows)| {
            let key = self.plan.tasks[*task].table.key.to_string();
            std::iter::repeat_n(key, *rows)
        });
        KeyedRows {
            layout: part.layout,
            keys: Table::new(table.rows(), vec![(TASK, texts(keys))]),
            table,
        }
    }

    fn stacked(self, stacking: &Stacking, rows: Vec<KeyedRows>) -> Result<Table, ResultsError> {
        let contradiction =
            |source: TableError| ResultsError::Table { stage: self.stage.name.clone(), source };
        let (tables, keys): (Vec<(usize, Table)>, Vec<Table>) =
            rows.into_iter().map(|rows| ((rows.layout, rows.table), rows.keys)).unzip();
        let table = stacking.stack(&tables).map_err(contradiction)?;
        let keys = if keys.is_empty() {
            Table::empty(&[TASK])
        } else {
            Table::stack(&keys).map_err(contradiction)?
        };
        let labelled = self.plan.labels.published(table, self.description);
        let described = self.absolute.beside(&labelled).described_by(self.description);
        Ok(with_paths(self.conversion.table(&described), self.sources).beside(&keys))
    }
}
