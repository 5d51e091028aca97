//! Claims on the error of the mesh (section 8), and claims of asperity on the secant A/(A₀ y) in
//! the limits of a large cell, a wide spectrum and a fine mesh.
//!
//! κ is the secant at a finite load: κ = Q₀ + c x^e + s ln ε + m h^g with x = 1/k_lower, ε =
//! k_lower/k_upper, h = k_upper/nodes. The manifest gives the exponents e and g; if it gives
//! several, the fit with the smallest Akaike criterion counts.
//!
//! To test that the term of the bandwidth is a logarithm, a parabola s ln ε + r (ln ε)² replaces
//! it. The ratio κ″/κ′ of its derivatives with respect to ln ε, at the middle of the range of ln ε,
//! is the exponent of a power with the same relative curvature. It is zero for a logarithm. A fit
//! with a free exponent cannot test this, because the fit is singular where the exponent tends to
//! zero.

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
    text: "internal points are nodes “that do not lie on the edge of contact zones”: “we estimate \
           the lower bound of the contact area as” A − (π/4) S_d Δx",
    source: "section 8, footnote on the perimeter, fig. 11",
    quantity: "ratio of the number of contact nodes with a gap among their four neighbours to π/4 \
               times the number of switches (pairs of neighbouring nodes with contact at one and a \
               gap at the other), at the load 0.06",
    expected: Expectation::Within(0.8, 1.2),
    reason: "±20 %, because the paper gives an estimate and does not say which neighbours count: \
             the ratio for straight edges of all directions is 0.90 with four neighbours, 1.27 \
             with eight",
    figure: None,
};

const BOUNDS: Statement = Statement {
    name: "true-area-lies-within-the-bounds",
    origin: Origin::Paper,
    text: "“A_inf/A₀ ≤ A′/A₀ ≤ A/A₀”, A_inf = A − (π/4) S_d Δx",
    source: "section 8, fig. 11",
    quantity: "c/(π/4) with c fitted to A_N = A* + c S_d Δx, where A_N is the counted area on N² \
               nodes and A* is common to all meshes of a surface, at all loads",
    expected: Expectation::Within(0.0, 1.0),
    reason: "0 if the counted area is exact, 1 if the lower bound is exact",
    figure: Some("mesh-convergence"),
};

const SMALLER_ERROR: Statement = Statement {
    name: "error-is-smaller-than-estimated",
    origin: Origin::Paper,
    text: "A′ ≈ A − (π/8) S_d Δx is a rough estimate; “the actual error may be significantly \
           smaller”",
    source: "section 8, eq. (12)",
    quantity: "c/(π/8) with c fitted to A_N = A* + c S_d Δx, where A_N is the counted area on N² \
               nodes and A* is common to all meshes of a surface, at all loads",
    expected: Expectation::Within(0.0, 0.9),
    reason: "“significantly smaller” is read as smaller by at least 10 %",
    figure: Some("mesh-convergence"),
};

const OF_2017_IS_RIGHT: Statement = Statement {
    name: "correction-of-2017-is-right",
    origin: Origin::Ours,
    text: "The counted area is too large by ((π − 1 + ln 2)/24) S_d Δx, within 15 %.",
    source: "Yastrebov, Anciaux & Molinari, Tribol. Int. 114 (2017) 161",
    quantity: "c/0.1181 with c fitted to A_N = A* + c S_d Δx, where A_N is the counted area on N² \
               nodes and A* is common to all meshes of a surface, at all loads; 0.1181 is the \
               coefficient of 2017",
    expected: Expectation::Within(0.85, 1.15),
    reason: "15 % of a correction of a few per cent is less than 1 % of the area",
    figure: Some("mesh-convergence"),
};

const LARGEST_ERROR: Statement = Statement {
    name: "largest-estimated-error",
    origin: Origin::Paper,
    text: "“This estimation may be as high as 45 %.”",
    source: "section 8, fig. 12",
    quantity: "ratio of (π/8) S_d Δx to the contact area, means over surfaces, at the lightest \
               load, for the spectrum with the largest ratio",
    expected: Expectation::Within(0.4, 0.5),
    reason: "45 ± 5 %; divided by A₀, as printed, it would be an absolute error, see \
             relative-error-is-absolute",
    figure: Some("relative-error"),
};

