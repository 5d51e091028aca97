//! Multilevel Monte Carlo means: many surfaces on a coarse mesh, and few of them on finer meshes.
//!
//! Let Y₀, …, Y_L be a quantity of one surface on meshes from the coarsest to the finest. The mean
//! on the finest mesh is the mean of Y₀ plus the means of the differences D_ℓ = Y_ℓ − Y_ℓ₋₁ of
//! equal surfaces. Differences vary less than Y between surfaces, so that few surfaces determine
//! their means (Giles, *Oper. Res.* 56, 607–617, 2008; *Acta Numer.* 24, 259–328, 2015).
//!
//! The surfaces of a mesh are the first N_ℓ ≤ N_ℓ₋₁ surfaces of the next coarser one. The terms are
//! then correlated. With D₀ = Y₀ and C_kℓ = cov(D_k, D_ℓ), the variance of the mean is
//!
//! ```text
//! T = Σ_k W_k / N_k,   W_k = C_kk + 2 Σ_(ℓ > k) C_kℓ,
//! ```
//!
//! where W_k = var(Y_L − Y_k₋₁) − var(Y_L − Y_k). Each variance C_kk is estimated from all surfaces
//! of its term, and each covariance is r_kℓ √(C_kk C_ℓℓ) with the correlation r_kℓ of the surfaces
//! that both terms share. The covariance of a few surfaces can exceed the variances of many, and T
//! would be negative. A correlation cannot: with two meshes, T is never negative. With more meshes
//! it is in one of 10,000 ensembles of 12, 4 and 2 surfaces; T then leaves out the covariances. The
//! price is a bias of T of at most 7 %, in ensembles as small as 12, 4 and 2 surfaces, or 10 and 3
//! (13 % with 10 and 2).
//!
//! If covariances were estimated as such, the estimate of T for normal values would be a quadratic
//! form whose variance has a closed form in C_kℓ and N_ℓ. By Satterthwaite's method, intervals use
//! Student's t with 2 T²/var(T) degrees of freedom. If covariances were known to be zero, these
//! would be the degrees of freedom of Welch & Satterthwaite. (Their formula covers 93 % instead of
//! 95 % if terms are strongly and positively correlated.)
//!
//! Coverage of 95 % intervals, in 4000 simulated ensembles of normal values with standard
//! deviations 1, 0.3 and 0.1 of the terms, and a correlation ρ of D₀ with each difference:
//!
//! | surfaces | ρ = −0.9 | 0 | 0.9 |
//! |---|---|---|---|
//! | 400, 60, 10 | 0.953 | 0.952 | 0.947 |
//! | 20, 6, 3 | 0.963 | 0.954 | 0.953 |
//! | 40, 10, 4 | 0.953 | 0.956 | 0.953 |
//! | 10, 5 | 0.963 | 0.957 | 0.955 |
//! | 40, 2 | 0.918 | 0.920 | 0.918 |

use crate::differences::degrees_of_freedom;
use crate::intervals::{interval_of_student, mean, without_rounding};

/// Mean on the finest mesh, with its standard error.
#[derive(Debug, Clone, PartialEq)]
pub struct MultilevelMean {
    /// Estimate of the mean on the finest mesh.
    pub value: f64,
    /// Standard error of the estimate.
    pub error: f64,
    /// Degrees of freedom of Student's t, rounded down.
    pub freedom: u32,
    /// Terms of the mean: the mean on the coarsest mesh, then the differences of neighbouring
    /// meshes.
    pub terms: Vec<Term>,
}

/// Term of a multilevel mean: the mean on the coarsest mesh, or a mean difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// Number of surfaces.
    pub surfaces: usize,
    /// Mean of the term over its surfaces.
    pub mean: f64,
    /// Variance of the term between surfaces.
    pub variance: f64,
    /// Variance W_k: that of the term plus twice its covariances with all finer terms. The variance
    /// of the multilevel mean is the sum of W_k / N_k over all terms.
    pub weighted_variance: f64,
}

