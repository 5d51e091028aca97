//! Claims on the area at which the gap stops percolating, and the interface is sealed.
//!
//! Of each surface it is the middle of the last open and the first sealed load, mean of both directions,
//! as the law `gap-percolation` of `fit` has it, of the area corrected as in 2017. The distance of the loads
//! is part of the error of its mean; a scatter that may be all of that distance is no scatter.

use super::evidence::{Evidence, SealingAreas};
use super::quantities::Quantities;
use super::{Claim, Expectation, Origin, Statement};

const AT_0_415: Statement = Statement {
    name: "interface-is-sealed-at-0.415-of-the-area",
    origin: Origin::Ours,
    says: "The gap stops percolating where 41.5 % of the area are in contact, on isotropic surfaces whose \
           longest waves are short beside the cell.",
    place: "Wang & Müser, arXiv 2010.13470: “A critical contact area near 0.415 is confirmed.”",
    quantity: "mean corrected area at the threshold, k_lower 8 or more",
    expected: Expectation::Within(0.405, 0.425),
    because: "as printed, “near”: one point either way, which tells it from the 0.5 of \
              effective-medium theory and not from the 0.42 that is used in engineering",
    figure: None,
};

const BELOW_ONE_HALF: Statement = Statement {
    name: "interface-is-sealed-below-one-half-of-the-area",
    origin: Origin::Ours,
    says: "The gap stops percolating before half of the area is in contact, whatever the cell.",
    place: "effective-medium theory has the threshold at 0.5",
    quantity: "1/2 less the mean corrected area at the threshold",
    expected: Expectation::Positive,
    because: "an order, so any difference will do",
    figure: None,
};

const WHATEVER_THE_CELL: Statement = Statement {
    name: "sealing-area-does-not-depend-on-k-lower",
    origin: Origin::Ours,
    says: "The mean area at the threshold does not depend on how many of the longest wavelengths there are \
           to the cell.",
    place: "Wang & Müser state it for short waves; smaller cells scatter about it",
    quantity: "mean corrected area at the threshold, greater k_lower less the next lesser one",
    expected: Expectation::Within(-0.01, 0.01),
    because: "one point, as interface-is-sealed-at-0.415-of-the-area",
    figure: None,
};

const SCATTER_FALLS: Statement = Statement {
    name: "sealing-area-scatters-less-in-greater-cells",
    origin: Origin::Ours,
    says: "The area at the threshold scatters less between surfaces where more of the longest wavelengths \
           fit into the cell.",
    place: "finite-size scaling: the scatter falls as a power of the cell",
    quantity: "ln of the standard deviation of the corrected area at the threshold, lesser k_lower over \
               the next greater one",
    expected: Expectation::Positive,
    because: "an order, so any difference will do",
    figure: None,
};

/// Longest wavelengths to the side of a cell that is great beside them.
const GREAT_CELL: i64 = 8;
const DATA: &str = "gap of measured contacts";
const LOADS: &str =
    "a `measure` stage over loads from open to sealed, close together: from 0.05 to 0.75";

/// The claims.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    let all = evidence.percolation_areas();
    let great: Vec<&SealingAreas> =
        all.iter().filter(|one| one.spectrum.k_lower >= GREAT_CELL).collect();
    let mut at = Quantities::default();
    for one in &great {
        at.add_rounded(
            evidence.name(&one.spectrum),
            &[one.values.len()],
            one.rounding,
            |weights| Some(weights.mean(&one.values)),
        );
    }
    let mut below = Quantities::default();
    for one in &all {
        below.add_rounded(
            evidence.name(&one.spectrum),
            &[one.values.len()],
            one.rounding,
            |weights| Some(0.5 - weights.mean(&one.values)),
        );
    }
    let (mut difference, mut scatter) = (Quantities::default(), Quantities::default());
    for [lesser, greater] in neighbours(&all) {
        let name = evidence.name(&lesser.spectrum);
        let label = format!("{name}, k_lower {} over it", greater.spectrum.k_lower);
        let surfaces = [lesser.values.len(), greater.values.len()];
        let rounding = lesser.rounding.hypot(greater.rounding);
        difference.add_rounded(label.clone(), &surfaces, rounding, |weights| {
            Some(weights.mean(&greater.values) - weights.mean(&lesser.values))
        });
        scatter.add(label, &surfaces, |weights| {
            let both = [lesser, greater];
            let are_resolved = both.iter().all(|one| one.scatter_is_resolved);
            let [lesser, greater] = both.map(|one| weights.deviation(&one.values));
            (are_resolved && lesser > 0.0 && greater > 0.0).then(|| (lesser / greater).ln())
        });
    }
    let lacks = |spectra: &'static str| {
        let is_there = !all.is_empty();
        move || if is_there { spectra } else { LOADS }.to_owned()
    };
    let steps = "spectra that differ in `k_lower` alone";
    vec![
        at.judge(AT_0_415, DATA, lacks("spectra with `k_lower` of 8 or more")),
        below.judge(BELOW_ONE_HALF, DATA, lacks("random surfaces")),
        difference.judge(WHATEVER_THE_CELL, DATA, lacks(steps)),
        scatter.judge(SCATTER_FALLS, DATA, lacks(steps)),
    ]
}

/// Pairs that differ in k_lower alone, neighbours in it: the lesser one first.
fn neighbours(all: &[SealingAreas]) -> Vec<[&SealingAreas; 2]> {
    let next = |one: &'_ SealingAreas| {
        let own = |other: &&SealingAreas| {
            let (a, b) = (&one.spectrum, &other.spectrum);
            a.is_plain()
                && b.is_plain()
                && (a.hurst, a.k_upper, a.nodes) == (b.hurst, b.k_upper, b.nodes)
                && b.k_lower > a.k_lower
        };
        let beyond = all.iter().filter(own);
        beyond.min_by_key(|other| other.spectrum.k_lower)
    };
    let pairs = all.iter().filter_map(|one| Some([one, next(one)?]));
    pairs.collect()
}
