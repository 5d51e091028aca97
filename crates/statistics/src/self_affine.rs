//! Fit of a self-affine power spectrum to measured densities by maximum likelihood.
//!
//! The model is C(q) = C₀ up to the roll-off q_r and C₀ (q/q_r)^(−2(1 + H)) beyond. For a Gaussian
//! surface, the measured density P of a ring of n modes is distributed as C χ²/n with n degrees of
//! freedom, so its scatter is proportional to C. Least squares of P would depend on the first rings
//! only, and least squares of ln P would be biased by rings of few modes. The Whittle likelihood
//! (Whittle 1953), −Σ n (ln C + P/C)/2, has neither problem.
//!
//! For given H and q_r, the best C₀ has a closed form, and the likelihood is concave in H. The
//! roll-off q_r is first tried at each ring, then refined between the neighbours of the best ring.
//!
//! Confidence intervals are computed by resampling surfaces. For a single surface, they follow from
//! the Fisher information of its modes, which are independent.

use nalgebra::{DMatrix, DVector};

use super::bootstrap::{Bootstrap, Estimate, Interval, Intervals};
use super::intervals::two_sided_quantile;
use super::{FitError, Window};

/// Minimum number of rings, one more than the number of parameters.
const LEAST_RINGS: usize = 4;
/// Maximum density, relative to the largest density, that counts as a rounding error.
const ROUNDING: f64 = 1e-20;

/// Minimum number of rings in a plateau. With fewer, the fit has no roll-off.
const LEAST_PLATEAU: usize = 2;
/// Minimum exponent 2(1 + H) for which the density counts as decreasing.
const FLATTEST: f64 = 1e-6;
/// Maximum exponent 2(1 + H); the fit fails if it reaches this value.
const STEEPEST: f64 = 20.0;
/// Maximum number of Newton steps for the exponent 2(1 + H).
const NEWTON_STEPS: usize = 50;
/// Number of golden-section steps for the roll-off q_r.
const GOLDEN_STEPS: usize = 40;

/// Power spectral densities of all surfaces of an ensemble in one ring of wavenumbers.
#[derive(Debug, Clone, PartialEq)]
pub struct RingOfSurfaces {
    /// Wavenumber q at the middle of the ring.
    pub wavenumber: f64,
    /// Degrees of freedom of the density of one surface: the number of modes in the ring that are
    /// independent.
    pub freedom: f64,
    /// Power spectral density of each surface.
    pub densities: Vec<f64>,
}

/// Fitted power spectrum of a self-affine surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelfAffine {
    /// Hurst exponent H of the surface.
    pub hurst: f64,
    /// Roll-off wavenumber q_r, or `None` if the power law extends to the first ring.
    pub rolloff: Option<f64>,
    /// Density C₀ of the plateau. Without a plateau, it is the fitted density of the first ring.
    pub plateau: f64,
    /// Root mean square of ln(P/C) for the measured densities P, weighted by the degrees of freedom
    /// of the rings.
    pub rms_residual: f64,
    /// Reduced χ²: sum of the squared deviations of P/C from one, divided by their variances and by
    /// the degrees of freedom.
    pub reduced_chi_square: f64,
    /// Number of rings in the fit.
    pub data: usize,
    /// Number of rings that the fit omits, because their densities are only rounding errors.
    pub masked: usize,
}

/// Rings to which a self-affine power spectrum is fitted.
#[derive(Debug, Clone)]
pub struct SelfAffineProblem {
    window: Window,
    surfaces: usize,
    masked: usize,
    rings: Vec<RingOfSurfaces>,
}

