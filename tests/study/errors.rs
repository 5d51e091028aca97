//! Errors of means: sampling, mesh, cell and solver, and lines that add missing surfaces.

use serde_json::Value;

use crate::bench::{Bench, text};
use crate::manifest::manifest;
use crate::report::report;

/// Returns a study of surfaces with these keys.
fn study(surfaces: &str) -> String {
    manifest("wrong", "seed = 5")
        .generate("surfaces", &format!("hurst = 0.8; heights = 'redraw'; {surfaces}"))
        .solve("contact", "loads = [0.05, 0.1]")
        .measure("area", "")
        .aggregate("mean-area", "over = ['area_fraction']")
        .text()
}

/// Study of one cell on three meshes, and of a smaller cell with as many nodes to the wavelength.
fn complete() -> String {
    study(
        "cases = [{ k_lower = 4, k_upper = 8, nodes = 64, realizations = 8 }, \
         { k_lower = 4, k_upper = 8, nodes = 128, realizations = 3 }, \
         { k_lower = 4, k_upper = 8, nodes = 256, realizations = 3 }, \
         { k_lower = 2, k_upper = 4, nodes = 32, realizations = 20 }]",
    )
}

fn errors(bench: &Bench, more: &[&str]) -> Value {
    let path = bench.path("study.toml");
    let output = bench.output(&[&["errors", path.to_str().unwrap(), "--json"], more].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn term<'a>(load: &'a Value, name: &str) -> &'a Value {
    let terms = load["terms"].as_array().unwrap();
    terms.iter().find(|term| term["term"] == name).unwrap_or_else(|| panic!("{name}: {load}"))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the variance of the mean.
fn variance(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|value| (value - mean(values)).powi(2)).sum();
    squares / (values.len() * (values.len() - 1)) as f64
}

#[test]
fn the_errors_of_a_mean_are_recomputed_from_the_areas_of_its_surfaces() {
    let bench = Bench::new();
    bench.run(&complete());
    let table = bench.table("wrong", "area");
    let areas = |nodes: i64, load: f64| -> Vec<f64> {
        let rows = (0..table.rows()).filter(|&row| {
            table.integers("nodes").unwrap().value(row) == nodes
                && table.reals("load").unwrap().value(row) == load
        });
        rows.map(|row| table.reals("area_fraction").unwrap().value(row)).collect()
    };
    let found = errors(&bench, &[]);
    let means = found["means"].as_array().unwrap();
    let large = means.iter().find(|mean| mean["point"] == "k_lower 4, k_upper 8").unwrap();
    assert_eq!((&large["nodes"], &large["unknown"]), (&64.0.into(), &serde_json::json!([])));
    assert!(found["additions"].as_array().unwrap().is_empty());
    for (index, load) in [0.05, 0.1].into_iter().enumerate() {
        let budget = &large["loads"][index];
        let [coarse, middle, fine] = [64, 128, 256].map(|nodes| areas(nodes, load));
        assert!((number(&budget["value"]) - mean(&coarse)).abs() < 1e-14);
        let sampling = number(&term(budget, "sampling")["standard_error"]);
        assert!((sampling - variance(&coarse).sqrt()).abs() < 1e-14);
        // Richardson's extrapolation of the three surfaces on all meshes.
        let mesh = term(budget, "mesh");
        assert_eq!(mesh["sizes"], serde_json::json!([64.0, 128.0, 256.0]));
        let [at_64, at_128, at_256] = [mean(&coarse[..3]), mean(&middle), mean(&fine)];
        let is_shown = mesh["order_is_shown"] == true;
        let order = if is_shown { ((at_64 - at_128) / (at_128 - at_256)).log2() } else { 1.0 };
        assert!((number(&mesh["order"]) - order).abs() < 1e-9);
        let bias = at_64 - at_256 + (at_128 - at_256) / (2_f64.powf(order) - 1.0);
        assert!((number(&mesh["bias"]) - bias).abs() < 1e-12, "{mesh} {bias}");
        // The mean of the larger cell is as far from the limit as that of the smaller one from it.
        let cell = term(budget, "cell");
        let small = areas(32, load);
        assert!((number(&cell["bias"]) - (mean(&small) - mean(&coarse))).abs() < 1e-12);
        let error = (variance(&small) + variance(&coarse)).sqrt();
        assert!((number(&cell["standard_error"]) - error).abs() < 1e-12);
        assert_eq!(term(budget, "solver")["interval"], serde_json::json!([-2e-6, 2e-6]));
    }
    // Gaps are compared in units of the longest wavelength.
    let gaps = errors(&bench, &["area", "mean_gap"]);
    let gaps = gaps["means"].as_array().unwrap();
    let gap = gaps.iter().find(|mean| mean["point"] == "k_lower 4, k_upper 8").unwrap();
    let gap = &gap["loads"][0];
    assert!(number(&term(gap, "cell")["bias"]).abs() < 0.1 * number(&gap["value"]), "{gap}");
    // The counted area is too large, and a mesh of half the step half as much.
    let mesh = term(&large["loads"][1], "mesh");
    assert!(number(&mesh["interval"][0]) > 0.0 && large["loads"][1]["largest"] == "mesh");
    let halving = large["halving"].as_array().unwrap();
    let of_mesh = halving.iter().find(|halving| halving["term"] == "mesh").unwrap();
    assert!(of_mesh["change"].as_str().unwrap().contains("nodes = 128"), "{of_mesh}");
    assert!(number(&of_mesh["core_hours"]) > 0.0);
    let (_, page) = report(&bench);
    assert!(page.contains("Errors of the mean contact area"));
}

