//! Contacts at prescribed mean gaps and displacements, from manifest to report.

use std::fs;

use asperity::tables::table::Table;

use crate::bench::{Bench, text};
use crate::manifest::{Manifest, manifest};

fn reals(table: &Table, name: &str) -> Vec<f64> {
    table.reals(name).unwrap().values().to_vec()
}

fn counts(table: &Table, name: &str) -> Vec<i64> {
    table.integers(name).unwrap().values().to_vec()
}

/// Returns a study that presses two rough surfaces with these keys.
fn pressed(keys: &str) -> Manifest {
    manifest("pressed", "seed = 5")
        .generate(
            "rough",
            "nodes = 64; side = '100 um'; hurst = 0.8; k_lower = 2; k_upper = 8; \
             rms_slope = 0.1; realizations = 2",
        )
        .solve("contact", &format!("effective_modulus = '10 GPa'; load_unit = 'MPa'; {keys}"))
        .measure("area", "")
}

/// Compares rows of loads with the rows at the mean gap or displacement that these loads have.
fn check_same(loads: &Table, found: &Table, rows: impl Iterator<Item = (usize, usize)>) {
    for (load, row) in rows {
        let value = |table: &Table, name: &str, row: usize| reals(table, name)[row];
        let ratio = value(found, "pressure", row) / value(loads, "pressure", load);
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
        let nodes = [counts(loads, "contact_nodes")[load], counts(found, "contact_nodes")[row]];
        assert!(nodes[0].abs_diff(nodes[1]) <= 1, "{nodes:?}");
        let gaps = [value(loads, "mean_gap", load), value(found, "mean_gap", row)];
        // The tolerance of the solver is 5e-5 × rms slope × mesh step.
        assert!((gaps[0] - gaps[1]).abs() <= 2.0 * 5e-5 * 0.1 * 100.0 / 64.0, "{gaps:?}");
    }
}

/// Keys of a half-space with either boundary, a layer, and a material that yields.
const BODIES: [&str; 4] = [
    "",
    "boundary = 'free'",
    "layer = { thickness = '20 um', poisson_ratio = 0.3, base = 'bonded' }",
    "hardness = '600 MPa'",
];

