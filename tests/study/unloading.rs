//! Studies of materials with a hardness under loads that decrease and grow again.

use asperity::tables::table::Table;

use crate::bench::{Bench, assert_same_files, real, study_of_map, text};
use crate::manifest::stages_from;

/// Data of an independent solver by projected gradients.
fn reference(name: &str) -> String {
    format!("{}/crates/mechanics/tests/data/unloading/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn study(loads: &str) -> String {
    let stages = stages_from("surface")
        .solve(
            "contact",
            &format!(
                "loads = {loads}; load_unit = 'absolute'; hardness = 0.6; path = 'as-given'; \
                 tolerance = 1e-9"
            ),
        )
        .measure("area", "")
        .text();
    study_of_map("cycle", &reference("heights.npy"), &stages)
}

/// Returns the row of a load on the first loading, or after the load `largest`.
fn row(table: &Table, load: f64, largest: Option<f64>) -> usize {
    let branches = table.texts("branch").unwrap();
    let maxima = table.reals("maximum_load").unwrap();
    let branch = if largest.is_some() { "unloading" } else { "loading" };
    let is_wanted = |row: &usize| {
        branches.value(*row) == branch
            && maxima.iter().nth(*row).unwrap() == largest
            && real(table, "pressure", *row) == load
    };
    (0..table.rows()).find(is_wanted).unwrap()
}

#[test]
fn states_of_a_cycle_are_those_of_an_independent_solver() {
    let bench = Bench::new();
    let cycle = "[0.02, 0.05, 0.1, 0.15, 0.1, 0.05, 0.02, 0.005, 0.02, 0.1, 0.15, 0.2, 0.25, 0.15, \
                 0.05, 0.01]";
    bench.run(&study(cycle));
    let contact = bench.table("cycle", "contact");
    // Six loads that were never exceeded, four below 0.15, and three below 0.25.
    assert_eq!(contact.rows(), 13);
    let file = std::fs::read_to_string(reference("cycle.csv")).unwrap();
    let rows: Vec<Vec<f64>> = file
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|number| number.parse().unwrap()).collect())
        .collect();
    for expected in rows {
        let [code, load, area, _, _, gap, depth, peak] = expected[..8] else { panic!("columns") };
        let largest = match code {
            0.0 => None,
            3.0 => Some(0.25),
            _ => Some(0.15).filter(|largest| load < *largest),
        };
        let row = row(&contact, load, largest);
        let nodes = contact.integers("contact_nodes").unwrap().value(row) as f64;
        assert_eq!(nodes, (area * 4096.0).round(), "load {load}, code {code}");
        assert!((real(&contact, "mean_gap", row) - gap).abs() < 1e-9);
        assert!((real(&contact, "residual_depth", row) - depth).abs() < 1e-9);
        assert!((real(&contact, "plastic_work", row) - 0.6 * depth).abs() < 1e-9);
        assert!((real(&contact, "peak_pressure", row) - peak).abs() < 2e-8);
    }
    // The same load has more contact after a larger one.
    let area = bench.table("cycle", "area");
    let fraction = |largest| real(&area, "area_fraction", row(&area, 0.05, largest));
    assert!(fraction(Some(0.15)) > 1.4 * fraction(None));
}

#[test]
fn more_unloading_keeps_the_rows_that_exist() {
    let extended = Bench::new();
    extended.run(&study("[0.1, 0.15, 0.05]"));
    extended.run(&study("[0.1, 0.15, 0.05, 0.02, 0.2, 0.1]"));
    let anew = Bench::new();
    anew.run(&study("[0.1, 0.15, 0.05, 0.02, 0.2, 0.1]"));
    assert_same_files(&extended.published("cycle"), &anew.published("cycle"));
    assert_eq!(anew.table("cycle", "contact").rows(), 6);
}

#[test]
fn a_path_without_memory_is_refused() {
    let bench = Bench::new();
    let path = bench.write(&study("[0.1, 0.05]").replace("hardness = 0.6", ""));
    let output = bench.output(&["check", path.to_str().unwrap()]);
    assert!(text(&output.stderr).contains("needs `adhesion` or a `hardness`"));
}

#[test]
fn gap_distributions_have_the_mean_gap_on_every_branch() {
    let bench = Bench::new();
    let gaps = "\n[stage.gaps]\nkind = \"measure\"\nfrom = \"contact\"\nwhat = \"gaps\"\n";
    let bins = "tolerance = 1e-9\ngap_bins = { count = 4000, to = 8.0 }";
    let manifest = study("[0.02, 0.15, 0.25, 0.1, 0.02]").replace("tolerance = 1e-9", bins) + gaps;
    bench.run(&manifest);
    let [surface, contact, gaps] =
        ["surface", "contact", "gaps"].map(|stage| bench.table("cycle", stage));
    let rms_height = real(&surface, "rms_height", 0);
    for (load, largest) in [(0.02, None), (0.25, None), (0.1, Some(0.25)), (0.02, Some(0.25))] {
        let is_of_load = |row: &usize| {
            real(&gaps, "pressure", *row) == load
                && gaps.reals("maximum_load").unwrap().iter().nth(*row).unwrap() == largest
        };
        let moment: f64 = (0..gaps.rows())
            .filter(is_of_load)
            .map(|row| {
                let nodes = gaps.integers("gap_nodes").unwrap().value(row) as f64;
                real(&gaps, "gap", row) * nodes / 4096.0
            })
            .sum();
        let mean_gap = real(&contact, "mean_gap", row(&contact, load, largest));
        // A gap differs from the centre of its bin by half a bin at most.
        let error = (moment * rms_height - mean_gap).abs();
        assert!(error < 1e-3 * rms_height, "{load}, {largest:?}: {moment} {mean_gap}");
    }
}
