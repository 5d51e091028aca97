//! Quantities of closed forms, which need no study and are exact.

use asperity_mechanics::grid::Grid;
use asperity_mechanics::theory::law::KAPPA_BGT;
use asperity_mechanics::theory::models::AsperityModel;
use asperity_mechanics::theory::models::{Asperities, Contact};
use asperity_mechanics::theory::persson;
use asperity_mechanics::topography::moments::Continuum;
use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
use asperity_mechanics::topography::spectrum::Spectrum;
use asperity_pipeline::study::claims::Statistic;
use asperity_statistics::intervals::{Bound, jackknife};

/// Returns the quantities of a closed form, or none if the statistic needs data.
pub fn bounds(statistic: Statistic) -> Vec<Bound> {
    match statistic {
        Statistic::AsymptoteOfAlpha => asymptote_of_alpha(),
        Statistic::GreenwoodDeficit => simplified_elliptic(),
        Statistic::AlphaInBgt => alpha_in_bgt(),
        Statistic::PerssonConcavity => {
            let loads = [0.005, 0.02, 0.04, 0.06];
            let bound = |load| Bound::exact(format!("load {load}"), persson::slope_curvature(load));
            loads.map(bound).into()
        }
        Statistic::SummitDensity => summits(),
        _ => Vec::new(),
    }
}

/// Returns the text of [`Claim::data`](crate::Claim::data).
pub fn data(statistic: Statistic) -> &'static str {
    match statistic {
        Statistic::SummitDensity => "twenty surfaces of its own, independent of the study",
        _ => "closed form, independent of the study",
    }
}

/// Compares the tabulated density of summits with counted summits: twenty small surfaces with one
/// narrow spectrum have about 90 well resolved summits each.
fn summits() -> Vec<Bound> {
    let (nodes, surfaces) = (128, 20);
    let grid = Grid::square(nodes, 1.0).expect("a square mesh on a cell of unit side is valid");
    let density_over_counted = |realization: u32| {
        let surface = RandomSurface {
            spectrum: Spectrum {
                hurst: 0.8,
                k_lower: 2,
                k_rolloff: 2,
                k_upper: 8,
                anisotropy: None,
            },
            amplitude: Amplitude::Gaussian,
            rms_slope: 1.0,
            seed: 2015,
            realization,
        };
        let tabulated = surface.moments(grid.cell()).summit_density_integer(grid.cell());
        count_summits(nodes, surface.draw(grid).heights()) as f64 / tabulated
    };
    let ratios: Vec<f64> = (0..surfaces).map(density_over_counted).collect();
    let label = "H 0.8, k_lower 2, k_upper 8".to_owned();
    let bound = jackknife(label, &[ratios.len()], |weights| Some(weights.mean(&ratios)));
    bound.into_iter().collect()
}

/// Counts the nodes that are higher than their eight neighbours on the periodic cell.
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

fn asymptote_of_alpha() -> Vec<Bound> {
    let bound = |hurst: f64| {
        let ln_alpha = |ln_magnification: f64| {
            let continuum =
                Continuum { hurst, plateau: 1.0, magnification: libm::exp(ln_magnification) };
            libm::log(continuum.nayak())
        };
        let (position, step) = (libm::log(1e8), 1e-3);
        let exponent = (ln_alpha(position + step) - ln_alpha(position - step)) / (2.0 * step);
        Bound::exact(format!("H {hurst}"), exponent / (2.0 * hurst))
    };
    [0.3, 0.8].map(bound).into()
}

fn asperities(
    model: AsperityModel,
    nayak: f64,
    contact: &dyn Fn(&Asperities) -> Option<Contact>,
) -> f64 {
    let model = Asperities::new(model, nayak).expect("α is above 3/2");
    let contact = contact(&model).expect("the model has a contact at these loads and areas");
    contact.secant()
}

fn alpha_in_bgt() -> Vec<Bound> {
    let bounds = [0.01, 0.02, 0.04, 0.06].map(|load| {
        let secant =
            |nayak| asperities(AsperityModel::BushGibsonThomas, nayak, &|m| m.at_load(load));
        Bound::exact(format!("load {load}"), 1.0 - secant(10.0) / secant(2.0))
    });
    bounds.into()
}

fn simplified_elliptic() -> Vec<Bound> {
    let bounds = [(1e-5, 12.0), (1e-10, 4.0)].map(|(area, printed)| {
        let model = AsperityModel::SimplifiedElliptic;
        let secant = asperities(model, 10.0, &|m| m.at_area(area));
        let deficit = 100.0 * (1.0 - secant / KAPPA_BGT);
        Bound::exact(format!("area {area:e}"), deficit - printed)
    });
    bounds.into()
}
