//! Disturbances of a run do not change its results.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::thread::sleep;
use std::time::Duration;

use crate::bench::{Bench, STUDY, assert_same_files, counts, is_idle};

/// Study that runs long enough to be killed halfway.
fn longer() -> String {
    STUDY.replace("nodes = 32", "nodes = 128").replace("realizations = 2", "realizations = 3")
}

#[test]
fn a_killed_run_goes_on_to_the_same_bytes() {
    let undisturbed = Bench::new();
    undisturbed.run(&longer());
    let total: u64 = undisturbed.plan(&longer()).values().map(|count| count.cached).sum();

    let bench = Bench::new();
    let manifest = bench.write(&longer());
    let arguments = ["run", manifest.to_str().unwrap(), "--jobs", "1"];
    for delay in [15, 30, 60, 90, 120] {
        let mut child =
            bench.asperity(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        sleep(Duration::from_millis(delay));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let kept = stored(&bench).len() as u64;
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
    let child =
        bench.asperity(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    sleep(Duration::from_millis(300));
    let kill = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert!(String::from_utf8_lossy(&output.stdout).contains("run again to continue"));
}

#[test]
fn two_runs_at_once_agree() {
    let bench = Bench::new();
    let manifest = bench.write(&longer());
    let arguments = ["run", manifest.to_str().unwrap(), "--json", "--jobs", "1"];
    let start = || {
        let mut command = bench.asperity(&arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let runs = [start(), start()].map(|child| child.wait_with_output().unwrap());
    assert!(runs.iter().all(|output| output.status.success()));
    let alone = Bench::new();
    alone.run(&longer());
    assert_same_files(&bench.files(), &alone.files());
}

/// Returns the files of the tables in the store.
fn stored(bench: &Bench) -> Vec<PathBuf> {
    let files = bench.files().into_keys();
    let tables = files.filter(|path| path.starts_with("store"));
    let tables = tables.filter(|path| path.extension().is_some_and(|e| e == "parquet"));
    tables.map(|path| bench.data().join(path)).collect()
}

#[test]
fn a_failed_task_lets_independent_ones_finish() {
    let bench = Bench::new();
    // First only surfaces, then a damaged surface file, then all stages.
    let surfaces = STUDY.split("[stage.light]").next().unwrap();
    bench.run(surfaces);
    let victim = stored(&bench).remove(0);
    fs::remove_file(&victim).unwrap();
    fs::create_dir(&victim).unwrap();

    let manifest = bench.write(&STUDY);
    let output = bench.output(&["run", manifest.to_str().unwrap(), "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let printed = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(printed.contains(victim.to_str().unwrap()), "{printed}");
    let stages = counts(&output.stdout);
    let done = |stage: &str| (stages[stage].computed, stages[stage].failed);
    assert_eq!((done("surfaces"), done("light")), ((0, 1), (3, 1)));
    assert_eq!((done("area"), done("law")), ((3, 1), (1, 1)));

    fs::remove_dir(&victim).unwrap();
    bench.run(&STUDY);
    assert!(bench.run(&STUDY).values().all(is_idle));
}

/// Kinds of damage to a file.
fn damages(whole: &[u8], other: &[u8]) -> Vec<(&'static str, Vec<u8>)> {
    let mut flipped = whole.to_vec();
    flipped[whole.len() / 3] ^= 4;
    vec![
        ("truncated", whole[..whole.len() / 2].to_vec()),
        ("flipped", flipped),
        ("empty", vec![]),
        ("foreign", other.to_vec()),
        ("text", b"not a table".to_vec()),
    ]
}

#[test]
fn a_damaged_file_is_set_aside_and_computed_again() {
    let undisturbed = Bench::new();
    undisturbed.run(&STUDY);
    let whole = undisturbed.files();
    for victim in stored(&undisturbed) {
        let name = victim.strip_prefix(undisturbed.data()).unwrap();
        let other = whole.iter().find(|(path, _)| *path != name).unwrap().1;
        for (how, bytes) in damages(&whole[name], other) {
            let bench = Bench::new();
            for (path, content) in &whole {
                // If there are no results, every table of the store is read.
                if path.starts_with("store") {
                    let path = bench.data().join(path);
                    fs::create_dir_all(path.parent().unwrap()).unwrap();
                    fs::write(path, content).unwrap();
                }
            }
            fs::write(bench.data().join(name), &bytes).unwrap();
            let manifest = bench.write(&STUDY);
            let output = bench.output(&["run", manifest.to_str().unwrap()]);
            let printed = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{how}: {printed}");
            assert!(printed.contains(name.to_str().unwrap()), "{how}: {printed}");

            let mut files = bench.files();
            let aside = format!("{}.damaged", name.display());
            assert_eq!(files.remove(Path::new(&aside)), Some(bytes), "{how}: {printed}");
            assert!(files == whole, "{how}");
        }
    }
}

#[test]
fn a_damaged_input_of_a_new_task_is_computed_again_before_it_is_read() {
    let bench = Bench::new();
    let surfaces = STUDY.split("[stage.light]").next().unwrap();
    bench.run(surfaces);
    for victim in stored(&bench) {
        fs::write(victim, "").unwrap();
    }
    let counts = bench.run(&STUDY);
    assert_eq!((counts["surfaces"].computed, counts["light"].computed), (4, 4));
    let undisturbed = Bench::new();
    undisturbed.run(&STUDY);
    let mut files = bench.files();
    files.retain(|path, _| path.extension().is_none_or(|e| e != "damaged"));
    assert!(files == undisturbed.files());
}
