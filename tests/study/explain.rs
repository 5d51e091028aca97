//! Reasons for running tasks, as `asperity explain` gives them after each kind of edit.

use std::fs;

use serde_json::Value;

use crate::bench::{Bench, STUDY, assert_same_files, is_idle};

/// Returns a bench on which the small study has run.
fn finished() -> Bench {
    let bench = Bench::new();
    bench.run(&STUDY);
    bench
}

fn explain(bench: &Bench, manifest: &str) -> Value {
    let path = bench.write(manifest);
    let output = bench.output(&["explain", path.to_str().unwrap(), "--json"]);
    let printed = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{printed}");
    serde_json::from_slice(&output.stdout).expect("the command prints JSON")
}

/// Formats every reason of a stage as `TASKS STAGE WHY FIELDS`.
fn reasons(explained: &Value, stage: &str) -> Vec<String> {
    let stages = explained["stages"].as_array().unwrap();
    let stage = stages.iter().find(|other| other["name"] == stage).unwrap();
    let printed = |reason: &Value| {
        let causes = reason["causes"].as_array().unwrap().iter();
        let causes: Vec<_> = causes.map(cause).collect();
        format!("{} {}", reason["tasks"], causes.join(" + "))
    };
    stage["reasons"].as_array().unwrap().iter().map(printed).collect()
}

fn cause(cause: &Value) -> String {
    let text = |value: &Value| value.as_str().unwrap_or("–").to_owned();
    let field = |field: &Value| match field.get("value") {
        Some(value) => format!(" {}={}", text(&field["field"]), text(value)),
        None => {
            format!(" {}:{}→{}", text(&field["field"]), text(&field["old"]), text(&field["new"]))
        }
    };
    let fields = cause["fields"].as_array();
    let fields: String = fields.into_iter().flatten().map(field).collect();
    let name = cause.get("name").map_or(String::new(), |name| format!(" {}", text(name)));
    format!("{} {}{fields}{name}", text(&cause["stage"]), text(&cause["why"]))
}

const STAGES: [&str; 6] = ["surfaces", "light", "area", "corrected", "law", "curves"];

fn assert_all(explained: &Value, stages: &[&str], expected: &[&str]) {
    for stage in stages {
        assert_eq!(reasons(explained, stage), expected, "{stage}");
    }
}

#[test]
fn a_study_that_never_ran_says_so() {
    let explained = explain(&Bench::new(), &STUDY);
    assert_eq!(reasons(&explained, "surfaces"), ["4 surfaces first-run"]);
    assert_eq!(reasons(&explained, "curves"), ["1 curves first-run"]);
}

#[test]
fn without_its_record_a_study_has_no_known_earlier_run() {
    let bench = finished();
    fs::remove_file(bench.path("data/plans/small.json")).unwrap();
    let path = bench.write(&STUDY.replace("hurst = 0.8", "hurst = 0.7"));
    let output = bench.output(&["explain", path.to_str().unwrap()]);
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(printed.contains("no record of an earlier run"), "{printed}");
}

#[test]
fn cosmetic_edits_leave_nothing_to_do() {
    let bench = finished();
    let cosmetic = format!("# A comment.\n{}", STUDY.replace("hurst = 0.8", "hurst = 0.80"));
    let path = bench.write(&cosmetic);
    for command in ["explain", "plan"] {
        let output = bench.output(&[command, path.to_str().unwrap()]);
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(printed.ends_with("nothing to do\n"), "{printed}");
    }
}

#[test]
fn more_realizations_are_new_and_reach_what_pools_them() {
    let bench = finished();
    let explained = explain(&bench, &STUDY.replace("realizations = 2", "realizations = 4"));
    let new = "surfaces new realization=2 … 3";
    assert_all(&explained, &["surfaces", "light", "area", "corrected"], &[&format!("4 {new}")]);
    assert_eq!(reasons(&explained, "law"), [format!("2 {new}")]);
    assert_eq!(reasons(&explained, "curves"), [format!("1 {new}")]);
}

#[test]
fn fewer_realizations_are_missed_by_what_pools_them() {
    let bench = finished();
    let explained = explain(&bench, &STUDY.replace("realizations = 2", "realizations = 1"));
    assert_all(&explained, &["surfaces", "light", "area", "corrected"], &[]);
    let fewer = "surfaces fewer realization=1";
    assert_eq!(reasons(&explained, "law"), [format!("2 {fewer}")]);
    assert_eq!(reasons(&explained, "curves"), [format!("1 {fewer}")]);
}

