//! Error functions where the standard ones lose their digits: scaled complement and inverses.

use std::f64::consts::PI;

/// From here the continued fraction converges in few terms and exp(x²) starts to lose digits.
const CONTINUED_FRACTION_FROM: f64 = 4.0;
/// Terms after which the fraction has converged to rounding at [`CONTINUED_FRACTION_FROM`].
const CONTINUED_FRACTION_TERMS: u32 = 40;
/// Newton's iterations are quadratic and monotone: ten are plenty from the bounds they start at.
const NEWTON_ITERATIONS: usize = 20;

/// exp(x²) erfc(x) for x ≥ 0, which neither overflows nor vanishes.
pub fn erfcx(x: f64) -> f64 {
    if x < CONTINUED_FRACTION_FROM {
        return (x * x).exp() * libm::erfc(x);
    }
    let fraction =
        (1..=CONTINUED_FRACTION_TERMS).rev().fold(x, |tail, term| x + 0.5 * f64::from(term) / tail);
    1.0 / (fraction * PI.sqrt())
}

/// ln erfc(x) for x ≥ 0, also where erfc(x) underflows.
pub fn ln_erfc(x: f64) -> f64 {
    if x < 0.5 { (-libm::erf(x)).ln_1p() } else { erfcx(x).ln() - x * x }
}

/// d ln erfc(x)/dx for x ≥ 0.
pub fn ln_erfc_slope(x: f64) -> f64 {
    -2.0 / (PI.sqrt() * erfcx(x))
}

/// The x ≥ 0 at which erf(x) is `value`; `None` outside [0, 1).
pub fn erf_inverse(value: f64) -> Option<f64> {
    if !(0.0..1.0).contains(&value) {
        return None;
    }
    if value > 0.5 {
        return erfc_inverse(1.0 - value);
    }
    // erf is concave and below its tangent at zero: the iterates grow towards the root.
    let mut x = value * PI.sqrt() / 2.0;
    for _ in 0..NEWTON_ITERATIONS {
        let step = (value - libm::erf(x)) * PI.sqrt() / 2.0 * (x * x).exp();
        x += step;
        if step.abs() <= f64::EPSILON * x {
            break;
        }
    }
    Some(x)
}

/// The x ≥ 0 at which erfc(x) is `value`; `None` outside (0, 1].
pub fn erfc_inverse(value: f64) -> Option<f64> {
    if !(value > 0.0 && value <= 1.0) {
        return None;
    }
    if value >= 0.5 {
        return erf_inverse(1.0 - value);
    }
    // ln erfc is concave and below −x²: the iterates shrink towards the root.
    let target = value.ln();
    let mut x = (-target).sqrt();
    for _ in 0..NEWTON_ITERATIONS {
        let step = (target - ln_erfc(x)) / ln_erfc_slope(x);
        x += step;
        if step.abs() <= f64::EPSILON * x {
            break;
        }
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_branches_of_erfcx_meet() {
        let below = erfcx(CONTINUED_FRACTION_FROM * (1.0 - f64::EPSILON));
        let above = erfcx(CONTINUED_FRACTION_FROM);
        // exp(x²) carries the rounding of x² = 16.
        assert!((below / above - 1.0).abs() < 1e-14);
    }

    #[test]
    fn erfcx_keeps_between_its_rational_bounds() {
        // 1/(x + √(x² + 2)) < (√π/2) erfcx(x) ≤ 1/(x + √(x² + 4/π)), Abramowitz & Stegun 7.1.13.
        for x in [0.1f64, 1.0, 3.9, 4.1, 10.0, 26.0, 100.0] {
            let value = erfcx(x) * PI.sqrt() / 2.0;
            assert!(value > 1.0 / (x + (x * x + 2.0).sqrt()));
            assert!(value <= 1.0 / (x + (x * x + 4.0 / PI).sqrt()));
        }
    }

    #[test]
    fn ln_erfc_goes_on_where_erfc_vanishes() {
        assert_eq!(libm::erfc(30.0), 0.0);
        // The first terms of the asymptotic series; the next is 15/(8x⁶) = 3e-9.
        let series = 1.0 - 1.0 / 1800.0 + 3.0 / (4.0 * 30f64.powi(4));
        assert!((ln_erfc(30.0) - (series / (30.0 * PI.sqrt())).ln() + 900.0).abs() < 4e-9);
    }

    #[test]
    fn slope_of_ln_erfc_agrees_with_differences() {
        for x in [0.01, 0.49, 0.51, 3.0, 5.0, 28.0] {
            let difference = (ln_erfc(x + 1e-4) - ln_erfc(x - 1e-4)) / 2e-4;
            assert!((difference / ln_erfc_slope(x) - 1.0).abs() < 1e-8);
        }
    }

    #[test]
    fn inverses_return_what_went_in() {
        for x in [0.0, 1e-12, 0.3, 0.4769, 0.48, 1.0, 5.0, 26.0] {
            let found = erfc_inverse(libm::erfc(x)).expect("erfc is within (0, 1]");
            // Below one half erfc itself is rounded to an ulp of one.
            assert!((found - x).abs() < 4.0 * f64::EPSILON * (1.0 + x));
        }
        for x in [0.0, 1e-300, 1e-12, 0.3, 0.4769, 0.48, 1.0] {
            let found = erf_inverse(libm::erf(x)).expect("erf is within [0, 1)");
            assert!((found - x).abs() <= 1e-15 * x * 4.0);
        }
    }

    #[test]
    fn inverses_have_no_value_outside_the_range() {
        assert!(erf_inverse(1.0).is_none() && erf_inverse(-0.1).is_none());
        assert!(erfc_inverse(0.0).is_none() && erfc_inverse(1.1).is_none());
        assert!(erf_inverse(f64::NAN).is_none() && erfc_inverse(f64::NAN).is_none());
    }
}
