//! Comparison with contacts that other programs have solved to 1e-12, imported as measured
//! surfaces.

use std::fs;
use std::path::{Path, PathBuf};

use arrow::array::AsArray;
use arrow::datatypes::Float64Type;
use asperity::tables::table::Table;

use crate::bench::Bench;
use crate::manifest::manifest;

fn reference(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/reference").join(name)
}

/// Returns the path of a reference file with a hardness, which the tests of the solver use, too.
pub fn with_hardness(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/mechanics/tests/data/hardness");
    folder.join(name)
}

/// Reads a column of the reference by its name.
pub fn column(csv: &str, name: &str) -> Vec<f64> {
    let mut lines = csv.lines();
    let header = lines.next().expect("a header");
    let index = header.split(',').position(|n| n == name).expect("a column of that name");
    lines.map(|line| line.split(',').nth(index).unwrap().parse().unwrap()).collect()
}

#[track_caller]
pub fn assert_near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        let error = (found / expected - 1.0).abs();
        assert!(error <= tolerance, "{found} should be {expected}");
    }
}

#[test]
fn an_imported_surface_has_the_contacts_that_another_code_finds() {
    let csv = fs::read_to_string(reference("s256_kl4_ks32_H08.csv")).unwrap();
    let loads = column(&csv, "p_norm");
    let bench = Bench::new();
    fs::copy(reference("s256_kl4_ks32_H08.npy"), bench.path("surface.npy")).unwrap();
    let manifest = manifest("outside", "")
        .generate("surface", "method = 'file'; path = 'surface.npy'; side = 1.0; periodic = true")
        .solve(
            "contact",
            &format!(
                "effective_modulus = 1.0; loads = {loads:?}; tolerance = 1e-8; pressures = 'none'"
            ),
        )
        .measure("area", "")
        .text();
    bench.run(&manifest);
    let area = bench.table("outside", "area");
    let nodes = area.integers("contact_nodes").unwrap();
    let switches = area.integers("switches").unwrap();
    let clusters = area.integers("clusters").unwrap();
    let gaps = area.reals("mean_gap").unwrap();
    assert_eq!(area.rows(), loads.len());
    for (row, fraction) in column(&csv, "area_fraction").into_iter().enumerate() {
        let load = loads[row];
        let expected = (fraction * 65536.0).round();
        // A node on the edge of a contact may fall on either side within the tolerances.
        assert!((nodes.value(row) as f64 - expected).abs() <= 1.0, "nodes at {load}");
        let expected = column(&csv, "switches")[row];
        assert!((switches.value(row) as f64 - expected).abs() <= 4.0, "switches at {load}");
        assert_eq!(clusters.value(row) as f64, column(&csv, "n_clusters")[row], "at {load}");
        // Both codes stop at errors of the gap near 1e-8 × rms slope × mesh step, here 1e-12.
        let expected = column(&csv, "mean_gap")[row];
        assert!((gaps.value(row) - expected).abs() < 1e-11, "gap at {load}");
    }
    let load = area.reals("load").unwrap().values().to_vec();
    assert_eq!(load, loads);
}

fn reals(table: &Table, name: &str) -> Vec<f64> {
    table.reals(name).unwrap().values().to_vec()
}

/// Reads contact and saturation at each load: packed bits, most significant first, after a header
/// of 128 bytes.
fn maps_by_others(name: &str) -> Vec<Vec<bool>> {
    let bytes = fs::read(with_hardness(&format!("{name}_maps.npy"))).unwrap();
    let bits = |byte: &u8| [7, 6, 5, 4, 3, 2, 1, 0].map(|bit| byte >> bit & 1 == 1);
    let maps = bytes[128..].chunks(128 * 128 / 8);
    maps.map(|map| map.iter().flat_map(bits).collect()).collect()
}

#[test]
fn contact_and_saturation_are_what_another_code_finds() {
    for name in ["h128_hard03", "h128_hard08"] {
        let csv = fs::read_to_string(with_hardness("hardness.csv")).unwrap();
        let is_wanted = |line: &&str| line.starts_with("name,") || line.starts_with(name);
        let csv: Vec<&str> = csv.lines().filter(is_wanted).collect();
        let csv = csv.join("\n");
        let of_others = |name: &str| column(&csv, name);
        let bench = Bench::new();
        let file = format!("{name}.npy");
        fs::copy(with_hardness(&file), bench.path(&file)).unwrap();
        let hardness = of_others("hardness")[0];
        let loads = of_others("pressure");
        bench.run(
            &manifest("outside", "")
                .generate(
                    "scan",
                    &format!("method = 'file'; path = '{file}'; side = 1.0; periodic = true"),
                )
                .solve(
                    "contact",
                    &format!(
                        "effective_modulus = 1.0; hardness = {hardness:?}; loads = {loads:?}; \
                         load_unit = 'absolute'; tolerance = 1e-8; pressures = 'all'"
                    ),
                )
                .measure("area", "")
                .text(),
        );
        let area = bench.table("outside", "area");
        for (here, there) in [
            ("contact_nodes", "contact_nodes"),
            ("saturated_nodes", "saturated_nodes"),
            ("switches_along_columns", "switches_x"),
            ("switches_along_rows", "switches_y"),
            ("clusters", "clusters"),
        ] {
            let found: Vec<f64> =
                area.integers(here).unwrap().values().iter().map(|&n| n as f64).collect();
            assert_eq!(found, of_others(there), "{name}: {here}");
        }
        let cells = 128.0 * 128.0;
        let [open, yielded] = ["contact_nodes", "saturated_nodes"].map(of_others);
        let gaps = of_others("mean_gap_outside").into_iter().zip(open);
        let gaps: Vec<f64> = gaps.map(|(gap, n)| gap * (1.0 - n / cells)).collect();
        assert_near(&reals(&area, "mean_gap"), &gaps, 1e-6);
        let depths = of_others("mean_penetration").into_iter().zip(&yielded);
        let depths: Vec<f64> = depths.map(|(depth, n)| depth * n / cells).collect();
        assert_near(&reals(&area, "mean_yielded_depth"), &depths, 1e-6);
        let shares: Vec<f64> = yielded.iter().map(|n| n / cells).collect();
        assert_eq!(reals(&area, "saturated_fraction"), shares);
        assert_eq!(reals(&area, "hardness"), vec![hardness; shares.len()]);
        let contact = bench.with_maps("outside", "contact");
        assert_near(&reals(&contact, "peak_pressure"), &of_others("peak_pressure"), 1e-12);
        let pressures = contact.lists("pressures").unwrap();
        for (load, maps) in maps_by_others(name).chunks(2).enumerate() {
            let list = pressures.value(load);
            let list = list.as_primitive::<Float64Type>();
            let touches: Vec<bool> = list.iter().map(|p| p.is_some()).collect();
            assert!(touches == maps[0], "{name}, load {load}");
            let saturated = |p: Option<f64>| p.is_some_and(|p| p > (1.0 - 1e-12) * hardness);
            assert!(list.iter().map(saturated).eq(maps[1].iter().copied()));
        }
    }
}
