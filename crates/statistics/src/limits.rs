//! Limit of an observable as several small parameters vanish: Q = Q₀ + Σ cⱼ fⱼ(xⱼ).
//!
//! An observable of rough contact on a mesh depends on three small parameters: the longest
//! wavelength divided by the cell, the shortest wavelength divided by the longest, and the mesh
//! step divided by the shortest wavelength. As in Prodanov, Dapp & Müser, Tribol. Lett. 53, 433
//! (2014), all three are extrapolated to zero simultaneously, by weighted least squares over many
//! spectra and meshes.
//!
//! If a term is a logarithm, the observable has no limit with respect to that parameter, and Q₀ is
//! its value at xⱼ = 1. Three numbers compare powers with logarithms: χ², Akaike's criterion, and
//! the leave-one-out prediction error.
//!
//! Weights are inverse variances of the means over surfaces. They are computed from a power law of
//! the small parameters that is fitted to the variances of all points (module `scatter`). With the
//! variance of each point instead, points whose few surfaces happen to agree would dominate. Then
//! intervals of nominally 95 % cover 87 % with four surfaces and 91 % with ten. All spectra of a
//! study share realizations, so that the deviations of their points are correlated, which reduces
//! χ². Confidence intervals are computed by resampling whole surfaces, the same surfaces at all
//! points, and are valid for any weights.

use super::FitError;
use super::bootstrap::{Bootstrap, Estimate, Intervals, Resample};
use super::random::Normals;
use scatter::Scatter;

mod scatter;
mod search;

/// Minimum and maximum of a free exponent.
///
/// x^0.02 is indistinguishable from a logarithm, and x^20 from zero.
pub const EXPONENTS: [f64; 2] = [0.02, 20.0];

/// Form f(x) of a term c f(x) as a function of its small parameter x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TermForm {
    /// Power f(x) = xᵉ with a given positive exponent e.
    Power(f64),
    /// Power f(x) = xᵉ with a fitted exponent e.
    FreePower,
    /// Logarithm f(x) = ln x.
    Logarithm,
}

/// Small parameters and observable of one spectrum on one mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitPoint {
    /// Small parameters xⱼ, one positive value for each term.
    pub small: Vec<f64>,
    /// Observable Q at these small parameters.
    pub observed: Observed,
}

/// Observable Q of a point: its values on several surfaces, or an estimate with a standard error.
#[derive(Debug, Clone, PartialEq)]
pub enum Observed {
    /// Values of the observable on each surface.
    Surfaces {
        /// Numbers of the surfaces, in ascending order. A surface has the same number at all
        /// points.
        units: Vec<usize>,
        /// Value of the observable for each surface.
        values: Vec<f64>,
    },
    /// Estimate that is statistically independent of the other points.
    Estimate {
        /// Estimated value of the observable.
        value: f64,
        /// Standard error of the value.
        standard_error: f64,
        /// Number of surfaces from which the value is estimated.
        surfaces: usize,
    },
}

impl Observed {
    /// Creates an observable from the values of the surfaces 0, 1, 2, …
    pub fn from_realizations(values: Vec<f64>) -> Observed {
        Observed::Surfaces { units: (0..values.len()).collect(), values }
    }

    /// Returns the mean over the surfaces, or the estimated value.
    pub fn mean(&self) -> f64 {
        match self {
            Observed::Surfaces { values, .. } => values.iter().sum::<f64>() / values.len() as f64,
            Observed::Estimate { value, .. } => *value,
        }
    }

    /// Returns the standard error of [`mean`](Self::mean).
    pub fn standard_error(&self) -> f64 {
        match self {
            Observed::Surfaces { values, .. } => {
                let (mean, count) = (self.mean(), values.len() as f64);
                let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
                (squares / (count - 1.0) / count).sqrt()
            }
            Observed::Estimate { standard_error, .. } => *standard_error,
        }
    }

