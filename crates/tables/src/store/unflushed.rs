//! Folders with new files of which the disk may not know yet.
//!
//! A file is on the disk before it gets its name, but its name is on the disk only once its folder
//! has been flushed. One flush does for all files of a folder, so that tasks of milliseconds do not
//! wait for one each: a power cut costs the tasks of the last second.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use super::StoreError;
use super::files::flush_folder;

/// How long a new file may wait.
const LONGEST: Duration = Duration::from_secs(1);

/// The folders, and since when the first of them waits.
#[derive(Debug, Default)]
pub struct Unflushed(Mutex<Waiting>);

#[derive(Debug, Default)]
struct Waiting {
    folders: BTreeSet<PathBuf>,
    since: Option<Instant>,
}

impl Unflushed {
    /// A new file; flushes its folder and the others if one of them has waited long enough.
    ///
    /// # Errors
    /// When a folder cannot be flushed.
    pub fn add(&self, file: &Path) -> Result<(), StoreError> {
        let is_due = {
            let mut waiting = self.0.lock().expect("no panic happens while it is held");
            waiting.folders.extend(file.parent().map(Path::to_owned));
            waiting.since.get_or_insert_with(Instant::now).elapsed() >= LONGEST
        };
        match is_due {
            true => self.flush(),
            false => Ok(()),
        }
    }

    /// Flushes all of them.
    ///
    /// # Errors
    /// When a folder cannot be flushed.
    pub fn flush(&self) -> Result<(), StoreError> {
        let waiting = {
            let mut waiting = self.0.lock().expect("no panic happens while it is held");
            std::mem::take(&mut *waiting)
        };
        waiting.folders.iter().try_for_each(|folder| flush_folder(folder))
    }
}
