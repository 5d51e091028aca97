//! Grouping of rows by parameter point, surface and load: no row is lost or counted twice.

use std::sync::LazyLock;

use serde_json::Value;

use crate::bench::{Bench, STUDY, with_claims};
use crate::manifest::{manifest, stages_from};

/// Runs a study and returns its claims as JSON.
fn claims(bench: &Bench) -> Value {
    let path = bench.path("study.toml");
    let output = bench.output(&["claims", path.to_str().unwrap(), "--json"]);
    assert!(output.status.success(), "{output:?}");
    let mut claims: Value = serde_json::from_slice(&output.stdout).unwrap();
    // The cost of more surfaces is measured by every command and differs.
    for claim in claims["claims"].as_array_mut().unwrap() {
        claim["core_hours"] = Value::Null;
    }
    claims
}

#[test]
fn a_load_of_two_blocks_is_one_load_however_it_was_computed() {
    let bench = Bench::new();
    let one_block = STUDY.replace("{ to = 0.1, steps = 4 }", "{ to = 0.06, steps = 6 }");
    let more = &stages_from("surfaces").solve("more", "loads = [0.02, 0.04, 0.05, 0.06]").text();
    let statistics = r#"statistics = ["mean", "sd"]"#;
    let slopes = r#"statistics = ["mean", "sd", "slope"]"#;
    let one_block = one_block.replace(statistics, slopes);
    let two_blocks = one_block.replace("from = \"light\"", "from = [\"light\", \"more\"]");
    bench.run(&one_block);
    let alone = bench.table("small", "curves");
    bench.run(&format!("{two_blocks}{more}"));
    let together = bench.table("small", "curves");
    assert_eq!(together.rows(), alone.rows());
    for column in ["load", "area_corrected_mean", "area_corrected_slope"] {
        let [alone, together] = [&alone, &together].map(|table| table.reals(column).unwrap());
        assert_eq!(alone, together, "{column}");
    }
    let path = bench.path("study.toml");
    let query = "select count(*) as rows from curves where load = 0.06";
    let asked = ["table", path.to_str().unwrap(), "--sql", query, "--json"];
    let answer: Value = serde_json::from_slice(&bench.output(&asked).stdout).unwrap();
    // Two spectra, each with the counted and the corrected area.
    assert_eq!(answer["rows"], 4);
}

#[test]
fn loads_in_pascals_and_reduced_ones_are_the_same_loads() {
    let bench = Bench::new();
    let reduced = STUDY.replace("{ to = 0.1, steps = 4 }", "[0.025, 0.05, 0.075]");
    let pascals = &stages_from("surfaces")
        .solve("pascals", "load_unit = 'absolute'; loads = [0.0005, 0.001, 0.0015]")
        .text();
    // E* is 1 and the rms slope is 0.02, which has no exact binary representation.
    let sloped = reduced.replace("hurst = 0.8", "hurst = 0.8\nrms_slope = 0.02");
    let both = sloped.replace("from = \"light\"", "from = [\"light\", \"pascals\"]");
    bench.run(&format!("{both}{pascals}"));
    let [light, pascals] = ["light", "pascals"].map(|stage| bench.table("small", stage));
    for column in ["load", "pressure", "contact_nodes"] {
        let [light, pascals] = [&light, &pascals].map(|table| {
            let column = table.batch().column_by_name(column).unwrap();
            column.to_data()
        });
        assert_eq!(light, pascals, "{column}");
    }
    let counts = bench.table("small", "curves");
    let counts = counts.integers("count").unwrap().values();
    assert!(counts.iter().all(|&count| count == 2), "{counts:?}");
}

#[test]
fn claims_rest_on_the_surfaces_of_every_seed() {
    let bench = Bench::new();
    let study = with_claims(&STUDY.replace("realizations = 2", "realizations = 3"));
    let with = |seeds: &str| study.replace("hurst = 0.8", &format!("hurst = 0.8\nseed = {seeds}"));
    let found = |seeds: &str| {
        bench.run(&with(seeds));
        claims(&bench)["claims"].clone()
    };
    let [both, reversed, one] = [found("[1, 2]"), found("[2, 1]"), found("1")];
    assert_eq!(both, reversed, "no seed comes first");
    assert_ne!(both, one);
    // Six surfaces of two seeds give intervals; three surfaces of one seed do not.
    let verdict = |claims: &Value| {
        let all = claims.as_array().unwrap().iter();
        let mut named = all.filter(|claim| claim["name"] == "area-above-persson");
        named.next().unwrap()["verdict"].clone()
    };
    assert_eq!(verdict(&one), "not computed");
    assert_ne!(verdict(&both), "not computed");
}

