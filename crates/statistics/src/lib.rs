//! Laws fitted to area curves, with intervals from resampled surfaces.
//!
//! Pure numerics: what goes in are the area fractions of the realizations of one parameter point on
//! a common grid of loads ([`Curves`]), what comes out are parameters and how well they do.
//!
//! - [`evolution`]: the contact evolution law by weighted least squares;
//! - [`convexity`]: the least κ for which the fitted slopes are convex, of one curve and of several;
//! - [`pressure_growth`]: the power law of dp̄/dp₀ against the area;
//! - [`mesh_convergence`]: what the mesh adds to the area, from several meshes of one surface;
//! - [`limits`]: what an observable tends to where several small numbers vanish;
//! - [`load_separation`]: the exponential relation of load and mean gap;
//! - [`percolation`]: the load and the area from which on no channel leads through the gap;
//! - [`scaled_erf`]: Persson's error function with a scaled argument, near full contact;
//! - [`self_affine`]: Hurst exponent and roll-off of measured power spectra;
//! - [`bootstrap`]: intervals of any of these, resampling whole surfaces;
//! - [`student`]: intervals of means;
//! - [`intervals`]: confidence intervals of any function of surfaces, by the jackknife;
//! - [`random`]: seeded normal numbers for made-up data.
//!
//! Loads are in units of E* × rms slope. A fit that fails is a [`FitError`], which says why.

pub mod bootstrap;
pub mod convexity;
pub mod curves;
pub mod evolution;
#[cfg(test)]
mod examples;
mod goodness;
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
pub mod student;

pub use curves::{Curves, Window};
pub use goodness::GoodnessOfFit;
pub use least_squares::line;

/// Why there is no fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The areas do not belong to the loads, or there are none.
    #[error(
        "{surfaces} surfaces with areas under {areas} loads, where {loads} loads were given: \
             every surface needs one area per load"
    )]
    Shape {
        /// Realizations given.
        surfaces: usize,
        /// Areas of the first surface of another length, or of any if there are no loads.
        areas: usize,
        /// Loads given.
        loads: usize,
    },
    /// Loads are not positive and ascending.
    #[error("load {position} is {load}: loads must be finite, positive and ascending")]
    Loads {
        /// Index of the first offender.
        position: usize,
        /// Its value.
        load: f64,
    },
    /// An area is not a number.
    #[error("area of surface {surface} under load {load} is {area}: areas must be finite")]
    Area {
        /// Index of the surface.
        surface: usize,
        /// The load.
        load: f64,
        /// Its value.
        area: f64,
    },
    /// Fewer data than the fit can use.
    #[error(
        "{found} usable data with loads in {window}, the fit needs {needed}: \
             widen the window or compute more loads inside it"
    )]
    TooFew {
        /// Where they were looked for.
        window: Window,
        /// Data found.
        found: usize,
        /// Data needed.
        needed: usize,
    },
    /// A given κ is no proportionality.
    #[error("kappa = {kappa} cannot be the slope of an area at zero load: it must be positive")]
    Kappa {
        /// The value.
        kappa: f64,
    },
    /// The law cannot bend the way the data do: its parameters run away.
    #[error(
        "no contact evolution law with kappa = {kappa:.4} has its best beta and mu within \
             reach (stopped at beta = {beta:.3e}, mu = {mu:.3e}): the law only bends downwards \
             from kappa, try another kappa or a window where the slope of the area falls"
    )]
    Runaway {
        /// κ of the attempt.
        kappa: f64,
        /// β where the search stopped.
        beta: f64,
        /// μ where the search stopped.
        mu: f64,
    },
    /// A search was given up: its parameters would say where the patience ended.
    #[error(
        "the least squares did not converge: the data do not tell the parameters apart, try \
             another window or a given kappa"
    )]
    NotConverged,
    /// No κ makes the exponent of the fit cross one.
    #[error(
        "the fitted exponent mu never crosses one for kappa from {lower:.4} to {upper:.4}: the \
             slope of the area does not fall enough in {window} to bound kappa"
    )]
    NoConvexKappa {
        /// Least κ tried, the mean slope of the data.
        lower: f64,
        /// Largest κ tried.
        upper: f64,
        /// Where the data lie.
        window: Window,
    },
    /// All areas of a fit are equal.
    #[error("the areas with loads in {window} are all equal: the law needs different ones")]
    EqualAreas {
        /// Where the data lie.
        window: Window,
    },
    /// A mean gap that does not fall has no decay length.
    #[error(
        "the mean gap does not fall with the load in {window}: an exponential relation of both \
             needs loads under which contact grows"
    )]
    NoDecay {
        /// Where the data lie.
        window: Window,
    },
    /// Surfaces that do not pass from open to sealed have no threshold.
    #[error(
        "{without} of {surfaces} surfaces are not seen to pass from an open gap to a sealed one along \
             {channels}, with loads in {window}: compute lighter or heavier ones"
    )]
    NotSealed {
        /// Surfaces without a threshold.
        without: usize,
        /// All of them.
        surfaces: usize,
        /// Directions of the channels.
        channels: percolation::Channels,
        /// Where it was looked for.
        window: Window,
    },
    /// A line needs more meshes.
    #[error(
        "areas on {found} meshes, a line with something to judge it by needs {needed}: \
             sweep `nodes` over more"
    )]
    TooFewMeshes {
        /// Meshes given.
        found: usize,
        /// Meshes needed.
        needed: usize,
    },
    /// Contacts without an edge tell nothing of what the mesh does to it.
    #[error("on some mesh nothing touches, or the edge is equal on all: nothing to extrapolate")]
    NoEdges,
    /// A term of a limit needs a small number to vanish.
    #[error(
        "term {} is {value} at some point: what is to vanish must be above zero and finite",
        term + 1
    )]
    NotSmall {
        /// Which term, from zero.
        term: usize,
        /// Its value.
        value: f64,
    },
    /// A point without scatter has no weight.
    #[error(
        "a point has {surfaces} surfaces, or all agree: weights come from the scatter between \
             surfaces, so every point needs two that differ"
    )]
    NoScatter {
        /// Its surfaces.
        surfaces: usize,
    },
    /// Fewer points than parameters, or as many.
    #[error(
        "{found} points for {free} free parameters: sweep the cutoffs or `nodes` over more, or \
             free fewer"
    )]
    TooFewPoints {
        /// Points.
        found: usize,
        /// Free parameters.
        free: usize,
    },
    /// The design of a limit has no full rank.
    #[error(
        "the points do not tell the terms apart: some grow in proportion, or one is equal at all \
             points"
    )]
    DependentTerms,
    /// A free exponent runs away.
    #[error(
        "the exponent of term {} ran to {exponent:.3e}: towards zero a power becomes a logarithm, \
             towards infinity it touches one point alone; give an exponent, or ask for a logarithm",
        term + 1
    )]
    NoExponent {
        /// Which term, from zero.
        term: usize,
        /// Where the search stopped.
        exponent: f64,
    },
    /// Several curves were to share one κ, but none has one.
    #[error("no curve of the {curves} has a least convex kappa: see the error of each")]
    NoCommonKappa {
        /// Curves given.
        curves: usize,
    },
}
