//! Exact laws, and drawn surfaces whose intervals cover the truth.

use super::*;
use asperity_contact::grid::Boundary;
use asperity_contact::grid::Grid;
use asperity_contact::topography::power_spectrum::rings;
use asperity_contact::topography::random::{Amplitude, RandomSurface};
use asperity_contact::topography::spectrum::Spectrum;

const BOOTSTRAP: Bootstrap = Bootstrap { replicates: 200, seed: 5, level: 0.95 };

fn exact(hurst: f64, rolloff: f64) -> Vec<RingOfSurfaces> {
    let ring = |k: i32| {
        let wavenumber = f64::from(k);
        let density = (wavenumber / rolloff).max(1.0).powf(-2.0 * (1.0 + hurst));
        RingOfSurfaces { wavenumber, freedom: 6.0 * wavenumber, densities: vec![1e-5 * density] }
    };
    (2..=64).map(ring).collect()
}

#[test]
fn an_exact_law_is_found_with_its_rolloff_between_rings() {
    for (hurst, rolloff) in [(0.3, 8.0), (0.8, 9.4), (1.0, 20.5)] {
        let problem = SelfAffineProblem::new(exact(hurst, rolloff), Window::ALL);
        let fit = problem.fit().unwrap();
        // The golden section cannot tell costs apart that differ by rounding.
        assert!((fit.hurst - hurst).abs() < 1e-5, "{fit:?}");
        assert!((fit.rolloff.unwrap() / rolloff - 1.0).abs() < 1e-5, "{fit:?}");
        assert!((fit.plateau / 1e-5 - 1.0).abs() < 1e-5);
        assert!(fit.rms_residual < 1e-5);
    }
}

#[test]
fn a_power_law_without_a_plateau_has_no_rolloff() {
    let fit = SelfAffineProblem::new(exact(0.6, 1.0), Window::ALL).fit().unwrap();
    assert!((fit.hurst - 0.6).abs() < 1e-9, "{fit:?}");
    assert_eq!(fit.rolloff, None);
}

#[test]
fn rings_that_are_rounding_or_outside_the_window_count_for_nothing() {
    let mut rings = exact(0.7, 9.0);
    rings.iter_mut().skip(40).for_each(|ring| ring.densities[0] = 1e-35);
    let window = Window { from: 4.0, to: 50.0 };
    let fit = SelfAffineProblem::new(rings, window).fit().unwrap();
    assert_eq!((fit.data, fit.masked), (38, 9));
    assert!((fit.hurst - 0.7).abs() < 1e-5);
}

#[test]
fn too_few_rings_and_rising_densities_have_no_fit() {
    let few = SelfAffineProblem::new(exact(0.5, 8.0)[..3].to_vec(), Window::ALL);
    assert!(matches!(few.fit(), Err(FitError::TooFew { .. })));
    let mut rising = exact(0.5, 8.0);
    for ring in &mut rising {
        ring.densities[0] = ring.wavenumber;
    }
    let rising = SelfAffineProblem::new(rising, Window::ALL);
    assert_eq!(rising.fit(), Err(FitError::NotConverged));
}

fn surface(realization: u32) -> RandomSurface {
    RandomSurface {
        spectrum: Spectrum { hurst: 0.8, k_lower: 1, k_rolloff: 12, k_upper: 60, anisotropy: None },
        amplitude: Amplitude::Gaussian,
        rms_slope: 1.0,
        seed: 2,
        realization,
    }
}

/// Rings of the wavenumbers that a mesh of 128 nodes has whole.
fn measured(realizations: std::ops::Range<u32>) -> Vec<RingOfSurfaces> {
    let mut found: Vec<RingOfSurfaces> = Vec::new();
    for realization in realizations {
        let drawn = surface(realization).draw(Grid::square(128, 1.0).unwrap());
        let own = rings(&drawn, Boundary::Periodic).into_iter().take(59);
        for (place, ring) in own.enumerate() {
            if found.len() == place {
                found.push(RingOfSurfaces {
                    wavenumber: ring.wavenumber(std::f64::consts::TAU),
                    freedom: ring.modes.into(),
                    densities: Vec::new(),
                });
            }
            found[place].densities.push(ring.density);
        }
    }
    found
}

#[test]
fn a_drawn_surface_has_the_exponent_and_rolloff_of_its_spectrum_within_their_intervals() {
    let mut covered = [0; 2];
    for realization in 0..20 {
        let problem = SelfAffineProblem::new(measured(realization..realization + 1), Window::ALL);
        let fit = problem.fit().unwrap();
        let intervals = problem.intervals(&fit, &BOOTSTRAP).intervals.unwrap();
        let truth = [0.8, 12.0];
        for (place, truth) in truth.into_iter().enumerate() {
            let Interval { lower, upper, .. } = intervals[place];
            covered[place] += u32::from(lower <= truth && truth <= upper);
        }
        assert!((fit.hurst - 0.8).abs() < 0.15, "{fit:?}");
    }
    // Of nominal 95 %: fewer than 16 of 20 has a probability of 0.3 %.
    assert!(covered.iter().all(|&covered| covered >= 16), "{covered:?}");
}

#[test]
fn resampled_surfaces_have_the_scatter_that_their_modes_have() {
    let problem = SelfAffineProblem::new(measured(0..12), Window::ALL);
    let fit = problem.fit().unwrap();
    let resampled = problem.intervals(&fit, &BOOTSTRAP).intervals.unwrap();
    let single = SelfAffineProblem::new(measured(0..1), Window::ALL);
    let informed = single.intervals(&single.fit().unwrap(), &BOOTSTRAP);
    let expected = informed.intervals.unwrap()[0].standard_error / 12_f64.sqrt();
    // Twelve surfaces know their scatter to a fifth; two such errors.
    let ratio = resampled[0].standard_error / expected;
    assert!((0.6..1.6).contains(&ratio), "{ratio}");
    // Within four standard errors.
    assert!((fit.hurst - 0.8).abs() < 4.0 * expected, "{fit:?}");
}
