use std::f64::consts::{PI, SQRT_2};

use proptest::prelude::*;

use super::AsperityModel::{
    BushGibsonThomas, GreenwoodWilliamson, MeanCurvature, SimplifiedElliptic,
};
use super::quadrature::GaussLegendre;
use super::{Asperities, AsperityModel, Contact};
use crate::theory::law::KAPPA_BGT;
use crate::theory::persson;
use crate::theory::persson::erfcx;

const MODELS: [AsperityModel; 4] =
    [BushGibsonThomas, SimplifiedElliptic, MeanCurvature, GreenwoodWilliamson];

fn asperities(model: AsperityModel, nayak: f64) -> Asperities {
    Asperities::new(model, nayak).expect("an isotropic surface")
}

fn at_load(model: AsperityModel, nayak: f64, load: f64) -> Contact {
    let contact = asperities(model, nayak).at_load(load);
    contact.expect("a load within range")
}

/// Returns 1 − κ/√(2π) at an area fraction, with the secant κ = a/y.
fn deficit(model: AsperityModel, nayak: f64, area: f64) -> f64 {
    let contact = asperities(model, nayak).at_area(area);
    1.0 - contact.expect("an area within range").secant() / KAPPA_BGT
}

fn model(name: &str) -> Option<AsperityModel> {
    match name {
        "bgt" => Some(BushGibsonThomas),
        "se" => Some(SimplifiedElliptic),
        "mean" => Some(MeanCurvature),
        "gw_mccool" => Some(GreenwoodWilliamson),
        _ => None,
    }
}

fn number(text: &str) -> f64 {
    text.parse().expect("the table holds numbers")
}

#[test]
fn curves_agree_with_an_independent_quadrature() {
    let table = include_str!("../../../tests/data/model_curves.csv");
    let mut rows = 0;
    for line in table.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let (load, area) = (number(cells[3]), number(cells[4]));
        let found = match model(cells[0]) {
            Some(model) => asperities(model, number(cells[1])).at_separation(number(cells[2])),
            None => Contact { load, area: persson::area(load), ..at_load(MeanCurvature, 2.0, 1.0) },
        };
        // The table has eleven digits.
        assert!((found.load / load - 1.0).abs() < 1e-10, "{line}");
        assert!((found.area / area - 1.0).abs() < 1e-10, "{line}");
        rows += 1;
    }
    assert_eq!(rows, 1375);
}

#[test]
fn areas_at_given_loads_agree_with_an_independent_quadrature() {
    let table = include_str!("../../../tests/data/model_area_at_pnorm.csv");
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    for line in lines {
        let cells: Vec<f64> = line.split(',').map(number).collect();
        assert!((persson::area(cells[0]) / cells[1] - 1.0).abs() < 1e-10);
        assert!((KAPPA_BGT * cells[0] / cells[2] - 1.0).abs() < 1e-10);
        for (name, area) in header.iter().zip(&cells).skip(3) {
            let (name, nayak) = name.split_once("_a").expect("a model and α");
            let model = model(name).expect("a model");
            let found = at_load(model, number(nayak), cells[0]).area;
            // Separations s in the table have errors of 2e-9, and ln a has s times that.
            assert!((found / area - 1.0).abs() < 2e-8, "{name} {line}");
        }
    }
}

#[test]
fn secants_fall_short_of_the_asymptote_for_many_decades() {
    let table = [
        (1e-1, [0.1681, 0.2005, 0.3580, 0.3860, 0.4205]),
        (1e-2, [0.0454, 0.0680, 0.2393, 0.2683, 0.2997]),
        (1e-3, [0.0210, 0.0366, 0.1742, 0.2025, 0.2320]),
        (1e-5, [0.0097, 0.0188, 0.1044, 0.1299, 0.1559]),
        (1e-10, [0.0042, 0.0085, 0.0408, 0.0594, 0.0781]),
    ];
    for (area, deficits) in table {
        let found = [
            deficit(SimplifiedElliptic, 2.0, area),
            deficit(BushGibsonThomas, 2.0, area),
            deficit(SimplifiedElliptic, 10.0, area),
            deficit(BushGibsonThomas, 10.0, area),
            deficit(MeanCurvature, 10.0, area),
        ];
        for (found, deficit) in found.iter().zip(deficits) {
            assert!((found - deficit).abs() < 0.5001e-4, "{area}: {found} {deficit}");
        }
    }
}

