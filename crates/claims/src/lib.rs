//! Claims of Yastrebov, Anciaux & Molinari (2015), and claims on their open questions, tested with
//! the tables of a study.
//!
//! A claim is a set of quantities and an expectation: each quantity must be positive or within a
//! range. It **holds** if every quantity is as expected at one-sided 95 % confidence. This is an
//! intersection–union test, so the level also applies to the claim as a whole. It **does not hold**
//! if the joint 95 % confidence interval of one quantity lies outside the expected range. Otherwise
//! the study cannot say, and the number of further surfaces that would decide the claim is
//! estimated.
//!
//! [`Origin`] separates claims of the paper, its misprints, and claims of asperity.
//!
//! | module | content |
//! |---|---|
//! | `evidence`, `setting` | the tables of a study as curves by spectrum; choice of their rows |
//! | `quantities` | the quantities of a claim, pairs of cutoffs, unmet requirements |
//! | `decisions` | claims that a growing study has decided; surfaces that would decide the others |
//! | `surfaces` | heights, Nayak's parameter and summits (section 3, appendices A and B) |
//! | `light`, `groups` | area under light loads, effect of cutoffs (5.2, 8, 9.2), collapse on ζ |
//! | `slope` | slope of the area, the contact evolution law (5.2, 6, 9.5, appendix C) |
//! | `full_contact` | the approach to full contact (section 7) |
//! | `mesh` | the error of the mesh (section 8); limits of large cells and fine meshes |
//! | `asperities`, `distributions`, `gap` | asperity models, pressures, stiffness, sealing |
//! | `flow` | dependence of the flow through the gap on the contact area |
//! | `closed_forms` | claims on closed forms, and misprints |

// Tests compare with tolerances.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

use std::fmt;

mod asperities;
mod closed_forms;
mod decisions;
mod distributions;
mod evidence;
mod flow;
mod full_contact;
mod gap;
mod groups;
mod light;
mod mesh;
mod quantities;
mod setting;
mod slope;
mod surfaces;

pub use decisions::{PaperClaims, names};
pub use evidence::{Evidence, KindTable};
pub use setting::Setting;

use asperity_statistics::intervals::Bound;

/// Text of a claim, its source, and its test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statement {
    /// Name of the claim, the same in every study.
    pub name: &'static str,
    pub origin: Origin,
    /// Text of the claim, quoted if it is the paper's.
    pub text: &'static str,
    /// Section and equation or figure of the paper, or the source of a claim of asperity.
    pub source: &'static str,
    /// Quantity that is computed, with unit and loads.
    pub quantity: &'static str,
    /// Condition that all quantities must meet.
    pub expected: Expectation,
    /// Reason for the expected range, and remarks.
    pub reason: &'static str,
    /// Name of the report's figure that shows the quantity.
    pub figure: Option<&'static str>,
}

/// Origin of a claim: the paper or another source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// A sentence of the paper.
    Paper,
    /// A misprint of the paper: a note without a verdict.
    Misprint,
    /// A claim of asperity or of other authors.
    Ours,
}

/// A claim with the outcome of its test.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    pub statement: Statement,
    /// Data that test the claim: `counted area`, `area corrected as in 2017`, `closed form` …
    pub data: &'static str,
    pub outcome: ClaimOutcome,
}

#[derive(Debug, Clone, PartialEq)]
pub enum ClaimOutcome {
    /// The quantities are known and have a verdict.
    Judged(Judgement),
    /// The study lacks data, which the text names.
    NotComputed(String),
    /// A misprint, for which nothing is computed.
    Noted,
}

/// A verdict with the quantities on which it is based.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    pub verdict: Verdict,
    pub bounds: Vec<Bound>,
    /// Index in `bounds` of the quantity with the smallest margin. The margin is the distance from
    /// the nearest end of the expected range in standard errors, negative outside the range.
    pub deciding: usize,
    /// Number of quantities that contradict the claim.
    pub contradicting: usize,
    /// Number of quantities that neither support nor contradict the claim.
    pub undecided: usize,
    /// Labels of quantities that cannot be computed. If there are any, the claim cannot hold.
    pub without_value: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Every quantity is as expected.
    Holds,
    /// At least one quantity is not as expected.
    DoesNotHold,
    /// No quantity contradicts the claim, but at least one interval is too wide.
    CannotSay,
}

/// Condition for the quantities of a claim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Expectation {
    /// Each quantity is above zero.
    Positive,
    /// Each quantity lies within this range, which is our reading of the claim's words.
    Within(f64, f64),
}

