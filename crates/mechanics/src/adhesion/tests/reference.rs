//! Rough surfaces that independent solvers have pressed to rounding, and long paths on them.
//!
//! The files are from `reference/adhesion` of the project: a solver for periodic surfaces whose
//! states agree with those of Tamaas 2.9.0 to 7e-11 in every gap.

use super::*;
use crate::fft::Transform;
use crate::topography::random::{Amplitude, RandomSurface};
use crate::topography::spectrum::Spectrum;

#[test]
fn states_at_mean_gaps_are_those_of_independent_solvers() {
    let heights = rough64();
    for (name, work, range) in [("weak", 0.002, 0.010), ("sticky", 0.006, 0.020)] {
        let mut path = path(64, &heights, Adhesion::new(work, range).unwrap());
        for row in rows(&format!("rough64_a_{name}.csv")) {
            let state = solved(&mut path, Target::MeanGap(row[0]));
            let close = |found: f64, expected: f64| {
                assert!((found - expected).abs() < 1e-9, "{name} {}: {found}", row[0]);
            };
            close(state.mean_gap, row[0]);
            close(state.mean_pressure, row[1]);
            assert_eq!(state.contact_nodes as f64, row[2] * 4096.0, "{name} {}", row[0]);
            assert_eq!(state.repulsive_nodes as f64, row[3] * 4096.0, "{name} {}", row[0]);
            close(state.elastic_energy, row[4]);
            close(state.adhesion_energy, row[5]);
            close(state.peak_pressure, row[6]);
            close(state.lowest_pressure, row[7]);
            // Tamaas.
            close(state.mean_pressure, row[9]);
        }
    }
}

/// Returns the surface on twice the nodes, with the same waves.
fn refined(heights: &[f64], nodes: usize) -> Vec<f64> {
    let (coarse, fine) = (Transform::new([nodes; 2]), Transform::new([2 * nodes; 2]));
    let mut spectrum = vec![Default::default(); nodes * (nodes / 2 + 1)];
    coarse.forward(heights, &mut spectrum, &mut coarse.scratch());
    let mut larger = vec![Default::default(); 2 * nodes * (nodes + 1)];
    for row in 0..nodes {
        let to = if row < nodes / 2 { row } else { row + nodes };
        for column in 0..nodes / 2 {
            larger[to * (nodes + 1) + column] = spectrum[row * (nodes / 2 + 1) + column];
        }
    }
    let mut out = vec![0.0; 4 * heights.len()];
    fine.inverse(&mut larger, &mut out, &mut fine.scratch());
    out.iter().map(|height| height / heights.len() as f64).collect()
}

const HYSTERESIS: [f64; 2] = [0.008, 0.014];

fn refined_path() -> AdhesivePath {
    let [work, range] = HYSTERESIS;
    path(128, &refined(&rough64(), 64), Adhesion::new(work, range).unwrap())
}

#[test]
fn approach_and_separation_follow_the_states_of_an_independent_solver() {
    let mut path = refined_path();
    let mut equal = 0;
    let rows = rows("hysteresis_a_gap.csv");
    for row in &rows {
        let state = solved(&mut path, Target::MeanGap(row[1]));
        let energy = state.elastic_energy + state.adhesion_energy;
        // Several minima exist at some gaps. Which one is reached depends on the steps.
        assert!(energy < row[5] + 1e-9, "{}: {energy} and {}", row[1], row[5]);
        let is_equal = (state.mean_pressure - row[2]).abs() < 1e-9
            && state.contact_nodes as f64 == (row[3] * 16384.0).round()
            && state.repulsive_nodes as f64 == (row[4] * 16384.0).round();
        equal += usize::from(is_equal);
        let has_several = [0.066, 0.018].contains(&row[1]) || energy < row[5] - 1e-9;
        assert!(is_equal || has_several, "{}: {state:?}", row[1]);
    }
    assert!(equal >= rows.len() - 4);
}

#[test]
fn loading_and_unloading_ends_with_the_pull_off_of_an_independent_solver() {
    let mut path = refined_path();
    for row in rows("hysteresis_a_load.csv").iter().filter(|row| row[2].is_finite()) {
        let state = solved(&mut path, Target::Load(row[1]));
        assert!((state.mean_pressure - row[1]).abs() < 1e-12);
        assert!((state.mean_gap - row[2]).abs() < 1e-8, "{}: {}", row[1], state.mean_gap);
        assert_eq!(state.contact_nodes as f64, (row[3] * 16384.0).round(), "{}", row[1]);
        assert_eq!(state.repulsive_nodes as f64, (row[4] * 16384.0).round(), "{}", row[1]);
    }
    let settings = Settings { pull_off_tolerance: 1e-3, ..Settings::default() };
    let state = path.step(Target::Load(-0.024), &settings, &|| false);
    assert_eq!(state.stop, Stop::PulledOff);
    let load = state.pull_off_load.unwrap();
    assert!(load < -0.022 + 1e-9 && load > -0.024, "{load}");
    assert_eq!(path.gap(), None);
}

#[test]
fn a_cycle_with_jumps_takes_few_pairs_and_returns_to_its_first_state() {
    let spectrum = Spectrum { hurst: 0.8, k_lower: 4, k_rolloff: 4, k_upper: 32, anisotropy: None };
    let amplitude = Amplitude::Gaussian;
    let surface = RandomSurface { spectrum, amplitude, rms_slope: 1.0, seed: 3, realization: 0 };
    let heights = surface.draw(square(128, 1.0));
    let mut path = path(128, heights.heights(), Adhesion::new(0.016, 0.02).unwrap());
    let approach: Vec<f64> = (0..20).map(|step| 0.1 - 0.004 * f64::from(step)).collect();
    let gaps = approach.iter().chain(approach.iter().rev().skip(1));
    let settings = Settings { tolerance: 1e-6, ..Settings::default() };
    let states: Vec<AdhesiveState> =
        gaps.map(|gap| path.step(Target::MeanGap(*gap), &settings, &|| false)).collect();
    assert!(states.iter().all(|state| state.stop == Stop::Converged));
    let [first, last] = [states[0], states[38]];
    assert!((first.mean_pressure - last.mean_pressure).abs() < 1e-6);
    // The path is not reversible: contacts break later than they form.
    assert!(states[10].contact_nodes < states[28].contact_nodes);
    let mean = states.iter().map(|state| f64::from(state.pairs)).sum::<f64>() / 39.0;
    let most = states.iter().map(|state| state.pairs).max();
    assert!(mean < 90.0 && most < Some(240), "{mean} pairs a state, {most:?} in the worst");
}
