//! What Yastrebov, Anciaux & Molinari (2015) say, and what they left open, put to the tables of a study.
//!
//! A claim is a set of quantities and what they must be for it to hold: positive, or within a range.
//! It **holds** if every quantity, at one-sided 95 % each, is as expected: that all of them are is
//! then as sure as that (an intersection–union test). It **does not hold** if one of them is not, in
//! intervals that cover all quantities together at 95 %. Otherwise nothing is said but how many more
//! surfaces would tell.
//!
//! What the paper claims, what it misprints, and what is ours are kept apart.
//!
//! | module | what it holds |
//! |---|---|
//! | `evidence`, `setting` | the tables of a study, sorted: curves by spectrum, in one setting |
//! | `quantities` | the quantities of a claim, how cutoffs are compared, what a study lacks |
//! | `decisions` | whether a growing study has decided a claim, and how many surfaces would |
//! | `surfaces` | heights, Nayak's parameter and summits (section 3, appendices A and B) |
//! | `light`, `groups` | area under light loads, which cutoff decides (5.2, 8, 9.2); the collapse |
//! | `slope` | slope of the area and the contact evolution law (5.2, 6, 9.5, appendix C) |
//! | `full_contact` | the approach to full contact (section 7) |
//! | `mesh` | the error of the mesh (section 8); limits of cell, bandwidth and mesh |
//! | `asperities`, `distributions`, `gap` | beyond the paper: models, pressures, stiffness, sealing |
//! | `closed_forms` | what no study decides: closed forms, and slips in print |

use std::fmt;

mod asperities;
mod closed_forms;
mod decisions;
mod distributions;
mod evidence;
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

/// What is claimed, where, and what would bear it out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statement {
    /// Its name, the same in every study.
    pub name: &'static str,
    /// Whose it is.
    pub origin: Origin,
    /// What is said; of the paper, in its own words.
    pub says: &'static str,
    /// Section and equation or figure of the paper; of ours, what it rests on.
    pub place: &'static str,
    /// What is computed of it, with units and range of loads.
    pub quantity: &'static str,
    /// What all quantities must be.
    pub expected: Expectation,
    /// Why that range, and what else a reader must know.
    pub because: &'static str,
    /// The figure of the report that shows it.
    pub figure: Option<&'static str>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// The paper's.
    Paper,
    /// A slip in its print: a note without a verdict.
    Misprint,
    /// Ours: what later work, or this program, adds.
    Ours,
}

/// One claim, and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    pub statement: Statement,
    /// What it was put to: `counted area`, `area corrected by 2017`, `closed form` …
    pub data: &'static str,
    /// What was found, or what would tell.
    pub outcome: ClaimOutcome,
}

#[derive(Debug, Clone, PartialEq)]
pub enum ClaimOutcome {
    /// Its quantities are known.
    Judged(Judgement),
    /// They are not: what the study lacks.
    NotComputed(String),
    /// There is nothing to compute.
    Noted,
}

/// A verdict, and the quantities that it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    pub verdict: Verdict,
    pub bounds: Vec<Bound>,
    /// The place of the one that speaks most against the claim, or least for it.
    pub deciding: usize,
    /// How many of them contradict the claim.
    pub contradicting: usize,
    /// How many say neither.
    pub undecided: usize,
    /// Those that have no value, so that nothing can hold of all.
    pub without_value: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Every quantity is as expected.
    Holds,
    /// Some quantity is not.
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

impl Origin {
    /// The word for programs.
    pub fn name(self) -> &'static str {
        match self {
            Origin::Paper => "paper",
            Origin::Misprint => "misprint",
            Origin::Ours => "ours",
        }
    }
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
    /// What one of so many quantities says.
    pub fn verdict(self, bound: &Bound, quantities: usize) -> Verdict {
        self.verdict_of(bound, quantities, 1)
    }

    /// The same at one of so many looks, all of which together are as sure.
    pub fn verdict_of(self, bound: &Bound, quantities: usize, looks: usize) -> Verdict {
        let (low, high) = self.range();
        let [least, most] = bound.single_of(looks);
        let [lower, upper] = bound.together(quantities * looks);
        if least >= low && most <= high {
            Verdict::Holds
        } else if upper < low || lower > high {
            Verdict::DoesNotHold
        } else {
            Verdict::CannotSay
        }
    }

    /// Whether a quantity, as it was found, is as expected.
    pub fn contains(self, value: f64) -> bool {
        let (low, high) = self.range();
        value >= low && value <= high
    }

    /// How far inside the expected range a quantity lies, in standard errors.
    fn margin(self, bound: &Bound) -> f64 {
        let (low, high) = self.range();
        let inside = (bound.value - low).min(high - bound.value);
        // Of a number known to rounding, any interval would have been wider.
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
    /// Judges quantities; none without any.
    pub fn of(expected: Expectation, bounds: Vec<Bound>) -> Option<Judgement> {
        let verdict = |bound: &Bound| expected.verdict(bound, bounds.len());
        let verdicts: Vec<Verdict> = bounds.iter().map(verdict).collect();
        let count = |verdict| verdicts.iter().filter(|&&found| found == verdict).count();
        let contradicting = count(Verdict::DoesNotHold);
        let undecided = count(Verdict::CannotSay);
        let margin = |place: &usize| expected.margin(&bounds[*place]);
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

    /// The same beside quantities that have no value: what is said of all cannot hold then.
    pub fn beside(self, without_value: &[String]) -> Judgement {
        let verdict = match self.verdict {
            Verdict::Holds if !without_value.is_empty() => Verdict::CannotSay,
            verdict => verdict,
        };
        Judgement { verdict, without_value: without_value.to_vec(), ..self }
    }
}

/// Every claim: those of the paper in its order, ours beside them, and its misprints at the end.
pub fn all(evidence: &Evidence) -> Vec<Claim> {
    let of_the_study = OF_A_STUDY.iter().flat_map(|claims| claims(evidence));
    let mut claims: Vec<Claim> = of_the_study.collect();
    claims.extend(closed_forms::of_closed_forms());
    claims.extend(closed_forms::misprints());
    claims
}

/// The claims that a study decides, subject by subject.
const OF_A_STUDY: [fn(&Evidence) -> Vec<Claim>; 14] = [
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
];

#[cfg(test)]
mod tests;
