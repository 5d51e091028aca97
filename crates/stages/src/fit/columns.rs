//! Columns that the tables of all laws have, except the [status](super::status).

use crate::columns::{codes, columns, integer, parameter_text, real};
use asperity_tables::column::Column;

columns! {
    /// law that is fitted
    pub const LAW: Column = parameter_text("law").with_codes(codes![
        /// contact evolution law of Yastrebov, Anciaux & Molinari (2015)
        "contact-evolution",
        /// growth of the mean contact pressure p̄ with the load, dp̄/dp₀ = β a^(μ − 1)
        "mean-pressure",
        /// contact area a near full contact under the load y, a = erf(β √2 y)
        "scaled-erf",
        /// load as a function of the mean gap ū, p₀ = p_c exp(−ū/u₀)
        "load-separation",
        /// contact area of one surface on several meshes, A_N = A* + c S_d Δx
        "mesh-convergence",
        /// contact area and load at which the gap ceases to percolate
        "gap-percolation",
        /// power spectral density, C(q) = C₀ for q ≤ q_r and C₀ (q/q_r)^(−2(1 + H)) for q > q_r
        "self-affine",
        /// limit of an observable where small parameters vanish, Q = Q₀ + Σ cⱼ fⱼ(xⱼ)
        "limits",
    ]);
    /// number of surfaces in the fit
    pub const SURFACES: Column = integer("surfaces", "1");
    /// number of rows whose load did not converge; the fit includes them
    pub const UNCONVERGED: Column = integer("unconverged", "1");
    /// number of data that the law is fitted to
    pub const DATA: Column = integer("data", "1");
    /// root mean square residual
    pub const RMS_RESIDUAL: Column = real("rms_residual", "1");
    /// χ² divided by the degrees of freedom, with variances from the scatter between surfaces
    pub const CHI_SQUARE: Column = real("reduced_chi_square", "1");
    /// number of bootstrap resamplings of surfaces
    pub const BOOTSTRAP: Column = integer("bootstrap", "1");
    /// number of resamplings that could not be fitted
    pub const BOOTSTRAP_FAILED: Column = integer("bootstrap_failed", "1");
}
