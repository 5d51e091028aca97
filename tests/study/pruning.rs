//! Pruning deletes only unneeded files, only with `--yes`, and never during a run.

use std::collections::BTreeMap;
use std::fs;
use std::process::Stdio;
use std::thread::sleep;
use std::time::Duration;

use asperity::tables::store::users::Lock;
use serde_json::Value;

use crate::bench::{Bench, STUDY, assert_same_files, is_idle, left_behind, text};

/// Returns the output of `prune --json`, by kind of file.
fn prune(bench: &Bench, arguments: &[&str]) -> BTreeMap<String, u64> {
    let arguments = [&["prune", "--json"], arguments].concat();
    let output = bench.output(&arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let kinds = json["kinds"].as_array().unwrap().iter();
    let kinds = kinds
        .map(|kind| (kind["name"].as_str().unwrap().to_owned(), kind["files"].as_u64().unwrap()));
    kinds.collect()
}

fn kinds<const N: usize>(kinds: [(&str, u64); N]) -> BTreeMap<String, u64> {
    kinds.map(|(name, files)| (name.to_owned(), files)).into()
}

#[test]
fn what_no_named_manifest_needs_is_shown_first_and_deleted_when_asked_for() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let small = bench.files();
    // One more surface per spectrum, and the stages that pool them.
    let larger =
        STUDY.replace("realizations = 2", "realizations = 3").replace("\"small\"", "\"larger\"");
    bench.run(&larger);
    let both = bench.files();
    let small_manifest = bench.path("small.toml");
    fs::write(&small_manifest, STUDY.as_bytes()).unwrap();
    let larger_manifest = bench.write(&larger);
    let (small_manifest, larger_manifest) =
        (small_manifest.to_str().unwrap(), larger_manifest.to_str().unwrap());

    assert_eq!(prune(&bench, &[small_manifest, larger_manifest]), kinds([]));
    let unneeded = kinds([
        ("aggregate", 1),
        ("correct", 2),
        ("fit", 2),
        ("generate", 2),
        ("measure", 2),
        ("plans", 1),
        ("results", 7),
        ("solve", 2),
    ]);
    assert_eq!(prune(&bench, &[small_manifest]), unneeded);
    assert_same_files(&bench.files(), &both);
    assert_eq!(prune(&bench, &[small_manifest, "--yes"]), unneeded);
    assert_same_files(&bench.files(), &small);
    assert!(!bench.data().join("results/larger").exists());
    assert!(bench.run(&STUDY).values().all(is_idle));
}

#[test]
fn a_run_names_the_results_of_a_removed_stage_and_prune_deletes_them() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let manifest = bench.write(STUDY.split("[stage.curves]").next().unwrap());
    let output = bench.output(&["run", manifest.to_str().unwrap()]);
    let printed = text(&output.stderr);
    assert!(printed.contains("curves.parquet` belongs to a stage"), "{printed}");
    assert!(printed.contains("that the study no longer has"), "{printed}");
    let unneeded = prune(&bench, &[manifest.to_str().unwrap(), "--yes"]);
    assert_eq!(unneeded, kinds([("aggregate", 1), ("results", 1)]));
    assert!(!bench.data().join("results/small/curves.parquet").exists());
    assert!(bench.data().join("results/small/law.parquet").exists());
}

#[test]
fn without_manifests_only_damaged_and_unfinished_files_go() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = bench.files();
    let staging = bench.data().join("store/unfinished");
    fs::write(staging.join(left_behind()), "half").unwrap();
    let elsewhere = staging.join(".unfinished-1@another-machine-aB3dEf");
    fs::write(&elsewhere, "half").unwrap();
    fs::write(bench.data().join("results/small/law.parquet.damaged"), "old").unwrap();
    fs::write(bench.data().join("store/notes.txt"), "mine").unwrap();
    assert_eq!(prune(&bench, &["--yes"]), kinds([("set aside", 1), ("unfinished", 1)]));
    fs::remove_file(bench.data().join("store/notes.txt")).expect("foreign files stay");
    fs::remove_file(elsewhere).expect("files of other machines stay");
    assert_same_files(&bench.files(), &before);
}

#[test]
fn nothing_is_deleted_while_somebody_uses_the_store() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let manifest = bench.write(&STUDY.replace("seed = 7", "seed = 8"));
    let arguments = ["prune", "--yes", manifest.to_str().unwrap()];
    let before = bench.files();
    let reader =
        asperity::tables::store::Store::open_read_only(&bench.data().join("store")).unwrap();
    let output = bench.output(&arguments);
    let printed = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1));
    assert!(printed.contains("in use by another process"), "{printed}");
    assert_same_files(&bench.files(), &before);
    drop(reader);
    assert!(bench.output(&arguments).status.success());
    assert!(bench.files().len() < before.len());
}

#[test]
fn a_command_that_waits_for_the_lock_says_so() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let pruning = Lock::exclusive(&bench.data().join("store")).unwrap().unwrap();
    let manifest = bench.path("study.toml");
    let mut status = bench.asperity(&["status", manifest.to_str().unwrap()]);
    let status = status.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    sleep(Duration::from_millis(1500));
    drop(pruning);
    let told = status.wait_with_output().unwrap();
    assert!(told.status.success());
    let printed = text(&told.stderr);
    assert_eq!(printed.matches("note: waiting for the lock of").count(), 1, "{printed}");
    // A command that does not wait says nothing.
    let told = bench.output(&["status", manifest.to_str().unwrap()]);
    assert!(!text(&told.stderr).contains("waiting"), "{}", text(&told.stderr));
}

#[test]
fn two_runs_and_prunes_at_once_do_no_harm() {
    let study = STUDY.replace("nodes = 32", "nodes = 128");
    let alone = Bench::new();
    alone.run(&study);
    let bench = Bench::new();
    let manifest = bench.write(&study);
    let other = bench.path("other.toml");
    fs::write(&other, STUDY.replace("seed = 7", "seed = 8")).unwrap();
    let start = || {
        let mut run = bench.asperity(&["run", manifest.to_str().unwrap()]);
        let silent = run.stdout(Stdio::null()).stderr(Stdio::null());
        silent.spawn().unwrap()
    };
    let mut runs = [start(), start()];
    while runs.iter_mut().any(|run| run.try_wait().unwrap().is_none()) {
        bench.output(&["prune", "--yes", other.to_str().unwrap()]);
    }
    for mut run in runs {
        assert!(run.wait().unwrap().success());
    }
    // The last prune may have run when no process was active.
    bench.run(&study);
    assert_same_files(&bench.files(), &alone.files());
}
