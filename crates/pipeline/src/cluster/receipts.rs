//! What computed a shard, and what came of it.
//!
//! Each process that computes a shard has a receipt of its own, a file that nobody else writes. It is
//! there from the beginning, is written anew while tasks are computed, and says in the end that it
//! has ended: one that has not, and has not been touched for long, is of a process that was killed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use std::{fs, io};

use serde::{Deserialize, Serialize};

use crate::cluster::shard::Shard;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{Existing, names, write_whole};
use asperity_tables::store::users::Writer;

/// After what time a receipt is written anew, the first time and later.
pub const EVERY: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(20)];

/// Nobody who lives leaves a receipt untouched for so long, but one whom a scheduler has suspended.
const LONG: Duration = Duration::from_secs(86400);

/// What computed a shard, and what came of it so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Receipt {
    pub study: String,
    /// Which part of its surfaces.
    pub shard: Shard,
    /// The job of a scheduler that it belongs to, if it was told.
    pub job: Option<String>,
    pub machine: String,
    /// The number that it knows the process by.
    pub process: u32,
    pub processor: String,
    /// Surfaces that are worked on at once.
    pub threads: usize,
    /// When it began, in seconds since 1970 …
    pub begun: u64,
    /// … when this was written …
    pub touched: u64,
    /// … and when it ended; none while it is at work, and of a process that was killed.
    pub ended: Option<u64>,
    /// Tasks that were to be computed.
    pub wanted: usize,
    pub computed: usize,
    /// Keys of the tasks under way.
    pub under_way: Vec<String>,
    pub failed: Vec<FailedTask>,
    /// Whether it was asked to stop.
    pub interrupted: bool,
    /// Whether it stopped because no table can be stored.
    pub halted: bool,
    /// Seconds of one core that computing has taken.
    pub seconds: f64,
    /// How fast that was, by mesh.
    pub pace: Vec<Pace>,
}

/// A task that could not be computed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FailedTask {
    pub task: String,
    pub stage: String,
    pub reason: String,
}

impl Receipt {
    /// One of this process, which begins now.
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

    /// Where it is among the receipts in a folder.
    pub fn path(&self, folder: &Path) -> PathBuf {
        let (number, count) = (self.shard.number(), self.shard.count());
        let Receipt { machine, process, begun, .. } = self;
        folder.join(format!("{number}-of-{count}-{machine}-{process}-{begun}.json"))
    }

    /// Writes it in the place of what it was before.
    pub fn write(&mut self, folder: &Path) -> Result<(), StoreError> {
        self.touched = now();
        let bytes = serde_json::to_vec_pretty(self).expect("a receipt is plain data");
        write_whole(&self.path(folder), &bytes, Existing::Replace, folder)
    }

    /// Says that its process is about to end.
    pub fn end(&mut self) {
        self.ended = Some(now());
    }

    /// Whether its process may be at work: it has not ended, and was at work a day ago.
    pub fn may_be_at_work(&self) -> bool {
        let untouched = now().saturating_sub(self.touched);
        self.ended.is_none() && untouched < LONG.as_secs()
    }
}

/// The receipts in a folder, in the order of their names; files that are none are left out.
pub fn read(folder: &Path) -> Result<Vec<Receipt>, StoreError> {
    let names = names(folder)?.into_iter();
    let names = names.filter(|name| !name.starts_with('.') && name.ends_with(".json"));
    let mut receipts = Vec::new();
    for name in names {
        let path = folder.join(name);
        match fs::read(&path) {
            Ok(bytes) => receipts.extend(serde_json::from_slice::<Receipt>(&bytes)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(source) => return Err(StoreError::Read { path, source }),
        }
    }
    Ok(receipts)
}

/// How fast all of them were together.
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

/// Work on one mesh: what was expected, and what it took.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    /// Nodes along x and y.
    pub nodes: [usize; 2],
    /// Pairs of transforms that the tasks were expected to take.
    pub pairs: f64,
    /// Seconds of one core that they took.
    pub seconds: f64,
}

/// Work of many tasks, added up: seconds of one core for each pair of transforms that was expected.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Paces(BTreeMap<[usize; 2], (f64, f64)>);

impl Paces {
    /// Adds work. What was expected to take no transforms tells no pace.
    pub fn add(&mut self, Pace { nodes, pairs, seconds }: Pace) {
        if pairs > 0.0 {
            let sums = self.0.entry(nodes).or_default();
            sums.0 += pairs;
            sums.1 += seconds;
        }
    }

    /// The sums, by mesh.
    pub fn all(&self) -> Vec<Pace> {
        let sums = self.0.iter();
        sums.map(|(&nodes, &(pairs, seconds))| Pace { nodes, pairs, seconds }).collect()
    }

    /// Seconds of one core for each expected pair, by mesh.
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
        assert!(receipt.may_be_at_work());
        receipt.touched -= 2 * 86400;
        assert!(!receipt.may_be_at_work());
        receipt.touched = now();
        receipt.ended = Some(now());
        assert!(!receipt.may_be_at_work());
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
