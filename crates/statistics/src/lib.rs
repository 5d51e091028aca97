//! Fits of laws of rough contact, with confidence intervals from resampled surfaces.
//!
//! The input of most fits is [`Curves`]: the area fractions of all realizations of one parameter
//! point under the same loads. Loads are in units of E* h′, where h′ is the rms slope. A fit
//! returns parameters and the goodness of fit, or a [`FitError`].
//!
//! | module | contents |
//! |---|---|
//! | [`curves`] | area curves of realizations, and windows of loads |
//! | [`evolution`] | contact evolution law by weighted least squares |
//! | [`convexity`] | least κ for which fitted slopes are convex, for one or several curves |
//! | [`pressure_growth`] | power law of dp̄/dp₀ against the area |
//! | [`load_separation`] | exponential relation of load and mean gap |
//! | [`scaled_erf`] | Persson's error function with a scaled argument, near full contact |
//! | [`percolation`] | load and area at the percolation threshold of the gap |
//! | [`mesh_convergence`] | error of the area due to the mesh, from several meshes of one surface |
//! | [`limits`] | limit of an observable as several small parameters vanish |
//! | [`self_affine`] | Hurst exponent and roll-off of measured power spectra |
//! | [`bootstrap`] | confidence intervals of fits by resampling whole surfaces |
//! | [`intervals`] | confidence intervals of functions of means by the jackknife |
//! | [`expectation`] | ranges in which quantities are expected, and verdicts |
//! | [`differences`] | differences of two means, paired or independent; many comparisons |
//! | [`discretization`] | error of a mean on a mesh or in a cell, from other meshes or cells |
//! | [`multilevel`] | means on a fine mesh from many surfaces on coarser ones |
//! | `least_squares` | Levenberg–Marquardt, linear least squares, goodness of fit |
//! | [`random`] | seeded normal random numbers for synthetic data |

#![warn(missing_docs)]
// Tests compare with tolerances.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod bootstrap;
pub mod convexity;
pub mod curves;
pub mod differences;
pub mod discretization;
pub mod evolution;
pub mod expectation;
pub mod intervals;
mod least_squares;
pub mod limits;
pub mod load_separation;
pub mod mesh_convergence;
pub mod multilevel;
pub mod percolation;
pub mod pressure_growth;
pub mod random;
pub mod scaled_erf;
pub mod self_affine;

pub use curves::{Curves, Window};
pub use least_squares::{GoodnessOfFit, line};

/// Reason why a fit failed. Tables have a code for each; the texts are those of
/// `EvolutionLaw.fit` in Python.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the error messages document the variants")]
pub enum FitError {
    #[error(
        "{surfaces} surfaces have areas under {areas} loads, but there are {loads} loads: \
             give one area per load for every surface"
    )]
    Shape {
        surfaces: usize,
        /// Number of areas of the first surface whose number of areas differs from `loads`; zero if
        /// there is no such surface.
        areas: usize,
        loads: usize,
    },
    #[error("the load at index {position} is {load}; loads must be finite, positive and ascending")]
    Loads { position: usize, load: f64 },
    #[error("the area of surface {surface} under load {load} is {area}; areas must be finite")]
    Area { surface: usize, load: f64, area: f64 },
    #[error(
        "{found} usable data with loads in {window}, but the fit needs {needed}: \
             widen the window or compute more loads inside it"
    )]
    TooFew { window: Window, found: usize, needed: usize },
    #[error(
        "kappa, the slope of the area at zero load, is {kappa}; it must be positive and finite"
    )]
    Kappa { kappa: f64 },
    /// The parameters diverge, because the law cannot have the curvature of the data.
    #[error(
        "the fit of the contact evolution law with kappa = {kappa:.4} diverges (stopped at \
             beta = {beta:.3e}, mu = {mu:.3e}): the slope of the law only decreases from kappa; \
             try another kappa, or a window where the slope of the area decreases"
    )]
    Runaway { kappa: f64, beta: f64, mu: f64 },
    /// The iteration ended before the sum of squares reached a minimum.
    #[error(
        "the least squares did not converge: the data do not determine the parameters; try \
             another window or a given kappa"
    )]
    NotConverged,
    #[error(
        "the fitted exponent mu does not cross one for kappa from {lower:.4} to {upper:.4}: the \
             slope of the area decreases too little in {window} to bound kappa; widen the window"
    )]
    NoConvexKappa { lower: f64, upper: f64, window: Window },
    #[error("all areas are equal")]
    EqualAreas,
    #[error("the mean gap does not decrease with the load")]
    NoDecay,
    #[error("the gap of a surface does not change from open to sealed at the loads of the window")]
    NotSealed { channels: percolation::Channels },
    #[error("there are too few meshes for a line with residuals")]
    TooFewMeshes,
    /// The perimeter term S_d Δx is the same on all meshes, or there is no contact on one of them.
    #[error("a mesh has no contact, or the perimeter times the mesh step is equal on all meshes")]
    NoEdges,
    #[error("a small parameter is not positive and finite")]
    NotSmall,
    /// The values of a point do not differ between surfaces, so its weight is undefined.
    #[error("the values of a point do not differ between surfaces")]
    NoScatter,
    #[error("there are too few points for the free parameters")]
    TooFewPoints,
    #[error("some terms are proportional, or one is equal at all points")]
    DependentTerms,
    #[error("a free exponent diverges")]
    NoExponent,
    #[error("no curve has a smallest kappa with convex slopes")]
    NoCommonKappa,
}
