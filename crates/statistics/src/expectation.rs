//! Expectations about quantities, and the verdict on a quantity with a known error.

use std::fmt;

use crate::intervals::Bound;

/// Range in which a quantity is expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    /// Lower and upper end of the range; infinite if there is none.
    pub range: [f64; 2],
    /// True if the ends do not belong to the range.
    pub is_strict: bool,
}

/// Outcome of comparing quantities with what is expected of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Every quantity is as expected.
    Holds,
    /// At least one quantity is not as expected.
    DoesNotHold,
    /// No quantity contradicts the claim, but at least one interval is too wide.
    CannotSay,
}

impl Verdict {
    /// Returns the words that users see.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Holds => "holds",
            Verdict::DoesNotHold => "does not hold",
            Verdict::CannotSay => "cannot say",
        }
    }
}

impl fmt::Display for Expectation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.range;
        match (self.is_strict, low.is_finite(), high.is_finite()) {
            (true, true, false) => write!(formatter, "above {low}"),
            (true, false, true) => write!(formatter, "below {high}"),
            (false, true, false) => write!(formatter, "at least {low}"),
            (false, false, true) => write!(formatter, "at most {high}"),
            (_, _, _) => write!(formatter, "{low} to {high}"),
        }
    }
}

impl Expectation {
    /// Expectation that a quantity is above zero.
    pub const POSITIVE: Expectation = Expectation { range: [0.0, f64::INFINITY], is_strict: true };

    /// Expectation that a quantity lies within a range, including its ends.
    pub fn within(low: f64, high: f64) -> Expectation {
        Expectation { range: [low, high], is_strict: false }
    }

    /// Returns the verdict on a quantity with the estimate `bound`, for a claim with `quantities`
    /// quantities.
    pub fn verdict(self, bound: &Bound, quantities: usize) -> Verdict {
        self.verdict_at_look(bound, quantities, 1)
    }

    /// Returns the verdict on a quantity with the estimate `bound`, for a claim with `quantities`
    /// quantities, at one of `looks` looks (interim tests of a growing study). The error level
    /// holds for all looks together.
    pub fn verdict_at_look(self, bound: &Bound, quantities: usize, looks: usize) -> Verdict {
        let [low, high] = self.closed();
        let [least, most] = bound.one_sided_of(looks);
        let [lower, upper] = bound.simultaneous(quantities * looks);
        if least >= low && most <= high {
            Verdict::Holds
        } else if upper < low || lower > high {
            Verdict::DoesNotHold
        } else {
            Verdict::CannotSay
        }
    }

    /// Returns true if a value is in the expected range.
    pub fn contains(self, value: f64) -> bool {
        let [low, high] = self.closed();
        value >= low && value <= high
    }

    /// Returns the distance of the estimate from the nearest end of the expected range, in standard
    /// errors. The distance is negative outside the range.
    pub fn margin(self, bound: &Bound) -> f64 {
        let [low, high] = self.closed();
        let inside = (bound.value - low).min(high - bound.value);
        // Exact numbers have no standard error.
        inside / bound.error.max(f64::EPSILON)
    }

    /// Returns the smallest and the largest number in the range.
    fn closed(self) -> [f64; 2] {
        let [low, high] = self.range;
        if self.is_strict { [low.next_up(), high.next_down()] } else { [low, high] }
    }
}
