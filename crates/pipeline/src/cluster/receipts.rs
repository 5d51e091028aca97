//! Receipts: files in which processes report their progress on a shard.
//!
//! Each process writes its own receipt, which no other process changes. It writes the receipt when
//! it starts, updates it while it computes tasks, and adds the time of the end. If a receipt has no
//! end and has not been updated for a long time, its process was killed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use std::{fs, io};

use serde::{Deserialize, Serialize};

use crate::cluster::shard::Shard;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{names, write_whole};
use asperity_tables::store::users::Writer;

/// Time between the start of a process and the first update of its receipt, and between later
/// updates.
pub const UPDATE_INTERVALS: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(20)];

/// Time without an update after which a process is considered dead. Only a process that the
/// scheduler has suspended can live for so long without updating its receipt.
const ABANDONED_AFTER: Duration = Duration::from_secs(86400);

/// Report of one process on the shard that it computes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Receipt {
    pub study: String,
    pub shard: Shard,
    /// Name of the scheduler's job, if it was given on the command line.
    pub job: Option<String>,
    pub machine: String,
    /// Process id on that machine.
    pub process: u32,
    pub processor: String,
    /// Number of threads, each of which works on one surface.
    pub threads: usize,
    /// Time of the start, in seconds since 1970.
    pub begun: u64,
    /// Time of the last update, in seconds since 1970.
    pub touched: u64,
    /// Time of the end, in seconds since 1970. `None` while the process is running, and for a
    /// process that was killed.
    pub ended: Option<u64>,
    pub wanted: usize,
    pub computed: usize,
    pub under_way: Vec<String>,
    pub failed: Vec<FailedTask>,
    pub interrupted: bool,
    /// True if the process stopped because tables could not be stored.
    pub halted: bool,
    /// Core-seconds that the tasks have taken.
    pub seconds: f64,
    /// Measured speed of the computation, by mesh.
    pub pace: Vec<Pace>,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FailedTask {
    pub task: String,
    pub stage: String,
    pub reason: String,
}

impl Receipt {
    /// Creates the receipt of this process, which starts now.
    pub fn begin(study: &str, shard: Shard, job: Option<String>, threads: usize) -> Receipt {
        let Writer { machine, process } = Writer::own();
        Receipt {
            study: study.to_owned(),
            shard,
            job,
            machine,
            process,
            processor: crate::forecast::processor(),
            threads,
            begun: now(),
            touched: now(),
            ended: None,
            wanted: 0,
            computed: 0,
            under_way: Vec::new(),
            failed: Vec::new(),
            interrupted: false,
            halted: false,
            seconds: 0.0,
            pace: Vec::new(),
        }
    }

    /// Returns the path of this receipt in the folder `folder`.
    pub fn path(&self, folder: &Path) -> PathBuf {
        let (number, count) = (self.shard.number(), self.shard.count());
        let Receipt { machine, process, begun, .. } = self;
        folder.join(format!("{number}-of-{count}-{machine}-{process}-{begun}.json"))
    }

    /// Writes the receipt with the present time, replacing its previous version.
    pub fn write(&mut self, folder: &Path) -> Result<(), StoreError> {
        self.touched = now();
        let bytes = serde_json::to_vec_pretty(self).expect("a receipt is plain data");
        write_whole(&self.path(folder), &bytes, folder)
    }

    /// Sets the time of the end to the present time.
    pub fn end(&mut self) {
        self.ended = Some(now());
    }

    /// Returns whether the process may be running: it has not ended, and its last update is less
    /// than a day old.
    pub fn may_be_running(&self) -> bool {
        let untouched = now().saturating_sub(self.touched);
        self.ended.is_none() && untouched < ABANDONED_AFTER.as_secs()
    }
}

