//! Claims on contact at light load: what cutoffs and Nayak's parameter do to the area.

use super::evidence::{COUNTED, Ensemble, Evidence, OF_2015, OF_2017, Spectrum};
use super::intervals::Weights;
use super::quantities::{Quantities, cutoffs, data, grid, grouping, needs, neighbours, under};
use super::{Claim, Expectation};
use crate::contact::law::KAPPA_BGT;
use crate::contact::models::AsperityModel;
use crate::contact::models::asperities::Asperities;
use crate::contact::nayak::Continuum;
use crate::contact::persson;

/// Loads that stand for light contact.
const LIGHT: [f64; 3] = [0.012, 0.024, 0.06];
/// Loads from light contact to where four fifths of the surface touch.
const UP_TO_FOUR_FIFTHS: [f64; 6] = [0.012, 0.024, 0.06, 0.14, 0.32, 0.52];
/// Ends of three equal stretches of light load.
const STRETCHES: [f64; 3] = [0.02, 0.04, 0.06];

/// The claims, in the order of the paper.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    let mut claims = Vec::new();
    for correction in [COUNTED, OF_2017] {
        claims.push(area_grows_with_k_lower(evidence, correction));
        claims.push(area_falls_with_k_upper(evidence, correction));
        claims.push(effect_of_alpha_is_weaker(evidence, correction));
        claims.push(above_persson(evidence, correction));
        claims.push(below_the_asymptote(evidence, correction));
        claims.push(slope_decreases(evidence, correction));
        claims.push(slope_is_convex(evidence, correction));
    }
    claims.push(area_at_the_end(evidence));
    claims.push(groups_by(evidence, COUNTED));
    claims.push(groups_by(evidence, OF_2015));
    claims.push(groups_by(evidence, OF_2017));
    claims.push(secant_grows(evidence, OF_2015));
    claims.push(secant_grows(evidence, OF_2017));
    claims
}

fn area_grows_with_k_lower(evidence: &Evidence, correction: &str) -> Claim {
    let ensembles = evidence.under(correction);
    let mut quantities = Quantities::default();
    for pair in neighbours(&ensembles, |s| s.k_lower, |s| s.k_upper) {
        for load in UP_TO_FOUR_FIFTHS {
            add_ratio(&mut quantities, pair, load, "k_lower", |s| s.k_lower, 1.0);
        }
    }
    quantities.claim(
        "area-grows-with-k-lower",
        "At given k_upper and load, surfaces of greater k_lower have more contact, up to 80 % of \
         the area (relative difference between neighbouring k_lower).",
        data(correction),
        Expectation::Positive,
        &needs(correction, "spectra that differ in `k_lower` alone"),
    )
}

fn area_falls_with_k_upper(evidence: &Evidence, correction: &str) -> Claim {
    let ensembles = evidence.under(correction);
    let mut quantities = Quantities::default();
    for pair in neighbours(&ensembles, |s| s.k_upper, |s| s.k_lower) {
        for load in LIGHT {
            add_ratio(&mut quantities, pair, load, "k_upper", |s| s.k_upper, -1.0);
        }
    }
    quantities.claim(
        "area-falls-with-alpha",
        "At given k_lower and light load, greater Nayak's parameter α, from greater k_upper, makes \
         the area smaller (relative fall between neighbouring k_upper).",
        data(correction),
        Expectation::Positive,
        &needs(correction, "spectra that differ in `k_upper` alone"),
    )
}

/// Adds ± ln of the ratio of two areas, as long as less than four fifths touch.
fn add_ratio<'a>(
    quantities: &mut Quantities<'a>,
    [lesser, greater]: [&'a Ensemble; 2],
    load: f64,
    name: &str,
    varied: fn(&Spectrum) -> i64,
    sign: f64,
) {
    let (Some(one), Some(other)) = (lesser.at(load), greater.at(load)) else {
        return;
    };
    if lesser.mean(one).max(greater.mean(other)) > 0.8 {
        return;
    }
    let label = format!(
        "{}, {name} {} over it, {}",
        cutoffs(&lesser.spectrum),
        varied(&greater.spectrum),
        under(greater.loads[other])
    );
    let surfaces = [lesser.surfaces(), greater.surfaces()];
    quantities.add(label, &surfaces, move |weights| {
        Some(sign * ln_ratio(lesser, greater, one, other, weights))
    });
}

fn ln_ratio(
    lesser: &Ensemble,
    greater: &Ensemble,
    one: usize,
    other: usize,
    weights: &Weights,
) -> f64 {
    (weights.mean(&greater.areas[other]) / weights.mean(&lesser.areas[one])).ln()
}

