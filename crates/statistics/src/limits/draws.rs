//! Intervals of limits, and how often each choice of forms wins, by resampling whole surfaces. A
//! surface is drawn equally often at all its points.

use std::f64::consts::PI;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::{LimitFit, LimitProblem, Observed, TermForm};
use crate::bootstrap::{Bootstrap, Estimate, Intervals, Resample};

/// What resampling says of several choices of forms.
#[derive(Debug, Clone, PartialEq)]
pub struct Resampled {
    /// Intervals of each choice: of the limit, the coefficients, and the free exponents in the order of
    /// their terms.
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

/// Resamples all choices alike.
pub fn resample(
    problem: &LimitProblem,
    rivals: &[(&[TermForm], &LimitFit)],
    bootstrap: &Bootstrap,
) -> Resampled {
    let units = problem.points.iter().filter_map(|point| match &point.observed {
        Observed::Surfaces { units, .. } => Some(&units[..]),
        Observed::Estimate { .. } => None,
    });
    let resample = Resample { fewest: problem.surfaces(), ..Resample::of(units) };
    // Akaike's criterion of each choice in each resampling.
    let mut criteria: Vec<Vec<f64>> = Vec::new();
    let intervals = rivals.iter().map(|(forms, fit)| {
        let mut own = Vec::with_capacity(bootstrap.replicates);
        let fits = bootstrap.of_units(resample, &estimates(forms, fit), |replicate, times| {
            let (means, used) = drawn(problem, times, replicate, bootstrap.seed);
            let refit = problem.fit_to(forms, &means, &used, Some(fit));
            own.push(refit.as_ref().map_or(f64::INFINITY, LimitFit::akaike));
            refit.map(|refit| parameters(forms, &refit))
        });
        criteria.push(own);
        fits
    });
    Resampled { intervals: intervals.collect(), comparison: compared(rivals, &criteria) }
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
    let mut normals = Normals::new(seed, replicate);
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

/// Standard normal numbers, as a function of seed and replicate.
struct Normals(ChaCha8Rng);

impl Normals {
    fn new(seed: u64, replicate: usize) -> Normals {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(b"estimate");
        let mut random = ChaCha8Rng::from_seed(key);
        random.set_stream(replicate as u64);
        Normals(random)
    }

    /// After Box & Muller (1958).
    fn next(&mut self) -> f64 {
        // Odd multiples of 2⁻⁵⁴: never zero.
        let mut uniform = || ((self.0.next_u64() >> 11) as f64 + 0.5) * 2f64.powi(-53);
        let radius = (-2.0 * libm::log(uniform())).sqrt();
        radius * libm::cos(2.0 * PI * uniform())
    }
}
