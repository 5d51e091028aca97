//! Claims on which cutoff decides: how curves group, how surfaces scatter, whether anything
//! converges (sections 5.2, 6 and 8); and the collapse on the bandwidth, a finding of ours.
//!
//! The counted area groups by k_lower and the area corrected by π/8 by k_upper (the paper's
//! sections 5.2 and 8). Corrected as in 2017 it does neither: ln A = c + s ln ζ + t ln k_lower has
//! t = 0, where ζ = k_upper/k_lower, so that the area falls logarithmically with the bandwidth
//! alone. Yastrebov, Anciaux & Molinari, J. Mech. Phys. Solids 107 (2017) 469, find a logarithm in
//! Nayak's parameter α. Over the modes of a cell α is no function of ζ: with k_lower = 1 it is half
//! as great again.

use crate::evidence::{AreaCurves, Evidence, Spectrum};
use crate::light::{LIGHT, UP_TO_FOUR_FIFTHS};
use crate::quantities::{
    Cutoff, Plane, Quantities, Step, below_four_fifths, data, families, needs, surfaces, under,
};
use crate::{Claim, Expectation, Origin, Statement};
use asperity_stages::correct::{AS_COUNTED, OF_2015, OF_2017};
use asperity_statistics::intervals::Weights;
use asperity_statistics::line;

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

pub fn of_groups(evidence: &Evidence) -> Vec<Claim> {
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
            let Some(places) = below_four_fifths(&family, load) else {
                continue;
            };
            quantities.add(under(family[0].loads[places[0]]), &surfaces(&family), |weights| {
                let area = |one: &AreaCurves, place: usize| weights.mean(&one.areas[place]);
                Some(quantity(Plane::over_cutoffs(&family, &places, area)?.slopes, spread))
            });
        }
    }
    quantities
}

const BANDWIDTH_ALONE: Statement = Statement {
    name: "corrected-area-depends-on-bandwidth-alone",
    origin: Origin::Ours,
    says: "Corrected as in 2017, the area at a given load depends on the bandwidth ζ = k_upper/k_lower \
           and not on k_lower besides: the groups of the paper are the mesh's and the \
           over-correction's.",
    place: "beside sections 5.2 and 8 of the paper, figs. 5 and 13",
    quantity: "t of ln A = c + s ln ζ + t ln k_lower by least squares over the spectra, loads 0.012 … \
               0.52 with less than 80 % of the area",
    expected: Expectation::Within(-0.015, 0.015),
    because: "0.015 is 4 % of the area from k_lower = 1 to 16; the counted area has 0.04, that \
              corrected by π/8 −0.12",
    figure: Some("collapse"),
};

const LOGARITHMIC: Statement = Statement {
    name: "corrected-area-falls-logarithmically-with-bandwidth",
    origin: Origin::Ours,
    says: "The law of the collapse: the corrected area falls as ζ grows.",
    place: "as corrected-area-depends-on-bandwidth-alone",
    quantity: "−s of ln A = c + s ln ζ + t ln k_lower, as there",
    expected: Expectation::Positive,
    because: "an order, so any difference will do; the intervals are the law",
    figure: Some("collapse"),
};

const RATHER_THAN_ALPHA: Statement = Statement {
    name: "corrected-area-collapses-on-bandwidth-rather-than-alpha",
    origin: Origin::Ours,
    says: "The bandwidth ζ puts the corrected areas of self-affine spectra on one curve, Nayak's \
           parameter α of the modes of the cell does so less well.",
    place: "beside section 5.2.2 of the paper, where eq. (alpha) makes α a function of ζ, which it is \
            over continuous wavenumbers alone",
    quantity: "ln of the root mean square that ln A = c + s ln α leaves over the spectra over the one that \
               ln A = c + s ln ζ leaves, loads 0.012 … 0.52 with less than 80 % of the area",
    expected: Expectation::Positive,
    because: "an order, so any difference will do",
    figure: Some("collapse"),
};

