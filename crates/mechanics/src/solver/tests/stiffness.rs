//! Stiffness of contacts against closed forms, independent code and differences between loads.

use std::f64::consts::PI;

use super::*;
use crate::elasticity::{Base, FreeHalfSpace, Layer, Support};
use crate::grid::Boundary;

const CONDUCTANCE: Reference =
    Reference { folder: "conductance", table: "rough128_a_conductance.csv" };

fn rows_of(table: &str) -> Vec<Vec<f64>> {
    let text = String::from_utf8(CONDUCTANCE.file(table)).unwrap();
    let row = |row: &str| row.split(',').map(|number| number.parse().unwrap()).collect();
    text.lines().skip(1).map(row).collect()
}

/// Returns the stiffness of the last load of a solver, at the accuracy of a tight tolerance.
fn stiffness(solver: &mut Solver, settings: &Settings) -> ContactStiffness {
    let pressure = solver.pressure().to_vec();
    let found = solver.contact_stiffness(&pressure, settings, &|| false);
    assert_eq!(found.stop, Stop::Converged);
    found
}

/// Returns a map with unit pressure on discs of radius 1, with `cells` nodes to the radius. The map
/// has `nodes` nodes per side, and its centre is between nodes.
fn discs(nodes: usize, cells: f64, centres: &[[f64; 2]]) -> Vec<f64> {
    let from_centre = |index: usize| (index as f64 + 0.5 - nodes as f64 / 2.0) / cells;
    let is_inside = |node: usize| {
        let (x, y) = (from_centre(node / nodes), from_centre(node % nodes));
        centres.iter().any(|[x_0, y_0]| (x - x_0).hypot(y - y_0) < 1.0)
    };
    (0..nodes * nodes).map(|node| f64::from(u8::from(is_inside(node)))).collect()
}

#[test]
fn a_rough_contact_is_as_stiff_as_independent_code_has_it() {
    let heights = CONDUCTANCE.heights("rough128_a", [1.0, 1.0]);
    for row in rows_of(CONDUCTANCE.table) {
        let mut solver = super::solver(128, heights.heights());
        let fine = Settings { tolerance: 1e-9, ..Settings::default() };
        press(&mut solver, row[0], &fine);
        let found = stiffness(&mut solver, &fine);
        assert!((found.stiffness / row[4] - 1.0).abs() < 1e-7, "{row:?}: {found:?}");
        let usual = Settings::default();
        press(&mut solver, row[0], &usual);
        let found = stiffness(&mut solver, &usual);
        assert!((found.stiffness / row[4] - 1.0).abs() < 1e-3, "{row:?}: {found:?}");
        assert!(found.pairs <= 12, "{row:?}: {found:?}");
    }
}

#[test]
fn discs_on_a_free_half_space_are_as_stiff_as_independent_code_has_them() {
    // The rows of clusters.csv with eight cells to the radius; stiffnesses are in units of E* a.
    let two = [[-2.0, 0.0], [2.0, 0.0]];
    let five = [[0.0, 0.0], [3.0, 0.0], [-3.0, 0.0], [0.0, 3.0], [0.0, -3.0]];
    for (row, centres) in [(0, &two[..]), (2, &five[..])] {
        let nodes = 96;
        let mut solver = Solver::new(
            FreeHalfSpace::new(square(nodes, 1.0)),
            &on(square(nodes, 1.0), &vec![0.0; 96 * 96]),
        );
        let fine = Settings { tolerance: 1e-9, ..Settings::default() };
        let found = solver.contact_stiffness(&discs(nodes, 8.0, centres), &fine, &|| false);
        let expected = rows_of("clusters.csv")[row][4];
        // The side is twelve radii long.
        let found = found.stiffness * 12.0;
        assert!((found / expected - 1.0).abs() < 1e-7, "{found}, {expected}");
    }
}

