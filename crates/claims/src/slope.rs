//! Claims on the slope of the area against the load (sections 5.2.2 and 6).

use super::evidence::{AreaCurves, Evidence};
use super::quantities::{Quantities, data, needs};
use super::{Claim, Expectation, Origin, Statement};
use asperity_contact::theory::persson;
use asperity_stages::correct::{AS_COUNTED, OF_2017};
use asperity_statistics::intervals::Weights;

/// Ends of three equal stretches of light load.
const STRETCHES: [f64; 3] = [0.02, 0.04, 0.06];
/// Loads that spread over the range of the claim as its curvature does.
const SPREAD: [f64; 3] = [0.005, 0.02, 0.06];

const DECREASES: Statement = Statement {
    name: "slope-decreases",
    origin: Origin::Paper,
    says: "“In all obtained curves, the slope of the contact area is a decreasing function of the \
           applied pressure”",
    place: "section 5.2.2, fig. 6",
    quantity: "fall of the mean slope ΔA/Δy from one third of the loads up to 0.06 to the next",
    expected: Expectation::Positive,
    because: "an order, so any difference will do",
    figure: Some("slope"),
};

const DECREASES_CORRECTED: Statement = Statement {
    name: "corrected-slope-decreases",
    origin: Origin::Ours,
    says: "The same of the area corrected as in 2017.",
    place: "as slope-decreases",
    ..DECREASES
};

const CONVEX: Statement = Statement {
    name: "slope-is-convex",
    origin: Origin::Paper,
    says: "“all curves are convex in the considered range (up to 10–14 % of the contact area \
           fraction)”, meaning their slopes; “a decreasing convex function”",
    place: "sections 5.2.2 and 9.6, fig. 6",
    quantity: "third divided difference of the mean area over the loads 0, 0.005, 0.02, 0.06: a sixth \
               of a mean third derivative",
    expected: Expectation::Positive,
    because: "equal thirds would miss the steep start; less than convexity everywhere, as the paper has it",
    figure: Some("slope"),
};

const CONVEX_CORRECTED: Statement = Statement {
    name: "corrected-slope-is-convex",
    origin: Origin::Ours,
    says: "The same of the area corrected as in 2017.",
    place: "as slope-is-convex",
    ..CONVEX
};

const CROSSES_PERSSON: Statement = Statement {
    name: "slope-crosses-perssons-near-half",
    origin: Origin::Paper,
    says: "“Up to about 50 % of contacting area, the numerically predicted slope is steeper than this \
           predicted by the Persson's model and vice versa for greater contact area fractions.”",
    place: "section 6, inset of fig. 9",
    quantity: "mean area at which the slope ΔA/Δy, by differences, falls below Persson's between the \
               same loads",
    expected: Expectation::Within(0.4, 0.6),
    because: "“about 50 %” is taken as ten points",
    figure: Some("area-full"),
};

/// The claims, in the order of the paper.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
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
    for (ensemble, places) in with_loads(evidence, correction, STRETCHES) {
        for third in 0..2 {
            let load = ensemble.loads[places[third]];
            let label = format!("{}, around load {load:.3}", evidence.name(&ensemble.spectrum));
            quantities.add(label, &[ensemble.surfaces()], |weights| {
                let slopes = divided(&curve(ensemble, places, weights));
                Some(slopes[third] - slopes[third + 1])
            });
        }
    }
    quantities.judge(statement, data(correction), || all_of(evidence, correction, &STRETCHES))
}

fn is_convex(evidence: &Evidence, correction: &str, statement: Statement) -> Claim {
    let mut quantities = Quantities::default();
    for (ensemble, places) in with_loads(evidence, correction, SPREAD) {
        let label = evidence.name(&ensemble.spectrum);
        quantities.add(label, &[ensemble.surfaces()], |weights| {
            Some(third_difference(&curve(ensemble, places, weights)))
        });
    }
    quantities.judge(statement, data(correction), || all_of(evidence, correction, &SPREAD))
}

/// What a study lacks that has not all of some loads.
fn all_of(evidence: &Evidence, correction: &str, loads: &[f64]) -> String {
    let missing = loads.iter().find(|&&load| {
        let own = evidence.of_the_paper(correction);
        !own.iter().any(|ensemble| ensemble.at(load).is_some())
    });
    let missing = missing.map_or_else(Vec::new, |&load| vec![load]);
    needs(evidence, correction, &missing, "loads from first touch to 0.06")
}

/// The ensembles that have these loads, and their places.
fn with_loads<'a>(
    evidence: &'a Evidence,
    correction: &str,
    loads: [f64; 3],
) -> Vec<(&'a AreaCurves, [usize; 3])> {
    let ensembles = evidence.of_the_paper(correction).into_iter();
    let found = ensembles.filter_map(|ensemble| {
        let places: Option<Vec<usize>> = loads.iter().map(|&load| ensemble.at(load)).collect();
        let places: [usize; 3] = places?.try_into().ok()?;
        let ascend = places.is_sorted_by(|a, b| a < b);
        ascend.then_some((ensemble, places))
    });
    found.collect()
}

/// Loads and mean areas from nothing on.
fn curve(ensemble: &AreaCurves, places: [usize; 3], weights: &Weights) -> [(f64, f64); 4] {
    let [a, b, c] =
        places.map(|place| (ensemble.loads[place], weights.mean(&ensemble.areas[place])));
    [(0.0, 0.0), a, b, c]
}

/// Divided differences of neighbouring points.
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
        needs(evidence, AS_COUNTED, &[0.5], "loads from first touch to two thirds of the area")
    })
}

/// The mean area at which the slope falls below Persson's, interpolated between midpoints of loads.
fn crossing(ensemble: &AreaCurves, weights: &Weights) -> Option<f64> {
    let mut before: Option<(f64, f64)> = None;
    for place in 1..ensemble.loads.len() {
        let [from, to] = [place - 1, place]
            .map(|place| (ensemble.loads[place], weights.mean(&ensemble.areas[place])));
        let area = 0.5 * (from.1 + to.1);
        // At light load the slope of few surfaces scatters about anything.
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
