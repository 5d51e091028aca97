//! Claims of ours on the limits of the secant A/(A₀ y): a great cell, a wide spectrum and a fine mesh.
//!
//! Here κ stands for the secant at a finite load: κ = Q₀ + c x^e + s ln ε + m h^g, x = 1/k_lower, ε = k_lower/k_upper, h = k_upper/nodes, with the
//! exponents of x and h that the manifest gives; of several, those with the least of Akaike's criterion.
//! Whether the bandwidth's term is a logarithm is told by the parabola s ln ε + r (ln ε)²: its κ″/κ′ in
//! the middle of ln ε is the exponent of the power that bends as much, and zero of a logarithm. A fit with
//! that exponent free would have no value where it runs to zero, which is the case in question.

use super::evidence::{Evidence, KappaPoints};
use super::quantities::Quantities;
use super::{Claim, Expectation, Origin, Statement};
use asperity_contact::theory::law::{KAPPA_BGT, KAPPA_PERSSON};
use asperity_statistics::intervals::Weights;
use asperity_statistics::limits::{LimitFit, LimitProblem, TermForm};

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

/// The claims.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    let laws: Vec<KappaLaw> = evidence.kappa.iter().filter_map(KappaLaw::of).collect();
    let needs = || match evidence.kappa.is_empty() {
        true => A_FIT.to_owned(),
        false => "more spectra and meshes than the fit has parameters".to_owned(),
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
            let forms = match term == points.bandwidth {
                true => &[TermForm::Logarithm][..],
                false => forms,
            };
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
