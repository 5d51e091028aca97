//! Computations that Ctrl-C can interrupt.
//!
//! Python handles signals and raises their exceptions in its main thread only, so the computation
//! runs in another thread, or checks for signals itself.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::prelude::*;

use crate::errors::bug;

/// Interval between two checks for signals.
const CHECK_INTERVAL: Duration = Duration::from_millis(50);
/// Time that interrupted work may take to end. After that, its thread continues in the background;
/// this is safe because files appear whole.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Runs `work` in a new thread while other Python threads run.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    watched(py, &Arc::default(), work, |_| Ok(()))
}

/// Runs `work` in a new thread; a signal sets `stop`, and `poll` is called 20 times a second.
pub fn watched<T: Send + 'static>(
    py: Python<'_>,
    stop: &Arc<AtomicBool>,
    work: impl FnOnce() -> T + Send + 'static,
    mut poll: impl FnMut(Python<'_>) -> PyResult<()>,
) -> PyResult<T> {
    let (sender, receiver) = channel();
    thread::Builder::new().name("asperity".to_owned()).spawn(move || sender.send(work()))?;
    let receiver = Mutex::new(receiver);
    let wait = |time: Duration| {
        let held = receiver.lock().expect("no code panics while it holds the lock");
        held.recv_timeout(time)
    };
    loop {
        match py.detach(|| wait(CHECK_INTERVAL)) {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Disconnected) => return Err(bug()),
            Err(RecvTimeoutError::Timeout) => {
                let checked = py.check_signals().and_then(|()| poll(py));
                if let Err(error) = checked {
                    stop.store(true, Ordering::SeqCst);
                    let _ = py.detach(|| wait(PATIENCE));
                    return Err(error);
                }
            }
        }
    }
}

/// Check for signals such as Ctrl-C, at most 20 times a second, for work that runs in the calling
/// Python thread.
pub struct Signals {
    last_check: Cell<Instant>,
    exception: Cell<Option<PyErr>>,
}

impl Signals {
    pub fn new() -> Signals {
        Signals { last_check: Cell::new(Instant::now()), exception: Cell::new(None) }
    }

    /// Returns whether a signal requires the work to end.
    pub fn received(&self) -> bool {
        if self.last_check.get().elapsed() >= CHECK_INTERVAL {
            self.last_check.set(Instant::now());
            if let Err(error) = Python::attach(|py| py.check_signals()) {
                self.exception.set(Some(error));
                return true;
            }
        }
        false
    }

    /// Returns the exception that the signal raised.
    pub fn exception(self) -> Option<PyErr> {
        self.exception.into_inner()
    }
}
