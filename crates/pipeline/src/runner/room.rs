//! Memory, shared by the tasks at work.

use std::sync::{Mutex, MutexGuard};

/// Each task takes its part before it begins. One that does not fit waits until others leave, and
/// smaller ones may begin before it; threads never wait.
pub struct Room {
    /// What each task takes.
    parts: Vec<u64>,
    state: Mutex<State>,
}

struct State {
    free: u64,
    /// Tasks that did not fit, in the order in which they came.
    waiting: Vec<usize>,
}

impl Room {
    /// So much memory, for tasks of these sizes. One that takes more may work alone.
    pub fn new(size: u64, parts: impl Iterator<Item = u64>) -> Room {
        Room {
            parts: parts.map(|part| part.min(size)).collect(),
            state: Mutex::new(State { free: size, waiting: Vec::new() }),
        }
    }

    /// Whether a task may begin; if not, one that leaves will hand it on.
    pub fn enter(&self, task: usize) -> bool {
        let mut state = self.state();
        let enters = state.admit(self.parts[task]);
        if !enters {
            state.waiting.push(task);
        }
        enters
    }

    /// Gives a task's part back; the tasks that may now begin.
    pub fn leave(&self, task: usize) -> Vec<usize> {
        let mut state = self.state();
        state.free += self.parts[task];
        let waiting = std::mem::take(&mut state.waiting).into_iter();
        let (begin, waiting) = waiting.partition(|&task| state.admit(self.parts[task]));
        state.waiting = waiting;
        begin
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect("no panic happens while it is held")
    }
}

impl State {
    fn admit(&mut self, part: u64) -> bool {
        let fits = part <= self.free;
        if fits {
            self.free -= part;
        }
        fits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_begin_as_others_leave_room_and_small_ones_first() {
        let room = Room::new(10, [6, 6, 3, 5].into_iter());
        assert!(room.enter(0));
        assert!(!room.enter(1), "two large ones do not fit");
        assert!(room.enter(2), "a small one beside a large one does");
        assert!(!room.enter(3));
        assert!(room.leave(2).is_empty(), "four are free");
        assert_eq!(room.leave(0), [1], "who came first");
        assert_eq!(room.leave(1), [3]);
        assert!(room.leave(3).is_empty());
        assert!(room.enter(0), "all is free again");
    }

    #[test]
    fn what_is_larger_than_the_room_works_alone() {
        let room = Room::new(10, [40, 1, 0].into_iter());
        assert!(room.enter(0) && !room.enter(1));
        assert!(room.enter(2), "what takes nothing always fits");
        assert_eq!(room.leave(0), [1]);
        assert!(!room.enter(0));
        assert_eq!(room.leave(1), [0]);
    }
}
