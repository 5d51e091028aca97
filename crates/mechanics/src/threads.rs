//! Threads that share the work on one surface, and cores that several surfaces share.
//!
//! Maps are divided into blocks of rows, and spectra into blocks of columns. Each free thread takes
//! the next block. Sums are then added up in the order of the rows (`InOrder` in the solver), so no
//! result depends on the number of threads or on their timing.
//!
//! Idle threads sleep. A task borrows cores for one pass over the mesh, so a surface that starts
//! while others are running gets its cores within milliseconds.
//!
//! Items that do not depend on each other, such as the loads of a surface, are better computed at
//! the same time: [`Threads::share`] lends a core for whole items.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use rayon::{ThreadPool, ThreadPoolBuilder};

mod share;

/// Number of nodes of a pass for each thread.
///
/// Waking a thread takes as long as the work on a few thousand nodes, so more threads would not be
/// faster on small maps.
const NODES_PER_THREAD: usize = 1 << 17;

/// Number of blocks per thread into which [`Workers::cuts`] divides work. With several, other
/// threads can take over the blocks of a delayed one.
const BLOCKS_PER_THREAD: usize = 4;

/// Returns the number of cores that this process may use.
pub fn available_cores() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

/// Pool of threads that work on surfaces; clones share the pool.
///
/// ```
/// use std::num::NonZeroUsize;
///
/// use asperity_mechanics::elasticity::PeriodicHalfSpace;
/// use asperity_mechanics::grid::Grid;
/// use asperity_mechanics::reduced::ReducedHeights;
/// use asperity_mechanics::solver::{Settings, Solver};
/// use asperity_mechanics::threads::Threads;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// let grid = Grid::square(512, 1.0)?;
/// let wave = Shape::Wave { amplitude: 0.1, waves: 1 }.draw(grid);
/// let heights = ReducedHeights::reduced(grid, wave.into_heights())?;
/// let press = |threads: Threads| {
///     let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &heights);
///     solver.set_threads(threads);
///     solver.press(0.01, &Settings::default(), &|| false);
///     solver.pressure().to_vec()
/// };
/// let three = Threads::new(NonZeroUsize::new(3).expect("three"));
/// assert_eq!(press(three), press(Threads::one()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Threads {
    cores: Option<Arc<Cores>>,
    /// Total time that other cores have been lent to this task, in nanoseconds.
    helper_time: Arc<AtomicU64>,
}

#[derive(Debug)]
struct Cores {
    /// Pool of `count − 1` threads. The calling thread is the last of the `count` threads. With one
    /// more thread in the pool, the caller would have to compete for its core, because idle threads
    /// of a pool wake up for any work.
    pool: ThreadPool,
    count: usize,
    in_use: Mutex<InUse>,
}

#[derive(Debug, Default)]
struct InUse {
    /// Number of running tasks. Each of them keeps a core.
    tasks: usize,
    /// Number of cores lent to tasks in addition to their own.
    lent: usize,
}

impl Threads {
    /// Returns a pool that consists of the calling thread alone.
    pub fn one() -> Self {
        Self::default()
    }

    /// Starts a pool of `count` threads, including the calling thread. If the system refuses to
    /// start them, the pool is smaller.
    ///
    /// The threads end when the last clone is dropped.
    pub fn new(count: NonZeroUsize) -> Self {
        let mut helpers = count.get() - 1;
        while helpers > 0 {
            let pool = ThreadPoolBuilder::new()
                .num_threads(helpers)
                .thread_name(|number| format!("helper-{number}"))
                .build();
            if let Ok(pool) = pool {
                return Self {
                    cores: Some(Arc::new(Cores {
                        pool,
                        count: helpers + 1,
                        in_use: Mutex::default(),
                    })),
                    helper_time: Arc::default(),
                };
            }
            helpers /= 2;
        }
        Self::one()
    }

    /// Starts a pool of at most `count` threads, and of no more than
    /// [`useful_for`](Self::useful_for) a map of `nodes` nodes.
    pub fn for_mesh(count: NonZeroUsize, nodes: usize) -> Self {
        let useful_for = NonZeroUsize::new(Self::useful_for(nodes));
        Self::new(useful_for.map_or(count, |useful_for| useful_for.min(count)))
    }

    /// Returns the number of threads, including the calling one.
    pub fn count(&self) -> usize {
        self.cores.as_ref().map_or(1, |cores| cores.count)
    }

    /// Begins a task and reserves a core for it until the returned value is dropped.
    pub fn begin_task(&self) -> Task {
        if let Some(cores) = &self.cores {
            cores.change(|in_use| in_use.tasks += 1);
        }
        Task { threads: Self { cores: self.cores.clone(), helper_time: Arc::default() } }
    }

