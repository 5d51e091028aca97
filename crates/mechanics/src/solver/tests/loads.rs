//! Tests of very light loads, borne by a few nodes, by one, or by plateaus at almost no pressure;
//! and of loads that are solved on coarser meshes first.

use std::f64::consts::TAU;

use super::*;
use crate::elasticity::{ElasticOperator, Factor, FreeHalfSpace};
use crate::grid::samples::rectangle;
use crate::topography::moments::Moments;
use crate::topography::random::{RandomSurface, samples};
use crate::topography::shapes::Shape;
use crate::topography::surface::Surface;

fn shape(nodes: usize, shape: Shape) -> Vec<f64> {
    reduced(&shape.draw(square(nodes, 1.0)))
}

fn random(nodes: usize, hurst: f64, k_lower: u32, realization: u32) -> Vec<f64> {
    let mut surface =
        RandomSurface { realization, ..samples::random(k_lower, nodes as u32 / 2, 7) };
    surface.spectrum.hurst = hurst;
    reduced(&surface.draw(square(nodes, 1.0)))
}

fn shapes(nodes: usize) -> Vec<Vec<f64>> {
    let [amplitude, radius] = [0.01, 0.2];
    let shapes = [
        Shape::Paraboloid { radius: 0.5 },
        Shape::Wave { amplitude, waves: 1 },
        Shape::WaveProduct { amplitude, waves: 2 },
        Shape::WaveSum { amplitude, waves: 3 },
        Shape::Punch { radius, depth: 0.1 },
        Shape::Punch { radius, depth: 0.001 },
    ];
    shapes.map(|each| shape(nodes, each)).into()
}

/// Reads a measured surface of the repository, which the published package does not contain.
fn measured() -> Option<Vec<f64>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/measured/afm_10um_256.npy");
    let (_, heights) = npy_array(&std::fs::read(path).ok()?);
    Some(reduced(&Surface::new(square(256, 1e-5), heights).unwrap()))
}

/// Rounds heights to multiples of the highest height divided by `steps`, as the converters of
/// instruments do.
fn stepped(heights: &[f64], steps: f64) -> Vec<f64> {
    let top = heights.iter().fold(0.0, |top: f64, h| top.max(*h));
    let step = top / steps;
    heights.iter().map(|h| (h / step).round() * step).collect()
}

/// Returns surfaces with their numbers of nodes per side, on meshes for both implementations of the
/// convolution.
fn surfaces() -> Vec<(usize, Vec<f64>)> {
    let mut surfaces = vec![(256, random(256, 0.8, 4, 0))];
    surfaces.extend(measured().map(|heights| (256, heights)));
    for nodes in [32, 36, 64] {
        let mut add = |heights| surfaces.push((nodes, heights));
        shapes(nodes).into_iter().for_each(&mut add);
        for realization in 0..12 {
            let k_lower = 1 + realization % 4;
            add(random(nodes, 0.2, k_lower, realization));
            add(random(nodes, 0.8, k_lower, realization));
        }
        add(noise(nodes, 1));
        add(stepped(&rough(nodes, 2), 10.0));
        add(stepped(&rough(nodes, 3), 1000.0));
    }
    surfaces
}

fn assert_pressed(outcome: &Outcome, solver: &Solver, load: f64) {
    assert!(outcome.contact_nodes >= 1, "{load}: {outcome:?}");
    let numbers = [outcome.residual, outcome.mean_gap, outcome.energy];
    assert!(numbers.iter().all(|number| number.is_finite()), "{load}: {outcome:?}");
    let peak = outcome.peak_pressure;
    let most = load * solver.pressure().len() as f64;
    assert!(peak >= load && peak <= 1.000001 * most, "{load}: {peak}");
    assert!((mean(solver.pressure()) / load - 1.0).abs() < 1e-12);
}

#[test]
fn every_load_is_borne_and_solved_however_light() {
    let loads = || (-15..=-9).map(|exponent| 10_f64.powi(exponent));
    for (nodes, heights) in surfaces() {
        for tolerance in [Settings::default().tolerance, 1e-8] {
            let settings = Settings { tolerance, pair_limit: 100 };
            let solve = |solver: &mut Solver, load| {
                let outcome = press(solver, load, &settings);
                assert_eq!(outcome.stop, Stop::Converged, "{nodes}, {load}");
                assert_pressed(&outcome, solver, load);
                // The rounding of heights adds to the residual.
                let rounding = 1e-15 * nodes as f64;
                assert_complementary(solver, &heights, load, tolerance + rounding);
            };
            let mut block = super::solver(nodes, &heights);
            for load in loads() {
                solve(&mut super::solver(nodes, &heights), load);
                solve(&mut block, load);
            }
        }
    }
}

