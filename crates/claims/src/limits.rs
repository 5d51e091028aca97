//! Limits of the secant κ = A/(A₀ y) for large cells, wide spectra and fine meshes.
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

use std::collections::BTreeSet;

use crate::setting::Setting;
use asperity_manifest::expression::Expression;
use asperity_pipeline::study::claims::Statistic;
use asperity_stages::columns::*;
use asperity_stages::correct::OF_2017;
use asperity_stages::ensemble::ParameterPoint;
use asperity_stages::fit::limits::{LimitChoices, groups};
use asperity_statistics::Window;
use asperity_statistics::intervals::Weights;
use asperity_statistics::limits::{LimitFit, LimitPoint, LimitProblem, Observed, TermForm};
use asperity_tables::table::{Table, TableError};

/// Largest load at which κ is compared with the theories for vanishing loads.
const FIRST_TOUCH: f64 = 0.021;

/// A number that is computed from the surfaces that the weights select.
pub type Computed<'a> = Box<dyn Fn(&Weights) -> Option<f64> + 'a>;

/// A value of κ in its limits.
pub struct KappaValue<'a> {
    pub label: String,
    pub surfaces: Vec<usize>,
    pub value: Computed<'a>,
}

/// Returns the values of a statistic of κ, for each load of the fits. `laws` are the best fits.
pub fn values<'a>(laws: &'a [KappaLaw<'a>], statistic: Statistic) -> Vec<KappaValue<'a>> {
    let light = laws.iter().map(|law| law.points.load).filter(|load| *load <= FIRST_TOUCH);
    let lightest = light.reduce(f64::min);
    let of_law = |law: &'a KappaLaw<'a>| -> Vec<KappaValue<'a>> {
        let named = |label: String, value: Computed<'a>| KappaValue {
            label,
            surfaces: law.points.surfaces(),
            value,
        };
        let label = law.points.label.clone();
        match statistic {
            Statistic::KappaExponent => {
                vec![named(label, Box::new(|weights| law.exponent(weights)))]
            }
            Statistic::KappaOfCell => {
                let cell = law.points.cell;
                vec![named(label, Box::new(move |weights| law.added(weights, cell, 1.0 / 16.0)))]
            }
            Statistic::KappaOfMesh => {
                let mesh = law.points.mesh;
                vec![named(label, Box::new(move |weights| law.added(weights, mesh, 1.0 / 8.0)))]
            }
            Statistic::KappaAtBandwidths if Some(law.points.load) == lightest => {
                let both = law.points.bandwidths().map(|ln_ratio| {
                    let label = format!("{label}, k_upper/k_lower {:.0}", libm::exp(-ln_ratio));
                    let value = move |weights: &Weights| {
                        Some(law.kappa(&law.fit(weights, None)?, ln_ratio))
                    };
                    named(label, Box::new(value))
                });
                both.into()
            }
            _ => Vec::new(),
        }
    };
    laws.iter().flat_map(of_law).collect()
}

/// A fit of the limits of a quantity for vanishing parameters, and the rows that it reads.
#[derive(Debug, Clone)]
pub struct LimitsFit {
    /// Fitted quantity, its terms and their possible forms.
    pub choices: LimitChoices,
    pub window: Window,
    pub table: Table,
}

/// κ = A/(A₀ y) for many spectra and meshes under one load, from areas corrected with the estimator
/// `2017`.
#[derive(Debug, Clone)]
pub struct KappaPoints {
    /// Name that distinguishes the fit: `load 0.01`.
    pub label: String,
    pub load: f64,
    /// One point for each spectrum and mesh: κ of each surface, and the values of 1/k_lower,
    /// k_lower/k_upper and k_upper/nodes in the order of the terms.
    points: Vec<LimitPoint>,
    /// Forms that each term may have, `[term][form]`.
    pub forms: Vec<Vec<TermForm>>,
    /// Index of the term of `k_lower / k_upper` in `forms`.
    pub bandwidth: usize,
    /// Index of the term of `1 / k_lower` in `forms`.
    pub cell: usize,
    /// Index of the term of `k_upper / nodes` in `forms`.
    pub mesh: usize,
}

impl KappaPoints {
    /// Returns the points with the values of the surfaces that `weights` selects.
    pub fn points(&self, weights: &Weights) -> Vec<LimitPoint> {
        let points = self.points.iter().map(|point| LimitPoint {
            small: point.small.clone(),
            observed: match &point.observed {
                Observed::Surfaces { values, .. } => {
                    Observed::from_realizations(weights.values(values).collect())
                }
                estimate => estimate.clone(),
            },
        });
        points.collect()
    }

