//! Properties of all surfaces, tested on random and difficult ones.
//!
//! The outcome describes the stored pressures correctly (the residual, recomputed from the elastic
//! kernel alone, the mean pressure and the bounds). A solution depends on the surface, the load and
//! the settings only: not on the number of threads or on other loads.

use std::f64::consts::TAU;
use std::num::NonZeroUsize;

use proptest::prelude::*;

use super::*;
use crate::elasticity::FreeHalfSpace;
use crate::grid::samples::rectangle;
use crate::grid::{Boundary, Grid};
use crate::threads::Threads;
use crate::topography::random::samples;
use crate::topography::shapes::Shape;
use crate::topography::surface::Surface;

#[test]
fn hard_surfaces_are_solved_to_the_last_digits() {
    let peak = map(33, |x, y| if x == 0.0 && y == 0.0 { 0.1 } else { 0.0 });
    let ripple =
        map(32, |x, y| 0.01 * (TAU * 16.0 * x).cos() + 0.01 * (TAU * (15.0 * y + x)).cos());
    for (nodes, heights) in [(64, noise(64, 1)), (33, peak), (32, ripple), (47, rough(47, 2))] {
        let mut solver = super::solver(nodes, &heights);
        let full = solver.full_contact_load().unwrap();
        for load in [1e-8, 1e-3, 0.01 * full, 0.3 * full, 0.9 * full, (1.0 - 1e-6) * full] {
            solved(&mut solver, load);
            assert_complementary(&solver, &heights, load, 2e-12);
        }
        assert_eq!(press(&mut solver, full, &TIGHT).stop, Stop::FullContact);
        assert_complementary(&solver, &heights, full, 2e-12);
    }
}

#[test]
fn contact_outside_the_sample_of_rows_is_found() {
    // On this mesh every fourth pair of rows is sampled, and the peak is in the first.
    let peak = map(256, |x, y| if x == 0.0 && y == 0.0 { 0.1 } else { 0.0 });
    let ridge = map(256, |x, _| if x == 0.0 { 0.01 } else { 0.0 });
    for heights in [peak, ridge, noise(256, 4), noise(256, 5)] {
        let mut solver = super::solver(256, &heights);
        let full = solver.full_contact_load().unwrap();
        for load in [1e-8, 1e-6, 1e-3 * full, 0.3 * full, 0.9 * full] {
            solved(&mut solver, load);
            assert_complementary(&solver, &heights, load, 2e-12);
        }
    }
}

#[test]
fn a_flat_surface_is_in_full_contact_under_any_load() {
    for nodes in [1, 2, 9] {
        let mut solver = super::solver(nodes, &vec![0.7; nodes * nodes]);
        let outcome = press(&mut solver, 1e-6, &TIGHT);
        assert_eq!((outcome.stop, outcome.contact_nodes), (Stop::FullContact, nodes * nodes));
        assert!(outcome.energy.abs() < 1e-20);
    }
}

#[test]
fn a_load_stops_on_request_and_can_be_solved_later() {
    let heights = rough(32, 3);
    let mut solver = super::solver(32, &heights);
    let load = 0.2 * solver.full_contact_load().unwrap();
    let limited = press(&mut solver, load, &Settings { pair_limit: 7, ..TIGHT });
    assert_eq!(limited.stop, Stop::PairLimit);
    assert!(limited.pairs >= 7 && limited.residual > TIGHT.tolerance);
    assert_eq!(solver.press(load, &TIGHT, &|| true).stop, Stop::Interrupted);
    solved(&mut solver, load);
    assert_complementary(&solver, &heights, load, 2e-12);
}

