//! The collapse on the bandwidth: a finding of ours.
//!
//! The counted area groups by k_lower and the area corrected by π/8 by k_upper (the paper's sections
//! 5.2 and 8). Corrected as in 2017 it does neither: ln A = c + s ln ζ + t ln k_lower has t = 0, where
//! ζ = k_upper/k_lower, so that the area falls logarithmically with the bandwidth alone. Yastrebov,
//! Anciaux & Molinari, J. Mech. Phys. Solids 107 (2017) 469, find a logarithm in Nayak's parameter
//! α. Over the modes of a cell α is no function of ζ: with k_lower = 1 it is half as great again.

use super::evidence::{AreaCurves, Evidence, Spectrum};
use super::light::UP_TO_FOUR_FIFTHS;
use super::quantities::{Plane, Quantities, data, families, needs, surfaces, under};
use super::{Claim, Expectation, Origin, Statement};
use asperity_stages::correct::OF_2017;
use asperity_statistics::intervals::Weights;
use asperity_statistics::line;

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

/// The claims.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    let own = evidence.of_the_paper(OF_2017);
    let are_several = own.iter().any(|one| one.spectrum.k_lower != own[0].spectrum.k_lower);
    let law = |axes: Axes, quantity: fn(&[[f64; 3]]) -> Option<f64>| match are_several {
        true => over_loads(&own, axes, |_| true, quantity),
        false => Quantities::default(),
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
    let several = match several_exponents || plateaus {
        true => over_loads(&all, with_alpha, areas_differ, |points| {
            left_by_a_line(&along(points, 1), &along(points, 2))
        }),
        false => Quantities::default(),
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
            match evidence.under(OF_2017).is_empty() {
                true => needs(evidence, OF_2017, &[], ""),
                false => {
                    "three spectra or more, with several `hurst`, or with and without a plateau, whose ln A \
                      under light loads lies farther than 0.01 from its mean, root mean square: where all \
                      areas are alike, α has nothing to tell apart"
                        .to_owned()
                }
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
            let places: Option<Vec<usize>> = family.iter().map(|one| one.at(load)).collect();
            let Some(places) = places else {
                continue;
            };
            let mut members = family.iter().zip(&places);
            if members.any(|(one, &place)| one.mean(place) > 0.8) {
                continue;
            }
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
