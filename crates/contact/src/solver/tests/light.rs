//! Loads so light that a few nodes bear them, or one, or plateaus at next to no pressure.

use super::reference::npy_array;
use super::*;
use crate::topography::moments::Moments;
use crate::topography::random::{Amplitude, RandomSurface};
use crate::topography::shapes::Shape;
use crate::topography::spectrum::Spectrum;
use crate::topography::surface::Surface;

/// Of unit rms slope on a unit cell.
fn reduced(surface: Surface) -> Vec<f64> {
    let unit = Moments::of(&surface).rms_slope() * surface.grid().cell().longer_side();
    surface.heights().iter().map(|h| h / unit).collect()
}

fn shape(nodes: usize, shape: Shape) -> Vec<f64> {
    reduced(shape.draw(square(nodes, 1.0)))
}

fn random(nodes: usize, hurst: f64, k_lower: u32, realization: u32) -> Vec<f64> {
    let surface = RandomSurface {
        spectrum: Spectrum {
            hurst,
            k_lower,
            k_rolloff: k_lower,
            k_upper: nodes as u32 / 2,
            anisotropy: None,
        },
        amplitude: Amplitude::Gaussian,
        rms_slope: 1.0,
        seed: 7,
        realization,
    };
    reduced(surface.draw(square(nodes, 1.0)))
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

/// A measured surface, which the repository has and the package of this crate has not.
fn measured() -> Option<Vec<f64>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/measured/afm_10um_256.npy");
    let (_, heights) = npy_array(&std::fs::read(path).ok()?);
    Some(reduced(Surface::new(square(256, 1e-5), heights).unwrap()))
}

/// Heights in steps, as converters of instruments give them.
fn stepped(heights: &[f64], steps: f64) -> Vec<f64> {
    let top = heights.iter().fold(0.0, |top: f64, h| top.max(*h));
    let step = top / steps;
    heights.iter().map(|h| (h / step).round() * step).collect()
}

/// Heights on meshes of either kind of transform.
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
                // Above the rounding of heights.
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
        let sinks =
            PeriodicHalfSpace::new(square(32, 1.0)).nodal_compliance(&Threads::one()) * bears;
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
        // Singular at the rim.
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
fn a_load_that_is_given_up_spoils_none_after_it() {
    for seed in 0..6 {
        let heights = rough(33, seed);
        let [mut fresh, mut worn] = [0; 2].map(|_| super::solver(33, &heights));
        for (pair_limit, load) in [(1, 1e-12), (150, 1e-60), (3, 1e-9), (200, 1e-13), (5, 0.01)] {
            let unreachable = Settings { tolerance: 1e-20, pair_limit };
            let outcome = press(&mut worn, load, &unreachable);
            assert_pressed(&outcome, &worn, load);
        }
        for load in [1e-12, 1e-3, 0.1] {
            let settings = Settings::default();
            let outcome = press(&mut worn, load, &settings);
            assert_eq!(outcome.stop, Stop::Converged);
            let alone = press(&mut fresh, load, &settings);
            assert_eq!(outcome.contact_nodes, alone.contact_nodes);
        }
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
