//! Rectangles, rectangular mesh cells, and free boundaries.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use arrow::array::{Array, AsArray};
use arrow::datatypes::Float64Type;
use asperity::tables::table::Table;
use serde_json::Value;

use crate::bench::{Bench, assert_same_files, is_idle, text};
use crate::manifest::manifest;
use crate::reference::column;

/// Folder of surfaces with reference solutions by independent code.
fn solved_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/mechanics/tests/data/rectangular-and-free")
}

/// Reads the loads of a reference solution from a text file with a header.
fn solved_by_others(name: &str) -> String {
    let path = solved_folder().join("rectangular_and_free.csv");
    let csv = fs::read_to_string(path).unwrap();
    let of_surface = |line: &&str| line.starts_with("name,") || line.starts_with(name);
    csv.lines().filter(of_surface).collect::<Vec<_>>().join("\n")
}

/// Returns a bench with one of these surfaces next to its manifest.
fn bench_with(name: &str) -> Bench {
    let bench = Bench::new();
    let file = format!("{name}.npy");
    let from = solved_folder().join(&file);
    fs::copy(from, bench.path(&file)).unwrap();
    bench
}

/// Imports a surface and presses it at the loads of the reference solution.
fn map_in_cell(name: &str, size: [f64; 2], boundary: &str) -> String {
    let pressures = column(&solved_by_others(name), "pressure");
    let is_periodic = boundary == "periodic";
    manifest("outside", "")
        .generate(
            "scan",
            &format!(
                "method = 'file'; path = '{name}.npy'; side = {size:?}; periodic = {is_periodic}"
            ),
        )
        .solve(
            "contact",
            &format!(
                "boundary = '{boundary}'; effective_modulus = 1.0; loads = {pressures:?}; \
                 load_unit = 'absolute'; tolerance = 1e-8; pressures = 'all'"
            ),
        )
        .measure("area", "")
        .text()
}

#[track_caller]
fn assert_agrees(csv: &str, name: &str, found: impl Fn(usize) -> f64, tolerance: f64) {
    for (row, expected) in column(csv, name).into_iter().enumerate() {
        let found = found(row);
        let error = (found / expected - 1.0).abs();
        assert!(error <= tolerance, "{name} in row {row}: {found} should be {expected}");
    }
}

fn agrees_with_independent_code(name: &str, size: [f64; 2], boundary: &str) {
    let csv = solved_by_others(name);
    let bench = bench_with(name);
    bench.run(&map_in_cell(name, size, boundary));
    let (area, contact) = (bench.table("outside", "area"), bench.table("outside", "contact"));
    assert_eq!(area.rows(), column(&csv, "load").len());
    for count in ["nodes_x", "nodes_y", "contact_nodes", "switches_x", "switches_y", "clusters"] {
        let found = area.integers(count).unwrap();
        assert_agrees(&csv, count, |row| found.value(row) as f64, 0.0);
    }
    for (table, real) in [
        (&area, "side_x"),
        (&area, "side_y"),
        (&area, "area_fraction"),
        (&contact, "mean_gap"),
        (&contact, "energy"),
        (&contact, "peak_pressure"),
        (&contact, "pressure"),
    ] {
        let found = table.reals(real).unwrap();
        assert_agrees(&csv, real, |row| found.value(row), 1e-6);
    }
    // S_d = Δy × switches_x + Δx × switches_y.
    let steps = [0, 1].map(|axis| size[axis] / column(&csv, ["nodes_x", "nodes_y"][axis])[0]);
    let [x, y] = ["switches_x", "switches_y"].map(|name| area.integers(name).unwrap());
    let perimeters = area.reals("perimeter_manhattan").unwrap();
    for row in 0..area.rows() {
        let perimeter = steps[1] * x.value(row) as f64 + steps[0] * y.value(row) as f64;
        assert!((perimeters.value(row) / perimeter - 1.0).abs() < 1e-14);
    }
    assert!(!area.has("nodes") && !area.has("side"));
}

#[test]
fn a_rectangle_has_the_contacts_that_another_code_finds() {
    agrees_with_independent_code("p192x320", [0.6, 1.0], "periodic");
}

#[test]
fn so_has_one_whose_cells_are_not_square() {
    agrees_with_independent_code("p256x160_cells", [1.0, 1.25], "periodic");
}

#[test]
fn so_has_one_with_nothing_beyond_its_edges() {
    agrees_with_independent_code("f128x192", [0.8, 1.2], "free");
}

fn reals(table: &Table, name: &str) -> Vec<f64> {
    table.reals(name).unwrap().values().to_vec()
}

