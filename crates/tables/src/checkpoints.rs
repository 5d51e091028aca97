//! How far a long task has come, kept while it is computed: it can go on from there after its process
//! has ended, in whatever way.

use std::io::{self, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Where one task keeps how far it has come. Nothing in it decides a number: a task that goes on from
/// a checkpoint ends with the bytes that it would have had.
pub trait Checkpoints: Sync {
    /// What was kept last; none if there is nothing, or nothing whole.
    fn last(&self) -> Option<Vec<u8>>;

    /// Whether it is time to keep something.
    fn is_due(&self) -> bool;

    /// Keeps what is written, in the place of what was kept before. Where that is not possible,
    /// nothing is kept and the task goes on.
    fn keep(&self, write: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>);
}

/// When something was kept last.
#[derive(Debug)]
pub struct Clock {
    every: Duration,
    last: Mutex<Instant>,
}

impl Clock {
    /// One by which something is due after so long, again and again.
    pub fn new(every: Duration) -> Clock {
        Clock { every, last: Mutex::new(Instant::now()) }
    }

    /// Whether it is time.
    pub fn is_due(&self) -> bool {
        self.last().elapsed() >= self.every
    }

    /// Begins anew.
    pub fn reset(&self) {
        *self.last() = Instant::now();
    }

    fn last(&self) -> std::sync::MutexGuard<'_, Instant> {
        self.last.lock().expect("no panic happens while it is held")
    }
}
