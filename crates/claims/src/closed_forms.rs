//! Statements that need no study: claims on closed forms, whose quantities are exact, and misprints
//! of the paper, which have no verdict.

use crate::{Claim, ClaimOutcome, Expectation, Judgement, Origin, Statement};
use asperity_contact::grid::Grid;
use asperity_contact::theory::law::KAPPA_BGT;
use asperity_contact::theory::models::AsperityModel;
use asperity_contact::theory::models::{Asperities, Contact};
use asperity_contact::theory::persson;
use asperity_contact::topography::moments::Continuum;
use asperity_contact::topography::random::{Amplitude, RandomSurface};
use asperity_contact::topography::spectrum::Spectrum;
use asperity_statistics::intervals::{Bound, jackknife};

const SUMMITS: Statement = Statement {
    name: "tabulated-density-of-summits",
    origin: Origin::Paper,
    text: "the density of asperities D = (√3/18π) m₄/m₂, tabulated, from which “we can easily \
           compute the average distance between closest asperities”, ⟨d⟩ = 1/√D",
    source: "appendix A.2, eq. (19) of the preprint, table 3",
    quantity: "ratio of the number of summits counted on a cell of side 1 to D in integer \
               wavenumbers, as in the table, for k_lower 2, k_upper 8, twenty surfaces of 128² \
               nodes",
    expected: Expectation::Within(0.9, 1.1),
    reason: "a mesh of 16 nodes per shortest wavelength misses 3 % of the summits; with angular \
             wavenumbers, D is (2π)² = 39.5 times as large and correct",
    figure: None,
};

const ASYMPTOTE_OF_ALPHA: Statement = Statement {
    name: "asymptote-of-alpha",
    origin: Origin::Paper,
    text: "“For a high enough ratio ζ, a simple asymptotic may be used: α ∼ ζ^(2H).”",
    source: "section 3, appendix A.1, eq. (18) of the preprint",
    quantity: "(d ln α/d ln ζ)/(2H) at ζ = 10⁸, for H = 0.3 and 0.8",
    expected: Expectation::Within(0.99, 1.01),
    reason: "“∼” is read as a claim on the exponent; the prefactor 3(1 − H)²/(2H(2 − H)) is 1.44 \
             for H = 0.3 and 0.0625 for H = 0.8",
    figure: Some("nayak"),
};

const PERSSON_IS_CONCAVE: Statement = Statement {
    name: "persson-slope-is-concave",
    origin: Origin::Paper,
    text: "“in Persson's model the slope decreases as a concave function”",
    source: "section 5.2.2 at light load, section 9.6; inset of fig. 9",
    quantity: "d³A/dy³ of A = erf(√2 y), the second derivative of the slope, at loads up to 0.06",
    expected: Expectation::Within(f64::NEG_INFINITY, 0.0),
    reason: "only the sign counts; it changes at y = 1/2, where 68 % of the area is in contact",
    figure: Some("slope"),
};

const ALPHA_IN_BGT: Statement = Statement {
    name: "alpha-in-asperity-models",
    origin: Origin::Paper,
    text: "“the contact area for α = 10 is ≈ 30 % lower than for α = 2” (Bush, Gibson & Thomas)",
    source: "section 5.2, fig. 5",
    quantity: "1 − A(α = 10)/A(α = 2) in the model, at loads 0.01, 0.02, 0.04, 0.06",
    expected: Expectation::Within(0.25, 0.35),
    reason: "“≈ 30 %” is read as 25 to 35 %; in the model, the area for α = 10 is lower than for α \
             = 2 by 21 to 22 %; the paper also names the simplified elliptic model",
    figure: Some("area-light"),
};

const GREENWOOD: Statement = Statement {
    name: "greenwood-2006-far-from-its-asymptote",
    origin: Origin::Paper,
    text: "for “α = 10 and area fraction A/A₀ ≈ 10⁻⁵, the coefficient κ … underestimates the \
           asymptotic value by 12 %; if … A/A₀ ≈ 10⁻¹⁰ … by 4 %”",
    source: "section 5.1",
    quantity: "1 − κ/√(2π) for the secant κ of the simplified elliptic model, minus the printed \
               number, in percentage points",
    expected: Expectation::Within(-2.0, 2.0),
    reason: "two percentage points, because the areas are given with “≈”",
    figure: None,
};