impl MultilevelMean {
    /// Computes the mean from `values[level][surface]`, from the coarsest mesh to the finest. The
    /// surfaces of a mesh are the first ones of the next coarser mesh, in the same order.
    ///
    /// Returns `None` if there is no mesh, if a mesh has a single surface or none, or if a mesh has
    /// more surfaces than the next coarser one.
    pub fn new(values: &[Vec<f64>]) -> Option<MultilevelMean> {
        let are_nested = values.windows(2).all(|pair| pair[1].len() <= pair[0].len());
        if values.last().is_none_or(|finest| finest.len() < 2) || !are_nested {
            return None;
        }
        let samples = Samples::new(values);
        let (samples, variance, freedom) = samples.with_variance_of_mean();
        let terms: Vec<Term> = (0..values.len()).map(|level| samples.term(level)).collect();
        let value = terms.iter().map(|term| term.mean).sum();
        Some(MultilevelMean {
            value,
            error: without_rounding(variance.sqrt(), value),
            freedom,
            terms,
        })
    }

    /// Returns the two-sided confidence interval with this probability.
    pub fn interval(&self, probability: f64) -> [f64; 2] {
        interval_of_student(self.value, self.error, self.freedom, probability)
    }

    /// Returns the share of each term in the variance of the mean.
    ///
    /// The shares add up to one; a share is negative if the covariances of its term outweigh its
    /// variance. Returns zeros if the values do not vary.
    pub fn shares(&self) -> Vec<f64> {
        let parts = self.terms.iter().map(|term| term.weighted_variance / term.surfaces as f64);
        let sum: f64 = parts.clone().sum();
        parts.map(|part| if self.error > 0.0 { part / sum } else { 0.0 }).collect()
    }
}

/// Values of the terms, and their covariances.
struct Samples {
    /// Values, indexed as `[level][surface]`.
    values: Vec<Vec<f64>>,
    means: Vec<f64>,
    /// Covariances C_kℓ of the terms.
    covariances: Vec<Vec<f64>>,
}

impl Samples {
    fn new(values: &[Vec<f64>]) -> Samples {
        let term = |level: usize| match level {
            0 => values[0].clone(),
            _ => values[level]
                .iter()
                .zip(&values[level - 1])
                .map(|(fine, coarse)| fine - coarse)
                .collect(),
        };
        let values: Vec<Vec<f64>> = (0..values.len()).map(term).collect();
        let means = values.iter().map(|values| mean(values.iter().copied())).collect();
        let covariance = |one: usize, other: usize| covariance(&values[one], &values[other]);
        let levels = 0..values.len();
        let covariances =
            levels.clone().map(|one| levels.clone().map(|other| covariance(one, other)).collect());
        Samples { covariances: covariances.collect(), means, values }
    }

    fn levels(&self) -> usize {
        self.values.len()
    }

    /// Returns the number of surfaces of a level.
    fn surfaces(&self, level: usize) -> f64 {
        self.values[level].len() as f64
    }

    fn term(&self, level: usize) -> Term {
        let variance = self.covariances[level][level];
        let finer: f64 = self.covariances[level][level + 1..].iter().sum();
        Term {
            surfaces: self.values[level].len(),
            mean: self.means[level],
            variance,
            weighted_variance: variance + 2.0 * finer,
        }
    }

    /// Returns the samples with the variance of the mean and the degrees of freedom of this
    /// estimate. Leaves out the covariances if the variance would be negative with them.
    fn with_variance_of_mean(mut self) -> (Samples, f64, u32) {
        let (with_covariances, freedom) = self.quadratic_form();
        if with_covariances > 0.0 {
            return (self, with_covariances, freedom);
        }
        for (level, covariances) in self.covariances.iter_mut().enumerate() {
            let variance = covariances[level];
            covariances.fill(0.0);
            covariances[level] = variance;
        }
        let (variance, freedom) = self.quadratic_form();
        (self, variance, freedom)
    }

    /// Returns the variance T = Σ a_kℓ C_kℓ (N − 1) of the mean, and the degrees of freedom
    /// 2 T²/var(T). Here N is the number of surfaces that the terms share, and
    /// var(T) = 2 Σ a_kℓ C_ℓp a_pq C_qk (N − 1).
    fn quadratic_form(&self) -> (f64, u32) {
        let covariance = |one: usize, other: usize| self.covariances[one][other];
        let shared = |levels: &[usize]| {
            let finest = levels.iter().copied().max().unwrap_or(0);
            self.surfaces(finest) - 1.0
        };
        let factor = |one: usize, other: usize| {
            1.0 / (self.surfaces(one.min(other)) * shared(&[one, other]))
        };
        let pairs =
            || (0..self.levels()).flat_map(|one| (0..self.levels()).map(move |other| (one, other)));
        let terms = pairs().map(|(k, l)| factor(k, l) * covariance(k, l) * shared(&[k, l]));
        let variance: f64 = terms.sum();
        let half_variance_of_variance: f64 = pairs()
            .flat_map(|(k, l)| pairs().map(move |(p, q)| [k, l, p, q]))
            .map(|[k, l, p, q]| {
                let factors = factor(k, l) * factor(p, q) * shared(&[k, l, p, q]);
                factors * covariance(l, p) * covariance(q, k)
            })
            .sum();
        let least = shared(&[self.levels() - 1]);
        let most: f64 = (0..self.levels()).map(|level| self.surfaces(level) - 1.0).sum();
        let freedom = variance.powi(2) / half_variance_of_variance;
        // A quotient of two zeros is that of values which do not vary.
        let bounded = if freedom > least { freedom.min(most) } else { least };
        (variance, degrees_of_freedom(bounded))
    }
}

