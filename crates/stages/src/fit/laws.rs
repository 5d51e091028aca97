//! Laws that can be fitted. Every `match` on laws is in this file.
//!
//! A law that has no settings is one variant of [`PlainLaw`] and one [`LawDefinition`]. Its
//! numerics are in [`asperity_statistics`].

use std::sync::Arc;

use serde::Serialize;

use crate::columns::columns;
use crate::fit::Params;
use crate::fit::contact_evolution::{self, EvolutionChoices};
use crate::fit::fitted_point::{FitParameter, FittedPoint, names};
use crate::fit::limits::{self, LimitChoices};
use asperity_manifest::expression::Expression;
use asperity_statistics::FitError;
use asperity_statistics::curves::Curves;
use asperity_statistics::load_separation::LoadSeparationProblem;
use asperity_statistics::pressure_growth::PressureGrowthProblem;
use asperity_statistics::scaled_erf::ScaledErfProblem;

/// A law with its settings.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Law {
    /// The contact evolution law of Yastrebov, Anciaux & Molinari (2015).
    ContactEvolution(EvolutionChoices),
    /// The limit of an observable for vanishing parameters.
    Limits(Arc<LimitChoices>),
    /// A law that has no settings, only parameters.
    Plain(PlainLaw),
}

/// A law that has no settings, only parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(tag = "law", rename_all = "kebab-case")]
pub enum PlainLaw {
    /// dp̄/dp₀ = β a^(μ − 1), for the mean contact pressure p̄.
    MeanPressure,
    /// a = erf(β √2 y), near full contact.
    ScaledErf,
    /// p₀ = p_c exp(−ū/u₀), for the mean gap ū.
    LoadSeparation,
    /// A_N = A* + c S_d Δx, over meshes of the same surfaces.
    MeshConvergence,
    /// The load and the area at which the gap stops percolating.
    GapPercolation,
    /// C(q) = C₀ up to the roll-off q_r and C₀ (q/q_r)^(−2(1 + H)) beyond it, for measured spectra.
    SelfAffine,
}

/// The definition of a plain law.
pub struct LawDefinition {
    /// Name of the law in manifests and tables.
    pub word: &'static str,
    /// Description of the law for editors and the guide.
    pub about: &'static str,
    /// Default of the key `window`: smallest and largest load of the fit in units of E* × rms slope
    /// or, for spectra, smallest and largest wavenumber.
    pub window: [f64; 2],
    /// Fitted parameters, in the order of their values.
    pub parameters: &'static [FitParameter],
    /// Data to which the law is fitted.
    pub fits: Fits,
}

/// Data to which a law is fitted. A variant for several laws holds the function that fits the law.
#[derive(Clone, Copy)]
pub enum Fits {
    /// Contact areas of the surfaces of one parameter point.
    Areas(FitOfCurves),
    /// Mean gaps of the surfaces of one parameter point. Only rows of measured contacts contain
    /// mean gaps.
    Gaps(FitOfCurves),
    /// Contact areas on several meshes of the same surfaces, at all parameter points together.
    Meshes,
    /// Percolation of the gaps of the surfaces of one parameter point.
    Percolation,
    /// Power spectra of the surfaces of one parameter point.
    Spectra,
}

/// Function that fits a law to the curves of the surfaces of one parameter point.
pub type FitOfCurves = fn(&Curves, &Params) -> Result<FittedPoint, FitError>;

impl PlainLaw {
    /// All plain laws, in the order of the documentation.
    pub const ALL: [PlainLaw; 6] = [
        PlainLaw::MeanPressure,
        PlainLaw::ScaledErf,
        PlainLaw::LoadSeparation,
        PlainLaw::MeshConvergence,
        PlainLaw::GapPercolation,
        PlainLaw::SelfAffine,
    ];

