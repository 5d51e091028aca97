//! Contacts that another program has solved to 1e-12, imported as any measured surface is.

use std::fs;
use std::path::{Path, PathBuf};

use crate::bench::Bench;

pub fn reference(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data/reference")
        .join(name)
}

/// A column of the reference by its name.
pub fn column(csv: &str, name: &str) -> Vec<f64> {
    let mut lines = csv.lines();
    let header = lines.next().expect("a header");
    let index = header
        .split(',')
        .position(|n| n == name)
        .expect("a column of that name");
    lines
        .map(|line| line.split(',').nth(index).unwrap().parse().unwrap())
        .collect()
}

#[test]
fn an_imported_surface_has_the_contacts_that_another_code_finds() {
    let csv = fs::read_to_string(reference("s256_kl4_ks32_H08.csv")).unwrap();
    let loads = column(&csv, "p_norm");
    let bench = Bench::new();
    fs::copy(
        reference("s256_kl4_ks32_H08.npy"),
        bench.path("surface.npy"),
    )
    .unwrap();
    let manifest = format!(
        r#"
[study]
name = "outside"

[stage.surface]
kind = "generate"
method = "file"
path = "surface.npy"
side = 1.0
periodic = true

[stage.contact]
kind = "solve"
from = "surface"
effective_modulus = 1.0
loads = {loads:?}
tolerance = 1e-8
pressures = "none"

[stage.area]
kind = "measure"
from = "contact"
"#
    );
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
        assert!(
            (nodes.value(row) as f64 - expected).abs() <= 1.0,
            "nodes at {load}"
        );
        let expected = column(&csv, "switches")[row];
        assert!(
            (switches.value(row) as f64 - expected).abs() <= 4.0,
            "switches at {load}"
        );
        assert_eq!(
            clusters.value(row) as f64,
            column(&csv, "n_clusters")[row],
            "at {load}"
        );
        // Both codes stop with gaps wrong by some 1e-8 of rms slope × mesh step, here 1e-12.
        let expected = column(&csv, "mean_gap")[row];
        assert!((gaps.value(row) - expected).abs() < 1e-11, "gap at {load}");
    }
    let load = area.reals("load").unwrap().values().to_vec();
    assert_eq!(load, loads);
}
