//! Fit of the contact evolution law by weighted least squares.
//!
//! The fit parameters are ln β and ln μ (and ln κ if κ is free), which keeps β, μ and κ positive.
//! The weight of a datum is the inverse variance of its mean over the realizations. If the variance
//! is unknown, weights are equal. Replicates of a bootstrap use the weights of the whole sample.
//! Areas of one surface are correlated from load to load. The reduced χ² can therefore compare fits
//! of the same data, but is not a test of the law. Confidence intervals are computed by resampling
//! surfaces. If κ, β and μ are all free, they are strongly correlated.

use super::bootstrap::{Bootstrap, Estimate, Intervals};
use super::curves::Data;
use super::least_squares::{Quality, Residuals, minimize};
use super::{Curves, FitError, Window};
use asperity_mechanics::theory::law::ContactEvolution;

/// Initial values (β, μ) of the fit. They are tried in order until the fit from one of them
/// succeeds.
const STARTS: [(f64, f64); 4] = [(1.0, 0.7), (0.2, 0.25), (3.0, 1.4), (1.0, 2.5)];
/// Range of accepted fitted exponents μ. Outside, the law has a kink or is nearly a logarithm.
const EXPONENTS: std::ops::RangeInclusive<f64> = 1e-3..=1e1;
/// Minimum of 1 − d ln a/d ln y at the heaviest load. A law with a smaller value is a straight
/// line.
const LEAST_DEVIATION: f64 = 1e-6;
/// Tolerance of the convexity condition μ ≤ 1. With [`Kappa::LeastConvex`], μ equals one only to
/// the accuracy of the root search for κ.
const CONVEX_TOLERANCE: f64 = 1e-6;

/// Quantity to which the contact evolution law is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Area fractions under the loads.
    Area,
    /// Difference quotients of the area between neighbouring loads, at their midpoints.
    ///
    /// The quotients differ from derivatives to second order in the load step. In the first
    /// interval the difference is larger, because the second derivative of a law with μ < 1
    /// diverges at zero load. A fit of the areas has no such error.
    Slope,
}

/// Treatment of κ in a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kappa {
    /// Given value of κ, which is not fitted.
    Given(f64),
    /// Free κ, fitted together with β and μ.
    Free,
    /// Least κ for which the fitted slope is convex (μ = 1), a lower bound of κ.
    LeastConvex,
}

/// Fitted contact evolution law with its goodness of fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvolutionFit {
    /// Contact evolution law with the fitted parameters.
    pub law: ContactEvolution,
    /// Root mean square residual of the fitted quantity (area or slope), without weights.
    pub rms_residual: f64,
    /// χ² divided by the degrees of freedom. `None` if the variances are unknown or there are no
    /// degrees of freedom.
    pub reduced_chi_square: Option<f64>,
    /// Weighted coefficient of determination R²; `None` if all data are equal.
    pub r_squared: Option<f64>,
    /// Number of data in the fit.
    pub data: usize,
    /// `true` if the slope da/dy of the law is convex at all loads: μ ≤ 1.
    pub convex: bool,
}

/// Data of one parameter point to which a contact evolution law is fitted.
///
/// ```
/// use asperity_mechanics::theory::law::{ContactEvolution, KAPPA_BGT};
/// use asperity_statistics::evolution::{EvolutionProblem, Kappa, Quantity};
/// use asperity_statistics::{Curves, FitError, Window};
///
/// // The fit to a surface that obeys a law recovers the parameters.
/// let law = ContactEvolution { kappa: KAPPA_BGT, beta: 1.2, mu: 0.6 };
/// let loads: Vec<f64> = (1..=20).map(|step| 0.01 * f64::from(step)).collect();
/// let areas = loads.iter().map(|load| law.area(*load)).collect();
/// let curves = Curves::new(loads, vec![areas])?;
/// let problem = EvolutionProblem::new(&curves, Quantity::Area, Window::ALL)?;
/// let found = problem.fit(Kappa::Given(KAPPA_BGT))?.law;
/// assert!((found.beta - 1.2).abs() < 1e-6 && (found.mu - 0.6).abs() < 1e-6);
/// # Ok::<(), FitError>(())
/// ```
#[derive(Debug, Clone)]
pub struct EvolutionProblem {
    quantity: Quantity,
    pub(super) data: Data,
    pub(super) mean: Vec<f64>,
    weights: Option<Vec<f64>>,
    /// Square root of the weight of each datum, relative to the largest one.
    scales: Vec<f64>,
}