impl SelfAffineProblem {
    /// Creates a problem from the rings with wavenumbers inside a window.
    ///
    /// The rings must be in ascending order, with one density for each surface.
    pub fn new(rings: Vec<RingOfSurfaces>, window: Window) -> Self {
        let mut rings = rings;
        let surfaces = rings.first().map_or(0, |ring| ring.densities.len());
        let densities = rings.iter().flat_map(|ring| ring.densities.iter().copied());
        let largest = densities.fold(0.0, f64::max);
        rings.retain(|ring| window.contains(ring.wavenumber));
        let inside = rings.len();
        let is_measured = |density: &f64| *density > ROUNDING * largest;
        rings.retain(|ring| ring.densities.iter().all(is_measured));
        Self { window, surfaces, masked: inside - rings.len(), rings }
    }

    /// Fits the spectrum to the mean densities over the surfaces.
    ///
    /// # Errors
    /// Fails if there are fewer than four rings, if the densities do not decrease, or if they
    /// decrease with an exponent 2(1 + H) of 20 or more.
    pub fn fit(&self) -> Result<SelfAffine, FitError> {
        self.fit_of(&vec![1; self.surfaces])
    }

    /// Computes confidence intervals of the Hurst exponent, the roll-off and the plateau, in this
    /// order.
    ///
    /// Without a roll-off, only the interval of the Hurst exponent is returned.
    pub fn intervals(&self, fit: &SelfAffine, bootstrap: &Bootstrap) -> Intervals {
        if self.surfaces == 1 && bootstrap.replicates > 0 {
            return Intervals {
                intervals: self.fisher_intervals(fit, bootstrap.level),
                replicates: 0,
                failed: 0,
            };
        }
        let hurst = Estimate::Real(fit.hurst);
        let rolloff = fit.rolloff.map(|rolloff| [rolloff, fit.plateau]);
        let others = rolloff.into_iter().flatten().map(Estimate::Positive);
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

    /// Fits the spectrum to the mean densities over surfaces, where surface i counts `times[i]`
    /// times.
    fn fit_of(&self, times: &[u32]) -> Result<SelfAffine, FitError> {
        let found = self.rings.len();
        if found < LEAST_RINGS {
            return Err(FitError::TooFew { window: self.window, found, needed: LEAST_RINGS });
        }
        let likelihood = Likelihood::new(&self.rings, times);
        let (position, rolloff) = likelihood.rolloff();
        let start = if position >= LEAST_PLATEAU { rolloff } else { likelihood.logs[0] };
        let power = likelihood.power(start);
        if !(power.exponent > FLATTEST && power.exponent < STEEPEST) {
            return Err(FitError::NotConverged);
        }
        let residuals = likelihood.residuals(start, &power);
        Ok(SelfAffine {
            hurst: power.exponent / 2.0 - 1.0,
            rolloff: (position >= LEAST_PLATEAU).then(|| libm::exp(rolloff)),
            plateau: power.plateau,
            rms_residual: residuals[0],
            reduced_chi_square: residuals[1],
            data: found,
            masked: self.masked,
        })
    }

    /// Computes confidence intervals at the given level from the Fisher information of independent
    /// modes. Returns `None` if the information matrix is singular.
    fn fisher_intervals(&self, fit: &SelfAffine, level: f64) -> Option<Vec<Interval>> {
        let start = fit.rolloff.unwrap_or(self.rings[0].wavenumber);
        let count = if fit.rolloff.is_some() { 3 } else { 2 };
        let mut information = DMatrix::zeros(count, count);
        let mut freedom = 0.0;
        for ring in &self.rings {
            let beyond = libm::log(ring.wavenumber / start);
            // The entries are the derivatives of ln C with respect to ln C₀, H and ln q_r.
            let gradient = if beyond > 0.0 {
                [1.0, -2.0 * beyond, 2.0 * (1.0 + fit.hurst)]
            } else {
                [1.0, 0.0, 0.0]
            };
            let gradient = DVector::from_column_slice(&gradient[..count]);
            information += 0.5 * ring.freedom * &gradient * gradient.transpose();
            freedom += ring.freedom;
        }
        let covariance = information.try_inverse()?;
        let quantile = two_sided_quantile(level, freedom as u32);
        let interval = |estimate: Estimate, index: usize| {
            estimate.interval(covariance[(index, index)].sqrt(), quantile)
        };
        let mut intervals = vec![interval(Estimate::Real(fit.hurst), 1)];
        if let Some(rolloff) = fit.rolloff {
            intervals.push(interval(Estimate::Positive(rolloff), 2));
            intervals.push(interval(Estimate::Positive(fit.plateau), 0));
        }
        Some(intervals)
    }
}

/// Whittle likelihood of the mean densities of all rings.
struct Likelihood {
    /// Logarithm ln q of the wavenumber of each ring.
    logs: Vec<f64>,
    /// Half the degrees of freedom of the mean density of each ring.
    weights: Vec<f64>,
    densities: Vec<f64>,
}

/// Exponent and plateau with the maximum likelihood for a given roll-off.
struct Power {
    /// Exponent 2(1 + H) of the decay.
    exponent: f64,
    /// Density C₀ below the roll-off.
    plateau: f64,
    /// Negative logarithm of the likelihood, up to a constant.
    cost: f64,
}

impl Likelihood {
    /// Creates the likelihood of the mean densities over surfaces, where surface i counts
    /// `times[i]` times.
    fn new(rings: &[RingOfSurfaces], times: &[u32]) -> Self {
        let surfaces: f64 = times.iter().copied().map(f64::from).sum();
        let mean = |ring: &RingOfSurfaces| {
            let densities = ring.densities.iter().zip(times);
            let sum: f64 = densities.map(|(density, &times)| density * f64::from(times)).sum();
            sum / surfaces
        };
        Self {
            logs: rings.iter().map(|ring| libm::log(ring.wavenumber)).collect(),
            weights: rings.iter().map(|ring| 0.5 * ring.freedom * surfaces).collect(),
            densities: rings.iter().map(mean).collect(),
        }
    }

