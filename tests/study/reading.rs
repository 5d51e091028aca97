//! Reading commands need no store and write nothing.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use serde_json::Value;

use crate::bench::{Bench, STUDY, assert_same_files, text};

/// Runs a command on the manifest of the bench; returns its exit code and output.
fn command(bench: &Bench, command: &str, arguments: &[&str]) -> (Option<i32>, String, String) {
    let manifest = bench.path("study.toml");
    let all = [&[command, manifest.to_str().unwrap()], arguments].concat();
    let output = bench.output(&all);
    let [out, err] = [&output.stdout, &output.stderr].map(|bytes| text(bytes));
    (output.status.code(), out, err)
}

/// Returns the outputs of all reading commands.
fn all_that_is_read(bench: &Bench) -> Vec<(Option<i32>, String, String)> {
    let query = "select count(*) as n from area join law using (k_upper)";
    let commands: [(&str, &[&str]); 6] = [
        ("table", &["area", "--json"]),
        ("table", &["law", "--csv"]),
        ("table", &["--sql", query, "--json"]),
        ("table", &["failures", "--json"]),
        ("columns", &["--json"]),
        ("claims", &["--json"]),
    ];
    commands.map(|(name, arguments)| command(bench, name, arguments)).into()
}

fn rows(bench: &Bench, stage: &str) -> (usize, String) {
    let (code, out, err) = command(bench, "table", &[stage, "--json"]);
    assert_eq!(code, Some(0), "{err}");
    (out.lines().count(), err)
}

/// Returns the results without columns and metadata about their origin.
fn results(bench: &Bench) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = bench.files();
    files.retain(|path, _| path.starts_with("results"));
    files
}

fn remove(bench: &Bench, name: &str) {
    fs::remove_dir_all(bench.data().join(name)).unwrap();
}

#[test]
fn reading_commands_work_without_the_store_and_change_no_results() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let with_store = all_that_is_read(&bench);
    assert!(with_store.iter().all(|(code, ..)| *code == Some(0)), "{with_store:?}");
    remove(&bench, "store");
    remove(&bench, "plans");
    let before = bench.files();
    assert_eq!(all_that_is_read(&bench), with_store);
    assert_same_files(&bench.files(), &before);
}

#[test]
fn a_study_whose_run_was_killed_before_its_tables_is_read_from_its_store_and_nothing_is_written() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let finished = all_that_is_read(&bench);
    remove(&bench, "results");
    fs::remove_file(bench.data().join("store/lock")).unwrap();
    let before = bench.files();
    assert_eq!(all_that_is_read(&bench), finished);
    assert_same_files(&bench.files(), &before);
}

#[test]
fn each_task_is_read_from_where_it_is() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let whole = rows(&bench, "area").0;
    let tasks = bench.table("small", "area");
    let tasks = tasks.texts("task").unwrap();
    let stored = |row: usize| bench.file_of(tasks.value(row));
    // One task exists only in the published table, others only in the store …
    bench.run(&STUDY.replace("realizations = 2", "realizations = 1"));
    fs::remove_file(stored(0)).unwrap();
    // … and the manifest requests a third surface.
    bench.write(&STUDY.replace("realizations = 2", "realizations = 3"));
    let (read, printed) = rows(&bench, "area");
    assert_eq!(read, whole);
    assert!(printed.contains("4 of 6 tasks"), "{printed}");
}

#[test]
fn results_alone_say_how_many_surfaces_were_drawn() {
    let bench = Bench::new();
    let until = "{ at_least = 3, at_most = 200, until = \"sem(area.area_fraction) < 4 %\" }";
    let growing = STUDY.replace("realizations = 2", &format!("realizations = {until}"));
    bench.run(&growing);
    let whole = rows(&bench, "surfaces");
    assert!(whole.0 > 6, "more than at least");
    remove(&bench, "store");
    assert_eq!(rows(&bench, "surfaces"), whole);
    assert_eq!(rows(&bench, "law").1, "");
}

