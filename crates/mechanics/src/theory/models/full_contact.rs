//! Model of the non-contact area near full contact: isolated penny-shaped cracks.
//!
//! The pressure of full contact is Gaussian with mean y and variance 1/4. Where it is negative, the
//! tension around its maximum is T − Cr², with the distance r. A crack opens there up to the radius
//! b at which the stress intensity vanishes: b² = 3T/(2C). The crack covers 3/2 of the area that
//! would be under tension.

use crate::theory::persson;

/// Ratio of the area of an isolated crack to the area that would be under tension in full contact.
pub const CRACK_OVER_TENSION: f64 = 1.5;

/// Returns the non-contact fraction (3/4) erfc(√2 y) under a load near full contact.
///
/// Persson's theory corresponds to [`CRACK_OVER_TENSION`] = 2 and gives erfc(√2 y).
pub fn noncontact(load: f64) -> f64 {
    CRACK_OVER_TENSION * tension(load)
}

/// Returns the area fraction erfc(√2 y)/2 that would be under tension in full contact.
pub fn tension(load: f64) -> f64 {
    0.5 * persson::noncontact(load)
}

/// Returns F(y) = −ln[(1 − a) y √(2π)] with 1 − a of [`noncontact`]. It exceeds F of Persson's
/// theory by ln(4/3).
pub fn approach(load: f64) -> f64 {
    persson::approach(load) - libm::log(0.5 * CRACK_OVER_TENSION)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noncontact_fraction_is_three_quarters_of_perssons() {
        for load in [0.5, 1.0, 3.0] {
            assert_eq!(noncontact(load), 0.75 * persson::noncontact(load));
            let found = persson::approach_to_full_contact(load, noncontact(load));
            let found = found.expect("not full contact");
            assert!((found - approach(load)).abs() < 1e-13 * found);
            assert!((found - persson::approach(load) - (4.0_f64 / 3.0).ln()).abs() < 1e-13 * found);
        }
    }

    #[test]
    fn a_crack_of_the_stated_size_has_no_stress_intensity() {
        // K_I ∝ ∫₀ᵇ (T − Cr²) r/√(b² − r²) dr, r = b sin θ (Sneddon 1946); C = 1, T = 2b²/3.
        let steps = 1000;
        let sum: f64 = (0..steps)
            .map(|step| {
                let angle = (f64::from(step) + 0.5) / f64::from(steps) * 0.5 * std::f64::consts::PI;
                let square = CRACK_OVER_TENSION * angle.sin().powi(2);
                (1.0 - square) * angle.sin()
            })
            .sum();
        // The midpoint rule is of second order.
        assert!((sum / f64::from(steps)).abs() < 1e-6);
    }
}
