//! Simultaneous confidence intervals by the jackknife, and Student's t distribution.
//!
//! A quantity θ is a function of means over surfaces. Its standard error is computed by the
//! delete-one jackknife. Each replicate omits the same realization from all spectra, so differences
//! between spectra are paired. With n surfaces, (θ̂ − θ)/error follows Student's t distribution
//! with n − 1 degrees of freedom. This is exact for means of normal numbers and approximate for
//! smooth functions of means. Bonferroni's inequality gives intervals that cover several quantities
//! simultaneously. The method uses no random numbers, so results do not depend on a seed.
//!
//! The alternative, a max-t band from a bootstrap of whole surfaces, has much lower coverage with
//! few surfaces. It has neither the tails of Student's t nor the factor √(n/(n − 1)).

use std::f64::consts::{FRAC_PI_2, PI};

/// Confidence level of all intervals of a claim together.
///
/// It is also the level of each one-sided bound.
pub const LEVEL: f64 = 0.95;

/// Minimum number of surfaces for which intervals are computed.
///
/// With four surfaces, the intervals of four simultaneous quantities would be ± eight standard
/// errors.
pub const FEWEST_SURFACES: usize = 5;

/// Number of bisections for a quantile of Student's t; sufficient for double precision.
const BISECTIONS: u32 = 64;

/// Estimate of a quantity, with the standard errors that determine its confidence bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// Description of the quantity, such as `k_upper 8, k_lower 2 over 1, load 0.02`.
    pub label: String,
    /// Estimate from all surfaces.
    pub value: f64,
    /// Statistical standard error, which is zero for an exact value.
    pub error: f64,
    /// Systematic standard error, which does not decrease with more surfaces.
    pub systematic: f64,
    /// Number of surfaces in the smallest ensemble of the quantity; `None` for a closed form.
    pub surfaces: Option<usize>,
}

impl Bound {
    /// Creates a quantity that is exact except for rounding.
    pub fn exact(label: impl Into<String>, value: f64) -> Bound {
        Bound { label: label.into(), value, error: 0.0, systematic: 0.0, surfaces: None }
    }

    /// Returns `true` if the quantity is exact except for rounding.
    pub fn is_exact(&self) -> bool {
        self.error == 0.0 && self.systematic == 0.0
    }

    /// Returns a confidence interval that is wide enough for several quantities: the intervals of
    /// `quantities` quantities contain all true values with the probability [`LEVEL`].
    pub fn simultaneous(&self, quantities: usize) -> [f64; 2] {
        self.interval(1.0 - (1.0 - LEVEL) / quantities.max(1) as f64, self.surfaces)
    }

    /// Returns the lower and the upper one-sided confidence bound, each separately at the level
    /// [`LEVEL`].
    pub fn one_sided(&self) -> [f64; 2] {
        self.one_sided_of(1)
    }

    /// Returns the lower and the upper one-sided bound for a sample that is tested `looks` times
    /// while it grows.
    ///
    /// All lower bounds together are valid with the probability [`LEVEL`], and so are all upper
    /// bounds.
    pub fn one_sided_of(&self, looks: usize) -> [f64; 2] {
        let beyond = 1.0 - (2.0 * LEVEL - 1.0);
        self.interval(1.0 - beyond / looks as f64, self.surfaces)
    }

    /// Returns the same estimate with the standard error predicted for another number of surfaces
    /// with the same scatter.
    pub fn with_surfaces(&self, surfaces: usize) -> Bound {
        let now = self.surfaces.unwrap_or(surfaces) as f64;
        Bound {
            error: self.error * (now / surfaces as f64).sqrt(),
            surfaces: self.surfaces.map(|_| surfaces),
            ..self.clone()
        }
    }

    fn interval(&self, probability: f64, surfaces: Option<usize>) -> [f64; 2] {
        let freedom = surfaces.map(|surfaces| surfaces.saturating_sub(1).max(1) as u32);
        let factor = freedom.map_or(0.0, |freedom| two_sided_quantile(probability, freedom));
        let half = factor * libm::hypot(self.error, self.systematic);
        [self.value - half, self.value + half]
    }
}