fn effect_of_alpha_is_weaker(evidence: &Evidence, correction: &str) -> Claim {
    let ensembles = evidence.under(correction);
    let mut quantities = Quantities::default();
    for [lesser, greater] in neighbours(&ensembles, |s| s.k_upper, |s| s.k_lower) {
        for load in LIGHT {
            let (Some(one), Some(other)) = (lesser.at(load), greater.at(load)) else {
                continue;
            };
            let model = bgt_area(&greater.spectrum, greater.loads[other])
                .zip(bgt_area(&lesser.spectrum, lesser.loads[one]));
            let Some((of_greater, of_lesser)) = model else {
                continue;
            };
            let modelled = (of_greater / of_lesser).ln();
            let label = format!(
                "{}, k_upper {} over it, {}",
                cutoffs(&lesser.spectrum),
                greater.spectrum.k_upper,
                under(greater.loads[other])
            );
            let surfaces = [lesser.surfaces(), greater.surfaces()];
            quantities.add(label, &surfaces, move |weights| {
                Some(ln_ratio(lesser, greater, one, other, weights) - modelled)
            });
        }
    }
    quantities.claim(
        "effect-of-alpha-is-weaker-than-in-bgt",
        "Nayak's parameter α lowers the area less than the model of Bush, Gibson & Thomas has it \
         (relative fall of the model less that found).",
        data(correction),
        Expectation::Positive,
        &needs(correction, "spectra that differ in `k_upper` alone"),
    )
}

fn bgt_area(spectrum: &Spectrum, load: f64) -> Option<f64> {
    let continuum = Continuum {
        hurst: spectrum.hurst,
        plateau: spectrum.k_lower as f64 / spectrum.k_rolloff as f64,
        magnification: spectrum.k_upper as f64 / spectrum.k_rolloff as f64,
    };
    let model = Asperities::new(AsperityModel::BushGibsonThomas, continuum.nayak()).ok()?;
    model.at_load(load).map(|contact| contact.area)
}

fn above_persson(evidence: &Evidence, correction: &str) -> Claim {
    compared(evidence, correction, |area, load| {
        area / persson::area(load) - 1.0
    })
    .claim(
        "area-above-persson",
        "At light load the area is greater than in Persson's theory (relative difference).",
        data(correction),
        Expectation::Positive,
        &needs(correction, "loads up to 0.06"),
    )
}

fn below_the_asymptote(evidence: &Evidence, correction: &str) -> Claim {
    compared(evidence, correction, |area, load| {
        1.0 - area / (KAPPA_BGT * load)
    })
    .claim(
        "area-below-bgt-asymptote",
        "At light load the area is less than √(2π) times the load, the asymptote of asperity models \
         (relative difference).",
        data(correction),
        Expectation::Positive,
        &needs(correction, "loads up to 0.06"),
    )
}

fn compared<'a>(
    evidence: &'a Evidence,
    correction: &str,
    difference: fn(f64, f64) -> f64,
) -> Quantities<'a> {
    let mut quantities = Quantities::default();
    for ensemble in evidence.under(correction) {
        for place in LIGHT.into_iter().filter_map(|load| ensemble.at(load)) {
            let load = ensemble.loads[place];
            let label = format!("{}, {}", cutoffs(&ensemble.spectrum), under(load));
            quantities.add(label, &[ensemble.surfaces()], move |weights| {
                Some(difference(weights.mean(&ensemble.areas[place]), load))
            });
        }
    }
    quantities
}

fn slope_decreases(evidence: &Evidence, correction: &str) -> Claim {
    let mut quantities = Quantities::default();
    for (ensemble, places) in with_stretches(evidence, correction) {
        for step in 0..2 {
            let label = format!(
                "{}, around {}",
                cutoffs(&ensemble.spectrum),
                under(ensemble.loads[places[step]])
            );
            quantities.add(label, &[ensemble.surfaces()], move |weights| {
                let slopes = slopes(ensemble, places, weights);
                Some(slopes[step] - slopes[step + 1])
            });
        }
    }
    quantities.claim(
        "slope-decreases",
        "The slope da/dy decreases with the load (fall between thirds of the loads up to 0.06).",
        data(correction),
        Expectation::Positive,
        &needs(correction, "loads at 0.02, 0.04 and 0.06"),
    )
}

fn slope_is_convex(evidence: &Evidence, correction: &str) -> Claim {
    let mut quantities = Quantities::default();
    for (ensemble, places) in with_stretches(evidence, correction) {
        let label = cutoffs(&ensemble.spectrum);
        quantities.add(label, &[ensemble.surfaces()], move |weights| {
            let slopes = slopes(ensemble, places, weights);
            Some(slopes[0] - 2.0 * slopes[1] + slopes[2])
        });
    }
    quantities.claim(
        "slope-is-convex",
        "The slope da/dy is a convex function of the load (second difference of its thirds up to \
         0.06).",
        data(correction),
        Expectation::Positive,
        &needs(correction, "loads at 0.02, 0.04 and 0.06"),
    )
}

