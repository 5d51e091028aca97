//! Claims that closed forms decide, whatever the study: their quantities are exact.

use super::intervals::{Bound, RESAMPLING, simultaneous};
use super::quantities::judged;
use super::{Claim, Expectation};
use crate::contact::law::KAPPA_BGT;
use crate::contact::models::AsperityModel;
use crate::contact::models::asperities::{Asperities, Contact};
use crate::contact::nayak::Continuum;
use crate::contact::persson;
use crate::contact::spectrum::Spectrum;
use crate::contact::surface::{Amplitude, RandomSurface};

/// The claims, in the order of the paper.
pub fn claims() -> Vec<Claim> {
    vec![
        summits(),
        asymptote_of_alpha(),
        exact(
            "alpha-is-linear-at-one-half",
            "H = 1/2 is where α(ζ) changes from concave to convex: there it is linear (second \
             difference of α over ζ = 1, 2, 3, over the first).",
            Expectation::Within(-0.01, 0.01),
            vec![Bound::exact("H = 0.5", bend_of_alpha(0.5))],
        ),
        exact(
            "persson-slope-is-concave",
            "In Persson's theory the slope da/dy is a concave function of the load (d³a/dy³).",
            Expectation::Within(f64::NEG_INFINITY, 0.0),
            [0.06, 0.25, 0.45, 0.55, 1.0]
                .map(|load| Bound::exact(format!("load {load}"), persson::slope_curvature(load)))
                .into(),
        ),
        alpha_in_bgt(),
        simplified_elliptic(),
    ]
}

fn exact(
    name: &'static str,
    says: &'static str,
    expected: Expectation,
    bounds: Vec<Bound>,
) -> Claim {
    Claim {
        name,
        says,
        data: "closed form".to_owned(),
        outcome: judged(expected, Some(&bounds)),
    }
}

/// Twenty small surfaces of one narrow spectrum: some 90 summits each, well resolved.
fn summits() -> Claim {
    let (nodes, surfaces) = (128, 20);
    let density_over_counted = |realization: u32| {
        let surface = RandomSurface {
            spectrum: Spectrum {
                hurst: 0.8,
                k_lower: 2,
                k_rolloff: 2,
                k_upper: 8,
            },
            amplitude: Amplitude::Gaussian,
            rms_slope: 1.0,
            seed: RESAMPLING.seed,
            realization,
        };
        let tabulated = surface.moments(1.0).summit_density_integer(1.0);
        count_summits(nodes, surface.draw(nodes, 1.0).heights()) as f64 / tabulated
    };
    let ratios: Vec<f64> = (0..surfaces).map(density_over_counted).collect();
    let label = "H = 0.8, k_lower 2, k_upper 8".to_owned();
    let bounds = simultaneous(&[label], &[ratios.len()], |weights| {
        Some(vec![weights.mean(&ratios)])
    });
    Claim {
        name: "tabulated-density-of-summits",
        says: "The tabulated D, in integer wavenumbers, is the number of summits in the cell (summits \
               counted over D; with angular wavenumbers, D is (2π)² = 39.5 times as large).",
        data: "twenty surfaces drawn for it".to_owned(),
        outcome: judged(Expectation::Within(0.9, 1.1), bounds.as_deref()),
    }
}

/// Nodes higher than their eight neighbours, around the cell.
fn count_summits(nodes: usize, heights: &[f64]) -> usize {
    let at = |i: usize, j: usize| heights[(i % nodes) * nodes + j % nodes];
    let is_summit = |i: usize, j: usize| {
        let around = (0..3).flat_map(|a| (0..3).map(move |b| (a, b)));
        let mut neighbours = around.filter(|&offset| offset != (1, 1));
        neighbours.all(|(a, b)| at(i + nodes + a - 1, j + nodes + b - 1) < at(i, j))
    };
    let all = (0..nodes).flat_map(|i| (0..nodes).map(move |j| (i, j)));
    all.filter(|&(i, j)| is_summit(i, j)).count()
}

fn alpha(hurst: f64, magnification: f64) -> f64 {
    let continuum = Continuum {
        hurst,
        plateau: 1.0,
        magnification,
    };
    continuum.nayak()
}

fn asymptote_of_alpha() -> Claim {
    let bounds = [0.3, 0.8].map(|hurst| {
        let magnification: f64 = 1e12;
        let ratio = alpha(hurst, magnification) / magnification.powf(2.0 * hurst);
        Bound::exact(format!("H = {hurst}"), ratio)
    });
    exact(
        "asymptote-of-alpha",
        "For wide spectra α ∼ ζ^(2H), taken as an equality (α/ζ^(2H) at ζ = 10¹²); the prefactor is \
         3(1 − H)²/(2H(2 − H)).",
        Expectation::Within(0.9, 1.1),
        bounds.into(),
    )
}

fn bend_of_alpha(hurst: f64) -> f64 {
    let [one, two, three] = [1.0, 2.0, 3.0].map(|magnification| alpha(hurst, magnification));
    (three - 2.0 * two + one) / (two - one)
}

fn asperities(
    model: AsperityModel,
    nayak: f64,
    contact: &dyn Fn(&Asperities) -> Option<Contact>,
) -> f64 {
    let model = Asperities::new(model, nayak).expect("α is above 3/2");
    let contact = contact(&model).expect("the loads and areas are within reach");
    contact.secant()
}

fn alpha_in_bgt() -> Claim {
    let bounds = [0.01, 0.02, 0.04, 0.06].map(|load| {
        let secant =
            |nayak| asperities(AsperityModel::BushGibsonThomas, nayak, &|m| m.at_load(load));
        Bound::exact(format!("load {load}"), 1.0 - secant(10.0) / secant(2.0))
    });
    exact(
        "alpha-in-bgt",
        "In the model of Bush, Gibson & Thomas the area for α = 10 is 30 % less than for α = 2, to \
         five per cent of the area.",
        Expectation::Within(0.25, 0.35),
        bounds.into(),
    )
}

fn simplified_elliptic() -> Claim {
    let bounds = [(1e-5, 0.12), (1e-10, 0.04)].map(|(area, printed)| {
        let model = AsperityModel::SimplifiedElliptic;
        let secant = asperities(model, 10.0, &|m| m.at_area(area));
        let deficit = 1.0 - secant / KAPPA_BGT;
        Bound::exact(format!("area {area:e}"), deficit - printed)
    });
    exact(
        "greenwood-2006-far-from-its-asymptote",
        "In the simplified elliptic model with α = 10 the secant is 12 % below √(2π) at an area of \
         10⁻⁵ and 4 % below at 10⁻¹⁰ (deficit found less that printed, to half a per cent).",
        Expectation::Within(-0.005, 0.005),
        bounds.into(),
    )
}
