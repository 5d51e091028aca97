//! Runner that computes the tables that the store lacks. Each task gets one core, or several cores
//! if there are fewer tasks than cores.
//!
//! A task starts when its inputs are finished and enough memory is free. If a task fails, the tasks
//! that depend on it are not started; all others continue. Results depend neither on the order of
//! tasks nor on their number of cores. If a table in the store turns out to be damaged, it is
//! quarantined and recomputed.

mod continuation;
mod queue;
mod row_writer;

use std::collections::BTreeSet;
use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use bytesize::ByteSize;
use continuation::Continuation;
use queue::{BusySeries, MemoryBudget, Ready, ReadyTasks};
use row_writer::RowWriter;

use crate::forecast::memory;
use crate::outcome::{Damage, RunOutcome, TaskError};
use crate::plan::{Plan, Task, missing_rows};
use crate::results::reader::ResultReader;
use asperity_manifest::diagnostics::words_of_panic;
use asperity_mechanics::threads::Threads;
use asperity_stages::surface::labels::{PATH, with_paths};
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::{Context, FinishedRows, Input, InputScope, Recipe, StageError};
use asperity_tables::parallel::{self, locked};
use asperity_tables::parquet::Columns;
use asperity_tables::store::series::{SeriesRows, TableRef};
use asperity_tables::store::{Store, StoreError};
use asperity_tables::table::Table;

/// Observer of task progress.
pub trait TaskObserver: Sync {
    /// Reports that a task has started.
    fn started(&self, task: usize);
    /// Reports the fraction of a task that is finished, from 0 to 1.
    fn advanced(&self, task: usize, share: f64);
    /// Reports that a task has finished or failed. `helped` is the time that other cores have spent
    /// on it, in addition to the core on which the task runs.
    fn finished(&self, task: usize, helped: Duration);
}

/// Returns the tasks whose tables, or rows of them, the store lacks.
pub fn missing(plan: &Plan, store: &Store) -> Vec<usize> {
    let tables: Vec<&TableRef> = plan.tasks.iter().map(|task| &task.table).collect();
    let have = store.have(&tables).into_iter().enumerate();
    have.filter_map(|(task, is_there)| (!is_there).then_some(task)).collect()
}

/// Returns `tasks` and all tasks without a table that they depend on, directly or indirectly.
pub fn with_missing_inputs(plan: &Plan, tasks: &[usize], store: &Store) -> Vec<usize> {
    let mut wanted: BTreeSet<usize> = tasks.iter().copied().collect();
    let mut next = tasks.to_vec();
    while let Some(task) = next.pop() {
        for &input in &plan.tasks[task].inputs {
            if !store.has(&plan.tasks[input].table) && wanted.insert(input) {
                next.push(input);
            }
        }
    }
    wanted.into_iter().collect()
}

/// Resources of the machine that a run may use.
#[derive(Debug, Clone, Copy)]
pub struct Resources {
    /// Number of cores, at least one for each running task.
    pub cores: NonZeroUsize,
    /// Memory that the running tasks may take together.
    pub room: ByteSize,
    /// Interval at which a long task stores its finished rows.
    pub store_rows_every: Duration,
}

