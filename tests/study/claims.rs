//! Claims that a study declares.

use std::fs;

use serde_json::Value;

use crate::bench::{Bench, STUDY, text};

/// Returns the small study with six surfaces per spectrum and these claims.
fn study(claims: &str) -> String {
    format!("{}{claims}", STUDY.replace("realizations = 2", "realizations = 6"))
}

/// Runs a study and returns its claim of this name as JSON.
fn claim(bench: &Bench, manifest: &str, name: &str) -> Value {
    bench.run(manifest);
    let path = bench.path("study.toml");
    let output = bench.output(&["claims", path.to_str().unwrap(), "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let claims = json["claims"].as_array().unwrap();
    claims.iter().find(|claim| claim["name"] == name).expect(name).clone()
}

fn values(claim: &Value) -> Vec<f64> {
    let quantities = claim["quantities"].as_array().unwrap().iter();
    quantities.map(|quantity| quantity["value"].as_f64().unwrap()).collect()
}

/// Returns the mean area of the spectrum with this cutoff at a load.
fn mean_area(bench: &Bench, stage: &str, column: &str, k_upper: i64, load: f64) -> f64 {
    let table = bench.table("small", stage);
    let (cutoffs, loads) = (table.integers("k_upper").unwrap(), table.reals("load").unwrap());
    let areas = table.reals(column).unwrap();
    let is_counted = |row: usize| match table.texts("correction") {
        Ok(corrections) => corrections.value(row) == "2017",
        Err(_) => true,
    };
    let is_own = |&row: &usize| {
        cutoffs.value(row) == k_upper && (loads.value(row) - load).abs() < 1e-9 && is_counted(row)
    };
    let own: Vec<f64> = (0..table.rows()).filter(is_own).map(|row| areas.value(row)).collect();
    assert_eq!(own.len(), 6);
    own.iter().sum::<f64>() / 6.0
}

#[test]
fn a_claim_on_a_mean_has_the_mean_of_the_table_and_its_interval() {
    let bench = Bench::new();
    let manifest = study(
        r#"
[claim.area-is-small]
text = "The area at the load 0.05 is below one half."
from = "area"
value = "area_fraction"
loads = 0.05
expected = "< 0.5"
"#,
    );
    let found = claim(&bench, &manifest, "area-is-small");
    assert_eq!(found["verdict"], "holds");
    assert_eq!([&found["kind"], &found["expected"]], ["study", "below 0.5"]);
    assert_eq!(found["quantity"], "this");
    let expected = [4, 8].map(|k_upper| mean_area(&bench, "area", "area_fraction", k_upper, 0.05));
    for (value, expected) in values(&found).iter().zip(expected) {
        assert!((value / expected - 1.0).abs() < 1e-12, "{found}");
    }
    let path = bench.path("study.toml");
    let printed = text(&bench.output(&["claims", path.to_str().unwrap()]).stdout);
    for part in ["Claims of the study\n", "1 claim of the study: 1 holds"] {
        assert!(printed.contains(part), "{printed}");
    }
}

#[test]
fn groups_are_compared_along_a_parameter_and_beside_other_data() {
    let bench = Bench::new();
    let manifest = study(
        r#"
[data.counted]
from = "area"
value = "area_fraction"

[data.better]
from = "corrected"
value = "area_corrected"
where = { correction = "2017" }

[claim.does-not-depend-on-k-upper]
text = "The area hardly depends on k_upper."
data = "counted"
loads = [0.025, 0.1]
along = "k_upper"
quantity = "ln(next / this)"
expected = [-0.5, 0.5]

[claim.correction-lowers-the-area]
text = "The correction lowers the area."
data = ["counted", "better"]
loads = "heaviest"
quantity = "better / counted"
expected = "< 1"
"#,
    );
    let along = claim(&bench, &manifest, "does-not-depend-on-k-upper");
    let expected = [0.025, 0.1].map(|load| {
        let [narrow, wide] =
            [4, 8].map(|k_upper| mean_area(&bench, "area", "area_fraction", k_upper, load));
        (wide / narrow).ln()
    });
    assert_eq!(along["verdict"], "holds");
    for (value, expected) in values(&along).iter().zip(expected) {
        assert!((value - expected).abs() < 1e-12, "{along}");
    }
    let beside = claim(&bench, &manifest, "correction-lowers-the-area");
    let expected = [4, 8].map(|k_upper| {
        mean_area(&bench, "corrected", "area_corrected", k_upper, 0.1)
            / mean_area(&bench, "area", "area_fraction", k_upper, 0.1)
    });
    assert_eq!((beside["verdict"].as_str(), values(&beside).len()), (Some("holds"), 2));
    for (value, expected) in values(&beside).iter().zip(expected) {
        assert!((value / expected - 1.0).abs() < 1e-12, "{beside}");
    }
}

#[test]
fn pressures_and_bounds_with_units_are_those_of_the_columns() {
    let bench = Bench::new();
    let loads = "loads = { to = 0.1, steps = 4 }";
    let manifest = study(
        r#"
[claim.gap-stays-open]
text = "At 20 MPa the gap is wider than 1 nm."
from = "area"
value = "mean_gap"
loads = "20 MPa"
expected = "> 1 nm"
"#,
    )
    .replace(loads, "loads = [\"10 MPa\", \"20 MPa\"]\neffective_modulus = \"100 GPa\"")
    .replace("hurst = 0.8", "hurst = 0.8\nrms_slope = 0.01\nside = \"100 um\"")
    .replace("window = [0, 0.1]\n", "");
    let found = claim(&bench, &manifest, "gap-stays-open");
    assert_eq!(found["verdict"], "holds", "{found}");
    assert_eq!(found["quantity"], "this in µm");
    assert_eq!(found["expected"], "above 0.001");
    assert_eq!(values(&found).len(), 2);
}

#[test]
fn claims_of_a_file_are_those_of_the_manifest_and_decide_surfaces() {
    let bench = Bench::new();
    let file = r#"
[claim.area-grows]
text = "The area grows with the load."
from = "area"
value = "area_fraction"
loads = [0.025, 0.1]
along = "load"
quantity = "next - this"
expected = "> 0"
"#;
    fs::write(bench.path("own.toml"), file).unwrap();
    let growing = "realizations = { at_least = 5, at_most = 9, until = \"decided(area-grows)\" }";
    let manifest = STUDY
        .replace("realizations = 2", growing)
        .replace("[study]\n", "[study]\nclaims = \"own.toml\"\n");
    let found = claim(&bench, &manifest, "area-grows");
    assert_eq!([&found["verdict"], &found["file"]], ["holds", "own.toml"]);
    assert_eq!(found["quantities"][0]["n"], 5);
    fs::write(bench.path("own.toml"), file.replace("along", "allong")).unwrap();
    let path = bench.path("study.toml");
    let output = bench.output(&["check", path.to_str().unwrap()]);
    let printed = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{printed}");
    assert!(printed.contains("own.toml:7:1") && printed.contains("`along`"), "{printed}");
}

#[test]
fn mistakes_in_claims_are_met_with_place_and_advice() {
    let whole = "[claim.a]\ntext = \"A.\"\nfrom = \"area\"\nvalue = \"area_fraction\"\n\
                 expected = \"> 0\"\n";
    let with = |line: &str| format!("{whole}{line}\n");
    let instead = |line: &str, other: &str| whole.replace(line, other);
    let wrong = [
        (instead("\"area\"", "\"aria\""), "there is no stage \"aria\"", 43),
        (instead("area_fraction", "area_frction"), "did you mean \"area_fraction\"?", 44),
        (instead("area_fraction", "surface"), "holds no numbers", 44),
        (instead("\"> 0\"", "\"positive\""), "is not a range", 45),
        (instead("\"> 0\"", "\"> 1 MPa\""), "no unit", 45),
        (instead("\"> 0\"", "[2, 1]"), "ends below its beginning", 45),
        (instead("expected = \"> 0\"\n", ""), "`expected` is not given", 41),
        (with("quantity = \"ln(next / this)\""), "the claim has no `along`", 46),
        (with("quantity = \"lnn(this)\""), "did you mean `ln`?", 46),
        (with("quantity = \"this / k_uper\""), "did you mean `k_upper`?", 46),
        (with("along = \"k_uper\""), "did you mean `k_upper`?", 46),
        (with("where = { k_uper = 4 }"), "did you mean \"k_upper\"?", 46),
        (with("loads = \"50 MPa\""), "unit", 46),
        (with("statistic = \"convexity\""), "`statistic`", 46),
        (with("regress = \"ln(this)\""), "`regress` and `on` are used together", 46),
        (with("reference = \"none.csv\""), "cannot read the table `none.csv`", 46),
        ("[claim.a]\ntext = \"A.\"\ndata = \"b\"\nexpected = 1\n".to_owned(), "`[data.b]`", 43),
    ];
    for (claims, advice, line) in wrong {
        let bench = Bench::new();
        let path = bench.write(&format!("{}\n{claims}", *STUDY));
        let output = bench.output(&["check", path.to_str().unwrap()]);
        let printed = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{claims}{printed}");
        let place = format!("study.toml:{line}:");
        assert!(printed.contains(advice) && printed.contains(&place), "{claims}{printed}");
    }
}

#[test]
fn a_claim_that_no_file_of_the_manifest_has_is_named_with_the_line_that_adds_it() {
    let bench = Bench::new();
    let growing =
        "realizations = { at_least = 5, at_most = 9, until = \"decided(area-above-persson)\" }";
    let path = bench.write(&STUDY.replace("realizations = 2", growing));
    let output = bench.output(&["check", path.to_str().unwrap()]);
    let printed = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{printed}");
    assert!(printed.contains("add the line `claims = \"yastrebov-2015\"`"), "{printed}");
}
