//! Smooth functions on the unit interval as sums of Chebyshev polynomials.

use std::f64::consts::PI;

/// The interpolant through the zeros of the next Chebyshev polynomial.
#[derive(Debug, Clone)]
pub struct Chebyshev {
    coefficients: Vec<f64>,
}

impl Chebyshev {
    /// Where the function is to be known for an expansion of `terms` terms: within (0, 1).
    pub fn nodes(terms: usize) -> impl Iterator<Item = f64> {
        (0..terms).map(move |node| 0.5 + 0.5 * Self::angle(node, terms).cos())
    }

    /// The expansion of the function which has these values at the [`Self::nodes`].
    pub fn through(values: &[f64]) -> Self {
        let terms = values.len();
        let coefficient = |order: usize| {
            let sum: f64 = (0..terms)
                .map(|node| values[node] * (order as f64 * Self::angle(node, terms)).cos())
                .sum();
            sum * if order == 0 { 1.0 } else { 2.0 } / terms as f64
        };
        Self { coefficients: (0..terms).map(coefficient).collect() }
    }

    /// The value at a point of [0, 1], by Clenshaw's recurrence.
    pub fn at(&self, point: f64) -> f64 {
        let double = 4.0 * point - 2.0;
        let (next, after) =
            self.coefficients[1..].iter().rev().fold((0.0, 0.0), |(next, after), coefficient| {
                (coefficient + double * next - after, next)
            });
        self.coefficients[0] + 0.5 * double * next - after
    }

    fn angle(node: usize, terms: usize) -> f64 {
        PI * (node as f64 + 0.5) / terms as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_of_lower_degree_is_reproduced() {
        let cubic = |x: f64| 1.0 - 3.0 * x + 0.5 * x * x * x;
        let values: Vec<f64> = Chebyshev::nodes(4).map(cubic).collect();
        let expansion = Chebyshev::through(&values);
        for point in [0.0, 0.1, 0.5, 0.77, 1.0] {
            assert!((expansion.at(point) - cubic(point)).abs() < 1e-14);
        }
    }

    #[test]
    fn an_analytic_function_is_reproduced_to_rounding() {
        let values: Vec<f64> = Chebyshev::nodes(16).map(f64::exp).collect();
        let expansion = Chebyshev::through(&values);
        for step in 0..=100 {
            let point = f64::from(step) / 100.0;
            assert!((expansion.at(point) / point.exp() - 1.0).abs() < 1e-14);
        }
    }
}
