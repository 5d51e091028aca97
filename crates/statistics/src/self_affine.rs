//! The power spectrum of a self-affine surface, fitted to measured densities by maximum likelihood.
//!
//! C(q) = C₀ up to the roll-off q_r, C₀ (q/q_r)^(−2(1 + H)) beyond. The density of a ring of n modes
//! of a Gaussian surface is C times χ² of n degrees of freedom, over n: its scatter is a share of the
//! density itself, and least squares would see the first rings alone, or with logarithms be biased
//! by those of few modes. The likelihood (Whittle 1953), −Σ n (ln C + P/C)/2 over rings of measured
//! density P, has neither fault. C₀ of its maximum is known for any H and q_r; in H it is concave; q_r
//! is looked for among the rings, then between the neighbours of the best.
//!
//! Intervals come from resampled surfaces; of a single surface from the information that its modes
//! have, for these are independent of each other.

use nalgebra::{DMatrix, DVector};

use super::bootstrap::{Bootstrap, Estimate, Interval, Intervals};
use super::student::two_sided_quantile;
use super::{FitError, Window};

mod likelihood;

use likelihood::{FLATTEST, LEAST_PLATEAU, Likelihood, STEEPEST};

/// Fewer rings have nothing to say against the law.
const LEAST_RINGS: usize = 4;
/// Densities below this share of the largest are rounding of a transform: beyond a cutoff.
const ROUNDING: f64 = 1e-20;

/// What is measured of one ring on every surface of an ensemble.
#[derive(Debug, Clone, PartialEq)]
pub struct RingOfSurfaces {
    /// Its wavenumber.
    pub wavenumber: f64,
    /// Degrees of freedom of its density on one surface.
    pub freedom: f64,
    /// Densities, surface by surface.
    pub densities: Vec<f64>,
}

/// A self-affine power spectrum with a roll-off, as fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelfAffine {
    /// Hurst exponent H.
    pub hurst: f64,
    /// Roll-off wavenumber q_r; none where the power law goes on down to the first ring.
    pub rolloff: Option<f64>,
    /// C₀, the density of the plateau, or of the first ring where there is none.
    pub plateau: f64,
    /// Root mean square of ln P/C, each ring with its degrees of freedom.
    pub rms_residual: f64,
    /// Mean over the rings of the squared deviation of P/C from one, over its variance.
    pub reduced_chi_square: f64,
    /// Rings fitted.
    pub data: usize,
    /// Rings left out, whose density is rounding.
    pub masked: usize,
}

/// Rings ready to be fitted.
#[derive(Debug, Clone)]
pub struct SelfAffineProblem {
    window: Window,
    surfaces: usize,
    masked: usize,
    rings: Vec<RingOfSurfaces>,
}

impl SelfAffineProblem {
    /// Takes the rings, which ascend, whose wavenumbers lie in a window; all hold one density for each
    /// surface.
    pub fn new(rings: Vec<RingOfSurfaces>, window: Window) -> Self {
        let mut rings = rings;
        let surfaces = rings.first().map_or(0, |ring| ring.densities.len());
        let most = rings.iter().flat_map(|ring| ring.densities.iter().copied());
        let most = most.fold(0.0, f64::max);
        rings.retain(|ring| window.contains(ring.wavenumber));
        let inside = rings.len();
        let is_measured = |density: &f64| *density > ROUNDING * most;
        rings.retain(|ring| ring.densities.iter().all(is_measured));
        Self { window, surfaces, masked: inside - rings.len(), rings }
    }

    /// Fits the mean over the surfaces.
    ///
    /// # Errors
    /// With fewer than four rings, or densities that do not fall.
    pub fn fit(&self) -> Result<SelfAffine, FitError> {
        self.fit_of(&vec![1; self.surfaces])
    }

