//! Surfaces that have yielded: they are pressed and measured as all others.

use std::fs;
use std::sync::LazyLock;

use asperity::tables::store::Store;
use asperity::tables::table::Table;

use crate::bench::{Bench, assert_same_files, is_idle, real, study_of_map, text};
use crate::manifest::{manifest, stages_from};

/// Data of an independent solver by projected gradients.
fn reference(name: &str) -> String {
    format!("{}/crates/mechanics/tests/data/unloading/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// Returns the numbers of a NumPy file, of which `number` reads one.
fn numbers<const SIZE: usize>(name: &str, number: fn([u8; SIZE]) -> f64) -> Vec<f64> {
    const HEADER: usize = 128;
    let bytes = fs::read(reference(name)).unwrap();
    let numbers = bytes[HEADER..].chunks_exact(SIZE);
    numbers.map(|bytes| number(bytes.try_into().unwrap())).collect()
}

/// Reads a column of maps of the task to which a row of a table belongs, for all rows of the task.
fn maps(bench: &Bench, table: &Table, row: usize, column: &str) -> Vec<Vec<f64>> {
    let key = table.texts("task").unwrap().value(row).parse().unwrap();
    let store = Store::open_read_only(&bench.data().join("store")).unwrap();
    let (task, _) = store.read_with_provenance(key).unwrap();
    let lists = task.lists(column).unwrap();
    let map = |row| {
        let values = lists.value(row);
        let values = values.as_any().downcast_ref::<arrow::array::Float64Array>().unwrap();
        values.iter().map(|value| value.unwrap_or(0.0)).collect()
    };
    (0..task.rows()).map(map).collect()
}

/// A cycle on the map of the reference, and the surface after its largest load, pressed again.
fn cycle() -> String {
    let stages = &stages_from("surface")
        .solve(
            "contact",
            "loads = [0.02, 0.1, 0.25, 0.15, 0.05, 0.01]; load_unit = 'absolute'; hardness = 0.6; \
             path = 'as-given'; pressures = 'all'; tolerance = 1e-9",
        )
        .generate("run-in", "from = 'contact'; method = 'yielded'")
        .solve(
            "again",
            "loads = [0.01, 0.05, 0.15, 0.25, 0.3]; load_unit = 'absolute'; hardness = 0.6; \
             pressures = 'all'; tolerance = 1e-9",
        )
        .text();
    study_of_map("cycle", &reference("heights.npy"), stages)
}

#[test]
fn the_pressure_at_which_a_surface_yielded_has_the_unit_of_its_contact() {
    let bench = Bench::new();
    let modulus = "effective_modulus = \"1 GPa\"\nload_unit = \"GPa\"\n";
    let study = cycle().replace("load_unit = \"absolute\"\n", modulus);
    let study = study.replace("hardness = 0.6", "hardness = \"0.6 GPa\"");
    let manifest = bench.write(&format!(
        "{study}\n[stage.rough]\nkind = \"measure\"\nfrom = [\"surface\", \"run-in\"]\nwhat = \"roughness\"\n"
    ));
    let output = bench.output(&["columns", manifest.to_str().unwrap(), "rough"]);
    let printed = text(&output.stdout);
    let line = printed.lines().find(|line| line.contains("yielded_pressure"));
    let line = line.unwrap_or_else(|| panic!("{printed}{}", text(&output.stderr)));
    assert!(line.contains("GPa"), "{line}");
}

#[test]
fn a_surface_that_has_yielded_has_lost_the_plastic_depth_of_an_independent_solver() {
    let bench = Bench::new();
    bench.run(&cycle());
    let table = bench.table("cycle", "run-in");
    let found = &maps(&bench, &table, 0, "heights")[0];
    let heights = numbers("heights.npy", f64::from_le_bytes);
    let depths = numbers("residual_depth.npy", |bytes| f64::from(f32::from_le_bytes(bytes)));
    let most = depths.iter().copied().fold(0.0, f64::max);
    assert!(most > 0.02, "{most}");
    for ((found, height), depth) in found.iter().zip(heights).zip(depths) {
        // The depths of the file are in single precision.
        assert!((height - depth - found).abs() < 1e-7 * most, "{height} {depth} {found}");
    }
    assert_eq!(table.texts("method").unwrap().value(0), "yielded");
    assert_eq!(real(&table, "yielded_pressure", 0), 0.25);
    assert_eq!(real(&table, "yielded_hardness", 0), 0.6);
    let before = bench.table("cycle", "surface");
    let name = |table: &Table, column: &str| table.texts(column).unwrap().value(0).to_owned();
    assert_eq!(name(&table, "original_surface"), name(&before, "surface"));
    assert!(real(&table, "rms_slope", 0) < 0.95 * real(&before, "rms_slope", 0));
}

#[test]
fn loading_again_is_elastic_along_the_curve_of_unloading_up_to_the_former_maximum() {
    let bench = Bench::new();
    bench.run(&cycle());
    let (contact, again) = (bench.table("cycle", "contact"), bench.table("cycle", "again"));
    let row = |table: &Table, load: f64, is_meant: &dyn Fn(usize) -> bool| {
        let mut rows = 0..table.rows();
        rows.find(|&row| real(table, "pressure", row) == load && is_meant(row)).unwrap()
    };
    let branches = contact.texts("branch").unwrap();
    let is_unloading = |row: usize| branches.value(row) == "unloading";
    for load in [0.01, 0.05, 0.15] {
        let down = row(&contact, load, &is_unloading);
        let up = row(&again, load, &|_| true);
        let nodes = |table: &Table, row| table.integers("contact_nodes").unwrap().value(row);
        assert_eq!(nodes(&contact, down), nodes(&again, up), "{load}");
        assert_eq!(again.integers("saturated_nodes").unwrap().value(up), 0);
        assert_eq!(real(&again, "mean_yielded_depth", up), 0.0);
        for column in ["mean_gap", "peak_pressure", "energy"] {
            let [one, other] =
                [(&contact, down), (&again, up)].map(|(table, row)| real(table, column, row));
            assert!((one - other).abs() < 1e-8, "{column} under {load}: {one} {other}");
        }
        // Rows of a task are in ascending order of the loads.
        let rank = |loads: &[f64]| loads.iter().position(|one| *one == load).unwrap();
        let unloaded = &maps(&bench, &contact, down, "pressures")[rank(&[0.01, 0.05, 0.15])];
        let loaded = &maps(&bench, &again, up, "pressures")[rank(&[0.01, 0.05, 0.15])];
        let error = unloaded.iter().zip(loaded).map(|(one, other)| (one - other).abs());
        assert!(error.fold(0.0, f64::max) < 1e-7, "pressures under {load}");
    }
    // At the former maximum, the state is that of the first loading, without further yielding.
    let (before, after) =
        (row(&contact, 0.25, &|row| !is_unloading(row)), row(&again, 0.25, &|_| true));
    let gap = |table, row| real(table, "mean_gap", row);
    assert!((gap(&contact, before) - gap(&again, after)).abs() < 1e-8);
    assert!(real(&again, "mean_yielded_depth", after) < 1e-8);
    assert!(real(&again, "mean_yielded_depth", row(&again, 0.3, &|_| true)) > 1e-3);
}

static SWEEP: LazyLock<String> = LazyLock::new(|| {
    manifest("sweep", "seed = 3")
        .generate(
            "surfaces",
            "nodes = 32; hurst = 0.8; k_lower = 2; k_upper = [4, 8]; rms_slope = 0.1; \
             realizations = 2",
        )
        .solve("first", "loads = [0.05, 0.2]; hardness = [0.5, 0.8]; hardness_unit = 'relative'")
        .generate("run-in", "from = 'first'; method = 'yielded'; load = [0.05, 0.2]")
        .solve("second", "loads = [0.1]")
        .measure("area", "")
        .measure("roughness", "from = ['surfaces', 'run-in']; what = 'roughness'")
        .aggregate("mean", "from = 'area'; over = 'area_fraction'; statistics = ['mean']")
        .text()
});

#[test]
fn rows_tell_surfaces_apart_by_load_hardness_and_what_they_were() {
    let bench = Bench::new();
    bench.run(&SWEEP);
    let table = bench.table("sweep", "run-in");
    assert_eq!(table.rows(), 2 * 2 * 2 * 2);
    let area = bench.table("sweep", "area");
    assert_eq!(area.rows(), 16);
    for table in [&table, &area] {
        assert_eq!(real(table, "from_rms_slope", 0), 0.1);
        assert!(real(table, "rms_slope", 0) < 0.1);
        assert_eq!(real(table, "hurst", 0), 0.8);
        let originals = table.texts("original_surface").unwrap();
        let originals: std::collections::BTreeSet<_> = originals.iter().flatten().collect();
        assert_eq!(originals.len(), 4);
    }
    // One mean over two surfaces for each cutoff, hardness and load.
    let mean = bench.table("sweep", "mean");
    assert_eq!(mean.rows(), 8);
    assert!(mean.integers("surfaces").unwrap().iter().all(|number| number == Some(2)));
    // The original surfaces have no load under which they yielded.
    let roughness = bench.table("sweep", "roughness");
    assert_eq!(roughness.reals("yielded_load").unwrap().iter().flatten().count(), 16);
    assert_eq!(roughness.rows(), 20);
}

#[test]
fn surfaces_do_not_depend_on_threads_storage_or_the_other_loads() {
    let whole = Bench::new();
    whole.run_with(&SWEEP, &["--jobs", "3"]);
    let extended = Bench::new();
    extended.run_with(&SWEEP.replace("load = [0.05, 0.2]", "load = 0.2"), &["--jobs", "1"]);
    let counts = extended.run_with(&SWEEP, &["--jobs", "1"]);
    assert_eq!((counts["run-in"].cached, counts["run-in"].computed), (8, 8));
    assert!(is_idle(&counts["first"]));
    assert_same_files(&extended.published("sweep"), &whole.published("sweep"));
    let redrawn = Bench::new();
    redrawn
        .run(&SWEEP.replace("load = [0.05, 0.2]\n", "load = [0.05, 0.2]\nheights = \"redraw\"\n"));
    for stage in ["second", "area", "roughness"] {
        let [one, other] = [&whole, &redrawn].map(|bench| bench.table("sweep", stage));
        let without_keys = |table: &Table| table.without(&["task"]);
        assert_eq!(without_keys(&one), without_keys(&other), "{stage}");
    }
}

#[test]
fn a_contact_that_does_not_converge_gives_no_surface() {
    let bench = Bench::new();
    let study = SWEEP.replace("hardness_unit", "max_pairs = 2\nhardness_unit");
    let path = bench.write(&study);
    let output = bench.output(&["run", path.to_str().unwrap()]);
    assert!(!output.status.success());
    let told = text(&output.stderr);
    assert!(told.contains("did not converge within 2 pairs of transforms"), "{told}");
}
