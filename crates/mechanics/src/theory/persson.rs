//! Persson's theory of rough contact.
//!
//! The distribution of the contact pressure follows a diffusion equation in the magnification, with
//! an absorbing boundary at zero pressure. Persson 2001 obtains a = erf(√2 y) for any spectrum,
//! with the load y = p₀/(E* h′), the rms slope h′ and the area fraction a. Loads and pressures are
//! in units of E* h′. In these units, the variance of the pressure at full contact is 1/4.
//!
//! The module also provides ln erfc and the inverses of erf and erfc, accurate in their tails.

use std::f64::consts::{PI, SQRT_2};

use super::law::KAPPA_PERSSON;

/// Returns the area fraction a = erf(√2 y) under a load y ≥ 0.
///
/// ```
/// use asperity_mechanics::theory::persson;
///
/// // Half of the surface is in contact if erf(√2 y) = 1/2.
/// assert!((persson::area(0.4769362762044699 / 2_f64.sqrt()) - 0.5).abs() < 1e-15);
/// // Light loads: a = √(8/π) y.
/// assert!((persson::area(1e-6) / 1e-6 - 1.5957691216057308).abs() < 1e-9);
/// ```
pub fn area(load: f64) -> f64 {
    libm::erf(SQRT_2 * load)
}

/// Returns the non-contact fraction 1 − a = erfc(√2 y), to full relative precision up to y ≈ 18.
pub fn noncontact(load: f64) -> f64 {
    libm::erfc(SQRT_2 * load)
}

/// Returns the slope da/dy. It is √(8/π) at zero load.
///
/// As a function of y, it is concave up to y = 1/2 and convex beyond.
pub fn slope(load: f64) -> f64 {
    KAPPA_PERSSON * libm::exp(-2.0 * load * load)
}

/// Returns the second derivative d²a/dy².
pub fn curvature(load: f64) -> f64 {
    -4.0 * load * slope(load)
}

/// Returns the third derivative d³a/dy³. The slope da/dy is convex where this derivative is
/// positive.
pub fn slope_curvature(load: f64) -> f64 {
    (16.0 * load * load - 4.0) * slope(load)
}

/// Returns the load y at which the area fraction is `area`, or `None` if `area` is outside [0, 1).
pub fn load(area: f64) -> Option<f64> {
    erf_inverse(area).map(|x| x / SQRT_2)
}

/// Returns the load y at which the non-contact fraction 1 − a is `noncontact`, or `None` if it is
/// outside (0, 1].
///
/// Near full contact, it is more accurate than [`load`], because a loses the digits of 1 − a.
pub fn load_at_noncontact(noncontact: f64) -> Option<f64> {
    erfc_inverse(noncontact).map(|x| x / SQRT_2)
}

/// Returns F(y) = −ln[(1 − a) y √(2π)] for a load y and a non-contact fraction 1 − a.
///
/// By eq. (10) of Yastrebov, Anciaux & Molinari 2015, F tends to 2y^η near full
/// contact, with η = 2 in Persson's theory. Returns `None` at zero load and at full contact.
pub fn approach_to_full_contact(load: f64, noncontact: f64) -> Option<f64> {
    (noncontact > 0.0 && load > 0.0)
        .then(|| -libm::log(noncontact) - libm::log(load * (2.0 * PI).sqrt()))
}

/// Returns F(y) = −ln[(1 − a) y √(2π)] with 1 − a of Persson's theory.
///
/// At heavy load, F = 2y² + 1/(4y²) − …
pub fn approach(load: f64) -> f64 {
    let x = SQRT_2 * load;
    x * x - libm::log(x * PI.sqrt() * erfcx(x))
}

/// Returns the probability density of the contact pressure p over the nominal area at
/// p = `pressure` (Persson 2001).
///
/// The density is for positive pressures only. Its integral is the area fraction, and its first
/// moment is the load.
pub fn pressure_density(load: f64, pressure: f64) -> f64 {
    if pressure <= 0.0 {
        return 0.0;
    }
    // The density is a Gaussian at +y minus its image at −y. Writing the image as a factor avoids
    // cancellation.
    let image = -libm::expm1(-8.0 * pressure * load);
    (2.0 / PI).sqrt() * libm::exp(-2.0 * (pressure - load).powi(2)) * image
}

