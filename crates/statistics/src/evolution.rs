//! The contact evolution law by weighted least squares.
//!
//! Parameters are ln β and ln μ (and ln κ where it is free), so that all stay positive. A datum
//! weighs as the inverse variance of its mean over the realizations, or all weigh the same where
//! that is unknown. Weights are part of the design: replicates of a bootstrap keep them. Areas of
//! one surface are correlated from load to load, so the reduced χ² compares fits of one data set
//! and is no test of the law; intervals come from resampled surfaces. κ, β and μ are strongly
//! correlated when all are free.

use super::bootstrap::{Bootstrap, Estimate, Intervals};
use super::curves::Data;
use super::least_squares::{Quality, minimize};
use super::{Curves, FitError, Window};
use asperity_contact::theory::law::ContactEvolution;

pub(super) mod residuals;

use residuals::{FreeKappa, GivenKappa, Model};

/// Starts (β, μ) of the search, tried until one converges.
const STARTS: [(f64, f64); 4] = [(1.0, 0.7), (0.2, 0.25), (3.0, 1.4), (1.0, 2.5)];
/// Exponents outside these describe a kink or a logarithm, not data.
const EXPONENTS: std::ops::RangeInclusive<f64> = 1e-3..=1e1;
/// A law that loses less than this share of the area's growth at the heaviest load is a
/// straight line, whatever its β and μ.
const LEAST_BEND: f64 = 1e-6;
/// μ at the least convex κ is one to within the tolerance of the root.
const CONVEX_TOLERANCE: f64 = 1e-6;

/// What is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Area fractions under the loads.
    Area,
    /// Difference quotients of the area at the midpoints of the loads. That they are not quite
    /// derivatives is an error of second order in the step, except in the first interval where
    /// the curvature of a law with μ < 1 diverges; areas have no such error.
    Slope,
}

/// How κ is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kappa {
    /// Kept at a value.
    Given(f64),
    /// Fitted with β and μ.
    Free,
    /// The least one for which the fitted slope is convex, μ = 1: a lower bound.
    LeastConvex,
}

/// A contact evolution law and how well it describes its data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvolutionFit {
    /// The law.
    pub law: ContactEvolution,
    /// Root mean square residual of the area or of its slope.
    pub rms_residual: f64,
    /// χ² per degree of freedom; `None` without variances or degrees of freedom.
    pub reduced_chi_square: Option<f64>,
    /// Weighted coefficient of determination; `None` where the data do not differ.
    pub r_squared: Option<f64>,
    /// Number of data.
    pub data: usize,
    /// Whether the slope of the law is convex at all loads, μ ≤ 1.
    pub convex: bool,
}

/// Data of one parameter point, ready to be fitted.
///
/// ```
/// use asperity_contact::theory::law::{ContactEvolution, KAPPA_BGT};
/// use asperity_statistics::evolution::{EvolutionProblem, Kappa, Quantity};
/// use asperity_statistics::{Curves, FitError, Window};
///
/// // One surface that obeys a law, whose parameters are found again.
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
    pub(super) quantity: Quantity,
    pub(super) data: Data,
    pub(super) mean: Vec<f64>,
    weights: Option<Vec<f64>>,
    /// Roots of the weights over their largest.
    pub(super) scales: Vec<f64>,
}

impl EvolutionProblem {
    /// Takes the data with loads inside a window.
    ///
    /// # Errors
    /// With fewer than four data: one more than the parameters.
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

    /// Fits the mean over the realizations.
    ///
    /// # Errors
    /// If κ is not positive, the search does not converge, the parameters run away, or no κ makes
    /// the slope convex.
    pub fn fit(&self, kappa: Kappa) -> Result<EvolutionFit, FitError> {
        let law = self.fit_mean(&self.mean, kappa, None)?;
        let predicted: Vec<f64> = self.data.loads.iter().map(|&y| self.predict(&law, y)).collect();
        let quality = Quality::of(&self.mean, &predicted, self.weights.as_deref());
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

    /// Intervals of κ, β and μ, in this order, about a fit of the whole sample.
    pub fn bootstrap(&self, kappa: Kappa, fit: &EvolutionFit, bootstrap: &Bootstrap) -> Intervals {
        let ContactEvolution { kappa: of, beta, mu } = fit.law;
        let estimates = [of, beta, mu].map(Estimate::Positive);
        bootstrap.intervals(self.data.surfaces(), &estimates, |multiplicities| {
            let mean = self.data.resampled_mean(multiplicities);
            let law = self.fit_mean(&mean, kappa, Some(fit.law))?;
            Ok(vec![law.kappa, law.beta, law.mu])
        })
    }

    /// Fits any values of the data, from a start near the answer where one is known.
    pub(super) fn fit_mean(
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
        let model = GivenKappa(Model { problem: self, mean }, kappa);
        self.first_minimum(kappa, near, |start| {
            let found = minimize(&model, [start.beta.ln(), start.mu.ln()]);
            (model.law(found.parameters), found.converged)
        })
    }

    fn fit_free(
        &self,
        mean: &[f64],
        near: Option<ContactEvolution>,
    ) -> Result<ContactEvolution, FitError> {
        let model = FreeKappa(Model { problem: self, mean });
        // The law only bends down from κ, so its proportionality is above that of the data.
        let kappa = 1.2 * self.proportionality(mean).abs().max(f64::MIN_POSITIVE);
        self.first_minimum(kappa, near, |start| {
            let found = minimize(&model, [start.beta.ln(), start.mu.ln(), start.kappa.ln()]);
            (FreeKappa::law(found.parameters), found.converged)
        })
    }

    /// The first search that converges to a law that bends.
    fn first_minimum(
        &self,
        kappa: f64,
        near: Option<ContactEvolution>,
        search: impl Fn(ContactEvolution) -> (ContactEvolution, bool),
    ) -> Result<ContactEvolution, FitError> {
        let starts = STARTS.iter().map(|&(beta, mu)| ContactEvolution { kappa, beta, mu });
        let mut some_bend = false;
        let mut stray = None;
        for start in near.into_iter().chain(starts) {
            let (law, converged) = search(start);
            match (self.bends(&law), converged) {
                (true, true) => return Ok(law),
                (true, false) => some_bend = true,
                (false, _) => stray = Some(law),
            }
        }
        Err(match stray {
            Some(ContactEvolution { kappa, beta, mu }) if !some_bend => {
                FitError::Runaway { kappa, beta, mu }
            }
            _ => FitError::NotConverged,
        })
    }

    fn bends(&self, law: &ContactEvolution) -> bool {
        let heaviest = self.data.loads.last().copied().unwrap_or(0.0);
        // The share of the growth that is lost is 1 − d ln a/d ln y = βa^μ.
        let lost = law.beta * law.area(heaviest).powf(law.mu);
        law.kappa.is_finite() && EXPONENTS.contains(&law.mu) && lost > LEAST_BEND
    }

    /// The factor of the best straight line a ∝ y.
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

    /// The slope of the area that a datum speaks of: its own, or that of its secant.
    pub(super) fn slope_of(&self, load: f64, value: f64) -> f64 {
        match self.quantity {
            Quantity::Area => value / load,
            Quantity::Slope => value,
        }
    }

    fn predict(&self, law: &ContactEvolution, load: f64) -> f64 {
        match self.quantity {
            Quantity::Area => law.area(load),
            Quantity::Slope => law.slope(load),
        }
    }
}

#[cfg(test)]
mod tests;