    /// Returns the number of rings below the best roll-off q_r, and ln q_r.
    fn rolloff(&self) -> (usize, f64) {
        let last = self.logs.len() - LEAST_PLATEAU;
        let cost = |rolloff: f64| self.power(rolloff).cost;
        let costs: Vec<f64> = self.logs[..last].iter().map(|&log| cost(log)).collect();
        let best = (0..last).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
        let (mut low, mut high) = (self.logs[best.saturating_sub(1)], self.logs[best + 1]);
        let golden = 0.5 * (5_f64.sqrt() - 1.0);
        let mut inner = [high - golden * (high - low), low + golden * (high - low)];
        let mut values = inner.map(cost);
        for _ in 0..GOLDEN_STEPS {
            if values[0] < values[1] {
                high = inner[1];
                inner = [high - golden * (high - low), inner[0]];
                values = [cost(inner[0]), values[0]];
            } else {
                low = inner[0];
                inner = [inner[1], low + golden * (high - low)];
                values = [values[1], cost(inner[1])];
            }
        }
        let rolloff = 0.5 * (low + high);
        let before = self.logs.iter().filter(|&&log| log < rolloff).count();
        (before, rolloff)
    }

    /// Computes the exponent and the plateau with the maximum likelihood for `rolloff` = ln q_r, by
    /// Newton's method with bisection.
    fn power(&self, rolloff: f64) -> Power {
        let beyond = || self.logs.iter().map(|log| (log - rolloff).max(0.0));
        let total: f64 = self.weights.iter().sum();
        let first: f64 = beyond().zip(&self.weights).map(|(x, weight)| x * weight).sum();
        let sums = |exponent: f64| {
            let mut sums = [0.0; 3];
            for ((x, weight), density) in beyond().zip(&self.weights).zip(&self.densities) {
                let part = weight * density * libm::exp(exponent * x);
                sums[0] += part;
                sums[1] += x * part;
                sums[2] += x * x * part;
            }
            sums
        };
        let (mut low, mut high) = (0.0, STEEPEST);
        let mut exponent = 3.0;
        for _ in 0..NEWTON_STEPS {
            let [zeroth, one, two] = sums(exponent);
            let mean = one / zeroth;
            let slope = total * mean - first;
            let bend = total * (two / zeroth - mean * mean);
            if slope < 0.0 {
                low = exponent;
            } else {
                high = exponent;
            }
            let newton = exponent - slope / bend;
            let is_inside = newton > low && newton < high;
            let next = if is_inside { newton } else { 0.5 * (low + high) };
            if (next - exponent).abs() < 1e-12 {
                break;
            }
            exponent = next;
        }
        let plateau = sums(exponent)[0] / total;
        Power { exponent, plateau, cost: total * libm::log(plateau) - exponent * first }
    }

