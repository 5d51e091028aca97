//! Gauss-Legendre quadrature, and Chebyshev interpolation on the unit interval.

use std::f64::consts::PI;

/// Nodes and weights of Gauss-Legendre quadrature on [−1, 1].
#[derive(Debug, Clone)]
pub struct GaussLegendre {
    nodes: Vec<(f64, f64)>,
}

impl GaussLegendre {
    /// Computes the rule with `order` nodes, by Newton's method for the zeros of the Legendre
    /// polynomial.
    pub fn new(order: u32) -> Self {
        let node = |index: u32| {
            // The start is close enough to the zero for quadratic convergence.
            let mut x = libm::cos(PI * (f64::from(index) + 0.75) / (f64::from(order) + 0.5));
            let mut slope = 0.0;
            for _ in 0..8 {
                let value;
                (value, slope) = legendre(order, x);
                x -= value / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        };
        Self { nodes: (0..order).map(node).collect() }
    }

    /// Iterates over the nodes and weights of the rule for the interval from `start` to `end`.
    pub fn over(&self, start: f64, end: f64) -> impl Iterator<Item = (f64, f64)> {
        let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
        self.nodes.iter().map(move |(node, weight)| (middle + half * node, half * weight))
    }
}

/// Returns P_n(x) and P_n′(x) for the Legendre polynomial of order n = `order` and x in (−1, 1).
fn legendre(order: u32, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for degree in 2..=order {
        let degree = f64::from(degree);
        let next = ((2.0 * degree - 1.0) * x * value - (degree - 1.0) * before) / degree;
        (before, value) = (value, next);
    }
    let slope = f64::from(order) * (x * value - before) / (x * x - 1.0);
    (value, slope)
}

/// Chebyshev interpolant on [0, 1].
#[derive(Debug, Clone)]
pub struct Chebyshev {
    coefficients: Vec<f64>,
}

impl Chebyshev {
    /// Iterates over the `terms` interpolation nodes in (0, 1) of an expansion with as many terms.
    pub fn nodes(terms: usize) -> impl Iterator<Item = f64> {
        (0..terms).map(move |node| 0.5 + 0.5 * libm::cos(Self::angle(node, terms)))
    }

    /// Creates the interpolant of a function from its values at [`Self::nodes`], in the same order.
    pub fn from_values(values: &[f64]) -> Self {
        let terms = values.len();
        let coefficient = |order: usize| {
            let sum: f64 = (0..terms)
                .map(|node| values[node] * libm::cos(order as f64 * Self::angle(node, terms)))
                .sum();
            sum * if order == 0 { 1.0 } else { 2.0 } / terms as f64
        };
        Self { coefficients: (0..terms).map(coefficient).collect() }
    }

    /// Returns the interpolant at a point of [0, 1], by Clenshaw's recurrence.
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
    fn polynomials_below_twice_the_order_are_integrated_exactly() {
        let rule = GaussLegendre::new(40);
        for power in [0, 1, 2, 41, 78, 79] {
            let found: f64 = rule.over(0.0, 1.0).map(|(x, w)| w * x.powi(power)).sum();
            let exact = 1.0 / f64::from(power + 1);
            assert!((found / exact - 1.0).abs() < 1e-13, "{power}: {found}");
        }
    }

    #[test]
    fn weights_of_a_panel_add_up_to_its_length() {
        let rule = GaussLegendre::new(5);
        let length: f64 = rule.over(-2.0, 5.0).map(|(_, weight)| weight).sum();
        assert!((length - 7.0).abs() < 1e-14);
    }

    #[test]
    fn a_polynomial_of_lower_degree_is_reproduced() {
        let cubic = |x: f64| 1.0 - 3.0 * x + 0.5 * x * x * x;
        let values: Vec<f64> = Chebyshev::nodes(4).map(cubic).collect();
        let expansion = Chebyshev::from_values(&values);
        for point in [0.0, 0.1, 0.5, 0.77, 1.0] {
            assert!((expansion.at(point) - cubic(point)).abs() < 1e-14);
        }
    }

    #[test]
    fn an_analytic_function_is_reproduced_to_rounding() {
        let values: Vec<f64> = Chebyshev::nodes(16).map(f64::exp).collect();
        let expansion = Chebyshev::from_values(&values);
        for step in 0..=100 {
            let point = f64::from(step) / 100.0;
            assert!((expansion.at(point) / point.exp() - 1.0).abs() < 1e-14);
        }
    }
}
