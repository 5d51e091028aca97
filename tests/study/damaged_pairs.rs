//! One run mends any two damaged files of a store: rows, parts and whole tables, in the own store
//! and in a read-only store below it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::bench::{Bench, assert_same_files, is_idle, text};
use crate::manifest::manifest;

/// Study with two files for the rows and for each part of a series, because the second load is
/// added by a second run.
static STUDY: LazyLock<String> = LazyLock::new(|| {
    manifest("parts", "")
        .generate("surfaces", "nodes = 16; hurst = 0.8; k_lower = 1; k_upper = 4")
        .solve("contact", "loads = [0.02, 0.1]; pressures = 'all'; flow = true")
        .measure("area", "")
        .text()
});

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Returns the study with a further part, which is computed from the stored pressures.
fn extended() -> String {
    STUDY.replace("flow = true", "flow = true\nstiffness = true")
}

/// Returns the tables in a store that has run the study.
fn tables() -> Files {
    let bench = Bench::new();
    bench.run(&STUDY.replace("[0.02, 0.1]", "[0.02]"));
    bench.run(&STUDY);
    let mut files = bench.files();
    files.retain(|path, _| path.starts_with("store") && path.extension().is_some());
    // A surface, and the rows, pressures, flows and areas of the first and of the second run.
    assert_eq!(files.len(), 9, "{:?}", files.keys());
    files
}

/// Damages a file so that either only reading its rows shows it, or also reading its metadata.
fn damaged(whole: &[u8], at_the_end: bool) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    if at_the_end {
        bytes.truncate(whole.len() / 2);
    } else {
        bytes[whole.len() / 3] ^= 1;
    }
    bytes
}

fn write(folder: &Path, files: &Files) {
    for (path, bytes) in files {
        let path = folder.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
}

/// Runs the extended study, whose tables must be `expected`, and shares it with its store.
fn assert_mends(bench: &Bench, expected: &Files, case: &str) {
    let manifest = bench.write(&extended());
    let said = |words: &[&str]| {
        let output = bench.output(&[words, &[manifest.to_str().unwrap()]].concat());
        let printed = text(&output.stdout) + &text(&output.stderr);
        assert!(output.status.success(), "{case}: {words:?}: {printed}");
    };
    said(&["run"]);
    assert_same_files(&bench.published("parts"), expected);
    assert!(bench.run(&extended()).values().all(is_idle), "{case}");
    let archive = bench.path("parts.zip");
    said(&["share", "--store", "--output", archive.to_str().unwrap()]);
    said(&["verify"]);
}

/// Calls `check` with a description of each case and the files of a store with two damaged tables.
fn for_all_pairs(check: impl Fn(&str, &Files)) {
    let files = tables();
    let names: Vec<&PathBuf> = files.keys().collect();
    for (index, first) in names.iter().enumerate() {
        for (distance, second) in names[index..].iter().enumerate() {
            let kinds = [(index + distance) % 2 == 0, distance % 3 == 0];
            let mut store = files.clone();
            for (name, at_the_end) in [*first, *second].into_iter().zip(kinds) {
                store.insert(name.clone(), damaged(&files[name], at_the_end));
            }
            check(&format!("{} and {}, {kinds:?}", first.display(), second.display()), &store);
        }
    }
}

fn expected() -> Files {
    let alone = Bench::new();
    alone.run(&extended());
    alone.published("parts")
}

#[test]
fn one_run_mends_any_two_files_of_the_own_store() {
    let expected = expected();
    for_all_pairs(|case, store| {
        let bench = Bench::new();
        write(&bench.data(), store);
        assert_mends(&bench, &expected, case);
    });
}

#[test]
fn one_run_mends_any_two_files_of_a_store_below() {
    let expected = expected();
    for_all_pairs(|case, store| {
        let (group, own) = (Bench::new(), Bench::new());
        write(&group.data(), store);
        fs::create_dir(own.data()).unwrap();
        let listed = format!("stores = [{:?}]", group.data());
        fs::write(own.data().join("asperity.toml"), listed).unwrap();
        assert_mends(&own, &expected, case);
        assert_same_files(&group.files(), store);
    });
}

#[test]
fn one_run_mends_a_file_in_both_stores() {
    let (expected, files) = (expected(), tables());
    for (name, whole) in &files {
        for at_the_end in [true, false] {
            let (group, own) = (Bench::new(), Bench::new());
            let mut store = files.clone();
            store.insert(name.clone(), damaged(whole, at_the_end));
            write(&group.data(), &store);
            write(&own.data(), &store);
            let listed = format!("stores = [{:?}]", group.data());
            fs::write(own.data().join("asperity.toml"), listed).unwrap();
            assert_mends(&own, &expected, &name.display().to_string());
        }
    }
}
