//! Adhesive contact: a hard wall and an attraction that decays exponentially with the gap.
//!
//! The gap is g = u − h − δ, as in [`solver`](crate::solver). The interaction energy per area is
//!
//! φ(g) = −w exp(−g/ρ), g ≥ 0,
//!
//! with the work of adhesion w and the range ρ (Müser et al., *Tribol. Lett.* 65, 2017, 118; Rey,
//! Anciaux & Molinari, *Comput. Mech.* 60, 2017, 69). A state is a local minimum of
//!
//! F = ½⟨(g + h) S (g + h)⟩ + ⟨φ(g)⟩ + p₀ ⟨g⟩ over g ≥ 0,
//!
//! with the stiffness S of the elastic body, Ŝ = E*|q|/2 for a periodic half-space. Either the
//! mean pressure p₀, negative under tension, or the mean gap ⟨g⟩ is prescribed ([`Target`]). Net
//! pressures are p = λ − (w/ρ) exp(−g/ρ): the wall presses with λ ≥ 0, only where g = 0, and all
//! nodes attract.
//!
//! # Paths
//!
//! The energy is not convex. For one load or mean gap, several minima may exist, and which one the
//! bodies take depends on the past. A state is therefore computed from the state before it, and an
//! [`AdhesivePath`] computes one after the other. Each state is reached by a descent along which
//! the energy never rises, in steps that are short beside ρ where attraction matters. Where a
//! state becomes unstable, the descent jumps to the next minimum. Steps of the path should be small
//! beside ρ. A state depends on the surface, the interaction, the target, the settings and the gaps
//! of the state before it, and on nothing else, to the last bit. A path can thus be
//! [resumed](AdhesivePath::resume) from stored gaps.
//!
//! # Method
//!
//! Projected conjugate gradients in the gaps of all nodes, in double precision (`descent`), with an
//! exact line search (`line_search`). They are preconditioned by the compliance of the free nodes
//! while the wall holds the others (`preconditioner`). An iteration takes two transform pairs. A
//! state of a rough surface takes 20 to 60 pairs, and up to 200 where contacts form or break.
//!
//! In gaps instead of pressures, the attraction is a function of the unknown at each node, and the
//! stiffness must be exact. For an isolated patch, it is exact on the doubled mesh, whose nodes
//! outside the map are unknowns without wall and attraction (`body`).
//!
//! The states of a symmetric surface are shaken and solved again, because a descent that keeps a
//! symmetry can end at a saddle point of the energy (`descent::shake`).
//!
//! # Limits
//!
//! The mesh must resolve the interaction. The error of the energy is 0.1 to 0.3 percent if
//! [`Adhesion::mesh_number`] is 0.3. From π/2 on, single nodes snap into contact on their own, and
//! hysteresis depends on the mesh.

use thiserror::Error;

use super::elasticity::ElasticOperator;
use super::fft::Scratch;
use super::grid::Boundary;
use super::reduced::ReducedHeights;
use super::solver::DEFAULT_TOLERANCE;
use super::threads::Threads;

mod body;
mod descent;
mod exponential;
mod line_search;
mod passes;
mod preconditioner;
mod state;

pub use state::AdhesiveState;

use body::Body;
use descent::{Control, Fields};

/// Interaction φ(g) = −w exp(−g/ρ) between the surfaces.
///
/// Lengths along the surface are in units of the longer side L of the cell. Heights and gaps are in
/// units of a L and pressures in units of a E*, with any number a; the [solver](crate::solver) uses
/// the rms slope, a = h′. The range is then in units of a L, and the work of adhesion in units of
/// a² E* L.
///
/// ```
/// use asperity_mechanics::adhesion::{Adhesion, AdhesionError};
///
/// let adhesion = Adhesion::new(0.002, 0.01)?;
/// assert_eq!(adhesion.largest_attraction(), 0.2);
/// // A mesh of 64 nodes per side is too coarse, and one of 128 is not.
/// assert!(adhesion.mesh_number(1.0 / 64.0) > 0.3);
/// assert!(adhesion.mesh_number(1.0 / 128.0) < 0.3);
/// assert!(Adhesion::new(-0.002, 0.01).is_err());
/// # Ok::<(), AdhesionError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adhesion {
    work: f64,
    range: f64,
}

