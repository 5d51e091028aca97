//! A claim of asperity on the flow through the gap: the pressure flow factor K/ū³, with the flow
//! conductivity K and the mean gap ū, depends on the contact area alone.
//!
//! A flow factor is the mean over both directions and over the surfaces of a spectrum. Its
//! logarithm is interpolated linearly in the mean area, which is corrected with the estimator
//! `2017`, between the two loads next to the area.

use crate::evidence::{Evidence, PerLoad, Spectrum};
use crate::gap::GREAT_CELL;
use crate::quantities::Quantities;
use crate::{Claim, Expectation, Origin, Statement};
use asperity_statistics::intervals::Weights;

const AREA_ALONE: Statement = Statement {
    name: "flow-depends-on-mean-gap-and-area-alone",
    origin: Origin::Ours,
    text: "The flow through the gap of an isotropic surface depends only on the mean gap and the \
           contact area, if the longest wavelength is much shorter than the cell.",
    source: "Wang & Müser, arXiv 2010.13470: “for isotropic roughness, we identify accurate \
             closed-form expressions, which only depend on the mean gap and the relative contact \
             area”; such an expression is the cube of the mean gap times a function of the area",
    quantity: "ln of the ratio of the pressure flow factor K/ū³ to that of the spectrum with the \
               smallest k_upper/k_lower, at the contact areas 0.05, 0.1 and 0.2, corrected as in \
               2017, k_lower ≥ 8",
    expected: Expectation::Within(-0.1, 0.1),
    reason: "“accurate” is read as 10 %",
    figure: Some("flow"),
};

/// Contact areas at which flow factors are compared.
const AREAS: [f64; 3] = [0.05, 0.1, 0.2];

const FLOWS: &str =
    "a `measure` stage of contacts with `flow = true` on spectra with `k_lower` of at least 8";
const SECOND_SPECTRUM: &str =
    "a second spectrum with `k_lower` of at least 8, and loads around the areas 0.05, 0.1 and 0.2";

pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    let films = films(evidence);
    let mut ratios = Quantities::default();
    if let Some((narrowest, others)) = films.split_first() {
        for other in others {
            let surfaces = [narrowest, other].map(|film| film.factors.surfaces());
            for area in AREAS {
                let label = format!("{}, area {area}", evidence.name(&other.areas.spectrum));
                ratios.add(label, &surfaces, |weights| {
                    Some(other.ln_factor(area, weights)? - narrowest.ln_factor(area, weights)?)
                });
            }
        }
    }
    let needs = if films.is_empty() { FLOWS } else { SECOND_SPECTRUM };
    vec![ratios.judge(AREA_ALONE, "flow through measured contacts", || needs.to_owned())]
}

/// Contact areas and flow factors of the surfaces of a spectrum, under the same loads.
struct Film {
    areas: PerLoad,
    factors: PerLoad,
}

/// Returns the flows of spectra without a plateau in large cells, ordered by k_upper/k_lower. Of
/// spectra with the same ratio, the largest cell is the first.
fn films(evidence: &Evidence) -> Vec<Film> {
    let areas = evidence.corrected_areas_along_loads();
    let of = |factors: PerLoad| {
        let areas = areas.iter().find(|areas| areas.spectrum == factors.spectrum)?;
        let areas = areas.at_loads(&factors.loads);
        (areas.loads == factors.loads).then_some(Film { areas, factors })
    };
    let mut films: Vec<Film> =
        evidence.flow_factors_along_loads().into_iter().filter_map(of).collect();
    films.retain(|film| {
        let spectrum = &film.factors.spectrum;
        spectrum.is_plain() && spectrum.k_lower >= GREAT_CELL
    });
    films.sort_by(|one, other| {
        let [a, b]: [&Spectrum; 2] = [one, other].map(|film| &film.factors.spectrum);
        let by_bandwidth = (a.k_upper * b.k_lower).cmp(&(b.k_upper * a.k_lower));
        by_bandwidth.then(b.k_lower.cmp(&a.k_lower)).then(a.hurst.total_cmp(&b.hurst))
    });
    films
}

impl Film {
    /// Returns the logarithm of the flow factor at a contact area between those of two loads.
    fn ln_factor(&self, area: f64, weights: &Weights) -> Option<f64> {
        let mean = |values: &[Vec<f64>], load: usize| weights.mean(&values[load]);
        let after = (0..self.areas.loads.len())
            .find(|&load| mean(&self.areas.values, load) >= area)
            .filter(|&load| load > 0)?;
        let [low, high] = [after - 1, after].map(|load| mean(&self.areas.values, load));
        let [of_low, of_high] =
            [after - 1, after].map(|load| libm::log(mean(&self.factors.values, load)));
        let share = (area - low) / (high - low);
        Some(of_low + share * (of_high - of_low)).filter(|value| value.is_finite())
    }
}