#[test]
fn a_new_point_is_reported_by_its_coordinate() {
    let bench = finished();
    let explained = explain(&bench, &STUDY.replace("[4, 8]", "[4, 6, 8]"));
    assert_all(
        &explained,
        &["surfaces", "light", "area", "corrected"],
        &["2 surfaces new k_upper=6"],
    );
    assert_eq!(reasons(&explained, "law"), ["1 surfaces new k_upper=6"]);
}

#[test]
fn a_point_less_is_missed_by_what_pools_all() {
    let bench = finished();
    let explained = explain(&bench, &STUDY.replace("[4, 8]", "[8]"));
    assert_eq!(reasons(&explained, "law"), [""; 0]);
    assert_eq!(reasons(&explained, "curves"), ["1 surfaces fewer k_upper=4"]);
}

#[test]
fn points_in_another_order_are_noticed_by_what_pools_all() {
    let bench = finished();
    let explained = explain(&bench, &STUDY.replace("[4, 8]", "[8, 4]"));
    assert_eq!(reasons(&explained, "curves"), ["1 surfaces reordered"]);
}

#[test]
fn a_changed_parameter_is_reported_with_its_old_and_new_value() {
    let bench = finished();
    let explained = explain(&bench, &STUDY.replace("hurst = 0.8", "hurst = 0.7"));
    assert_all(
        &explained,
        &["surfaces", "light", "area", "corrected"],
        &["4 surfaces changed hurst:0.8→0.7"],
    );
    let explained = explain(&bench, &STUDY.replace("steps = 4", "steps = 4, from = 0.02"));
    assert_all(&explained, &["surfaces"], &[]);
    let printed = reasons(&explained, "light");
    assert!(printed[0].starts_with("4 light changed loads:0.025, "), "{printed:?}");
    assert_eq!(reasons(&explained, "area"), printed);
}

