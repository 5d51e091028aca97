//! What an observable tends to where several small numbers vanish: Q = Q₀ + Σ cⱼ fⱼ(xⱼ).
//!
//! An observable of rough contact computed on a mesh depends on three small numbers: the longest
//! wavelength over the cell, the shortest over the longest, and the mesh step over the shortest.
//! After Prodanov, Dapp & Müser, Tribol. Lett. 53, 433 (2014), all three are taken to zero at once,
//! by weighted least squares over many spectra and meshes. Where a term is a logarithm the
//! observable has no limit in that direction, and Q₀ is its value at xⱼ = 1; which of the two
//! describes the data better is told in numbers: χ², Akaike's criterion, and the error of
//! predicting a point that was left out.
//!
//! Weights are one over the variance of the mean over surfaces, as a power law of the small numbers
//! has it that is fitted to the variances of all points (`scatter`). Those of each point by itself
//! would be its own: points whose few surfaces happen to agree would decide, and intervals of 95 %
//! that take such weights as given cover 87 % with four surfaces and 91 % with ten. Points that
//! share realizations, as all spectra of a study do, deviate together, which lowers χ². Intervals
//! come from the surfaces, resampled whole and the same in all points, and are right whatever the
//! weights.

use super::FitError;
use super::bootstrap::{Bootstrap, Estimate, Intervals, Resample};
use super::random::Normals;
use scatter::Scatter;

mod scatter;
mod search;

/// Exponents that are searched for stay within these: x^0.02 cannot be told from a logarithm, and
/// x^20 from nothing.
pub const EXPONENTS: [f64; 2] = [0.02, 20.0];

/// What a term is of its small number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TermForm {
    /// c xᵉ with a given exponent, above zero.
    Power(f64),
    /// c xᵉ with the exponent free.
    FreePower,
    /// c ln x.
    Logarithm,
}

/// One spectrum on one mesh: where it is, and the observable there.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitPoint {
    /// The small numbers, one for each term; above zero.
    pub small: Vec<f64>,
    /// The observable.
    pub observed: Observed,
}

/// How an observable is known.
#[derive(Debug, Clone, PartialEq)]
pub enum Observed {
    /// One value for each surface.
    Surfaces {
        /// Numbers of the surfaces, ascending. A surface has the same number at all points.
        units: Vec<usize>,
        /// Value of each surface.
        values: Vec<f64>,
    },
    /// By an estimate from so many surfaces, independent of those of other points.
    Estimate {
        /// Its value.
        value: f64,
        /// Its standard error.
        standard_error: f64,
        /// Surfaces behind it.
        surfaces: usize,
    },
}

impl Observed {
    /// Values of the surfaces 0, 1, 2 …
    pub fn of_realizations(values: Vec<f64>) -> Observed {
        Observed::Surfaces { units: (0..values.len()).collect(), values }
    }

    /// Mean over the surfaces.
    pub fn mean(&self) -> f64 {
        match self {
            Observed::Surfaces { values, .. } => values.iter().sum::<f64>() / values.len() as f64,
            Observed::Estimate { value, .. } => *value,
        }
    }

    /// Standard error of the mean.
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

    /// Number of surfaces.
    pub fn surfaces(&self) -> usize {
        match self {
            Observed::Surfaces { values, .. } => values.len(),
            Observed::Estimate { surfaces, .. } => *surfaces,
        }
    }
}

/// Points to which laws of the same small numbers are fitted.
#[derive(Debug, Clone)]
pub struct LimitProblem {
    points: Vec<LimitPoint>,
    scatter: Scatter,
    /// One over the standard error that each point is weighted by.
    scales: Vec<f64>,
}

/// A fitted law.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitFit {
    /// Q₀: the observable where all powers vanish, and the numbers under logarithms are one.
    pub limit: f64,
    /// cⱼ, term by term.
    pub coefficients: Vec<f64>,
    /// The exponent of each term, none of a logarithm.
    pub exponents: Vec<Option<f64>>,
    /// Σ of squared residuals over the variances of the means.
    pub chi_square: f64,
    /// Parameters that were free.
    pub free: usize,
}

