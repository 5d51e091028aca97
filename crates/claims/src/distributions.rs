//! Claims on the distribution of contact pressures, compared with Persson's theory (2001):
//! p(σ) = √(2/π) [exp(−2(σ − y)²) − exp(−2(σ + y)²)], with σ and the load y in units of E* × rms
//! slope.
//!
//! Quantities are fractions of the nominal area with a pressure between two bounds, averaged over
//! surfaces. The theory is integrated over the same bounds, so no bin is compared at its middle.

use crate::evidence::{Evidence, Pressures, Spectrum};
use crate::quantities::Quantities;
use crate::{Claim, Expectation, Origin, Statement};
use asperity_contact::theory::persson;
use asperity_statistics::intervals::Weights;

const LINEAR_AT_ZERO: Statement = Statement {
    name: "pressure-density-is-linear-at-zero",
    origin: Origin::Ours,
    text: "On finer meshes the probability density at zero pressure falls towards zero as the \
           square root of the mesh step, as it must if the density rises linearly from zero.",
    source: "Persson 2001, where p(σ) vanishes at σ = 0 by its boundary condition; the density of \
             a Hertzian contact vanishes, too: dA/dp ∝ p",
    quantity: "exponent n of Δxⁿ for the fraction of the area with a pressure below 0.025 E* h′, \
               from the same surfaces on a mesh of 32 to 64 nodes per shortest wavelength and on \
               one with twice as many, at loads 0.02, 0.1",
    expected: Expectation::Within(0.3, 0.7),
    reason: "the density is linear if the pressure falls as the square root of the distance to an \
             edge of contact. A mesh of step Δx does not resolve pressures below those of the \
             nodes next to an edge, about √Δx, so its density at zero falls as √Δx. The exponent \
             is 0 if the density starts at a finite value. A single mesh cannot show how the \
             density begins: exponents fitted between 0.1 and 0.2 are 0.05 on 8 nodes per shortest \
             wavelength and 0.7 on 128",
    figure: None,
};

const AS_PERSSON: Statement = Statement {
    name: "pressures-are-distributed-as-in-persson",
    origin: Origin::Ours,
    text: "Under light and moderate loads contact pressures are distributed as in Persson's \
           theory.",
    source: "Persson 2001",
    quantity: "ratio of the fraction of the area with a pressure from 0.1 to 0.5, 0.5 to 1 and 1 \
               to 1.5 E* h′ to that in the theory, at loads 0.02, 0.1, 0.4",
    expected: Expectation::Within(0.9, 1.1),
    reason: "±10 %; lower pressures are excluded, because they depend on the mesh",
    figure: None,
};

const MIDDLE_AS_PERSSON: Statement = Statement {
    name: "middle-pressures-are-as-in-persson",
    origin: Origin::Ours,
    text: "The fraction of the area with a pressure from 0.5 to 1 times E* × rms slope is that of \
           Persson's theory under all loads.",
    source: "observed in the study `manifests/distributions.toml`; no theory is known that \
             predicts it",
    quantity: "ratio of the fraction of the area with a pressure from 0.5 to 1 E* h′ to that in \
               the theory, at loads 0.02, 0.05, 0.1, 0.2, 0.4, 0.8",
    expected: Expectation::Within(0.95, 1.05),
    reason: "±5 %, while the fractions below and above this range differ by factors",
    figure: None,
};

const FEWER_HIGH: Statement = Statement {
    name: "high-pressures-are-rarer-than-in-persson",
    origin: Origin::Ours,
    text: "Under light and moderate loads, pressures above E* × rms slope are rarer than in \
           Persson's theory, where a smaller area bears the same load.",
    source: "compare area-above-persson",
    quantity: "ln of the ratio of the fraction of the area with a pressure from 1 to 2 E* h′ in \
               the theory to that in the study, at loads 0.02, 0.05, 0.1, 0.2",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any difference counts",
    figure: None,
};

const HEAVY_AS_PERSSON: Statement = Statement {
    name: "pressures-near-full-contact-are-as-in-persson",
    origin: Origin::Ours,
    text: "Near full contact, pressures far from zero are distributed as in Persson's theory.",
    source: "Persson 2001: at full contact the pressure of a Gaussian surface is Gaussian",
    quantity: "ratio of the fraction of the area with a pressure from 0.5 to 1, 1 to 1.5 and 1.5 \
               to 2 E* h′ to that in the theory, at the load 0.8",
    expected: Expectation::Within(0.95, 1.05),
    reason: "±5 %; 89 % of the area is in contact in the theory",
    figure: None,
};

const DATA: &str = "pressures of contact nodes";
const MODERATE: [f64; 3] = [0.02, 0.1, 0.4];
const TO_HEAVY: [f64; 6] = [0.02, 0.05, 0.1, 0.2, 0.4, 0.8];

pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    let all = evidence.pressures();
    let lacks = |loads: &'static [f64]| {
        let is_there = !all.is_empty();
        move || {
            if is_there {
                let loads: Vec<String> = loads.iter().map(f64::to_string).collect();
                format!(
                    "a load at {}, and bins with edges at 0.1, 0.5, 1, 1.5, 2",
                    loads.join(" or ")
                )
            } else {
                "a `measure` stage with `what = \"pressures\"`".to_owned()
            }
        }
    };
    let over_theory = |loads: &[f64], bounds: &[[f64; 2]]| {
        let mut quantities = Quantities::default();
        for (one, &bounds) in with_bounds(&all, loads, bounds) {
            ratio(evidence, one, bounds, |ratio| ratio, &mut quantities);
        }
        quantities
    };
    let mut rarer = Quantities::default();
    for (one, &bounds) in with_bounds(&all, &TO_HEAVY[..4], &[[1.0, 2.0]]) {
        ratio(evidence, one, bounds, |ratio| -libm::log(ratio), &mut rarer);
    }
    let below = [[0.1, 0.5], [0.5, 1.0], [1.0, 1.5]];
    let middle = [[0.5, 1.0]];
    let far = [[0.5, 1.0], [1.0, 1.5], [1.5, 2.0]];
    vec![
        linear(evidence, &all).judge(LINEAR_AT_ZERO, DATA, || {
            "pressures of the same surfaces on meshes of 32 to 128 nodes per shortest wavelength, \
             each with twice as many nodes as the previous one, at a load of 0.02 or 0.1 in bins \
             of 0.025, because a single mesh cannot show how the density begins"
                .to_owned()
        }),
        over_theory(&MODERATE, &below).judge(AS_PERSSON, DATA, lacks(&MODERATE)),
        over_theory(&TO_HEAVY, &middle).judge(MIDDLE_AS_PERSSON, DATA, lacks(&TO_HEAVY)),
        rarer.judge(FEWER_HIGH, DATA, lacks(&TO_HEAVY[..4])),
        over_theory(&[0.8], &far).judge(HEAVY_AS_PERSSON, DATA, lacks(&[0.8])),
    ]
}

/// Returns each distribution near one of these loads, paired with each of the bounds.
fn with_bounds<'a>(
    all: &'a [Pressures],
    loads: &'a [f64],
    bounds: &'a [[f64; 2]],
) -> impl Iterator<Item = (&'a Pressures, &'a [f64; 2])> {
    let own = under_loads(all, loads).into_iter();
    own.flat_map(move |one| bounds.iter().map(move |bounds| (one, bounds)))
}

/// Returns the distributions of all spectra at loads within 10 % of one of the requested loads.
fn under_loads<'a>(all: &'a [Pressures], loads: &[f64]) -> Vec<&'a Pressures> {
    let is_near = |load: f64| loads.iter().any(|asked| (load / asked - 1.0).abs() < 0.1);
    all.iter().filter(|one| is_near(one.load)).collect()
}

fn label(evidence: &Evidence, one: &Pressures) -> String {
    evidence.name_under(&one.spectrum, one.load)
}

/// Adds `quantity`(f/f_Persson) to `quantities`. f is the fraction of the nominal area with a
/// pressure from `low` to `high`, averaged over the surfaces, and f_Persson is the same fraction in
/// Persson's theory.
fn ratio(
    evidence: &Evidence,
    one: &Pressures,
    [low, high]: [f64; 2],
    quantity: fn(f64) -> f64,
    quantities: &mut Quantities,
) {
    let Some(shares) = one.between(low, high) else {
        return;
    };
    let label = format!("{}, pressures {low} to {high}", label(evidence, one));
    let theory = persson::fraction_between(one.load, low, high);
    quantities.add(label, &[shares.len()], |weights: &Weights| {
        let share = weights.mean(&shares);
        (share > 0.0).then(|| quantity(share / theory))
    });
}

/// Computes the exponent n of f ∝ Δxⁿ from pairs of meshes with the steps Δx and Δx/2, where f is
/// the fraction of the nominal area with pressures from 0 to 0.025.
fn linear(evidence: &Evidence, all: &[Pressures]) -> Quantities {
    let mut quantities = Quantities::default();
    for one in under_loads(all, &MODERATE[..2]) {
        let finer = Spectrum { nodes: 2 * one.spectrum.nodes, ..one.spectrum.clone() };
        let is_finer = |other: &&Pressures| other.spectrum == finer && other.load == one.load;
        let finer = all.iter().find(is_finer);
        let lightest = |one: &Pressures| one.between(0.0, 0.025);
        let Some((coarse, fine)) = lightest(one).zip(finer.and_then(lightest)) else {
            continue;
        };
        if !(32..=64).contains(&(one.spectrum.nodes / one.spectrum.k_upper)) {
            continue;
        }
        quantities.add(label(evidence, one), &[coarse.len(), fine.len()], |weights| {
            let [coarse, fine] = [&coarse, &fine].map(|shares| weights.mean(shares));
            (fine > 0.0).then(|| libm::log2(coarse / fine))
        });
    }
    quantities
}
