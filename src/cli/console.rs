//! ProgressDisplay display of a run, and handling of signals.

use std::io::{self, IsTerminal, stderr};
use std::process::exit;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, Builder};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use super::{print_notice, warn};
use crate::session::events::Batch;
use crate::session::failures;
use crate::session::{Event, Observer, RunProgress};
use asperity_tables::parallel::locked;

/// Time between progress lines if stderr is not a terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Maximum number of failures printed; the table of failures lists all.
const MAX_FAILURES: usize = 10;

/// Observer that prints notices, progress and failures of a run on standard error.
#[derive(Default)]
pub(crate) struct Console {
    /// ProgressDisplay of the current batch of tasks.
    progress: Mutex<Option<ProgressDisplay>>,
}

impl Observer for Console {
    fn on_event(&self, event: Event<'_>) {
        let mut progress = locked(&self.progress);
        match (event, progress.as_mut()) {
            (Event::Begun(batch), _) => *progress = Some(ProgressDisplay::new(batch)),
            (Event::Started(task), Some(ProgressDisplay { run, bar, .. })) => {
                if let (Some(bar), Some(kind)) = (bar, run.kind(task)) {
                    bar.set_prefix(kind.name());
                }
            }
            (Event::Advanced(task, share), Some(progress)) => {
                progress.run.advanced(task, share);
                progress.update_display();
            }
            (Event::Finished(task), Some(progress)) => {
                progress.run.finished(task);
                progress.update_display();
            }
            (Event::Ended, Some(ended)) => {
                ended.bar.iter().for_each(ProgressBar::finish_and_clear);
                *progress = None;
            }
            (Event::Failed(failed), _) => {
                let lines = failures::text_lines(failed, MAX_FAILURES)
                    .expect("the event carries a table of failures");
                lines.iter().for_each(|line| warn(line));
            }
            (other, _) => print_notice(other),
        }
    }
}

/// ProgressDisplay bar on a terminal, or plain lines.
struct ProgressDisplay {
    run: RunProgress,
    bar: Option<ProgressBar>,
    last_line: Instant,
}

impl ProgressDisplay {
    /// Starts the display for a batch of tasks.
    fn new(batch: Batch) -> ProgressDisplay {
        let bar = stderr().is_terminal().then(|| {
            let template = "{prefix:9} {bar:40} {pos}/{len} {elapsed} {msg}";
            let style = ProgressStyle::with_template(template).expect("the template is valid");
            let bar = ProgressBar::new(batch.tasks.len() as u64).with_style(style);
            bar.enable_steady_tick(Duration::from_millis(250));
            bar
        });
        if bar.is_none() {
            warn(&batch.to_string());
        }
        ProgressDisplay { run: RunProgress::new(batch), bar, last_line: Instant::now() }
    }

    fn update_display(&mut self) {
        if let Some(bar) = &self.bar {
            bar.set_position(self.run.tasks_done() as u64);
            bar.set_message(self.run.time_left_in_words());
        } else if self.last_line.elapsed() >= LINE_EVERY {
            self.last_line = Instant::now();
            warn(&self.run.to_string());
        }
    }
}

/// Time that a stopped run may take to end if a user waits at the terminal.
pub(crate) const INTERACTIVE: Duration = Duration::from_millis(1500);
/// Time that a stopped run of a scheduler may take to end. Slurm allows 30 s after `scancel`, and
/// our scripts request 60 s before the time limit.
pub(crate) const SCHEDULED: Duration = Duration::from_secs(20);

/// Flag that a signal sets to stop a run, and the number of the signal.
#[derive(Debug, Clone, Default)]
pub(crate) struct StopSignal {
    requested: Arc<AtomicBool>,
    signal: Arc<AtomicI32>,
}

impl StopSignal {
    /// Starts a thread that waits for SIGINT, SIGTERM and, if it is not ignored, SIGHUP.
    ///
    /// The first signal sets the flag. The process ends if tasks are still running when `patience`
    /// is over, or on a second signal. This is safe at any time, because stored files appear whole.
    /// A process started by `nohup` ignores SIGHUP and outlives its terminal.
    pub(crate) fn on_signal(patience: Duration) -> io::Result<StopSignal> {
        let stop = StopSignal::default();
        let mut handled = vec![SIGINT, SIGTERM];
        handled.extend((!is_ignored(SIGHUP)).then_some(SIGHUP));
        let mut signals = Signals::new(handled)?;
        let handler = stop.clone();
        let wait = move || {
            for signal in signals.forever() {
                handler.on_signal_received(signal, patience);
            }
        };
        Builder::new().spawn(wait).map_err(|error| {
            let message = "cannot wait for Ctrl-C; allow more processes (`ulimit -u`)";
            io::Error::new(error.kind(), format!("{message}: {error}"))
        })?;
        Ok(stop)
    }

    /// Returns the flag, which is true after a signal.
    pub(crate) fn requested(&self) -> &AtomicBool {
        &self.requested
    }

    /// Returns the exit code that shells use for a process ended by the signal: 130 after Ctrl-C,
    /// 143 after `kill`.
    pub(crate) fn exit_code(&self) -> u8 {
        let signal = self.signal.load(Ordering::SeqCst);
        u8::try_from(128 + signal).unwrap_or(u8::MAX)
    }

    fn on_signal_received(&self, signal: i32, patience: Duration) {
        self.signal.store(signal, Ordering::SeqCst);
        if self.requested.swap(true, Ordering::SeqCst) {
            exit(self.exit_code().into());
        }
        warn("stopping; finished tasks are kept");
        let code = self.exit_code().into();
        let end = move || {
            thread::sleep(patience);
            warn("stopped; unfinished tasks are lost; run again to continue");
            exit(code)
        };
        if Builder::new().spawn(end).is_err() {
            end();
        }
    }
}

/// Returns whether the process ignores a signal, as `/proc/self/status` reports.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = line.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
