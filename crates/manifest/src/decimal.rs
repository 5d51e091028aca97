//! Rounds computed numbers to twelve significant digits.
//!
//! In floating-point numbers, `{ to = 0.06, steps = 6 }` gives the load 0.019999999999999997
//! instead of 0.02. Coordinates of rows are therefore rounded to [`DIGITS`] digits. Equal numbers
//! then have equal bits and equal keys, and `where load = 0.02` finds them.

/// Number of significant digits of rounded numbers. A double has almost sixteen digits, of which
/// the last four may be rounding errors.
pub const DIGITS: usize = 12;

/// Relative difference below which two numbers are considered equal. A difference quotient over a
/// smaller step would be noise.
pub const RESOLUTION: f64 = 1e-9;

/// Rounds a number to [`DIGITS`] significant digits. Negative zero becomes zero; infinities and NaN
/// do not change.
pub fn nearest(value: f64) -> f64 {
    let written = format!("{value:.*e}", DIGITS - 1);
    written.parse::<f64>().map_or(value, |value| value + 0.0)
}

/// Returns the decimal number `text` × 10^`power`, for example `("0.1", 3)` → 100.
///
/// The decimal point is moved before the text is converted to binary, so that the result is exact
/// wherever the decimal result is. Returns infinity if the text is not a number.
pub fn shifted(text: &str, power: i32) -> f64 {
    let (digits, own_power) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let exponent = own_power.parse::<i32>().map_or(i32::MAX, |own| own.saturating_add(power));
    format!("{digits}e{exponent}").parse().unwrap_or(f64::INFINITY)
}

/// Formats a number as users write it: `0.1`, `2e9`.
pub fn written(value: f64) -> String {
    if (1e-4..1e6).contains(&value.abs()) || value == 0.0 {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// Returns whether two numbers differ by less than [`RESOLUTION`].
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
    fn moving_the_decimal_point_is_exact() {
        for (text, power, exact) in [
            ("0.1", 3, 100.0),
            ("210", 3, 210_000.0),
            ("1.1e2", -6, 0.00011),
            ("-5.5E-3", 9, -5.5e6),
            ("+7", 0, 7.0),
        ] {
            assert_eq!(shifted(text, power), exact, "{text}");
        }
        assert_ne!(1.1e2 * 1e-6, 0.00011, "a product is not exact");
        assert_eq!(shifted("1e99999999999", 0), f64::INFINITY);
        assert_eq!(shifted("one", 0), f64::INFINITY);
    }

    #[test]
    fn large_and_small_numbers_are_written_with_exponents() {
        let texts = [0.0, 0.5, 2e9, 1e-5, 123456.0].map(written);
        assert_eq!(texts, ["0", "0.5", "2e9", "1e-5", "123456"]);
    }

    #[test]
    fn numbers_are_told_apart_from_the_ninth_digit_on() {
        assert!(is_same(0.02, 0.019999999999999997) && is_same(0.0, -0.0));
        assert!(!is_same(0.02, 0.02000001) && !is_same(0.0, 1e-300));
    }
}
