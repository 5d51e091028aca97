//! Contact evolution law for the contact area against the load, with three parameters.
//!
//! The law is proportional at vanishing load. App. C of Yastrebov, Anciaux & Molinari 2015 assumes
//! that the mean contact pressure p̄ = p₀/a, where a is the area fraction, grows with the load as
//! dp̄/dp₀ = β a^(μ−1). This integrates to
//!
//! ```text
//! a = [β + (κy)^(−μ)]^(−1/μ)
//! ```
//!
//! with the load y = p₀/(E* h′). The computation uses Y = κy and t = βY^μ in the form
//! a = Y(1 + t)^(−1/μ), because the printed form overflows for y → 0.

/// Ratio a/y at vanishing load in the asperity model of Bush, Gibson & Thomas 1975: √(2π).
pub const KAPPA_BGT: f64 = 2.506_628_274_631_000_5;

/// Ratio a/y at vanishing load in the theory of Persson 2001: √(8/π).
pub const KAPPA_PERSSON: f64 = 1.595_769_121_605_730_7;

/// Contact evolution law, eq. (8) of Yastrebov, Anciaux & Molinari 2015.
///
/// Loads and mean pressures are in units of E* h′, areas are fractions of the nominal area. All
/// parameters are positive. With β < 1, the area exceeds one at heavy load. Use a law only in the
/// range of loads of its fit.
///
/// ```
/// use asperity_mechanics::theory::law::{ContactEvolution, KAPPA_BGT};
///
/// // With β = μ = 1, a = κy/(1 + κy).
/// let law = ContactEvolution { kappa: KAPPA_BGT, beta: 1.0, mu: 1.0 };
/// let (load, proportional) = (0.3, 0.3 * KAPPA_BGT);
/// let area = law.area(load);
/// assert!((area - proportional / (1.0 + proportional)).abs() < 1e-15);
/// assert_eq!(law.slope(0.0), KAPPA_BGT);
/// assert!((law.load(area).unwrap() - load).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactEvolution {
    /// Slope κ of the area at zero load.
    pub kappa: f64,
    /// Factor β in dp̄/dp₀ = β a^(μ−1). The area tends to β^(−1/μ) at heavy load.
    pub beta: f64,
    /// Exponent μ in dp̄/dp₀ = β a^(μ−1).
    pub mu: f64,
}

impl ContactEvolution {
    /// Returns the area fraction a under a load y ≥ 0.
    #[inline]
    pub fn area(&self, load: f64) -> f64 {
        let (proportional, bend) = self.reduced(load);
        proportional * libm::exp(-libm::log1p(bend) / self.mu)
    }

    /// Returns the slope da/dy, eq. (9) of Yastrebov, Anciaux & Molinari 2015. It is κ
    /// at zero load.
    #[inline]
    pub fn slope(&self, load: f64) -> f64 {
        let (_, bend) = self.reduced(load);
        self.kappa * libm::exp(-(1.0 + 1.0 / self.mu) * libm::log1p(bend))
    }

    /// Returns the second derivative d²a/dy².
    ///
    /// It is never positive. It diverges at zero load if μ < 1.
    pub fn curvature(&self, load: f64) -> f64 {
        let (proportional, bend) = self.reduced(load);
        let decay = libm::exp(-(2.0 + 1.0 / self.mu) * libm::log1p(bend));
        let bend_per_load = self.beta * libm::pow(proportional, self.mu - 1.0);
        -self.kappa.powi(2) * (1.0 + self.mu) * bend_per_load * decay
    }

    /// Returns the third derivative d³a/dy³. The slope da/dy is convex where this derivative is
    /// positive.
    pub fn slope_curvature(&self, load: f64) -> f64 {
        let (proportional, bend) = self.reduced(load);
        let decay = libm::exp(-(3.0 + 1.0 / self.mu) * libm::log1p(bend));
        let scale = (1.0 + self.mu) * self.beta * libm::pow(proportional, self.mu - 2.0);
        scale * self.kappa.powi(3) * decay * ((1.0 - self.mu) + (2.0 + self.mu) * bend)
    }

    /// Returns the load y at which the area fraction is `area`, or `None` if no load has this area.
    pub fn load(&self, area: f64) -> Option<f64> {
        let remaining = -self.beta * libm::pow(area, self.mu);
        (area >= 0.0 && remaining > -1.0)
            .then(|| area / self.kappa * libm::exp(-libm::log1p(remaining) / self.mu))
    }

