//! Surfaces without stored heights, and the distribution of heights over many surfaces.

use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use arrow::array::Array;
use asperity::tables::table::Table;

use crate::bench::{Bench, assert_same_files, is_idle};
use crate::manifest::manifest;

static SPECTRA: LazyLock<String> = LazyLock::new(|| {
    manifest("spectra", "seed = 7")
        .generate(
            "surfaces",
            "nodes = 32; hurst = 0.8; k_lower = 2; k_upper = [4, 16]; realizations = 3; \
             heights = 'redraw'",
        )
        .aggregate("table", "over = ['nayak', 'skewness']")
        .text()
});

static DISTRIBUTION: LazyLock<String> = LazyLock::new(|| {
    manifest("distribution", "seed = 7")
        .generate(
            "surfaces",
            "nodes = 64; hurst = 0.8; k_lower = [1, 4]; k_upper = 16; realizations = 3",
        )
        .measure("each", "bins = 20; range = 3.0")
        .measure("pooled", "from = 'surfaces'; bins = 20; range = 3.0; pool = true")
        .aggregate("most", "over = ['density_sd']; group_by = ['k_lower']; statistics = ['max']")
        .text()
});

fn values(table: &Table, name: &str) -> Vec<f64> {
    table.reals(name).unwrap().iter().map(Option::unwrap).collect()
}

#[test]
fn a_surface_without_heights_differs_by_what_only_a_mesh_can_tell() {
    let (seen, unseen) = (Bench::new(), Bench::new());
    seen.run(&SPECTRA);
    unseen.run(&SPECTRA.replace("redraw", "none"));
    let [seen, unseen] = [seen, unseen].map(|bench| bench.table("spectra", "surfaces"));
    let of_the_mesh = ["skewness", "excess_kurtosis", "full_contact_load"];
    for name in of_the_mesh {
        assert_eq!(seen.reals(name).unwrap().null_count(), 0);
        assert_eq!(unseen.reals(name).unwrap().null_count(), 6);
    }
    let others = |table: &Table| table.without(&of_the_mesh).without(&["task"]);
    assert_eq!(others(&seen), others(&unseen));
}

#[test]
fn statistics_of_surfaces_with_and_without_heights_are_different_work() {
    let bench = Bench::new();
    bench.run(&SPECTRA);
    let without = bench.plan(&SPECTRA.replace("redraw", "none"));
    assert_eq!((without["surfaces"].cached, without["table"].cached), (0, 0));
    bench.run(&SPECTRA.replace("redraw", "none"));
    assert!(bench.plan(&SPECTRA).values().all(is_idle));
    let skewness = bench.table("spectra", "table");
    assert_eq!(skewness.reals("skewness_mean").unwrap().null_count(), 2);
}

#[test]
fn summit_density_of_many_surfaces_is_that_of_the_lattice() {
    let bench = Bench::new();
    let many = SPECTRA.replace("redraw", "none").replace(
        "over = [\"nayak\", \"skewness\"]",
        "group_by = [\"k_upper\", \"summit_density_continuum\", \"summit_density_lattice\"]\n\
         over = [\"summit_density_integer\"]",
    );
    bench.run(&many.replace("realizations = 3", "realizations = 100"));
    let table = bench.table("spectra", "table");
    assert_eq!(table.rows(), 2);
    let sem = values(&table, "summit_density_integer_sem");
    let mean = values(&table, "summit_density_integer_mean");
    for (row, lattice) in values(&table, "summit_density_lattice").into_iter().enumerate() {
        // A mean of ratios differs from the ratio of means by a term of second order in the
        // scatter, here a few per cent, because the spectrum has few modes.
        assert!((mean[row] - lattice).abs() < 4.0 * sem[row] + 0.02 * lattice);
        assert!(sem[row] < 0.05 * lattice);
    }
}

#[test]
fn pooled_densities_are_mean_and_deviation_of_those_of_each_surface() {
    let bench = Bench::new();
    let counts = bench.run(&DISTRIBUTION);
    assert_eq!((counts["each"].computed, counts["pooled"].computed), (6, 2));
    let (each, pooled) =
        (bench.table("distribution", "each"), bench.table("distribution", "pooled"));
    assert_eq!((each.rows(), pooled.rows()), (120, 40));
    assert!(!pooled.has("surface") && !pooled.has("realization"));
    let densities = values(&each, "density");
    let (means, deviations) = (values(&pooled, "density_mean"), values(&pooled, "density_sd"));
    for (row, mean) in means.into_iter().enumerate() {
        let (point, bin) = (row / 20, row % 20);
        let of = [0, 1, 2].map(|surface| densities[20 * (3 * point + surface) + bin]);
        let expected = of.iter().sum::<f64>() / 3.0;
        assert!((mean - expected).abs() < 1e-14);
        let squares: f64 = of.iter().map(|density| (density - expected).powi(2)).sum();
        assert!((deviations[row] - (squares / 2.0).sqrt()).abs() < 1e-14);
    }
}

#[test]
fn the_lower_cutoff_decides_how_normal_heights_are() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("manifests/heights.toml");
    let manifest = fs::read_to_string(path).unwrap();
    // The same study with a coarser mesh, shorter spectra and fewer surfaces.
    let small = manifest
        .replace("nodes = 512", "nodes = 256")
        .replace("k_upper = [32, 128]", "k_upper = [16, 64]")
        .replace("k_lower = [1, 4, 16]", "k_lower = [1, 4]")
        .replace("realizations = 1000", "realizations = 60");
    let bench = Bench::new();
    let counts = bench.run(&small);
    assert_eq!(counts["density"].computed, 4);
    assert_eq!(bench.table("heights", "single-density").rows(), 12_000);

    let kurtosis = bench.table("heights", "kurtosis");
    let mean = values(&kurtosis, "kurtosis_mean");
    let of_modes = values(&kurtosis, "kurtosis_of_modes");
    let sem = values(&kurtosis, "difference_sem");
    for row in 0..4 {
        assert!((mean[row] - of_modes[row]).abs() < 3.5 * sem[row], "{row}");
    }
    // The rows have (k_lower, k_upper) = (1, 16), (1, 64), (4, 16), (4, 64).
    let spread = values(&bench.table("heights", "spread"), "integral_of_sd");
    assert!(spread[0].min(spread[1]) > 2.0 * spread[2].max(spread[3]));
    assert!((spread[0] / spread[1] - 1.0).abs() < 0.15);
}

#[test]
fn a_pooled_surface_need_not_be_kept() {
    let (kept, redrawn) = (Bench::new(), Bench::new());
    kept.run(&DISTRIBUTION);
    redrawn
        .run(&DISTRIBUTION.replace("realizations = 3", "realizations = 3\nheights = \"redraw\""));
    let table = |bench: &Bench| bench.table("distribution", "pooled");
    assert_eq!(table(&kept), table(&redrawn));
}

#[test]
fn threads_change_no_pooled_bit() {
    let (one, two) = (Bench::new(), Bench::new());
    one.run_with(&DISTRIBUTION, &["--jobs", "1"]);
    two.run_with(&DISTRIBUTION, &["--jobs", "3"]);
    assert_same_files(&one.files(), &two.files());
}