#[test]
fn a_run_without_its_store_takes_no_rows_away() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = results(&bench);
    let key = bench.table("small", "area").texts("task").unwrap().value(0).to_owned();
    remove(&bench, "store");
    let done = bench.run_with(&STUDY, &["--only", &key]);
    assert_eq!(done["area"].computed, 1);
    assert!(results(&bench) == before);

    // One task is new; of the others only published rows exist.
    let larger = STUDY.replace("realizations = 2", "realizations = 3");
    let surfaces = bench.plan(&larger)["surfaces"];
    assert_eq!(surfaces.to_run, 5);
    bench.run(&larger);
    let whole = results(&bench);
    let area = bench.table("small", "area");
    let newest =
        (0..area.rows()).find(|&row| area.integers("realization").unwrap().value(row) == 2);
    let newest = area.texts("task").unwrap().value(newest.unwrap()).to_owned();
    bench.run(&STUDY);
    remove(&bench, "store");
    bench.run_with(&larger, &["--only", &newest]);
    assert_eq!(bench.table("small", "area").rows(), 20, "16 kept, and 4 of the new one");
    bench.run(&larger);
    assert!(results(&bench) == whole);
}

#[test]
fn what_is_nowhere_is_not_computed_and_what_is_damaged_is_named() {
    let bench = Bench::new();
    bench.run(&STUDY);
    remove(&bench, "store");
    let area = bench.data().join("results/small/area.parquet");
    fs::write(&area, "no table").unwrap();
    let (code, _, printed) = command(&bench, "table", &["area"]);
    assert_eq!(code, Some(1));
    assert!(printed.contains("area.parquet` is damaged"), "{printed}");
    fs::remove_file(&area).unwrap();
    let (code, _, printed) = command(&bench, "table", &["area"]);
    assert_eq!(code, Some(1));
    assert!(printed.contains("`area` has no results"), "{printed}");
}

#[test]
fn a_map_is_drawn_where_it_is_and_otherwise_the_command_is_named_that_brings_it_back() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let picture = bench.path("view.png");
    let arguments = ["light", "k_upper=4", "realization=0", "--output"];
    let arguments = [&arguments[..], &[picture.to_str().unwrap()]].concat();
    assert_eq!(command(&bench, "view", &arguments).0, Some(0));
    remove(&bench, "store");
    fs::remove_file(&picture).unwrap();
    let (code, _, printed) = command(&bench, "view", &arguments);
    assert_eq!(code, Some(1));
    assert!(printed.contains("has no maps of task"), "{printed}");
    assert!(printed.contains("asperity run "), "{printed}");
    assert!(!picture.exists());
}

/// Writes a rough map of 32 × 32 nodes as a NumPy file.
fn npy() -> Vec<u8> {
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (32, 32), }";
    let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    bytes.extend(format!("{header:117}\n").bytes());
    let heights = (0..32 * 32).map(|node: u64| (node * node % 37) as f64);
    bytes.extend(heights.flat_map(f64::to_le_bytes));
    bytes
}

fn measured() -> String {
    let surfaces = STUDY.split("[stage.surfaces]").next().unwrap();
    let rest = &STUDY[STUDY.find("[stage.light]").unwrap()..STUDY.find("[stage.law]").unwrap()];
    let file =
        "kind = \"generate\"\nmethod = \"file\"\npath = \"map.npy\"\nside = 1.0\nperiodic = true";
    format!("{surfaces}[stage.surfaces]\n{file}\n\n{rest}")
}

#[test]
fn a_surface_whose_file_is_gone_is_the_one_that_the_tables_are_of() {
    let bench = Bench::new();
    fs::write(bench.path("map.npy"), npy()).unwrap();
    bench.run(&measured());
    let whole = rows(&bench, "corrected");
    assert_eq!(whole.1, "");
    remove(&bench, "store");
    fs::remove_file(bench.path("map.npy")).unwrap();
    let (read, printed) = rows(&bench, "corrected");
    assert_eq!(read, whole.0);
    assert!(printed.contains("surface file `map.npy` cannot be read"), "{printed}");
    for name in ["columns", "claims", "report"] {
        let elsewhere = bench.path("elsewhere");
        let output = ["--output", elsewhere.to_str().unwrap()];
        let output = &output[..if name == "report" { 2 } else { 0 }];
        let (code, _, printed) = command(&bench, name, output);
        assert_eq!(code, Some(0), "{name}: {printed}");
    }
    // A run needs the file.
    let (code, _, printed) = command(&bench, "run", &[]);
    assert_eq!(code, Some(2));
    assert!(printed.contains("map.npy"), "{printed}");
    // A file that was never read has no recorded content.
    bench.write(&measured().replace("map.npy", "other.npy"));
    assert_eq!(command(&bench, "table", &["corrected"]).0, Some(2));
}

