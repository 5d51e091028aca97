//! What a run says while it computes: how far it has come, how long it will go on and what failed;
//! and what the system tells the process meanwhile.

use std::io::{self, IsTerminal, stderr};
use std::process::exit;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, Builder};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;

use super::{tell_notice, warn};
use crate::session::events::Batch;
use crate::session::failures;
use crate::session::words::counted;
use crate::session::{Event, Observer, RunProgress};

/// Seconds between lines where there is no terminal to redraw.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Failures that are told one by one; the table has them all.
const TOLD: usize = 10;

/// Says on standard error what happens in a run: what should be known, how far it has come, and
/// what failed.
#[derive(Default)]
pub struct Console {
    /// Of the tasks that are computed just now.
    progress: Mutex<Option<Progress>>,
}

impl Observer for Console {
    fn hear(&self, event: Event<'_>) {
        let mut progress = self.progress.lock().expect("no panic happens while it is held");
        match (event, progress.as_mut()) {
            (Event::Begun(batch), _) => *progress = Some(Progress::new(batch)),
            (Event::Started(task), Some(progress)) => progress.started(task),
            (Event::Advanced(task, share), Some(progress)) => progress.advanced(task, share),
            (Event::Finished(task), Some(progress)) => progress.finished(task),
            (Event::Ended, Some(_)) => {
                if let Some(progress) = progress.take() {
                    progress.end();
                }
            }
            (Event::Failed(failed), _) => {
                let told =
                    failures::in_words(failed, TOLD).expect("a run tells a table of failures");
                told.iter().for_each(|line| warn(line));
            }
            (other, _) => tell_notice(other),
        }
    }
}

/// A bar on a terminal, plain lines elsewhere.
struct Progress {
    run: RunProgress,
    bar: Option<ProgressBar>,
    last_line: Instant,
}

impl Progress {
    /// Begins to count the tasks that are to run, among cached ones that are not.
    fn new(batch: Batch) -> Progress {
        let total = batch.tasks.len();
        let bar = stderr().is_terminal().then(|| bar(total));
        if bar.is_none() {
            let begun = begun(total, batch.cached, batch.plan.tasks.len());
            warn(&format!("{}: {begun}", batch.plan.study));
        }
        Progress { run: RunProgress::new(batch), bar, last_line: Instant::now() }
    }

    fn started(&self, task: usize) {
        if let (Some(bar), Some(kind)) = (&self.bar, self.run.kind(task)) {
            bar.set_prefix(kind.name());
        }
    }

    fn advanced(&mut self, task: usize, share: f64) {
        self.run.advanced(task, share);
        self.tell();
    }

    fn finished(&mut self, task: usize) {
        self.run.finished(task);
        self.tell();
    }

    /// Clears the bar.
    fn end(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn tell(&mut self) {
        let left = self.run.time_left();
        let left = left.map_or("…".to_owned(), |left| duration(left) + " left");
        let finished = self.run.tasks_done();
        if let Some(bar) = &self.bar {
            bar.set_position(finished as u64);
            bar.set_message(left);
        } else if self.last_line.elapsed() >= LINE_EVERY {
            self.last_line = Instant::now();
            let total = counted(self.run.tasks(), "task");
            warn(&format!("{finished} of {total}, {left}"));
        }
    }
}

/// What is about to be done, and what is not.
fn begun(to_run: usize, cached: usize, all: usize) -> String {
    let begun = format!("{} to run, {cached} cached", counted(to_run, "task"));
    match all.saturating_sub(to_run + cached) {
        0 => begun,
        later => format!("{begun}, {later} left for later"),
    }
}

fn bar(total: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix:9} {bar:40} {pos}/{len} {elapsed} {msg}")
        .expect("the template is valid");
    let bar = ProgressBar::new(total as u64).with_style(style);
    // The bar panics if the system refuses it a thread.
    if Builder::new().spawn(|| ()).is_ok() {
        bar.enable_steady_tick(Duration::from_millis(250));
    }
    bar
}

/// A duration in the two units that matter.
pub fn duration(duration: Duration) -> String {
    let seconds = duration.as_secs();
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, seconds) => format!("{seconds} s"),
        (0, minutes, seconds) => format!("{minutes} min {seconds} s"),
        (hours, minutes, _) => format!("{hours} h {minutes} min"),
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_for_later_is_not_cached() {
        assert_eq!(begun(2, 33, 35), "2 tasks to run, 33 cached");
        assert_eq!(begun(1, 0, 35), "1 task to run, 0 cached, 34 left for later");
    }

    #[test]
    fn durations_are_told_in_the_two_units_that_matter() {
        let told = |seconds| duration(Duration::from_secs(seconds));
        assert_eq!(told(59), "59 s");
        assert_eq!(told(61), "1 min 1 s");
        assert_eq!(told(3 * 3600 + 62), "3 h 1 min");
    }
}
