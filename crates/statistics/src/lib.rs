//! Laws fitted to area curves, with intervals from resampled surfaces.
//!
//! Pure numerics: what goes in are the area fractions of the realizations of one parameter point on
//! a common grid of loads ([`Curves`]), what comes out are parameters and how well they do. Loads
//! are in units of E* × rms slope. A fit that fails is a [`FitError`], which says why.
//!
//! | module | holds |
//! |---|---|
//! | [`curves`] | area curves of realizations, and the data that a window takes from them |
//! | [`evolution`] | the contact evolution law by weighted least squares |
//! | [`convexity`] | the least κ for which the fitted slopes are convex, of one curve and of several |
//! | [`pressure_growth`] | the power law of dp̄/dp₀ against the area |
//! | [`load_separation`] | the exponential relation of load and mean gap |
//! | [`scaled_erf`] | Persson's error function with a scaled argument, near full contact |
//! | [`percolation`] | the load and the area from which on no channel leads through the gap |
//! | [`mesh_convergence`] | what the mesh adds to the area, from several meshes of one surface |
//! | [`limits`] | what an observable tends to where several small numbers vanish |
//! | [`self_affine`] | Hurst exponent and roll-off of measured power spectra |
//! | [`bootstrap`] | intervals of any of these, resampling whole surfaces |
//! | [`intervals`] | intervals of any function of surfaces by the jackknife, and Student's t |
//! | `least_squares` | Levenberg–Marquardt, linear least squares, a straight line, goodness of fit |
//! | [`random`] | seeded normal numbers for made-up data |

#![warn(missing_docs)]

pub mod bootstrap;
pub mod convexity;
pub mod curves;
pub mod evolution;
pub mod intervals;
mod least_squares;
pub mod limits;
pub mod load_separation;
pub mod mesh_convergence;
pub mod percolation;
pub mod pressure_growth;
pub mod random;
pub mod scaled_erf;
pub mod self_affine;

pub use curves::{Curves, Window};
pub use least_squares::{GoodnessOfFit, line};

/// Why there is no fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum FitError {
    #[error(
        "{surfaces} surfaces with areas under {areas} loads, where {loads} loads were given: \
             every surface needs one area per load"
    )]
    Shape {
        surfaces: usize,
        /// Areas of the first surface of another length, or of any if there are no loads.
        areas: usize,
        loads: usize,
    },
    #[error("load {position} is {load}: loads must be finite, positive and ascending")]
    Loads { position: usize, load: f64 },
    #[error("area of surface {surface} under load {load} is {area}: areas must be finite")]
    Area { surface: usize, load: f64, area: f64 },
    #[error(
        "{found} usable data with loads in {window}, the fit needs {needed}: \
             widen the window or compute more loads inside it"
    )]
    TooFew { window: Window, found: usize, needed: usize },
    #[error("kappa = {kappa} cannot be the slope of an area at zero load: it must be positive")]
    Kappa { kappa: f64 },
    /// The law cannot bend the way the data do: its parameters run away.
    #[error(
        "no contact evolution law with kappa = {kappa:.4} has its best beta and mu within \
             reach (stopped at beta = {beta:.3e}, mu = {mu:.3e}): the law only bends downwards \
             from kappa, try another kappa or a window where the slope of the area falls"
    )]
    Runaway { kappa: f64, beta: f64, mu: f64 },
    /// A search was given up: its parameters would say where the patience ended.
    #[error(
        "the least squares did not converge: the data do not tell the parameters apart, try \
             another window or a given kappa"
    )]
    NotConverged,
    #[error(
        "the fitted exponent mu never crosses one for kappa from {lower:.4} to {upper:.4}: the \
             slope of the area does not fall enough in {window} to bound kappa"
    )]
    NoConvexKappa { lower: f64, upper: f64, window: Window },
    #[error("the areas with loads in {window} are all equal: the law needs different ones")]
    EqualAreas { window: Window },
    #[error(
        "the mean gap does not fall with the load in {window}: an exponential relation of both \
             needs loads under which contact grows"
    )]
    NoDecay { window: Window },
    #[error(
        "{without} of {surfaces} surfaces are not seen to pass from an open gap to a sealed one along \
             {channels}, with loads in {window}: compute lighter or heavier ones"
    )]
    NotSealed { without: usize, surfaces: usize, channels: percolation::Channels, window: Window },
    #[error(
        "areas on {found} meshes, a line with something to judge it by needs {needed}: \
             sweep `nodes` over more"
    )]
    TooFewMeshes { found: usize, needed: usize },
    /// Contacts without an edge tell nothing of what the mesh does to it.
    #[error("on some mesh nothing touches, or the edge is equal on all: nothing to extrapolate")]
    NoEdges,
    #[error(
        "term {} is {value} at some point: what is to vanish must be above zero and finite",
        term + 1
    )]
    NotSmall {
        /// Which term, from zero.
        term: usize,
        value: f64,
    },
    /// A point without scatter has no weight.
    #[error(
        "a point has {surfaces} surfaces, or all agree: weights come from the scatter between \
             surfaces, so every point needs two that differ"
    )]
    NoScatter { surfaces: usize },
    #[error(
        "{found} points for {free} free parameters: sweep the cutoffs or `nodes` over more, or \
             free fewer"
    )]
    TooFewPoints { found: usize, free: usize },
    #[error(
        "the points do not tell the terms apart: some grow in proportion, or one is equal at all \
             points"
    )]
    DependentTerms,
    #[error(
        "the exponent of term {} ran to {exponent:.3e}: towards zero a power becomes a logarithm, \
             towards infinity it touches one point alone; give an exponent, or ask for a logarithm",
        term + 1
    )]
    NoExponent {
        /// Which term, from zero.
        term: usize,
        exponent: f64,
    },
    #[error("no curve of the {curves} has a least convex kappa: see the error of each")]
    NoCommonKappa { curves: usize },
}
