//! Hertz's contact of two curvatures: how much an ellipse differs from a circle.
//!
//! A summit of principal curvatures κ₁ ≥ κ₂ pressed in by w against E* has an elliptic contact of
//! area π w/H · f_A and carries (4/3) E* w^(3/2) H^(−1/2) · f_P, where H = (κ₁ + κ₂)/2 and both
//! factors depend on κ₂/κ₁ alone (Johnson 1985, section 4.2). They are one for a sphere.
//!
//! `EllipticityMeans` are means over the ellipticity of summits of one mean curvature, tabulated
//! once for all roughness. Among the stationary points of mean curvature H the difference d = tH
//! has the density (3d/m4) exp(−3d²/(2m4)), and of these H² − d² = H²(1 − t²) counts (Nayak 1971).
//! With u = t² and x = 3H²/(2m4) the mean of a function f of the ellipticity is H² x W(x),
//!
//! ```text
//! W(x) = ∫₀¹ (1 − u) f(√u) e^(−xu) du
//! ```
//!
//! which knows nothing of the spectrum.

use std::f64::consts::FRAC_PI_2;

use super::quadrature::Chebyshev;

/// The iteration for the axis ratio gains a digit or more each time.
const ITERATIONS: usize = 60;

/// The contact ellipse of a summit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// Minor over major axis, in (0, 1].
    pub axis_ratio: f64,
    /// f_A: area over that of a sphere of the same mean curvature, at the same indentation.
    pub area_factor: f64,
    /// f_P: load over that of a sphere of the same mean curvature, at the same indentation.
    pub load_factor: f64,
}

impl Ellipse {
    /// The ellipse of a summit whose smaller curvature is κ₂ = `ratio` κ₁, with `ratio` in (0, 1].
    ///
    /// With t = (κ₁ − κ₂)/(κ₁ + κ₂), f_A = 1 + 4t²/9 + … and f_P = 1 + t²/3 + … near the sphere;
    /// towards the cylinder both diverge as the inverse of the axis ratio, but for logarithms.
    pub fn of_curvature_ratio(ratio: f64) -> Self {
        let axis_ratio = axis_ratio(ratio);
        let Integrals { first, second, .. } = Integrals::of_axis_ratio(axis_ratio);
        Self {
            axis_ratio,
            area_factor: second / (axis_ratio * first),
            load_factor: FRAC_PI_2 * second.sqrt() / (axis_ratio * first * first.sqrt()),
        }
    }

    /// The same with t = (κ₁ − κ₂)/(κ₁ + κ₂), in [0, 1).
    pub fn of_curvature_difference(t: f64) -> Self {
        Self::of_curvature_ratio((1.0 - t) / (1.0 + t))
    }
}

/// Solves κ₂/κ₁ = k² D/B, which is between k^(3/2) and k² but for a logarithm.
fn axis_ratio(curvature_ratio: f64) -> f64 {
    let target = curvature_ratio.ln();
    if target == 0.0 {
        return 1.0;
    }
    let mut log = target / 1.5;
    for _ in 0..ITERATIONS {
        // In logarithms the equation is nearly a proportionality: scale to meet the target.
        let next = log * target / Integrals::log_curvature_ratio(log);
        let step = next - log;
        log = next;
        if step.abs() <= 2.0 * f64::EPSILON * log.abs().max(1.0) {
            break;
        }
    }
    log.exp()
}

/// Complete elliptic integrals of the parameter m = 1 − k².
struct Integrals {
    /// K, of the first kind.
    first: f64,
    /// E, of the second kind.
    second: f64,
    /// (D − B)/K, where D = (K − E)/m and B = K − D = (E − k² K)/m.
    skew: f64,
}

impl Integrals {
    /// By the arithmetic-geometric mean of 1 and the complementary modulus k, DLMF 19.8(i).
    ///
    /// Starting from k rather than from m keeps all digits as k → 0, and summing c²/m rather than
    /// c² keeps those of the skew as k → 1.
    fn of_axis_ratio(k: f64) -> Self {
        let (mut mean, mut geometric) = (0.5 * (1.0 + k), k.sqrt());
        let mut half_difference = 0.5 * (1.0 - k);
        let mut share = 0.25 * (1.0 - k) / (1.0 + k);
        let mut sum = share;
        let mut weight = 1.0;
        while half_difference > f64::EPSILON * mean {
            let next = 0.5 * (mean + geometric);
            geometric = (mean * geometric).sqrt();
            mean = next;
            let shrink = half_difference / (4.0 * mean);
            share *= shrink * shrink;
            half_difference *= shrink;
            weight *= 2.0;
            sum += weight * share;
        }
        let first = FRAC_PI_2 / mean;
        Self { first, second: first * (0.5 - sum + k * k * (0.5 + sum)), skew: 2.0 * sum }
    }

