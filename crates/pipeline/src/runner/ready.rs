//! Tasks that may begin, and the workers that wait for them.

use std::sync::{Condvar, Mutex, MutexGuard};

/// A task that may begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ready {
    /// As soon as it has found room.
    Unhoused(usize),
    /// It has been given room.
    Housed(usize),
}

/// What is ready; the latest first, which goes on with what has just been computed.
#[derive(Default)]
pub struct ReadyTasks {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    ready: Vec<Ready>,
    /// Tasks that are at work, and may make others ready.
    at_work: usize,
}

impl ReadyTasks {
    pub fn push(&self, task: Ready) {
        self.state().ready.push(task);
        self.changed.notify_one();
    }

    /// The next task, at work until what is returned with it is dropped. Waits for one; none when there
    /// will be no more.
    pub fn next(&self) -> Option<(Ready, AtWork<'_>)> {
        let mut state = self.state();
        loop {
            if let Some(task) = state.ready.pop() {
                state.at_work += 1;
                return Some((task, AtWork(self)));
            }
            if state.at_work == 0 {
                return None;
            }
            let woken = self.changed.wait(state);
            state = woken.expect("no panic happens while it is held");
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect("no panic happens while it is held")
    }
}

/// A task at work.
pub struct AtWork<'a>(&'a ReadyTasks);

impl Drop for AtWork<'_> {
    fn drop(&mut self) {
        let mut state = self.0.state();
        state.at_work -= 1;
        if state.at_work == 0 {
            self.0.changed.notify_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_comes_first_and_no_more_come_when_none_is_at_work() {
        let tasks = ReadyTasks::default();
        tasks.push(Ready::Unhoused(1));
        tasks.push(Ready::Unhoused(2));
        let (second, working) = tasks.next().unwrap();
        assert_eq!(second, Ready::Unhoused(2));
        tasks.push(Ready::Housed(3));
        drop(working);
        assert_eq!(tasks.next().unwrap().0, Ready::Housed(3));
        assert_eq!(tasks.next().unwrap().0, Ready::Unhoused(1));
        assert!(tasks.next().is_none());
    }

    #[test]
    fn a_worker_waits_for_what_others_make_ready() {
        let tasks = ReadyTasks::default();
        tasks.push(Ready::Unhoused(0));
        let (_, working) = tasks.next().unwrap();
        std::thread::scope(|scope| {
            let other = scope.spawn(|| tasks.next().map(|(task, _)| task));
            tasks.push(Ready::Unhoused(7));
            assert_eq!(other.join().unwrap(), Some(Ready::Unhoused(7)));
            let last = scope.spawn(|| tasks.next().is_none());
            drop(working);
            assert!(last.join().unwrap());
        });
    }
}
