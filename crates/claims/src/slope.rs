//! Claims on the slope of the area against the load (sections 5.2.2 and 6), and on the contact
//! evolution law and its κ (sections 5.2.1, 9.5 and appendix C).

use crate::evidence::{AreaCurves, Evidence};
use crate::quantities::{Cutoff, Quantities, Step, data, families, needs, surfaces};
use crate::{Claim, Expectation, Origin, Statement};
use asperity_contact::theory::law::KAPPA_BGT;
use asperity_contact::theory::persson;
use asperity_stages::correct::{AS_COUNTED, OF_2015, OF_2017};
use asperity_statistics::Window;
use asperity_statistics::evolution::{EvolutionProblem, Kappa, Quantity};
use asperity_statistics::intervals::Weights;
use asperity_statistics::pressure_growth::PressureGrowthProblem;

/// Upper ends of the intervals 0–0.02, 0.02–0.04 and 0.04–0.06 of the load, in units of E* × rms
/// slope.
const STRETCHES: [f64; 3] = [0.02, 0.04, 0.06];
/// Loads that, together with zero load, define the third divided difference of the area. They are
/// closer together where the curvature is larger.
const SPREAD: [f64; 3] = [0.005, 0.02, 0.06];

const DECREASES: Statement = Statement {
    name: "slope-decreases",
    origin: Origin::Paper,
    text: "“In all obtained curves, the slope of the contact area is a decreasing function of the \
           applied pressure”",
    source: "section 5.2.2, fig. 6",
    quantity: "decrease of the mean slope ΔA/Δy from each third of the loads up to 0.06 to the \
               next third",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any decrease counts",
    figure: Some("slope"),
};

const DECREASES_CORRECTED: Statement = Statement {
    name: "corrected-slope-decreases",
    origin: Origin::Ours,
    text: "The slope of the area corrected as in 2017 decreases, too.",
    source: "see slope-decreases",
    ..DECREASES
};

const CONVEX: Statement = Statement {
    name: "slope-is-convex",
    origin: Origin::Paper,
    text: "“all curves are convex in the considered range (up to 10–14 % of the contact area \
           fraction)”, meaning their slopes; “a decreasing convex function”",
    source: "sections 5.2.2 and 9.6, fig. 6",
    quantity: "third divided difference of the mean area at loads 0, 0.005, 0.02, 0.06, which is a \
               sixth of a mean third derivative",
    expected: Expectation::Positive,
    reason: "equal intervals would miss the steep start; the test is weaker than the paper's claim \
             of convexity everywhere",
    figure: Some("slope"),
};

const CONVEX_CORRECTED: Statement = Statement {
    name: "corrected-slope-is-convex",
    origin: Origin::Ours,
    text: "The slope of the area corrected as in 2017 is convex, too.",
    source: "see slope-is-convex",
    ..CONVEX
};

const CROSSES_PERSSON: Statement = Statement {
    name: "slope-crosses-perssons-near-half",
    origin: Origin::Paper,
    text: "“Up to about 50 % of contacting area, the numerically predicted slope is steeper than \
           this predicted by the Persson's model and vice versa for greater contact area \
           fractions.”",
    source: "section 6, inset of fig. 9",
    quantity: "mean area at which the slope ΔA/Δy between neighbouring loads falls below Persson's \
               slope between the same loads",
    expected: Expectation::Within(0.4, 0.6),
    reason: "“about 50 %” is read as 40 to 60 %",
    figure: Some("area-full"),
};

pub fn of_the_slope(evidence: &Evidence) -> Vec<Claim> {
    vec![
        decreases(evidence, AS_COUNTED, DECREASES),
        decreases(evidence, OF_2017, DECREASES_CORRECTED),
        is_convex(evidence, AS_COUNTED, CONVEX),
        is_convex(evidence, OF_2017, CONVEX_CORRECTED),
        crosses_persson(evidence),
    ]
}

fn decreases(evidence: &Evidence, correction: &str, statement: Statement) -> Claim {
    let mut quantities = Quantities::default();
    for (ensemble, indices) in with_loads(evidence, correction, STRETCHES) {
        for third in 0..2 {
            let load = ensemble.loads[indices[third]];
            let label = format!("{}, around load {load:.3}", evidence.name(&ensemble.spectrum));
            quantities.add(label, &[ensemble.surfaces()], |weights| {
                let slopes = divided(&curve(ensemble, indices, weights));
                Some(slopes[third] - slopes[third + 1])
            });
        }
    }
    quantities.judge(statement, data(correction), || all_of(evidence, correction, &STRETCHES))
}

