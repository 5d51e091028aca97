//! Claims that studies declare, tested with the tables of a study.
//!
//! A claim is a set of quantities and an expectation: each quantity must be within a range. It
//! **holds** if every quantity is as expected at one-sided 95 % confidence. This is an
//! intersection–union test, so the level also applies to the claim as a whole. It **does not hold**
//! if the joint 95 % confidence interval of one quantity lies outside the expected range. Otherwise
//! the study cannot say, and the number of further surfaces that would decide the claim is
//! estimated.
//!
//! | module | content |
//! |---|---|
//! | `evidence`, `setting` | groups of rows with one value per surface and load; choice of rows |
//! | `evaluate` | the quantities of a claim from its groups |
//! | `scope` | values of the names in expressions |
//! | `regression`, `statistics` | numbers that no expression gives |
//! | `limits` | the secant in the limits of large cells, wide spectra and fine meshes |
//! | `closed_forms` | quantities that need no study |
//! | `quantities` | intervals and judgements |
//! | `decisions` | claims that a growing study has decided; surfaces that would decide the others |

// Tests compare with tolerances.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod closed_forms;
mod decisions;
mod evaluate;
mod evidence;
mod limits;
mod quantities;
mod regression;
mod scope;
mod setting;
mod statistics;

pub use asperity_pipeline::study::claims::{ClaimSpec, Origin};
pub use asperity_statistics::expectation::{Expectation, Verdict};
pub use decisions::DeclaredClaims;
pub use evidence::{Evidence, Group, StageTable};
pub use setting::{NOT_COMPARED, Setting};

use asperity_statistics::intervals::Bound;
use asperity_tables::table::TableError;

/// A claim with the outcome of its test.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    pub statement: ClaimSpec,
    /// Data that test the claim, such as `counted area`.
    pub data: String,
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

impl Judgement {
    /// Judges a claim from its quantities, or returns `None` if there are none.
    pub fn new(expected: Expectation, bounds: Vec<Bound>) -> Option<Judgement> {
        let margin = |index: &usize| expected.margin(&bounds[*index]);
        let deciding = (0..bounds.len()).min_by(|a, b| margin(a).total_cmp(&margin(b)))?;
        let [contradicting, undecided] = decisions::counts(&bounds, expected, 1);
        let verdict = match (contradicting, undecided) {
            (0, 0) => Verdict::Holds,
            (0, _) => Verdict::CannotSay,
            _ => Verdict::DoesNotHold,
        };
        let without_value = Vec::new();
        Some(Judgement { verdict, bounds, deciding, contradicting, undecided, without_value })
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

/// Tests claims, in their order.
///
/// # Errors
/// If a table lacks a column that its kind of stage writes.
pub fn all(specs: &[ClaimSpec], evidence: &Evidence) -> Result<Vec<Claim>, TableError> {
    specs.iter().map(|spec| evaluate::claim(spec, evidence)).collect()
}

/// Returns claims without results of a study: closed forms are judged, and all other claims are
/// not computed.
pub fn without_results(specs: &[ClaimSpec]) -> Vec<Claim> {
    let nothing = Evidence::from_tables(Vec::new()).expect("no table, so no column is missing");
    all(specs, &nothing).expect("no table, so no column is missing")
}

#[cfg(test)]
mod tests;
