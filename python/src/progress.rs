//! What a run tells, until Python asks for it.

use std::sync::{Arc, Mutex, MutexGuard};

use asperity::cli::terminal::escaped;
use asperity::session::{Event, Observer, RunProgress};
use pyo3::prelude::*;

/// How much a notice should worry, and its words.
pub type Notices = Vec<(String, String)>;

/// Hears a session from whichever thread, and remembers.
#[derive(Clone, Default)]
pub struct Listener(Arc<Mutex<Heard>>);

#[derive(Default)]
struct Heard {
    notices: Notices,
    batch: Option<Batch>,
}

/// Tasks that are computed just now.
struct Batch {
    study: String,
    progress: RunProgress,
    doing: &'static str,
    cached: usize,
}

/// How far a run has come, in Python a dictionary.
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
    fn heard(&self) -> MutexGuard<'_, Heard> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// What should be known and has not been handed on.
    pub fn notices(&self) -> Notices {
        std::mem::take(&mut self.heard().notices)
    }

    /// How far the tasks under way have come, if there are any.
    pub fn advance(&self) -> Option<Advance> {
        let heard = self.heard();
        let batch = heard.batch.as_ref()?;
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
        let mut heard = self.heard();
        match (event, &mut heard.batch) {
            (Event::Notice(notice), _) => {
                let words = escaped(&notice.to_string()).into_owned();
                let told = (notice.severity().to_string(), words);
                heard.notices.push(told);
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
