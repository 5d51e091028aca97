//! The collapse on the bandwidth, and with it on Nayak's parameter: a finding of ours.
//!
//! The counted area groups by k_lower and the area corrected by π/8 by k_upper (the paper's sections
//! 5.2 and 8). Corrected as in 2017 it does neither: ln A = c + s ln ζ + t ln k_lower has t = 0, where
//! ζ = k_upper/k_lower, so that the area falls logarithmically with the bandwidth alone. Yastrebov,
//! Anciaux & Molinari, J. Mech. Phys. Solids 107 (2017) 469, find the same law in α.

use super::evidence::{AreaCurves, Evidence, Spectrum};
use super::intervals::Weights;
use super::light::UP_TO_FOUR_FIFTHS;
use super::quantities::{Plane, Quantities, data, families, needs, surfaces, under};
use super::{Claim, Expectation, Origin, Statement};
use crate::fitting::line;
use crate::stages::correct::OF_2017;

const BANDWIDTH_ALONE: Statement = Statement {
    name: "corrected-area-depends-on-bandwidth-alone",
    origin: Origin::Ours,
    says: "Corrected as in 2017, the area at a given load depends on ζ = k_upper/k_lower, hence by eq. \
           (alpha) on α, and not on k_lower besides: the groups of the paper are the mesh's and the \
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

const ALPHA_ALONE: Statement = Statement {
    name: "corrected-area-collapses-on-alpha",
    origin: Origin::Ours,
    says: "Spectra of other Hurst exponents and with plateaus lie on the same curve when α stands for \
           the bandwidth.",
    place: "section 9.3 of the paper conjectures it (“the Hurst roughness exponent does not play an \
            independent role”) and calls for the test; the correction and plateaus are ours",
    quantity: "root mean square of what ln A = c + s ln α leaves over all spectra, loads 0.012 … 0.52 \
               with less than 80 % of the area",
    expected: Expectation::Within(f64::NEG_INFINITY, 0.01),
    because: "one per cent of the area, where spectra differ by up to thirty",
    figure: Some("collapse"),
};

/// The claims.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    let own = evidence.of_the_paper(OF_2017);
    let bandwidth = |spectrum: &Spectrum| (spectrum.k_upper as f64 / spectrum.k_lower as f64).ln();
    let are_several = own
        .iter()
        .any(|one| one.spectrum.k_lower != own[0].spectrum.k_lower);
    let law = |quantity: fn(Plane) -> f64| match are_several {
        true => over_loads(&own, bandwidth, |points| {
            Plane::through(points).map(quantity)
        }),
        false => Quantities::default(),
    };
    let spectra = "spectra of at least two `k_lower` and two `k_upper` each";
    let lacking = || needs(evidence, OF_2017, &UP_TO_FOUR_FIFTHS, spectra);
    let all = evidence.under(OF_2017);
    let varies = all.iter().any(|one| {
        let [first, one] = [&all[0].spectrum, &one.spectrum];
        first.hurst != one.hurst || first.is_plain() != one.is_plain()
    });
    let several = match varies {
        true => over_loads(
            &all,
            |spectrum| spectrum.continuum().nayak().ln(),
            left_by_a_line,
        ),
        false => Quantities::default(),
    };
    let data = data(OF_2017);
    vec![
        law(|plane| plane.slopes[1]).judge(BANDWIDTH_ALONE, data, lacking),
        law(|plane| -plane.slopes[0]).judge(LOGARITHMIC, data, lacking),
        several.judge(ALPHA_ALONE, data, || {
            match evidence.under(OF_2017).is_empty() {
                true => needs(evidence, OF_2017, &[], ""),
                false => {
                    "three spectra or more, with several `hurst`, or with and without a plateau, and \
                      light loads that all of them have"
                        .to_owned()
                }
            }
        }),
    ]
}

/// Root mean square of what a straight line leaves of ln A over a measure of the bandwidth; of two spectra it
/// leaves nothing, whatever they are.
fn left_by_a_line(points: &[[f64; 3]]) -> Option<f64> {
    if points.len() < 3 {
        return None;
    }
    let along = |axis: usize| points.iter().map(move |point| point[axis]);
    let (x, y): (Vec<f64>, Vec<f64>) = (along(0).collect(), along(2).collect());
    let (slope, offset) = line(&x, &y)?;
    let squares = x.iter().zip(&y);
    let squares = squares.map(|(x, y)| (y - offset - slope * x).powi(2));
    Some((squares.sum::<f64>() / x.len() as f64).sqrt())
}

/// A quantity of points (bandwidth, ln k_lower, ln A) of all spectra, at each load.
fn over_loads(
    ensembles: &[&AreaCurves],
    bandwidth: impl Fn(&Spectrum) -> f64,
    quantity: impl Fn(&[[f64; 3]]) -> Option<f64>,
) -> Quantities {
    let mut quantities = Quantities::default();
    for family in of_one_mesh(ensembles) {
        for load in UP_TO_FOUR_FIFTHS {
            let places: Option<Vec<usize>> = family.iter().map(|one| one.at(load)).collect();
            let Some(places) = places else {
                continue;
            };
            let mut members = family.iter().zip(&places);
            if members.any(|(one, &place)| one.mean(place) > 0.8) {
                continue;
            }
            let value = |weights: &Weights| {
                let point = |(one, &place): (&&AreaCurves, &usize)| {
                    let area = weights.mean(&one.areas[place]);
                    let spectrum = &one.spectrum;
                    [
                        bandwidth(spectrum),
                        (spectrum.k_lower as f64).ln(),
                        area.ln(),
                    ]
                };
                let points: Vec<[f64; 3]> = family.iter().zip(&places).map(point).collect();
                quantity(&points)
            };
            quantities.add(under(family[0].loads[places[0]]), &surfaces(&family), value);
        }
    }
    quantities
}

/// Ensembles on one mesh, of whatever Hurst exponent.
fn of_one_mesh<'a>(ensembles: &[&'a AreaCurves]) -> Vec<Vec<&'a AreaCurves>> {
    let mut meshes: Vec<Vec<&AreaCurves>> = Vec::new();
    for family in families(ensembles) {
        let nodes = family[0].spectrum.nodes;
        match meshes
            .iter_mut()
            .find(|mesh| mesh[0].spectrum.nodes == nodes)
        {
            Some(mesh) => mesh.extend(family),
            None => meshes.push(family),
        }
    }
    meshes
}