    /// Returns the number of threads that are useful for a pass over `nodes` nodes, at least one.
    pub fn useful_for(nodes: usize) -> usize {
        (nodes / NODES_PER_THREAD).max(1)
    }

    /// Borrows free threads for a pass over `nodes` nodes, as many as are
    /// [useful](Self::useful_for).
    pub fn workers(&self, nodes: usize) -> Workers<'_> {
        self.workers_up_to(Self::useful_for(nodes))
    }

    /// Runs two functions that visit about `nodes` nodes together, and returns their results. They
    /// run in parallel if a second thread is free and useful for so many nodes.
    pub fn join<A, B: Send>(
        &self,
        nodes: usize,
        first: impl FnOnce() -> A,
        second: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        let workers = self.workers_up_to(Self::useful_for(nodes).min(2));
        match workers.cores {
            Some(cores) if workers.helpers > 0 => {
                let mut done = None;
                let own = cores.pool.in_place_scope(|scope| {
                    scope.spawn(|_| done = Some(second()));
                    first()
                });
                (own, done.expect("the scope waits for it"))
            }
            _ => (first(), second()),
        }
    }

    /// Borrows free threads until the returned value is dropped: at most `most`, including the
    /// calling thread.
    pub fn workers_up_to(&self, most: usize) -> Workers<'_> {
        let cores = self.cores.as_deref();
        Workers {
            cores,
            helpers: cores.map_or(0, |cores| cores.lend(most.saturating_sub(1))),
            helper_time: &self.helper_time,
            begun: Instant::now(),
        }
    }
}

impl Cores {
    fn change<V>(&self, change: impl FnOnce(&mut InUse) -> V) -> V {
        change(&mut locked(&self.in_use))
    }

    /// Lends free cores to a task and returns their number: at most `most`, and at most
    /// ⌈`count`/`tasks`⌉ − 1, an equal share of all cores.
    fn lend(&self, most: usize) -> usize {
        self.change(|in_use| {
            let tasks = in_use.tasks.max(1);
            let free = self.count.saturating_sub(tasks + in_use.lent);
            let share = self.count.div_ceil(tasks) - 1;
            let lent = most.min(free).min(share);
            in_use.lent += lent;
            lent
        })
    }

    /// Takes back `lent` cores if more cores are in use than there are. Returns whether it did.
    fn take_back_if_overbooked(&self, lent: usize) -> bool {
        self.change(|in_use| {
            let is_overbooked = in_use.tasks.max(1) + in_use.lent > self.count;
            if is_overbooked {
                in_use.lent -= lent;
            }
            is_overbooked
        })
    }
}

fn locked<V>(mutex: &Mutex<V>) -> MutexGuard<'_, V> {
    mutex.lock().expect("no code panics while it holds the lock")
}

/// Running task, which keeps one core until it is dropped.
pub struct Task {
    threads: Threads,
}

impl Task {
    /// Returns the threads of the task: its own core and free cores.
    pub fn threads(&self) -> &Threads {
        &self.threads
    }

    /// Returns the total time for which other cores have been lent to the task.
    pub fn helper_time(&self) -> Duration {
        Duration::from_nanos(self.threads.helper_time.load(Ordering::Relaxed))
    }
}

impl Drop for Task {
    fn drop(&mut self) {
        if let Some(cores) = &self.threads.cores {
            cores.change(|in_use| in_use.tasks -= 1);
        }
    }
}

/// Threads that share one pass, including the calling thread. Dropping the value returns the others
/// to the pool.
pub struct Workers<'a> {
    cores: Option<&'a Cores>,
    helpers: usize,
    helper_time: &'a AtomicU64,
    begun: Instant,
}