/// How well a law does, in the units of the observable where not said otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// Root mean square residual, every point alike.
    pub rms_residual: f64,
    /// χ² over degrees of freedom.
    pub reduced_chi_square: f64,
    /// Akaike's criterion, χ² + 2 × the number of free parameters.
    pub akaike: f64,
    /// Root of the weighted mean square error with which a point is predicted by the others; none
    /// where the others cannot be fitted.
    pub leave_one_out: Option<f64>,
}

/// What resampling says of several choices of forms.
#[derive(Debug, Clone, PartialEq)]
pub struct Resampled {
    /// Intervals of each choice: of the limit, the coefficients, and the free exponents in the
    /// order of their terms.
    pub intervals: Vec<Intervals>,
    /// How the choices compare.
    pub comparison: Vec<Comparison>,
}

/// How one choice of forms compares with its rivals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// exp(−Δ/2) over the sum of all, with Δ the excess of Akaike's criterion over the least.
    pub akaike_weight: f64,
    /// Share of the resamplings in which this choice has the least of Akaike's criterion; none
    /// without resamplings.
    pub best_share: Option<f64>,
}

impl LimitProblem {
    /// Points of as many small numbers as there are terms.
    ///
    /// # Errors
    /// When a small number is not above zero, or a point has no scatter to be weighted by.
    pub fn new(points: Vec<LimitPoint>) -> Result<LimitProblem, FitError> {
        for point in &points {
            for (term, &value) in point.small.iter().enumerate() {
                if !(value > 0.0 && value.is_finite()) {
                    return Err(FitError::NotSmall { term, value });
                }
            }
            let surfaces = point.observed.surfaces();
            let error = point.observed.standard_error();
            if surfaces < 2 || !(error > 0.0 && error.is_finite()) {
                return Err(FitError::NoScatter { surfaces });
            }
        }
        let scatter = Scatter::of(&points);
        let scale = |point: &LimitPoint| {
            1.0 / scatter.standard_error(&point.small, point.observed.surfaces())
        };
        let scales = points.iter().map(scale).collect();
        Ok(LimitProblem { points, scatter, scales })
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.points.len()
    }

    /// The fewest surfaces behind a point.
    pub fn surfaces(&self) -> usize {
        let counts = self.points.iter().map(|point| point.observed.surfaces());
        counts.min().unwrap_or(0)
    }

    /// The law by weighted least squares.
    ///
    /// # Errors
    /// With no more points than parameters, where the points do not tell the terms apart, or where
    /// a free exponent leaves [`EXPONENTS`].
    pub fn fit(&self, forms: &[TermForm]) -> Result<LimitFit, FitError> {
        self.fit_to(forms, &self.means(), &vec![true; self.points.len()], None)
    }

    /// How well a fitted law does.
    pub fn judge(&self, forms: &[TermForm], fit: &LimitFit) -> Judged {
        let means = self.means();
        let count = self.points.len();
        let squares = (0..count).map(|i| (means[i] - self.predicted(fit, i)).powi(2));
        let freedom = (count - fit.free) as f64;
        Judged {
            rms_residual: (squares.sum::<f64>() / count as f64).sqrt(),
            reduced_chi_square: fit.chi_square / freedom,
            akaike: fit.akaike(),
            leave_one_out: self.leave_one_out(forms, fit, &means),
        }
    }

