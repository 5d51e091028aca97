//! Fits of limits, and advice for extending a study.

use std::sync::LazyLock;

use serde_json::Value;

use crate::bench::{Bench, text};
use crate::manifest::{manifest, stages_from};
use crate::report::report;

/// Study with three small parameters, each with at least two values, on small meshes.
static LIMITS: LazyLock<String> = LazyLock::new(|| {
    manifest("limits", "seed = 1")
        .generate(
            "surfaces",
            "hurst = 0.8; realizations = 5; heights = 'redraw'; \
             cases = [{ k_lower = 1, k_upper = 4, nodes = 16 }, \
             { k_lower = 1, k_upper = 4, nodes = 32 }, { k_lower = 1, k_upper = 8, nodes = 32 }, \
             { k_lower = 2, k_upper = 8, nodes = 32 }, { k_lower = 2, k_upper = 8, nodes = 64 }, \
             { k_lower = 2, k_upper = 16, nodes = 64 }]",
        )
        .solve("contact", "loads = [0.09, 0.1, 0.11]")
        .measure("area", "")
        .fit(
            "limit",
            "law = 'limits'; of = ['area_fraction / load', '-1 / slope(mean_gap)']; loads = 0.1; \
             bootstrap = 100; terms = [{ of = '1 / k_lower', exponent = 1 }, \
             { of = 'k_lower / k_upper', exponent = [0.5, 1] }, \
             { of = 'k_upper / nodes', exponent = 1 }]",
        )
        .text()
});

#[test]
fn every_quantity_and_every_form_has_a_row() {
    let bench = Bench::new();
    bench.run(&LIMITS);
    let fits = bench.table("limits", "limit");
    assert_eq!(fits.rows(), 4);
    let status = fits.texts("status").unwrap();
    assert!(status.iter().all(|status| status == Some("fitted")));
    let weights = fits.reals("akaike_weight").unwrap();
    for quantity in [[0, 1], [2, 3]] {
        let sum: f64 = quantity.iter().map(|&row| weights.value(row)).sum();
        assert!((sum - 1.0).abs() < 1e-12);
    }
    assert!(fits.integers("data").unwrap().iter().all(|data| data == Some(6)));
}

/// Study whose query divides the mean gaps of every surface by the rms height of the same surface.
static OVER_HEIGHTS: LazyLock<String> = LazyLock::new(|| {
    stages_from("area")
        .aggregate(
            "gaps",
            "from = ['area', 'surfaces']; \
             sql = 'select area.*, surfaces.rms_height from area join surfaces using (surface)'",
        )
        .fit(
            "gap-limit",
            "law = 'limits'; of = 'mean_gap / rms_height'; loads = 0.1; bootstrap = 0; \
             terms = { of = '1 / k_lower', exponent = 1 }; over = ['k_upper', 'nodes']",
        )
        .text()
});

#[test]
fn an_observable_may_be_made_of_columns_that_a_query_joins() {
    let bench = Bench::new();
    bench.run(&format!("{}{}", *LIMITS, *OVER_HEIGHTS));
    let fits = bench.table("limits", "gap-limit");
    assert_eq!(fits.texts("status").unwrap().value(0), "fitted");
    assert_eq!(fits.integers("data").unwrap().value(0), 6);
    assert_eq!(fits.integers("surfaces").unwrap().value(0), 5);
    // At light loads, the mean gap is a few rms heights.
    let limit = fits.reals("limit").unwrap().value(0);
    assert!((0.1..3.0).contains(&limit), "{limit}");
}

#[test]
fn means_over_surfaces_are_no_rows_that_limits_can_be_fitted_to() {
    let bench = Bench::new();
    let means = OVER_HEIGHTS.replace(
        "area.*, surfaces.rms_height",
        "area.k_lower, area.k_upper, area.nodes, area.load, area.mean_gap, surfaces.rms_height",
    );
    let manifest = bench.write(&format!("{}{means}", *LIMITS));
    let output = bench.output(&["check", manifest.to_str().unwrap()]);
    assert!(!output.status.success());
    let printed = text(&output.stderr);
    assert!(printed.contains("do not describe single surfaces"), "{printed}");
}

#[test]
fn one_more_octave_towards_each_limit_is_priced_and_narrows_it() {
    let bench = Bench::new();
    let manifest = bench.write(&LIMITS);
    let advise = |more: &[&str]| {
        let arguments = [&["errors", manifest.to_str().unwrap()], more].concat();
        let output = bench.output(&arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    assert!(advise(&[]).contains("without a result"));
    bench.run(&LIMITS);
    let printed = advise(&[]);
    for part in ["area_fraction / load, load 0.1", "twice the surfaces", "k_upper, nodes"] {
        assert!(printed.contains(part), "{part} in\n{printed}");
    }
    let advice: Value = serde_json::from_str(&advise(&["--json"])).unwrap();
    let steps = advice["limits"][0]["steps"].as_array().unwrap();
    let step = |term: &str| steps.iter().find(|step| step["term"] == term).unwrap();
    // Each term is halved by doubling other parameters.
    for (term, doubled, points) in [
        ("1 / k_lower", &["k_lower", "k_upper", "nodes"][..], 3),
        ("k_lower / k_upper", &["k_upper", "nodes"], 4),
        ("k_upper / nodes", &["nodes"], 4),
    ] {
        let step = step(term);
        assert_eq!(step["doubled"], serde_json::json!(doubled), "{term}");
        assert_eq!(step["points"], points, "{term}");
        let factor = step["factor"].as_f64().unwrap();
        assert!(0.0 < factor && factor < 1.0, "{term}: {factor}");
        assert!(step["core_hours"].as_f64().unwrap() > 0.0);
    }
    let again = &steps[steps.len() - 1];
    assert_eq!(again["points"], 6);
}

#[test]
fn tied_parameters_are_doubled_together() {
    let bench = Bench::new();
    let study = manifest("tied", "seed = 1")
        .generate(
            "surfaces",
            "hurst = 0.8; realizations = 4; heights = 'redraw'; k_lower = [1, 2, 4]; \
             k_upper = '4 * k_lower'; nodes = '4 * k_upper'",
        )
        .solve("contact", "loads = [0.1]")
        .measure("area", "")
        .fit(
            "limit",
            "law = 'limits'; of = 'area_fraction'; loads = 0.1; bootstrap = 10; \
             terms = { of = '1 / k_lower', exponent = 1 }; over = ['k_upper', 'nodes']",
        )
        .text();
    bench.run(&study);
    let output = bench.output(&["errors", bench.path("study.toml").to_str().unwrap(), "--json"]);
    let errors: Value = serde_json::from_slice(&output.stdout).unwrap();
    let steps = errors["limits"][0]["steps"].as_array().unwrap();
    // One octave, and twice the surfaces.
    assert_eq!(steps.len(), 2, "{errors}");
    assert_eq!(steps[0]["doubled"], serde_json::json!(["k_lower", "k_upper", "nodes"]));
}

#[test]
fn a_page_draws_limits_of_every_quantity_and_tells_forms_apart() {
    let bench = Bench::new();
    bench.run(&LIMITS);
    let (said, page) = report(&bench);
    let page = page.replace("&#x2f;", "/");
    let title = "Limits of large cells, fine roughness and fine meshes";
    let drawn = said["drawn"].as_array().unwrap();
    assert!(drawn.iter().any(|one| one == title), "{said}");
    for part in [
        "area_fraction / load",
        "-1 / slope(mean_gap)",
        "k_lower / k_upper: power 0.5",
        "k_lower / k_upper: power 1",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("1 / k_lower: power 1"), "the same in all rows");
}
