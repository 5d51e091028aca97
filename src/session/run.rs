//! Computing what a study lacks, and writing its tables.
//!
//! [`RunOptions`] say what to compute and with what, [`PreparedRun`] has checked them against the
//! study and the store, and [`RunReport`] says what came of it. A shard computes tables of tasks
//! alone: see `shard`.

mod shard;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use bytesize::ByteSize;
use serde::Serialize;

use super::error::SessionError;
use super::events::{Batch, Event, Notice, Observer};
use super::maintenance::in_words;
use super::names::{TaskNameError, planned};
use super::status::{GrowingStage, StageCount};
use super::{Session, Shard, failures};
use asperity_claims::PaperClaims;
use asperity_contact::threads::available_cores;
use asperity_pipeline::forecast::memory::{self, MemoryLimit};
use asperity_pipeline::plan::Plan;
use asperity_pipeline::plan::reasons::record::Record;
use asperity_pipeline::results::reader::ResultReader;
use asperity_pipeline::results::{self, ResultsError, exceeded_hardness, owner};
use asperity_pipeline::runner::{self, Damage, Resources};
use asperity_pipeline::study::Warning;
use asperity_tables::store::key::TaskKey;
use asperity_tables::store::{Store, StoreError};

pub use asperity_pipeline::adaptive_sampling::SampledStudy;
pub use asperity_pipeline::results::PublishedTable;
pub use asperity_pipeline::runner::{RunOutcome, TaskError};

/// What a run shall do, and with what. The default computes all that is missing.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// Cores to work on, one surface on each, or several cores on one where there are fewer surfaces;
    /// as many as there are when left out.
    pub jobs: Option<NonZeroUsize>,
    /// Memory to keep to, by working on fewer surfaces at once; seven eighths of what there is for
    /// the process when left out.
    pub memory: Option<ByteSize>,
    /// Which tasks to compute.
    pub selection: Selection,
    /// Whether to take the place of another manifest whose study has the same name.
    pub replace: bool,
    /// The job of a scheduler that the run belongs to, as the receipt of a shard names it.
    pub job: Option<String>,
    /// How often a long block of loads keeps how far it has come, to go on from there when its
    /// process has ended; every ten minutes when left out.
    pub checkpoint_every: Option<Duration>,
}

/// Nobody minds to compute so long again.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(600);

/// Which tasks of a study a run computes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Selection {
    /// All that the store lacks, and as many surfaces as its tables ask for.
    #[default]
    Missing,
    /// One task, even if its table is there, and what it lacks: its key, or the first digits of
    /// it.
    Task(String),
    /// What the store lacks of one part of the surfaces, as far as it hangs on one surface alone. No
    /// table of a stage is written, but a receipt.
    Shard(Shard),
}

impl RunOptions {
    /// Cores to work on.
    fn cores(&self) -> NonZeroUsize {
        self.jobs.unwrap_or_else(available_cores)
    }
}

impl Selection {
    /// The tasks that are meant, of those that the plan has by now and of which the store lacks
    /// some.
    fn tasks(
        &self,
        plan: &Plan,
        missing: &[usize],
        store: &Store,
    ) -> Result<Vec<usize>, TaskNameError> {
        Ok(match self {
            Selection::Missing => missing.to_vec(),
            Selection::Task(key) => runner::with_missing_inputs(plan, planned(key, plan)?, store),
            Selection::Shard(shard) => shard.tasks(plan, missing),
        })
    }
}

/// A run that may begin: what it would compute fits into memory and takes nobody's tables away.
#[derive(Debug)]
pub struct PreparedRun<'a> {
    session: &'a Session<'a>,
    selection: Selection,
    sampled: SampledStudy,
    /// The tasks that the store lacks.
    missing: Vec<usize>,
    store: Store,
    jobs: NonZeroUsize,
    memory: MemoryLimit,
    job: Option<String>,
    checkpoint_every: Duration,
}

/// What came of a run.
#[derive(Debug)]
pub struct RunReport {
    /// The study, with as many surfaces as it has by now, and its plan, of whose tasks the rest
    /// speaks.
    pub sampled: SampledStudy,
    /// What should be known of the study, and of what it has found.
    pub warnings: Vec<Warning>,
    /// The tasks that the store lacked.
    pub missing: Vec<usize>,
    /// The tasks that were to be computed.
    pub wanted: Vec<usize>,
    pub outcome: RunOutcome,
    /// The stages' tables; none where nothing can be stored, and none of a shard.
    pub tables: Option<Vec<PublishedTable>>,
    /// Where the table of failures is, if there is one.
    pub failures: Option<PathBuf>,
    /// Where the receipt of a shard is.
    pub receipt: Option<PathBuf>,
}