const ALPHA_ALONE: Statement = Statement {
    name: "corrected-area-collapses-on-alpha",
    origin: Origin::Ours,
    says: "Spectra of several Hurst exponents lie on one curve against α.",
    place: "section 9.3 of the paper conjectures it (“the Hurst roughness exponent does not play an \
            independent role”) and calls for the test; the correction is ours",
    quantity: "root mean square of what ln A = c + s ln α leaves over all spectra, α over the modes of the \
               cell, loads 0.012 … 0.52 with less than 80 % of the area",
    expected: Expectation::Within(f64::NEG_INFINITY, MOST_LEFT),
    because: "one per cent of the area; at loads at which ln A of the spectra lies within one per cent of \
              its mean, root mean square, any line would do, and nothing is judged",
    figure: Some("collapse"),
};

const ALPHA_ALONE_WITH_PLATEAUS: Statement = Statement {
    says: "Spectra with plateaus of several lengths lie on one curve against α.",
    place: "section 9.3 of the paper calls for the test of α alone; the correction and plateaus are ours",
    ..ALPHA_ALONE
};

const ALPHA_ALONE_OF_BOTH: Statement = Statement {
    says: "Spectra of several Hurst exponents, with plateaus and without, lie on one curve against α.",
    place: "section 9.3 of the paper conjectures it of Hurst exponents (“the Hurst roughness exponent does \
            not play an independent role”) and calls for the test; the correction and plateaus are ours",
    ..ALPHA_ALONE
};

/// Largest root mean square of ln A about a line on which areas are said to collapse. The areas
/// must scatter by more than this about their mean, or any line would do.
const MOST_LEFT: f64 = 0.01;

pub fn of_the_collapse(evidence: &Evidence) -> Vec<Claim> {
    let own = evidence.of_the_paper(OF_2017);
    let are_several = own.iter().any(|one| one.spectrum.k_lower != own[0].spectrum.k_lower);
    let law = |axes: Axes, quantity: fn(&[[f64; 3]]) -> Option<f64>| {
        if are_several { over_loads(&own, axes, |_| true, quantity) } else { Quantities::default() }
    };
    let with_k_lower: Axes =
        |spectrum| Some([ln_bandwidth(spectrum), (spectrum.k_lower as f64).ln()]);
    let with_alpha: Axes = |spectrum| Some([ln_bandwidth(spectrum), spectrum.nayak()?.ln()]);
    let spectra = "spectra of at least two `k_lower` and two `k_upper` each";
    let lacking = || needs(evidence, OF_2017, &UP_TO_FOUR_FIFTHS, spectra);
    let all = evidence.under(OF_2017);
    let several_exponents = all.iter().any(|one| one.spectrum.hurst != all[0].spectrum.hurst);
    let plateaus = all.iter().any(|one| !one.spectrum.is_plain());
    let on_alpha = match (several_exponents, plateaus) {
        (_, false) => ALPHA_ALONE,
        (false, true) => ALPHA_ALONE_WITH_PLATEAUS,
        (true, true) => ALPHA_ALONE_OF_BOTH,
    };
    let several = if several_exponents || plateaus {
        over_loads(&all, with_alpha, areas_differ, |points| {
            left_by_a_line(&along(points, 1), &along(points, 2))
        })
    } else {
        Quantities::default()
    };
    let data = data(OF_2017);
    vec![
        law(with_k_lower, |points| {
            Some(Plane::through(points)?.slopes[1])
        })
        .judge(BANDWIDTH_ALONE, data, lacking),
        law(with_k_lower, |points| {
            Some(-Plane::through(points)?.slopes[0])
        })
        .judge(LOGARITHMIC, data, lacking),
        law(with_alpha, |points| {
            let [bandwidth, alpha, area] = [0, 1, 2].map(|axis| along(points, axis));
            let [on_alpha, on_bandwidth] = [alpha, bandwidth].map(|x| left_by_a_line(&x, &area));
            Some((on_alpha? / on_bandwidth?).ln())
        })
        .judge(RATHER_THAN_ALPHA, data, lacking),
        several.judge(on_alpha, data, || {
            if evidence.under(OF_2017).is_empty() {
                needs(evidence, OF_2017, &[], "")
            } else {
                "three spectra or more, with several `hurst`, or with and without a plateau, whose ln A \
                 under light loads lies farther than 0.01 from its mean, root mean square: where all \
                 areas are alike, α has nothing to tell apart"
                    .to_owned()
            }
        }),
    ]
}

