//! Claims on the contact evolution law and its κ (sections 5.2.1, 9.5 and appendix C).

use super::evidence::{AreaCurves, Evidence};
use super::quantities::{Quantities, data, families, needs, surfaces};
use super::steps::{Cutoff, Step};
use super::{Claim, Expectation, Origin, Statement};
use asperity_contact::theory::law::KAPPA_BGT;
use asperity_stages::correct::{AS_COUNTED, OF_2015};
use asperity_statistics::Window;
use asperity_statistics::evolution::{EvolutionFit, EvolutionProblem, Kappa, Quantity};
use asperity_statistics::intervals::Weights;

const LEAST_CONVEX: Statement = Statement {
    name: "least-convex-kappa",
    origin: Origin::Paper,
    says: "“a lower boundary for this parameter for which the numerical data points can be fitted \
           appropriately [that is, convexly]: κ ⪆ 1.055 √(2π)”, “quite subjective”",
    place: "section 5.2.1, eq. (cel_derivative), fig. 6",
    quantity: "least κ/√(2π) for which the law's slopes, fitted to those of all spectra at loads up to \
               0.06, are convex",
    expected: Expectation::Within(1.0, 1.11),
    because: "the paper calls its number subjective: five per cent either way",
    figure: Some("slope"),
};

const BOUND_FALLS: Statement = Statement {
    name: "least-convex-kappa-falls-with-the-correction",
    origin: Origin::Paper,
    says: "“this lower boundary can be significantly decreased, if one takes into account the error \
           estimation based on the perimeter”",
    place: "section 5.2.1, section 8",
    quantity: "ln of the least convex κ of the counted area over that of the area corrected by π/8",
    expected: Expectation::Within(0.05, f64::INFINITY),
    because: "“significantly” is taken as five per cent",
    figure: Some("area-corrected"),
};

const DEPENDS_ON_K_LOWER: Statement = Statement {
    name: "least-convex-kappa-depends-on-k-lower",
    origin: Origin::Paper,
    says: "“the minimal value of κ is strongly dependent on the lower cutoff k_l”",
    place: "section 5.2.1",
    quantity: "ln of the ratio of the least convex κ of the spectra of neighbouring k_lower, at equal \
               k_upper, each spectrum by itself",
    expected: Expectation::Within(0.05, f64::INFINITY),
    because: "“strongly” is taken as five per cent for each step, as “significantly” is elsewhere; that κ \
              grows with k_lower is what is found, the paper gives no direction",
    figure: Some("slope"),
};

const EXPONENT: Statement = Statement {
    name: "exponent-of-pressure-growth",
    origin: Origin::Paper,
    says: "the mean contact pressure's derivative dp̄/dp₀ “decreases approximately as a power law of the \
           contact area”, β (A₀/A)^(1 − μ) with 0 < μ < 1",
    place: "appendix C, eq. (b1), fig. 17; the figure has lines of −0.7 and −0.9, which hold for fewer of \
            these spectra",
    quantity: "m = μ − 1 of the contact evolution law with κ = 1.1 √(2π), fitted to the slopes at loads \
               up to 0.06",
    expected: Expectation::Within(-1.0, 0.0),
    because: "as printed; the law's own exponent, since logarithms of differences leave out those \
              that fall",
    figure: Some("pressure-growth"),
};

const FITS_WELL: Statement = Statement {
    name: "law-fits-below-a-fifth",
    origin: Origin::Paper,
    says: "the contact evolution formula “fits well all our results at small contact area fractions \
           (< 20 %)”",
    place: "section 9.5, eq. (cel)",
    quantity: "root mean square of what the law, with κ, β and μ free, leaves of the mean areas below \
               a fifth, relative to each",
    expected: Expectation::Within(f64::NEG_INFINITY, 0.01),
    because: "“well” is taken as one per cent, what the mean of fifty surfaces is known to",
    figure: Some("area-light"),
};

/// The loads that the paper calls light.
const LIGHT: Window = Window { from: 0.0, to: 0.06 };
/// Proportionality that the paper fits slopes with.
const GIVEN_KAPPA: f64 = 1.1 * KAPPA_BGT;
/// Loads of a curve that are enough to tell how its slope bends.
const ENOUGH_LOADS: usize = 10;
const MANY_LOADS: &str = "ten loads or more from first touch to 0.06";

/// The claims, in the order of the paper.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    vec![
        least_convex(evidence),
        falls_with_correction(evidence),
        depends_on_k_lower(evidence),
        fits_well(evidence),
        exponent(evidence),
    ]
}

/// Ensembles with enough light loads.
fn resolved<'a>(evidence: &'a Evidence, correction: &str) -> Vec<&'a AreaCurves> {
    let mut ensembles = evidence.of_the_paper(correction);
    let is_light = |load: &&f64| LIGHT.contains(**load);
    ensembles.retain(|one| one.loads.iter().filter(is_light).count() >= ENOUGH_LOADS);
    ensembles
}

fn fit(
    ensemble: &AreaCurves,
    weights: &Weights,
    quantity: Quantity,
    window: Window,
    kappa: Kappa,
) -> Option<EvolutionFit> {
    let problem = EvolutionProblem::new(&ensemble.curves(weights)?, quantity, window).ok()?;
    problem.fit(kappa).ok()
}

/// The least κ that makes the slopes of one ensemble convex.
fn own_kappa(ensemble: &AreaCurves, weights: &Weights) -> Option<f64> {
    let problem = EvolutionProblem::new(&ensemble.curves(weights)?, Quantity::Slope, LIGHT).ok()?;
    Some(problem.fit(Kappa::LeastConvex).ok()?.law.kappa)
}

/// The least κ that makes the slopes of several convex.
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
            Some((counted? / corrected?).ln())
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
            Some((greater? / lesser?).ln())
        });
    }
    quantities.judge(DEPENDS_ON_K_LOWER, data(AS_COUNTED), || {
        let spectra = format!("spectra that differ in `k_lower` alone, and {MANY_LOADS}");
        needs(evidence, AS_COUNTED, &[0.06], &spectra)
    })
}

fn exponent(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    for ensemble in resolved(evidence, AS_COUNTED) {
        let label = evidence.name(&ensemble.spectrum);
        quantities.add(label, &[ensemble.surfaces()], |weights| {
            let kappa = Kappa::Given(GIVEN_KAPPA);
            let fit = fit(ensemble, weights, Quantity::Slope, LIGHT, kappa)?;
            Some(fit.law.mu - 1.0)
        });
    }
    quantities
        .judge(EXPONENT, data(AS_COUNTED), || needs(evidence, AS_COUNTED, &[0.06], MANY_LOADS))
}

fn fits_well(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    for ensemble in resolved(evidence, AS_COUNTED) {
        let below = |place: &usize| ensemble.mean(*place) < 0.2;
        let Some(last) = (0..ensemble.loads.len()).rfind(below) else {
            continue;
        };
        let window = Window { from: 0.0, to: ensemble.loads[last] };
        let label = evidence.name(&ensemble.spectrum);
        quantities.add(label, &[ensemble.surfaces()], |weights| {
            let fit = fit(ensemble, weights, Quantity::Area, window, Kappa::Free)?;
            let rests = (0..=last).map(|place| {
                let area = weights.mean(&ensemble.areas[place]);
                (fit.law.area(ensemble.loads[place]) / area - 1.0).powi(2)
            });
            Some((rests.sum::<f64>() / (last + 1) as f64).sqrt())
        });
    }
    quantities
        .judge(FITS_WELL, data(AS_COUNTED), || needs(evidence, AS_COUNTED, &[0.06], MANY_LOADS))
}
