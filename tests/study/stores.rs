//! Read-only stores below the store of a data folder: their tables are read, and they stay as they
//! are.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde_json::Value;

use crate::bench::{Bench, Count, STUDY, assert_same_files, is_idle, text};

const LOADS: &str = "{ to = 0.1, steps = 4 }";

/// Returns a bench in which a group has run the study with two loads, and the files of its data.
fn group() -> Bench {
    let group = Bench::new();
    group.run(&STUDY.replace(LOADS, "[0.025, 0.05]"));
    group
}

/// Returns a bench whose data folder lies above the store of the group.
fn above(group: &Bench) -> Bench {
    let own = Bench::new();
    fs::create_dir(own.data()).unwrap();
    list(&own.data(), &[&group.data()]);
    own
}

/// Lists stores in the settings file in a folder.
fn list(folder: &Path, stores: &[&Path]) {
    fs::write(folder.join("asperity.toml"), format!("stores = {stores:?}")).unwrap();
}

/// Returns the content of every file of a bench, and the time of its last change.
fn state(bench: &Bench) -> BTreeMap<PathBuf, (Vec<u8>, SystemTime)> {
    let changed = |path: &Path| bench.data().join(path).metadata().unwrap().modified().unwrap();
    let files = bench.files().into_iter();
    files.map(|(path, bytes)| (path.clone(), (bytes, changed(&path)))).collect()
}

fn computed(counts: &BTreeMap<String, Count>) -> u64 {
    counts.values().map(|count| count.computed).sum()
}

/// Runs a command on the manifest of a bench.
fn said(bench: &Bench, words: &[&str]) -> (bool, String) {
    let output = bench.output(words);
    (output.status.success(), text(&output.stdout) + &text(&output.stderr))
}

fn manifest(bench: &Bench) -> String {
    bench.path("study.toml").to_str().unwrap().to_owned()
}

#[test]
fn tables_of_a_store_below_are_not_computed_again() {
    let (group, study) = (group(), STUDY.replace(LOADS, "[0.025, 0.05]"));
    let (before, own) = (state(&group), above(&group));
    let counts = own.run(&study);
    assert!(counts.values().all(is_idle), "{counts:?}");
    assert!(!own.files().keys().any(|path| path.starts_with("store") && path.ends_with("parquet")));
    assert_same_files(&own.published("small"), &group.published("small"));
    assert_eq!(state(&group), before);

    let record = fs::read(own.data().join("plans/small.json")).unwrap();
    let record: Value = serde_json::from_slice(&record).unwrap();
    let store = group.data().join("store");
    let from = serde_json::json!([{ "store": store, "tasks": 4 }]);
    assert_eq!(record["stages"][0]["stores"], from);
    let (_, plan) = said(&own, &["plan", &manifest(&own)]);
    let line = format!("finished in `{}`: 4 surfaces, 4 light", store.display());
    assert!(plan.contains(&line), "{plan}");
    let (_, tasks) = said(&own, &["plan", &manifest(&own), "--tasks"]);
    assert!(tasks.lines().all(|line| line.contains(store.to_str().unwrap())), "{tasks}");
    let (_, status) = said(&own, &["status", &manifest(&own), "--json"]);
    let status: Value = serde_json::from_str(&status).unwrap();
    assert_eq!(status["stages"][0]["stores"], from);
    let (_, status) = said(&own, &["status", &manifest(&own)]);
    assert!(status.contains(&line), "{status}");
    // The key alone is enough to find a table.
    let task: Value = serde_json::from_str(tasks.lines().next().unwrap()).unwrap();
    let (_, shown) = said(&own, &["show", task["task"].as_str().unwrap()]);
    assert!(shown.contains(store.to_str().unwrap()), "{shown}");
}

#[test]
fn loads_in_two_stores_give_the_bytes_of_one_store() {
    let (group, alone) = (group(), Bench::new());
    let (before, own) = (state(&group), above(&group));
    let counts = own.run(&STUDY);
    assert_eq!((counts["surfaces"].computed, counts["light"].computed), (0, 4));
    alone.run(&STUDY);
    assert_same_files(&own.published("small"), &alone.published("small"));
    let own_rows = own.files().into_keys().filter(|path| path.starts_with("store")).count();
    assert!(own_rows < alone.files().into_keys().filter(|path| path.starts_with("store")).count());
    assert_eq!(state(&group), before);
    // An archive has the tables of both stores.
    let archive = own.path("small.zip");
    let words = ["share", &manifest(&own), "--store", "--output", archive.to_str().unwrap()];
    let (is_done, shared) = said(&own, &[&words[..], &["--json"]].concat());
    assert!(is_done, "{shared}");
    let shared: Value = serde_json::from_str(&shared).unwrap();
    assert_eq!(shared["stored"], shared["tasks"]);
}

