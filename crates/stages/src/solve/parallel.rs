//! Loads of one task, which several workers solve at the same time.
//!
//! Each load is a row of its own and does not depend on the others, so no result depends on the
//! number of workers or on their timing.

use std::cell::Cell;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::{Context, StageError};
use asperity_mechanics::solver::Watch;
use asperity_tables::parallel::locked;
use asperity_tables::table::Table;

/// Loads of one task.
pub struct LoadTask<'a> {
    context: &'a Context<'a>,
    /// Loads in the unit of the manifest, in ascending order.
    loads: &'a [f64],
    /// Expected pairs of transforms for each load.
    pairs_per_load: f64,
}

impl<'a> LoadTask<'a> {
    pub fn new(context: &'a Context<'a>, loads: &'a [f64], pairs_per_load: f64) -> LoadTask<'a> {
        LoadTask { context, loads, pairs_per_load }
    }

    /// Returns the table of all loads. `solve(worker, index, watch)` computes the row of a load,
    /// and `table` makes a table from rows in the order of the loads.
    ///
    /// The calling thread works with `own`, and other free cores work with workers from
    /// `new_worker`. Finished rows are kept whenever they are due and after an interruption.
    ///
    /// # Errors
    /// Returns the first error of a load, or an error if finished rows cannot be stored.
    pub fn run<W: Send, R: Clone + Send>(
        &self,
        own: &mut W,
        new_worker: impl FnMut(&W) -> Option<W>,
        solve: impl Fn(&mut W, usize, &dyn Watch) -> Result<R, StageError> + Sync,
        table: impl Fn(Vec<R>) -> Table + Sync,
    ) -> Result<Table, StageError> {
        let Context { threads, interrupted, finished: receiver, advance, .. } = *self.context;
        let progress = Progress { advance, loads: self.loads.len(), done: Mutex::new(0.0) };
        let results = Mutex::new(vec![None; self.loads.len()]);
        let solve_one = |worker: &mut W, index: usize| {
            let watch = LoadWatch::new(interrupted, &progress, self.pairs_per_load);
            let row = solve(worker, index, &watch)?;
            watch.finish();
            let mut finished = locked(&results);
            finished[index] = Some(row);
            let is_last = finished.iter().all(Option::is_some);
            if !is_last && receiver.are_due() { self.keep(&finished, &table) } else { Ok(()) }
        };
        let solved = threads.share(self.loads.len(), own, new_worker, solve_one);
        let finished = results.into_inner().expect("no code panics while it holds the lock");
        if let Err(StageError::Interrupted) = solved {
            self.keep(&finished, &table)?;
        }
        solved.map(|()| table(finished.into_iter().flatten().collect()))
    }

    /// Stores the rows that are finished so far.
    fn keep<R: Clone>(
        &self,
        finished: &[Option<R>],
        table: impl Fn(Vec<R>) -> Table,
    ) -> Result<(), StageError> {
        let rows: Vec<R> = finished.iter().flatten().cloned().collect();
        if rows.is_empty() {
            return Ok(());
        }
        let done = self.loads.iter().zip(finished).filter(|(_, row)| row.is_some());
        let loads: Vec<f64> = done.map(|(load, _)| *load).collect();
        self.context.finished.keep(&loads, &table(rows)).map_err(StageError::Store)
    }
}

/// Progress of a task.
struct Progress<'a> {
    advance: &'a (dyn Fn(f64) + Sync),
    /// Number of loads of the task.
    loads: usize,
    /// Number of finished loads, including the finished fractions of those under way.
    done: Mutex<f64>,
}

impl Progress<'_> {
    fn add(&self, loads: f64) {
        let mut done = locked(&self.done);
        *done += loads;
        (self.advance)((*done / self.loads as f64).min(1.0));
    }
}

/// Watch that reports the progress of a load while it is solved.
struct LoadWatch<'a> {
    interrupted: &'a (dyn Fn() -> bool + Sync),
    progress: &'a Progress<'a>,
    /// Expected pairs of the load.
    expected: f64,
    /// Finished fraction of the load that the progress of the task includes.
    reported: Cell<f64>,
    last_report: Cell<Instant>,
}