fn with_stretches<'a>(evidence: &'a Evidence, correction: &str) -> Vec<(&'a Ensemble, [usize; 3])> {
    let ensembles = evidence.under(correction).into_iter();
    let found = ensembles.filter_map(|ensemble| {
        let places: Option<Vec<usize>> = STRETCHES.iter().map(|&load| ensemble.at(load)).collect();
        let places: [usize; 3] = places?.try_into().ok()?;
        places
            .is_sorted_by(|a, b| a < b)
            .then_some((ensemble, places))
    });
    found.collect()
}

/// Mean slopes from nothing to the first place, and between the places.
fn slopes(ensemble: &Ensemble, places: [usize; 3], weights: &Weights) -> [f64; 3] {
    let (mut load_before, mut area_before) = (0.0, 0.0);
    places.map(|place| {
        let (load, area) = (ensemble.loads[place], weights.mean(&ensemble.areas[place]));
        let slope = (area - area_before) / (load - load_before);
        (load_before, area_before) = (load, area);
        slope
    })
}

fn area_at_the_end(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    for ensemble in evidence.under(COUNTED) {
        if let Some(place) = ensemble.at(0.06) {
            let label = cutoffs(&ensemble.spectrum);
            quantities.add(label, &[ensemble.surfaces()], move |weights| {
                Some(weights.mean(&ensemble.areas[place]))
            });
        }
    }
    quantities.claim(
        "area-at-0.06",
        "A mean pressure of 0.06 E* × rms slope brings 10 to 14 % of the surface into contact (the \
         paper prints 0.06 E*).",
        data(COUNTED),
        Expectation::Within(0.095, 0.145),
        &needs(COUNTED, "a load at 0.06"),
    )
}

fn groups_by(evidence: &Evidence, correction: &str) -> Claim {
    let (name, says, sign) = match correction {
        OF_2015 => (
            "corrected-area-groups-by-k-upper",
            "Corrected by π/8, the curves group by k_upper (spread between k_upper less that \
             between k_lower, relative to the area).",
            -1.0,
        ),
        OF_2017 => (
            "groups-of-2015-are-of-the-correction",
            "Corrected as in 2017, the curves group by k_lower still: the groups by k_upper are of \
             the correction by π/8 (spread between k_lower less that between k_upper).",
            1.0,
        ),
        _ => (
            "area-groups-by-k-lower",
            "The counted area groups by k_lower, up to 80 % of the area (spread between k_lower \
             less that between k_upper, relative to the area).",
            1.0,
        ),
    };
    let loads: &[f64] = match correction {
        COUNTED => &UP_TO_FOUR_FIFTHS,
        _ => &LIGHT,
    };
    let mut quantities = Quantities::default();
    if let Some(rows) = grid(&evidence.under(correction)) {
        let surfaces: Vec<usize> = rows.iter().flatten().map(|one| one.surfaces()).collect();
        for &load in loads {
            let below = |one: &&Ensemble| one.at(load).is_some_and(|at| one.mean(at) < 0.8);
            if rows.iter().flatten().all(below) {
                let rows = rows.clone();
                quantities.add(under(load), &surfaces, move |weights| {
                    Some(sign * grouping(&rows, load, weights)?)
                });
            }
        }
    }
    let needs = needs(correction, "a grid of `k_lower` and `k_upper`");
    quantities.claim(name, says, data(correction), Expectation::Positive, &needs)
}

fn secant_grows(evidence: &Evidence, correction: &str) -> Claim {
    let ensembles = evidence.under(correction);
    let most = ensembles.iter().map(|one| one.spectrum.k_lower).max();
    let mut quantities = Quantities::default();
    for ensemble in ensembles {
        let (Some(first), Some(last)) = (ensemble.at(0.012), ensemble.at(0.06)) else {
            continue;
        };
        if Some(ensemble.spectrum.k_lower) == most && first < last {
            let label = cutoffs(&ensemble.spectrum);
            quantities.add(label, &[ensemble.surfaces()], move |weights| {
                let secant = |at: usize| weights.mean(&ensemble.areas[at]) / ensemble.loads[at];
                Some(secant(last) / secant(first) - 1.0)
            });
        }
    }
    quantities.claim(
        "corrected-secant-grows",
        "For the greatest k_lower, the secant a/y of the corrected area grows with the load \
         (relative growth from 0.012 to 0.06).",
        data(correction),
        Expectation::Positive,
        &needs(correction, "loads from 0.012 to 0.06"),
    )
}
