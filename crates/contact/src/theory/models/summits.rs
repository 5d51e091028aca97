//! Nayak's statistics of the summits of an isotropic Gaussian surface.
//!
//! Height z, mean curvature H = (κ₁ + κ₂)/2 and half the difference d = (κ₁ − κ₂)/2 of the
//! principal curvatures of summits, both positive where the surface bends down, follow from three
//! moments of the spectrum: m0 = ⟨h²⟩, m2 = ⟨h_x²⟩ and m4 = ⟨h_xx²⟩ (Longuet-Higgins 1957,
//! Nayak 1971). A surface of Nayak's parameter α = m0 m4/m2² is that of m0 = m2 = 1, m4 = α with
//! heights in units of √m0, curvatures in units of m2/√m0 and areas in units of m0/m2.

use std::f64::consts::PI;

use super::gaussian_heights::GaussianHeights;

/// Moments of a spectrum in one direction; their α = m0 m4/m2² is at least 3/2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summits {
    /// Variance of the heights.
    pub m0: f64,
    /// Variance of the slope in one direction, half the mean square gradient.
    pub m2: f64,
    /// Variance of the second derivative in one direction.
    pub m4: f64,
}

impl Summits {
    /// In the units in which m0 = m2 = 1.
    pub fn reduced(nayak: f64) -> Self {
        Self { m0: 1.0, m2: 1.0, m4: nayak }
    }

    /// Nayak's parameter α.
    pub fn nayak(&self) -> f64 {
        self.m0 * self.m4 / (self.m2 * self.m2)
    }

    /// Summits per unit area.
    pub fn per_area(&self) -> f64 {
        self.m4 / (6.0 * PI * 3_f64.sqrt() * self.m2)
    }

    /// Mean height of the summits, 4√(m0/(πα)), above the mean height of the surface.
    pub fn mean_height(&self) -> f64 {
        4.0 * (self.m0 / (PI * self.nayak())).sqrt()
    }

    /// Variance of the heights of the summits, m0 (1 − (1 − 3√3 + 16/π)/α); the literature rounds
    /// the constant to 0.8968 (McCool 1986).
    pub fn height_variance(&self) -> f64 {
        let constant = 1.0 - 3.0 * 3_f64.sqrt() + 16.0 / PI;
        self.m0 * (1.0 - constant / self.nayak())
    }

    /// Mean of the mean curvature of the summits, (8/3)√(m4/π).
    pub fn mean_curvature(&self) -> f64 {
        8.0 / 3.0 * (self.m4 / PI).sqrt()
    }

    /// Variance of the mean curvature over all points of the surface, about zero.
    pub fn curvature_variance(&self) -> f64 {
        2.0 / 3.0 * self.m4
    }

    /// Variance of the mean curvature over all points of one height, about z m2/m0.
    pub fn curvature_variance_at_a_height(&self) -> f64 {
        (self.curvature_variance() - self.m2 * self.m2 / self.m0).max(0.0)
    }

    /// Heights of the points, and of the summits, of one mean curvature H.
    pub(crate) fn heights(&self, mean_curvature: f64) -> GaussianHeights {
        let share = self.m2 / self.curvature_variance();
        GaussianHeights {
            mean: share * mean_curvature,
            deviation: (self.m0 - share * self.m2).max(0.0).sqrt(),
        }
    }

    /// Of all summits per unit area, those per unit of height, of H and of d; zero unless
    /// 0 ≤ d < H. It is singular at α = 3/2, where the height decides H.
    pub fn density(&self, height: f64, mean_curvature: f64, curvature_difference: f64) -> f64 {
        let (h, d) = (mean_curvature, curvature_difference);
        if !(0.0..h).contains(&d) {
            return 0.0;
        }
        let heights = self.heights(h);
        let gaussian =
            |x: f64, variance: f64| (-0.5 * x * x / variance).exp() / (2.0 * PI * variance).sqrt();
        let differences = 3.0 * d / self.m4 * (-1.5 * d * d / self.m4).exp();
        let stationary = gaussian(h, self.curvature_variance())
            * gaussian(height - heights.mean, heights.deviation.powi(2))
            * differences;
        (h * h - d * d) / (2.0 * PI * self.m2) * stationary
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theory::models::quadrature::GaussLegendre;

    /// ∫ weight(z, H) D dz dH dd.
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
            close(variance, summits.height_variance());
            close(curvature, summits.mean_curvature());
        }
    }

    #[test]
    fn variance_of_the_summit_heights_has_the_published_constant() {
        let summits = Summits::reduced(2.0);
        assert!((2.0 * (1.0 - summits.height_variance()) - 0.8968).abs() < 1e-5);
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
}
