//! Claims on which cutoff decides: how curves group, how surfaces scatter, whether anything
//! converges (sections 5.2, 6 and 8).

use super::evidence::{AreaCurves, Evidence, Spectrum};
use super::light::{LIGHT, UP_TO_FOUR_FIFTHS};
use super::quantities::{Plane, Quantities, data, families, needs, surfaces, under};
use super::steps::{Cutoff, Step};
use super::{Claim, Expectation, Origin, Statement};
use asperity_stages::correct::{AS_COUNTED, OF_2015};
use asperity_statistics::intervals::Weights;

const GROUPS_BY_K_LOWER: Statement = Statement {
    name: "area-groups-by-k-lower",
    origin: Origin::Paper,
    says: "“The curves form three groups with respect to the lower cutoff wavenumber k_l = 16, 4, 1”, \
           “easily distinguished up to about 80 % of the contact area”",
    place: "sections 5.2 and 6, figs. 5, 9",
    quantity: "distance of neighbouring groups of k_lower less the width of a group, in ln A by least \
               squares over the spectra, loads 0.012 … 0.52 with less than 80 % of the area",
    expected: Expectation::Positive,
    because: "groups lie apart when a step of k_lower, a factor of 4, does more than all of k_upper",
    figure: Some("area-light"),
};

const GROUPS_BY_K_UPPER: Statement = Statement {
    name: "corrected-area-groups-by-k-upper",
    origin: Origin::Paper,
    says: "“The results depend only slightly on the lower cutoff wavenumber k_l, but strongly on the \
           upper cutoff k_s. The curves are grouped by the value of k_s”",
    place: "section 8, eq. (corrected_area), fig. 13",
    quantity: "distance of neighbouring groups of k_upper less the width of a group, in ln A of the area \
               corrected by π/8, by least squares over the spectra, loads 0.012, 0.024, 0.06",
    expected: Expectation::Positive,
    because: "groups lie apart when a step of k_upper, a factor of 2, does more than all of k_lower, one \
              of 16",
    figure: Some("area-corrected"),
};

const NO_TREND_WITHIN_GROUPS: Statement = Statement {
    name: "no-trend-within-corrected-groups",
    origin: Origin::Paper,
    says: "“within each group there is no specific trend with respect to the lower cutoff or Nayak's \
           parameter”",
    place: "section 8, fig. 13",
    quantity: "∂ ln A/∂ ln k_lower of the area corrected by π/8 at given k_upper, by least squares \
               over the spectra, loads 0.012, 0.024, 0.06",
    expected: Expectation::Within(-0.02, 0.02),
    because: "0.02 is 5 % of the area from k_lower = 1 to 16, a fifth of what k_upper does",
    figure: Some("area-corrected"),
};

const VARIANCES: Statement = Statement {
    name: "scatter-falls-with-cutoffs",
    origin: Origin::Paper,
    says: "“the standard deviation in the results is higher for smaller k_s and k_l: the smallest \
           variance is found for k_l = 16, k_s = 128, the highest … for k_l = 1, k_s = 32”",
    place: "section 5.2, fig. 5",
    quantity: "ln of the ratio of the standard deviations between surfaces of the areas of \
               neighbouring k_lower or k_upper, the lesser one's over the greater one's, load 0.06",
    expected: Expectation::Positive,
    because: "an order, so any difference will do",
    figure: Some("area-light"),
};

const NO_CONVERGENCE: Statement = Statement {
    name: "no-convergence-in-k-lower",
    origin: Origin::Paper,
    says: "“we do not obtain any convergence in the area evolution curve with an increasing k_l \
           (approaching a Gaussian surface)”",
    place: "sections 5.2.2 and 9.2, figs. 5, 6",
    quantity: "ln of the ratio of mean areas over one step of k_lower, less half of that over the \
               step before, steps of equal ratio, loads 0.012, 0.024, 0.06",
    expected: Expectation::Positive,
    because: "a series that converges as fast as 1/2 a step would have zero or less; “any” would be more, \
              for slower ones converge too",
    figure: Some("area-light"),
};

/// The claims, in the order of the paper.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    vec![
        groups_by_k_lower(evidence),
        variances(evidence),
        no_convergence(evidence),
        groups_by_k_upper(evidence),
        no_trend_within_groups(evidence),
    ]
}

fn variances(evidence: &Evidence) -> Claim {
    let ensembles = evidence.of_the_paper(AS_COUNTED);
    let mut quantities = Quantities::default();
    for cutoff in [Cutoff::Lower, Cutoff::Upper] {
        for step in Step::all(&ensembles, cutoff) {
            let Some([one, other]) = step.at(0.06) else {
                continue;
            };
            let label = step.label(evidence, one);
            quantities.add(label, &step.surfaces(), |weights| {
                let lesser = weights.deviation(&step.lesser.areas[one]);
                let greater = weights.deviation(&step.greater.areas[other]);
                Some((lesser / greater).ln())
            });
        }
    }
    quantities.judge(VARIANCES, data(AS_COUNTED), || {
        needs(evidence, AS_COUNTED, &[0.06], "spectra that differ in one cutoff alone")
    })
}

