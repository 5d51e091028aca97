//! Runs, which compute missing tasks and write tables.
//!
//! [`RunOptions`] select tasks and resources, [`PreparedRun`] has checked them against the study
//! and the store, and [`RunReport`] contains the result. Runs of a shard write only tables of
//! tasks; see `shard`.

mod shard;

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use bytesize::ByteSize;
use serde::Serialize;
use serde_json::{Value, json};

use super::error::SessionError;
use super::events::{Batch, Event, Notice, Observer};
use super::formatting::chain;
use super::name_lookup::{TaskNameError, planned};
use super::status::{StageCount, growing};
use super::{Session, Shard, failures};
use asperity_claims::DeclaredClaims;
use asperity_mechanics::threads::available_cores;
use asperity_pipeline::forecast::memory::{self, MemoryLimit};
use asperity_pipeline::outcome::Damage;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::plan::sources::{Sources, TasksFromStore};
use asperity_pipeline::results::reader::ResultReader;
use asperity_pipeline::results::{self, ResultsError, owner, warnings};
use asperity_pipeline::runner::{self, Resources};
use asperity_pipeline::study::Warning;
use asperity_tables::key::TaskKey;
use asperity_tables::store::{Store, StoreError};
use asperity_tables::table::Table;

pub use asperity_pipeline::adaptive_sampling::SampledStudy;
pub use asperity_pipeline::outcome::{RunOutcome, TaskError};
pub use asperity_pipeline::results::PublishedTable;

/// Options of a run, which by default computes all missing tasks.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct RunOptions {
    /// Number of cores to use (default: all). Each core works on one surface; if fewer surfaces
    /// remain, several cores share one.
    pub jobs: Option<NonZeroUsize>,
    /// Memory limit of the run (default: 7/8 of the available memory). A run computes fewer
    /// surfaces in parallel to stay below it.
    pub memory: Option<ByteSize>,
    pub selection: Selection,
    /// Overwrite the results of another manifest with the same study name.
    pub replace: bool,
    /// Name of the scheduler job, recorded in the receipt of a shard.
    pub(crate) job: Option<String>,
    /// Interval at which the finished loads of a surface are stored while its other loads are
    /// solved; default: one minute. After the end of the process, the next run solves only the
    /// loads that are not stored.
    pub(crate) checkpoint_every: Option<Duration>,
}

/// Default interval at which finished loads are stored. A run that is killed loses at most the work
/// of this interval.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(60);

/// Tasks of a study that a run computes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Selection {
    /// All missing tasks, and as many surfaces as adaptive sampling requires.
    #[default]
    Missing,
    /// One task, given by the first digits of its key, and its missing inputs. The task is computed
    /// even if its table exists.
    Task(String),
    /// Missing tasks that depend on a single surface of this shard. The run writes a receipt, but
    /// no tables of stages.
    Shard(Shard),
}

impl Selection {
    /// Returns the indices of the selected tasks.
    fn tasks(
        &self,
        plan: &Plan,
        missing: &[usize],
        store: &Store,
    ) -> Result<Vec<usize>, TaskNameError> {
        Ok(match self {
            Selection::Missing => missing.to_vec(),
            Selection::Task(key) => runner::with_missing_inputs(plan, &planned(key, plan)?, store),
            Selection::Shard(shard) => shard.tasks(plan, missing),
        })
    }
}

/// Run that has passed all checks: its tasks fit into memory, and it does not overwrite results of
/// another manifest.
#[derive(Debug)]
pub struct PreparedRun<'a> {
    session: &'a Session<'a>,
    options: RunOptions,
    sampled: SampledStudy,
    /// Indices of tasks that are not in the store, ascending.
    missing: Vec<usize>,
    store: Store,
    jobs: NonZeroUsize,
    memory: MemoryLimit,
}

/// Result of a run, including failures.
#[derive(Debug)]
#[non_exhaustive]
pub struct RunReport {
    /// Study with its final number of surfaces, and its plan; task indices refer to this plan.
    pub sampled: SampledStudy,
    /// Warnings about the study and its results.
    pub warnings: Vec<Warning>,
    /// Tasks that were missing before the run.
    pub missing: Vec<usize>,
    /// Tasks that the run had to compute.
    pub wanted: Vec<usize>,
    pub outcome: RunOutcome,
    /// Tables of the stages, or `None` for shards and if the disk is full or cannot be written.
    pub tables: Option<Vec<PublishedTable>>,
    /// Path of the table of failures, if there is one.
    pub failures: Option<PathBuf>,
    /// Path of the receipt of a shard.
    pub(crate) receipt: Option<PathBuf>,
    /// Read-only stores from which tables of finished tasks were read.
    pub(crate) stores: Vec<TasksFromStore>,
}

