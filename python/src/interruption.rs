//! Work that Ctrl-C ends: Python hears signals in its main thread alone, and only there does an
//! exception come of them.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::prelude::*;

use crate::errors::bug;

/// How often signals are looked for.
const EVERY: Duration = Duration::from_millis(50);
/// How long work that was told to stop may take to end. What goes on after that goes on alone: a
/// table is whole or not there, whenever its thread ends.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Work on a thread of its own, while other threads of Python run.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    watched(py, &Arc::default(), work, |_| Ok(()))
}

/// The same; a signal sets `stop`, and `look` is called again and again meanwhile.
pub fn watched<T: Send + 'static>(
    py: Python<'_>,
    stop: &Arc<AtomicBool>,
    work: impl FnOnce() -> T + Send + 'static,
    mut look: impl FnMut(Python<'_>) -> PyResult<()>,
) -> PyResult<T> {
    let (sender, receiver) = channel();
    thread::Builder::new().name("asperity".to_owned()).spawn(move || sender.send(work()))?;
    let receiver = Mutex::new(receiver);
    let wait = |time: Duration| {
        let receiver = receiver.lock().expect("no panic happens while it is held");
        receiver.recv_timeout(time)
    };
    loop {
        match py.detach(|| wait(EVERY)) {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Disconnected) => return Err(bug()),
            Err(RecvTimeoutError::Timeout) => {
                let heard = py.check_signals().and_then(|()| look(py));
                if let Err(error) = heard {
                    stop.store(true, Ordering::SeqCst);
                    let _ = py.detach(|| wait(PATIENCE));
                    return Err(error);
                }
            }
        }
    }
}

/// A question for work on the thread of Python itself: whether a signal came. Python is asked no
/// more often than 20 times a second.
pub struct Signals {
    asked: Cell<Instant>,
    heard: Cell<Option<PyErr>>,
}

impl Signals {
    pub fn new() -> Signals {
        Signals { asked: Cell::new(Instant::now()), heard: Cell::new(None) }
    }

    /// Whether work should end.
    pub fn came(&self) -> bool {
        if self.asked.get().elapsed() >= EVERY {
            self.asked.set(Instant::now());
            if let Err(error) = Python::attach(|py| py.check_signals()) {
                self.heard.set(Some(error));
                return true;
            }
        }
        false
    }

    /// The exception that came of it.
    pub fn exception(self) -> Option<PyErr> {
        self.heard.into_inner()
    }
}