#[test]
fn proposed_lines_show_what_a_study_lacks_and_the_error_falls_as_predicted() {
    let bench = Bench::new();
    let before = study("nodes = 64; k_lower = 4; k_upper = 8; realizations = 6");
    bench.run(&before);
    let found = errors(&bench, &[]);
    assert_eq!(found["means"][0]["unknown"], serde_json::json!(["mesh", "cell"]));
    let [addition] = &found["additions"].as_array().unwrap()[..] else { panic!("{found}") };
    assert_eq!(addition["stage"], "surfaces");
    let lines = addition["lines"].as_str().unwrap();
    assert!(lines.contains("nodes = 128, realizations = 4 }, # mesh"), "{lines}");
    assert!(lines.contains("k_lower = 2, k_upper = 4, nodes = 32, realizations = 24 }, # cell"));
    let keys = "nodes = 64\nk_lower = 4\nk_upper = 8\nrealizations = 6\n";
    assert!(before.contains(keys), "{before}");
    bench.run(&before.replace(keys, lines));
    let found = errors(&bench, &["mean-area", "area_fraction"]);
    let means = found["means"].as_array().unwrap();
    let large = means.iter().find(|mean| mean["point"] == "k_lower 4, k_upper 8").unwrap();
    assert_eq!((&large["nodes"], &large["unknown"]), (&64.0.into(), &serde_json::json!([])));
    let predicted = term(&large["loads"][1], "mesh")["interval"].clone();
    let before_area = number(&large["loads"][1]["value"]);
    // The same surfaces on a mesh whose error is an eighth.
    bench.run(&study("nodes = 512; k_lower = 4; k_upper = 8; realizations = 6"));
    let fine = errors(&bench, &[]);
    let difference = before_area - number(&fine["means"][0]["loads"][1]["value"]);
    let [lower, upper] = [0, 1].map(|end| 7.0 / 8.0 * number(&predicted[end]));
    assert!(lower < difference && difference < upper, "{difference} in {predicted}");
}

#[test]
fn a_smaller_tolerance_shows_the_error_of_the_solver() {
    let bench = Bench::new();
    let study = study("nodes = 32; k_lower = 2; k_upper = 4; realizations = 4");
    bench.run(&study.replace("loads =", "tolerance = [0.1, 1e-8]\nloads ="));
    let found = errors(&bench, &[]);
    let solver = term(&found["means"][0]["loads"][0], "solver");
    assert_eq!(solver["sizes"], serde_json::json!([1e-8]));
    assert!(number(&solver["standard_error"]) >= 0.0 && solver["bias"].is_number());
    assert_eq!(found["means"].as_array().unwrap().len(), 1);
}

#[test]
fn stages_without_means_over_surfaces_are_refused() {
    let bench = Bench::new();
    bench.run(&study("nodes = 32; k_lower = 2; k_upper = 4; realizations = 4"));
    let path = bench.path("study.toml");
    let path = path.to_str().unwrap();
    for (arguments, message) in [
        (&["surfaces"][..], "has no means over surfaces under loads"),
        (&["nothing"], "the study has no stage `nothing`"),
        (&["mean-area", "nothing"], "has no means of a column `nothing`"),
    ] {
        let output = bench.output(&[&["errors", path], arguments].concat());
        assert!(!output.status.success());
        let printed = text(&output.stderr);
        assert!(printed.contains(message), "{printed}");
    }
}

#[test]
fn proposed_lines_replace_the_keys_and_parameters_of_the_manifest() {
    let replaced = |surfaces: &str, more: &str| {
        let bench = Bench::new();
        bench.run(&format!("{}{more}", study(&format!("realizations = 4; {surfaces}"))));
        let found = errors(&bench, &[]);
        let addition = &found["additions"][0];
        assert_eq!(addition["stage"], "surfaces");
        (addition["replaced"].clone(), addition["unused"].clone())
    };
    let wavelengths = "nodes = 32; side = '8 um'; longest_wavelength = '4 um'; \
                       shortest_wavelength = '1 um'";
    let keys = ["side", "nodes", "longest_wavelength", "shortest_wavelength", "realizations"];
    let none = serde_json::json!([]);
    assert_eq!(replaced(wavelengths, ""), (serde_json::json!(keys), none));
    let parameters = "\n[parameters]\nwaves = [2, 4]\nsteepness = 0.1\n";
    let tied =
        "k_lower = 'waves'; k_upper = '2 * waves'; nodes = '8 * waves'; rms_slope = 'steepness'";
    let keys = serde_json::json!(["k_lower", "k_upper", "nodes", "realizations"]);
    assert_eq!(replaced(tied, parameters), (keys, serde_json::json!(["waves"])));
}
