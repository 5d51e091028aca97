//! Loads far from those before, which are solved for on coarser meshes first.

use std::f64::consts::TAU;
use std::num::NonZeroUsize;

use super::*;
use crate::elasticity::{ElasticOperator, FreeHalfSpace};
use crate::grid::samples::rectangle;
use crate::topography::moments::Moments;
use crate::topography::random::{Amplitude, RandomSurface};
use crate::topography::shapes::Shape;
use crate::topography::spectrum::Spectrum;

/// The fewest nodes a side from which on there are coarser meshes.
const NODES: usize = 512;

/// Of unit rms slope, with no wave shorter than so many nodes.
fn smooth(nodes: usize, shortest: u32, seed: u64) -> Vec<f64> {
    let surface = RandomSurface {
        spectrum: Spectrum {
            hurst: 0.8,
            k_lower: 2,
            k_rolloff: 2,
            k_upper: nodes as u32 / shortest,
            anisotropy: None,
        },
        amplitude: Amplitude::Gaussian,
        rms_slope: 1.0,
        seed,
        realization: 0,
    };
    surface.draw(square(nodes, 1.0)).into_heights()
}

fn contact(solver: &Solver) -> Vec<bool> {
    solver.pressure().iter().map(|p| *p > 0.0).collect()
}

fn yielding(hardness: f64, heights: &[f64]) -> Solver {
    let body = PeriodicHalfSpace::new(square(NODES, 1.0));
    Solver::yielding(body, Some(Hardness::new(hardness).unwrap()), heights)
}

#[test]
fn pairs_do_not_grow_with_the_mesh_and_hardly_depend_on_the_load() {
    for nodes in [NODES, 2 * NODES] {
        let mut solver = solver(nodes, &smooth(nodes, 16, 1));
        for load in [0.002, 0.02, 0.2, 0.01, 1.0] {
            let outcome = press(&mut solver, load, &Settings::default());
            assert_eq!(outcome.stop, Stop::Converged);
            assert!(outcome.pairs <= 18, "{nodes}, {load}: {}", outcome.pairs);
        }
    }
}

#[test]
fn far_loads_have_the_contact_to_which_near_ones_lead() {
    for shortest in [2, 16] {
        let heights = smooth(NODES, shortest, 2);
        let (mut far, mut near) = (solver(NODES, &heights), solver(NODES, &heights));
        let settings = Settings { tolerance: 1e-9, ..Settings::default() };
        for step in 0..9 {
            let load = 0.1 * 1.25_f64.powi(step);
            assert_eq!(press(&mut near, load, &settings).stop, Stop::Converged);
            if step % 4 > 0 {
                continue;
            }
            assert_eq!(press(&mut far, load, &settings).stop, Stop::Converged);
            assert!(contact(&far) == contact(&near), "{shortest}, {load}");
            for (a, b) in far.pressure().iter().zip(near.pressure()) {
                assert!((a - b).abs() < 1e-6, "{shortest}, {load}: {a}, {b}");
            }
        }
    }
}

#[test]
fn all_bodies_and_meshes_satisfy_the_conditions_of_contact() {
    let square = square(NODES, 1.0);
    let oblong = rectangle([NODES, 2 * NODES], [0.7, 1.0]);
    let large = smooth(2 * NODES, 8, 3);
    let rows = large.chunks_exact(2 * NODES).take(NODES);
    let cut: Vec<f64> = rows.flat_map(|row| &row[..NODES]).copied().collect();
    let hardness = Hardness::new(0.4).unwrap();
    let bodies: [(Box<dyn ElasticOperator>, Option<Hardness>); 4] = [
        (Box::new(PeriodicHalfSpace::new(square)), Some(hardness)),
        (Box::new(PeriodicHalfSpace::new(oblong)), None),
        (Box::new(FreeHalfSpace::new(square)), None),
        (Box::new(FreeHalfSpace::new(square)), Some(hardness)),
    ];
    for (body, hardness) in bodies {
        let is_oblong = body.grid() == oblong;
        let heights = if is_oblong { &large[..oblong.count()] } else { &cut };
        let mut solver = Solver::on(Threads::one(), body, hardness, heights);
        for (load, tolerance) in [(0.003, 5e-5), (0.1, 5e-5), (0.02, 1e-9), (0.3, 1e-9)] {
            let settings = Settings { tolerance, ..Settings::default() };
            let outcome = press(&mut solver, load, &settings);
            assert_eq!(outcome.stop, Stop::Converged, "{load}");
            // What is decided in the end moves gaps by a part of the residual.
            assert_complementary(&solver, heights, load, 1.5 * tolerance);
        }
    }
}

