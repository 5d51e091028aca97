//! What flows through the gap, from end to end.

use arrow::array::Array;

use crate::bench::Bench;
use crate::columns::assert_kept;

const LEAKING: &str = r#"
[study]
name = "leaking"
seed = 5

[stage.surfaces]
kind = "generate"
nodes = 64
hurst = 0.8
k_lower = 2
k_upper = 16
realizations = 3

[stage.contact]
kind = "solve"
from = "surfaces"
loads = { from = 0.0, to = 0.8, steps = 8 }
flow = true

[stage.area]
kind = "measure"
from = "contact"
stiffness = true
"#;

#[test]
fn a_gap_leaks_while_it_percolates_and_less_under_each_load() {
    let bench = Bench::new();
    bench.run(LEAKING);
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
    assert!(
        reals("flow_residual")
            .iter()
            .flatten()
            .all(|residual| residual <= 1e-6)
    );
    assert_kept(&bench, "leaking", &bench.path("study.toml"));
}

#[test]
fn interfaces_become_stiffer_under_load_and_the_ends_of_a_block_have_no_slope() {
    let bench = Bench::new();
    bench.run(LEAKING);
    let area = bench.table("leaking", "area");
    let stiffness = area.reals("stiffness").unwrap();
    for surface in 0..3 {
        let of = |load: usize| 8 * surface + load;
        assert!(stiffness.is_null(of(0)) && stiffness.is_null(of(7)));
        let inner: Vec<f64> = (1..7).map(|load| stiffness.value(of(load))).collect();
        assert!(inner.is_sorted() && inner[0] > 0.0, "{inner:?}");
    }
}

#[test]
fn a_flow_changes_no_other_column() {
    let bench = Bench::new();
    bench.run(LEAKING);
    let with = bench.table("leaking", "contact");
    bench.run(&LEAKING.replace("flow = true", ""));
    let without = bench.table("leaking", "contact");
    // Another question is another task.
    let columns = without.without(&["task"]);
    assert_eq!(with.only(&columns.names()), columns);
    assert_eq!(with.names().len(), without.names().len() + 6);
}
