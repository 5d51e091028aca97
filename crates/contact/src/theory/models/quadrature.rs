//! Gauss-Legendre quadrature over panels, the ends of which are where the integrand changes.

use std::f64::consts::PI;

/// Nodes and weights for the interval [−1, 1].
#[derive(Debug, Clone)]
pub struct GaussLegendre {
    nodes: Vec<(f64, f64)>,
}

impl GaussLegendre {
    /// The rule of `order` nodes, by Newton's iteration on the Legendre polynomial.
    pub fn new(order: u32) -> Self {
        let node = |index: u32| {
            // Between the neighbouring bounds of the zeros, close enough for quadratic convergence.
            let mut x = (PI * (f64::from(index) + 0.75) / (f64::from(order) + 0.5)).cos();
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

    /// Nodes and weights for the interval from `start` to `end`.
    pub fn over(&self, start: f64, end: f64) -> impl Iterator<Item = (f64, f64)> {
        let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
        self.nodes.iter().map(move |(node, weight)| (middle + half * node, half * weight))
    }
}

/// The Legendre polynomial of this order and its derivative, within (−1, 1).
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
}