    /// Returns the mean contact pressure p̄ = y/a in units of E* h′. It is 1/κ at zero load.
    pub fn mean_pressure(&self, load: f64) -> f64 {
        let (_, bend) = self.reduced(load);
        libm::exp(libm::log1p(bend) / self.mu) / self.kappa
    }

    /// Returns [∂a/∂ln β, ∂a/∂ln μ, ∂a/∂ln κ] of the area a.
    #[inline]
    pub fn area_gradient(&self, load: f64) -> [f64; 3] {
        let Some(terms) = self.gradient_terms(load) else {
            return [0.0; 3];
        };
        let area = self.area(load);
        [
            -area * terms.deviation / self.mu,
            area * (terms.log_bend / self.mu - terms.deviation * terms.log_proportional),
            area * (1.0 - terms.deviation),
        ]
    }

    /// Returns [∂s/∂ln β, ∂s/∂ln μ, ∂s/∂ln κ] of the slope s = da/dy.
    #[inline]
    pub fn slope_gradient(&self, load: f64) -> [f64; 3] {
        let Some(terms) = self.gradient_terms(load) else {
            return [0.0, 0.0, self.kappa];
        };
        let slope = self.slope(load);
        let factor = (1.0 + self.mu) * terms.deviation;
        [
            -slope * factor / self.mu,
            slope * (terms.log_bend / self.mu - factor * terms.log_proportional),
            slope * (1.0 - factor),
        ]
    }

    /// Returns Y = κy and t = βY^μ.
    #[inline]
    fn reduced(&self, load: f64) -> (f64, f64) {
        let proportional = self.kappa * load;
        (proportional, self.beta * libm::pow(proportional, self.mu))
    }

    /// Returns the terms that [`area_gradient`](Self::area_gradient) and
    /// [`slope_gradient`](Self::slope_gradient) share, or `None` at zero load.
    ///
    /// At zero load, ln Y is infinite, but its product with t is zero.
    #[inline]
    fn gradient_terms(&self, load: f64) -> Option<GradientTerms> {
        let (proportional, bend) = self.reduced(load);
        (proportional > 0.0).then(|| GradientTerms {
            log_proportional: libm::log(proportional),
            log_bend: libm::log1p(bend),
            deviation: bend / (1.0 + bend),
        })
    }
}

struct GradientTerms {
    /// Logarithm ln Y, where Y = κy.
    log_proportional: f64,
    /// Logarithm ln(1 + t), where t = βY^μ.
    log_bend: f64,
    /// Relative difference (a − y da/dy)/a, which equals t/(1 + t) = βa^μ.
    deviation: f64,
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use proptest::prelude::*;

    fn law() -> impl Strategy<Value = ContactEvolution> {
        (1.0..4.0f64, 0.05..2.0f64, 0.1..2.5f64).prop_map(|(kappa, beta, mu)| ContactEvolution {
            kappa,
            beta,
            mu,
        })
    }

    fn close(left: f64, right: f64, tolerance: f64) -> Result<(), TestCaseError> {
        let scale = left.abs().max(right.abs()).max(1e-300);
        prop_assert!((left - right).abs() <= tolerance * scale, "{left:e} against {right:e}");
        Ok(())
    }

    /// Returns the derivative of `function` at `at`, as a central difference of fourth order.
    ///
    /// With steps of 1e-3 of the load, the truncation error is 1e-11, and the rounding error is
    /// 1e-13 relative to f/(f′ y).
    fn derivative(function: impl Fn(f64) -> f64, at: f64, step: f64) -> f64 {
        let odd = |s: f64| function(at + s) - function(at - s);
        (8.0 * odd(step) - odd(2.0 * step)) / (12.0 * step)
    }

