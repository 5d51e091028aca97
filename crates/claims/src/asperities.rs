//! Claims on asperity models with and without interaction, compared with the boundary-element
//! solution.
//!
//! The area of a model is the sum of the areas of its Hertzian contact ellipses. It is compared
//! with the area in the boundary-element solution of the same surfaces, corrected for the mesh with
//! the estimator `2017`.

use crate::evidence::{AreaCurves, Evidence, PerLoad};
use crate::quantities::{Quantities, needs};
use crate::{Claim, Expectation, Origin, Statement};
use asperity_stages::columns::{ASPERITY_AREA_FRACTION, MEAN_GAP, OVERLAPPING_SHARE};
use asperity_stages::correct::OF_2017;
use asperity_statistics::intervals::Weights;

const LESS_AREA: Statement = Statement {
    name: "non-interacting-asperities-have-less-area",
    origin: Origin::Paper,
    text: "“Without interaction, for a given separation, the force appears to be overestimated \
           compared to the case of interacting asperities. The trend is inverse for the contact \
           area, that is smaller for non-interacting asperities.”",
    source: "section 5.2.3",
    quantity: "ln of the ratio of the mean solved area, which includes all interaction, to the \
               mean area of the model without interaction under the same load, at loads 0.001, \
               0.004, 0.016, 0.064",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any difference counts; the model counts the common area \
             of overlapping ellipses twice, so the area of their union is even smaller",
    figure: None,
};

const INTERACTION_ADDS: Statement = Statement {
    name: "interaction-adds-area-to-asperities",
    origin: Origin::Ours,
    text: "Among asperity models, too, the area under a given load is smaller without interaction.",
    source: "see non-interacting-asperities-have-less-area",
    quantity: "ln of the ratio of the mean areas of the models with `interaction = \"explicit\"` \
               and without interaction, at loads 0.001, 0.004, 0.016, 0.064",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any difference counts; both models count the common \
             area of overlapping ellipses twice",
    figure: None,
};

const TOO_MUCH_AREA: Statement = Statement {
    name: "asperities-without-interaction-have-too-much-area",
    origin: Origin::Ours,
    text: "Asperities without interaction have more contact area than the solution under the same \
           load.",
    source: "expected from √(2π) y of Bush, Gibson & Thomas, which exceeds solved areas",
    quantity: "ln of the ratio of the mean area of the model to the mean solved area, at loads \
               0.001, 0.004, 0.016, 0.064",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any difference counts; it is opposite to the paper's \
             sentence on interaction; the model uses the summits of the solved surfaces, not those \
             of a random field",
    figure: None,
};

const AGREES: Statement = Statement {
    name: "interaction-brings-asperities-to-the-solution",
    origin: Origin::Ours,
    text: "Under light loads, asperities that displace each other elastically have the area of the \
           solution.",
    source: "Ciavarella, Delfine & Demelio, J. Mech. Phys. Solids 54 (2006) 2569, correct asperity \
             models by the mean displacement; here each force displaces all summits",
    quantity: "ratio of the mean area of the model with `interaction = \"explicit\"` to the mean \
               solved area, at loads 0.001, 0.004, 0.016",
    expected: Expectation::Within(0.95, 1.05),
    reason: "±5 %; the correction for the mesh is known to 15 %, which is 1 to 2 % of these areas",
    figure: None,
};

const UP_TO: Statement = Statement {
    name: "interacting-asperities-agree-up-to-0.01",
    origin: Origin::Ours,
    text: "The area of asperities that displace each other agrees with the solution within 10 % up \
           to the load 0.01.",
    source: "see interaction-brings-asperities-to-the-solution",
    quantity: "load up to which the mean area of the model with `interaction = \"explicit\"` \
               deviates by at most 10 % from the mean solved area, between the lightest and the \
               heaviest load of the study",
    expected: Expectation::Within(0.01, f64::INFINITY),
    reason: "about 2 % of the area is in contact at this load; the quantity is the end of the \
             range of agreement",
    figure: None,
};

