//! Least convex κ: the smallest κ for which the fitted slope is convex.
//!
//! The slope of a contact evolution law is convex at all loads if and only if μ ≤ 1. The μ fitted
//! with a given κ decreases with κ. The least convex κ of a curve is therefore the root of
//! μ_fit(κ) = 1. The common κ of several curves is the largest of their least convex κ. It depends
//! on the window and is a lower bound of the true κ, as used by Yastrebov, Anciaux & Molinari 2015.
//!
//! The root is found without fitting μ. With the best β for μ = 1, the derivative of the sum of
//! squares with respect to ln μ is computed. Its sign shows whether the best μ is above or below
//! one. Far from the root, a full fit may diverge, but this derivative exists.

use super::FitError;
use super::bootstrap::{Bootstrap, Estimate, Intervals, Resample};
use super::evolution::{EvolutionFit, EvolutionProblem, Kappa};
use super::least_squares::{Residuals, minimize};

/// Ratio of successive κ in the search for a sign change of the [`MuDerivative`].
const SCAN_RATIO: f64 = 0.9;
/// Maximum number of steps from a given κ in the search for a sign change of the [`MuDerivative`]
/// near it.
const NEAR_STEPS: i32 = 6;
/// Maximum number of doublings of κ, starting from twice the largest slope of the data.
const DOUBLINGS: usize = 6;
/// Relative tolerance of the least convex κ, orders of magnitude below statistical errors.
const KAPPA_TOLERANCE: f64 = 1e-10;
/// Maximum number of iterations of the Illinois method; bisection would need about thirty.
const ROOT_ITERATIONS: usize = 60;

/// Fits of contact evolution laws to several curves with a common κ.
#[derive(Debug, Clone, PartialEq)]
pub struct CommonKappa {
    /// Largest of the least convex κ of the curves.
    pub kappa: f64,
    /// Least convex κ of each curve, or the reason why it has none.
    pub own: Vec<Result<f64, FitError>>,
    /// Fit of each curve with the common κ, or the reason why it failed.
    pub fits: Vec<Result<EvolutionFit, FitError>>,
}

impl CommonKappa {
    /// Fits all curves with the largest of their least convex κ.
    ///
    /// Curves without a least convex κ do not affect the common κ.
    ///
    /// # Errors
    /// Fails if no curve has a least convex κ.
    pub fn fit(problems: &[EvolutionProblem]) -> Result<Self, FitError> {
        let own: Vec<_> = problems
            .iter()
            .map(|problem| problem.least_convex_kappa(&problem.mean, None))
            .collect();
        let kappa =
            own.iter().flatten().copied().reduce(f64::max).ok_or(FitError::NoCommonKappa)?;
        let fits = problems.iter().map(|problem| problem.fit(Kappa::Given(kappa))).collect();
        Ok(Self { kappa, own, fits })
    }

    /// Computes the confidence interval of the common κ by resampling whole surfaces.
    ///
    /// `units` contains, for each curve, the numbers of its surfaces. Curves share realizations: a
    /// surface has the same number and the same multiplicity in all curves. Curves without a least
    /// convex κ are omitted.
    pub fn bootstrap(
        &self,
        problems: &[EvolutionProblem],
        units: &[Vec<usize>],
        bootstrap: &Bootstrap,
    ) -> Intervals {
        let curves = problems.iter().zip(units).zip(&self.own);
        let bounded: Vec<(&EvolutionProblem, &[usize], f64)> = curves
            .filter_map(|((problem, units), own)| Some((problem, &units[..], *own.as_ref().ok()?)))
            .collect();
        let resample = Resample::from_ensembles(bounded.iter().map(|(_, units, _)| *units));
        let estimates = [Estimate::Positive(self.kappa)];
        bootstrap.intervals_of_ensembles(resample, &estimates, |_, times| {
            let mut largest = 0.0f64;
            for &(problem, units, near) in &bounded {
                let times: Vec<u32> = units.iter().map(|&unit| times[unit]).collect();
                if times.iter().any(|&times| times > 0) {
                    let mean = problem.data.resampled_mean(&times);
                    largest = largest.max(problem.least_convex_kappa(&mean, Some(near))?);
                }
            }
            Ok(vec![largest])
        })
    }
}

impl EvolutionProblem {
    /// Finds the least convex κ of the mean curve `mean`. The search begins near `near`, if it is
    /// given, and otherwise covers all κ.
    pub(super) fn least_convex_kappa(
        &self,
        mean: &[f64],
        near: Option<f64>,
    ) -> Result<f64, FitError> {
        let mut derivative = MuDerivative { problem: self, mean, ln_beta: 0.0 };
        let found = near
            .and_then(|kappa| bracket_near(&mut derivative, kappa))
            .map_or_else(|| self.bracket(mean, &mut derivative), Ok)?;
        Ok(root(&mut derivative, found))
    }

