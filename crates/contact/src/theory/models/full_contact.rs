//! Near full contact what is left open are isolated penny-shaped cracks.
//!
//! The pressure of full contact is Gaussian of mean y and variance 1/4, and where it is most
//! negative it is a paraboloid, T − Cr². A crack there opens up to the radius at which its stress
//! intensity vanishes, b² = 3T/(2C): its area is 3/2 times that under tension.

use crate::theory::persson;

/// Area of an isolated crack over the area under tension of the paraboloid of pressure that opens
/// it.
pub const CRACK_OVER_TENSION: f64 = 1.5;

/// The fraction out of contact under a load near full contact, (3/4) erfc(√2 y).
///
/// Persson's theory takes 2 for the [`CRACK_OVER_TENSION`] and hence erfc(√2 y).
pub fn noncontact(load: f64) -> f64 {
    CRACK_OVER_TENSION * tension(load)
}

/// The fraction under tension if the surfaces were bonded into full contact, erfc(√2 y)/2.
pub fn tension(load: f64) -> f64 {
    0.5 * persson::noncontact(load)
}

/// F(y) = −ln[(1 − a) y √(2π)]: that of Persson's theory and ln(4/3) more.
pub fn approach(load: f64) -> f64 {
    persson::approach(load) - (0.5 * CRACK_OVER_TENSION).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cracks_leave_three_quarters_of_what_persson_leaves() {
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