/// Minimum time between two progress reports of a load. On small meshes a report takes longer than
/// an iteration.
const REPORT_INTERVAL: Duration = Duration::from_millis(200);

impl<'a> LoadWatch<'a> {
    fn new(
        interrupted: &'a (dyn Fn() -> bool + Sync),
        progress: &'a Progress<'a>,
        expected: f64,
    ) -> LoadWatch<'a> {
        let (reported, last_report) = (Cell::new(0.0), Cell::new(Instant::now()));
        LoadWatch { interrupted, progress, expected, reported, last_report }
    }

    fn finish(&self) {
        self.report(1.0);
    }

    fn report(&self, done: f64) {
        self.progress.add(done - self.reported.replace(done));
    }
}

impl Watch for LoadWatch<'_> {
    fn is_interrupted(&self) -> bool {
        (self.interrupted)()
    }

    fn spent(&self, pairs: u32) {
        if self.last_report.get().elapsed() >= REPORT_INTERVAL {
            self.last_report.set(Instant::now());
            self.report((f64::from(pairs) / self.expected).min(1.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;
    use std::path::Path;
    use std::sync::atomic::{AtomicBool, Ordering};

    use bytesize::ByteSize;

    use super::*;
    use crate::columns::LOAD;
    use crate::solve::tests::KeptRows;
    use crate::surface_files::SurfaceFiles;
    use asperity_mechanics::threads::Threads;
    use asperity_tables::column::reals;

    const LOADS: [f64; 4] = [0.1, 0.2, 0.3, 0.4];

    fn table(loads: Vec<f64>) -> Table {
        Table::new(loads.len(), vec![(LOAD, reals(loads))])
    }

    /// Outcome of a task that is interrupted after `most` loads: result, kept rows and reported
    /// fractions.
    fn run(count: usize, most: usize, kept: &KeptRows) -> (Result<Table, StageError>, Vec<f64>) {
        let threads = Threads::new(NonZeroUsize::new(count).unwrap());
        let reported = Mutex::new(Vec::new());
        let is_interrupted = AtomicBool::new(false);
        let context = Context {
            sources: &SurfaceFiles::new(Path::new("")),
            memory: ByteSize::gib(1),
            threads: &threads,
            interrupted: &|| is_interrupted.load(Ordering::Relaxed),
            finished: kept,
            stored: None,
            reserve: &|_| true,
            advance: &|fraction| locked(&reported).push(fraction),
        };
        let task = LoadTask::new(&context, &LOADS, 13.0);
        let solve = |(): &mut (), index: usize, watch: &dyn Watch| {
            if watch.is_interrupted() {
                return Err(StageError::Interrupted);
            }
            is_interrupted.store(index + 1 == most, Ordering::Relaxed);
            Ok(LOADS[index])
        };
        let result = task.run(&mut (), |()| Some(()), solve, table);
        (result, reported.into_inner().unwrap())
    }

    #[test]
    fn rows_follow_the_order_of_the_loads_for_any_number_of_threads() {
        for count in [1, 2, 3] {
            let (result, reported) = run(count, usize::MAX, &KeptRows::never_due());
            assert_eq!(result.unwrap(), table(LOADS.to_vec()));
            assert!(reported.is_sorted());
            assert_eq!(reported.last(), Some(&1.0));
        }
    }

    #[test]
    fn progress_counts_finished_loads() {
        let (_, reported) = run(1, usize::MAX, &KeptRows::never_due());
        assert_eq!(reported, [0.25, 0.5, 0.75, 1.0]);
    }

    #[test]
    fn finished_rows_are_kept_when_they_are_due() {
        let kept = KeptRows::always_due();
        run(1, usize::MAX, &kept).0.unwrap();
        let expected =
            (1..4).map(|count| (LOADS[..count].to_vec(), table(LOADS[..count].to_vec())));
        assert_eq!(kept.rows(), expected.collect::<Vec<_>>());
    }

    #[test]
    fn finished_rows_are_kept_after_an_interruption() {
        let kept = KeptRows::never_due();
        let (result, _) = run(1, 2, &kept);
        assert!(matches!(result, Err(StageError::Interrupted)));
        assert_eq!(kept.rows(), [(LOADS[..2].to_vec(), table(LOADS[..2].to_vec()))]);
    }
}
