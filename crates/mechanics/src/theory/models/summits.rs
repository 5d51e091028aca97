//! Nayak's statistics of the summits of an isotropic Gaussian surface.
//!
//! The joint distribution of the summits depends on three moments of the spectrum: m0 = ⟨h²⟩,
//! m2 = ⟨h_x²⟩ and m4 = ⟨h_xx²⟩ (Longuet-Higgins 1957, Nayak 1971). Its variables are the height z,
//! the mean curvature H = (κ₁ + κ₂)/2, and half the difference of the principal curvatures,
//! d = (κ₁ − κ₂)/2. Curvatures are positive for a convex surface.
//!
//! Reduced units are √m0 for heights, m2/√m0 for curvatures and m0/m2 for areas. In these units, a
//! surface of Nayak's parameter α = m0 m4/m2² has m0 = m2 = 1 and m4 = α.
//!
//! `GaussianHeights` describes the heights of summits of one mean curvature.

use std::f64::consts::{PI, SQRT_2};

use crate::theory::persson::erfcx;

/// Spectral moments of an isotropic Gaussian surface, which determine its summits.
///
/// Nayak's parameter α = m0 m4/m2² is at least 3/2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summits {
    /// Variance m0 of the heights.
    pub m0: f64,
    /// Variance m2 of the slope along one direction, equal to half the mean square gradient.
    pub m2: f64,
    /// Variance m4 of the second derivative along one direction.
    pub m4: f64,
}

impl Summits {
    /// Returns the spectral moments for Nayak's parameter α, in units with m0 = m2 = 1.
    pub fn reduced(nayak: f64) -> Self {
        Self { m0: 1.0, m2: 1.0, m4: nayak }
    }

    /// Returns Nayak's parameter α = m0 m4/m2².
    pub fn nayak(&self) -> f64 {
        self.m0 * self.m4 / (self.m2 * self.m2)
    }

    /// Returns the number of summits per unit area, √3/(18π) m4/m2.
    pub fn per_area(&self) -> f64 {
        self.m4 / (6.0 * PI * 3_f64.sqrt() * self.m2)
    }

    /// Returns the mean height 4√(m0/(πα)) of the summits above the mean plane.
    pub fn mean_height(&self) -> f64 {
        4.0 * (self.m0 / (PI * self.nayak())).sqrt()
    }

    /// Returns the mean of the mean curvature H over all summits, (8/3)√(m4/π).
    pub fn mean_curvature(&self) -> f64 {
        8.0 / 3.0 * (self.m4 / PI).sqrt()
    }

    /// Returns the mean square ⟨H²⟩ = (2/3) m4 of the mean curvature over all points of the
    /// surface.
    pub fn curvature_variance(&self) -> f64 {
        2.0 / 3.0 * self.m4
    }

    /// Returns the variance (2/3) m4 − m2²/m0 of the mean curvature over all points of the same
    /// height z.
    ///
    /// The mean over these points is z m2/m0.
    pub fn curvature_variance_at_a_height(&self) -> f64 {
        (self.curvature_variance() - self.m2 * self.m2 / self.m0).max(0.0)
    }

    /// Returns the distribution of the heights of all points with the mean curvature H.
    ///
    /// The heights of the summits with this mean curvature have the same distribution.
    pub(crate) fn heights(&self, mean_curvature: f64) -> GaussianHeights {
        let regression = self.m2 / self.curvature_variance();
        GaussianHeights {
            mean: regression * mean_curvature,
            deviation: (self.m0 - regression * self.m2).max(0.0).sqrt(),
        }
    }

