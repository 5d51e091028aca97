//! Output of `asperity table`.

use std::io::Read;
use std::process::Stdio;

use serde_json::Value;

use crate::bench::{Bench, STUDY, text};

/// Returns the standard output of `table`.
fn table(bench: &Bench, arguments: &[&str]) -> String {
    let path = bench.path("study.toml");
    let all = [&["table", path.to_str().unwrap()], arguments].concat();
    let output = bench.output(&all);
    assert!(output.status.success(), "{}", text(&output.stderr));
    text(&output.stdout)
}

/// Returns the standard error of `table`, which must end with `code`.
fn refusal(bench: &Bench, arguments: &[&str], code: i32) -> String {
    let path = bench.path("study.toml");
    let all = [&["table", path.to_str().unwrap()], arguments].concat();
    let output = bench.output(&all);
    assert_eq!(output.status.code(), Some(code), "{}", text(&output.stderr));
    text(&output.stderr)
}

#[test]
fn json_and_csv_give_every_row_to_the_last_digit() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let stored = bench.table("small", "area");
    let loads = stored.reals("load").unwrap();
    let json = table(&bench, &["area", "--json"]);
    let csv = table(&bench, &["area", "--csv", "--columns", "stop,load"]);
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("stop,load"));
    assert_eq!(json.lines().count(), stored.rows());
    for ((row, line), stored) in json.lines().zip(lines).zip(loads.values()) {
        let row: Value = serde_json::from_str(row).unwrap();
        assert_eq!(row["load"].as_f64(), Some(*stored));
        let (stop, load) = line.split_once(',').unwrap();
        assert_eq!(stop, row["stop"]);
        assert_eq!(load.parse(), Ok(*stored));
    }
}

#[test]
fn booleans_in_csv_are_words_that_r_and_spreadsheets_read() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let query = "select distinct load > 0.06 as heavy from area order by heavy";
    assert_eq!(table(&bench, &["--csv", "--sql", query]), "heavy\nFALSE\nTRUE\n");
}

#[test]
fn a_table_for_reading_says_what_it_leaves_out() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let printed = table(&bench, &["area", "--rows", "3"]);
    for part in ["in every row: method filter", "k_upper", "… 13 more rows", "more columns"] {
        assert!(printed.contains(part), "{part} in\n{printed}");
    }
    let asked = table(&bench, &["area", "--columns", "nodes,load", "--rows", "0"]);
    assert_eq!(asked.lines().count(), 1 + 16, "{asked}");
}

#[test]
fn a_query_joins_the_tables_of_all_stages() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let query = "select a.load, a.area_fraction * a.nodes * a.nodes - c.contact_nodes as difference \
                 from area a join light c using (surface, load)";
    let answer = table(&bench, &["--sql", query, "--json"]);
    assert_eq!(answer.lines().count(), 16);
    for row in answer.lines() {
        let row: Value = serde_json::from_str(row).unwrap();
        assert_eq!(row["difference"], 0.0);
    }
}

#[test]
fn what_is_not_there_is_named_with_what_is() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let stage = refusal(&bench, &["aera"], 2);
    assert!(stage.contains("did you mean `area`?"), "{stage}");
    assert!(stage.contains("`corrected`"), "{stage}");
    let table = refusal(&bench, &["--sql", "select * from aera"], 2);
    assert!(table.contains("did you mean `area`?"), "{table}");
    let column = refusal(&bench, &["--sql", "select area_fractoin from area"], 2);
    assert!(column.contains("did you mean `area_fraction`?"), "{column}");
    assert!(column.contains("`switches`"), "{column}");
    let chosen = refusal(&bench, &["area", "--columns", "laod"], 2);
    assert!(chosen.contains("did you mean `load`?"), "{chosen}");
    let verb = refusal(&bench, &["--sql", "drop table area"], 2);
    assert!(verb.contains("starts with `select`"), "{verb}");
}

#[test]
fn errors_of_a_query_list_only_its_own_tables() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let column = refusal(&bench, &["--sql", "select clusters from surfaces"], 2);
    assert!(column.contains("there is no column `clusters`"), "{column}");
    assert!(column.contains("`nayak`"), "{column}");
    assert!(!column.contains("`area_fraction`"), "{column}");
    let query = "select s.clusters from surfaces s join area a using (surface)";
    let of_a_table = refusal(&bench, &["--sql", query], 2);
    assert!(of_a_table.contains("`s` has no column `clusters`"), "{of_a_table}");
    assert!(!of_a_table.contains("`area_fraction`"), "{of_a_table}");
}

#[test]
fn a_deep_query_is_answered_and_a_deeper_one_refused() {
    let bench = Bench::new();
    let sum = |terms: usize| format!("select {} as s from area", vec!["load"; terms].join(" + "));
    bench.run(&STUDY);
    let answer = table(&bench, &["--sql", &sum(200), "--json"]);
    assert_eq!(answer.lines().count(), 16);
    let refused = refusal(&bench, &["--sql", &sum(3000)], 2);
    assert!(refused.contains("nests more than"), "{refused}");
    let stage =
        format!("[stage.deep]\nkind = \"aggregate\"\nfrom = \"area\"\nsql = \"{}\"", sum(3000));
    let path = bench.write(&format!("{}\n{stage}", *STUDY));
    let output = bench.output(&["check", path.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    let printed = text(&output.stderr);
    assert!(printed.contains("nests more than"), "{printed}");
}

#[test]
fn a_panic_of_polars_becomes_an_error() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let query = "select greatest() as g from area";
    let printed = refusal(&bench, &["--sql", query], 2);
    assert!(printed.starts_with("error: polars cannot answer this query"), "{printed}");
    assert!(!printed.contains("panicked"), "{printed}");
}

#[test]
fn what_is_not_computed_names_the_command_that_computes_it() {
    let bench = Bench::new();
    bench.write(&STUDY);
    for arguments in [&["area"] as &[&str], &["--sql", "select * from area"]] {
        let printed = refusal(&bench, arguments, 1);
        assert!(printed.contains("`area` has no results"), "{printed}");
        assert!(printed.contains("asperity run "), "{printed}");
    }
    assert!(!bench.data().exists());
}

#[test]
fn a_table_follows_its_manifest_and_says_what_is_missing() {
    let bench = Bench::new();
    bench.run(&STUDY);
    // Two surfaces per spectrum exist, and the manifest requests a third.
    let path = bench.write(&STUDY.replace("realizations = 2", "realizations = 3"));
    let output = bench.output(&["table", path.to_str().unwrap(), "area", "--json"]);
    assert_eq!(text(&output.stdout).lines().count(), 16);
    let printed = text(&output.stderr);
    assert!(printed.contains("4 of 6 tasks"), "{printed}");
    // The manifest has one surface less than the table on disk.
    bench.write(&STUDY.replace("realizations = 2", "realizations = 1"));
    assert_eq!(table(&bench, &["area", "--json"]).lines().count(), 8);
}

#[test]
fn a_reader_that_leaves_early_is_no_failure() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let path = bench.path("study.toml");
    for format in ["--csv", "--json", "--rows=0"] {
        let mut child = bench
            .asperity(&["table", path.to_str().unwrap(), "area", format])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let mut printed = String::new();
        child.stderr.take().unwrap().read_to_string(&mut printed).unwrap();
        assert!(child.wait().unwrap().success(), "{format}: {printed}");
        assert_eq!(printed, "", "{format}");
    }
}
