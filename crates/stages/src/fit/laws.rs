//! The laws that can be fitted; every `match` on them is here.
//!
//! A law that has nothing free but its own parameters is one variant of [`PlainLaw`] and one
//! [`LawDefinition`]; its numerics are in [`fitting`](asperity_statistics).

use std::sync::Arc;

use serde::Serialize;

use super::Params;
use super::contact_evolution::{self, EvolutionChoices};
use super::limits::{self, LimitChoices};
use super::rows::{Parameter, Row, names};
use asperity_statistics::FitError;
use asperity_statistics::curves::Curves;
use asperity_statistics::load_separation::LoadSeparationProblem;
use asperity_statistics::pressure_growth::PressureGrowthProblem;
use asperity_statistics::scaled_erf::ScaledErfProblem;

/// A law and what is free in it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Law {
    /// The contact evolution law of Yastrebov, Anciaux & Molinari (2015).
    ContactEvolution(EvolutionChoices),
    /// What an observable tends to where small numbers vanish.
    Limits(Arc<LimitChoices>),
    /// A law that has nothing free but its own parameters.
    Plain(PlainLaw),
}

/// A law that has nothing free but its own parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(tag = "law", rename_all = "kebab-case")]
pub enum PlainLaw {
    /// dp̄/dp₀ = β a^(μ − 1).
    MeanPressure,
    /// a = erf(β √2 y), near full contact.
    ScaledErf,
    /// p₀ = p_c exp(−ū/u₀), of the mean gap ū.
    LoadSeparation,
    /// A_N = A* + c S_d Δx, over meshes of the same surfaces.
    MeshConvergence,
    /// The load and the area from which on the gap does not percolate.
    GapPercolation,
    /// C(q) = C₀ up to the roll-off q_r, C₀ (q/q_r)^(−2(1 + H)) beyond, of measured spectra.
    SelfAffine,
}

/// What is known of a plain law.
pub struct LawDefinition {
    /// The word in manifests and tables.
    pub word: &'static str,
    /// What it is, in a sentence for editors and the guide.
    pub about: &'static str,
    /// Smallest and largest load that count when none are given, in units of E* × rms slope.
    pub window: [f64; 2],
    pub parameters: &'static [Parameter],
    pub fits: Fits,
}

/// What a law is fitted to, and how.
#[derive(Clone, Copy)]
pub enum Fits {
    /// The areas of the surfaces of one parameter point.
    Areas(FitOfCurves),
    /// Their mean gaps; only measured contacts have any.
    Gaps(FitOfCurves),
    /// Areas on several meshes of the same surfaces, at all parameter points at once.
    Meshes,
    /// Whether the gaps of the surfaces of one parameter point percolate.
    Percolation,
    /// Power spectra of the surfaces of one parameter point.
    Spectra,
}

/// Fits the curves of the surfaces of one parameter point.
pub type FitOfCurves = fn(&Curves, &Params) -> Result<Row, FitError>;

impl PlainLaw {
    /// Every one.
    pub const ALL: [PlainLaw; 6] = [
        PlainLaw::MeanPressure,
        PlainLaw::ScaledErf,
        PlainLaw::LoadSeparation,
        PlainLaw::MeshConvergence,
        PlainLaw::GapPercolation,
        PlainLaw::SelfAffine,
    ];

