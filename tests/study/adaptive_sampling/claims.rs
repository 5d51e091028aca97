//! Adaptive sampling until claims are decided.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Stdio;
use std::thread;
use std::time::Duration;

use serde_json::Value;

use super::planned;
use crate::bench::{Bench, assert_same_files, is_idle, text};
use crate::manifest::manifest;

/// Study of two spectra at the loads of the claims, with a fit and means.
fn study(realizations: &str) -> String {
    manifest("decided", "seed = 5; claims = 'yastrebov-2015'")
        .generate(
            "surfaces",
            &format!(
                "nodes = 64; hurst = 0.8; k_lower = [2, 4]; k_upper = 8; \
                 realizations = {realizations}"
            ),
        )
        .solve("contact", "loads = [0.012, 0.024, 0.06]")
        .measure("area", "")
        .correct("corrected", "correction = '2017'")
        .fit("law", "from = 'area'; bootstrap = 20")
        .aggregate("means", "from = 'area'; over = ['area_fraction']; statistics = ['mean']")
        .text()
}

fn until(condition: &str, [at_least, at_most]: [u32; 2]) -> String {
    study(&format!("{{ at_least = {at_least}, at_most = {at_most}, until = \"{condition}\" }}"))
}

const GROWS: &str = "decided(area-grows-with-k-lower)";

