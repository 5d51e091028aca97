//! Who uses a store: locks, and the names of files that are being written.
//!
//! A process that works with a store shares a lock on it; one that removes tables from it holds the
//! lock alone. The lock belongs to an open file, so that the system takes it back when a process
//! ends in whatever way: no lock can be left behind.
//!
//! Machines that share a file system do not always share its locks: where `flock` holds on one
//! machine only, as on some NFS and Lustre, nobody sees that others are at work. So the name of an
//! unfinished file says which process of which machine writes it.

use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, SystemTime};

use sysinfo::{Pid, ProcessesToUpdate, System};

use super::StoreError;

/// Name of the file in the store that is locked. It is always empty and never removed.
const LOCK: &str = "lock";

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
        let _ = writable(&folder.join(LOCK));
    }

    /// Takes the store in this folder alone, unless somebody uses it.
    ///
    /// # Errors
    /// When the file to be locked cannot be opened or locked.
    pub fn alone(folder: &Path) -> Result<Option<Lock>, StoreError> {
        let path = folder.join(LOCK);
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
    let path = folder.join(LOCK);
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

/// How the names of files begin that are still being written.
pub(crate) const UNFINISHED: &str = ".unfinished-";

/// Nobody writes one file for so long, whatever the clocks of two machines say.
const ABANDONED_AFTER: Duration = Duration::from_secs(7 * 86400);

/// A process of a machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Writer {
    pub machine: String,
    /// The number that it knows the process by.
    pub process: u32,
}

impl Writer {
    pub fn own() -> Writer {
        Writer { machine: own_machine().to_owned(), process: std::process::id() }
    }

    /// How the names of its unfinished files begin; some letters follow that tell them apart.
    pub fn prefix(&self) -> String {
        format!("{UNFINISHED}{}@{}-", self.process, self.machine)
    }

    /// Whose unfinished file has this name; nobody's that is known if an older version of the
    /// program gave it.
    pub fn from_name(name: &str) -> Option<Writer> {
        let (process, rest) = name.strip_prefix(UNFINISHED)?.split_once('@')?;
        let (machine, _) = rest.rsplit_once('-')?;
        Some(Writer { machine: machine.to_owned(), process: process.parse().ok()? })
    }
}

/// A moment on a machine: who lives there, and how late it is.
#[derive(Debug)]
pub struct HostState {
    pub machine: String,
    pub now: SystemTime,
    /// When a process of the machine began, if it lives.
    pub started: fn(u32) -> Option<SystemTime>,
}

impl HostState {
    pub fn here() -> HostState {
        HostState { machine: own_machine().to_owned(), now: SystemTime::now(), started }
    }

    /// Whether an unfinished file is nobody's any more. One of this machine is, once its process
    /// has ended; of other machines nothing is known, so that only a file that has not been
    /// touched for a week is taken for abandoned.
    pub fn is_abandoned(&self, file: &Path) -> bool {
        let Some(touched) = file.metadata().and_then(|told| told.modified()).ok() else {
            // It is finished, or somebody else has removed it.
            return false;
        };
        let is_long_before = |moment: SystemTime| {
            let since = moment.duration_since(touched);
            since.is_ok_and(|since| since > ABANDONED_AFTER)
        };
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        match Writer::from_name(&name) {
            // The system may have given the number to another process since.
            Some(writer) if !self.machine.is_empty() && writer.machine == self.machine => {
                (self.started)(writer.process).is_none_or(is_long_before)
            }
            _ => is_long_before(self.now),
        }
    }
}

/// The name of this machine, as far as it tells it from others and fits a file's name.
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

    /// A machine on which one process lives, since a day ago.
    fn node07() -> HostState {
        HostState {
            machine: "node-07".to_owned(),
            now: SystemTime::now(),
            started: |process| (process == 7).then(|| SystemTime::now() - Duration::from_secs(86400)),
        }
    }

    /// Whether a file of this name, last touched so many days ago, is abandoned.
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
    fn a_name_tells_its_writer() {
        let own = Writer::own();
        assert_eq!(Writer::from_name(&(own.prefix() + "aB3dEf")), Some(own));
        for name in ["area.parquet", ".unfinished-aB3dEf", ".unfinished-x@node-aB3dEf"] {
            assert_eq!(Writer::from_name(name), None, "{name}");
        }
    }

    #[test]
    fn files_of_a_living_process_are_not_abandoned() {
        assert!(!is_abandoned(&name("node-07", 7), 0));
        // It may have been asleep.
        assert!(!is_abandoned(&name("node-07", 7), 5));
    }

    #[test]
    fn files_of_a_process_that_has_ended_are_abandoned_at_once() {
        assert!(is_abandoned(&name("node-07", 8), 0));
        // Its number is another's by now.
        assert!(is_abandoned(&name("node-07", 7), 9));
    }

    #[test]
    fn files_of_other_machines_and_of_nobody_known_are_abandoned_after_a_week() {
        for name in [name("node-08", 8), name("node-08", 7), ".unfinished-aB3dEf".to_owned()] {
            assert!(!is_abandoned(&name, 0), "{name}");
            assert!(!is_abandoned(&name, 6), "{name}");
            assert!(is_abandoned(&name, 8), "{name}");
        }
    }

    #[test]
    fn a_machine_without_a_name_of_its_own_knows_none_of_its_files() {
        let nameless = HostState { machine: String::new(), ..node07() };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name("", 8));
        File::create(&path).unwrap();
        assert!(!nameless.is_abandoned(&path));
    }

    #[test]
    fn this_process_lives() {
        let started = started(std::process::id()).unwrap();
        assert!(started <= SystemTime::now());
    }
}