#[test]
fn a_lattice_of_discs_has_the_resistance_of_its_closed_form() {
    for nodes in [96, 192] {
        for radius in [0.0625, 0.125] {
            let mut solver = super::solver(nodes, &vec![0.0; nodes * nodes]);
            let pressure = discs(nodes, radius * nodes as f64, &[[0.0, 0.0]]);
            let found = solver.contact_stiffness(&pressure, &Settings::default(), &|| false);
            let closed = 1.0 / (0.5 / radius - 3.9002649200 / PI);
            // The mesh makes a disc less stiff by 0.112 of a cell, and periodic cells by more.
            let expected = 1.0 - 0.2 / (radius * nodes as f64);
            let ratio = found.stiffness / closed;
            assert!((ratio - expected).abs() < 0.02, "{nodes}, {radius}: {ratio}");
        }
    }
}

#[test]
fn the_stiffness_is_the_slope_of_the_load_over_the_approach() {
    let heights = rough(64, 9);
    let layer = Layer::new(0.05, 0.3, Support::Rigid(Base::Bonded)).unwrap();
    let hardness = Hardness::new(1.2).unwrap();
    for (body, has_mean) in [
        (Body::default(), false),
        (Body { elastic: Elastic::Layer(layer), hardness: None }, false),
        (Body { elastic: Elastic::default(), hardness: Some(hardness) }, false),
        (Body { elastic: Boundary::Free.into(), hardness: None }, true),
    ] {
        let mut solver = body.solver(&on(square(64, 1.0), &heights));
        let unit = solver.displacement_under_unit_pressure();
        assert_eq!(unit.is_some(), has_mean);
        let mut approach = |load| {
            let outcome = solved(&mut solver, load);
            let sunk = unit.as_ref().map_or(0.0, |unit| {
                let product = unit.iter().zip(solver.pressure()).map(|(u, p)| u * p);
                product.sum::<f64>() / unit.len() as f64
            });
            sunk - outcome.mean_gap + outcome.yielded_depth
        };
        let (load, step) = (0.1, 1e-5);
        let slope = 2.0 * step / (approach(load + step) - approach(load - step));
        solved(&mut solver, load);
        let found = stiffness(&mut solver, &TIGHT);
        assert!((found.stiffness / slope - 1.0).abs() < 2e-3, "{body:?}: {found:?}, {slope}");
    }
}

/// Returns a body with a hardness, in units of E*.
fn yielding(elastic: Elastic, hardness: f64) -> Body {
    Body { elastic, hardness: Some(Hardness::new(hardness).unwrap()) }
}

#[test]
fn a_contact_that_yielded_begins_to_unload_with_the_stiffness_of_all_its_nodes() {
    let (load, step, hardness) = (0.1, 1e-5, 0.5);
    let mut heights = rough(64, 9);
    let mut solver = yielding(Elastic::default(), hardness).solver(&on(square(64, 1.0), &heights));
    assert!(solved(&mut solver, load).saturated_nodes > 0);
    let pressure = solver.pressure().to_vec();
    let loading = solver.contact_stiffness(&pressure, &TIGHT, &|| false);
    let found = solver.unloading_stiffness(&pressure, &TIGHT, &|| false);
    assert!(found.stiffness > loading.stiffness, "{found:?}, {loading:?}");
    let usual = solver.unloading_stiffness(&pressure, &Settings::default(), &|| false);
    assert!(usual.pairs <= 12, "{usual:?}");
    assert!((usual.stiffness / found.stiffness - 1.0).abs() < 1e-4, "{usual:?}, {found:?}");

    // The surface keeps its plastic depth, and unloads elastically.
    let gaps = solver.gap_under(&pressure);
    for ((height, gap), pressure) in heights.iter_mut().zip(gaps).zip(&pressure) {
        *height -= if *pressure >= hardness { (-gap).max(0.0) } else { 0.0 };
    }
    let mut solver = Body::default().solver(&on(square(64, 1.0), &heights));
    let mut gap = |load| solved(&mut solver, load).mean_gap;
    let slope = step / (gap(load - step) - gap(load));
    assert!((found.stiffness / slope - 1.0).abs() < 5e-3, "{found:?}, {slope}");
}

