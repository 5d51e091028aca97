//! Observer that stores events of a session until Python reads them.

use std::sync::{Arc, Mutex, MutexGuard};

use asperity::internal::escaped;
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

/// Progress of the last batch of tasks.
struct Batch {
    study: String,
    /// Line with the numbers of tasks of the batch.
    summary: String,
    progress: RunProgress,
    doing: &'static str,
    cached: usize,
}

/// Progress of a run, converted to a dictionary.
#[derive(IntoPyObject)]
pub struct Advance {
    pub study: String,
    pub batch: String,
    pub text: String,
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

    /// Returns the progress of the last batch, which may have ended; `None` before the first batch.
    pub fn advance(&self) -> Option<Advance> {
        let events = self.lock();
        let batch = events.batch.as_ref()?;
        Some(Advance {
            study: batch.study.clone(),
            batch: batch.summary.clone(),
            text: batch.progress.to_string(),
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
                    summary: escaped(&begun.to_string()).into_owned(),
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
            // At the end, the batch is kept, so that the last state of a short run is shown, too.
            _ => {}
        }
    }
}