#[test]
fn shapes_and_noise_are_pressed_from_the_first_touch_on() {
    let grid = square(NODES, 1.0);
    let shapes = [
        Shape::Paraboloid { radius: 0.5 },
        Shape::Wave { amplitude: 0.01, waves: 3 },
        Shape::WaveProduct { amplitude: 0.01, waves: 2 },
        Shape::Punch { radius: 0.2, depth: 0.1 },
    ];
    let drawn = shapes.map(|shape| {
        let surface = shape.draw(grid);
        let slope = Moments::of(&surface).rms_slope();
        surface.heights().iter().map(|h| h / slope).collect()
    });
    // The last one has nothing in common with what its every second node shows.
    let ripple = map(NODES, |x, y| {
        let [fast, slow] = [TAU * 256.0 * x, TAU * (255.0 * y + x)];
        1e-3 * (fast.cos() + slow.cos())
    });
    for heights in drawn.into_iter().chain([noise(NODES, 1), ripple]) {
        let mut solver = solver(NODES, &heights);
        let full = solver.full_contact_load().unwrap();
        for load in [1e-9, 1e-5, 1e-3, 0.1 * full, 0.8 * full, 0.01 * full] {
            let outcome = press(&mut solver, load, &Settings::default());
            assert_eq!(outcome.stop, Stop::Converged, "{load}: {outcome:?}");
            assert_complementary(&solver, &heights, load, 1e-4);
        }
    }
}

#[test]
fn a_hardness_that_no_pressure_passes_changes_no_bit_and_one_that_some_pass_is_borne() {
    let heights = smooth(NODES, 8, 4);
    let mut elastic = solver(NODES, &heights);
    let loads = [0.001, 0.01, 0.05];
    let peaks = loads.map(|load| press(&mut elastic, load, &Settings::default()).peak_pressure);
    // Above all but the last peak, by so little that a coarser mesh may pass it.
    let hardness = peaks[1].max(peaks[0]) * (1.0 + 1e-6);
    assert!(hardness < peaks[2]);
    let (mut elastic, mut bounded) = (solver(NODES, &heights), yielding(hardness, &heights));
    for load in &loads[..2] {
        press(&mut elastic, *load, &Settings::default());
        press(&mut bounded, *load, &Settings::default());
        let bits = |solver: &Solver| -> Vec<u64> {
            solver.pressure().iter().map(|p| p.to_bits()).collect()
        };
        assert!(bits(&elastic) == bits(&bounded), "{load}");
    }
    let outcome = press(&mut bounded, loads[2], &Settings::default());
    assert_eq!(outcome.peak_pressure, hardness);
    assert!(outcome.saturated_nodes > 0);
    assert_complementary(&bounded, &heights, loads[2], 1e-4);
}

#[test]
fn a_load_ends_where_it_is_told_to_on_a_coarser_mesh_and_can_be_taken_up_again() {
    let heights = smooth(NODES, 8, 5);
    // A quarter of which many add up without rounding.
    for hardness in [None, Some(0.25)] {
        let mut solver = match hardness {
            None => solver(NODES, &heights),
            Some(hardness) => yielding(hardness, &heights),
        };
        for load in [0.02, 0.1] {
            let outcome = solver.press(load, &Settings::default(), &|| true);
            assert_eq!(outcome.stop, Stop::Interrupted);
            assert!(outcome.contact_nodes > 0);
            assert!((mean(solver.pressure()) / load - 1.0).abs() < 1e-12);
        }
        assert_eq!(press(&mut solver, 0.1, &Settings::default()).stop, Stop::Converged);
        assert_complementary(&solver, &heights, 0.1, 1e-4);
    }
}

#[test]
fn a_restored_solver_goes_on_with_the_same_bits_on_any_threads() {
    let heights = smooth(NODES, 8, 6);
    let mut solver = super::solver(NODES, &heights);
    press(&mut solver, 0.01, &Settings::default());
    press(&mut solver, 0.05, &Settings::default());
    let mut bytes = Vec::new();
    solver.save(&mut bytes).unwrap();
    let mut restored = super::solver(NODES, &heights);
    restored.restore(&mut bytes.as_slice()).unwrap();
    let three = Threads::new(NonZeroUsize::new(3).unwrap());
    restored.work_on(three);
    for load in [0.055, 0.2, 0.21] {
        let outcomes =
            [&mut solver, &mut restored].map(|solver| press(solver, load, &Settings::default()));
        assert_eq!(outcomes[0], outcomes[1]);
        assert!(solver.pressure() == restored.pressure(), "{load}");
    }
}