#[test]
fn tangents_fall_short_of_the_asymptote_by_a_little_more() {
    for (area, deficit) in [(1e-5, 0.1146), (1e-10, 0.0435)] {
        let contact = asperities(SimplifiedElliptic, 10.0).at_area(area);
        let slope = contact.expect("an area within range").slope;
        assert!((1.0 - slope / KAPPA_BGT - deficit).abs() < 0.5001e-4);
    }
}

#[test]
fn broad_spectra_have_a_fifth_less_area_than_narrow_ones() {
    let table = [(0.001, 0.818), (0.01, 0.782), (0.02, 0.778), (0.04, 0.783), (0.06, 0.795)];
    for (load, ratio) in table {
        let area = |nayak| at_load(BushGibsonThomas, nayak, load).area;
        assert!((area(10.0) / area(2.0) - ratio).abs() < 0.5001e-3);
    }
}

#[test]
fn expansion_at_large_separation_has_the_stated_coefficient() {
    // κ = √(2π) (1 − c α/s² + O(s⁻⁴)), with the secant κ = a/y at separation s.
    for (model, coefficient) in
        [(BushGibsonThomas, 19.0 / 108.0), (SimplifiedElliptic, 1.0 / 12.0), (MeanCurvature, 0.25)]
    {
        for nayak in [1.5, 2.0, 5.0] {
            let apparent = |separation: f64| {
                let secant = asperities(model, nayak).at_separation(separation).secant();
                (1.0 - secant / KAPPA_BGT) * separation * separation / nayak
            };
            // Richardson extrapolation; the remainder is of order (α/s²)².
            let found = (apparent(32.0) * 4.0 - apparent(16.0)) / 3.0;
            assert!((found - coefficient).abs() < 1e-5 * nayak * nayak, "{found}");
            let expansion = KAPPA_BGT * (1.0 - coefficient * nayak / 1024.0);
            let exact = asperities(model, nayak).at_separation(32.0).secant();
            let error = expansion / exact - 1.0;
            assert!(error.abs() < (nayak / 1024.0).powi(2));
        }
    }
}

#[test]
fn half_of_the_bearing_area_is_in_contact_at_large_separation() {
    let bearing = |separation: f64| 0.5 * libm::erfc(separation / SQRT_2);
    for model in [BushGibsonThomas, SimplifiedElliptic, MeanCurvature] {
        let area = asperities(model, 2.0).at_separation(30.0).area;
        // Corrections are of order α/s².
        assert!((area / bearing(30.0) - 0.5).abs() < 2.0 / 900.0);
    }
}

#[test]
fn spheres_of_one_radius_have_no_linear_limit() {
    for (separation, secant) in [(2.0, 1.82), (4.0, 2.38), (6.0, 2.88), (10.0, 3.72)] {
        let contact = asperities(GreenwoodWilliamson, 10.0).at_separation(separation);
        assert!((contact.secant() - secant).abs() < 0.00501);
    }
}

/// Returns the number of summits per units of area, height and geometric mean curvature, for
/// m0 = m2 = 1 (Greenwood 2006).
fn greenwood_density(height: f64, curvature: f64, nayak: f64) -> f64 {
    let variance = 2.0 / 3.0 * nayak - 1.0;
    let shrink = 3.0 - 3.0 / nayak;
    let scaled = (curvature - height / shrink) / (2.0 * variance / shrink).sqrt();
    let growth = 1.5 / nayak * (curvature * curvature - height * height / shrink);
    let tail = if scaled > 0.0 {
        0.5 * erfcx(scaled) * (growth - scaled * scaled).exp()
    } else {
        0.5 * libm::erfc(scaled) * growth.exp()
    };
    let gaussian = (-0.5 * height * height).exp() / (2.0 * PI).sqrt();
    1.5 * curvature.powi(3) / (PI * nayak) * gaussian * tail / shrink.sqrt()
}

