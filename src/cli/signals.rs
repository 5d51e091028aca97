//! What the system tells the process while it runs.

use std::io;
use std::process::exit;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::thread::{self, Builder};
use std::time::Duration;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;

use super::warn;

/// How long a stopped run may take to end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Patience {
    /// Somebody sits before it.
    OfAPerson,
    /// A scheduler waits: Slurm half a minute for who is cancelled, a whole one, as scripts ask it
    /// to, for who is out of time.
    OfANode,
}

impl Patience {
    fn duration(self) -> Duration {
        match self {
            Patience::OfAPerson => Duration::from_millis(1500),
            Patience::OfANode => Duration::from_secs(20),
        }
    }
}

/// Makes a file that grows beyond `ulimit -f` an error of whoever writes it, who knows its name;
/// otherwise the system would end the process without a word.
pub fn survive_large_files() -> io::Result<()> {
    signal_hook::flag::register(SIGXFSZ, Arc::default()).map(drop)
}

/// Whether, and by which signal, the process has been asked to stop.
#[derive(Debug, Clone, Default)]
pub struct StopSignal {
    asked: Arc<AtomicBool>,
    signal: Arc<AtomicI32>,
}

impl StopSignal {
    /// The first signal asks tasks to stop. Those that do not before patience ends, and those under
    /// way at a second signal, are dropped: whatever moment a process ends, nothing stored is
    /// harmed. What `nohup` has started outlives its terminal.
    pub fn on_signal(patience: Patience) -> io::Result<StopSignal> {
        let stop = StopSignal::default();
        let mut heard = vec![SIGINT, SIGTERM];
        heard.extend((!is_ignored(SIGHUP)).then_some(SIGHUP));
        let mut signals = Signals::new(heard)?;
        let asked = stop.clone();
        let hear = move || {
            for signal in signals.forever() {
                asked.hear(signal, patience);
            }
        };
        let started = Builder::new().spawn(hear).map(drop);
        started.map_err(|error| {
            let message = "cannot start the thread that hears Ctrl-C; allow more processes \
                           (`ulimit -u`)";
            io::Error::new(error.kind(), format!("{message}: {error}"))
        })?;
        Ok(stop)
    }

    /// Whether the process has been asked to stop.
    pub fn asked(&self) -> &AtomicBool {
        &self.asked
    }

    /// How shells know a process that a signal has ended: 130 after Ctrl-C, 143 after `kill`.
    pub fn exit_code(&self) -> u8 {
        let signal = self.signal.load(Ordering::SeqCst);
        u8::try_from(128 + signal).unwrap_or(u8::MAX)
    }

    fn hear(&self, signal: i32, patience: Patience) {
        self.signal.store(signal, Ordering::SeqCst);
        if self.asked.swap(true, Ordering::SeqCst) {
            exit(self.exit_code().into());
        }
        warn("stopping; finished tasks are kept");
        let code = self.exit_code().into();
        let end = move || {
            thread::sleep(patience.duration());
            warn("stopped; unfinished tasks are dropped, run again to go on");
            exit(code)
        };
        if Builder::new().spawn(end).is_err() {
            end();
        }
    }
}

/// Whether the process was started to ignore a signal, as far as the system tells.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