impl EvolutionProblem {
    /// Creates a problem from `quantity` at the loads inside a window.
    ///
    /// # Errors
    /// Fails if there are fewer than four data, one more than the parameters.
    pub fn new(curves: &Curves, quantity: Quantity, window: Window) -> Result<Self, FitError> {
        let data = match quantity {
            Quantity::Area => curves.area_data(window),
            Quantity::Slope => curves.slope_data(window),
        };
        let (found, needed) = (data.loads.len(), 4);
        if found < needed {
            return Err(FitError::TooFew { window, found, needed });
        }
        let weights = data.weights();
        let scales = match &weights {
            None => vec![1.0; found],
            Some(weights) => {
                let largest = weights.iter().copied().fold(0.0, f64::max);
                weights.iter().map(|weight| (weight / largest).sqrt()).collect()
            }
        };
        Ok(Self { quantity, mean: data.mean(), weights, scales, data })
    }

    /// Fits the law to the mean over the realizations.
    ///
    /// # Errors
    /// Fails if a given κ is not positive, if the iteration does not converge, if the parameters
    /// diverge, or if no κ makes the slope convex.
    pub fn fit(&self, kappa: Kappa) -> Result<EvolutionFit, FitError> {
        let law = self.fit_mean(&self.mean, kappa, None)?;
        let predicted: Vec<f64> = self.data.loads.iter().map(|&y| self.predict(&law, y)).collect();
        let quality = Quality::new(&self.mean, &predicted, self.weights.as_deref());
        let parameters = if matches!(kappa, Kappa::Given(_)) { 2 } else { 3 };
        let freedom = self.mean.len() - parameters;
        Ok(EvolutionFit {
            law,
            rms_residual: quality.rms_residual,
            reduced_chi_square: (self.weights.is_some() && freedom > 0)
                .then(|| quality.chi_square / freedom as f64),
            r_squared: quality.r_squared,
            data: self.mean.len(),
            convex: law.mu <= 1.0 + CONVEX_TOLERANCE,
        })
    }

    /// Computes confidence intervals of κ, β and μ, in this order, by resampling surfaces. `fit` is
    /// the fit to all surfaces.
    pub fn bootstrap(&self, kappa: Kappa, fit: &EvolutionFit, bootstrap: &Bootstrap) -> Intervals {
        let ContactEvolution { kappa: fitted, beta, mu } = fit.law;
        let estimates = [fitted, beta, mu].map(Estimate::Positive);
        bootstrap.intervals(self.data.surfaces(), &estimates, |multiplicities| {
            let mean = self.data.resampled_mean(multiplicities);
            let law = self.fit_mean(&mean, kappa, Some(fit.law))?;
            Ok(vec![law.kappa, law.beta, law.mu])
        })
    }

    /// Fits the law to the mean curve `mean`. The iteration starts from `near`, if it is given.
    fn fit_mean(
        &self,
        mean: &[f64],
        kappa: Kappa,
        near: Option<ContactEvolution>,
    ) -> Result<ContactEvolution, FitError> {
        match kappa {
            Kappa::Given(kappa) => self.fit_given(mean, kappa, near),
            Kappa::Free => self.fit_free(mean, near),
            Kappa::LeastConvex => {
                let kappa = self.least_convex_kappa(mean, near.map(|law| law.kappa))?;
                self.fit_given(mean, kappa, near)
            }
        }
    }

    fn fit_given(
        &self,
        mean: &[f64],
        kappa: f64,
        near: Option<ContactEvolution>,
    ) -> Result<ContactEvolution, FitError> {
        if !(kappa > 0.0 && kappa.is_finite()) {
            return Err(FitError::Kappa { kappa });
        }
        let model = self.model(mean, kappa);
        self.first_minimum(kappa, near, |start| {
            let found = minimize(&model, [libm::log(start.beta), libm::log(start.mu)]);
            (model.law(found.parameters), found.converged)
        })
    }

