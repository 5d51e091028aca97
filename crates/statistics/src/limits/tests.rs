//! Tests with known limits, from exact data and from synthetic studies with scatter.

use super::*;
use crate::random::normal;

/// Returns the small parameters of 27 points: all combinations of three values of each.
fn grid() -> Vec<Vec<f64>> {
    let mut points = Vec::new();
    for thermodynamic in [0.5, 0.25, 0.125] {
        for fractal in [0.25, 0.125, 0.0625] {
            for continuum in [0.25, 0.125, 0.0625] {
                points.push(vec![thermodynamic, fractal, continuum]);
            }
        }
    }
    points
}

/// Returns 2.1 + 0.4 x₁ − 0.8 x₂^0.7 + 0.6 x₃.
fn truth(small: &[f64]) -> f64 {
    2.1 + 0.4 * small[0] - 0.8 * small[1].powf(0.7) + 0.6 * small[2]
}

/// Returns a synthetic study in which the scatter between surfaces is proportional to the first
/// small parameter.
///
/// The deviation of a surface has a part that is the same at all points and an independent part.
fn study(seed: u64, surfaces: usize, scatter: f64, truth: fn(&[f64]) -> f64) -> LimitProblem {
    let grid = grid();
    let draws = normal(seed, surfaces * (grid.len() + 1));
    let point = |(index, small): (usize, &Vec<f64>)| {
        let own = |surface: usize| {
            let common = draws[surface];
            let own = draws[surfaces * (index + 1) + surface];
            truth(small) + scatter * small[0] * (0.6 * common + 0.8 * own)
        };
        LimitPoint {
            small: small.clone(),
            observed: Observed::from_realizations((0..surfaces).map(own).collect()),
        }
    };
    LimitProblem::new(grid.iter().enumerate().map(point).collect()).expect("well formed")
}

const GIVEN: [TermForm; 3] = [TermForm::Power(1.0), TermForm::Power(0.7), TermForm::Power(1.0)];
const FREE: [TermForm; 3] = [TermForm::Power(1.0), TermForm::FreePower, TermForm::Power(1.0)];

/// Returns the bias of a fitted parameter, in standard errors, and the coverage of its intervals.
///
/// Both are estimated from 400 studies. For exponents, the bias is the bias of the logarithm.
fn experiment(forms: &[TermForm], surfaces: usize, parameter: usize, truth_of: f64) -> (f64, f64) {
    const STUDIES: u64 = 400;
    let bootstrap = Bootstrap { replicates: 200, seed: 5, level: 0.95 };
    let mut covered = 0.0;
    let deviations: Vec<f64> = (0..STUDIES)
        .map(|seed| {
            let problem = study(seed, surfaces, 0.05, truth);
            let fit = problem.fit(forms).unwrap();
            let resampled = problem.resample(&[(forms, &fit)], &bootstrap);
            let interval = resampled.intervals[0].intervals.as_ref().unwrap()[parameter];
            covered += f64::from(interval.lower <= truth_of && truth_of <= interval.upper);
            match parameter {
                0 => fit.limit - truth_of,
                1..=3 => fit.coefficients[parameter - 1] - truth_of,
                _ => (fit.exponents[1].unwrap() / truth_of).ln(),
            }
        })
        .collect();
    let count = STUDIES as f64;
    let mean = deviations.iter().sum::<f64>() / count;
    let squares: f64 = deviations.iter().map(|one| (one - mean).powi(2)).sum();
    let error = (squares / (count - 1.0) / count).sqrt();
    (mean / error, covered / count)
}

#[test]
fn exact_data_give_their_limit_coefficients_and_exponent() {
    let problem = study(1, 5, 1e-9, truth);
    for forms in [GIVEN, FREE] {
        let fit = problem.fit(&forms).unwrap();
        assert!((fit.limit - 2.1).abs() < 1e-7, "{fit:?}");
        let known = [0.4, -0.8, 0.6];
        for (found, known) in fit.coefficients.iter().zip(known) {
            assert!((found - known).abs() < 1e-6, "{fit:?}");
        }
        assert!((fit.exponents[1].unwrap() - 0.7).abs() < 1e-6, "{fit:?}");
    }
}

#[test]
fn a_logarithm_is_fitted_with_its_value_at_one() {
    let problem = study(1, 5, 1e-9, |small| 2.0 + 0.1 * small[1].ln());
    let forms = [TermForm::Power(1.0), TermForm::Logarithm, TermForm::Power(1.0)];
    let fit = problem.fit(&forms).unwrap();
    assert!((fit.limit - 2.0).abs() < 1e-7 && (fit.coefficients[1] - 0.1).abs() < 1e-7);
    assert_eq!(fit.exponents[1], None);
}

#[test]
fn limits_of_given_exponents_are_unbiased_and_covered() {
    for (parameter, known) in [(0, 2.1), (2, -0.8)] {
        let (bias, covered) = experiment(&GIVEN, 10, parameter, known);
        assert!(bias.abs() < 2.0, "{parameter}: {bias} standard errors");
        // The binomial error is 0.011 for 400 studies.
        assert!((0.92..=0.98).contains(&covered), "{parameter}: {covered}");
    }
}