#[test]
fn loading_and_unloading_are_equally_stiff_where_nothing_yields() {
    let mut solver =
        yielding(Boundary::Free.into(), 1e3).solver(&on(square(64, 1.0), &rough(64, 9)));
    assert_eq!(solved(&mut solver, 0.1).saturated_nodes, 0);
    let pressure = solver.pressure().to_vec();
    let loading = solver.contact_stiffness(&pressure, &TIGHT, &|| false);
    assert_eq!(solver.unloading_stiffness(&pressure, &TIGHT, &|| false), loading);
}

#[test]
fn a_saturated_disc_unloads_as_a_flat_punch() {
    let (nodes, cells) = (96, 12.0);
    let pressure = discs(nodes, cells, &[[0.0, 0.0]]);
    let flat = vec![0.0; nodes * nodes];
    let mut solver = yielding(Boundary::Free.into(), 1.0).solver(&on(square(nodes, 1.0), &flat));
    let found = solver.contact_stiffness(&pressure, &TIGHT, &|| false);
    assert_eq!(found.stiffness, 0.0, "every node keeps its pressure");
    let found = solver.unloading_stiffness(&pressure, &TIGHT, &|| false);
    let radius = cells / nodes as f64;
    // 2 E* a, less the 0.112 cells by which a disc on a mesh is smaller, on average.
    let expected = 2.0 * radius * (1.0 - 0.112 / cells);
    assert!((found.stiffness / expected - 1.0).abs() < 0.02, "{found:?}, {expected}");
}

#[test]
fn a_ball_is_as_stiff_as_hertz_has_it() {
    let (nodes, radius, a) = (192, 4.0, 0.2_f64);
    let heights = map(nodes, |x, y| -((x - 0.5).powi(2) + (y - 0.5).powi(2)) / (2.0 * radius));
    let mut solver =
        Solver::new(FreeHalfSpace::new(square(nodes, 1.0)), &on(square(nodes, 1.0), &heights));
    solved(&mut solver, 4.0 / 3.0 * a.powi(3) / radius);
    let found = stiffness(&mut solver, &Settings::default());
    assert!((found.stiffness / (2.0 * a) - 1.0).abs() < 2e-3, "{found:?}");
}

#[test]
fn full_contact_is_rigid_and_a_saturated_one_has_no_stiffness() {
    let heights = rough(32, 1);
    let mut solver = super::solver(32, &heights);
    let full = 1.1 * solver.full_contact_load().unwrap();
    press(&mut solver, full, &Settings::default());
    let pressure = solver.pressure().to_vec();
    let found = solver.contact_stiffness(&pressure, &Settings::default(), &|| false);
    assert_eq!((found.stiffness, found.stop), (f64::INFINITY, Stop::FullContact));

    let hardness = Some(Hardness::new(0.5).unwrap());
    let mut solver =
        Body { elastic: Elastic::default(), hardness }.solver(&on(square(32, 1.0), &heights));
    let mut saturated = vec![0.0; 32 * 32];
    saturated[5] = 0.5;
    let found = solver.contact_stiffness(&saturated, &Settings::default(), &|| false);
    assert_eq!((found.stiffness, found.pairs), (0.0, 0));
}

#[test]
fn a_load_has_the_same_bytes_after_a_stiffness() {
    for (nodes, elastic) in [(48, Boundary::Free.into()), (256, Elastic::default())] {
        let heights = rough(nodes, 2);
        let body = Body { elastic, hardness: None };
        let solve = |first: bool| {
            let mut solver = body.solver(&on(square(nodes, 1.0), &heights));
            if first {
                press(&mut solver, 0.3, &Settings::default());
                stiffness(&mut solver, &Settings::default());
            }
            let outcome = press(&mut solver, 0.05, &Settings::default());
            let found = stiffness(&mut solver, &Settings::default());
            (outcome, solver.pressure().to_vec(), found)
        };
        assert_eq!(solve(true), solve(false));
    }
}
