//! Runs of one shard, which write tables of tasks and a receipt, but no other files.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread::{self, Builder};
use std::time::{Duration, Instant};

use super::{PreparedRun, RunOutcome, RunReport, TaskError};
use crate::session::error::SessionError;
use crate::session::{Event, Observer};
use asperity_manifest::diagnostics::chain;
use asperity_pipeline::cluster::receipts::{FailedTask, Pace, Paces, Receipt, UPDATE_INTERVALS};
use asperity_pipeline::cluster::shard::Shard;
use asperity_pipeline::forecast::remaining::Remaining;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::runner::TaskObserver;
use asperity_tables::key::TaskKey;
use asperity_tables::parallel::locked;

impl PreparedRun<'_> {
    /// Computes the missing tasks of a shard, and writes their tables and a receipt.
    ///
    /// The final run, after all shards, writes the results, the record of the plan and the table of
    /// failures.
    pub(super) fn execute_shard(
        self,
        shard: Shard,
        stop: &AtomicBool,
    ) -> Result<RunReport, SessionError> {
        let folder = self.session.data().receipts_of(&self.plan().study);
        let wanted = self.options.selection.tasks(self.plan(), &self.missing, &self.store)?;
        let threads = self.jobs.get();
        let mut receipt =
            Receipt::begin(&self.plan().study, shard, self.options.job.clone(), threads);
        receipt.wanted = wanted.len();
        receipt.write(&folder)?;
        let ledger = Ledger {
            observer: self.session.observer,
            plan: self.plan(),
            remaining: Remaining::new(self.plan(), &wanted, &self.store),
            work: Mutex::default(),
        };
        let outcome = ledger
            .with_receipt(&mut receipt, &folder, || self.compute_observed(&wanted, stop, &ledger));
        let outcome = ledger.close(outcome, &mut receipt, &folder)?;
        self.report_failures(&outcome)?;
        Ok(RunReport {
            receipt: Some(receipt.path(&folder)),
            warnings: self.sampled.study.warnings(),
            sampled: self.sampled,
            missing: self.missing,
            wanted,
            outcome,
            tables: None,
            failures: None,
            stores: Vec::new(),
        })
    }
}

/// Observer that forwards events and records the computing time of tasks.
struct Ledger<'a> {
    observer: &'a dyn Observer,
    plan: &'a Plan,
    /// Rows that the tasks lacked before the run.
    remaining: Remaining,
    work: Mutex<Work>,
}

#[derive(Default)]
struct Work {
    under_way: BTreeMap<usize, Instant>,
    /// Index and core-seconds of each finished task.
    finished: Vec<(usize, f64)>,
}

impl Ledger<'_> {
    /// Runs `work` and writes its progress into the receipt periodically.
    fn with_receipt<T>(&self, receipt: &mut Receipt, folder: &Path, work: impl FnOnce() -> T) -> T {
        let (at_work, has_ended) = mpsc::channel::<()>();
        thread::scope(|scope| {
            let enter = move || {
                let [mut wait, later] = UPDATE_INTERVALS;
                while has_ended.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
                    wait = later;
                    self.enter(receipt, &[]);
                    // Ignore errors here: the final write reports them.
                    let _ = receipt.write(folder);
                }
            };
            // Without this thread, the receipt is written only at the end.
            let _ = Builder::new().spawn_scoped(scope, enter);
            let done = work();
            drop(at_work);
            done
        })
    }

    /// Writes the outcome of the run into the receipt and marks the receipt as ended. Returns the
    /// outcome.
    fn close(
        &self,
        outcome: Result<RunOutcome, SessionError>,
        receipt: &mut Receipt,
        folder: &Path,
    ) -> Result<RunOutcome, SessionError> {
        let failed = outcome.as_ref().map_or(&[][..], |outcome| &outcome.failed);
        self.enter(receipt, failed);
        if let Ok(outcome) = &outcome {
            receipt.computed = outcome.computed.len();
            receipt.interrupted = outcome.interrupted;
            receipt.halted = outcome.halted;
        }
        receipt.under_way.clear();
        receipt.end();
        let written = receipt.write(folder);
        let outcome = outcome?;
        // On a full disk, the run has reported the cause already.
        if !outcome.halted {
            written?;
        }
        Ok(outcome)
    }

    fn enter(&self, receipt: &mut Receipt, failed: &[(TaskKey, TaskError)]) {
        let work = locked(&self.work);
        let planned =
            failed.iter().filter_map(|(task, error)| Some((self.plan.index_of(*task)?, error)));
        let tried: Vec<(usize, &TaskError)> = planned.collect();
        let key = |task: usize| self.plan.tasks[task].table.key.to_string();
        let begun = work.under_way.values();
        let lasting = begun.map(|begun| begun.elapsed().as_secs_f64());
        let finished = work.finished.iter().map(|(_, seconds)| *seconds);
        receipt.seconds = finished.chain(lasting).fold(0.0, |sum, seconds| sum + seconds);
        receipt.computed = work.finished.len();
        receipt.under_way = work.under_way.keys().map(|&task| key(task)).collect();
        let mut paces = Paces::default();
        for &(task, seconds) in &work.finished {
            if !tried.iter().any(|(failed, _)| *failed == task) {
                paces.add(Pace {
                    nodes: self.plan.tasks[task].nodes,
                    pairs: self.remaining.effort(self.plan, task).pairs,
                    seconds,
                });
            }
        }
        receipt.pace = paces.all();
        let stages = self.plan.stage_names();
        let own = tried.iter().filter(|(_, error)| !matches!(error, TaskError::Upstream(_)));
        let failed = own.map(|(task, error)| FailedTask {
            task: key(*task),
            stage: stages[*task].to_owned(),
            reason: chain(*error),
        });
        receipt.failed = failed.collect();
    }
}

impl TaskObserver for Ledger<'_> {
    fn started(&self, task: usize) {
        locked(&self.work).under_way.insert(task, Instant::now());
        self.observer.on_event(Event::Started(task));
    }

    fn advanced(&self, task: usize, share: f64) {
        self.observer.on_event(Event::Advanced(task, share));
    }

    fn finished(&self, task: usize, helped: Duration) {
        let mut work = locked(&self.work);
        if let Some(begun) = work.under_way.remove(&task) {
            let seconds = (begun.elapsed() + helped).as_secs_f64();
            work.finished.push((task, seconds));
        }
        drop(work);
        self.observer.on_event(Event::Finished(task));
    }
}