    /// Returns the density of summits per unit of area, of height z, of H and of d, with
    /// z = `height`, H = `mean_curvature` and d = `curvature_difference`.
    ///
    /// It is zero unless 0 ≤ d < H. It is singular at α = 3/2, where z determines H.
    pub fn density(&self, height: f64, mean_curvature: f64, curvature_difference: f64) -> f64 {
        let (h, d) = (mean_curvature, curvature_difference);
        if !(0.0..h).contains(&d) {
            return 0.0;
        }
        let heights = self.heights(h);
        let gaussian = |x: f64, variance: f64| {
            libm::exp(-0.5 * x * x / variance) / (2.0 * PI * variance).sqrt()
        };
        let differences = 3.0 * d / self.m4 * libm::exp(-1.5 * d * d / self.m4);
        let stationary = gaussian(h, self.curvature_variance())
            * gaussian(height - heights.mean, heights.deviation.powi(2))
            * differences;
        (h * h - d * d) / (2.0 * PI * self.m2) * stationary
    }
}

/// Number of standard deviations beyond which the normal density is negligible.
const REACH: f64 = 9.0;

/// Normal distribution of the heights z of the summits of one mean curvature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GaussianHeights {
    pub mean: f64,
    /// Standard deviation of z, which is zero if all heights are equal.
    pub deviation: f64,
}

/// Partial moments ⟨(z − s)₊ⁿ⟩ of the heights z above a plane at height s.
///
/// The area of Hertz contacts is proportional to the moment n = 1, their load to n = 3/2. The
/// derivatives of area and load with respect to s are proportional to n = 0 and n = 1/2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Excess {
    /// Moment n = 0: the fraction of summits above the plane.
    pub fraction: f64,
    /// Moment n = 1/2, in √height.
    pub half: f64,
    /// Moment n = 1: the mean excess height.
    pub first: f64,
    /// Moment n = 3/2, in height^(3/2).
    pub three_halves: f64,
}

impl GaussianHeights {
    /// Returns the partial moments above a plane at height s = `separation`.
    ///
    /// Relative errors are below 1e-13. An exception is the moment n = 1 if the plane is u ≫ 1
    /// standard deviations above the mean: its relative error is u² rounding errors.
    pub fn excess(&self, separation: f64) -> Excess {
        if self.deviation == 0.0 {
            let excess = self.mean - separation;
            return Excess::from_height(excess);
        }
        let standard = Excess::from_standard_normal((separation - self.mean) / self.deviation);
        let root = self.deviation.sqrt();
        Excess {
            fraction: standard.fraction,
            half: standard.half * root,
            first: standard.first * self.deviation,
            three_halves: standard.three_halves * self.deviation * root,
        }
    }
}

impl Excess {
    /// Returns the moments of summits that all have the height z = s + `excess`.
    fn from_height(excess: f64) -> Self {
        let fraction = if excess > 0.0 { 1.0 } else { 0.0 };
        let first = excess.max(0.0);
        Self { fraction, half: first.sqrt(), first, three_halves: first * first.sqrt() }
    }

    /// Returns the moments ⟨(w − u)₊ⁿ⟩ of a standard normal w.
    fn from_standard_normal(u: f64) -> Self {
        let (fraction, first) = whole_powers(u);
        let (half, three_halves) =
            if u < -REACH { half_powers_far_below(u) } else { half_powers(u) };
        Self { fraction, half, first, three_halves }
    }
}

/// Returns the moments ⟨(w − u)₊ⁿ⟩ of a standard normal w for n = 0 and 1: Q(u), and φ(u) − u Q(u).
fn whole_powers(u: f64) -> (f64, f64) {
    if u < 0.0 {
        let above = 0.5 * libm::erfc(u / SQRT_2);
        return (above, density(u) - u * above);
    }
    // Mills' ratio Q/φ avoids cancellation.
    let mills = (0.5 * PI).sqrt() * erfcx(u / SQRT_2);
    (density(u) * mills, density(u) * (1.0 - u * mills))
}

