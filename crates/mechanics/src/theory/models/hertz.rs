//! Hertz contact of a summit with two principal curvatures.
//!
//! A summit has the principal curvatures κ₁ ≥ κ₂ and the mean curvature H = (κ₁ + κ₂)/2. Under the
//! approach w, the area of its elliptic contact is π w/H · f_A, and its force is
//! (4/3) E* w^(3/2) H^(−1/2) · f_P. Both factors depend on κ₂/κ₁ alone (Johnson 1985, section 4.2)
//! and are one for a sphere.
//!
//! `EllipticityMeans` tabulates means over the ellipticity of summits of one mean curvature. The
//! difference d = tH of stationary points of mean curvature H has the density
//! (3d/m4) exp(−3d²/(2m4)), with the weight H² − d² = H²(1 − t²) (Nayak 1971). With u = t² and
//! x = 3H²/(2m4), the mean of a function f of the ellipticity is H² x W(x), where
//!
//! ```text
//! W(x) = ∫₀¹ (1 − u) f(√u) e^(−xu) du
//! ```
//!
//! does not depend on the spectrum.

use std::f64::consts::FRAC_PI_2;

use super::quadrature::Chebyshev;

/// Maximum number of iterations for the axis ratio. Each iteration gains at least one digit.
const ITERATIONS: usize = 60;

/// Contact ellipse of a summit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// Ratio of the minor to the major axis, in (0, 1].
    pub axis_ratio: f64,
    /// Factor f_A: contact area divided by the contact area of a sphere with the same mean
    /// curvature and approach.
    pub area_factor: f64,
    /// Factor f_P: force divided by the force of a sphere with the same mean curvature and
    /// approach.
    pub load_factor: f64,
}

impl Ellipse {
    /// Computes the ellipse from the curvature ratio κ₂/κ₁ = `ratio`, in (0, 1].
    ///
    /// With t = (κ₁ − κ₂)/(κ₁ + κ₂), f_A = 1 + 4t²/9 + … and f_P = 1 + t²/3 + … near the sphere.
    /// Towards the cylinder, both diverge as the inverse of the axis ratio, up to logarithms.
    pub fn from_curvature_ratio(ratio: f64) -> Self {
        let axis_ratio = axis_ratio(ratio);
        let Integrals { first, second, .. } = Integrals::from_axis_ratio(axis_ratio);
        Self {
            axis_ratio,
            area_factor: second / (axis_ratio * first),
            load_factor: FRAC_PI_2 * second.sqrt() / (axis_ratio * first * first.sqrt()),
        }
    }
}

/// Returns the axis ratio k that solves κ₂/κ₁ = k² D/B, with the integrals D and B of
/// [`Integrals::skew`].
///
/// Up to a logarithm, κ₂/κ₁ is between k^(3/2) and k².
fn axis_ratio(curvature_ratio: f64) -> f64 {
    let target = libm::log(curvature_ratio);
    if target == 0.0 {
        return 1.0;
    }
    let mut log = target / 1.5;
    for _ in 0..ITERATIONS {
        // ln(κ₂/κ₁) is nearly proportional to ln k, so that scaling ln k nearly meets the target.
        let next = log * target / Integrals::log_curvature_ratio(log);
        let step = next - log;
        log = next;
        if step.abs() <= 2.0 * f64::EPSILON * log.abs().max(1.0) {
            break;
        }
    }
    libm::exp(log)
}

/// Complete elliptic integrals for the axis ratio k, with the parameter m = 1 − k².
struct Integrals {
    /// Integral K of the first kind.
    first: f64,
    /// Integral E of the second kind.
    second: f64,
    /// Ratio (D − B)/K, where D = (K − E)/m and B = K − D = (E − k² K)/m.
    skew: f64,
}

