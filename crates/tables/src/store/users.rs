//! Locks of a store, and the processes that write its unfinished files.
//!
//! A process that uses a store holds a shared lock; a process that removes tables holds an
//! exclusive lock. The lock belongs to an open file, so that the system releases it when the
//! process ends, even after a crash.
//!
//! On some file systems, such as some NFS and Lustre, `flock` works within one machine only. A
//! process then does not see the locks of other machines. Therefore the name of an unfinished file
//! contains the names of the machine and the process that write it.

use std::fmt;
use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, SystemTime};

use sysinfo::{Pid, ProcessesToUpdate, System};

use super::StoreError;
use super::permissions::explained;

/// Name of the lock file in the store. The file is empty and is never removed.
pub(super) const LOCK: &str = "lock";

/// Lock of a store. The lock is held until this value is dropped.
///
/// If the file cannot be locked, the value holds no lock. No process can then take the exclusive
/// lock either, so no process removes tables.
#[derive(Debug)]
pub struct Lock(#[expect(dead_code, reason = "an open file holds the lock")] Option<File>);

impl Lock {
    /// Takes the shared lock of the store in a folder. Waits while another process has the
    /// exclusive lock.
    ///
    /// The lock file is not created: a store without a lock file has never been used.
    ///
    /// # Errors
    /// Returns an error if the lock file exists but cannot be opened.
    pub fn share(folder: &Path) -> Result<Lock, StoreError> {
        let path = folder.join(LOCK);
        // Some file systems lock only files that are open for writing.
        let opened = OpenOptions::new().read(true).write(true).open(&path);
        match opened.or_else(|_| File::open(&path)) {
            Ok(file) => Ok(Lock(Some(file).filter(|file| file.lock_shared().is_ok()))),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Lock(None)),
            Err(source) => Err(failed(&path, source)),
        }
    }

    /// Returns whether another process has the exclusive lock of the store in a folder, so that
    /// [`Lock::share`] would wait.
    pub fn is_exclusive(folder: &Path) -> bool {
        let file = File::open(folder.join(LOCK)).ok();
        file.is_some_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }

    /// Takes the shared lock of a store that must not be changed, if it can be locked.
    pub(super) fn share_read_only(folder: &Path) -> Lock {
        let file = File::open(folder.join(LOCK)).ok();
        Lock(file.filter(|file| file.lock_shared().is_ok()))
    }

    /// Creates the lock file if possible. Without it, no process can take the exclusive lock.
    pub fn prepare(folder: &Path) {
        let _ = writable(&folder.join(LOCK));
    }

    /// Takes the exclusive lock of the store in a folder. Returns `None` if another process uses
    /// the store.
    ///
    /// # Errors
    /// Returns an error if the lock file cannot be created, opened or locked.
    pub fn exclusive(folder: &Path) -> Result<Option<Lock>, StoreError> {
        let path = folder.join(LOCK);
        let failed = |source| failed(&path, source);
        let file = writable(&path).map_err(failed)?;
        match file.try_lock() {
            Ok(()) => Ok(Some(Lock(Some(file)))),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(source)) => Err(failed(source)),
        }
    }
}

fn failed(path: &Path, source: io::Error) -> StoreError {
    StoreError::Lock { path: path.to_owned(), source: explained(source, path) }
}

fn writable(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)
}

/// Prefix of the names of files that are still being written.
pub(crate) const UNFINISHED: &str = ".unfinished-";

/// Time without a change after which an unfinished file of another machine counts as abandoned.
///
/// It exceeds the time of writing a file plus the difference between the clocks of two machines.
const ABANDONED_AFTER: Duration = Duration::from_secs(7 * 86400);

/// Process that writes an unfinished file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Writer {
    pub machine: String,
    /// Process identifier on that machine.
    pub process: u32,
}

impl Writer {
    pub fn own() -> Writer {
        Writer { machine: own_machine().to_owned(), process: std::process::id() }
    }

    /// Returns the prefix of the names of unfinished files of this process. Random letters follow.
    pub fn prefix(&self) -> String {
        format!("{UNFINISHED}{self}-")
    }

    /// Parses the name of an unfinished file. Returns `None` for names that older versions of the
    /// program have given.
    pub fn from_name(name: &str) -> Option<Writer> {
        let (process, rest) = name.strip_prefix(UNFINISHED)?.split_once('@')?;
        let (machine, _) = rest.rsplit_once('-')?;
        Some(Writer { machine: machine.to_owned(), process: process.parse().ok()? })
    }
}

impl fmt::Display for Writer {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}@{}", self.process, self.machine)
    }
}

/// Name, clock and running processes of a machine, which decide whether a file is abandoned.
#[derive(Debug)]
pub struct HostState {
    pub machine: String,
    pub now: SystemTime,
    /// Function that returns the start time of a process of the machine, or `None` if the process
    /// is not running.
    pub started: fn(u32) -> Option<SystemTime>,
}

impl HostState {
    pub fn here() -> HostState {
        HostState { machine: own_machine().to_owned(), now: SystemTime::now(), started }
    }

