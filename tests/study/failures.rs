//! Failed tasks are reported, recorded in a table, and can be repeated with one command.

use std::fs;
use std::path::PathBuf;
use std::process::Output;

use asperity::tables::table::Table;
use serde_json::Value;

use crate::bench::{Bench, STUDY, counts, text};

/// Study in which one task cannot be stored, because a folder has the path of its table.
struct Blocked {
    bench: Bench,
    key: String,
    obstacle: PathBuf,
}

impl Blocked {
    /// Creates a folder at the path of the first task of a stage.
    fn at(stage: &str) -> Blocked {
        let undisturbed = Bench::new();
        undisturbed.run(&STUDY);
        let table = undisturbed.table("small", stage);
        let key = table.texts("task").unwrap().value(0).to_owned();
        let bench = Bench::new();
        let file = undisturbed.file_of(&key);
        let obstacle = bench.data().join(file.strip_prefix(undisturbed.data()).unwrap());
        fs::create_dir_all(&obstacle).unwrap();
        Blocked { bench, key, obstacle }
    }

    fn run(&self) -> Output {
        let path = self.bench.write(&STUDY);
        self.bench.output(&["run", path.to_str().unwrap(), "--json"])
    }
}

fn column(table: &Table, name: &str) -> Vec<String> {
    let texts = table.texts(name).unwrap();
    texts.iter().map(|text| text.unwrap().to_owned()).collect()
}

/// Returns the stages of the tasks with this outcome.
fn stages(failures: &Table, outcome: &str) -> Vec<String> {
    let rows = column(failures, "stage").into_iter();
    let rows = rows.zip(column(failures, "outcome"));
    let such = rows.filter(|(_, found)| found == outcome);
    such.map(|(stage, _)| stage).collect()
}

#[test]
fn a_failed_task_is_a_row_and_so_is_what_needs_it_and_everything_else_is_computed() {
    let blocked = Blocked::at("light");
    let output = blocked.run();
    assert_eq!(output.status.code(), Some(1));
    let done = counts(&output.stdout);
    let done = ["surfaces", "light", "area", "law", "curves"]
        .map(|stage| (done[stage].computed, done[stage].failed));
    assert_eq!(done, [(4, 0), (3, 1), (3, 1), (1, 1), (0, 1)]);

    let failures = blocked.bench.table("small", "failures");
    assert_eq!(stages(&failures, "failed"), ["light"]);
    let dropped = ["area", "corrected", "law", "curves"];
    assert_eq!(stages(&failures, "not-started"), dropped);
    let reasons = column(&failures, "reason");
    assert!(reasons[0].contains(blocked.obstacle.to_str().unwrap()));
    for reason in &reasons[1..] {
        let expected = format!("needs task {}, which failed", blocked.key);
        assert_eq!(*reason, expected);
    }
    let printed = text(&output.stderr);
    for part in ["stage `light`, nodes=32", "k_upper=4", "realization=0", "--only"] {
        assert!(printed.contains(part), "{part} in\n{printed}");
    }
}

#[test]
fn the_table_of_failures_is_as_it_was_written() {
    let bench = Bench::new();
    bench.run(&STUDY.replace("[stage.area]", "max_pairs = 1\n\n[stage.area]"));
    let verify = || bench.output(&["verify"]);
    let output = verify();
    assert!(output.status.success(), "{}", text(&output.stdout));
    let file = bench.data().join("results/small/failures.parquet");
    fs::copy(file.with_file_name("light.parquet"), &file).unwrap();
    assert_eq!(verify().status.code(), Some(1));
}

#[test]
fn a_row_places_its_task_by_what_the_surfaces_that_it_needs_have_in_common() {
    let blocked = Blocked::at("light");
    blocked.run();
    let failures = blocked.bench.table("small", "failures");
    let known =
        |name: &str| -> Vec<Option<i64>> { failures.integers(name).unwrap().iter().collect() };
    let (one, none) = (Some(4), None);
    assert_eq!(known("k_upper"), [one, one, one, one, none]);
    let first = Some(0);
    assert_eq!(known("realization"), [first, first, first, none, none]);
    assert_eq!(known("nodes"), [Some(32); 5]);
}

