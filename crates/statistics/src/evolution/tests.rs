use super::super::examples::{
    BGT_ALPHA_2, BGT_ALPHA_10, persson_curve, scattered, single, uniform,
};
use super::*;
use asperity_contact::theory::law::{KAPPA_BGT, KAPPA_PERSSON};

const LAW: ContactEvolution = ContactEvolution { kappa: 1.1 * KAPPA_BGT, beta: 1.2, mu: 0.6 };
const LIGHT: Window = Window { from: 0.0, to: 0.06 };
const BOOTSTRAP: Bootstrap = Bootstrap { replicates: 200, seed: 11, level: 0.95 };

fn exact(law: ContactEvolution, loads: Vec<f64>) -> Curves {
    scattered(law, loads, 1, (0.0, 0.0), 0)
}

fn problem(curves: &Curves, quantity: Quantity) -> EvolutionProblem {
    EvolutionProblem::new(curves, quantity, LIGHT).expect("enough loads")
}

fn fit(curves: &Curves, quantity: Quantity, kappa: Kappa) -> EvolutionFit {
    problem(curves, quantity).fit(kappa).expect("a law that bends")
}

#[test]
fn areas_of_a_law_return_its_parameters() {
    let curves = exact(LAW, uniform(0.06, 50));
    let fit = fit(&curves, Quantity::Area, Kappa::Given(LAW.kappa));
    assert!(fit.convex && fit.data == 50);
    assert!((fit.law.beta / LAW.beta - 1.0).abs() < 1e-8);
    assert!((fit.law.mu / LAW.mu - 1.0).abs() < 1e-8);
    assert!(fit.rms_residual < 1e-11 && fit.r_squared > Some(1.0 - 1e-15));
}

#[test]
fn free_kappa_is_recovered_with_the_other_parameters() {
    let fit = fit(&exact(LAW, uniform(0.06, 50)), Quantity::Area, Kappa::Free);
    // κ, β and μ are correlated to 0.999: the rounding of the areas is much amplified.
    assert!((fit.law.kappa / LAW.kappa - 1.0).abs() < 1e-6);
    assert!((fit.law.beta / LAW.beta - 1.0).abs() < 1e-6);
    assert!((fit.law.mu / LAW.mu - 1.0).abs() < 1e-6);
}

#[test]
fn slopes_of_a_law_return_its_parameters_to_the_order_of_the_differences() {
    let error = |steps| {
        let fit = fit(&exact(LAW, uniform(0.06, steps)), Quantity::Slope, Kappa::Given(LAW.kappa));
        (fit.law.beta / LAW.beta - 1.0).abs() + (fit.law.mu / LAW.mu - 1.0).abs()
    };
    // The first interval is the worst, as the curvature diverges there: its share of the data and
    // its error fall with the step.
    assert!(error(50) < 0.02, "{}", error(50));
    assert!(error(400) < 0.3 * error(50), "{} {}", error(50), error(400));
}

#[test]
fn asperity_model_has_its_known_parameters() {
    let fit = fit(&single(&BGT_ALPHA_2), Quantity::Slope, Kappa::Given(KAPPA_BGT));
    // An independent implementation gave .535 and .617.
    assert!((fit.law.beta - 0.535).abs() < 1e-3 && (fit.law.mu - 0.617).abs() < 1e-3, "{fit:?}");
    let fit = self::fit(&single(&BGT_ALPHA_10), Quantity::Slope, Kappa::Given(KAPPA_BGT));
    assert!((fit.law.beta - 0.150).abs() < 1e-3 && (fit.law.mu - 0.203).abs() < 1e-3, "{fit:?}");
}

#[test]
fn scattered_surfaces_return_the_law_within_a_few_standard_errors() {
    let curves = scattered(LAW, uniform(0.06, 50), 40, (0.02, 0.002), 3);
    let problem = problem(&curves, Quantity::Area);
    let fit = problem.fit(Kappa::Given(LAW.kappa)).expect("a law that bends");
    let resampled = problem.bootstrap(Kappa::Given(LAW.kappa), &fit, &BOOTSTRAP);
    let intervals = resampled.intervals.expect("no failures");
    assert_eq!(resampled.failed, 0);
    assert!((fit.law.beta - LAW.beta).abs() < 3.0 * intervals[1].standard_error);
    assert!((fit.law.mu - LAW.mu).abs() < 3.0 * intervals[2].standard_error);
    assert!(intervals[2].lower < fit.law.mu && fit.law.mu < intervals[2].upper);
}