/// Computes the tasks `missing`. Stops early if `interrupted` is set. If the system refuses to
/// start a thread for each core, uses fewer threads.
pub fn run(
    plan: &Plan,
    missing: &[usize],
    reader: &ResultReader,
    sources: &SurfaceFiles,
    resources: Resources,
    observer: &dyn TaskObserver,
    interrupted: &AtomicBool,
) -> RunOutcome {
    let threads = Threads::new(resources.cores);
    let mut is_missing = vec![false; plan.tasks.len()];
    missing.iter().for_each(|&task| is_missing[task] = true);
    let waits_for = plan.tasks.iter().enumerate().map(|(task, Task { inputs, .. })| {
        let waits = inputs.iter().filter(|&&input| is_missing[input]).count();
        AtomicUsize::new(if is_missing[task] { waits } else { usize::MAX })
    });
    let size = |task| memory::of_task(plan, task, threads.count()).0;
    let run = Run {
        plan,
        stages: plan.stage_names(),
        reader,
        sources,
        observer,
        interrupted,
        store_rows_every: resources.store_rows_every,
        memory: resources.room,
        ready: ReadyTasks::default(),
        room: MemoryBudget::new(resources.room.0, (0..plan.tasks.len()).map(size)),
        busy: BusySeries::default(),
        dependents: plan.dependents(),
        waits_for: waits_for.collect(),
        has_failed: plan.tasks.iter().map(|_| AtomicBool::default()).collect(),
        threads,
        halted: AtomicBool::new(false),
        done: Mutex::default(),
    };
    // The queue returns the latest task first, so that the first task of the plan is added last.
    for &task in missing.iter().rev() {
        if run.waits_for[task].load(Ordering::Relaxed) == 0 {
            run.ready.push(Ready::Waiting(task));
        }
    }
    let workers = resources.cores.get().min(missing.len());
    parallel::on_threads("worker", workers, &|| run.work());
    run.outcome()
}

/// Minimum number of inputs for which one published table is read instead of many stored tables.
const MANY_INPUTS: usize = 8;

struct Run<'a> {
    plan: &'a Plan,
    stages: Vec<&'a str>,
    reader: &'a ResultReader,
    sources: &'a SurfaceFiles,
    observer: &'a dyn TaskObserver,
    interrupted: &'a AtomicBool,
    threads: Threads,
    store_rows_every: Duration,
    memory: ByteSize,
    ready: ReadyTasks,
    room: MemoryBudget,
    /// Series of which a task is computing rows.
    busy: BusySeries,
    dependents: Vec<Vec<usize>>,
    /// Number of missing inputs that each task waits for; `usize::MAX` for a task that is not part
    /// of this run.
    waits_for: Vec<AtomicUsize>,
    has_failed: Vec<AtomicBool>,
    /// True if the run must stop because tables can no longer be stored.
    halted: AtomicBool,
    done: Mutex<RunOutcome>,
}

