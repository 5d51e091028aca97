//! Threads that share the work on a surface, and the cores that surfaces share.
//!
//! Maps are cut into blocks of rows, spectra into blocks of columns, and whichever thread is free
//! takes the next block. Sums are added up in the order of the rows afterwards, by the solver's
//! `InOrder`, so that no number depends on how many threads there were, or on which of them did
//! what.
//!
//! A thread that has nothing to do sleeps. What is shared is one pass over the mesh: a surface that
//! begins while others are at work has its cores within milliseconds.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Nodes that are worth a thread: waking one takes as long as a few thousand nodes do.
const FEWEST_NODES: usize = 1 << 17;

/// Blocks to a thread, so that one that is held up leaves some to the others.
const BLOCKS: usize = 4;

/// Cores that this process may use.
pub fn available_cores() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

/// Threads to work on surfaces with, for whoever has a copy of this together.
///
/// ```
/// use std::num::NonZeroUsize;
///
/// use asperity_contact::elasticity::PeriodicHalfSpace;
/// use asperity_contact::grid::Grid;
/// use asperity_contact::solver::{Settings, Solver};
/// use asperity_contact::threads::Threads;
/// use asperity_contact::topography::shapes::Shape;
///
/// let grid = Grid::square(512, 1.0)?;
/// let wave = Shape::Wave { amplitude: 0.1, waves: 1 }.draw(grid);
/// let press = |threads: Threads| {
///     let mut solver = Solver::new(PeriodicHalfSpace::new(grid), wave.heights());
///     solver.work_on(threads);
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
    /// Nanoseconds that others have spent on the work of this task.
    helped: Arc<AtomicU64>,
}

#[derive(Debug)]
struct Cores {
    /// One thread to a core, but for one: whoever has work to share does a part of it himself. A
    /// thread that nobody ever had work for would look for some whenever there is any, on a core
    /// that another needs.
    pool: ThreadPool,
    count: usize,
    in_use: Mutex<InUse>,
}

#[derive(Debug, Default)]
struct InUse {
    /// Tasks that each keep a core.
    tasks: usize,
    /// Cores that were lent to them besides.
    lent: usize,
}

impl Threads {
    /// The thread that has the work, and no other.
    pub fn one() -> Self {
        Self::default()
    }

    /// Starts `count` threads, including the calling one, or fewer if the system refuses some of
    /// them. They end when the last clone is dropped.
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
                    helped: Arc::default(),
                };
            }
            helpers /= 2;
        }
        Self::one()
    }

    /// Starts at most `count` threads, but no more than a mesh of this many nodes can use.
    pub fn for_mesh(count: NonZeroUsize, nodes: usize) -> Self {
        let worthwhile = NonZeroUsize::new(Self::worthwhile(nodes));
        Self::new(worthwhile.map_or(count, |worthwhile| worthwhile.min(count)))
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.cores.as_ref().map_or(1, |cores| cores.count)
    }

    /// Keeps a core for a task until what is returned is dropped.
    pub fn begin_task(&self) -> Task {
        if let Some(cores) = &self.cores {
            cores.change(|in_use| in_use.tasks += 1);
        }
        Task { threads: Self { cores: self.cores.clone(), helped: Arc::default() } }
    }

    /// How many threads a pass over so many nodes is worth.
    pub fn worthwhile(nodes: usize) -> usize {
        (nodes / FEWEST_NODES).max(1)
    }

    /// The threads that there are at present for a pass over so many nodes.
    pub fn crew(&self, nodes: usize) -> Crew<'_> {
        self.crew_of(Self::worthwhile(nodes))
    }

    /// Does two things at once, if a second thread is worth while on so many nodes.
    pub fn both<A, B: Send>(
        &self,
        nodes: usize,
        first: impl FnOnce() -> A,
        second: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        let crew = self.crew_of(Self::worthwhile(nodes).min(2));
        match crew.cores {
            Some(cores) if crew.helpers > 0 => {
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

    /// At most so many of the threads.
    pub fn crew_of(&self, most: usize) -> Crew<'_> {
        let cores = self.cores.as_deref();
        Crew {
            cores,
            helpers: cores.map_or(0, |cores| cores.lend(most.saturating_sub(1))),
            helped: &self.helped,
            begun: Instant::now(),
        }
    }
}

impl Cores {
    fn change<V>(&self, change: impl FnOnce(&mut InUse) -> V) -> V {
        change(&mut self.in_use.lock().expect("no panic happens while it is held"))
    }

    /// Lends cores, but to nobody more than his share.
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
}

/// A task that keeps a core.
pub struct Task {
    threads: Threads,
}

impl Task {
    /// Its own core, and those that are free.
    pub fn threads(&self) -> &Threads {
        &self.threads
    }

    /// Time that other cores have spent on it.
    pub fn helped(&self) -> Duration {
        Duration::from_nanos(self.threads.helped.load(Ordering::Relaxed))
    }
}

impl Drop for Task {
    fn drop(&mut self) {
        if let Some(cores) = &self.threads.cores {
            cores.change(|in_use| in_use.tasks -= 1);
        }
    }
}

/// Threads that share one pass.
pub struct Crew<'a> {
    cores: Option<&'a Cores>,
    helpers: usize,
    helped: &'a AtomicU64,
    begun: Instant,
}