const ERROR_HALVES: Statement = Statement {
    name: "estimated-error-halves-at-30-percent",
    origin: Origin::Paper,
    text: "“the error is only divided by two at about 30 % of the contact area fraction”",
    source: "section 8, fig. 12",
    quantity: "mean area at which the ratio of (π/8) S_d Δx to the contact area is half of its \
               value at the lightest load, mean over the spectra",
    expected: Expectation::Within(0.2, 0.4),
    reason: "“about 30 %” is read as 20 to 40 %",
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

/// Judges c/`coefficient` for each spectrum that was solved on several meshes, with c from a fit of
/// A_N = A* + c S_d Δx.
fn over_meshes(evidence: &Evidence, statement: Statement, coefficient: f64) -> Claim {
    let mut quantities = Quantities::default();
    for meshes in evidence.of_several_meshes() {
        let [covariances, variances] = &meshes.moments;
        quantities.add(meshes.name.clone(), &[variances.len()], |weights| {
            Some(weights.mean(covariances) / weights.mean(variances) / coefficient)
        });
    }
    quantities.judge(statement, "counted area on several meshes", || {
        "the same surfaces with `hurst = 0.8` and no plateau on at least three meshes \
         (`nodes`)"
            .to_owned()
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

/// Returns [counted, corrected] area–load curves for each spectrum. Omits spectra whose two curves
/// differ in the loads or do not start near first contact.
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

const BOTH: &str = "counted area and area corrected by π/8";
const FROM_TOUCH: &str = "loads from 0.0012 to a contact area of 30 %, counted and corrected";

fn error_halves(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    let pairs = with_error(evidence);
    let surfaces: Vec<usize> = pairs.iter().map(|[counted, _]| counted.surfaces()).collect();
    if !pairs.is_empty() {
        let label = format!("mean of {} spectra", pairs.len());
        quantities.add(label, &surfaces, |weights| {
            let areas = pairs.iter().map(|[counted, corrected]| {
                let point = |index: usize| {
                    let area = weights.mean(&counted.areas[index]);
                    let error = 1.0 - weights.mean(&corrected.areas[index]) / area;
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

/// Returns the area at which the error falls to half of its first value, by linear interpolation.
/// `curve` has points (area, error).
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
    text: "In the limits of large cells and fine meshes, and within the bandwidths of the study, \
           the secant A/(A₀ y) falls with the logarithm of k_upper/k_lower.",
    source: "Yastrebov, Anciaux & Molinari, J. Mech. Phys. Solids 107 (2017) 469, find that the \
             area falls logarithmically with α; Prodanov, Dapp & Müser, Tribol. Lett. 53 (2014) \
             433, extrapolate the secant to a limit by powers",
    quantity: "exponent of the power of ε = k_lower/k_upper whose κ″/κ′ equals that of the fitted \
               secant κ at the middle of the spectra, with derivatives with respect to ln ε, at \
               each load of the fit",
    expected: Expectation::Within(-0.2, 0.2),
    reason: "0 is a logarithm; a power with the exponent 0.2 covers more than half of the way to \
             its limit between bandwidths of 2 and 128, and one with an exponent below −0.2 falls \
             faster than any logarithm",
    figure: None,
};

const BETWEEN_THEORIES: Statement = Statement {
    name: "kappa-lies-between-theories-on-fine-meshes",
    origin: Origin::Ours,
    text: "In the limits of large cells and fine meshes, the secant lies between √(8/π) of Persson \
           and √(2π) of Bush, Gibson & Thomas, for the narrowest and the widest spectrum of the \
           study.",
    source: "compare section 8 of the paper, which finds this for the area corrected by π/8",
    quantity: "(secant − √(8/π))/(√(2π) − √(8/π)) at the lightest load of the fit, if that is at \
               most 0.02",
    expected: Expectation::Within(0.0, 1.0),
    reason: "0 is Persson's theory, 1 that of asperities, both for a vanishing load; at the load \
             0.02 Persson's secant is smaller by 0.03 %. The claim does not extend beyond the \
             bandwidths of the study, because a logarithm leaves every interval",
    figure: None,
};

const CELL_IS_GREAT_ENOUGH: Statement = Statement {
    name: "sixteen-wavelengths-to-the-cell-are-enough",
    origin: Origin::Ours,
    text: "The secant of a cell with sixteen longest wavelengths per side equals that of an \
           infinite cell.",
    source: "section 9.2 of the paper finds no convergence in k_lower up to 16 at a given k_upper, \
             where the bandwidth falls as k_lower grows",
    quantity: "contribution of the term in 1/k_lower to the fitted secant at k_lower = 16, divided \
               by the secant at the middle of the bandwidths, at each load of the fit",
    expected: Expectation::Within(-0.02, 0.02),
    reason: "2 % of the area, less than the 3 % that count as distinct in \
             alpha-alone-does-not-decide",
    figure: None,
};

const MESH_IS_FINE_ENOUGH: Statement = Statement {
    name: "eight-nodes-to-the-wavelength-are-enough-once-corrected",
    origin: Origin::Ours,
    text: "If the area is corrected as in 2017, the secant on a mesh of eight nodes per shortest \
           wavelength equals that on an infinitely fine mesh.",
    source: "compare section 8 of the paper, whose coarsest meshes have eight nodes",
    quantity: "contribution of the term in k_upper/nodes to the fitted secant at k_upper/nodes = \
               1/8, divided by the secant at the middle of the bandwidths, at each load of the fit",
    expected: Expectation::Within(-0.02, 0.02),
    reason: "2 % of the area; counted areas are too large by about 10 %",
    figure: None,
};

/// Largest load at which κ is compared with the theories for vanishing loads.
const FIRST_TOUCH: f64 = 0.021;
/// Requirement of the claims on the limits of κ.
const A_FIT: &str = "a `fit` stage with `law = \"limits\"`, `of = \"area_corrected / load\"` and terms of \
                     `1 / k_lower`, `k_lower / k_upper` and `k_upper / nodes`, from a `correct` stage with \
                     `correction = \"2017\"`";
const DATA: &str = "area corrected as in 2017, in its limits";

pub fn of_limits(evidence: &Evidence) -> Vec<Claim> {
    let laws: Vec<KappaLaw> = evidence.kappa.iter().filter_map(KappaLaw::best_fit).collect();
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
            let label =
                format!("{}, k_upper/k_lower {:.0}", law.points.label, libm::exp(-ln_ratio));
            quantities.add(label, &law.points.surfaces(), |weights| {
                let kappa = law.kappa(&law.fit(weights, None)?, ln_ratio);
                Some((kappa - KAPPA_PERSSON) / (KAPPA_BGT - KAPPA_PERSSON))
            });
        }
    }
    quantities
}

/// Law of κ as a function of 1/k_lower, k_lower/k_upper and k_upper/nodes.
struct KappaLaw<'a> {
    points: &'a KappaPoints,
    /// Form of each term. The term of k_lower/k_upper is a logarithm.
    forms: Vec<TermForm>,
    /// Middle of the range of ln(k_lower/k_upper).
    middle: f64,
}

impl<'a> KappaLaw<'a> {
    /// Selects the forms in the manifest whose fit has the smallest Akaike criterion. Returns
    /// `None` if no combination of forms can be fitted.
    fn best_fit(points: &'a KappaPoints) -> Option<KappaLaw<'a>> {
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

    /// Fits the law to the surfaces that `weights` selects. If `more` is given, the law has a
    /// further logarithmic term, c ln(`more`(ε)).
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

    /// Returns κ″/κ′, the ratio of the derivatives with respect to ln ε, at the middle of the range
    /// of ln ε.
    fn exponent(&self, weights: &Weights) -> Option<f64> {
        // The term is a logarithm, and the logarithm of exp((ln ε)²) is (ln ε)².
        let parabola = self.fit(weights, Some(|ratio| libm::exp(libm::log(ratio).powi(2))))?;
        let linear = parabola.coefficients[self.points.bandwidth];
        let square = *parabola.coefficients.last()?;
        Some(2.0 * square / (linear + 2.0 * square * self.middle))
    }

    /// Returns κ = Q₀ + s ln ε of an infinite cell on an infinitely fine mesh.
    fn kappa(&self, fit: &LimitFit, ln_ratio: f64) -> f64 {
        fit.limit + fit.coefficients[self.points.bandwidth] * ln_ratio
    }

    /// Returns the contribution c xᵉ of a term at x = `small`, divided by κ at the middle of the
    /// range of ln ε. Returns `None` for a logarithmic term, which does not vanish with x.
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