/// Returns the fraction of the nominal area with pressures from `low` to `high`.
///
/// This is the integral of [`pressure_density`] over these pressures. It requires
/// 0 ≤ `low` ≤ `high`.
pub fn fraction_between(load: f64, low: f64, high: f64) -> f64 {
    let around = |centre: f64| {
        let [low, high] = [low, high].map(|pressure| SQRT_2 * (pressure - centre));
        // If both ends are on one side of the centre, erfc avoids cancellation.
        if low >= 0.0 {
            libm::erfc(low) - libm::erfc(high)
        } else if high <= 0.0 {
            libm::erfc(-high) - libm::erfc(-low)
        } else {
            libm::erf(high) - libm::erf(low)
        }
    };
    0.5 * (around(load) - around(-load))
}

/// Minimum x for which [`erfcx`] uses a continued fraction, because exp(x²) erfc(x) loses digits.
const CONTINUED_FRACTION_FROM: f64 = 4.0;

/// Number of terms of the continued fraction, sufficient from [`CONTINUED_FRACTION_FROM`] on.
const CONTINUED_FRACTION_TERMS: u32 = 40;

/// Maximum number of Newton iterations for the inverses of erf and erfc; about ten are needed.
const NEWTON_ITERATIONS: usize = 20;

/// Returns the scaled complementary error function exp(x²) erfc(x) for x ≥ 0.
pub(crate) fn erfcx(x: f64) -> f64 {
    if x < CONTINUED_FRACTION_FROM {
        return libm::exp(x * x) * libm::erfc(x);
    }
    let fraction =
        (1..=CONTINUED_FRACTION_TERMS).rev().fold(x, |tail, term| x + 0.5 * f64::from(term) / tail);
    1.0 / (fraction * PI.sqrt())
}

/// Returns ln erfc(x) for x ≥ 0, even where erfc(x) underflows.
pub fn ln_erfc(x: f64) -> f64 {
    if x < 0.5 { libm::log1p(-libm::erf(x)) } else { libm::log(erfcx(x)) - x * x }
}

/// Returns the derivative d ln erfc(x)/dx for x ≥ 0.
pub fn ln_erfc_slope(x: f64) -> f64 {
    -2.0 / (PI.sqrt() * erfcx(x))
}

/// Returns the x ≥ 0 with erf(x) = `value`, or `None` if `value` is outside [0, 1).
fn erf_inverse(value: f64) -> Option<f64> {
    if !(0.0..1.0).contains(&value) {
        return None;
    }
    if value > 0.5 {
        return erfc_inverse(1.0 - value);
    }
    // erf is concave and below its tangent at zero, so the iterates increase to the root.
    let mut x = value * PI.sqrt() / 2.0;
    for _ in 0..NEWTON_ITERATIONS {
        let step = (value - libm::erf(x)) * PI.sqrt() / 2.0 * libm::exp(x * x);
        x += step;
        if step.abs() <= f64::EPSILON * x {
            break;
        }
    }
    Some(x)
}