#[test]
fn independent_noise_gives_a_reduced_chi_square_of_one() {
    let curves = scattered(LAW, uniform(0.06, 50), 200, (0.0, 0.01), 9);
    let fit = fit(&curves, Quantity::Area, Kappa::Given(LAW.kappa));
    // 48 degrees of freedom: ±√(2/48), and 10 % for the variances.
    assert!((fit.reduced_chi_square.expect("a variance") - 1.0).abs() < 0.6);
}

#[test]
fn single_surface_has_neither_chi_square_nor_interval() {
    let problem = problem(&exact(LAW, uniform(0.06, 50)), Quantity::Slope);
    let fit = problem.fit(Kappa::Given(LAW.kappa)).expect("a law that bends");
    assert_eq!(fit.reduced_chi_square, None);
    assert_eq!(problem.bootstrap(Kappa::Free, &fit, &BOOTSTRAP).intervals, None);
}

#[test]
fn order_of_the_surfaces_changes_the_fit_by_rounding_only() {
    let curves = |reverse: bool| {
        let curves = scattered(LAW, uniform(0.06, 30), 8, (0.05, 0.01), 21);
        let mut rows: Vec<Vec<f64>> = (0..8)
            .map(|s| {
                let mut only = [0; 8];
                only[s] = 1;
                curves.area_data(Window::ALL).resampled_mean(&only)
            })
            .collect();
        if reverse {
            rows.reverse();
        }
        Curves::new(uniform(0.06, 30), rows).expect("well formed")
    };
    let fits =
        [true, false].map(|reverse| fit(&curves(reverse), Quantity::Slope, Kappa::Given(3.0)));
    assert!((fits[0].law.beta / fits[1].law.beta - 1.0).abs() < 1e-8);
    assert!((fits[0].law.mu / fits[1].law.mu - 1.0).abs() < 1e-8);
}

#[test]
fn window_with_too_few_loads_is_refused_by_name() {
    let curves = exact(LAW, uniform(0.06, 5));
    let window = Window { from: 0.03, to: 0.06 };
    let error = EvolutionProblem::new(&curves, Quantity::Area, window).unwrap_err();
    assert_eq!(error, FitError::TooFew { window, found: 3, needed: 4 });
    assert_eq!(
        error.to_string(),
        "3 usable data with loads in [0.03, 0.06], the fit needs 4: widen the window or compute \
         more loads inside it"
    );
}

#[test]
fn kappa_below_the_slope_of_the_data_runs_away() {
    let problem = problem(&persson_curve(uniform(0.06, 50)), Quantity::Slope);
    let error = problem.fit(Kappa::Given(0.9 * KAPPA_PERSSON)).unwrap_err();
    assert!(matches!(error, FitError::Runaway { .. }), "{error}");
    let error = problem.fit(Kappa::Given(-1.0)).unwrap_err();
    assert_eq!(error, FitError::Kappa { kappa: -1.0 });
}

#[test]
fn a_power_law_has_an_infinite_slope_at_first_touch_and_so_no_kappa() {
    let loads = uniform(0.06, 20);
    let areas = loads.iter().map(|y| 2.0 * y.powf(0.9)).collect();
    let curves = Curves::new(loads, vec![areas]).expect("well formed");
    for quantity in [Quantity::Area, Quantity::Slope] {
        let error = problem(&curves, quantity).fit(Kappa::Free).unwrap_err();
        assert_eq!(error, FitError::NotConverged);
    }
}

#[test]
fn slope_is_convex_only_up_to_an_exponent_of_one() {
    for (mu, convex) in [(0.9, true), (1.3, false)] {
        let law = ContactEvolution { mu, ..LAW };
        let fit = fit(&exact(law, uniform(0.06, 50)), Quantity::Area, Kappa::Given(law.kappa));
        assert_eq!(fit.convex, convex);
    }
}

#[test]
fn surfaces_that_never_touch_have_no_law() {
    let problem = problem(&single(&[0.0; 50]), Quantity::Slope);
    for kappa in [Kappa::Free, Kappa::LeastConvex] {
        assert!(problem.fit(kappa).is_err(), "{:?}", problem.fit(kappa));
    }
}
