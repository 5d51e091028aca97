//! Calls that run on several threads and end all threads before they return.
//!
//! In contrast, the threads of rayon's global pool stay alive. If the process forks afterwards, as
//! Python does, the pool of the child waits forever for threads that do not exist there. The pool
//! also panics if the system refuses a thread. This module uses fewer threads instead.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::thread::{self, Builder, available_parallelism};

/// Locks a mutex.
///
/// # Panics
/// Panics if a thread panicked while it held the lock.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().expect("no code panics while it holds the lock")
}

/// Applies a function to all items and returns the results in the order of the items.
///
/// There is one thread per core, or fewer if the system refuses to start threads.
pub fn map<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let take = || {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else {
                return done;
            };
            done.push((index, work(item)));
        }
    };
    let threads = available_parallelism().map_or(1, usize::from).min(items.len());
    let mut done: Vec<(usize, R)> =
        on_threads("part", threads, &take).into_iter().flatten().collect();
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Runs `work` on `count` threads, one of which is the calling thread. Returns one result per
/// thread. If the system refuses to start threads, uses fewer.
///
/// # Panics
/// Panics if `work` panics, after all threads have ended.
pub fn on_threads<R: Send>(name: &str, count: usize, work: &(impl Fn() -> R + Sync)) -> Vec<R> {
    thread::scope(|scope| {
        let start = |number: usize| {
            let builder = Builder::new().name(format!("{name}-{number}"));
            builder.spawn_scoped(scope, work).ok()
        };
        let helpers: Vec<_> = (1..count).map_while(start).collect();
        let mut done = vec![work()];
        let others = helpers.into_iter().map(|helper| helper.join());
        done.extend(others.map(|other| other.unwrap_or_else(|panic| resume_unwind(panic))));
        done
    })
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_items() {
        for count in [0, 1, 2, 1000] {
            let items: Vec<usize> = (0..count).collect();
            assert_eq!(map(&items, |item| item.to_string()).len(), count);
            let squares: Vec<usize> = items.iter().map(|item| item * item).collect();
            assert_eq!(map(&items, |item| item * item), squares);
        }
    }

    #[test]
    fn no_thread_outlives_the_call() {
        let names = || {
            let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten();
            let names =
                tasks.flatten().map(|task| std::fs::read_to_string(task.path().join("comm")));
            names.flatten().filter(|name| name.starts_with("short-lived")).count()
        };
        on_threads("short-lived", 4, &|| std::thread::yield_now());
        // The system may list a thread for a moment after it was joined.
        let start = Instant::now();
        while names() > 0 && start.elapsed() < Duration::from_secs(10) {
            thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(names(), 0);
    }

    #[test]
    #[should_panic(expected = "seven")]
    fn a_panic_in_one_item_panics_the_call() {
        map(&[1, 7, 3], |item| assert_ne!(*item, 7, "seven"));
    }
}