    /// Returns the number of surfaces of each point.
    pub fn surfaces(&self) -> Vec<usize> {
        let counts = self.points.iter().map(|point| point.observed.surfaces());
        counts.collect()
    }

    /// Returns ln(k_lower/k_upper) of the widest and the narrowest spectrum.
    pub fn bandwidths(&self) -> [f64; 2] {
        let all = self.points.iter().map(|point| libm::log(point.small[self.bandwidth]));
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], one| {
            [least.min(one), most.max(one)]
        })
    }
}

/// Returns the points of each fit whose quantity is κ = `area_corrected / load` and whose terms are
/// those of 1/k_lower, k_lower/k_upper and k_upper/nodes.
pub fn kappa_points(fits: &[LimitsFit], setting: &Setting) -> Result<Vec<KappaPoints>, TableError> {
    let kappa = Expression::parse("area_corrected / load").expect("this is an expression");
    let mut all: Vec<KappaPoints> = Vec::new();
    for fit in fits {
        let LimitsFit { choices, window, table } = fit;
        let is_meant = choices.of == kappa && choices.error.is_none();
        let Some([cell, bandwidth, mesh]) = small_numbers(choices).filter(|_| is_meant) else {
            continue;
        };
        let Some(table) = corrected_as_in_2017(table, setting)? else {
            continue;
        };
        let groups = groups(&table, choices, *window)?;
        for group in &groups {
            let point = ParameterPoint::from_row(&table, group.row).only(&[HURST.name]);
            for load in group.loads.iter().flatten().copied() {
                let label = match groups.len() {
                    1 => format!("load {load}"),
                    _ => format!("{point}, load {load}"),
                };
                let points = KappaPoints {
                    points: group.points_under(Some(load)),
                    label,
                    load,
                    forms: forms(choices),
                    bandwidth,
                    cell,
                    mesh,
                };
                // Two stages may read the same rows.
                let is_new = all.iter().all(|known| known.label != points.label);
                all.extend(Some(points).filter(|points| is_new && !points.points.is_empty()));
            }
        }
    }
    Ok(all)
}

/// Returns the rows in the setting with the correction `2017`, or `None` if there are none.
fn corrected_as_in_2017(table: &Table, setting: &Setting) -> Result<Option<Table>, TableError> {
    if !table.has(CORRECTION.name) {
        return Ok(None);
    }
    let table = setting.rows(table);
    let corrections = table.texts(CORRECTION.name)?;
    let own: Vec<usize> =
        (0..table.rows()).filter(|&row| corrections.value(row) == OF_2017).collect();
    Ok((!own.is_empty()).then(|| table.pick(&own)))
}

/// Returns the indices of the terms of 1/k_lower, k_lower/k_upper and k_upper/nodes, or `None` if
/// the fit has other terms.
fn small_numbers(choices: &LimitChoices) -> Option<[usize; 3]> {
    let of = |columns: &[&str]| {
        let wanted: BTreeSet<&str> = columns.iter().copied().collect();
        choices.terms.iter().position(|term| term.of.columns() == wanted)
    };
    let all = [
        of(&[K_LOWER.name])?,
        of(&[K_LOWER.name, K_UPPER.name])?,
        of(&[K_UPPER.name, NODES.name])?,
    ];
    (choices.terms.len() == all.len()).then_some(all)
}

fn forms(choices: &LimitChoices) -> Vec<Vec<TermForm>> {
    let terms = choices.terms.iter();
    terms.map(|term| term.forms.iter().map(|form| form.term_form()).collect()).collect()
}

/// Law of κ as a function of 1/k_lower, k_lower/k_upper and k_upper/nodes.
pub struct KappaLaw<'a> {
    points: &'a KappaPoints,
    /// Form of each term. The term of k_lower/k_upper is a logarithm.
    forms: Vec<TermForm>,
    /// Middle of the range of ln(k_lower/k_upper).
    middle: f64,
}

impl<'a> KappaLaw<'a> {
    /// Selects the forms in the manifest whose fit has the smallest Akaike criterion. Returns
    /// `None` if no combination of forms can be fitted.
    pub fn best_fit(points: &'a KappaPoints) -> Option<KappaLaw<'a>> {
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
