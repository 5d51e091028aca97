//! Exponential function that the compiler vectorises.

use std::f64::consts::LOG2_E;

/// Arguments below this are replaced by it. The exponential is then 3e-308, the smallest normal
/// number.
const LOWEST: f64 = -708.0;

/// Arguments above this are replaced by it.
const HIGHEST: f64 = 709.0;

/// 1.5 × 2⁵². A number of moderate size that is added to it is rounded to an integer, which
/// the lowest bits of the sum contain.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// ln 2 in two parts. The product of the first part and an integer below 2¹¹ is exact.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];

/// Reciprocals of 13!, 12!, …, 2!.
const COEFFICIENTS: [f64; 12] = [
    1.0 / 6_227_020_800.0,
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    1.0 / 2.0,
];

/// Returns eˣ with a relative error of at most 3e-16 for −708 ≤ x ≤ 709.
///
/// With x = k ln 2 + r, the result is 2ᵏ eʳ, and eʳ is a sum of fourteen terms of its series. Only
/// sums and products are used, none of them fused, so that all processors return the same bytes.
#[inline(always)]
pub fn exponential(x: f64) -> f64 {
    let x = if x < LOWEST { LOWEST } else { x };
    let x = if x > HIGHEST { HIGHEST } else { x };
    let shifted = x * LOG2_E + ROUNDING;
    let k = shifted - ROUNDING;
    let r = (x - k * LN_2[0]) - k * LN_2[1];
    let mut series = COEFFICIENTS[0];
    for coefficient in &COEFFICIENTS[1..] {
        series = series * r + coefficient;
    }
    let fraction = 1.0 + (r + r * r * series);
    // Adds k to the exponent of one.
    let power = (shifted.to_bits() << 52).wrapping_add(1_f64.to_bits());
    fraction * f64::from_bits(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_that_of_the_mathematical_library() {
        for step in 0..200_000 {
            let x = -708.0 + 1417.0 * f64::from(step) / 200_000.0;
            let expected = libm::exp(x);
            assert!((exponential(x) / expected - 1.0).abs() < 3e-16, "{x}");
        }
        assert_eq!(exponential(0.0), 1.0);
    }

    #[test]
    fn arguments_far_out_give_the_smallest_and_largest_numbers() {
        assert!(exponential(-1e300) < 1e-300);
        assert!(exponential(1e300).is_finite());
    }
}