    /// Returns the number of surfaces of the point.
    pub fn surfaces(&self) -> usize {
        match self {
            Observed::Surfaces { values, .. } => values.len(),
            Observed::Estimate { surfaces, .. } => *surfaces,
        }
    }
}

/// Points (spectra on meshes) to which laws of their small parameters are fitted.
#[derive(Debug, Clone)]
pub struct LimitProblem {
    points: Vec<LimitPoint>,
    scatter: Scatter,
    /// Inverse standard error of the mean of each point, from the fitted power law of the scatter.
    scales: Vec<f64>,
}

/// Fitted law Q = Q₀ + Σ cⱼ fⱼ(xⱼ).
#[derive(Debug, Clone, PartialEq)]
pub struct LimitFit {
    /// Limit Q₀: the observable where all powers are zero and the arguments of all logarithms are
    /// one.
    pub limit: f64,
    /// Coefficient cⱼ of each term.
    pub coefficients: Vec<f64>,
    /// Exponent eⱼ of each term, or `None` for a logarithm.
    pub exponents: Vec<Option<f64>>,
    /// χ²: sum of the squared residuals, each divided by the variance of the mean of its point.
    pub chi_square: f64,
    /// Number of fitted parameters: the limit, the coefficients and the free exponents.
    pub free: usize,
}

/// Goodness of fit of a law, for the comparison of laws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assessment {
    /// Root mean square residual without weights, in the unit of the observable.
    pub rms_residual: f64,
    /// χ² divided by the degrees of freedom.
    pub reduced_chi_square: f64,
    /// Akaike's information criterion, χ² + 2 × the number of free parameters.
    pub akaike: f64,
    /// Leave-one-out error, in the unit of the observable: weighted rms error of the prediction of
    /// each point by a fit to all other points.
    ///
    /// `None` if one of these fits fails.
    pub leave_one_out: Option<f64>,
}

/// Confidence intervals of several laws and their comparison, from resampled surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct Resampled {
    /// Confidence intervals of the parameters of each law.
    ///
    /// The order of the parameters is: limit, coefficients, free exponents.
    pub intervals: Vec<Intervals>,
    /// Comparison of each law with the other laws.
    pub comparison: Vec<Comparison>,
}

/// Comparison of one law with all laws that were fitted to the same points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// Akaike weight: exp(−Δ/2), divided by its sum over all laws.
    ///
    /// Δ is Akaike's criterion of this law minus the minimum over all laws.
    pub akaike_weight: f64,
    /// Fraction of the replicates in which Akaike's criterion of this law is the smallest.
    ///
    /// `None` without replicates.
    pub best_fraction: Option<f64>,
}

impl LimitProblem {
    /// Creates a problem from points with one small parameter for each term.
    ///
    /// # Errors
    /// Fails if a small parameter is not positive and finite, or if the values at a point are equal
    /// for all surfaces.
    pub fn new(points: Vec<LimitPoint>) -> Result<LimitProblem, FitError> {
        for point in &points {
            if !point.small.iter().all(|value| *value > 0.0 && value.is_finite()) {
                return Err(FitError::NotSmall);
            }
            let error = point.observed.standard_error();
            if point.observed.surfaces() < 2 || !(error > 0.0 && error.is_finite()) {
                return Err(FitError::NoScatter);
            }
        }
        let scatter = Scatter::new(&points);
        let scale = |point: &LimitPoint| {
            1.0 / scatter.standard_error(&point.small, point.observed.surfaces())
        };
        let scales = points.iter().map(scale).collect();
        Ok(LimitProblem { points, scatter, scales })
    }

    /// Returns the number of points.
    pub fn points(&self) -> usize {
        self.points.len()
    }

    /// Returns the smallest number of surfaces over all points.
    pub fn surfaces(&self) -> usize {
        let counts = self.points.iter().map(|point| point.observed.surfaces());
        counts.min().unwrap_or(0)
    }