#[test]
fn an_unreachable_tolerance_ends_at_the_pair_limit() {
    let mut solver = super::solver(16, &rough(16, 4));
    let outcome = press(&mut solver, 0.1, &Settings { tolerance: 0.0, pair_limit: 300 });
    assert_eq!(outcome.stop, Stop::PairLimit);
    assert!(outcome.residual < 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn pressure_and_gap_exclude_each_other(
        nodes in 2_usize..=40, seed: u64, part in 1e-4..1.0_f64, white: bool,
    ) {
        let heights = if white { noise(nodes, seed) } else { rough(nodes, seed) };
        let mut solver = super::solver(nodes, &heights);
        let load = part * solver.full_contact_load().unwrap();
        let outcome = press(&mut solver, load, &Settings { tolerance: 1e-10, pair_limit: 4000 });
        prop_assert_eq!(outcome.stop, Stop::Converged);
        assert_complementary(&solver, &heights, load, 1.01e-10);
        let touching = solver.pressure().iter().filter(|p| **p > 0.0).count();
        prop_assert_eq!(outcome.contact_nodes, touching);
        let gaps = gap(&solver, &heights);
        prop_assert!((outcome.mean_gap - mean(&gaps)).abs() < 1e-14);
    }

    #[test]
    fn contact_grows_with_the_load(nodes in 8_usize..=32, seed: u64) {
        let mut solver = super::solver(nodes, &rough(nodes, seed));
        let full = solver.full_contact_load().unwrap();
        let mut before = 0;
        for part in [0.001, 0.01, 0.05, 0.1, 0.2, 0.4, 0.8, 1.0] {
            let outcome = press(&mut solver, part * full, &TIGHT);
            prop_assert!(outcome.contact_nodes >= before);
            before = outcome.contact_nodes;
        }
    }

    #[test]
    fn solution_owes_nothing_to_earlier_loads(
        nodes in 8_usize..=32, seed: u64, parts in prop::collection::vec(0.001..1.2_f64, 1..5),
        hardness in prop::option::of(0.3..3.0_f64),
    ) {
        let heights = rough(nodes, seed);
        let full = super::solver(nodes, &heights).full_contact_load().unwrap();
        let hardness = hardness.map(|part| Hardness::new(part * full).unwrap());
        let body = Body { elastic: Boundary::Periodic.into(), hardness };
        let [mut fresh, mut worn] = [0; 2].map(|_| body.solver(&on(square(nodes, 1.0), &heights)));
        for part in parts {
            if hardness.is_none_or(|hardness| hardness.check_load(part * full).is_ok()) {
                press(&mut worn, part * full, &Settings::default());
            }
        }
        let case = (0.15 * full, 5e-5);
        prop_assert!(pressed(&mut fresh, case) == pressed(&mut worn, case));
    }
}

/// Returns white noise on `grid`, in units of rms slope × longer side.
fn noise_on(grid: Grid, seed: u64) -> Vec<f64> {
    let nodes = grid.count();
    let square = noise(nodes.isqrt() + 1, seed);
    reduced(&Surface::new(grid, square[..nodes].to_vec()).unwrap())
}

fn yields_at(hardness: f64) -> Body {
    Body { elastic: Boundary::Periodic.into(), hardness: Some(Hardness::new(hardness).unwrap()) }
}

#[test]
fn saturated_nodes_stay_saturated_where_they_bear_nearly_all_of_the_load() {
    // 69 nodes at the hardness bear all but 7e-6 of the second load.
    let grid = square(12, 1.0);
    let heights = reduced(&Shape::Paraboloid { radius: 1.0 }.draw(grid));
    let mut solver = yields_at(0.01).solver(&on(grid, &heights));
    assert_outcome(&mut solver, &heights, 0.0012);
    let outcome = assert_outcome(&mut solver, &heights, 0.0047917);
    assert_eq!(outcome.saturated_nodes, 69);
}

#[test]
fn loads_near_whole_numbers_of_saturated_nodes_are_solved() {
    for radius in [0.8, 1.0, 1.7] {
        for nodes in [10, 12, 15] {
            let grid = square(nodes, 1.0);
            let heights = reduced(&Shape::Paraboloid { radius }.draw(grid));
            let hardness = 0.01;
            let mut solver = yields_at(hardness).solver(&on(grid, &heights));
            for saturated in (1..nodes * nodes).step_by(7) {
                let whole = saturated as f64 / grid.count() as f64 * hardness;
                for part in [1.0 - 1e-5, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.0 + 1e-5] {
                    assert_outcome(&mut solver, &heights, part * whole);
                }
            }
        }
    }
}

#[test]
fn no_loaded_node_is_dropped_on_elongated_cells() {
    for aspect in [1e2, 1e3, 1e4] {
        for size in [[1.0, aspect], [aspect, 1.0]] {
            for seed in 0..20 {
                let grid = rectangle([8, 8], size);
                let heights = noise_on(grid, seed);
                let mut solver = Body::default().solver(&on(grid, &heights));
                let full = solver.full_contact_load().unwrap();
                for part in [1e-6, 1e-3, 0.03, 0.3] {
                    let load = part * full;
                    let outcome = assert_outcome(&mut solver, &heights, load);
                    // With mesh steps along x and y as different as this, many loads do not
                    // converge.
                    if outcome.stop != Stop::Converged {
                        continue;
                    }
                    let found = outcome.contact_nodes;
                    let mut tight = Body::default().solver(&on(grid, &heights));
                    let tight = press(&mut tight, load, &TIGHT);
                    let (exact, is_known) = (tight.contact_nodes, tight.stop == Stop::Converged);
                    assert!(!is_known || found.abs_diff(exact) <= 1, "{found} for {exact} nodes");
                }
            }
        }
    }
}

#[test]
fn cells_up_to_thirty_times_as_long_as_wide_converge() {
    for aspect in [1.0, 3.0, 10.0, 30.0] {
        for size in [[1.0, aspect], [aspect, 1.0]] {
            for seed in 0..10 {
                let grid = rectangle([8, 8], size);
                let heights = noise_on(grid, seed);
                let mut solver = Body::default().solver(&on(grid, &heights));
                let full = solver.full_contact_load().unwrap();
                for part in [1e-6, 1e-3, 0.03, 0.3] {
                    let outcome = assert_outcome(&mut solver, &heights, part * full);
                    assert_eq!(outcome.stop, Stop::Converged);
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_residual_is_that_of_the_stored_pressures(
        nodes in (2_usize..=32, 2_usize..=32), aspect in -2.0..2.0_f64, seed: u64,
        free: bool, tight: bool, hardness in prop::option::of(-4.0..1.0_f64),
        parts in prop::collection::vec(-6.0..0.0_f64, 1..6),
    ) {
        let grid = rectangle([nodes.0, nodes.1], [10_f64.powf(aspect), 1.0]);
        let heights = noise_on(grid, seed);
        let hardness = hardness.map(|exponent| 10_f64.powf(exponent));
        let body = Body {
            elastic: if free { Boundary::Free } else { Boundary::Periodic }.into(),
            hardness: hardness.map(|pressure| Hardness::new(pressure).unwrap()),
        };
        let settings = Settings {
            tolerance: if tight { 1e-9 } else { Settings::default().tolerance },
            ..Settings::default()
        };
        let mut solver = body.solver(&on(grid, &heights));
        for part in parts {
            let load = 10_f64.powf(part) * hardness.unwrap_or(1.0).min(1.0) * 0.99;
            assert_outcome_at(&settings, &mut solver, &heights, load);
        }
    }
}

/// Returns the outcome and the bits of the pressures under a light load, under three loads close to
/// each other, and under a heavy one.
fn solved_on(threads: &Threads, mut solver: Solver, tolerance: f64) -> Vec<(String, Vec<u64>)> {
    let settings = Settings { tolerance, ..Settings::default() };
    solver.set_threads(threads.clone());
    let press = |load: f64| {
        let outcome = press(&mut solver, load, &settings);
        let bits = solver.pressure().iter().map(|p| p.to_bits()).collect();
        // A missing mean gap is NaN, which is not equal to itself.
        (format!("{outcome:?}"), bits)
    };
    [1e-8, 0.02, 0.03, 0.04, 0.3].into_iter().map(press).collect()
}

fn same_on_any_threads(tolerance: f64, solver: impl Fn() -> Solver) {
    let alone = solved_on(&Threads::one(), solver(), tolerance);
    for count in [2, 3, 8] {
        let threads = Threads::new(NonZeroUsize::new(count).unwrap());
        let shared = solved_on(&threads, solver(), tolerance);
        for ((one, bits), (other, shared)) in alone.iter().zip(shared) {
            assert!(*one == other && *bits == shared, "{count}: {one}, {other}");
        }
    }
}

#[test]
fn a_square_is_pressed_to_the_same_bits() {
    // With packed convolutions, with a reference pressure, and with rustfft and rows that do not
    // fill registers.
    for (nodes, tolerance) in [(640, 6e-5), (640, 1e-8), (637, 6e-5)] {
        let heights = rough(nodes, 5);
        same_on_any_threads(tolerance, || super::solver(nodes, &heights));
    }
}

#[test]
fn a_rectangle_is_pressed_to_the_same_bits() {
    let grid = rectangle([480, 832], [480.0, 832.0]);
    let heights = &rough(832, 7)[..grid.count()];
    same_on_any_threads(6e-5, || Solver::new(PeriodicHalfSpace::new(grid), &on(grid, heights)));
}

#[test]
fn free_boundaries_and_materials_that_yield_are_solved_to_the_same_bits() {
    let grid = square(640, 1.0);
    let heights = rough(640, 3);
    same_on_any_threads(6e-5, || Solver::new(FreeHalfSpace::new(grid), &on(grid, &heights)));
    let hardness = Some(Hardness::new(0.5).unwrap());
    let body = Body { hardness, ..Body::default() };
    same_on_any_threads(6e-5, || body.solver(&on(grid, &heights)));
}

fn random_solver(body: Body) -> Solver {
    let surface = samples::random(1, 16, 3);
    let grid = square(64, 1.0);
    body.solver(&on(grid, surface.draw(grid).heights()))
}

fn half_space(boundary: Boundary, hardness: Option<f64>) -> Body {
    let hardness = hardness.map(|pressure| Hardness::new(pressure).unwrap());
    Body { elastic: boundary.into(), hardness }
}

#[test]
fn the_mean_gap_is_that_of_the_outcome() {
    for boundary in [Boundary::Periodic, Boundary::Free] {
        let mut solver = random_solver(half_space(boundary, None));
        let outcome = solver.press(0.05, &Settings::default(), &|| false);
        assert_eq!(outcome.stop, Stop::Converged);
        let pressure = solver.pressure().to_vec();
        let gap = solver.gap_under(&pressure);
        let mean = gap.iter().sum::<f64>() / gap.len() as f64;
        assert!((mean - outcome.mean_gap).abs() < 1e-6 * outcome.mean_gap);
        let penetration = gap.iter().fold(0.0, |least: f64, gap| least.min(*gap));
        assert!(-penetration * 64.0 <= 1.01 * outcome.residual, "{penetration}");
        let product: f64 = gap.iter().zip(&pressure).map(|(g, p)| g * p).sum();
        assert_eq!(product, 0.0);
    }
}

#[test]
fn the_gap_of_yielded_material_is_minus_the_depth_of_the_outcome() {
    let mut solver = random_solver(half_space(Boundary::Periodic, Some(0.3)));
    let outcome = solver.press(0.1, &Settings::default(), &|| false);
    let pressure = solver.pressure().to_vec();
    let gap = solver.gap_under(&pressure);
    let saturated = gap.iter().zip(&pressure).filter(|(_, p)| **p >= 0.3);
    let depth: f64 = saturated.map(|(gap, _)| -gap).sum::<f64>() / gap.len() as f64;
    assert!(outcome.saturated_nodes > 0);
    assert!((depth - outcome.yielded_depth).abs() < 1e-4 * outcome.yielded_depth);
}

/// Load and tolerance. Light loads, full contact and two tolerances leave a solver in different
/// states.
const CASES: [(f64, f64); 6] =
    [(0.02, 5e-5), (0.3, 1e-8), (1e-9, 5e-5), (0.03, 5e-5), (20.0, 5e-5), (0.1, 5e-5)];

fn pressed(solver: &mut Solver, (load, tolerance): (f64, f64)) -> (String, Vec<u64>) {
    let settings = Settings { tolerance, ..Settings::default() };
    let outcome = press(solver, load, &settings);
    (format!("{outcome:?}"), solver.pressure().iter().map(|p| p.to_bits()).collect())
}

/// Asserts that loads below the hardness have the same result alone, after other loads in any
/// order, after an interruption and an unreachable tolerance, and on siblings.
fn assert_independent(nodes: usize, body: Body) {
    let heights = rough(nodes, 5);
    let new = || body.solver(&on(square(nodes, 1.0), &heights));
    let is_borne = |load: f64| body.hardness.is_none_or(|bound| bound.check_load(load).is_ok());
    let cases: Vec<_> = CASES.into_iter().filter(|(load, _)| is_borne(*load)).collect();
    let alone: Vec<_> = cases.iter().map(|case| pressed(&mut new(), *case)).collect();
    let [mut up, mut down] = [new(), new()];
    let mut sibling = up.sibling(Threads::one());
    down.press(0.1, &Settings::default(), &|| true);
    press(&mut down, 1e-12, &Settings { tolerance: 0.0, pair_limit: 100 });
    let forward: Vec<_> = cases.iter().map(|case| pressed(&mut up, *case)).collect();
    let mut backward: Vec<_> = cases.iter().rev().map(|case| pressed(&mut down, *case)).collect();
    backward.reverse();
    let mut late = up.sibling(Threads::one());
    for (index, case) in cases.iter().enumerate() {
        assert!(forward[index] == alone[index], "{case:?} after smaller indices");
        assert!(backward[index] == alone[index], "{case:?} after larger indices");
        for sibling in [&mut sibling, &mut late] {
            assert!(pressed(sibling, *case) == alone[index], "{case:?} by a sibling");
        }
    }
}

fn bodies() -> [Body; 4] {
    [
        half_space(Boundary::Periodic, None),
        half_space(Boundary::Periodic, Some(0.5)),
        half_space(Boundary::Free, None),
        half_space(Boundary::Free, Some(0.5)),
    ]
}

#[test]
fn a_load_has_the_same_bytes_after_any_others_and_by_a_sibling() {
    for body in bodies() {
        assert_independent(60, body);
    }
}

#[test]
fn the_same_holds_with_coarser_meshes() {
    for body in bodies() {
        assert_independent(512, body);
    }
}

#[test]
fn siblings_press_different_loads_at_the_same_time() {
    let heights = rough(64, 6);
    let mut first = solver(64, &heights);
    let expected = CASES.map(|case| pressed(&mut first, case));
    let found = std::thread::scope(|scope| {
        let solvers = CASES.map(|case| (first.sibling(Threads::one()), case));
        let running =
            solvers.map(|(mut sibling, case)| scope.spawn(move || pressed(&mut sibling, case)));
        running.map(|thread| thread.join().unwrap())
    });
    assert!(found == expected);
}
