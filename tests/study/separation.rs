//! Exponential relation between load and mean gap, from surfaces to the fit.

use std::sync::LazyLock;

use crate::bench::{Bench, text};
use crate::manifest::manifest;

static PRESSED: LazyLock<String> = LazyLock::new(|| {
    manifest("separation", "seed = 11")
        .generate(
            "surfaces",
            "nodes = 128; hurst = 0.8; k_lower = 4; k_upper = 32; side = 1e-3; rms_slope = 0.1; \
             realizations = 6",
        )
        .solve("contact", "loads = { from = 0.01, to = 0.1, steps = 6, spacing = 'geometric' }")
        .measure("area", "")
        .fit("separation", "law = 'load-separation'; bootstrap = 200")
        .text()
});

#[test]
fn the_mean_gap_falls_by_half_an_rms_height_while_the_load_grows_by_e() {
    let bench = Bench::new();
    bench.run(&PRESSED);
    let fits = bench.table("separation", "separation");
    assert_eq!(fits.rows(), 1);
    assert_eq!(fits.texts("status").unwrap().value(0), "fitted");
    let value = |name: &str| fits.reals(name).unwrap().value(0);
    let surfaces = bench.table("separation", "surfaces");
    let heights = surfaces.reals("rms_height").unwrap().values();
    let rms_height = heights.iter().sum::<f64>() / heights.len() as f64;
    // Persson (2007) predicts a decay length of the order of the rms height. A larger study (four
    // times the nodes, twice the range of wavelengths) gives a ratio of 0.46. The precision of six
    // surfaces is a few per cent.
    let share = value("decay_length") / rms_height;
    assert!((share - 0.46).abs() < 0.04, "{share}");
    assert!(value("decay_length_lower") < value("decay_length"));
    assert!(value("decay_length") < value("decay_length_upper"));
    // The residual of the logarithm of the load is a few per cent.
    assert!(value("rms_residual") < 0.05, "{}", value("rms_residual"));
    let path = bench.path("study.toml");
    let printed = text(&bench.output(&["run", path.to_str().unwrap()]).stdout);
    assert!(printed.contains("u₀"), "{printed}");
}