// Intervals of nonlinear parameters are accurate to first order. With ten surfaces, the coverage is
// one per cent lower.
#[test]
fn free_exponents_and_their_limits_are_unbiased_and_covered() {
    for (parameter, known) in [(0, 2.1), (4, 0.7)] {
        let (bias, covered) = experiment(&FREE, 20, parameter, known);
        assert!(bias.abs() < 2.0, "{parameter}: {bias} standard errors");
        assert!((0.92..=0.98).contains(&covered), "{parameter}: {covered}");
    }
}

#[test]
fn intervals_of_few_surfaces_have_their_coverage() {
    let (_, covered) = experiment(&GIVEN, 4, 0, 2.1);
    assert!((0.92..=0.98).contains(&covered), "{covered}");
}

#[test]
fn the_true_form_has_the_least_criterion_and_predicts_best() {
    let problem = study(3, 10, 0.02, truth);
    let wrong = [TermForm::Power(1.0), TermForm::Power(3.0), TermForm::Power(1.0)];
    let fits = [GIVEN, wrong].map(|forms| (forms, problem.fit(&forms).unwrap()));
    let assessed = fits.each_ref().map(|(forms, fit)| problem.assess(forms, fit));
    assert!(assessed[0].akaike + 10.0 < assessed[1].akaike, "{assessed:?}");
    assert!(assessed[0].leave_one_out.unwrap() < assessed[1].leave_one_out.unwrap());
    // The expected value would be one, but the common scatter of realizations reduces it.
    assert!((0.4..2.0).contains(&assessed[0].reduced_chi_square), "{assessed:?}");
    let rivals = fits.each_ref().map(|(forms, fit)| (&forms[..], fit));
    let bootstrap = Bootstrap { replicates: 200, seed: 1, level: 0.95 };
    let compared = problem.resample(&rivals, &bootstrap).comparison;
    assert!(compared[0].akaike_weight > 0.99 && compared[0].best_fraction > Some(0.95));
    assert!((compared[0].akaike_weight + compared[1].akaike_weight - 1.0).abs() < 1e-15);
}

#[test]
fn leave_one_out_errors_of_a_line_follow_from_its_leverages() {
    let values = [1.0, 0.0, 2.0, 1.5];
    let point = |(index, value): (usize, &f64)| LimitPoint {
        small: vec![1.0 + index as f64],
        observed: Observed::from_realizations(vec![value - 1.0, value + 1.0]),
    };
    let problem = LimitProblem::new(values.iter().enumerate().map(point).collect()).unwrap();
    let forms = [TermForm::Power(1.0)];
    let fit = problem.fit(&forms).unwrap();
    let error = |index: usize| {
        let x = 1.0 + index as f64;
        let leverage = 0.25 + (x - 2.5).powi(2) / 5.0;
        (values[index] - fit.limit - fit.coefficients[0] * x) / (1.0 - leverage)
    };
    let squares: f64 = (0..4).map(|index| error(index).powi(2)).sum();
    let found = problem.assess(&forms, &fit).leave_one_out.unwrap();
    assert!((found - (squares / 4.0).sqrt()).abs() < 1e-13);
}

#[test]
fn estimates_without_surfaces_scatter_by_their_standard_errors() {
    let point = |small: f64| LimitPoint {
        small: vec![small],
        observed: Observed::Estimate { value: 1.0 + small, standard_error: 0.1, surfaces: 50 },
    };
    let problem = LimitProblem::new([1.0, 2.0, 3.0].map(point).to_vec()).unwrap();
    let forms = [TermForm::Power(1.0)];
    let fit = problem.fit(&forms).unwrap();
    let bootstrap = Bootstrap { replicates: 4000, seed: 1, level: 0.95 };
    let intervals = problem.resample(&[(&forms, &fit)], &bootstrap).intervals;
    let limit = intervals[0].intervals.as_ref().unwrap()[0];
    // The intercept of a line has the standard error σ √(Σx²/(n Σ(x − x̄)²)). It is estimated from
    // 4000 replicates, to 1.1 %.
    let known = 0.1 * (14.0_f64 / 6.0).sqrt();
    assert!((limit.standard_error / known - 1.0).abs() < 0.04, "{limit:?}");
}

#[test]
fn problems_without_a_fit_are_errors() {
    let surfaces = |values: [f64; 2]| Observed::from_realizations(values.to_vec());
    let point = |small: f64, values| LimitPoint { small: vec![small], observed: surfaces(values) };
    let refused = |point| LimitProblem::new(vec![point]).unwrap_err();
    assert_eq!(refused(point(0.0, [1.0, 2.0])), FitError::NotSmall);
    assert_eq!(refused(point(1.0, [1.0, 1.0])), FitError::NoScatter);
    let problem = |small: [f64; 4]| {
        let points = small.map(|small| point(small, [1.0, 1.0 + small]));
        LimitProblem::new(points.to_vec()).unwrap()
    };
    let power = [TermForm::Power(1.0)];
    let few = LimitProblem::new(vec![point(1.0, [1.0, 2.0]); 2]).unwrap();
    assert_eq!(few.fit(&power).unwrap_err(), FitError::TooFewPoints);
    let equal = problem([0.5; 4]).fit(&power).unwrap_err();
    assert_eq!(equal, FitError::DependentTerms);
}