impl Origin {
    /// Returns the name of the origin in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Origin::Paper => "paper",
            Origin::Misprint => "misprint",
            Origin::Ours => "ours",
        }
    }
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
        match self {
            Expectation::Positive => write!(formatter, "above 0"),
            Expectation::Within(low, f64::INFINITY) => write!(formatter, "at least {low}"),
            Expectation::Within(f64::NEG_INFINITY, high) => write!(formatter, "at most {high}"),
            Expectation::Within(low, high) => write!(formatter, "{low} to {high}"),
        }
    }
}

impl Expectation {
    /// Returns the verdict on a quantity with the estimate `bound`, for a claim with `quantities`
    /// quantities.
    pub fn verdict(self, bound: &Bound, quantities: usize) -> Verdict {
        self.verdict_at_look(bound, quantities, 1)
    }

    /// Returns the verdict on a quantity with the estimate `bound`, for a claim with `quantities`
    /// quantities, at one of `looks` looks (interim tests of a growing study). The error level
    /// holds for all looks together.
    pub fn verdict_at_look(self, bound: &Bound, quantities: usize, looks: usize) -> Verdict {
        let (low, high) = self.range();
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
        let (low, high) = self.range();
        value >= low && value <= high
    }

    /// Returns the distance of the estimate from the nearest end of the expected range, in standard
    /// errors. The distance is negative outside the range.
    fn margin(self, bound: &Bound) -> f64 {
        let (low, high) = self.range();
        let inside = (bound.value - low).min(high - bound.value);
        // Exact numbers have no standard error.
        inside / bound.error.max(f64::EPSILON)
    }

    fn range(self) -> (f64, f64) {
        match self {
            Expectation::Positive => (f64::MIN_POSITIVE, f64::INFINITY),
            Expectation::Within(low, high) => (low, high),
        }
    }
}

impl Judgement {
    /// Judges a claim from its quantities, or returns `None` if there are none.
    pub fn new(expected: Expectation, bounds: Vec<Bound>) -> Option<Judgement> {
        let verdict = |bound: &Bound| expected.verdict(bound, bounds.len());
        let verdicts: Vec<Verdict> = bounds.iter().map(verdict).collect();
        let count = |verdict| verdicts.iter().filter(|&&found| found == verdict).count();
        let contradicting = count(Verdict::DoesNotHold);
        let undecided = count(Verdict::CannotSay);
        let margin = |index: &usize| expected.margin(&bounds[*index]);
        let deciding = (0..bounds.len()).min_by(|a, b| margin(a).total_cmp(&margin(b)))?;
        Some(Judgement {
            verdict: match (contradicting, undecided) {
                (0, 0) => Verdict::Holds,
                (0, _) => Verdict::CannotSay,
                _ => Verdict::DoesNotHold,
            },
            deciding,
            contradicting,
            undecided,
            bounds,
            without_value: Vec::new(),
        })
    }

    /// Adds the labels of quantities without a value. If there are any, the verdict `Holds` becomes
    /// `CannotSay`.
    pub fn with_missing(self, without_value: &[String]) -> Judgement {
        let verdict = match self.verdict {
            Verdict::Holds if !without_value.is_empty() => Verdict::CannotSay,
            verdict => verdict,
        };
        Judgement { verdict, without_value: without_value.to_vec(), ..self }
    }
}

/// Tests all claims of the paper and of asperity, by subject in the order of the paper. Claims on
/// closed forms and misprints are at the end.
pub fn all(evidence: &Evidence) -> Vec<Claim> {
    let of_the_study = OF_A_STUDY.iter().flat_map(|claims| claims(evidence));
    let mut claims: Vec<Claim> = of_the_study.collect();
    claims.extend(closed_forms::of_closed_forms());
    claims.extend(closed_forms::misprints());
    claims
}

/// Returns all claims without results of a study: claims on closed forms are judged, and all other
/// claims are not computed.
pub fn without_results() -> Vec<Claim> {
    all(&Evidence::from_tables(&[]).expect("no table, so no column is missing"))
}

/// Functions that test the claims on a subject with the results of a study.
const OF_A_STUDY: [fn(&Evidence) -> Vec<Claim>; 15] = [
    surfaces::claims,
    light::of_light_loads,
    groups::of_groups,
    light::of_alpha,
    slope::of_the_slope,
    slope::of_kappa,
    full_contact::claims,
    mesh::of_the_mesh,
    groups::of_the_collapse,
    mesh::of_limits,
    gap::of_stiffness,
    asperities::claims,
    distributions::claims,
    gap::of_sealing,
    flow::claims,
];

#[cfg(test)]
mod tests;
