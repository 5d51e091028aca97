//! Claims on the influence of each cutoff on the area: groups of curves, scatter and convergence
//! (sections 5.2, 6 and 8). Also claims on the collapse of corrected areas on the bandwidth, a
//! finding of asperity.
//!
//! The curves of the counted area form groups by k_lower, and those of the area corrected with the
//! estimator `pi/8` form groups by k_upper (sections 5.2 and 8 of the paper). The area A corrected
//! with the estimator `2017` forms no groups: the fit ln A = c + s ln ζ + t ln k_lower with ζ =
//! k_upper/k_lower gives t = 0. At a given load, this area depends only on the bandwidth ζ.
//!
//! Yastrebov, Anciaux & Molinari, J. Mech. Phys. Solids 107 (2017) 469, find that the area falls
//! with the logarithm of Nayak's parameter α. Over the modes of a cell, α is not a function of ζ:
//! it is larger by half for k_lower = 1.

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
    text: "“The curves form three groups with respect to the lower cutoff wavenumber k_l = 16, 4, \
           1”, “easily distinguished up to about 80 % of the contact area”",
    source: "sections 5.2 and 6, figs. 5, 9",
    quantity: "distance between neighbouring groups of equal k_lower minus the width of a group, \
               both in ln A from the least-squares plane over ln k_lower and ln k_upper, at loads \
               from 0.012 to 0.52 with less than 80 % of the area in contact",
    expected: Expectation::Positive,
    reason: "groups are apart if one step of k_lower, a factor of 4, changes the area more than \
             the whole range of k_upper",
    figure: Some("area-light"),
};

const GROUPS_BY_K_UPPER: Statement = Statement {
    name: "corrected-area-groups-by-k-upper",
    origin: Origin::Paper,
    text: "“The results depend only slightly on the lower cutoff wavenumber k_l, but strongly on \
           the upper cutoff k_s. The curves are grouped by the value of k_s”",
    source: "section 8, eq. (12), fig. 13",
    quantity: "distance between neighbouring groups of equal k_upper minus the width of a group, \
               both in ln A from the least-squares plane over ln k_lower and ln k_upper, for the \
               area A corrected by π/8, at loads 0.012, 0.024, 0.06",
    expected: Expectation::Positive,
    reason: "groups are apart if one step of k_upper, a factor of 2, changes the area more than \
             the whole range of k_lower, a factor of 16",
    figure: Some("area-corrected"),
};

const NO_TREND_WITHIN_GROUPS: Statement = Statement {
    name: "no-trend-within-corrected-groups",
    origin: Origin::Paper,
    text: "“within each group there is no specific trend with respect to the lower cutoff or \
           Nayak's parameter”",
    source: "section 8, fig. 13",
    quantity: "∂ ln A/∂ ln k_lower at given k_upper, from the least-squares plane over ln k_lower \
               and ln k_upper, for the area A corrected by π/8, at loads 0.012, 0.024, 0.06",
    expected: Expectation::Within(-0.02, 0.02),
    reason: "0.02 changes the area by 5 % from k_lower = 1 to 16, a fifth of the effect of k_upper",
    figure: Some("area-corrected"),
};

const VARIANCES: Statement = Statement {
    name: "scatter-falls-with-cutoffs",
    origin: Origin::Paper,
    text: "“the standard deviation in the results is higher for smaller k_s and k_l: the smallest \
           variance is found for k_l = 16, k_s = 128, the highest … for k_l = 1, k_s = 32”",
    source: "section 5.2, fig. 5",
    quantity: "ln of the ratio of the standard deviations of the area between surfaces for \
               neighbouring k_lower or k_upper (smaller over larger), at the load 0.06",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any difference counts",
    figure: Some("area-light"),
};

