//! Claims of asperity on the gap: the incremental stiffness K = −dp₀/dū of an interface with the
//! mean gap ū, and the area at which the gap stops percolating.
//!
//! Persson's p₀ ∝ exp(−ū/u₀) has K = p₀/u₀. Between two loads, K = (y₂ − y₁)/(ū₁ − ū₂). For an
//! exponential law, this is the exact stiffness at the logarithmic mean of the loads, (y₂ −
//! y₁)/ln(y₂/y₁), for any spacing of the loads. The exponent of K(y) is computed between the loads
//! 0.01 and 0.05, where K is computed from the two neighbouring loads.
//!
//! The sealing area of a surface is the mean of its corrected areas (estimator `2017`) under the
//! last open and the first sealed load, averaged over both directions, as in the law
//! `gap-percolation` of `fit`. The spacing of the loads adds to the error of the mean over
//! surfaces. If the spacing alone could cause the scatter between surfaces, this scatter is not
//! used.

use std::collections::BTreeMap;

use crate::evidence::{Evidence, PerLoad};
use crate::quantities::{Cutoff, Quantities};
use crate::{Claim, Expectation, Origin, Statement};
use asperity_stages::columns::MEAN_GAP;
use asperity_statistics::intervals::Weights;

const PROPORTIONAL: Statement = Statement {
    name: "stiffness-is-proportional-to-load",
    origin: Origin::Ours,
    text: "The stiffness of an interface is proportional to the load, if the cell is much larger \
           than the longest wavelength.",
    source: "Persson's p₀ ∝ exp(−ū/u₀); arXiv 1210.4635: over a wide range of loads",
    quantity: "d ln K/d ln y between the loads 0.01 and 0.05 with K = −dy/dū, mean over the \
               spectra of each k_lower ≥ 8",
    expected: Expectation::Within(0.9, 1.1),
    reason: "the exponent is 1 if K is proportional to the load; ±10 %",
    figure: None,
};

const FINITE_SIZE: Statement = Statement {
    name: "sublinear-stiffness-is-of-the-finite-cell",
    origin: Origin::Ours,
    text: "Under light loads the stiffness grows more slowly than the load; this deviation \
           vanishes as the cell grows.",
    source: "arXiv 1210.4635: sublinear growth at low load is an effect of finite size",
    quantity: "increase of d ln K/d ln y (see stiffness-is-proportional-to-load) from one k_lower \
               to the next larger one, at equal k_upper/k_lower and nodes/k_lower, mean over the \
               spectra",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any increase counts; it is tested only for k_lower ≤ 4, \
             because an exponent that has reached 1 no longer grows",
    figure: None,
};

/// Loads between which the exponent d ln K/d ln y is computed, in units of E* × rms slope.
const ENDS: [f64; 2] = [0.01, 0.05];
/// Smallest k_lower, in wavelengths per side of the cell, for which the cell counts as large.
pub const GREAT_CELL: i64 = 8;
/// Largest k_lower for which the exponent of K(y) is expected to grow with the size of the cell.
const SMALL_CELL: i64 = 4;
const GAP_DATA: &str = "mean gap of measured contacts";
const NEIGHBOURING_LOADS: &str =
    "a `measure` stage with loads at 0.01 and 0.05, and one load on either side of each";

pub fn of_stiffness(evidence: &Evidence) -> Vec<Claim> {
    let mut gaps = evidence.along_loads(MEAN_GAP.name);
    gaps.retain(|one| one.spectrum.is_plain() && exponent(one, &Weights::ALL).is_some());
    let mut great: BTreeMap<i64, Vec<&PerLoad>> = BTreeMap::new();
    for one in gaps.iter().filter(|one| one.spectrum.k_lower >= GREAT_CELL) {
        great.entry(one.spectrum.k_lower).or_default().push(one);
    }
    let mut exponents = Quantities::default();
    for (k_lower, own) in &great {
        let label = format!("k_lower {k_lower}, {}", spectra(own.len()));
        let surfaces: Vec<usize> = own.iter().map(|one| one.surfaces()).collect();
        exponents
            .add(label, &surfaces, |weights| mean(own.iter().map(|one| exponent(one, weights))));
    }
    let mut growth = Quantities::default();
    for ([k_lower, next], own) in steps(&gaps) {
        let label = format!("k_lower {k_lower} → {next}, {}", spectra(own.len()));
        let surfaces: Vec<usize> = own.iter().flatten().map(|one| one.surfaces()).collect();
        growth.add(label, &surfaces, |weights| {
            mean(own.iter().map(|[lesser, greater]| {
                Some(exponent(greater, weights)? - exponent(lesser, weights)?)
            }))
        });
    }
    let lacks = |spectra: &'static str| {
        let is_there = !gaps.is_empty();
        move || if is_there { spectra } else { NEIGHBOURING_LOADS }.to_owned()
    };
    vec![
        exponents.judge(
            PROPORTIONAL,
            GAP_DATA,
            lacks("spectra without a plateau and with `k_lower` of at least 8"),
        ),
        growth.judge(
            FINITE_SIZE,
            GAP_DATA,
            lacks(
                "spectra with `k_lower` up to 4 that differ only in the size of the cell: all \
                   wavenumbers and `nodes` multiplied by 2",
            ),
        ),
    ]
}

