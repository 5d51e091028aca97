//! Checkpoints: an interrupted block of loads continues and gives the same bytes.

use std::fs;
use std::num::NonZeroUsize;
use std::process::Stdio;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;

use asperity::session::{Event, RunOptions, Session};

use crate::bench::{Bench, assert_same_files};

/// One surface with free boundaries, one long block of loads, and stored pressures.
const STUDY: &str = r#"
[study]
name = "long"

[stage.surfaces]
kind = "generate"
nodes = 64
hurst = 0.8
k_lower = 1
k_upper = 16

[stage.contact]
kind = "solve"
from = "surfaces"
loads = { to = 0.4, steps = 40 }
pressures = [0.01, 0.2]
boundary = "periodic"
"#;

fn options() -> RunOptions {
    RunOptions {
        jobs: NonZeroUsize::new(1),
        checkpoint_every: Some(Duration::ZERO),
        ..RunOptions::default()
    }
}

/// Runs until the progress of the block, from 0 to 1, reaches `most`; returns the reported values.
fn run_until(bench: &Bench, study: &str, most: f64) -> Vec<f64> {
    let (stop, printed) = (AtomicBool::new(false), Mutex::new(Vec::new()));
    let on_event = |event: Event| {
        if let Event::Advanced(_, share) = event {
            printed.lock().unwrap().push(share);
            stop.store(share >= most, Ordering::SeqCst);
        }
    };
    let session = Session::new(bench.write(study), bench.data()).observed_by(&on_event);
    session.run(&options(), &stop).unwrap();
    printed.into_inner().unwrap()
}

/// Counts the finished loads: values of the progress that two runs reported. Values within a load
/// depend on the clock and differ.
fn loads(reported: &[f64], by_another: &[f64]) -> usize {
    reported.iter().filter(|share| by_another.contains(share)).count()
}

#[test]
fn a_block_that_was_stopped_again_and_again_computes_no_load_twice() {
    for study in [STUDY.to_owned(), STUDY.replace("periodic", "free")] {
        let undisturbed = Bench::new();
        let all = run_until(&undisturbed, &study, 2.0);
        let bench = Bench::new();
        let mut shares = Vec::new();
        for most in [0.1, 0.3, 0.5, 0.8, 2.0] {
            shares.extend(run_until(&bench, &study, most));
        }
        assert_eq!(loads(&shares, &all), 40);
        assert!(shares.is_sorted(), "{shares:?}");
        let checkpoints = bench.data().join("store/checkpoints");
        assert_eq!(fs::read_dir(&checkpoints).unwrap().count(), 0);
        fs::remove_dir(checkpoints).unwrap();
        assert_same_files(&bench.files(), &undisturbed.files());
    }
}

#[test]
fn a_block_whose_process_was_killed_goes_on_from_its_checkpoint() {
    let study = STUDY.replace("nodes = 64", "nodes = 256");
    let undisturbed = Bench::new();
    let all = run_until(&undisturbed, &study, 2.0);
    let bench = Bench::new();
    let manifest = bench.write(&study);
    let arguments = ["run", manifest.to_str().unwrap(), "--checkpoint-every", "0"];
    let mut run = bench.asperity(&arguments);
    let mut run = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let checkpoints = bench.data().join("store/checkpoints");
    let is_kept = || fs::read_dir(&checkpoints).is_ok_and(|kept| kept.count() > 0);
    while !is_kept() {
        sleep(Duration::from_millis(5));
    }
    run.kill().unwrap();
    run.wait().unwrap();
    let shares = run_until(&bench, &study, 2.0);
    let solved = loads(&shares, &all);
    assert!(solved < 40, "{solved} loads");
    fs::remove_dir(checkpoints).unwrap();
    assert_same_files(&bench.files(), &undisturbed.files());
}

#[test]
fn a_checkpoint_that_is_damaged_is_as_good_as_none() {
    let undisturbed = Bench::new();
    let all = run_until(&undisturbed, STUDY, 2.0);
    let bench = Bench::new();
    run_until(&bench, STUDY, 0.5);
    let folder = bench.data().join("store/checkpoints");
    let path = fs::read_dir(&folder).unwrap().next().unwrap().unwrap().path();
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&path, bytes).unwrap();
    assert_eq!(loads(&run_until(&bench, STUDY, 2.0), &all), 40);
    fs::remove_dir(folder).unwrap();
    assert_same_files(&bench.files(), &undisturbed.files());
}
