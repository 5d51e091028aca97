//! The power spectrum of a self-affine surface, fitted to measured densities by maximum likelihood.
//!
//! C(q) = C₀ up to the roll-off q_r, C₀ (q/q_r)^(−2(1 + H)) beyond. The density of a ring of n
//! modes of a Gaussian surface is C times χ² of n degrees of freedom, over n: its scatter is a
//! share of the density itself, and least squares would see the first rings alone, or with
//! logarithms be biased by those of few modes. The likelihood (Whittle 1953), −Σ n (ln C + P/C)/2
//! over rings of measured density P, has neither fault. C₀ of its maximum is known for any H and
//! q_r; in H it is concave; q_r is looked for among the rings, then between the neighbours of the
//! best.
//!
//! Intervals come from resampled surfaces; of a single surface from the information that its modes
//! have, for these are independent of each other.

use nalgebra::{DMatrix, DVector};

use super::bootstrap::{Bootstrap, Estimate, Interval, Intervals};
use super::intervals::two_sided_quantile;
use super::{FitError, Window};

/// Fewer rings have nothing to say against the law.
const LEAST_RINGS: usize = 4;
/// Densities below this share of the largest are rounding of a transform: beyond a cutoff.
const ROUNDING: f64 = 1e-20;

/// Fewer rings before the roll-off are no plateau.
const LEAST_PLATEAU: usize = 2;
/// Densities that fall less do not fall.
const FLATTEST: f64 = 1e-6;
/// The steepest power law that is looked for.
const STEEPEST: f64 = 20.0;
/// Steps of the searches for the exponent and for the roll-off, each of which gains digits.
const NEWTON_STEPS: usize = 50;
const GOLDEN_STEPS: usize = 40;

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
    /// Takes the rings, which ascend, whose wavenumbers lie in a window; all hold one density for
    /// each surface.
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

    /// Student's intervals with the standard errors that the information of independent modes
    /// gives.
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
        let interval = |estimate: Estimate, place: usize| {
            estimate.interval(covariance[(place, place)].sqrt(), quantile)
        };
        let mut intervals = vec![interval(Estimate::Real(fit.hurst), 1)];
        if let Some(rolloff) = fit.rolloff {
            intervals.push(interval(Estimate::Positive(rolloff), 2));
            intervals.push(interval(Estimate::Positive(fit.plateau), 0));
        }
        Some(intervals)
    }
}

/// Logarithms of wavenumbers, and mean densities with their weights.
struct Likelihood {
    logs: Vec<f64>,
    /// Half the degrees of freedom of the mean.
    weights: Vec<f64>,
    densities: Vec<f64>,
}

/// The best power law beyond a roll-off.
struct Power {
    /// 2(1 + H).
    exponent: f64,
    /// The density before it.
    plateau: f64,
    /// Minus the logarithm of the likelihood, but for a constant.
    cost: f64,
}

impl Likelihood {
    /// Of the mean over surfaces, each so many times.
    fn of(rings: &[RingOfSurfaces], times: &[u32]) -> Self {
        let surfaces: f64 = times.iter().copied().map(f64::from).sum();
        let mean = |ring: &RingOfSurfaces| {
            let densities = ring.densities.iter().zip(times);
            let sum: f64 = densities.map(|(density, &times)| density * f64::from(times)).sum();
            sum / surfaces
        };
        Self {
            logs: rings.iter().map(|ring| ring.wavenumber.ln()).collect(),
            weights: rings.iter().map(|ring| 0.5 * ring.freedom * surfaces).collect(),
            densities: rings.iter().map(mean).collect(),
        }
    }

