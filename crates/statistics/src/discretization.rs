//! Error of a mean on a mesh or in a cell, from means on other meshes or in other cells.
//!
//! If the mean on N nodes is Q(N) = Q∞ + c N⁻ᵖ, the means on two meshes a < b give the error of the
//! mean on any mesh n by Richardson's extrapolation:
//!
//! ```text
//! Q(n) − Q∞ = Q(n) − Q(b) + (Q(a) − Q(b)) b⁻ᵖ / (a⁻ᵖ − b⁻ᵖ).
//! ```
//!
//! Three meshes a < b < c show the order p in (Q(a) − Q(b))/(Q(b) − Q(c)). The order is assumed to
//! be one if there are two meshes, if the scatter hides one of the two differences, or if the
//! apparent order is below 0.8. Differences that fall so slowly are those of meshes that are too
//! coarse for one power: corrected areas on 4, 8 and 16 nodes to the shortest wavelength have an
//! apparent order of 0.5, and of 0.9 on 8, 16 and 32. Intervals with an assumed order also span the
//! errors for the orders 1/2 and 2, added in quadrature to the scatter.
//!
//! The standard error is computed by the jackknife. It includes that of an order that the means
//! show. Equal surfaces on several meshes are left out together. Surfaces in different cells are
//! independent, so their variances are added, with the degrees of freedom of Welch and
//! Satterthwaite.

use crate::differences::{MeanDifference, degrees_of_freedom};
use crate::intervals::{deviation, mean};

/// Least and largest order that means can show.
const ORDERS: [f64; 2] = [0.8, 4.0];
/// Distance from these bounds within which an order is one of them.
const ROUNDING: f64 = 1e-6;
/// Order that is assumed if the means do not show it.
const ASSUMED_ORDER: f64 = 1.0;
/// Least and largest order that is possible if it is assumed.
const POSSIBLE_ORDERS: [f64; 2] = [0.5, 2.0];
/// Number of bisections for an order.
const BISECTIONS: u32 = 50;
/// Confidence level at which two means differ.
const LEVEL: f64 = 0.95;

/// Relation between the surfaces on different meshes or in different cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// The same surfaces, in the same order.
    Paired,
    /// Independent surfaces.
    Independent,
}

/// Error of a mean on a mesh or in a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscretizationError {
    /// Mean on this mesh minus its limit, with its standard error.
    pub error: MeanDifference,
    /// Order p of the error, which is proportional to size⁻ᵖ.
    pub order: f64,
    /// True if the means show the order, and false if it is assumed.
    pub is_order_shown: bool,
    /// Errors for the orders 1/2 and 2 minus the error, if the order is assumed.
    deviations: [f64; 2],
}

impl DiscretizationError {
    /// Computes the error of the mean at `target` from the three largest sizes, or two if there are
    /// not more. Sizes ascend, such as the numbers of nodes per side. `values` are indexed as
    /// `[size][surface]`.
    ///
    /// Returns `None` if there are fewer than two sizes, or fewer than two surfaces of a size.
    pub fn new(
        sizes: &[f64],
        values: &[Vec<f64>],
        target: usize,
        sampling: Sampling,
    ) -> Option<DiscretizationError> {
        if sizes.len() < 2 || values.iter().any(|values| values.len() < 2) {
            return None;
        }
        let is_order_shown = shows_order(values, sampling) && {
            let order = order(sizes, &means(values))?;
            // The search ends within rounding of a bound if the order is beyond it.
            ORDERS[0] + ROUNDING < order && order < ORDERS[1] - ROUNDING
        };
        let order_of = |means: &[f64]| {
            if is_order_shown { order(sizes, means) } else { Some(ASSUMED_ORDER) }
        };
        let error = |means: &[f64]| Some(extrapolated(sizes, means, target, order_of(means)?));
        let all = means(values);
        let value = error(&all)?;
        let (variance, freedom) = match sampling {
            Sampling::Paired => {
                let count = values[0].len();
                let without = |surface: usize| {
                    let left = values.iter().map(|values| mean_without(values, surface));
                    error(&left.collect::<Vec<_>>())
                };
                let replicates = (0..count).map(without).collect::<Option<Vec<f64>>>()?;
                (jackknife_variance(&replicates), count as f64 - 1.0)
            }
            Sampling::Independent => {
                let (mut variance, mut squares) = (0.0, 0.0);
                for (size, values) in values.iter().enumerate() {
                    let without = |surface: usize| {
                        let mut left = all.clone();
                        left[size] = mean_without(values, surface);
                        error(&left)
                    };
                    let replicates =
                        (0..values.len()).map(without).collect::<Option<Vec<f64>>>()?;
                    let own = jackknife_variance(&replicates);
                    variance += own;
                    squares += own.powi(2) / (values.len() as f64 - 1.0);
                }
                (variance, variance.powi(2) / squares)
            }
        };
        Some(DiscretizationError {
            error: MeanDifference {
                value,
                error: variance.sqrt(),
                freedom: degrees_of_freedom(freedom),
            },
            order: order_of(&all)?,
            is_order_shown,
            deviations: POSSIBLE_ORDERS.map(|order| {
                let other = extrapolated(sizes, &all, target, order);
                if is_order_shown { 0.0 } else { other - value }
            }),
        })
    }

