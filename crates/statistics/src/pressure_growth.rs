//! Fit of the growth dp̄/dp₀ of the mean contact pressure as a power of the contact area.
//!
//! The contact evolution law assumes dp̄/dp₀ = β a^(μ−1) with the mean contact pressure p̄ = p₀/a.
//! This fit tests the assumption directly. For each pair of neighbouring loads, it computes the
//! difference quotient Δp̄/Δp₀ and the mean area. A line is fitted to the logarithms of both (fig.
//! dpdp0 of Yastrebov, Anciaux & Molinari 2015).

use super::bootstrap::{Bootstrap, Estimate, Intervals};
use super::curves::Data;
use super::least_squares::{Quality, line};
use super::{Curves, FitError, GoodnessOfFit, Window};

/// Minimum number of data, one more than the number of parameters.
const LEAST_DATA: usize = 3;

/// Power law dp̄/dp₀ = β a^(μ−1) fitted to the area fraction a.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureGrowth {
    /// Exponent of the area fraction a. It is μ − 1 for a contact evolution law.
    pub exponent: f64,
    /// Value of dp̄/dp₀ extrapolated to full contact. It is β for a contact evolution law.
    pub prefactor: f64,
    /// Goodness of fit of ln(dp̄/dp₀) in the intervals between loads.
    ///
    /// Intervals without contact, or in which the mean pressure does not grow, are masked.
    pub goodness: GoodnessOfFit,
}

/// Areas at the ends of intervals between neighbouring loads, to which the power law of dp̄/dp₀ is
/// fitted.
#[derive(Debug, Clone)]
pub struct PressureGrowthProblem {
    window: Window,
    /// Areas at the ends of the intervals, or `None` if the window contains no interval.
    ends: Option<Data>,
}

impl PressureGrowthProblem {
    /// Creates a problem from the intervals between neighbouring loads with midpoints inside a
    /// window.
    pub fn new(curves: &Curves, window: Window) -> Self {
        let mut inside =
            curves.loads().windows(2).filter(|pair| window.contains(0.5 * (pair[0] + pair[1])));
        let ends = inside.next().map(|first| {
            let last = inside.next_back().unwrap_or(first);
            curves.area_data(Window { from: first[0], to: last[1] })
        });
        Self { window, ends }
    }

    /// Fits the power law to the mean over the realizations.
    ///
    /// # Errors
    /// Fails if the mean pressure grows in fewer than three intervals, or if all areas are equal.
    pub fn fit(&self) -> Result<PressureGrowth, FitError> {
        self.fit_mean(|ends| ends.mean())
    }

    /// Computes confidence intervals of the exponent and the prefactor, in this order, by
    /// resampling surfaces.
    pub fn bootstrap(&self, fit: &PressureGrowth, bootstrap: &Bootstrap) -> Intervals {
        let surfaces = self.ends.as_ref().map_or(0, Data::surfaces);
        let estimates = [Estimate::Real(fit.exponent), Estimate::Positive(fit.prefactor)];
        bootstrap.intervals(surfaces, &estimates, |multiplicities| {
            let fit = self.fit_mean(|ends| ends.resampled_mean(multiplicities))?;
            Ok(vec![fit.exponent, fit.prefactor])
        })
    }

    fn fit_mean(&self, mean: impl Fn(&Data) -> Vec<f64>) -> Result<PressureGrowth, FitError> {
        let window = self.window;
        let points = self.ends.as_ref().map_or_else(Vec::new, |ends| growth(ends, &mean(ends)));
        let (ln_areas, ln_growths): (Vec<f64>, Vec<f64>) = points.iter().flatten().copied().unzip();
        let data = ln_areas.len();
        if data < LEAST_DATA {
            return Err(FitError::TooFew { window, found: data, needed: LEAST_DATA });
        }
        let (exponent, intercept) = line(&ln_areas, &ln_growths).ok_or(FitError::EqualAreas)?;
        let predicted: Vec<f64> = ln_areas.iter().map(|ln| intercept + exponent * ln).collect();
        let quality = Quality::new(&ln_growths, &predicted, None);
        Ok(PressureGrowth {
            exponent,
            prefactor: libm::exp(intercept),
            goodness: GoodnessOfFit::new(&quality, data, points.len()),
        })
    }
}