    /// What is known of it.
    pub fn definition(self) -> LawDefinition {
        match self {
            PlainLaw::MeanPressure => LawDefinition {
                word: "mean-pressure",
                about: "dp̄/dp₀ = β a^(μ − 1): the growth of the mean contact pressure.",
                window: contact_evolution::WINDOW,
                parameters: &[EXPONENT, PREFACTOR],
                fits: Fits::Areas(mean_pressure),
            },
            PlainLaw::ScaledErf => LawDefinition {
                word: "scaled-erf",
                about: "a = erf(β√2 y), near full contact.",
                window: [0.3, 2.0],
                parameters: &[ERF_SCALE],
                fits: Fits::Areas(scaled_erf),
            },
            PlainLaw::LoadSeparation => LawDefinition {
                word: "load-separation",
                about: "p₀ = p_c exp(−ū/u₀), of the mean gap ū.",
                // Where the mean gap falls in proportion to the logarithm of the load.
                window: [0.01, 0.1],
                parameters: &[DECAY_LENGTH, CLOSING_LOAD],
                fits: Fits::Gaps(load_separation),
            },
            PlainLaw::MeshConvergence => LawDefinition {
                word: "mesh-convergence",
                about: "a_N = a* + c S_d Δx/L², over meshes of the same surfaces.",
                // No surface is out of full contact under ten times its rms slope × E*.
                window: [0.0, 10.0],
                parameters: &[MESH_COEFFICIENT],
                fits: Fits::Meshes,
            },
            PlainLaw::GapPercolation => LawDefinition {
                word: "gap-percolation",
                about: "The load and the area from which on no channel leads through the gap.",
                window: [0.0, 10.0],
                parameters: &[
                    PERCOLATION_AREA,
                    PERCOLATION_AREA_CORRECTED,
                    PERCOLATION_LOAD,
                    PERCOLATION_AREA_X,
                    PERCOLATION_AREA_CORRECTED_X,
                    PERCOLATION_LOAD_X,
                    PERCOLATION_AREA_Y,
                    PERCOLATION_AREA_CORRECTED_Y,
                    PERCOLATION_LOAD_Y,
                ],
                fits: Fits::Percolation,
            },
            PlainLaw::SelfAffine => LawDefinition {
                word: "self-affine",
                about: "C(q) = C₀ up to q_r, C₀ (q/q_r)^(−2(1 + H)) beyond, of measured spectra.",
                // Of wavenumbers: all that a quantity may be.
                window: [0.0, 1e30],
                parameters: &[HURST_EXPONENT, ROLLOFF, PLATEAU_DENSITY],
                fits: Fits::Spectra,
            },
        }
    }
}

impl Law {
    /// The word in manifests and tables.
    pub fn word(&self) -> &'static str {
        match self {
            Law::ContactEvolution(_) => contact_evolution::WORD,
            Law::Limits(_) => limits::WORD,
            Law::Plain(law) => law.definition().word,
        }
    }

    /// Its parameters, in the order of their values; those of limits depend on their terms, and
    /// their tables are written elsewhere.
    pub fn parameters(&self) -> &'static [Parameter] {
        match self {
            Law::ContactEvolution(_) => &contact_evolution::PARAMETERS,
            Law::Limits(_) => &[],
            Law::Plain(law) => law.definition().parameters,
        }
    }
}

/// The parameters of every law.
pub fn parameters() -> impl Iterator<Item = Parameter> {
    let plain = PlainLaw::ALL.into_iter();
    let plain = plain.flat_map(|law| law.definition().parameters.iter().copied());
    let plain = contact_evolution::PARAMETERS.into_iter().chain(plain);
    plain.chain(limits::columns::parameters())
}

const EXPONENT: Parameter =
    Parameter::number(names!("exponent"), "exponent of dp̄/dp₀ as a power of the area, μ − 1")
        .with_label("exponent");
const PREFACTOR: Parameter =
    Parameter::number(names!("prefactor"), "prefactor of dp̄/dp₀ as a power of the area, β");
const ERF_SCALE: Parameter =
    Parameter::number(names!("erf_scale"), "β of a = erf(β √2 y); 1 in Persson's theory")
        .with_label("scale");
const DECAY_LENGTH: Parameter = Parameter::of_unit(
    "length",
    names!("decay_length"),
    "u₀ of p₀ = p_c exp(−ū/u₀): how much the mean gap falls while the load grows by the factor e",
)
.with_label("u₀");
const CLOSING_LOAD: Parameter = Parameter::of_unit(
    "E* × rms slope",
    names!("closing_load"),
    "p_c of p₀ = p_c exp(−ū/u₀): the load at which the exponential has no gap left",
)
.with_label("p_c");
const MESH_COEFFICIENT: Parameter = Parameter::number(
    names!("mesh_coefficient"),
    "c of A_N = A* + c S_d Δx: the share of S_d Δx that the mesh adds",
)
.with_label("c");
const PERCOLATION_AREA: Parameter = Parameter::number(
    names!("percolation_area"),
    "share of the nodes in contact from which on no channel of gap leads through, mean of surfaces and \
     of both directions; null where the surfaces are not drawn from an isotropic spectrum",
);
const PERCOLATION_AREA_CORRECTED: Parameter = Parameter::number(
    names!("percolation_area_corrected"),
    "the same share of the area, corrected for the mesh as by the correction `2017`",
)
.with_label("sealed from an area of");
const PERCOLATION_LOAD: Parameter = Parameter::of_unit(
    "E* × rms slope",
    names!("percolation_load"),
    "load from which on no channel of gap leads through, mean of surfaces and of both directions; \
     null where the surfaces are not drawn from an isotropic spectrum",
);