#[test]
fn the_command_in_a_row_computes_its_task_and_the_row_goes() {
    let blocked = Blocked::at("light");
    blocked.run();
    let command = column(&blocked.bench.table("small", "failures"), "command").remove(0);
    let words: Vec<&str> = command.split(' ').collect();
    let again = || blocked.bench.output(&words[1..]);
    assert_eq!(again().status.code(), Some(1), "the obstacle is still there");
    let left = blocked.bench.table("small", "failures");
    assert_eq!(left.rows(), 5, "four tasks have not started");

    fs::remove_dir(&blocked.obstacle).unwrap();
    let output = again();
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("1 task computed"));
    let file = blocked.bench.data().join("results/small/failures.parquet");
    assert!(!file.exists(), "no failure remains");
    assert!(!text(&output.stdout).contains("failures"));

    assert!(blocked.run().status.success());
    assert!(!file.exists());
}

#[test]
fn one_task_is_computed_alone_with_what_it_needs() {
    let undisturbed = Bench::new();
    undisturbed.run(&STUDY);
    let whole = undisturbed.table("small", "area");
    let key = column(&whole, "task").remove(0);
    let bench = Bench::new();
    let done = bench.run_with(&STUDY, &["--only", &key[..12]]);
    let done = ["surfaces", "light", "area", "corrected"].map(|stage| done[stage].computed);
    assert_eq!(done, [1, 1, 1, 0]);
    assert_eq!(column(&bench.table("small", "area"), "task"), vec![key.clone(); 4]);
    let again = bench.run_with(&STUDY, &["--only", &key]);
    assert_eq!(again["area"].computed, 1);
    assert_eq!(again["light"].computed, 0);

    let path = bench.path("study.toml");
    let fresh = Bench::new();
    let printed = fresh.output(&["run", path.to_str().unwrap(), "--only", &key]);
    assert!(text(&printed.stderr).contains("small: 3 tasks to run, 0 finished, 16 left for later"));
    let summary = text(&printed.stdout);
    assert!(summary.contains("4 loads on 1 surface · "), "{summary}");
    assert!(summary.contains("· 3 tasks left for later"), "{summary}");
    for stage in ["law", "curves", "missing"] {
        assert!(!summary.contains(stage), "{stage} in\n{summary}");
    }
    let unknown = "0".repeat(32);
    let output = bench.output(&["run", path.to_str().unwrap(), "--only", &unknown]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("has no task 0000"));
}

#[test]
fn a_load_that_did_not_converge_is_a_row_and_no_error() {
    let bench = Bench::new();
    let hasty = STUDY.replace("[stage.area]", "max_pairs = 1\n\n[stage.area]");
    bench.run(&hasty);
    let light = bench.table("small", "light");
    let stops = column(&light, "stop");
    let given_up = stops.iter().filter(|stop| *stop == "pair-limit").count();
    assert!(given_up > 0);
    let failures = bench.table("small", "failures");
    assert_eq!(stages(&failures, "not-converged"), vec!["light"; given_up]);
    assert_eq!(failures.rows(), given_up);
    let loads = failures.reals("load").unwrap();
    assert_eq!(loads.iter().flatten().count(), given_up);
    assert!(column(&failures, "reason")[0].contains("`max_pairs = 1`"));

    let path = bench.path("study.toml");
    let path = path.to_str().unwrap();
    let printed = bench.output(&["table", path, "failures", "--json"]);
    assert_eq!(text(&printed.stdout).lines().count(), given_up);
    let query = "select count(*) as rows from failures";
    let printed = bench.output(&["table", path, "--sql", query, "--json"]);
    let printed: Value = serde_json::from_slice(&printed.stdout).unwrap();
    assert_eq!(printed["rows"], given_up);

    bench.run(&STUDY);
    assert!(!bench.data().join("results/small/failures.parquet").exists());
    let none = bench.output(&["table", path, "failures", "--json"]);
    assert!(none.status.success() && none.stdout.is_empty());
}

#[test]
fn earlier_failures_that_cannot_be_read_are_no_failure() {
    let blocked = Blocked::at("light");
    let file = blocked.bench.data().join("results/small/failures.parquet");
    blocked.run();
    let sound = fs::read(&file).unwrap();
    let damages: [&[u8]; 3] = [b"no table", &[], &sound[..sound.len() / 2]];
    for bytes in damages {
        fs::write(&file, bytes).unwrap();
        assert_eq!(blocked.run().status.code(), Some(1));
        assert!(fs::read(&file).unwrap() == sound);
    }
    // A table of a stage has different columns.
    fs::copy(file.with_file_name("surfaces.parquet"), &file).unwrap();
    assert_eq!(blocked.run().status.code(), Some(1));
    assert!(fs::read(&file).unwrap() == sound);
}

#[test]
fn no_stage_has_the_name_of_the_table_of_failures() {
    let bench = Bench::new();
    let path = bench.write(&STUDY.replace("stage.curves", "stage.Failures"));
    let output = bench.output(&["check", path.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("cannot be called `Failures`"));
}