    /// Fits the law Q = Q₀ + Σ cⱼ fⱼ(xⱼ) with the given forms fⱼ by weighted least squares.
    ///
    /// # Errors
    /// Fails if there are not more points than parameters, if the terms are linearly dependent, or
    /// if a free exponent leaves the range [`EXPONENTS`].
    pub fn fit(&self, forms: &[TermForm]) -> Result<LimitFit, FitError> {
        self.fit_to(forms, &self.means(), &vec![true; self.points.len()], None)
    }

    /// Computes the goodness of a fitted law.
    pub fn assess(&self, forms: &[TermForm], fit: &LimitFit) -> Assessment {
        let means = self.means();
        let count = self.points.len();
        let squares = (0..count).map(|i| (means[i] - self.predicted(fit, i)).powi(2));
        let freedom = (count - fit.free) as f64;
        Assessment {
            rms_residual: (squares.sum::<f64>() / count as f64).sqrt(),
            reduced_chi_square: fit.chi_square / freedom,
            akaike: fit.akaike(),
            leave_one_out: self.leave_one_out(forms, fit, &means),
        }
    }

    /// Computes confidence intervals for several laws (`rivals`), and compares the laws.
    ///
    /// Replicates draw whole surfaces. A surface has the same multiplicity at all its points and
    /// for all laws.
    pub fn resample(
        &self,
        rivals: &[(&[TermForm], &LimitFit)],
        bootstrap: &Bootstrap,
    ) -> Resampled {
        let units = self.points.iter().filter_map(|point| match &point.observed {
            Observed::Surfaces { units, .. } => Some(&units[..]),
            Observed::Estimate { .. } => None,
        });
        let resample = Resample { fewest: self.surfaces(), ..Resample::from_ensembles(units) };
        // Akaike's criterion, indexed by law and replicate.
        let mut criteria: Vec<Vec<f64>> = Vec::new();
        let intervals = rivals.iter().map(|(forms, fit)| {
            let mut own = Vec::with_capacity(bootstrap.replicates);
            let fits = bootstrap.intervals_of_ensembles(
                resample,
                &estimates(forms, fit),
                |replicate, times| {
                    let (means, used) = resampled_means(self, times, replicate, bootstrap.seed);
                    let refit = self.fit_to(forms, &means, &used, Some(fit));
                    own.push(refit.as_ref().map_or(f64::INFINITY, LimitFit::akaike));
                    refit.map(|refit| parameters(forms, &refit))
                },
            );
            criteria.push(own);
            fits
        });
        Resampled { intervals: intervals.collect(), comparison: compare(rivals, &criteria) }
    }

    fn means(&self) -> Vec<f64> {
        let means = self.points.iter().map(|point| point.observed.mean());
        means.collect()
    }

    /// Fits the law to the points selected by `used`, with the mean of point i in `means[i]`.
    ///
    /// The iteration starts from the exponents of `start`, if it is given.
    fn fit_to(
        &self,
        forms: &[TermForm],
        means: &[f64],
        used: &[bool],
        start: Option<&LimitFit>,
    ) -> Result<LimitFit, FitError> {
        let found = used.iter().filter(|used| **used).count();
        let is_free = |form: &&TermForm| **form == TermForm::FreePower;
        let free = 1 + forms.len() + forms.iter().filter(is_free).count();
        if found <= free {
            return Err(FitError::TooFewPoints);
        }
        search::fit(self, forms, means, used, start, free)
    }

    fn leave_one_out(&self, forms: &[TermForm], fit: &LimitFit, means: &[f64]) -> Option<f64> {
        let (mut squares, mut weights) = (0.0, 0.0);
        let mut used = vec![true; self.points.len()];
        for (i, mean) in means.iter().enumerate() {
            used[i] = false;
            let others = self.fit_to(forms, means, &used, Some(fit)).ok()?;
            used[i] = true;
            let weight = self.scales[i].powi(2);
            squares += weight * (mean - self.predicted(&others, i)).powi(2);
            weights += weight;
        }
        Some((squares / weights).sqrt())
    }