const GAP_MORE_THAN_AREA: Statement = Statement {
    name: "interaction-of-asperities-is-in-the-gap",
    origin: Origin::Ours,
    text: "Interaction changes the mean gap of asperity models more than it changes their area.",
    source: "under a given load, a uniform displacement moves the reference plane and changes no \
             contact",
    quantity: "absolute relative change of the mean gap from `interaction = \"explicit\"` to no \
               interaction, minus that of the mean area, at loads 0.032, 0.064, 0.128",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any difference counts",
    figure: None,
};

const STAY_APART: Statement = Statement {
    name: "asperities-stay-apart-under-light-loads",
    origin: Origin::Ours,
    text: "Up to the load 0.004, less than 5 % of the area of interacting asperities is in \
           overlapping contacts.",
    source: "asperity models assume separate contacts",
    quantity: "mean fraction of the area of the ellipses that is in overlapping ellipses, for \
               `interaction = \"explicit\"`, at loads 0.001, 0.002, 0.004",
    expected: Expectation::Within(f64::NEG_INFINITY, 0.05),
    reason: "if more than 5 % of the area overlaps, the model no longer describes the surface",
    figure: None,
};

const DATA: &str = "asperity models and area corrected as in 2017";
const MODELS: &str = "asperity models";
const NONE: &str = "none";
const EXPLICIT: &str = "explicit";

pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    let [none, explicit] = [NONE, EXPLICIT].map(|interaction| {
        evidence.asperities_along_loads(interaction, ASPERITY_AREA_FRACTION.name)
    });
    let lacks_models = |interaction: &'static str| {
        move || {
            format!(
                "a `solve` stage with `method = \"asperities\"` and `interaction = \
                 \"{interaction}\"`"
            )
        }
    };
    let lacks = |models: &[PerLoad], interaction: &'static str, loads: &'static [f64]| {
        let is_there = !models.is_empty();
        move || if is_there { needs_beside(evidence, loads) } else { lacks_models(interaction)() }
    };
    let solved = evidence.under(OF_2017);
    vec![
        of_area(evidence, &none, &solved, &MODEL_LOADS, |ratio| -libm::log(ratio)).judge(
            LESS_AREA,
            DATA,
            lacks(&none, NONE, &MODEL_LOADS),
        ),
        added(evidence, &none, &explicit).judge(INTERACTION_ADDS, MODELS, || {
            "`solve` stages with `method = \"asperities\"`, `interaction = [\"none\", \
             \"explicit\"]`, and a load at 0.001, 0.004, 0.016 or 0.064"
                .to_owned()
        }),
        of_area(evidence, &none, &solved, &MODEL_LOADS, libm::log).judge(
            TOO_MUCH_AREA,
            DATA,
            lacks(&none, NONE, &MODEL_LOADS),
        ),
        of_area(evidence, &explicit, &solved, &LIGHT, |ratio| ratio).judge(
            AGREES,
            DATA,
            lacks(&explicit, EXPLICIT, &LIGHT),
        ),
        up_to(evidence, &explicit, &solved).judge(UP_TO, DATA, lacks(&explicit, EXPLICIT, &[])),
        in_the_gap(evidence, &none, &explicit).judge(GAP_MORE_THAN_AREA, MODELS, || {
            "`solve` stages with `method = \"asperities\"`, `interaction = [\"none\", \
             \"explicit\"]`, and a load at 0.032, 0.064 or 0.128"
                .to_owned()
        }),
        stay_apart(evidence).judge(STAY_APART, MODELS, || {
            if explicit.is_empty() {
                lacks_models(EXPLICIT)()
            } else {
                "a load at 0.001, 0.002 or 0.004".to_owned()
            }
        }),
    ]
}

/// Loads at which models are compared, from first contact to considerable interaction of the
/// asperities, in units of E* × rms slope.
const MODEL_LOADS: [f64; 4] = [0.001, 0.004, 0.016, 0.064];
/// Loads with few contacts, in units of E* × rms slope.
const LIGHT: [f64; 3] = [0.001, 0.004, 0.016];

fn needs_beside(evidence: &Evidence, loads: &[f64]) -> String {
    if evidence.under(OF_2017).is_empty() {
        needs(evidence, OF_2017, &[], "")
    } else {
        let loads: Vec<String> = loads.iter().map(f64::to_string).collect();
        let at = match loads.as_slice() {
            [] => String::new(),
            loads => format!(", at {}", loads.join(" or ")),
        };
        format!(
            "the same surfaces in a boundary-element solution and in an asperity model, under the \
             same loads{at}"
        )
    }
}