impl Integrals {
    /// Computes the integrals for the axis ratio k by the arithmetic-geometric mean of 1 and k,
    /// DLMF 19.8(i).
    ///
    /// Starting from k instead of m is accurate for k → 0. Summing c²/m instead of c² keeps the
    /// skew accurate for k → 1.
    fn from_axis_ratio(k: f64) -> Self {
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

    /// Returns ln(κ₂/κ₁) = ln(k² D/B) for ln k = `log_k` < 0.
    fn log_curvature_ratio(log_k: f64) -> f64 {
        let Self { skew, .. } = Self::from_axis_ratio(libm::exp(log_k));
        2.0 * log_k + 2.0 * libm::atanh(skew)
    }
}

/// Number of terms of the Chebyshev expansions. Their errors decrease as exp(−c √terms); see the
/// tests.
const TERMS: usize = 54;

/// Value of x below which half of the interpolation nodes are; W(x) changes most in this range.
const HALF_WAY: f64 = 4.0;

/// Step in τ = ln(u/(1 − u)) of the trapezoidal rule, which converges exponentially.
const STEP: f64 = 0.25;

/// Indices n of the nodes τ = n × [`STEP`] of the trapezoidal rule.
///
/// The integrand decays as e^τ for τ → −∞ and at least as e^(−3τ/2) for τ → ∞.
const STEPS: std::ops::RangeInclusive<i32> = -190..=110;

/// Table of x W(x) for the factors f_A (`area`) and f_P (`load`), as the module [`hertz`](self)
/// defines W.
///
/// Both entries are interpolants of (1 + x) W(x) in the variable x/(4 + x).
#[derive(Debug, Clone)]
pub(super) struct EllipticityMeans {
    area: Chebyshev,
    load: Chebyshev,
}

impl EllipticityMeans {
    /// Tabulates W for two functions f of the ellipticity: `factors` returns both for a curvature
    /// ratio κ₂/κ₁.
    ///
    /// Both must be one at κ₂ = κ₁ and grow more slowly than κ₁/κ₂ for κ₂/κ₁ → 0.
    pub fn new(factors: impl Fn(f64) -> (f64, f64)) -> Self {
        let nodes: Vec<Node> = STEPS.map(|step| Node::new(step, &factors)).collect();
        let x = Chebyshev::nodes(TERMS).map(|unit| HALF_WAY * unit / (1.0 - unit));
        let (area, load): (Vec<f64>, Vec<f64>) = x.map(|x| transform(&nodes, x)).unzip();
        Self { area: Chebyshev::from_values(&area), load: Chebyshev::from_values(&load) }
    }

