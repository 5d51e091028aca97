//! Surfaces whose area on each mesh is known.

use arrow::array::Array;

use super::*;
use crate::fit::laws::{Law, PlainLaw};
use asperity_tables::column::{integers, reals};

const HURST: Column = Column::parameter("hurst", ColumnKind::Real, "1", "Hurst exponent");

/// Two surfaces under two loads on three meshes: A_N = A* + 0.1 S_d Δx, A* = load × (2 + r).
/// Ten edges a side, whatever the mesh: S_d Δx = 10/nodes.
fn table() -> Table {
    let rows: Vec<(i64, i64, f64)> = [64, 128, 256]
        .into_iter()
        .flat_map(|nodes| {
            [(0, 0.1), (0, 0.2), (1, 0.1), (1, 0.2)].map(|(r, load)| (nodes, r, load))
        })
        .collect();
    let area =
        |&(nodes, r, load): &(i64, i64, f64)| load * (2 + r) as f64 + 0.1 * 10.0 / nodes as f64;
    Table::new(
        rows.len(),
        vec![
            (NODES, integers(rows.iter().map(|row| row.0))),
            (HURST, reals(vec![0.8; rows.len()])),
            (REALIZATION, integers(rows.iter().map(|row| row.1))),
            (LOAD, reals(rows.iter().map(|row| row.2))),
            (AREA_FRACTION, reals(rows.iter().map(area))),
            (SWITCHES, integers(rows.iter().map(|row| 10 * row.0))),
        ],
    )
}

fn params() -> Params {
    Params {
        law: Law::Plain(PlainLaw::MeshConvergence),
        window: [0.0, 10.0],
        bootstrap: 20,
        level: 0.9,
        seed: 1,
    }
}

#[test]
fn every_surface_and_load_is_regressed_and_then_all_together() {
    let fitted = run(&table(), &params()).unwrap();
    let pooled: Vec<_> = fitted.texts("pooled").unwrap().iter().flatten().collect();
    let expected = [["nothing"; 4].as_slice(), &["surfaces"; 2], &["surfaces and loads"]];
    assert_eq!(pooled, expected.concat());
    let coefficients = fitted.reals("mesh_coefficient").unwrap();
    for coefficient in coefficients.iter().flatten() {
        assert!((coefficient - 0.1).abs() < 1e-13, "{coefficient}");
    }
    let limits: Vec<f64> = fitted.reals("area_limit").unwrap().iter().flatten().collect();
    for (found, exact) in limits.iter().zip([0.2, 0.4, 0.3, 0.6, 0.25, 0.5, 0.375]) {
        assert!((found - exact).abs() < 1e-14, "{found} {exact}");
    }
    assert!(!fitted.has("nodes"));
}

#[test]
fn the_mesh_is_no_part_of_a_point_and_what_is_pooled_has_no_number() {
    let fitted = run(&table(), &params()).unwrap();
    assert_eq!(fitted.rows(), 7);
    let numbers = fitted.integers("realization").unwrap();
    let numbers: Vec<_> = numbers.iter().collect();
    assert_eq!(numbers[..4], [Some(0), Some(0), Some(1), Some(1)]);
    assert_eq!(numbers[4..], [None; 3]);
    assert_eq!(fitted.reals("load").unwrap().null_count(), 1);
}

#[test]
fn corrections_are_judged_by_what_they_leave() {
    let fitted = run(&table(), &params()).unwrap();
    let last = |name: &str| fitted.reals(name).unwrap().value(6);
    assert!(last("error_fitted") < 1e-13);
    assert!(last("error_2017") < last("error_none") && last("error_none") < last("error_pi_8"));
}

#[test]
fn one_mesh_alone_is_no_fit_but_a_row_that_says_so() {
    let one = table().pick(&[0, 1, 2, 3]);
    let fitted = run(&one, &params()).unwrap();
    let status = fitted.texts("status").unwrap();
    assert!(status.iter().flatten().all(|text| text.contains("1 meshes")));
    assert_eq!(fitted.reals("mesh_coefficient").unwrap().null_count(), 7);
}