/// Pairs each model with the boundary-element solution of the same surfaces. Omits models without
/// such a solution.
fn with_solutions<'a>(
    models: &'a [PerLoad],
    solved: &[&'a AreaCurves],
) -> Vec<(&'a PerLoad, &'a AreaCurves)> {
    let own = |model: &'a PerLoad| {
        let is_own = |solved: &&&AreaCurves| {
            solved.spectrum == model.spectrum && solved.surfaces() == model.surfaces()
        };
        Some((model, *solved.iter().find(is_own)?))
    };
    models.iter().filter_map(own).collect()
}

/// Returns the mean area of a model divided by the mean area of the boundary-element solution, at
/// the load with this index in the model. Returns `None` if the solution does not have this load.
fn ratio(model: &PerLoad, solved: &AreaCurves, index: usize, weights: &Weights) -> Option<f64> {
    let load = model.loads[index];
    let other = solved.at(load).filter(|&other| is_near(solved.loads[other], load))?;
    Some(weights.mean(&model.values[index]) / weights.mean(&solved.areas[other]))
}

/// Returns true if two loads agree to three digits, to which geometrically spaced loads are
/// rounded.
fn is_near(one: f64, other: f64) -> bool {
    (one / other - 1.0).abs() < 1e-3
}

/// Computes `quantity`(ā_model/ā_solved) for each spectrum and each of `loads`, with area fractions
/// averaged over the surfaces.
fn of_area(
    evidence: &Evidence,
    models: &[PerLoad],
    solved: &[&AreaCurves],
    loads: &[f64],
    quantity: fn(f64) -> f64,
) -> Quantities {
    let mut quantities = Quantities::default();
    for (model, solved) in with_solutions(models, solved) {
        for index in loads.iter().filter_map(|&load| model.at(load)) {
            if ratio(model, solved, index, &Weights::ALL).is_none() {
                continue;
            }
            let label = label(evidence, model, index);
            quantities.add(label, &[model.surfaces()], |weights| {
                ratio(model, solved, index, weights).map(quantity)
            });
        }
    }
    quantities
}

/// Computes ln(ā_explicit/ā_none) for each spectrum and each of [`MODEL_LOADS`]: the ratio of the
/// mean areas of the models with and without interaction of the asperities.
fn added(evidence: &Evidence, none: &[PerLoad], explicit: &[PerLoad]) -> Quantities {
    let mut quantities = Quantities::default();
    for without in none {
        let Some(with) = of_same_surfaces(explicit, without) else {
            continue;
        };
        let [with, without] = at_common_loads([with, without]);
        for index in MODEL_LOADS.iter().filter_map(|&load| without.at(load)) {
            let label = label(evidence, &without, index);
            quantities.add(label, &[without.surfaces()], |weights| {
                let mean = |one: &PerLoad| weights.mean(&one.values[index]);
                Some(libm::log(mean(&with) / mean(&without)))
            });
        }
    }
    quantities
}

/// Returns the model with the same spectrum and surfaces as another model.
fn of_same_surfaces<'a>(models: &'a [PerLoad], other: &PerLoad) -> Option<&'a PerLoad> {
    models.iter().find(|one| one.spectrum == other.spectrum && one.surfaces() == other.surfaces())
}

/// Returns the models at the loads that all of them have. A model lacks a load under which it did
/// not converge for some surface.
fn at_common_loads<const N: usize>(models: [&PerLoad; N]) -> [PerLoad; N] {
    let mut common = models[0].loads.clone();
    common.retain(|load| models.iter().all(|model| model.loads.contains(load)));
    models.map(|model| model.at_loads(&common))
}

/// Returns a label such as `k_lower 2, k_upper 16, load 0.0040`.
fn label(evidence: &Evidence, model: &PerLoad, index: usize) -> String {
    let name = evidence.name(&model.spectrum);
    // Three decimals would not distinguish the lightest loads.
    format!("{name}, load {:.4}", model.loads[index])
}