fn figures(said: &str) -> Vec<Value> {
    let said: Value = serde_json::from_str(said).unwrap();
    said["drawn"].as_array().unwrap().clone()
}

#[test]
fn a_report_elsewhere_replaces_an_earlier_one_of_the_study_and_other_files_only_if_asked() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let folder = bench.path("paper");
    let (page, figure) = (folder.join("report.html"), folder.join("figures/contact-maps.png"));
    let report = |options: &[&str]| {
        let output = ["--output", folder.to_str().unwrap()];
        let (code, _, printed) = command(&bench, "report", &[&output, options].concat());
        (code, printed)
    };
    fs::create_dir_all(folder.join("figures")).unwrap();
    fs::write(&figure, "mine").unwrap();
    let (code, printed) = report(&[]);
    assert_eq!(code, Some(2), "{printed}");
    assert!(printed.contains("figures` is not part of a report"), "{printed}");
    assert_eq!(fs::read(&figure).unwrap(), b"mine");
    assert!(!page.exists());
    assert_eq!(report(&["--replace"]).0, Some(0));
    assert_eq!(report(&[]).0, Some(0), "its own unedited page");

    // An edited page, and a page of another study.
    let written = fs::read_to_string(&page).unwrap();
    let other = written.replace("\"study\":\"small\"", "\"study\":\"other\"");
    assert_ne!(other, written);
    for changed in [written.replace("</html>", "<p>mine</html>"), other] {
        fs::write(&page, &changed).unwrap();
        assert_eq!(report(&[]).0, Some(2));
        assert_eq!(fs::read_to_string(&page).unwrap(), changed);
        assert_eq!(report(&["--replace"]).0, Some(0));
    }
    fs::write(&page, "<html>mine</html>").unwrap();
    let (code, printed) = report(&["--replace"]);
    assert_eq!(code, Some(2));
    assert!(printed.contains("was not written by `asperity report`"), "{printed}");
    assert_eq!(fs::read_to_string(&page).unwrap(), "<html>mine</html>");
}

#[test]
fn a_report_without_the_store_lacks_the_maps_only() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let (_, said, _) = command(&bench, "report", &["--json"]);
    let all = figures(&said);
    assert!(all.contains(&"Contact maps".into()));
    let whole = results(&bench);
    remove(&bench, "store");
    let before = bench.files();
    let elsewhere = bench.path("elsewhere");
    let output = ["--json", "--output", elsewhere.to_str().unwrap()];
    let (code, said, printed) = command(&bench, "report", &output);
    assert_eq!(code, Some(0), "{printed}");
    assert_eq!(figures(&said).len(), all.len() - 1);
    assert_same_files(&bench.files(), &before);
    let page = fs::read_to_string(elsewhere.join("report.html")).unwrap();
    assert!(page.contains("which are no longer in the store"));
    let table = elsewhere.join("../data/results/small/area.parquet");
    assert!(
        table.exists() && page.contains("..&#x2f;data&#x2f;results&#x2f;small&#x2f;area.parquet")
    );
    for (path, bytes) in results(&bench) {
        if let Ok(figure) = path.strip_prefix("results/small/figures")
            && !figure.starts_with("contact-maps.svg")
            && !figure.starts_with("contact-maps.png")
            && !figure.starts_with("contact-maps.pdf")
        {
            assert!(fs::read(elsewhere.join("figures").join(figure)).unwrap() == bytes);
        }
    }
    let (code, said, _) = command(&bench, "report", &["--json"]);
    assert_eq!((code, figures(&said).len()), (Some(0), all.len() - 1));
    let maps = bench.data().join("results/small/figures/contact-maps.svg");
    assert!(!maps.exists());
    bench.run(&STUDY);
    assert_eq!(command(&bench, "report", &[]).0, Some(0));
    assert!(results(&bench) == whole);
}