/// Selection of the surfaces in a jackknife replicate: all, or all but one.
///
/// Ensembles with the same number of surfaces omit the same surface, because their realizations
/// share random numbers.
#[derive(Debug, Clone, Copy)]
pub struct Weights {
    /// Surface that is left out, and the number of surfaces of the ensembles that lack it.
    left_out: Option<(usize, usize)>,
}

impl Weights {
    /// Selection of all surfaces, as for the estimate itself.
    pub const ALL: Weights = Weights { left_out: None };

    /// Iterates over the values of the selected surfaces.
    pub fn values<'a>(&self, values: &'a [f64]) -> impl Iterator<Item = f64> + Clone + 'a {
        let left_out =
            self.left_out.filter(|(_, of)| *of == values.len()).map(|(surface, _)| surface);
        let surfaces = values.iter().enumerate();
        surfaces.filter_map(move |(surface, value)| (Some(surface) != left_out).then_some(*value))
    }

    /// Returns the mean of the values of the selected surfaces.
    pub fn mean(&self, values: &[f64]) -> f64 {
        mean(self.values(values))
    }

    /// Returns the sample standard deviation of the values of the selected surfaces.
    pub fn deviation(&self, values: &[f64]) -> f64 {
        deviation(self.values(values))
    }
}

/// Computes a quantity and its jackknife standard error over surfaces.
///
/// `quantity` computes it from the selected surfaces. `surfaces` contains the number of surfaces of
/// each ensemble. Returns `None` if one of these numbers is below [`FEWEST_SURFACES`], or if
/// `quantity` returns `None`.
pub fn jackknife(
    label: String,
    surfaces: &[usize],
    quantity: impl Fn(&Weights) -> Option<f64>,
) -> Option<Bound> {
    let fewest = surfaces.iter().copied().min()?;
    if fewest < FEWEST_SURFACES {
        return None;
    }
    let value = quantity(&Weights::ALL)?;
    let mut counts = surfaces.to_vec();
    counts.sort_unstable();
    counts.dedup();
    let mut variance = 0.0;
    for of in counts {
        let without = |surface| quantity(&Weights { left_out: Some((surface, of)) });
        let replicates: Vec<f64> = (0..of).map(without).collect::<Option<_>>()?;
        // The jackknife variance is (n − 1)/n Σ (θ̂₍ᵢ₎ − θ̄)².
        let inflation = (of - 1) as f64 * (of - 1) as f64 / of as f64;
        variance += inflation * deviation(replicates.iter().copied()).powi(2);
    }
    Some(Bound { label, value, error: variance.sqrt(), systematic: 0.0, surfaces: Some(fewest) })
}

pub(crate) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count)
}

pub(crate) fn deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let mean = mean(values.clone());
    let count = values.clone().count() as f64;
    let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
    without_rounding((squares / (count - 1.0)).sqrt(), mean)
}

/// Returns the standard deviation or error of a mean, or zero if it is a rounding error: equal
/// values differ from their mean by rounding errors only.
pub(crate) fn without_rounding(deviation: f64, mean: f64) -> f64 {
    if deviation > 1e-13 * mean.abs() { deviation } else { 0.0 }
}

/// Returns the two-sided confidence interval of a mean with this standard error, by Student's t
/// distribution.
pub(crate) fn interval_of_student(
    mean: f64,
    error: f64,
    freedom: u32,
    probability: f64,
) -> [f64; 2] {
    let half = two_sided_quantile(probability, freedom) * error;
    [mean - half, mean + half]
}

/// Returns the t with P(|T| ≤ t) = `probability` for Student's t distribution with `freedom`
/// degrees of freedom.
///
/// The probability is between 0 and 1, and `freedom` is at least one.
pub fn two_sided_quantile(probability: f64, freedom: u32) -> f64 {
    let (mut below, mut above) = (0.0, FRAC_PI_2);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (below + above);
        if within(middle, freedom) < probability {
            below = middle;
        } else {
            above = middle;
        }
    }
    f64::from(freedom).sqrt() * libm::tan(0.5 * (below + above))
}