    fn fit_free(
        &self,
        mean: &[f64],
        near: Option<ContactEvolution>,
    ) -> Result<ContactEvolution, FitError> {
        // The slope of the law decreases from κ, so that κ is larger than the mean slope.
        let kappa = 1.2 * self.proportionality(mean).abs().max(f64::MIN_POSITIVE);
        let model = self.model(mean, kappa);
        self.first_minimum(kappa, near, |start| {
            let found = minimize(
                &model,
                [libm::log(start.beta), libm::log(start.mu), libm::log(start.kappa)],
            );
            (model.law(found.parameters), found.converged)
        })
    }

    /// Minimises the sum of squares from one start after another, until a minimum with a curved law
    /// is found.
    ///
    /// The starts are `near`, if it is given, and then [`STARTS`] with κ = `kappa`. `search`
    /// returns the law at the end of an iteration and whether it converged.
    fn first_minimum(
        &self,
        kappa: f64,
        near: Option<ContactEvolution>,
        search: impl Fn(ContactEvolution) -> (ContactEvolution, bool),
    ) -> Result<ContactEvolution, FitError> {
        let starts = STARTS.iter().map(|&(beta, mu)| ContactEvolution { kappa, beta, mu });
        let mut some_curved = false;
        let mut diverged = None;
        for start in near.into_iter().chain(starts) {
            let (law, converged) = search(start);
            match (self.is_curved(&law), converged) {
                (true, true) => return Ok(law),
                (true, false) => some_curved = true,
                (false, _) => diverged = Some(law),
            }
        }
        Err(match diverged {
            Some(ContactEvolution { kappa, beta, mu }) if !some_curved => {
                FitError::Runaway { kappa, beta, mu }
            }
            _ => FitError::NotConverged,
        })
    }

    fn is_curved(&self, law: &ContactEvolution) -> bool {
        let heaviest = self.data.loads.last().copied().unwrap_or(0.0);
        // This is 1 − d ln a/d ln y.
        let deviation = law.beta * libm::pow(law.area(heaviest), law.mu);
        law.kappa.is_finite() && EXPONENTS.contains(&law.mu) && deviation > LEAST_DEVIATION
    }

    /// Returns the slope of the straight line a ∝ y that fits the mean curve `mean` best.
    pub(super) fn proportionality(&self, mean: &[f64]) -> f64 {
        let (mut shared, mut spread) = (0.0, 0.0);
        for ((&load, value), scale) in self.data.loads.iter().zip(mean).zip(&self.scales) {
            let line = match self.quantity {
                Quantity::Area => load,
                Quantity::Slope => 1.0,
            };
            shared += scale * scale * line * value;
            spread += scale * scale * line * line;
        }
        shared / spread
    }

    /// Returns the slope of the area for the datum `value` at a load. If the data are areas, it is
    /// the secant a/y.
    pub(super) fn slope_of(&self, load: f64, value: f64) -> f64 {
        match self.quantity {
            Quantity::Area => value / load,
            Quantity::Slope => value,
        }
    }

    /// Returns the residuals of the mean curve `mean` from a law with `P` free parameters.
    ///
    /// Parameters that are not free have the values κ = `kappa`, β = 1 and μ = 1.
    pub(super) fn model<'a, const P: usize>(&'a self, mean: &'a [f64], kappa: f64) -> Model<'a, P> {
        Model { problem: self, mean, fixed: ContactEvolution { kappa, beta: 1.0, mu: 1.0 } }
    }

    fn predict(&self, law: &ContactEvolution, load: f64) -> f64 {
        match self.quantity {
            Quantity::Area => law.area(load),
            Quantity::Slope => law.slope(load),
        }
    }
}

/// Residuals of a mean curve from a contact evolution law with `P` free parameters.
///
/// The free parameters are the first `P` of ln β, ln μ and ln κ; the others are `fixed`.
pub(super) struct Model<'a, const P: usize> {
    problem: &'a EvolutionProblem,
    mean: &'a [f64],
    /// Values of the parameters that are not free.
    fixed: ContactEvolution,
}

