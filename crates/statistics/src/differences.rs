//! Differences between the means of two samples: Student's and Welch's intervals, and Holm's
//! correction for many comparisons.

use crate::intervals::{deviation, interval_of_student, mean, within};

/// Difference between two means, with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanDifference {
    /// Mean of the second sample minus mean of the first.
    pub value: f64,
    /// Standard error of the difference.
    pub error: f64,
    /// Degrees of freedom of Student's t.
    pub freedom: u32,
}

impl MeanDifference {
    /// Computes the mean of paired differences. Its degrees of freedom are n − 1.
    ///
    /// Returns `None` if there are fewer than two differences.
    pub fn paired(differences: &[f64]) -> Option<MeanDifference> {
        let count = differences.len();
        if count < 2 {
            return None;
        }
        Some(MeanDifference {
            value: mean(differences.iter().copied()),
            error: deviation(differences.iter().copied()) / (count as f64).sqrt(),
            freedom: degrees_of_freedom(count as f64 - 1.0),
        })
    }

    /// Computes the difference of the means of two independent samples by Welch's method, for
    /// samples of different variances. The degrees of freedom of Welch & Satterthwaite are rounded
    /// down.
    ///
    /// Returns `None` if a sample has fewer than two values.
    pub fn independent(first: &[f64], second: &[f64]) -> Option<MeanDifference> {
        if first.len() < 2 || second.len() < 2 {
            return None;
        }
        // Variance of the mean of each sample.
        let [one, other] = [first, second]
            .map(|values| deviation(values.iter().copied()).powi(2) / values.len() as f64);
        let sum = one + other;
        let share = |variance: f64, values: &[f64]| variance.powi(2) / (values.len() as f64 - 1.0);
        let freedom = sum.powi(2) / (share(one, first) + share(other, second));
        Some(MeanDifference {
            value: mean(second.iter().copied()) - mean(first.iter().copied()),
            error: sum.sqrt(),
            freedom: degrees_of_freedom(freedom),
        })
    }

    /// Returns the two-sided confidence interval with this probability.
    pub fn interval(&self, probability: f64) -> [f64; 2] {
        interval_of_student(self.value, self.error, self.freedom, probability)
    }

    /// Returns the probability of a difference of at least this magnitude if the means are equal.
    pub fn p_value(&self) -> f64 {
        if self.error == 0.0 {
            return if self.value == 0.0 { 1.0 } else { 0.0 };
        }
        let angle = libm::atan(self.value.abs() / self.error / f64::from(self.freedom).sqrt());
        (1.0 - within(angle, self.freedom)).max(0.0)
    }
}

/// Rounds degrees of freedom down. Constant samples have none; they get one, which changes
/// nothing, because their standard error is zero.
pub(crate) fn degrees_of_freedom(freedom: f64) -> u32 {
    if freedom >= 1.0 { (freedom + 1e-9).min(f64::from(u32::MAX)) as u32 } else { 1 }
}

/// Adjusts the p-values of several comparisons by Holm's method (*Scand. J. Statist.* 6, 65–70,
/// 1979).
///
/// If all means are equal, the probability that any adjusted value is at most α is at most α. The
/// comparisons need not be independent.
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&one, &other| p_values[one].total_cmp(&p_values[other]));
    let mut adjusted = vec![0.0; p_values.len()];
    let mut largest = 0.0_f64;
    for (rank, index) in order.into_iter().enumerate() {
        let remaining = (p_values.len() - rank) as f64;
        largest = largest.max((remaining * p_values[index]).min(1.0));
        adjusted[index] = largest;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intervals::two_sided_quantile;
    use crate::random::normal;

    #[test]
    fn the_interval_of_paired_differences_has_its_closed_form() {
        let found = MeanDifference::paired(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert_eq!((found.value, found.freedom), (3.0, 4));
        assert!((found.error - 0.5_f64.sqrt()).abs() < 1e-15);
        let [lower, upper] = found.interval(0.95);
        // The quantile of Student's t for 95 % and four degrees of freedom is 2.776445.
        let half = 2.776_445_105 * 0.5_f64.sqrt();
        assert!((lower - (3.0 - half)).abs() < 1e-8 && (upper - (3.0 + half)).abs() < 1e-8);
    }

    #[test]
    fn samples_of_equal_size_and_variance_have_two_n_minus_two_degrees_of_freedom() {
        let first = [1.0, 2.0, 3.0, 4.0];
        let second = first.map(|value| value + 10.0);
        let found = MeanDifference::independent(&first, &second).unwrap();
        assert_eq!((found.value, found.freedom), (10.0, 6));
        assert!((found.error - (2.0 * (5.0 / 3.0) / 4.0_f64).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn a_constant_sample_adds_no_degrees_of_freedom() {
        let found = MeanDifference::independent(&[1.0; 9], &[1.0, 2.0, 3.0]).unwrap();
        assert_eq!(found.freedom, 2);
        let constant = MeanDifference::independent(&[1.0; 2], &[3.0; 2]).unwrap();
        assert_eq!((constant.interval(0.95), constant.p_value()), ([2.0, 2.0], 0.0));
        assert_eq!(MeanDifference::paired(&[0.0; 3]).unwrap().p_value(), 1.0);
    }

    #[test]
    fn single_values_have_no_interval() {
        assert_eq!(MeanDifference::paired(&[1.0]), None);
        assert_eq!(MeanDifference::independent(&[1.0], &[1.0, 2.0]), None);
    }

    #[test]
    fn an_interval_that_ends_at_zero_has_the_p_value_of_its_level() {
        for freedom in [1, 4, 9, 30] {
            let value = two_sided_quantile(0.95, freedom);
            let found = MeanDifference { value, error: 1.0, freedom };
            assert!((found.p_value() - 0.05).abs() < 1e-12, "{freedom}");
        }
    }

    #[test]
    fn equal_means_are_found_different_in_five_percent_of_the_samples() {
        let studies = 2000;
        let is_found = |index: &u64| {
            let (first, second) = (normal(2 * index, 6), normal(2 * index + 1, 12));
            let second: Vec<f64> = second.iter().map(|value| 3.0 * value).collect();
            let found = MeanDifference::independent(&first, &second).unwrap();
            let [lower, upper] = found.interval(0.95);
            lower > 0.0 || upper < 0.0
        };
        let rate = (0..studies).filter(is_found).count() as f64 / studies as f64;
        // The binomial error of 2000 samples is 0.005.
        assert!((rate - 0.05).abs() < 0.015, "{rate}");
    }

    #[test]
    fn adjusted_p_values_are_those_of_holm() {
        let close = |found: &[f64], expected: &[f64]| {
            found.iter().zip(expected).all(|(one, other)| (one - other).abs() < 1e-15)
        };
        let found = holm(&[0.01, 0.04, 0.03, 0.005]);
        assert!(close(&found, &[0.03, 0.06, 0.06, 0.02]), "{found:?}");
        assert!(close(&holm(&[0.9, 0.8]), &[1.0, 1.0]));
        assert!(holm(&[]).is_empty());
    }
}
