//! Means over the ellipticity of summits of one mean curvature, tabulated once for all roughness.
//!
//! Among the stationary points of mean curvature H the difference d = tH has the density
//! (3d/m4) exp(−3d²/(2m4)), and of these H² − d² = H²(1 − t²) counts (Nayak 1971). With u = t² and
//! x = 3H²/(2m4) the mean of a function f of the ellipticity is H² x W(x),
//!
//! ```text
//! W(x) = ∫₀¹ (1 − u) f(√u) e^(−xu) du
//! ```
//!
//! which knows nothing of the spectrum.

use super::chebyshev::Chebyshev;

/// Terms of the expansions, which converge like exp(−c √terms); see the tests.
const TERMS: usize = 54;
/// Places the nodes where W changes: half of them at smaller x.
const HALF_WAY: f64 = 4.0;
/// Step in the logarithm of u/(1 − u); the trapezoidal rule converges exponentially in it.
const STEP: f64 = 0.25;
/// The integrand decays as e^τ to the left and at least as e^(−3|τ|/2) to the right.
const STEPS: std::ops::RangeInclusive<i32> = -190..=110;

/// Of the factors of area and of load, as fractions of their large-x limit f(0) H².
#[derive(Debug, Clone)]
pub struct EllipticityMeans {
    area: Chebyshev,
    load: Chebyshev,
}

impl EllipticityMeans {
    /// From a function of κ₂/κ₁ that returns the factors of area and of load, both of them one at
    /// κ₂ = κ₁ and of weaker growth than κ₁/κ₂ towards the cylinder.
    pub fn new(factors: impl Fn(f64) -> (f64, f64)) -> Self {
        let nodes: Vec<Node> = STEPS.map(|step| Node::new(step, &factors)).collect();
        let x = Chebyshev::nodes(TERMS).map(|unit| HALF_WAY * unit / (1.0 - unit));
        let (area, load): (Vec<f64>, Vec<f64>) = x.map(|x| transform(&nodes, x)).unzip();
        Self { area: Chebyshev::through(&area), load: Chebyshev::through(&load) }
    }

    /// x W(x) for the factors of area and of load.
    pub fn at(&self, x: f64) -> (f64, f64) {
        let unit = x / (HALF_WAY + x);
        let weight = x / (1.0 + x);
        (weight * self.area.at(unit), weight * self.load.at(unit))
    }
}

struct Node {
    /// u = t².
    square: f64,
    /// Of the trapezoidal rule, with the Jacobian and with 1 − u.
    weight: f64,
    factors: (f64, f64),
}

impl Node {
    fn new(step: i32, factors: impl Fn(f64) -> (f64, f64)) -> Self {
        let logit = STEP * f64::from(step);
        let square = 1.0 / (1.0 + (-logit).exp());
        let complement = 1.0 / (1.0 + logit.exp());
        Self {
            square,
            weight: STEP * square * complement * complement,
            factors: factors(complement / (1.0 + square.sqrt()).powi(2)),
        }
    }
}

/// (1 + x) W(x), which stays between bounds that are neither zero nor infinite.
fn transform(nodes: &[Node], x: f64) -> (f64, f64) {
    let (area, load) = nodes.iter().fold((0.0, 0.0), |(area, load), node| {
        let weight = node.weight * (-x * node.square).exp();
        (area + weight * node.factors.0, load + weight * node.factors.1)
    });
    ((1.0 + x) * area, (1.0 + x) * load)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theory::models::hertz::Ellipse;

    fn ellipses(ratio: f64) -> (f64, f64) {
        let ellipse = Ellipse::of_curvature_ratio(ratio);
        (ellipse.area_factor, ellipse.load_factor)
    }

    #[test]
    fn means_of_one_are_closed() {
        let means = EllipticityMeans::new(|_| (1.0, 1.0));
        for x in [0.01_f64, 0.5, 3.0, 40.0, 1e3, 1e6] {
            let exact = (x + (-x).exp_m1()) / x;
            let (area, load) = means.at(x);
            // The closed form cancels to x/2.
            assert!((area / exact - 1.0).abs() < 1e-14 * (1.0 + 1.0 / x));
            assert_eq!(area, load);
        }
    }

    #[test]
    fn flat_summits_have_the_moments_of_their_shape() {
        // Spheres of the geometric mean curvature: (1 − u)^(−1/2) and (1 − u)^(−1/4).
        let means = EllipticityMeans::new(|ratio| {
            let factor = 0.5 * (1.0 + ratio) / ratio.sqrt();
            (factor, factor.sqrt())
        });
        let x = 1e-13;
        let (area, load) = means.at(x);
        assert!((area / x - 2.0 / 3.0).abs() < 1e-12);
        assert!((load / x - 4.0 / 7.0).abs() < 1e-12);
    }

    #[test]
    fn sharp_summits_are_spheres_with_a_first_correction() {
        // x ∫ (1 − u)(1 + cu) e^(−xu) du = 1 − (1 − c)/x + O(x⁻²), c = 4/9 and 1/3.
        let (area, load) = EllipticityMeans::new(ellipses).at(1e6);
        assert!((area - 1.0 + 5.0 / 9.0 * 1e-6).abs() < 1e-11);
        assert!((load - 1.0 + 2.0 / 3.0 * 1e-6).abs() < 1e-11);
    }

    #[test]
    fn expansion_is_the_integral_between_its_nodes() {
        let means = EllipticityMeans::new(ellipses);
        let nodes: Vec<Node> = STEPS.map(|step| Node::new(step, ellipses)).collect();
        for step in -40..80 {
            let x = (0.2 * f64::from(step)).exp();
            let (area, load) = transform(&nodes, x);
            let weight = x / (1.0 + x);
            let (found_area, found_load) = means.at(x);
            assert!((found_area / (weight * area) - 1.0).abs() < 1e-13);
            assert!((found_load / (weight * load) - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn integral_agrees_with_one_in_the_curvature_difference() {
        let nodes: Vec<Node> = STEPS.map(|step| Node::new(step, ellipses)).collect();
        let rule = crate::theory::models::quadrature::GaussLegendre::new(400);
        for x in [0.0_f64, 1.0, 30.0, 1000.0] {
            // t = sin θ softens the root with which the integrand ends at t = 1.
            let (mut area, mut load) = (0.0, 0.0);
            for (angle, width) in rule.over(0.0, std::f64::consts::FRAC_PI_2) {
                let (t, cosine) = angle.sin_cos();
                let (of_area, of_load) = ellipses((1.0 - t) / (1.0 + t));
                let weight = 2.0 * width * cosine.powi(3) * t * (-x * t * t).exp() * (1.0 + x);
                area += weight * of_area;
                load += weight * of_load;
            }
            let found = transform(&nodes, x);
            // The logarithms in the factors leave the Gauss rule algebraic.
            assert!((found.0 / area - 1.0).abs() < 1e-9, "{x} {} {area}", found.0);
            assert!((found.1 / load - 1.0).abs() < 1e-9, "{x} {} {load}", found.1);
        }
    }
}
