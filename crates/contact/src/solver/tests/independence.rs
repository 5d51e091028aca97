//! The result of a load depends on the surface, the load and the settings only.

use super::*;
use crate::grid::Boundary;

/// Load and tolerance. Light loads, full contact, two tolerances and an interrupted load leave a
/// solver in different states.
const CASES: [(f64, f64); 6] =
    [(0.02, 5e-5), (0.3, 1e-8), (1e-9, 5e-5), (0.03, 5e-5), (20.0, 5e-5), (0.1, 5e-5)];

fn pressed(solver: &mut Solver, (load, tolerance): (f64, f64)) -> (String, Vec<u64>) {
    let settings = Settings { tolerance, ..Settings::default() };
    let outcome = press(solver, load, &settings);
    (format!("{outcome:?}"), solver.pressure().iter().map(|p| p.to_bits()).collect())
}

/// Asserts that loads below the hardness have the same result alone, after other loads in any
/// order, after an interruption, and on siblings.
fn assert_independent(nodes: usize, body: HalfSpace) {
    let heights = rough(nodes, 5);
    let new = || body.solver(square(nodes, 1.0), &heights);
    let is_borne = |load: f64| body.hardness.is_none_or(|bound| bound.check_load(load).is_ok());
    let cases: Vec<_> = CASES.into_iter().filter(|(load, _)| is_borne(*load)).collect();
    let alone: Vec<_> = cases.iter().map(|case| pressed(&mut new(), *case)).collect();
    let [mut up, mut down] = [new(), new()];
    let mut sibling = up.sibling(Threads::one());
    down.press(0.1, &Settings::default(), &|| true);
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

fn bodies() -> [HalfSpace; 4] {
    let body = |boundary, hardness: Option<f64>| HalfSpace {
        boundary,
        hardness: hardness.map(|pressure| Hardness::new(pressure).unwrap()),
    };
    [
        body(Boundary::Periodic, None),
        body(Boundary::Periodic, Some(0.5)),
        body(Boundary::Free, None),
        body(Boundary::Free, Some(0.5)),
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
