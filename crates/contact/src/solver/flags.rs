//! What is known of a node besides numbers: two bits, or three where the material may yield, in a
//! number that can spare them.
//!
//! Between passes, each node carries one number from iteration to iteration: its last move if it is
//! free. It only steers the search, so that its lowest bits are as good as any to tell whether it is.
//! A map of its own would be read and written in every pass.

use pulp::Simd;

use super::lanes::{Choice, Lanes};

/// Takes part in the iteration: its pressure may change in the way in which its gap asks for.
pub const FREE: u32 = 1;
/// Has pressure.
pub const PRESSED: u32 = 2;
/// Has the pressure under which the material yields, and is pressed too. Without a hardness, no
/// node is, and the bit belongs to the number.
pub const SATURATED: u32 = 4;

const MARKS: u32 = FREE | PRESSED;
const ALL_MARKS: u32 = MARKS | SATURATED;

#[inline(always)]
pub fn mark<S: Simd, const R: usize>(
    carry: Lanes<S, R>,
    free: Choice<S, R>,
    pressed: Choice<S, R>,
) -> Lanes<S, R> {
    carry.with(MARKS, [(FREE, free), (PRESSED, pressed)])
}

/// The same where the material yields.
#[inline(always)]
pub fn mark_yielding<S: Simd, const R: usize>(
    carry: Lanes<S, R>,
    free: Choice<S, R>,
    pressed: Choice<S, R>,
    saturated: Choice<S, R>,
) -> Lanes<S, R> {
    let marks = [(FREE, free), (PRESSED, pressed), (SATURATED, saturated)];
    carry.with(ALL_MARKS, marks)
}

#[inline(always)]
pub fn has(carry: f32, mark: u32) -> bool {
    carry.to_bits() & mark != 0
}

/// The number with the marks of such a pressure; whether it is free stays as it was.
#[inline(always)]
pub fn marked_by_pressure(carry: f32, pressure: f64, hardness: f64) -> f32 {
    let pressed = PRESSED * u32::from(pressure > 0.0);
    let saturated = SATURATED * u32::from(pressure >= hardness);
    f32::from_bits((carry.to_bits() & !(PRESSED | SATURATED)) | pressed | saturated)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marked(carry: f32, free: bool, pressed: bool) -> f32 {
        let marks = (FREE * u32::from(free)) | (PRESSED * u32::from(pressed));
        f32::from_bits((carry.to_bits() & !MARKS) | marks)
    }

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

    #[test]
    fn marks_of_a_pressure_leave_whether_the_node_is_free() {
        for free in [false, true] {
            for (pressure, pressed, saturated) in
                [(0.0, false, false), (0.3, true, false), (0.5, true, true)]
            {
                let bearer = marked_by_pressure(marked(-2.5, free, true), pressure, 0.5);
                let found = [FREE, PRESSED, SATURATED].map(|mark| has(bearer, mark));
                assert_eq!(found, [free, pressed, saturated]);
                assert!((bearer + 2.5).abs() <= 1e-6 * 2.5);
            }
        }
    }
}
