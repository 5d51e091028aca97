//! Claims that a growing study has decided, and the number of surfaces that would decide the
//! others.
//!
//! A growing study tests its claims several times, at so-called looks, and stops as soon as they
//! are decided. Such a study errs more often than a study with one test: ten looks at 95 % each are
//! wrong in up to one case of five. Therefore the 5 % are divided among the looks (Bonferroni), so
//! all looks together are wrong in at most 5 % of the cases. The intervals are at least as wide as
//! those of a study of fixed size. So if a look decides a claim, `claims` gives the same verdict on
//! the same surfaces.

use std::num::NonZeroU32;

use crate::evaluate;
use crate::evidence::Evidence;
use crate::{Claim, ClaimOutcome, Expectation, Judgement, Verdict};
use asperity_pipeline::adaptive_sampling::{ClaimRule, Decisions, Undecided};
use asperity_pipeline::plan::Plan;
use asperity_pipeline::study::Study;
use asperity_statistics::intervals::Bound;
use asperity_tables::table::{Table, TableError};

/// Stopping rule of a study that adds surfaces until its claims are decided.
#[derive(Debug, Clone, Copy)]
pub struct DeclaredClaims;

impl ClaimRule for DeclaredClaims {
    fn decide(
        &self,
        study: &Study,
        plan: &Plan,
        tables: &[Option<Table>],
        names: &[String],
        looks: NonZeroU32,
    ) -> Result<Decisions, TableError> {
        let evidence = Evidence::from_study(study, plan, tables)?;
        let mut decisions = Decisions::default();
        for spec in study.claims.iter().filter(|spec| spec.depends_on_surfaces()) {
            if names.is_empty() || names.contains(&spec.name) {
                add(&mut decisions, evaluate::claim(spec, &evidence)?, looks);
            }
        }
        Ok(decisions)
    }
}

/// Adds a claim to the decided, undecided or unjudged claims in `decisions`.
fn add(decisions: &mut Decisions, claim: Claim, looks: NonZeroU32) {
    let (name, expected) = (claim.statement.name, claim.statement.expected);
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

/// Largest number of surfaces of each spectrum that a prediction considers.
const MAX_SURFACES: usize = 1_000_000;

impl Judgement {
    /// Returns the number of further surfaces of each spectrum that would decide an undecided
    /// claim, if all values and standard deviations stay the same. Returns `None` for a decided
    /// claim, or if a million surfaces would not decide it.
    ///
    /// If a quantity is outside the expected range, the claim fails as soon as the joint interval
    /// of this quantity excludes the range. Otherwise the claim holds as soon as each quantity is
    /// as expected at one-sided 95 %.
    pub fn more_surfaces(&self, expected: Expectation) -> Option<usize> {
        let now = self.surfaces()?;
        Some(self.surfaces_to_decide(expected, 1)? - now)
    }

    /// Returns true if the claim is decided at one of `looks` looks, at a level that holds for all
    /// looks together.
    pub fn is_decided(&self, expected: Expectation, looks: NonZeroU32) -> bool {
        let [contradicting, undecided] = counts(&self.bounds, expected, looks.get() as usize);
        contradicting > 0 || (undecided == 0 && self.without_value.is_empty())
    }

    /// Returns the present number of surfaces of each spectrum, and the number that would decide
    /// the claim at one of `looks` looks (see [`Judgement::more_surfaces`]). Returns `None` if no
    /// number would.
    pub fn decided_with(&self, expected: Expectation, looks: NonZeroU32) -> Option<[usize; 2]> {
        let needed = self.surfaces_to_decide(expected, looks.get() as usize)?;
        let could_hold = self.bounds.iter().all(|bound| expected.contains(bound.value));
        // A claim cannot hold if one of its quantities has no value.
        let is_hopeless = could_hold && !self.without_value.is_empty();
        Some([self.surfaces()?, needed]).filter(|_| !is_hopeless)
    }

    /// Returns the smallest number of surfaces on which a quantity is based.
    fn surfaces(&self) -> Option<usize> {
        let counts = self.bounds.iter().filter_map(|bound| bound.surfaces);
        counts.min()
    }

    /// Returns the number of surfaces of each spectrum with which an undecided claim would be
    /// decided.
    fn surfaces_to_decide(&self, expected: Expectation, looks: usize) -> Option<usize> {
        let [contradicting, undecided] = counts(&self.bounds, expected, looks);
        if contradicting > 0 || undecided == 0 {
            return None;
        }
        let now = self.surfaces()?;
        let all = self.bounds.len();
        let until = |bound: &Bound, wanted: Verdict| {
            let decided = |surfaces: usize| {
                expected.verdict_at_look(&bound.with_surfaces(surfaces), all, looks) == wanted
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

/// Returns [number of quantities that contradict the claim, number of undecided quantities] at one
/// of `looks` looks.
pub fn counts(bounds: &[Bound], expected: Expectation, looks: usize) -> [usize; 2] {
    let verdict = |bound: &Bound| expected.verdict_at_look(bound, bounds.len(), looks);
    [Verdict::DoesNotHold, Verdict::CannotSay]
        .map(|meant| bounds.iter().filter(|bound| verdict(bound) == meant).count())
}

/// Returns the smallest number n ≥ `from` for which `does`(n) is true, or `None` if n would exceed
/// [`MAX_SURFACES`]. If `does` is true for n, it must be true for all larger numbers.
fn fewest(from: usize, does: impl Fn(usize) -> bool) -> Option<usize> {
    let mut above = from;
    while !does(above) {
        if above >= MAX_SURFACES {
            return None;
        }
        above = (2 * above).min(MAX_SURFACES);
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

    fn growth() -> Growth {
        Growth { at_least: 10, at_most: 80, until: Until::Claims(Vec::new()) }
    }

    /// Returns the fraction of simulated studies in which one look finds a mean above zero,
    /// although the true mean is zero.
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
                let verdict =
                    Expectation::POSITIVE.verdict_at_look(&bound.unwrap(), 1, looks_shared);
                verdict == Verdict::Holds
            })
        };
        (0..STUDIES).filter(is_misled).count() as f64 / STUDIES as f64
    }

    #[test]
    fn all_looks_together_mislead_no_more_than_one_does() {
        let looks = looks(&growth()).get() as usize;
        assert_eq!(looks, 5);
        // 2000 studies determine a fraction of 5 % to half a percentage point.
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
            let expected = Expectation::POSITIVE;
            let judgement = Judgement::new(expected, bounds.clone()).unwrap();
            assert_eq!(judgement.verdict, Verdict::CannotSay);
            let more = judgement.more_surfaces(expected).unwrap();
            let then = |surfaces: usize| {
                let bounds = bounds.iter().map(|bound| bound.with_surfaces(surfaces));
                Judgement::new(expected, bounds.collect()).unwrap().verdict
            };
            assert_ne!(then(10 + more), Verdict::CannotSay, "{more}");
            assert_eq!(then(10 + more - 1), Verdict::CannotSay, "{more}");
        }
    }

    #[test]
    fn what_is_decided_needs_no_more_and_a_quantity_of_zero_never_is() {
        let expected = Expectation::POSITIVE;
        let more =
            |bound: Bound| Judgement::new(expected, vec![bound]).unwrap().more_surfaces(expected);
        assert_eq!(more(bound(1.0, 0.1)), None);
        assert_eq!(more(bound(0.0, 0.1)), None);
    }
}
