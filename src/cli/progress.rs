//! How far a run has come, and how long it will go on.

use std::collections::{BTreeMap, HashMap};
use std::io::{IsTerminal, stderr};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::counted;
use crate::pace::Pace;
use crate::plan::Plan;
use crate::runner::Observer;

/// Seconds between lines where there is no terminal to redraw.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// A bar on a terminal, plain lines elsewhere; both on standard error.
pub struct Progress<'a> {
    plan: &'a Plan,
    total: usize,
    /// Seconds of one core that each of them is expected to take.
    expected: HashMap<usize, f64>,
    /// Their sum.
    expected_in_all: f64,
    bar: Option<ProgressBar>,
    state: Mutex<State>,
}

struct State {
    begun: Instant,
    finished: usize,
    /// Expected seconds of finished tasks.
    done: f64,
    /// Expected seconds done of tasks under way.
    under_way: BTreeMap<usize, f64>,
    last_line: Instant,
}

impl<'a> Progress<'a> {
    /// Begins to count the tasks that are to run, among `cached` ones that are not.
    pub fn new(plan: &'a Plan, to_run: &[usize], cached: usize, pace: &Pace) -> Progress<'a> {
        let total = to_run.len();
        let expected = |&task: &usize| (task, pace.seconds(&plan.tasks[task]));
        let expected: HashMap<usize, f64> = to_run.iter().map(expected).collect();
        let bar = stderr().is_terminal().then(|| bar(total));
        if bar.is_none() {
            let begun = begun(total, cached, plan.tasks.len());
            eprintln!("{}: {begun}", plan.study);
        }
        let now = Instant::now();
        Progress {
            plan,
            total,
            expected_in_all: expected.values().sum(),
            expected,
            bar,
            state: Mutex::new(State {
                begun: now,
                finished: 0,
                done: 0.0,
                under_way: BTreeMap::new(),
                last_line: now,
            }),
        }
    }

    /// Clears the bar.
    pub fn end(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn expected(&self, task: usize) -> f64 {
        self.expected.get(&task).copied().unwrap_or(0.0)
    }

    fn tell(&self, change: impl FnOnce(&mut State)) {
        let mut state = self
            .state
            .lock()
            .expect("no panic happens while it is held");
        change(&mut state);
        let done = state.done + state.under_way.values().sum::<f64>();
        let share = done / self.expected_in_all;
        let left = time_left(state.begun.elapsed(), share);
        let left = left.map_or("…".to_owned(), |left| duration(left) + " left");
        if let Some(bar) = &self.bar {
            bar.set_position(state.finished as u64);
            bar.set_message(left);
        } else if state.last_line.elapsed() >= LINE_EVERY {
            state.last_line = Instant::now();
            eprintln!(
                "{} of {}, {left}",
                state.finished,
                counted(self.total, "task")
            );
        }
    }
}

impl Observer for Progress<'_> {
    fn started(&self, task: usize) {
        if let Some(bar) = &self.bar {
            bar.set_prefix(self.plan.tasks[task].recipe.kind().name());
        }
    }

    fn advanced(&self, task: usize, share: f64) {
        self.tell(|state| {
            state.under_way.insert(task, share * self.expected(task));
        });
    }

    fn finished(&self, task: usize) {
        self.tell(|state| {
            state.finished += 1;
            state.done += self.expected(task);
            state.under_way.remove(&task);
        });
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
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}

/// Time that the rest takes at the pace so far, once there is a pace.
fn time_left(elapsed: Duration, share_done: f64) -> Option<Duration> {
    let seconds = elapsed.as_secs_f64() * (1.0 - share_done) / share_done;
    (share_done > 0.01).then(|| Duration::from_secs_f64(seconds.max(0.0)))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_done_in_a_minute_leaves_nine() {
        let left = time_left(Duration::from_secs(60), 0.1);
        assert_eq!(left.map(|left| left.as_secs()), Some(540));
    }

    #[test]
    fn nothing_done_promises_nothing() {
        assert_eq!(time_left(Duration::from_secs(60), 0.0), None);
    }

    #[test]
    fn what_is_left_for_later_is_not_cached() {
        assert_eq!(begun(2, 33, 35), "2 tasks to run, 33 cached");
        assert_eq!(
            begun(1, 0, 35),
            "1 task to run, 0 cached, 34 left for later"
        );
    }

    #[test]
    fn durations_are_told_in_the_two_units_that_matter() {
        let told = |seconds| duration(Duration::from_secs(seconds));
        assert_eq!(told(59), "59 s");
        assert_eq!(told(61), "1 min 1 s");
        assert_eq!(told(3 * 3600 + 62), "3 h 1 min");
    }
}