#[test]
fn the_highest_node_bears_what_bends_less_than_the_next_is_lower() {
    for realization in 0..20 {
        let heights = random(32, 0.5, 2, realization);
        let mut solver = super::solver(32, &heights);
        let highest =
            (0..heights.len()).max_by(|a, b| heights[*a].total_cmp(&heights[*b])).unwrap();
        let outcome = press(&mut solver, 1e-12, &Settings::default());
        assert_eq!(outcome.contact_nodes, 1);
        let bears = 1e-12 * heights.len() as f64;
        assert!((solver.pressure()[highest] / bears - 1.0).abs() < 1e-12);
        let sinks = PeriodicHalfSpace::new(square(32, 1.0))
            .nodal(Factor::Displacement, &Threads::one())
            * bears;
        assert!((outcome.energy / (0.5 * 1e-12 * sinks) - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_flat_face_touches_as_a_whole_however_light_the_load() {
    let heights = shape(128, Shape::Punch { radius: 0.3, depth: 0.001 });
    let face = heights.iter().filter(|height| **height == 0.0).count();
    for exponent in [-15, -12, -9, -7, -6, -5] {
        let mut solver = super::solver(128, &heights);
        let load = 10_f64.powi(exponent);
        let outcome = press(&mut solver, load, &Settings::default());
        assert_eq!(outcome.stop, Stop::Converged);
        assert_eq!(outcome.contact_nodes, face, "{load}");
        // The pressure is singular at the rim.
        assert!(outcome.peak_pressure > 1.5 * load * (128 * 128) as f64 / face as f64);
    }
}

#[test]
fn strips_along_the_rows_are_found_where_a_sample_of_rows_shows_their_edges_alone() {
    let wave = Shape::Wave { amplitude: 0.01, waves: 1 };
    let heights = shape(256, wave);
    for load in [1e-5, 1e-4, 3e-4] {
        let mut solver = super::solver(256, &heights);
        let settings = Settings { pair_limit: 150, ..Settings::default() };
        let outcome = press(&mut solver, load, &settings);
        assert_eq!(outcome.stop, Stop::Converged, "{load}: {outcome:?}");
    }
}

#[test]
fn loads_in_any_order_are_solved() {
    for seed in 0..4 {
        let heights = rough(32, seed);
        let mut solver = super::solver(32, &heights);
        for load in [0.3, 1e-15, 1e-10, 0.01, 2e-4, 1e-7, 1e-8, 1e-3, 1e-60, 1e-12] {
            let outcome = press(&mut solver, load, &Settings::default());
            assert_eq!(outcome.stop, Stop::Converged, "{load}");
            assert_pressed(&outcome, &solver, load);
        }
    }
}

/// Minimum number of nodes per side for which coarser meshes are used.
const NODES: usize = 512;

/// Returns a surface of unit rms slope without waves shorter than `shortest` nodes.
fn smooth(nodes: usize, shortest: u32, seed: u64) -> Vec<f64> {
    let surface = samples::random(2, nodes as u32 / shortest, seed);
    surface.draw(square(nodes, 1.0)).into_heights()
}

fn yielding(hardness: f64, heights: &[f64]) -> Solver {
    let body = Body { hardness: Some(Hardness::new(hardness).unwrap()), ..Body::default() };
    body.solver(&on(square(NODES, 1.0), heights))
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
        let reduced = on(body.grid(), heights);
        let mut solver = Solver::with_threads(Threads::one(), body, hardness, &reduced);
        for (load, tolerance) in [(0.003, 5e-5), (0.1, 5e-5), (0.02, 1e-9), (0.3, 1e-9)] {
            let settings = Settings { tolerance, ..Settings::default() };
            let outcome = press(&mut solver, load, &settings);
            assert_eq!(outcome.stop, Stop::Converged, "{load}");
            // The final decision changes gaps by a part of the residual.
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
        let slope = Moments::from_surface(&surface).rms_slope();
        surface.heights().iter().map(|h| h / slope).collect()
    });
    // In the last map, every second node says nothing about the nodes in between.
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
    // Above all peaks but the last, by so little that a coarser mesh may exceed it.
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
fn a_load_stops_on_request_on_a_coarser_mesh_and_can_be_solved_later() {
    let heights = smooth(NODES, 8, 5);
    for hardness in [None, Some(0.25)] {
        let mut solver = match hardness {
            None => solver(NODES, &heights),
            Some(hardness) => yielding(hardness, &heights),
        };
        for load in [0.02, 0.1] {
            let outcome = solver.press(load, &Settings::default(), &|| true);
            assert_eq!(outcome.stop, Stop::Interrupted);
            assert!(outcome.contact_nodes > 0);
            // Row by row, because a long sum would be rounded.
            let rows = solver.pressure().chunks_exact(NODES).map(mean);
            assert!((mean(&Vec::from_iter(rows)) / load - 1.0).abs() < 1e-12);
        }
        assert_eq!(press(&mut solver, 0.1, &Settings::default()).stop, Stop::Converged);
        assert_complementary(&solver, &heights, 0.1, 1e-4);
    }
}
