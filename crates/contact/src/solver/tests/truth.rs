//! What an outcome says about the stored pressures is true of them: the residual, recomputed from
//! the elastic kernel alone, the mean pressure and the bounds.

use proptest::prelude::*;

use super::*;
use crate::grid::samples::rectangle;
use crate::grid::{Boundary, Grid};
use crate::topography::moments::Moments;
use crate::topography::shapes::Shape;
use crate::topography::surface::Surface;

/// Heights in units of rms slope × longer side.
fn reduced(surface: &Surface) -> Vec<f64> {
    let unit = Moments::of(surface).rms_slope() * surface.grid().cell().longer_side();
    surface.heights().iter().map(|h| h / unit).collect()
}

/// White noise, not periodic in any sense that would make it special.
fn noise_on(grid: Grid, seed: u64) -> Vec<f64> {
    let nodes = grid.count();
    let square = noise(nodes.isqrt() + 1, seed);
    reduced(&Surface::new(grid, square[..nodes].to_vec()).unwrap())
}

fn solver_of(body: HalfSpace, grid: Grid, heights: &[f64]) -> Solver {
    body.solver(grid, heights)
}

fn yields_at(hardness: f64) -> HalfSpace {
    HalfSpace { boundary: Boundary::Periodic, hardness: Some(Hardness::new(hardness).unwrap()) }
}

#[test]
fn saturated_nodes_stay_saturated_where_they_bear_nearly_all_of_the_load() {
    // 69 nodes at the hardness bear all but 7e-6 of the second load.
    let grid = square(12, 1.0);
    let heights = reduced(&Shape::Paraboloid { radius: 1.0 }.draw(grid));
    let mut solver = solver_of(yields_at(0.01), grid, &heights);
    assert_told_truly(&mut solver, &heights, 0.0012);
    let outcome = assert_told_truly(&mut solver, &heights, 0.0047917);
    assert_eq!(outcome.saturated_nodes, 69);
}

#[test]
fn loads_near_whole_numbers_of_saturated_nodes_are_solved() {
    for radius in [0.8, 1.0, 1.7] {
        for nodes in [10, 12, 15] {
            let grid = square(nodes, 1.0);
            let heights = reduced(&Shape::Paraboloid { radius }.draw(grid));
            let hardness = 0.01;
            let mut solver = solver_of(yields_at(hardness), grid, &heights);
            for saturated in (1..nodes * nodes).step_by(7) {
                let whole = saturated as f64 / grid.count() as f64 * hardness;
                for part in [1.0 - 1e-5, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.0 + 1e-5] {
                    assert_told_truly(&mut solver, &heights, part * whole);
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
                let mut solver = solver_of(HalfSpace::default(), grid, &heights);
                let full = solver.full_contact_load().unwrap();
                for part in [1e-6, 1e-3, 0.03, 0.3] {
                    let load = part * full;
                    let outcome = assert_told_truly(&mut solver, &heights, load);
                    // Where mesh steps along x and y are this unlike, many loads do not converge.
                    if outcome.stop != Stop::Converged {
                        continue;
                    }
                    let found = outcome.contact_nodes;
                    let mut tight = solver_of(HalfSpace::default(), grid, &heights);
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
                let mut solver = solver_of(HalfSpace::default(), grid, &heights);
                let full = solver.full_contact_load().unwrap();
                for part in [1e-6, 1e-3, 0.03, 0.3] {
                    let outcome = assert_told_truly(&mut solver, &heights, part * full);
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
        let body = HalfSpace {
            boundary: if free { Boundary::Free } else { Boundary::Periodic },
            hardness: hardness.map(|pressure| Hardness::new(pressure).unwrap()),
        };
        let settings = Settings {
            tolerance: if tight { 1e-9 } else { Settings::default().tolerance },
            ..Settings::default()
        };
        let mut solver = solver_of(body, grid, &heights);
        for part in parts {
            let load = 10_f64.powf(part) * hardness.unwrap_or(1.0).min(1.0) * 0.99;
            assert_told_truly_at(&settings, &mut solver, &heights, load);
        }
    }
}
