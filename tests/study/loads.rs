//! Loads in the store: a study with other loads or other columns computes only what is new.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;

use asperity::session::{Event, RunOptions, Session};
use asperity::tables::table::Table;
use serde_json::Value;

use crate::bench::{Bench, assert_same_files, is_idle, text};
use crate::manifest::manifest;

/// Two surfaces under the loads that replace `LOADS`, and all that follows from them.
static STUDY: LazyLock<String> = LazyLock::new(|| {
    manifest("loads", "")
        .generate("surfaces", "nodes = 32; hurst = 0.8; k_lower = 2; k_upper = 8; realizations = 2")
        .solve("contact", "loads = LOADS")
        .measure("area", "")
        .correct("corrected", "")
        .aggregate("mean", "over = ['area_corrected']")
        .text()
});

fn with(loads: &str) -> String {
    STUDY.replace("LOADS", loads)
}

/// Adds keys to the `solve` stage of a study.
fn and(study: &str, keys: &str) -> String {
    study.replace("kind = \"solve\"", &format!("kind = \"solve\"\n{keys}"))
}

/// Returns the published tables of a study that is run from nothing with these options.
fn from_nothing(study: &str, options: &[&str]) -> BTreeMap<PathBuf, Vec<u8>> {
    let bench = Bench::new();
    bench.run_with(study, options);
    bench.published("loads")
}

