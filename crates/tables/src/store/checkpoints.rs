//! Checkpoints of long tasks, from which another process can continue after a crash.
//!
//! A checkpoint is a file `checkpoints/KEY.checkpoint` in the store. Its last bytes are the digest
//! of all bytes before. It is removed when the table of the task has been stored.

use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use super::Store;
use super::files::{Existing, write_with};
use super::key::TaskKey;

/// Name of the folder of checkpoints in a store.
pub const FOLDER: &str = "checkpoints";
/// Extension of the file names of checkpoints.
pub(crate) const ENDING: &str = ".checkpoint";

const DIGEST: usize = blake3::OUT_LEN;

/// Storage for the checkpoints of one task.
///
/// A task that is continued from a checkpoint produces the same bytes as an uninterrupted one.
pub trait Checkpoints: Sync {
    /// Returns the bytes of the last checkpoint, or `None` if there is no valid checkpoint.
    fn last(&self) -> Option<Vec<u8>>;

    /// Returns true if it is time for the next checkpoint.
    fn is_due(&self) -> bool;

    /// Replaces the checkpoint with the output of `write`. Ignores errors, because a task can also
    /// start anew.
    fn keep(&self, write: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>);
}

/// Storage for the checkpoint of one task in a store. A new checkpoint replaces the previous one.
#[derive(Debug)]
pub struct StoredCheckpoints<'a> {
    store: &'a Store,
    key: TaskKey,
    every: Duration,
    /// Time of the last checkpoint, or of the start of the task before the first checkpoint.
    last: Mutex<Instant>,
    is_kept: AtomicBool,
}

impl<'a> StoredCheckpoints<'a> {
    /// Creates the storage for a task that starts now. `every` is the time between checkpoints.
    pub fn new(store: &'a Store, key: TaskKey, every: Duration) -> StoredCheckpoints<'a> {
        let last = Mutex::new(Instant::now());
        StoredCheckpoints { store, key, every, last, is_kept: AtomicBool::new(false) }
    }

    /// Removes the checkpoint, which is useless once the table exists. Ignores errors.
    pub fn remove(&self) {
        if self.is_kept.load(Ordering::Relaxed) {
            let _ = fs::remove_file(self.path());
        }
    }

    fn kept_at(&self) -> MutexGuard<'_, Instant> {
        self.last.lock().expect("no code panics while it holds the lock")
    }

    fn path(&self) -> PathBuf {
        self.store.root.join(FOLDER).join(format!("{}{ENDING}", self.key))
    }
}

impl Checkpoints for StoredCheckpoints<'_> {
    fn last(&self) -> Option<Vec<u8>> {
        let mut bytes = fs::read(self.path()).ok()?;
        self.is_kept.store(true, Ordering::Relaxed);
        let end = bytes.len().checked_sub(DIGEST)?;
        let digest = blake3::hash(&bytes[..end]);
        let is_whole = digest.as_bytes().as_slice() == &bytes[end..];
        bytes.truncate(end);
        is_whole.then_some(bytes)
    }

    fn is_due(&self) -> bool {
        self.kept_at().elapsed() >= self.every
    }

    fn keep(&self, write: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>) {
        let written = write_with(&self.path(), Existing::Replace, &self.store.staging(), |file| {
            let mut out = Hashing {
                hasher: blake3::Hasher::new(),
                out: io::BufWriter::with_capacity(1 << 16, file),
            };
            write(&mut out)?;
            let digest = out.hasher.finalize();
            out.out.write_all(digest.as_bytes())?;
            out.out.flush()
        });
        // Errors are ignored: if the disk is full, writing the table reports it.
        drop(written);
        self.is_kept.store(true, Ordering::Relaxed);
        *self.kept_at() = Instant::now();
    }
}

/// Writer that also computes the digest of the written bytes.
struct Hashing<W> {
    hasher: blake3::Hasher,
    out: W,
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.out.write(bytes)?;
        self.hasher.update(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::key::Digest;

    #[test]
    fn a_damaged_checkpoint_is_ignored() {
        let root = tempfile::tempdir().unwrap();
        let store = Store::open(root.path()).unwrap();
        let key = TaskKey::new("test", 1, Digest::from_params(&()), &[]);
        let checkpoints = StoredCheckpoints::new(&store, key, Duration::ZERO);
        assert!(checkpoints.is_due() && checkpoints.last().is_none());
        for content in [b"first".as_slice(), b"", b"second"] {
            checkpoints.keep(&mut |out| out.write_all(content));
            assert_eq!(checkpoints.last().as_deref(), Some(content));
        }
        let mut bytes = fs::read(checkpoints.path()).unwrap();
        bytes[2] ^= 1;
        fs::write(checkpoints.path(), &bytes).unwrap();
        assert_eq!(checkpoints.last(), None);
        checkpoints.remove();
        assert!(!checkpoints.path().exists());
    }
}