#[test]
fn displacements_with_nothing_beyond_the_edges_are_absolute() {
    let bench = bench_with("f128x192");
    bench.run(&map_in_cell("f128x192", [0.8, 1.2], "free"));
    let scan = bench.with_maps("outside", "scan");
    let heights = scan.lists("heights").unwrap().value(0);
    let heights = heights.as_primitive::<Float64Type>().values().to_vec();
    let mean_height = heights.iter().sum::<f64>() / heights.len() as f64;
    let contact = bench.with_maps("outside", "contact");
    let pressures = contact.lists("pressures").unwrap();
    let column = |name: &str| contact.reals(name).unwrap().values().to_vec();
    let [mean_pressure, gap, sunk, energy] =
        ["pressure", "mean_gap", "mean_displacement", "energy"].map(column);
    for row in 0..contact.rows() {
        let list = pressures.value(row);
        let pressures = list.as_primitive::<Float64Type>().iter().map(Option::unwrap_or_default);
        let with_heights: f64 = pressures.zip(&heights).map(|(p, h)| p * h).sum();
        // In contact u = h + δ, elsewhere u = h + δ + g: ½⟨p u⟩ = ½⟨p h⟩ + ½⟨p⟩ δ.
        let offset = sunk[row] - mean_height - gap[row];
        let expected = 0.5 * (with_heights / heights.len() as f64 + mean_pressure[row] * offset);
        assert!((energy[row] / expected - 1.0).abs() < 1e-7, "{expected}");
    }
    assert_eq!(contact.texts("boundary").unwrap().value(0), "free");
}

#[test]
fn a_map_that_is_not_periodic_has_the_slope_of_its_differences() {
    let bench = bench_with("f128x192");
    bench.run(&map_in_cell("f128x192", [0.8, 1.2], "free"));
    let scan = bench.table("outside", "scan");
    assert_eq!(scan.texts("edges").unwrap().value(0), "open");
    // The modes of the map have an rms slope of 0.02. Differences between nodes underestimate it,
    // because the shortest wavelength is 7 nodes.
    let slope = scan.reals("rms_slope").unwrap().value(0);
    assert!((0.95..0.995).contains(&(slope / 0.02)), "{slope}");
    let load = bench.table("outside", "contact").reals("load").unwrap().value(0);
    assert!((load * slope / 1e-4 - 1.0).abs() < 1e-9, "reduced by this slope");
    for without_modes in ["effective_modes", "full_contact_load"] {
        assert!(scan.reals(without_modes).unwrap().is_null(0), "{without_modes}");
    }
    let output = bench.output(&["columns", bench.path("study.toml").to_str().unwrap(), "scan"]);
    let printed = text(&output.stdout);
    let printed = printed.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(printed.contains("differences between neighbouring nodes"), "{printed}");
}

static ROUGH: LazyLock<String> = LazyLock::new(|| {
    manifest("rough", "seed = 7")
        .generate(
            "surfaces",
            "nodes = [64, 32]; side = [2.0, 1.0]; hurst = 0.8; k_lower = 2; k_upper = [8, 16]; \
             realizations = 2",
        )
        .solve("contact", "loads = { to = 0.4, steps = 4 }")
        .measure("area", "")
        .correct("corrected", "correction = ['none', '2017']")
        .aggregate("curves", "over = ['area_corrected']; statistics = ['mean', 'sd']")
        .text()
});

/// Checks that a random surface on a rectangle has the statistics of a square.
#[test]
fn rectangles_are_drawn_pressed_measured_corrected_and_aggregated() {
    let bench = Bench::new();
    bench.run(&ROUGH);
    let surfaces = bench.table("rough", "surfaces");
    assert_eq!(surfaces.integers("nodes_x").unwrap().value(0), 64);
    assert_eq!(surfaces.reals("side_y").unwrap().value(0), 1.0);
    for slope in surfaces.reals("rms_slope").unwrap().values() {
        assert_eq!(*slope, 1.0);
    }
    let corrected = bench.table("rough", "corrected");
    let (areas, counted) =
        (reals(&corrected, "area_corrected"), reals(&corrected, "area_fraction"));
    let switches = corrected.integers("switches").unwrap();
    let names = corrected.texts("correction").unwrap();
    let c = (std::f64::consts::PI - 1.0 + std::f64::consts::LN_2) / 24.0;
    for row in 0..corrected.rows() {
        let coefficient = if names.value(row) == "none" { 0.0 } else { c };
        let expected = counted[row] - coefficient * switches.value(row) as f64 / (64.0 * 32.0);
        assert!((areas[row] - expected).abs() < 1e-15);
    }
    let curves = bench.table("rough", "curves");
    assert_eq!(curves.rows(), 2 * 2 * 4);
    assert!(curves.has("nodes_x") && curves.has("side_y"));
    // Repeating the run computes nothing, also if the pair is written out.
    assert!(bench.run(&ROUGH).values().all(is_idle));
    let before = tables(&bench);
    let outright = ROUGH.replace("[64, 32]", "[[64, 32]]").replace("[2.0, 1.0]", "[[2.0, 1.0]]");
    assert!(bench.run(&outright).values().all(is_idle));
    assert_same_files(&tables(&bench), &before);
}