    /// Returns the two-sided confidence interval with this probability.
    pub fn interval(&self, probability: f64) -> [f64; 2] {
        let [lower, upper] = self.error.interval(probability);
        let half = 0.5 * (upper - lower);
        let [least, most] =
            [f64::min, f64::max].map(|end| self.deviations.iter().copied().fold(0.0, end));
        let value = self.error.value;
        [value - libm::hypot(half, least), value + libm::hypot(half, most)]
    }

    /// Returns the share of the error that remains on a size `factor` times as large.
    pub fn remaining(&self, factor: f64) -> f64 {
        libm::pow(factor, -self.order)
    }
}

/// Returns whether the differences between the means of the three largest sizes exceed their
/// scatter, and have the same sign.
fn shows_order(values: &[Vec<f64>], sampling: Sampling) -> bool {
    let [.., coarse, middle, fine] = values else { return false };
    let sign = |one: &[f64], other: &[f64]| {
        let difference = match sampling {
            Sampling::Paired => MeanDifference::paired(
                &one.iter().zip(other).map(|(one, other)| other - one).collect::<Vec<_>>(),
            ),
            Sampling::Independent => MeanDifference::independent(one, other),
        };
        let [lower, upper] = difference?.interval(LEVEL);
        (lower > 0.0 || upper < 0.0).then_some(lower > 0.0)
    };
    let signs = [sign(coarse, middle), sign(middle, fine)];
    signs[0].is_some() && signs[0] == signs[1]
}

/// Returns the order, within [`ORDERS`], whose differences between the means of the three largest
/// sizes have the given ratio.
fn order(sizes: &[f64], means: &[f64]) -> Option<f64> {
    let ([.., a, b, c], [.., at_a, at_b, at_c]) = (sizes, means) else { return None };
    let (wide, narrow) = ((at_a - at_b).abs(), (at_b - at_c).abs());
    let is_below = |order: f64| {
        let [a, b, c] = [a, b, c].map(|size| libm::pow(size / b, -order));
        (a - b) * narrow < wide * (b - c)
    };
    let [mut below, mut above] = ORDERS;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (below + above);
        if is_below(middle) {
            below = middle;
        } else {
            above = middle;
        }
    }
    Some(0.5 * (below + above))
}

fn extrapolated(sizes: &[f64], means: &[f64], target: usize, order: f64) -> f64 {
    let [coarse, fine] = [sizes.len() - 2, sizes.len() - 1];
    let beyond = 1.0 / (libm::pow(sizes[fine] / sizes[coarse], order) - 1.0);
    means[target] - means[fine] + beyond * (means[coarse] - means[fine])
}

fn means(values: &[Vec<f64>]) -> Vec<f64> {
    values.iter().map(|values| mean(values.iter().copied())).collect()
}

fn mean_without(values: &[f64], surface: usize) -> f64 {
    let others = values.iter().enumerate().filter(|(index, _)| *index != surface);
    mean(others.map(|(_, value)| *value))
}

