//! Which claims a study has decided, looked at several times as it grows.
//!
//! Whoever looks at a claim again and again, and ends as soon as it is decided, is misled more often than
//! by one look: at 95 % each, ten looks mislead in up to one case of five. So each of so many looks has its
//! share of the 5 % (Bonferroni), and all of them together mislead in no more. Quantities are then as
//! certain as those of a study whose size was given, or more: whoever is told a verdict on the way is told
//! the same in the end by `claims`.

use std::num::NonZeroU32;

use super::evidence::Evidence;
use super::{Claim, ClaimOutcome, OF_A_STUDY, Origin};
use crate::study_evidence;
use asperity_pipeline::adaptive_sampling::{ClaimRule, Decisions, Undecided};
use asperity_pipeline::plan::Plan;
use asperity_pipeline::study::Study;
use asperity_tables::table::{Table, TableError};

/// The claims of the paper and of the field, as the rule of a study that waits for them.
#[derive(Debug, Clone, Copy)]
pub struct PaperClaims;

impl ClaimRule for PaperClaims {
    fn decide(
        &self,
        study: &Study,
        plan: &Plan,
        tables: &[Option<Table>],
        names: &[String],
        looks: NonZeroU32,
    ) -> Result<Decisions, TableError> {
        let evidence = study_evidence::of(study, plan, tables)?;
        Ok(decisions(&evidence, names, looks))
    }
}

/// The names of all claims that surfaces decide.
pub fn names() -> Vec<&'static str> {
    let nothing = Evidence::of(&[]).expect("nothing lacks no column");
    let claims = OF_A_STUDY.iter().flat_map(|claims| claims(&nothing));
    claims.map(|claim| claim.statement.name).collect()
}

/// What is decided of the claims of some names, or of all, at one of so many looks.
fn decisions(evidence: &Evidence, names: &[String], looks: NonZeroU32) -> Decisions {
    let is_meant =
        |claim: &Claim| names.is_empty() || names.iter().any(|name| name == claim.statement.name);
    let nothing = Evidence::of(&[]).expect("nothing lacks no column");
    let mut decisions = Decisions::default();
    for claims in OF_A_STUDY {
        // Some claims take seconds: those of a file are computed where one of them is asked for.
        if !claims(&nothing).iter().any(is_meant) {
            continue;
        }
        for claim in claims(evidence).into_iter().filter(is_meant) {
            add(&mut decisions, claim, looks);
        }
    }
    decisions
}

/// Sorts a claim in by its outcome.
fn add(decisions: &mut Decisions, claim: Claim, looks: NonZeroU32) {
    let (name, expected) = (claim.statement.name, claim.statement.expected);
    debug_assert_ne!(claim.statement.origin, Origin::Misprint);
    match claim.outcome {
        ClaimOutcome::Judged(judgement) if judgement.is_decided(expected, looks) => {
            decisions.decided.push(name);
        }
        ClaimOutcome::Judged(judgement) => decisions
            .undecided
            .push(Undecided { name, surfaces: judgement.decided_with(expected, looks) }),
        ClaimOutcome::NotComputed(needs) => decisions.not_judged.push((name, needs)),
        ClaimOutcome::Noted => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Expectation, Verdict};
    use asperity_pipeline::adaptive_sampling::{least_step, looks};
    use asperity_pipeline::study::{Growth, Until};
    use asperity_statistics::intervals::jackknife;
    use asperity_statistics::random::normal;

    #[test]
    fn claims_that_surfaces_decide_have_names_of_their_own() {
        let mut names = names();
        assert!(names.contains(&"area-above-persson"));
        assert!(!names.contains(&"asymptote-of-alpha"), "a closed form decides it");
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }

    fn growth() -> Growth {
        Growth { at_least: 10, at_most: 80, until: Until::Claims(Vec::new()) }
    }

    /// The share of studies that are told on the way that a mean lies above zero, where it is zero.
    fn misled(looks_shared: usize) -> f64 {
        const STUDIES: u64 = 2000;
        let growth = growth();
        let is_misled = |study: &u64| {
            let all = normal(*study, growth.at_most as usize);
            let sizes = std::iter::successors(Some(growth.at_least), |&n| Some(least_step(n)));
            let mut sizes = sizes.take_while(|&n| n < growth.at_most);
            sizes.any(|n| {
                let values = &all[..n as usize];
                let bound =
                    jackknife(String::new(), &[values.len()], |weights| Some(weights.mean(values)));
                let verdict = Expectation::Positive.verdict_of(&bound.unwrap(), 1, looks_shared);
                verdict == Verdict::Holds
            })
        };
        (0..STUDIES).filter(is_misled).count() as f64 / STUDIES as f64
    }

    #[test]
    fn all_looks_together_mislead_no_more_than_one_does() {
        let looks = looks(&growth()).get() as usize;
        assert_eq!(looks, 5);
        // 2000 studies tell a share of 5 % to half a point.
        let (shared, single) = (misled(looks), misled(1));
        assert!(shared < 0.06, "{shared}");
        assert!(single > 0.1, "{single}");
    }
}