const NO_CONVERGENCE: Statement = Statement {
    name: "no-convergence-in-k-lower",
    origin: Origin::Paper,
    text: "“we do not obtain any convergence in the area evolution curve with an increasing k_l \
           (approaching a Gaussian surface)”",
    source: "sections 5.2.2 and 9.2, figs. 5, 6",
    quantity: "ln of the ratio of the mean areas for a step of k_lower, minus half of the same \
               logarithm for the previous step, where k_lower grows by the same factor; at loads \
               0.012, 0.024, 0.06",
    expected: Expectation::Positive,
    reason: "zero or negative for a series whose steps halve or shrink faster; “any” claims more, \
             because a series whose steps shrink more slowly may converge, too",
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
                Some(libm::log(lesser / greater))
            });
        }
    }
    quantities.judge(VARIANCES, data(AS_COUNTED), || {
        needs(evidence, AS_COUNTED, &[0.06], "spectra that differ only in one cutoff")
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
    let spectra = "spectra with one `k_upper` and three `k_lower` of equal ratio, such as 1, 4, 16";
    quantities
        .judge(NO_CONVERGENCE, data(AS_COUNTED), || needs(evidence, AS_COUNTED, &LIGHT, spectra))
}

const SEVERAL_CUTOFFS: &str = "spectra with all combinations of at least two `k_lower` and two \
                               `k_upper`";

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

/// Returns [smallest steps, ranges] of the cutoffs of these ensembles, each as [value for ln
/// k_lower, value for ln k_upper].
pub fn spread(family: &[&AreaCurves]) -> [[f64; 2]; 2] {
    let cutoffs: [fn(&Spectrum) -> i64; 2] = [|one| one.k_lower, |one| one.k_upper];
    let steps_and_span = cutoffs.map(|cutoff| {
        let mut all: Vec<i64> = family.iter().map(|one| cutoff(&one.spectrum)).collect();
        all.sort_unstable();
        all.dedup();
        let ln = |pair: &[i64]| libm::log(pair[1] as f64 / pair[0] as f64);
        let step = all.windows(2).map(ln).fold(f64::INFINITY, f64::min);
        (step, ln(&[all[0], all[all.len() - 1]]))
    });
    [steps_and_span.map(|both| both.0), steps_and_span.map(|both| both.1)]
}

/// Computes `quantity`([s, t], [`spread`] of the cutoffs) for each mesh and each of `loads` with at
/// most 80 % of the area in contact. The slopes s and t are those of the least-squares plane ln A =
/// c + s ln k_lower + t ln k_upper.
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
            let Some(indices) = below_four_fifths(&family, load) else {
                continue;
            };
            quantities.add(under(family[0].loads[indices[0]]), &surfaces(&family), |weights| {
                let area = |one: &AreaCurves, index: usize| weights.mean(&one.areas[index]);
                Some(quantity(Plane::over_cutoffs(&family, &indices, area)?.slopes, spread))
            });
        }
    }
    quantities
}

const BANDWIDTH_ALONE: Statement = Statement {
    name: "corrected-area-depends-on-bandwidth-alone",
    origin: Origin::Ours,
    text: "The area corrected as in 2017 depends, at a given load, on the bandwidth ζ = \
           k_upper/k_lower only. The groups in the paper come from the mesh and from an \
           overcorrection.",
    source: "compare sections 5.2 and 8 of the paper, figs. 5 and 13",
    quantity: "t of ln A = c + s ln ζ + t ln k_lower, by least squares over the spectra, at loads \
               from 0.012 to 0.52 with less than 80 % of the area in contact",
    expected: Expectation::Within(-0.015, 0.015),
    reason: "0.015 changes the area by 4 % from k_lower = 1 to 16; t is 0.04 for the counted area \
             and −0.12 for the area corrected by π/8",
    figure: Some("collapse"),
};

const LOGARITHMIC: Statement = Statement {
    name: "corrected-area-falls-logarithmically-with-bandwidth",
    origin: Origin::Ours,
    text: "The corrected area at a given load falls as ζ grows.",
    source: "see corrected-area-depends-on-bandwidth-alone",
    quantity: "−s of ln A = c + s ln ζ + t ln k_lower, as in \
               corrected-area-depends-on-bandwidth-alone",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any fall counts",
    figure: Some("collapse"),
};

const RATHER_THAN_ALPHA: Statement = Statement {
    name: "corrected-area-collapses-on-bandwidth-rather-than-alpha",
    origin: Origin::Ours,
    text: "The corrected areas of self-affine spectra collapse on the bandwidth ζ better than on \
           Nayak's parameter α of the modes of the cell.",
    source: "compare section 5.2.2 of the paper, where α is a function of ζ by eq. (3), which \
             only holds for continuous wavenumbers",
    quantity: "ln of the ratio of the rms residuals of the fits ln A = c + s ln α and ln A = c + s \
               ln ζ over the spectra, at loads from 0.012 to 0.52 with less than 80 % of the area \
               in contact",
    expected: Expectation::Positive,
    reason: "the claim states an order, so any difference counts",
    figure: Some("collapse"),
};

const ALPHA_ALONE: Statement = Statement {
    name: "corrected-area-collapses-on-alpha",
    origin: Origin::Ours,
    text: "Spectra of several Hurst exponents lie on one curve against α.",
    source: "section 9.3 of the paper conjectures this (“the Hurst roughness exponent does not \
             play an independent role”) and calls for the test; the correction is an addition of \
             asperity",
    quantity: "rms residual of the fit ln A = c + s ln α over all spectra, with α over the modes \
               of the cell, at loads from 0.012 to 0.52 with less than 80 % of the area in contact",
    expected: Expectation::Within(f64::NEG_INFINITY, MOST_LEFT),
    reason: "1 % of the area; loads at which ln A itself deviates from its mean by less than 1 % \
             rms are not tested, because any line would fit them",
    figure: Some("collapse"),
};

const ALPHA_ALONE_WITH_PLATEAUS: Statement = Statement {
    text: "Spectra with plateaus of several lengths lie on one curve against α.",
    source: "section 9.3 of the paper calls for the test of α alone; the correction and plateaus \
             are additions of asperity",
    ..ALPHA_ALONE
};