    /// Returns the definition of the law.
    pub fn definition(self) -> LawDefinition {
        match self {
            PlainLaw::MeanPressure => LawDefinition {
                word: "mean-pressure",
                about: "dp̄/dp₀ = β a^(μ − 1), the growth of the mean contact pressure p̄.",
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
                about: "p₀ = p_c exp(−ū/u₀), for the mean gap ū.",
                // Here the mean gap decreases in proportion to the logarithm of the load.
                window: [0.01, 0.1],
                parameters: &[DECAY_LENGTH, CLOSING_LOAD],
                fits: Fits::Gaps(load_separation),
            },
            PlainLaw::MeshConvergence => LawDefinition {
                word: "mesh-convergence",
                about: "a_N = a* + c S_d Δx/L², the effect of the mesh on the area, from meshes of the same surfaces.",
                // All loads: under ten times E* × rms slope every surface is in full contact.
                window: [0.0, 10.0],
                parameters: &[MESH_COEFFICIENT],
                fits: Fits::Meshes,
            },
            PlainLaw::GapPercolation => LawDefinition {
                word: "gap-percolation",
                about: "The load and the area at which the last channel through the gap closes.",
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
                about: "C(q) = C₀ up to q_r and C₀ (q/q_r)^(−2(1 + H)) beyond it, for measured spectra.",
                // All wavenumbers.
                window: [0.0, 1e30],
                parameters: &[HURST_EXPONENT, ROLLOFF, PLATEAU_DENSITY],
                fits: Fits::Spectra,
            },
        }
    }
}

impl Law {
    /// Returns the name of the law in manifests and tables.
    pub fn word(&self) -> &'static str {
        match self {
            Law::ContactEvolution(_) => contact_evolution::WORD,
            Law::Limits(_) => limits::WORD,
            Law::Plain(law) => law.definition().word,
        }
    }

    /// Returns the observable of a fit of limits.
    pub fn observable(&self) -> Option<&Expression> {
        match self {
            Law::Limits(choices) => Some(&choices.of),
            Law::ContactEvolution(_) | Law::Plain(_) => None,
        }
    }

    /// Returns the fitted parameters, in the order of their values. Returns an empty list for
    /// [`Law::Limits`], because the parameters of a limit depend on its terms.
    pub fn parameters(&self) -> &'static [FitParameter] {
        match self {
            Law::ContactEvolution(_) => &contact_evolution::PARAMETERS,
            Law::Limits(_) => &[],
            Law::Plain(law) => law.definition().parameters,
        }
    }
}

/// Returns the parameters of all laws.
pub fn parameters() -> impl Iterator<Item = FitParameter> {
    let plain =
        PlainLaw::ALL.into_iter().flat_map(|law| law.definition().parameters.iter().copied());
    let plain = contact_evolution::PARAMETERS.into_iter().chain(plain);
    plain.chain(limits::columns::parameters())
}

