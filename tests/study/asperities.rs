//! Asperity models compared with the solver, from manifest to table.

use std::sync::LazyLock;

use arrow::array::Array;
use asperity::tables::table::Table;

use crate::bench::Bench;
use crate::manifest::manifest;
use crate::report::report;

static ASPERITIES: LazyLock<String> = LazyLock::new(|| {
    manifest("asperities", "seed = 1")
        .generate(
            "surfaces",
            "nodes = 64; hurst = 0.8; k_lower = 2; k_upper = 8; realizations = 2; \
             heights = 'redraw'",
        )
        .solve("solved", "loads = [0.01, 0.02]")
        .solve(
            "summits",
            "from = 'surfaces'; method = 'asperities'; \
             interaction = ['none', 'mean-field', 'explicit']; loads = [0.01, 0.02]",
        )
        .measure("area", "from = ['solved', 'summits']")
        .text()
});

#[test]
fn asperity_models_have_about_the_contact_area_of_the_solver() {
    let bench = Bench::new();
    bench.run(&ASPERITIES);
    let summits = bench.table("asperities", "summits");
    assert_eq!(summits.rows(), 3 * 2 * 2);
    let areas = summits.reals("asperity_area_fraction").unwrap();
    let interactions = summits.texts("interaction").unwrap();
    let solved = bench.table("asperities", "solved");
    for row in 0..summits.rows() {
        // At equal loads, the Hertz contacts of the summits have about the area of the solution.
        let coordinates = |table: &Table, row: usize| {
            let surface = table.texts("surface").unwrap().value(row).to_owned();
            (surface, table.reals("load").unwrap().value(row).to_bits())
        };
        let same_row = (0..solved.rows())
            .find(|&other| coordinates(&solved, other) == coordinates(&summits, row));
        let nodes = solved.integers("contact_nodes").unwrap();
        let area = nodes.value(same_row.unwrap()) as f64 / 4096.0;
        let share = areas.value(row) / area;
        assert!((0.4..1.6).contains(&share), "{share}");
        assert!(summits.integers("contacts").unwrap().value(row) > 0);
        assert_eq!(summits.texts("stop").unwrap().value(row), "converged");
    }
    // A uniform displacement only shifts the plane.
    let of = |word: &str| -> Vec<f64> {
        let rows = (0..summits.rows()).filter(|&row| interactions.value(row) == word);
        rows.map(|row| areas.value(row)).collect()
    };
    assert_eq!(of("none"), of("mean-field"));
    assert_ne!(of("none"), of("explicit"));
    let area = bench.table("asperities", "area");
    let solved = area.texts("interaction").unwrap();
    assert_eq!((area.rows(), solved.null_count()), (16, 4));
}

#[test]
fn what_is_solved_keeps_its_columns() {
    let bench = Bench::new();
    bench.run(&ASPERITIES);
    let solved = bench.table("asperities", "solved");
    assert!(!solved.has("interaction") && !solved.has("contacts"));
}

#[test]
fn a_page_draws_models_over_the_solution() {
    let bench = Bench::new();
    bench.run(&ASPERITIES);
    let (said, page) = report(&bench);
    let title = "Asperity models beside the solution";
    let drawn = said["drawn"].as_array().unwrap();
    assert!(drawn.iter().any(|one| one == title), "{said}");
    for interaction in ["no interaction", "mean field", "explicit interaction"] {
        assert!(page.contains(interaction), "{interaction}");
    }
}