impl Crew<'_> {
    /// Where to cut so many pieces of work, no less than one: where each block begins, from zero.
    pub fn cuts(&self, pieces: usize) -> Vec<usize> {
        let blocks = match self.helpers {
            0 => 1,
            helpers => (BLOCKS * (helpers + 1)).min(pieces),
        };
        (0..blocks).map(|block| block * pieces / blocks).collect()
    }

    /// Does the work on each block, in any order, with the tools of whoever does it: as many as
    /// there are threads are made, if there are fewer.
    pub fn each<V: Send, B: Send>(
        &self,
        tools: &mut Vec<V>,
        new: impl Fn() -> V,
        blocks: &mut [B],
        work: impl Fn(&mut V, &mut B) + Sync,
    ) {
        while tools.len() <= self.helpers {
            tools.push(new());
        }
        let waiting = Mutex::new(blocks.iter_mut());
        let next = || {
            let mut waiting = waiting.lock().expect("no panic happens while it is held");
            waiting.next()
        };
        let toil = |tools: &mut V| {
            while let Some(block) = next() {
                work(tools, block);
            }
        };
        let (own, others) = tools.split_first_mut().expect("there is one at least");
        match self.cores {
            Some(cores) if self.helpers > 0 => cores.pool.in_place_scope(|scope| {
                for tools in &mut others[..self.helpers] {
                    scope.spawn(|_| toil(tools));
                }
                toil(own);
            }),
            _ => toil(own),
        }
    }
}

impl Drop for Crew<'_> {
    fn drop(&mut self) {
        if let Some(cores) = self.cores {
            cores.change(|in_use| in_use.lent -= self.helpers);
            let helped = self.begun.elapsed().as_nanos() as u64 * self.helpers as u64;
            self.helped.fetch_add(helped, Ordering::Relaxed);
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
        let helpers = |most: usize| threads.crew_of(most).helpers;
        let first = threads.begin_task();
        assert_eq!([helpers(100), helpers(3), helpers(1), helpers(0)], [4, 2, 0, 0]);
        let second = threads.begin_task();
        // Two for one of them and one for the other.
        let crew = threads.crew_of(100);
        assert_eq!([crew.helpers, helpers(100)], [2, 1]);
        drop((second, crew));
        assert_eq!(helpers(100), 4);
        let others: Vec<Task> = (0..4).map(|_| threads.begin_task()).collect();
        assert_eq!(helpers(100), 0);
        drop((first, others));
    }

    #[test]
    fn the_help_that_a_task_had_is_counted() {
        let threads = threads(3);
        let (alone, helped) = (threads.begin_task(), threads.begin_task());
        let crew = helped.threads().crew_of(2);
        std::thread::sleep(Duration::from_millis(2));
        drop(crew);
        assert!(helped.helped() >= Duration::from_millis(2));
        assert_eq!(alone.helped(), Duration::ZERO);
    }

    #[test]
    fn small_meshes_stay_on_one_thread() {
        let threads = threads(8);
        assert_eq!(threads.crew(256 * 256).helpers, 0);
        assert_eq!(threads.crew(512 * 512).helpers, 1);
        assert_eq!(threads.crew(1024 * 1024).helpers, 7);
        assert_eq!(Threads::one().crew(1 << 30).helpers, 0);
    }

    #[test]
    fn blocks_follow_each_other_and_all_work_is_done_once() {
        for count in [1, 2, 7] {
            let threads = threads(count);
            for pieces in [1, 2, 13, 1000] {
                let crew = threads.crew_of(100);
                let cuts = crew.cuts(pieces);
                assert_eq!(cuts[0], 0);
                assert!(cuts.is_sorted_by(|one, next| one < next));
                assert!(*cuts.last().unwrap() < pieces);
                let mut tools = Vec::new();
                let mut done = vec![0; pieces];
                crew.each(&mut tools, || (), &mut done, |(), done| *done += 1);
                assert_eq!(done, vec![1; pieces]);
                assert_eq!(tools.len(), count);
            }
        }
    }

    #[test]
    fn both_of_two_things_are_done() {
        for count in [1, 2, 3] {
            let threads = threads(count);
            let both = threads.both(1 << 20, || 2 + 2, || vec![7]);
            assert_eq!(both, (4, vec![7]));
            assert_eq!(threads.crew_of(100).helpers, count - 1);
        }
    }

    #[test]
    fn a_panic_of_one_thread_is_one_of_all_and_frees_the_cores() {
        let threads = threads(3);
        let pass = || {
            let crew = threads.crew_of(3);
            let mut blocks: Vec<usize> = (0..50).collect();
            let work = |(): &mut (), block: &mut usize| assert_ne!(*block, 7);
            crew.each(&mut Vec::new(), || (), &mut blocks, work);
        };
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(pass)).is_err());
        assert_eq!(threads.crew_of(3).helpers, 2);
    }
}
