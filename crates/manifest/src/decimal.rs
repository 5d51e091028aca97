//! Numbers as a person would write them.
//!
//! `{ to = 0.06, steps = 6 }` means 0.02 and not 0.019999999999999997. A number that places a row is
//! therefore the nearest decimal of [`DIGITS`] significant digits, whoever computed it: then equal
//! numbers have equal bits, equal keys, and are found by `where load = 0.02`.

/// Significant digits that count. A double has almost sixteen; the last four are left to the
/// rounding of whoever computed it.
pub const DIGITS: usize = 12;

/// Numbers whose relative distance is below this are one number: a step between them is rounding,
/// and a difference quotient over it noise.
pub const RESOLUTION: f64 = 1e-9;

/// The nearest decimal of [`DIGITS`] significant digits. Zero has one sign; what is not finite stays
/// as it is.
pub fn nearest(value: f64) -> f64 {
    let written = format!("{value:.*e}", DIGITS - 1);
    written.parse::<f64>().map_or(value, |value| value + 0.0)
}

/// Whether two numbers are one but for rounding.
pub fn is_same(one: f64, other: f64) -> bool {
    one == other || (one - other).abs() < RESOLUTION * one.abs().max(other.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn computed_numbers_become_those_that_were_meant() {
        for (computed, meant) in
            [(0.06 * (2.0 / 6.0), 0.02), (0.1 + 0.2, 0.3), (1.0 - 0.9, 0.1), (3.0 * 1.1, 3.3)]
        {
            assert_ne!(computed, meant);
            assert_eq!(nearest(computed), meant);
        }
    }

    #[test]
    fn short_decimals_stay_as_they_are_and_rounding_twice_changes_nothing() {
        for value in [6e-5, 1.7, 2015.0, 1e-30, 1e30, 0.123456789012, 5e-324] {
            assert_eq!(nearest(value), value);
        }
        let third = nearest(1.0 / 3.0);
        assert_eq!(third, 0.333333333333);
        assert_eq!(nearest(third), third);
        assert_eq!(nearest(-0.0).to_bits(), 0.0_f64.to_bits());
        assert_eq!(nearest(f64::INFINITY), f64::INFINITY);
        assert!(nearest(f64::NAN).is_nan());
    }

    #[test]
    fn numbers_are_told_apart_from_the_ninth_digit_on() {
        assert!(is_same(0.02, 0.019999999999999997) && is_same(0.0, -0.0));
        assert!(!is_same(0.02, 0.02000001) && !is_same(0.0, 1e-300));
    }
}