#[test]
fn claims_rest_on_one_tolerance_and_name_what_they_leave_out() {
    let bench = Bench::new();
    let study = with_claims(&STUDY.replace("realizations = 2", "realizations = 5"));
    let loads = "loads = { to = 0.1, steps = 4 }";
    bench.run(&study);
    let tight = claims(&bench);
    assert_eq!(tight["left_out"].as_array().map(Vec::len), Some(0));
    for sweep in ["[0.5, 6e-5]", "[6e-5, 0.5]"] {
        bench.run(&study.replace(loads, &format!("{loads}\ntolerance = {sweep}")));
        let swept = claims(&bench);
        assert_eq!(swept["claims"], tight["claims"]);
        assert_eq!(swept["rests_on"]["tolerance"], 6e-5);
        // Two spectra × five surfaces × four loads.
        assert_eq!(swept["left_out"][0]["rows"], 40);
        assert_eq!(swept["left_out"][0]["with"]["tolerance"], 0.5);
    }
    let path = bench.path("study.toml");
    let printed = bench.output(&["claims", path.to_str().unwrap()]);
    let printed = String::from_utf8(printed.stdout).unwrap();
    assert!(printed.contains("omitted: 40 rows with tolerance 0.5"), "{printed}");
}

/// Returns the small study with two values of one key, for each key that can be swept.
fn sweeps() -> Vec<(&'static str, String)> {
    let swept = [
        ("hurst = 0.8", "hurst = [0.3, 0.8]"),
        ("k_lower = 2", "k_lower = [1, 2]"),
        ("k_lower = 2", "k_lower = 2\nk_rolloff = [2, 3]"),
        ("nodes = 32", "nodes = [32, 64]"),
        ("nodes = 32", "nodes = 32\nside = [1, 2]"),
        ("nodes = 32", "nodes = 32\nrms_slope = [0.1, 1]"),
        ("nodes = 32", "nodes = 32\nseed = [1, 2]"),
        ("\nloads", "\neffective_modulus = [1, 2]\nloads"),
        ("\nloads", "\ntolerance = [1e-3, 1e-4]\nloads"),
    ];
    let swept = swept.map(|(key, sweep)| (sweep, STUDY.replacen(key, sweep, 1)));
    let again = &stages_from("surfaces")
        .solve("again", "loads = { to = 0.1, steps = 4 }; max_pairs = 501")
        .text();
    let both = STUDY.replace("from = \"light\"", "from = [\"light\", \"again\"]");
    let mut sweeps = Vec::from(swept);
    sweeps.push(("max_pairs", format!("{both}{again}")));
    sweeps
}

#[test]
fn plan_and_tables_agree_on_parameter_points_for_every_swept_key() {
    for (sweep, manifest) in sweeps() {
        let bench = Bench::new();
        bench.run(&manifest);
        // Two seeds belong to one parameter point; two values of any other key give two points.
        let (points, surfaces) = if sweep.contains("seed") { (2, 4) } else { (4, 2) };
        let corrections = 2;
        let law = bench.table("small", "law");
        assert_eq!(law.rows(), corrections * points, "{sweep}");
        let pooled = law.integers("surfaces").unwrap().values();
        assert!(pooled.iter().all(|&pooled| pooled == surfaces), "{sweep}: {pooled:?}");
        let curves = bench.table("small", "curves");
        let counted: i64 = curves.integers("count").unwrap().values().iter().sum();
        let rows = bench.table("small", "corrected").rows();
        assert_eq!(counted as usize, rows, "{sweep}");
    }
}

