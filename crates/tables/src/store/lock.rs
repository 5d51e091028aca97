//! Who uses a store.
//!
//! Whoever works with a store shares a lock on it; whoever removes tables from it holds the lock
//! alone. The lock belongs to an open file, so that the system takes it back when a process ends
//! in whatever way: no lock can be left behind.

use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;

use super::StoreError;

/// Name of the file in the store that is locked. It is always empty and never removed.
const NAME: &str = "lock";

/// A hold on a store, until it is dropped. Empty where files cannot be locked: nobody can have
/// such a store alone, so that there is nothing to be afraid of.
#[derive(Debug)]
pub struct Lock {
    _file: Option<File>,
}

impl Lock {
    /// Shares the store in this folder; waits while somebody has it alone. Nothing is made: where
    /// there is no file to be locked, nobody has worked yet.
    ///
    /// # Errors
    /// When the file to be locked is there and may not be opened.
    pub fn share(folder: &Path) -> Result<Lock, StoreError> {
        let Some(file) = open(folder)? else {
            return Ok(Lock { _file: None });
        };
        let locked = file.lock_shared().is_ok();
        Ok(Lock { _file: locked.then_some(file) })
    }

    /// Makes the file to be locked, before the store is shared for work. Where it cannot be written
    /// nobody can have the store alone.
    pub fn prepare(folder: &Path) {
        let _ = writable(&folder.join(NAME));
    }

    /// Takes the store in this folder alone, unless somebody uses it.
    ///
    /// # Errors
    /// When the file to be locked cannot be opened or locked.
    pub fn alone(folder: &Path) -> Result<Option<Lock>, StoreError> {
        let path = folder.join(NAME);
        let failed = |source| StoreError::Lock { path: path.clone(), source };
        let file = writable(&path).map_err(failed)?;
        match file.try_lock() {
            Ok(()) => Ok(Some(Lock { _file: Some(file) })),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(source)) => Err(failed(source)),
        }
    }
}

/// The file to be locked; none in a store that was never locked. Some file systems share locks of
/// files only that may be written.
fn open(folder: &Path) -> Result<Option<File>, StoreError> {
    let path = folder.join(NAME);
    let mut options = OpenOptions::new();
    let opened = options.read(true).write(true).open(&path);
    match opened.or_else(|_| File::open(&path)) {
        Ok(file) => Ok(Some(file)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(StoreError::Lock { path, source }),
    }
}

fn writable(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_share_a_store_and_nobody_has_it_alone_meanwhile() {
        let folder = tempfile::tempdir().unwrap();
        Lock::prepare(folder.path());
        let one = Lock::share(folder.path()).unwrap();
        let other = Lock::share(folder.path()).unwrap();
        assert!(Lock::alone(folder.path()).unwrap().is_none());
        drop(one);
        assert!(Lock::alone(folder.path()).unwrap().is_none());
        drop(other);
        assert!(Lock::alone(folder.path()).unwrap().is_some());
    }

    #[test]
    fn one_alone_keeps_others_waiting_until_it_is_done() {
        let folder = tempfile::tempdir().unwrap();
        let alone = Lock::alone(folder.path()).unwrap().unwrap();
        assert!(Lock::alone(folder.path()).unwrap().is_none());
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| Lock::share(folder.path()).map(drop));
            drop(alone);
            waiting.join().unwrap().unwrap();
        });
    }

    #[test]
    fn a_store_that_is_not_there_is_shared_without_making_it() {
        let folder = tempfile::tempdir().unwrap();
        let nowhere = folder.path().join("nowhere");
        Lock::share(&nowhere).unwrap();
        assert!(!nowhere.exists());
        Lock::share(folder.path()).unwrap();
        assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    }
}
