//! Claims on the error that the mesh makes (section 8), and of ours on the limits of the secant
//! A/(A₀ y): a great cell, a wide spectrum and a fine mesh.
//!
//! Here κ stands for the secant at a finite load: κ = Q₀ + c x^e + s ln ε + m h^g, x = 1/k_lower, ε
//! = k_lower/k_upper, h = k_upper/nodes, with the exponents of x and h that the manifest gives; of
//! several, those with the least of Akaike's criterion. Whether the bandwidth's term is a logarithm
//! is told by the parabola s ln ε + r (ln ε)²: its κ″/κ′ in the middle of ln ε is the exponent of
//! the power that bends as much, and zero of a logarithm. A fit with that exponent free would have
//! no value where it runs to zero, which is the case in question.

use crate::evidence::{AreaCurves, Evidence, KappaPoints};
use crate::quantities::{Quantities, needs};
use crate::{Claim, Expectation, Origin, Statement};
use asperity_contact::morphology::area::{PI_OVER_EIGHT, YASTREBOV_2017};
use asperity_contact::theory::law::{KAPPA_BGT, KAPPA_PERSSON};
use asperity_stages::correct::{AS_COUNTED, OF_2015};
use asperity_statistics::intervals::Weights;
use asperity_statistics::limits::{LimitFit, LimitProblem, TermForm};

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