#[test]
fn edits_of_two_stages_are_reported_together() {
    let bench = finished();
    let edited =
        STUDY.replace("hurst = 0.8", "hurst = 0.7").replace(r#"["mean", "sd"]"#, r#"["mean"]"#);
    let explained = explain(&bench, &edited);
    assert_eq!(
        reasons(&explained, "curves"),
        ["1 surfaces changed hurst:0.8→0.7 + curves changed statistics:mean, sd→mean"]
    );
}

#[test]
fn keeping_more_of_a_surface_reaches_no_later_stage() {
    let bench = finished();
    let kept = STUDY.replace("hurst = 0.8", "hurst = 0.8\nheights = \"redraw\"");
    let explained = explain(&bench, &kept);
    assert_eq!(reasons(&explained, "surfaces"), ["4 surfaces changed heights:keep→redraw"]);
    assert_all(&explained, &["light", "area", "law", "curves"], &[]);
}

#[test]
fn a_new_stage_is_reported_for_all_later_stages() {
    let bench = finished();
    let extended = STUDY.replace(
        "[stage.area]\nkind = \"measure\"\nfrom = \"light\"",
        "[stage.heavy]\nkind = \"solve\"\nfrom = \"surfaces\"\nloads = [0.3]\n\
         [stage.area]\nkind = \"measure\"\nfrom = [\"light\", \"heavy\"]",
    );
    let explained = explain(&bench, &extended);
    assert_all(&explained, &["heavy", "area"], &["4 heavy new-stage"]);
    assert_eq!(reasons(&explained, "curves"), ["1 heavy new-stage"]);
}

#[test]
fn a_removed_input_is_reported() {
    let bench = finished();
    let reading = |names: &str| {
        let heavy = "[stage.heavy]\nkind = \"solve\"\nfrom = \"surfaces\"\nloads = [0.3]\n";
        let area = "[stage.area]\nkind = \"measure\"\nfrom = ";
        STUDY.replace(&format!("{area}\"light\""), &format!("{heavy}{area}{names}"))
    };
    bench.run(&reading("[\"light\", \"heavy\"]"));
    let explained = explain(&bench, &reading("\"heavy\""));
    assert_eq!(reasons(&explained, "curves"), ["1 area reads-less light"]);
    bench.run(&reading("\"heavy\""));
    fs::remove_dir_all(bench.path("data/store")).unwrap();
    let explained = explain(&bench, &reading("[\"light\", \"heavy\"]"));
    assert_eq!(reasons(&explained, "area"), ["4 area reads-more light", "4 area missing"]);
}

#[test]
fn a_renamed_stage_is_still_known() {
    let bench = finished();
    let renamed = STUDY
        .replace("stage.light", "stage.pressed")
        .replace("from = \"light\"", "from = \"pressed\"")
        .replace("hurst = 0.8", "hurst = 0.7");
    let explained = explain(&bench, &renamed);
    assert_all(&explained, &["pressed", "area"], &["4 surfaces changed hurst:0.8→0.7"]);
}

#[test]
fn missing_damaged_and_uncomputed_tables_have_different_reasons() {
    let bench = finished();
    let task = |row: usize| {
        let tasks = bench.table("small", "corrected");
        tasks.texts("task").unwrap().value(8 * row).to_owned()
    };
    let (gone, damaged) = (bench.file_of(&task(0)), bench.file_of(&task(1)));
    fs::remove_file(&gone).unwrap();
    fs::rename(&damaged, damaged.with_extension("parquet.damaged")).unwrap();
    let explained = explain(&bench, &STUDY);
    assert_eq!(reasons(&explained, "corrected"), ["1 corrected missing", "1 corrected damaged"]);
    assert_all(&explained, &["law", "curves"], &[]);

    // The record of a run that was killed.
    let record = bench.path("data/plans/small.json");
    let text = fs::read_to_string(&record).unwrap();
    fs::write(&record, text.replace("\"finished\":4", "\"finished\":2")).unwrap();
    let explained = explain(&bench, &STUDY);
    assert_eq!(reasons(&explained, "corrected")[0], "1 corrected unfinished");
}

#[test]
fn another_version_of_a_stage_is_reported() {
    let bench = finished();
    let record = bench.path("data/plans/small.json");
    let text = fs::read_to_string(&record).unwrap();
    let mut json: Value = serde_json::from_str(&text).unwrap();
    json["stages"][1]["version"] = Value::from(0);
    fs::write(&record, json.to_string()).unwrap();
    fs::remove_dir_all(bench.path("data/store")).unwrap();
    let explained = explain(&bench, &STUDY);
    assert_eq!(reasons(&explained, "surfaces"), ["4 surfaces missing"]);
    assert_all(&explained, &["light", "area"], &["4 light version"]);
    assert_eq!(reasons(&explained, "curves"), ["1 light version"]);
}

#[test]
fn a_record_that_cannot_be_read_costs_explanations_only() {
    let bench = finished();
    fs::write(bench.path("data/plans/small.json"), "nonsense").unwrap();
    assert!(bench.run(&STUDY).values().all(is_idle));
    let explained = explain(&bench, &STUDY.replace("hurst = 0.8", "hurst = 0.7"));
    assert_eq!(reasons(&explained, "surfaces"), ["4 surfaces changed hurst:0.8→0.7"]);
}

#[test]
fn looking_changes_no_reason_and_running_does() {
    let bench = finished();
    let edited = STUDY.replace("hurst = 0.8", "hurst = 0.7");
    let before = bench.files();
    let changed = ["4 surfaces changed hurst:0.8→0.7"];
    assert_all(&explain(&bench, &edited), &STAGES[..4], &changed);
    bench.plan(&edited);
    assert_all(&explain(&bench, &edited), &STAGES[..4], &changed);
    assert_same_files(&bench.files(), &before);
    bench.run(&edited);
    // After undoing the edit, all results exist.
    let back = explain(&bench, &STUDY);
    assert_all(&back, &STAGES, &[]);
}

#[test]
fn one_stage_can_be_asked_for_and_a_wrong_name_is_met_with_the_right_one() {
    let bench = finished();
    let path = bench.write(&STUDY.replace("hurst = 0.8", "hurst = 0.7"));
    let manifest = path.to_str().unwrap();
    let one = bench.output(&["explain", manifest, "area"]);
    let printed = String::from_utf8_lossy(&one.stdout).into_owned();
    assert!(
        printed.contains("4 tasks, 16 loads to measure: earlier stage `surfaces`: hurst 0.8 → 0.7"),
        "{printed}"
    );
    assert!(!printed.contains("light"), "{printed}");
    let wrong = bench.output(&["explain", manifest, "aera"]);
    assert_eq!(wrong.status.code(), Some(2));
    let printed = String::from_utf8_lossy(&wrong.stderr).into_owned();
    assert!(printed.contains("did you mean `area`?"), "{printed}");
}