impl Run<'_> {
    /// Computes ready tasks until none is left. A task that does not fit into memory is postponed
    /// until another task has released memory, and a task that adds rows to a series until no other
    /// task does.
    fn work(&self) {
        while let Some((next, _at_work)) = self.ready.next() {
            let series = |task: usize| self.plan.tasks[task].table.key;
            let task = match next {
                Ready::Waiting(task) if !self.busy.enter(series(task), task) => continue,
                Ready::Waiting(task) if !self.room.enter(task) => continue,
                Ready::Waiting(task) | Ready::Admitted(task) => task,
            };
            self.attempt(task);
            for next in self.room.leave(task) {
                self.ready.push(Ready::Admitted(next));
            }
            for next in self.busy.leave(series(task)) {
                self.ready.push(Ready::Waiting(next));
            }
        }
    }

    fn attempt(&self, task: usize) {
        if self.is_stopped() {
            return;
        }
        let cores = self.threads.begin_task();
        self.observer.started(task);
        let compute = || self.compute(task, cores.threads());
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(compute))
            .unwrap_or_else(|payload| Err(TaskError::Panic(words_of_panic(payload.as_ref()))));
        match result {
            Ok(()) => {
                self.outcome_mut(|outcome| outcome.computed.push(self.plan.tasks[task].key));
                for &next in self.dependents[task].iter().rev() {
                    if self.is_to_run(next)
                        && self.waits_for[next].fetch_sub(1, Ordering::AcqRel) == 1
                    {
                        self.ready.push(Ready::Waiting(next));
                    }
                }
            }
            Err(TaskError::Stage(StageError::Interrupted)) => return,
            Err(error) => self.fail(task, error),
        }
        self.observer.finished(task, cores.helper_time());
    }

    fn compute(&self, task: usize, threads: &Threads) -> Result<(), TaskError> {
        let size = memory::of_task(self.plan, task, self.threads.count());
        if !memory::is_available(size) {
            let takes = size.display().si().to_string();
            return Err(TaskError::Memory { takes });
        }
        let (store, planned) = (self.reader.store(), &self.plan.tasks[task]);
        let Some(series) = planned.table.series.as_deref() else {
            let inputs = self.inputs(task, None, threads)?;
            let rows = Continuation::new(store, self.plan, task, self.store_rows_every);
            let stored = rows.stored();
            let table =
                self.run(task, &planned.recipe, &inputs, &rows, stored.as_ref(), threads)?;
            store.publish(&self.plan.provenance(task), &table)?;
            rows.finish();
            return Ok(());
        };
        // Other commands read all files of a series, also those that count as missing here.
        if store.has_unreadable(planned.table.key)? {
            self.set_aside(task, None)?;
        }
        match self.compute_rows(task, series, threads) {
            Err(TaskError::Store(cause)) if cause.is_recomputable() => {
                self.set_aside(task, Some(cause))?;
                self.compute_rows(task, series, threads)
            }
            done => done,
        }
    }

    /// Computes the rows and parts of a series that the store lacks. Returns an error if stored
    /// rows from which a part is computed are damaged.
    fn compute_rows(
        &self,
        task: usize,
        series: &SeriesRows,
        threads: &Threads,
    ) -> Result<(), TaskError> {
        let (store, planned) = (self.reader.store(), &self.plan.tasks[task]);
        for group in missing_rows::to_compute(planned, series, store)? {
            let stored = group.stored(planned, store)?;
            let inputs = self.inputs(task, Some(&group.values), threads)?;
            let every = self.store_rows_every;
            let writer = RowWriter::new(store, self.plan, task, series.column, &group, every);
            let recipe = group.recipe(&planned.recipe);
            let table = self.run(task, &recipe, &inputs, &writer, stored.as_ref(), threads)?;
            writer.write(&group.values, &table)?;
        }
        Ok(())
    }

    /// Reads the inputs of a task. If `rows` is given, reads only the rows with these values from
    /// inputs whose rows are independent.
    fn inputs(
        &self,
        task: usize,
        rows: Option<&[f64]>,
        threads: &Threads,
    ) -> Result<Vec<Input<'_>>, TaskError> {
        let Task { recipe, inputs, .. } = &self.plan.tasks[task];
        let columns = recipe.columns_read();
        let many = inputs.len() >= MANY_INPUTS && columns == Columns::Light;
        let table = |&input: &usize| {
            let table = self.plan.tasks[input].table.with_parts(|part| recipe.reads_part(part));
            rows.map_or(table.clone(), |rows| table.restricted(rows))
        };
        let tables: Vec<TableRef> = inputs.iter().map(table).collect();
        let (mut read, mut first, mut held) = (Vec::new(), 0, 0.0);
        while first < inputs.len() {
            let left = (&inputs[first..], &tables[first..]);
            let found = many.then(|| self.published(left, recipe.stacks_inputs())).flatten();
            let (mut input, count) = match found {
                Some(found) => found,
                None => (self.read(inputs[first], &tables[first], columns, threads)?, 1),
            };
            first += count;
            if recipe.input_scope() != InputScope::Single {
                let labelled = self.plan.labels.added_to(input.table);
                let names_path = recipe.uses_column(PATH.name);
                input.table =
                    if names_path { with_paths(labelled, self.sources) } else { labelled };
            }
            if columns == Columns::Light {
                input.table = recipe.needed(input.table);
                held += memory::COPIES_OF_INPUTS * input.table.bytes_held() as f64;
            }
            if held > self.memory.0 as f64 {
                let all = held / first as f64 * inputs.len() as f64;
                return Err(TaskError::Inputs {
                    takes: ByteSize(all as u64).display().si().to_string(),
                    room: self.memory.display().si().to_string(),
                });
            }
            read.push(input);
        }
        Ok(read)
    }

    /// Runs a recipe and checks its table.
    fn run(
        &self,
        task: usize,
        recipe: &Recipe,
        inputs: &[Input],
        finished: &dyn FinishedRows,
        stored: Option<&Table>,
        threads: &Threads,
    ) -> Result<Table, TaskError> {
        let context = Context {
            sources: self.sources,
            memory: self.memory,
            threads,
            finished,
            stored,
            reserve: &|bytes| self.room.reserve(task, bytes),
            interrupted: &|| self.is_stopped(),
            advance: &|share| self.observer.advanced(task, share),
        };
        let table = recipe.run(inputs, &context)?;
        table
            .check_finite()
            .map_err(|found| TaskError::NotFinite { found, is_query: recipe.query().is_some() })?;
        Ok(table)
    }

    /// Returns the table of the first of some tasks from the published table of its stage or, if
    /// `stacks` is true, those of the first tasks as one table. Also returns their number. Returns
    /// `None` if the published table lacks rows of the first task.
    fn published(
        &self,
        (tasks, tables): (&[usize], &[TableRef]),
        stacks: bool,
    ) -> Option<(Input<'_>, usize)> {
        let stage = self.stages[tasks[0]];
        let (table, count) = if stacks {
            let left = tasks.iter().zip(tables);
            let of_stage = left.take_while(|(task, _)| self.stages[**task] == stage);
            let tables = of_stage.map(|(_, table)| table);
            let (rows, table) = self.reader.published_consecutive(stage, tables)?;
            (table, rows.len())
        } else {
            (self.reader.published_table(stage, &tables[0])?, 1)
        };
        Some((self.input(tasks[0], table), count))
    }

    fn read(
        &self,
        task: usize,
        table: &TableRef,
        columns: Columns,
        threads: &Threads,
    ) -> Result<Input<'_>, TaskError> {
        let store = self.reader.store();
        let table = match store.read(table, columns) {
            Err(cause) if cause.is_recomputable() => {
                self.recompute(task, cause, threads)?;
                store.read(table, columns)?
            }
            read => read?,
        };
        Ok(self.input(task, table))
    }

    /// Returns the table of a task as an input of another task.
    fn input(&self, task: usize, table: Table) -> Input<'_> {
        let recipe = &self.plan.tasks[task].recipe;
        Input { recipe, surface: self.plan.surface_of(task), table }
    }

    /// Recomputes a table that existed when the run started but is damaged. Two tasks that read the
    /// table may both recompute it, which does no harm because the results are equal.
    fn recompute(
        &self,
        task: usize,
        cause: StoreError,
        threads: &Threads,
    ) -> Result<(), TaskError> {
        self.set_aside(task, Some(cause))?;
        match self.compute(task, threads) {
            Ok(()) => {
                self.outcome_mut(|outcome| outcome.computed.push(self.plan.tasks[task].key));
                Ok(())
            }
            Err(TaskError::Stage(StageError::Interrupted)) => Err(StageError::Interrupted.into()),
            Err(error) => {
                self.fail(task, error);
                Err(TaskError::Upstream(self.plan.tasks[task].table.key))
            }
        }
    }

    /// Sets all damaged files of a task aside. `cause` is the error of reading its table, if it was
    /// read.
    fn set_aside(&self, task: usize, cause: Option<StoreError>) -> Result<(), StoreError> {
        let key = self.plan.tasks[task].table.key;
        let damaged = Damage::set_aside(key, self.reader.store(), cause)?;
        self.outcome_mut(|outcome| outcome.damaged.extend(damaged));
        Ok(())
    }

    fn is_stopped(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed) || self.halted.load(Ordering::Relaxed)
    }

    fn is_to_run(&self, task: usize) -> bool {
        self.waits_for[task].load(Ordering::Relaxed) != usize::MAX
    }

    /// Records the failure of a task and of all tasks that depend on it.
    fn fail(&self, task: usize, error: TaskError) {
        if matches!(&error, TaskError::Store(error) if error.affects_all_tables()) {
            self.halted.store(true, Ordering::Relaxed);
        }
        let root = match &error {
            TaskError::Upstream(root) => *root,
            _ => self.plan.tasks[task].table.key,
        };
        self.outcome_mut(|outcome| {
            let mut failures = vec![(task, error)];
            while let Some((task, error)) = failures.pop() {
                if !self.has_failed[task].swap(true, Ordering::Relaxed) {
                    outcome.failed.push((self.plan.tasks[task].key, error));
                    let waiting = self.dependents[task].iter().copied();
                    let dropped = waiting.filter(|&next| self.is_to_run(next));
                    failures.extend(dropped.map(|next| (next, TaskError::Upstream(root))));
                }
            }
        });
    }

    fn outcome_mut(&self, change: impl FnOnce(&mut RunOutcome)) {
        change(&mut locked(&self.done));
    }

    fn outcome(self) -> RunOutcome {
        let mut outcome = self.done.into_inner().expect("no code panics while it holds the lock");
        // The order of the plan does not depend on the order in which tasks have run.
        outcome.computed.sort_by_key(|task| self.plan.index_of(*task));
        outcome.computed.dedup();
        outcome.failed.sort_by_key(|(task, _)| self.plan.index_of(*task));
        outcome.damaged.sort_by_cached_key(|damage| self.plan.task_of(damage.table));
        outcome.interrupted = self.interrupted.load(Ordering::Relaxed);
        outcome.halted = self.halted.load(Ordering::Relaxed);
        outcome
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::study::Study;

    /// Study that solves the contact of each of three surfaces.
    const STUDY: &str = r#"
[study]
name = "small"

[stage.surfaces]
kind = "generate"
nodes = 16
hurst = 0.8
k_lower = 1
k_upper = 4
realizations = 3

[stage.light]
kind = "solve"
from = "surfaces"
loads = [0.1]
"#;

    /// Observer that ignores all events.
    struct Silence;

    impl TaskObserver for Silence {
        fn started(&self, _: usize) {}
        fn advanced(&self, _: usize, _: f64) {}
        fn finished(&self, _: usize, _: Duration) {}
    }

    #[test]
    fn memory_that_the_system_does_not_give_fails_its_task_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let study = Study::parse(STUDY, "small.toml", Path::new("")).unwrap();
        let mut plan = Plan::new(&study);
        // The mesh takes petabytes.
        plan.tasks[0].nodes = [1 << 24; 2];
        let store = Store::open(&folder.path().join("store")).unwrap();
        let means = Resources {
            cores: NonZeroUsize::new(2).unwrap(),
            room: ByteSize(u64::MAX),
            store_rows_every: Duration::MAX,
        };
        let missing = missing(&plan, &store);
        let stopped = AtomicBool::new(false);
        let sources = &study.sources;
        let reader = ResultReader::new(store, &folder.path().join("results"));
        let outcome = run(&plan, &missing, &reader, sources, means, &Silence, &stopped);
        let (first, error) = &outcome.failed[0];
        assert_eq!(*first, plan.tasks[0].key);
        assert!(matches!(error, TaskError::Memory { .. }), "{error}");
        assert!(error.to_string().contains("the system does not provide"));
        let others = &outcome.failed[1..];
        assert!(others.iter().all(|(_, error)| matches!(error, TaskError::Upstream(_))));
        let all = outcome.computed.len() + outcome.failed.len();
        assert_eq!(all, plan.tasks.len());
        assert!(outcome.computed.len() > others.len());
    }
}