fn spectra(count: usize) -> String {
    match count {
        1 => "1 spectrum".to_owned(),
        _ => format!("mean of {count} spectra"),
    }
}

fn mean(values: impl ExactSizeIterator<Item = Option<f64>>) -> Option<f64> {
    let count = values.len() as f64;
    let sum: f64 = values.sum::<Option<f64>>()?;
    Some(sum / count)
}

/// Returns pairs of spectra that differ only in the size of the cell, grouped by [k_lower of the
/// smaller cell, k_lower of the larger cell]. The smaller cell has at most [`SMALL_CELL`] longest
/// wavelengths per side.
fn steps(gaps: &[PerLoad]) -> BTreeMap<[i64; 2], Vec<[&PerLoad; 2]>> {
    let mut steps: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for one in gaps.iter().filter(|one| one.spectrum.k_lower <= SMALL_CELL) {
        let a = &one.spectrum;
        let differs_by_the_cell = |other: &&PerLoad| {
            let b = &other.spectrum;
            a.hurst == b.hurst
                && b.k_lower > a.k_lower
                && a.k_upper * b.k_lower == b.k_upper * a.k_lower
                && a.nodes * b.k_lower == b.nodes * a.k_lower
        };
        let next = gaps.iter().filter(differs_by_the_cell);
        if let Some(other) = next.min_by_key(|other| other.spectrum.k_lower) {
            let key = [a.k_lower, other.spectrum.k_lower];
            steps.entry(key).or_default().push([one, other]);
        }
    }
    steps
}

/// Returns the exponent d ln K/d ln y of the stiffness K between the loads [`ENDS`].
fn exponent(gaps: &PerLoad, weights: &Weights) -> Option<f64> {
    let [light, heavy] = ENDS.map(|load| stiffness(gaps, load, weights));
    let ((load, stiffness), (other_load, other)) = (light?, heavy?);
    let is_rising = stiffness > 0.0 && other > 0.0 && other_load > load;
    is_rising.then(|| libm::log(other / stiffness) / libm::log(other_load / load))
}

/// Returns (logarithmic mean of the two loads next to `load`, stiffness K between these loads).
fn stiffness(gaps: &PerLoad, load: f64, weights: &Weights) -> Option<(f64, f64)> {
    let index = gaps.at(load)?;
    let (before, after) = (index.checked_sub(1)?, index + 1);
    let (one, other) = (*gaps.loads.get(before)?, *gaps.loads.get(after)?);
    let [gap, next] = [before, after].map(|index| weights.mean(&gaps.values[index]));
    let logarithmic_mean = (other - one) / libm::log(other / one);
    Some((logarithmic_mean, (other - one) / (gap - next)))
}

const AT_0_415: Statement = Statement {
    name: "interface-is-sealed-at-0.415-of-the-area",
    origin: Origin::Ours,
    text: "The gap stops percolating at a contact area of 41.5 %, for isotropic surfaces whose \
           longest wavelength is much shorter than the cell.",
    source: "Wang & Müser, arXiv 2010.13470: “A critical contact area near 0.415 is confirmed.”",
    quantity: "mean area, corrected as in 2017, at the percolation threshold of the gap, k_lower ≥ \
               8",
    expected: Expectation::Within(0.405, 0.425),
    reason: "“near” is read as ±0.01, which excludes the 0.5 of effective-medium theory, but not \
             the 0.42 used in engineering",
    figure: None,
};

const BELOW_ONE_HALF: Statement = Statement {
    name: "interface-is-sealed-below-one-half-of-the-area",
    origin: Origin::Ours,
    text: "The gap stops percolating before half of the area is in contact, for all sizes of the \
           cell.",
    source: "effective-medium theory predicts a threshold of 0.5",
    quantity: "1/2 minus the mean area, corrected as in 2017, at the percolation threshold of the \
               gap",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any difference counts",
    figure: None,
};

