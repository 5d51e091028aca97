//! How far a long task has come, kept while it is computed: it can go on from there after its process
//! has ended, in whatever way.
//!
//! The store keeps it as `checkpoints/KEY.checkpoint`, which ends with the digest of all that comes
//! before, and is there until the task's table is.

use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use super::Store;
use super::files::{Existing, write_with};
use super::key::TaskKey;

/// The folder of checkpoints in a store.
pub const FOLDER: &str = "checkpoints";
/// What their names end with.
pub(crate) const ENDING: &str = ".checkpoint";

const DIGEST: usize = blake3::OUT_LEN;

/// Where one task keeps how far it has come. Nothing in it decides a number: a task that goes on from
/// a checkpoint ends with the bytes that it would have had.
pub trait Checkpoints: Sync {
    /// What was kept last; none if there is nothing, or nothing whole.
    fn last(&self) -> Option<Vec<u8>>;

    /// Whether it is time to keep something.
    fn is_due(&self) -> bool;

    /// Keeps what is written, in the place of what was kept before. Where that is not possible,
    /// nothing is kept and the task goes on.
    fn keep(&self, write: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>);
}

/// The checkpoints of one task, one in the place of the other.
#[derive(Debug)]
pub struct StoredCheckpoints<'a> {
    store: &'a Store,
    key: TaskKey,
    every: Duration,
    /// When something was kept last, or the task began.
    last: Mutex<Instant>,
    is_kept: AtomicBool,
}

impl<'a> StoredCheckpoints<'a> {
    /// Those of a task that begins now, one after every so long.
    pub fn new(store: &'a Store, key: TaskKey, every: Duration) -> StoredCheckpoints<'a> {
        let last = Mutex::new(Instant::now());
        StoredCheckpoints { store, key, every, last, is_kept: AtomicBool::new(false) }
    }

    /// Removes what is kept: the task's table is there. What cannot be removed does no harm.
    pub fn remove(&self) {
        if self.is_kept.load(Ordering::Relaxed) {
            let _ = fs::remove_file(self.path());
        }
    }

    fn kept_at(&self) -> MutexGuard<'_, Instant> {
        self.last.lock().expect("no panic happens while it is held")
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
        // A full disk is told of by the task's table.
        drop(written);
        self.is_kept.store(true, Ordering::Relaxed);
        *self.kept_at() = Instant::now();
    }
}

/// Hands bytes on, and knows their digest.
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
    fn what_is_kept_is_read_whole_or_not_at_all() {
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