/// Shortest and longest range of an interaction.
const RANGES: [f64; 2] = [1e-9, 1e9];

/// Largest work of adhesion.
const MOST_WORK: f64 = 1e9;

/// Error of an invalid interaction.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum AdhesionError {
    /// The work of adhesion is negative, too large or not a number.
    #[error("the work of adhesion is {0}; it must be between 0 and 1e9 in reduced units")]
    Work(f64),
    /// The range is not positive, or far from all lengths of a surface.
    #[error("the range of the attraction is {0}; it must be between 1e-9 and 1e9 in reduced units")]
    Range(f64),
}

impl Adhesion {
    /// Creates an interaction from the work of adhesion and the range, in the units above.
    ///
    /// Without work of adhesion, the contact is not adhesive.
    ///
    /// # Errors
    ///
    /// Fails if the work of adhesion is negative or above 1e9, or if the range is not between 1e-9
    /// and 1e9.
    pub fn new(work: f64, range: f64) -> Result<Self, AdhesionError> {
        if !(0.0..=MOST_WORK).contains(&work) {
            return Err(AdhesionError::Work(work));
        }
        if !(RANGES[0]..=RANGES[1]).contains(&range) {
            return Err(AdhesionError::Range(range));
        }
        Ok(Self { work, range })
    }

    /// Returns w/ρ, the largest attraction, which flat surfaces in contact have.
    pub fn largest_attraction(self) -> f64 {
        self.work / self.range
    }

    /// Returns Δx w/(E* ρ²) for a mesh step Δx in units of the longer side.
    ///
    /// It compares the curvature of the interaction with the stiffness of the finest waves of the
    /// mesh, π E*/(2 Δx). Above [`BISTABLE`], single nodes have two states.
    pub fn mesh_number(self, step: f64) -> f64 {
        step * self.work / (self.range * self.range)
    }
}

/// Mesh number Δx w/(E* ρ²) above which single nodes have two states.
///
/// A wave of the shortest wavelength 2Δx has the stiffness π E*/(2 Δx), and the attraction changes
/// by at most w/ρ² per length. Above this number the attraction changes faster than the elastic
/// pressure of the wave.
pub const BISTABLE: f64 = std::f64::consts::FRAC_PI_2;

/// Quantity that is prescribed for a state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// Mean gap over the map, positive, in the unit of heights (see [`Adhesion`]).
    MeanGap(f64),
    /// Mean pressure over the map, negative under tension, in the unit of pressures.
    Load(f64),
}

/// Stopping criteria of one state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest accepted [residual](AdhesiveState::residual).
    pub tolerance: f64,
    /// Maximum number of transform pairs for one state.
    pub pair_limit: u32,
    /// Accuracy of the load of pull-off, as a fraction of the largest attraction w/ρ.
    pub pull_off_tolerance: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: 1e-9, pair_limit: 20_000, pull_off_tolerance: 1e-4 }
    }
}

impl Settings {
    /// Default settings of studies and of `asperity-contact`.
    pub const OF_STUDIES: Self =
        Self { tolerance: DEFAULT_TOLERANCE, pair_limit: 20_000, pull_off_tolerance: 1e-5 };
}

/// Reason why the computation of a state ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stop {
    /// The residual is within the tolerance.
    Converged,
    /// The pair limit was reached.
    PairLimit,
    /// The state no longer moves, although its residual exceeds the tolerance: rounding prevents
    /// further progress.
    Stalled,
    /// The state is in balance, but its mean gap is not the prescribed one: an isolated patch jumps
    /// past it.
    GapNotReached,
    /// The caller stopped the computation.
    Interrupted,
    /// No state in contact bears the load: the bodies are apart.
    #[default]
    PulledOff,
}

