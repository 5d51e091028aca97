//! A half-space with nothing outside the map: against independent code and closed forms.

use std::f64::consts::PI;

use super::reference::RECTANGULAR_AND_FREE as REFERENCE;
use super::*;
use crate::elasticity::FreeHalfSpace;
use crate::grid::samples::rectangle;
use crate::topography::moments::Moments;

fn free(nodes: usize, heights: &[f64]) -> Solver {
    Solver::new(FreeHalfSpace::new(square(nodes, 1.0)), heights)
}

#[test]
fn a_free_surface_touches_as_independent_code_has_it() {
    let surface = REFERENCE.heights("f128x192", [0.8, 1.2]);
    let grid = surface.grid();
    let slope = Moments::of(&surface).rms_slope();
    let unit = slope * grid.cell().longer_side();
    let reduced: Vec<f64> = surface.heights().iter().map(|h| h / unit).collect();
    let mut solver = Solver::new(FreeHalfSpace::new(grid), &reduced);
    assert_eq!(solver.full_contact_load(), None);
    let solved_by_others = REFERENCE.solved("f128x192");
    let maps = REFERENCE.maps("f128x192", "contact", grid);
    for (row, map) in solved_by_others.iter().zip(maps) {
        let load = row.number(7);
        let outcome = solved(&mut solver, load);
        let touches: Vec<bool> = solver.pressure().iter().map(|p| *p > 0.0).collect();
        assert!(touches == map[..grid.count()], "at {load}");
        assert_eq!(outcome.contact_nodes, row.count(9));
        let close = |found: f64, exact: f64| (found / exact - 1.0).abs() < 1e-8;
        assert!(close(outcome.mean_gap * unit, row.number(14)), "{outcome:?}");
        assert!(close(outcome.energy * slope * unit, row.number(15)));
        assert!(close(outcome.peak_pressure * slope, row.number(16)));
    }
}

#[test]
fn a_ball_sinks_as_hertz_has_it() {
    // F = 4/3 E* √R δ^(3/2), with radii and forces in units of the side and E*; a is 0.2.
    let (nodes, radius, a) = (256, 4.0, 0.2_f64);
    let heights = map(nodes, |x, y| -((x - 0.5).powi(2) + (y - 0.5).powi(2)) / (2.0 * radius));
    let force = 4.0 / 3.0 * a.powi(3) / radius;
    let mut solver = free(nodes, &heights);
    let outcome = solved(&mut solver, force);
    let area = outcome.contact_nodes as f64 / (nodes * nodes) as f64;
    assert!((area / (PI * a * a) - 1.0).abs() < 0.01, "{area}");
    let peak = 2.0 * a / (PI * radius);
    assert!((outcome.peak_pressure / peak - 1.0).abs() < 2e-3);
    // ½⟨p u⟩ = 2/5 F δ, δ = a²/R.
    let energy = 0.4 * force * a * a / radius;
    assert!((outcome.energy / energy - 1.0).abs() < 2e-3);
}

#[test]
fn a_ball_in_the_middle_of_a_large_periodic_cell_is_nearly_alone() {
    let (nodes, radius) = (256, 4.0);
    let heights = map(nodes, |x, y| -((x - 0.5).powi(2) + (y - 0.5).powi(2)) / (2.0 * radius));
    let force = 4.0 / 3.0 * 0.02_f64.powi(3) / radius;
    let alone = solved(&mut free(nodes, &heights), force);
    let repeated = solved(&mut solver(nodes, &heights), force);
    assert_eq!(alone.contact_nodes, repeated.contact_nodes);
    assert!((alone.peak_pressure / repeated.peak_pressure - 1.0).abs() < 1e-3);
}

#[test]
fn nothing_leaks_over_an_edge() {
    // A bump at one edge, in contact right up to it: the opposite edge knows nothing of it.
    let (nodes, radius) = (64, 0.5);
    let heights = map(nodes, |x, y| -(x * x + (y - 0.5).powi(2)) / (2.0 * radius));
    let mut at_edge = free(nodes, &heights);
    solved(&mut at_edge, 1e-3);
    let touches = |i: usize, j: usize| at_edge.pressure()[i * nodes + j] > 0.0;
    assert!(touches(0, nodes / 2) && !touches(nodes - 1, nodes / 2));
    // The same on twice as long a map: the part that is beyond is never touched, and nothing else
    // changes.
    let twice = rectangle([2 * nodes, nodes], [2.0, 1.0]);
    let longer: Vec<f64> = (0..twice.count())
        .map(|node| {
            let [i, j] = twice.place(node);
            let [x, y] = [i, j].map(|index| index as f64 / nodes as f64);
            -(x * x + (y - 0.5).powi(2)) / (2.0 * radius) / 2.0
        })
        .collect();
    let mut on_longer = Solver::new(FreeHalfSpace::new(twice), &longer);
    solved(&mut on_longer, 0.5e-3);
    for (node, pressure) in at_edge.pressure().iter().enumerate() {
        let found = on_longer.pressure()[node];
        assert!((pressure - found).abs() < 1e-8, "node {node}");
    }
}

#[test]
fn heavy_loads_bring_all_nodes_into_contact() {
    let heights = map(32, |x, y| 1e-3 * (6.0 * x).sin() * (5.0 * y).cos());
    let mut solver = free(32, &heights);
    let outcome = solved(&mut solver, 1.0);
    assert_eq!(outcome.contact_nodes, 32 * 32);
    assert!(outcome.mean_gap.abs() < 1e-12, "{outcome:?}");
    // A uniform displacement takes more pressure at the edges.
    assert!(outcome.peak_pressure > 2.0);
}

#[test]
fn edges_take_hardly_more_pairs_than_a_map_that_repeats() {
    let loads = [0.02, 0.04, 0.06, 0.08, 0.1, 0.2, 0.4, 0.6];
    let mut pairs = [0; 2];
    for seed in 1..=3 {
        let heights = rough(128, seed);
        let bodies = [solver(128, &heights), free(128, &heights)];
        for (mut body, pairs) in bodies.into_iter().zip(&mut pairs) {
            let spent = loads.map(|load| solved(&mut body, load).pairs);
            *pairs += spent.iter().sum::<u32>();
        }
    }
    // On 1024² nodes 158 for 135; without a margin around the map 312.
    let [periodic, free] = pairs;
    assert!(4 * free < 5 * periodic, "{free} for {periodic}");
}
