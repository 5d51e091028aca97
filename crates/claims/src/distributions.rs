//! Claims on how contact pressures are distributed, beside Persson's theory (2001):
//! p(σ) = √(2/π) [exp(−2(σ − y)²) − exp(−2(σ + y)²)], σ and the load y in units of E* × rms slope.
//!
//! Quantities are shares of the nominal area whose pressure lies between two bounds, means over surfaces,
//! so that the theory is integrated over the same bounds and no bin is compared at its middle.

use crate::evidence::{Evidence, Pressures, Spectrum};
use crate::quantities::Quantities;
use crate::{Claim, Expectation, Origin, Statement};
use asperity_contact::theory::persson;
use asperity_statistics::intervals::Weights;

const LINEAR_AT_ZERO: Statement = Statement {
    name: "pressure-density-is-linear-at-zero",
    origin: Origin::Ours,
    says: "The probability density of the contact pressure rises linearly from zero.",
    place: "Persson 2001, where p(σ) vanishes at σ = 0 by its boundary condition; so does that of Hertz' \
            contact, dA/dp ∝ p",
    quantity: "exponent of the mesh step with which the share of the area below 0.025 falls, from a mesh of \
               32 to 64 nodes to the shortest wavelength to one of twice as many, the same surfaces, loads \
               0.02, 0.1",
    expected: Expectation::Within(0.3, 0.7),
    because: "the density is linear where pressure falls as the square root of the distance to an edge of \
              contact. A mesh of step Δx does not resolve pressures below those of its first nodes within \
              an edge, about √Δx, and its density at zero falls as √Δx; the exponent is 0 where a density \
              starts at a finite value. How the density on one mesh begins is the mesh's: exponents between \
              0.1 and 0.2 are 0.05 on 8 nodes to the shortest wavelength and 0.7 on 128",
    figure: None,
};

const AS_PERSSON: Statement = Statement {
    name: "pressures-are-distributed-as-in-persson",
    origin: Origin::Ours,
    says: "Under light and moderate loads contact pressures are distributed as in Persson's theory.",
    place: "Persson 2001",
    quantity: "share of the area whose pressure lies from 0.1 to 0.5, from 0.5 to 1 and from 1 to 1.5 over that \
               in the theory, loads 0.02, 0.1, 0.4",
    expected: Expectation::Within(0.9, 1.1),
    because: "ten per cent; the lightest pressures, which the mesh decides, are left out",
    figure: None,
};

const MIDDLE_AS_PERSSON: Statement = Statement {
    name: "middle-pressures-are-as-in-persson",
    origin: Origin::Ours,
    says: "The share of the area whose pressure lies from 0.5 to 1 times E* × rms slope is that of \
           Persson's theory, under whatever load.",
    place: "found in `manifests/distributions.toml`; no theory is known to ask for it",
    quantity: "share of the area whose pressure lies from 0.5 to 1 over that in the theory, loads 0.02, 0.05, \
               0.1, 0.2, 0.4, 0.8",
    expected: Expectation::Within(0.95, 1.05),
    because: "five per cent, where the shares below and above differ by factors",
    figure: None,
};

const FEWER_HIGH: Statement = Statement {
    name: "high-pressures-are-rarer-than-in-persson",
    origin: Origin::Ours,
    says: "Under light and moderate loads pressures above E* × rms slope are rarer than in Persson's theory, \
           in which contact bears the same load on less area.",
    place: "beside area-above-persson",
    quantity: "ln of the share of the area whose pressure lies from 1 to 2 in the theory over that found, \
               loads 0.02, 0.05, 0.1, 0.2",
    expected: Expectation::Positive,
    because: "an order, so any difference will do",
    figure: None,
};

const HEAVY_AS_PERSSON: Statement = Statement {
    name: "pressures-near-full-contact-are-as-in-persson",
    origin: Origin::Ours,
    says: "Towards full contact the pressures that are far from zero are distributed as in Persson's theory.",
    place: "Persson 2001: at full contact the pressure of a Gaussian surface is Gaussian",
    quantity: "share of the area whose pressure lies from 0.5 to 1, from 1 to 1.5 and from 1.5 to 2 over that in \
               the theory, load 0.8",
    expected: Expectation::Within(0.95, 1.05),
    because: "five per cent; 89 % of the area touch in the theory",
    figure: None,
};

const DATA: &str = "pressures of the nodes in contact";
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
                    "a load at {}, and bins that end at 0.1, 0.2, 0.5, 1, 1.5, 2",
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
        ratio(evidence, one, bounds, |ratio| -ratio.ln(), &mut rarer);
    }
    let below = [[0.1, 0.5], [0.5, 1.0], [1.0, 1.5]];
    let middle = [[0.5, 1.0]];
    let far = [[0.5, 1.0], [1.0, 1.5], [1.5, 2.0]];
    vec![
        linear(evidence, &all).judge(LINEAR_AT_ZERO, DATA, || {
            "pressures of the same surfaces on meshes of 32 to 128 nodes to the shortest wavelength, each of \
             twice as many nodes as the last, at a load of 0.02 or 0.1 in bins of 0.025: how the density on \
             one mesh begins is the mesh's"
                .to_owned()
        }),
        over_theory(&MODERATE, &below).judge(AS_PERSSON, DATA, lacks(&MODERATE)),
        over_theory(&TO_HEAVY, &middle).judge(MIDDLE_AS_PERSSON, DATA, lacks(&TO_HEAVY)),
        rarer.judge(FEWER_HIGH, DATA, lacks(&TO_HEAVY[..4])),
        over_theory(&[0.8], &far).judge(HEAVY_AS_PERSSON, DATA, lacks(&[0.8])),
    ]
}

/// The distributions under the nearest of some loads, each with each of some bounds.
fn with_bounds<'a>(
    all: &'a [Pressures],
    loads: &'a [f64],
    bounds: &'a [[f64; 2]],
) -> impl Iterator<Item = (&'a Pressures, &'a [f64; 2])> {
    let own = under_loads(all, loads).into_iter();
    own.flat_map(move |one| bounds.iter().map(move |bounds| (one, bounds)))
}

/// Of each spectrum the distributions under loads within a tenth of the nearest of some.
fn under_loads<'a>(all: &'a [Pressures], loads: &[f64]) -> Vec<&'a Pressures> {
    let is_near = |load: f64| loads.iter().any(|asked| (load / asked - 1.0).abs() < 0.1);
    all.iter().filter(|one| is_near(one.load)).collect()
}

fn label(evidence: &Evidence, one: &Pressures) -> String {
    evidence.name_under(&one.spectrum, one.load)
}

/// A function of the mean share between two bounds over that in Persson's theory.
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
    let theory = persson::share_between(one.load, low, high);
    quantities.add(label, &[shares.len()], |weights: &Weights| {
        let share = weights.mean(&shares);
        (share > 0.0).then(|| quantity(share / theory))
    });
}

/// Collects the exponents with which the share of the lightest pressures falls with the mesh step.
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
            (fine > 0.0).then(|| (coarse / fine).log2())
        });
    }
    quantities
}