    /// How many rings lie before the best roll-off, and its logarithm.
    fn rolloff(&self) -> (usize, f64) {
        let last = self.logs.len() - LEAST_PLATEAU;
        let cost = |rolloff: f64| self.power(rolloff).cost;
        let costs: Vec<f64> = self.logs[..last].iter().map(|&log| cost(log)).collect();
        let best = (0..last).min_by(|&one, &other| costs[one].total_cmp(&costs[other]));
        let best = best.unwrap_or(0);
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

    /// The best exponent and plateau for a roll-off: the root of the slope of a convex function.
    fn power(&self, rolloff: f64) -> Power {
        let beyond = || self.logs.iter().map(|log| (log - rolloff).max(0.0));
        let total: f64 = self.weights.iter().sum();
        let first: f64 = beyond().zip(&self.weights).map(|(x, weight)| x * weight).sum();
        let sums = |exponent: f64| {
            let mut sums = [0.0; 3];
            for ((x, weight), density) in beyond().zip(&self.weights).zip(&self.densities) {
                let part = weight * density * (exponent * x).exp();
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
            match slope < 0.0 {
                true => low = exponent,
                false => high = exponent,
            }
            let newton = exponent - slope / bend;
            let next = match newton > low && newton < high {
                true => newton,
                false => 0.5 * (low + high),
            };
            if (next - exponent).abs() < 1e-12 {
                break;
            }
            exponent = next;
        }
        let plateau = sums(exponent)[0] / total;
        Power { exponent, plateau, cost: total * plateau.ln() - exponent * first }
    }

    /// The weighted root mean square of ln P/C, and the mean of the squared deviations of P/C over
    /// their variances.
    fn residuals(&self, rolloff: f64, power: &Power) -> [f64; 2] {
        let mut sums = [0.0; 3];
        for ((log, weight), density) in self.logs.iter().zip(&self.weights).zip(&self.densities) {
            let law = power.plateau * (-power.exponent * (log - rolloff).max(0.0)).exp();
            let ratio = density / law;
            sums[0] += weight * ratio.ln().powi(2);
            sums[1] += weight * (ratio - 1.0).powi(2);
            sums[2] += weight;
        }
        // The variance of the mean of n pairs of modes is 1/n.
        let freedom = self.logs.len() as f64 - 3.0;
        [(sums[0] / sums[2]).sqrt(), sums[1] / freedom]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_contact::grid::{Boundary, Grid};
    use asperity_contact::topography::power_spectrum::rings;
    use asperity_contact::topography::random::{Amplitude, RandomSurface};
    use asperity_contact::topography::spectrum::Spectrum;

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
            // The golden section cannot tell costs apart that differ by rounding.
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

    /// Rings of the wavenumbers that a mesh of 128 nodes has whole.
    fn measured(realizations: std::ops::Range<u32>) -> Vec<RingOfSurfaces> {
        let mut found: Vec<RingOfSurfaces> = Vec::new();
        for realization in realizations {
            let drawn = surface(realization).draw(Grid::square(128, 1.0).unwrap());
            let own = rings(&drawn, Boundary::Periodic).into_iter().take(59);
            for (place, ring) in own.enumerate() {
                if found.len() == place {
                    found.push(RingOfSurfaces {
                        wavenumber: ring.wavenumber(std::f64::consts::TAU),
                        freedom: ring.modes.into(),
                        densities: Vec::new(),
                    });
                }
                found[place].densities.push(ring.density);
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
            for (place, truth) in truth.into_iter().enumerate() {
                let Interval { lower, upper, .. } = intervals[place];
                covered[place] += u32::from(lower <= truth && truth <= upper);
            }
            assert!((fit.hurst - 0.8).abs() < 0.15, "{fit:?}");
        }
        // Of nominal 95 %: fewer than 16 of 20 has a probability of 0.3 %.
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
        // Twelve surfaces know their scatter to a fifth; two such errors.
        let ratio = resampled[0].standard_error / expected;
        assert!((0.6..1.6).contains(&ratio), "{ratio}");
        // Within four standard errors.
        assert!((fit.hurst - 0.8).abs() < 4.0 * expected, "{fit:?}");
    }
}
