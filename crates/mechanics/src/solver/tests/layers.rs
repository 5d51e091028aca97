//! Layers and coatings, whose contacts independent code has solved.

use std::f64::consts::PI;

use super::*;
use crate::elasticity::{Base, Layer, Support};
use crate::topography::random::{Amplitude, RandomSurface};
use crate::topography::spectrum::Spectrum;

const LAYER: Reference = Reference { folder: "layer", table: "rough_layer.csv" };

/// Returns the rows of a table of the reference, split at commas.
fn rows_of(reference: &Reference, table: &str) -> Vec<Vec<String>> {
    let text = String::from_utf8(reference.file(table)).unwrap();
    text.lines().skip(1).map(|row| row.split(',').map(str::to_owned).collect()).collect()
}

/// Returns the layer of a row of the table of the rough surface.
fn layer_of(row: &[String]) -> Layer {
    let number = |text: &str| text.parse::<f64>().unwrap();
    let ratios: Vec<f64> = row[2].trim_matches(['(', ')']).split_whitespace().map(number).collect();
    let support = match row[0].as_str() {
        "bonded" => Support::Rigid(Base::Bonded),
        "smooth" => Support::Rigid(Base::Frictionless),
        _ => Support::HalfSpace { poisson_ratio: ratios[2], modulus_ratio: ratios[0] },
    };
    let poisson_ratio = if ratios.len() == 1 { ratios[0] } else { ratios[1] };
    Layer::new(number(&row[1]), poisson_ratio, support).unwrap()
}

fn pressed_on(layer: Layer, heights: &[f64], nodes: usize) -> Solver {
    let body = Body { elastic: Elastic::Layer(layer), hardness: None };
    body.solver(&on(square(nodes, 1.0), heights))
}

#[test]
fn rough_surfaces_touch_layers_as_independent_code_has_it() {
    let heights = LAYER.heights("rough96_a", [1.0, 1.0]);
    for row in rows_of(&LAYER, "rough_layer.csv") {
        let number = |column: usize| row[column].parse::<f64>().unwrap();
        let layer = layer_of(&row);
        let mut solver = pressed_on(layer, heights.heights(), 96);
        let is_close = |found: f64, column: usize| {
            assert!((found / number(column) - 1.0).abs() < 1e-7, "{row:?}: {found}");
        };
        is_close(solver.full_contact_load().unwrap(), 10);
        let load = number(3);
        let settings = Settings { tolerance: 1e-9, ..Settings::default() };
        let outcome = press(&mut solver, load, &settings);
        assert_eq!(outcome.stop, Stop::Converged, "{row:?}: {outcome:?}");
        assert_eq!(outcome.contact_nodes as f64 / 9216.0, (number(4) * 9216.0).round() / 9216.0);
        let compression = layer.uniform_compliance().map_or(0.0, |compliance| compliance * load);
        assert!((compression - number(7)).abs() < 1e-14);
        is_close(outcome.mean_gap, 6);
        is_close(outcome.peak_pressure, 8);
        // The energy of the reference includes the uniform compression.
        is_close(outcome.energy + 0.5 * load * compression, 9);
    }
}

#[test]
fn a_ball_on_a_layer_approaches_and_touches_as_independent_code_has_it() {
    // A ball of radius 1, pressed so that the contact radius of Hertz is 0.1.
    let (nodes, hertz) = (192, 0.1_f64);
    for row in rows_of(&LAYER, "hertz_layer.csv") {
        let row: Vec<f64> = row.iter().map(|number| number.parse().unwrap()).collect();
        let [nu, base, thickness, cell, approach, radius, peak, .., change] = row[..] else {
            panic!("eleven columns")
        };
        let base = if base == 0.0 { Base::Bonded } else { Base::Frictionless };
        let layer = Layer::new(thickness * hertz / cell, nu, Support::Rigid(base)).unwrap();
        let heights = map(nodes, |x, y| -cell * ((x - 0.5).powi(2) + (y - 0.5).powi(2)) / 2.0);
        let load = 4.0 / 3.0 * hertz.powi(3) / (cell * cell);
        let mut solver = pressed_on(layer, &heights, nodes);
        let outcome =
            press(&mut solver, load, &Settings { tolerance: 1e-8, ..Settings::default() });
        let sunk = layer.uniform_compliance().unwrap() * load - mean(&heights) - outcome.mean_gap;
        let found = sunk * cell / (hertz * hertz);
        let found_radius = (outcome.contact_nodes as f64 / PI).sqrt() * cell / nodes as f64;
        // The reference has a mesh of 384².
        assert!((found / approach - 1.0).abs() < 1e-4 + 2.0 * change, "{row:?}: {found}");
        let cells = cell / nodes as f64 / hertz;
        assert!((found_radius / hertz - radius).abs() < 0.15 * cells + 0.01, "{row:?}");
        assert!((outcome.peak_pressure / (2.0 * hertz / PI) / peak - 1.0).abs() < 4e-3, "{row:?}");
    }
}