/// Surfaces of one spectrum with different rms slopes, at pressures in pascals.
static IN_PASCALS: LazyLock<String> = LazyLock::new(|| {
    manifest("pascals", "seed = 7")
        .generate(
            "surfaces",
            "method = 'spectrum'; path = 'spectrum.csv'; nodes = 32; side = 1e-3; realizations = 4",
        )
        .solve(
            "loads",
            "effective_modulus = 1e11; load_unit = 'absolute'; loads = [1e8, 3e8, 5e8, 1e9, 2e9]",
        )
        .measure("area", "")
        .aggregate(
            "means",
            "over = ['area_fraction']; statistics = ['mean', 'sem', 'slope']; models = ['persson']",
        )
        .fit("law", "from = 'area'; law = 'contact-evolution'; window = [0, 1]; bootstrap = 20")
        .fit("gap", "from = 'area'; law = 'load-separation'; window = [0, 1]; bootstrap = 20")
        .text()
});

const SPECTRUM: &str = "wavenumber [1/m],density [m^4]\n12566,1e-19\n50266,4e-21\n";

fn in_pascals(change: impl Fn(&str) -> String) -> Bench {
    let bench = Bench::new();
    std::fs::write(bench.path("spectrum.csv"), SPECTRUM).unwrap();
    bench.run(&change(&IN_PASCALS));
    bench
}

#[test]
fn an_ensemble_under_pressures_in_pascals_has_one_mean_a_pressure() {
    let bench = in_pascals(str::to_owned);
    let area = bench.table("pascals", "area");
    let slopes = area.reals("load").unwrap().values();
    assert!(slopes[0] != slopes[5], "surfaces differ in slope");
    let pressures = area.reals("pressure").unwrap().values();
    let given = [1e8, 3e8, 5e8, 1e9, 2e9];
    assert!(pressures.iter().all(|pressure| given.contains(pressure)), "{pressures:?}");
    let means = bench.table("pascals", "means");
    assert_eq!(means.reals("pressure").unwrap().values(), &given);
    assert_eq!(means.integers("surfaces").unwrap().values(), &[4; 5]);
    let areas = area.reals("area_fraction").unwrap();
    let rows = (0..area.rows()).filter(|&row| pressures[row] == 1e8);
    let mean = rows.map(|row| areas.value(row)).sum::<f64>() / 4.0;
    let found = means.reals("area_fraction_mean").unwrap().value(0);
    assert!((found - mean).abs() < 1e-15);
    for law in ["law", "gap"] {
        let status = bench.table("pascals", law);
        assert_eq!(status.texts("status").unwrap().value(0), "fitted", "{law}");
        assert_eq!(status.integers("surfaces").unwrap().value(0), 4);
    }
}

#[test]
fn a_condition_on_the_error_of_a_mean_counts_surfaces_under_pressures_in_pascals() {
    let bench = in_pascals(|manifest| {
        let until = r#"{ at_least = 3, at_most = 5, until = "sem(area.area_fraction) < 0.01 %" }"#;
        manifest.replace("realizations = 4", &format!("realizations = {until}"))
    });
    // The areas of the surfaces differ by several per cent.
    let surfaces = bench.table("pascals", "surfaces");
    assert_eq!(surfaces.rows(), 5);
}

#[test]
fn groups_by_a_load_that_differs_between_surfaces_are_refused() {
    let bench = Bench::new();
    std::fs::write(bench.path("spectrum.csv"), SPECTRUM).unwrap();
    let path = bench.write(&IN_PASCALS.replace(
        "over = [\"area_fraction\"]",
        "group_by = [\"load\"]\nover = [\"area_fraction\"]",
    ));
    let output = bench.output(&["run", path.to_str().unwrap()]);
    assert!(!output.status.success());
    let printed = crate::bench::text(&output.stderr);
    assert!(printed.contains("group by `pressure`"), "{printed}");
}

#[test]
fn the_report_has_the_area_against_pressure_of_an_ensemble_in_pascals() {
    let bench = in_pascals(str::to_owned);
    let path = bench.path("study.toml");
    let output = bench.output(&["report", path.to_str().unwrap(), "--json"]);
    assert!(output.status.success(), "{output:?}");
    let figures = bench.data().join("results/pascals/figures");
    let drawn = std::fs::read_to_string(figures.join("pressure.svg")).unwrap();
    // The curve has a marker at each of its five pressures.
    assert!(drawn.matches("<circle").count() >= 5, "{drawn}");
}