fn no_convergence(evidence: &Evidence) -> Claim {
    let ensembles = evidence.of_the_paper(AS_COUNTED);
    let steps = Step::all(&ensembles, Cutoff::Lower);
    let mut quantities = Quantities::default();
    for (first, second) in steps.iter().flat_map(|first| {
        let follows = |second: &&Step| second.lesser.spectrum == first.greater.spectrum;
        steps.iter().filter(follows).map(move |second| (first, second))
    }) {
        let ratio = |step: &Step| {
            step.greater.spectrum.k_lower as f64 / step.lesser.spectrum.k_lower as f64
        };
        if ratio(first) != ratio(second) {
            continue;
        }
        for load in LIGHT {
            let Some((before, after)) = first.at(load).zip(second.at(load)) else {
                continue;
            };
            let label = second.label(evidence, after[0]);
            let surfaces = [first.surfaces(), second.surfaces()].concat();
            quantities.add(label, &surfaces, |weights| {
                Some(second.ln_ratio(after, weights) - 0.5 * first.ln_ratio(before, weights))
            });
        }
    }
    let spectra = "spectra with three `k_lower` in equal ratio at one `k_upper`";
    quantities
        .judge(NO_CONVERGENCE, data(AS_COUNTED), || needs(evidence, AS_COUNTED, &LIGHT, spectra))
}

const SEVERAL_CUTOFFS: &str = "spectra of at least two `k_lower` and two `k_upper` each";

fn groups_by_k_lower(evidence: &Evidence) -> Claim {
    let quantities = sensitivities(
        evidence,
        AS_COUNTED,
        &UP_TO_FOUR_FIFTHS,
        |[lower, upper], [steps, spans]| steps[0] * lower.abs() - spans[1] * upper.abs(),
    );
    quantities.judge(GROUPS_BY_K_LOWER, data(AS_COUNTED), || {
        needs(evidence, AS_COUNTED, &UP_TO_FOUR_FIFTHS, SEVERAL_CUTOFFS)
    })
}

fn groups_by_k_upper(evidence: &Evidence) -> Claim {
    let apart = |[lower, upper]: [f64; 2], [steps, spans]: [[f64; 2]; 2]| {
        steps[1] * upper.abs() - spans[0] * lower.abs()
    };
    let quantities = sensitivities(evidence, OF_2015, &LIGHT, apart);
    quantities.judge(GROUPS_BY_K_UPPER, data(OF_2015), || {
        needs(evidence, OF_2015, &LIGHT, SEVERAL_CUTOFFS)
    })
}

fn no_trend_within_groups(evidence: &Evidence) -> Claim {
    let quantities = sensitivities(evidence, OF_2015, &LIGHT, |[lower, _], _| lower);
    quantities.judge(NO_TREND_WITHIN_GROUPS, data(OF_2015), || {
        needs(evidence, OF_2015, &LIGHT, SEVERAL_CUTOFFS)
    })
}

/// The least steps, and the spans, of ln k_lower and ln k_upper among ensembles.
pub fn spread(family: &[&AreaCurves]) -> [[f64; 2]; 2] {
    let cutoffs: [fn(&Spectrum) -> i64; 2] = [|one| one.k_lower, |one| one.k_upper];
    let steps_and_span = cutoffs.map(|cutoff| {
        let mut all: Vec<i64> = family.iter().map(|one| cutoff(&one.spectrum)).collect();
        all.sort_unstable();
        all.dedup();
        let ln = |pair: &[i64]| (pair[1] as f64 / pair[0] as f64).ln();
        let step = all.windows(2).map(ln).fold(f64::INFINITY, f64::min);
        (step, ln(&[all[0], all[all.len() - 1]]))
    });
    [steps_and_span.map(|both| both.0), steps_and_span.map(|both| both.1)]
}

/// A function of how ln A depends on ln k_lower and ln k_upper, and of their spread, at each load at
/// which less than four fifths touch.
fn sensitivities(
    evidence: &Evidence,
    correction: &str,
    loads: &[f64],
    quantity: fn([f64; 2], [[f64; 2]; 2]) -> f64,
) -> Quantities {
    let mut quantities = Quantities::default();
    for family in families(&evidence.of_the_paper(correction)) {
        let spread = spread(&family);
        for &load in loads {
            let places: Option<Vec<usize>> = family.iter().map(|one| one.at(load)).collect();
            let Some(places) = places else {
                continue;
            };
            let mut members = family.iter().zip(&places);
            if members.any(|(one, &place)| one.mean(place) > 0.8) {
                continue;
            }
            let plane = |weights: &Weights| {
                let point = |(one, &place): (&&AreaCurves, &usize)| {
                    let [lower, upper] = [one.spectrum.k_lower, one.spectrum.k_upper];
                    let area = weights.mean(&one.areas[place]);
                    [(lower as f64).ln(), (upper as f64).ln(), area.ln()]
                };
                let points: Vec<[f64; 3]> = family.iter().zip(&places).map(point).collect();
                Plane::through(&points)
            };
            quantities.add(under(family[0].loads[places[0]]), &surfaces(&family), |weights| {
                Some(quantity(plane(weights)?.slopes, spread))
            });
        }
    }
    quantities
}