    /// Intervals of the Hurst exponent and, where there is one, of the roll-off and the plateau.
    pub fn intervals(&self, fit: &SelfAffine, bootstrap: &Bootstrap) -> Intervals {
        if self.surfaces == 1 && bootstrap.replicates > 0 {
            return Intervals {
                intervals: self.informed(fit, bootstrap.level),
                replicates: 0,
                failed: 0,
            };
        }
        let hurst = Estimate::Real(fit.hurst);
        let others = fit.rolloff.map(|rolloff| [rolloff, fit.plateau]);
        let others = others.into_iter().flatten().map(Estimate::Positive);
        let estimates: Vec<Estimate> = [hurst].into_iter().chain(others).collect();
        bootstrap.intervals(self.surfaces, &estimates, |times| {
            let replicate = self.fit_of(times)?;
            match (fit.rolloff, replicate.rolloff) {
                (None, _) => Ok(vec![replicate.hurst]),
                (Some(_), Some(rolloff)) => Ok(vec![replicate.hurst, rolloff, replicate.plateau]),
                (Some(_), None) => Err(FitError::NotConverged),
            }
        })
    }

    /// Fits the mean over surfaces, each so many times.
    fn fit_of(&self, times: &[u32]) -> Result<SelfAffine, FitError> {
        let found = self.rings.len();
        if found < LEAST_RINGS {
            return Err(FitError::TooFew { window: self.window, found, needed: LEAST_RINGS });
        }
        let likelihood = Likelihood::of(&self.rings, times);
        let (position, rolloff) = likelihood.rolloff();
        let (power, start) = match position >= LEAST_PLATEAU {
            true => (likelihood.power(rolloff), rolloff),
            false => (likelihood.power(likelihood.logs[0]), likelihood.logs[0]),
        };
        if !(power.exponent > FLATTEST && power.exponent < STEEPEST) {
            return Err(FitError::NotConverged);
        }
        let residuals = likelihood.residuals(start, &power);
        Ok(SelfAffine {
            hurst: power.exponent / 2.0 - 1.0,
            rolloff: (position >= LEAST_PLATEAU).then(|| rolloff.exp()),
            plateau: power.plateau,
            rms_residual: residuals[0],
            reduced_chi_square: residuals[1],
            data: found,
            masked: self.masked,
        })
    }

    /// Student's intervals with the standard errors that the information of independent modes gives.
    fn informed(&self, fit: &SelfAffine, level: f64) -> Option<Vec<Interval>> {
        let start = fit.rolloff.unwrap_or(self.rings[0].wavenumber);
        let count = if fit.rolloff.is_some() { 3 } else { 2 };
        let mut information = DMatrix::zeros(count, count);
        let mut freedom = 0.0;
        for ring in &self.rings {
            let beyond = (ring.wavenumber / start).ln();
            // Of ln C by ln C₀, H and ln q_r.
            let gradient = match beyond > 0.0 {
                true => [1.0, -2.0 * beyond, 2.0 * (1.0 + fit.hurst)],
                false => [1.0, 0.0, 0.0],
            };
            let gradient = DVector::from_column_slice(&gradient[..count]);
            information += 0.5 * ring.freedom * &gradient * gradient.transpose();
            freedom += ring.freedom;
        }
        let covariance = information.try_inverse()?;
        let quantile = two_sided_quantile(level, freedom as u32);
        let error = |place: usize| covariance[(place, place)].sqrt();
        let real = |value: f64, error: f64| Interval {
            lower: value - quantile * error,
            upper: value + quantile * error,
            standard_error: error,
        };
        let positive = |value: f64, error: f64| Interval {
            lower: value / (quantile * error).exp(),
            upper: value * (quantile * error).exp(),
            standard_error: value * error,
        };
        let mut intervals = vec![real(fit.hurst, error(1))];
        if let Some(rolloff) = fit.rolloff {
            intervals.extend([positive(rolloff, error(2)), positive(fit.plateau, error(0))]);
        }
        Some(intervals)
    }
}

#[cfg(test)]
mod tests;