/// Reads every table on disk.
fn tables(bench: &Bench) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = bench.files();
    files.retain(|path, _| path.extension().is_some_and(|ending| ending == "parquet"));
    files
}

#[test]
fn squares_in_a_study_with_rectangles_keep_their_columns() {
    let bench = Bench::new();
    let both = ROUGH.replace("nodes = [64, 32]\nside = [2.0, 1.0]\n", "").replace(
        "k_upper = [8, 16]",
        "cases = [{ nodes = 64, k_upper = 8 }, { nodes = [64, 32], side = [2.0, 1.0], k_upper = 8 }]",
    );
    bench.run(&both);
    let area = bench.table("rough", "area");
    let (squares, rectangles) =
        (area.integers("nodes").unwrap(), area.integers("nodes_x").unwrap());
    for row in 0..area.rows() {
        assert_ne!(squares.is_valid(row), rectangles.is_valid(row));
    }
    assert_eq!(squares.null_count(), area.rows() / 2);
    let alone = both.replace(", { nodes = [64, 32], side = [2.0, 1.0], k_upper = 8 }", "");
    let other = Bench::new();
    other.run(&alone);
    let (all, of_squares) = (tables(&bench), tables(&other));
    for stage in ["surfaces", "contact", "area", "corrected"] {
        for key in other.table("rough", stage).texts("task").unwrap().iter().flatten() {
            let path = other.file_of(key);
            let path = path.strip_prefix(other.data()).unwrap();
            assert!(of_squares.contains_key(path), "{path:?}");
            assert!(all.get(path) == of_squares.get(path), "{stage}: {path:?}");
        }
    }
}

/// Returns width and height of a picture.
fn size_of(bench: &Bench, arguments: &[&str]) -> ([u32; 2], Value) {
    let path = bench.path("view.png");
    let study = bench.path("study.toml");
    let start = ["view", study.to_str().unwrap()];
    let options = ["--bare", "--json", "--replace", "--output", path.to_str().unwrap()];
    let output = bench.output(&[&start, arguments, &options].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let file = BufReader::new(File::open(path).unwrap());
    let reader = png::Decoder::new(file).read_info().unwrap();
    let printed = serde_json::from_slice(&output.stdout).unwrap();
    ([reader.info().width, reader.info().height], printed)
}

#[test]
fn pictures_of_rectangles_are_as_wide_as_x_and_as_high_as_y() {
    let bench = bench_with("p256x160_cells");
    bench.run(&map_in_cell("p256x160_cells", [1.0, 1.25], "periodic"));
    for arguments in [&["scan"][..], &["contact"], &["contact", "--map", "pressures"]] {
        let (size, printed) = size_of(&bench, arguments);
        // Mesh cells of 1/256 × 1/128 are drawn two pixels high.
        assert_eq!(size, [256, 320], "{arguments:?}");
        assert_eq!(printed["nodes"], serde_json::json!([256, 160]));
    }
}

#[test]
fn a_report_of_rectangles_has_their_maps_in_proportion() {
    let bench = Bench::new();
    bench.run(&ROUGH);
    let path = bench.path("study.toml");
    let output = bench.output(&["report", path.to_str().unwrap(), "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    let page = fs::read_to_string(said["page"].as_str().unwrap()).unwrap();
    assert!(page.contains("width=\"230.0\" height=\"115.0\" preserve"));
}

#[test]
fn both_boundaries_of_one_surface_are_two_parameter_points() {
    let bench = Bench::new();
    let both = ROUGH
        .replace("loads = {", "boundary = [\"periodic\", \"free\"]\nloads = {")
        .replace("k_upper = [8, 16]", "k_upper = 8");
    bench.run(&both);
    let contact = bench.table("rough", "contact");
    let boundary = contact.texts("boundary").unwrap();
    let free = boundary.iter().flatten().count();
    assert_eq!([free, contact.rows()], [8, 16]);
    let sunk = contact.reals("mean_displacement").unwrap();
    assert_eq!(sunk.null_count(), 8);
    let curves = bench.table("rough", "curves");
    assert_eq!(curves.rows(), 2 * 2 * 4);
    let counts = curves.integers("count").unwrap();
    assert!(counts.values().iter().all(|count| *count == 2));
}