    /// Returns x W(x) for the first and for the second function of [`EllipticityMeans::new`].
    pub fn at(&self, x: f64) -> (f64, f64) {
        let unit = x / (HALF_WAY + x);
        let weight = x / (1.0 + x);
        (weight * self.area.at(unit), weight * self.load.at(unit))
    }
}

struct Node {
    /// Value u = t² at the node of the trapezoidal rule.
    square: f64,
    /// Weight of the trapezoidal rule, with the Jacobian and the factor 1 − u.
    weight: f64,
    factors: (f64, f64),
}

impl Node {
    fn new(step: i32, factors: impl Fn(f64) -> (f64, f64)) -> Self {
        let logit = STEP * f64::from(step);
        let square = 1.0 / (1.0 + libm::exp(-logit));
        let complement = 1.0 / (1.0 + libm::exp(logit));
        Self {
            square,
            weight: STEP * square * complement * complement,
            factors: factors(complement / (1.0 + square.sqrt()).powi(2)),
        }
    }
}

/// Returns (1 + x) W(x) for both functions. It is positive and bounded for all x.
fn transform(nodes: &[Node], x: f64) -> (f64, f64) {
    let (area, load) = nodes.iter().fold((0.0, 0.0), |(area, load), node| {
        let weight = node.weight * libm::exp(-x * node.square);
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
        let half = Integrals::from_axis_ratio(0.5_f64.sqrt());
        let first = libm::tgamma(0.25).powi(2) / (4.0 * PI.sqrt());
        assert!((half.first - first).abs() < 1e-15);
        assert!((half.second - 0.5 * (first + FRAC_PI_2 / first)).abs() < 1e-15);
        // K = ln(4/k) and E = 1 up to k² ln k.
        let thin = Integrals::from_axis_ratio(1e-9);
        assert!((thin.first - (2.0 * LN_2 + 9.0 * LN_10)).abs() < 1e-14);
        assert!((thin.second - 1.0).abs() < 1e-14);
        let circle = Integrals::from_axis_ratio(1.0);
        assert_eq!((circle.first, circle.second), (FRAC_PI_2, FRAC_PI_2));
    }

    #[test]
    fn legendre_relation_holds_between_complementary_axis_ratios() {
        for k in [1e-3_f64, 0.1, 0.4, 0.7] {
            let these = Integrals::from_axis_ratio(k);
            let others = Integrals::from_axis_ratio((1.0 - k * k).sqrt());
            let left = these.second * others.first + others.second * these.first
                - these.first * others.first;
            assert!((left - FRAC_PI_2).abs() < 1e-14);
        }
    }

    #[test]
    fn axis_ratio_solves_the_equation_of_the_curvatures() {
        for ratio in [1e-20_f64, 1e-8, 0.01, 0.3, 0.9, 1.0 - 1e-7, 1.0] {
            let k = Ellipse::from_curvature_ratio(ratio).axis_ratio;
            let Integrals { skew, .. } = Integrals::from_axis_ratio(k);
            let found = k * k * (1.0 + skew) / (1.0 - skew);
            // At 1e-20, (1 − skew) K = 1 while K = 24, which cancels digits.
            assert!((found / ratio - 1.0).abs() < 1e-13, "{ratio}: {found}");
        }
    }

    /// Computes the ellipse from t = (κ₁ − κ₂)/(κ₁ + κ₂), in [0, 1).
    fn from_curvature_difference(t: f64) -> Ellipse {
        Ellipse::from_curvature_ratio((1.0 - t) / (1.0 + t))
    }

    #[test]
    fn a_nearly_spherical_summit_has_quadratic_factors() {
        for t in [1e-3, 1e-2] {
            let ellipse = from_curvature_difference(t);
            // The remainder is of fourth order, with coefficients below one half.
            let fourth = 0.5 * t.powi(4) + 1e-15;
            assert!((ellipse.area_factor - 1.0 - 4.0 / 9.0 * t * t).abs() < fourth);
            assert!((ellipse.load_factor - 1.0 - t * t / 3.0).abs() < fourth);
            assert!((ellipse.axis_ratio - 1.0 + 4.0 / 3.0 * t).abs() < t * t);
        }
        let sphere = from_curvature_difference(0.0);
        assert_eq!((sphere.area_factor, sphere.load_factor), (1.0, 1.0));
    }

    #[test]
    fn a_nearly_cylindrical_summit_has_a_thin_ellipse() {
        // κ₂/κ₁ = k² (ln(4/k) − 1), f_A = 1/(k ln(4/k)), f_P = (π/2)/(k ln(4/k)^(3/2)).
        let k = 1e-6_f64;
        let logarithm = (4.0 / k).ln();
        let ellipse = Ellipse::from_curvature_ratio(k * k * (logarithm - 1.0));
        let load_factor = FRAC_PI_2 / (k * logarithm.powf(1.5));
        assert!((ellipse.axis_ratio / k - 1.0).abs() < 1e-10);
        assert!((ellipse.area_factor * k * logarithm - 1.0).abs() < 1e-10);
        assert!((ellipse.load_factor / load_factor - 1.0).abs() < 1e-10);
    }

    #[test]
    fn a_sphere_of_the_geometric_mean_curvature_has_more_area_and_less_load_than_the_ellipse() {
        for t in [0.1, 0.3, 0.5, 0.8, 0.99] {
            let ellipse = from_curvature_difference(t);
            let square = 1.0_f64 - t * t;
            assert!(ellipse.area_factor < square.powf(-0.5));
            assert!(ellipse.load_factor > square.powf(-0.25));
        }
    }

    fn ellipses(ratio: f64) -> (f64, f64) {
        let ellipse = Ellipse::from_curvature_ratio(ratio);
        (ellipse.area_factor, ellipse.load_factor)
    }

    #[test]
    fn means_of_one_are_closed() {
        let means = EllipticityMeans::new(|_| (1.0, 1.0));
        for x in [0.01_f64, 0.5, 3.0, 40.0, 1e3, 1e6] {
            let exact = (x + (-x).exp_m1()) / x;
            let (area, load) = means.at(x);
            // The closed form cancels to x/2 for small x.
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
            // The substitution t = sin θ removes the square-root singularity at t = 1.
            let (mut area, mut load) = (0.0, 0.0);
            for (angle, width) in rule.over(0.0, std::f64::consts::FRAC_PI_2) {
                let (t, cosine) = angle.sin_cos();
                let (of_area, of_load) = ellipses((1.0 - t) / (1.0 + t));
                let weight = 2.0 * width * cosine.powi(3) * t * (-x * t * t).exp() * (1.0 + x);
                area += weight * of_area;
                load += weight * of_load;
            }
            let found = transform(&nodes, x);
            // Logarithms in the factors limit the Gauss rule to algebraic convergence.
            assert!((found.0 / area - 1.0).abs() < 1e-9, "{x} {} {area}", found.0);
            assert!((found.1 / load - 1.0).abs() < 1e-9, "{x} {} {load}", found.1);
        }
    }
}