const INDEPENDENT_OF_CELL: Statement = Statement {
    name: "sealing-area-does-not-depend-on-k-lower",
    origin: Origin::Ours,
    text: "The mean area at the percolation threshold does not depend on the number of longest \
           wavelengths per side of the cell.",
    source: "Wang & Müser state the threshold for cells much larger than the longest wavelength; \
             smaller cells scatter about it",
    quantity: "difference of the mean areas, corrected as in 2017, at the percolation threshold of \
               the gap for neighbouring k_lower (larger minus smaller)",
    expected: Expectation::Within(-0.01, 0.01),
    reason: "±0.01, as for interface-is-sealed-at-0.415-of-the-area",
    figure: None,
};

const SCATTER_FALLS: Statement = Statement {
    name: "sealing-area-scatters-less-in-greater-cells",
    origin: Origin::Ours,
    text: "The area at the percolation threshold scatters less between surfaces in larger cells.",
    source: "finite-size scaling: the scatter falls as a power of the size of the cell",
    quantity: "ln of the ratio of the standard deviations of the area, corrected as in 2017, at \
               the percolation threshold of the gap for neighbouring k_lower (smaller over larger)",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any difference counts",
    figure: None,
};

const SEALING_DATA: &str = "gap of measured contacts";
const LOADS_TO_SEALED: &str =
    "a `measure` stage with closely spaced loads from open to sealed, such as from 0.05 to 0.75";

pub fn of_sealing(evidence: &Evidence) -> Vec<Claim> {
    let all = evidence.percolation_areas();
    let mut at = Quantities::default();
    let mut below = Quantities::default();
    for one in &all {
        let (label, surfaces) = (evidence.name(&one.spectrum), [one.values.len()]);
        if one.spectrum.k_lower >= GREAT_CELL {
            at.add_rounded(label.clone(), &surfaces, one.rounding, |weights| {
                Some(weights.mean(&one.values))
            });
        }
        below.add_rounded(label, &surfaces, one.rounding, |weights| {
            Some(0.5 - weights.mean(&one.values))
        });
    }
    let (mut difference, mut scatter) = (Quantities::default(), Quantities::default());
    for lesser in &all {
        let Some(greater) = Cutoff::Lower.next(&lesser.spectrum, &all, |one| &one.spectrum) else {
            continue;
        };
        let name = evidence.name(&lesser.spectrum);
        let label = format!("{name} → k_lower {}", greater.spectrum.k_lower);
        let surfaces = [lesser.values.len(), greater.values.len()];
        let rounding = libm::hypot(lesser.rounding, greater.rounding);
        difference.add_rounded(label.clone(), &surfaces, rounding, |weights| {
            Some(weights.mean(&greater.values) - weights.mean(&lesser.values))
        });
        scatter.add(label, &surfaces, |weights| {
            let both = [lesser, greater];
            let are_resolved = both.iter().all(|one| one.scatter_is_resolved);
            let [lesser, greater] = both.map(|one| weights.deviation(&one.values));
            (are_resolved && lesser > 0.0 && greater > 0.0).then(|| libm::log(lesser / greater))
        });
    }
    let lacks = |spectra: &'static str| {
        let is_there = !all.is_empty();
        move || if is_there { spectra } else { LOADS_TO_SEALED }.to_owned()
    };
    let steps = "spectra that differ only in `k_lower`";
    vec![
        at.judge(AT_0_415, SEALING_DATA, lacks("spectra with `k_lower` of at least 8")),
        below.judge(BELOW_ONE_HALF, SEALING_DATA, lacks("random surfaces")),
        difference.judge(INDEPENDENT_OF_CELL, SEALING_DATA, lacks(steps)),
        scatter.judge(SCATTER_FALLS, SEALING_DATA, lacks(steps)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::Spectrum;

    #[test]
    fn of_an_exponential_the_stiffness_is_proportional_however_loads_are_spaced() {
        for loads in
            [vec![0.009, 0.01, 0.011, 0.045, 0.05, 0.055], vec![0.003, 0.01, 0.02, 0.05, 0.4]]
        {
            let gap = |load: &f64| vec![-0.4 * load.ln()];
            let gaps = PerLoad {
                spectrum: Spectrum {
                    hurst: 0.8,
                    k_lower: 8,
                    k_rolloff: 8,
                    k_upper: 32,
                    nodes: 256,
                },
                values: loads.iter().map(gap).collect(),
                loads,
            };
            let found = exponent(&gaps, &Weights::ALL).unwrap();
            assert!((found - 1.0).abs() < 1e-12, "{found}");
        }
    }
}