/// Returns two measures of a spectrum.
type Axes = fn(&Spectrum) -> Option<[f64; 2]>;

fn ln_bandwidth(spectrum: &Spectrum) -> f64 {
    (spectrum.k_upper as f64 / spectrum.k_lower as f64).ln()
}

fn along(points: &[[f64; 3]], axis: usize) -> Vec<f64> {
    points.iter().map(|point| point[axis]).collect()
}

/// Returns whether the areas scatter by more about their mean than a collapse may leave about a
/// line.
fn areas_differ(points: &[[f64; 3]]) -> bool {
    let areas = along(points, 2);
    let mean = areas.iter().sum::<f64>() / areas.len() as f64;
    root_mean_square(areas.iter().map(|area| area - mean)) > MOST_LEFT
}

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

/// Returns the root mean square of the residuals of a straight line, or `None` for two spectra,
/// which every line fits.
fn left_by_a_line(x: &[f64], y: &[f64]) -> Option<f64> {
    if x.len() < 3 {
        return None;
    }
    let (slope, offset) = line(x, y)?;
    let rest = x.iter().zip(y).map(|(x, y)| y - offset - slope * x);
    Some(root_mean_square(rest))
}

/// Collects a quantity at each load from the points (two measures of the spectrum, ln A) of all
/// spectra. Loads whose points do not satisfy `is_asked` are left out.
fn over_loads(
    ensembles: &[&AreaCurves],
    axes: Axes,
    is_asked: fn(&[[f64; 3]]) -> bool,
    quantity: impl Fn(&[[f64; 3]]) -> Option<f64>,
) -> Quantities {
    let mut quantities = Quantities::default();
    for family in of_one_mesh(ensembles) {
        let measures: Option<Vec<[f64; 2]>> =
            family.iter().map(|one| axes(&one.spectrum)).collect();
        let Some(measures) = measures else {
            continue;
        };
        for load in UP_TO_FOUR_FIFTHS {
            let Some(places) = below_four_fifths(&family, load) else {
                continue;
            };
            let points = |weights: &Weights| -> Vec<[f64; 3]> {
                let areas = family.iter().zip(&places);
                let areas = areas.map(|(one, &place)| weights.mean(&one.areas[place]));
                let points = measures.iter().zip(areas);
                let points = points.map(|(&[one, other], area)| [one, other, area.ln()]);
                points.collect()
            };
            if is_asked(&points(&Weights::ALL)) {
                let label = under(family[0].loads[places[0]]);
                quantities.add(label, &surfaces(&family), |weights| quantity(&points(weights)));
            }
        }
    }
    quantities
}

/// Ensembles on one mesh, of whatever Hurst exponent.
fn of_one_mesh<'a>(ensembles: &[&'a AreaCurves]) -> Vec<Vec<&'a AreaCurves>> {
    let mut meshes: Vec<Vec<&AreaCurves>> = Vec::new();
    for family in families(ensembles) {
        let nodes = family[0].spectrum.nodes;
        match meshes.iter_mut().find(|mesh| mesh[0].spectrum.nodes == nodes) {
            Some(mesh) => mesh.extend(family),
            None => meshes.push(family),
        }
    }
    meshes
}
