//! Closed forms, limits and invariants.

use std::f64::consts::{PI, SQRT_2, TAU};
use std::num::NonZeroUsize;

use super::*;
use crate::grid::samples::rectangle;

#[test]
fn flat_surfaces_attract_each_other_uniformly() {
    let adhesion = Adhesion::new(0.002, 0.05).unwrap();
    for gap in [0.01, 0.05, 0.3] {
        let mut path = path(16, &[0.0; 256], adhesion);
        let state = solved(&mut path, Target::MeanGap(gap));
        let expected = -0.002 / 0.05 * libm::exp(-gap / 0.05);
        assert!((state.mean_pressure - expected).abs() < 1e-14, "{state:?}");
        assert!((state.adhesion_energy - expected * 0.05).abs() < 1e-15);
        assert_eq!(state.contact_nodes, 0);
    }
}

#[test]
fn contact_is_full_from_the_load_that_attraction_lowers() {
    // reference/adhesion/README.md: 1.626244075675 without adhesion, less w/(ρ E* h′).
    let adhesion = Adhesion::new(0.002, 0.010).unwrap();
    let full = 1.626244075675 - adhesion.largest_attraction();
    let heights = rough64();
    for (load, is_full) in [(full - 1e-6, false), (full + 1e-6, true)] {
        let mut path = path(64, &heights, adhesion);
        let state = solved(&mut path, Target::Load(load));
        assert_eq!(state.contact_nodes == 4096, is_full, "{state:?}");
        assert!((state.mean_pressure - load).abs() < 1e-12);
    }
}

/// Returns a wave of unit amplitude along x, with a strip of four nodes along y.
fn wave(nodes: usize, adhesion: Adhesion) -> AdhesivePath {
    let grid = rectangle([nodes, 4], [1.0, 4.0 / nodes as f64]);
    let height = |node: usize| libm::cos(TAU * ((node / 4) as f64 + 0.5) / nodes as f64);
    let heights: Vec<f64> = (0..grid.count()).map(height).collect();
    AdhesivePath::new(Threads::one(), &PeriodicHalfSpace::new(grid), adhesion, &on(grid, &heights))
}

/// Returns the half width, in wavelengths, of the stable contact of a wave with adhesion α under a
/// mean pressure (Johnson 1995).
fn half_width_of_johnson(alpha: f64, pressure: f64) -> f64 {
    let [mut low, mut high] = [0.1, 0.3];
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let angle = PI * middle;
        let found = libm::sin(angle).powi(2) - alpha * libm::tan(angle).sqrt();
        *(if found > pressure { &mut high } else { &mut low }) = middle;
    }
    0.5 * (low + high)
}

#[test]
fn a_wave_with_short_ranged_attraction_is_that_of_johnson() {
    let alpha: f64 = 0.1;
    let work = 0.5 * (alpha * PI).powi(2);
    let mut path = wave(2048, Adhesion::new(work, 0.014_726_215_6).unwrap());
    // reference/adhesion/johnson_1995_exponential.csv.
    for [gap, pressure, half_width] in [
        [0.6, 0.125297929, 0.143066406],
        [0.4, 0.244074174, 0.19140625],
        [0.25, 0.371314335, 0.236816406],
    ] {
        let state = solved(&mut path, Target::MeanGap(gap));
        let found = state.mean_pressure / PI;
        assert!((found - pressure).abs() < 1e-7, "{gap}: {found}");
        let width = state.contact_nodes as f64 / (4.0 * 2048.0);
        assert!((width - 2.0 * half_width).abs() < 1.5 / 2048.0, "{gap}: {width}");
        // The zone of attraction at the edge is about 0.003 wavelengths wide.
        let expected = half_width_of_johnson(alpha, found);
        assert!((0.5 * width - expected).abs() < 0.004, "{gap}: {width}");
    }
}

#[test]
fn the_energy_falls_with_the_gap_by_the_pressure() {
    let mut path = path(64, &rough64(), Adhesion::new(0.002, 0.010).unwrap());
    solved(&mut path, Target::MeanGap(0.07));
    let middle = solved(&mut path, Target::MeanGap(0.05));
    let gap = path.gap().map(<[f64]>::to_vec);
    let step = 1e-5;
    let energies = [-step, step].map(|change| {
        path.resume(gap.clone());
        let state = solved(&mut path, Target::MeanGap(0.05 + change));
        state.elastic_energy + state.adhesion_energy
    });
    let slope = (energies[1] - energies[0]) / (2.0 * step);
    assert!((slope + middle.mean_pressure).abs() < 1e-5, "{slope}, {}", middle.mean_pressure);
}