fn is_convex(evidence: &Evidence, correction: &str, statement: Statement) -> Claim {
    let mut quantities = Quantities::default();
    for (ensemble, indices) in with_loads(evidence, correction, SPREAD) {
        let label = evidence.name(&ensemble.spectrum);
        quantities.add(label, &[ensemble.surfaces()], |weights| {
            Some(third_difference(&curve(ensemble, indices, weights)))
        });
    }
    quantities.judge(statement, data(correction), || all_of(evidence, correction, &SPREAD))
}

/// Returns the unmet requirement for a study that lacks one of these loads.
fn all_of(evidence: &Evidence, correction: &str, loads: &[f64]) -> String {
    let missing = loads.iter().find(|&&load| {
        let own = evidence.of_the_paper(correction);
        !own.iter().any(|ensemble| ensemble.at(load).is_some())
    });
    let missing = missing.map_or_else(Vec::new, |&load| vec![load]);
    needs(evidence, correction, &missing, "loads from first contact to 0.06")
}

/// Returns the ensembles that have these loads, with the indices of the loads.
fn with_loads<'a>(
    evidence: &'a Evidence,
    correction: &str,
    loads: [f64; 3],
) -> Vec<(&'a AreaCurves, [usize; 3])> {
    let ensembles = evidence.of_the_paper(correction).into_iter();
    let found = ensembles.filter_map(|ensemble| {
        let indices: Option<Vec<usize>> = loads.iter().map(|&load| ensemble.at(load)).collect();
        let indices: [usize; 3] = indices?.try_into().ok()?;
        let ascend = indices.is_sorted_by(|a, b| a < b);
        ascend.then_some((ensemble, indices))
    });
    found.collect()
}

/// Returns the points (load, mean area), starting with (0, 0).
fn curve(ensemble: &AreaCurves, indices: [usize; 3], weights: &Weights) -> [(f64, f64); 4] {
    let [a, b, c] =
        indices.map(|index| (ensemble.loads[index], weights.mean(&ensemble.areas[index])));
    [(0.0, 0.0), a, b, c]
}

/// Returns the first divided differences (a₂ − a₁)/(y₂ − y₁) of neighbouring points (y, a).
fn divided(points: &[(f64, f64); 4]) -> [f64; 3] {
    [0, 1, 2].map(|i| (points[i + 1].1 - points[i].1) / (points[i + 1].0 - points[i].0))
}

fn third_difference(points: &[(f64, f64); 4]) -> f64 {
    let first = divided(points);
    let second = [0, 1].map(|i| (first[i + 1] - first[i]) / (points[i + 2].0 - points[i].0));
    (second[1] - second[0]) / (points[3].0 - points[0].0)
}

fn crosses_persson(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    for ensemble in evidence.of_the_paper(AS_COUNTED) {
        if ensemble.loads.iter().all(|load| *load < 0.5) {
            continue;
        }
        let label = evidence.name(&ensemble.spectrum);
        quantities.add(label, &[ensemble.surfaces()], |weights| crossing(ensemble, weights));
    }
    quantities.judge(CROSSES_PERSSON, data(AS_COUNTED), || {
        needs(evidence, AS_COUNTED, &[0.5], "loads from first contact to two thirds of the area")
    })
}

/// Returns the mean area at which the slope falls below Persson's. Slopes are difference quotients
/// between neighbouring loads. The slope minus Persson's slope is interpolated linearly over the
/// area.
fn crossing(ensemble: &AreaCurves, weights: &Weights) -> Option<f64> {
    let mut before: Option<(f64, f64)> = None;
    for index in 1..ensemble.loads.len() {
        let [from, to] = [index - 1, index]
            .map(|index| (ensemble.loads[index], weights.mean(&ensemble.areas[index])));
        let area = 0.5 * (from.1 + to.1);
        // At light load the slopes of few surfaces scatter too much.
        if area < 0.2 {
            continue;
        }
        let excess = (to.1 - from.1) - (persson::area(to.0) - persson::area(from.0));
        let excess = excess / (to.0 - from.0);
        if let Some((area_before, excess_before)) = before
            && excess <= 0.0
            && excess_before > 0.0
        {
            let share = excess_before / (excess_before - excess);
            return Some(area_before + share * (area - area_before));
        }
        before = Some((area, excess));
    }
    None
}