    #[test]
    fn constants_are_the_closed_forms() {
        assert!((KAPPA_BGT - (2.0 * PI).sqrt()).abs() < 1e-15);
        assert!((KAPPA_PERSSON - (8.0 / PI).sqrt()).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn slope_satisfies_the_differential_equation(law in law(), load in 1e-6..3.0f64) {
            let area = law.area(load);
            // The tolerance is relative to a, because the right side cancels at heavy load.
            let left = load * law.slope(load);
            let right = area - law.beta * area.powf(1.0 + law.mu);
            prop_assert!((left - right).abs() < 1e-12 * area);
        }

        #[test]
        fn area_equals_its_printed_form(law in law(), load in 1e-3..3.0f64) {
            let printed = (law.beta + (law.kappa * load).powf(-law.mu)).powf(-1.0 / law.mu);
            close(law.area(load), printed, 1e-12)?;
        }

        #[test]
        fn load_inverts_the_area(law in law(), load in 1e-9..1.0f64) {
            let found = law.load(law.area(load)).expect("an area of the law is reached");
            // The condition number is (1 + βY^μ)/μ.
            let (_, bend) = law.reduced(load);
            close(found, load, 1e-14 * (1.0 + bend) / law.mu.min(1.0) * 10.0)?;
        }

        #[test]
        fn curvature_satisfies_the_differentiated_equation(law in law(), load in 1e-4..3.0f64) {
            // y a' = a − βa^(1+μ) differentiated: y a'' = −β(1+μ)a^μ a'.
            let right = -law.beta * (1.0 + law.mu) * law.area(load).powf(law.mu) * law.slope(load);
            close(load * law.curvature(load), right, 1e-12)?;
        }

        #[test]
        fn slope_curvature_satisfies_the_twice_differentiated_equation(
            law in law(), load in 1e-4..3.0f64
        ) {
            let (area, slope, curvature) = (law.area(load), law.slope(load), law.curvature(load));
            let growth = law.mu * slope.powi(2) / area + curvature;
            let terms = [curvature, law.beta * (1.0 + law.mu) * area.powf(law.mu) * growth];
            let scale = terms[0].abs() + law.beta * (1.0 + law.mu) * area.powf(law.mu)
                * (law.mu * slope.powi(2) / area + curvature.abs());
            let residual = load * law.slope_curvature(load) + terms[0] + terms[1];
            prop_assert!(residual.abs() < 1e-12 * scale);
        }

        #[test]
        fn derivatives_agree_with_differences(law in law(), load in 0.01..2.0f64) {
            let step = 1e-3 * load;
            close(law.slope(load), derivative(|y| law.area(y), load, step), 1e-8)?;
            close(law.curvature(load), derivative(|y| law.slope(y), load, step), 1e-8)?;
        }

        #[test]
        fn mean_pressure_grows_with_the_load_as_a_power_of_the_area(
            law in law(), load in 0.01..2.0f64
        ) {
            close(law.mean_pressure(load), load / law.area(load), 1e-13)?;
        }

        #[test]
        fn gradients_agree_with_differences_in_the_logarithms(law in law(), load in 1e-3..2.0f64) {
            let moved = |which: usize, by: f64| {
                let mut moved = law;
                let parameter = match which {
                    0 => &mut moved.beta,
                    1 => &mut moved.mu,
                    _ => &mut moved.kappa,
                };
                *parameter *= by.exp();
                moved
            };
            for which in 0..3 {
                let area = derivative(|by| moved(which, by).area(load), 0.0, 1e-3);
                prop_assert!((law.area_gradient(load)[which] - area).abs() < 1e-8 * law.area(load));
                let slope = derivative(|by| moved(which, by).slope(load), 0.0, 1e-3);
                prop_assert!((law.slope_gradient(load)[which] - slope).abs() < 1e-8 * law.kappa);
            }
        }
    }

    #[test]
    fn area_is_proportional_to_a_vanishing_load() {
        let law = ContactEvolution { kappa: 2.7, beta: 1.3, mu: 0.55 };
        for load in [1e-300, 1e-100, 1e-30] {
            // The relative deviation βY^μ/μ is 1e-16 at the largest of these loads.
            assert!((law.area(load) / (law.kappa * load) - 1.0).abs() < 1e-14);
        }
        assert_eq!((law.area(0.0), law.slope(0.0)), (0.0, 2.7));
    }

    #[test]
    fn area_saturates_at_one_only_with_a_prefactor_of_one() {
        let law = |beta| ContactEvolution { kappa: 2.5, beta, mu: 0.6 };
        // ln Y = 70 and ln(1 + t)/μ cancel.
        assert!((law(1.0).area(1e30) - 1.0).abs() < 1e-13);
        assert!((law(0.5).area(1e30) - 0.5f64.powf(-1.0 / 0.6)).abs() < 1e-13);
        assert_eq!(law(1.0).load(1.0), None);
    }
}
