//! Random surfaces whose heights are not Gaussian.

use arrow::array::Array;
use asperity::tables::table::Table;

use crate::bench::{Bench, assert_same_files, real};
use crate::manifest::manifest;
use crate::reference::assert_near;

const KEYS: &str = "hurst = 0.8; k_lower = 4; k_upper = 32; rms_slope = 0.1";

fn assert_equal(name: &str, one: (&Table, usize), other: (&Table, usize)) {
    assert_near(&[real(one.0, name, one.1)], &[real(other.0, name, other.1)], 1e-12);
}

#[test]
fn skewed_surfaces_have_the_spectrum_of_gaussian_ones_on_any_mesh() {
    let bench = Bench::new();
    let text = manifest("skewed", "seed = 3")
        .generate("gaussian", &format!("nodes = 96; {KEYS}"))
        .generate("skewed", &format!("nodes = [96, 192]; {KEYS}; skewness = -1.0; kurtosis = 5.0"))
        .text();
    bench.run(&text);
    let [gaussian, skewed] = ["gaussian", "skewed"].map(|stage| bench.table("skewed", stage));
    for row in 0..2 {
        for name in ["rms_slope", "rms_height", "nayak", "m40", "effective_modes"] {
            assert_equal(name, (&skewed, row), (&gaussian, 0));
        }
        assert_eq!(real(&skewed, "target_skewness", row), -1.0);
        assert_eq!(real(&skewed, "target_kurtosis", row), 5.0);
        assert!((real(&skewed, "skewness", row) + 1.0).abs() < 0.02);
        assert!((real(&skewed, "excess_kurtosis", row) - 2.0).abs() < 0.15);
        assert!(real(&skewed, "height_deviation", row) < 0.02);
    }
    assert!(!gaussian.has("height_deviation") && !gaussian.has("target_skewness"));
}

#[test]
fn surfaces_have_the_heights_and_the_spectrum_of_another_one() {
    let bench = Bench::new();
    let text = manifest("likeness", "seed = 3")
        .generate("scan", &format!("nodes = 96; {KEYS}; skewness = -1.5; kurtosis = 6.0"))
        .measure("spectrum", "what = 'spectrum'")
        .generate(
            "alike",
            "from = 'spectrum'; method = 'spectrum'; nodes = 128; side = 1.0; seed = 8; \
             height_distribution = 'scan'; realizations = 2",
        )
        .generate("other", &format!("nodes = 64; {KEYS}; height_distribution = 'scan'; seed = 9"))
        .text();
    bench.run(&text);
    let [scan, alike, other] =
        ["scan", "alike", "other"].map(|stage| bench.table("likeness", stage));
    for (table, row) in [(&alike, 0), (&alike, 1), (&other, 0)] {
        assert!((real(table, "skewness", row) - real(&scan, "skewness", 0)).abs() < 0.05);
        assert!(
            (real(table, "excess_kurtosis", row) - real(&scan, "excess_kurtosis", 0)).abs() < 0.3
        );
        let name = table.texts("heights_of").unwrap().value(row).to_owned();
        assert!(scan.texts("surface").unwrap().value(0).starts_with(&name));
    }
    assert_eq!(alike.reals("height_deviation").unwrap().null_count(), 0);
}

#[test]
fn threads_do_not_change_the_tables() {
    let text = manifest("threads", "seed = 3")
        .generate("surfaces", &format!("nodes = 96; {KEYS}; kurtosis = 2.0; realizations = 4"))
        .text();
    let benches = ["1", "3"].map(|jobs| {
        let bench = Bench::new();
        bench.run_with(&text, &["--jobs", jobs]);
        bench
    });
    let [one, three] = &benches;
    assert_same_files(&one.published("threads"), &three.published("threads"));
}

#[test]
fn a_distribution_that_the_spectrum_does_not_allow_is_told() {
    let bench = Bench::new();
    let keys =
        "nodes = 64; hurst = 0.8; k_lower = 1; k_upper = 1; skewness = -2.0; kurtosis = 10.0";
    let path = bench.write(&manifest("few", "").generate("surfaces", keys).text());
    let output = bench.output(&["run", path.to_str().unwrap()]);
    let printed = crate::bench::text(&[output.stdout, output.stderr].concat());
    assert!(printed.contains("`height_deviation` up to 0."), "{printed}");
}