    /// All parameters' intervals under several choices of forms, and how often each choice wins, by
    /// resampling whole surfaces. A surface is drawn equally often at all its points, and all
    /// choices are resampled alike.
    pub fn resample(
        &self,
        rivals: &[(&[TermForm], &LimitFit)],
        bootstrap: &Bootstrap,
    ) -> Resampled {
        let units = self.points.iter().filter_map(|point| match &point.observed {
            Observed::Surfaces { units, .. } => Some(&units[..]),
            Observed::Estimate { .. } => None,
        });
        let resample = Resample { fewest: self.surfaces(), ..Resample::of(units) };
        // Akaike's criterion of each choice in each resampling.
        let mut criteria: Vec<Vec<f64>> = Vec::new();
        let intervals = rivals.iter().map(|(forms, fit)| {
            let mut own = Vec::with_capacity(bootstrap.replicates);
            let fits = bootstrap.of_units(resample, &estimates(forms, fit), |replicate, times| {
                let (means, used) = drawn(self, times, replicate, bootstrap.seed);
                let refit = self.fit_to(forms, &means, &used, Some(fit));
                own.push(refit.as_ref().map_or(f64::INFINITY, LimitFit::akaike));
                refit.map(|refit| parameters(forms, &refit))
            });
            criteria.push(own);
            fits
        });
        Resampled { intervals: intervals.collect(), comparison: compared(rivals, &criteria) }
    }

    fn means(&self) -> Vec<f64> {
        let means = self.points.iter().map(|point| point.observed.mean());
        means.collect()
    }

    /// The fit to other means, of the points that are used; the search for exponents starts at
    /// those of another fit where there is one.
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
            return Err(FitError::TooFewPoints { found, free });
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

    /// What a law says of a point.
    fn predicted(&self, fit: &LimitFit, point: usize) -> f64 {
        let terms = fit.coefficients.iter().zip(&fit.exponents);
        let terms = terms.zip(&self.points[point].small);
        let terms = terms.map(|((coefficient, exponent), &small)| {
            coefficient
                * match exponent {
                    Some(exponent) => libm::pow(small, *exponent),
                    None => libm::log(small),
                }
        });
        fit.limit + terms.sum::<f64>()
    }
}

impl LimitFit {
    /// Akaike's criterion, χ² + 2 × the number of free parameters.
    pub fn akaike(&self) -> f64 {
        self.chi_square + 2.0 * self.free as f64
    }
}

fn compared(rivals: &[(&[TermForm], &LimitFit)], criteria: &[Vec<f64>]) -> Vec<Comparison> {
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
    let compare = |rival: usize| Comparison {
        akaike_weight: likelihoods[rival] / total,
        best_share: (replicates > 0).then(|| wins[rival] as f64 / replicates as f64),
    };
    (0..rivals.len()).map(compare).collect()
}

fn estimates(forms: &[TermForm], fit: &LimitFit) -> Vec<Estimate> {
    let linear = 1 + forms.len();
    let values = parameters(forms, fit).into_iter().enumerate();
    let estimate = |(place, value)| match place < linear {
        true => Estimate::Real(value),
        false => Estimate::Positive(value),
    };
    values.map(estimate).collect()
}

/// The limit, the coefficients, and the exponents that are free.
fn parameters(forms: &[TermForm], fit: &LimitFit) -> Vec<f64> {
    let free = forms.iter().zip(&fit.exponents);
    let free = free.filter(|(form, _)| **form == TermForm::FreePower);
    let free = free.filter_map(|(_, exponent)| *exponent);
    let linear = [fit.limit].into_iter().chain(fit.coefficients.iter().copied());
    linear.chain(free).collect()
}

/// Returns the mean of each point in a resampling, and whether any of its surfaces was drawn.
/// Points without a drawn surface are not fitted.
fn drawn(
    problem: &LimitProblem,
    times: &[u32],
    replicate: usize,
    seed: u64,
) -> (Vec<f64>, Vec<bool>) {
    // Estimates without surfaces are drawn as a function of seed and replicate.
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
            // A resampling of n surfaces scatters by √((n − 1)/n) standard errors; so do these.
            let lost = ((surfaces - 1) as f64 / *surfaces as f64).sqrt();
            (value + lost * standard_error * normals.next(), true)
        }
    });
    points.unzip()
}

#[cfg(test)]
mod tests;