/// What programs read of a run.
#[derive(Debug, Serialize)]
pub struct RunSummary<'a> {
    pub stages: Vec<StageRun<'a>>,
    /// Tables that were damaged, and were computed again.
    pub damaged: Vec<DamagedTask<'a>>,
    pub growing: Vec<GrowingStage<'a>>,
    pub warnings: &'a [Warning],
    /// Where the table of failures is, if there is one.
    pub failures: Option<&'a Path>,
    /// Where the receipt of a shard is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub receipt: Option<&'a Path>,
}

/// What a run did for one stage.
#[derive(Debug, Serialize)]
pub struct StageRun<'a> {
    /// How much of it was there before.
    #[serde(flatten)]
    pub before: StageCount<'a>,
    /// Its tasks that were computed.
    pub computed: usize,
    /// Its tasks that could not be.
    pub failed: usize,
}

/// A task whose table was damaged.
#[derive(Debug, Serialize)]
pub struct DamagedTask<'a> {
    pub task: TaskKey,
    #[serde(serialize_with = "in_words")]
    pub cause: &'a StoreError,
    /// Where the damaged file is now.
    #[serde(rename = "aside")]
    pub quarantined: &'a Path,
}

impl RunReport {
    /// What the run did, stage by stage.
    pub fn stages(&self) -> Vec<StageRun<'_>> {
        let failed: Vec<usize> = self.outcome.failed.iter().map(|(task, _)| *task).collect();
        let stages = StageCount::all(&self.sampled.plan, &self.missing).into_iter();
        let stages = stages.map(|before| StageRun {
            computed: before.among(&self.outcome.computed),
            failed: before.among(&failed),
            before,
        });
        stages.collect()
    }

    /// What programs read of it.
    pub fn summary(&self) -> RunSummary<'_> {
        let damaged = self.outcome.damaged.iter().map(|damage| DamagedTask {
            task: self.sampled.plan.tasks[damage.task].key,
            cause: &damage.cause,
            quarantined: &damage.quarantined,
        });
        RunSummary {
            stages: self.stages(),
            damaged: damaged.collect(),
            growing: GrowingStage::all(&self.sampled.stages),
            warnings: &self.warnings,
            failures: self.failures.as_deref(),
            receipt: self.receipt.as_deref(),
        }
    }
}