#[test]
fn far_apart_rigid_surfaces_attract_each_other() {
    let (work, range, gap) = (1e-7, 0.05, 0.3);
    let heights = rough64();
    let mean = heights.iter().sum::<f64>() / 4096.0;
    let pull = |height: &f64| work / range * libm::exp(-(gap + mean - height) / range);
    let expected = -heights.iter().map(pull).sum::<f64>() / 4096.0;
    let mut path = path(64, &heights, Adhesion::new(work, range).unwrap());
    let settings = Settings { tolerance: 1e-13, ..Settings::default() };
    let state = path.step(Target::MeanGap(gap), &settings, &|| false);
    assert_eq!(state.stop, Stop::Converged);
    assert_eq!(state.contact_nodes, 0);
    assert!((state.mean_pressure / expected - 1.0).abs() < 2e-4, "{state:?}");
}

#[test]
fn a_resumed_path_has_the_bytes_of_an_uninterrupted_one() {
    let adhesion = Adhesion::new(0.006, 0.020).unwrap();
    let heights = rough64();
    let targets = [Target::MeanGap(0.1), Target::MeanGap(0.05), Target::Load(0.001)];
    let mut whole = path(64, &heights, adhesion);
    for (done, target) in targets.into_iter().enumerate() {
        let stored = whole.gap().map(<[f64]>::to_vec);
        let state = solved(&mut whole, target);
        let mut resumed = path(64, &heights, adhesion);
        resumed.resume(stored);
        assert_eq!(solved(&mut resumed, target), state, "{done}");
        assert_eq!(resumed.gap(), whole.gap());
        assert_eq!(resumed.pressure(), whole.pressure());
    }
    // An interrupted state is not part of the path that is resumed.
    let stored = whole.gap().map(<[f64]>::to_vec);
    let target = Target::MeanGap(0.03);
    let interrupted = whole.step(target, &Settings::default(), &|| true);
    assert_eq!(interrupted.stop, Stop::Interrupted);
    let mut resumed = path(64, &heights, adhesion);
    resumed.resume(stored.clone());
    whole.resume(stored);
    assert_eq!(solved(&mut whole, target), solved(&mut resumed, target));
}

#[test]
fn states_do_not_depend_on_the_number_of_threads() {
    let nodes = 512;
    let at = |index: usize| TAU * index as f64 / nodes as f64;
    let height = |node: usize| {
        let (x, y) = (at(node / nodes), at(node % nodes));
        0.02 * (libm::cos(3.0 * x + 2.0 * y) + libm::cos(5.0 * y - x) + libm::sin(7.0 * x))
    };
    let heights: Vec<f64> = (0..nodes * nodes).map(height).collect();
    let adhesion = Adhesion::new(0.0005, 0.005).unwrap();
    let states = [1, 3].map(|count| {
        let mut path = path(nodes, &heights, adhesion);
        path.set_threads(Threads::new(NonZeroUsize::new(count).unwrap()));
        let settings = Settings { tolerance: 1e-6, ..Settings::default() };
        let state = path.step(Target::MeanGap(0.03), &settings, &|| false);
        (state, path.gap().unwrap().to_vec(), path.pressure().to_vec())
    });
    assert!(states[0] == states[1]);
}

#[test]
fn stiff_bodies_bear_the_light_load_that_is_prescribed() {
    // Steel with a work of adhesion of 50 mJ/m² and a range of 0.1 µm: w/ρ is 2e-5 E* h′.
    let adhesion = Adhesion::new(2e-7, 0.01).unwrap();
    let settings = Settings { tolerance: 5e-5, ..Settings::default() };
    for load in [4e-8, 4e-6, 4e-5, 4e-3] {
        let mut path = path(64, &rough64(), adhesion);
        let state = path.step(Target::Load(load), &settings, &|| false);
        assert_eq!(state.stop, Stop::Converged);
        assert!((state.mean_pressure / load - 1.0).abs() < 0.01, "{load}: {state:?}");
    }
}

#[test]
fn without_work_of_adhesion_nothing_attracts() {
    let mut path = path(64, &rough64(), Adhesion::new(0.0, 0.01).unwrap());
    let state = solved(&mut path, Target::Load(0.05));
    assert_eq!((state.adhesion_energy, state.attractive_pressure), (0.0, 0.0));
    assert!((state.mean_pressure - 0.05).abs() < 1e-15);
    assert_eq!(state.contact_nodes, state.repulsive_nodes);
    assert_eq!(step(&mut path, Target::Load(-0.01)).stop, Stop::PulledOff);
}

