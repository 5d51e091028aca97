//! Spheres on an isolated patch.

use std::f64::consts::{PI, TAU};

use super::*;
use crate::elasticity::{Factor, FreeHalfSpace, kernel, transform};

/// Returns the path of a sphere of unit radius on a square of `side`, with E* = w = 1.
fn sphere(nodes: usize, side: f64, range: f64) -> AdhesivePath {
    let at = |index: usize| (index as f64 + 0.5) / nodes as f64 - 0.5;
    let height = |node: usize| {
        let (x, y) = (at(node / nodes), at(node % nodes));
        -0.5 * side * (x * x + y * y)
    };
    let heights: Vec<f64> = (0..nodes * nodes).map(height).collect();
    let body = FreeHalfSpace::new(square(nodes, side));
    // Vertical lengths are in units of the side as well.
    let adhesion = Adhesion::new(1.0 / side, range / side).unwrap();
    AdhesivePath::new(Threads::one(), &body, adhesion, &on(body.grid(), &heights))
}

/// Returns the pull-off force in units of π w R.
fn pull_off(nodes: usize, side: f64, range: f64, loads: [f64; 2]) -> f64 {
    let mut path = sphere(nodes, side, range);
    let area = side * side;
    let settings = Settings { tolerance: 1e-7, pull_off_tolerance: 1e-5, ..Settings::default() };
    for force in [0.0, loads[0]] {
        let target = Target::Load(force * PI / area);
        let state = path.step(target, &settings, &|| false);
        assert_eq!(state.stop, Stop::Converged, "{force}: {state:?}");
    }
    let state = path.step(Target::Load(loads[1] * PI / area), &settings, &|| false);
    assert_eq!(state.stop, Stop::PulledOff);
    state.pull_off_load.unwrap() * area / PI
}

#[test]
fn spheres_pull_off_between_the_limits_of_short_and_long_range() {
    // reference/adhesion/sphere_pulloff.csv, from rings in axial symmetry.
    for (tabor, nodes, side, expected) in
        [(0.2, 64, 28.0, -1.905537), (1.0, 64, 8.0, -1.663798), (3.0, 96, 5.0, -1.541552)]
    {
        let loads = [0.9 * expected, 1.1 * expected];
        let found = pull_off(nodes, side, 1.0 / tabor, loads);
        assert!((found / expected - 1.0).abs() < 0.01, "{tabor}: {found} for {expected}");
    }
}

#[test]
fn a_sphere_at_a_mean_gap_has_a_known_force_and_can_be_resumed() {
    // reference/adhesion/sphere_curves.csv: Tabor 1, approach 0.4.
    let side = 8.0;
    let mut path = sphere(64, side, 1.0);
    for force in [0.0, -3.952612] {
        solved(&mut path, Target::Load(force / side / side));
    }
    let gap = path.gap().map(<[f64]>::to_vec);
    let loaded = solved(&mut path, Target::Load(-3.952612 / side / side));
    // The gap is g = u − h − δ with the height h of the sphere, zero at its summit.
    let square = |i: usize| ((i as f64 + 0.5) / 64.0 - 0.5).powi(2);
    let mean_height = -side * (0..64).map(square).sum::<f64>() / 64.0;
    let approach = side * (loaded.mean_displacement - loaded.mean_gap - mean_height);
    assert!((approach - 0.4).abs() < 0.01, "{approach}");
    // Prescribing the mean gap finds the same state.
    path.resume(gap);
    let held = solved(&mut path, Target::MeanGap(loaded.mean_gap));
    assert!((held.mean_pressure / loaded.mean_pressure - 1.0).abs() < 1e-6, "{held:?}");
    assert_eq!(held.contact_nodes, loaded.contact_nodes);
    assert!((held.elastic_energy / loaded.elastic_energy - 1.0).abs() < 1e-6);
}

#[test]
fn a_patch_may_jump_between_all_mean_gaps() {
    let grid = square(32, 1.0);
    let wave = |waves: usize, i: usize| (TAU * (waves * i) as f64 / 32.0).cos();
    let height = |node: usize| {
        let (i, j) = (node / 32, node % 32);
        0.1 * wave(1, i) * wave(1, j) + 0.02 * wave(3, i + j)
    };
    let heights: Vec<f64> = (0..grid.count()).map(height).collect();
    let adhesion = Adhesion::new(0.006, 0.05).unwrap();
    let body = FreeHalfSpace::new(grid);
    let mut path = AdhesivePath::new(Threads::one(), &body, adhesion, &on(body.grid(), &heights));
    let settings = Settings { tolerance: 5e-5, pair_limit: 2000, ..Settings::default() };
    for gap in [5.0, 0.01, 0.001, 5.0, 0.001, 5.0] {
        let state = path.step(Target::MeanGap(gap), &settings, &|| false);
        assert_eq!(state.stop, Stop::Converged, "{gap}: {state:?}");
        assert!((state.mean_gap / gap - 1.0).abs() < 1e-10, "{gap}: {state:?}");
        assert!(state.mean_pressure.is_finite(), "{gap}: {state:?}");
    }
}