/// Numbers of tasks of one stage in a run.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct StageRun<'a> {
    /// Finished and missing tasks before the run.
    #[serde(flatten)]
    pub before: StageCount<'a>,
    /// Number of tasks that the run computed.
    pub computed: usize,
    /// Number of tasks that failed in the run.
    pub failed: usize,
}

impl RunReport {
    /// Counts the tasks of each stage.
    pub fn stages(&self) -> Vec<StageRun<'_>> {
        let plan = &self.sampled.plan;
        let computed = indices(plan, self.outcome.computed.iter());
        let failed = indices(plan, self.outcome.failed.iter().map(|(task, _)| task));
        let counts = StageCount::all(plan, &self.missing).into_iter();
        let stages = counts.map(|before| StageRun {
            computed: before.among(&computed),
            failed: before.among(&failed),
            before,
        });
        stages.collect()
    }

    /// Returns the JSON output of `asperity run`.
    ///
    /// # Errors
    /// Returns an error if a path is not valid UTF-8.
    pub(crate) fn summary(&self) -> Result<Value, serde_json::Error> {
        let damaged = self.outcome.damaged.iter().map(|damage| {
            Ok(json!({
                "task": damage.table,
                "cause": chain(&damage.cause),
                "aside": serde_json::to_value(&damage.quarantined)?,
            }))
        });
        let mut summary = json!({
            "stages": self.stages(),
            "damaged": damaged.collect::<Result<Vec<_>, serde_json::Error>>()?,
            "growing": growing(&self.sampled.stages),
            "warnings": self.warnings,
            "failures": serde_json::to_value(&self.failures)?,
        });
        if let Some(receipt) = &self.receipt {
            summary["receipt"] = serde_json::to_value(receipt)?;
        }
        if !self.stores.is_empty() {
            summary["stores"] = serde_json::to_value(&self.stores)?;
        }
        Ok(summary)
    }
}