/// Returns ln a and ln(Δp̄/Δp₀) of each interval, with the mean a of `areas` at its ends. An
/// interval is `None` if a logarithm does not exist.
fn growth(ends: &Data, areas: &[f64]) -> Vec<Option<(f64, f64)>> {
    ends.loads
        .windows(2)
        .zip(areas.windows(2))
        .map(|(loads, areas)| {
            let pressure = |end: usize| loads[end] / areas[end];
            let growth = (pressure(1) - pressure(0)) / (loads[1] - loads[0]);
            let in_contact = areas[0] > 0.0 && areas[1] > 0.0;
            (in_contact && growth > 0.0)
                .then(|| (libm::log(0.5 * (areas[0] + areas[1])), libm::log(growth)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::curves::{BGT_ALPHA_2, BGT_ALPHA_10, scattered, single, uniform};
    use asperity_mechanics::theory::law::ContactEvolution;

    const LAW: ContactEvolution = ContactEvolution { kappa: 2.7, beta: 1.2, mu: 0.4 };

    const HEAVIER: Window = Window { from: 0.007, to: 0.06 };

    fn fit(curves: &Curves, window: Window) -> PressureGrowth {
        PressureGrowthProblem::new(curves, window).fit().expect("enough growth")
    }

    #[test]
    fn exponent_of_an_exact_law_is_mu_minus_one_and_the_prefactor_beta() {
        let error = |steps| {
            let curves = scattered(LAW, uniform(0.3, steps), 1, (0.0, 0.0), 0);
            let fit = fit(&curves, Window { from: 0.01, to: 0.3 });
            ((fit.exponent - (LAW.mu - 1.0)).abs(), (fit.prefactor - LAW.beta).abs())
        };
        let (coarse, fine) = (error(60), error(240));
        // The error of differences is of second order in the step.
        assert!(fine.0 < 1e-3 && fine.1 < 2e-3, "{fine:?}");
        assert!(fine.0 < coarse.0 / 8.0, "{coarse:?} {fine:?}");
    }

    #[test]
    fn asperity_models_grow_with_their_published_exponents() {
        let exponent = |areas| fit(&single(areas), HEAVIER).exponent;
        // An independent implementation gives −0.214 and −0.639 with the same intervals.
        assert!((exponent(&BGT_ALPHA_2) + 0.214).abs() < 1e-3);
        assert!((exponent(&BGT_ALPHA_10) + 0.639).abs() < 1e-3);
    }

    #[test]
    fn intervals_are_those_with_midpoints_in_the_window() {
        let fit = fit(&single(&BGT_ALPHA_2), HEAVIER);
        // The first interval is between the sixth and the seventh load, with the midpoint 0.0078.
        assert_eq!((fit.goodness.data, fit.goodness.masked), (44, 0));
    }

    #[test]
    fn intervals_over_which_the_mean_pressure_falls_are_masked() {
        let mut areas = BGT_ALPHA_2;
        areas[20] *= 1.1;
        let fit = fit(&single(&areas), Window::ALL);
        assert_eq!((fit.goodness.data, fit.goodness.masked), (48, 1));
    }

    #[test]
    fn constant_mean_pressure_has_no_growth() {
        let proportional: Vec<f64> = uniform(0.06, 50).iter().map(|_| 0.0).collect();
        let problem = PressureGrowthProblem::new(&single(&proportional), Window::ALL);
        assert!(matches!(problem.fit(), Err(FitError::TooFew { found: 0, needed: 3, .. })));
        let outside =
            PressureGrowthProblem::new(&single(&BGT_ALPHA_2), Window { from: 1.0, to: 2.0 });
        assert!(matches!(outside.fit(), Err(FitError::TooFew { found: 0, .. })));
    }

    #[test]
    fn interval_of_the_exponent_contains_it() {
        // Surfaces that only scale the load have equal exponents; noise makes them scatter.
        let problem = |factor, noise| {
            let window = Window { from: 0.02, to: 0.3 };
            let curves = scattered(LAW, uniform(0.3, 20), 20, (factor, noise), 5);
            PressureGrowthProblem::new(&curves, window)
        };
        let fit = problem(0.03, 0.002).fit().expect("enough growth");
        let bootstrap = Bootstrap { replicates: 200, seed: 1, level: 0.95 };
        let intervals = problem(0.03, 0.002).bootstrap(&fit, &bootstrap).intervals;
        let interval = intervals.expect("no failures")[0];
        let exact = problem(0.0, 0.0).fit().expect("enough growth").exponent;
        assert!(interval.lower <= exact && exact <= interval.upper);
    }
}