const ALPHA_ALONE_OF_BOTH: Statement = Statement {
    text: "Spectra of several Hurst exponents, with plateaus and without, lie on one curve against \
           α.",
    source: "section 9.3 of the paper conjectures this for Hurst exponents (“the Hurst roughness \
             exponent does not play an independent role”) and calls for the test; the correction \
             and plateaus are additions of asperity",
    ..ALPHA_ALONE
};

/// Largest rms residual of ln A that counts as a collapse. A load is tested only if the rms
/// deviation of ln A from the mean is larger, because otherwise any line fits.
const MOST_LEFT: f64 = 0.01;

pub fn of_the_collapse(evidence: &Evidence) -> Vec<Claim> {
    let own = evidence.of_the_paper(OF_2017);
    let are_several = own.iter().any(|one| one.spectrum.k_lower != own[0].spectrum.k_lower);
    let law = |axes: Axes, quantity: fn(&[[f64; 3]]) -> Option<f64>| {
        if are_several { over_loads(&own, axes, |_| true, quantity) } else { Quantities::default() }
    };
    let with_k_lower: Axes =
        |spectrum| Some([ln_bandwidth(spectrum), libm::log(spectrum.k_lower as f64)]);
    let with_alpha: Axes = |spectrum| Some([ln_bandwidth(spectrum), libm::log(spectrum.nayak()?)]);
    let spectra = "spectra with all combinations of at least two `k_lower` and two `k_upper`";
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
            rms_residual(&along(points, 1), &along(points, 2))
        })
    } else {
        Quantities::default()
    };
    let data = data(OF_2017);
    vec![
        law(with_k_lower, |points| Some(Plane::through(points)?.slopes[1])).judge(
            BANDWIDTH_ALONE,
            data,
            lacking,
        ),
        law(with_k_lower, |points| Some(-Plane::through(points)?.slopes[0])).judge(
            LOGARITHMIC,
            data,
            lacking,
        ),
        law(with_alpha, |points| {
            let [bandwidth, alpha, area] = [0, 1, 2].map(|axis| along(points, axis));
            let [on_alpha, on_bandwidth] = [alpha, bandwidth].map(|x| rms_residual(&x, &area));
            Some(libm::log(on_alpha? / on_bandwidth?))
        })
        .judge(RATHER_THAN_ALPHA, data, lacking),
        several.judge(on_alpha, data, || {
            if evidence.under(OF_2017).is_empty() {
                needs(evidence, OF_2017, &[], "")
            } else {
                "three spectra or more, with several `hurst` or with and without a plateau, whose \
                 ln A under light loads deviates from its mean by more than 0.01 rms, because \
                 any line fits nearly equal areas"
                    .to_owned()
            }
        }),
    ]
}

/// Function from a spectrum to the abscissae [x₁, x₂] for a fit of ln A; `None` omits the spectrum.
type Axes = fn(&Spectrum) -> Option<[f64; 2]>;

fn ln_bandwidth(spectrum: &Spectrum) -> f64 {
    libm::log(spectrum.k_upper as f64 / spectrum.k_lower as f64)
}

fn along(points: &[[f64; 3]], axis: usize) -> Vec<f64> {
    points.iter().map(|point| point[axis]).collect()
}

/// Returns true if the rms deviation of ln A from its mean exceeds [`MOST_LEFT`].
fn areas_differ(points: &[[f64; 3]]) -> bool {
    let areas = along(points, 2);
    let mean = areas.iter().sum::<f64>() / areas.len() as f64;
    root_mean_square(areas.iter().map(|area| area - mean)) > MOST_LEFT
}

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

/// Returns the rms residual of the least-squares line y = a + b x, or `None` for fewer than three
/// points.
fn rms_residual(x: &[f64], y: &[f64]) -> Option<f64> {
    if x.len() < 3 {
        return None;
    }
    let (slope, offset) = line(x, y)?;
    let rest = x.iter().zip(y).map(|(x, y)| y - offset - slope * x);
    Some(root_mean_square(rest))
}

/// Computes a quantity for each mesh and load from the points [x₁, x₂, ln A] of all spectra, with
/// the abscissae that `axes` returns. Omits loads whose points do not satisfy `is_tested`.
fn over_loads(
    ensembles: &[&AreaCurves],
    axes: Axes,
    is_tested: fn(&[[f64; 3]]) -> bool,
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
            let Some(indices) = below_four_fifths(&family, load) else {
                continue;
            };
            let points = |weights: &Weights| -> Vec<[f64; 3]> {
                let areas = family.iter().zip(&indices);
                let areas = areas.map(|(one, &index)| weights.mean(&one.areas[index]));
                let points = measures.iter().zip(areas);
                let points = points.map(|(&[one, other], area)| [one, other, libm::log(area)]);
                points.collect()
            };
            if is_tested(&points(&Weights::ALL)) {
                let label = under(family[0].loads[indices[0]]);
                quantities.add(label, &surfaces(&family), |weights| quantity(&points(weights)));
            }
        }
    }
    quantities
}

/// Groups ensembles with the same mesh. Unlike [`families`], a group can contain several Hurst
/// exponents.
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
