//! Rectangles, of square cells and others: against independent code, and against squares.

use super::reference::RECTANGULAR_AND_FREE as REFERENCE;
use super::*;
use crate::grid::samples::rectangle;
use crate::morphology::area::ContactArea;
use crate::morphology::clusters::Clusters;
use crate::morphology::map::ContactMap;
use crate::topography::moments::Moments;

#[test]
fn rectangles_touch_as_independent_code_has_it() {
    for (name, size) in [("p192x320", [0.6, 1.0]), ("p256x160_cells", [1.0, 1.25])] {
        let surface = REFERENCE.heights(name, size);
        let grid = surface.grid();
        let slope = Moments::of(&surface).rms_slope();
        assert!((slope - 0.02).abs() < 1e-14);
        let unit = slope * grid.cell().longer_side();
        let reduced: Vec<f64> = surface.heights().iter().map(|h| h / unit).collect();
        let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &reduced);
        let maps = REFERENCE.maps(name, "contact", grid);
        for (row, map) in REFERENCE.solved(name).iter().zip(maps) {
            let load = row.number(7);
            let outcome = solved(&mut solver, load);
            let touches: Vec<bool> = solver.pressure().iter().map(|p| *p > 0.0).collect();
            assert!(touches == map[..grid.count()], "{name} at {load}");
            assert_eq!(outcome.contact_nodes, row.count(9));
            let contact = ContactMap::of_pressures(grid.nodes(), solver.pressure());
            let area = ContactArea::of(&contact);
            assert_eq!(area.switches_along_columns, row.count(11));
            assert_eq!(area.switches_along_rows, row.count(12));
            assert_eq!(Clusters::of_contact(&contact).count, row.count(13));
            let close = |found: f64, exact: f64| (found / exact - 1.0).abs() < 1e-8;
            assert!(close(outcome.mean_gap * unit, row.number(14)));
            assert!(close(outcome.energy * slope * unit, row.number(15)));
            assert!(close(outcome.peak_pressure * slope, row.number(16)));
        }
    }
}

#[test]
fn a_surface_repeated_along_one_side_touches_as_it_does_alone() {
    let heights = rough(32, 3);
    let once = square(32, 1.0);
    let twice = rectangle([64, 32], [2.0, 1.0]);
    let repeated: Vec<f64> = heights.iter().chain(&heights).map(|h| h / 2.0).collect();
    let mut alone = Solver::new(PeriodicHalfSpace::new(once), &heights);
    let mut both = Solver::new(PeriodicHalfSpace::new(twice), &repeated);
    let full = alone.full_contact_load().unwrap();
    assert!((both.full_contact_load().unwrap() / full - 1.0).abs() < 1e-12);
    for load in [0.003, 0.05, 0.6].map(|share| share * full) {
        let (one, two) = (solved(&mut alone, load), solved(&mut both, load));
        assert_eq!(2 * one.contact_nodes, two.contact_nodes);
        assert!((one.energy / (2.0 * two.energy) - 1.0).abs() < 1e-9);
        assert!((one.mean_gap / (2.0 * two.mean_gap) - 1.0).abs() < 1e-9);
        for (index, pressure) in both.pressure().iter().enumerate() {
            let single = alone.pressure()[index % (32 * 32)];
            assert!((pressure - single).abs() < 1e-7 * one.peak_pressure);
        }
    }
}

#[test]
fn turning_a_rectangle_turns_its_contact() {
    let lying = rectangle([24, 40], [1.0, 1.5]);
    let standing = rectangle([40, 24], [1.5, 1.0]);
    let heights: Vec<f64> = noise(40, 5)[..lying.count()].to_vec();
    let turned: Vec<f64> = (0..standing.count())
        .map(|node| {
            let [i, j] = standing.place(node);
            heights[j * 40 + i]
        })
        .collect();
    let mut one = Solver::new(PeriodicHalfSpace::new(lying), &heights);
    let mut other = Solver::new(PeriodicHalfSpace::new(standing), &turned);
    for load in [0.01, 0.3] {
        let (outcome, turned) = (solved(&mut one, load), solved(&mut other, load));
        assert_eq!(outcome.contact_nodes, turned.contact_nodes);
        for (node, pressure) in other.pressure().iter().enumerate() {
            let [i, j] = standing.place(node);
            let unturned = one.pressure()[j * 40 + i];
            assert!((pressure - unturned).abs() < 1e-8 * outcome.peak_pressure);
        }
    }
}

#[test]
fn rectangles_of_either_transform_are_pressed_however_they_lie() {
    for (nodes, size) in [([64, 32], [1.0, 1.0]), ([9, 50], [0.2, 1.0]), ([1, 64], [0.1, 3.0])] {
        let grid = rectangle(nodes, size);
        let heights: Vec<f64> = noise(64, 7)[..grid.count()].to_vec();
        let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &heights);
        for load in [1e-12, 1e-3, 0.1, 1.0, 100.0] {
            let outcome = press(&mut solver, load, &Settings::default());
            assert!(
                [Stop::Converged, Stop::FullContact].contains(&outcome.stop),
                "{nodes:?}, {load}: {outcome:?}"
            );
            assert!((mean(solver.pressure()) / load - 1.0).abs() < 1e-12);
        }
    }
}