/// Returns the covariance of two terms: the correlation of the surfaces that both have, the first
/// ones of each, times the standard deviations of all their surfaces.
fn covariance(one: &[f64], other: &[f64]) -> f64 {
    let shared = one.len().min(other.len());
    let ratio = |values: &[f64]| {
        let of_shared = covariance_of_equal(&values[..shared], &values[..shared]);
        if of_shared > 0.0 { covariance_of_equal(values, values) / of_shared } else { 0.0 }
    };
    covariance_of_equal(&one[..shared], &other[..shared]) * (ratio(one) * ratio(other)).sqrt()
}

fn covariance_of_equal(one: &[f64], other: &[f64]) -> f64 {
    let [mean_of_one, mean_of_other] = [one, other].map(|values| mean(values.iter().copied()));
    let products = one.iter().zip(other).map(|(a, b)| (a - mean_of_one) * (b - mean_of_other));
    products.sum::<f64>() / (one.len() as f64 - 1.0)
}

/// Variance and cost that decide how many surfaces a level needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelCost {
    /// Variance W_k; see [`Term::weighted_variance`].
    pub variance: f64,
    /// Cost of a surface, in any unit.
    pub cost: f64,
}

/// Returns the numbers of surfaces, from the coarsest mesh to the finest, that give the mean a
/// variance at least cost, if no mesh has fewer surfaces than a finer one:
/// N_k = √(W_k/C_k) Σ_ℓ √(W_ℓ C_ℓ) / variance.
///
/// If N_k would grow from a mesh to the next finer one, both have the same number of surfaces and
/// count as one mesh with the sums of their W and C. A negative sum of W counts as zero.
pub fn best_numbers(levels: &[LevelCost], variance: f64) -> Vec<f64> {
    let pools = pools(levels);
    let roots = pools.iter().map(|(pool, _)| (pool.variance.max(0.0) * pool.cost).sqrt());
    let sum: f64 = roots.sum();
    let numbers = pools.iter().flat_map(|(pool, levels)| {
        let number = (pool.variance.max(0.0) / pool.cost).sqrt() * sum / variance;
        std::iter::repeat_n(number, *levels)
    });
    numbers.collect()
}

