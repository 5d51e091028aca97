//! Flow through the gap, from manifest to table.

use std::sync::LazyLock;

use arrow::array::Array;

use crate::bench::{Bench, text};
use crate::columns::assert_kept;
use crate::manifest::manifest;

static LEAKING: LazyLock<String> = LazyLock::new(|| {
    manifest("leaking", "seed = 5")
        .generate(
            "surfaces",
            "nodes = 64; hurst = 0.8; k_lower = 2; k_upper = 16; realizations = 3",
        )
        .solve("contact", "loads = { from = 0.0, to = 0.8, steps = 8 }; flow = true")
        .measure("area", "")
        .text()
});

#[test]
fn a_gap_leaks_while_it_percolates_and_less_under_each_load() {
    let bench = Bench::new();
    bench.run(&LEAKING);
    let area = bench.table("leaking", "area");
    let reals = |name: &str| area.reals(name).unwrap().clone();
    let mean_gap = reals("mean_gap");
    for axis in ["x", "y"] {
        let factor = reals(&format!("flow_factor_{axis}"));
        let conductivity = reals(&format!("flow_conductivity_{axis}"));
        let open = area.flags(&format!("gap_percolates_{axis}")).unwrap();
        assert_eq!(factor.null_count(), 0);
        for row in 0..area.rows() {
            assert_eq!(factor.value(row) > 0.0, open.value(row), "{axis} {row}");
            let expected = factor.value(row) * mean_gap.value(row).powi(3);
            assert!((conductivity.value(row) - expected).abs() <= 1e-12 * expected);
            assert!(factor.value(row) < 1.0);
            if row % 8 > 0 {
                assert!(conductivity.value(row) <= conductivity.value(row - 1));
            }
        }
    }
    assert!(reals("flow_residual").iter().flatten().all(|residual| residual <= 1e-6));
    assert_kept(&bench, "leaking", &bench.path("study.toml"));
}

#[test]
fn interfaces_become_stiffer_under_load_and_the_ends_of_a_block_have_no_slope() {
    let bench = Bench::new();
    let manifest = LEAKING
        .replace(
            "loads = { from = 0.0, to = 0.8, steps = 8 }\nflow = true",
            "loads = [0.1, 0.105, 0.11, 0.2, 0.21, 0.22, 0.23, 0.24]",
        )
        .replace("from = \"contact\"", "from = \"contact\"\nstiffness = true");
    bench.run(&manifest);
    let area = bench.table("leaking", "area");
    let stiffness = area.reals("stiffness_finite_difference").unwrap();
    for surface in 0..3 {
        let of = |load: usize| 8 * surface + load;
        // No central difference exists at both ends and on both sides of the jump from 0.11 to 0.2.
        for load in [0, 2, 3, 7] {
            assert!(stiffness.is_null(of(load)));
        }
        let inner: Vec<f64> = [1, 4, 5, 6].map(|load| stiffness.value(of(load))).into();
        assert!(inner.is_sorted() && inner[0] > 0.0, "{inner:?}");
    }
}

#[test]
fn a_paraboloid_on_a_free_half_space_is_as_stiff_as_hertz_says() {
    let bench = Bench::new();
    bench.run(
        &manifest("hertz", "")
            .generate("surfaces", "method = 'paraboloid'; nodes = 256; radius = 1.0")
            .solve(
                "contact",
                "boundary = 'free'; load_unit = 'absolute'; \
                 loads = [0.0019, 0.002, 0.0021, 0.0095, 0.01, 0.0105]",
            )
            .measure("area", "stiffness = true")
            .text(),
    );
    let area = bench.table("hertz", "area");
    let pressure = area.reals("pressure").unwrap();
    let stiffness = area.reals("stiffness_finite_difference").unwrap();
    for row in [1, 4] {
        // a³ = 3 F R/(4 E*) and dF/dδ = 2 E* a, with side, modulus and radius 1.
        let expected = 2.0 * (0.75 * pressure.value(row)).cbrt();
        let found = stiffness.value(row);
        // The mesh shifts the edge of the contact by less than half a node; the radius is about 30
        // nodes.
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
    }
}

#[test]
fn the_old_name_of_the_stiffness_is_answered_with_the_new_one() {
    let bench = Bench::new();
    let reduced = format!(
        "{}stiffness = true\n\n[stage.mean]\nkind = \"aggregate\"\nfrom = \"area\"\nover = [\"stiffness\"]\n",
        *LEAKING
    );
    let path = bench.write(&reduced);
    let output = bench.output(&["check", path.to_str().unwrap()]);
    let printed = text(&output.stderr);
    assert!(printed.contains("did you mean \"stiffness_finite_difference\"?"), "{printed}");
}

#[test]
fn a_flow_changes_no_other_column() {
    let bench = Bench::new();
    bench.run(&LEAKING);
    let with = bench.table("leaking", "contact");
    bench.run(&LEAKING.replace("flow = true", ""));
    let without = bench.table("leaking", "contact");
    // Other flow parameters give another task.
    let columns = without.without(&["task"]);
    assert_eq!(with.only(&columns.names()), columns);
    assert_eq!(with.names().len(), without.names().len() + 6);
}