    /// Finds an interval of κ in which the [`MuDerivative`] changes sign, scanning from large κ to
    /// smaller ones.
    ///
    /// Slopes fitted with all larger κ in the scan are convex.
    fn bracket(&self, mean: &[f64], derivative: &mut MuDerivative) -> Result<Bracket, FitError> {
        let mean_slope = self.proportionality(mean);
        let steepest = self
            .data
            .loads
            .iter()
            .zip(mean)
            .map(|(&load, &value)| self.slope_of(load, value))
            .fold(mean_slope, f64::max);
        let none =
            |upper| FitError::NoConvexKappa { lower: mean_slope, upper, window: self.data.window };
        let mut upper = 2.0 * steepest;
        let mut at_upper = derivative.at(upper);
        for _ in 0..DOUBLINGS {
            if at_upper > 0.0 {
                break;
            }
            upper *= 2.0;
            at_upper = derivative.at(upper);
        }
        let top = upper;
        // The scan ends at the mean slope, because the best law for smaller κ is a straight line.
        while at_upper > 0.0 && upper > mean_slope && mean_slope > 0.0 {
            let lower = (upper * SCAN_RATIO).max(mean_slope * (1.0 + KAPPA_TOLERANCE));
            let at_lower = derivative.at(lower);
            if at_lower <= 0.0 {
                return Ok([(lower, at_lower), (upper, at_upper)]);
            }
            if lower >= upper * (1.0 - KAPPA_TOLERANCE) {
                break;
            }
            (upper, at_upper) = (lower, at_lower);
        }
        Err(none(top))
    }
}

/// Lower and upper κ, each with its derivative, of which the first is not positive.
type Bracket = [(f64, f64); 2];

fn bracket_near(derivative: &mut MuDerivative, kappa: f64) -> Option<Bracket> {
    let at = derivative.at(kappa);
    let ratio: f64 = if at > 0.0 { 0.99 } else { 1.01 };
    let (mut inner, mut at_inner) = (kappa, at);
    for step in 1..=NEAR_STEPS {
        let outer = kappa * ratio.powi(1 << (step - 1));
        let at_outer = derivative.at(outer);
        if (at_outer > 0.0) != (at > 0.0) {
            let (inner, outer) = ((inner, at_inner), (outer, at_outer));
            return Some(if at > 0.0 { [outer, inner] } else { [inner, outer] });
        }
        (inner, at_inner) = (outer, at_outer);
    }
    None
}

/// Finds the κ in a bracket at which the derivative is zero, by the Illinois method.
fn root(derivative: &mut MuDerivative, bracket: Bracket) -> f64 {
    let [(mut lower, mut at_lower), (mut upper, mut at_upper)] = bracket;
    let mut kappa = upper;
    let mut moved_upper = None;
    for _ in 0..ROOT_ITERATIONS {
        let next = (lower * at_upper - upper * at_lower) / (at_upper - at_lower);
        let step = (next - kappa).abs();
        kappa = next;
        let at = derivative.at(kappa);
        if step <= KAPPA_TOLERANCE * kappa || at == 0.0 {
            break;
        }
        if at > 0.0 {
            (upper, at_upper) = (kappa, at);
            at_lower *= if moved_upper == Some(true) { 0.5 } else { 1.0 };
        } else {
            (lower, at_lower) = (kappa, at);
            at_upper *= if moved_upper == Some(false) { 0.5 } else { 1.0 };
        }
        moved_upper = Some(at > 0.0);
    }
    kappa
}

/// Half the derivative of the sum of squared residuals with respect to ln μ at μ = 1, with the best
/// β for a given κ.
///
/// It is positive if an exponent μ < 1 fits better than μ = 1.
struct MuDerivative<'a> {
    problem: &'a EvolutionProblem,
    mean: &'a [f64],
    /// Last fitted ln β. The next fit of β starts from it.
    ln_beta: f64,
}

impl MuDerivative<'_> {
    fn at(&mut self, kappa: f64) -> f64 {
        // With μ = 1, the law is a = Y/(1 + βY) with the free parameter β.
        let hyperbola = self.problem.model::<1>(self.mean, kappa);
        let found = minimize(&hyperbola, [self.ln_beta]);
        let [ln_beta] = found.parameters;
        let law = hyperbola.law([ln_beta]);
        // The next fit must not start from a straight line.
        self.ln_beta = if ln_beta > -10.0 { ln_beta } else { 0.0 };
        let mut residuals = vec![0.0; self.mean.len()];
        hyperbola.residuals([ln_beta], &mut residuals);
        residuals.iter().enumerate().map(|(i, r)| r * hyperbola.gradient(&law, i)[1]).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolution::Quantity;
    use crate::random::curves::{
        BGT_ALPHA_2, BGT_ALPHA_10, persson_curve, scattered, single, uniform,
    };
    use crate::{Curves, Window};
    use asperity_mechanics::theory::law::{ContactEvolution, KAPPA_BGT};

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
        // An independent implementation that fits μ at every κ gives these values.
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
    fn curves_without_a_bound_do_not_affect_the_others() {
        let areas: Vec<f64> = uniform(0.06, 50).iter().map(|y| 2.0 * y).collect();
        let problems = [
            problem(&single(&areas), Quantity::Slope),
            problem(&single(&BGT_ALPHA_2), Quantity::Slope),
        ];
        let common = CommonKappa::fit(&problems).expect("one bound");
        assert!(common.own[0].is_err() && common.own[1] == Ok(common.kappa));
        let error = CommonKappa::fit(&problems[..1]).unwrap_err();
        assert_eq!(error, FitError::NoCommonKappa);
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
}