columns! {
    /// exponent μ − 1 of dp̄/dp₀ = β a^(μ − 1), with the mean contact pressure p̄ and the area
    /// fraction a
    const EXPONENT: FitParameter = FitParameter::number(names!("exponent")).with_label("exponent");
    /// prefactor β of dp̄/dp₀ = β a^(μ − 1)
    const PREFACTOR: FitParameter = FitParameter::number(names!("prefactor"));
    /// scale β of the area fraction a = erf(β √2 y); it is 1 in Persson's theory
    const ERF_SCALE: FitParameter = FitParameter::number(names!("erf_scale")).with_label("scale");
    /// u₀ of p₀ = p_c exp(−ū/u₀): decrease of the mean gap ū when the load grows by the factor e
    const DECAY_LENGTH: FitParameter =
        FitParameter::of_unit("length", names!("decay_length")).with_label("u₀");
    /// p_c of p₀ = p_c exp(−ū/u₀): load at which the law gives a mean gap of zero
    const CLOSING_LOAD: FitParameter =
        FitParameter::of_unit("E* × rms slope", names!("closing_load")).with_label("p_c");
    /// coefficient c of the mesh error in A_N = A* + c S_d Δx, with the counted area A_N, the
    /// Manhattan perimeter S_d and the mesh step Δx
    const MESH_COEFFICIENT: FitParameter =
        FitParameter::number(names!("mesh_coefficient")).with_label("c");
    /// fraction of the nodes in contact at which the gap stops percolating, averaged over the
    /// surfaces and over both directions; null where the surfaces are not drawn from an isotropic
    /// spectrum
    const PERCOLATION_AREA: FitParameter = FitParameter::number(names!("percolation_area"));
    /// contact area fraction, corrected for the mesh with the correction `2017`, at which the gap
    /// stops percolating; averaged and null like `percolation_area`, and null with adhesion, for
    /// which the coefficient is not measured
    const PERCOLATION_AREA_CORRECTED: FitParameter =
        FitParameter::number(names!("percolation_area_corrected"))
            .with_label("sealed from a corrected area of");
    /// load at which the gap stops percolating, averaged over the surfaces and over both
    /// directions; null where the surfaces are not drawn from an isotropic spectrum
    const PERCOLATION_LOAD: FitParameter =
        FitParameter::of_unit("E* × rms slope", names!("percolation_load"))
            .with_label("sealed from a load of");
    /// fraction of the nodes in contact at which the gap stops percolating along x, averaged over
    /// the surfaces
    const PERCOLATION_AREA_X: FitParameter = FitParameter::number(names!("percolation_area_x"));
    /// contact area fraction, corrected for the mesh with the correction `2017`, at which the gap
    /// stops percolating along x, averaged over the surfaces; null with adhesion
    const PERCOLATION_AREA_CORRECTED_X: FitParameter =
        FitParameter::number(names!("percolation_area_corrected_x"))
            .with_label("sealed along x from a corrected area of");
    /// load at which the gap stops percolating along x, averaged over the surfaces
    const PERCOLATION_LOAD_X: FitParameter =
        FitParameter::of_unit("E* × rms slope", names!("percolation_load_x"));
    /// fraction of the nodes in contact at which the gap stops percolating along y, averaged over
    /// the surfaces
    const PERCOLATION_AREA_Y: FitParameter = FitParameter::number(names!("percolation_area_y"));
    /// contact area fraction, corrected for the mesh with the correction `2017`, at which the gap
    /// stops percolating along y, averaged over the surfaces; null with adhesion
    const PERCOLATION_AREA_CORRECTED_Y: FitParameter =
        FitParameter::number(names!("percolation_area_corrected_y"))
            .with_label("sealed along y from a corrected area of");
    /// load at which the gap stops percolating along y, averaged over the surfaces
    const PERCOLATION_LOAD_Y: FitParameter =
        FitParameter::of_unit("E* × rms slope", names!("percolation_load_y"));
    /// Hurst exponent H of the measured spectrum, C ∝ q^(−2(1 + H)) beyond the roll-off; for a
    /// single surface, its confidence interval assumes independent modes
    const HURST_EXPONENT: FitParameter =
        FitParameter::number(names!("hurst_exponent")).with_label("H");
    /// roll-off q_r: angular wavenumber up to which the measured spectrum is constant; null where
    /// the spectrum already decreases from its first ring of wavenumbers
    const ROLLOFF: FitParameter =
        FitParameter::of_unit("1/length", names!("rolloff_wavenumber")).with_label("q_r");
    /// spectral density C₀ up to the roll-off; null without a roll-off
    const PLATEAU_DENSITY: FitParameter =
        FitParameter::of_unit("length⁴", names!("plateau_density"));
}

fn mean_pressure(curves: &Curves, params: &Params) -> Result<FittedPoint, FitError> {
    let problem = PressureGrowthProblem::new(curves, params.window());
    let fit = problem.fit()?;
    let intervals = problem.bootstrap(&fit, &params.bootstrap());
    let row = FittedPoint::fitted(vec![fit.exponent, fit.prefactor], &fit.goodness, intervals);
    Ok(row.unless_masked())
}

fn scaled_erf(curves: &Curves, params: &Params) -> Result<FittedPoint, FitError> {
    let problem = ScaledErfProblem::new(curves, params.window());
    let fit = problem.fit()?;
    let intervals = problem.bootstrap(&fit, &params.bootstrap());
    let row = FittedPoint::fitted(vec![fit.beta], &fit.goodness, intervals);
    Ok(row.unless_masked())
}

fn load_separation(gaps: &Curves, params: &Params) -> Result<FittedPoint, FitError> {
    let problem = LoadSeparationProblem::new(gaps, params.window());
    let fit = problem.fit()?;
    let intervals = problem.bootstrap(&fit, &params.bootstrap());
    let row =
        FittedPoint::fitted(vec![fit.decay_length, fit.closing_load], &fit.goodness, intervals);
    Ok(row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::contact_evolution::{Datum, Kappa};

    /// A different serialisation would change the keys of all stored fits, so that they would be
    /// computed again.
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