/// Reads the receipts in a folder, in the order of their file names. Other files are skipped.
pub fn read(folder: &Path) -> Result<Vec<Receipt>, StoreError> {
    let names =
        names(folder)?.into_iter().filter(|name| !name.starts_with('.') && name.ends_with(".json"));
    let mut receipts = Vec::new();
    for name in names {
        let path = folder.join(name);
        match fs::read(&path) {
            Ok(bytes) => receipts.extend(serde_json::from_slice::<Receipt>(&bytes)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(source) => return Err(StoreError::reading(path, source)),
        }
    }
    Ok(receipts)
}

pub fn paces<'a>(receipts: impl IntoIterator<Item = &'a Receipt>) -> Paces {
    let mut paces = Paces::default();
    for receipt in receipts {
        receipt.pace.iter().for_each(|pace| paces.add(*pace));
    }
    paces
}

fn now() -> u64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(0, |since| since.as_secs())
}

/// Expected and actual work of tasks on one mesh.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    /// Nodes along x and y.
    pub nodes: [usize; 2],
    /// Expected number of pairs of Fourier transforms.
    pub pairs: f64,
    /// Core-seconds that the tasks took.
    pub seconds: f64,
}

/// Sums of the work of many tasks, by mesh: expected pairs of transforms, and core-seconds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Paces(BTreeMap<[usize; 2], (f64, f64)>);

impl Paces {
    /// Adds work to the sums. Work without expected transforms has no pace and is ignored.
    pub fn add(&mut self, Pace { nodes, pairs, seconds }: Pace) {
        if pairs > 0.0 {
            let sums = self.0.entry(nodes).or_default();
            sums.0 += pairs;
            sums.1 += seconds;
        }
    }

    /// Returns the sums, one entry for each mesh.
    pub fn all(&self) -> Vec<Pace> {
        let sums = self.0.iter();
        sums.map(|(&nodes, &(pairs, seconds))| Pace { nodes, pairs, seconds }).collect()
    }

    /// Returns the core-seconds per expected pair of transforms, by mesh.
    pub fn seconds_per_pair(&self) -> BTreeMap<[usize; 2], f64> {
        let sums = self.0.iter();
        sums.map(|(&nodes, &(pairs, seconds))| (nodes, seconds / pairs)).collect()
    }
}

#[cfg(test)]
mod tests {

    use super::*;

    fn receipt(number: u32) -> Receipt {
        let shard = Shard::new(number, 4).expect("one of four");
        Receipt::begin("small", shard, Some("17".to_owned()), 2)
    }

    #[test]
    fn a_receipt_is_read_as_it_was_written_and_other_files_are_none() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(read(folder.path()).unwrap(), []);
        let mut receipts = [receipt(1), receipt(3)];
        for receipt in &mut receipts {
            receipt.pace.push(Pace { nodes: [64; 2], pairs: 10.0, seconds: 0.25 });
            receipt.write(folder.path()).unwrap();
        }
        fs::write(folder.path().join("notes.json"), "{}").unwrap();
        fs::write(folder.path().join("notes.txt"), "").unwrap();
        assert_eq!(read(folder.path()).unwrap(), receipts);
        let paces = paces(&receipts).seconds_per_pair();
        assert_eq!(paces[&[64; 2]], 0.025);
    }

    #[test]
    fn who_has_ended_or_been_silent_for_a_day_is_not_at_work() {
        let mut receipt = receipt(1);
        assert!(receipt.may_be_running());
        receipt.touched -= 2 * 86400;
        assert!(!receipt.may_be_running());
        receipt.touched = now();
        receipt.ended = Some(now());
        assert!(!receipt.may_be_running());
    }

    #[test]
    fn the_pace_of_several_is_all_seconds_over_all_pairs() {
        let mut paces = Paces::default();
        for (pairs, seconds) in [(100.0, 1.0), (300.0, 7.0), (0.0, 5.0)] {
            let nodes = [64, 32];
            paces.add(Pace { nodes, pairs, seconds });
        }
        assert_eq!(paces.seconds_per_pair(), BTreeMap::from([([64, 32], 0.02)]));
    }
}