#[test]
fn a_damaged_table_below_is_computed_into_the_own_store_and_stays_in_place() {
    let (group, study) = (group(), STUDY.replace(LOADS, "[0.025, 0.05]"));
    let whole = group.published("small");
    let files = group.files().into_iter();
    let files = files.filter(|(path, _)| path.starts_with("store") && path.extension().is_some());
    for (path, bytes) in files {
        // A table with a sound end is found to be damaged only when its rows are read.
        let mut damaged = bytes.clone();
        damaged[bytes.len() / 3] ^= 1;
        fs::write(group.data().join(path), damaged).unwrap();
    }
    let (before, own) = (state(&group), above(&group));
    let counts = own.run(&study);
    assert!(computed(&counts) > 0);
    assert_same_files(&own.published("small"), &whole);
    assert_eq!(state(&group), before);
    assert!(own.run(&study).values().all(is_idle));
    let (is_sound, verified) = said(&own, &["verify"]);
    assert!(is_sound, "{verified}");
    let (is_sound, verified) = said(&own, &["verify", "--stores"]);
    assert!(!is_sound && verified.contains("left in place"), "{verified}");
    assert_eq!(state(&group), before);
}

#[test]
fn a_damaged_map_below_is_named_with_the_command_that_computes_it() {
    let (group, study) = (Bench::new(), STUDY.replace(LOADS, "[0.025, 0.05]\npressures = \"all\""));
    group.run(&study);
    let own = above(&group);
    own.run(&study);
    let mut files = group.files().into_iter();
    let (path, mut bytes) =
        files.find(|(path, _)| path.to_string_lossy().contains("-pressures-")).unwrap();
    let middle = bytes.len() / 3;
    bytes[middle] ^= 1;
    fs::write(group.data().join(path), bytes).unwrap();
    let archive = own.path("small.zip");
    let manifest = manifest(&own);
    let share = ["share", &manifest, "--store", "--output", archive.to_str().unwrap()];
    let (is_done, printed) = said(&own, &share);
    assert!(!is_done, "{printed}");
    let hint = printed.split('`').find(|part| part.contains("--only")).unwrap();
    let key = hint.split(' ').next_back().unwrap();
    assert!(said(&own, &["run", &manifest, "--only", key]).0, "{key}");
    let (is_done, printed) = said(&own, &share);
    assert!(is_done, "{printed}");
}

#[test]
fn a_store_that_does_not_exist_stops_runs_and_warns_readers() {
    let (group, own) = (group(), Bench::new());
    let study = STUDY.replace(LOADS, "[0.025, 0.05]");
    own.run(&study);
    for (store, reason) in [
        (group.path("nowhere"), "No such file or directory"),
        (group.path("study.toml"), "Not a directory"),
        (group.data().join("results"), "it is neither a store nor a data folder"),
    ] {
        list(&own.data(), &[&store]);
        for (command, succeeds) in [("table", true), ("plan", true), ("run", false)] {
            let mut words = vec![command.to_owned(), manifest(&own)];
            words.extend((command == "table").then(|| "area".to_owned()));
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let (is_done, printed) = said(&own, &words);
            assert_eq!(is_done, succeeds, "{command}: {printed}");
            let found = printed.matches(reason).count();
            assert_eq!(found, 1, "{command}: {printed}");
            assert!(printed.contains("asperity.toml"), "{printed}");
        }
        // Commands that find a task by its key warn, too.
        let table = own.table("small", "surfaces");
        let key = table.texts("task").unwrap().value(0).to_owned();
        let picture = own.path("heights.png");
        let view = ["view", &key, "--replace", "--output", picture.to_str().unwrap()];
        for words in [&["show", &key][..], &view] {
            let (is_done, printed) = said(&own, words);
            assert!(is_done, "{printed}");
            assert_eq!(printed.matches(reason).count(), 1, "{printed}");
        }
    }
}

#[test]
fn the_nearest_settings_file_that_lists_stores_counts() {
    let group = group();
    let own = above(&group);
    let study = STUDY.replace(LOADS, "[0.025, 0.05]");
    let finished = || own.plan(&study)["surfaces"].cached;
    assert_eq!(finished(), 4);
    list(&own.path("."), &[]);
    assert_eq!(finished(), 0);
    list(&own.path("."), &[&group.data().join("store")]);
    fs::remove_file(own.data().join("asperity.toml")).unwrap();
    assert_eq!(finished(), 4);
    // A store below itself is the store alone.
    list(&group.data(), &[&group.data()]);
    assert!(!text(&group.output(&["plan", &manifest(&group)]).stdout).contains("finished in"));
    fs::write(own.path("asperity.toml"), "store = []").unwrap();
    let (is_done, printed) = said(&own, &["plan", &manifest(&own)]);
    assert!(!is_done && printed.contains("did you mean `stores`?"), "{printed}");
}