const LEAST_CONVEX: Statement = Statement {
    name: "least-convex-kappa",
    origin: Origin::Paper,
    text: "“a lower boundary for this parameter for which the numerical data points can be fitted \
           appropriately [that is, convexly]: κ ⪆ 1.055 √(2π)”, “quite subjective”",
    source: "section 5.2.1, eq. (9), fig. 6",
    quantity: "smallest κ/√(2π) for which the slopes of the law, fitted for all spectra at loads \
               up to 0.06, are convex",
    expected: Expectation::Within(1.0, 1.11),
    reason: "±5 %, because the paper calls its number subjective",
    figure: Some("slope"),
};

const BOUND_FALLS: Statement = Statement {
    name: "least-convex-kappa-falls-with-the-correction",
    origin: Origin::Paper,
    text: "“this lower boundary can be significantly decreased, if one takes into account the \
           error estimation based on the perimeter”",
    source: "section 5.2.1, section 8",
    quantity: "ln of the ratio of the smallest κ with convex slopes (see least-convex-kappa) for \
               the counted area to that for the area corrected by π/8",
    expected: Expectation::Within(0.05, f64::INFINITY),
    reason: "“significantly” is read as at least 5 %",
    figure: Some("area-corrected"),
};

const DEPENDS_ON_K_LOWER: Statement = Statement {
    name: "least-convex-kappa-depends-on-k-lower",
    origin: Origin::Paper,
    text: "“the minimal value of κ is strongly dependent on the lower cutoff k_l”",
    source: "section 5.2.1",
    quantity: "ln of the ratio of the smallest κ with convex slopes (see least-convex-kappa) of \
               single spectra, for neighbouring k_lower (larger over smaller) at equal k_upper",
    expected: Expectation::Within(0.05, f64::INFINITY),
    reason: "“strongly” is read as at least 5 % for each step; the paper gives no direction, and \
             growth with k_lower is what studies find",
    figure: Some("slope"),
};

const EXPONENT: Statement = Statement {
    name: "exponent-of-pressure-growth",
    origin: Origin::Paper,
    text: "the mean contact pressure's derivative dp̄/dp₀ “decreases approximately as a power law \
           of the contact area”, β (A₀/A)^(1 − μ) with 0 < μ < 1",
    source: "appendix C, eq. (22) of the preprint, fig. 17; the lines of slopes −0.7 and −0.9 in \
             the figure hold for fewer of these spectra",
    quantity: "m = μ − 1 of the line through ln(Δp̄/Δp₀) against ln(A/A₀), between neighbouring \
               loads up to 0.06",
    expected: Expectation::Within(-1.0, 0.0),
    reason: "the printed range 0 < μ < 1. A fit of the contact evolution law cannot test it, \
             because the law exists for μ > 0 only",
    figure: Some("pressure-growth"),
};

const FITS_WELL: Statement = Statement {
    name: "law-fits-below-a-fifth",
    origin: Origin::Paper,
    text: "the contact evolution formula “fits well all our results at small contact area \
           fractions (< 20 %)”",
    source: "section 9.5, eq. (8)",
    quantity: "rms relative residual of the law with free κ, β and μ, fitted to the mean areas \
               below 20 %",
    expected: Expectation::Within(f64::NEG_INFINITY, 0.01),
    reason: "“well” is read as at most 1 %, the precision of a mean of fifty surfaces",
    figure: Some("area-light"),
};

/// Range of the loads that the paper calls light.
const LIGHT: Window = Window { from: 0.0, to: 0.06 };
/// Smallest number of light loads for a fit of the evolution law.
const ENOUGH_LOADS: usize = 10;
const MANY_LOADS: &str = "ten loads or more from first contact to 0.06";

pub fn of_kappa(evidence: &Evidence) -> Vec<Claim> {
    vec![
        least_convex(evidence),
        falls_with_correction(evidence),
        depends_on_k_lower(evidence),
        fits_well(evidence),
        exponent(evidence),
    ]
}

/// Returns the ensembles with enough light loads.
fn resolved<'a>(evidence: &'a Evidence, correction: &str) -> Vec<&'a AreaCurves> {
    let mut ensembles = evidence.of_the_paper(correction);
    let is_light = |load: &&f64| LIGHT.contains(**load);
    ensembles.retain(|one| one.loads.iter().filter(is_light).count() >= ENOUGH_LOADS);
    ensembles
}

/// Returns the smallest κ that makes the slopes of one ensemble convex.
fn own_kappa(ensemble: &AreaCurves, weights: &Weights) -> Option<f64> {
    let problem = EvolutionProblem::new(&ensemble.curves(weights)?, Quantity::Slope, LIGHT).ok()?;
    Some(problem.fit(Kappa::LeastConvex).ok()?.law.kappa)
}

