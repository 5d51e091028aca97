//! Claims on Nayak's parameter: how much it does, and what it cannot do alone (sections 5.2, 9.3).

use super::evidence::{Evidence, Spectrum};
use super::light::LIGHT;
use super::quantities::{Quantities, data, needs, under};
use super::steps::{Cutoff, Step};
use super::{Claim, Expectation, Origin, Statement};
use asperity_contact::theory::models::{Asperities, AsperityModel};
use asperity_stages::correct::{AS_COUNTED, OF_2017};

const WEAKER_THAN_IN_MODELS: Statement = Statement {
    name: "effect-of-alpha-is-weaker-than-in-asperity-models",
    origin: Origin::Paper,
    says: "“the effect of α on the contact area is not as strong as predicted by these models” (Bush, \
           Gibson & Thomas, and the simplified elliptic model of Greenwood 2006)",
    place: "section 5.2, fig. 5; section 9.3 (ii)",
    quantity: "ln of the ratio of mean areas of neighbouring k_upper at equal k_lower, less the same \
               in the model at the α of either spectrum over the modes of the cell, loads 0.012, \
               0.024, 0.06",
    expected: Expectation::Positive,
    because: "both logarithms are negative; an order, so any difference will do",
    figure: Some("area-light"),
};

const NOT_ALPHA_ALONE: Statement = Statement {
    name: "alpha-alone-does-not-decide",
    origin: Origin::Paper,
    says: "“for different k_l and similar ζ = k_s/k_l … the area evolutions are quite distinct. Hence, \
           for non-Gaussian surfaces, the Nayak's parameter α cannot solely determine the evolution \
           of the contact area.”",
    place: "section 5.2.2, figs. 5, 6",
    quantity: "ln of the ratio of mean areas, greater k_lower over lesser, of spectra of equal ζ, loads \
               0.012, 0.024, 0.06",
    expected: Expectation::Within(0.03, f64::INFINITY),
    because: "“quite distinct” is taken as three per cent; counted areas, as the paper has them. By eq. \
              (alpha), over continuous wavenumbers, equal ζ is equal α; over the modes of the cell α is \
              5.50 and 5.26 for ζ = 8, the paper's example, but 43.9 and 30.3 for ζ = 32",
    figure: Some("area-light"),
};

const ALPHA_ALONE: Statement = Statement {
    name: "alpha-alone-decides-corrected",
    origin: Origin::Ours,
    says: "Corrected as in 2017, spectra of equal ζ have the same area: what alpha-alone-does-not-decide \
           found is the mesh's.",
    place: "see corrected-area-depends-on-bandwidth-alone",
    expected: Expectation::Within(-0.02, 0.02),
    because: "two per cent, less than is called distinct there",
    figure: Some("collapse"),
    ..NOT_ALPHA_ALONE
};

/// The claims, in the order of the paper.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    vec![
        weaker_than_in_models(evidence),
        of_equal_bandwidth(evidence, AS_COUNTED, NOT_ALPHA_ALONE),
        of_equal_bandwidth(evidence, OF_2017, ALPHA_ALONE),
    ]
}

fn weaker_than_in_models(evidence: &Evidence) -> Claim {
    let models = [
        (AsperityModel::BushGibsonThomas, "Bush, Gibson & Thomas"),
        (AsperityModel::SimplifiedElliptic, "Greenwood 2006"),
    ];
    let ensembles = evidence.of_the_paper(AS_COUNTED);
    let mut quantities = Quantities::default();
    for step in Step::all(&ensembles, Cutoff::Upper) {
        for places in LIGHT.into_iter().filter_map(|load| step.at(load)) {
            let [one, _] = places;
            let load = step.lesser.loads[one];
            for (model, name) in models {
                let area = |spectrum: &Spectrum| modelled_area(model, spectrum, load);
                let modelled = area(&step.greater.spectrum).zip(area(&step.lesser.spectrum));
                let Some((of_greater, of_lesser)) = modelled else {
                    continue;
                };
                let label = format!("{}, {name}", step.label(evidence, one));
                quantities.add(label, &step.surfaces(), |weights| {
                    Some(step.ln_ratio(places, weights) - (of_greater / of_lesser).ln())
                });
            }
        }
    }
    let spectra = "spectra that differ in `k_upper` alone";
    quantities.judge(WEAKER_THAN_IN_MODELS, data(AS_COUNTED), || {
        needs(evidence, AS_COUNTED, &LIGHT, spectra)
    })
}

/// The area of an asperity model with the α of a spectrum over the modes of its cell.
fn modelled_area(model: AsperityModel, spectrum: &Spectrum, load: f64) -> Option<f64> {
    let model = Asperities::new(model, spectrum.nayak()?).ok()?;
    model.at_load(load).map(|contact| contact.area)
}

fn of_equal_bandwidth(evidence: &Evidence, correction: &str, statement: Statement) -> Claim {
    let ensembles = evidence.of_the_paper(correction);
    let mut quantities = Quantities::default();
    for lesser in &ensembles {
        let next = ensembles.iter().filter(|greater| {
            let (one, other) = (&lesser.spectrum, &greater.spectrum);
            one.nodes == other.nodes
                && one.k_lower < other.k_lower
                && one.k_upper * other.k_lower == other.k_upper * one.k_lower
        });
        let Some(greater) = next.min_by_key(|greater| greater.spectrum.k_lower) else {
            continue;
        };
        for load in LIGHT {
            let Some((one, other)) = lesser.at(load).zip(greater.at(load)) else {
                continue;
            };
            let label = format!(
                "{} over {}, {}",
                evidence.name(&greater.spectrum),
                evidence.name(&lesser.spectrum),
                under(lesser.loads[one])
            );
            let surfaces = [lesser.surfaces(), greater.surfaces()];
            quantities.add(label, &surfaces, |weights| {
                let [greater, lesser] = [&greater.areas[other], &lesser.areas[one]];
                Some((weights.mean(greater) / weights.mean(lesser)).ln())
            });
        }
    }
    quantities.judge(statement, data(correction), || {
        needs(evidence, correction, &LIGHT, "spectra of equal `k_upper` / `k_lower`")
    })
}