/// Returns the x ≥ 0 with erfc(x) = `value`, or `None` if `value` is outside (0, 1].
pub fn erfc_inverse(value: f64) -> Option<f64> {
    if !(value > 0.0 && value <= 1.0) {
        return None;
    }
    if value >= 0.5 {
        return erf_inverse(1.0 - value);
    }
    // ln erfc is concave and below −x², so the iterates decrease to the root.
    let target = libm::log(value);
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
    use proptest::prelude::*;

    use super::*;

    /// Returns ∫ pⁿ f(p) dp with n = `power` and the pressure density f, by Simpson's rule up to
    /// p = 8, where the density is below 1e-30.
    fn moment(load: f64, power: i32) -> f64 {
        let (steps, width) = (4000, 8.0 / 4000.0);
        let value = |i: u32| {
            let pressure = f64::from(i) * width;
            pressure_density(load, pressure) * pressure.powi(power)
        };
        let inner: f64 = (1..steps).map(|i| value(i) * if i % 2 == 1 { 4.0 } else { 2.0 }).sum();
        (value(0) + inner + value(steps)) * width / 3.0
    }

    #[test]
    fn fractions_between_pressures_add_up_to_area_and_load() {
        for load in [1e-3, 0.03, 0.3, 1.0, 1.7] {
            // The range includes the tail; bins are so narrow that their mean is their middle.
            let (bins, width) = (14_000_u32, 5e-4);
            let fraction = |bin: u32| {
                let low = f64::from(bin) * width;
                fraction_between(load, low, low + width)
            };
            let total: f64 = (0..bins).map(fraction).sum();
            let moment: f64 =
                (0..bins).map(|bin| (f64::from(bin) + 0.5) * width * fraction(bin)).sum();
            assert!((total - area(load)).abs() < 1e-12, "{load}");
            assert!((moment - load).abs() < 1e-6, "{load}: {moment}");
        }
    }

    #[test]
    fn the_fraction_of_a_narrow_interval_is_the_density() {
        for (load, pressure) in [(1e-4, 0.5), (0.2, 0.01), (0.2, 2.5), (1.0, 1.0)] {
            let fraction = fraction_between(load, pressure - 1e-4, pressure + 1e-4) / 2e-4;
            let density = pressure_density(load, pressure);
            // Nearly equal terms cancel under light loads.
            assert!((fraction / density - 1.0).abs() < 1e-6, "{load} {pressure}");
        }
    }

    #[test]
    fn area_under_the_heaviest_light_load_is_nearly_proportional() {
        assert!((area(0.06) - 0.095_516_852).abs() < 1e-9);
        assert!((KAPPA_PERSSON * 0.06 - 0.095_746_147).abs() < 1e-9);
    }

    #[test]
    fn area_under_1_7_is_not_full_contact() {
        assert!((area(1.7) - 0.999_33).abs() < 5e-6);
        assert!((noncontact(1.7) - (1.0 - area(1.7))).abs() < 1e-15);
    }

    #[test]
    fn slope_turns_from_concave_to_convex_at_one_half() {
        assert!(slope_curvature(0.499) < 0.0 && slope_curvature(0.501) > 0.0);
        assert!((area(0.5) - 0.682_689_492_137).abs() < 1e-12);
    }

    #[test]
    fn pressure_density_integrates_to_the_area_and_to_the_load() {
        for load in [0.01, 0.06, 0.5, 1.7] {
            assert!((moment(load, 0) - area(load)).abs() < 1e-10);
            assert!((moment(load, 1) - load).abs() < 1e-10);
        }
    }

    #[test]
    fn approach_to_full_contact_is_quadratic_with_an_inverse_square_correction() {
        for load in [3.0, 6.0, 20.0] {
            let x_squared = 2.0 * load * load;
            // The next term of the expansion of ln(x√π erfcx x) is 5/(8x⁴).
            let rest = approach(load) - x_squared - 0.5 / x_squared;
            assert!(
                (rest * x_squared * x_squared + 0.625).abs()
                    < 2.5 / x_squared + 1e-16 * x_squared.powi(3)
            );
        }
    }

    proptest! {
        #[test]
        fn approach_is_that_of_the_fraction_out_of_contact(load in 1e-3..15.0f64) {
            let found = approach_to_full_contact(load, noncontact(load)).expect("not full contact");
            prop_assert!((found - approach(load)).abs() < 1e-12 * (1.0 + found.abs()));
        }

        #[test]
        fn loads_invert_the_area_and_its_complement(exponent in -9.0..0.0f64, heavy in 0.0..15.0f64) {
            let light = 10f64.powf(exponent);
            let found = load(area(light)).expect("below full contact");
            // The condition number a/(y a') is at most 5 up to y = 1; 1 − a has an error of an ulp.
            prop_assert!((found / light - 1.0).abs() < 1e-14);
            let found = load_at_noncontact(noncontact(heavy)).expect("below full contact");
            prop_assert!((found - heavy).abs() < 1e-14 * (1.0 + heavy));
        }

        #[test]
        fn derivatives_agree_with_differences(load in 0.01..2.0f64) {
            let difference = |f: fn(f64) -> f64| (f(load + 1e-5) - f(load - 1e-5)) / 2e-5;
            // The truncation error is 1e-10 times the third derivative, the rounding error 1e-11.
            prop_assert!((difference(area) - slope(load)).abs() < 1e-9);
            prop_assert!((difference(slope) - curvature(load)).abs() < 1e-8);
            prop_assert!((difference(curvature) - slope_curvature(load)).abs() < 1e-7);
        }
    }

    #[test]
    fn there_is_no_load_of_full_contact() {
        assert_eq!(
            (load(1.0), load_at_noncontact(0.0), approach_to_full_contact(1.0, 0.0)),
            (None, None, None)
        );
    }

    #[test]
    fn both_branches_of_erfcx_meet() {
        let below = erfcx(CONTINUED_FRACTION_FROM * (1.0 - f64::EPSILON));
        let above = erfcx(CONTINUED_FRACTION_FROM);
        // exp(x²) amplifies the rounding error of x² = 16.
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
    fn ln_erfc_is_finite_where_erfc_underflows() {
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
    fn inverses_return_the_argument() {
        for x in [0.0, 1e-12, 0.3, 0.4769, 0.48, 1.0, 5.0, 26.0] {
            let found = erfc_inverse(libm::erfc(x)).expect("erfc is within (0, 1]");
            // For small x, erfc is rounded to an ulp of one.
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