    /// Returns the observable that a fitted law predicts at the point with index `point`.
    fn predicted(&self, fit: &LimitFit, point: usize) -> f64 {
        let small = &self.points[point].small;
        let values = fit.exponents.iter().zip(small).map(|(exponent, &small)| match exponent {
            Some(exponent) => libm::pow(small, *exponent),
            None => libm::log(small),
        });
        let terms = fit.coefficients.iter().zip(values).map(|(factor, value)| factor * value);
        fit.limit + terms.sum::<f64>()
    }
}

impl LimitFit {
    /// Returns Akaike's information criterion, χ² + 2 × the number of free parameters.
    pub fn akaike(&self) -> f64 {
        self.chi_square + 2.0 * self.free as f64
    }
}

fn compare(rivals: &[(&[TermForm], &LimitFit)], criteria: &[Vec<f64>]) -> Vec<Comparison> {
    let akaike: Vec<f64> = rivals.iter().map(|(_, fit)| fit.akaike()).collect();
    let least = akaike.iter().copied().fold(f64::INFINITY, f64::min);
    let likelihoods: Vec<f64> = akaike.iter().map(|one| libm::exp(0.5 * (least - one))).collect();
    let total: f64 = likelihoods.iter().sum();
    let replicates = criteria.first().map_or(0, Vec::len);
    let best = |replicate: usize| {
        let value = |rival: &usize| criteria[*rival][replicate];
        let best = (0..rivals.len()).min_by(|one, other| value(one).total_cmp(&value(other)));
        best.filter(|best| value(best).is_finite())
    };
    let mut wins = vec![0_usize; rivals.len()];
    for best in (0..replicates).filter_map(best) {
        wins[best] += 1;
    }
    let comparison = |rival: usize| Comparison {
        akaike_weight: likelihoods[rival] / total,
        best_fraction: (replicates > 0).then(|| wins[rival] as f64 / replicates as f64),
    };
    (0..rivals.len()).map(comparison).collect()
}

fn estimates(forms: &[TermForm], fit: &LimitFit) -> Vec<Estimate> {
    let linear = 1 + forms.len();
    let values = parameters(forms, fit).into_iter().enumerate();
    let estimate = |(index, value)| {
        if index < linear { Estimate::Real(value) } else { Estimate::Positive(value) }
    };
    values.map(estimate).collect()
}

/// Returns the limit, the coefficients and the free exponents of a law, in this order.
fn parameters(forms: &[TermForm], fit: &LimitFit) -> Vec<f64> {
    let terms = forms.iter().zip(&fit.exponents);
    let free =
        terms.filter_map(|(form, exponent)| exponent.filter(|_| *form == TermForm::FreePower));
    let linear = [fit.limit].into_iter().chain(fit.coefficients.iter().copied());
    linear.chain(free).collect()
}

/// Returns the mean of each point in a replicate, and whether the replicate contains the point.
///
/// Surface i is drawn `times[i]` times. A point is missing if no surface of the point is drawn.
fn resampled_means(
    problem: &LimitProblem,
    times: &[u32],
    replicate: usize,
    seed: u64,
) -> (Vec<f64>, Vec<bool>) {
    // Estimates without surfaces are drawn from a normal distribution. The key makes the draws a
    // function of the seed and the replicate.
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(b"estimate");
    let mut normals = Normals::new(key, replicate as u64);
    let points = problem.points.iter().map(|point| match &point.observed {
        Observed::Surfaces { units, values } => {
            let times = units.iter().map(|&unit| f64::from(times[unit]));
            let drawn: f64 = times.clone().sum();
            let sum: f64 = values.iter().zip(times).map(|(value, times)| value * times).sum();
            if drawn > 0.0 { (sum / drawn, true) } else { (0.0, false) }
        }
        Observed::Estimate { value, standard_error, surfaces } => {
            // The means of replicates of n surfaces scatter by √((n − 1)/n) standard errors.
            let correction = ((surfaces - 1) as f64 / *surfaces as f64).sqrt();
            (value + correction * standard_error * normals.next(), true)
        }
    });
    points.unzip()
}

#[cfg(test)]
mod tests;