/// Returns (n − 1)/n Σ (θ̂₍ᵢ₎ − θ̄)².
fn jackknife_variance(replicates: &[f64]) -> f64 {
    let count = replicates.len() as f64;
    (count - 1.0).powi(2) / count * deviation(replicates.iter().copied()).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::normal;

    /// Means of a quantity with the limit 2 and the error 3/sizeᵖ, of surfaces that scatter.
    fn ladder(sizes: &[f64], order: f64, scatter: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let level = |(size, scatter): (&f64, &Vec<f64>)| {
            scatter.iter().map(|own| 2.0 + 3.0 * size.powf(-order) + own).collect()
        };
        sizes.iter().zip(scatter).map(level).collect()
    }

    #[test]
    fn three_meshes_show_the_order_and_the_error_of_each() {
        let sizes = [32.0, 64.0, 96.0, 192.0];
        let shared = vec![normal(1, 4); 4];
        for order in [0.9, 1.0, 1.5, 2.0] {
            let values = ladder(&sizes, order, &shared);
            for (target, size) in sizes.iter().enumerate() {
                let found =
                    DiscretizationError::new(&sizes, &values, target, Sampling::Paired).unwrap();
                assert!(found.is_order_shown && (found.order - order).abs() < 1e-6);
                assert!((found.error.value - 3.0 * size.powf(-order)).abs() < 1e-6);
                assert!(found.error.error < 1e-6 && found.error.freedom == 3);
            }
        }
    }

    #[test]
    fn two_meshes_are_extrapolated_with_the_order_one() {
        let sizes = [64.0, 128.0];
        let values = ladder(&sizes, 1.0, &vec![normal(2, 5); 2]);
        let found = DiscretizationError::new(&sizes, &values, 0, Sampling::Paired).unwrap();
        assert!(!found.is_order_shown && found.order == 1.0);
        assert!((found.error.value - 3.0 / 64.0).abs() < 1e-12);
    }

    #[test]
    fn intervals_with_an_assumed_order_span_other_orders() {
        let sizes = [64.0, 128.0, 256.0];
        // Differences that fall with the order 0.5.
        let values = ladder(&sizes, 0.5, &vec![normal(2, 5); 3]);
        let found = DiscretizationError::new(&sizes, &values, 2, Sampling::Paired).unwrap();
        assert!(!found.is_order_shown);
        let difference = 3.0 / 128_f64.sqrt() - 3.0 / 16.0;
        assert!((found.error.value - difference).abs() < 1e-12);
        // The factors 1/(2ᵖ − 1) of the orders 2 and 1/2.
        let [lower, upper] = found.interval(0.95);
        assert!((lower - difference / 3.0).abs() < 1e-9);
        assert!((upper - difference / (2_f64.sqrt() - 1.0)).abs() < 1e-9);
        assert!((upper - 3.0 / 16.0).abs() < 1e-9, "the true error");
    }

    #[test]
    fn the_standard_error_of_two_meshes_is_that_of_twice_the_paired_difference() {
        let values = [vec![1.0, 1.1, 1.3], vec![0.9, 1.05, 1.15]];
        let found = DiscretizationError::new(&[1.0, 2.0], &values, 0, Sampling::Paired).unwrap();
        let twice = MeanDifference::paired(&[0.2, 0.1, 0.3]).unwrap();
        assert!((found.error.value - twice.value).abs() < 1e-12);
        assert!((found.error.error - twice.error).abs() < 1e-12);
        assert_eq!(found.error.freedom, 2);
        let cells = [vec![1.0, 1.1, 1.3, 1.0], vec![0.9, 1.05, 1.15]];
        let found = DiscretizationError::new(&[1.0, 2.0], &cells, 0, Sampling::Independent);
        let welch = MeanDifference::independent(&cells[0], &cells[1]).unwrap();
        let error = found.unwrap().error;
        assert!((error.error - 2.0 * welch.error).abs() < 1e-12);
        assert_eq!(error.freedom, welch.freedom);
    }

    #[test]
    fn scatter_that_hides_the_differences_shows_no_order() {
        let sizes = [4.0, 8.0, 16.0];
        let scatter: Vec<Vec<f64>> = (0..3).map(|level| normal(10 + level, 6)).collect();
        let values = ladder(&sizes, 1.0, &scatter);
        let found = DiscretizationError::new(&sizes, &values, 0, Sampling::Independent).unwrap();
        assert!(!found.is_order_shown && found.order == 1.0);
        assert_eq!(DiscretizationError::new(&[1.0], &values[..1], 0, Sampling::Paired), None);
    }

    #[test]
    fn intervals_cover_the_error_of_the_mesh() {
        let sizes = [32.0, 64.0, 128.0];
        let studies = 400;
        let is_covered = |study: &u64| {
            let own = normal(7 * study, 6);
            // The error of the mesh of a surface varies by a fifth.
            let of_mesh: Vec<f64> = normal(7 * study + 1, 6);
            let level = |size: &f64| {
                let surfaces = own.iter().zip(&of_mesh);
                surfaces.map(|(own, of_mesh)| own + 3.0 / size * (1.0 + 0.2 * of_mesh)).collect()
            };
            let values: Vec<Vec<f64>> = sizes.iter().map(level).collect();
            let found = DiscretizationError::new(&sizes, &values, 0, Sampling::Paired).unwrap();
            let [lower, upper] = found.error.interval(0.95);
            lower <= 3.0 / 32.0 && 3.0 / 32.0 <= upper
        };
        let rate = (0..studies).filter(is_covered).count() as f64 / studies as f64;
        // The binomial error of 400 studies is 0.011.
        assert!((rate - 0.95).abs() < 0.035, "{rate}");
    }
}