impl<'a> PreparedRun<'a> {
    pub(super) fn new(
        session: &'a Session<'a>,
        options: &RunOptions,
    ) -> Result<PreparedRun<'a>, SessionError> {
        let study = session.study()?;
        for warning in &study.warnings() {
            session.notify(Event::Notice(Notice::Study(warning)));
        }
        let store = session.open()?;
        let sampled = SampledStudy::from_tables(study, &store, &DeclaredClaims)?;
        if !options.replace {
            let folder = session.data().results_of(&sampled.plan.study);
            let SampledStudy { study, plan, .. } = &sampled;
            let former = owner::check(session.manifest(), study, plan, &folder)?;
            if let Some(manifest) = &former {
                session.notify(Event::Notice(Notice::FormerOwner { manifest, folder: &folder }));
            }
        }
        let missing = runner::missing(&sampled.plan, &store);
        let wanted = options.selection.tasks(&sampled.plan, &missing, &store)?;
        let jobs = options.jobs.unwrap_or_else(available_cores);
        let memory = MemoryLimit::new(options.memory, jobs.get());
        memory.fits(&sampled.plan, &wanted)?;
        let own = options.clone();
        Ok(PreparedRun { session, options: own, sampled, missing, store, jobs, memory })
    }

    /// Computes tasks and writes tables until all tasks are finished or `stop` is set.
    ///
    /// Finished tasks are kept, so that another run can continue.
    ///
    /// # Errors
    /// Returns an error if data cannot be read or written. The failure of a task is not an error
    /// but a row of the table of failures.
    pub fn execute(mut self, stop: &AtomicBool) -> Result<RunReport, SessionError> {
        if let Selection::Shard(shard) = self.options.selection {
            return self.execute_shard(shard, stop);
        }
        self.save_record();
        let settled = match self.options.selection {
            Selection::Missing => self.sample_adaptively(stop)?,
            _ => RunOutcome::default(),
        };
        let missing = self.missing.clone();
        let wanted = self.options.selection.tasks(self.plan(), &missing, &self.store)?;
        let mut outcome = self.compute(&wanted, stop)?;
        // Tasks computed during adaptive sampling were missing and wanted, too.
        let computed = indices(self.plan(), settled.computed.iter());
        let [missing, wanted] = [missing, wanted].map(|tasks| joined(tasks, &computed));
        outcome.append(settled);
        // If tables of tasks cannot be stored, tables of stages cannot be stored either.
        let published =
            if outcome.halted { Ok(None) } else { self.publish(&mut outcome, stop).map(Some) };
        let failed = self.report_failures(&outcome)?;
        let tables = published?;
        for PublishedTable { path, quarantined, .. } in tables.iter().flatten() {
            if let Some(quarantined) = quarantined {
                self.notice(Notice::Edited { path, quarantined });
            }
        }
        let found = self.warnings(tables.as_deref().unwrap_or_default())?;
        let failures = match &tables {
            Some(tables) => {
                let (session, plan) = (self.session, self.plan());
                failures::write(session, plan, failed, &wanted, tables, &self.store)?
            }
            None => None,
        };
        for path in results::orphans(self.plan(), &self.session.data().results())? {
            self.notice(Notice::Orphan(&path));
        }
        let is_unchanged = outcome.computed.is_empty() && outcome.damaged.is_empty();
        if !outcome.halted && !is_unchanged {
            self.find_missing();
            self.save_record();
        }
        let known = self.sampled.study.warnings();
        let stores = Sources::new(self.plan(), &self.missing, &self.store).all();
        Ok(RunReport {
            sampled: self.sampled,
            warnings: known.into_iter().chain(found).collect(),
            missing,
            wanted,
            outcome,
            tables,
            failures,
            receipt: None,
            stores,
        })
    }

    fn plan(&self) -> &Plan {
        &self.sampled.plan
    }

    /// Updates the list of missing tasks.
    fn find_missing(&mut self) {
        self.missing = runner::missing(&self.sampled.plan, &self.store);
    }

    fn notice(&self, notice: Notice) {
        self.session.notify(Event::Notice(notice));
    }

    /// Adds surfaces until the conditions of all adaptive stages hold or their maximum is reached.
    fn sample_adaptively(&mut self, stop: &AtomicBool) -> Result<RunOutcome, SessionError> {
        let mut outcome = RunOutcome::default();
        loop {
            for (task, cause) in self.sampled.take_damaged() {
                outcome.damaged.extend(self.set_aside(task, cause)?);
            }
            let mut missing = self.sampled.deciding_tasks();
            missing.retain(|&task| !self.store.has(&self.plan().tasks[task].table));
            let round = self.compute(&missing, stop)?;
            if round.computed.is_empty() {
                // Tasks that pooled fewer surfaces are not in the final plan.
                outcome.computed.retain(|task| self.plan().index_of(*task).is_some());
                return Ok(outcome);
            }
            outcome.append(round);
            // The main computation repeats failed tasks and reports them.
            outcome.failed.clear();
            let study = self.sampled.study.clone();
            self.sampled = SampledStudy::from_tables(study, &self.store, &DeclaredClaims)?;
            self.find_missing();
        }
    }

    fn compute(&self, wanted: &[usize], stop: &AtomicBool) -> Result<RunOutcome, SessionError> {
        self.compute_observed(wanted, stop, &self.session.observer)
    }

    fn compute_observed(
        &self,
        wanted: &[usize],
        stop: &AtomicBool,
        observer: &dyn runner::TaskObserver,
    ) -> Result<RunOutcome, SessionError> {
        if wanted.is_empty() {
            return Ok(RunOutcome::default());
        }
        let resources = self.resources(wanted);
        let folder = self.session.data().results_of(&self.plan().study);
        let reader = ResultReader::new(self.store.clone(), &folder);
        let without = joined(self.missing.clone(), wanted).len();
        self.session.notify(Event::Begun(Batch {
            plan: self.plan(),
            tasks: wanted,
            store: &self.store,
            cached: self.plan().tasks.len() - without,
        }));
        let outcome = runner::run(
            self.plan(),
            wanted,
            &reader,
            &self.sampled.study.sources,
            resources,
            observer,
            stop,
        );
        self.session.notify(Event::Ended);
        self.store.flush()?;
        Ok(outcome)
    }

    /// Returns the cores and the memory that a run of the tasks `wanted` may use. Sends a notice if
    /// memory limits the number of parallel tasks.
    fn resources(&self, wanted: &[usize]) -> Resources {
        let (plan, room) = (self.plan(), self.memory.room());
        let jobs = self.jobs.get().min(wanted.len());
        let largest = memory::of_largest(plan, wanted);
        let at_once = (room.0 / largest.0.max(1)).max(1);
        if at_once < jobs as u64 {
            self.notice(Notice::ScarceMemory { largest, at_once, jobs, allowance: self.memory });
        }
        Resources {
            cores: memory::threads(plan, wanted, room, self.jobs),
            room,
            store_rows_every: self.options.checkpoint_every.unwrap_or(CHECKPOINT_EVERY),
        }
    }

    /// Writes the tables of the stages. If this finds damaged tables of tasks, quarantines them,
    /// computes these tasks again, adds the outcome to `outcome`, and writes the tables once more.
    fn publish(
        &self,
        outcome: &mut RunOutcome,
        stop: &AtomicBool,
    ) -> Result<Vec<PublishedTable>, SessionError> {
        let (manifest, folder) = (self.session.manifest(), self.session.data().results());
        let room = self.memory.room();
        let publish = || results::publish(&self.sampled, &self.store, manifest, &folder, room);
        let tables = match publish() {
            Err(ResultsError::Damaged { tables }) => tables,
            published => return Ok(published?),
        };
        let mut tasks = Vec::new();
        for (task, cause) in tables {
            outcome.damaged.extend(self.set_aside(task, cause)?);
            tasks.push(task);
        }
        tasks.sort_unstable();
        tasks.dedup();
        outcome.append(self.compute(&tasks, stop)?);
        Ok(publish()?)
    }

    fn set_aside(&self, task: usize, cause: StoreError) -> Result<Vec<Damage>, StoreError> {
        Damage::set_aside(self.plan().tasks[task].table.key, &self.store, Some(cause))
    }

    /// Returns the warnings about the results, and sends them to the observer.
    fn warnings(&self, tables: &[PublishedTable]) -> Result<Vec<Warning>, SessionError> {
        let SampledStudy { study, plan, .. } = &self.sampled;
        let warnings = warnings::warnings(study, plan, |stage| {
            let there = tables.get(stage).filter(|table| table.finished > 0);
            Ok::<_, SessionError>(there.map(PublishedTable::read).transpose()?)
        })?;
        for warning in &warnings {
            self.notice(Notice::Study(warning));
        }
        Ok(warnings)
    }

    /// Reports damaged files and failed tasks, and returns the table of the failed tasks.
    fn report_failures(&self, outcome: &RunOutcome) -> Result<Table, SessionError> {
        for damage in &outcome.damaged {
            self.notice(Notice::Damaged(damage));
        }
        let failed = failures::failed_tasks(self.session, self.plan(), outcome)?;
        if failed.rows() > 0 {
            self.session.notify(Event::Failed(&failed));
        }
        Ok(failed)
    }

    /// Saves a record of the study, so that the next plan can explain changes since this run.
    ///
    /// A failure gives a notice only, because no result depends on the record.
    fn save_record(&self) {
        let study = &self.sampled.study;
        let sources = Sources::new(self.plan(), &self.missing, &self.store);
        let record =
            Record::new(study, self.plan(), &self.missing).with_sources(self.plan(), &sources);
        if let Err(error) = record.write(&self.session.data().records(), &study.name) {
            self.notice(Notice::RecordNotSaved(&error));
        }
    }
}

impl runner::TaskObserver for &dyn Observer {
    fn started(&self, task: usize) {
        self.on_event(Event::Started(task));
    }

    fn advanced(&self, task: usize, share: f64) {
        self.on_event(Event::Advanced(task, share));
    }

    fn finished(&self, task: usize, _: Duration) {
        self.on_event(Event::Finished(task));
    }
}

/// Returns the sorted indices of those tasks that the plan has.
fn indices<'k>(plan: &Plan, tasks: impl Iterator<Item = &'k TaskKey>) -> Vec<usize> {
    let mut indices: Vec<usize> = tasks.filter_map(|&task| plan.index_of(task)).collect();
    indices.sort_unstable();
    indices
}

/// Returns the sorted union of two lists of tasks.
fn joined(mut tasks: Vec<usize>, others: &[usize]) -> Vec<usize> {
    tasks.extend(others);
    tasks.sort_unstable();
    tasks.dedup();
    tasks
}