/// Returns the numbers of rows to compute that `explain` states for a stage, and what it says about
/// them.
fn remaining(bench: &Bench, study: &str, stage: &str) -> Vec<(u64, String)> {
    let path = bench.write(study);
    let output = bench.output(&["explain", path.to_str().unwrap(), stage, "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let explained: Value = serde_json::from_slice(&output.stdout).unwrap();
    let reasons = explained["stages"][0]["reasons"].as_array().unwrap();
    let reason = |reason: &Value| {
        let words = reason["remaining"].as_array().unwrap().iter();
        let words: Vec<&str> = words.map(|words| words.as_str().unwrap()).collect();
        (reason["rows"].as_u64().unwrap(), words.join("; "))
    };
    reasons.iter().map(reason).collect()
}

/// Returns the rows of a table under one of these loads.
fn under(table: &Table, loads: &[f64]) -> Table {
    let known = table.reals("load").unwrap().values();
    let rows: Vec<usize> = (0..table.rows()).filter(|&row| loads.contains(&known[row])).collect();
    table.pick(&rows)
}

/// Returns the number of pairs of transforms of all loads in the store.
fn pairs(bench: &Bench) -> i64 {
    bench.table("loads", "contact").integers("pairs").unwrap().iter().flatten().sum()
}

#[test]
fn further_loads_are_the_only_ones_that_are_solved_and_measured() {
    let bench = Bench::new();
    bench.run(&with("[0.05]"));
    let [contact, area] = ["contact", "area"].map(|stage| bench.table("loads", stage));
    let stored = bench.files();
    let more = with("[0.02, 0.05, 0.1]");
    for (stage, words) in [("contact", "4 loads to solve"), ("area", "4 loads to measure")] {
        assert_eq!(remaining(&bench, &more, stage), [(4, words.to_owned())]);
    }
    let counts = bench.run(&more);
    assert_eq!((counts["contact"].computed, counts["area"].computed), (2, 2));
    for (stage, old) in [("contact", contact), ("area", area)] {
        assert_eq!(under(&bench.table("loads", stage), &[0.05]), old);
    }
    for (path, bytes) in stored.iter().filter(|(path, _)| path.starts_with("store")) {
        assert_eq!(bench.files().get(path), Some(bytes), "{}", path.display());
    }
    assert_same_files(&bench.published("loads"), &from_nothing(&more, &[]));
    assert!(bench.run(&more).values().all(is_idle));
}

#[test]
fn fewer_loads_and_loads_of_another_study_solve_nothing() {
    let bench = Bench::new();
    bench.run(&with("[0.02, 0.05, 0.1]"));
    for loads in ["[0.05]", "[0.02, 0.1]"] {
        let study = with(loads);
        let counts = bench.run(&study);
        assert!(is_idle(&counts["contact"]) && is_idle(&counts["area"]));
        assert_same_files(&bench.published("loads"), &from_nothing(&study, &[]));
    }
    let other = with("[0.05, 0.1]").replace("name = \"loads\"", "name = \"other\"");
    let counts = bench.run(&other);
    assert!(is_idle(&counts["contact"]) && is_idle(&counts["area"]));
}

#[test]
fn a_block_that_is_split_into_two_stages_or_merged_solves_nothing() {
    let whole = with("[0.02, 0.05, 0.1]");
    let split = with("[0.02, 0.1]").replace(
        "[stage.area]\nkind = \"measure\"\nfrom = \"contact\"",
        "[stage.middle]\nkind = \"solve\"\nfrom = \"surfaces\"\nloads = [0.05]\n\n\
         [stage.area]\nkind = \"measure\"\nfrom = [\"contact\", \"middle\"]",
    );
    for (first, second) in [(&whole, &split), (&split, &whole)] {
        let bench = Bench::new();
        bench.run(first);
        let counts = bench.run(second);
        let solved = counts.iter().filter(|(name, _)| !["corrected", "mean"].contains(&&***name));
        assert!(solved.map(|(_, count)| count).all(is_idle), "{counts:?}");
        let mut fresh = from_nothing(second, &[]);
        let mut found = bench.published("loads");
        // The table of a stage that is gone stays.
        for files in [&mut fresh, &mut found] {
            files.remove(&PathBuf::from("middle.parquet"));
        }
        assert_same_files(&found, &fresh);
    }
}

#[test]
fn two_stages_with_common_loads_solve_them_once() {
    let both = with("[0.02, 0.05]")
        + "\n[stage.again]\nkind = \"solve\"\nfrom = \"surfaces\"\nloads = [0.05, 0.1]\n";
    let bench = Bench::new();
    bench.run(&both);
    let files = bench.files();
    let keys = bench.table("loads", "again");
    let key = keys.texts("task").unwrap().value(0);
    let of_series = files.keys().filter(|path| path.to_string_lossy().contains(key));
    assert_eq!(of_series.count(), 2, "the loads of the first stage, and the other one");
}

#[test]
fn requested_columns_are_computed_without_the_rows_that_exist() {
    let loads = "[0.05, 0.2]";
    let flow = "flow = true";
    let counts = "pressure_bins = { count = 4, to = 2.0 }\ngap_bins = { count = 4, to = 3.0 }";
    let bench = Bench::new();
    bench.run(&with(loads));
    let rows = bench.table("loads", "contact");

    let kept = and(&with(loads), "pressures = \"all\"");
    let again = "`pressures` of 4 loads, solved again because no pressures are stored";
    assert_eq!(remaining(&bench, &kept, "contact"), [(4, again.to_owned())]);
    let computed = bench.run(&kept);
    assert!(is_idle(&computed["area"]) && is_idle(&computed["corrected"]));
    assert_eq!(bench.table("loads", "contact"), rows);

    let from_stored = and(&with(loads), &format!("{flow}\n{counts}"));
    let [(4, words)] = &remaining(&bench, &from_stored, "contact")[..] else { panic!("four rows") };
    assert!(words.ends_with("of 4 loads, from stored pressures"), "{words}");
    bench.run(&from_stored);
    assert_same_files(&bench.published("loads"), &from_nothing(&from_stored, &[]));
    assert_eq!(bench.table("loads", "contact").names().len(), rows.names().len() + 6);

    // The same columns, computed with the loads.
    let other = Bench::new();
    other.run(&and(&with(loads), &format!("pressures = \"all\"\n{flow}\n{counts}")));
    let [one, two] = [&bench, &other].map(|bench| bench.with_maps("loads", "contact"));
    assert_eq!(one, two);
    assert_eq!(pairs(&bench), pairs(&other));
}

#[test]
fn pressures_under_one_load_solve_this_load_only() {
    let bench = Bench::new();
    bench.run(&with("[0.05, 0.2]"));
    let one = and(&with("[0.05, 0.2]"), "pressures = [0.2]");
    assert_eq!(remaining(&bench, &one, "contact")[0].0, 2);
    bench.run(&one);
    let lists = bench.with_maps("loads", "contact");
    let lists = lists.lists("pressures").unwrap();
    assert_eq!([lists.value(0).len(), lists.value(1).len()], [0, 32 * 32]);
}

#[test]
fn tables_do_not_depend_on_the_number_of_cores() {
    let study = and(&with("{ to = 0.4, steps = 9 }"), "gap_bins = { count = 4, to = 3.0 }");
    let alone = from_nothing(&study, &["--jobs", "1"]);
    for jobs in ["2", "3", "8"] {
        assert_same_files(&from_nothing(&study, &["--jobs", jobs]), &alone);
    }
}

/// Runs until the progress of a task, from 0 to 1, reaches `most`.
fn run_until(bench: &Bench, study: &str, most: f64) {
    let stop = AtomicBool::new(false);
    let on_event = |event: Event| {
        if let Event::Advanced(_, share) = event {
            stop.store(share >= most, Ordering::SeqCst);
        }
    };
    let session = Session::new(bench.write(study), bench.data()).observed_by(&on_event);
    let mut options = RunOptions::default();
    options.jobs = NonZeroUsize::new(1);
    session.run(&options, &stop).unwrap();
}

#[test]
fn an_interrupted_surface_keeps_its_finished_loads() {
    let study = with("{ to = 0.4, steps = 40 }").replace("realizations = 2", "realizations = 1");
    let bench = Bench::new();
    let mut left = 40;
    for most in [0.1, 0.3, 0.6] {
        run_until(&bench, &study, most);
        let [(now, _)] = remaining(&bench, &study, "contact")[..] else { panic!("one task") };
        assert!(now < left, "{now} of {left} loads are left");
        left = now;
    }
    run_until(&bench, &study, 2.0);
    assert_same_files(&bench.published("loads"), &from_nothing(&study, &[]));
}

#[test]
fn a_killed_process_loses_only_the_loads_that_it_has_not_stored() {
    let study = with("{ to = 0.4, steps = 40 }");
    let study = study.replace("realizations = 2", "realizations = 1").replace("= 32", "= 256");
    let bench = Bench::new();
    let manifest = bench.write(&study);
    let arguments = ["run", manifest.to_str().unwrap(), "--checkpoint-every", "0"];
    let mut run = bench.asperity(&arguments);
    let mut run = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let rows = |bench: &Bench| bench.files().keys().filter(|path| is_of_rows(path)).count();
    while rows(&bench) == 0 {
        sleep(Duration::from_millis(5));
    }
    run.kill().unwrap();
    run.wait().unwrap();
    let [(left, _)] = remaining(&bench, &study, "contact")[..] else { panic!("one task") };
    assert!(left < 40, "{left} loads");
    run_until(&bench, &study, 2.0);
    assert_same_files(&bench.published("loads"), &from_nothing(&study, &[]));
}

/// Returns whether a path is that of a file with rows of a series.
fn is_of_rows(path: &Path) -> bool {
    path.to_string_lossy().contains('-') && path.extension().is_some_and(|end| end == "parquet")
}

#[test]
fn a_damaged_file_of_rows_is_computed_again() {
    let bench = Bench::new();
    let study = with("[0.05]").replace("realizations = 2", "realizations = 1");
    let more = study.replace("[0.05]", "[0.05, 0.1]");
    bench.run(&study);
    bench.run(&more);
    let paths: Vec<PathBuf> = bench.files().into_keys().filter(|path| is_of_rows(path)).collect();
    for path in paths {
        let path = bench.data().join(path);
        let mut bytes = std::fs::read(&path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(&path, bytes).unwrap();
        std::fs::remove_dir_all(bench.data().join("results")).unwrap();
        bench.run(&more);
        assert_same_files(&bench.published("loads"), &from_nothing(&more, &[]));
    }
}

#[test]
fn pruning_removes_the_files_of_loads_that_no_study_has() {
    let bench = Bench::new();
    bench.run(&with("[0.05]"));
    bench.run(&with("[0.05, 0.1]"));
    let manifest = bench.write(&with("[0.05]"));
    bench.run(&with("[0.05]"));
    let rows = |bench: &Bench| bench.files().into_keys().filter(|path| is_of_rows(path)).count();
    assert_eq!(rows(&bench), 8);
    let output = bench.output(&["prune", manifest.to_str().unwrap(), "--yes"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(rows(&bench), 4);
    assert!(bench.run(&with("[0.05]")).values().all(is_idle));
}