    /// Returns the root mean square of ln(P/C), weighted by the degrees of freedom, and the reduced
    /// χ² of P/C.
    fn residuals(&self, rolloff: f64, power: &Power) -> [f64; 2] {
        let mut sums = [0.0; 3];
        for ((log, weight), density) in self.logs.iter().zip(&self.weights).zip(&self.densities) {
            let law = power.plateau * libm::exp(-power.exponent * (log - rolloff).max(0.0));
            let ratio = density / law;
            sums[0] += weight * libm::log(ratio).powi(2);
            sums[1] += weight * (ratio - 1.0).powi(2);
            sums[2] += weight;
        }
        // The relative variance of the mean power of n pairs of modes is 1/n.
        let freedom = self.logs.len() as f64 - 3.0;
        [(sums[0] / sums[2]).sqrt(), sums[1] / freedom]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_mechanics::grid::{Boundary, Grid};
    use asperity_mechanics::topography::power_spectrum::rings;
    use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
    use asperity_mechanics::topography::spectrum::Spectrum;

    const BOOTSTRAP: Bootstrap = Bootstrap { replicates: 200, seed: 5, level: 0.95 };

    fn exact(hurst: f64, rolloff: f64) -> Vec<RingOfSurfaces> {
        let ring = |k: i32| {
            let wavenumber = f64::from(k);
            let density = (wavenumber / rolloff).max(1.0).powf(-2.0 * (1.0 + hurst));
            RingOfSurfaces {
                wavenumber,
                freedom: 6.0 * wavenumber,
                densities: vec![1e-5 * density],
            }
        };
        (2..=64).map(ring).collect()
    }

    #[test]
    fn an_exact_law_is_found_with_its_rolloff_between_rings() {
        for (hurst, rolloff) in [(0.3, 8.0), (0.8, 9.4), (1.0, 20.5)] {
            let problem = SelfAffineProblem::new(exact(hurst, rolloff), Window::ALL);
            let fit = problem.fit().unwrap();
            // Rounding errors of the cost limit the accuracy of the golden-section search.
            assert!((fit.hurst - hurst).abs() < 1e-5, "{fit:?}");
            assert!((fit.rolloff.unwrap() / rolloff - 1.0).abs() < 1e-5, "{fit:?}");
            assert!((fit.plateau / 1e-5 - 1.0).abs() < 1e-5);
            assert!(fit.rms_residual < 1e-5);
        }
    }

    #[test]
    fn a_power_law_without_a_plateau_has_no_rolloff() {
        let fit = SelfAffineProblem::new(exact(0.6, 1.0), Window::ALL).fit().unwrap();
        assert!((fit.hurst - 0.6).abs() < 1e-9, "{fit:?}");
        assert_eq!(fit.rolloff, None);
    }

    #[test]
    fn rings_that_are_rounding_or_outside_the_window_count_for_nothing() {
        let mut rings = exact(0.7, 9.0);
        rings.iter_mut().skip(40).for_each(|ring| ring.densities[0] = 1e-35);
        let window = Window { from: 4.0, to: 50.0 };
        let fit = SelfAffineProblem::new(rings, window).fit().unwrap();
        assert_eq!((fit.data, fit.masked), (38, 9));
        assert!((fit.hurst - 0.7).abs() < 1e-5);
    }

    #[test]
    fn too_few_rings_and_rising_densities_have_no_fit() {
        let few = SelfAffineProblem::new(exact(0.5, 8.0)[..3].to_vec(), Window::ALL);
        assert!(matches!(few.fit(), Err(FitError::TooFew { .. })));
        let mut rising = exact(0.5, 8.0);
        for ring in &mut rising {
            ring.densities[0] = ring.wavenumber;
        }
        let rising = SelfAffineProblem::new(rising, Window::ALL);
        assert_eq!(rising.fit(), Err(FitError::NotConverged));
    }

    fn surface(realization: u32) -> RandomSurface {
        RandomSurface {
            spectrum: Spectrum {
                hurst: 0.8,
                k_lower: 1,
                k_rolloff: 12,
                k_upper: 60,
                anisotropy: None,
            },
            amplitude: Amplitude::Gaussian,
            rms_slope: 1.0,
            seed: 2,
            realization,
        }
    }

    /// Returns the densities of drawn surfaces on a mesh of 128² nodes, in the rings that are
    /// complete.
    fn measured(realizations: std::ops::Range<u32>) -> Vec<RingOfSurfaces> {
        let mut found: Vec<RingOfSurfaces> = Vec::new();
        for realization in realizations {
            let drawn = surface(realization).draw(Grid::square(128, 1.0).unwrap());
            let own = rings(&drawn, Boundary::Periodic).into_iter().take(59);
            for (index, ring) in own.enumerate() {
                if found.len() == index {
                    found.push(RingOfSurfaces {
                        wavenumber: ring.wavenumber(std::f64::consts::TAU),
                        freedom: ring.modes.into(),
                        densities: Vec::new(),
                    });
                }
                found[index].densities.push(ring.density);
            }
        }
        found
    }

    #[test]
    fn a_drawn_surface_has_the_exponent_and_rolloff_of_its_spectrum_within_their_intervals() {
        let mut covered = [0; 2];
        for realization in 0..20 {
            let problem =
                SelfAffineProblem::new(measured(realization..realization + 1), Window::ALL);
            let fit = problem.fit().unwrap();
            let intervals = problem.intervals(&fit, &BOOTSTRAP).intervals.unwrap();
            let truth = [0.8, 12.0];
            for (index, truth) in truth.into_iter().enumerate() {
                let Interval { lower, upper, .. } = intervals[index];
                covered[index] += u32::from(lower <= truth && truth <= upper);
            }
            assert!((fit.hurst - 0.8).abs() < 0.15, "{fit:?}");
        }
        // If 95 % are covered, fewer than 16 of 20 have a probability of 0.3 %.
        assert!(covered.iter().all(|&covered| covered >= 16), "{covered:?}");
    }

    #[test]
    fn resampled_surfaces_have_the_scatter_that_their_modes_have() {
        let problem = SelfAffineProblem::new(measured(0..12), Window::ALL);
        let fit = problem.fit().unwrap();
        let resampled = problem.intervals(&fit, &BOOTSTRAP).intervals.unwrap();
        let single = SelfAffineProblem::new(measured(0..1), Window::ALL);
        let informed = single.intervals(&single.fit().unwrap(), &BOOTSTRAP);
        let expected = informed.intervals.unwrap()[0].standard_error / 12_f64.sqrt();
        // The scatter of twelve surfaces has an error of 20 %; the tolerance is about twice that.
        let ratio = resampled[0].standard_error / expected;
        assert!((0.6..1.6).contains(&ratio), "{ratio}");
        // The tolerance is four standard errors.
        assert!((fit.hurst - 0.8).abs() < 4.0 * expected, "{fit:?}");
    }
}
