//! What is known of a node besides numbers: two bits, in a number that can spare them.
//!
//! Between passes, each node carries one number from iteration to iteration: its last move if it is
//! free, else the extension of the gap. Both only steer the search, so that their lowest bits are
//! as good as any to tell which it is. A map of its own would be read and written in every pass.

use pulp::Simd;

use super::lanes::{Choice, Lanes};

/// Takes part in the iteration: has pressure or penetrates.
pub const FREE: u32 = 1;
/// Has pressure.
pub const PRESSED: u32 = 2;

const MARKS: u32 = FREE | PRESSED;

#[inline(always)]
pub fn mark<S: Simd, const R: usize>(
    carry: Lanes<S, R>,
    free: Choice<S, R>,
    pressed: Choice<S, R>,
) -> Lanes<S, R> {
    carry.with(MARKS, [(FREE, free), (PRESSED, pressed)])
}

#[inline(always)]
pub fn has(carry: f32, mark: u32) -> bool {
    carry.to_bits() & mark != 0
}

/// The number with these marks and no others.
#[inline(always)]
pub fn marked(carry: f32, free: bool, pressed: bool) -> f32 {
    let marks = (FREE * u32::from(free)) | (PRESSED * u32::from(pressed));
    f32::from_bits((carry.to_bits() & !MARKS) | marks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_hardly_change_the_number_that_bears_them() {
        for number in [0.0_f32, 1.0, -3.7e-5, 2.5e20] {
            for (free, pressed) in [(false, false), (false, true), (true, false), (true, true)] {
                let bearer = marked(number, free, pressed);
                assert_eq!((has(bearer, FREE), has(bearer, PRESSED)), (free, pressed));
                assert!((bearer - number).abs() <= 4e-7 * number.abs() + f32::MIN_POSITIVE);
            }
        }
    }
}