#[test]
fn what_is_no_interaction_is_refused() {
    assert_eq!(Adhesion::new(-1e-3, 0.1), Err(AdhesionError::Work(-1e-3)));
    assert!(Adhesion::new(f64::NAN, 0.1).is_err());
    assert!(Adhesion::new(f64::INFINITY, 0.1).is_err());
    for range in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Adhesion::new(1.0, range).is_err(), "{range}");
    }
}

#[test]
fn a_tension_above_the_largest_attraction_pulls_off_at_once() {
    let adhesion = Adhesion::new(0.006, 0.020).unwrap();
    let mut path = path(64, &rough64(), adhesion);
    let apart = step(&mut path, Target::Load(-0.001));
    assert_eq!((apart.stop, apart.pull_off_load), (Stop::PulledOff, None));
    assert_eq!(path.gap(), None);
    // A load that is not negative brings the bodies together.
    solved(&mut path, Target::Load(0.02));
    let state = step(&mut path, Target::Load(-1.0));
    assert_eq!(state.stop, Stop::PulledOff);
    let load = state.pull_off_load.unwrap();
    assert!(load > -0.3 && load < 0.0, "{load}");
    assert_eq!(path.gap(), None);
}

#[test]
fn extreme_interactions_give_finite_states() {
    let heights = rough64();
    for (work, range) in
        [(1e6, 0.01), (1e9, 1e-9), (1e-3, 1e-9), (1e-3, 1e9), (1e9, 1e9), (1e-300, 0.01)]
    {
        let adhesion = Adhesion::new(work, range).unwrap();
        for target in [Target::MeanGap(0.05), Target::Load(0.05), Target::MeanGap(1e-7)] {
            let mut path = path(64, &heights, adhesion);
            let settings = Settings { pair_limit: 400, ..Settings::default() };
            let state = path.step(target, &settings, &|| false);
            let case = format!("{work} {range} {target:?}: {state:?}");
            assert!(state.mean_pressure.is_finite() && state.residual.is_finite(), "{case}");
            assert!(path.gap().unwrap().iter().all(|gap| *gap >= 0.0 && gap.is_finite()), "{case}");
            assert!(state.pairs < 440, "{case}");
        }
    }
}

#[test]
fn paths_may_jump_and_a_single_node_is_a_surface() {
    let mut path = path(64, &rough64(), Adhesion::new(0.006, 0.020).unwrap());
    for gap in [0.3, 0.006, 0.5, 0.02, 1e-6] {
        let state = solved(&mut path, Target::MeanGap(gap));
        assert!((state.mean_gap / gap - 1.0).abs() < 1e-9);
    }
    let mut node = super::path(1, &[7.0], Adhesion::new(0.01, 0.1).unwrap());
    let state = solved(&mut node, Target::MeanGap(0.1));
    assert!((state.mean_pressure + 0.1 * libm::exp(-1.0)).abs() < 1e-15);
    let state = solved(&mut node, Target::Load(1.0));
    assert_eq!((state.contact_nodes, state.mean_gap), (1, 0.0));
    let state = step(&mut node, Target::Load(-0.2));
    assert_eq!(state.stop, Stop::PulledOff);
    assert!((state.pull_off_load.unwrap() + 0.1).abs() < 1e-4);
}

#[test]
fn a_pair_limit_during_the_search_for_the_pull_off_load_parts_the_bodies() {
    let mut path = wave(32, Adhesion::new(0.01, 0.1).unwrap());
    let settings = Settings::default();
    assert_eq!(path.step(Target::Load(0.05), &settings, &|| false).stop, Stop::Converged);
    let few = Settings { pair_limit: 1, ..settings };
    let state = path.step(Target::Load(-10.0), &few, &|| false);
    assert_eq!(state.stop, Stop::PairLimit);
    assert!(state.residual > settings.tolerance);
    assert!(path.gap().is_none());
    assert_eq!(state.pull_off_load, None);
    assert_eq!(path.step(Target::Load(0.05), &settings, &|| false).stop, Stop::Converged);
}