#[test]
fn layers_take_hardly_more_pairs_than_half_spaces() {
    let nodes = 256;
    let spectrum = Spectrum { hurst: 0.8, k_lower: 2, k_rolloff: 2, k_upper: 32, anisotropy: None };
    let amplitude = Amplitude::Gaussian;
    let surface = RandomSurface { spectrum, amplitude, rms_slope: 1.0, seed: 1, realization: 0 };
    let heights = surface.draw(square(nodes, 1.0)).into_heights();
    let pairs = |elastic: Elastic| -> u32 {
        let mut solver = Body { elastic, hardness: None }.solver(&on(square(nodes, 1.0), &heights));
        let press = |load| {
            let outcome = press(&mut solver, load, &Settings::default());
            assert_eq!(outcome.stop, Stop::Converged, "{elastic:?}, {load}");
            outcome.pairs
        };
        [0.003, 0.03, 0.2, 0.6].map(press).iter().sum()
    };
    let half_space = pairs(Elastic::default());
    let on = |thickness, nu, support| Elastic::Layer(Layer::new(thickness, nu, support).unwrap());
    let rigid = |thickness, nu, base| on(thickness, nu, Support::Rigid(base));
    let coated = |thickness, modulus_ratio| {
        on(thickness, 0.3, Support::HalfSpace { poisson_ratio: 0.3, modulus_ratio })
    };
    for (body, most) in [
        (rigid(0.5, 0.3, Base::Bonded), 1.1),
        (rigid(0.05, 0.3, Base::Bonded), 1.1),
        (rigid(0.05, 0.3, Base::Frictionless), 1.1),
        (rigid(0.05, 0.45, Base::Bonded), 1.1),
        (rigid(0.01, 0.3, Base::Bonded), 1.1),
        (coated(0.05, 0.1), 1.1),
        // Thin incompressible layers and stiff coatings are not as well preconditioned.
        (rigid(0.05, 0.5, Base::Bonded), 1.1),
        (rigid(0.01, 0.5, Base::Bonded), 1.4),
        (coated(0.05, 4.0), 1.2),
        (coated(0.05, 20.0), 2.0),
        (coated(0.05, 100.0), 4.0),
    ] {
        let ratio = f64::from(pairs(body)) / f64::from(half_space);
        assert!(ratio <= most, "{body:?}: {ratio}");
    }
}

#[test]
fn stiff_coatings_converge_and_touch_where_they_do_at_a_small_tolerance() {
    let nodes = 128;
    let spectrum = Spectrum { hurst: 0.8, k_lower: 4, k_rolloff: 4, k_upper: 16, anisotropy: None };
    let amplitude = Amplitude::Gaussian;
    let surface = RandomSurface { spectrum, amplitude, rms_slope: 1.0, seed: 1, realization: 0 };
    let heights = surface.draw(square(nodes, 1.0)).into_heights();
    for (modulus_ratio, most) in [(20.0, 60), (100.0, 150)] {
        for thickness in [0.02, 0.08] {
            for hardness in [None, Some(0.8)] {
                let support = Support::HalfSpace { poisson_ratio: 0.3, modulus_ratio };
                let elastic = Elastic::Layer(Layer::new(thickness, 0.3, support).unwrap());
                let hardness = hardness.map(|hardness| Hardness::new(hardness).unwrap());
                let mut solver =
                    Body { elastic, hardness }.solver(&on(square(nodes, 1.0), &heights));
                for load in [0.01, 0.05, 0.2] {
                    let mut touching = |tolerance| {
                        let settings = Settings { tolerance, ..Settings::default() };
                        let outcome = press(&mut solver, load, &settings);
                        assert_eq!(outcome.stop, Stop::Converged, "{elastic:?}, {load}");
                        let touching: Vec<bool> =
                            solver.pressure().iter().map(|p| *p > 0.0).collect();
                        (outcome.pairs, touching)
                    };
                    let (pairs, found) = touching(DEFAULT_TOLERANCE);
                    let (_, exact) = touching(1e-10);
                    let wrong = found.iter().zip(&exact).filter(|(a, b)| a != b).count();
                    assert!(pairs <= most, "{elastic:?}, {hardness:?}, {load}: {pairs} pairs");
                    assert!(wrong <= 2, "{elastic:?}, {hardness:?}, {load}: {wrong} nodes");
                }
            }
        }
    }
}

#[test]
fn a_layer_with_a_hardness_yields_and_a_coating_of_the_same_material_is_a_half_space() {
    let heights = rough(48, 5);
    let solved = |elastic, hardness: Option<f64>, load| {
        let hardness = hardness.map(|hardness| Hardness::new(hardness).unwrap());
        let mut solver = Body { elastic, hardness }.solver(&on(square(48, 1.0), &heights));
        (assert_outcome(&mut solver, &heights, load), solver.pressure().to_vec())
    };
    let layer = Layer::new(0.05, 0.3, Support::Rigid(Base::Bonded)).unwrap();
    let (yielded, _) = solved(Elastic::Layer(layer), Some(0.8), 0.1);
    assert!(yielded.saturated_nodes > 0 && yielded.peak_pressure == 0.8);
    let (elastic, _) = solved(Elastic::Layer(layer), None, 0.1);
    assert!(elastic.peak_pressure > 0.8 && elastic.contact_nodes <= yielded.contact_nodes);

    let same = Support::HalfSpace { poisson_ratio: 0.3, modulus_ratio: 1.0 };
    let coated = Elastic::Layer(Layer::new(0.05, 0.3, same).unwrap());
    let (coated, coated_pressures) = solved(coated, None, 0.1);
    let (bare, pressures) = solved(Elastic::default(), None, 0.1);
    assert_eq!(coated.contact_nodes, bare.contact_nodes);
    let mut pairs = coated_pressures.iter().zip(&pressures);
    assert!(pairs.all(|(one, other)| (one - other).abs() < 1e-3));
}
