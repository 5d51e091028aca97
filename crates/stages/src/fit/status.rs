//! Codes of the column `status`, which describes how a fit ended.
//!
//! Tables hold only the codes. The explanations of codes are attached when a table is published or
//! described. They can therefore be reworded without computing fits again.

use crate::columns::{columns, text};
use asperity_statistics::FitError;
use asperity_statistics::percolation::Channels;
use asperity_tables::column::{Code, Column};

columns! {
    /// how the fit ended, or why values are missing
    pub const STATUS: Column = text("status").with_codes(CODES);
}

/// Declares the codes of the column `status`, and lists them. The doc comment of a code is its
/// meaning, which users read.
macro_rules! status_codes {
    ($($(#[doc = $meaning:literal])+ $name:ident = $word:literal;)+) => {
        $($(#[doc = $meaning])+ pub const $name: Code =
            Code { word: $word, meaning: concat!($($meaning),+).trim_ascii_start() };)+

        /// All codes of the column `status`.
        pub const CODES: &[Code] = &[$($name),+];
    };
}

status_codes! {
    /// the fit succeeded
    FITTED = "fitted";
    /// the least-squares iteration did not converge, because the data do not determine the
    /// parameters; try another window, or give κ a value
    NOT_CONVERGED = "not-converged";
    /// the window contains fewer data than the law needs; widen the window or compute more loads in
    /// it
    TOO_FEW_DATA = "too-few-data";
    /// more than 20 % of the data have no logarithm, because the mean contact pressure does not
    /// increase or contact is full; try another window or another correction
    TOO_MANY_MASKED = "too-many-masked";
    /// all areas in the window are equal, so that the law cannot be fitted
    EQUAL_AREAS = "equal-areas";
    /// the mean gap does not decrease with the load in the window; choose loads under which the
    /// contact grows
    NO_DECAY = "no-decay";
    /// the least squares have no minimum at finite positive parameters, because the data do not
    /// have the curvature of the law: a parameter grows without bound or tends to zero; try another
    /// κ or another window
    UNBOUNDED = "unbounded";
    /// no κ gives μ = 1, because the slope of the area does not decrease enough in the window to
    /// bound κ
    NO_CONVEX_KAPPA = "no-convex-kappa";
    /// no parameter point that shares κ has a smallest κ with convex slope
    NO_COMMON_KAPPA = "no-common-kappa";
    /// the gap of some surface does not change from open to sealed in the window; compute lighter
    /// or heavier loads
    NOT_SEALED = "not-sealed";
    /// the same as `not-sealed`, but only for channels along x
    NOT_SEALED_X = "not-sealed-x";
    /// the same as `not-sealed`, but only for channels along y
    NOT_SEALED_Y = "not-sealed-y";
    /// areas are known on too few meshes to fit a line and estimate its error; sweep `nodes` over
    /// more values
    TOO_FEW_MESHES = "too-few-meshes";
    /// there is no contact on some mesh, or the perimeter is the same on all meshes, so that the
    /// area cannot be extrapolated
    NO_EDGES = "no-edges";
    /// there are fewer parameter points than free parameters; sweep the cutoffs or `nodes` over
    /// more values, or give exponents a value
    TOO_FEW_POINTS = "too-few-points";
    /// the terms cannot be distinguished: some are proportional, or one has the same value at all
    /// parameter points
    DEPENDENT_TERMS = "dependent-terms";
    /// a free exponent tends to zero, where a power becomes a logarithm, or to infinity; give the
    /// exponent a value or use the form `logarithm`
    NO_EXPONENT = "no-exponent";
    /// the small parameter of some term is not positive and finite at every parameter point
    INVALID_TERM = "invalid-term";
    /// the values of some parameter point do not differ between surfaces, so its weight is
    /// undefined; compute more surfaces
    NO_SCATTER = "no-scatter";
    /// the loads are not positive and ascending, or some area or κ is not finite
    INVALID_DATA = "invalid-data";
}

/// Returns the code that describes an error.
pub fn from_error(error: &FitError) -> Code {
    match error {
        FitError::Shape { .. }
        | FitError::Loads { .. }
        | FitError::Area { .. }
        | FitError::Kappa { .. } => INVALID_DATA,
        FitError::TooFew { .. } => TOO_FEW_DATA,
        FitError::Runaway { .. } => UNBOUNDED,
        FitError::NotConverged => NOT_CONVERGED,
        FitError::NoConvexKappa { .. } => NO_CONVEX_KAPPA,
        FitError::EqualAreas => EQUAL_AREAS,
        FitError::NoDecay => NO_DECAY,
        FitError::NotSealed { channels, .. } => match channels {
            Channels::AlongX => NOT_SEALED_X,
            Channels::AlongY => NOT_SEALED_Y,
            Channels::AlongBoth => NOT_SEALED,
        },
        FitError::TooFewMeshes => TOO_FEW_MESHES,
        FitError::NoEdges => NO_EDGES,
        FitError::NotSmall => INVALID_TERM,
        FitError::NoScatter => NO_SCATTER,
        FitError::TooFewPoints => TOO_FEW_POINTS,
        FitError::DependentTerms => DEPENDENT_TERMS,
        FitError::NoExponent => NO_EXPONENT,
        FitError::NoCommonKappa => NO_COMMON_KAPPA,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_a_single_word_and_unique() {
        let mut words: Vec<&str> = CODES.iter().map(|code| code.word).collect();
        assert!(words.iter().all(|word| !word.contains(' ')));
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), CODES.len());
    }
}
