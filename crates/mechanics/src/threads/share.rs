//! Items that do not depend on each other, each on one core and on those that remain free.
//!
//! Helpers are threads outside the pool. A thread of the pool that waits for a pass would take over
//! other work of the pool in the meantime, and the pass would have to wait for a whole item.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::{Threads, Workers, locked};

impl Threads {
    /// Calls `work(worker, item)` once for each item from 0 to `items` − 1, on all free cores.
    ///
    /// The calling thread works with `own`. Before each of its items, it lends every free core to a
    /// helper with a worker from `new_worker`, as long as items are left. If `new_worker` returns
    /// `None`, for example for lack of memory, it lends no more cores before this item. A helper
    /// stops when no items are left, or when more cores are in use than there are, because another
    /// task has started. It returns its core at once, and its worker is used again by later
    /// helpers. While the calling thread waits for the last helpers, their passes can borrow its
    /// core.
    ///
    /// # Errors
    /// Returns the first error of `work`. The remaining items are skipped.
    ///
    /// ```
    /// use std::convert::Infallible;
    /// use std::num::NonZeroUsize;
    /// use std::sync::Mutex;
    ///
    /// use asperity_mechanics::threads::Threads;
    ///
    /// let threads = Threads::new(NonZeroUsize::new(2).expect("two"));
    /// let squares = Mutex::new(vec![0; 5]);
    /// let work = |_: &mut (), item: usize| {
    ///     squares.lock().expect("no panic")[item] = item * item;
    ///     Ok::<(), Infallible>(())
    /// };
    /// threads.share(5, &mut (), |()| Some(()), work)?;
    /// assert_eq!(squares.into_inner()?, [0, 1, 4, 9, 16]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn share<W: Send, E: Send>(
        &self,
        items: usize,
        own: &mut W,
        mut new_worker: impl FnMut(&W) -> Option<W>,
        work: impl Fn(&mut W, usize) -> Result<(), E> + Sync,
    ) -> Result<(), E> {
        let items = SharedItems::new(items);
        let idle = Mutex::new(Vec::new());
        let idle_worker = || locked(&idle).pop();
        thread::scope(|scope| {
            let mut helpers = Vec::new();
            while let Some(item) = items.take() {
                while items.are_left()
                    && let Some(mut core) = self.free_core()
                    && let Some(mut worker) = idle_worker().or_else(|| new_worker(own))
                    && let Some(item) = items.take()
                {
                    let (items, idle, work) = (&items, &idle, &work);
                    let help = move || {
                        let mut next = Some(item);
                        while let Some(item) = next {
                            items.run(|| work(&mut worker, item));
                            next = if core.give_way() { None } else { items.take() };
                        }
                        locked(idle).push(worker);
                    };
                    match thread::Builder::new().spawn_scoped(scope, help) {
                        Ok(helper) => helpers.push(helper),
                        // The system refuses to start a thread.
                        Err(_) => items.run(|| work(own, item)),
                    }
                }
                items.run(|| work(own, item));
            }
            // The helpers that are left share the core of the calling thread.
            let _core = self.lend_own_core();
            for helper in helpers {
                helper.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            }
        });
        items.into_result()
    }

    /// Borrows a core if one is free.
    fn free_core(&self) -> Option<Workers<'_>> {
        let workers = self.workers_up_to(2);
        (workers.helpers > 0).then_some(workers)
    }
}

/// Queue of the items that several threads share.
struct SharedItems<E> {
    count: usize,
    next: AtomicUsize,
    error: Mutex<Option<E>>,
}

impl<E> SharedItems<E> {
    fn new(count: usize) -> Self {
        Self { count, next: AtomicUsize::new(0), error: Mutex::new(None) }
    }

    fn are_left(&self) -> bool {
        self.next.load(Ordering::Relaxed) < self.count
    }

    fn take(&self) -> Option<usize> {
        let next = |next: usize| (next < self.count).then_some(next + 1);
        self.next.fetch_update(Ordering::Relaxed, Ordering::Relaxed, next).ok()
    }

    fn skip_the_rest(&self) {
        self.next.store(self.count, Ordering::Relaxed);
    }

    /// Runs the work on an item. After an error or a panic, no thread takes another item.
    fn run(&self, work: impl FnOnce() -> Result<(), E>) {
        let guard = SkipOnPanic(self);
        let result = work();
        std::mem::forget(guard);
        if let Err(error) = result {
            self.skip_the_rest();
            locked(&self.error).get_or_insert(error);
        }
    }

    fn into_result(self) -> Result<(), E> {
        let error = self.error.into_inner().expect("no code panics while it holds the lock");
        error.map_or(Ok(()), Err)
    }
}

/// Guard that is dropped only if the work on an item panics.
struct SkipOnPanic<'a, E>(&'a SharedItems<E>);

