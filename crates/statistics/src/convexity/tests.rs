use super::super::evolution::Quantity;
use super::super::examples::{
    BGT_ALPHA_2, BGT_ALPHA_10, persson_curve, scattered, single, uniform,
};
use super::super::{Curves, Window};
use super::*;
use asperity_contact::theory::law::{ContactEvolution, KAPPA_BGT};

const LIGHT: Window = Window { from: 0.0, to: 0.06 };
const BOOTSTRAP: Bootstrap = Bootstrap { replicates: 100, seed: 3, level: 0.95 };

fn problem(curves: &Curves, quantity: Quantity) -> EvolutionProblem {
    EvolutionProblem::new(curves, quantity, LIGHT).expect("enough loads")
}

fn least(curves: &Curves) -> f64 {
    let fit = problem(curves, Quantity::Slope).fit(Kappa::LeastConvex).expect("a bound");
    assert!(fit.convex && (fit.law.mu - 1.0).abs() < 1e-6, "{fit:?}");
    fit.law.kappa / KAPPA_BGT
}

#[test]
fn least_convex_kappas_of_the_models_are_the_known_ones() {
    // An independent implementation gave these, fitting μ at every κ.
    assert!((least(&single(&BGT_ALPHA_2)) - 0.921).abs() < 1e-3);
    assert!((least(&single(&BGT_ALPHA_10)) - 0.693).abs() < 1e-3);
    assert!((least(&persson_curve(uniform(0.06, 50))) - 0.638).abs() < 1e-3);
}

#[test]
fn fits_are_convex_from_the_least_kappa_up_and_not_below() {
    let problem = problem(&single(&BGT_ALPHA_2), Quantity::Slope);
    let least = problem.fit(Kappa::LeastConvex).expect("a bound").law.kappa;
    let convex = |factor| problem.fit(Kappa::Given(factor * least)).expect("bends").convex;
    assert!(!convex(0.999) && convex(1.001) && convex(1.5));
}

#[test]
fn hyperbolic_law_is_its_own_bound() {
    let law = ContactEvolution { kappa: 2.4, beta: 0.8, mu: 1.0 };
    let curves = scattered(law, uniform(0.06, 50), 1, (0.0, 0.0), 0);
    let fit = problem(&curves, Quantity::Area).fit(Kappa::LeastConvex).expect("a bound");
    assert!((fit.law.kappa / law.kappa - 1.0).abs() < 1e-7);
    assert!((fit.law.beta / law.beta - 1.0).abs() < 1e-5);
}

#[test]
fn proportional_area_bounds_no_kappa() {
    let areas: Vec<f64> = uniform(0.06, 50).iter().map(|y| 2.0 * y).collect();
    let error = problem(&single(&areas), Quantity::Slope).fit(Kappa::LeastConvex).unwrap_err();
    assert!(matches!(error, FitError::NoConvexKappa { .. }), "{error}");
}

#[test]
fn common_kappa_is_the_largest_and_makes_every_slope_convex() {
    let problems =
        [BGT_ALPHA_10, BGT_ALPHA_2].map(|areas| problem(&single(&areas), Quantity::Slope));
    let common = CommonKappa::fit(&problems).expect("bounds");
    let own: Vec<f64> = common.own.iter().map(|own| *own.as_ref().expect("a bound")).collect();
    assert_eq!(common.kappa, own[1]);
    assert!(common.fits.iter().all(|fit| fit.as_ref().expect("bends").convex));
}

#[test]
fn curves_without_a_bound_do_not_spoil_the_others() {
    let areas: Vec<f64> = uniform(0.06, 50).iter().map(|y| 2.0 * y).collect();
    let problems = [
        problem(&single(&areas), Quantity::Slope),
        problem(&single(&BGT_ALPHA_2), Quantity::Slope),
    ];
    let common = CommonKappa::fit(&problems).expect("one bound");
    assert!(common.own[0].is_err() && common.own[1] == Ok(common.kappa));
    let error = CommonKappa::fit(&problems[..1]).unwrap_err();
    assert_eq!(error, FitError::NoCommonKappa { curves: 1 });
}

#[test]
fn interval_of_the_common_kappa_contains_it() {
    let law = ContactEvolution { kappa: 2.6, beta: 1.0, mu: 0.7 };
    let problems = [0.7, 0.5].map(|mu| {
        let law = ContactEvolution { mu, ..law };
        problem(&scattered(law, uniform(0.06, 30), 20, (0.02, 0.001), 8), Quantity::Area)
    });
    let common = CommonKappa::fit(&problems).expect("bounds");
    let units = vec![(0..20).collect(); 2];
    let resampled = common.bootstrap(&problems, &units, &BOOTSTRAP);
    assert_eq!(resampled.failed, 0);
    let interval = resampled.intervals.expect("no failures")[0];
    assert!(interval.lower < common.kappa && common.kappa < interval.upper);
}

#[test]
fn search_near_the_answer_finds_the_same_root() {
    let problem = problem(&single(&BGT_ALPHA_2), Quantity::Slope);
    let far = problem.least_convex_kappa(&problem.mean, None).expect("a bound");
    for guess in [0.8 * far, 0.999 * far, far, 1.2 * far, 10.0 * far] {
        let near = problem.least_convex_kappa(&problem.mean, Some(guess)).expect("a bound");
        assert!((near / far - 1.0).abs() < 1e-8, "{guess}");
    }
}