/// Unites neighbouring meshes until W/C decreases from each to the next finer one. Returns the sums
/// of W and C, with the number of meshes.
fn pools(levels: &[LevelCost]) -> Vec<(LevelCost, usize)> {
    let mut pools: Vec<(LevelCost, usize)> = Vec::new();
    for &level in levels {
        let mut pool = (level, 1);
        while let Some((coarser, count)) = pools
            .pop_if(|(coarser, _)| coarser.variance * pool.0.cost < pool.0.variance * coarser.cost)
        {
            let variance = coarser.variance + pool.0.variance;
            pool = (LevelCost { variance, cost: coarser.cost + pool.0.cost }, count + pool.1);
        }
        pools.push(pool);
    }
    pools
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::normal;

    /// Correlated values of surfaces on meshes: the mean 2 on the finest mesh, and terms with the
    /// standard deviations 1, 0.3, 0.1, … and a correlation ρ with the first term.
    fn values(seed: u64, surfaces: &[usize], correlation: f64) -> Vec<Vec<f64>> {
        let first = normal(100 * seed, surfaces[0]);
        let mut known: Vec<Vec<f64>> = vec![first.iter().map(|x| 2.0 + x).collect()];
        for (level, &count) in surfaces.iter().enumerate().skip(1) {
            let own = normal(100 * seed + level as u64, count);
            let deviation = [1.0, 0.3, 0.1, 0.03][level];
            let uncorrelated = (1.0 - correlation * correlation).sqrt();
            let terms =
                own.iter().zip(&first).map(|(own, first)| correlation * first + uncorrelated * own);
            let coarser = &known[level - 1];
            known
                .push(terms.zip(coarser).map(|(term, coarse)| coarse + deviation * term).collect());
        }
        known
    }

    #[test]
    fn one_mesh_has_the_interval_of_student() {
        let found = MultilevelMean::new(&[vec![1.0, 2.0, 3.0, 4.0, 5.0]]).unwrap();
        assert_eq!((found.value, found.freedom), (3.0, 4));
        assert!((found.error - 0.5_f64.sqrt()).abs() < 1e-15);
        assert_eq!(found.shares(), [1.0]);
    }

    #[test]
    fn two_meshes_have_the_closed_form_with_the_covariance() {
        let coarse = vec![1.0, 2.0, 4.0, 7.0, 11.0];
        let fine = vec![1.5, 2.0, 5.0];
        let found = MultilevelMean::new(&[coarse, fine]).unwrap();
        // The differences are 0.5, 0 and 1. Their correlation with 1, 2 and 4 is 1/2 over the root
        // of 7/3 and 1/4.
        let covariance = 0.5 * (16.5 / (7.0 / 3.0_f64)).sqrt();
        let [first, second] = found.terms[..] else { panic!("two terms") };
        assert!((found.value - (5.0 + 0.5)).abs() < 1e-14);
        assert!((first.variance - 16.5).abs() < 1e-13);
        assert!((second.variance - 0.25).abs() < 1e-15);
        assert!((first.weighted_variance - (16.5 + 2.0 * covariance)).abs() < 1e-13);
        let variance = (16.5 + 2.0 * covariance) / 5.0 + 0.25 / 3.0;
        assert!((found.error.powi(2) - variance).abs() < 1e-13);
        assert!((found.shares()[1] - 0.25 / 3.0 / variance).abs() < 1e-13);
    }

    #[test]
    fn equal_surfaces_on_all_meshes_have_the_plain_mean_and_interval_of_the_finest() {
        let known = values(3, &[12, 12, 12], 0.5);
        let found = MultilevelMean::new(&known).unwrap();
        let plain = MultilevelMean::new(&known[2..]).unwrap();
        assert!((found.value - plain.value).abs() < 1e-14);
        assert!((found.error / plain.error - 1.0).abs() < 1e-12);
        assert_eq!(found.freedom, plain.freedom);
    }

    #[test]
    fn freedom_is_that_of_welch_and_satterthwaite_but_for_the_error_of_the_covariance() {
        let coarse = vec![-1.0, -1.0, 1.0, 1.0, -3.0, 3.0, 0.0, 0.0];
        let terms = [1.0, -1.0, 1.0, -1.0];
        let fine = coarse.iter().zip(terms).map(|(coarse, term)| coarse + term).collect();
        let found = MultilevelMean::new(&[coarse, fine]).unwrap();
        let [one, other] = [22.0 / 7.0 / 8.0, 4.0 / 3.0 / 4.0_f64];
        // The estimated covariance is zero, with the variance V₀ V₁/(N₁ − 1); its weight is 2/N₀.
        let covariance = 4.0 / 64.0 * (22.0 / 7.0) * (4.0 / 3.0) / 3.0;
        let half = one * one / 7.0 + other * other / 3.0 + covariance / 2.0;
        let freedom = (one + other).powi(2) / half;
        assert_eq!(found.freedom, freedom as u32);
    }

    #[test]
    fn intervals_cover_the_mean_of_the_finest_mesh() {
        const ENSEMBLES: u64 = 400;
        for surfaces in [&[400, 60, 10][..], &[40, 10, 4], &[20, 6, 3], &[10, 5], &[60, 15, 6, 4]] {
            for correlation in [-0.9, 0.0, 0.9] {
                let covers = |seed: &u64| {
                    let found = MultilevelMean::new(&values(*seed, surfaces, correlation)).unwrap();
                    let [lower, upper] = found.interval(0.95);
                    lower <= 2.0 && 2.0 <= upper
                };
                let share = (0..ENSEMBLES).filter(covers).count() as f64 / ENSEMBLES as f64;
                // The binomial error of 400 ensembles is 0.011.
                assert!((0.925..=0.985).contains(&share), "{surfaces:?} {correlation}: {share}");
            }
        }
    }

    #[test]
    fn variance_is_estimated_with_little_bias() {
        for correlation in [-0.9, 0.9] {
            let found = (0..2000)
                .map(|seed| MultilevelMean::new(&values(seed, &[12, 4, 2], correlation)).unwrap());
            let found: Vec<_> = found.collect();
            let expected = mean(found.iter().map(|found| found.error.powi(2)));
            let actual = mean(found.iter().map(|found| (found.value - 2.0).powi(2)));
            // The relative error of a variance from 2000 values is √(2/2000) = 0.03.
            assert!((expected / actual - 1.0).abs() < 0.12, "{correlation}: {expected} {actual}");
        }
    }

    #[test]
    fn the_error_of_two_meshes_does_not_jump() {
        let coarse: Vec<f64> = [&[0.0, 10.0][..], &[5.0; 8]].concat();
        let error = |difference: f64| {
            let fine = vec![0.0, 10.0 + difference];
            MultilevelMean::new(&[coarse.clone(), fine]).unwrap().error
        };
        // The differences 0 and d have the variance d²/2 and the correlation of the sign of d with
        // the coarse values, of the variance 50/9.
        for step in -100..=100 {
            let difference = 0.1 * f64::from(step);
            let (one, other) = (50.0 / 9.0 / 10.0, difference * difference / 4.0);
            let covariance = difference * (25.0 / 9.0_f64).sqrt();
            let expected = (one + 2.0 * covariance / 10.0 + other).sqrt();
            assert!((error(difference) - expected).abs() < 1e-12, "{difference}");
            assert!(error(difference) >= 0.6, "{difference}: {}", error(difference));
        }
    }

    #[test]
    fn covariances_that_would_make_the_variance_negative_are_left_out() {
        let negative = (0..50_000).find_map(|seed| {
            let known = values(seed, &[12, 4, 2], -0.9);
            let (with_covariances, _) = Samples::new(&known).quadratic_form();
            (with_covariances <= 0.0).then_some(known)
        });
        let found = MultilevelMean::new(&negative.expect("one in 10,000")).unwrap();
        let variance: f64 =
            found.terms.iter().map(|term| term.variance / term.surfaces as f64).sum();
        assert!((found.error.powi(2) / variance - 1.0).abs() < 1e-12);
        assert!((found.shares().iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn single_surfaces_and_surfaces_that_a_coarser_mesh_lacks_have_no_mean() {
        assert_eq!(MultilevelMean::new(&[]), None);
        assert_eq!(MultilevelMean::new(&[vec![1.0, 2.0], vec![1.0]]), None);
        assert_eq!(MultilevelMean::new(&[vec![1.0, 2.0], vec![1.0, 2.0, 3.0]]), None);
    }

    #[test]
    fn values_that_do_not_vary_have_no_error() {
        let found = MultilevelMean::new(&[vec![0.1; 6], vec![0.3; 3]]).unwrap();
        assert_eq!(found.error, 0.0);
        assert!((found.value - 0.3).abs() < 1e-15);
    }

    #[test]
    fn best_numbers_have_the_variance_at_the_least_cost() {
        let levels = [(1.0, 1.0), (0.09, 4.0), (0.01, 16.0)];
        let levels = levels.map(|(variance, cost)| LevelCost { variance, cost });
        let numbers = best_numbers(&levels, 1e-3);
        let pairs = || levels.iter().zip(&numbers);
        let variance: f64 = pairs().map(|(level, number)| level.variance / number).sum();
        let cost: f64 = pairs().map(|(level, number)| level.cost * number).sum();
        assert!((variance / 1e-3 - 1.0).abs() < 1e-12);
        // (Σ √(W_k C_k))² / variance, with square roots 1, 0.6 and 0.4.
        assert!((cost * 1e-3 - 4.0).abs() < 1e-12);
        // A difference that varies more than the coarsest mesh needs as many surfaces there.
        let equal = [(1.0, 1.0), (9.0, 4.0)].map(|(variance, cost)| LevelCost { variance, cost });
        let numbers = best_numbers(&equal, 0.1);
        assert!(numbers.iter().all(|number| (number - 100.0).abs() < 1e-9), "{numbers:?}");
        // A negative variance of the coarsest mesh lowers that of the next one.
        let negative =
            [(-1.0, 1.0), (3.0, 4.0)].map(|(variance, cost)| LevelCost { variance, cost });
        assert!(best_numbers(&negative, 0.1).iter().all(|number| (number - 20.0).abs() < 1e-9));
    }
}