/// Returns the moments ⟨(w − u)₊ⁿ⟩ of a standard normal w for n = 1/2 and 3/2.
///
/// The integration variable is v = √(w − u). The integrand is even and entire in v, so the
/// trapezoidal rule converges exponentially.
fn half_powers(u: f64) -> (f64, f64) {
    let end = (u.max(0.0).powi(2) + REACH * REACH).sqrt() - u;
    // The step is small relative to the width of the integrand: a Gaussian of variance 1/(2u) for
    // u → ∞, and two Gaussians of variance 1/(4|u|) for u → −∞.
    let step = 0.5 / (4.0 * u.abs() + 10.0).sqrt();
    let (mut half, mut three_halves) = (0.0, 0.0);
    for node in 1.. {
        let square = (f64::from(node) * step).powi(2);
        if square > end {
            break;
        }
        let term = square * density(u + square);
        half += term;
        three_halves += square * term;
    }
    (2.0 * step * half, 2.0 * step * three_halves)
}

/// Returns the same as [`half_powers`] for u < −[`REACH`], by the trapezoidal rule in w.
///
/// The singularity at w = u is outside the range of integration.
fn half_powers_far_below(u: f64) -> (f64, f64) {
    const STEPS: i32 = 15;
    let step = REACH / f64::from(STEPS);
    let (mut half, mut three_halves) = (0.0, 0.0);
    for node in -STEPS..=STEPS {
        let w = f64::from(node) * step;
        let term = step * density(w) * (w - u).sqrt();
        half += term;
        three_halves += (w - u) * term;
    }
    (half, three_halves)
}