pub fn of_the_mesh(evidence: &Evidence) -> Vec<Claim> {
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
    for ensemble in evidence.edge_nodes_over_switches(0.06) {
        let label = evidence.name_under(&ensemble.spectrum, ensemble.load);
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
        let label = evidence.name_under(&counted.spectrum, counted.loads[0]);
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

const LOGARITHMIC: Statement = Statement {
    name: "kappa-falls-logarithmically-with-bandwidth",
    origin: Origin::Ours,
    says: "In the limits of great cells and fine meshes the secant A/(A₀ y) falls with the \
           logarithm of k_upper/k_lower, and has no fractal limit.",
    place: "Yastrebov, Anciaux & Molinari, J. Mech. Phys. Solids 107 (2017) 469, find that the \
            area falls logarithmically with α; Prodanov, Dapp & Müser, Tribol. Lett. 53 (2014) 433, \
            take the secant to a limit by powers",
    quantity: "exponent of the power of k_lower/k_upper that bends as the secant does in the middle of \
               the spectra, each load of the fit",
    expected: Expectation::Within(-0.2, 0.2),
    because: "0 is a logarithm; a power with the exponent 0.2 has gone more than half of its way to the \
              limit from a bandwidth of 2 to one of 128, and one below −0.2 falls faster than any \
              logarithm",
    figure: None,
};

const BETWEEN_THEORIES: Statement = Statement {
    name: "kappa-lies-between-theories-on-fine-meshes",
    origin: Origin::Ours,
    says: "In the limits of great cells and fine meshes the secant lies between Persson's √(8/π) and \
           √(2π) of Bush, Gibson & Thomas, for the narrowest spectrum of the study and for the widest.",
    place: "beside section 8 of the paper, which finds it of the area corrected by π/8",
    quantity: "(secant − √(8/π))/(√(2π) − √(8/π)) under the lightest load of the fit, up to 0.02",
    expected: Expectation::Within(0.0, 1.0),
    because: "0 in Persson's theory, 1 in that of asperities, as the load goes to zero; under the load \
              0.02 Persson's secant is less than that by 3 in 10 000. Beyond the bandwidths of the study nothing \
              is said: a logarithm leaves every interval",
    figure: None,
};

const CELL_IS_GREAT_ENOUGH: Statement = Statement {
    name: "sixteen-wavelengths-to-the-cell-are-enough",
    origin: Origin::Ours,
    says: "Of a cell with sixteen of the longest wavelengths to its side the secant is that of an \
           infinite one.",
    place: "section 9.2 of the paper finds no convergence in k_lower up to 16, at a given k_upper: there \
            the bandwidth falls as k_lower grows",
    quantity: "what 1/k_lower = 1/16 adds to the secant, over the secant in the middle of the bandwidths, \
               each load of the fit",
    expected: Expectation::Within(-0.02, 0.02),
    because: "two per cent of the area, as spectra are called distinct elsewhere",
    figure: None,
};

const MESH_IS_FINE_ENOUGH: Statement = Statement {
    name: "eight-nodes-to-the-wavelength-are-enough-once-corrected",
    origin: Origin::Ours,
    says: "Corrected as in 2017, the secant on a mesh of eight nodes to the shortest wavelength is that \
           on an infinitely fine one.",
    place: "beside section 8 of the paper, whose coarsest meshes are of eight",
    quantity: "what k_upper/nodes = 1/8 adds to the secant, over the secant in the middle of the \
               bandwidths, each load of the fit",
    expected: Expectation::Within(-0.02, 0.02),
    because: "two per cent of the area; counted areas are too large by some ten",
    figure: None,
};

/// Loads up to which κ is compared with what theories say of first touch.
const FIRST_TOUCH: f64 = 0.021;
/// What a study without such a fit lacks.
const A_FIT: &str = "a `fit` stage with `law = \"limits\"`, `of = \"area_corrected / load\"` and terms of \
                     `1 / k_lower`, `k_lower / k_upper` and `k_upper / nodes`, from a `correct` stage with \
                     `correction = \"2017\"`";
const DATA: &str = "area corrected by 2017, over its limits";

pub fn of_limits(evidence: &Evidence) -> Vec<Claim> {
    let laws: Vec<KappaLaw> = evidence.kappa.iter().filter_map(KappaLaw::of).collect();
    let needs = || {
        if evidence.kappa.is_empty() {
            A_FIT.to_owned()
        } else {
            "more spectra and meshes than the fit has parameters".to_owned()
        }
    };
    let per_load = |value: fn(&KappaLaw, &Weights) -> Option<f64>| {
        let mut quantities = Quantities::default();
        for law in &laws {
            let surfaces = law.points.surfaces();
            quantities.add(law.points.label.clone(), &surfaces, |weights| value(law, weights));
        }
        quantities
    };
    vec![
        per_load(|law, weights| law.exponent(weights)).judge(LOGARITHMIC, DATA, needs),
        between_theories(&laws).judge(BETWEEN_THEORIES, DATA, needs),
        per_load(|law, weights| law.added(weights, law.points.cell, 1.0 / 16.0)).judge(
            CELL_IS_GREAT_ENOUGH,
            DATA,
            needs,
        ),
        per_load(|law, weights| law.added(weights, law.points.mesh, 1.0 / 8.0)).judge(
            MESH_IS_FINE_ENOUGH,
            DATA,
            needs,
        ),
    ]
}

fn between_theories(laws: &[KappaLaw]) -> Quantities {
    let mut quantities = Quantities::default();
    let light = laws.iter().filter(|law| law.points.load <= FIRST_TOUCH);
    let lightest = light.map(|law| law.points.load).reduce(f64::min);
    for law in laws.iter().filter(|law| Some(law.points.load) == lightest) {
        for ln_ratio in law.points.bandwidths() {
            let label = format!("{}, k_upper/k_lower {:.0}", law.points.label, (-ln_ratio).exp());
            quantities.add(label, &law.points.surfaces(), |weights| {
                let kappa = law.kappa(&law.fit(weights, None)?, ln_ratio);
                Some((kappa - KAPPA_PERSSON) / (KAPPA_BGT - KAPPA_PERSSON))
            });
        }
    }
    quantities
}

/// κ as a law of the three small numbers.
struct KappaLaw<'a> {
    points: &'a KappaPoints,
    /// The form of each term, a logarithm of the bandwidth.
    forms: Vec<TermForm>,
    /// The middle of ln(k_lower/k_upper).
    middle: f64,
}

impl<'a> KappaLaw<'a> {
    /// Of the forms that the manifest names, those with the least of Akaike's criterion; `None` where none
    /// can be fitted.
    fn of(points: &'a KappaPoints) -> Option<KappaLaw<'a>> {
        let [least, most] = points.bandwidths();
        let law = |forms| KappaLaw { points, forms, middle: 0.5 * (least + most) };
        let all = points.forms.iter().enumerate();
        let combinations = all.fold(vec![Vec::new()], |chosen, (term, forms)| {
            let forms = if term == points.bandwidth { &[TermForm::Logarithm][..] } else { forms };
            let extended = chosen.iter().flat_map(|before: &Vec<TermForm>| {
                forms.iter().map(|form| [&before[..], &[*form]].concat())
            });
            extended.collect()
        });
        let fitted = combinations.into_iter().filter_map(|forms| {
            let law = law(forms);
            let akaike = law.fit(&Weights::ALL, None)?.akaike();
            Some((law, akaike))
        });
        let best = fitted.min_by(|one, other| one.1.total_cmp(&other.1));
        best.map(|(law, _)| law)
    }

    /// The law of the surfaces that count; with one more term of the bandwidth, of which it is given as
    /// the logarithm of a number.
    fn fit(&self, weights: &Weights, more: Option<fn(f64) -> f64>) -> Option<LimitFit> {
        let mut points = self.points.points(weights);
        let mut forms = self.forms.clone();
        if let Some(more) = more {
            forms.push(TermForm::Logarithm);
            for point in &mut points {
                point.small.push(more(point.small[self.points.bandwidth]));
            }
        }
        LimitProblem::new(points).ok()?.fit(&forms).ok()
    }

    /// κ″/κ′ over ln ε in its middle.
    fn exponent(&self, weights: &Weights) -> Option<f64> {
        // Of exp((ln ε)²) the logarithm is the square.
        let parabola = self.fit(weights, Some(|ratio| libm::exp(libm::log(ratio).powi(2))))?;
        let linear = parabola.coefficients[self.points.bandwidth];
        let square = *parabola.coefficients.last()?;
        Some(2.0 * square / (linear + 2.0 * square * self.middle))
    }

    /// κ of a great cell on a fine mesh.
    fn kappa(&self, fit: &LimitFit, ln_ratio: f64) -> f64 {
        fit.limit + fit.coefficients[self.points.bandwidth] * ln_ratio
    }

    /// What a term adds, over κ in the middle of the bandwidths; `None` of a logarithm, which has no limit.
    fn added(&self, weights: &Weights, term: usize, small: f64) -> Option<f64> {
        let fit = self.fit(weights, None)?;
        let added = fit.coefficients[term] * libm::pow(small, fit.exponents[term]?);
        Some(added / self.kappa(&fit, self.middle))
    }
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
