//! Solutions owe nothing to the number of threads.

use std::num::NonZeroUsize;

use super::*;
use crate::elasticity::FreeHalfSpace;
use crate::grid::samples::rectangle;
use crate::threads::Threads;

/// Outcomes and pressures, bit by bit, under a light load, some in reach of each other, and a heavy
/// one.
fn solved_on(threads: &Threads, mut solver: Solver, tolerance: f64) -> Vec<(String, Vec<u64>)> {
    let settings = Settings { tolerance, ..Settings::default() };
    solver.work_on(threads.clone());
    let press = |load: f64| {
        let outcome = press(&mut solver, load, &settings);
        let bits = solver.pressure().iter().map(|p| p.to_bits()).collect();
        // Where there is no mean gap it is no number, which equals none.
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
    // By registers, with a base of its own, and by rustfft, whose rows fill no registers.
    for (nodes, tolerance) in [(640, 6e-5), (640, 1e-8), (637, 6e-5)] {
        let heights = rough(nodes, 5);
        same_on_any_threads(tolerance, || super::solver(nodes, &heights));
    }
}

#[test]
fn a_rectangle_is_pressed_to_the_same_bits() {
    let grid = rectangle([480, 832], [480.0, 832.0]);
    let heights = &rough(832, 7)[..grid.count()];
    same_on_any_threads(6e-5, || Solver::new(PeriodicHalfSpace::new(grid), heights));
}

#[test]
fn free_boundaries_and_materials_that_yield_are_solved_to_the_same_bits() {
    let grid = square(640, 1.0);
    let heights = rough(640, 3);
    same_on_any_threads(6e-5, || Solver::new(FreeHalfSpace::new(grid), &heights));
    let hardness = Some(Hardness::new(0.5).unwrap());
    let yielding = || Solver::yielding(PeriodicHalfSpace::new(grid), hardness, &heights);
    same_on_any_threads(6e-5, yielding);
}
