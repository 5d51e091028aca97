//! How many more surfaces would decide a claim.

use std::num::NonZeroU32;

use super::{Expectation, Judgement, Verdict};
use asperity_statistics::intervals::Bound;

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
        match others.is_empty() {
            false => {
                let each = others.into_iter();
                each.filter_map(|bound| until(bound, Verdict::DoesNotHold)).min()
            }
            true => {
                let each = agreeing.into_iter().map(|bound| until(bound, Verdict::Holds));
                each.collect::<Option<Vec<usize>>>()?.into_iter().max()
            }
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
        match middle >= from && does(middle) {
            true => above = middle,
            false => below = middle,
        }
    }
    Some(above.max(from))
}

#[cfg(test)]
mod tests {
    use super::*;

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
