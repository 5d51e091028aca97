//! Runs that are killed or meet a full disk: no result is lost, and the final bytes equal those of
//! an undisturbed run.

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::bench::{Bench, STUDY, assert_same_files, left_behind};
use crate::disk::Disk;

/// Number of disturbances per study.
const TIMES: usize = 50;

/// Study with more tasks, all of them short.
fn study() -> String {
    STUDY.replace("realizations = 2", "realizations = 4")
}

/// Returns the bench of an undisturbed run and its duration.
fn undisturbed() -> (Bench, Duration) {
    let bench = Bench::new();
    let begun = Instant::now();
    bench.run(&study());
    (bench, begun.elapsed())
}

fn start(bench: &Bench) -> Child {
    let manifest = bench.write(&study());
    let mut command = bench.asperity(&["run", manifest.to_str().unwrap()]);
    let silent = command.stdout(Stdio::null()).stderr(Stdio::null());
    silent.spawn().unwrap()
}

/// Kills each process after a random fraction of the duration `whole`; returns whether one had
/// finished before.
fn kill_at_random(mut runs: Vec<Child>, whole: Duration, random: &mut ChaCha8Rng) -> bool {
    let mut is_done = false;
    for run in &mut runs {
        sleep(whole.mul_f64(random.random::<f64>()));
        run.kill().unwrap();
        is_done |= run.wait().unwrap().success();
    }
    is_done
}

/// Kills runs repeatedly; compares the bytes when a study is complete, and starts again.
fn survives(together: usize, seed: u64) {
    let (undisturbed, whole) = undisturbed();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut bench = Bench::new();
    for _ in 0..TIMES / together {
        let runs = (0..together).map(|_| start(&bench)).collect();
        if kill_at_random(runs, whole, &mut random) {
            bench.run(&study());
            assert_same_files(&bench.content(), &undisturbed.content());
            bench = Bench::new();
        }
    }
    bench.run(&study());
    assert_same_files(&bench.content(), &undisturbed.content());
}

#[test]
fn a_run_killed_at_fifty_moments_ends_with_the_same_bytes() {
    survives(1, 1);
}

#[test]
fn two_runs_at_once_killed_at_fifty_moments_end_with_the_same_bytes() {
    survives(2, 2);
}

#[test]
fn a_disk_that_fills_up_fifty_times_ends_with_the_same_bytes() {
    let (undisturbed, _) = undisturbed();
    let bench = Bench::new();
    let Some(disk) = Disk::mount(&bench.data()) else {
        return;
    };
    let blocks: u64 =
        undisturbed.files().values().map(|bytes| bytes.len().div_ceil(4096) as u64).sum();
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut sizes: Vec<u64> = (0..TIMES).map(|_| random.random_range(1..blocks)).collect();
    sizes.sort_unstable();
    let manifest = bench.write(&study());
    let mut failures = 0;
    for size in sizes {
        disk.resize(size);
        let output = bench.output(&["run", manifest.to_str().unwrap()]);
        let printed = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{printed}");
        assert!(printed.contains("No space left on device"), "{printed}");
        assert!(printed.contains(bench.data().to_str().unwrap()), "{printed}");
        assert!(bench.output(&["verify"]).status.success());
        failures += 1;
    }
    assert_eq!(failures, TIMES);
    disk.resize(2 * blocks);
    bench.run(&study());
    assert_same_files(&bench.content(), &undisturbed.content());
}

/// Simulates a full disk with `ulimit -f`, which needs no special permissions.
#[test]
fn files_that_may_not_grow_are_named_and_cost_nothing_else() {
    const LIMITED: &str = "ulimit -f $1; exec $2 run $3";
    let (undisturbed, _) = undisturbed();
    let bench = Bench::new();
    let manifest = bench.write(&study());
    for blocks in ["1", "8", "16", "24"] {
        let command = Command::new("sh")
            .args(["-c", LIMITED, "sh", blocks, env!("CARGO_BIN_EXE_asperity")])
            .arg(&manifest)
            .env("ASPERITY_DATA", bench.data())
            .output();
        let output = command.unwrap();
        let printed = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{printed}");
        assert!(printed.contains("File too large"), "{printed}");
        assert!(printed.contains(bench.data().to_str().unwrap()), "{printed}");
        assert!(bench.output(&["verify"]).status.success());
    }
    bench.run(&study());
    assert_same_files(&bench.content(), &undisturbed.content());
}

#[test]
fn unfinished_files_are_deleted_when_no_process_uses_the_store() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = bench.files();
    let folders = ["store/unfinished", "results/small", "results/small/figures"];
    let left: Vec<PathBuf> =
        folders.map(|folder| bench.data().join(folder).join(left_behind())).into();
    fs::create_dir(bench.data().join("results/small/figures")).unwrap();
    for path in &left {
        fs::write(path, "half a table").unwrap();
    }
    let reader =
        asperity::tables::store::Store::open_read_only(&bench.data().join("store")).unwrap();
    bench.run(&STUDY);
    assert!(left.iter().all(|path| path.exists()));
    drop(reader);
    bench.run(&STUDY);
    assert_same_files(&bench.files(), &before);
}