impl<const P: usize> Model<'_, P> {
    /// Returns the law with the given free parameters: the first `P` of ln β, ln μ and ln κ.
    pub(super) fn law(&self, logarithms: [f64; P]) -> ContactEvolution {
        let parameter =
            |index: usize, fixed: f64| logarithms.get(index).map_or(fixed, |ln| libm::exp(*ln));
        ContactEvolution {
            kappa: parameter(2, self.fixed.kappa),
            beta: parameter(0, self.fixed.beta),
            mu: parameter(1, self.fixed.mu),
        }
    }

    /// Returns the derivatives of the residual of datum `datum` with respect to ln β, ln μ and ln
    /// κ.
    // Inlined so that derivatives with respect to fixed parameters are not computed.
    #[inline(always)]
    pub(super) fn gradient(&self, law: &ContactEvolution, datum: usize) -> [f64; 3] {
        let load = self.problem.data.loads[datum];
        let gradient = match self.problem.quantity {
            Quantity::Area => law.area_gradient(load),
            Quantity::Slope => law.slope_gradient(load),
        };
        gradient.map(|derivative| self.problem.scales[datum] * derivative)
    }
}

impl<const P: usize> Residuals<P> for Model<'_, P> {
    fn count(&self) -> usize {
        self.mean.len()
    }

    fn residuals(&self, parameters: [f64; P], into: &mut [f64]) {
        let law = self.law(parameters);
        let EvolutionProblem { data, scales, .. } = self.problem;
        for (i, residual) in into.iter_mut().enumerate() {
            *residual = scales[i] * (self.problem.predict(&law, data.loads[i]) - self.mean[i]);
        }
    }

    fn gradients(&self, parameters: [f64; P], into: &mut [[f64; P]]) {
        let law = self.law(parameters);
        for (datum, gradient) in into.iter_mut().enumerate() {
            let all = self.gradient(&law, datum);
            *gradient = std::array::from_fn(|parameter| all[parameter]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::curves::{
        BGT_ALPHA_2, BGT_ALPHA_10, persson_curve, scattered, single, uniform,
    };
    use asperity_mechanics::theory::law::{KAPPA_BGT, KAPPA_PERSSON};

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
        // κ, β and μ have correlations of 0.999, which amplify rounding errors of the areas.
        assert!((fit.law.kappa / LAW.kappa - 1.0).abs() < 1e-6);
        assert!((fit.law.beta / LAW.beta - 1.0).abs() < 1e-6);
        assert!((fit.law.mu / LAW.mu - 1.0).abs() < 1e-6);
    }

    #[test]
    fn slopes_of_a_law_return_its_parameters_to_the_order_of_the_differences() {
        let error = |steps| {
            let fit =
                fit(&exact(LAW, uniform(0.06, steps)), Quantity::Slope, Kappa::Given(LAW.kappa));
            (fit.law.beta / LAW.beta - 1.0).abs() + (fit.law.mu / LAW.mu - 1.0).abs()
        };
        // The first interval has the largest error, because the curvature diverges there. Its
        // weight and its error decrease with the step.
        assert!(error(50) < 0.02, "{}", error(50));
        assert!(error(400) < 0.3 * error(50), "{} {}", error(50), error(400));
    }

    #[test]
    fn asperity_model_has_its_known_parameters() {
        let fit = fit(&single(&BGT_ALPHA_2), Quantity::Slope, Kappa::Given(KAPPA_BGT));
        // An independent implementation gives 0.535 and 0.617.
        assert!(
            (fit.law.beta - 0.535).abs() < 1e-3 && (fit.law.mu - 0.617).abs() < 1e-3,
            "{fit:?}"
        );
        let fit = self::fit(&single(&BGT_ALPHA_10), Quantity::Slope, Kappa::Given(KAPPA_BGT));
        assert!(
            (fit.law.beta - 0.150).abs() < 1e-3 && (fit.law.mu - 0.203).abs() < 1e-3,
            "{fit:?}"
        );
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
        // The error is √(2/48) for 48 degrees of freedom, plus 10 % due to the variances.
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
    fn window_with_too_few_loads_is_an_error() {
        let curves = exact(LAW, uniform(0.06, 5));
        let window = Window { from: 0.03, to: 0.06 };
        let error = EvolutionProblem::new(&curves, Quantity::Area, window).unwrap_err();
        assert_eq!(error, FitError::TooFew { window, found: 3, needed: 4 });
        assert_eq!(
            error.to_string(),
            "3 usable data with loads in [0.03, 0.06], but the fit needs 4: widen the window or \
             compute more loads inside it"
        );
    }

    #[test]
    fn kappa_below_the_slope_of_the_data_diverges() {
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
}