impl<E> Drop for SkipOnPanic<'_, E> {
    fn drop(&mut self) {
        self.0.skip_the_rest();
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::Barrier;
    use std::time::{Duration, Instant};

    use super::*;

    fn threads(count: usize) -> Threads {
        Threads::new(NonZeroUsize::new(count).unwrap())
    }

    /// Shares items whose work is `work`, with numbered workers, and returns the worker of each.
    fn workers_of_items(
        threads: &Threads,
        items: usize,
        most_workers: usize,
        work: impl Fn(usize) + Sync,
    ) -> Vec<usize> {
        let done = Mutex::new(vec![None; items]);
        let mut workers = 1;
        let new_worker = |_: &usize| {
            workers += 1;
            (workers <= most_workers).then_some(workers)
        };
        let on_item = |worker: &mut usize, item: usize| {
            work(item);
            assert_eq!(locked(&done)[item].replace(*worker), None);
            Ok::<(), ()>(())
        };
        threads.share(items, &mut 1, new_worker, on_item).unwrap();
        done.into_inner().unwrap().into_iter().map(Option::unwrap).collect()
    }

    #[test]
    fn every_shared_item_is_done_once_and_helpers_return_their_cores() {
        for count in [1, 2, 3, 7] {
            let threads = threads(count);
            for items in [0, 1, 2, 100] {
                let workers = workers_of_items(&threads, items, 100, |_| ());
                assert_eq!(workers.len(), items);
                assert!(workers.iter().all(|worker| *worker <= count), "{workers:?}");
                assert_eq!(threads.workers_up_to(100).helpers, count - 1);
            }
        }
    }

    #[test]
    fn two_items_are_worked_on_at_the_same_time() {
        let threads = threads(2);
        let both = Barrier::new(2);
        let mut workers = workers_of_items(&threads, 2, 100, |_| {
            both.wait();
        });
        workers.sort_unstable();
        assert_eq!(workers, [1, 2]);
    }

    #[test]
    fn the_calling_thread_does_all_items_without_another_worker_or_core() {
        assert_eq!(workers_of_items(&threads(3), 9, 1, |_| ()), [1; 9]);
        let threads = threads(2);
        let tasks = [threads.begin_task(), threads.begin_task()];
        assert_eq!(workers_of_items(tasks[0].threads(), 9, 100, |_| ()), [1; 9]);
    }

    #[test]
    fn a_helper_gives_way_to_another_task() {
        let threads = threads(2);
        let sharing = threads.begin_task();
        let other = Mutex::new(None);
        let both = Barrier::new(2);
        let workers = workers_of_items(sharing.threads(), 20, 100, |item| {
            if item < 2 {
                both.wait();
            }
            if item == 0 {
                *locked(&other) = Some(threads.begin_task());
            }
            if item < 2 {
                both.wait();
            }
        });
        // The calling thread has the first item and a helper has the second. After these, the other
        // task has the core of the helper.
        assert_eq!(workers[..2], [1, 2]);
        assert_eq!(workers[2..], [1; 18]);
        assert!(sharing.helper_time() > Duration::ZERO);
        drop((sharing, other));
        assert_eq!(threads.workers_up_to(2).helpers, 1);
    }

    #[test]
    fn the_last_helper_borrows_the_core_of_the_calling_thread() {
        let threads = threads(2);
        let task = threads.begin_task();
        let both = Barrier::new(2);
        let borrowed = Mutex::new(0);
        let on_item = |worker: &mut usize, _: usize| {
            both.wait();
            // The calling thread is the first worker.
            if *worker == 2 {
                let start = Instant::now();
                while *locked(&borrowed) == 0 && start.elapsed() < Duration::from_secs(10) {
                    *locked(&borrowed) = task.threads().workers_up_to(2).helpers;
                }
            }
            Ok::<(), ()>(())
        };
        task.threads().share(2, &mut 1, |_| Some(2), on_item).unwrap();
        assert_eq!(locked(&borrowed).to_owned(), 1);
        // The calling thread has its core again.
        let _other = threads.begin_task();
        assert_eq!(threads.workers_up_to(2).helpers, 0);
    }

    #[test]
    fn an_error_skips_the_remaining_items() {
        let threads = threads(3);
        let done = Mutex::new(0);
        let work = |_: &mut (), item: usize| {
            *locked(&done) += 1;
            if item == 3 { Err(item) } else { Ok(()) }
        };
        assert_eq!(threads.share(1000, &mut (), |()| None, work), Err(3));
        assert_eq!(done.into_inner().unwrap(), 4);
    }

    #[test]
    fn a_panic_on_a_shared_item_spreads_and_frees_the_cores() {
        for panicking in [0, 1, 50] {
            let threads = threads(3);
            let work = |(): &mut (), item: usize| -> Result<(), ()> {
                assert_ne!(item, panicking);
                Ok(())
            };
            let share = || threads.share(100, &mut (), |()| Some(()), work);
            assert!(catch_unwind(AssertUnwindSafe(share)).is_err());
            assert_eq!(threads.workers_up_to(3).helpers, 2);
        }
    }
}