    /// Returns true if no process writes this unfinished file any more.
    ///
    /// A file of this machine is abandoned once its process has ended. It is not known whether
    /// processes of other machines are running, so their files are abandoned after a week without a
    /// change.
    pub fn is_abandoned(&self, file: &Path) -> bool {
        let Some(touched) = file.metadata().and_then(|metadata| metadata.modified()).ok() else {
            // The file has just been finished or removed.
            return false;
        };
        let is_long_before = |moment: SystemTime| {
            let since = moment.duration_since(touched);
            since.is_ok_and(|since| since > ABANDONED_AFTER)
        };
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        match Writer::from_name(&name) {
            // A process that started long after the last change is another one with the same
            // identifier.
            Some(writer) if !self.machine.is_empty() && writer.machine == self.machine => {
                (self.started)(writer.process).is_none_or(is_long_before)
            }
            _ => is_long_before(self.now),
        }
    }
}

/// Returns the name of this machine, made of characters that are allowed in file names. The name is
/// empty if it does not identify the machine.
fn own_machine() -> &'static str {
    static NAME: OnceLock<String> = OnceLock::new();
    NAME.get_or_init(|| {
        let name = System::host_name().filter(|name| name != "localhost");
        let plain = |letter: char| match letter {
            'a'..='z' | 'A'..='Z' | '0'..='9' | '.' | '-' => letter,
            _ => '_',
        };
        name.unwrap_or_default().chars().take(64).map(plain).collect()
    })
}

fn started(process: u32) -> Option<SystemTime> {
    let process = Pid::from_u32(process);
    let mut system = System::new();
    system.refresh_processes(ProcessesToUpdate::Some(&[process]), false);
    let started = system.process(process)?.start_time();
    Some(SystemTime::UNIX_EPOCH + Duration::from_secs(started))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shared_locks_exclude_the_exclusive_lock() {
        let folder = tempfile::tempdir().unwrap();
        Lock::prepare(folder.path());
        let one = Lock::share(folder.path()).unwrap();
        let other = Lock::share(folder.path()).unwrap();
        assert!(Lock::exclusive(folder.path()).unwrap().is_none());
        drop(one);
        assert!(Lock::exclusive(folder.path()).unwrap().is_none());
        drop(other);
        assert!(Lock::exclusive(folder.path()).unwrap().is_some());
    }

    #[test]
    fn the_exclusive_lock_makes_others_wait() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!Lock::is_exclusive(folder.path()));
        let alone = Lock::exclusive(folder.path()).unwrap().unwrap();
        assert!(Lock::exclusive(folder.path()).unwrap().is_none());
        assert!(Lock::is_exclusive(folder.path()));
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| Lock::share(folder.path()).map(drop));
            drop(alone);
            waiting.join().unwrap().unwrap();
        });
    }

    #[test]
    fn a_shared_lock_creates_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let nowhere = folder.path().join("nowhere");
        Lock::share(&nowhere).unwrap();
        assert!(!nowhere.exists());
        Lock::share(folder.path()).unwrap();
        assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    }

    /// Returns a machine with one process, number 7, which has been running for a day.
    fn node07() -> HostState {
        HostState {
            machine: "node-07".to_owned(),
            now: SystemTime::now(),
            started: |process| {
                (process == 7).then(|| SystemTime::now() - Duration::from_secs(86400))
            },
        }
    }

    /// Returns true if a file of this name is abandoned `days` days after its last change.
    fn is_abandoned(name: &str, days: u64) -> bool {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        let file = File::create(&path).unwrap();
        let touched = SystemTime::now() - Duration::from_secs(days * 86400 + 60);
        file.set_modified(touched).unwrap();
        node07().is_abandoned(&path)
    }

    fn name(machine: &str, process: u32) -> String {
        let machine = machine.to_owned();
        Writer { machine, process }.prefix() + "aB3dEf"
    }

    #[test]
    fn the_name_of_an_unfinished_file_identifies_its_writer() {
        let own = Writer::own();
        assert_eq!(Writer::from_name(&(own.prefix() + "aB3dEf")), Some(own));
        for name in ["area.parquet", ".unfinished-aB3dEf", ".unfinished-x@node-aB3dEf"] {
            assert_eq!(Writer::from_name(name), None, "{name}");
        }
    }

    #[test]
    fn files_of_a_running_process_are_not_abandoned() {
        assert!(!is_abandoned(&name("node-07", 7), 0));
        // The process may have been suspended.
        assert!(!is_abandoned(&name("node-07", 7), 5));
    }

    #[test]
    fn files_of_an_ended_process_are_abandoned_immediately() {
        assert!(is_abandoned(&name("node-07", 8), 0));
        // Another process has reused the identifier.
        assert!(is_abandoned(&name("node-07", 7), 9));
    }

    #[test]
    fn files_of_other_machines_and_unknown_writers_are_abandoned_after_a_week() {
        for name in [name("node-08", 8), name("node-08", 7), ".unfinished-aB3dEf".to_owned()] {
            assert!(!is_abandoned(&name, 0), "{name}");
            assert!(!is_abandoned(&name, 6), "{name}");
            assert!(is_abandoned(&name, 8), "{name}");
        }
    }

    #[test]
    fn a_machine_without_a_unique_name_owns_no_files() {
        let nameless = HostState { machine: String::new(), ..node07() };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name("", 8));
        File::create(&path).unwrap();
        assert!(!nameless.is_abandoned(&path));
    }

    #[test]
    fn this_process_has_a_start_time() {
        let started = started(std::process::id()).unwrap();
        assert!(started <= SystemTime::now());
    }
}
