//! Claims on the error that the mesh makes (section 8).

use std::collections::BTreeMap;

use super::evidence::{AreaCurves, Evidence};
use super::quantities::{Quantities, needs, under};
use super::{Claim, Expectation, Origin, Statement};
use asperity_contact::morphology::area::{PI_OVER_EIGHT, YASTREBOV_2017};
use asperity_stages::columns::{EDGE_NODES_4, SWITCHES};
use asperity_stages::correct::{AS_COUNTED, OF_2015};

const EDGE_NODES: Statement = Statement {
    name: "edge-nodes-are-pi-over-4-of-the-switches",
    origin: Origin::Paper,
    says: "internal points are nodes “that do not lie on the edge of contact zones”: “we estimate the \
           lower bound of the contact area as” A − (π/4) S_d Δx",
    place: "section 8, footnote on the perimeter, fig. 11",
    quantity: "contact nodes with a gap among their four neighbours, over π/4 of the switches, at the \
               load 0.06",
    expected: Expectation::Within(0.8, 1.2),
    because: "an estimate, so twenty per cent, and the paper does not say which neighbours count: straight \
              edges of all directions have 0.90 with four of them, 1.27 with eight",
    figure: None,
};

const BOUNDS: Statement = Statement {
    name: "true-area-lies-within-the-bounds",
    origin: Origin::Paper,
    says: "“A_inf/A₀ ≤ A′/A₀ ≤ A/A₀”, A_inf = A − (π/4) S_d Δx",
    place: "section 8, fig. 11",
    quantity: "c/(π/4), where A_N = A* + c S_d Δx over meshes of the same surfaces, all loads",
    expected: Expectation::Within(0.0, 1.0),
    because: "0 where the counted area is right, 1 where the lower bound is",
    figure: Some("mesh-convergence"),
};

const SMALLER_ERROR: Statement = Statement {
    name: "error-is-smaller-than-estimated",
    origin: Origin::Paper,
    says: "A′ ≈ A − (π/8) S_d Δx is a rough estimate; “the actual error may be significantly smaller”",
    place: "section 8, eq. (corrected_area)",
    quantity: "c/(π/8), where A_N = A* + c S_d Δx over meshes of the same surfaces, all loads",
    expected: Expectation::Within(0.0, 0.9),
    because: "smaller by ten per cent is significantly smaller",
    figure: Some("mesh-convergence"),
};

const OF_2017_IS_RIGHT: Statement = Statement {
    name: "correction-of-2017-is-right",
    origin: Origin::Ours,
    says: "The area is too large by ((π − 1 + ln 2)/24) S_d Δx, to 15 %.",
    place: "Yastrebov, Anciaux & Molinari, Tribol. Int. 114 (2017) 161",
    quantity: "c over that coefficient, 0.1181, where A_N = A* + c S_d Δx over meshes of the same \
               surfaces, all loads",
    expected: Expectation::Within(0.85, 1.15),
    because: "15 % of a correction of a few per cent is less than one per cent of the area",
    figure: Some("mesh-convergence"),
};

const LARGEST_ERROR: Statement = Statement {
    name: "largest-estimated-error",
    origin: Origin::Paper,
    says: "“This estimation may be as high as 45 %.”",
    place: "section 8, fig. 12",
    quantity: "(π/8) S_d Δx over the area of contact, means over surfaces, at the lightest load of the \
               spectrum for which it is greatest",
    expected: Expectation::Within(0.4, 0.5),
    because: "five points either way; as printed, over A₀, it would be an absolute error: see \
              relative-error-is-absolute",
    figure: Some("relative-error"),
};

const ERROR_HALVES: Statement = Statement {
    name: "estimated-error-halves-at-30-percent",
    origin: Origin::Paper,
    says: "“the error is only divided by two at about 30 % of the contact area fraction”",
    place: "section 8, fig. 12",
    quantity: "mean area at which (π/8) S_d Δx over the area of contact is half of what it is at the \
               lightest load, mean over the spectra",
    expected: Expectation::Within(0.2, 0.4),
    because: "“about” is taken as ten points",
    figure: Some("relative-error"),
};

/// The claims, in the order of the paper.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    vec![
        over_meshes(evidence, BOUNDS, 2.0 * PI_OVER_EIGHT),
        edge_nodes(evidence),
        over_meshes(evidence, SMALLER_ERROR, PI_OVER_EIGHT),
        over_meshes(evidence, OF_2017_IS_RIGHT, YASTREBOV_2017),
        largest_error(evidence),
        error_halves(evidence),
    ]
}