/// The parameters of the gap's percolation along one axis.
macro_rules! percolation_along {
    ($axis:literal: $area:ident, $area_corrected:ident, $load:ident) => {
        const $area: Parameter = Parameter::number(
            names!("percolation_area_", $axis),
            concat!(
                "share of the nodes in contact from which on no channel of gap leads through along ",
                $axis,
                ", mean of surfaces",
            ),
        );
        const $area_corrected: Parameter = Parameter::number(
            names!("percolation_area_corrected_", $axis),
            concat!(
                "the same share along ",
                $axis,
                ", corrected for the mesh as by the correction `2017`",
            ),
        )
        .with_label(concat!("sealed along ", $axis, " from"));
        const $load: Parameter = Parameter::of_unit(
            "E* × rms slope",
            names!("percolation_load_", $axis),
            concat!(
                "load from which on no channel of gap leads through along ",
                $axis,
                ", mean of surfaces",
            ),
        );
    };
}

percolation_along!("x": PERCOLATION_AREA_X, PERCOLATION_AREA_CORRECTED_X, PERCOLATION_LOAD_X);
percolation_along!("y": PERCOLATION_AREA_Y, PERCOLATION_AREA_CORRECTED_Y, PERCOLATION_LOAD_Y);

const HURST_EXPONENT: Parameter = Parameter::number(
    names!("hurst_exponent"),
    "Hurst exponent H of the measured spectrum, C ∝ q^(−2(1 + H)) beyond the roll-off; of a single \
     surface its interval is that of independent modes",
)
.with_label("H");
const ROLLOFF: Parameter = Parameter::of_unit(
    "1/length",
    names!("rolloff_wavenumber"),
    "angular wavenumber up to which the measured spectrum is flat; null where it falls from its first \
     ring on",
)
.with_label("q_r");
const PLATEAU_DENSITY: Parameter =
    Parameter::of_unit("length⁴", names!("plateau_density"), "spectral density up to the roll-off");

fn mean_pressure(curves: &Curves, params: &Params) -> Result<Row, FitError> {
    let problem = PressureGrowthProblem::new(curves, params.window());
    let fit = problem.fit()?;
    let intervals = problem.bootstrap(&fit, &params.bootstrap());
    let row = Row::fitted(vec![fit.exponent, fit.prefactor], &fit.goodness, intervals);
    Ok(row.unless_masked())
}

fn scaled_erf(curves: &Curves, params: &Params) -> Result<Row, FitError> {
    let problem = ScaledErfProblem::new(curves, params.window());
    let fit = problem.fit()?;
    let intervals = problem.bootstrap(&fit, &params.bootstrap());
    let row = Row::fitted(vec![fit.beta], &fit.goodness, intervals);
    Ok(row.unless_masked())
}

fn load_separation(gaps: &Curves, params: &Params) -> Result<Row, FitError> {
    let problem = LoadSeparationProblem::new(gaps, params.window());
    let fit = problem.fit()?;
    let intervals = problem.bootstrap(&fit, &params.bootstrap());
    let row = Row::fitted(vec![fit.decay_length, fit.closing_load], &fit.goodness, intervals);
    Ok(row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::contact_evolution::{Datum, Kappa};

    /// Keys are made of these texts: other texts would compute every fit again.
    #[test]
    fn a_fit_is_written_as_it_always_was() {
        let written = |law: Law| {
            let params = Params { law, window: [0.0, 0.06], bootstrap: 10, level: 0.95, seed: 3 };
            serde_json::to_string(&params).unwrap()
        };
        let rest = r#""window":[0.0,0.06],"bootstrap":10,"level":0.95,"seed":3}"#;
        let evolution =
            |kappa| written(Law::ContactEvolution(EvolutionChoices { to: Datum::Slope, kappa }));
        for (kappa, text) in [
            (Kappa::Free, r#""free""#),
            (Kappa::Given(2.5), r#"{"given":2.5}"#),
            (Kappa::MinimalConvex, r#""minimal-convex""#),
        ] {
            let text = format!(r#"{{"law":"contact-evolution","to":"slope","kappa":{text},{rest}"#);
            assert_eq!(evolution(kappa), text);
        }
        for law in PlainLaw::ALL {
            let word = law.definition().word;
            assert_eq!(written(Law::Plain(law)), format!(r#"{{"law":"{word}",{rest}"#));
        }
    }
}
