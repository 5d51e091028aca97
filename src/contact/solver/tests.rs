//! What the tests of the solver share.

use super::*;

mod closed_forms;
mod invariants;

/// Where double precision ends on the meshes used here.
const TIGHT: Settings = Settings {
    tolerance: 1e-12,
    pair_limit: 4000,
};

fn map(nodes: usize, height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let place = |index: usize| index as f64 / nodes as f64;
    (0..nodes * nodes)
        .map(|node| height(place(node / nodes), place(node % nodes)))
        .collect()
}

fn press(solver: &mut Solver, load: f64, settings: &Settings) -> Outcome {
    solver.press(load, settings, &|| false)
}

fn solved(solver: &mut Solver, load: f64) -> Outcome {
    let outcome = press(solver, load, &TIGHT);
    assert_eq!(outcome.stop, Stop::Converged, "{outcome:?}");
    outcome
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