#[test]
fn the_mean_gap_of_a_load_bears_this_load() {
    for body in BODIES {
        let (by_load, by_gap) = (Bench::new(), Bench::new());
        let separator = if body.is_empty() { "" } else { "; " };
        let study = |keys: &str| pressed(&format!("{body}{separator}{keys}")).text();
        by_load.run(&study("loads = ['20 MPa', '100 MPa']"));
        let loads = by_load.table("pressed", "contact");
        let known = reals(&loads, "mean_gap");
        let list = known.iter().map(|gap| format!("'{gap} um'")).collect::<Vec<_>>().join(", ");
        by_gap.run(&study(&format!("control = 'gap'; gaps = [{list}]")));
        let found = by_gap.table("pressed", "contact");
        assert_eq!(found.rows(), 8, "{body}");
        let prescribed = reals(&found, "prescribed_gap");
        let realizations = [&loads, &found].map(|table| counts(table, "realization"));
        let same = (0..4).map(|load| {
            let is_it = |row: &usize| {
                (prescribed[*row] / known[load] - 1.0).abs() < 1e-9
                    && realizations[1][*row] == realizations[0][load]
            };
            (load, (0..8).find(is_it).unwrap())
        });
        check_same(&loads, &found, same);
        assert!(found.texts("stop").unwrap().iter().all(|stop| stop == Some("converged")));
        assert!(found.texts("control").unwrap().iter().all(|control| control == Some("gap")));
        // Forces follow from the sides: 1 MPa on (100 µm)² is 0.01 N.
        for (force, pressure) in reals(&found, "force").iter().zip(reals(&found, "pressure")) {
            assert!((force / (0.01 * pressure) - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn displacements_count_from_first_touch() {
    let bench = Bench::new();
    let ball = "boundary = 'free'; control = 'displacement'; displacements = ['20 nm', '80 nm']";
    let study = manifest("ball", "")
        .generate("ball", "method = 'paraboloid'; nodes = 128; side = '10 um'; radius = '50 um'")
        .solve("contact", &format!("effective_modulus = '70 GPa'; load_unit = 'MPa'; {ball}"))
        .measure("area", "")
        .text();
    bench.run(&study);
    let contact = bench.table("ball", "contact");
    assert_eq!(reals(&contact, "prescribed_displacement"), [0.02, 0.08]);
    for (depth, force) in [0.02_f64, 0.08].into_iter().zip(reals(&contact, "force")) {
        // Hertz: F = 4/3 E* √R d^(3/2), with E* in N/µm².
        let expected = 4.0 / 3.0 * 0.07 * 50.0_f64.sqrt() * depth.powf(1.5);
        assert!((force / expected - 1.0).abs() < 0.01, "{force} N instead of {expected} N");
    }
}

#[test]
fn another_gap_computes_its_row_and_all_stages_group_by_the_gap() {
    let bench = Bench::new();
    let study = |gaps: &str| {
        pressed(&format!("control = 'gap'; gaps = [{gaps}]; gap_bins = {{ count = 10, to = 5 }}"))
            .aggregate("means", "over = ['area_fraction', 'pressure']; statistics = ['mean']")
            .text()
    };
    bench.run(&study("'0.5 um', '0.2 um'"));
    let before = bench.table("pressed", "contact");
    let more = study("'0.5 um', '0.2 um', '0.35 um', '9 um'");
    let explained = bench.write(&more);
    let output = bench.output(&["explain", explained.to_str().unwrap(), "contact", "--json"]);
    let explained: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(explained["stages"][0]["reasons"][0]["rows"], 4, "{explained}");
    bench.run(&more);
    let after = bench.table("pressed", "contact");
    assert_eq!(after.rows(), 8);
    let known = [0.2, 0.5];
    let gaps = reals(&after, "prescribed_gap");
    let kept: Vec<usize> = (0..8).filter(|&row| known.contains(&gaps[row])).collect();
    assert_eq!(after.pick(&kept).without(&["task"]), before.without(&["task"]));
    // The surfaces do not touch at 9 µm.
    let apart: Vec<usize> = (0..8).filter(|&row| gaps[row] == 9.0).collect();
    for &row in &apart {
        assert_eq!(after.texts("stop").unwrap().value(row), "no-contact");
        assert_eq!((reals(&after, "load")[row], counts(&after, "contact_nodes")[row]), (0.0, 0));
        assert_eq!(reals(&after, "mean_gap")[row], 9.0);
    }
    let means = bench.table("pressed", "means");
    assert_eq!(reals(&means, "prescribed_gap"), [0.2, 0.35, 0.5, 9.0]);
    assert_eq!(counts(&means, "surfaces"), [2; 4]);
    let areas = reals(&means, "area_fraction_mean");
    assert!(areas[0] > areas[1] && areas[1] > areas[2] && areas[3] == 0.0, "{areas:?}");
    let manifest = bench.path("study.toml");
    let report = bench.output(&["report", manifest.to_str().unwrap()]);
    assert!(report.status.success(), "{}", text(&report.stderr));
    assert!(bench.data().join("results/pressed/report.html").exists());
    // Maps are chosen by the gap.
    let picture = bench.path("map.png");
    let task = ["view", manifest.to_str().unwrap(), "contact", "realization=0", "--map", "gap"];
    let view = |gap: &str| {
        let options = ["--gap", gap, "--replace", "-o", picture.to_str().unwrap()];
        text(&bench.output(&[&task[..], &options].concat()).stdout)
    };
    assert!(view("350 nm").contains("gap at mean gap 0.35 µm"), "{}", view("350 nm"));
    let apart = view("9 um");
    assert!(apart.contains("gap at mean gap 9 µm"), "{apart}");
    let export = bench.path("gaps.npz");
    let file = ["--output", export.to_str().unwrap()];
    let task = ["export", manifest.to_str().unwrap(), "contact", "realization=0", "--map", "gap"];
    assert!(bench.output(&[&task[..], &file].concat()).status.success());
    let names = String::from_utf8_lossy(&fs::read(export).unwrap()).into_owned();
    assert!(names.contains("prescribed_gap.npy"));
}
