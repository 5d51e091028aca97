use super::*;
use crate::elasticity::Factor;
use crate::grid::samples::{rectangle, square};
use crate::threads::Threads;

const RIGID: [Support; 2] = [Support::Rigid(Base::Bonded), Support::Rigid(Base::Frictionless)];

fn layer(poisson_ratio: f64, support: Support) -> Layer {
    Layer::new(0.05, poisson_ratio, support).unwrap()
}

fn coating(poisson_ratio: f64, modulus_ratio: f64, below: f64) -> Layer {
    layer(poisson_ratio, Support::HalfSpace { poisson_ratio: below, modulus_ratio })
}

fn is_close(found: f64, expected: f64, tolerance: f64) -> bool {
    (found / expected - 1.0).abs() < tolerance
}

/// Returns the header and the rows of a table of factors that independent programs computed.
fn table(name: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let path = format!("{}/tests/data/layer/{name}.csv", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap().split(',').map(str::to_owned).collect();
    let row = |line: &str| line.split(',').map(|number| number.parse().unwrap()).collect();
    (header, lines.map(row).collect())
}

#[test]
fn factors_of_layers_on_a_rigid_base_are_those_of_the_closed_forms() {
    let (header, rows) = table("factor_bonded");
    for row in rows {
        for (name, factor) in header.iter().zip(&row).skip(1) {
            let nu = name.strip_prefix("nu=").unwrap().parse().unwrap();
            let found = layer(nu, RIGID[0]).factor(row[0]);
            // The reference lost digits in the smallest factors.
            let error = (found - factor).abs();
            assert!(error < 1e-11 * factor + 1e-16, "{name}, {}: {found}, {factor}", row[0]);
        }
    }
    for row in table("factor_smooth").1 {
        // A frictionless base has the same factor for any Poisson's ratio.
        for nu in [0.0, 0.3, 0.5] {
            assert!(is_close(layer(nu, RIGID[1]).factor(row[0]), row[1], 1e-11), "{row:?}");
        }
    }
}

#[test]
fn factors_of_coatings_are_those_of_the_closed_forms() {
    for row in table("factor_coating").1 {
        let [x, modulus_ratio, nu, below, factor] = row[..] else { panic!("five columns") };
        let found = coating(nu, modulus_ratio, below).factor(x);
        assert!(is_close(found, factor, 1e-11), "{row:?}: {found}");
    }
}

#[test]
fn a_coating_of_the_material_of_the_substrate_is_a_half_space() {
    for nu in [-0.5, 0.0, 0.3, 0.5] {
        for x in [1e-9, 1e-3, 0.2, 1.0, 5.0, 39.0, 1e10] {
            assert!((coating(nu, 1.0, nu).factor(x) - 1.0).abs() < 1e-14, "{nu}, {x}");
        }
    }
}

#[test]
fn a_soft_coating_is_a_bonded_layer_and_a_thin_one_leaves_the_substrate() {
    for nu in [0.0, 0.3, 0.5] {
        for x in [0.01, 0.3, 2.0] {
            let bonded = layer(nu, RIGID[0]).factor(x);
            assert!(is_close(coating(nu, 1e-15, 0.2).factor(x), bonded, 1e-6));
        }
        // Both waves are displaced by 2/(E* |q|) with the modulus of the substrate.
        for (modulus_ratio, below) in [(4.0, 0.1), (0.25, 0.4)] {
            let substrate = modulus_ratio * (1.0 - below) / (1.0 - nu);
            assert!(is_close(coating(nu, modulus_ratio, below).factor(1e-7), substrate, 1e-5));
        }
    }
}

#[test]
fn waves_longer_than_the_thickness_press_a_foundation() {
    let x = 1e-5;
    for nu in [-0.9, 0.0, 0.3, 0.49] {
        let winkler = x * (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu) * (1.0 - nu));
        assert!(is_close(layer(nu, RIGID[0]).factor(x), winkler, 1e-7));
        assert!(is_close(layer(nu, RIGID[1]).factor(x), x / 2.0, 1e-9));
    }
    assert!(is_close(layer(0.5, RIGID[0]).factor(x), 2.0 / 3.0 * x.powi(3), 1e-9));
}

