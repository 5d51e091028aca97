//! Nothing that happens to a run changes what it computes.

use std::fs;
use std::process::Stdio;
use std::thread::sleep;
use std::time::Duration;

use crate::bench::{Bench, STUDY, counts, is_idle};

/// Finished tasks: unfinished files carry other names.
fn finished(bench: &Bench) -> usize {
    let is_table = |path: &&std::path::PathBuf| {
        path.starts_with("store") && path.extension().is_some_and(|e| e == "parquet")
    };
    bench.files().keys().filter(is_table).count()
}

/// A study that takes long enough to be killed in its middle.
fn longer() -> String {
    STUDY
        .replace("nodes = 32", "nodes = 128")
        .replace("realizations = 2", "realizations = 3")
}

#[test]
fn a_killed_run_goes_on_to_the_same_bytes() {
    let undisturbed = Bench::new();
    undisturbed.run(&longer());
    let total: u64 = undisturbed
        .plan(&longer())
        .values()
        .map(|count| count.cached)
        .sum();

    let bench = Bench::new();
    let manifest = bench.write(&longer());
    let arguments = ["run", manifest.to_str().unwrap(), "--jobs", "1"];
    for delay in [15, 30, 60, 90, 120] {
        let mut child = bench
            .asperity(&arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        sleep(Duration::from_millis(delay));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let kept = finished(&bench) as u64;
    let counts = bench.run(&longer());
    let computed: u64 = counts.values().map(|count| count.computed).sum();
    assert_eq!(kept + computed, total);

    let is_leftover = |name: &str| name.starts_with(".unfinished-");
    let mut files = bench.files();
    files.retain(|path, _| !is_leftover(&path.file_name().unwrap().to_string_lossy()));
    assert!(files == undisturbed.files());
}

#[test]
fn an_interrupted_run_says_so_and_goes_on_later() {
    let bench = Bench::new();
    let manifest = bench.write(&longer().replace("nodes = 128", "nodes = 512"));
    let arguments = ["run", manifest.to_str().unwrap()];
    let child = bench
        .asperity(&arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    sleep(Duration::from_millis(300));
    let kill = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert!(String::from_utf8_lossy(&output.stdout).contains("run again to go on"));
}

#[test]
fn two_runs_at_once_agree() {
    let bench = Bench::new();
    let manifest = bench.write(&longer());
    let arguments = ["run", manifest.to_str().unwrap(), "--json", "--jobs", "1"];
    let start = || {
        let mut command = bench.asperity(&arguments);
        command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let runs = [start(), start()].map(|child| child.wait_with_output().unwrap());
    assert!(runs.iter().all(|output| output.status.success()));
    let alone = Bench::new();
    alone.run(&longer());
    assert!(bench.files() == alone.files());
}

#[test]
fn a_failed_task_lets_independent_ones_finish() {
    let bench = Bench::new();
    // Surfaces alone, then one of them damaged, then everything.
    let surfaces = STUDY.split("[stage.light]").next().unwrap();
    bench.run(surfaces);
    let files = bench.files();
    let victim = files.keys().find(|path| path.starts_with("store")).unwrap();
    let path = bench.data().join(victim);
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() / 2]).unwrap();

    let manifest = bench.write(STUDY);
    let output = bench.output(&["run", manifest.to_str().unwrap(), "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        told.contains(&victim.file_name().unwrap().to_string_lossy().into_owned()),
        "{told}"
    );
    let stages = counts(&output.stdout);
    assert_eq!((stages["light"].computed, stages["light"].failed), (3, 1));
    assert_eq!((stages["area"].computed, stages["area"].failed), (3, 1));
    assert_eq!((stages["law"].computed, stages["law"].failed), (1, 1));

    fs::write(&path, whole).unwrap();
    bench.run(STUDY);
    assert!(bench.run(STUDY).values().all(is_idle));
}
