//! What Yastrebov, Anciaux & Molinari (2015) say, put to the tables of a study.
//!
//! A claim is a set of quantities and what they must be for it to hold: positive, or within a range.
//! Every quantity has an interval, from resampling whole surfaces, wide enough that all intervals of
//! a claim cover together; the same realizations are drawn for every spectrum, so that differences
//! between spectra are paired. A claim **holds** if every interval agrees with it, **does not hold**
//! if one contradicts it, and otherwise nothing is said.

use std::fmt;

pub mod closed_forms;
pub mod evidence;
mod fits;
mod full_contact;
pub mod intervals;
mod light;
mod mesh;
mod quantities;
mod setting;

pub use evidence::Evidence;
pub use setting::{LeftOut, Setting};

use intervals::Bound;

/// One claim, and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    /// Its name, the same in every study.
    pub name: &'static str,
    /// What the paper says.
    pub says: &'static str,
    /// What it was put to: `counted area`, `area corrected by 2017`, `closed form` …
    pub data: String,
    /// What was found, or which stage would tell.
    pub outcome: Outcome,
}

/// What became of a claim.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// Its quantities are known.
    Judged(Judgement),
    /// They are not: what would have to be there.
    NotComputed(String),
}

/// A verdict, and the quantity that decides it.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// Whether the claim holds.
    pub verdict: Verdict,
    /// What all quantities must be.
    pub expected: Expectation,
    /// The quantity that speaks most against the claim, or least for it.
    pub deciding: Bound,
    /// How many quantities there are.
    pub quantities: usize,
    /// How many of them contradict the claim.
    pub contradicting: usize,
    /// How many say neither.
    pub undecided: usize,
}

/// Whether a claim holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Every interval agrees with it.
    Holds,
    /// Some interval contradicts it.
    DoesNotHold,
    /// Some interval is too wide to tell, and none contradicts it.
    CannotSay,
}

/// What the quantities of a claim must be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Expectation {
    /// Above zero.
    Positive,
    /// From one number to another: a printed number, as widely as its words allow.
    Within(f64, f64),
}

impl Verdict {
    /// The words that a reader sees.
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
        match self {
            Expectation::Positive => write!(formatter, "above 0"),
            Expectation::Within(low, f64::INFINITY) => write!(formatter, "at least {low}"),
            Expectation::Within(f64::NEG_INFINITY, high) => write!(formatter, "at most {high}"),
            Expectation::Within(low, high) => write!(formatter, "{low} to {high}"),
        }
    }
}

impl Expectation {
    fn verdict(self, bound: &Bound) -> Verdict {
        let (low, high) = self.range();
        if bound.lower >= low && bound.upper <= high {
            Verdict::Holds
        } else if bound.upper < low || bound.lower > high {
            Verdict::DoesNotHold
        } else {
            Verdict::CannotSay
        }
    }

    /// How far inside the expected range a quantity lies, in half widths of its interval.
    fn margin(self, bound: &Bound) -> f64 {
        let (low, high) = self.range();
        let inside = (bound.value - low).min(high - bound.value);
        let half_width = 0.5 * (bound.upper - bound.lower);
        if half_width > 0.0 {
            inside / half_width
        } else {
            // Exact: any interval would have been wider.
            inside / f64::EPSILON
        }
    }

    fn range(self) -> (f64, f64) {
        match self {
            Expectation::Positive => (f64::MIN_POSITIVE, f64::INFINITY),
            Expectation::Within(low, high) => (low, high),
        }
    }
}

impl Judgement {
    /// Judges quantities with intervals; none without any quantity.
    pub fn of(expected: Expectation, bounds: &[Bound]) -> Option<Judgement> {
        let verdicts: Vec<Verdict> = bounds.iter().map(|bound| expected.verdict(bound)).collect();
        let count = |verdict| verdicts.iter().filter(|&&found| found == verdict).count();
        let contradicting = count(Verdict::DoesNotHold);
        let undecided = count(Verdict::CannotSay);
        let verdict = match (contradicting, undecided) {
            (0, 0) => Verdict::Holds,
            (0, _) => Verdict::CannotSay,
            _ => Verdict::DoesNotHold,
        };
        let deciding = bounds
            .iter()
            .min_by(|one, other| expected.margin(one).total_cmp(&expected.margin(other)))?;
        Some(Judgement {
            verdict,
            expected,
            deciding: deciding.clone(),
            quantities: bounds.len(),
            contradicting,
            undecided,
        })
    }
}

/// Every claim, in the order of the paper.
pub fn all(evidence: &Evidence) -> Vec<Claim> {
    let mut claims = light::claims(evidence);
    claims.extend(fits::claims(evidence));
    claims.extend(full_contact::claims(evidence));
    claims.extend(mesh::claims(evidence));
    claims.extend(closed_forms::claims());
    claims
}

#[cfg(test)]
mod tests;
