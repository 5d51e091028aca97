//! Multilevel means of whole studies: numbers of surfaces on each mesh, fixed and adaptive.

use serde_json::Value;

use crate::bench::{Bench, assert_same_files, is_idle, text};
use crate::manifest::manifest;

/// Returns a study of surfaces on meshes of 16² to 64² nodes with these keys.
fn study(surfaces: &str) -> String {
    let surfaces = format!("{surfaces}; hurst = 0.8; k_lower = 2; k_upper = 4; heights = 'redraw'");
    manifest("levels", "seed = 3")
        .generate("surfaces", &surfaces)
        .solve("contact", "loads = [0.05, 0.1]")
        .measure("area", "")
        .aggregate("mean-area", "estimator = 'multilevel'; over = ['area_fraction', 'mean_gap']")
        .text()
}

fn nested() -> String {
    study(
        "cases = [{ nodes = 16, realizations = 24 }, { nodes = 32, realizations = 8 }, \
         { nodes = 64, realizations = 4 }]",
    )
}

fn growing(at_most: u32, bound: &str) -> String {
    study(&format!(
        "nodes = [16, 32, 64]; realizations = {{ at_least = 4, at_most = {at_most}, until = \
         'sem(mean-area.area_fraction) < {bound}' }}"
    ))
}

/// Returns the surfaces in the output of `plan --json`.
fn planned(bench: &Bench, manifest: &str) -> Value {
    let path = bench.write(manifest);
    let output = bench.output(&["plan", path.to_str().unwrap(), "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    json["growing"][0].clone()
}

/// Returns what `check` prints about a wrong manifest.
fn refused(manifest: &str) -> String {
    let bench = Bench::new();
    let path = bench.write(manifest);
    let output = bench.output(&["check", path.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    text(&output.stderr).to_owned()
}

#[test]
fn the_mean_of_the_finest_mesh_is_recomputed_from_the_areas_of_the_surfaces() {
    let bench = Bench::new();
    bench.run(&nested());
    let means = bench.table("levels", "mean-area");
    let nodes = means.integers("nodes").unwrap().values().to_vec();
    assert_eq!(nodes, [16, 16, 32, 32, 64, 64]);
    assert_eq!(means.integers("surfaces").unwrap().values(), &[24, 24, 8, 8, 4, 4]);
    let areas = bench.table("levels", "area");
    let area = |mesh: i64, realization: i64, load: f64| {
        let row = (0..areas.rows()).find(|&row| {
            areas.integers("nodes").unwrap().value(row) == mesh
                && areas.integers("realization").unwrap().value(row) == realization
                && areas.reals("load").unwrap().value(row) == load
        });
        areas.reals("area_fraction").unwrap().value(row.unwrap())
    };
    for (row, load) in [(4, 0.05), (5, 0.1)] {
        let mean = |count: i64, value: &dyn Fn(i64) -> f64| {
            (0..count).map(value).sum::<f64>() / count as f64
        };
        let expected = mean(24, &|surface| area(16, surface, load))
            + mean(8, &|surface| area(32, surface, load) - area(16, surface, load))
            + mean(4, &|surface| area(64, surface, load) - area(32, surface, load));
        let found = means.reals("area_fraction_mean").unwrap().value(row);
        assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        let shares: f64 = (0..3)
            .map(|level| means.reals("area_fraction_share").unwrap().value(row - 4 + 2 * level))
            .sum();
        assert!((shares - 1.0).abs() < 1e-12, "{shares}");
    }
}

#[test]
fn each_mesh_gets_the_surfaces_that_the_mean_needs() {
    let bench = Bench::new();
    let manifest = growing(400, "1 %");
    let before = planned(&bench, &manifest);
    assert_eq!((&before["surfaces"], &before["holds"]), (&4.into(), &Value::Null));
    bench.run(&manifest);
    let after = planned(&bench, &manifest);
    assert_eq!(after["holds"], true);
    let numbers: Vec<u64> = after["meshes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|mesh| mesh["surfaces"].as_u64().unwrap())
        .collect();
    assert!(numbers[0] > 2 * numbers[2] && numbers.is_sorted_by(|a, b| a >= b), "{numbers:?}");
    let means = bench.table("levels", "mean-area");
    for row in [4, 5] {
        let value = |name: &str| means.reals(name).unwrap().value(row);
        assert!(value("area_fraction_sem") < 0.01 * value("area_fraction_mean"));
    }
    assert!(bench.run(&manifest).values().all(is_idle));
}

#[test]
fn threads_and_former_surfaces_change_no_number_of_surfaces() {
    let manifest = growing(400, "1 %");
    let (one, two, later) = (Bench::new(), Bench::new(), Bench::new());
    one.run_with(&manifest, &["--jobs", "1"]);
    two.run_with(&manifest, &["--jobs", "2"]);
    assert_same_files(&one.files(), &two.files());
    later.run(&nested());
    later.run(&manifest);
    for stage in ["area", "mean-area"] {
        assert_eq!(later.table("levels", stage), one.table("levels", stage), "{stage}");
    }
}

#[test]
fn more_surfaces_on_a_mesh_compute_only_these() {
    let bench = Bench::new();
    bench.run(&nested());
    let counts = bench.run(&nested().replace("realizations = 24", "realizations = 26"));
    assert_eq!(counts["contact"].computed, 2);
    assert_eq!(counts["mean-area"].computed, 1);
}

#[test]
fn surfaces_that_have_no_multilevel_mean_are_refused() {
    let wrong = [
        (study("nodes = 16; realizations = 9"), "the same surfaces on several meshes"),
        (
            nested().replace("realizations = 4", "realizations = 1"),
            "the mean difference of a single surface has no standard error",
        ),
        (
            nested().replace("realizations = 4", "realizations = 9"),
            "8 surfaces on a mesh of 32, but 9 surfaces on a mesh of 64",
        ),
        (
            study("method = 'paraboloid'; nodes = [16, 32]; radius = 1.0")
                .replace("; hurst = 0.8; k_lower = 2; k_upper = 4", ""),
            "multilevel means need random surfaces",
        ),
        (
            nested().replace("over = ", "statistics = [\"mean\", \"sd\"]\nover = "),
            "a multilevel mean has no \"sd\"",
        ),
        (
            nested().replace("over = ", "group_by = [\"load\"]\nover = "),
            "cannot be combined with `estimator = \"multilevel\"`",
        ),
        (
            growing(9, "1 %").replace("mean-area.area_fraction", "mean-area.secant"),
            "`mean-area` has no mean of a column `secant`",
        ),
        (
            study("nodes = [16, 32]; realizations = [9, 4]"),
            "a parameter point has several numbers of surfaces",
        ),
        (
            study(
                "cases = [{ nodes = 16, realizations = 4 }, { nodes = 32, realizations = \
                 { at_most = 19, until = 'sem(area.area_fraction) < 1 %' } }]",
            ),
            "different conditions in `realizations`",
        ),
    ];
    for (manifest, message) in wrong {
        let printed = refused(&manifest);
        assert!(printed.contains(message), "{message}: {printed}");
    }
}