    /// ln(k² D/B) against ln k < 0.
    fn log_curvature_ratio(log_k: f64) -> f64 {
        let Self { skew, .. } = Self::of_axis_ratio(log_k.exp());
        2.0 * log_k + 2.0 * skew.atanh()
    }
}

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
pub(super) struct EllipticityMeans {
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
    use std::f64::consts::{LN_2, LN_10, PI};

    use super::{Ellipse, *};

    #[test]
    fn elliptic_integrals_agree_with_their_closed_forms() {
        // K(1/2) = Γ(1/4)²/(4√π), and E follows from it by Legendre's relation.
        let half = Integrals::of_axis_ratio(0.5_f64.sqrt());
        let first = libm::tgamma(0.25).powi(2) / (4.0 * PI.sqrt());
        assert!((half.first - first).abs() < 1e-15);
        assert!((half.second - 0.5 * (first + FRAC_PI_2 / first)).abs() < 1e-15);
        // K = ln(4/k) and E = 1 up to k² ln k.
        let thin = Integrals::of_axis_ratio(1e-9);
        assert!((thin.first - (2.0 * LN_2 + 9.0 * LN_10)).abs() < 1e-14);
        assert!((thin.second - 1.0).abs() < 1e-14);
        let circle = Integrals::of_axis_ratio(1.0);
        assert_eq!((circle.first, circle.second), (FRAC_PI_2, FRAC_PI_2));
    }

    #[test]
    fn legendre_relation_holds_between_complementary_axis_ratios() {
        for k in [1e-3_f64, 0.1, 0.4, 0.7] {
            let these = Integrals::of_axis_ratio(k);
            let others = Integrals::of_axis_ratio((1.0 - k * k).sqrt());
            let left = these.second * others.first + others.second * these.first
                - these.first * others.first;
            assert!((left - FRAC_PI_2).abs() < 1e-14);
        }
    }

    #[test]
    fn axis_ratio_solves_the_equation_of_the_curvatures() {
        for ratio in [1e-20_f64, 1e-8, 0.01, 0.3, 0.9, 1.0 - 1e-7, 1.0] {
            let k = Ellipse::of_curvature_ratio(ratio).axis_ratio;
            let Integrals { skew, .. } = Integrals::of_axis_ratio(k);
            let found = k * k * (1.0 + skew) / (1.0 - skew);
            // At 1e-20, (1 − skew) K = 1 is what is left of K = 24.
            assert!((found / ratio - 1.0).abs() < 1e-13, "{ratio}: {found}");
        }
    }

    #[test]
    fn a_nearly_spherical_summit_has_quadratic_factors() {
        for t in [1e-3, 1e-2] {
            let ellipse = Ellipse::of_curvature_difference(t);
            // What is left out is of fourth order, with prefactors below one half.
            let fourth = 0.5 * t.powi(4) + 1e-15;
            assert!((ellipse.area_factor - 1.0 - 4.0 / 9.0 * t * t).abs() < fourth);
            assert!((ellipse.load_factor - 1.0 - t * t / 3.0).abs() < fourth);
            assert!((ellipse.axis_ratio - 1.0 + 4.0 / 3.0 * t).abs() < t * t);
        }
        let sphere = Ellipse::of_curvature_difference(0.0);
        assert_eq!((sphere.area_factor, sphere.load_factor), (1.0, 1.0));
    }

    #[test]
    fn a_nearly_cylindrical_summit_has_a_thin_ellipse() {
        // κ₂/κ₁ = k² (ln(4/k) − 1), f_A = 1/(k ln(4/k)), f_P = (π/2)/(k ln(4/k)^(3/2)).
        let k = 1e-6_f64;
        let logarithm = (4.0 / k).ln();
        let ellipse = Ellipse::of_curvature_ratio(k * k * (logarithm - 1.0));
        let load_factor = FRAC_PI_2 / (k * logarithm.powf(1.5));
        assert!((ellipse.axis_ratio / k - 1.0).abs() < 1e-10);
        assert!((ellipse.area_factor * k * logarithm - 1.0).abs() < 1e-10);
        assert!((ellipse.load_factor / load_factor - 1.0).abs() < 1e-10);
    }

    #[test]
    fn a_sphere_of_the_geometric_mean_curvature_has_more_area_and_less_load_than_the_ellipse() {
        for t in [0.1, 0.3, 0.5, 0.8, 0.99] {
            let ellipse = Ellipse::of_curvature_difference(t);
            let square = 1.0_f64 - t * t;
            assert!(ellipse.area_factor < square.powf(-0.5));
            assert!(ellipse.load_factor > square.powf(-0.25));
        }
    }

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