/// Returns the standard normal density φ.
fn density(w: f64) -> f64 {
    libm::exp(-0.5 * w * w) / (2.0 * PI).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theory::models::quadrature::GaussLegendre;

    /// Returns the integral of `weight(z, H)` times the density of summits over z, H and d.
    fn mean(summits: Summits, weight: impl Fn(f64, f64) -> f64) -> f64 {
        let rule = GaussLegendre::new(48);
        let (rms, bend) = (summits.m0.sqrt(), summits.curvature_variance().sqrt());
        let mut sum = 0.0;
        for (h, of_h) in rule.over(0.0, 9.0 * bend) {
            let heights = summits.heights(h);
            let reach = 9.0 * heights.deviation.min(rms);
            for (z, of_z) in rule.over(heights.mean - reach, heights.mean + reach) {
                for (d, of_d) in rule.over(0.0, h) {
                    sum += of_h * of_z * of_d * summits.density(z, h, d) * weight(z, h);
                }
            }
        }
        sum
    }

    /// Returns the variance of the heights of the summits, m0 (1 − (1 − 3√3 + 16/π)/α).
    ///
    /// The literature rounds the constant to 0.8968 (McCool 1986).
    fn height_variance(summits: &Summits) -> f64 {
        let constant = 1.0 - 3.0 * 3_f64.sqrt() + 16.0 / PI;
        summits.m0 * (1.0 - constant / summits.nayak())
    }

    #[test]
    fn moments_of_the_density_are_the_closed_forms() {
        for (m0, m2, m4) in [(1.0, 1.0, 1.6), (1.0, 1.0, 10.0), (0.09, 4.0, 900.0)] {
            let summits = Summits { m0, m2, m4 };
            let density = mean(summits, |_, _| 1.0);
            let height = mean(summits, |z, _| z) / density;
            let variance = mean(summits, |z, _| z * z) / density - height * height;
            let curvature = mean(summits, |_, h| h) / density;
            let close = |found: f64, exact: f64| {
                assert!((found / exact - 1.0).abs() < 1e-10, "{found} for {exact}");
            };
            close(density, summits.per_area());
            close(height, summits.mean_height());
            close(variance, height_variance(&summits));
            close(curvature, summits.mean_curvature());
        }
    }

    #[test]
    fn variance_of_the_summit_heights_has_the_published_constant() {
        let summits = Summits::reduced(2.0);
        assert!((2.0 * (1.0 - height_variance(&summits)) - 0.8968).abs() < 1e-5);
    }

    #[test]
    fn curvature_follows_from_the_height_on_a_surface_of_one_wavelength() {
        let summits = Summits::reduced(1.5);
        assert_eq!(summits.curvature_variance_at_a_height(), 0.0);
        assert_eq!(summits.heights(2.0).deviation, 0.0);
        assert_eq!(summits.heights(2.0).mean, 2.0);
    }

    #[test]
    fn there_is_no_summit_with_a_negative_principal_curvature() {
        let summits = Summits::reduced(2.0);
        assert_eq!(summits.density(1.0, 1.0, 1.0), 0.0);
        assert_eq!(summits.density(1.0, -1.0, 0.5), 0.0);
        assert!(summits.density(1.0, 1.0, 0.999) > 0.0);
    }

    const STANDARD: GaussianHeights = GaussianHeights { mean: 0.0, deviation: 1.0 };

    #[test]
    fn half_of_the_heights_above_their_mean_have_closed_moments() {
        let excess = STANDARD.excess(0.0);
        // 2^(n/2 − 1) Γ((n + 1)/2)/√π.
        let half = 2_f64.powf(-0.75) * libm::tgamma(0.75) / PI.sqrt();
        let three_halves = 2_f64.powf(-0.25) * libm::tgamma(1.25) / PI.sqrt();
        assert_eq!(excess.fraction, 0.5);
        assert!((excess.half / half - 1.0).abs() < 1e-13);
        assert!((excess.first * (2.0 * PI).sqrt() - 1.0).abs() < 1e-15);
        assert!((excess.three_halves / three_halves - 1.0).abs() < 1e-13);
    }

    #[test]
    fn moments_agree_with_quadrature_at_any_separation() {
        let rule = GaussLegendre::new(100);
        for u in [-60.0_f64, -9.01, -8.99, -3.0, -0.5, 0.0, 0.5, 2.0, 8.0, 20.0, 36.0] {
            let end = (u.max(0.0).hypot(9.0) - u).sqrt();
            let start = (-u - 9.0).max(0.0).sqrt();
            let moment = |power: i32| -> f64 {
                let value = |v: f64| 2.0 * v.powi(power + 1) * density(u + v * v);
                rule.over(start, end).map(|(v, width)| width * value(v)).sum()
            };
            let excess = STANDARD.excess(u);
            let found = [excess.fraction, excess.half, excess.first, excess.three_halves];
            for (power, found) in (0..).zip(found) {
                // Errors: φ(36) amplifies the rounding of an exponent of 650, the first moment u².
                let error = found / moment(power) - 1.0;
                assert!(error.abs() < 1e-13 * (1.0 + u * u / 100.0), "{u}, {power}: {error:e}");
            }
        }
    }

    #[test]
    fn each_moment_is_the_derivative_of_another() {
        let heights = GaussianHeights { mean: 0.7, deviation: 0.3 };
        for separation in [-3.0, 0.0, 0.7, 2.0] {
            let excess = heights.excess(separation);
            let above = heights.excess(separation + 1e-4);
            let below = heights.excess(separation - 1e-4);
            // The error is of second order in the step divided by the deviation.
            let first = (below.first - above.first) / 2e-4;
            let three_halves = (below.three_halves - above.three_halves) / 2e-4;
            assert!((first / excess.fraction - 1.0).abs() < 1e-5);
            assert!((three_halves / (1.5 * excess.half) - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn equal_heights_are_the_limit_of_a_vanishing_deviation() {
        for separation in [-1.0, 0.9, 1.1] {
            let [equal, narrow] = [0.0, 1e-6].map(|deviation| {
                let heights = GaussianHeights { mean: 1.0, deviation };
                heights.excess(separation)
            });
            assert_eq!(equal.fraction, narrow.fraction);
            assert!((equal.half - narrow.half).abs() < 1e-9);
            assert!((equal.first - narrow.first).abs() < 1e-9);
            assert!((equal.three_halves - narrow.three_halves).abs() < 1e-9);
        }
    }
}