#[test]
fn a_wave_whose_nodes_close_one_after_another_reaches_every_load_from_both_sides() {
    // reference/faults/F5-stalls-pair-limit: a wave of unit rms slope on eight nodes.
    let grid = rectangle([8, 7], [1.0, 0.875]);
    let height = |node: usize| libm::cos(TAU * (node / 7) as f64 / 8.0) / (PI * SQRT_2);
    let heights: Vec<f64> = (0..grid.count()).map(height).collect();
    let adhesion = Adhesion::new(0.030_601_5, 0.098_090_0).unwrap();
    let body = PeriodicHalfSpace::new(grid);
    let mut path = AdhesivePath::new(Threads::one(), &body, adhesion, &on(body.grid(), &heights));
    let loads = [0.0074075, 0.0010146, -0.0641486, 0.0018188, -0.0641486, 0.0010146, 0.0074075];
    let states = loads.map(|load| solved(&mut path, Target::Load(load)));
    assert!(states.iter().all(|state| state.pairs < 60), "{states:?}");
    let nodes = states.map(|state| state.contact_nodes);
    assert_eq!(nodes, [21, 21, 7, 21, 7, 21, 21]);
    for (one, other) in states.iter().zip(states.iter().rev()) {
        let energy = |state: &AdhesiveState| state.elastic_energy + state.adhesion_energy;
        assert!((energy(one) - energy(other)).abs() < 1e-9, "{one:?} {other:?}");
    }
}

#[test]
fn a_state_that_rounding_keeps_from_the_tolerance_ends_with_few_pairs() {
    let mut path = path(64, &rough64(), Adhesion::new(0.006, 0.020).unwrap());
    let settings = Settings { tolerance: 0.0, ..Settings::default() };
    for target in [Target::MeanGap(0.05), Target::Load(0.02)] {
        let state = path.step(target, &settings, &|| false);
        assert_eq!(state.stop, Stop::Stalled, "{state:?}");
        assert!(state.residual < 1e-12 && state.pairs < 1500, "{state:?}");
    }
}

#[test]
fn the_pull_off_load_does_not_depend_on_the_loads_before_it() {
    // A step from the second of five loads tears off bodies that bear more if it is approached.
    let heights = [
        -1, 3, -16, 0, -12, -2, 0, -2, -9, 0, 9, 9, 15, 20, 5, 1, 7, 11, -5, -14, 7, 4, -8, -4, -21,
    ];
    let heights = heights.map(|height| 0.01 * f64::from(height));
    let adhesion = Adhesion::new(0.015_343_366, 0.158_880_187).unwrap();
    let strongest = adhesion.largest_attraction();
    let pull_off = |steps: u32| {
        let mut path = path(5, &heights, adhesion);
        let settings = Settings { pull_off_tolerance: 1e-5, ..Settings::default() };
        let load = |step: u32| 0.1 - (0.1 + 1.001 * strongest) * f64::from(step) / f64::from(steps);
        let states =
            (0..=steps).map(|step| path.step(Target::Load(load(step)), &settings, &|| false));
        states.filter_map(|state| state.pull_off_load).next().unwrap()
    };
    let slow = pull_off(400);
    for steps in [1, 2, 3, 5, 20] {
        let found = pull_off(steps);
        assert!((found - slow).abs() < 2e-5 * strongest, "{steps}: {found} for {slow}");
    }
}

#[test]
fn states_of_symmetric_surfaces_are_minima_of_the_energy() {
    // Four equal summits, of which some would let go first if the surface were not symmetric.
    let wave = |index: usize| libm::cos(2.0 * TAU * (index as f64 + 0.5) / 16.0);
    let heights: Vec<f64> = (0..256).map(|node| 0.03 * wave(node / 16) * wave(node % 16)).collect();
    let tilted: Vec<f64> =
        heights.iter().enumerate().map(|(node, height)| height + 1e-7 * node as f64).collect();
    let adhesion = Adhesion::new(0.005_12, 0.02).unwrap();
    let mut symmetric = path(16, &heights, adhesion);
    let mut tilted = path(16, &tilted, adhesion);
    for step in (1..=12).rev().chain(1..=20) {
        let target = Target::MeanGap(0.005 * f64::from(step));
        let state = solved(&mut symmetric, target);
        tilted.resume(symmetric.gap().map(<[f64]>::to_vec));
        let other = solved(&mut tilted, target);
        let energy = |state: &AdhesiveState| state.elastic_energy + state.adhesion_energy;
        let fallen = energy(&state) - energy(&other);
        // The tilt changes heights by 3e-5 and the energy by less than 1e-6.
        assert!(fallen < 1e-6, "{target:?}: {fallen} {state:?}");
    }
}