fn up_to(evidence: &Evidence, models: &[PerLoad], solved: &[&AreaCurves]) -> Quantities {
    let mut quantities = Quantities::default();
    for (model, solved) in with_solutions(models, solved) {
        let indices = 0..model.loads.len();
        let common: Vec<usize> =
            indices.filter(|&index| ratio(model, solved, index, &Weights::ALL).is_some()).collect();
        if common.len() < 2 {
            continue;
        }
        let label = evidence.name(&model.spectrum);
        quantities.add(label, &[model.surfaces()], |weights| {
            let points = common.iter().map(|&index| {
                let deviation = libm::log(ratio(model, solved, index, weights)?).abs();
                Some((model.loads[index], deviation))
            });
            Some(first_beyond(&points.collect::<Option<Vec<_>>>()?, libm::log(1.1)))
        });
    }
    quantities
}

/// Returns the smallest load at which the deviation exceeds `limit`, interpolated linearly in the
/// logarithm of the load. `points` are pairs (load, deviation). Returns the first load if the
/// deviation exceeds `limit` there, and the last load if the deviation never exceeds `limit`.
fn first_beyond(points: &[(f64, f64)], limit: f64) -> f64 {
    match points.iter().position(|(_, deviation)| *deviation > limit) {
        Some(0) => points[0].0,
        None => points[points.len() - 1].0,
        Some(index) => {
            let [(load, within), (next, beyond)] = [points[index - 1], points[index]];
            let share = (limit - within) / (beyond - within);
            load * libm::pow(next / load, share)
        }
    }
}

fn in_the_gap(evidence: &Evidence, none: &[PerLoad], explicit: &[PerLoad]) -> Quantities {
    let gaps = |interaction| evidence.asperities_along_loads(interaction, MEAN_GAP.name);
    let (gaps_none, gaps_explicit) = (gaps(NONE), gaps(EXPLICIT));
    let mut quantities = Quantities::default();
    for area in none {
        let own = |all| of_same_surfaces(all, area);
        let (Some(other), Some(gap), Some(other_gap)) =
            (own(explicit), own(&gaps_none), own(&gaps_explicit))
        else {
            continue;
        };
        let [area, other, gap, other_gap] = at_common_loads([area, other, gap, other_gap]);
        for index in [0.032, 0.064, 0.128].into_iter().filter_map(|load| area.at(load)) {
            let label = label(evidence, &area, index);
            quantities.add(label, &[area.surfaces()], |weights| {
                let mean = |one: &PerLoad| weights.mean(&one.values[index]);
                let change = |without, with| (mean(without) / mean(with) - 1.0).abs();
                Some(change(&gap, &other_gap) - change(&area, &other))
            });
        }
    }
    quantities
}

fn stay_apart(evidence: &Evidence) -> Quantities {
    let mut quantities = Quantities::default();
    for shares in evidence.asperities_along_loads(EXPLICIT, OVERLAPPING_SHARE.name) {
        for index in [0.001, 0.002, 0.004].into_iter().filter_map(|load| shares.at(load)) {
            let label = label(evidence, &shares, index);
            quantities.add(label, &[shares.surfaces()], |weights| {
                Some(weights.mean(&shares.values[index]))
            });
        }
    }
    quantities
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::Spectrum;

    #[test]
    fn models_are_compared_under_the_loads_that_both_have() {
        let model = |loads: &[f64]| PerLoad {
            spectrum: Spectrum { hurst: 0.8, k_lower: 4, k_rolloff: 4, k_upper: 32, nodes: 256 },
            loads: loads.to_vec(),
            values: loads.iter().map(|load| vec![*load, 2.0 * load]).collect(),
        };
        let (all, some) = (model(&[0.1, 0.2, 0.3]), model(&[0.2, 0.3, 0.4]));
        let common = model(&[0.2, 0.3]);
        assert_eq!(at_common_loads([&all, &some]), [common.clone(), common]);
    }

    #[test]
    fn a_deviation_passes_its_limit_between_two_loads() {
        let points = [(0.001, 0.0), (0.01, 0.1), (0.1, 0.2)];
        assert!((first_beyond(&points, 0.15) - 0.1_f64.powf(1.5)).abs() < 1e-15);
        assert_eq!(first_beyond(&points, -0.1), 0.001);
        assert_eq!(first_beyond(&points, 0.3), 0.1);
    }
}
