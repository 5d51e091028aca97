//! Upgrade of a data folder of version 0.1.0: what is reused, what is computed again and why.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use zip::ZipArchive;

use crate::bench::{Bench, Count, is_idle, text};

/// Stages with the same numbers in version 0.1.0 and now. Each kind of stage is among them.
const REUSED: [&str; 7] = ["surfaces", "contact", "area", "corrected", "law", "curves", "heights"];

/// Stages with other numbers, and the reason that `plan` gives.
const COMPUTED_AGAIN: [(&str, &str); 5] = [
    ("scan", "reader `text` version 4: units in all spellings of titles convert the numbers; "),
    ("seal", "flow version 2: another solver, whose certified error is at most 1e-6"),
    ("patch", "free boundary version 3: pressures that a step clips are taken from the nodes"),
    (
        "autocorrelation",
        "autocorrelation version 2: lag zero of the radial mean is the mean square",
    ),
    ("table", "query version 3: `sum(1)`, windows with `order by`, `%`, `round` and `cast` are"),
];

fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/study/upgrade").join(name)
}

fn unpack(archive: &str) -> Bench {
    let bench = Bench::new();
    let mut archive = ZipArchive::new(File::open(source(archive)).unwrap()).unwrap();
    archive.extract(bench.path("")).unwrap();
    bench
}

/// Returns a bench with the data folder of version 0.1.0 and the file that its study reads.
fn upgraded() -> Bench {
    let bench = unpack("data.zip");
    fs::copy(source("scan.txt"), bench.path("scan.txt")).unwrap();
    bench
}

/// Returns the manifest of version 0.1.0.
fn old_manifest() -> String {
    fs::read_to_string(source("study.toml")).unwrap()
}

/// Returns the manifest as this version wants it.
fn manifest() -> String {
    old_manifest().replace("load_unit = \"absolute\"", "load_unit = \"GPa\"")
}

/// Runs a command that must succeed, and returns what it prints.
fn printed(bench: &Bench, arguments: &[&str]) -> String {
    let output = bench.asperity(arguments).current_dir(bench.path("")).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// Returns the files of the store.
fn store(bench: &Bench) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = bench.files();
    files.retain(|path, _| path.starts_with("store") && !path.ends_with("lock"));
    files
}

#[test]
fn a_key_that_has_changed_is_answered_by_the_new_one() {
    let bench = upgraded();
    let path = bench.write(&old_manifest());
    let output = bench.output(&["check", path.to_str().unwrap()]);
    let message = text(&output.stderr);
    assert!(!output.status.success() && message.contains("set `load_unit = \"GPa\"`"), "{message}");
    assert_eq!(bench.plan(&manifest())["contact"].cached, 2);
}

#[test]
fn only_new_numbers_are_computed_and_each_stage_says_why() {
    let bench = upgraded();
    let old = store(&bench);
    let planned = bench.plan(&manifest());
    for stage in REUSED {
        assert!(is_idle(&planned[stage]) || planned[stage].to_run == 0, "{stage}");
    }
    assert_eq!(planned.len(), REUSED.len() + COMPUTED_AGAIN.len());
    let shown = printed(&bench, &["plan", "study.toml", "--json"]);
    let shown: Value = serde_json::from_str(&shown).unwrap();
    for stage in shown["stages"].as_array().unwrap() {
        let name = stage["name"].as_str().unwrap();
        let reasons = stage["reasons"].to_string();
        match COMPUTED_AGAIN.iter().find(|(of, _)| *of == name) {
            Some((_, reason)) => assert!(reasons.contains(reason), "{name}: {reasons}"),
            None => assert_eq!(reasons, "[]", "{name}"),
        }
    }

    let computed = bench.run(&manifest());
    let expected: u64 = COMPUTED_AGAIN.iter().map(|(stage, _)| planned[*stage].to_run).sum();
    assert_eq!(computed.values().map(|count: &Count| count.computed).sum::<u64>(), expected);
    let now = store(&bench);
    assert!(old.iter().all(|(path, bytes)| now.get(path) == Some(bytes)), "old files stay");
    assert!(bench.run(&manifest()).values().all(is_idle));
    printed(&bench, &["verify", "study.toml"]);
}

#[test]
fn tables_with_the_same_numbers_can_be_read_before_the_first_run() {
    let bench = upgraded();
    bench.write(&manifest());
    let before = bench.files();
    for stage in REUSED {
        let table = printed(&bench, &["table", "study.toml", stage, "--csv"]);
        assert!(table.lines().count() > 1, "{stage}: {table}");
    }
    let shown = printed(&bench, &["show", "data/results/upgrade/seal.parquet"]);
    assert!(shown.contains("flow_factor_x"), "{shown}");
    crate::bench::assert_same_files(&bench.files(), &before);
}

#[test]
fn the_difference_to_the_old_tables_is_named_with_its_reason() {
    let (bench, old) = (upgraded(), upgraded());
    bench.run(&manifest());
    let old = old.data();
    let differences = printed(&bench, &["diff", old.to_str().unwrap(), "study.toml"]);
    let lines: Vec<&str> = differences.lines().map(str::trim).collect();
    for (stage, reason) in COMPUTED_AGAIN {
        let expected = format!("{stage}: {reason}");
        assert!(lines.iter().any(|line| line.starts_with(&expected)), "{expected}\n{differences}");
    }
    let equal = lines.iter().find(|line| line.starts_with("equal to the last bit: ")).unwrap();
    for stage in REUSED.iter().chain(&["scan", "table"]) {
        assert!(equal.contains(&format!("{stage} (")), "{stage}: {equal}");
    }
    for changed in ["flow_factor_x", "peak_pressure"] {
        assert!(lines.iter().any(|line| line.starts_with(changed)), "{changed}\n{differences}");
    }
}

#[test]
fn an_old_archive_is_whole_and_its_study_runs() {
    let bench = unpack("archive.zip");
    let mut check = Command::new("sha256sum");
    check.args(["--check", "--strict", "--quiet", "SHA256SUMS"]).current_dir(bench.path(""));
    assert!(check.status().unwrap().success());
    printed(&bench, &["verify", "archive.toml"]);
    let shown = printed(&bench, &["show", "data/results/archive/area.parquet"]);
    assert!(shown.contains("area_fraction"), "{shown}");
    printed(&bench, &["run", "archive.toml"]);
    let archive = source("archive.zip");
    let differences = printed(&bench, &["diff", archive.to_str().unwrap(), "archive.toml"]);
    assert!(differences.contains("seal: flow version 2: another solver"), "{differences}");
    assert!(differences.contains("equal to the last bit: surfaces (1 row)"), "{differences}");
}