#[test]
fn a_patch_has_the_mean_gap_that_its_state_says_or_reports_the_jump_past_it() {
    // Strong adhesion, as in reference/faults/F6-free-gap-control.
    let heights = rough64();
    let mean = heights.iter().sum::<f64>() / 4096.0;
    let body = FreeHalfSpace::new(square(64, 1.0));
    let adhesion = Adhesion::new(0.039, 0.054).unwrap();
    let mut path = AdhesivePath::new(Threads::one(), &body, adhesion, &on(body.grid(), &heights));
    let settings = Settings { tolerance: 5e-5, ..Settings::default() };
    let mut jumps = 0;
    for step in (1..=9).rev().chain(2..=9) {
        let gap = 0.018 * f64::from(step);
        let state = path.step(Target::MeanGap(gap), &settings, &|| false);
        let gaps = path.gap().unwrap();
        let pressures = path.pressure();
        let mean_of = |values: &[f64]| values.iter().sum::<f64>() / 4096.0;
        assert!((mean_of(gaps) - state.mean_gap).abs() < 1e-14, "{gap}: {state:?}");
        assert!((mean_of(pressures) - state.mean_pressure).abs() < 1e-12, "{gap}: {state:?}");
        // The displacement is g + h + δ, so that it has the energy ½⟨p (g + h)⟩ up to a constant.
        let work =
            |node: usize| pressures[node] * (gaps[node] + heights[node] - mean - state.mean_gap);
        let energy = 0.5 * (0..4096).map(work).sum::<f64>() / 4096.0
            + 0.5 * state.mean_pressure * state.mean_displacement;
        assert!((energy / state.elastic_energy - 1.0).abs() < 1e-3, "{gap}: {energy} {state:?}");
        match state.stop {
            Stop::Converged => assert!((state.mean_gap / gap - 1.0).abs() < 1e-10, "{state:?}"),
            Stop::GapNotReached => jumps += 1,
            stop => panic!("{gap}: {stop:?}"),
        }
    }
    assert_eq!(jumps, 0);
}

#[test]
fn a_patch_that_jumps_past_a_mean_gap_says_so_and_has_its_own() {
    let at = |index: usize| (index as f64 + 0.5) / 6.0 - 0.5;
    let heights: Vec<f64> =
        (0..36).map(|node| -at(node / 6).powi(2) - at(node % 6).powi(2)).collect();
    let body = FreeHalfSpace::new(square(6, 1.0));
    let adhesion = Adhesion::new(0.288, 0.2).unwrap();
    let mut path = AdhesivePath::new(Threads::one(), &body, adhesion, &on(body.grid(), &heights));
    solved(&mut path, Target::MeanGap(0.2));
    let state = step(&mut path, Target::MeanGap(0.1));
    assert_eq!(state.stop, Stop::GapNotReached, "{state:?}");
    assert!(state.residual <= 1e-9);
    assert!((state.mean_gap - 0.1).abs() > 1e-3, "{state:?}");
    let mean = path.gap().unwrap().iter().sum::<f64>() / 36.0;
    assert!((mean - state.mean_gap).abs() < 1e-15);
    solved(&mut path, Target::MeanGap(0.05));
}

#[test]
fn the_energy_of_a_state_that_did_not_converge_is_that_of_its_pressures() {
    let mut path = sphere(32, 8.0, 1.0);
    let settings = Settings { pair_limit: 4, ..Settings::default() };
    let state = path.step(Target::Load(0.01), &settings, &|| false);
    assert_eq!(state.stop, Stop::PairLimit);
    let pressures = path.pressure().to_vec();
    let body = FreeHalfSpace::new(square(32, 8.0));
    let (transform, kernel) =
        (transform(&body), kernel(&Threads::one(), &body, Factor::Displacement));
    let mut displacement = vec![0.0; 1024];
    transform.convolve(&kernel, &pressures, &mut displacement, &mut transform.scratch());
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / 1024.0;
    let moved = mean(&mut displacement.iter().copied());
    let energy = mean(&mut displacement.iter().zip(&pressures).map(|(u, p)| 0.5 * u * p));
    assert!((state.mean_displacement / moved - 1.0).abs() < 1e-12, "{state:?} {moved}");
    assert!((state.elastic_energy / energy - 1.0).abs() < 1e-12, "{state:?} {energy}");
}
