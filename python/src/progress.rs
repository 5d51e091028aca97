//! Observer that stores events of a session until Python reads them.

use std::sync::{Arc, Mutex, MutexGuard};

use asperity::cli::terminal::escaped;
use asperity::session::{Event, Observer, RunProgress};
use pyo3::prelude::*;

/// Severity and text of each notice.
pub type Notices = Vec<(String, String)>;

/// Observer that can be called from any thread.
#[derive(Clone, Default)]
pub struct Listener(Arc<Mutex<Events>>);

#[derive(Default)]
struct Events {
    notices: Notices,
    batch: Option<Batch>,
}

/// Progress of the current batch of tasks.
struct Batch {
    study: String,
    progress: RunProgress,
    doing: &'static str,
    cached: usize,
}

/// Progress of a run, converted to a dictionary.
#[derive(IntoPyObject)]
pub struct Advance {
    pub study: String,
    pub doing: &'static str,
    pub tasks: usize,
    pub tasks_done: usize,
    pub cached: usize,
    pub share: f64,
    pub seconds_left: Option<f64>,
}

impl Listener {
    fn lock(&self) -> MutexGuard<'_, Events> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Returns and removes the stored notices.
    pub fn take_notices(&self) -> Notices {
        std::mem::take(&mut self.lock().notices)
    }

    /// Returns the progress of the current batch; `None` between batches.
    pub fn advance(&self) -> Option<Advance> {
        let events = self.lock();
        let batch = events.batch.as_ref()?;
        Some(Advance {
            study: batch.study.clone(),
            doing: batch.doing,
            tasks: batch.progress.tasks(),
            tasks_done: batch.progress.tasks_done(),
            cached: batch.cached,
            share: batch.progress.share(),
            seconds_left: batch.progress.time_left().map(|left| left.as_secs_f64()),
        })
    }
}

impl Observer for Listener {
    fn on_event(&self, event: Event<'_>) {
        let mut events = self.lock();
        match (event, &mut events.batch) {
            (Event::Notice(notice), _) => {
                let words = escaped(&notice.to_string()).into_owned();
                events.notices.push((notice.severity().to_string(), words));
            }
            (Event::Begun(begun), batch) => {
                *batch = Some(Batch {
                    study: begun.plan.study.clone(),
                    cached: begun.cached,
                    progress: RunProgress::new(begun),
                    doing: "",
                });
            }
            (Event::Started(task), Some(batch)) => {
                batch.doing = batch.progress.kind(task).map_or("", |kind| kind.name());
            }
            (Event::Advanced(task, share), Some(batch)) => batch.progress.advanced(task, share),
            (Event::Finished(task), Some(batch)) => batch.progress.finished(task),
            (Event::Ended, batch) => *batch = None,
            (
                Event::Failed(_) | Event::Started(_) | Event::Advanced(..) | Event::Finished(_),
                _,
            ) => {}
        }
    }
}
