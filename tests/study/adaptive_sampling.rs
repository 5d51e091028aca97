//! Adaptive sampling until a mean is precise enough or claims are decided.

mod claims;

use serde_json::Value;

use crate::bench::{Bench, STUDY, assert_same_files, is_idle, text};

const UNTIL: &str = "sem(area.area_fraction) < 4 %";

/// Returns the small study with this number of surfaces and with stages that compute their means.
fn study(realizations: &str) -> String {
    let study = STUDY.replace("realizations = 2", &format!("realizations = {realizations}"));
    format!(
        "{study}
[stage.means]
kind = \"aggregate\"
from = \"area\"
over = [\"area_fraction\"]
statistics = [\"mean\", \"sem\"]
"
    )
}

fn growing(at_most: u32) -> String {
    study(&format!("{{ at_least = 3, at_most = {at_most}, until = \"{UNTIL}\" }}"))
}

/// Returns the surfaces in the output of `plan --json`.
fn planned(bench: &Bench, manifest: &str) -> Value {
    let path = bench.write(manifest);
    let output = bench.output(&["plan", path.to_str().unwrap(), "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    json["growing"][0].clone()
}

/// Returns the largest relative standard error and the number of surfaces of each mean.
fn largest_error(bench: &Bench) -> (f64, i64) {
    let means = bench.table("small", "means");
    let column = |name: &str| means.reals(name).unwrap().values().to_vec();
    let errors = column("area_fraction_sem").into_iter();
    let errors = errors.zip(column("area_fraction_mean")).map(|(error, mean)| error / mean);
    let counts = means.integers("count").unwrap().values().to_vec();
    assert!(counts.iter().all(|count| *count == counts[0]), "{counts:?}");
    (errors.fold(0.0, f64::max), counts[0])
}

#[test]
fn surfaces_are_drawn_until_the_mean_is_known_and_no_more() {
    let bench = Bench::new();
    let manifest = growing(200);
    let before = planned(&bench, &manifest);
    assert_eq!((&before["surfaces"], &before["holds"]), (&3.into(), &Value::Null));
    bench.run(&manifest);
    let (error, surfaces) = largest_error(&bench);
    assert!(error < 0.04, "{error}");
    assert!((4..200).contains(&surfaces), "{surfaces}");
    let after = planned(&bench, &manifest);
    assert_eq!((&after["surfaces"], &after["holds"]), (&surfaces.into(), &true.into()));
    assert!(bench.run(&manifest).values().all(is_idle));
    // Fewer surfaces are not enough.
    let fewer = Bench::new();
    fewer.run(&study("3"));
    assert!(largest_error(&fewer).0 > 0.04);
}

#[test]
fn threads_and_what_was_there_before_change_no_byte() {
    let manifest = growing(200);
    let (one, two, later) = (Bench::new(), Bench::new(), Bench::new());
    one.run_with(&manifest, &["--jobs", "1"]);
    two.run_with(&manifest, &["--jobs", "2"]);
    assert_same_files(&one.files(), &two.files());
    later.run(&study("5"));
    later.run(&manifest);
    for stage in ["area", "law", "means"] {
        assert_eq!(later.table("small", stage), one.table("small", stage), "{stage}");
    }
}

#[test]
fn a_mean_that_stays_unknown_ends_at_the_most_and_says_so() {
    let bench = Bench::new();
    let path = bench.write(&growing(4));
    let output = bench.output(&["run", path.to_str().unwrap()]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let printed = text(&output.stdout);
    let expected =
        format!("surfaces: 4 surfaces per point (the maximum); {UNTIL} does not hold: it is");
    assert!(printed.contains(&expected), "{printed}");
    assert_eq!(largest_error(&bench).1, 4);
}

#[test]
fn a_damaged_table_that_the_number_depends_on_is_computed_again() {
    let bench = Bench::new();
    let manifest = growing(200);
    bench.run(&manifest);
    let files = bench.files();
    let area = bench.table("small", "area");
    let task = area.texts("task").unwrap().value(0).to_owned();
    let path = bench.file_of(&task);
    std::fs::write(&path, "nothing").unwrap();
    assert_eq!(planned(&bench, &manifest)["holds"], Value::Null);
    bench.run(&manifest);
    let mended = bench.files();
    assert!(files.iter().all(|(name, bytes)| mended.get(name) == Some(bytes)));
}

#[test]
fn wrong_conditions_are_met_with_place_and_advice() {
    let until = |condition: &str| {
        study(&format!("{{ at_least = 3, at_most = 9, until = \"{condition}\" }}"))
    };
    let wrong = [
        (until("sem(aera.area_fraction) < 1 %"), "did you mean `area`?"),
        (until("sem(area.area_fractoin) < 1 %"), "did you mean `area_fraction`?"),
        (until("sem(law.kappa) < 1 %"), "`law` has no rows for each surface"),
        (until("area_fraction < 1 %"), "must be `sem(STAGE.COLUMN) < 0.5 %`"),
        (study("{ at_least = 3, until = \"sem(area.secant) < 1 %\" }"), "lacks `at_most`"),
        (
            study("{ at_least = 9, at_most = 3, until = \"sem(area.secant) < 1 %\" }"),
            "`at_least = 9` is above `at_most = 3`",
        ),
        (study("\"many\""), "no key of the stage and no parameter is called `many`"),
    ];
    for (manifest, advice) in wrong {
        let bench = Bench::new();
        let path = bench.write(&manifest);
        let output = bench.output(&["check", path.to_str().unwrap()]);
        let printed = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{printed}");
        assert!(printed.contains(advice) && printed.contains("study.toml:12:"), "{printed}");
    }
}

#[test]
fn prune_keeps_the_surfaces_that_were_drawn_where_a_table_that_asked_for_them_is_missing() {
    let bench = Bench::new();
    let manifest = growing(200);
    bench.run(&manifest);
    let before = bench.files();
    let areas = bench.table("small", "area");
    let task = areas.texts("task").unwrap().value(0).to_owned();
    let missing = bench.file_of(&task);
    std::fs::remove_file(missing).unwrap();
    let path = bench.write(&manifest);
    let output = bench.output(&["prune", "--yes", path.to_str().unwrap()]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let counts = bench.run(&manifest);
    let computed = ["surfaces", "light", "area"].map(|stage| counts[stage].computed);
    assert_eq!(computed, [0, 0, 1]);
    assert_same_files(&bench.files(), &before);
}