#[test]
fn simplified_elliptic_model_is_that_of_greenwood_s_closed_density() {
    let rule = GaussLegendre::new(100);
    for (nayak, separation) in [(2.0_f64, -0.5_f64), (2.0, 1.5), (10.0, 0.0), (10.0, 3.0)] {
        let (mut area, mut load) = (0.0, 0.0);
        let spread = (2.0 / 3.0 * nayak - 1.0).sqrt();
        for (root, of_root) in rule.over(0.0, (separation.max(0.0).hypot(9.0) - separation).sqrt())
        {
            let (excess, of_height) = (root * root, 2.0 * root * of_root);
            let height = separation + excess;
            // The substitution by a square makes half powers of the curvature smooth at zero.
            for (root, of_root) in rule.over(0.0, (height.max(0.0) + 9.0 * spread).sqrt()) {
                let (curvature, of_curvature) = (root * root, 2.0 * root * of_root);
                let summits =
                    of_height * of_curvature * greenwood_density(height, curvature, nayak);
                area += summits * PI * excess / curvature;
                load += summits * 4.0 / 3.0 * excess.powf(1.5) / curvature.sqrt();
            }
        }
        let contact = asperities(SimplifiedElliptic, nayak).at_separation(separation);
        assert!((contact.area / area - 1.0).abs() < 1e-10);
        assert!((contact.load / (load / SQRT_2) - 1.0).abs() < 1e-10);
    }
}

#[test]
fn a_single_wavelength_is_the_continuous_limit_of_narrow_spectra() {
    for model in MODELS {
        for separation in [-2.0, 0.0, 1.0, 3.0, 20.0] {
            let ring = asperities(model, 1.5).at_separation(separation);
            let nearly = asperities(model, 1.5 + 1e-9).at_separation(separation);
            // For spheres of one radius the decay is exp(−z²/(2⟨z²⟩)): a change of at most u² δα.
            assert!((ring.area / nearly.area - 1.0).abs() < 1e-6);
            assert!((ring.load / nearly.load - 1.0).abs() < 1e-6);
            assert!((ring.slope / nearly.slope - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn loads_and_areas_out_of_range_have_no_contact() {
    let asperities = asperities(BushGibsonThomas, 2.0);
    for value in [0.0, -1.0, 1e-305, f64::NAN, f64::INFINITY] {
        assert_eq!(asperities.at_load(value), None);
        assert_eq!(asperities.at_area(value), None);
    }
}

#[test]
fn no_surface_has_a_nayak_parameter_below_three_halves() {
    for nayak in [1.499, -2.0, f64::NAN, f64::INFINITY] {
        let error = Asperities::new(BushGibsonThomas, nayak).expect_err("not a surface");
        assert!(error.to_string().contains("at least 3/2"));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn loads_and_areas_are_met(
        which in 0..4usize, nayak in 1.5..100.0f64, exponent in -250.0..4.0f64
    ) {
        let asperities = asperities(MODELS[which], nayak);
        let target = 10f64.powf(exponent);
        let of_load = asperities.at_load(target).expect("a load within range");
        // An ulp of s changes ln y by s ulps of s.
        prop_assert!((of_load.load / target - 1.0).abs() < 1e-12);
        let of_area = asperities.at_area(target).expect("an area within range");
        prop_assert!((of_area.area / target - 1.0).abs() < 1e-12);
    }

    #[test]
    fn slopes_are_those_of_the_curves(
        which in 0..4usize, nayak in 1.5..100.0f64, separation in -3.0..8.0f64
    ) {
        let asperities = asperities(MODELS[which], nayak);
        let contact = asperities.at_separation(separation);
        let above = asperities.at_separation(separation + 1e-4);
        let below = asperities.at_separation(separation - 1e-4);
        let slope = (above.area - below.area) / (above.load - below.load);
        let stiffness = (below.load - above.load) / 2e-4;
        // The error is of second order in the step, times s² and, in narrow spectra, 1/(2α − 3).
        prop_assert!((contact.slope / slope - 1.0).abs() < 1e-5);
        prop_assert!((contact.stiffness / stiffness - 1.0).abs() < 1e-5);
    }

    #[test]
    fn models_keep_their_order(nayak in 1.5..100.0f64, exponent in -8.0..-1.0f64) {
        let load = 10f64.powf(exponent);
        let area = |model| at_load(model, nayak, load).area;
        let areas = [MeanCurvature, BushGibsonThomas, SimplifiedElliptic].map(area);
        prop_assert!(areas.is_sorted());
        prop_assert!(areas[2] < KAPPA_BGT * load);
    }
}