/// Returns the smallest κ that makes the slopes of all these ensembles convex.
fn common_kappa(ensembles: &[&AreaCurves], weights: &Weights) -> Option<f64> {
    let own: Option<Vec<f64>> = ensembles.iter().map(|one| own_kappa(one, weights)).collect();
    own?.into_iter().reduce(f64::max)
}

fn least_convex(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    for family in families(&resolved(evidence, AS_COUNTED)) {
        let label = format!("all {} spectra", family.len());
        quantities.add(label, &surfaces(&family), |weights| {
            Some(common_kappa(&family, weights)? / KAPPA_BGT)
        });
    }
    quantities
        .judge(LEAST_CONVEX, data(AS_COUNTED), || needs(evidence, AS_COUNTED, &[0.06], MANY_LOADS))
}

fn falls_with_correction(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    let corrected = families(&resolved(evidence, OF_2015));
    for (counted, corrected) in families(&resolved(evidence, AS_COUNTED)).iter().zip(&corrected) {
        let label = format!("all {} spectra", counted.len());
        let surfaces = [surfaces(counted), surfaces(corrected)].concat();
        quantities.add(label, &surfaces, |weights| {
            let [counted, corrected] = [counted, corrected].map(|all| common_kappa(all, weights));
            Some(libm::log(counted? / corrected?))
        });
    }
    quantities.judge(BOUND_FALLS, "counted area and its correction by π/8", || {
        needs(evidence, OF_2015, &[0.06], MANY_LOADS)
    })
}

fn depends_on_k_lower(evidence: &Evidence) -> Claim {
    let ensembles = resolved(evidence, AS_COUNTED);
    let mut quantities = Quantities::default();
    for step in Step::all(&ensembles, Cutoff::Lower) {
        let label = step.name(evidence);
        quantities.add(label, &step.surfaces(), |weights| {
            let [lesser, greater] =
                [step.lesser, step.greater].map(|ensemble| own_kappa(ensemble, weights));
            Some(libm::log(greater? / lesser?))
        });
    }
    quantities.judge(DEPENDS_ON_K_LOWER, data(AS_COUNTED), || {
        let spectra = format!("spectra that differ only in `k_lower`, and {MANY_LOADS}");
        needs(evidence, AS_COUNTED, &[0.06], &spectra)
    })
}

fn exponent(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    for ensemble in resolved(evidence, AS_COUNTED) {
        let label = evidence.name(&ensemble.spectrum);
        quantities.add(label, &[ensemble.surfaces()], |weights| {
            let problem = PressureGrowthProblem::new(&ensemble.curves(weights)?, LIGHT);
            let fit = problem.fit().ok()?;
            // Steps in which p̄ decreases have no logarithm. Without them the exponent is biased.
            (fit.goodness.masked == 0).then_some(fit.exponent)
        });
    }
    quantities
        .judge(EXPONENT, data(AS_COUNTED), || needs(evidence, AS_COUNTED, &[0.06], MANY_LOADS))
}

fn fits_well(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    for ensemble in resolved(evidence, AS_COUNTED) {
        let below = |index: &usize| ensemble.mean(*index) < 0.2;
        let Some(last) = (0..ensemble.loads.len()).rfind(below) else {
            continue;
        };
        let window = Window { from: 0.0, to: ensemble.loads[last] };
        let label = evidence.name(&ensemble.spectrum);
        quantities.add(label, &[ensemble.surfaces()], |weights| {
            let curves = ensemble.curves(weights)?;
            let problem = EvolutionProblem::new(&curves, Quantity::Area, window).ok()?;
            let fit = problem.fit(Kappa::Free).ok()?;
            let rests = (0..=last).map(|index| {
                let area = weights.mean(&ensemble.areas[index]);
                (fit.law.area(ensemble.loads[index]) / area - 1.0).powi(2)
            });
            Some((rests.sum::<f64>() / (last + 1) as f64).sqrt())
        });
    }
    quantities
        .judge(FITS_WELL, data(AS_COUNTED), || needs(evidence, AS_COUNTED, &[0.06], MANY_LOADS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_third_divided_difference_of_a_cubic_is_its_coefficient() {
        let cubic = |x: f64| (x, 2.0 * x - 3.0 * x * x + 5.0 * x.powi(3));
        let points = [0.0, 0.005, 0.02, 0.06].map(cubic);
        assert!((third_difference(&points) - 5.0).abs() < 1e-9);
    }
}