/// Returns P(|T| ≤ √ν tan θ) for Student's T with ν = `freedom` and θ = `angle`.
///
/// The finite sums are eqs. 26.7.3 and 26.7.4 of Abramowitz & Stegun, *Handbook of Mathematical
/// Functions* (1964).
pub(crate) fn within(angle: f64, freedom: u32) -> f64 {
    let (sine, cosine) = libm::sincos(angle);
    // The terms contain every second power of cos θ, from 1 for even ν and from cos θ for odd ν.
    let is_odd = freedom % 2 == 1;
    let mut term = if is_odd { cosine } else { 1.0 };
    let mut sum = 0.0;
    for power in (u32::from(is_odd)..freedom.saturating_sub(1)).step_by(2) {
        sum += term;
        term *= cosine * cosine * f64::from(power + 1) / f64::from(power + 2);
    }
    if is_odd { (angle + sine * sum) * 2.0 / PI } else { sine * sum }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::normal;

    /// Values, indexed as `[quantity][surface]`.
    type Samples = Vec<Vec<f64>>;

    /// Draws values of independent quantities.
    fn independent(seed: u64, quantities: usize, surfaces: usize) -> Samples {
        let sample = |index: usize| normal(1000 * seed + index as u64, surfaces);
        (0..quantities).map(sample).collect()
    }

    /// Draws values of quantities of nine spectra. Quantities of the same spectrum share most of
    /// their scatter.
    fn structured(seed: u64, quantities: usize, surfaces: usize) -> Samples {
        let spectra = independent(2 * seed, 9, surfaces);
        let own = independent(2 * seed + 1, quantities, surfaces);
        let mixed = own.iter().enumerate().map(|(index, own)| {
            let shared = &spectra[index % 9];
            let values = own.iter().zip(shared);
            values.map(|(own, shared)| 0.6 * own + 0.8 * shared).collect()
        });
        mixed.collect()
    }

    /// Function that draws values from a seed and the numbers of quantities and surfaces.
    type Scatter = fn(u64, usize, usize) -> Samples;

    /// Returns the fraction of samples in which the simultaneous intervals of the logarithms of all
    /// means cover the true values.
    fn coverage(
        samples: Scatter,
        quantities: usize,
        surfaces: usize,
        value: fn(f64) -> f64,
        truth: f64,
    ) -> f64 {
        const STUDIES: u64 = 300;
        let covers = |study: &u64| {
            let samples = samples(*study, quantities, surfaces);
            samples.iter().all(|sample| {
                let values: Vec<f64> = sample.iter().map(|&normal| value(normal)).collect();
                let bound = jackknife(String::new(), &[surfaces], |weights| {
                    Some(weights.mean(&values).ln())
                });
                let [lower, upper] = bound.unwrap().simultaneous(quantities);
                lower <= truth.ln() && truth.ln() <= upper
            })
        };
        (0..STUDIES).filter(covers).count() as f64 / STUDIES as f64
    }

    /// Numbers of quantities of typical claims, each with the generator of the values.
    const CASES: [(usize, Scatter); 4] =
        [(1, independent), (9, independent), (36, structured), (72, independent)];
    const SURFACES: [usize; 4] = [5, 10, 20, 50];

    #[test]
    fn simultaneous_intervals_have_their_coverage_with_few_surfaces() {
        for (quantities, samples) in CASES {
            for surfaces in SURFACES {
                let scattered = |normal: f64| 1.0 + 0.05 * normal;
                let found = coverage(samples, quantities, surfaces, scattered, 1.0);
                // The binomial error of 300 studies is 0.013. Bonferroni's bound is conservative
                // for correlated loads.
                assert!((0.91..=0.99).contains(&found), "{quantities} × {surfaces}: {found}");
            }
        }
    }

    #[test]
    fn logarithms_of_skewed_areas_are_covered_as_well() {
        for (quantities, samples) in CASES {
            for surfaces in SURFACES {
                // Areas of single surfaces scatter by 0.01 to 0.1; this lognormal scatters by 0.25.
                let lognormal = |normal: f64| (0.25 * normal).exp();
                let truth = (0.25_f64 * 0.25 / 2.0).exp();
                let found = coverage(samples, quantities, surfaces, lognormal, truth);
                assert!((0.89..=0.99).contains(&found), "{quantities} × {surfaces}: {found}");
            }
        }
    }

    #[test]
    fn the_jackknife_of_a_mean_is_its_standard_error() {
        let values = normal(1, 12);
        let bound = jackknife(String::new(), &[12], |weights| Some(weights.mean(&values))).unwrap();
        let expected = Weights::ALL.deviation(&values) / 12_f64.sqrt();
        assert!((bound.error / expected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn common_scatter_cancels_in_differences() {
        let shared = normal(2, 10);
        let [one, other] = [1.0, 1.3]
            .map(|factor| shared.iter().map(|x| factor * (0.1 * x).exp()).collect::<Vec<_>>());
        let bound = jackknife(String::new(), &[10, 10], |weights| {
            Some((weights.mean(&other) / weights.mean(&one)).ln())
        });
        assert!(bound.unwrap().error < 1e-12);
    }

    #[test]
    fn ensembles_of_other_sizes_add_their_variances() {
        let (few, many) = (normal(3, 6), normal(4, 24));
        let error = |surfaces: &[usize], of: &dyn Fn(&Weights) -> f64| {
            jackknife(String::new(), surfaces, |weights| Some(of(weights))).unwrap().error
        };
        let alone = [
            error(&[6], &|weights| weights.mean(&few)),
            error(&[24], &|weights| weights.mean(&many)),
        ];
        let both = error(&[6, 24], &|weights| weights.mean(&few) - weights.mean(&many));
        assert!((both.powi(2) - alone[0].powi(2) - alone[1].powi(2)).abs() < 1e-12);
    }

    #[test]
    fn fewer_surfaces_than_five_have_no_interval() {
        let values = normal(1, 4);
        assert_eq!(jackknife(String::new(), &[4], |weights| Some(weights.mean(&values))), None);
    }

    #[test]
    fn quantiles_are_those_of_the_tables() {
        // The columns are the two-sided quantiles for 90, 95 and 99 %.
        let printed = [
            (1, [6.314, 12.706, 63.657]),
            (2, [2.920, 4.303, 9.925]),
            (4, [2.132, 2.776, 4.604]),
            (9, [1.833, 2.262, 3.250]),
            (49, [1.677, 2.010, 2.680]),
        ];
        for (freedom, quantiles) in printed {
            for (probability, quantile) in [0.9, 0.95, 0.99].into_iter().zip(quantiles) {
                let found = two_sided_quantile(probability, freedom);
                assert!((found - quantile).abs() < 5.1e-4, "{freedom}: {found}");
            }
        }
    }

    #[test]
    fn one_and_two_degrees_of_freedom_have_closed_forms() {
        for probability in [0.1, 0.5, 0.95, 0.999] {
            let cauchy = (FRAC_PI_2 * probability).tan();
            let found = two_sided_quantile(probability, 1);
            assert!((found / cauchy - 1.0).abs() < 1e-12, "{found}");
            let two: f64 = probability * (2.0 / (1.0 - probability * probability)).sqrt();
            let found = two_sided_quantile(probability, 2);
            assert!((found / two - 1.0).abs() < 1e-12, "{found}");
        }
    }

    #[test]
    fn many_degrees_of_freedom_are_normal() {
        // The expansion of Cornish & Fisher is t = z + (z³ + z)/(4ν) + O(ν⁻²).
        let normal = 1.959_963_984_540_054_f64;
        let correction = (normal.powi(3) + normal) / 4.0;
        for freedom in [10_000, 10_001] {
            let found = two_sided_quantile(0.95, freedom);
            let expected = normal + correction / f64::from(freedom);
            assert!((found - expected).abs() < 1e-7, "{found}");
        }
    }

    #[test]
    fn intervals_of_the_mean_have_the_nominal_coverage_with_few_values() {
        for count in [3, 5, 10] {
            let experiments = 2000;
            let covered = (0..experiments).filter(|&experiment| {
                let values = normal(experiment, count);
                let mean = values.iter().sum::<f64>() / count as f64;
                let square = values.iter().map(|value| (value - mean).powi(2));
                let freedom = count as f64 - 1.0;
                let error = (square.sum::<f64>() / freedom / count as f64).sqrt();
                mean.abs() <= two_sided_quantile(0.95, count as u32 - 1) * error
            });
            // The binomial error of 2000 experiments is 0.005. Percentile intervals cover only 0.84
            // with five values.
            let rate = covered.count() as f64 / experiments as f64;
            assert!((rate - 0.95).abs() < 0.02, "{count}: {rate}");
        }
    }
}