/// c over a coefficient, for each spectrum whose surfaces were pressed on several meshes.
fn over_meshes(evidence: &Evidence, statement: Statement, coefficient: f64) -> Claim {
    let mut quantities = Quantities::default();
    for meshes in evidence.of_several_meshes() {
        let [covariances, variances] = &meshes.moments;
        quantities.add(meshes.name.clone(), &[variances.len()], |weights| {
            Some(weights.mean(covariances) / weights.mean(variances) / coefficient)
        });
    }
    quantities.judge(statement, "counted area on several meshes", || {
        "the same surfaces, `hurst = 0.8` and no plateau, on three or more `nodes`".to_owned()
    })
}

fn edge_nodes(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    let ratio = |row: &BTreeMap<&str, f64>| row[EDGE_NODES_4.name] / row[SWITCHES.name];
    for ensemble in evidence.of_contacts(0.06, &[EDGE_NODES_4.name, SWITCHES.name], ratio) {
        let label = format!("{}, {}", evidence.name(&ensemble.spectrum), under(ensemble.load));
        quantities.add(label, &[ensemble.values.len()], |weights| {
            Some(weights.mean(&ensemble.values) / std::f64::consts::FRAC_PI_4)
        });
    }
    quantities.judge(EDGE_NODES, "measured contacts", || {
        needs(evidence, AS_COUNTED, &[0.06], "measured contacts")
    })
}

/// Counted and corrected curves of the same spectrum, on the same loads, from first touch on.
fn with_error(evidence: &Evidence) -> Vec<[&AreaCurves; 2]> {
    let corrected = evidence.of_the_paper(OF_2015);
    let counted = evidence.of_the_paper(AS_COUNTED).into_iter();
    let pairs = counted.filter_map(|counted| {
        let own = |other: &&&AreaCurves| {
            other.spectrum == counted.spectrum
                && other.loads == counted.loads
                && other.surfaces() == counted.surfaces()
        };
        corrected.iter().find(own).map(|other| [counted, *other])
    });
    // The lightest of the paper's fifty loads is 0.0012.
    let pairs = pairs.filter(|[counted, _]| counted.loads[0] < 0.005);
    pairs.collect()
}

fn largest_error(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    let error = |[counted, corrected]: &[&AreaCurves; 2]| 1.0 - corrected.mean(0) / counted.mean(0);
    let pairs = with_error(evidence);
    let largest = pairs.iter().max_by(|a, b| error(a).total_cmp(&error(b)));
    if let Some([counted, corrected]) = largest {
        let label = format!("{}, {}", evidence.name(&counted.spectrum), under(counted.loads[0]));
        quantities.add(label, &[counted.surfaces()], |weights| {
            Some(1.0 - weights.mean(&corrected.areas[0]) / weights.mean(&counted.areas[0]))
        });
    }
    quantities.judge(LARGEST_ERROR, BOTH, || needs(evidence, OF_2015, &[0.0012], FROM_TOUCH))
}

const BOTH: &str = "counted area and its correction by π/8";
const FROM_TOUCH: &str = "loads from 0.0012 to 30 % of contact, counted and corrected";

fn error_halves(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    let pairs = with_error(evidence);
    let surfaces: Vec<usize> = pairs.iter().map(|[counted, _]| counted.surfaces()).collect();
    if !pairs.is_empty() {
        let label = format!("mean of {} spectra", pairs.len());
        quantities.add(label, &surfaces, |weights| {
            let areas = pairs.iter().map(|[counted, corrected]| {
                let point = |place: usize| {
                    let area = weights.mean(&counted.areas[place]);
                    let error = 1.0 - weights.mean(&corrected.areas[place]) / area;
                    (area, error)
                };
                let curve: Vec<(f64, f64)> = (0..counted.loads.len()).map(point).collect();
                halved(&curve)
            });
            let areas: Vec<f64> = areas.collect::<Option<_>>()?;
            Some(areas.iter().sum::<f64>() / areas.len() as f64)
        });
    }
    quantities.judge(ERROR_HALVES, BOTH, || needs(evidence, OF_2015, &[0.0012], FROM_TOUCH))
}

/// The area at which an error has fallen to half of its first value, between two points.
fn halved(curve: &[(f64, f64)]) -> Option<f64> {
    let half = 0.5 * curve.first()?.1;
    let crossing = curve.windows(2).find(|pair| pair[1].1 <= half)?;
    let [(area, error), (next_area, next_error)] = [crossing[0], crossing[1]];
    let share = (error - half) / (error - next_error);
    Some(area + share * (next_area - area))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_that_falls_linearly_is_halved_half_way() {
        let curve = [(0.0, 0.4), (0.1, 0.36), (0.6, 0.16), (1.0, 0.0)];
        assert!((halved(&curve).unwrap() - 0.5).abs() < 1e-15);
        assert_eq!(halved(&curve[..2]), None);
    }
}