/// Returns the verdict on a claim and its number of surfaces.
fn verdict(bench: &Bench, name: &str) -> (String, i64) {
    let path = bench.path("study.toml");
    let output = bench.output(&["claims", path.to_str().unwrap(), "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let claims = json["claims"].as_array().unwrap();
    let claim = claims.iter().find(|claim| claim["name"] == name).unwrap();
    let surfaces = claim["quantities"][0]["n"].as_i64().unwrap_or(0);
    (claim["verdict"].as_str().unwrap().to_owned(), surfaces)
}

fn results(bench: &Bench) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = bench.files();
    files.retain(|path, _| path.starts_with("results"));
    files
}

#[test]
fn surfaces_are_drawn_until_a_named_claim_is_decided_and_no_more() {
    let bench = Bench::new();
    let manifest = until(GROWS, [5, 400]);
    let before = planned(&bench, &manifest);
    assert_eq!(
        [&before["surfaces"], &before["holds"], &before["until"]],
        [&5.into(), &Value::Null, &GROWS.into()]
    );
    bench.run(&manifest);
    let after = planned(&bench, &manifest);
    let surfaces = after["surfaces"].as_i64().unwrap();
    assert_eq!((&after["holds"], &after["undecided"]), (&true.into(), &Value::Array(vec![])));
    assert!((6..400).contains(&surfaces), "{surfaces}");
    let (verdict, of) = verdict(&bench, "area-grows-with-k-lower");
    assert!(["holds", "does not hold"].contains(&verdict.as_str()), "{verdict}");
    assert_eq!(of, surfaces);
    assert!(bench.run(&manifest).values().all(is_idle));
    // Fits and means use only the final number of surfaces.
    for stage in ["law", "means"] {
        let rows = bench.table("decided", stage);
        let of = rows.integers(if stage == "law" { "surfaces" } else { "count" }).unwrap();
        assert!(of.iter().all(|of| of == Some(surfaces)), "{stage}");
    }
    let stored = bench.files().into_keys().filter(|path| {
        path.starts_with("store") && path.extension().is_some_and(|of| of == "parquet")
    });
    let planned = bench.plan(&manifest);
    let tasks: u64 = planned.values().map(|count| count.cached).sum();
    assert_eq!(stored.count() as u64, tasks, "nothing else was computed");
}

#[test]
fn threads_kills_and_larger_studies_before_change_no_number_of_surfaces_and_no_byte() {
    let manifest = until("decided(area-above-persson, area-grows-with-k-lower)", [5, 30]);
    let (one, two, killed, later) = (Bench::new(), Bench::new(), Bench::new(), Bench::new());
    one.run_with(&manifest, &["--jobs", "1"]);
    two.run_with(&manifest, &["--jobs", "2"]);
    assert_same_files(&one.files(), &two.files());
    let path = killed.write(&manifest);
    for wait in [10, 40, 80, 120] {
        let mut run = killed.asperity(&["run", path.to_str().unwrap(), "--jobs", "1"]);
        let mut run = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        thread::sleep(Duration::from_millis(wait));
        let _ = run.kill();
        run.wait().unwrap();
    }
    killed.run(&manifest);
    assert_same_files(&results(&one), &results(&killed));
    // Existing additional surfaces do not change the number that is requested.
    later.run(&study("40"));
    later.run(&manifest);
    for stage in ["area", "law", "means"] {
        assert_eq!(later.table("decided", stage), one.table("decided", stage), "{stage}");
    }
}

#[test]
fn what_stays_undecided_ends_at_the_most_and_is_named() {
    let bench = Bench::new();
    let name = "corrected-area-grows-with-k-lower";
    let path = bench.write(&until(&format!("decided({name})"), [5, 6]));
    let output = bench.output(&["run", path.to_str().unwrap()]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let printed = text(&output.stdout);
    let expected = format!(
        "surfaces: 6 surfaces per point (the maximum): 0 of 1 claims decided; more surfaces would \
         decide `{name}`"
    );
    assert!(printed.contains(&expected), "{printed}");
    assert_eq!(verdict(&bench, name), ("cannot say".to_owned(), 6));
}

#[test]
fn a_named_claim_that_the_study_cannot_judge_asks_for_no_surfaces_and_says_what_it_needs() {
    let bench = Bench::new();
    let manifest = until("decided(sealing-area-does-not-depend-on-k-lower)", [5, 50]);
    let path = bench.write(&manifest);
    let output = bench.output(&["run", path.to_str().unwrap()]);
    let printed = text(&output.stdout);
    let expected = "surfaces: 5 surfaces per point: no claim to decide; \
                    `sealing-area-does-not-depend-on-k-lower` needs";
    assert!(printed.contains(expected), "{printed}");
}

#[test]
fn all_claims_that_the_study_can_judge_are_meant_without_names() {
    let bench = Bench::new();
    let manifest = until("claims decided", [5, 8]);
    bench.run(&manifest);
    let after = planned(&bench, &manifest);
    assert_eq!(after["surfaces"], 8, "{after}");
    let undecided = after["undecided"].as_array().unwrap();
    assert!(!undecided.is_empty());
    for name in undecided {
        assert_eq!(verdict(&bench, name.as_str().unwrap()).0, "cannot say", "{name}");
    }
}

#[test]
fn claims_wait_until_means_are_known() {
    let more = r#"
[stage.others]
kind = "generate"
nodes = 64
hurst = 0.8
k_lower = 8
k_upper = 8
realizations = { at_least = 3, at_most = 40, until = "sem(others-area.area_fraction) < 5 %" }

[stage.others-contact]
kind = "solve"
from = "others"
loads = [0.024]

[stage.others-area]
kind = "measure"
from = "others-contact"
"#;
    let manifest = until(GROWS, [5, 30]) + more;
    let (one, two) = (Bench::new(), Bench::new());
    one.run_with(&manifest, &["--jobs", "1"]);
    two.run_with(&manifest, &["--jobs", "2"]);
    assert_same_files(&one.files(), &two.files());
    let path = one.path("study.toml");
    let output = one.output(&["plan", path.to_str().unwrap(), "--json"]);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let growing = json["growing"].as_array().unwrap();
    assert_eq!(growing.len(), 2);
    assert!(growing.iter().all(|stage| stage["holds"] == true), "{json}");
}

#[test]
fn wrong_conditions_on_claims_are_met_with_place_and_advice() {
    let wrong = [
        (until("decided(area-above-person)", [5, 9]), "did you mean `area-above-persson`?"),
        (
            until("decided(asymptote-of-alpha)", [5, 9]),
            "there is no claim `asymptote-of-alpha` that surfaces decide",
        ),
        (until("claims decided", [4, 9]), "`at_least = 4` is too few for claims"),
        (until("all claims", [5, 9]), "or `decided(CLAIM, …)`"),
    ];
    for (manifest, advice) in wrong {
        let bench = Bench::new();
        let path = bench.write(&manifest);
        let output = bench.output(&["check", path.to_str().unwrap()]);
        let printed = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{printed}");
        assert!(printed.contains(advice) && printed.contains("study.toml:13:"), "{printed}");
    }
}