/// Path of states of one adhesive contact, each of which starts from the state before it.
///
/// A path begins with the bodies apart, and a path whose bodies have been pulled off is like a new
/// one.
///
/// ```
/// use asperity_mechanics::adhesion::{Adhesion, AdhesivePath, Settings, Stop, Target};
/// use asperity_mechanics::elasticity::PeriodicHalfSpace;
/// use asperity_mechanics::grid::Grid;
/// use asperity_mechanics::reduced::ReducedHeights;
/// use asperity_mechanics::threads::Threads;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// let grid = Grid::square(64, 1.0)?;
/// let wave = Shape::Wave { amplitude: 0.1, waves: 1 }.draw(grid);
/// let adhesion = Adhesion::new(0.01, 0.05)?;
/// let body = PeriodicHalfSpace::new(grid);
/// let heights = ReducedHeights::reduced(grid, wave.into_heights())?;
/// let mut path = AdhesivePath::new(Threads::one(), &body, adhesion, &heights);
/// for gap in [0.12, 0.10, 0.08] {
///     let state = path.step(Target::MeanGap(gap), &Settings::default(), &|| false);
///     assert_eq!(state.stop, Stop::Converged);
///     assert!((state.mean_gap - gap).abs() < 1e-12);
///     let gaps = path.gap().expect("the bodies are not apart");
///     assert_eq!(state.contact_nodes, gaps.iter().filter(|gap| **gap == 0.0).count());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct AdhesivePath {
    threads: Threads,
    body: Body,
    adhesion: Adhesion,
    scratch: Scratch<f64>,
    fields: Fields,
    /// Quantity that the present descent keeps.
    control: Control,
    /// Number of transform pairs of the present state.
    pairs: u32,
    /// True before the first state, and after pull-off.
    is_apart: bool,
    /// Gaps and pressures of the last state, on the map.
    gap: Vec<f64>,
    pressure: Vec<f64>,
}

impl AdhesivePath {
    /// Mean number of transform pairs of a state, for forecasts.
    pub const PAIRS_PER_STATE: f64 = 70.0;

    /// Returns the memory of a path in bytes per node of the map.
    ///
    /// For a free boundary, the mesh has four times the nodes of the map.
    pub fn bytes_per_node(boundary: Boundary) -> f64 {
        match boundary {
            Boundary::Periodic => 135.0,
            Boundary::Free => 500.0,
        }
    }

    /// Begins a path of a rough surface, with the bodies apart.
    ///
    /// `heights` are on the operator's grid, in the units of [`Adhesion`] with a = h′. Their mean
    /// does not matter.
    ///
    /// # Panics
    ///
    /// Panics if the number of heights differs from the number of nodes of the operator.
    pub fn new(
        threads: Threads,
        operator: &dyn ElasticOperator,
        adhesion: Adhesion,
        heights: &ReducedHeights,
    ) -> Self {
        let nodes = operator.grid().count();
        assert_eq!(heights.grid().count(), nodes, "one height per node");
        let body = Body::new(&threads, operator, heights.as_slice());
        Self {
            scratch: body.scratch(threads.clone()),
            fields: Fields::new(body.domain),
            control: Control::MeanGap,
            pairs: 0,
            is_apart: true,
            gap: vec![0.0; nodes],
            pressure: vec![0.0; nodes],
            threads,
            body,
            adhesion,
        }
    }

    /// Sets the threads that share the work. States do not depend on their number, not even in the
    /// last bit.
    pub fn set_threads(&mut self, threads: Threads) {
        self.scratch.set_threads(threads.clone());
        self.threads = threads;
    }

    /// Continues the path from the stored [`gap`](Self::gap) of a state: the next state has the
    /// same bytes as if this path had computed the stored one.
    ///
    /// # Panics
    ///
    /// Panics if the number of gaps differs from the number of nodes.
    pub fn resume(&mut self, gap: Option<Vec<f64>>) {
        self.is_apart = gap.is_none();
        self.pressure.fill(0.0);
        if let Some(gap) = gap {
            assert_eq!(gap.len(), self.gap.len(), "one gap per node");
            self.gap = gap;
        }
    }

    /// Returns the gaps of the last state, which are exactly zero in contact, or `None` while the
    /// bodies are apart.
    pub fn gap(&self) -> Option<&[f64]> {
        (!self.is_apart).then_some(&self.gap)
    }

    /// Returns the net pressures of the state that [`step`](Self::step) has computed. They are
    /// negative where the surfaces attract each other more than the wall presses.
    ///
    /// Outside contact the pressure is exactly −(w/ρ) exp(−g/ρ). While the bodies are apart, all
    /// pressures are zero.
    pub fn pressure(&self) -> &[f64] {
        &self.pressure
    }
}

#[cfg(test)]
mod tests;
