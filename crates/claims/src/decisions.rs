//! Which claims a study has decided, looked at several times as it grows, and how many more surfaces would
//! decide one.
//!
//! Whoever looks at a claim again and again, and ends as soon as it is decided, is misled more often than
//! by one look: at 95 % each, ten looks mislead in up to one case of five. So each of so many looks has its
//! share of the 5 % (Bonferroni), and all of them together mislead in no more. Quantities are then as
//! certain as those of a study whose size was given, or more: whoever is told a verdict on the way is told
//! the same in the end by `claims`.

use std::num::NonZeroU32;

use crate::evidence::Evidence;
use crate::{Claim, ClaimOutcome, Expectation, Judgement, OF_A_STUDY, Origin, Verdict};
use asperity_pipeline::adaptive_sampling::{ClaimRule, Decisions, Undecided};
use asperity_pipeline::plan::Plan;
use asperity_pipeline::study::Study;
use asperity_statistics::intervals::Bound;
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
        let evidence = Evidence::of_study(study, plan, tables)?;
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

/// Surfaces of each spectrum beyond which nobody goes.
const MOST: usize = 1_000_000;

impl Judgement {
    /// How many more surfaces of each spectrum would decide an undecided claim at the present spread,
    /// if every quantity is as it was found; `None` for a claim that is decided, or that a million
    /// would not decide.
    ///
    /// A quantity on the wrong side decides the claim once its interval, beside those of all others,
    /// excludes what is expected; else the claim holds once each quantity does by itself.
    pub fn more_surfaces(&self, expected: Expectation) -> Option<usize> {
        let now = self.surfaces()?;
        Some(self.surfaces_to_decide(expected, 1)? - now)
    }

    /// Whether the claim is decided at one of so many looks, of which each is so much surer than a single
    /// one that all of them together are as sure.
    pub fn is_decided(&self, expected: Expectation, looks: NonZeroU32) -> bool {
        let [contradicting, undecided] = self.counts(expected, looks.get() as usize);
        contradicting > 0 || (undecided == 0 && self.without_value.is_empty())
    }

    /// How many surfaces of each spectrum there are, and how many would decide the claim at one of so many
    /// looks, as [`Judgement::more_surfaces`] has it; `None` if no number would.
    pub fn decided_with(&self, expected: Expectation, looks: NonZeroU32) -> Option<[usize; 2]> {
        let needed = self.surfaces_to_decide(expected, looks.get() as usize)?;
        let could_hold = self.bounds.iter().all(|bound| expected.contains(bound.value));
        // Beside a quantity without a value nothing holds of all.
        let is_hopeless = could_hold && !self.without_value.is_empty();
        Some([self.surfaces()?, needed]).filter(|_| !is_hopeless)
    }

    /// The fewest surfaces behind a quantity.
    fn surfaces(&self) -> Option<usize> {
        let counts = self.bounds.iter().filter_map(|bound| bound.surfaces);
        counts.min()
    }

    /// How many quantities contradict the claim, and how many say neither.
    fn counts(&self, expected: Expectation, looks: usize) -> [usize; 2] {
        let all = self.bounds.len();
        let verdict = |bound: &Bound| expected.verdict_of(bound, all, looks);
        [Verdict::DoesNotHold, Verdict::CannotSay].map(|meant| {
            let bounds = self.bounds.iter();
            bounds.filter(|bound| verdict(bound) == meant).count()
        })
    }

    /// The surfaces of each spectrum with which an undecided claim would be decided.
    fn surfaces_to_decide(&self, expected: Expectation, looks: usize) -> Option<usize> {
        let [contradicting, undecided] = self.counts(expected, looks);
        if contradicting > 0 || undecided == 0 {
            return None;
        }
        let now = self.surfaces()?;
        let all = self.bounds.len();
        let until = |bound: &Bound, wanted: Verdict| {
            let decided = |surfaces: usize| {
                expected.verdict_of(&bound.with_surfaces(surfaces), all, looks) == wanted
            };
            fewest(now, decided)
        };
        let (agreeing, others): (Vec<&Bound>, Vec<&Bound>) =
            self.bounds.iter().partition(|bound| expected.contains(bound.value));
        if others.is_empty() {
            let each = agreeing.into_iter().map(|bound| until(bound, Verdict::Holds));
            each.collect::<Option<Vec<usize>>>()?.into_iter().max()
        } else {
            let each = others.into_iter();
            each.filter_map(|bound| until(bound, Verdict::DoesNotHold)).min()
        }
    }
}

/// The fewest surfaces, not below a number, that do; more of them do as well.
fn fewest(from: usize, does: impl Fn(usize) -> bool) -> Option<usize> {
    let mut above = from;
    while !does(above) {
        if above >= MOST {
            return None;
        }
        above = (2 * above).min(MOST);
    }
    let mut below = above / 2;
    while above - below > 1 {
        let middle = below + (above - below) / 2;
        if middle >= from && does(middle) { above = middle } else { below = middle }
    }
    Some(above.max(from))
}

#[cfg(test)]
mod tests {
    use super::*;
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

    fn bound(value: f64, error: f64) -> Bound {
        Bound { label: String::new(), value, error, systematic: 0.0, surfaces: Some(10) }
    }

    #[test]
    fn as_many_surfaces_as_are_said_to_decide_do_and_one_less_does_not() {
        for bounds in [
            vec![bound(0.1, 0.1)],
            vec![bound(0.1, 0.1), bound(0.3, 0.2)],
            vec![bound(-0.1, 0.1), bound(0.3, 0.2)],
        ] {
            let expected = Expectation::Positive;
            let judgement = Judgement::of(expected, bounds.clone()).unwrap();
            assert_eq!(judgement.verdict, Verdict::CannotSay);
            let more = judgement.more_surfaces(expected).unwrap();
            let then = |surfaces: usize| {
                let bounds = bounds.iter().map(|bound| bound.with_surfaces(surfaces));
                Judgement::of(expected, bounds.collect()).unwrap().verdict
            };
            assert_ne!(then(10 + more), Verdict::CannotSay, "{more}");
            assert_eq!(then(10 + more - 1), Verdict::CannotSay, "{more}");
        }
    }

    #[test]
    fn what_is_decided_needs_no_more_and_a_quantity_of_zero_never_is() {
        let expected = Expectation::Positive;
        let more =
            |bound: Bound| Judgement::of(expected, vec![bound]).unwrap().more_surfaces(expected);
        assert_eq!(more(bound(1.0, 0.1)), None);
        assert_eq!(more(bound(0.0, 0.1)), None);
    }
}