impl<'a> PreparedRun<'a> {
    pub(super) fn new(
        session: &'a Session<'a>,
        options: &RunOptions,
    ) -> Result<PreparedRun<'a>, SessionError> {
        let study = session.study()?;
        for warning in &study.warnings() {
            session.tell(Event::Notice(Notice::Study(warning)));
        }
        let store = session.open()?;
        let sampled = SampledStudy::from_tables(study, &store, &PaperClaims)?;
        if !options.replace {
            let folder = session.data().results_of(&sampled.plan.study);
            let reader = ResultReader::new(store.clone(), &folder);
            owner::check(session.manifest(), &sampled.study, &sampled.plan, &reader)?;
        }
        let missing = runner::missing(&sampled.plan, &store);
        let wanted = options.selection.tasks(&sampled.plan, &missing, &store)?;
        let jobs = options.cores();
        let memory = MemoryLimit::new(options.memory, jobs.get());
        memory.fits(&sampled.plan, &wanted)?;
        Ok(PreparedRun {
            session,
            selection: options.selection.clone(),
            sampled,
            missing,
            store,
            jobs,
            memory,
            job: options.job.clone(),
            checkpoint_every: options.checkpoint_every.unwrap_or(CHECKPOINT_EVERY),
        })
    }

    /// The study as the store makes it before the run.
    pub fn sampled(&self) -> &SampledStudy {
        &self.sampled
    }

    /// Computes and writes until all is done, or `stop` is set. What is finished is kept: another
    /// run goes on from there.
    ///
    /// # Errors
    /// When the data cannot be read or written. Tasks that fail are no errors, but rows of the
    /// table of failures.
    pub fn execute(mut self, stop: &AtomicBool) -> Result<RunReport, SessionError> {
        if let Selection::Shard(shard) = self.selection {
            return self.execute_shard(shard, stop);
        }
        self.remember();
        let settled = match self.selection {
            Selection::Missing => self.settle_surfaces(stop)?,
            _ => RunOutcome::default(),
        };
        let missing = self.missing.clone();
        let wanted = self.selection.tasks(self.plan(), &missing, &self.store)?;
        let mut outcome = self.compute(&wanted, stop)?;
        // What was drawn on the way was missing and wanted, too.
        let [missing, wanted] = [missing, wanted].map(|tasks| joined(tasks, &settled.computed));
        outcome.append(settled);
        // Where no task's table can be stored, no stage's table can.
        let tables = match outcome.halted {
            true => Ok(None),
            false => self.publish(&mut outcome, stop).map(Some),
        };
        for damage in &outcome.damaged {
            self.notice(Notice::Damaged(damage));
        }
        let failed = failures::of_run(self.session, self.plan(), &outcome)?;
        if failed.rows() > 0 {
            self.session.tell(Event::Failed(&failed));
        }
        let tables = tables?;
        self.tell_edited(tables.as_deref().unwrap_or_default());
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
        let is_as_before = outcome.computed.is_empty() && outcome.damaged.is_empty();
        if !outcome.halted && !is_as_before {
            self.look();
            self.remember();
        }
        let known = self.sampled.study.warnings();
        Ok(RunReport {
            sampled: self.sampled,
            warnings: known.into_iter().chain(found).collect(),
            missing,
            wanted,
            outcome,
            tables,
            failures,
            receipt: None,
        })
    }

    fn plan(&self) -> &Plan {
        &self.sampled.plan
    }

    /// Finds out anew what the store lacks.
    fn look(&mut self) {
        self.missing = runner::missing(&self.sampled.plan, &self.store);
    }

    fn notice(&self, notice: Notice) {
        self.session.tell(Event::Notice(notice));
    }

    /// Draws surfaces until their number is settled, and computes what settles it.
    fn settle_surfaces(&mut self, stop: &AtomicBool) -> Result<RunOutcome, SessionError> {
        let mut outcome = RunOutcome::default();
        loop {
            for (task, cause) in self.sampled.take_damaged() {
                let damage = Damage::quarantine(self.plan(), task, &self.store, cause)?;
                outcome.damaged.extend(damage);
            }
            let mut missing = self.sampled.deciding_tasks();
            missing.retain(|&task| !self.store.has(self.plan().tasks[task].key));
            let round = self.compute(&missing, stop)?;
            if round.computed.is_empty() {
                return Ok(outcome);
            }
            outcome.append(round);
            // What has failed is tried again, and told of, with all the rest.
            outcome.failed.clear();
            let sampled =
                SampledStudy::from_tables(self.sampled.study.clone(), &self.store, &PaperClaims)?;
            outcome = outcome.renumbered(self.plan(), &sampled.plan);
            self.sampled = sampled;
            self.look();
        }
    }

    fn compute(&self, wanted: &[usize], stop: &AtomicBool) -> Result<RunOutcome, SessionError> {
        self.compute_heard_by(wanted, stop, &Relay(self.session.observer))
    }

    fn compute_heard_by(
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
        self.session.tell(Event::Begun(Batch {
            plan: self.plan(),
            tasks: wanted,
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
        self.session.tell(Event::Ended);
        self.store.flush()?;
        Ok(outcome)
    }

    /// One surface to a core, as far as memory goes, and several cores to a surface where there are
    /// fewer of them.
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
            checkpoint_every: self.checkpoint_every,
        }
    }

    /// Writes the stages' tables. Tasks' tables that turn out to be damaged only now, because no
    /// other task has read them, are computed again.
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
            let damage = Damage::quarantine(self.plan(), task, &self.store, cause)?;
            outcome.damaged.extend(damage);
            tasks.push(task);
        }
        tasks.sort_unstable();
        tasks.dedup();
        outcome.append(self.compute(&tasks, stop)?);
        Ok(publish()?)
    }

    /// Tells what should be known of what the study has found.
    fn warnings(&self, tables: &[PublishedTable]) -> Result<Vec<Warning>, SessionError> {
        let SampledStudy { study, plan, .. } = &self.sampled;
        let warnings = exceeded_hardness::warnings(study, plan, |stage| {
            let there = tables.get(stage).filter(|table| table.finished > 0);
            Ok::<_, SessionError>(there.map(PublishedTable::read).transpose()?)
        });
        let warnings = warnings?;
        for warning in &warnings {
            self.notice(Notice::Study(warning));
        }
        Ok(warnings)
    }

    /// Names files in the places of tables that were not as a run had written them.
    fn tell_edited(&self, tables: &[PublishedTable]) {
        for PublishedTable { path, quarantined, .. } in tables {
            if let Some(quarantined) = quarantined {
                self.notice(Notice::Edited { path, quarantined });
            }
        }
    }

    /// Writes down what the study is and how far it came, for the next plan to say what has
    /// changed. No result depends on it, so that no run fails for it.
    fn remember(&self) {
        let study = &self.sampled.study;
        let record = Record::new(study, self.plan(), &self.missing);
        if let Err(error) = record.write(&self.session.data().records(), &study.name) {
            self.notice(Notice::NotRemembered(&error));
        }
    }
}

/// Hands on what tasks do.
struct Relay<'a>(&'a dyn Observer);

impl runner::TaskObserver for Relay<'_> {
    fn started(&self, task: usize) {
        self.0.hear(Event::Started(task));
    }

    fn advanced(&self, task: usize, share: f64) {
        self.0.hear(Event::Advanced(task, share));
    }

    fn finished(&self, task: usize, _: Duration) {
        self.0.hear(Event::Finished(task));
    }
}

/// Tasks of two lists, in order.
fn joined(mut tasks: Vec<usize>, others: &[usize]) -> Vec<usize> {
    tasks.extend(others);
    tasks.sort_unstable();
    tasks.dedup();
    tasks
}