#[test]
fn waves_shorter_than_the_thickness_do_not_feel_the_base() {
    let layers = RIGID.map(|support| layer(0.4, support));
    for layer in layers.into_iter().chain([coating(0.3, 1e3, 0.2), coating(0.3, 1e-3, 0.2)]) {
        for x in [19.0, 39.9, 40.1, 400.0, 1e300] {
            assert!((layer.factor(x) - 1.0).abs() < 1e-12, "{layer:?}, {x}");
        }
    }
}

#[test]
fn the_approach_of_a_thick_layer_is_less_than_that_of_hertz_by_the_integral_of_one_minus_f() {
    // The integrals of 1 − f over all x, for a point force far above the base.
    let by_parts = |layer: Layer| -> f64 {
        let step = 1e-3;
        let nodes = (0..40_000).map(|node| (f64::from(node) + 0.5) * step);
        nodes.map(|x| (1.0 - layer.factor(x)) * step).sum()
    };
    for (nu, integral) in [(0.0, 1.2110617185), (0.3, 1.3768541655), (0.5, 1.7702167734)] {
        assert!(is_close(by_parts(layer(nu, RIGID[0])), integral, 1e-6));
    }
    assert!(is_close(by_parts(layer(0.3, RIGID[1])), 1.1675768374, 1e-6));
}

#[test]
fn a_uniform_pressure_strains_a_layer_along_its_thickness_alone() {
    // t/M, with M in units of E*.
    for support in RIGID {
        let compliance = layer(0.3, support).uniform_compliance().unwrap();
        let modulus = 0.7 / (1.3 * 0.4) * (1.0 - 0.3 * 0.3);
        assert!(is_close(compliance, 0.05 / modulus, 1e-14));
        assert_eq!(layer(0.5, support).uniform_compliance(), Some(0.0));
    }
    assert_eq!(coating(0.3, 2.0, 0.3).uniform_compliance(), None);
}

#[test]
fn impossible_layers_are_refused() {
    let rigid = |thickness, nu| Layer::new(thickness, nu, RIGID[0]);
    assert_eq!(rigid(0.0, 0.3), Err(LayerError::Thickness(0.0)));
    assert!(matches!(rigid(f64::NAN, 0.3), Err(LayerError::Thickness(_))));
    assert_eq!(rigid(1.0, -1.0), Err(LayerError::PoissonRatio(-1.0)));
    let coating = |modulus_ratio, poisson_ratio| {
        Layer::new(1.0, 0.3, Support::HalfSpace { poisson_ratio, modulus_ratio })
    };
    assert_eq!(coating(0.0, 0.3), Err(LayerError::ModulusRatio(0.0)));
    assert_eq!(coating(1.0, 0.51), Err(LayerError::PoissonRatio(0.51)));
}

#[test]
fn a_stiffness_is_the_inverse_of_the_displacement_except_for_the_uniform_wave() {
    let layers = RIGID.map(|support| layer(0.5, support));
    for layer in layers.into_iter().chain([coating(0.3, 4.0, 0.2)]) {
        for grid in [square(16, 3.0), rectangle([12, 16], [1.5, 4.0])] {
            let body = PeriodicLayer::new(grid, layer);
            assert_eq!((body.displacement([0, 0]), body.stiffness([0, 0])), (0.0, 0.0));
            for waves in [[1, 0], [0, 1], [3, 4], [6, 8]] {
                assert!((body.displacement(waves) * body.stiffness(waves) - 1.0).abs() < 1e-14);
            }
        }
    }
}

#[test]
fn a_node_sinks_less_into_a_thin_layer() {
    let grid = square(32, 1.0);
    let compliance = |thickness: f64| {
        let layer = Layer::new(thickness, 0.3, RIGID[0]).unwrap();
        PeriodicLayer::new(grid, layer).nodal(Factor::Displacement, &Threads::one())
    };
    assert!(compliance(0.01) < compliance(0.1) && compliance(0.1) < compliance(10.0));
    // A point of a Winkler foundation sinks by p t/M; a layer is one for all waves of this mesh.
    let layer = Layer::new(1e-5, 0.3, RIGID[0]).unwrap();
    let waves = 1.0 - 1.0 / f64::from(32 * 32);
    assert!(is_close(compliance(1e-5), waves * layer.uniform_compliance().unwrap(), 1e-5));
}
