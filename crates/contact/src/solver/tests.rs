//! What the tests of the solver share.

use super::*;
use crate::elasticity::PeriodicHalfSpace;
use crate::grid::samples::square;

mod closed_forms;
mod far_loads;
mod free;
mod hardness;
mod invariants;
mod light;
mod rectangles;
mod reference;
mod threads;
mod truth;

/// Where double precision ends on the meshes used here.
const TIGHT: Settings = Settings { tolerance: 1e-12, pair_limit: 4000 };

fn map(nodes: usize, height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let place = |index: usize| index as f64 / nodes as f64;
    (0..nodes * nodes).map(|node| height(place(node / nodes), place(node % nodes))).collect()
}

/// A solver of a square surface on a periodic half-space.
pub(super) fn solver(nodes: usize, heights: &[f64]) -> Solver {
    Solver::new(PeriodicHalfSpace::new(square(nodes, 1.0)), heights)
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

/// White noise, and so a spectrum up to the Nyquist wave, of no particular slope.
fn noise(nodes: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut draw = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let slope = 2.0 * nodes as f64;
    (0..nodes * nodes).map(|_| (draw() + draw() + draw()) / slope).collect()
}

/// Noise smoothed by the half-space: a self-affine spectrum with a wavelength as long as the cell.
pub(super) fn rough(nodes: usize, seed: u64) -> Vec<f64> {
    let transform = Transform::<f64>::new([nodes; 2]);
    let mut heights = vec![0.0; nodes * nodes];
    let kernel = elasticity::displacement(&PeriodicHalfSpace::new(square(nodes, 1.0)));
    transform.convolve(&kernel, &noise(nodes, seed), &mut heights, &mut transform.scratch());
    heights.iter().map(|height| height * nodes as f64).collect()
}

/// Gap by its definition, from kernels alone, less its mean in elastic contact.
fn gap(solver: &Solver, heights: &[f64]) -> Vec<f64> {
    let transform = elasticity::transform::<f64>(&*solver.body);
    let mut gap = vec![0.0; heights.len()];
    let kernel = elasticity::displacement(&*solver.body);
    transform.convolve(&kernel, solver.pressure(), &mut gap, &mut transform.scratch());
    gap.iter_mut().zip(heights).for_each(|(gap, height)| *gap -= height);
    let of = |chosen: &dyn Fn(f64) -> bool| -> Vec<f64> {
        let nodes = gap.iter().zip(solver.pressure());
        nodes.filter(|(_, p)| chosen(**p)).map(|(gap, _)| *gap).collect()
    };
    let elastic = of(&|p| p > 0.0 && p < solver.search.ceiling());
    // Without elastic nodes, the highest of saturated ones must be below all others.
    let saturated = of(&|p| p >= solver.search.ceiling());
    let offset = if elastic.is_empty() {
        saturated.into_iter().fold(f64::MIN, f64::max)
    } else {
        mean(&elastic)
    };
    gap.iter().map(|gap| gap - offset).collect()
}

fn assert_complementary(solver: &Solver, heights: &[f64], load: f64, tolerance: f64) {
    // Row by row: many equal numbers one after the other are all rounded the same way.
    let rows = solver.pressure().chunks_exact(solver.search.nodes[1]);
    let total: f64 = rows.map(|row| row.iter().sum::<f64>()).sum();
    assert!((total / solver.pressure().len() as f64 / load - 1.0).abs() < 1e-12);
    let violation = violation(solver, heights);
    assert!(violation <= tolerance, "{violation} > {tolerance}");
}

/// The largest violation of the conditions of contact by the stored pressures, in the units of
/// [`Outcome::residual`], from kernels alone.
fn violation(solver: &Solver, heights: &[f64]) -> f64 {
    let hardness = solver.search.ceiling();
    let nodes = solver.pressure().iter().zip(gap(solver, heights));
    let violations = nodes.map(|(p, gap)| {
        assert!((0.0..=hardness).contains(p));
        match *p {
            0.0 => -gap,
            p if p == hardness => gap,
            _ => gap.abs(),
        }
    });
    solver.search.steps_per_side * violations.fold(0.0, f64::max)
}

/// Presses at the default tolerance and checks the outcome against the stored pressures.
fn assert_told_truly(solver: &mut Solver, heights: &[f64], load: f64) -> Outcome {
    assert_told_truly_at(&Settings::default(), solver, heights, load)
}

fn assert_told_truly_at(
    settings: &Settings,
    solver: &mut Solver,
    heights: &[f64],
    load: f64,
) -> Outcome {
    let outcome = press(solver, load, settings);
    let range = heights.iter().fold(0.0_f64, |range, h| range.max(h.abs()));
    let rounding = 1e-13 * solver.search.steps_per_side * range;
    let tolerance = match outcome.stop {
        Stop::Converged | Stop::FullContact => settings.tolerance,
        // What did not converge is told in single precision.
        _ => outcome.residual + f64::from(f32::EPSILON) * solver.search.steps_per_side * range,
    };
    assert_complementary(solver, heights, load, 1.02 * tolerance + rounding);
    let violation = violation(solver, heights);
    let error = (violation - outcome.residual).abs();
    assert!(error <= 0.02 * tolerance + rounding, "{violation}, {outcome:?}");
    outcome
}