impl Workers<'_> {
    /// Returns the borrowed cores if more cores are in use than there are. Returns whether it did.
    fn give_way(&mut self) -> bool {
        let gives_way = self.cores.is_some_and(|cores| cores.take_back_if_overbooked(self.helpers));
        if gives_way {
            self.count_time();
            self.helpers = 0;
        }
        gives_way
    }

    fn count_time(&self) {
        let helper_time = self.begun.elapsed().as_nanos() as u64 * self.helpers as u64;
        self.helper_time.fetch_add(helper_time, Ordering::Relaxed);
    }

    /// Divides `pieces` (at least one) consecutive pieces of work into blocks of about equal size.
    /// Returns the index of the first piece of each block.
    pub fn cuts(&self, pieces: usize) -> Vec<usize> {
        let blocks = match self.helpers {
            0 => 1,
            helpers => (BLOCKS_PER_THREAD * (helpers + 1)).min(pieces),
        };
        (0..blocks).map(|block| block * pieces / blocks).collect()
    }

    /// Calls `work(state, block)` for each block, in any order.
    ///
    /// Each thread uses its own element of `states`. Missing elements are created with `new_state`.
    pub fn for_each<V: Send, B: Send>(
        &self,
        states: &mut Vec<V>,
        new_state: impl Fn() -> V,
        blocks: &mut [B],
        work: impl Fn(&mut V, &mut B) + Sync,
    ) {
        while states.len() <= self.helpers {
            states.push(new_state());
        }
        let waiting = Mutex::new(blocks.iter_mut());
        let next = || locked(&waiting).next();
        let run_blocks = |states: &mut V| {
            while let Some(block) = next() {
                work(states, block);
            }
        };
        let (own, others) = states.split_first_mut().expect("there is one at least");
        match self.cores {
            Some(cores) if self.helpers > 0 => cores.pool.in_place_scope(|scope| {
                for states in &mut others[..self.helpers] {
                    scope.spawn(|_| run_blocks(states));
                }
                run_blocks(own);
            }),
            _ => run_blocks(own),
        }
    }
}

impl Drop for Workers<'_> {
    fn drop(&mut self) {
        if let Some(cores) = self.cores {
            cores.change(|in_use| in_use.lent -= self.helpers);
            self.count_time();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn threads(count: usize) -> Threads {
        Threads::new(NonZeroUsize::new(count).unwrap())
    }

    #[test]
    fn a_task_alone_has_all_cores_and_several_share_them() {
        let threads = threads(5);
        let helpers = |most: usize| threads.workers_up_to(most).helpers;
        let first = threads.begin_task();
        assert_eq!([helpers(100), helpers(3), helpers(1), helpers(0)], [4, 2, 0, 0]);
        let second = threads.begin_task();
        // The first task borrows two cores and the second task one.
        let workers = threads.workers_up_to(100);
        assert_eq!([workers.helpers, helpers(100)], [2, 1]);
        drop((second, workers));
        assert_eq!(helpers(100), 4);
        let others: Vec<Task> = (0..4).map(|_| threads.begin_task()).collect();
        assert_eq!(helpers(100), 0);
        drop((first, others));
    }

    #[test]
    fn the_help_that_a_task_had_is_counted() {
        let threads = threads(3);
        let (alone, helped) = (threads.begin_task(), threads.begin_task());
        let workers = helped.threads().workers_up_to(2);
        std::thread::sleep(Duration::from_millis(2));
        drop(workers);
        assert!(helped.helper_time() >= Duration::from_millis(2));
        assert_eq!(alone.helper_time(), Duration::ZERO);
    }

    #[test]
    fn small_meshes_stay_on_one_thread() {
        let threads = threads(8);
        assert_eq!(threads.workers(256 * 256).helpers, 0);
        assert_eq!(threads.workers(512 * 512).helpers, 1);
        assert_eq!(threads.workers(1024 * 1024).helpers, 7);
        assert_eq!(Threads::one().workers(1 << 30).helpers, 0);
    }

    #[test]
    fn blocks_follow_each_other_and_all_work_is_done_once() {
        for count in [1, 2, 7] {
            let threads = threads(count);
            for pieces in [1, 2, 13, 1000] {
                let workers = threads.workers_up_to(100);
                let cuts = workers.cuts(pieces);
                assert_eq!(cuts[0], 0);
                assert!(cuts.is_sorted_by(|one, next| one < next));
                assert!(*cuts.last().unwrap() < pieces);
                let mut states = Vec::new();
                let mut done = vec![0; pieces];
                workers.for_each(&mut states, || (), &mut done, |(), done| *done += 1);
                assert_eq!(done, vec![1; pieces]);
                assert_eq!(states.len(), count);
            }
        }
    }

    #[test]
    fn join_runs_both_functions() {
        for count in [1, 2, 3] {
            let threads = threads(count);
            let both = threads.join(1 << 20, || 2 + 2, || vec![7]);
            assert_eq!(both, (4, vec![7]));
            assert_eq!(threads.workers_up_to(100).helpers, count - 1);
        }
    }

    #[test]
    fn a_panic_of_one_thread_spreads_and_frees_the_cores() {
        let threads = threads(3);
        let pass = || {
            let workers = threads.workers_up_to(3);
            let mut blocks: Vec<usize> = (0..50).collect();
            let work = |(): &mut (), block: &mut usize| assert_ne!(*block, 7);
            workers.for_each(&mut Vec::new(), || (), &mut blocks, work);
        };
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(pass)).is_err());
        assert_eq!(threads.workers_up_to(3).helpers, 2);
    }
}