pub fn of_closed_forms() -> Vec<Claim> {
    let persson = [0.005, 0.02, 0.04, 0.06];
    let persson =
        persson.map(|load| Bound::exact(format!("load {load}"), persson::slope_curvature(load)));
    vec![
        exact(ASYMPTOTE_OF_ALPHA, asymptote_of_alpha()),
        exact(GREENWOOD, simplified_elliptic()),
        exact(ALPHA_IN_BGT, alpha_in_bgt()),
        exact(PERSSON_IS_CONCAVE, persson.into()),
        summits(),
    ]
}

fn exact(statement: Statement, bounds: Vec<Bound>) -> Claim {
    judged(statement, "closed form, independent of the study", bounds)
}

fn judged(statement: Statement, data: &'static str, bounds: Vec<Bound>) -> Claim {
    let judgement = Judgement::new(statement.expected, bounds);
    Claim {
        statement,
        data,
        outcome: ClaimOutcome::Judged(judgement.expect("closed forms have values")),
    }
}

/// Judges the tabulated density of summits by counting summits: twenty small surfaces with one
/// narrow spectrum have about 90 well resolved summits each.
fn summits() -> Claim {
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
    let data = "twenty surfaces of its own, independent of the study";
    judged(SUMMITS, data, bound.into_iter().collect())
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

/// Returns the misprints, in the order of the paper.
pub fn misprints() -> Vec<Claim> {
    let noted = |statement: &Statement| Claim {
        statement: *statement,
        data: "the paper's print",
        outcome: ClaimOutcome::Noted,
    };
    MISPRINTS.iter().map(noted).collect()
}

const fn misprint(
    name: &'static str,
    source: &'static str,
    text: &'static str,
    reason: &'static str,
) -> Statement {
    Statement {
        name,
        origin: Origin::Misprint,
        text,
        source,
        quantity: "",
        expected: Expectation::Within(f64::NEG_INFINITY, f64::INFINITY),
        reason,
        figure: None,
    }
}

const MISPRINTS: [Statement; 9] = [
    misprint(
        "cutoffs-belong-to-the-spectrum",
        "section 3, eq. of the spectrum",
        "C if k_l < |k| < k_r",
        "appendix A.1 has k_l ≤ |k|; this only matters with a plateau, because without one the \
         second line includes k_l",
    ),
    misprint(
        "shortest-wavelength",
        "section 7",
        "λ_s = 2π/k_s",
        "k is the number of waves per side: λ_s = L/k_s, as defined in section 3",
    ),
    misprint(
        "p0-over-rms-slope",
        "section 4, twice; footnote of section 5.2.1; captions of figs. 12 and 13",
        "p₀ = 1.7 E*, p₀ ∈ [0; 0.06 E*]",
        "loads are p₀/(E* √⟨|∇h|²⟩), as in eqs. (5) and (6); for a slope of \
         0.02, 0.06 E* would be a load of 3, beyond full contact",
    ),
    misprint(
        "relative-error-is-absolute",
        "section 8, E(p₀)",
        "E(p₀) = (π/8) S_d Δx/A₀, “the relative error”",
        "45 % and “divided by two at about 30 %” hold for the error divided by the contact area A, \
         not by A₀, see largest-estimated-error",
    ),
    misprint(
        "eq-of-eta",
        "caption of fig. 10",
        "“the exponent η = 2 in Eq. (6)”",
        "η occurs in eq. (10)",
    ),
    misprint(
        "longest-wavelength-is-meant",
        "section 10",
        "“the lower cutoff wavenumber has to be high enough, i.e. the shortest wavelength has to be \
         significantly smaller than the period”",
        "the longest wavelength, L/k_l, is meant",
    ),
    misprint(
        "plateau-ratio",
        "appendix A.1",
        "“the ratios ξ = k_r/k_l”",
        "the formulas use ξ = k_l/k_r, as defined before them",
    ),
    misprint(
        "density-in-integer-wavenumbers",
        "appendix A.2, table 3",
        "the tabulated D, used in “⟨d⟩ = 1/√D”",
        "the table counts waves per side, but eq. (19) of the preprint requires angular \
         wavenumbers, so D lacks a factor of (2π)² and ⟨d⟩ a factor of 1/(2π); more than a \
         misprint, see tabulated-density-of-summits",
    ),
    misprint(
        "asymptote-of-itself",
        "section 5.1",
        "the prediction (7) “only slightly deviates from its asymptotics”",
        "eq. (6) is meant; it deviates by 0.24 % at the load 0.06",
    ),
];
