//! Queue of ready tasks for the workers, the memory budget that running tasks share, and the series
//! to which they add rows.

use std::collections::HashMap;
use std::sync::{Condvar, Mutex};

use asperity_tables::key::{KeyMap, TaskKey};
use asperity_tables::parallel::locked;

/// A task whose inputs exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ready {
    /// Task for which no memory is reserved yet.
    Waiting(usize),
    /// Task for which memory is reserved.
    Admitted(usize),
}

/// Stack of the tasks that are ready to start. The task added last starts first, because it mostly
/// reads the table that has just been computed.
#[derive(Default)]
pub struct ReadyTasks {
    state: Mutex<Queue>,
    changed: Condvar,
}

#[derive(Default)]
struct Queue {
    ready: Vec<Ready>,
    /// Number of running tasks. Each may make other tasks ready when it finishes.
    at_work: usize,
}

impl ReadyTasks {
    pub fn push(&self, task: Ready) {
        locked(&self.state).ready.push(task);
        self.changed.notify_one();
    }

    /// Waits for the next task and returns it. The task counts as running until the returned guard
    /// is dropped. Returns `None` when no task is ready or running.
    pub fn next(&self) -> Option<(Ready, AtWork<'_>)> {
        let mut state = locked(&self.state);
        loop {
            if let Some(task) = state.ready.pop() {
                state.at_work += 1;
                return Some((task, AtWork(self)));
            }
            if state.at_work == 0 {
                return None;
            }
            let woken = self.changed.wait(state);
            state = woken.expect("no code panics while it holds the lock");
        }
    }
}

/// Guard that counts a task as running until it is dropped.
pub struct AtWork<'a>(&'a ReadyTasks);

impl Drop for AtWork<'_> {
    fn drop(&mut self) {
        let mut state = locked(&self.0.state);
        state.at_work -= 1;
        if state.at_work == 0 {
            self.0.changed.notify_all();
        }
    }
}

/// Memory budget that the running tasks share.
///
/// The memory of each task is reserved before the task starts. A task that does not fit waits until
/// others have released memory, and smaller tasks may start before it. Threads do not wait: they
/// compute other tasks.
pub struct MemoryBudget {
    parts: Vec<u64>,
    state: Mutex<Memory>,
}

struct Memory {
    free: u64,
    /// Memory that running tasks have reserved in addition to their own, by task.
    additional: HashMap<usize, u64>,
    /// Tasks that did not fit, in the order in which they were tried.
    waiting: Vec<usize>,
}

impl MemoryBudget {
    /// Creates a budget of `size` bytes; `parts` are the sizes of all tasks in bytes. A task that
    /// is larger than the budget runs alone.
    pub fn new(size: u64, parts: impl Iterator<Item = u64>) -> MemoryBudget {
        MemoryBudget {
            parts: parts.map(|part| part.min(size)).collect(),
            state: Mutex::new(Memory {
                free: size,
                additional: HashMap::new(),
                waiting: Vec::new(),
            }),
        }
    }

    /// Reserves the memory of a task. Returns false if the memory is not free; the task is then
    /// returned later by [`MemoryBudget::leave`].
    pub fn enter(&self, task: usize) -> bool {
        let mut state = locked(&self.state);
        let enters = state.admit(self.parts[task]);
        if !enters {
            state.waiting.push(task);
        }
        enters
    }

    /// Reserves further memory for a running task until the task ends. Returns false if the memory
    /// is not free.
    pub fn reserve(&self, task: usize, bytes: u64) -> bool {
        let mut state = locked(&self.state);
        let fits = state.admit(bytes);
        if fits {
            *state.additional.entry(task).or_default() += bytes;
        }
        fits
    }

    /// Releases the memory of a task and reserves it for waiting tasks. Returns the tasks that may
    /// start now.
    pub fn leave(&self, task: usize) -> Vec<usize> {
        let mut state = locked(&self.state);
        state.free += self.parts[task] + state.additional.remove(&task).unwrap_or(0);
        let waiting = std::mem::take(&mut state.waiting).into_iter();
        let (begin, waiting) = waiting.partition(|&task| state.admit(self.parts[task]));
        state.waiting = waiting;
        begin
    }
}

impl Memory {
    fn admit(&mut self, part: u64) -> bool {
        let fits = part <= self.free;
        if fits {
            self.free -= part;
        }
        fits
    }
}

/// Series to which running tasks add rows.
///
/// Two tasks that add rows to the same series run one after the other, because both may lack the
/// same rows.
#[derive(Default)]
pub struct BusySeries(Mutex<KeyMap<Vec<usize>>>);

impl BusySeries {
    /// Marks the series of a task as busy. Returns false if it is busy already; the task is then
    /// returned later by [`BusySeries::leave`].
    pub fn enter(&self, series: TaskKey, task: usize) -> bool {
        let mut busy = locked(&self.0);
        match busy.get_mut(&series) {
            Some(waiting) => {
                waiting.push(task);
                false
            }
            None => {
                busy.insert(series, Vec::new());
                true
            }
        }
    }

    /// Marks the series as free, and returns the tasks that wait for it.
    pub fn leave(&self, series: TaskKey) -> Vec<usize> {
        let mut busy = locked(&self.0);
        busy.remove(&series).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {

    use super::*;

    #[test]
    fn the_latest_comes_first_and_no_more_come_when_none_is_at_work() {
        let tasks = ReadyTasks::default();
        tasks.push(Ready::Waiting(1));
        tasks.push(Ready::Waiting(2));
        let (second, working) = tasks.next().unwrap();
        assert_eq!(second, Ready::Waiting(2));
        tasks.push(Ready::Admitted(3));
        drop(working);
        assert_eq!(tasks.next().unwrap().0, Ready::Admitted(3));
        assert_eq!(tasks.next().unwrap().0, Ready::Waiting(1));
        assert!(tasks.next().is_none());
    }

    #[test]
    fn a_worker_waits_for_what_others_make_ready() {
        let tasks = ReadyTasks::default();
        tasks.push(Ready::Waiting(0));
        let (_, working) = tasks.next().unwrap();
        std::thread::scope(|scope| {
            let other = scope.spawn(|| tasks.next().map(|(task, _)| task));
            tasks.push(Ready::Waiting(7));
            assert_eq!(other.join().unwrap(), Some(Ready::Waiting(7)));
            let last = scope.spawn(|| tasks.next().is_none());
            drop(working);
            assert!(last.join().unwrap());
        });
    }

    #[test]
    fn tasks_begin_as_others_leave_room_and_small_ones_first() {
        let room = MemoryBudget::new(10, [6, 6, 3, 5].into_iter());
        assert!(room.enter(0));
        assert!(!room.enter(1), "two large tasks do not fit");
        assert!(room.enter(2), "a small task fits beside a large one");
        assert!(!room.enter(3));
        assert!(room.leave(2).is_empty(), "four bytes are free");
        assert_eq!(room.leave(0), [1], "the task that was tried first starts");
        assert_eq!(room.leave(1), [3]);
        assert!(room.leave(3).is_empty());
        assert!(room.enter(0), "all memory is free again");
    }

    #[test]
    fn what_is_larger_than_the_room_works_alone() {
        let room = MemoryBudget::new(10, [40, 1, 0].into_iter());
        assert!(room.enter(0) && !room.enter(1));
        assert!(room.enter(2), "a task without memory always fits");
        assert_eq!(room.leave(0), [1]);
        assert!(!room.enter(0));
        assert_eq!(room.leave(1), [0]);
    }
}
