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

/// What is decided of some claims.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Decisions {
    /// Claims that are decided.
    pub decided: Vec<&'static str>,
    /// Claims that are not.
    pub undecided: Vec<Undecided>,
    /// Claims without a quantity, and what they need.
    pub not_judged: Vec<(&'static str, String)>,
}

/// A claim that is not decided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Undecided {
    /// Its name.
    pub name: &'static str,
    /// How many surfaces of each spectrum there are, and how many would decide it at the present spread;
    /// `None` if no number would.
    pub surfaces: Option<[usize; 2]>,
}

/// The names of all claims that surfaces decide.
pub fn names() -> Vec<&'static str> {
    let nothing = Evidence::of(&[]).expect("nothing lacks no column");
    let claims = OF_A_STUDY.iter().flat_map(|claims| claims(&nothing));
    claims.map(|claim| claim.statement.name).collect()
}

/// What is decided of the claims of some names, or of all, at one of so many looks.
pub fn decisions(evidence: &Evidence, names: &[String], looks: NonZeroU32) -> Decisions {
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
            decisions.add(claim, looks);
        }
    }
    decisions
}

impl Decisions {
    fn add(&mut self, claim: Claim, looks: NonZeroU32) {
        let (name, expected) = (claim.statement.name, claim.statement.expected);
        debug_assert_ne!(claim.statement.origin, Origin::Misprint);
        match claim.outcome {
            ClaimOutcome::Judged(judgement) if judgement.is_decided(expected, looks) => {
                self.decided.push(name);
            }
            ClaimOutcome::Judged(judgement) => self.undecided.push(Undecided {
                name,
                surfaces: judgement.decided_with(expected, looks),
            }),
            ClaimOutcome::NotComputed(needs) => self.not_judged.push((name, needs)),
            ClaimOutcome::Noted => {}
        }
    }

    /// How many surfaces in place of so many would decide all claims that some number decides; `None`
    /// without any.
    pub fn wanted(&self, surfaces: u32) -> Option<u64> {
        let wanted = self.undecided.iter().filter_map(|claim| {
            let [now, needed] = claim.surfaces?;
            // A spectrum with fewer surfaces than this stage draws has its own share of more.
            Some((u64::from(surfaces) * needed as u64).div_ceil(now as u64))
        });
        wanted.max()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claims_that_surfaces_decide_have_names_of_their_own() {
        let mut names = names();
        assert!(names.contains(&"area-above-persson"));
        assert!(
            !names.contains(&"asymptote-of-alpha"),
            "a closed form decides it"
        );
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
